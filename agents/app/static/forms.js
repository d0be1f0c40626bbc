// A new camera's fields are shown only where a new camera is chosen.

for (const choice of document.querySelectorAll("select[data-camera]")) {
  const fields = choice.form.querySelectorAll("[data-new-camera]");
  const show = () => {
    for (const field of fields) {
      field.hidden = choice.value !== "new";
      for (const input of field.querySelectorAll("input")) input.required = !field.hidden;
    }
  };
  choice.addEventListener("change", show);
  show();
}

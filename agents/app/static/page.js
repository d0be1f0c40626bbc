// On every page: the current screen is in view, forms lose nothing, and films go on being sent.

import "./forms.js";
import { sendFilms } from "./films.js";

document.querySelector("nav [aria-current]")?.scrollIntoView({ inline: "center", block: "nearest" });
document.getElementById("sessions")?.addEventListener("change", (event) => { location.href = event.target.value; });
if (document.body.classList.contains("reads")) {
  for (const form of document.querySelectorAll("form[method=post]")) for (const field of form.elements) field.disabled = true;
} else sendFilms();

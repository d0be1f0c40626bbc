// Targets and positions that the club keeps by a name: saved, opened, forgotten, and sent as a picture.

import { ask, element } from "./ask.js";
import { pictureOf } from "./picture.js";
import { $, direction, say, sheet, state } from "./throw_board.js";
import { written } from "./throw_address.js";

let kept = JSON.parse($("kept").textContent);
const OPEN = {
  // A target is as a thrower to the end that is played to sees it.
  targets: ({ x, y }) => sheet.send("target", { x: direction() * x, y: direction() * y }),
  positions: ({ address }) => { location.hash = address; },
};

/** List what is saved. */
export function listKept() {
  for (const [kind, open] of Object.entries(OPEN)) {
    const list = $(`kept-${kind}`);
    list.replaceChildren(...kept[kind].map((one) => {
      const take = element("button", { type: "button", class: "plain" }, one.name);
      take.addEventListener("click", () => open(one));
      const forget = element("button", { type: "button", class: "plain", "aria-label": `Forget ${one.name}`, title: `Forget ${one.name}` }, "×");
      forget.addEventListener("click", () => change(`throw/${kind}/${one.id}/forget`, {}));
      return element("li", {}, take, forget);
    }));
    list.hidden = kept[kind].length === 0;
  }
}

async function change(path, json) {
  try {
    kept = await ask(path, { method: "POST", json });
    listKept();
    return true;
  } catch (error) {
    say(error.message, true);
    return false;
  }
}

$("keep-target").addEventListener("submit", async (event) => {
  event.preventDefault();
  if (!state.target) { say("Click a target first.", true); return; }
  const { x, y } = state.target, name = $("target-name").value;
  if (await change("throw/targets", { name, place: { x, y } })) {
    say(`Saved. A call may say “draw ${name.trim()}”.`);
    $("target-name").value = "";
  }
});
$("keep-position").addEventListener("submit", async (event) => {
  event.preventDefault();
  if (await change("throw/positions", { name: $("position-name").value, address: written(state) })) say("Saved; it opens from this list on every device.");
});

/** Send the picture by what the device offers, or save it as a file. */
$("send-picture").addEventListener("click", async () => {
  const name = $("position-name").value.trim() || "Position";
  const file = new File([await pictureOf($("sheet"), `${name}. ${$("turn").textContent}`)], `${name}.png`, { type: "image/png" });
  if (navigator.canShare?.({ files: [file] })) {
    await navigator.share({ files: [file], title: name }).catch(() => {});
    return;
  }
  const link = element("a", { href: URL.createObjectURL(file), download: file.name });
  link.click();
  say(`Saved as ${file.name}.`);
});

// Targets that the club keeps by a name: chosen, added and forgotten.

import { ask, element } from "./ask.js";
import { $, direction, say, sheet, state } from "./throw_board.js";

let targets = JSON.parse($("targets").textContent);

/** List the kept targets; each is as a thrower to the end that is played to sees it. */
export function listTargets() {
  $("kept-targets").replaceChildren(...targets.map((one) => {
    const take = element("button", { type: "button", class: "plain" }, one.name);
    take.addEventListener("click", () => sheet.send("target", { x: direction() * one.x, y: direction() * one.y }));
    const forget = element("button", { type: "button", class: "plain", "aria-label": `Forget ${one.name}`, title: `Forget ${one.name}` }, "×");
    forget.addEventListener("click", () => change(`throw/targets/${one.id}/forget`, {}));
    return element("li", {}, take, forget);
  }));
  $("kept-targets").hidden = targets.length === 0;
}

async function change(path, json) {
  try {
    targets = (await ask(path, { method: "POST", json })).targets;
    listTargets();
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

// Throws: the house with all rests, and entries in the list, with calls read as they are typed.

import { ask, element } from "./ask.js";
import { drawHouse, restAt } from "./house.js";
import { TEE } from "./sheet.js";
import { typed } from "./units.js";

const find = (id) => document.getElementById(id);
const rests = JSON.parse(find("rests").textContent);
const sheet = drawHouse(find("house"), rests);
let active = null; // the call that a tap on the house fills in

find("athlete").addEventListener("change", (event) => event.target.form.submit());
const athletes = [...new Map(rests.map((one) => [one.athlete, one.colour]))].filter(([name]) => name);
find("legend").replaceChildren(...athletes.map(([name, colour]) =>
  element("span", {}, element("i", { class: `c${colour}` }), name)));

// A row is opened by a tap anywhere on it that is no field.
document.querySelector("table.throws").addEventListener("click", (event) => {
  if (event.target.closest("input, select, a, button, label")) return;
  event.target.closest("tr")?.querySelector("a.open")?.click();
});

// --- calls ---------------------------------------------------------------------------------------

const reading = (input) => input.form.querySelector(".reading") ?? input.form.appendChild(element("p", { class: "reading small" }));
let asked = 0;

/** Say how a call is read, and show where it is to rest. */
async function read(input) {
  const mine = ++asked;
  await new Promise((done) => setTimeout(done, 150));
  if (mine !== asked) return;
  const found = await ask(`throws/read?text=${encodeURIComponent(input.value)}`).catch(() => null);
  if (mine !== asked || !found) return;
  const words = found.words || (found.problem ? `${found.problem}; kept as a remark.` : "");
  reading(input).textContent = words;
  // Beside the house, too: on a phone the keyboard may cover the field.
  if (active === input) find("tap").textContent = words || `Tap the house where throw ${input.closest("tr").dataset.throw} should rest.`;
  reading(input).classList.toggle("warn", Boolean(found.problem));
  sheet.aim(found.target ? { x: found.target[0], y: TEE + found.target[1] } : null);
}

for (const input of document.querySelectorAll("input[name=called]")) {
  input.addEventListener("focus", () => {
    active = input;
    document.querySelector(".house").classList.add("placing"); // in sight, however far down the list
    for (const row of document.querySelectorAll("tr[aria-current]")) row.removeAttribute("aria-current");
    input.closest("tr").setAttribute("aria-current", "true");
    find("tap").textContent = `Tap the house where throw ${input.closest("tr").dataset.throw} should rest.`;
    read(input);
  });
  input.addEventListener("input", () => read(input));
}

const PLACE = /-?\d+(\.\d+)?\s*(ft|m)?\s*,\s*-?\d+(\.\d+)?\s*(ft\b|m\b)?|\b(button|tee|pin|(top|back|left|right) (four|eight|twelve))\b/i;
sheet.addEventListener("target", ({ detail }) => {
  const there = restAt(rests, detail);
  if (!active) {
    if (there) document.querySelector(`tr[data-throw="${there.number}"] a.open`)?.click();
    return;
  }
  const place = `${typed(detail.x)},${typed(detail.y - TEE)}`;
  active.value = PLACE.test(active.value) ? active.value.replace(PLACE, place) : `${active.value.trim() || "draw"} ${place}`;
  active.dispatchEvent(new Event("input", { bubbles: true }));
  active.dispatchEvent(new Event("change", { bubbles: true }));
});
document.addEventListener("focusin", ({ target }) => {
  if (!target.matches("input, select, textarea, a") || target.name === "called" || target.closest(".house")) return;
  active = null;
  document.querySelector(".house").classList.remove("placing");
});

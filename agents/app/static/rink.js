// At the rink: the throw of this moment in large numbers, spoken by the browser's own voice.

import { element } from "./ask.js";
import { refresh } from "./forms.js";
import { listen } from "./jobs.js";

const find = (id) => document.getElementById(id);
const { session } = find("rink").dataset;
const ALOUD = "say throws aloud";
const spoken = new Set(); // numbers of the throw that is shown, as they were spoken

find("aloud").checked = localStorage.getItem(ALOUD) === "yes";
find("aloud").addEventListener("change", ({ target }) => {
  localStorage.setItem(ALOUD, target.checked ? "yes" : "no");
  speak(target.checked ? "Throws are spoken." : ""); // a voice begins with a tap
});
find("full").addEventListener("click", () => document.querySelector(".now").requestFullscreen?.());

function speak(words) {
  if (!words || !find("aloud").checked || !window.speechSynthesis) return;
  const spoken = words.replace(/(\d) s\b/g, "$1 seconds").replace(/(\d) cm\b/g, "$1 centimetres").replace(/(\d) m\b/g, "$1 metres")
    .replace(/(\d) ft\b/g, "$1 feet").replace(/(\d) in\b/g, "$1 inches");
  speechSynthesis.speak(Object.assign(new SpeechSynthesisUtterance(spoken), { lang: "en" }));
}

const isTime = ({ name }) => name === "Split" || name === "Hog to hog";

function show(state) {
  const { live, latest: [last], next } = state, now = live ?? last;
  const whose = next.athlete || next.called ? `Next: ${[next.athlete, next.called].filter(Boolean).join(", ")}` : "";
  find("next").textContent = whose;
  if (!now) return;
  find("who").textContent = [live ? "Now" : `Throw ${last.number}`, now.athlete].filter(Boolean).join(" · ");
  find("called").textContent = now.called;
  find("how").textContent = live ? (live.rests ? "first numbers; the film is measured next" : "the stone is running") : "";
  // Numbers of a running stone are those of lines that it has passed.
  const ready = now.numbers.filter((one) => isTime(one) || !live || live.rests);
  find("numbers").replaceChildren(...ready.map((one) => element("div", { class: isTime(one) ? "" : "words" },
    element("dt", {}, one.name), element("dd", {}, one.value), element("dd", { class: "sigma" }, one.sigma))));
  return ready;
}

/** Speak what is new: a split as soon as it is known, the rest when the stone has stopped. */
function tell(before, state) {
  const ready = show(state) ?? [];
  if (state.live && !before.live) spoken.clear();
  const isNew = state.live || (state.count > before.count && !before.live);
  if (!isNew) return;
  const words = ready.filter(({ name }) => !spoken.has(name));
  words.forEach(({ name }) => spoken.add(name));
  speak(words.map(({ name, value }) => `${name}: ${value.replace("\n", ", ")}.`).join(" "));
  if (!state.live) spoken.clear();
}

let known = JSON.parse(find("state").textContent);
show(known);
listen(`practice/${session}/events`, (state) => {
  const before = known;
  known = state;
  tell(before, state);
  if (state.count !== before.count || state.camera?.marked !== before.camera?.marked) refresh();
});
// An entry counts on the leaderboard at once.
document.addEventListener("saved", () => refresh(), true);
// The screen stays on beside the ice.
const stayOn = () => navigator.wakeLock?.request("screen").catch(() => {});
document.addEventListener("visibilitychange", stayOn);
stayOn();

// Practice: films that are dropped, and how far everything is.

import { ask, at, element, meta } from "./ask.js";
import { changes, queued, queueFilms, refusals, setRefusals } from "./films.js";
import { refresh } from "./forms.js";
import { jobLine, listen } from "./jobs.js";

const { session } = document.getElementById("practice").dataset;
const PATIENCE = 2000; // between two tries while the app does not answer [ms]
const find = (id) => document.getElementById(id);

// --- films that are sent ---------------------------------------------------------------------

function complain(text) {
  find("problem").textContent = text;
  find("problem").hidden = !text;
}

const drop = find("drop");
function takeChosen() {
  queueFilms(session, [...find("files").files]);
  find("files").value = "";
}
find("files").addEventListener("change", takeChosen);
if (find("files").files.length) takeChosen(); // chosen before this script was there
for (const name of ["dragenter", "dragover"]) {
  drop.addEventListener(name, (event) => {
    event.preventDefault();
    drop.classList.add("over");
  });
}
drop.addEventListener("dragleave", () => drop.classList.remove("over"));
drop.addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over");
  queueFilms(session, [...event.dataTransfer.files]);
});
// A film that misses the place is not opened by the browser instead of this page.
for (const name of ["dragover", "drop"]) window.addEventListener(name, (event) => event.preventDefault());

function showRefused() {
  find("refused").replaceChildren(...refusals(session).map(({ name, why }, k) => {
    const away = element("button", { type: "button", class: "plain light", "aria-label": `Hide ${name}` }, "OK");
    away.addEventListener("click", () => setRefusals(session, refusals(session).filter((_, n) => n !== k)));
    return element("li", { class: "problem" }, `${name}: ${why} `, away);
  }));
}
changes.addEventListener("change", () => { showRefused(); show(latest); });

// --- how far everything is -------------------------------------------------------------------

const STATES = {
  waiting: "waiting",
  running: "being tracked",
  again: "tracked with other marks; will be tracked again",
  failed: "not tracked",
  cancelled: "cancelled",
};

const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

function filmLine(film) {
  const share = film.received / film.size;
  const state = film.state === "coming"
    ? `${Math.floor(100 * share)} % sent`
    : film.state === "done" ? plural(film.throws, "throw") : STATES[film.state];
  const line = element("li", { "data-state": film.state },
    ...(film.state === "coming" ? [] : [element("img", { class: "still", src: at(`throws/films/${film.id}/still`), alt: "", loading: "lazy" })]),
    element("span", { class: "name" }, film.name), " ",
    element("span", { class: film.state === "failed" ? "bad" : "quiet" }, state));
  if (film.state === "coming") {
    line.append(element("progress", { max: 1, value: share, "aria-label": `${film.name} sent` }));
    if (!queued.some((one) => one.session === session && one.name === film.name && one.size === film.size)) {
      line.append(element("p", { class: "small warn" }, "Drop it here again to send the rest, if no other device is sending it."));
    }
  }
  if (film.remark) line.append(element("p", { class: "small quiet" }, film.remark));
  if (film.state === "failed") {
    const again = element("button", { type: "button", class: "plain" }, "Try again");
    again.addEventListener("click", () =>
      ask(`practice/films/${film.id}/again`, { method: "POST" }).catch((e) => complain(e.message)));
    line.append(again);
  }
  if (film.mark) {
    line.append(element("a", { href: at(`practice/${session}/films/${film.id}/mark/${meta("csrf")}/`), target: "_blank", class: "small" },
      "Was the camera moved? Mark the sheet from this film on"));
  }
  const away = element("button", { type: "button", class: "plain light", "aria-label": `Remove ${film.name}` }, "Remove");
  away.addEventListener("click", () => removeFilm(film));
  line.append(away);
  return line;
}

async function removeFilm(film) {
  const throws = film.throws ? ` and its ${plural(film.throws, "throw")}` : "";
  if (!confirm(`Remove ${film.name}${throws}? It can be brought back below.`)) return;
  const fields = { kind: "film", id: film.id, session, csrf: meta("csrf") };
  await ask("practice/remove", { method: "POST", body: new URLSearchParams(fields) }).catch((error) => complain(error.message));
}

const throwLine = (one) => element("li", {}, element("a", { href: at(`throws/${session}/${one.number}`) }, `${one.number}: ${one.words}`));

let latest = JSON.parse(find("state").textContent);
const partsOf = (state) => JSON.stringify([state.removed, state.camera, state.films.some((film) => film.state !== "coming")]);
let parts = partsOf(latest), refreshing = false;

function show(state) {
  latest = state;
  find("films").replaceChildren(...state.films.map(filmLine));
  find("jobs").replaceChildren(...state.jobs.map((job) => jobLine(job, complain)));
  find("nothing").hidden = state.jobs.length > 0;
  find("count").textContent = state.count ? `${plural(state.count, "throw")} in all.` : "No throws yet.";
  find("latest").replaceChildren(...state.latest.map(throwLine));
  // Marks, and what was removed, change other parts of this page.
  const now = partsOf(state);
  if (now !== parts && !refreshing) {
    refreshing = true;
    refresh().then((done) => {
      refreshing = false;
      if (done) parts = now;
      else setTimeout(() => show(latest), PATIENCE);
    });
  }
}

show(latest);
showRefused();
listen(`practice/${session}/events`, show);

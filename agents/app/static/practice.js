// Practice: sends films piece by piece, and shows how far everything is.

import { ask, at, element, meta } from "./ask.js";
import { jobLine, listen } from "./jobs.js";

const session = document.getElementById("practice").dataset.session;
const PIECE = 4 * 1024 * 1024;
const PATIENCE = 2000; // between two tries while the app does not answer [ms]
const find = (id) => document.getElementById(id);
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

// --- films that are sent ---------------------------------------------------------------------

const queue = [];
let sending = false;

/** Ask until the app answers: it may have been started anew, and goes on where it was. */
async function persistently(work) {
  for (;;) {
    try {
      return await work();
    } catch (error) {
      if (!error.away) throw error;
      complain(`${error.message} The film goes on by itself.`);
      await sleep(PATIENCE);
    }
  }
}

async function send(file) {
  const about = { name: file.name, size: file.size };
  const path = `practice/${session}/films`;
  const begun = await persistently(() => ask(path, { method: "POST", json: about }));
  let { received } = begun;
  while (received < file.size) {
    const body = file.slice(received, received + PIECE);
    try {
      const answer = await persistently(() =>
        ask(`practice/films/${begun.film}?begin=${received}`, { method: "PUT", body }));
      ({ received } = answer);
    } catch (error) {
      if (error.status !== 422) throw error;
      // The app has another idea of how much has come: it says how much.
      const now = await persistently(() => ask(path, { method: "POST", json: about }));
      if (now.received === received) throw error;
      ({ received } = now);
    }
    complain("");
  }
}

async function sendAll() {
  if (sending) return;
  sending = true;
  while (queue.length) {
    const file = queue.shift();
    try {
      await send(file);
    } catch (error) {
      complain(`${file.name}: ${error.message}`);
    }
  }
  sending = false;
}

function complain(text) {
  find("sending").textContent = text;
  find("sending").hidden = !text;
}

function take(files) {
  complain("");
  queue.push(...files);
  sendAll();
}

const drop = find("drop");
function takeChosen() {
  take([...find("files").files]);
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
  take([...event.dataTransfer.files]);
});
// A film that misses the place is not opened by the browser instead of this page.
for (const name of ["dragover", "drop"]) {
  window.addEventListener(name, (event) => event.preventDefault());
}
window.addEventListener("beforeunload", (event) => {
  if (sending) event.preventDefault();
});

// --- how far everything is -------------------------------------------------------------------

const STATES = {
  coming: "is being sent",
  waiting: "waits",
  running: "is being tracked",
  done: "tracked",
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
    element("span", { class: "name" }, film.name), " ",
    element("span", { class: film.state === "failed" ? "bad" : "quiet" }, state));
  if (film.state === "coming") {
    line.append(element("progress", { max: 1, value: share, "aria-label": `${film.name} sent` }));
    if (!sending) {
      line.append(element("p", { class: "small warn" }, "Drop it here again to send the rest."));
    }
  }
  if (film.said) line.append(element("p", { class: "small quiet" }, film.said));
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
  try {
    await ask("practice/remove", { method: "POST", body: new URLSearchParams(fields) });
    location.reload();
  } catch (error) {
    complain(error.message);
  }
}

function throwLine(one) {
  const words = `${one.number}: ${one.words}`;
  return element("li", {}, one.id === null
    ? words
    : element("a", { href: at(`throws/${session}/${one.id}`) }, words));
}

function show(state) {
  find("films").replaceChildren(...state.films.map(filmLine));
  find("jobs").replaceChildren(...state.jobs.map((job) => jobLine(job, complain)));
  find("nothing").hidden = state.jobs.length > 0;
  find("count").textContent = state.count
    ? `${plural(state.count, "throw")} in all.` : "Nobody has thrown yet.";
  find("latest").replaceChildren(...state.latest.map(throwLine));
  const marked = find("marked");
  const now = state.camera?.marked ? "the sheet is marked." : "the sheet is not marked yet.";
  if (marked && state.camera) marked.textContent = now;
  if (marked && state.films.some((film) => film.state !== "coming")) {
    find("to-mark").hidden = false;
    find("no-film").hidden = true;
  }
}

listen(`practice/${session}/events`, show);

// Forms that lose nothing: what is typed stays in this browser until the app has it, and no page is left by saving.

import { ask, at, element, meta } from "./ask.js";

const DRAFT = `draft ${meta("root")}`, AGAIN = 3000; // until an entry is sent again [ms]
const entries = new Map();

const drafts = {
  of: (path) => JSON.parse(localStorage.getItem(DRAFT + path) ?? "null"),
  keep: (path, draft) => (draft ? localStorage.setItem(DRAFT + path, JSON.stringify(draft)) : localStorage.removeItem(DRAFT + path)),
  paths: () => Object.keys(localStorage).filter((key) => key.startsWith(DRAFT)).map((key) => key.slice(DRAFT.length)),
};

const post = (path, { fields, was }) => ask(path, { method: "POST", keepalive: true,
  body: new URLSearchParams({ ...fields, was: JSON.stringify(was) }) });

/** Say something below a form, with buttons {words: act}. */
function tell(form, words, bad = false, buttons = {}) {
  const line = form.querySelector(".reply") ?? form.appendChild(element("p", { class: "reply small", role: "status" }));
  line.classList.toggle("problem", bad);
  line.replaceChildren(words, ...Object.entries(buttons).map(([name, act]) => {
    const button = element("button", { type: "button", class: "plain light" }, name);
    button.addEventListener("click", act);
    return button;
  }));
}

// --- entries: saved field by field ---------------------------------------------------------------

/** A coach's entry of one throw. Only what changed is sent, with what it was before. */
class Entry {
  constructor(form) {
    this.form = form;
    this.path = form.dataset.entry;
    this.was = JSON.parse(form.dataset.was);
    const draft = drafts.of(this.path);
    if (draft) {
      this.put(draft.fields);
      Object.assign(this.was, draft.was);
      this.save();
    }
  }

  get changed() {
    const now = Object.fromEntries(new FormData(this.form));
    return Object.fromEntries(Object.entries(now).filter(([name, value]) => name in this.was && value.trim() !== this.was[name]));
  }

  put(fields) {
    for (const [name, value] of Object.entries(fields)) if (this.form.elements[name]) this.form.elements[name].value = value;
  }

  keep() {
    const fields = this.changed, names = Object.keys(fields);
    const was = Object.fromEntries(names.map((name) => [name, this.was[name]]));
    drafts.keep(this.path, names.length ? { fields, was } : null);
    return names.length ? { fields, was } : null;
  }

  async save() {
    const draft = this.keep();
    if (!draft || this.busy) return;
    this.busy = true;
    clearTimeout(this.later);
    try {
      const answer = await post(this.path, draft);
      // What was not touched here may be another coach's: it is shown; what is typed just now stays.
      const typed = this.changed;
      this.was = answer.now;
      this.put(Object.fromEntries(Object.entries(answer.now).filter(([name]) => !(name in typed) || typed[name] === draft.fields[name])));
      this.keep();
      tell(this.form, "Saved.");
      this.form.dispatchEvent(new CustomEvent("saved", { detail: answer }));
    } catch (error) {
      this.failed(error, draft);
    } finally {
      this.busy = false;
    }
    if (!this.stopped && !this.later && this.keep()) this.save();
  }

  failed(error, draft) {
    if (error.away) {
      tell(this.form, "The app does not answer. This is kept in this browser, and saved as soon as it does.", true);
      this.later = setTimeout(() => { this.later = null; this.save(); }, AGAIN);
    } else if (error.status === 409) {
      this.stopped = true;
      const { now } = error.document;
      const go = () => { this.stopped = false; this.was = now; this.keep(); tell(this.form, ""); this.save(); };
      tell(this.form, `${error.message}. `, true, {
        "Keep mine": () => { this.put(draft.fields); go(); },
        "Take theirs": () => { this.put(now); go(); },
      });
    } else {
      this.stopped = true;
      tell(this.form, `Not saved: ${error.message}`, true);
    }
  }
}

document.addEventListener("input", ({ target }) => {
  const entry = entries.get(target.form);
  if (entry) { entry.stopped = false; entry.keep(); }
  else if (target.form?.dataset.draft) drafts.keep(target.form.dataset.draft, Object.fromEntries(new FormData(target.form)));
});
document.addEventListener("change", ({ target }) => {
  const entry = entries.get(target.form);
  if (entry && target.name === "athlete") { // whoever is known brings their hand along
    const known = [...document.querySelectorAll("#athletes option")].find((option) => option.value === target.value);
    if (known && target.form.elements.hand) target.form.elements.hand.value = known.dataset.hand;
  }
  entry?.save();
});

/** Send what was typed on pages that are no longer open. */
async function sendRest() {
  const open = new Set([...entries.values()].map((entry) => entry.path));
  for (const path of drafts.paths().filter((one) => one.startsWith("throws/") && !open.has(one))) {
    const draft = drafts.of(path);
    try {
      if (draft) await post(path, draft);
      drafts.keep(path, null);
    } catch (error) {
      if (error.away) { setTimeout(sendRest, AGAIN); return; }
      const link = element("a", { href: at(path) }, `throw ${path.split("/")[2]}`);
      const line = element("p", { class: "problem", role: "alert" }, "An entry of ", link, ` was not saved: ${error.message}. `);
      const leave = element("button", { type: "button", class: "plain light" }, "Discard it");
      leave.addEventListener("click", () => { drafts.keep(path, null); line.remove(); });
      line.append(leave);
      document.getElementById("main").prepend(line);
    }
  }
}

// --- other forms: sent without leaving the page ---------------------------------------------------

/** Take over the parts of a page that may have changed; what is typed and sent elsewhere stays. */
function takeOver(page) {
  for (const part of page.querySelectorAll("[data-part]")) {
    const old = document.getElementById(part.id);
    if (!old) document.getElementById("main").append(part);
    else if (!old.contains(document.activeElement) || document.activeElement.type === "submit") old.replaceWith(part);
  }
  prepare();
}

/** The page that an answer holds. */
export const parsed = async (response) => new DOMParser().parseFromString(await response.text(), "text/html");

/** Bring the parts of this page up to date; false while the app does not answer. */
export async function refresh() {
  try {
    const response = await fetch(location.href, { headers: { Accept: "text/html" } });
    if (response.ok) takeOver(await parsed(response));
    return response.ok;
  } catch {
    return false;
  }
}

document.addEventListener("submit", async (event) => {
  const form = event.target, { submitter } = event;
  if (form.method !== "post") return;
  event.preventDefault();
  const entry = entries.get(form);
  if (entry) { entry.stopped = false; entry.save(); return; }
  let response;
  try {
    const body = new URLSearchParams(new FormData(form, submitter));
    response = await fetch(form.action, { method: "POST", body, headers: { Accept: "text/html" } });
  } catch {
    tell(form, "The app does not answer. What you typed is kept here; try again.", true);
    return;
  }
  const page = await parsed(response);
  if (!response.ok) { tell(form, page.querySelector(".problem")?.textContent ?? `The app answered with ${response.status}.`, true); return; }
  if (form.dataset.draft) drafts.keep(form.dataset.draft, null);
  if (form.dataset.reload) { location.reload(); return; }
  if (new URL(response.url).pathname !== location.pathname) { location.href = response.url; return; }
  takeOver(page);
  if (!form.isConnected) return;
  if (form.dataset.draft) form.reset();
  tell(form, "Done.");
});

/** Entries, drafts, and fields that are shown only where a new camera is chosen. */
function prepare() {
  for (const form of document.querySelectorAll("form[data-entry]")) if (!entries.has(form)) entries.set(form, new Entry(form));
  for (const form of document.querySelectorAll("form[data-draft]")) {
    const draft = drafts.of(form.dataset.draft);
    for (const [name, value] of Object.entries(draft ?? {})) if (name !== "csrf" && form.elements[name]) form.elements[name].value = value;
  }
  for (const choice of document.querySelectorAll("select[data-camera]")) {
    const show = () => {
      for (const field of choice.form.querySelectorAll("[data-new-camera]")) {
        field.hidden = choice.value !== "new";
        for (const input of field.querySelectorAll("input")) input.required = !field.hidden;
      }
    };
    choice.addEventListener("change", show);
    show();
  }
}

prepare();
sendRest();

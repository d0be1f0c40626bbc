// Films on their way to the app: kept in this browser until all of each has arrived, whichever page is open.

import { ask, element, meta } from "./ask.js";

const PIECE = 4 * 1024 * 1024, PATIENCE = 2000; // between two tries while the app does not answer [ms]
const root = meta("root"), REFUSED = `refused ${root}`;
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
const inMemory = []; // films that this browser could not keep
let keeping = 0, current = null, wake = () => {};
/** Films that wait or are being sent: {session, name, size}. */
export let queued = [];
/** Tells of changes by the event "change". */
export const changes = new EventTarget();

const opened = new Promise((done, failed) => {
  const request = indexedDB.open("curling films", 1);
  request.onupgradeneeded = () => request.result.createObjectStore("films", { autoIncrement: true });
  request.onsuccess = () => done(request.result);
  request.onerror = () => failed(request.error);
});
opened.catch(() => {}); // a browser that keeps nothing: films are in memory only

async function stored(mode, act) {
  const transaction = (await opened).transaction("films", mode), request = act(transaction.objectStore("films"));
  return new Promise((done, failed) => {
    transaction.oncomplete = () => done(request.result);
    transaction.onabort = transaction.onerror = () => failed(transaction.error);
  });
}

/** All films of this club that wait, the first first. */
async function waiting() {
  let kept = [];
  try {
    const keys = await stored("readonly", (store) => store.getAllKeys()), items = await stored("readonly", (store) => store.getAll());
    kept = items.map((item, k) => ({ ...item, key: keys[k] })).filter((item) => item.root === root);
  } catch { /* nothing is kept */ }
  const all = [...kept, ...inMemory];
  queued = all.map(({ session, file }) => ({ session, name: file.name, size: file.size }));
  return all;
}

/** Put films into the queue of a session. */
export async function queueFilms(session, files) {
  for (const file of files) {
    keeping += 1;
    try {
      await stored("readwrite", (store) => store.add({ root, session, file }));
    } catch {
      inMemory.push({ session, file });
    }
    keeping -= 1;
    await waiting();
    wake();
    changed();
  }
}

// --- refusals -----------------------------------------------------------------------------------

/** Films of a session that the app refused: [{name, why}]. */
export const refusals = (session) => (JSON.parse(localStorage.getItem(REFUSED) ?? "{}"))[session] ?? [];

export function setRefusals(session, list) {
  const all = JSON.parse(localStorage.getItem(REFUSED) ?? "{}");
  localStorage.setItem(REFUSED, JSON.stringify({ ...all, [session]: list }));
  changed();
}

// --- sending ------------------------------------------------------------------------------------

/** Ask until the app answers: it may have been restarted, and continues where it was. */
async function persistently(work) {
  for (;;) {
    try {
      return await work();
    } catch (error) {
      if (!error.away) throw error;
      current.problem = `${error.message} Sending continues as soon as it does.`;
      changed();
      await sleep(PATIENCE);
    }
  }
}

async function send({ session, file }) {
  const about = { name: file.name, size: file.size }, path = `practice/${session}/films`;
  const begun = await persistently(() => ask(path, { method: "POST", json: about }));
  let { received } = begun;
  while (received < file.size) {
    Object.assign(current, { share: received / file.size, problem: "" });
    changed();
    const body = file.slice(received, received + PIECE);
    try {
      ({ received } = await persistently(() => ask(`practice/films/${begun.film}?begin=${received}`, { method: "PUT", body })));
    } catch (error) {
      if (error.status !== 422) throw error;
      // The app has another idea of how much has come: it says how much.
      const now = await persistently(() => ask(path, { method: "POST", json: about }));
      if (now.received === received) throw error;
      ({ received } = now);
    }
  }
}

async function sendAll() {
  for (;;) {
    const [film] = await waiting();
    if (!film) {
      await Promise.race([new Promise((done) => { wake = done; }), sleep(PATIENCE)]);
      continue;
    }
    current = { name: film.file.name, share: 0, problem: "" };
    changed();
    try {
      await send(film);
    } catch (error) {
      setRefusals(film.session, [...refusals(film.session), { name: film.file.name, why: error.message }]);
    }
    if (film.key === undefined) inMemory.splice(inMemory.indexOf(film), 1);
    else await stored("readwrite", (store) => store.delete(film.key));
    await waiting();
    current = null;
    changed();
  }
}

function changed() {
  const badge = document.getElementById("sending-films") ?? document.body.appendChild(element("p", { id: "sending-films", role: "status", hidden: true }));
  badge.hidden = !queued.length;
  const words = current ? `${current.name}, ${Math.floor(100 * current.share)} %` : "beginning";
  const safe = inMemory.length ? " Keep this page open." : "";
  badge.textContent = current?.problem || `Sending ${queued.length} film${queued.length === 1 ? "" : "s"}: ${words}.${safe}`;
  changes.dispatchEvent(new Event("change"));
}

/** Send what waits, now and later; of several open pages one does. */
export function sendFilms() {
  if (navigator.locks) navigator.locks.request("curling films", sendAll);
  else sendAll();
}

// Only what this browser could not keep is lost with the page.
window.addEventListener("beforeunload", (event) => { if (inMemory.length || keeping) event.preventDefault(); });

// What all modes of the screen "Plan" share: what the address says, the sheet, and asking the server.

import { ask, meta } from "./ask.js";
import { HOG, placeInWords, RADIUS, Sheet, TEE, viewButtons } from "./sheet.js";
import { read, written } from "./throw_address.js";
import { length } from "./units.js";

export const $ = (id) => document.getElementById(id);
export const NAMES = { home: "red", away: "yellow" };
const HOUSE = 1.829;
/** From the hog line, where a throw begins, to the far tee line. */
export const START = 2 * HOG + (TEE - HOG);

// --- what the address says -----------------------------------------------------------------------

/** The hand that was chosen last on this device: an athlete plans with their own at once. */
export const ownHand = `skill ${meta("root")}`;
const usual = () => ({
  mode: "target", ice: $("ice").options[0].value,
  skill: [...$("skill").options].find((one) => one.value === localStorage.getItem(ownHand))?.value ?? "club", handle: "either", to: "away", stones: [],
  target: null, hit: false, throw: { speed: 2.1, angle: 0, spin: -1.5 }, hammer: "home", delivered: 0, left: 1,
  score: [0, 0], game: null,
});
let stoneNumber = 0;
/** A number that no stone has yet. */
export const nextStone = () => ++stoneNumber;
/** All that the screen shows. */
export const state = {};

/** Take over what the address says. */
export function readAddress() {
  Object.assign(state, read(usual(), nextStone));
}
readAddress();

/** Write the address; `step` makes one that "back" returns from. */
export function keep(step = false) {
  if (written(state) === location.hash) return;
  history[step ? "pushState" : "replaceState"](null, "", written(state));
}

// --- the sheet ------------------------------------------------------------------------------------

const ices = JSON.parse($("ices").textContent);
/** Size of the chosen ice, and its product of split and speed. */
export const ice = () => ices[Math.max($("ice").selectedIndex, 0)];
export const sheet = new Sheet($("sheet"), {
  ...ices[0], view: "house", wheel: true });
viewButtons(sheet, $("views"));
/** The throw that is shown, as the server answered, and the stones of the game that is played. */
export const desk = { shown: null };
export const play = { stones: [], mine: false, to: "away" };
let asked = 0;
export const direction = () => (state.to === "home" ? -1 : 1);

export function say(words, problem = false) {
  $("status").textContent = words;
  $("status").classList.toggle("problem", problem);
}

/** What is still asked for is no longer wanted. */
export function leaveAside() {
  asked += 1;
  $("throwing").removeAttribute("aria-busy");
}

/** Ask, and take only the latest answer, with a way to see whether it is still wanted; what goes wrong is one sentence. */
export async function post(path, json, then, failed) {
  const number = ++asked, wanted = () => number === asked;
  $("throwing").setAttribute("aria-busy", "true");
  const soon = setTimeout(() => { if (wanted()) say("One moment …"); }, 700);
  try {
    const answer = await ask(path, { method: "POST", json });
    clearTimeout(soon);
    if (wanted()) await then(answer, wanted);
  } catch (error) {
    if (wanted()) {
      say(error.message, true);
      failed?.();
    }
  } finally {
    clearTimeout(soon);
    if (wanted()) $("throwing").removeAttribute("aria-busy");
  }
}

export const asJson = (stones) => stones.map(({ x, y, team }) => ({ x, y, team }));

/** The stones that lie there now: those laid out, or those of the game. */
export const lying = () => (state.mode === "play" ? play.stones : state.stones);
/** Whose throw it is. */
export const thrower = () => (state.mode === "play" ? state.game?.person ?? "home" : state.mode === "position" ? toThrow() : "home");
/** A plan is for the home team: give it the thrower's stones as those. */
export const asOwn = (stones) => asJson(stones).map((s) => ({ ...s, team: s.team === thrower() ? "home" : "away" }));

/** The stones that would count as they lie: nearer the tee than the nearest of the other team. */
function counting(stones) {
  const far = ({ x, y }) => Math.hypot(x, Math.abs(y) - TEE);
  const inside = stones.filter((s) => far(s) <= HOUSE + RADIUS).sort((a, b) => far(a) - far(b));
  const other = inside.findIndex((s) => s.team !== inside[0].team);
  return new Set(other < 0 ? inside : inside.slice(0, other));
}

export function layStones() {
  const numbers = { home: 0, away: 0 }, count = counting(lying());
  sheet.lay(lying().map((stone) => ({ ...stone, counts: count.has(stone), name: `${NAMES[stone.team]} stone ${++numbers[stone.team]}` })));
}

export function clearThrow() {
  leaveAside();
  sheet.stop?.();
  sheet.trace([]);
  sheet.broom(null);
  sheet.expect(null, null);
  sheet.ghost(null);
  $("result").hidden = true;
  $("answer").hidden = true;
  if (state.mode === "play") $("sliders").hidden = true; // until a throw is aimed
  $("act").replaceChildren();
  desk.shown = null;
}

export function turnTo(end) {
  sheet.direction = end === "home" ? -1 : 1;
  sheet.fit();
}

/** Whose stone is next in the position that is laid out. */
export const toThrow = () => ((state.delivered % 2 === 1) === (state.hammer === "home") ? "home" : "away");

// --- words ----------------------------------------------------------------------------------------

/** The hand that throws, and a call's handle for it. */
export const hand = () => $("skill").selectedOptions[0]?.dataset.hand ?? "right";
export const turnOf = (call) => (hand() === "left" ? call.left_hander : call.right_hander);
export const weight = (found) => (found.call.hog_to_hog_s === null ? "short" : `${found.call.hog_to_hog_s.toFixed(1)} s`);
/** Where the broom stands, and how a throw ends. */
export const broom = ({ broom_m }) => (Math.abs(broom_m) < 0.01 ? "on the centre line" : `${length(broom_m)} ${broom_m > 0 ? "right" : "left"}`);
export const endOf = (found) => `It ${found.ends}${found.in_play ? ` ${placeInWords(found.rest, found.to === "home" ? -1 : 1)}` : ""}.`;
export const upper = (words) => words[0].toUpperCase() + words.slice(1);
export const percent = (share) => `${Math.round(100 * share)} %`;
export const signed = (value) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(1)}`;

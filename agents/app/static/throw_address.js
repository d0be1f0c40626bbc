// The address of the screen "Plan": all that it shows, so that it can be shared and reloaded.

import { TEE } from "./sheet.js";

const $ = (id) => document.getElementById(id);
export const STONES = 8; // of a team

/** What an address says, where it says something; the rest is as in `now`. `numbered` numbers stones. */
export function read(now, numbered) {
  const given = new URLSearchParams(location.hash.slice(1));
  const number = (name, fallback) => { const value = Number(given.get(name)); return given.has(name) && Number.isFinite(value) ? value : fallback; };
  const among = (id, fallback) => [...$(id).options].some((option) => option.value === given.get(id)) ? given.get(id) : fallback;
  for (const id of ["ice", "skill", "handle", "to", "hammer"]) now[id] = among(id, now[id]);
  if (["target", "hand", "position", "play"].includes(given.get("mode"))) now.mode = given.get("mode");
  now.stones = (given.get("stones") ?? "").split("*").flatMap((one) => {
    const [x, y] = one.slice(1).split("_").map(Number), team = { r: "home", y: "away" }[one[0]];
    return team && Number.isFinite(x) && Number.isFinite(y) ? [{ id: numbered(), team, x, y }] : [];
  }).slice(0, 2 * STONES);
  if (given.has("x") && given.has("y")) now.target = { x: number("x", 0), y: number("y", TEE) };
  now.hit = given.get("hit") === "1";
  now.throw = { speed: number("v", 2.1), angle: number("a", 0), spin: number("s", -1.5) };
  now.delivered = number("n", 0);
  now.left = number("left", 1);
  now.score = (given.get("score") ?? "0-0").split("-").map((points) => Number(points) || 0).slice(0, 2);
  if (given.has("seed")) {
    const throws = (given.get("t") ?? "").split("*").filter(Boolean).map((one) => one.split("_").map(Number));
    now.game = { seed: number("seed", 0), ends: number("ends", 2), opponent: among("opponent", "greedy"),
      opponent_skill: given.get("its") ?? "club", person: given.get("me") === "away" ? "away" : "home",
      laid: given.get("laid") === "1", throws };
  }
  return now;
}

const short = (value, digits) => String(Number(value.toFixed(digits)));

/** The address of all that a screen shows. */
export function written(state) {
  const parts = { mode: state.mode, ice: state.ice, skill: state.skill };
  if (state.handle !== "either") parts.handle = state.handle;
  if (state.to !== "away") parts.to = state.to;
  if (state.stones.length) parts.stones = state.stones.map((s) => `${s.team === "home" ? "r" : "y"}${short(s.x, 3)}_${short(s.y, 3)}`).join("*");
  if (state.target) Object.assign(parts, { x: short(state.target.x, 3), y: short(state.target.y, 3) });
  if (state.hit) parts.hit = "1";
  if (state.mode === "hand") Object.assign(parts, { v: short(state.throw.speed, 4), a: short(state.throw.angle, 5), s: short(state.throw.spin, 3) });
  if (state.mode === "position" || state.game?.laid) Object.assign(parts, { hammer: state.hammer, n: state.delivered, left: state.left, score: state.score.join("-") });
  if (state.game) {
    const { seed, ends, opponent, opponent_skill, person, laid, throws } = state.game;
    Object.assign(parts, { seed, ends, opponent, its: opponent_skill, me: person });
    if (laid) parts.laid = "1";
    if (throws.length) parts.t = throws.map((one) => one.map((value) => short(value, 5)).join("_")).join("*");
  }
  return "#" + new URLSearchParams(parts);
}

// A position that is laid out, and the best calls in it.

import { element } from "./ask.js";
import { RADIUS, TEE } from "./sheet.js";
import { STONES } from "./throw_address.js";
import { $, asJson, broom, clearThrow, direction, hand, keep, layStones, leaveAside, lying, NAMES, nextStone, percent, play, post, say, sheet, signed, state, toThrow, turnOf, upper, weight } from "./throw_board.js";
import { byHand } from "./throw_by_hand.js";
import { planIt, show } from "./throw_found.js";

/** The fewest stones thrown where these lie. */
function fewest() {
  const count = { home: 0, away: 0 };
  for (const stone of state.stones) count[stone.team] += 1;
  const other = state.hammer === "home" ? "away" : "home";
  return Math.max(2 * count[state.hammer], 2 * count[other] - 1, 0);
}

export function addStone(team) {
  if (state.stones.filter((stone) => stone.team === team).length >= STONES) { say(`A team has ${STONES} stones.`, true); return; }
  const d = direction(), places = [];
  for (const y of [0.9, 0.2, -0.6, -1.3, -2.4, -3.4]) for (const x of [-1.2, -0.8, -0.4, 0, 0.4, 0.8, 1.2]) places.push({ x: d * x * (team === "home" ? 1 : -1), y: d * (TEE + y) });
  const free = places.find((p) => state.stones.every((s) => Math.hypot(s.x - p.x, s.y - p.y) > 2.3 * RADIUS));
  if (!free) return;
  const id = nextStone();
  state.stones.push({ id, team, ...free });
  stonesChanged();
  sheet.stones.get(String(id))?.focus();
}

export function stonesChanged() {
  if (state.game?.laid) state.game = null; // it began with other stones
  state.delivered = Math.max(state.delivered, Math.min(fewest(), 15));
  clearThrow();
  $("calls").hidden = true;
  layStones();
  setPosition();
  keep();
  if (state.mode === "target") planIt();
  if (state.mode === "hand") byHand();
}

export function setPosition() {
  $("hammer").value = state.hammer;
  $("delivered").value = state.delivered;
  $("ends-left").value = state.left;
  [$("score-home").value, $("score-away").value] = state.score;
  const team = toThrow(), number = Math.floor(state.delivered / 2) + 1;
  $("turn").textContent = `${upper(NAMES[team])} throws next: its stone ${number} of 8${state.delivered === 15 ? ", the last of the end" : ""}.`;
}

export function readPosition() {
  if (state.game?.laid) state.game = null;
  const whole = (id, low, high) => Math.min(Math.max(Math.round(Number($(id).value) || 0), low), high);
  state.hammer = $("hammer").value;
  state.delivered = Math.max(whole("delivered", 0, 15), Math.min(fewest(), 15));
  state.left = whole("ends-left", 1, 10);
  state.score = [whole("score-home", 0, 99), whole("score-away", 0, 99)];
  setPosition();
  leaveAside();
  $("calls").hidden = true;
  keep();
}

export const position = () => ({ stones: asJson(state.stones), to: state.to, hammer: state.hammer, delivered: state.delivered, ends_left: state.left, score: state.score });

export function askCall() {
  clearThrow();
  say("Looking for the best call …");
  post("throw/calls", { ice: state.ice, skill: state.skill, position: position() }, listCalls);
}

export function listCalls(found) {
  const box = $("calls");
  const rows = found.calls.map((call, k) => {
    const row = element("button", { type: "button", class: "call", "aria-pressed": "false" },
      element("b", {}, `${k + 1}. ${call.shot}, ${turnOf(call.call)}`), element("b", {}, `${(100 * call.win).toFixed(0)} %`),
      element("span", { class: "small" }, `${weight(call)}, broom ${broom(call.call)}; ` +
        (found.last_stone ? `scores in ${percent(call.lies_shot)}, ${signed(call.points)} points on average` : `lies shot in ${percent(call.lies_shot)}, ${signed(call.points)} on average`)));
    row.addEventListener("click", () => pickCall(call, row));
    return row;
  });
  box.replaceChildren(element("h2", {}, `Best calls for ${NAMES[found.team]}`),
    element("p", { class: "small quiet" }, `The chance of winning the game, over the errors of this hand; in-turn and out-turn of a ${hand()}-hander.`), ...rows);
  box.hidden = false;
  say(`The best call: ${found.calls[0].shot}, ${percent(found.calls[0].win)} to win.`);
  rows[0].click();
}

function pickCall(call, row) {
  for (const other of $("calls").querySelectorAll(".call")) other.setAttribute("aria-pressed", String(other === row));
  const json = { ice: state.ice, throw: call.throw, to: state.mode === "play" ? play.to : state.to, stones: asJson(lying()) };
  post("throw/run", json, (found) => show({ ...found, ...call, call: call.call }));
}

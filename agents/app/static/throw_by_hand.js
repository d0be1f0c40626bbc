// A throw by hand: speed, broom and turns by sliders, and the path that follows.

import { $, asJson, endOf, keep, lying, play, post, say, sheet, START, state, turnOf } from "./throw_board.js";
import { show } from "./throw_found.js";
import { freshEnd } from "./throw_game.js";
import { length } from "./units.js";

let busy = false;
let waiting = null;
export function byHand() {
  if (state.mode === "play") {
    if (!play.mine) return;
    freshEnd();
    sheet.aim(null);
    state.target = null;
    $("calls").hidden = true;
  }
  const speed = Number($("speed").value), broom = Number($("broom").value), spin = Number($("spin").value);
  state.throw = { speed, angle: -Math.atan2(broom, START), spin };
  sayHand();
  keep();
  // While an answer is awaited, only the latest wish is kept.
  if (busy) { waiting = byHand; return; }
  runThrow();
}

export function runThrow() {
  busy = true;
  const json = { ice: state.ice, throw: state.throw, to: state.mode === "play" ? play.to : state.to, stones: asJson(lying()) };
  post("throw/run", json, (found) => { say(endOf(found)); show(found); }).finally(() => {
    busy = false;
    const next = waiting;
    waiting = null;
    next?.();
  });
}

/** What the sliders say: the broom at once, seconds and turns as soon as the throw is found. */
export function sayHand(found = null) {
  const { angle, spin } = state.throw, broom = -START * Math.tan(angle), call = found?.call;
  const weight = !call ? $("speed-value").textContent || "…" : call.hog_to_hog_s === null ? "short of the hog line" : `${call.hog_to_hog_s.toFixed(1)} s`;
  const where = Math.abs(broom) < 0.005 ? "on the centre line" : `${length(broom)} ${broom > 0 ? "right" : "left"}`;
  const turn = Math.abs(spin) < 0.01 ? "none" : call ? `${call.turns.toFixed(1)} turns, ${turnOf(call)}` : $("spin-value").textContent || "…";
  for (const [id, words] of [["speed", weight], ["broom", where], ["spin", turn]]) {
    $(`${id}-value`).textContent = words;
    $(id).setAttribute("aria-valuetext", words);
  }
}

export function setHand() {
  $("speed").value = state.throw.speed;
  $("broom").value = -START * Math.tan(state.throw.angle);
  $("spin").value = state.throw.spin;
  sayHand();
}

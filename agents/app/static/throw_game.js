// A game against a player, throw by throw; its throws stand in the address.

import { element } from "./ask.js";
import { $, clearThrow, keep, layStones, NAMES, play, post, say, sheet, state, toThrow, turnTo, upper } from "./throw_board.js";
import { position } from "./throw_position.js";

export function gameJson(more) {
  const { seed, ends, opponent, opponent_skill, person, laid, throws } = state.game;
  return { ice: state.ice, skill: state.skill, opponent_skill, opponent, person, ends: laid ? 1 : ends, seed, throws,
    position: laid ? position() : null, ...more };
}

export function newGame(laid) {
  state.game = { seed: Math.floor(Math.random() * 1e6), ends: Math.min(Math.max(Number($("ends").value) || 2, 1), 10), opponent: $("opponent").value,
    opponent_skill: $("opponent-skill").value, person: laid ? toThrow() : $("person").value, laid, throws: [] };
  state.mode = "play";
  state.target = null;
  keep(true);
}

export function throwInGame(thrown) {
  if (!play.mine) return;
  play.mine = false;
  allow(false); // a question while the stones run would end their run, and the turn with it
  $("calls").hidden = true;
  sheet.aim(null);
  state.target = null;
  clearThrow();
  goOn({ throw: { speed: thrown.speed, angle: thrown.angle, spin: thrown.spin }, since: state.game.throws.length });
}

export function goOn(more) {
  post("throw/game", gameJson(more), async (found, wanted) => {
    const before = state.game.throws.length;
    state.game.throws = found.throws;
    if (found.throws.length !== before) keep(true);
    board(found.state, found.deliveries.length > 0);
    for (const delivery of found.deliveries) {
      await showDelivery(delivery, wanted);
      if (!wanted()) return;
    }
    stand(found);
  }, () => { // it was not thrown: it is still the person's turn
    play.mine = Boolean(more.throw);
    allow(play.mine);
  });
}

async function showDelivery(delivery, wanted) {
  turnTo(delivery.direction);
  const thrown = delivery.paths.find((path) => !delivery.before.some((s) => s.stone === path.stone));
  const teamOf = (stone) => (stone < 8 ? "home" : "away");
  play.stones = delivery.before.map((s) => ({ id: s.stone, ...s }));
  layStones();
  say(`${upper(NAMES[delivery.team])} throws${delivery.shot ? `: ${delivery.shot}` : ""} …`);
  await sheet.run(delivery.paths.map((path) => ({ ...path, team: teamOf(path.stone), stone: path === thrown ? null : path.stone })),
    { speed: Number($("playback").value), hide: delivery.paths.filter((path) => path !== thrown).map((path) => path.stone) });
  if (!wanted()) return;
  play.stones = delivery.lying.map((s) => ({ id: s.stone, ...s }));
  layStones();
  if (delivery.ruling) say(`${upper(delivery.ruling)}.`, true);
}

function allow(mine) {
  for (const one of document.querySelectorAll("#in-play button")) one.disabled = !mine;
}

/** How the game stands, once all is at rest. */
function stand({ state: now, deliveries }) {
  const last = deliveries[deliveries.length - 1], ended = last?.score_of_end;
  const { person } = state.game;
  play.mine = !now.over && now.to_throw === person;
  play.to = now.to;
  if (!ended) {
    play.stones = now.stones.map((s) => ({ id: s.stone, ...s }));
    turnTo(now.to);
    sheet.trace([]);
  }
  sheet.movable = false;
  layStones();
  board(now, false);
  const words = [];
  if (last?.ruling) words.push(`${upper(last.ruling)}.`);
  if (ended) {
    const [red, yellow] = ended;
    words.push(red === yellow ? "The end is blank." : `${red > yellow ? "Red" : "Yellow"} scores ${red + yellow}.`);
  }
  if (now.over) words.push(now.winner ? `${upper(NAMES[now.winner])} wins the game${now.conceded ? `: ${NAMES[now.conceded]} concedes` : ""}.` : "The game ends without a winner.");
  else {
    if (now.lies && !ended) words.push(`${upper(NAMES[now.lies.team])} lies ${now.lies.points}.`);
    words.push(`You throw ${NAMES[person]}: stone ${Math.floor(now.delivered / 2) + 1} of 8${now.hammer === person ? ", and you have the hammer" : ""}.`);
    words.push("Click where it should rest, or a stone to hit it.");
  }
  $("standing").textContent = words.slice(0, -1).join(" ") || words[0];
  say(words.join(" "), Boolean(last?.ruling));
  $("rules").textContent = `${now.rules}. ${now.guards}`;
  $("in-play").hidden = false;
  $("game-form").open = now.over;
  allow(play.mine);
  // After an end the next one is played the other way; its empty house comes with the next target.
  play.fresh = Boolean(ended) && !now.over;
}

function board(now, hushed) {
  const box = $("scoreboard"), ends = Math.max(now.ends, now.line_score.length);
  const count = hushed ? Math.max(now.line_score.length - 1, 0) : now.line_score.length;
  const heads = Array.from({ length: ends }, (_, k) => element("th", { scope: "col" }, String(k + 1)));
  const [opponent] = [...$("opponent").options].find((one) => one.value === state.game.opponent).textContent.split(" (");
  const rows = ["home", "away"].map((team, k) => {
    const cells = Array.from({ length: ends }, (_, e) => element("td", {}, now.line_score[e] && (e < count || !hushed) ? String(now.line_score[e][k]) : ""));
    const total = now.start_score[k] + now.line_score.slice(0, hushed ? count : ends).reduce((sum, end) => sum + end[k], 0);
    const who = state.game.person === team ? "you" : opponent;
    return element("tr", {}, element("th", { scope: "row" }, element("i", { class: `dot ${team}` }), `${upper(NAMES[team])} (${who})`,
      ...(now.hammer === team ? [" ", element("span", { class: "hammer" }, "hammer")] : [])), ...cells,
      element("td", { class: "total" }, String(total)), element("td", { class: "left" }, now.stones_left[k] ? `${now.stones_left[k]}` : ""));
  });
  box.replaceChildren(element("table", {}, element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "End"), ...heads, element("th", { scope: "col" }, "Total"), element("th", { scope: "col" }, "Left"))),
    element("tbody", {}, ...rows)));
  box.hidden = false;
}

export function freshEnd() {
  if (!play.fresh) return;
  play.fresh = false;
  play.stones = [];
  turnTo(play.to);
  sheet.trace([]);
  layStones();
}

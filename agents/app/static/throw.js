// The screen "Throw". All that it shows follows from the address, so that it can be shared and reloaded.

import { ask, element } from "./ask.js";
import { HOG, RADIUS, Sheet, TEE, viewButtons } from "./sheet.js";
import { read, STONES, written } from "./throw_address.js";

const $ = (id) => document.getElementById(id);
const NAMES = { home: "red", away: "yellow" }, HOUSE = 1.829, START = 2 * HOG + (TEE - HOG);

// --- what the address says -----------------------------------------------------------------------

const usual = () => ({
  mode: "target", ice: $("ice").options[0].value, skill: "club", handle: "either", to: "away", stones: [],
  target: null, hit: false, throw: { speed: 2.1, angle: 0, spin: -1.5 }, hammer: "home", delivered: 0, left: 1,
  score: [0, 0], game: null,
});
let state = usual(), stoneNumber = 0;

/** Write the address; `step` makes one that "back" returns from. */
function keep(step = false) {
  if (written(state) === location.hash) return;
  history[step ? "pushState" : "replaceState"](null, "", written(state));
}

// --- the sheet ------------------------------------------------------------------------------------

const sheet = new Sheet($("sheet"), {
  ...JSON.parse($("ices").textContent)[0], view: "house", wheel: true });
viewButtons(sheet, $("views"));
let shown = null; // the throw that is shown, as the server told it
let asked = 0, busy = false;
const direction = () => (state.to === "home" ? -1 : 1);

function say(words, problem = false) {
  $("said").textContent = words;
  $("said").classList.toggle("problem", problem);
}

/** Ask, and take only the latest answer; what goes wrong is one sentence. */
async function post(path, json, then) {
  const number = ++asked;
  $("throwing").setAttribute("aria-busy", "true");
  const soon = setTimeout(() => { if (number === asked) say("One moment …"); }, 700);
  try {
    const answer = await ask(path, { method: "POST", json });
    clearTimeout(soon);
    if (number === asked) await then(answer);
  } catch (error) {
    if (number === asked) say(error.message, true);
  } finally {
    clearTimeout(soon);
    if (number === asked) $("throwing").removeAttribute("aria-busy");
  }
}

const asJson = (stones) => stones.map(({ x, y, team }) => ({ x, y, team }));

/** The stones that lie there now: those laid out, or those of the game. */
const lying = () => (state.mode === "play" ? play.stones : state.stones);
/** Whose throw it is. */
const thrower = () => (state.mode === "play" ? state.game?.person ?? "home" : state.mode === "position" ? toThrow() : "home");
/** A plan is for the home team: give it the thrower's stones as those. */
const asOwn = (stones) => asJson(stones).map((s) => ({ ...s, team: s.team === thrower() ? "home" : "away" }));

/** The stones that would count as they lie: nearer the tee than the nearest of the other team. */
function counting(stones) {
  const far = ({ x, y }) => Math.hypot(x, Math.abs(y) - TEE);
  const inside = stones.filter((s) => far(s) <= HOUSE + RADIUS).sort((a, b) => far(a) - far(b));
  const other = inside.findIndex((s) => s.team !== inside[0].team);
  return new Set(other < 0 ? inside : inside.slice(0, other));
}

function layStones() {
  const numbers = { home: 0, away: 0 }, count = counting(lying());
  sheet.lay(lying().map((stone) => ({ ...stone, counts: count.has(stone), name: `${NAMES[stone.team]} stone ${++numbers[stone.team]}` })));
}

function clearThrow() {
  sheet.stop?.();
  sheet.trace([]);
  sheet.broom(null);
  sheet.expect(null, null);
  sheet.ghost(null);
  $("result").hidden = true;
  $("act").replaceChildren();
  shown = null;
}

function turnTo(end) {
  sheet.direction = end === "home" ? -1 : 1;
  sheet.fit();
}

// --- a throw and what to expect of it -------------------------------------------------------------

function facts(rows) {
  return element("dl", { class: "facts" }, ...rows.filter(Boolean).map(([what, value, more]) =>
    element("div", {}, element("dt", {}, what), element("dd", {}, value), ...(more ? [element("dd", { class: "more" }, more)] : []))));
}

function button(words, act, plain = true) {
  const made = element("button", { type: "button", class: plain ? "plain" : "" }, words);
  made.addEventListener("click", act);
  return made;
}

/** Draw a throw that the server told, and say it in words. */
function show(found) {
  shown = found;
  const { call } = found, team = thrower();
  if (state.mode === "play") { // the sliders go on from what is planned
    state.throw = found.throw;
    setHand();
  }
  sheet.stop?.();
  sheet.trace([...(found.second ? tracesOf(found.second, team, "second") : []), ...tracesOf(found, team)]);
  sheet.broom(call.broom, call.from);
  sheet.expect(found.cloud, found.ellipse);
  sheet.ghost(found.in_play ? found.rest : null, team);
  const box = $("result");
  const words = [
    found.shot ? element("h2", {}, found.shot[0].toUpperCase() + found.shot.slice(1)) : "",
    facts([
      ["Weight", call.hog_to_hog_s === null ? "short" : `${call.hog_to_hog_s.toFixed(1)} s`, "hog to hog"],
      ["Broom", call.broom_in_words.replace(" of the centre line", ""), "from the centre line"],
      state.mode === "target" && !state.hit ? ["Ice", `${call.ice_m.toFixed(2)} m`, `${call.ice_in_brooms} to the ${call.ice_side}`] : null,
      ["Handle", turnOf(call), turnOf(call) === "no turn" ? "" : `of a ${hand()}-hander, ${call.turns} turns`],
      found.miss ? ["Expected miss", found.miss.words.split(" on average")[0], found.miss.words.split(", ")[1]] : null,
      found.chance !== undefined && !found.miss ? ["Succeeds", `${Math.round(100 * found.chance)} %`, found.success_means] : null,
      found.win !== undefined ? ["Wins the game", `${(100 * found.win).toFixed(0)} %`, `± ${(100 * found.win_error).toFixed(1)}`] : null,
    ])];
  if (found.sweep) words.push(element("p", {}, `Swept from ${found.sweep[0].toFixed(0)} to ${found.sweep[1].toFixed(0)} s.`));
  if (found.miss?.by_the_ice_m != null) words.push(element("p", { class: "small quiet" },
    `The hand alone misses by ${cm(found.miss.by_the_hand_m)}, what is not known of the ice by ${cm(found.miss.by_the_ice_m)}.`));
  if (found.costs?.length) words.push(element("h2", {}, "What errors cost"),
    element("ul", {}, ...found.costs.map((cost) => element("li", {}, cost.words + (found.miss || cost.success ? "" : " – and it fails")))));
  if (!found.cloud && !found.costs) words.push(element("p", {}, `It ${found.ends}.`));
  for (const remark of found.remarks ?? []) words.push(element("p", { class: "small quiet" }, remark));
  const row = $("act");
  row.replaceChildren();
  if (state.mode === "play") {
    if (play.mine) row.append(button("Throw it", () => throwInGame(found.throw), false));
  } else row.append(button("Let it run", letItRun, false));
  if (found.second) row.append(button(`Second choice: ${turnOf(found.second.call)}, ${weight(found.second)}`, () => show({ ...found.second, second: null, remarks: found.remarks })));
  box.replaceChildren(...words.filter(Boolean));
  box.hidden = false;
}

const cm = (metres) => (metres < 0.995 ? `${Math.round(100 * metres)} cm` : `${metres.toFixed(2)} m`);
/** The hand that throws, and a call's handle for it. */
const hand = () => $("skill").selectedOptions[0]?.dataset.hand ?? "right";
const turnOf = (call) => (hand() === "left" ? call.left_hander : call.right_hander);
const weight = (found) => (found.call.hog_to_hog_s === null ? "short" : `${found.call.hog_to_hog_s.toFixed(1)} s`);
const tracesOf = (found, team, kind) => (found.paths ?? []).map((path) => ({ ...path, kind: kind ?? (path.stone === null ? team : lying()[path.stone]?.team) }));

async function letItRun() {
  if (!shown?.paths) return;
  const team = thrower(), stones = lying();
  sheet.ghost(null);
  await sheet.run(shown.paths.map((path) => ({ ...path, team: path.stone === null ? team : stones[path.stone].team })),
    { speed: Number($("pace").value), hide: shown.paths.filter((path) => path.stone !== null).map((path) => stones[path.stone].id) });
  sheet.ghost(shown.in_play ? shown.rest : null, team);
  say(`It ${shown.ends}.`);
}

function planIt() {
  if (!state.target) return;
  sheet.aim(state.target);
  keep();
  const json = { ice: state.ice, skill: state.skill, target: state.target, stones: asOwn(lying()), hit: state.hit, handle: state.handle };
  post("throw/plan", json, (found) => { say(found.expectation ? `${upper(found.expectation)}.` : ""); show(found); });
}

const upper = (words) => words[0].toUpperCase() + words.slice(1);

// --- by hand --------------------------------------------------------------------------------------

let waiting = null;
function byHand() {
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

function runThrow() {
  busy = true;
  const json = { ice: state.ice, throw: state.throw, to: state.mode === "play" ? play.to : state.to, stones: asJson(lying()) };
  post("throw/run", json, (found) => { say(`It ${found.ends}.`); show(found); }).finally(() => {
    busy = false;
    const next = waiting;
    waiting = null;
    next?.();
  });
}

function sayHand() {
  const { speed, angle, spin } = state.throw, broom = -START * Math.tan(angle);
  $("speed-said").textContent = `${speed.toFixed(2)} m/s`;
  $("broom-said").textContent = Math.abs(broom) < 0.005 ? "on the centre line" : `${cm(Math.abs(broom))} ${broom > 0 ? "right" : "left"} (${(Math.abs(angle) * 180 / Math.PI).toFixed(2)}°)`;
  const turn = Math.abs(spin) < 0.01 ? "none" : `${Math.abs(spin).toFixed(2)} rad/s ${spin > 0 ? "counter-clockwise" : "clockwise"}`;
  $("spin-said").textContent = turn;
  for (const [id, words] of [["speed", `${speed.toFixed(2)} metres a second`], ["broom", $("broom-said").textContent], ["spin", turn]]) $(id).setAttribute("aria-valuetext", words);
}

function setHand() {
  $("speed").value = state.throw.speed;
  $("broom").value = -START * Math.tan(state.throw.angle);
  $("spin").value = state.throw.spin;
  sayHand();
}

// --- a position -----------------------------------------------------------------------------------

const toThrow = () => ((state.delivered % 2 === 1) === (state.hammer === "home") ? "home" : "away");

/** The fewest stones thrown where these lie. */
function fewest() {
  const count = { home: 0, away: 0 };
  for (const stone of state.stones) count[stone.team] += 1;
  const other = state.hammer === "home" ? "away" : "home";
  return Math.max(2 * count[state.hammer], 2 * count[other] - 1, 0);
}

function addStone(team) {
  if (state.stones.filter((stone) => stone.team === team).length >= STONES) { say(`A team has ${STONES} stones.`, true); return; }
  const d = direction(), places = [];
  for (const y of [0.9, 0.2, -0.6, -1.3, -2.4, -3.4]) for (const x of [-1.2, -0.8, -0.4, 0, 0.4, 0.8, 1.2]) places.push({ x: d * x * (team === "home" ? 1 : -1), y: d * (TEE + y) });
  const free = places.find((p) => state.stones.every((s) => Math.hypot(s.x - p.x, s.y - p.y) > 2.3 * RADIUS));
  if (!free) return;
  state.stones.push({ id: ++stoneNumber, team, ...free });
  stonesChanged();
  sheet.stones.get(String(stoneNumber))?.focus();
}

function stonesChanged() {
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

function setPosition() {
  $("hammer").value = state.hammer;
  $("delivered").value = state.delivered;
  $("ends-left").value = state.left;
  [$("score-home").value, $("score-away").value] = state.score;
  const team = toThrow(), number = Math.floor(state.delivered / 2) + 1;
  $("turn").textContent = `${upper(NAMES[team])} throws next: its stone ${number} of 8${state.delivered === 15 ? ", the last of the end" : ""}.`;
}

function readPosition() {
  if (state.game?.laid) state.game = null;
  const whole = (id, low, high) => Math.min(Math.max(Math.round(Number($(id).value) || 0), low), high);
  state.hammer = $("hammer").value;
  state.delivered = Math.max(whole("delivered", 0, 15), Math.min(fewest(), 15));
  state.left = whole("ends-left", 1, 10);
  state.score = [whole("score-home", 0, 99), whole("score-away", 0, 99)];
  setPosition();
  $("calls").hidden = true;
  keep();
}

const position = () => ({ stones: asJson(state.stones), to: state.to, hammer: state.hammer, delivered: state.delivered, ends_left: state.left, score: state.score });

function askCall() {
  clearThrow();
  say("Looking for the best call …");
  post("throw/calls", { ice: state.ice, skill: state.skill, position: position() }, listCalls);
}

function listCalls(found) {
  const box = $("calls");
  const rows = found.calls.map((call, k) => {
    const row = element("button", { type: "button", class: "call", "aria-pressed": "false" },
      element("b", {}, `${k + 1}. ${call.shot}, ${turnOf(call.call)}`), element("b", {}, `${(100 * call.win).toFixed(0)} %`),
      element("span", { class: "small" }, `${weight(call)}, broom ${call.call.broom_in_words}; ` +
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

const percent = (share) => `${Math.round(100 * share)} %`;
const signed = (value) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(1)}`;

function pickCall(call, row) {
  for (const other of $("calls").querySelectorAll(".call")) other.setAttribute("aria-pressed", String(other === row));
  const json = { ice: state.ice, throw: call.throw, to: state.mode === "play" ? play.to : state.to, stones: asJson(lying()) };
  post("throw/run", json, (found) => show({ ...found, ...call, call: call.call, ends: found.ends }));
}

// --- a game ---------------------------------------------------------------------------------------

const play = { stones: [], mine: false, to: "away" };

function gameJson(more) {
  const { seed, ends, opponent, opponent_skill, person, laid, throws } = state.game;
  return { ice: state.ice, skill: state.skill, opponent_skill, opponent, person, ends: laid ? 1 : ends, seed, throws,
    position: laid ? position() : null, ...more };
}

function newGame(laid) {
  state.game = { seed: Math.floor(Math.random() * 1e6), ends: Math.min(Math.max(Number($("ends").value) || 2, 1), 10), opponent: $("opponent").value,
    opponent_skill: $("opponent-skill").value, person: laid ? toThrow() : $("person").value, laid, throws: [] };
  state.mode = "play";
  state.target = null;
  keep(true);
  setMode();
  goOn({ since: 0 });
}

function throwInGame(thrown) {
  if (!play.mine) return;
  play.mine = false;
  $("calls").hidden = true;
  sheet.aim(null);
  state.target = null;
  clearThrow();
  goOn({ throw: { speed: thrown.speed, angle: thrown.angle, spin: thrown.spin }, since: state.game.throws.length });
}

function goOn(more) {
  post("throw/game", gameJson(more), async (found) => {
    const before = state.game.throws.length;
    state.game.throws = found.throws;
    if (found.throws.length !== before) keep(true);
    board(found.state, found.deliveries.length > 0);
    for (const delivery of found.deliveries) await showDelivery(delivery);
    stand(found);
  });
}

async function showDelivery(delivery) {
  turnTo(delivery.direction);
  const thrown = delivery.paths.find((path) => !delivery.before.some((s) => s.stone === path.stone));
  const teamOf = (stone) => (stone < 8 ? "home" : "away");
  play.stones = delivery.before.map((s) => ({ id: s.stone, ...s }));
  layStones();
  say(`${upper(NAMES[delivery.team])} throws${delivery.shot ? `: ${delivery.shot}` : ""} …`);
  await sheet.run(delivery.paths.map((path) => ({ ...path, team: teamOf(path.stone), stone: path === thrown ? null : path.stone })),
    { speed: Number($("pace").value), hide: delivery.paths.filter((path) => path !== thrown).map((path) => path.stone) });
  play.stones = delivery.lying.map((s) => ({ id: s.stone, ...s }));
  layStones();
  if (delivery.ruling) say(`${upper(delivery.ruling)}.`, true);
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
  for (const one of document.querySelectorAll("#in-play button")) one.disabled = !play.mine;
  // After an end the next one is played the other way; its empty house comes with the next target.
  play.fresh = Boolean(ended) && !now.over;
}

function board(now, hushed) {
  const box = $("scoreboard"), ends = Math.max(now.ends, now.line_score.length);
  const count = hushed ? Math.max(now.line_score.length - 1, 0) : now.line_score.length;
  const heads = Array.from({ length: ends }, (_, k) => element("th", { scope: "col" }, String(k + 1)));
  const rows = ["home", "away"].map((team, k) => {
    const cells = Array.from({ length: ends }, (_, e) => element("td", {}, now.line_score[e] && (e < count || !hushed) ? String(now.line_score[e][k]) : ""));
    const total = now.start_score[k] + now.line_score.slice(0, hushed ? count : ends).reduce((sum, end) => sum + end[k], 0);
    const who = state.game.person === team ? "you" : state.game.opponent;
    return element("tr", {}, element("th", { scope: "row" }, element("i", { class: `dot ${team}` }), `${upper(NAMES[team])} (${who})`,
      ...(now.hammer === team ? [" ", element("span", { class: "hammer" }, "hammer")] : [])), ...cells,
      element("td", { class: "total" }, String(total)), element("td", { class: "left" }, now.stones_left[k] ? `${now.stones_left[k]}` : ""));
  });
  box.replaceChildren(element("table", {}, element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "End"), ...heads, element("th", { scope: "col" }, "Total"), element("th", { scope: "col" }, "Left"))),
    element("tbody", {}, ...rows)));
  box.hidden = false;
}

function freshEnd() {
  if (!play.fresh) return;
  play.fresh = false;
  play.stones = [];
  turnTo(play.to);
  sheet.trace([]);
  layStones();
}

// --- modes ----------------------------------------------------------------------------------------

function setMode() {
  for (const input of document.querySelectorAll("#modes input")) input.checked = input.value === state.mode;
  for (const part of document.querySelectorAll("[data-mode]")) part.hidden = !part.dataset.mode.split(" ").includes(state.mode);
  for (const id of ["ice", "skill", "to", "handle"]) $(id).value = state[id];
  $("to").disabled = state.mode === "play";
  $("settings-said").textContent = `${$("ice").selectedOptions[0].textContent}; ${$("skill").selectedOptions[0].textContent}`;
  $("scoreboard").hidden = state.mode !== "play" || !state.game;
  $("in-play").hidden = !state.game;
  $("game-form").open = !state.game;
  $("calls").hidden = true;
  sheet.movable = state.mode !== "play";
  clearThrow();
  sheet.aim(null);
  turnTo(state.mode === "play" ? play.to : state.to);
  layStones();
  say("");
}

function begin() {
  setMode();
  setPosition();
  setHand();
  if (state.mode === "target") planIt();
  if (state.mode === "hand") runThrow();
  if (state.mode === "play" && state.game) goOn({ since: Math.max(state.game.throws.length - 1, 0) });
  if (state.mode === "target" && !state.target) say("Click where the stone should rest.");
}

for (const input of document.querySelectorAll("#modes input")) input.addEventListener("change", () => {
  state.mode = input.value;
  keep(true);
  begin();
});
$("handle").addEventListener("change", () => { state.handle = $("handle").value; keep(); planIt(); });
for (const id of ["ice", "skill"]) $(id).addEventListener("change", () => {
  state[id] = $(id).value;
  Object.assign(sheet, JSON.parse($("ices").textContent)[$("ice").selectedIndex]);
  sheet.paint();
  keep();
  begin();
});
$("to").addEventListener("change", () => {
  state.to = $("to").value;
  // The house is turned with all that lies in it.
  for (const stone of state.stones) Object.assign(stone, { x: -stone.x, y: -stone.y });
  if (state.target) state.target = { x: -state.target.x, y: -state.target.y };
  keep();
  begin();
});
for (const id of ["speed", "broom", "spin"]) $(id).addEventListener("input", byHand);
for (const id of ["hammer", "delivered", "ends-left", "score-home", "score-away"]) $(id).addEventListener("change", readPosition);
$("add-home").addEventListener("click", () => addStone("home"));
$("add-away").addEventListener("click", () => addStone("away"));
$("clear").addEventListener("click", () => { state.stones = []; state.delivered = 0; stonesChanged(); });
$("ask-call").addEventListener("click", askCall);
$("play-on").addEventListener("click", () => newGame(true));
$("new-game").addEventListener("submit", (event) => { event.preventDefault(); newGame(false); });
$("ask-advice").addEventListener("click", () => {
  freshEnd();
  clearThrow();
  say("Looking for the best call …");
  post("throw/advice", gameJson({}), listCalls);
});

for (const one of document.querySelectorAll(".to-button")) one.addEventListener("click", () => {
  sheet.send("target", { x: 0, y: TEE });
  sheet.layers.target.firstElementChild?.focus();
});
sheet.addEventListener("target", ({ detail }) => {
  if (state.mode === "position" || state.mode === "hand" || (state.mode === "play" && !play.mine)) return;
  if (state.mode === "play") freshEnd();
  const d = state.mode === "play" ? (play.to === "home" ? -1 : 1) : direction();
  state.target = { x: detail.x, y: d * Math.abs(detail.y) };
  state.hit = false;
  $("calls").hidden = true;
  planIt();
});
sheet.addEventListener("pick", ({ detail }) => {
  if (!(state.mode === "target" || (state.mode === "play" && play.mine && !play.fresh))) return;
  const stone = lying().find((one) => String(one.id) === detail.id);
  state.target = { x: stone.x, y: stone.y };
  state.hit = true;
  $("calls").hidden = true;
  planIt();
});
sheet.addEventListener("stone", ({ detail }) => {
  const stone = state.stones.find((one) => String(one.id) === detail.id);
  if (!stone || state.mode === "play") return;
  Object.assign(stone, { x: detail.x, y: detail.y });
  stonesChanged();
});
sheet.addEventListener("remove", ({ detail }) => {
  state.stones = state.stones.filter((one) => String(one.id) !== detail.id);
  stonesChanged();
});
addEventListener("popstate", () => { state = read(usual(), () => ++stoneNumber); begin(); });

state = read(usual(), () => ++stoneNumber);
begin();

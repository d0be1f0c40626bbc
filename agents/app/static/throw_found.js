// A throw that the server found: drawn on the sheet, in words, and run.

import { element } from "./ask.js";
import { $, asOwn, broom, desk, endOf, ice, keep, lying, percent, play, post, say, sheet, state, thrower, turnOf, upper, weight } from "./throw_board.js";
import { sayHand, setHand } from "./throw_by_hand.js";
import { throwInGame } from "./throw_game.js";
import { length } from "./units.js";

function facts(rows) {
  return element("dl", { class: "facts" }, ...rows.filter(Boolean).map(([what, value, more]) =>
    element("div", {}, element("dt", {}, what), element("dd", {}, value), ...(more ? [element("dd", { class: "more" }, more)] : []))));
}

function button(words, act, plain = true) {
  const made = element("button", { type: "button", class: plain ? "plain" : "" }, words);
  made.addEventListener("click", act);
  return made;
}

/** The answer on the picture: weight, ice or broom, handle, and how sure it is. */
function answer(found) {
  const { call } = found, { split, split_measured } = ice();
  const seconds = call.hog_to_hog_s;
  const ready = [
    ["Weight", seconds === null ? "short" : `${seconds.toFixed(1)} s`, `split ${split_measured ? "" : "about "}${(split / found.throw.speed).toFixed(2)} s`],
    state.mode === "target" && !state.hit
      ? ["Ice", length(call.ice_m), `broom ${call.ice_side} of the target`] : ["Broom", broom(call), "of the centre line"],
    ["Handle", turnOf(call), `${call.turns.toFixed(1)} turns`],
    found.miss ? ["Misses by", length(found.miss.expected_m), "on average"]
      : found.chance !== undefined ? ["Chance", percent(found.chance), found.success_means ?? ""] : null,
  ].filter(Boolean);
  $("answer").replaceChildren(...ready.map(([what, value, more]) => element("div", {}, element("dt", {}, what), element("dd", {}, value), element("dd", { class: "more" }, more))));
  $("answer").hidden = false;
}

/** Draw a throw that the server found, and say it in words. */
export function show(found) {
  desk.shown = found;
  const { call } = found, team = thrower();
  answer(found);
  if (state.mode === "hand") sayHand(found);
  if (state.mode === "play") { // the sliders go on from what is planned
    state.throw = found.throw;
    setHand();
    sayHand(found);
    $("sliders").hidden = false;
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
      ["Broom", broom(call), "from the centre line"],
      state.mode === "target" && !state.hit ? ["Ice", length(call.ice_m), `${call.ice_in_brooms} to the ${call.ice_side}`] : null,
      found.miss ? ["Expected miss", found.miss.words.split(" on average")[0], found.miss.words.split(", ")[1]] : null,
      found.chance !== undefined && !found.miss ? ["Succeeds", `${Math.round(100 * found.chance)} %`, found.success_means] : null,
      found.win !== undefined ? ["Wins the game", `${(100 * found.win).toFixed(0)} %`, `± ${(100 * found.win_error).toFixed(1)}`] : null,
    ])];
  if (found.habit) words.push(element("p", { class: "lead" }, found.habit));
  if (found.sweep) words.push(element("p", {}, `Swept from ${found.sweep[0].toFixed(0)} to ${found.sweep[1].toFixed(0)} s.`));
  if (found.miss?.by_the_ice_m != null) words.push(element("p", { class: "small quiet" },
    `Alone, the hand misses by ${length(found.miss.by_the_hand_m)}, and the uncertainty of the ice by ${length(found.miss.by_the_ice_m)}.`));
  if (found.costs?.length) words.push(element("h2", {}, "What errors cost"),
    element("ul", {}, ...found.costs.map((cost) => element("li", {}, cost.words + (found.miss || cost.success ? "" : " – and it fails")))));
  if (!found.cloud && !found.costs) words.push(element("p", {}, endOf(found)));
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

const tracesOf = (found, team, kind) => (found.paths ?? []).map((path) => ({ ...path, kind: kind ?? (path.stone === null ? team : lying()[path.stone]?.team) }));

async function letItRun() {
  if (!desk.shown?.paths) return;
  const team = thrower(), stones = lying();
  sheet.ghost(null);
  await sheet.run(desk.shown.paths.map((path) => ({ ...path, team: path.stone === null ? team : stones[path.stone].team })),
    { speed: Number($("playback").value), hide: desk.shown.paths.filter((path) => path.stone !== null).map((path) => stones[path.stone].id) });
  sheet.ghost(desk.shown.in_play ? desk.shown.rest : null, team);
  say(endOf(desk.shown));
}

export function planIt() {
  if (!state.target) return;
  sheet.aim(state.target);
  keep();
  const json = { ice: state.ice, skill: state.skill, target: state.target, stones: asOwn(lying()), hit: state.hit, handle: state.handle };
  post("throw/plan", json, (found) => { say([found.expectation && `${upper(found.expectation)}.`, found.habit].filter(Boolean).join(" ")); show(found); });
}

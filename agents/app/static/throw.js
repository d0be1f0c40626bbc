// The screen "Plan". All that it shows follows from the address, so that it can be shared and reloaded.

import { TEE } from "./sheet.js";
import { $, clearThrow, direction, hand, ice, keep, layStones, lying, ownHand, play, post, readAddress, say, sheet, state, turnTo } from "./throw_board.js";
import { byHand, runThrow, setHand } from "./throw_by_hand.js";
import { planIt } from "./throw_found.js";
import { freshEnd, gameJson, goOn, newGame } from "./throw_game.js";
import { addStone, askCall, listCalls, readPosition, setPosition, stonesChanged } from "./throw_position.js";
import { listKept } from "./throw_kept.js";

function setMode() {
  for (const input of document.querySelectorAll("#modes input")) input.checked = input.value === state.mode;
  for (const part of document.querySelectorAll("[data-mode]")) part.hidden = !part.dataset.mode.split(" ").includes(state.mode);
  for (const id of ["ice", "skill", "to", "handle"]) $(id).value = state[id];
  $("to").disabled = state.mode === "play";
  $("settings-chosen").textContent = $("ice").selectedOptions[0].textContent;
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

/** Handles by the name that the chosen hand has for them. */
function nameHandles() {
  const names = hand() === "left" ? ["out-turn", "in-turn"] : ["in-turn", "out-turn"];
  ["clockwise", "counter-clockwise"].forEach((way, k) => { $("handle").options[k + 1].textContent = `${names[k]} (${way})`; });
}

function begin() {
  if (state.mode === "target" && !state.target) state.target = { x: 0, y: direction() * TEE };
  setMode();
  nameHandles();
  setPosition();
  setHand();
  if (state.mode === "target") planIt();
  if (state.mode === "hand") runThrow();
  if (state.mode === "play" && state.game) goOn({ since: Math.max(state.game.throws.length - 1, 0) });
}

function beginGame(laid) {
  newGame(laid);
  setMode();
  $("sheet").scrollIntoView({ block: "nearest" });
  goOn({ since: 0 });
}

for (const input of document.querySelectorAll("#modes input")) input.addEventListener("change", () => {
  state.mode = input.value;
  keep(true);
  begin();
});
$("handle").addEventListener("change", () => { state.handle = $("handle").value; keep(); planIt(); });
for (const id of ["ice", "skill"]) $(id).addEventListener("change", () => {
  state[id] = $(id).value;
  localStorage.setItem(ownHand, state.skill);
  Object.assign(sheet, ice());
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
let cleared = null;
$("clear").addEventListener("click", () => {
  cleared = { stones: state.stones, delivered: state.delivered };
  Object.assign(state, { stones: [], delivered: 0 });
  stonesChanged();
  $("undo").hidden = false;
});
$("undo").addEventListener("click", () => { Object.assign(state, cleared); stonesChanged(); $("undo").hidden = true; });
$("ask-call").addEventListener("click", askCall);
$("play-on").addEventListener("click", () => beginGame(true));
$("new-game").addEventListener("submit", (event) => { event.preventDefault(); beginGame(false); });
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
  keep(true);
  planIt();
});
sheet.addEventListener("pick", ({ detail }) => {
  if (!(state.mode === "target" || (state.mode === "play" && play.mine && !play.fresh))) return;
  const stone = lying().find((one) => String(one.id) === detail.id);
  state.target = { x: stone.x, y: stone.y };
  state.hit = true;
  $("calls").hidden = true;
  keep(true);
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
addEventListener("popstate", () => { readAddress(); begin(); });

listKept();
begin();

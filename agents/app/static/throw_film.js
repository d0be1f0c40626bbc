// A throw's film with the stone's path drawn over it, in step with its speed.

import { ask, at, element } from "./ask.js";
import { parsed } from "./forms.js";
import { drawHouse } from "./house.js";
import { jobLine, listen } from "./jobs.js";
import { TEE } from "./sheet.js";
import { SPEED, SPEED_NAME } from "./units.js";

const NAMESPACE = "http://www.w3.org/2000/svg";
const HEIGHT = 180, LEFT = 44, BOTTOM = 28, TOP = 12;
const SLOWLY = 0.25;
const find = (id) => document.getElementById(id);

function draw(parent, name, attributes, text) {
  const made = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

const points = (pairs) => pairs.map((pair) => pair.join(",")).join(" ");

/** The sample at or before a time. */
function sampleAt(t, time) {
  let low = 0, high = t.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (t[middle] <= time) low = middle; else high = middle - 1;
  }
  return low;
}

/** The times at which the stone's centre passes the lines of the sheet. */
function crossings({ t, ahead }) {
  const lines = [[-10.9725, "hog"], [10.9725, "hog"], [17.3735, "tee"]];
  const found = [];
  for (const [line, name] of lines) {
    const k = ahead.findIndex((value) => value >= line);
    if (k > 0) found.push([t[k], name]);
  }
  return found;
}

function drawCurve(svg, track) {
  const WIDTH = Math.max(svg.clientWidth, 280);
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
  const { t, speed } = track;
  const begin = t[0], end = t[t.length - 1], most = Math.max(...speed, 0.5) * 1.15;
  const x = (time) => LEFT + (time - begin) / (end - begin) * (WIDTH - LEFT - 8);
  const y = (value) => HEIGHT - BOTTOM - value / most * (HEIGHT - BOTTOM - TOP);
  for (let value = 0; value <= most; value += most > 8 ? 2 : most > 2.6 ? 1 : 0.5) {
    draw(svg, "line", { x1: LEFT, x2: WIDTH - 8, y1: y(value), y2: y(value), class: "grid" });
    draw(svg, "text", { x: LEFT - 6, y: y(value) + 4, class: "across" }, value.toFixed(1));
  }
  for (let time = 0; time <= end - begin; time += 5) {
    draw(svg, "text", { x: x(begin + time), y: HEIGHT - 10, class: "below" }, `${time} s`);
  }
  draw(svg, "text", { x: 0, y: TOP }, SPEED_NAME);
  for (const [time, name] of crossings(track)) {
    draw(svg, "line", { x1: x(time), x2: x(time), y1: TOP, y2: HEIGHT - BOTTOM, class: "mark" });
    draw(svg, "text", { x: x(time) + 3, y: TOP + 10, class: "small" }, name);
  }
  draw(svg, "polyline", { points: points(t.map((k, i) => [x(k), y(speed[i])])), class: "speed" });
  const cursor = draw(svg, "line", { y1: TOP, y2: HEIGHT - BOTTOM, class: "cursor" });
  const dot = draw(svg, "circle", { r: 5, class: "dot" });
  return {
    show(time, value) {
      cursor.setAttribute("x1", x(time));
      cursor.setAttribute("x2", x(time));
      dot.setAttribute("cx", x(time));
      dot.setAttribute("cy", y(value));
    },
    timeAt(event) {
      const box = svg.getBoundingClientRect();
      const at = (event.clientX - box.left) / box.width * WIDTH;
      const share = Math.min(Math.max((at - LEFT) / (WIDTH - LEFT - 8), 0), 1);
      return begin + share * (end - begin);
    },
  };
}

function drawOverlay(svg, picture) {
  if (!svg || !picture) return null;
  svg.setAttribute("viewBox", `0 0 ${picture.size.join(" ")}`);
  draw(svg, "polyline", { points: points(picture.path), class: "way" });
  const so = draw(svg, "polyline", { class: "way so-far" });
  const outline = draw(svg, "polygon", { class: "outline" });
  return (k) => {
    so.setAttribute("points", points(picture.path.slice(0, k + 1)));
    outline.setAttribute("points", points(picture.outlines[k]));
  };
}

// How the call is read, as soon as it is saved.
document.querySelector("form.entry").addEventListener("saved", ({ detail }) => {
  find("read").textContent = detail.words || (detail.problem ? `${detail.problem}; kept as a remark.` : "");
  find("read").classList.toggle("warn", Boolean(detail.problem));
});

/** The throw's track; while the app does not answer, it is asked again. */
async function trackOfThrow() {
  for (;;) {
    try {
      return await ask(find("throw").dataset.track);
    } catch (error) {
      if (!error.away) throw error;
      await new Promise((done) => setTimeout(done, 1000));
    }
  }
}

const track = await trackOfThrow();
track.speed = track.speed.map((value) => value / SPEED);
const { t, speed } = track;
const film = find("film"), slider = find("time");
const curve = drawCurve(find("curve"), track);
const overlay = drawOverlay(find("overlay"), track.picture);
slider.min = t[0];
slider.max = t[t.length - 1];

let other = null; // shows another throw at the same time since its release

function show(time) {
  const within = Math.min(Math.max(time, t[0]), t[t.length - 1]);
  const k = sampleAt(t, within + 1e-6);
  curve.show(within, speed[k]);
  overlay?.(k);
  other?.(within - t[0]);
  slider.value = within;
  slider.setAttribute("aria-valuetext", `${(within - t[0]).toFixed(1)} seconds`);
  find("now").textContent = `${(within - t[0]).toFixed(1)} s: ${speed[k].toFixed(2)} ${SPEED_NAME}`;
}

/** Ask for a copy that this browser plays, and play it as soon as it is there. */
async function playCopy() {
  const { copy } = film.dataset, list = find("copying");
  const complain = (text) => list.replaceChildren(element("li", { class: "problem" }, text));
  find("unplayable").hidden = false;
  if (film.src.endsWith(copy)) return; // not even that
  try {
    const { job } = await ask(copy, { method: "POST" });
    listen(`practice/work/events?jobs=${job}`, ([now], events) => {
      list.replaceChildren(jobLine(now, complain));
      if (now.state !== "done") return;
      events.close();
      find("unplayable").hidden = true;
      film.src = at(copy);
      film.addEventListener("loadedmetadata", () => go(Number(slider.value)), { once: true });
    });
  } catch (error) {
    complain(error.message);
  }
}

function go(time) {
  if (film) film.currentTime = time;
  show(time);
}

slider.addEventListener("input", () => go(Number(slider.value)));
find("curve").addEventListener("pointerdown", (event) => {
  go(curve.timeAt(event));
  const move = (further) => go(curve.timeAt(further));
  window.addEventListener("pointermove", move);
  window.addEventListener("pointerup", () => window.removeEventListener("pointermove", move),
    { once: true });
});

if (film) {
  film.addEventListener("error", playCopy);
  if (film.error) playCopy(); // before this script was there
  find("drawn").addEventListener("change", (event) => {
    find("overlay").toggleAttribute("hidden", !event.target.checked);
  });
  find("slow").addEventListener("change", (event) => {
    film.playbackRate = event.target.checked ? SLOWLY : 1;
  });
  for (const [id, by] of [["frame-back", -track.frame], ["frame-on", track.frame]]) find(id).addEventListener("click", () => { film.pause(); go(film.currentTime + by); });
  for (const name of ["seeked", "pause"]) film.addEventListener(name, () => show(film.currentTime));
  // With each frame that is shown, where the browser tells of it.
  if ("requestVideoFrameCallback" in film) {
    const each = (now, frame) => {
      show(frame.mediaTime);
      film.requestVideoFrameCallback(each);
    };
    film.requestVideoFrameCallback(each);
  } else {
    film.addEventListener("timeupdate", () => show(film.currentTime));
  }
}
go(t[0]);

// --- from above, alone or beside another throw -----------------------------------------------------

const [rest] = JSON.parse(find("rests").textContent);
const above = drawHouse(find("above"), rest ? [rest] : [], { editable: false, view: "whole", stretch: [1.7, 2.6] });
const pathOf = ({ ahead, right }, kind) => ({ x: right, y: ahead, kind });
above.trace([pathOf(track, "home")]);
if (rest?.broom != null) above.broom({ x: rest.broom, y: TEE }, { x: 0, y: -10.97 });
if (rest?.target) {
  above.aim({ x: rest.target[0], y: TEE + rest.target[1] });
  above.layers.target.firstElementChild.removeAttribute("tabindex");
}

/** Put another throw beside this one: its path, its numbers, and its film, in step from the release. */
async function putBeside(number) {
  for (const one of document.querySelectorAll(".other")) one.remove();
  other = null;
  above.trace([pathOf(track, "home")]);
  history.replaceState(null, "", number ? `#beside=${number}` : location.pathname + location.search);
  if (!number) return;
  const path = find("throw").dataset.track.replace(/\d+.track$/, number);
  try {
    const there = await ask(`${path}/track`), page = await parsed(await fetch(at(path)));
    above.trace([pathOf(there, "away"), pathOf(track, "home")]);
    const rows = [...page.querySelectorAll("table.what tr")], here = document.querySelector("table.what tbody");
    for (const row of here?.rows ?? []) {
      const same = rows.find((one) => one.cells[0].textContent === row.cells[0].textContent);
      row.append(element("td", { class: "number other" }, ...(same?.cells[1].childNodes ?? [])));
    }
    const head = (team, words) => element("th", { scope: "col", class: "number" }, element("i", { class: `dot ${team}` }), words);
    here?.prepend(element("tr", { class: "other" }, element("td"), head("home", "this throw"), head("away", `throw ${number}`)));
    const video = page.getElementById("film");
    if (film && video) showOther(film, document.importNode(video), there);
  } catch (error) {
    find("now").textContent = error.message;
  }
}

function showOther(film, video, there) {
  const svg = document.createElementNS(NAMESPACE, "svg"), followed = drawOverlay(svg, there.picture);
  Object.assign(video, { id: "", controls: false, muted: true });
  film.parentElement.after(element("div", { class: "film other" }, video, svg));
  other = (since) => {
    const time = there.t[0] + since;
    if (Math.abs(video.currentTime - time) > (film.paused ? 0.01 : 0.2)) video.currentTime = time;
    followed?.(sampleAt(there.t, time));
    if (film.paused !== video.paused) video[film.paused ? "pause" : "play"]();
    video.playbackRate = film.playbackRate;
  };
  go(Number(slider.value));
}

find("beside").addEventListener("change", ({ target }) => putBeside(Number(target.value)));
const [, asked] = /^#beside=(\d+)$/.exec(location.hash) ?? [];
if (asked) find("beside").value = asked;
if (find("beside").value) putBeside(Number(find("beside").value));

// The sheet as one picture: drawn in metres, zoomed with wheel and fingers, moved on with the keyboard.
//
// Places are in the sheet frame, as in every file: x across, y along, both in metres from mid-sheet.
// Play runs to the right in a wide picture and upwards in a tall one; right of the thrower is down, or
// right. Colours and line widths are in sheet.css, so that the picture follows light and dark.

import { hold } from "./sheet_hands.js";
import { length as inWords } from "./units.js";

const SVG = "http://www.w3.org/2000/svg";
export const TEE = 17.3735, HOG = 10.9725, BACK = 19.2025, HACK = 21.0315, RADIUS = 0.145;
const HOG_WIDTH = 0.1016, RINGS = [[1.829, "blue"], [1.219, "ice"], [0.610, "red"], [0.152, "ice"]];
const BROOM = 0.2, FINGER = 15, LEAST_STONE = 3.5;
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** An element of the picture. */
export function shape(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const line = (x1, y1, x2, y2, name) => shape("line", { x1, y1, x2, y2, class: name });

/** Where a place of the sheet lies, as the thrower sees it. */
export function placeInWords({ x, y }, direction) {
  const right = direction * x, past = direction * y - TEE;
  if (Math.hypot(right, past) < 0.05) return "on the button";
  const parts = [];
  if (Math.abs(past) >= 0.05) parts.push(`${inWords(past)} ${past > 0 ? "behind" : "before"} the tee line`);
  if (Math.abs(right) >= 0.05) parts.push(`${inWords(right)} ${right > 0 ? "right" : "left"} of the centre line`);
  return parts.join(", ");
}

/**
 * One picture of the sheet.
 *
 * Options: `length`, `width` of the ice; `radius` of a stone; `direction` of play, 1 to the away end
 * and -1 to the home end; `stretch`, by how much a wide and a tall picture are drawn wider than the sheet;
 * `view`, "house" or "whole"; `editable`, whether a target may be set; `movable`, whether stones may be
 * moved; `wheel`, whether a wheel alone zooms, which else scrolls the page.
 * Sends the events "target" {x, y}, "stone" {id, x, y}, "pick" {id} and "remove" {id}.
 */
export class Sheet extends EventTarget {
  constructor(svg, options = {}) {
    super();
    Object.assign(this, { length: 44.5, width: 4.5, radius: RADIUS, direction: 1, stretch: [1, 1], view: "house",
      editable: true, movable: true, wheel: false, printing: false }, options);
    this.svg = svg;
    this.stones = new Map();
    this.world = shape("g");
    this.layers = {};
    for (const name of ["ice", "cells", "paint", "cloud", "paths", "broom", "target", "stones", "moving"]) {
      this.layers[name] = shape("g", { class: name });
      this.world.append(this.layers[name]);
    }
    this.announcement = document.createElement("p");
    this.announcement.className = "unseen";
    this.announcement.setAttribute("aria-live", "polite");
    svg.after(this.announcement);
    svg.classList.add("sheet");
    svg.append(this.hatching(), this.world);
    this.paint();
    hold(this);
    new ResizeObserver(() => this.fit()).observe(svg);
    this.fit();
  }

  // --- the ice -------------------------------------------------------------------------------

  hatching() {
    // Each picture has a separate pattern: a page may hold several.
    this.hatch = `hatch-${Math.random().toString(36).slice(2)}`;
    const pattern = shape("pattern", { id: this.hatch, width: 0.3, height: 0.3, patternUnits: "userSpaceOnUse",
      patternTransform: "rotate(45)" }, line(0, 0, 0, 0.3, "hatch"));
    return shape("defs", {}, pattern);
  }

  paint() {
    const { length, width } = this, half = width / 2;
    this.layers.ice.replaceChildren(shape("rect", { x: -half, y: -length / 2, width, height: length, class: "sheet-ice" }));
    const paint = this.layers.paint;
    paint.replaceChildren();
    for (const end of [-1, 1]) {
      for (const [r, colour] of RINGS) paint.append(shape("circle", { cx: 0, cy: end * TEE, r, class: `ring ${colour}` }));
      paint.append(
        line(-half, end * TEE, half, end * TEE, "mark"),
        line(-half, end * BACK, half, end * BACK, "mark"),
        shape("rect", { x: -half, y: end > 0 ? HOG : -HOG - HOG_WIDTH, width, height: HOG_WIDTH, class: "hog" }),
        shape("rect", { x: -0.2, y: end * HACK - 0.05, width: 0.15, height: 0.1, class: "hack" }),
        shape("rect", { x: 0.05, y: end * HACK - 0.05, width: 0.15, height: 0.1, class: "hack" }));
    }
    paint.append(line(0, -HACK, 0, HACK, "mark"),
      shape("rect", { x: -half, y: -length / 2, width, height: length, class: "edge" }));
  }

  /** The map: `relative` in rows from y = -length/2 upwards, null where no stone ran. */
  map(cells, most = null) {
    const layer = this.layers.cells;
    layer.replaceChildren();
    this.svg.classList.toggle("mapped", Boolean(cells));
    if (!cells) return;
    const { size, relative } = cells, known = relative.flat().filter((value) => value !== null);
    const top = most ?? Math.max(0.005, ...known.map(Math.abs));
    const bottom = (i) => Math.min(-this.length / 2 + i * size, this.length / 2);
    for (let j = 0; j < relative[0].length; j++) {
      const x = -this.width / 2 + j * size, width = Math.min(size, this.width / 2 - x);
      for (let i = 0, next; i < relative.length; i = next) {
        // Cells that look alike are one piece, so that a print of the map stays small.
        next = i + 1;
        while (next < relative.length && relative[next][j] === relative[i][j]) next += 1;
        const value = relative[i][j], box = { x, y: bottom(i), width, height: bottom(next) - bottom(i) };
        if (value === null) layer.append(shape("rect", { ...box, class: "unseen-ice", fill: `url(#${this.hatch})` }));
        else if (value !== 0) layer.append(shape("rect", { ...box, class: value > 0 ? "heavy" : "keen",
          "fill-opacity": Math.min(Math.abs(value) / top, 1).toFixed(3) }));
      }
    }
  }

  // --- what is seen ----------------------------------------------------------------------------

  fit() {
    const box = this.svg.getBoundingClientRect();
    if (!box.width || !box.height) return;
    const wide = this.printing || box.width > 1.1 * box.height;
    if (this.wide !== wide) this.zoomed = false;
    this.wide = wide;
    this.turn();
    if (!this.zoomed) this.show(this.view);
    else this.sized();
  }

  /** By how much the sheet is drawn wider than it is; a house is drawn round. */
  get widened() {
    return this.view === "whole" ? this.stretch[this.wide ? 0 : 1] : 1;
  }

  /** Across and along become right and up, or down and right; what is right stays on the right. */
  turn() {
    const d = this.direction, s = this.widened;
    this.world.setAttribute("transform", this.wide ? `matrix(0 ${d * s} ${d} 0 0 0)` : `matrix(${d * s} 0 0 ${-d} 0 0)`);
  }

  /** Show "house", "whole" or {from, to} along the way of play. */
  show(view) {
    this.zoomed = false;
    this.svg.classList.remove("zoomed");
    this.view = view;
    this.turn();
    const [from, to] = view === "whole" ? [-this.length / 2, this.length / 2]
      : view === "house" ? [HOG - 0.9, BACK + 0.7] : [view.from, view.to];
    const half = (this.width / 2 + 0.08) * this.widened;
    this.window = this.wide ? { x: from, y: -half, w: to - from, h: 2 * half }
      : { x: -half, y: -to, w: 2 * half, h: to - from };
    this.apply();
  }

  apply() {
    const { x, y, w, h } = this.window;
    this.svg.setAttribute("viewBox", `${x} ${y} ${w} ${h}`);
    this.sized();
  }

  /** Pixels that a metre takes. */
  get scale() {
    const box = this.svg.getBoundingClientRect();
    return this.window && box.width ? Math.min(box.width / this.window.w, box.height / this.window.h) : 50;
  }

  /** Keep stones visible, and large enough for a finger, however small the picture is. */
  sized() {
    const least = LEAST_STONE / this.scale, finger = FINGER / this.scale, r = Math.max(this.radius, least);
    for (const one of this.world.querySelectorAll(".stone")) one.style.setProperty("--size", r / this.radius);
    for (const reach of this.world.querySelectorAll(".reach")) reach.setAttribute("r", Math.max(this.radius, finger));
  }

  zoomAbout(x, y, factor) {
    const box = this.svg.getBoundingClientRect(), scale = this.scale, old = this.window;
    // The window takes the form of the picture, so that nothing jumps.
    const w = box.width / scale, h = box.height / scale;
    const left = old.x - (w - old.w) / 2, top = old.y - (h - old.h) / 2;
    const least = Math.min(w, h) * scale / 1200, most = 1.6 * this.length;
    const k = Math.min(Math.max(1 / factor, least / Math.min(w, h), 0.05), most / Math.max(w, h));
    const u = left + (x - box.left) / scale, v = top + (y - box.top) / scale;
    this.window = { x: u - (u - left) * k, y: v - (v - top) * k, w: w * k, h: h * k };
    this.zoomed = true;
    this.svg.classList.add("zoomed");
    this.apply();
  }

  moveBy(dx, dy) {
    const scale = this.scale;
    this.window.x -= dx / scale;
    this.window.y -= dy / scale;
    this.zoomed = true;
    this.svg.classList.add("zoomed");
    this.apply();
  }

  /** The place on the sheet under a pointer. */
  under(event) {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.world.getScreenCTM().inverse());
    return { x: at.x, y: at.y };
  }

  within({ x, y }) {
    const r = this.radius, d = this.direction;
    const along = Math.min(Math.max(d * y, HOG + r + 0.01), BACK + r - 0.01), side = this.width / 2 - r - 0.005;
    return { x: Math.min(Math.max(x, -side), side), y: d * along };
  }

  // --- words and handles ----------------------------------------------------------------------

  send(name, detail) {
    this.dispatchEvent(Object.assign(new Event(name), { detail }));
  }

  say(words) {
    this.announcement.textContent = words;
  }

  placeOf(held) {
    return { x: Number(held.dataset.x), y: Number(held.dataset.y) };
  }

  /** Put a stone or the target somewhere; a stone stops where another lies. */
  put(held, wanted) {
    const at = this.within(wanted), least = 2 * this.radius + 0.002;
    if (held.dataset.held === "stone") {
      for (const [id, other] of this.stones) {
        if (id === held.dataset.id) continue;
        const there = this.placeOf(other), apart = Math.hypot(at.x - there.x, at.y - there.y);
        if (apart >= least) continue;
        const away = apart > 1e-6 ? [(at.x - there.x) / apart, (at.y - there.y) / apart] : [0, 1];
        at.x = there.x + away[0] * least;
        at.y = there.y + away[1] * least;
      }
    }
    this.place(held, at);
  }

  place(held, { x, y }) {
    held.dataset.x = x.toFixed(4);
    held.dataset.y = y.toFixed(4);
    held.setAttribute("transform", `translate(${x} ${y})`);
    const where = placeInWords({ x, y }, this.direction);
    held.setAttribute("aria-label", `${held.dataset.name}, ${where}`);
  }

  tell(held, done) {
    const at = this.placeOf(held);
    this.say(`${held.dataset.name}: ${placeInWords(at, this.direction)}`);
    if (held.dataset.held === "stone") this.send("stone", { id: held.dataset.id, ...at, done });
    else this.send("target", at);
  }

  // --- stones, target, broom ---------------------------------------------------------------------

  /** Lay stones: [{id, x, y, team, name}]. Those that stay keep their element, and the focus. */
  lay(stones) {
    const wanted = new Set(stones.map((stone) => String(stone.id)));
    for (const [id, held] of this.stones) if (!wanted.has(id)) { held.remove(); this.stones.delete(id); }
    for (const stone of stones) {
      const id = String(stone.id);
      let held = this.stones.get(id);
      if (!held || held.dataset.team !== stone.team) {
        held?.remove();
        held = this.stone(stone.team, stone.theta ?? 0);
        Object.assign(held.dataset, { held: "stone", id, team: stone.team, name: stone.name ?? `${stone.team} stone` });
        if (this.editable) {
          held.setAttribute("tabindex", "0");
          held.setAttribute("role", "button");
          held.setAttribute("aria-roledescription", this.movable ? "stone; arrow keys move it, delete removes it" : "stone");
        } else held.setAttribute("role", "img");
        held.prepend(shape("circle", { class: "reach", r: this.radius }));
        this.stones.set(id, held);
        this.layers.stones.append(held);
      }
      held.classList.toggle("counting", Boolean(stone.counts));
      this.place(held, stone);
    }
    this.sized();
  }

  stone(team, theta = 0) {
    const r = this.radius;
    const handle = shape("g", { class: "handle", transform: `rotate(${theta * 180 / Math.PI})` },
      shape("line", { x1: 0, y1: -0.42 * r, x2: 0, y2: 0.55 * r, class: "bar" }));
    return shape("g", { class: `stone ${team}` }, shape("g", { class: "body" },
      shape("circle", { r, class: "granite" }), shape("circle", { r: 0.64 * r, class: "cap" }), handle));
  }

  /** The target, or none. */
  aim(place) {
    const layer = this.layers.target;
    if (!place) { layer.replaceChildren(); return; }
    let held = layer.firstElementChild;
    if (!held) {
      const r = this.radius;
      held = shape("g", { class: "aim", tabindex: 0, role: "button", "aria-roledescription": "target; arrow keys move it" },
        shape("circle", { class: "reach", r }), shape("circle", { r, class: "spot" }),
        line(-1.7 * r, 0, 1.7 * r, 0, "cross"), line(0, -1.7 * r, 0, 1.7 * r, "cross"));
      Object.assign(held.dataset, { held: "target", name: "target" });
      layer.append(held);
      this.place(held, place);
      this.sized();
    } else this.place(held, place);
  }

  /** The broom on the far tee line, and the line of delivery to it. */
  broom(at, from) {
    const layer = this.layers.broom;
    layer.replaceChildren();
    if (!at) return;
    layer.append(line(from.x, from.y, at.x, at.y, "delivery"),
      shape("rect", { x: at.x - BROOM / 2, y: at.y - 0.05, width: BROOM, height: 0.1, rx: 0.03, class: "head" }));
  }

  /** What is expected of a throw: where trials ended, and the ellipse that holds half of them. */
  expect(cloud, ellipse) {
    const layer = this.layers.cloud;
    layer.replaceChildren();
    for (const [x, y] of cloud ?? []) if (x !== null && y !== null) layer.append(shape("circle", { cx: x, cy: y, r: 0.03, class: "trial" }));
    if (ellipse) layer.append(shape("ellipse", { rx: ellipse.rx, ry: ellipse.ry, class: "half",
      transform: `translate(${ellipse.x} ${ellipse.y}) rotate(${ellipse.turn})` }));
  }

  /** Where a stone will rest, pale. */
  ghost(place, team = "home") {
    for (const old of this.layers.cloud.querySelectorAll(".ghost")) old.remove();
    if (!place) return;
    const one = this.stone(team);
    one.classList.add("ghost");
    one.setAttribute("transform", `translate(${place.x} ${place.y})`);
    this.layers.cloud.append(one);
    this.sized();
  }

  /** Paths as lines: [{x: [], y: [], kind}]. */
  trace(paths) {
    this.layers.paths.replaceChildren(...paths.map(({ x, y, kind }) => shape("polyline", {
      points: x.map((value, k) => `${value},${y[k]}`).join(" "), class: `path ${kind ?? ""}` })));
  }

  // --- a stone runs ----------------------------------------------------------------------------

  /**
   * Let stones run along their paths: [{stone, team, t, x, y, theta, status}]. `hide` are the ids of
   * the stones that lie there before and move. Resolves when all rest.
   */
  run(paths, { speed = 6, hide = [], follow = true } = {}) {
    this.stop?.();
    const layer = this.layers.moving, last = Math.max(...paths.map((path) => path.t[path.t.length - 1]));
    for (const id of hide) this.stones.get(String(id))?.classList.add("elsewhere");
    const moving = paths.map((path) => {
      const one = this.stone(path.team, path.theta[0]);
      layer.append(one);
      return one;
    });
    this.trace(paths.map((path) => ({ x: [], y: [], kind: path.team })));
    const lines = [...this.layers.paths.children];
    this.sized();
    const home = this.view, watching = follow && !this.zoomed && home === "house" && !calm.matches;
    if (watching) this.show("whole");
    let begun = null, asked = 0, near = !watching;
    const place = (path, t) => {
      const n = path.t.length;
      let k = path.t.findIndex((at) => at >= t);
      if (k === 0) return [0, path.x[0], path.y[0], path.theta[0]];
      if (k < 0) k = n - 1;
      const u = Math.min((t - path.t[k - 1]) / (path.t[k] - path.t[k - 1] || 1), 1);
      const mix = (values) => values[k - 1] + u * (values[k] - values[k - 1]);
      return [k - 1 + u, mix(path.x), mix(path.y), mix(path.theta)];
    };
    const draw = (t) => paths.forEach((path, i) => {
      const [k, x, y, theta] = place(path, t), whole = Math.floor(k) + 1;
      moving[i].setAttribute("transform", `translate(${x} ${y})`);
      moving[i].querySelector(".handle").setAttribute("transform", `rotate(${theta * 180 / Math.PI})`);
      const done = t >= path.t[path.t.length - 1];
      moving[i].classList.toggle("gone", done && path.status !== "rest");
      const points = path.x.slice(0, whole).map((value, j) => `${value},${path.y[j]}`);
      lines[i].setAttribute("points", [...points, `${x},${y}`].join(" "));
      if (!near && path.stone === null && this.direction * y > HOG - 1.5) { near = true; this.show(home); }
    });
    return new Promise((resolve) => {
      const end = () => {
        cancelAnimationFrame(asked);
        if (!near) this.show(home);
        draw(last);
        layer.replaceChildren();
        for (const held of this.stones.values()) held.classList.remove("elsewhere");
        this.stop = null;
        resolve();
      };
      this.stop = end;
      if (calm.matches) { end(); return; }
      const tick = (now) => {
        begun ??= now;
        const t = (now - begun) / 1000 * speed;
        if (t >= last) { end(); return; }
        draw(t);
        asked = requestAnimationFrame(tick);
      };
      asked = requestAnimationFrame(tick);
    });
  }
}

/** Buttons that change what is seen: for those who have neither wheel nor two fingers. */
export function viewButtons(sheet, parent, views = [["house", "House"], ["whole", "Whole sheet"]]) {
  const button = (words, label, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.className = "plain small";
    made.textContent = words;
    if (label) made.setAttribute("aria-label", label);
    made.addEventListener("click", act);
    parent.append(made);
  };
  for (const [view, words] of views) button(words, "", () => sheet.show(view));
  const about = (factor) => {
    const box = sheet.svg.getBoundingClientRect();
    sheet.zoomAbout(box.left + box.width / 2, box.top + box.height / 2, factor);
  };
  button("+", "Zoom in", () => about(1.5));
  button("−", "Zoom out", () => about(1 / 1.5));
}

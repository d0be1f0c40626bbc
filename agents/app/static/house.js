// The house with the places where stones came to rest, both ends as the thrower sees them.

import { RADIUS, Sheet, shape, TEE } from "./sheet.js";

/** A picture of a house with rests: [{number, athlete, colour, right, past}]. */
export function drawHouse(svg, rests, options = {}) {
  const sheet = new Sheet(svg, { editable: true, movable: false, ...options });
  sheet.layers.stones.replaceChildren(...rests.map((one) => shape("circle", {
    cx: one.right, cy: TEE + one.past, r: RADIUS, class: `rest c${one.colour}`, "data-throw": one.number },
    Object.assign(shape("title"), { textContent: `Throw ${one.number}${one.athlete ? `, ${one.athlete}` : ""}` }))));
  return sheet;
}

/** The rest under a place of the sheet: the nearest within a stone's width. */
export function restAt(rests, { x, y }) {
  const far = (one) => Math.hypot(one.right - x, TEE + one.past - y);
  const nearest = [...rests].sort((a, b) => far(a) - far(b))[0];
  return nearest && far(nearest) < 2 * RADIUS ? nearest : null;
}

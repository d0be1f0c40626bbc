// The hands on a picture of the sheet: pointer, fingers, wheel and keys. The picture is in sheet.js.

import { BACK, HOG } from "./sheet.js";

const CLICK = 6; // pixels that a click may slip
const NUDGE = 0.05, SHOVE = 0.005, LEAP = 0.25; // metres: an arrow key, with shift, with ctrl

/** Let a sheet be clicked, dragged, pinched, wheeled and moved by keys. */
export function hold(sheet) {
  const svg = sheet.svg, touching = new Map();
  let drag = null, apart = 0;
  const spread = () => { const [a, b] = [...touching.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
  const middle = () => { const [a, b] = [...touching.values()]; return [(a.x + b.x) / 2, (a.y + b.y) / 2]; };
  svg.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    touching.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (touching.size === 2) { drag = null; apart = spread(); return; }
    const held = sheet.editable ? event.target.closest?.("[data-held]") : null;
    drag = { held, x: event.clientX, y: event.clientY, moved: false, id: event.pointerId };
    if (held) {
      const grip = sheet.under(event), at = sheet.placeOf(held);
      drag.off = { x: at.x - grip.x, y: at.y - grip.y };
      held.focus({ preventScroll: true });
      event.preventDefault();
    }
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    const before = touching.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.x, dy = event.clientY - before.y;
    if (touching.size === 2) {
      const from = middle();
      touching.set(event.pointerId, { x: event.clientX, y: event.clientY });
      const now = spread(), to = middle();
      sheet.moveBy(to[0] - from[0], to[1] - from[1]);
      if (apart > 0 && now > 0) sheet.zoomAbout(...to, now / apart);
      apart = now;
      return;
    }
    touching.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (!drag || drag.id !== event.pointerId) return;
    if (Math.hypot(event.clientX - drag.x, event.clientY - drag.y) > CLICK) drag.moved = true;
    if (!drag.moved) return;
    if (drag.held) {
      if (drag.held.dataset.held === "stone" && !sheet.movable) return;
      const at = sheet.under(event);
      sheet.put(drag.held, { x: at.x + drag.off.x, y: at.y + drag.off.y });
    } else if (sheet.zoomed) sheet.moveBy(dx, dy);
  });
  const up = (event) => {
    touching.delete(event.pointerId);
    if (!drag || drag.id !== event.pointerId) { if (!touching.size) drag = null; return; }
    const { held, moved } = drag;
    drag = null;
    if (event.type === "pointercancel") return;
    if (held && moved && (sheet.movable || held.dataset.held === "target")) sheet.tell(held, true);
    else if (held?.dataset.held === "stone") sheet.send("pick", { id: held.dataset.id });
    else if (!moved) click(sheet, event);
  };
  svg.addEventListener("pointerup", up);
  svg.addEventListener("pointercancel", up);
  // A held stone and two fingers are ours; else one finger scrolls the page until the picture is zoomed.
  svg.addEventListener("touchstart", (event) => { if (sheet.editable && event.target.closest?.("[data-held]")) event.preventDefault(); }, { passive: false });
  svg.addEventListener("touchmove", (event) => { if (event.touches.length > 1) event.preventDefault(); }, { passive: false });
  svg.addEventListener("wheel", (event) => {
    // With the page's own scrolling left alone: a wheel zooms with ctrl, or once it is zoomed.
    if (!event.ctrlKey && !sheet.zoomed && !sheet.wheel) return;
    event.preventDefault();
    sheet.zoomAbout(event.clientX, event.clientY, Math.exp(-event.deltaY / 300));
  }, { passive: false });
  svg.addEventListener("dblclick", () => sheet.show(sheet.view));
  svg.addEventListener("keydown", (event) => key(sheet, event));
}

function click(sheet, event) {
  if (!sheet.editable) return;
  const at = sheet.under(event), d = sheet.direction;
  if (Math.abs(at.x) > sheet.width / 2 || d * at.y < HOG || d * at.y > BACK + sheet.radius) return;
  sheet.send("target", sheet.within(at));
}

function key(sheet, event) {
  const held = event.target.closest?.("[data-held]");
  if (!held || !sheet.editable) return;
  const step = event.shiftKey ? SHOVE : event.ctrlKey || event.metaKey ? LEAP : NUDGE;
  const d = sheet.direction, [across, along] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key] ?? [0, 0];
  const fixed = held.dataset.held === "stone" && !sheet.movable;
  if ((across || along) && !fixed) {
    event.preventDefault();
    const at = sheet.placeOf(held);
    // The arrow points the way the stone goes in the picture.
    const [dx, dy] = sheet.wide ? [along, across] : [across, -along];
    sheet.put(held, { x: at.x + d * dx * step, y: at.y + d * dy * step });
    sheet.tell(held, true);
  } else if ((event.key === "Delete" || event.key === "Backspace") && !fixed) {
    event.preventDefault();
    if (held.dataset.held === "stone") sheet.send("remove", { id: held.dataset.id });
  } else if (event.key === "Enter" || event.key === " ") {
    event.preventDefault();
    if (held.dataset.held === "stone") sheet.send("pick", { id: held.dataset.id });
    else sheet.send("target", sheet.placeOf(held));
  }
}

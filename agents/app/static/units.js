// Lengths and speeds for people, in the units that the club has chosen.

const FOOT = 0.3048;
export const FEET = document.documentElement.dataset.units === "feet";
/** The unit of speed [m/s], and its name. */
export const [SPEED, SPEED_NAME] = FEET ? [FOOT, "ft/s"] : [1, "m/s"];

/** A length: to the centimetre or the inch, without sign. */
export function length(metres) {
  const size = Math.abs(metres), inches = Math.round(size / FOOT * 12);
  if (FEET) return inches < 12 ? `${inches} in` : `${Math.floor(inches / 12)} ft ${inches % 12} in`;
  return size < 0.995 ? `${Math.round(100 * size)} cm` : `${size.toFixed(2)} m`;
}

/** A length as it is typed into a call. */
export const typed = (metres) => (FEET ? `${(metres / FOOT).toFixed(1)}ft` : metres.toFixed(2));

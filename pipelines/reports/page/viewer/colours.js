// Colour maps that are read without telling red from green, and how numbers are written.

const HEX = (text) => text.match(/../g).map((pair) => parseInt(pair, 16));
const LIST = (text) => text.split(" ").map(HEX);
const MAPS = {
  viridis: LIST("440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725"),
  cividis: LIST("00224e 123570 3b496c 575d6d 707173 8a8678 a59c74 c3b369 e1cc55 fee838"),
  magma: LIST("000004 150e37 3b0f70 641a80 8c2981 b73779 de4968 f7705c fe9f6d fecf92 fcfdbf"),
  "blue – red": LIST("0b3c8c 3f6fb5 7fa4d0 bcd2e6 f5f5f5 eecab8 dc9470 bf5b3f 8c1b12"),
};
const WORDS = LIST("4477aa ee6677 228833 ccbb44 66ccee aa3377 e69f00 44aa99 882255 999933 0072b2 d55e00");

export const GREY = [168, 168, 166];
export const mapNames = Object.keys(MAPS);
export const wordColour = (index) => WORDS[index % WORDS.length];
export const fromHex = (text) => HEX(text.replace("#", ""));

/** Colour of a share from 0 to 1 on a map. */
export function colourOf(map, share) {
  const stops = MAPS[map] ?? MAPS.viridis;
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  return stops[low].map((value, k) => Math.round(value + (at - low) * (stops[low + 1][k] - value)));
}

/** The map as a CSS gradient. */
export const gradient = (map) => `linear-gradient(to right, ${(MAPS[map] ?? MAPS.viridis).map((one) => `rgb(${one})`).join(", ")})`;

const SCALED = {
  Pa: [[1e6, "MPa"], [1e3, "kPa"]],
  N: [[1e6, "MN"], [1e3, "kN"]],
  m: [[1, "m"], [1e-3, "mm"], [1e-6, "µm"]],
  "m/s": [[1, "m/s"], [1e-3, "mm/s"]],
};

/** Return the factor and the name of a unit in which a largest value is easy to read. */
export function readable(unit, largest) {
  const steps = SCALED[unit] ?? [];
  const found = steps.find(([factor]) => Math.abs(largest) >= factor) ?? steps.at(-1);
  return found && Math.abs(largest) > 0 ? { factor: found[0], unit: found[1] } : { factor: 1, unit: unit === "-" ? "" : unit };
}

const ROUNDING = { m: 1e-12, N: 1e-6, Pa: 1e-6 }; // what is smaller is what rounding leaves of zero

/** The value, or 0 where rounding alone made it. */
export const withoutRounding = (value, unit) => (Math.abs(value) < (ROUNDING[unit] ?? 0) ? 0 : value);

/** Write a number with four digits in the language of the page. */
export function written(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(digits - 2).replace(".", point());
  return value.toLocaleString(document.documentElement.lang || "en", { maximumSignificantDigits: digits, useGrouping: false });
}

const point = () => (1.5).toLocaleString(document.documentElement.lang || "en")[1];

/** A value with its unit, in one that is easy to read. */
export function quantity(value, unit) {
  const shown = withoutRounding(value, unit), { factor, unit: name } = readable(unit, shown);
  return `${written(shown / factor)}${name ? ` ${name}` : ""}`;
}

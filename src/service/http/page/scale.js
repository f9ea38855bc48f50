// What the colors mean.

/** What no water touches. */
export const DRY = [0.7, 0.72, 0.75];

// nine points of viridis (Smith and van der Walt, CC0), bright where there is much, and a diverging scale for what has a sign
const SEQUENTIAL = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const DIVERGING = ["#2166ac", "#67a9cf", "#d1e5f0", "#f7f7f7", "#fddbc7", "#ef8a62", "#b2182b"];

const size = (v) => Math.hypot(...v);

/** Each quantity: its name, its unit, whether it has a sign, and its value on a surface; `surface` tells the surfaces apart. */
export const QUANTITIES = {
  force: { label: "force |F|", unit: "N", of: (s) => size(s.force) },
  fx: { label: "force along x", unit: "N", signed: true, of: (s) => s.force[0] },
  fy: { label: "force along y", unit: "N", signed: true, of: (s) => s.force[1] },
  fz: { label: "force along z", unit: "N", signed: true, of: (s) => s.force[2] },
  stress: { label: "|F| over area of the surface", unit: "Pa", of: (s) => size(s.force) / s.area },
  wet: { label: "wetted fraction", unit: "", top: 1, of: (s) => s.wet },
  surface: { label: "which surface", unit: "", apart: true, of: () => 0 },
};

const stops = (quantity) => (quantity.signed ? DIVERGING : SEQUENTIAL);

export const gradient = (quantity) => `linear-gradient(to right, ${stops(quantity).join(",")})`;

/** A probability. */
export const PROBABILITY = { label: "probability", unit: "", top: 1 };

/** The smallest of these steps times a power of ten that is not below the value. */
export function roundUp(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((step) => step * power).find((step) => step >= value * (1 - 1e-9));
}

/** The end of the scale for these surfaces. */
export const topOf = (quantity, surfaces) =>
  quantity.top ?? roundUp(Math.max(...surfaces.map((s) => Math.abs(quantity.of(s)))));

/** Red, green and blue of a value, each from 0 to 1. */
export function colorOf(quantity, value, top) {
  const colors = stops(quantity);
  const share = quantity.signed ? (value / top + 1) / 2 : value / top;
  const at = Math.min(Math.max(share, 0), 1) * (colors.length - 1);
  const low = Math.min(Math.floor(at), colors.length - 2);
  const channel = (color, k) => parseInt(color.slice(1 + 2 * k, 3 + 2 * k), 16) / 255;
  const mix = (k) => channel(colors[low], k) * (low + 1 - at) + channel(colors[low + 1], k) * (at - low);
  return [mix(0), mix(1), mix(2)];
}

/** A color of its own for each of many: hues a golden angle apart, light and dark in turn for eyes that see few hues. */
export function colorOfIndex(index) {
  const [hue, light] = [(137.5 * index) % 360, [0.62, 0.45, 0.75][index % 3]];
  const channel = (shift) => {
    const k = (shift + hue / 30) % 12;
    return light - 0.6 * Math.min(light, 1 - light) * Math.max(-1, Math.min(k - 3, 9 - k, 1));
  };
  return [channel(0), channel(8), channel(4)];
}

export const css = ([r, g, b]) => `rgb(${[r, g, b].map((x) => Math.round(255 * x)).join(",")})`;

/** A number for people: without an exponent, with at most three digits after the point. */
export const short = (value) => String(+value.toPrecision(3));

/** The numbers under the scale. */
export const ticks = (quantity, top) => {
  const from = quantity.signed ? -top : 0;
  return [0, 0.25, 0.5, 0.75, 1].map((share) => short(from + share * (top - from)));
};

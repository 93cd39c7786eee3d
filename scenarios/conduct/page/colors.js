// Colours of oil by thickness (Bonn Agreement Oil Appearance Code up to 0.2 mm, browns above), and of booms by what they bear.
import { KNOT } from "./units.js";

export const AFLOAT = 0, HELD = 1, LOST = 2, ASHORE = 3;
export const OIL_CLASSES = [
  { from: 0, words: "sheen", color: "#b8c3c9", opacity: .55 },
  { from: 0.3e-6, words: "rainbow", color: "#b79ac8", opacity: .6 },
  { from: 5e-6, words: "metallic", color: "#7f95a3", opacity: .65 },
  { from: 50e-6, words: "0.05 mm", color: "#b08d57", opacity: .7 },
  { from: 200e-6, words: "0.2 mm", color: "#8f6430", opacity: .75 },
  { from: 1e-3, words: "1 mm", color: "#63421d", opacity: .8 },
  { from: 10e-3, words: "10 mm", color: "#3d2710", opacity: .85 },
  { from: 50e-3, words: "50 mm", color: "#1d1207", opacity: .9 },
];
export function oilClass(thickness) {
  let found = 0;
  while (found + 1 < OIL_CLASSES.length && thickness >= OIL_CLASSES[found + 1].from) found++;
  return found;
}
export const NORMAL_CLASSES = [
  { from: 0, words: "below 0.6 kn", color: "#2fae76" },
  { from: 0.6, words: "0.6 kn", color: "#f2c230" },
  { from: 0.7, words: "0.7 kn: loses oil", color: "#ee6c1a" },
  { from: 1.0, words: "1 kn", color: "#b3001e" },
];
export const normalColor = (speed) => NORMAL_CLASSES.findLast((one) => speed / KNOT >= one.from).color;
const TENSION = [[255, 236, 150], [255, 186, 60], [246, 112, 20], [200, 24, 30], [110, 0, 40]]; // as in the recording
export function tensionColor(tension, full) {
  if (tension == null) return "#8fa3af";
  const place = Math.min(Math.max(tension / full, 0), 1) * (TENSION.length - 1), low = Math.min(Math.floor(place), TENSION.length - 2);
  return `rgb(${TENSION[low].map((part, k) => Math.round(part + (place - low) * (TENSION[low + 1][k] - part))).join(",")})`;
}

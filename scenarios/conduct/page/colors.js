// Colours of oil by thickness, which the scene brings, and of booms by what they bear.
import { KNOT } from "./units.js";

// The class of a film among those of the scene, by its thickness [m].
export function filmClass(films, thickness) {
  let found = 0;
  while (found + 1 < films.length && thickness >= films[found + 1].from) found++;
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

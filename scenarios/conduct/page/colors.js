// Colours of oil by thickness, which the scene brings, and of booms by what they bear; and the legend of both.
import { KNOT, force } from "./units.js";

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

const escape = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
const strip = (title, cells) => `<dl><dt>${title}</dt>${cells.map(([color, words]) => `<dd><i style="background:${color}"></i>${escape(words)}</dd>`).join("")}</dl>`;

// The legend stands below the plan, so that it hides nothing.
export function showLegend(place, scene, boomBy) {
  const full = scene.booms[0]?.full_tension, parts = [0, 0.25, 0.5, 0.75, 1];
  const byNormal = NORMAL_CLASSES.map((one) => [one.color, one.words]), byTension = parts.map((part) => [tensionColor(part * full, full), force(part * full).split(" (")[0]]);
  const booms = scene.booms.length ? strip(boomBy === "normal" ? "Water against the boom" : "Tension of the boom", boomBy === "normal" ? byNormal : byTension) : "";
  const lost = ["#de2020", `lost: 1 m² for ${1000 * scene.spot_thickness} litres`];
  place.innerHTML = booms + strip("Oil, no spot below 2 px", [...scene.films.map((one) => [one.color, one.words]), lost]);
}

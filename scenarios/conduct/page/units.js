// Quantities as people at sea read them; all that arrives is in SI units, directions in radians counter-clockwise from +x.
export const KNOT = 1852 / 3600;
export const knots = (speed, digits = 2) => speed == null ? "–" : `${(speed / KNOT).toFixed(digits)} kn`;
export const compass = (direction, bearing) => ((bearing - direction) * 180 / Math.PI % 360 + 360) % 360;
export const course = (direction, bearing) => direction == null ? "–" : String(Math.round(compass(direction, bearing)) % 360).padStart(3, "0");
export const direction = (degrees, bearing) => bearing - degrees * Math.PI / 180;
export const figures = (number) => number === 0 ? "0" : Number(number.toPrecision(3)).toLocaleString("en", { maximumFractionDigits: 6 });
export const volume = (cubic) => cubic == null ? "–" : Math.abs(cubic) >= 1 ? `${figures(cubic)} m³` : `${figures(1000 * cubic)} litres`;
export const perHour = (rate) => `${figures(3600 * rate)} m³/h`;
// A volume of oil, and its share of another in per cent where there is one: "20 litres, 5.7 %".
export const shareOf = (part, whole) => volume(part) + (whole > 0 && part > 0 ? `, ${figures(100 * part / whole)} %` : "");
// "engine stopped", or "port engine stopped" for one of two; empty for engines that run.
export const engineFault = (state) => state === "running" ? "" : `${state.slice(0, -"stopped".length)}engine stopped`;
export function force(newton) {
  if (newton == null) return "–";
  const tonnes = newton >= 1000 ? ` (${figures(newton / 9806.65)} t)` : "";
  return newton >= 100 ? `${figures(newton / 1000)} kN${tonnes}` : `${figures(newton)} N`;
}
export function clock(seconds) {
  const whole = Math.floor(seconds / 60);
  return `${whole}:${(seconds - 60 * whole).toFixed(1).padStart(4, "0")}`;
}
// The size of the page's letters over that on a screen of 1280 px: what is drawn grows with it, so that a projector's picture is read from afar.
export const rootUnit = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 15;

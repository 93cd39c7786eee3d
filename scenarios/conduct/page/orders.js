// Settings of orders that follow from the state; nothing here touches the page.

// Waves of a height [m] and a period [s], of which one may be left out: the present ones, or new ones, which run with the wind where one blows.
export function waves(weather, height, seconds) {
  const known = weather?.waves;
  if (known) return [[known.key, known.height, height], [known.period_key, known.period, seconds]].filter(([, old, wanted]) => Number.isFinite(wanted) && wanted !== old).map(([key, , wanted]) => `sea.waves.${key}=${wanted}`);
  const period = seconds || Math.max(2, 5 * Math.sqrt(height)).toFixed(1);
  const way = weather?.wind?.direction == null ? "" : `,direction=${weather.wind.direction}`;
  return [`sea.waves={kind="regular",height=${height},period=${period}${way}}`];
}

// Orders as they are typed: KEY=VALUE, several with a space between.
export const settings = (text) => text.split(/\s+(?=[\w.-]+=)/).map((one) => one.trim()).filter(Boolean);

// What the helmsmen keep in a state, as orders that a trainer changes: course and speed of each vessel that has them.
export function heldOrders(state, compass, knot) {
  const kept = Object.entries(state?.vessels ?? {}).filter(([, { ordered }]) => ordered && !ordered.by_hand);
  return kept.map(([name, { ordered }]) => `vessels.${name}.legs=[{speed_kn=${(ordered.speed / knot).toFixed(2)},heading_compass=${Math.round(compass(ordered.heading))}}]`).join(" ");
}

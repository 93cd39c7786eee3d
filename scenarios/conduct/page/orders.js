// Settings of orders that follow from the state; nothing here touches the page.

// Waves of a height [m]: the present ones, or new ones, which run with the wind where one blows.
export function waves(table, weather, height) {
  if (weather?.waves) return [`${table}.waves.${weather.waves.key}=${height}`];
  const kind = table === "sea" ? 'kind="regular",' : "", period = Math.max(2, 5 * Math.sqrt(height)).toFixed(1);
  const way = weather?.wind?.direction == null ? "" : `,direction=${weather.wind.direction}`;
  return [`${table}.waves={${kind}height=${height},period=${period}${way}}`];
}

// Settings of orders that follow from the state; nothing here touches the page.

// Waves of a height [m]: the present ones, or new ones, which run with the wind where one blows.
export function waves(weather, height) {
  if (weather?.waves) return [`sea.waves.${weather.waves.key}=${height}`];
  const period = Math.max(2, 5 * Math.sqrt(height)).toFixed(1);
  const way = weather?.wind?.direction == null ? "" : `,direction=${weather.wind.direction}`;
  return [`sea.waves={kind="regular",height=${height},period=${period}${way}}`];
}

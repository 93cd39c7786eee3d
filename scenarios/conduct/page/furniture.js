// What stands in the corners of a plan: north arrow, scale bar, arrows of current, wind and waves.
import { compass, course, knots } from "./units.js";

const INK = "#14232e";

export function drawFurniture(pen, view) {
  drawNorth(pen, view.width - 36, 44);
  drawScale(pen, view.scale, view.width - 20, view.height - 22);
  drawWeather(pen, view, 14, 14);
}

function panel(pen, left, top, width, height) {
  pen.fillStyle = "rgba(255,255,255,.86)";
  pen.beginPath(); pen.roundRect(left, top, width, height, 6); pen.fill();
}

function write(pen, words, left, top, weight = 400, align = "left") {
  pen.font = `${weight} 12px system-ui, 'DejaVu Sans', sans-serif`;
  pen.textAlign = align; pen.textBaseline = "middle"; pen.fillStyle = INK;
  pen.fillText(words, left, top);
}

function drawNorth(pen, left, top) {
  panel(pen, left - 18, top - 34, 36, 62);
  pen.fillStyle = INK;
  pen.beginPath(); pen.moveTo(left, top - 14); pen.lineTo(left + 8, top + 18); pen.lineTo(left, top + 11); pen.lineTo(left - 8, top + 18); pen.fill();
  write(pen, "N", left, top - 23, 700, "center");
}

function drawScale(pen, scale, right, bottom) {
  const most = 140 / scale, power = 10 ** Math.floor(Math.log10(most)), metres = [5, 2, 1].find((one) => one * power <= most) * power;
  const long = metres * scale;
  panel(pen, right - long - 12, bottom - 26, long + 24, 36);
  pen.strokeStyle = INK; pen.lineWidth = 2;
  pen.beginPath(); pen.moveTo(right - long, bottom - 4); pen.lineTo(right - long, bottom + 2); pen.lineTo(right, bottom + 2); pen.lineTo(right, bottom - 4); pen.stroke();
  write(pen, metres >= 1000 ? `${metres / 1000} km` : `${metres} m`, right - long / 2, bottom - 14, 600, "center");
}

function drawWeather(pen, view, left, top) {
  const { current, wind, waves } = view.state.weather, bearing = view.scene.bearing, rows = [];
  if (wind) rows.push(["wind", wind.direction, wind.speed == null ? "from a table" : `${knots(wind.speed, 0)} from ${course(wind.direction + Math.PI, bearing)}`, "#0b5c8a"]);
  if (current) rows.push(["current", current.direction, current.speed == null ? "from a table" : `${knots(current.speed)} towards ${course(current.direction, bearing)}`, "#17734a"]);
  if (waves) rows.push(["waves", waves.direction, `${Number(waves.height.toFixed(2))} m, ${Number(waves.period.toFixed(1))} s, from ${course(waves.direction + Math.PI, bearing)}`, "#5b4a9c"]);
  const seen = view.state.weather.visibility;
  if (seen < 10000) rows.push(["sight", null, seen < 1000 ? `${Math.round(seen)} m` : `${(seen / 1000).toFixed(1)} km`, INK]);
  if (!rows.length) return;
  panel(pen, left, top, 246, 12 + 32 * rows.length);
  rows.forEach(([name, direction, words, color], index) => {
    const middle = top + 22 + 32 * index;
    if (direction != null) arrow(pen, left + 22, middle, compass(direction, bearing) * Math.PI / 180, color);
    write(pen, name, left + 44, middle, 600);
    write(pen, words, left + 98, middle);
  });
}

function arrow(pen, left, top, turn, color) {
  pen.save();
  pen.translate(left, top); pen.rotate(turn);
  pen.strokeStyle = pen.fillStyle = color; pen.lineWidth = 2.5;
  pen.beginPath(); pen.moveTo(0, 12); pen.lineTo(0, -5); pen.stroke();
  pen.beginPath(); pen.moveTo(0, -13); pen.lineTo(6, -3); pen.lineTo(-6, -3); pen.fill();
  pen.restore();
}

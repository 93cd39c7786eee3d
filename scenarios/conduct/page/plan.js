// The plan view: north up, drawn on a canvas from the latest state.
import { compass, engineFault, knots, rootUnit } from "./units.js";
import { filmClass, normalColor, tensionColor } from "./colors.js";
import { drawEquipment } from "./equipment.js";
import { drawFurniture } from "./furniture.js";

const LEAST = 1; // px, radius of the smallest spot of oil: the legend says so
const LEAST_VESSEL = 16; // px, so that a vessel is seen from far

export class PlanView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.center = [0, 0]; // east and north [m] in the middle of the view
    this.scale = 2; // px a metre
    this.follows = true;
    this.boomBy = "normal";
    this.pin = null; // a place [m] that the instructor has chosen
    this.own = null; // the vessel in the middle, on its crew's page
    this.tracks = {};
    this.unit = 1;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen();
  }

  begin(scene) {
    this.scene = scene;
    this.tracks = {};
    const [sine, cosine] = [Math.sin(scene.bearing), Math.cos(scene.bearing)];
    this.toMap = (x, y) => [x * sine - y * cosine, x * cosine + y * sine];
    this.isFitted = false;
    this.chart = null;
    if (!scene.chart) return;
    const image = new Image();
    image.onload = () => { this.chart = image; this.redraw(); };
    image.src = scene.chart.image;
  }

  remember(name, x, y) {
    const track = this.tracks[name] ??= [];
    const last = track.at(-1);
    if (!last || Math.hypot(last[0] - x, last[1] - y) > 0.5) track.push([x, y]);
    if (track.length > 4000) this.tracks[name] = track.filter((_, index) => index % 2 === 0);
  }

  // Shows a state; of the past, it adds nothing to the tracks.
  show(state, isPast = false) {
    this.state = state;
    if (!isPast) for (const [name, vessel] of Object.entries(state.vessels)) this.remember(name, vessel.x, vessel.y);
    this.redraw();
  }

  redraw() {
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => { this.isAsked = false; if (this.scene && this.state) this.draw(); });
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
    this.unit = rootUnit();
    this.isFitted = this.isFitted && !this.follows;
    this.redraw();
  }

  // The size of the view, in units of which all that it shows grows with the page's letters.
  get width() { return this.canvas.clientWidth / this.unit; }
  get height() { return this.canvas.clientHeight / this.unit; }

  // Points of the exercise itself: vessels and booms.
  points() {
    const found = Object.values(this.state.vessels).map((vessel) => this.toMap(vessel.x, vessel.y));
    for (const { x, y } of Object.values(this.state.skimmers)) found.push(this.toMap(x, y));
    for (const { ends } of Object.values(this.state.lines)) found.push(...ends.map(([x, y]) => this.toMap(x, y)));
    for (const boom of Object.values(this.state.booms)) found.push(...boom.line.map(([x, y]) => this.toMap(x, y)));
    if (!found.length) found.push(this.toMap(this.scene.bounds[0], this.scene.bounds[1]), this.toMap(this.scene.bounds[2], this.scene.bounds[3]));
    return found;
  }

  // The oil near the points of the exercise, for a view that holds both.
  nearOil(low, high) {
    const near = [], room = 0.6 * Math.max(high[0] - low[0], high[1] - low[1]), spots = this.spots ?? [];
    for (let k = 0; k < spots.length; k += 5) {
      const [east, north] = this.toMap(spots[k], spots[k + 1]);
      if (east > low[0] - room && east < high[0] + room && north > low[1] - room && north < high[1] + room) near.push([east, north]);
    }
    return near;
  }

  // The corners [m], low and high, of the vessels, the booms and the oil near them.
  limits() {
    const own = bounds(this.points());
    return bounds([...own, ...this.nearOil(...own)]);
  }

  fit() {
    const [low, high] = this.limits();
    const middle = this.middle(), span = [0, 1].map((axis) => 2 * Math.max(middle[axis] - low[axis], high[axis] - middle[axis], 1e-3));
    this.scale = 0.76 * Math.min((this.width - 60) / span[0], (this.height - 60) / span[1]);
    this.center = middle;
    this.isFitted = true;
  }

  middle() {
    const own = this.own && this.state.vessels[this.own];
    return own ? this.toMap(own.x, own.y) : middleOf(...this.limits());
  }

  at(x, y) {
    const [east, north] = this.toMap(x, y);
    return [this.width / 2 + (east - this.center[0]) * this.scale, this.height / 2 - (north - this.center[1]) * this.scale];
  }

  // The place in the world [m] at a point of the canvas [px].
  placeAt(left, top) {
    const east = this.center[0] + (left / this.unit - this.width / 2) / this.scale, north = this.center[1] + (this.height / 2 - top / this.unit) / this.scale;
    const [sine, cosine] = [Math.sin(this.scene.bearing), Math.cos(this.scene.bearing)];
    return [east * sine + north * cosine, north * sine - east * cosine];
  }

  drawPin(pen) {
    const [left, top] = this.at(...this.pin);
    pen.strokeStyle = "#a8231c"; pen.lineWidth = 2.5;
    pen.beginPath(); pen.moveTo(left - 9, top); pen.lineTo(left + 9, top); pen.moveTo(left, top - 9); pen.lineTo(left, top + 9); pen.arc(left, top, 6, 0, 7); pen.stroke();
  }

  draw() {
    if (!this.canvas.clientWidth) return;
    if (!this.isFitted) this.fit();
    if (this.follows) this.center = this.middle();
    const ratio = (window.devicePixelRatio || 1) * this.unit, pen = this.context;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = "#dcebf2";
    pen.fillRect(0, 0, this.width, this.height);
    if (this.chart) this.drawChart(pen);
    for (const { outline, depth } of this.scene.land) {
      const tint = depth ? "127,176,208" : "227,211,172";
      this.polygon(pen, outline, `rgba(${tint},${this.chart ? 0.3 : 1})`, depth ? "#7fa8c0" : "#a58f5b");
      if (depth) label(pen, `${depth} m`, ...this.at(...meanOf(outline)));
    }
    this.drawOil(pen);
    drawFurniture(pen, this); // below all that floats, so that it hides none of it
    for (const outline of Object.values(this.scene.bodies)) this.polygon(pen, outline, "#b9ae9c", "#6f6555");
    for (const boom of this.scene.booms) if (boom.area.length) this.polygon(pen, boom.area, "rgba(23,115,74,.12)", "#17734a");
    for (const [name, outlines] of Object.entries(this.scene.areas)) {
      for (const outline of outlines) this.polygon(pen, outline, "rgba(23,115,74,.12)", "#17734a");
      label(pen, name, ...this.at(...meanOf(outlines[0])));
    }
    this.drawTracks(pen);
    for (const boom of this.scene.booms) this.drawBoom(pen, boom, this.state.booms[boom.name]);
    drawEquipment(pen, this);
    for (const vessel of this.scene.vessels) this.drawVessel(pen, vessel, this.state.vessels[vessel.name]);
    if (this.pin) this.drawPin(pen);
    if (this.own) this.drawVeil(pen, this.state.vessels[this.own]);
  }

  // The chart of the site, somewhat faint: what floats is to be seen first.
  drawChart(pen) {
    const { origin: [x, y], along: [east, north] } = this.scene.chart;
    const [left, top] = this.at(x, y), [right, low] = this.at(x + east, y + north);
    pen.save();
    pen.globalAlpha = 0.8;
    pen.imageSmoothingQuality = "high";
    pen.transform(right - left, low - top, top - low, right - left, left, top);
    pen.drawImage(this.chart, 0, 0);
    pen.restore();
  }

  // Fog, or night: what a crew does not see from its vessel.
  drawVeil(pen, own) {
    const [left, top] = this.at(own.x, own.y), radius = this.state.weather.visibility * this.scale;
    if (radius > Math.hypot(this.width, this.height)) return;
    pen.fillStyle = "rgba(196,206,212,.97)";
    pen.beginPath(); pen.rect(0, 0, this.width, this.height); pen.arc(left, top, radius, 0, 2 * Math.PI); pen.fill("evenodd");
    drawFurniture(pen, this);
  }

  polygon(pen, outline, fill, stroke) {
    pen.beginPath();
    outline.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](...this.at(x, y)));
    pen.closePath();
    pen.fillStyle = fill; pen.fill();
    pen.strokeStyle = stroke; pen.lineWidth = 1.2; pen.stroke();
  }

  drawOil(pen) {
    const spots = this.spots ?? new Float32Array(0), films = this.scene.films, groups = films.map(() => new Path2D()), lost = new Path2D(), ashore = new Path2D(), fates = this.scene.fates;
    for (let k = 0; k < spots.length; k += 5) {
      const [left, top] = this.at(spots[k], spots[k + 1]), size = Math.max(spots[k + 2] * this.scale, LEAST);
      if (left < -size || top < -size || left > this.width + size || top > this.height + size) continue;
      const path = fates[spots[k + 4]] === "stranded" ? ashore : groups[filmClass(films, spots[k + 3])];
      if (size < 2.5) path.rect(left - size, top - size, 2 * size, 2 * size);
      else { path.moveTo(left + size, top); path.arc(left, top, size, 0, 7); }
      if (fates[spots[k + 4]].startsWith("lost_")) { // its film, and on it a spot of its volume
        const mark = Math.max(spots[k + 2] * Math.sqrt(spots[k + 3] / this.scene.spot_thickness) * this.scale, LEAST);
        lost.moveTo(left + mark, top); lost.arc(left, top, mark, 0, 7);
      }
    }
    groups.forEach((path, index) => { pen.fillStyle = films[index].color; pen.globalAlpha = films[index].opacity; pen.fill(path); });
    pen.globalAlpha = 1;
    pen.fillStyle = "#5a1d6b"; pen.fill(ashore);
    pen.fillStyle = "#de2020"; pen.fill(lost);
  }

  drawTracks(pen) {
    pen.setLineDash([5, 5]);
    pen.strokeStyle = "#5f7886"; pen.lineWidth = 1.3;
    for (const track of Object.values(this.tracks)) {
      pen.beginPath();
      track.forEach(([x, y], index) => pen[index ? "lineTo" : "moveTo"](...this.at(x, y)));
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  drawBoom(pen, boom, state) {
    const line = state.line.map(([x, y]) => this.at(x, y));
    this.drawTowLines(pen, boom, line);
    pen.lineCap = "butt";
    for (const [color, width] of [["#14232e", 7], [null, 4.5]]) {
      for (let k = 0; k + 1 < line.length; k++) {
        const parts = state.parted;
        pen.beginPath();
        pen.moveTo(...(parts.includes(k) ? between(line[k], line[k + 1], 0.35) : line[k]));
        pen.lineTo(...(parts.includes(k + 1) ? between(line[k], line[k + 1], 0.65) : line[k + 1]));
        pen.strokeStyle = color ?? (this.boomBy === "normal" ? normalColor(state.normal[k]) : tensionColor(state.tension[k], boom.full_tension));
        pen.lineWidth = width;
        pen.stroke();
      }
    }
  }

  drawTowLines(pen, boom, line) {
    pen.strokeStyle = "#14232e"; pen.lineWidth = 1.6;
    boom.ends.forEach((name, index) => {
      const vessel = this.state.vessels[name], size = this.scene.vessels.find((one) => one.name === name);
      if (!vessel) return;
      const back = -0.4 * size.length;
      pen.beginPath();
      pen.moveTo(...this.at(vessel.x + back * Math.cos(vessel.heading), vessel.y + back * Math.sin(vessel.heading)));
      pen.lineTo(...(index ? line.at(-1) : line[0]));
      pen.stroke();
    });
  }

  drawVessel(pen, vessel, state) {
    const [left, top] = this.at(state.x, state.y), turn = compass(state.heading, this.scene.bearing) * Math.PI / 180;
    const length = Math.max(vessel.length * this.scale, LEAST_VESSEL), beam = length * vessel.beam / vessel.length;
    const fault = engineFault(state.engine);
    pen.save();
    pen.translate(left, top); pen.rotate(turn);
    pen.beginPath();
    pen.moveTo(0, -length / 2);
    pen.quadraticCurveTo(beam / 2, -length / 4, beam / 2, 0);
    pen.lineTo(beam / 2, length / 2); pen.lineTo(-beam / 2, length / 2); pen.lineTo(-beam / 2, 0);
    pen.quadraticCurveTo(-beam / 2, -length / 4, 0, -length / 2);
    pen.fillStyle = fault ? "#a8231c" : vessel.name === this.own ? "#0b5c8a" : "#22345c"; pen.fill();
    pen.strokeStyle = "#ffffff"; pen.lineWidth = 1; pen.stroke();
    pen.restore();
    const words = `${vessel.name} ${knots(state.over_ground, 1)}${fault && `, ${fault}`}`;
    label(pen, words, Math.min(left + 12, this.width - 10 - 7 * words.length), top - beam / 2 - 8);
  }

  listen() {
    let held = null;
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { held = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      this.move((held[0] - event.clientX) / this.unit / this.scale, (event.clientY - held[1]) / this.unit / this.scale);
      held = [event.clientX, event.clientY];
    });
    canvas.addEventListener("dblclick", (event) => {
      if (!this.scene || this.own) return;
      this.pin = this.placeAt(event.offsetX, event.offsetY);
      this.onPin?.(this.pin);
      this.redraw();
    });
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(-event.deltaY / 600)); }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = 40 / this.scale, moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      if (moves[event.key]) { this.move(...moves[event.key]); event.preventDefault(); event.stopPropagation(); }
    });
  }

  move(east, north) {
    this.setFollow(false);
    this.center = [this.center[0] + east, this.center[1] + north];
    this.redraw();
  }

  zoom(factor) {
    this.scale = Math.min(Math.max(this.scale * factor, 0.02), 400);
    this.redraw();
  }

  setFollow(wanted) {
    this.follows = wanted;
    this.onFollow?.(wanted);
    this.redraw();
  }
}

const meanOf = (points) => points.reduce(([x, y], one) => [x + one[0] / points.length, y + one[1] / points.length], [0, 0]);
const middleOf = (low, high) => [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
function bounds(points) {
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (const point of points) for (const axis of [0, 1]) { low[axis] = Math.min(low[axis], point[axis]); high[axis] = Math.max(high[axis], point[axis]); }
  return [low, high];
}
const between = (a, b, part) => [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])];

export function label(pen, words, left, top) {
  pen.font = "600 12px system-ui, 'DejaVu Sans', sans-serif";
  pen.textAlign = "left"; pen.textBaseline = "middle";
  pen.lineWidth = 3.5; pen.strokeStyle = "rgba(255,255,255,.85)"; pen.lineJoin = "round";
  pen.strokeText(words, left, top);
  pen.fillStyle = "#14232e"; pen.fillText(words, left, top);
}

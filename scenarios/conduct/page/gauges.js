// Gauges of each boom, and diagrams of the run so far.
import uPlot from "./vendor/uPlot.esm.js";
import { skimmerGauges } from "./equipment.js";
import { KNOT, force, knots, rootUnit, shareOf, volume } from "./units.js";

const entry = (title, value, extra = "", state = "") => `<dl class="gauge ${state}"><dt>${title}</dt><dd>${value}${extra}</dd></dl>`;
const meter = (value, most, title) => `<meter min="0" max="${most}" value="${Math.min(value ?? 0, most)}" aria-label="${title}"></meter>`;
const escape = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);

export function showGauges(place, scene, state) {
  const booms = scene.booms.map((boom) => boomGauges(boom, state.booms[boom.name], scene)), skimmers = Object.entries(state.skimmers).map(([name, one]) => skimmerGauges(name, one));
  place.innerHTML = [...booms, ...skimmers].join("") || "<p class='quiet'>This exercise has no boom.</p>";
}

function boomGauges(boom, state, scene) {
  const held = state.normal_speed_held, limit = scene.speeds.limit;
  const pulls = Object.entries(state.pull).map(([end, pull]) => entry(`Pull at ${escape(end)}`, force(pull), meter(pull, boom.full_tension, `Pull at ${escape(end)}`), pull > boom.full_tension ? "bad" : ""));
  const causes = Object.entries(state.lost).filter(([, lost]) => lost > 0).map(([cause, lost]) => {
    const known = scene.causes[cause] ?? { words: cause, color: "#888" };
    return `<li><i style="background:${known.color}"></i>${volume(lost)} ${escape(known.words)}</li>`;
  });
  return `<div class="boom"><h2>Boom ${escape(boom.name)}${scene.modelled ? ", losses modelled" : ""}</h2>
    ${entry("Speed through the water", knots(state.tow_speed))}
    ${entry("Water against the boom", knots(held), meter(held, 2 * limit, "Water against the boom"), held > limit ? "bad" : held > 0.85 * limit ? "warn" : "")}
    ${entry("Gap, of the length", state.gap_ratio == null ? "–" : `${Math.round(100 * state.gap_ratio)} %`)}
    ${pulls.join("")}
    ${entry("Oil held", volume(state.oil_contained))}
    ${state.led_on == null ? "" : entry("Led on past its end", volume(state.led_on))}
    ${entry("Oil lost", shareOf(state.oil_lost, state.oil_met), "", state.oil_lost > 0 ? "warn" : "")}
    <ul class="causes">${causes.join("")}</ul></div>`;
}

export class Charts {
  constructor(place) { this.place = place; this.rows = []; }

  begin(scene, rows) {
    this.rows = [...rows];
    this.boom = scene.booms[0]?.name;
    this.place.replaceChildren();
    if (!this.boom) return;
    this.oil = this.chart("Oil, m³", [["held", "#63421d"], ["lost", "#a8231c"]]);
    this.speed = this.chart("Speed, kn", [["through water", "#0b5c8a"], ["against boom", "#c2410c"]]);
    this.refresh();
  }

  chart(title, series) {
    const box = document.createElement("div");
    box.className = "chart";
    box.innerHTML = `<h2>${title}</h2>`;
    this.place.append(box);
    const unit = rootUnit(), font = `${11 * unit}px system-ui`;
    const size = () => ({ width: Math.max(box.clientWidth, 160), height: 128 * unit });
    const plot = new uPlot({
      ...size(), cursor: { sync: { key: "run" } }, legend: { show: true, live: false },
      scales: { x: { time: false } },
      axes: [{ size: 26 * unit, font }, { size: 44 * unit, font }],
      series: [{ label: "s" }, ...series.map(([label, stroke]) => ({ label, stroke, width: 2, points: { show: false } }))],
    }, [[], ...series.map(() => [])], box);
    new ResizeObserver(() => plot.setSize(size())).observe(box);
    return plot;
  }

  add(state) {
    if (!this.boom || (this.rows.length && state.time - this.rows.at(-1).time < 0.5)) return;
    this.rows.push({ time: state.time, booms: state.booms });
    if (this.rows.length > 3000) this.rows = this.rows.filter((_, index) => index % 2 === 0);
    this.refresh();
  }

  refresh() {
    const times = this.rows.map((row) => row.time), of = (key, factor = 1) => this.rows.map((row) => row.booms[this.boom]?.[key] == null ? null : row.booms[this.boom][key] * factor);
    this.oil.setData([times, of("oil_contained"), of("oil_lost")]);
    this.speed.setData([times, of("tow_speed", 1 / KNOT), of("normal_speed_held", 1 / KNOT)]);
  }
}

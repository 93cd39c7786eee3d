// Skimmers, mooring legs and ties: on the plan, in gauges, and the orders to them.
import { perHour, volume } from "./units.js";
import { label } from "./plan.js";

const INK = "#14232e", GONE = "#8a9aa4", WORKING = "#17734a", STANDING = "#a8231c";
const fillOf = (skimmer) => (skimmer.oil_aboard + skimmer.water_aboard) / skimmer.storage;
const percent = (part) => `${Math.round(100 * part)} %`;

export function drawEquipment(pen, view) {
  for (const line of Object.values(view.state.lines)) drawLine(pen, view, line);
  for (const [name, skimmer] of Object.entries(view.state.skimmers)) drawSkimmer(pen, view, name, skimmer);
}

function drawLine(pen, view, { name, kind, ends, holds, dragged }) {
  const [top, foot] = ends.map(([x, y]) => view.at(x, y));
  pen.strokeStyle = holds ? INK : GONE; pen.lineWidth = 1.4;
  pen.setLineDash(holds ? [] : [3, 4]);
  pen.beginPath(); pen.moveTo(...top); pen.lineTo(...foot); pen.stroke();
  pen.setLineDash([]);
  if (kind !== "mooring") return;
  drawAnchor(pen, ...foot);
  label(pen, dragged > 0.5 ? `${name}, dragged ${dragged.toFixed(1)} m` : name, foot[0] + 9, foot[1] + 9);
}

// A shank with a ring, and two flukes.
function drawAnchor(pen, left, top) {
  pen.strokeStyle = INK; pen.lineWidth = 2;
  pen.beginPath(); pen.arc(left, top - 7, 2.2, 0, 7); pen.moveTo(left, top - 5); pen.lineTo(left, top + 7); pen.stroke();
  pen.beginPath(); pen.arc(left, top, 7, 0.15 * Math.PI, 0.85 * Math.PI); pen.stroke();
}

// The mouth at its size, green while it works and red where it stands, and beside it the fill of its tank.
function drawSkimmer(pen, view, name, skimmer) {
  const [left, top] = view.at(skimmer.x, skimmer.y), radius = Math.max(0.5 * skimmer.swath * view.scale, 6), color = skimmer.stands ? STANDING : WORKING;
  pen.beginPath(); pen.arc(left, top, radius, 0, 7);
  pen.fillStyle = "rgba(255,255,255,.35)"; pen.fill();
  pen.strokeStyle = "#ffffff"; pen.lineWidth = 5; pen.stroke();
  pen.strokeStyle = color; pen.lineWidth = 2.5; pen.stroke();
  const words = skimmer.stands ? `${name} ${skimmer.stands}` : `${name} ${perHour(skimmer.rate)}`;
  label(pen, `${words}, tank ${percent(fillOf(skimmer))}`, left + radius + 6, top);
}

const entry = (title, value, meter = "", state = "") => `<dl class="gauge ${state}"><dt>${title}</dt><dd>${value}${meter}</dd></dl>`;
const meterOf = (value, most, title) => `<meter min="0" max="${most}" value="${Math.min(value, most)}" aria-label="${title}"></meter>`;
const escape = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);

export function skimmerGauges(name, skimmer) {
  const aboard = skimmer.oil_aboard + skimmer.water_aboard;
  return `<div class="boom skimmer"><h2>Skimmer ${escape(name)}${skimmer.stands ? `: ${skimmer.stands}` : ""}</h2>
    ${entry("Oil taken up now", perHour(skimmer.rate), meterOf(skimmer.rate, skimmer.nameplate, "Oil taken up now, of what the pump lifts"))}
    ${entry("Tank", `${percent(fillOf(skimmer))} of ${volume(skimmer.storage)}`, meterOf(aboard, skimmer.storage, "Fill of the tank"), fillOf(skimmer) > 0.9 ? "warn" : "")}
    ${entry("Water in the tank", aboard > 0 ? percent(skimmer.water_aboard / aboard) : "–")}
    ${entry("Oil taken up so far", volume(skimmer.oil))}</div>`;
}

// Start, stop, pump rate and place of a skimmer, for the instructor and the crews that work with it; on: what carries it, null for nothing.
export function skimmerControls(name, on, number) {
  const id = escape(name), [along, across] = on ? ["Ahead", "To port"] : ["x", "y"];
  return `<p class="state" id="skimmer-${id}"></p><div class="row"><button class="start">Start</button><button class="stop grave">Stop</button></div>
    <div class="row">${number(`pump-${id}`, "Pump", "m³/h", 1, 0.1, 1000)}<button class="rate">Order</button></div>
    <div class="row">${number(`ahead-${id}`, along, "m", 0.5, -1e4, 1e4)}${number(`port-${id}`, across, "m", 0.5, -1e4, 1e4)}<button class="move">Move</button></div>`;
}

export function showSkimmers(state) {
  for (const [name, skimmer] of Object.entries(state.skimmers)) {
    const place = document.getElementById(`skimmer-${name}`);
    if (place) place.textContent = `${skimmer.stands || "works"}${skimmer.moves ? ", moves" : ""}, takes up ${perHour(skimmer.rate)} of oil; tank ${percent(fillOf(skimmer))} of ${volume(skimmer.storage)}`;
  }
}

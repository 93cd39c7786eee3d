// The controls beside the plan: the instructor's, those of a vessel's crew, or none.
import { skimmerControls } from "./equipment.js";
import { settings, waves } from "./orders.js";
import { KNOT, clock, course, compass, direction, engineFault, knots } from "./units.js";

const escape = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
const number = (id, title, unit, step, low, high) => `<label class="number">${title} <span>${unit}</span><input id="${id}" type="number" step="${step}" min="${low}" max="${high}"></label>`;
const value = (id) => document.getElementById(id).valueAsNumber;

export function buildControls(place, hello, scene, link) {
  place.replaceChildren();
  briefs(place, scene);
  if (hello.role === "instructor") instructor(place, hello, scene, link);
  else if (hello.role === "vessel") crew(place, hello, scene, link);
  else observer(place, scene);
}

// The brief for all, and the instructor's notes, which only his page is sent.
function briefs(place, scene) {
  for (const [title, text] of [["Brief", scene.brief], ["Notes for the instructor", scene.notes]]) {
    if (!text) continue; // an exercise of particles alone has none
    const isOpen = title === "Brief" && !("notes" in scene);
    place.insertAdjacentHTML("beforeend", `<details class="brief"${isOpen ? " open" : ""}><summary>${title}</summary><p>${escape(text.replace(/(.{100,})\n/g, "$1 "))}</p></details>`);
  }
}

// The radio, which all stations hear.
function radio(place, hello, scene, link) {
  const own = hello.vessel || "instructor", stations = ["all stations", "instructor", ...scene.vessels.map((one) => one.name)].filter((one) => one !== own);
  if (!scene.vessels.length) return;
  const box = group(place, "Radio", `<div class="row"><label>Call <select id="radio-to">${stations.map((one) => `<option>${escape(one)}</option>`).join("")}</select></label><label class="wide">and say<input id="radio-text" type="text" maxlength="500"></label><button>Say</button></div>`);
  const field = document.getElementById("radio-text"), say = async () => { if (field.value.trim() && (await link.give("say", { to: document.getElementById("radio-to").value, text: field.value.trim() })).told) field.value = ""; };
  when(box, "button", say);
  field.addEventListener("keydown", (event) => { if (event.key === "Enter") say(); });
}

// What is ordered, and what the vessels make of it.
function observer(place, scene) {
  for (const { name } of scene.vessels) group(place, `Vessel ${escape(name)}`, `<p class="state" id="state-${escape(name)}"></p>`);
  for (const name of Object.keys(scene.skimmers)) group(place, `Skimmer ${escape(name)}`, `<p class="state" id="skimmer-${escape(name)}"></p>`);
  if (!place.childElementCount) place.innerHTML = "<p class='quiet'>You watch. The instructor gives the orders.</p>";
}

function group(place, title, inner) {
  const box = document.createElement("fieldset");
  box.innerHTML = `<legend>${title}</legend>${inner}`;
  place.append(box);
  return box;
}

function when(box, selector, act) { box.querySelectorAll(selector).forEach((one) => one.addEventListener("click", () => act(one))); }

function instructor(place, hello, scene, link) {
  const bearing = scene.bearing;
  if (scene.tows) {
    const tow = group(place, "Tow: all vessels", `<div class="row">${number("tow-speed", "Speed", "kn", 0.05, 0, 10)}${number("tow-course", "Course", "°", 1, 0, 359)}<button>Order</button></div>`);
    when(tow, "button", () => link.give("tow", { speed: value("tow-speed") * KNOT, heading: direction(value("tow-course"), bearing) }));
  }
  for (const vessel of scene.vessels) vesselControls(place, vessel, scene, link);
  for (const name of Object.keys(scene.skimmers)) skimmerBox(place, name, scene, (settings) => link.give("order", { settings }));
  radio(place, hello, scene, link);
  if (scene.injects.length) injectControls(place, scene, link);
  weatherControls(place, scene, link);
  if (scene.oils.length) releaseControls(place, scene, link);
  for (const boom of scene.booms) {
    const lines = boom.tow_line == null ? "" : `<div class="row">${number(`line-${boom.name}`, "Tow lines, by winch", "m", 0.5, 1, 500)}<button class="haul">Order</button></div>`;
    const box = group(place, `Boom ${escape(boom.name)}`, `${lines}<div class="row">${number(`part-${boom.name}`, "Part at joint", `1 to ${boom.segments - 1}`, 1, 1, boom.segments - 1)}<button class="grave">Part</button></div>`);
    when(box, ".haul", () => link.give("order", { settings: [`booms.${boom.name}.tow_line=${value(`line-${boom.name}`)}`] }));
    when(box, ".grave", () => {
      const joints = [...new Set([...(window.conduct.state?.booms[boom.name].parted ?? []), value(`part-${boom.name}`)])];
      link.give("order", { settings: [`booms.${boom.name}.parted=[${joints.join(",")}]`] });
    });
  }
  const free = group(place, "Any order", `<div class="row"><label class="wide">KEY=VALUE, several with a space between<input id="free" type="text" placeholder="emitters.leak.speed=0"></label><button>Order</button></div>`);
  when(free, "button", () => link.give("order", { settings: settings(document.getElementById("free").value) }));
  group(place, "Marks and branches", `<ul class="marks" id="marks"></ul><div class="row">${number("back-time", "Go back to", "s", 0.1, 0, 1e6)}<label class="wide">and order there<input id="back-orders" type="text" placeholder="tow.speed_kn=0.4"></label><button id="back">Branch</button></div>`);
  document.getElementById("back").addEventListener("click", () => branch(link, { time: value("back-time"), recording: null }, settings(document.getElementById("back-orders").value)));
  const links = Object.entries(hello.links).filter(([name]) => name !== "instructor").map(([name, token]) => `<label>${escape(name)}</label><code>${location.origin}/#${escape(token)}</code>`);
  group(place, "Addresses of the other pages", `<div class="links">${links.join("")}</div>`);
}

function skimmerBox(place, name, scene, order) {
  const box = group(place, `Skimmer ${escape(name)}`, skimmerControls(name, scene.skimmers[name].on, number)), give = (setting) => order([`skimmers.${name}.${setting}`]);
  when(box, ".start", () => give("running=true"));
  when(box, ".stop", () => give("running=false"));
  when(box, ".rate", () => give(`nameplate=${value(`pump-${name}`)}`));
  when(box, ".move", () => give(`place=[${value(`ahead-${name}`)},${value(`port-${name}`)}]`));
}

function injectControls(place, scene, link) {
  const rows = scene.injects.map((one) => `<div class="row"><button data-inject="${escape(one.name)}">${escape(one.text || one.name)}</button><span class="quiet">${one.text ? `told to ${escape(one.to.join(", ") || "all")}` : "nobody is told"}</span></div>`);
  const box = group(place, "Injects of the exercise", rows.join(""));
  when(box, "button", (button) => link.give("order", { settings: [`injects.${button.dataset.inject}.given=true`] }));
}

// Greys out the injects that have been given.
export function showInjects(given) {
  document.querySelectorAll("[data-inject]").forEach((one) => { one.disabled = given.includes(one.dataset.inject); });
}

function releaseControls(place, scene, link) {
  const vessels = scene.vessels.map((one) => `<option value="${escape(one.name)}">beside ${escape(one.name)}</option>`);
  const oils = scene.oils.map((name) => `<option>${escape(name)}</option>`);
  const box = group(place, "Release oil", `<div class="row">${number("spill-volume", "Volume", "litres", 10, 1, 1e6)}${number("spill-time", "within", "s", 1, 1, 86400)}<label>Oil <select id="spill-oil">${oils.join("")}</select></label></div>
    <div class="row"><label>Place <select id="spill-place"><option value="">the pin: double-click on the plan</option>${vessels.join("")}</select></label><button class="grave">Release</button></div>`);
  document.getElementById("spill-volume").value = 1000;
  document.getElementById("spill-time").value = 60;
  when(box, "button", () => {
    const state = window.conduct.state, beside = document.getElementById("spill-place").value, { radius, height } = scene.pipe;
    const vessel = scene.vessels.find((one) => one.name === beside), place = vessel ? [0, vessel.beam + 1] : window.conduct.plan.pin;
    if (!place) return link.on({ kind: "refused", problems: [["the place", "is not chosen, allowed: a double-click on the plan sets the pin"]] });
    const litres = value("spill-volume"), name = `release-${Object.keys(state.pipes).length + 1}`;
    const speed = litres / 1000 / value("spill-time") / (Math.PI * radius ** 2);
    const oil = JSON.stringify(document.getElementById("spill-oil").value), mouth = [...place, height].join(",");
    return link.give("order", { settings: [`emitters.${name}={phase=${oil},${vessel ? `on=${JSON.stringify(beside)},` : ""}mouth=[${mouth}],direction=[0.0,0.0,-1.0],radius=${radius},speed=${speed},start=${state.time},volume=${litres / 1000}}`] });
  });
}

let isBranching = false; // until the console has answered

// Goes back to a mark, or to another moment with the recording null, with orders there.
async function branch(link, { time, recording }, settings) {
  isBranching = true;
  allowBranches();
  await link.give("branch", { time, recording, settings });
  isBranching = false;
  allowBranches();
}

// A second branch is possible only once the first one runs.
function allowBranches() {
  const box = document.getElementById("marks")?.closest("fieldset");
  if (box) box.disabled = isBranching || window.conduct.session.phase === "building";
}

function vesselControls(place, vessel, scene, link) {
  const id = vessel.name, steers = vessel.control === "helmsman";
  const helm = steers ? `<div class="row">${number(`speed-${id}`, "Speed", "kn", 0.05, -10, 10)}${number(`course-${id}`, "Course", "°", 1, 0, 359)}<label class="check"><input id="line-${id}" type="checkbox" checked> Keep the line</label><button class="order">Order</button></div>` : "";
  const box = group(place, `Vessel ${escape(id)}`, `<p class="state" id="state-${id}"></p>${helm}<div class="row"><button class="fail grave">Engine fails</button><button class="fix">Engine runs again</button></div>`);
  when(box, ".order", () => steer(link, id, value(`speed-${id}`), value(`course-${id}`), document.getElementById(`line-${id}`).checked, scene.bearing));
  when(box, ".fail", () => link.give("engine", { vessel: id, runs: false }));
  when(box, ".fix", () => link.give("engine", { vessel: id, runs: true }));
}

function steer(link, vessel, speed, degrees, keeps, bearing) {
  return link.give("steer", { vessel, speed: speed * KNOT, heading: direction(degrees, bearing), keeps_line: keeps });
}

function weatherControls(place, scene, link) {
  const bearing = scene.bearing;
  const box = group(place, "Weather", `
    <div class="row">${number("wind-speed", "Wind", "kn", 1, 0, 100)}${number("wind-from", "from", "°", 1, 0, 359)}<button data-what="wind">Order</button></div>
    <div class="row">${number("current-speed", "Current", "kn", 0.05, 0, 8)}${number("current-to", "towards", "°", 1, 0, 359)}<button data-what="current">Order</button></div>
    <div class="row">${number("waves-height", "Waves", "m", 0.1, 0, 20)}${number("waves-period", "period", "s", 0.5, 1, 20)}<button data-what="waves">Order</button></div>
    <div class="row">${number("visibility", "Visibility", "m", 50, 10, 20000)}<button data-what="visibility">Order</button></div>
    <div class="row">${number("weather-within", "Each within", "min, 0 at once", 1, 0, 600)}</div>`);
  when(box, "button", (button) => {
    const what = button.dataset.what, weather = window.conduct.state?.weather, present = weather?.[what];
    let ordered;
    if (what === "visibility") ordered = [`sea.visibility=${value("visibility")}`];
    else if (what === "waves") ordered = waves(weather, value("waves-height"), value("waves-period"));
    else {
      const speed = value(`${what}-speed`) * KNOT, way = what === "wind" ? direction(value("wind-from") + 180, bearing) : direction(value("current-to"), bearing);
      ordered = present ? [`sea.${what}.speed=${speed}`, `sea.${what}.direction=${way}`] : [`sea.${what}={kind="steady",speed=${speed},direction=${way}}`];
    }
    const within = 60 * (value("weather-within") || 0);
    link.give("order", { settings: within === weather.within ? ordered : [...ordered, `sea.within=${within}`] });
  });
}

function crew(place, hello, scene, link) {
  const { vessel } = hello;
  const order = { speed: 0, course: 0, isKnown: false };
  const box = group(place, `Helm of ${escape(vessel)}`, `<p class="state" id="state-${vessel}"></p>
    <div class="helm" role="group" aria-label="Ordered course"><button data-turn="-5" aria-label="5 degrees to port">−5°</button><output id="helm-course">–</output><button data-turn="5" aria-label="5 degrees to starboard">+5°</button></div>
    <div class="helm" role="group" aria-label="Ordered speed"><button data-knots="-0.1" aria-label="0.1 knots slower">−0.1</button><output id="helm-speed">–</output><button data-knots="0.1" aria-label="0.1 knots faster">+0.1</button></div>
    <div class="row"><label class="check"><input id="helm-line" type="checkbox" checked> Keep the line</label></div>
    <div class="row"><button class="main" id="helm-give">Order</button><button id="helm-undo">As it is</button></div>
    <p class="quiet">Left and right arrows turn, up and down arrows change the speed, Enter orders.</p>`);
  levers(place, vessel, link);
  const show = () => {
    document.getElementById("helm-course").innerHTML = `${String(Math.round(order.course) % 360).padStart(3, "0")}°<small>course to order</small>`;
    document.getElementById("helm-speed").innerHTML = `${order.speed.toFixed(2)} kn<small>speed over the ground to order</small>`;
  };
  const turn = (degrees) => { order.course = ((Math.round((order.course + degrees) / 5) * 5) % 360 + 360) % 360; order.isTouched = true; show(); };
  const change = (by) => { order.speed = Math.round((order.speed + by) * 100) / 100; order.isTouched = true; show(); };
  const give = () => { order.isTouched = false; return steer(link, vessel, order.speed, order.course, document.getElementById("helm-line").checked, scene.bearing); };
  when(box, "[data-turn]", (one) => turn(Number(one.dataset.turn)));
  when(box, "[data-knots]", (one) => change(Number(one.dataset.knots)));
  when(box, "#helm-give", give);
  when(box, "#helm-undo", () => { order.isTouched = false; });
  group(place, "Engine", `<div class="row"><button id="helm-stop" class="grave">Stop the engine</button><button id="helm-start">Start the engine</button></div>`);
  document.getElementById("helm-stop").addEventListener("click", () => link.give("engine", { vessel, runs: false }));
  document.getElementById("helm-start").addEventListener("click", () => link.give("engine", { vessel, runs: true }));
  lineControls(place, vessel, scene, link);
  radio(place, hello, scene, link);
  for (const name of scene.vessels.find((one) => one.name === vessel).skimmers) skimmerBox(place, name, scene, (settings) => link.give("skim", { vessel, settings }));
  window.conduct.helm = { turn, change, give, follow(ordered) {
    if (order.isTouched || !ordered || ordered.by_hand) return;
    order.speed = Math.round(100 * ordered.speed / KNOT) / 100;
    order.course = compass(ordered.heading, scene.bearing);
    show();
  } };
}

// The winch of the vessel's own tow line, where it has one.
function lineControls(place, vessel, scene, link) {
  const { line } = scene.vessels.find((one) => one.name === vessel);
  if (!line) return;
  const box = group(place, "Tow line", `<div class="row">${number("own-line", "Length, by winch", "m", 0.5, 0.5, 500)}<button>Order</button></div>`);
  when(box, "button", () => link.give("line", { vessel, length: value("own-line") }));
}

// Thrust and rudder by hand, instead of a helmsman who keeps course and speed.
function levers(place, vessel, link) {
  const slide = (id, title, low, high) => `<div class="lever"><label for="${id}">${title}</label><output id="${id}-words" for="${id}"></output><input id="${id}" type="range" min="-100" max="100" step="5" value="0"><span class="ends quiet" aria-hidden="true"><span>${low}</span><span>${high}</span></span></div>`;
  const box = group(place, "Thrust and rudder by hand", `${slide("lever-thrust", "Thrust", "astern", "ahead")}${slide("lever-rudder", "Rudder", "port", "starboard")}
    <div class="row"><button id="lever-give">Take the levers</button><button id="lever-middle">Stop, amidships</button></div>
    <p class="quiet">The levers act when you take them, and then whenever you let go of one. An order of course and speed gives the helm back.</p>`);
  const at = (id) => document.getElementById(id);
  const words = () => {
    const [thrust, rudder] = [at("lever-thrust").valueAsNumber, at("lever-rudder").valueAsNumber];
    at("lever-thrust-words").textContent = thrust === 0 ? "stop" : `${Math.abs(thrust)} % ${thrust > 0 ? "ahead" : "astern"}`;
    at("lever-rudder-words").textContent = rudder === 0 ? "amidships" : `${Math.abs(rudder)} % to ${rudder > 0 ? "starboard" : "port"}`;
  };
  const give = () => link.give("levers", { vessel, thrust: at("lever-thrust").valueAsNumber / 100, steering: -at("lever-rudder").valueAsNumber / 100 });
  const isTaken = () => window.conduct.state?.vessels[vessel]?.ordered?.by_hand;
  box.querySelectorAll("input").forEach((one) => { one.addEventListener("input", words); one.addEventListener("change", () => { if (isTaken()) give(); }); });
  at("lever-give").addEventListener("click", give);
  at("lever-middle").addEventListener("click", () => { at("lever-thrust").value = at("lever-rudder").value = 0; words(); give(); });
  words();
}

function orderedWords(ordered, bearing) {
  if (!ordered) return "";
  if (!ordered.by_hand) return `; ordered ${knots(ordered.speed)}, course ${course(ordered.heading, bearing)}`;
  const [thrust, steering] = ordered.by_hand.map((part) => Math.round(100 * part));
  return `; by hand ${thrust ? `${Math.abs(thrust)} % ${thrust > 0 ? "ahead" : "astern"}` : "no thrust"}, rudder ${steering ? `${Math.abs(steering)} % to ${steering > 0 ? "port" : "starboard"}` : "amidships"}`;
}

function lineWords(line) {
  if (!line) return "";
  return `; tow line ${line.now.toFixed(1)} m${Math.abs(line.now - line.ordered) > 0.05 ? `, going to ${line.ordered.toFixed(1)} m` : ""}`;
}

export function showVessels(scene, state) {
  for (const [name, vessel] of Object.entries(state.vessels)) {
    const place = document.getElementById(`state-${name}`);
    if (!place) continue;
    const ordered = orderedWords(vessel.ordered, scene.bearing), fault = engineFault(vessel.engine);
    place.textContent = `Heading ${course(vessel.mean_heading, scene.bearing)}, ${knots(vessel.over_ground)} over the ground, ${knots(vessel.through_water)} through the water${ordered}${lineWords(vessel.line)}${fault && `; ${fault}`}`;
  }
}

// Lets the fields show what is ordered now; what somebody has typed stays until it is ordered, in another colour while it is not.
export function showOrdered(scene, state) {
  const degrees = (way) => way == null ? null : compass(way, scene.bearing), { wind, current, waves } = state.weather;
  fill("wind-speed", wind && wind.speed / KNOT, 0); fill("wind-from", wind && degrees(wind.direction + Math.PI), 0);
  fill("current-speed", current && current.speed / KNOT, 2); fill("current-to", current && degrees(current.direction), 0);
  fill("waves-height", waves && waves.height, 2); fill("waves-period", waves && waves.period, 1); fill("visibility", state.weather.visibility, 0); fill("weather-within", state.weather.within / 60, 0);
  fill("tow-speed", state.tow && state.tow.speed / KNOT, 2); fill("tow-course", state.tow && degrees(state.tow.heading), 0);
  for (const [name, vessel] of Object.entries(state.vessels)) {
    fill(`speed-${name}`, vessel.ordered && vessel.ordered.speed / KNOT, 2);
    fill(`course-${name}`, degrees((vessel.ordered ?? vessel).heading), 0);
  }
  for (const boom of scene.booms) fill(`line-${boom.name}`, boom.ends.map((end) => state.vessels[end]?.line?.laid).find((laid) => laid != null), 1);
  for (const [name, one] of Object.entries(state.skimmers)) {
    fill(`pump-${name}`, 3600 * one.nameplate, 1);
    fill(`ahead-${name}`, one.place[0], 1); fill(`port-${name}`, one.place[1], 1);
  }
  fill("own-line", state.vessels[window.conduct.hello.vessel]?.line?.ordered, 1);
}

function fill(id, number, digits) {
  const field = document.getElementById(id);
  if (field?.type !== "number" || number == null || !Number.isFinite(number)) return;
  const ordered = number.toFixed(digits);
  if (!field.dataset.typed && field.dataset.ordered !== ordered) field.value = field.dataset.ordered = ordered;
  field.classList.toggle("typed", field.value !== "" && Number(field.value) !== Number(ordered));
}
document.addEventListener("input", (event) => { if (event.target.type === "number") event.target.dataset.typed = "yes"; });
document.addEventListener("click", (event) => event.target.closest?.(".row button")?.closest(".row").querySelectorAll("input").forEach((one) => delete one.dataset.typed), { capture: true });

export function showMarks(session, link) {
  const place = document.getElementById("marks");
  if (!place) return;
  place.innerHTML = session.marks.map((mark, index) => `<li><span>${clock(mark.time)} ${escape(mark.name)}</span><button data-mark="${index}">Go back</button></li>`).join("") || "<li class='quiet'>No marks yet: the key M sets one.</li>";
  place.querySelectorAll("button").forEach((one) => one.addEventListener("click", () => branch(link, session.marks[Number(one.dataset.mark)], [])));
  allowBranches();
}

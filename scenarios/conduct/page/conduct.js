// The console's page: it shows what the server tells, and gives the orders of its role.
import { buildControls, showInjects, showMarks, showOrdered, showVessels } from "./controls.js";
import { showLegend } from "./colors.js";
import { showSkimmers } from "./equipment.js";
import { Charts, showGauges } from "./gauges.js";
import { Debriefs } from "./debrief.js";
import { Link } from "./link.js";
import { Log } from "./log.js";
import { PlanView } from "./plan.js";
import { Timeline } from "./timeline.js";
import { heldOrders } from "./orders.js";
import { KNOT, clock, compass } from "./units.js";

const SCALES = [0.1, 0.25, 0.5, 1, 2, 5, 10, null];
const at = (id) => document.getElementById(id);
const plan = new PlanView(at("plan")), charts = new Charts(at("charts")), log = new Log(at("log"));
const conduct = window.conduct = { state: null, scene: null, session: null, hello: null, log, plan };
let noticeTimer = 0;

function notice(text, bad = false, seconds = 8) {
  clearTimeout(noticeTimer);
  at("notice").hidden = !text;
  at("notice").textContent = text;
  at("notice").classList.toggle("bad", bad);
  if (seconds) noticeTimer = setTimeout(() => { at("notice").hidden = true; }, 1000 * seconds);
}

const on = {
  hello(message) {
    conduct.hello = message;
    at("log").replaceChildren();
    timeline.begin();
    document.body.classList.toggle("crew", message.role === "vessel");
    document.body.classList.toggle("observer", message.role === "observer");
    at("role").textContent = message.role === "vessel" ? `Vessel ${message.vessel}` : message.role[0].toUpperCase() + message.role.slice(1);
    at("introduction").hidden = message.role === "observer";
    if (at("person").value) introduce();
    at("transport").hidden = message.role !== "instructor";
    at("tab-scene").hidden = at("tab-both").hidden = !message.viewer;
    plan.own = message.vessel || null;
    at("notice").hidden = true;
  },
  session(message) {
    const before = conduct.session, isNew = message.run !== before?.run;
    conduct.session = message;
    if (message.run === 1 && message.phase === "building") notice("The run is being built. The first one on a machine is compiled, which takes some minutes.", false, 0);
    else if (message.run === 1 && before?.phase === "building") notice("");
    at("tab-debrief").hidden = !message.debriefs.length;
    if (isNew) select("plan");
    phase();
    showMarks(message, link);
    },
  scene(message) {
    timeline.present();
    conduct.scene = message;
    at("title").textContent = message.title || message.name;
    document.title = `${message.name}: ${conduct.hello.vessel || conduct.hello.role}`;
    plan.begin(message);
    showLegend(at("legend"), message, plan.boomBy);
    if (conduct.builtFor === conduct.session.run) return; // the page was cut off and is back: what is typed stays
    conduct.builtFor = conduct.session.run;
    buildControls(at("controls"), conduct.hello, message, link);
    showMarks(conduct.session, link);
  },
  history(message) {
    charts.begin(conduct.scene, message.rows);
    for (const row of message.rows) for (const [name, [x, y]] of Object.entries(row.vessels)) plan.remember(name, x, y);
  },
  given(message) { showInjects(message.injects); },
  lines(message) { log.add(message.lines); timeline.add(message.lines); },
  state(message) {
    conduct.state = message;
    timeline.reach(message.time);
    charts.add(message);
    if (timeline.past === null) show(message);
    showVessels(conduct.scene, message);
    showSkimmers(message);
    conduct.helm?.follow(message.vessels[conduct.hello.vessel]?.ordered);
    showOrdered(conduct.scene, message);
    tellLag();
    veilScene();
    phase();
    },
  refused(message) { notice(message.problems.map(([place, text]) => `${place} ${text}`).join("; "), true); },
  away(message) {
    if (message.code === 4401) { at("password").showModal(); notice(message.reason || "the address opens nothing", true, 0); }
    else notice("The console is away; this page comes back by itself.", true, 0);
    at("phase").textContent = "away"; at("phase").className = "pill away";
  },
};

function show(state) {
  plan.spots = floats(state.oil);
  plan.show(state, timeline.past !== null);
  showGauges(at("gauges"), conduct.scene, state);
}

function floats(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

function phase() {
  const { session, state } = conduct, runs = session?.phase === "running";
  const words = !session ? "connecting" : runs ? (state?.paused ? "paused" : state?.index === 0 ? "starting" : "running") : session.phase === "building" ? "building" : session.phase;
  at("phase").textContent = words;
  at("phase").className = `pill ${words}`;
  if (session && !runs && session.reason) notice(session.reason, session.phase === "failed", 0);
  for (const id of ["go", "step", "mark", "end", "scale"]) at(id).disabled = !runs;
  at("debrief").disabled = !(runs || session?.phase === "ended");
  if (!state) return;
  at("go").textContent = state.paused ? "Go on" : "Pause";
  at("time").textContent = clock(state.time);
  at("factor").textContent = state.paused ? "paused" : state.real_time_factor == null ? "–" : `${state.real_time_factor.toFixed(2)} ×`;
  const behind = state.set_back + state.lag, late = !state.paused && state.lag > 0.05;
  at("lag").textContent = state.pace == null ? "no clock" : behind < 0.05 ? "keeps time" : `${state.lag.toFixed(2)} s${state.set_back > 0.05 ? `, ${state.set_back.toFixed(0)} s in all` : ""}`;
  at("lag").parentElement.classList.toggle("late", late);
  if (document.activeElement !== at("scale")) at("scale").value = String(state.pace);
}

// Shows one of the views, or plan and 3-D side by side.
function select(name) {
  for (const one of ["plan", "scene", "both", "debrief"]) at(`tab-${one}`).setAttribute("aria-selected", String(one === name));
  at("view-plan").hidden = !["plan", "both"].includes(name);
  at("view-scene").hidden = !["scene", "both"].includes(name);
  at("views").hidden = at("legend").hidden = at("timeline").hidden = name === "debrief";
  at("view-debrief").hidden = name !== "debrief";
  if (!at("view-scene").hidden && !at("view-scene").firstChild) {
    const frame = document.createElement("iframe"); // of another origin: browsers give it a process of its own
    frame.title = "3-D view";
    frame.src = conduct.hello.viewer;
    at("view-scene").append(frame, Object.assign(document.createElement("div"), { className: "veil" }));
    veilScene();
  }
  plan.redraw();
  tellLag();
}

// Fog, or night: what stands as far off as the exercise's camera does keeps exp(-3.912 distance / visibility) of its contrast (Koschmieder 1924).
function veilScene() {
  const veil = at("view-scene").lastChild, seen = conduct.state?.weather.visibility;
  if (veil && seen) veil.style.opacity = conduct.hello.vessel ? 1 - Math.exp(-3.912 * conduct.scene.distance / seen) : 0;
}

// Lets the 3-D view show the moment at which the timeline stands.
function moveScene() {
  const frame = at("view-scene").firstChild;
  if (frame) frame.contentWindow.postMessage({ time: timeline.past }, new URL(frame.src).origin);
}

// Says how far the 3-D view lags behind the moment at which the page stands.
function tellLag() {
  const now = timeline.past ?? conduct.state?.time, lag = now - conduct.shown, isSeen = !at("view-scene").hidden && conduct.shown != null && now != null;
  at("scene-lag").hidden = !isSeen;
  if (isSeen) at("scene-lag").textContent = `3-D shows ${clock(conduct.shown)}: ${Math.abs(lag) < 0.5 ? "keeps up" : `${Math.abs(lag).toFixed(lag < 10 ? 1 : 0)} s ${lag > 0 ? "behind" : "ahead"}`}`;
}

async function debrief() {
  notice("The run ends, and its debrief is written …", false, 0);
  const answer = await link.give("debrief");
  if (answer.told) await openDebriefs([...new Set([...conduct.session.debriefs, answer.told])]);
}

async function openDebriefs(names, whatIfs = conduct.session.what_ifs) {
  const moments = [{ time: 0, name: "the start" }, ...conduct.session.marks];
  const compared = whatIfs.includes(names.at(-1)) ? names.at(-1) : null;
  try {
    const found = compared && await (await debriefs.get("what-if", compared)).json();
    const shown = found ? [found.first, found.second] : names;
    await debriefs.show(shown, found, conduct.hello.role === "instructor" ? { moments, ordersAt, tryAgain: whatIf } : null);
  } catch (error) {
    return notice(`the debrief cannot be shown: ${error.message}`, true);
  }
  select("debrief");
  notice("");
}

// What the helmsmen keep at a moment, as orders.
async function ordersAt(time) {
  const { state } = await link.give("look", { time });
  return heldOrders(state && JSON.parse(state), (way) => compass(way, conduct.scene.bearing), KNOT);
}

// Makes the run again with other orders at a moment [s], as fast as it can to the same end, and shows both.
async function whatIf(time, settings) {
  notice(`Runs again from ${clock(time)}, with ${settings.join(" ") || "no order"} …`, false, 0);
  const { told } = await link.give("what-if", { time, settings });
  if (told) await openDebriefs([...conduct.session.debriefs.filter((name) => name !== told), told], [told]);
}

// Gives the name of the person in front of the page, under which its orders stand in the log.
function introduce() {
  sessionStorage.setItem("person", at("person").value);
  if (at("person").value.trim()) link.give("introduce", { name: at("person").value.trim() });
}

const toggle = () => link.give(conduct.state?.paused ? "go-on" : "pause");
const mark = () => link.give("mark", { name: `moment ${(conduct.session?.marks.length ?? 0) + 1}` });
const rescale = (by) => {
  const place = Math.min(Math.max(SCALES.indexOf(conduct.state?.pace ?? null) + by, 0), SCALES.length - 1);
  link.give("pace", { value: SCALES[place] });
};
at("scale").innerHTML = SCALES.map((one) => `<option value="${one}">${one === null ? "fastest" : `${one} ×`}</option>`).join("");
at("scale").addEventListener("change", () => { link.give("pace", { value: at("scale").value === "null" ? null : Number(at("scale").value) }); at("scale").blur(); });
at("go").addEventListener("click", toggle);
at("step").addEventListener("click", () => link.give("step"));
at("mark").addEventListener("click", mark);
at("end").addEventListener("click", () => link.give("end"));
at("debrief").addEventListener("click", debrief);
at("boom-by").addEventListener("change", () => { plan.boomBy = at("boom-by").value; plan.redraw(); showLegend(at("legend"), conduct.scene, plan.boomBy); });
at("follow").addEventListener("change", () => plan.setFollow(at("follow").checked));
plan.onFollow = (wanted) => { at("follow").checked = wanted; };
at("fit").addEventListener("click", () => { plan.fit(); plan.setFollow(true); });
for (const name of ["plan", "scene", "both"]) at(`tab-${name}`).addEventListener("click", () => select(name));
at("tab-debrief").addEventListener("click", () => openDebriefs(conduct.session.debriefs));
at("person").value = sessionStorage.getItem("person") ?? "";
at("person").addEventListener("change", introduce);
at("password").addEventListener("close", () => link.retry(at("password-text").value));

// The 3-D view takes the keyboard when it begins; a page whose keys waited for the view to draw would be late, so it takes them back.
function takeKeysBack() {
  const frame = at("view-scene").firstChild;
  if (frame && document.activeElement === frame && !frame.matches(":hover")) { frame.blur(); focus(); }
}
addEventListener("blur", () => setTimeout(takeKeysBack)); // the frame has the focus only after this event

// A button that a pointer has pressed gives the keyboard back to the page.
document.addEventListener("click", (event) => { if (event.detail > 0) event.target.closest?.("button")?.blur(); });
document.addEventListener("keydown", (event) => {
  if (event.target.closest("input, select, textarea, dialog") || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === " " && event.target.closest("button")) return; // it presses that button
  press(event.key, event);
});

// Does what a key stands for on the page of this role.
function press(key, event) {
  const helm = conduct.helm;
  const keys = conduct.hello?.role === "instructor"
    ? { " ": toggle, ".": () => link.give("step"), "+": () => rescale(1), "-": () => rescale(-1), m: mark, f: () => at("fit").click() }
    : helm ? { ArrowLeft: () => helm.turn(-5), ArrowRight: () => helm.turn(5), ArrowUp: () => helm.change(0.1), ArrowDown: () => helm.change(-0.1), Enter: () => { if (!event?.target.closest("button")) helm.give(); } } : {};
  if (!keys[key]) return;
  keys[key]();
  if (key !== "Enter") event?.preventDefault();
}

plan.onPin = () => { if (at("spill-place")) at("spill-place").value = ""; };
const token = location.hash.slice(1);
const link = conduct.link = new Link(token, (message) => on[message.kind]?.(message));
const timeline = new Timeline(at, link, show), debriefs = new Debriefs(at("view-debrief"), link, token);
timeline.onPresent = () => { if (conduct.state) show(conduct.state); moveScene(); };
timeline.onLook = moveScene;
addEventListener("message", (event) => {
  const frame = at("view-scene").firstChild;
  if (!frame || event.source !== frame.contentWindow || event.origin !== new URL(frame.src).origin) return;
  if (event.data === "scene") { takeKeysBack(); if (timeline.past !== null) moveScene(); }
  if (event.data.key) press(event.data.key);
  if (event.data.shown != null) { conduct.shown = event.data.shown; tellLag(); }
});

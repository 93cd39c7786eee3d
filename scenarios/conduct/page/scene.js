// The 3-D view: the Rerun viewer without its panels, in a process of its own. The page around it, of another origin, says which moment it
// shows, in messages { time: seconds or null }; this view answers with what it shows, in messages { shown: seconds }.
const page = new URLSearchParams(location.search).get("page");
const words = document.getElementById("words");
const PAUSED = 1, FOLLOWING = 3; // play states of the viewer

// A whole number as protobuf writes it, least significant seven bits first.
function varint(number) {
  const bytes = [];
  for (let left = BigInt(number); ; left >>= 7n) {
    if (left < 128n) return [...bytes, Number(left)];
    bytes.push(Number(left & 127n) | 128);
  }
}
const field = (number, bytes) => [number << 3 | 2, bytes.length, ...bytes];

// The viewer's request SetTime { timeline 2 { name 1 }, duration 3 { nanoseconds 1 }, play state 5 }, which is field 6 of its requests.
function setTime(seconds, state) {
  const timeline = field(2, field(1, [...new TextEncoder().encode("sim_time")]));
  const moment = seconds === null ? [] : field(3, [8, ...varint(Math.round(seconds * 1e9))]);
  return new Uint8Array(field(6, [...timeline, ...moment, 5 << 3, state]));
}

// The fields of a message of protobuf: each number with a whole number or with the bytes of a part.
function* fields(bytes) {
  for (let at = 0; at < bytes.length;) {
    const whole = () => { let sum = 0n, shift = 0n, byte; do { byte = bytes[at++]; sum |= BigInt(byte & 127) << shift; shift += 7n; } while (byte > 127); return sum; };
    const key = Number(whole()), kind = key & 7;
    if (kind === 0) { yield [key >> 3, whole()]; continue; }
    const long = kind === 2 ? Number(whole()) : kind === 1 ? 8 : 4;
    yield [key >> 3, bytes.subarray(at, at += long)];
  }
}

// The time [s] at which the viewer's cursor stands: recording 3 { cursor 3 { time 3 { nanoseconds 1 } } } of its state; null without data.
function shownTime(state) {
  let part = state;
  for (const number of [3, 3, 3, 1]) part = part && [...fields(part)].find(([found]) => found === number)?.[1];
  return typeof part === "bigint" ? Number(part) / 1e9 : null;
}

function say(text) { words.textContent = text; words.hidden = !text; }

console.debug = () => {}; // the viewer would tell each step of its compiler of shaders, tens of thousands of lines

async function begin() {
  await wasm_bindgen({ module_or_path: "/viewer/re_viewer_bg.wasm" });
  const panels = { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Hidden" };
  const view = new wasm_bindgen.WebHandle({
    url: [new URLSearchParams(location.search).get("url")], hide_welcome_screen: true, panel_state_overrides: panels,
    enable_history: false, notebook: false, persist: false, theme: "light",
  });
  await view.start(document.getElementById("scene"));
  say("");
  let wanted = null, isAsking = false;
  async function show() {
    if (isAsking || wanted === null) return;
    const { time } = wanted;
    [wanted, isAsking] = [null, true];
    await view.viewer_control(setTime(time, time === null ? FOLLOWING : PAUSED)).catch((error) => console.warn(`the 3-D view did not move: ${error.message}`));
    isAsking = false;
    show();
  }
  addEventListener("message", (event) => { if (event.origin === page) { wanted = event.data; show(); } });
  setInterval(() => {
    if (view.has_panicked()) return say("The 3-D view has failed. Open the page again.");
    const shown = shownTime(view.viewer_state());
    if (shown !== null) parent.postMessage({ shown }, page);
  }, 500);
  parent.postMessage("scene", page);
}
// The page's keys belong to the page, wherever the focus is; all others move the camera.
const OF_PAGE = [" ", ".", "+", "-", "m", "Enter", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"];
addEventListener("keydown", (event) => {
  if (!OF_PAGE.includes(event.key) || event.ctrlKey || event.metaKey || event.altKey) return;
  event.stopImmediatePropagation();
  parent.postMessage({ key: event.key }, page);
}, { capture: true });
begin().catch((error) => say(`This browser cannot show the 3-D view: ${error.message ?? error}. The plan shows the same from above.`));

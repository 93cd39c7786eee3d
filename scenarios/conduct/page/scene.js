// The 3-D view: the Rerun viewer without its panels, in a process of its own. The page around it, of another origin, says which moment it
// shows, in messages { time: seconds or null }.
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
  setInterval(() => { if (view.has_panicked()) say("The 3-D view has failed. Open the page again."); }, 1000);
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

// The log: newest line first.
import { clock } from "./units.js";

const MOST = 400;

export class Log {
  constructor(place) { this.place = place; }

  add(lines) {
    for (const line of lines) {
      const item = document.createElement("li"), time = document.createElement("time"), text = document.createElement("span");
      time.textContent = clock(line.time);
      text.textContent = (["", "orders", "instructor", "oilsim", "VHF"].includes(line.source) ? "" : `${line.source}: `) + (line.words ?? line.text);
      text.className = line.level === "info" ? (line.order ? "order" : line.source === "VHF" ? "radio" : "") : line.level;
      item.append(time, text);
      this.place.prepend(item);
    }
    while (this.place.childElementCount > MOST) this.place.lastElementChild.remove();
  }
}

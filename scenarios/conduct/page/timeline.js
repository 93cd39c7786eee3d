// The timeline below the plan: what was ordered and what happened, and a slider to look back.
import { clock } from "./units.js";

export class Timeline {
  constructor(at, link, show) {
    Object.assign(this, { slider: at("moment"), ticks: at("ticks"), words: at("looking"), back: at("present"), link, show });
    this.end = 0;
    this.marks = [];
    this.past = null; // [s] where the page looks, null: at the present
    this.slider.addEventListener("input", () => this.look(Number(this.slider.value)));
    this.back.addEventListener("click", () => this.present());
  }

  begin() { this.marks = []; this.end = 0; this.present(); }

  add(lines) {
    for (const line of lines) {
      const kind = line.mark ? "mark" : line.order && line.words !== "goes on" && line.words !== "paused" ? "order" : line.level === "warning" && line.source !== "oilsim" ? "warning" : "";
      if (kind) this.marks.push({ time: line.time, kind, words: line.words });
    }
    this.draw();
  }

  // Takes note of the present [s]; a run that went back forgets what came after.
  reach(time) {
    if (time < this.end) this.marks = this.marks.filter((mark) => mark.time <= time);
    const isFar = time > this.end + 0.5 || time < this.end;
    this.end = time;
    this.slider.max = String(time);
    if (this.past === null) this.slider.value = String(time);
    if (isFar) this.draw();
  }

  draw() {
    this.ticks.replaceChildren(...this.marks.map((mark) => {
      const tick = document.createElement("i");
      tick.className = mark.kind;
      tick.title = `${clock(mark.time)} ${mark.words}`;
      tick.style.left = `${this.end > 0 ? 100 * Math.min(mark.time / this.end, 1) : 0}%`;
      return tick;
    }));
  }

  async look(time) {
    if (time >= this.end - 0.05) return this.present();
    this.past = time;
    this.back.disabled = false;
    this.words.textContent = `looks at ${clock(time)}`;
    this.words.className = "past";
    this.onLook?.();
    if (this.isAsking) return;
    this.isAsking = true;
    const answer = await this.link.give("look", { time });
    this.isAsking = false;
    if (answer.state && this.past !== null) this.show(JSON.parse(answer.state));
    if (this.past !== null && Math.abs(this.past - time) > 0.05) this.look(this.past);
  }

  present() {
    this.past = null;
    this.back.disabled = true;
    this.slider.value = String(this.end);
    this.words.textContent = "present";
    this.words.className = "quiet";
    this.onPresent?.();
  }
}

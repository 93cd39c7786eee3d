// The debrief in the page: the program's own page of a recording, two side by side after a branch, its export as one file or on paper, and
// "what if".
import uPlot from "./vendor/uPlot.esm.js";
import { settings } from "./orders.js";
import { clock } from "./units.js";

const element = (kind, entries = {}, ...inner) => { const one = Object.assign(document.createElement(kind), entries); one.append(...inner); return one; };

export class Debriefs {
  constructor(place, link, token) { Object.assign(this, { place, link, token }); this.pages = []; }

  async get(kind, name) {
    const answer = await fetch(`/${kind}/${encodeURIComponent(name)}`, { headers: { authorization: `Bearer ${this.token}`, "x-password": this.link.password } });
    if (!answer.ok) throw new Error(await answer.text());
    return answer;
  }

  async fetch(name) { return { name, address: URL.createObjectURL(await (await this.get("debrief", name)).blob()) }; }

  // Shows the debriefs with these names, the last two side by side; above them the comparison of two runs. `tries` has the moments from
  // which the instructor may try again, and what holds there.
  async show(names, compared, tries) {
    for (const page of this.pages) URL.revokeObjectURL(page.address);
    this.pages = await Promise.all(names.slice(-2).map((name) => this.fetch(name)));
    const bar = element("div", { className: "exports" }), pages = element("div", { className: "pages" });
    for (const page of this.pages) {
      bar.append(element("a", { href: page.address, download: `${page.name}-debrief.html`, textContent: `Save ${page.name} as one HTML file` }));
      const frame = element("iframe", { title: `Debrief of ${page.name}`, src: page.address });
      const print = element("button", { textContent: "Print or save as PDF", ariaLabel: `Print or save as PDF: ${page.name}` });
      print.addEventListener("click", () => frame.contentWindow.print());
      bar.append(print);
      pages.append(element("figure", {}, element("figcaption", { textContent: page.name }), frame));
    }
    this.place.replaceChildren(bar, ...(tries ? [this.whatIf(tries)] : []), ...(compared ? [comparison(compared)] : []), pages);
    for (const plot of this.place.querySelectorAll(".chart")) plot.draw?.();
  }

  // Other orders at a moment; those that hold there stand in the field, to be changed.
  whatIf({ moments, ordersAt, tryAgain }) {
    const time = element("input", { id: "what-if-time", type: "number", min: 0, step: 0.1, value: 0 });
    const marks = element("select", { id: "what-if-from" }, ...moments.map((one) => element("option", { textContent: `${clock(one.time)} ${one.name}`, value: one.time })));
    const orders = element("input", { id: "what-if-orders", type: "text", size: 60, placeholder: "tow.speed_kn=0.4 sea.wind.speed=12" });
    const button = element("button", { className: "main", textContent: "Try" });
    let isTouched = false;
    const fill = async () => { const held = await ordersAt(time.valueAsNumber || 0); if (!isTouched) orders.value = held; };
    orders.addEventListener("input", () => { isTouched = true; });
    time.addEventListener("change", fill);
    marks.addEventListener("change", () => { time.value = marks.value; fill(); });
    button.addEventListener("click", async () => { button.disabled = true; await tryAgain(time.valueAsNumber || 0, settings(orders.value)); button.disabled = false; });
    fill();
    return element("div", { className: "exports" }, element("label", {}, "What if, at ", marks, " or ", time, " s, it had been ordered: "), element("label", { className: "wide", ariaLabel: "Orders, KEY=VALUE, several with a space between" }, orders), button,
      element("span", { className: "quiet", textContent: "All other orders are given again." }));
  }
}

// Two runs: what other orders changed, as a table and two curves of each.
function comparison(found) {
  const box = element("section", { className: "compared", ariaLabel: "What if: both runs" });
  const said = found.apart === null ? `Nothing changes: both runs are the same, frame for frame, from ${clock(found.begin)} to ${clock(found.end)}.` : `The runs differ from ${clock(found.apart)} on; compared up to ${clock(found.end)}.`;
  box.append(element("h2", { textContent: `A: ${found.first}. B: the same with ${found.orders.join("; ") || "no other order"}.` }), element("p", { id: "what-if-said", className: found.apart === null ? "notice" : "", textContent: said }));
  if (found.apart === null) return box;
  const row = (kind, ...cells) => element("tr", {}, ...cells.map((text) => element(kind, { textContent: text })));
  const grades = found.grades.map(([boom, one, two]) => row("td", `grade, ${boom}`, "", one, two));
  box.append(element("table", {}, element("thead", {}, row("th", "", "", "A", "B")), element("tbody", {}, ...grades, ...found.rows.map((cells) => row("td", ...cells)))));
  const charts = element("div", { className: "curves" });
  for (const one of found.curves) {
    const chart = element("div", { className: "chart" }, element("h2", { textContent: `${one.title}, ${one.unit}` }));
    chart.draw = () => draw(chart, one);
    charts.append(chart);
  }
  box.append(charts);
  return box;
}

// Draws one quantity of both runs, each at its own times.
function draw(place, { first, second }) {
  const times = [...new Set([...first[0], ...second[0]])].sort((one, two) => one - two);
  const at = ([own, values]) => { const known = new Map(own.map((time, index) => [time, values[index]])); return times.map((time) => known.get(time)); };
  const line = (label, stroke, dash) => ({ label, stroke, dash, width: 2, spanGaps: true, points: { show: false } });
  new uPlot({ width: Math.max(place.clientWidth, 240), height: 150, legend: { show: true, live: false }, scales: { x: { time: false } },
    axes: [{ size: 26, font: "11px system-ui" }, { size: 50, font: "11px system-ui" }], series: [{ label: "s" }, line("A", "#0b5c8a"), line("B", "#c2410c", [6, 4])] }, [times, at(first), at(second)], place);
}

// The debrief in the page: the program's own page of a recording, two side by side after a branch, its export as one file or on paper, and
// "what if".
import { clock } from "./units.js";

const element = (kind, entries = {}, ...inner) => { const one = Object.assign(document.createElement(kind), entries); one.append(...inner); return one; };

export class Debriefs {
  constructor(place, link, token) { Object.assign(this, { place, link, token }); this.pages = []; }

  async fetch(name) {
    const answer = await fetch(`/debrief/${encodeURIComponent(name)}`, { headers: { authorization: `Bearer ${this.token}`, "x-password": this.link.password } });
    if (!answer.ok) throw new Error(await answer.text());
    return { name, address: URL.createObjectURL(await answer.blob()) };
  }

  // Shows the debriefs with these names, the last two side by side. `tries` are the moments from which the instructor may try again.
  async show(names, tries, tryAgain) {
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
    if (tries.length) bar.append(element("span", { className: "spacer" }), ...this.whatIf(tries, tryAgain));
    this.place.replaceChildren(bar, pages);
  }

  whatIf(tries, tryAgain) {
    const options = tries.map((one) => element("option", { textContent: `${clock(one.time)} ${one.name}` }));
    const from = element("select", { id: "what-if-from" }, ...options);
    const less = element("input", { id: "what-if-less", type: "number", min: 0, max: 5, step: 0.05, value: 0.1 });
    const button = element("button", { className: "main", textContent: "Try" });
    button.addEventListener("click", () => { button.disabled = true; tryAgain(tries[from.selectedIndex], less.valueAsNumber || 0); });
    return [element("label", {}, "What if, from ", from), element("label", {}, " the tow had been slower by ", less, " kn"), button];
  }
}

// The debrief in the page: the program's own page of a recording, two side by side after a branch, and its export as one file.
export class Debriefs {
  constructor(place, link, token) { Object.assign(this, { place, link, token }); this.pages = []; }

  async fetch(name) {
    const answer = await fetch(`/debrief/${encodeURIComponent(name)}`, { headers: { authorization: `Bearer ${this.token}`, "x-password": this.link.password } });
    if (!answer.ok) throw new Error(await answer.text());
    return { name, address: URL.createObjectURL(await answer.blob()) };
  }

  // Shows the debriefs with these names, the last two side by side.
  async show(names) {
    for (const page of this.pages) URL.revokeObjectURL(page.address);
    this.pages = await Promise.all(names.slice(-2).map((name) => this.fetch(name)));
    const bar = document.createElement("div"), pages = document.createElement("div");
    bar.className = "exports";
    pages.className = "pages";
    for (const page of this.pages) {
      const save = document.createElement("a");
      save.href = page.address;
      save.download = `${page.name}-debrief.html`;
      save.textContent = `Save ${page.name} as one HTML file`;
      bar.append(save);
      const box = document.createElement("figure"), frame = document.createElement("iframe"), caption = document.createElement("figcaption");
      caption.textContent = page.name;
      frame.title = `Debrief of ${page.name}`;
      frame.src = page.address;
      box.append(caption, frame);
      pages.append(box);
    }
    this.place.replaceChildren(bar, pages);
  }
}

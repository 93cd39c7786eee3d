// The link to the console's server: it introduces the page with its token, passes messages on, and comes back after a break.
const WAIT = [300, 1000, 2000, 5000]; // ms before each new try

export class Link {
  constructor(token, on) {
    Object.assign(this, { token, on, password: sessionStorage.getItem("password") ?? "", tries: 0, next: 1, open: false, delays: [] });
    this.pending = new Map();
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/live`);
    this.socket.onopen = () => this.socket.send(JSON.stringify({ token: this.token, password: this.password }));
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = (event) => this.lost(event);
  }

  take(message) {
    if (message.kind === "hello") { this.tries = 0; this.open = true; }
    if (message.kind !== "answer") return this.on(message);
    const waiting = this.pending.get(message.id);
    if (message.taken) { if (waiting) this.delays.push(performance.now() - waiting.sent); return; }
    this.pending.delete(message.id);
    if (message.problems) this.on({ kind: "refused", problems: message.problems, id: message.id });
    waiting?.done(message);
  }

  lost(event) {
    this.open = false;
    for (const waiting of this.pending.values()) waiting.done({ problems: [["the console", "was cut off before it answered"]] });
    this.pending.clear();
    this.on({ kind: "away", code: event.code, reason: event.reason });
    if (event.code !== 4401) setTimeout(() => this.connect(), WAIT[Math.min(this.tries++, WAIT.length - 1)]);
  }

  retry(password) {
    this.password = password;
    sessionStorage.setItem("password", password);
    this.connect();
  }

  // Gives a command; the promise holds the answer once the run has acted.
  give(verb, entries = {}) {
    if (!this.open) { this.on({ kind: "refused", problems: [["the console", "is away"]] }); return Promise.resolve({ problems: [] }); }
    const id = this.next++;
    return new Promise((done) => {
      this.pending.set(id, { done, sent: performance.now() });
      this.socket.send(JSON.stringify({ id, do: verb, ...entries }));
    });
  }
}

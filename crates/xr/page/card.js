// What is told beside the picture, and the menu: plain elements of the page.

const SHADINGS = ["plain", "displacement", "strain", "von-mises", "error"];
const SHOWN_MS = 7000;
const byId = (id) => document.getElementById(id);

export class Card {
  // `ask` sends a wish to the run; `frame` puts the eye where it is best.
  constructor(ask, frame) {
    this.ask = ask;
    this.frame = frame;
    this.heard = null;
    this.status = null;
    for (const button of document.querySelectorAll("[data-ask]")) button.onclick = () => ask(button.dataset.ask);
    byId("colours").onclick = () => this.nextColours();
    byId("read").onclick = () => byId("read-dialog").showModal();
    byId("save").onclick = () => byId("save-dialog").showModal();
    byId("exit").onclick = () => byId("exit-dialog").showModal();
    byId("frame").onclick = frame;
    byId("read-dialog").onclose = (e) => { if (e.target.returnValue && byId("read-name").value) ask("read", { name: byId("read-name").value }); };
    byId("save-dialog").onclose = (e) => { if (e.target.returnValue) ask("save", { name: byId("save-name").value }); };
    byId("exit-dialog").onclose = (e) => { if (e.target.returnValue === "exit") ask("exit"); };
    for (const id of ["tips", "second-tips"])
      byId(id).append(...["T", "I", "M", "R", "L"].map((letter) => Object.assign(document.createElement("span"), { textContent: letter })));
    document.addEventListener("keydown", (event) => this.key(event));
    byId("hint").textContent = matchMedia("(pointer: coarse)").matches
      ? "" : "drag: turn · right drag: shift · wheel: nearer · K keep shape · C colours · F view";
  }

  hello(hello) {
    this.ramp = hello.ramp;
    const shapes = hello.shapes.map((name) => {
      const button = Object.assign(document.createElement("button"), { textContent: name, value: "" });
      button.onclick = () => this.ask("read", { name });
      return button;
    });
    byId("shapes").replaceChildren(...shapes);
    byId("read-dialog").addEventListener("toggle", () => { byId("read-name").value = ""; });
    const context = byId("legend-ramp").getContext("2d");
    context.putImageData(new ImageData(Uint8ClampedArray.from(hello.ramp), hello.ramp.length / 4, 1), 0, 0);
    this.say("state", "the run is being prepared");
  }

  key(event) {
    if (event.target instanceof HTMLInputElement || event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector("dialog[open]")) return;
    const wishes = { k: "keep-shape", z: "undo-keep-shape", Backspace: "detach", Home: "return-home", ",": "restart" };
    const others = { c: () => this.nextColours(), f: this.frame, o: () => byId("read").click(), s: () => byId("save").click(), q: () => byId("exit").click() };
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (wishes[key]) this.ask(wishes[key]);
    else if (others[key]) others[key]();
    else return;
    event.preventDefault();
  }

  nextColours() {
    const now = SHADINGS.indexOf(this.status ? this.status.shading : "plain");
    this.ask("shade", { what: SHADINGS[(now + 1) % SHADINGS.length] });
  }

  say(id, text) {
    const element = byId(id);
    if (element.textContent !== text) element.textContent = text;
  }

  lost(why) {
    this.say("state", why);
    byId("state").className = "bad";
  }

  show(status) {
    this.status = status;
    this.say("state", status.state);
    byId("state").className = ["squeezed", "held"].includes(status.state) ? status.state : "";
    byId("second-tips").hidden = !status.second_tips;
    for (const [id, tips] of [["tips", status.tips], ["second-tips", status.second_tips ?? []]])
      [...byId(id).children].forEach((dot, i) => dot.classList.toggle("on", tips[i] === true));
    this.say("force", status.grip_n === null ? "" : `grip force ${status.grip_n.toFixed(2)} N`);
    const answer = status.round_trip_ms === null ? "" : ` · answer in ${status.round_trip_ms.toFixed(1)} ms`;
    const server = status.preparing ? "the server prepares the object" : `server ${status.server}`;
    this.say("server", `${server}${answer} · ${status.nodes} nodes · tick ${status.tick}`);
    document.querySelector("[data-ask=keep-shape]").disabled = !status.can_keep;
    document.querySelector("[data-ask=undo-keep-shape]").disabled = status.kept === 0;
    const legend = status.legend;
    byId("legend").hidden = legend === null;
    if (legend) {
      this.say("legend-title", legend.title);
      const marks = legend.marks.filter((_, i) => i % 2 === 0).map((text) => Object.assign(document.createElement("span"), { textContent: text }));
      byId("legend-marks").replaceChildren(...marks);
      this.say("legend-remark", legend.remark);
    }
    // A page that comes later does not hear old sentences.
    if (this.heard === null) this.heard = Math.max(0, ...status.sentences.map((s) => s.number));
    for (const { number, text, refused } of status.sentences) if (number > this.heard) this.tell(text, refused, number);
  }

  tell(text, refused, number = this.heard) {
    this.heard = number;
    const line = Object.assign(document.createElement("li"), { textContent: text, className: refused ? "refused" : "" });
    byId("sentences").append(line);
    while (byId("sentences").children.length > 5) byId("sentences").firstChild.remove();
    setTimeout(() => line.remove(), SHOWN_MS);
  }

  figures(text) { this.say("figures", text); }
}

// The page: stream, scene, eye, headset and cards put together.

import { Card } from "./card.js";
import { Eye } from "./eye.js";
import { Headset } from "./headset.js";
import { Scene } from "./scene.js";
import { Stream } from "./stream.js";

const canvas = document.getElementById("scene");
const figures = { drawn: 0, stereo: 0, faults: [], latencies: [], roundTrips: [] };

function start() {
  const scene = new Scene(canvas), eye = new Eye(canvas);
  let drawn = 0, shownRecord = null, waits = false;

  const card = new Card((ask, more) => stream.ask(ask, more), () => eye.leave());
  const stream = new Stream({
    hello: (hello) => { scene.setHello(hello); card.hello(hello); headset.takesHands = hello.takes_hands; drawn = 0; },
    status: (status) => { if (status.eye) eye.direct(status.eye); card.show(status); figures.status = status; },
    object: (object) => scene.setObject(object),
    hand: (hand) => scene.setHand(hand),
    picture: (picture) => {
      scene.setPicture(picture);
      if (Number.isFinite(picture.stamp)) keep(figures.roundTrips, performance.now() - picture.stamp);
      waits = true;
    },
    lost: (why) => { card.lost(why); shownRecord = null; },
  });
  const headset = new Headset(scene, stream, (ask, more) => stream.ask(ask, more), () => after(true));

  // A picture has been drawn: the run may send the next one.
  function after(inHeadset) {
    figures.drawn++;
    if (inHeadset) figures.stereo++;
    const picture = scene.picture;
    if (!waits || !picture) return;
    waits = false;
    let latency = NaN;
    if (picture.record !== null && picture.record !== shownRecord) {
      shownRecord = picture.record;
      latency = headset.age(picture.record);
      if (Number.isFinite(latency)) keep(figures.latencies, latency);
    }
    if (picture.number !== drawn) {
      drawn = picture.number;
      stream.acknowledge(drawn, latency, inHeadset);
    }
  }

  let before = performance.now(), told = 0;
  function draw(now) {
    requestAnimationFrame(draw);
    if (headset.isInside) return;
    const scale = Math.min(devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * scale), height = Math.round(canvas.clientHeight * scale);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    eye.follow(Math.min((now - before) / 1000, 0.1));
    before = now;
    const gl = scene.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    scene.draw(eye.view(canvas.width / Math.max(canvas.height, 1)));
    after(false);
    if (now - told > 500) { told = now; card.figures(text()); }
  }
  requestAnimationFrame(draw);

  function text() {
    const picture = scene.picture;
    if (!picture) return "";
    const parts = [`places to ±${(1e6 * picture.error).toFixed(1)} µm`, `picture ${(picture.bytes / 1024).toFixed(1)} KiB`];
    if (figures.roundTrips.length) parts.push(`there and back ${median(figures.roundTrips).toFixed(0)} ms`);
    if (figures.latencies.length) parts.push(`hand to picture ${median(figures.latencies).toFixed(0)} ms`);
    return parts.join(" · ");
  }
  // For tests of the page.
  window.softgrasp = { figures, stream: stream.figures, scene, eye, headset, card, median };
}

// Keeps the newest numbers.
function keep(numbers, number) {
  numbers.push(number);
  if (numbers.length > 240) numbers.shift();
}

function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted.length ? sorted[sorted.length >> 1] : NaN;
}

window.addEventListener("error", (event) => figures.faults.push(event.message));
window.addEventListener("unhandledrejection", (event) => figures.faults.push(String(event.reason)));
try {
  start();
} catch (error) {
  figures.faults.push(String(error));
  document.getElementById("state").textContent = String(error.message || error);
}

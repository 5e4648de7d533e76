// The stream between page and run: messages as docs/xr.md has them, little-endian, and a connection
// that is looked for again whenever it is lost.

const FORMAT = 2;
const OBJECT = 1, HAND = 2, PICTURE = 3;
const WITH_HAND = 1, COLOURED = 2, WHOLE = 4, WITH_SECOND = 8;
const NO_RECORD = 0xffffffff;
const ACK_BYTES = 24, JOINTS = 25, JOINTS_BYTES = 16 + 28 * JOINTS;

// A typed array of its own: offsets within a message need not fit its elements.
function array(kind, buffer, at, length) {
  return new kind(buffer.slice(at, at + length * kind.BYTES_PER_ELEMENT));
}

export function decodeObject(buffer) {
  const view = new DataView(buffer);
  const vertices = view.getUint32(8, true), triangles = view.getUint32(12, true);
  const count = view.getUint32(16, true), parts = [];
  let at = 20;
  for (let i = 0; i < count; i++, at += 52) {
    const f = (k) => view.getFloat32(at + 8 + 4 * k, true);
    parts.push({
      first: view.getUint32(at, true), triangles: view.getUint32(at + 4, true),
      colour: [f(0), f(1), f(2)], roughness: f(3), metallic: f(4), coat: [f(5), f(6)], subsurface: f(7),
      texture: view.getUint32(at + 40, true), relief: view.getUint32(at + 44, true),
      twoSided: view.getUint32(at + 48, true) !== 0,
    });
  }
  const uvs = array(Float32Array, buffer, at, 2 * vertices);
  at += 8 * vertices;
  return { version: view.getUint32(4, true), vertices, parts, uvs,
    triangles: array(Uint32Array, buffer, at, 3 * triangles) };
}

export function decodeHand(buffer) {
  const view = new DataView(buffer);
  const vertices = view.getUint32(8, true), triangles = view.getUint32(12, true);
  let at = 24;
  const floats = (each) => { const a = array(Float32Array, buffer, at, each * vertices); at += a.byteLength; return a; };
  const places = floats(3), normals = floats(3), uvs = floats(2), weights = floats(4);
  const bones = array(Uint8Array, buffer, at, 4 * vertices);
  at += 4 * vertices;
  return { version: view.getUint32(4, true), vertices, boneCount: view.getUint32(16, true), texture: view.getUint32(20, true),
    places, normals, uvs, weights, bones, triangles: array(Uint32Array, buffer, at, 3 * triangles) };
}

export function decodePicture(buffer) {
  const view = new DataView(buffer);
  const flags = view.getUint8(1), capsuleCount = view.getUint16(2, true);
  const runCount = view.getUint32(88, true), changed = view.getUint32(92, true);
  const record = view.getUint32(32, true);
  let at = 96;
  const hands = [];
  const takeHand = (version) => { hands.push({ version, bones: array(Float32Array, buffer, at, 18 * 8) }); at += 18 * 32; };
  if (flags & WITH_HAND) takeHand(view.getUint32(12, true));
  if (flags & WITH_SECOND) { at += 4; takeHand(view.getUint32(at - 4, true)); }
  const capsules = array(Float32Array, buffer, at, 8 * capsuleCount);
  at += 32 * capsuleCount;
  const runs = array(Uint32Array, buffer, at, 2 * runCount);
  at += 8 * runCount;
  const places = array(Uint16Array, buffer, at, 3 * changed);
  at += 6 * changed;
  const normals = array(Int16Array, buffer, at, 2 * changed);
  at += 4 * changed;
  const coloured = (flags & COLOURED) !== 0;
  return {
    number: view.getUint32(4, true), object: view.getUint32(8, true), hands,
    tick: Number(view.getBigUint64(16, true)), stamp: view.getFloat64(24, true),
    record: record === NO_RECORD ? null : record, ground: view.getFloat32(36, true),
    pose: array(Float32Array, buffer, 40, 7), origin: array(Float32Array, buffer, 68, 3),
    step: view.getFloat32(80, true), error: view.getFloat32(84, true),
    whole: (flags & WHOLE) !== 0, coloured, capsules, runs, places, normals, changed,
    shares: coloured ? array(Uint8Array, buffer, at, changed) : null, bytes: buffer.byteLength,
  };
}

export class Stream {
  // `hear` has functions hello, status, object, hand, picture, lost.
  constructor(hear) {
    this.hear = hear;
    this.pause = 500;
    this.figures = { connections: 0, pictures: 0, bytes: 0, handsSent: 0 };
    this.connect();
  }

  connect() {
    const address = new URL("stream", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => { this.pause = 500; this.figures.connections++; };
    socket.onmessage = (event) => { this.take(event.data); };
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.hear.lost(event.reason || "the run cannot be reached; looking for it again");
      setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(2 * this.pause, 4000);
    };
  }

  take(data) {
    if (typeof data === "string") {
      const told = JSON.parse(data);
      if (told.hello === undefined) return this.hear.status(told);
      if (told.hello !== FORMAT) return this.hear.lost("the page is older than the run: load it again");
      return this.hear.hello(told);
    }
    this.figures.bytes += data.byteLength;
    switch (new Uint8Array(data, 0, 1)[0]) {
      case OBJECT: return this.hear.object(decodeObject(data));
      case HAND: return this.hear.hand(decodeHand(data));
      case PICTURE: this.figures.pictures++; return this.hear.picture(decodePicture(data));
    }
  }

  get isOpen() { return this.socket.readyState === WebSocket.OPEN; }

  send(data) { if (this.isOpen) this.socket.send(data); }

  ask(ask, more = {}) { this.send(JSON.stringify({ ask, ...more })); }

  // Says that a picture has been drawn; `latency` in ms or NaN.
  acknowledge(number, latency, inHeadset) {
    const view = new DataView(new ArrayBuffer(ACK_BYTES));
    view.setUint8(0, 0x81);
    view.setUint32(4, number, true);
    view.setFloat64(8, performance.now(), true);
    view.setFloat32(16, latency, true);
    view.setUint32(20, inHeadset ? 1 : 0, true);
    this.send(view.buffer);
  }

  // Sends a hand: `numbers` are seven for each joint, NaN where it is not tracked.
  sendHand(isRight, number, timeMs, numbers) {
    const view = new DataView(new ArrayBuffer(JOINTS_BYTES));
    view.setUint8(0, 0x82);
    view.setUint8(1, isRight ? 1 : 0);
    view.setUint16(2, JOINTS, true);
    view.setUint32(4, number, true);
    view.setFloat64(8, timeMs, true);
    numbers.forEach((value, i) => view.setFloat32(16 + 4 * i, value, true));
    // What waits to be sent would come too late: the next hand is newer.
    if (this.isOpen && this.socket.bufferedAmount < 8 * JOINTS_BYTES) {
      this.socket.send(view.buffer);
      this.figures.handsSent++;
    }
  }
}

// The headset: two eyes, tracked hands, and a board with the menu in the scene.

import { Board } from "./board.js";

const JOINTS = 25;
const OFF_M = { ahead: 0.45, below: 0.38 };
const REMEMBERED = 512;

export class Headset {
  // `after` is told when a picture has been drawn for both eyes.
  constructor(scene, stream, ask, after) {
    this.scene = scene;
    this.stream = stream;
    this.after = after;
    this.session = null;
    this.takesHands = false;
    this.number = 0;
    this.sentAt = new Float64Array(REMEMBERED).fill(NaN);
    this.sentNumber = new Uint32Array(REMEMBERED);
    this.board = new Board(scene, (wish) => (wish === "place" ? (this.placed = false) : wish === "leave" ? this.session.end() : ask(wish)));
    this.button = document.getElementById("enter");
    this.button.onclick = () => this.enter();
    this.offer();
  }

  get isInside() { return this.session !== null; }

  async offer() {
    if (!navigator.xr) {
      if (!window.isSecureContext && /Quest|Vision|VR/i.test(navigator.userAgent))
        document.getElementById("hint").textContent = "a headset enters only over https: start the run with --xr-tls";
      return;
    }
    const can = await navigator.xr.isSessionSupported("immersive-vr").catch(() => false);
    this.button.hidden = !can;
  }

  async enter() {
    try {
      const session = await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["local-floor", "hand-tracking"] });
      const gl = this.scene.gl;
      await gl.makeXRCompatible();
      session.updateRenderState({ baseLayer: new XRWebGLLayer(session, gl), depthNear: 0.02, depthFar: 20 });
      this.base = await session.requestReferenceSpace("local-floor").catch(() => session.requestReferenceSpace("local"));
      this.placed = false;
      session.addEventListener("end", () => { this.session = null; });
      this.session = session;
      session.requestAnimationFrame((time, frame) => this.draw(time, frame));
    } catch (error) {
      this.session = null;
      document.getElementById("state").textContent = `the headset cannot be entered: ${error.message || error}`;
    }
  }

  // Puts the object's home before the person: ahead of the eyes and below them, the world turned as they look.
  place(frame) {
    const pose = frame.getViewerPose(this.base);
    if (!pose) return false;
    const { position: p, orientation: q } = pose.transform;
    const ahead = { x: -2 * (q.x * q.z + q.w * q.y), z: -(1 - 2 * (q.x * q.x + q.y * q.y)) };
    const length = Math.hypot(ahead.x, ahead.z) || 1;
    const yaw = Math.atan2(-ahead.x / length, -ahead.z / length);
    const at = { x: p.x + OFF_M.ahead * ahead.x / length, y: p.y - OFF_M.below, z: p.z + OFF_M.ahead * ahead.z / length };
    const turn = { x: 0, y: Math.sin(yaw / 2), z: 0, w: Math.cos(yaw / 2) };
    this.world = this.base.getOffsetReferenceSpace(new XRRigidTransform(at, turn));
    this.placed = true;
    return true;
  }

  draw(time, frame) {
    const session = frame.session;
    session.requestAnimationFrame((t, f) => this.draw(t, f));
    if (!this.placed && !this.place(frame)) return;
    const hands = this.hands(frame);
    this.send(hands, time);
    const pose = frame.getViewerPose(this.world);
    if (!pose) return;
    const layer = session.renderState.baseLayer, gl = this.scene.gl;
    this.board.follow(hands);
    const extras = [...this.skeletons(hands), ...this.board.extras()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    pose.views.forEach((view, i) => {
      const { x, y, width, height } = layer.getViewport(view);
      gl.viewport(x, y, width, height);
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(x, y, width, height);
      const { position: p } = view.transform;
      this.scene.draw({ projection: view.projectionMatrix, eyeFromWorld: view.transform.inverse.matrix, place: [p.x, p.y, p.z] }, extras);
    });
    gl.disable(gl.SCISSOR_TEST);
    this.after();
  }

  // Tracked hands in the world's frame: seven numbers for each joint, NaN where it is not tracked.
  hands(frame) {
    const hands = {};
    for (const source of frame.session.inputSources) {
      if (!source.hand) continue;
      const numbers = new Float32Array(7 * JOINTS).fill(NaN);
      let tracked = 0, joint = 0;
      for (const space of source.hand.values()) {
        const pose = frame.getJointPose(space, this.world);
        if (pose) {
          const { position: p, orientation: q } = pose.transform;
          numbers.set([p.x, p.y, p.z, q.x, q.y, q.z, q.w], 7 * joint);
          tracked++;
        }
        joint++;
      }
      if (tracked > 0) hands[source.handedness] = numbers;
    }
    return hands;
  }

  // Both hands grasp; where both are tracked from the beginning on, the right one is the first.
  send(hands, time) {
    if (!this.takesHands) return;
    for (const side of ["right", "left"]) {
      if (!hands[side]) continue;
      this.number = (this.number + 1) >>> 0;
      const at = this.number % REMEMBERED;
      this.sentAt[at] = performance.now();
      this.sentNumber[at] = this.number;
      this.stream.sendHand(side === "right", this.number, time, hands[side]);
    }
  }

  // How long ago a hand was tracked, ms; NaN for one that is forgotten.
  age(number) {
    const at = number % REMEMBERED;
    return this.sentNumber[at] === number ? performance.now() - this.sentAt[at] : NaN;
  }

  // The joints of both hands as balls: where the hand really is.
  skeletons(hands) {
    const extras = [];
    const grasps = this.takesHands;
    for (const numbers of Object.values(hands)) {
      for (let joint = 0; joint < JOINTS; joint++) {
        const [x, y, z] = numbers.subarray(7 * joint, 7 * joint + 3);
        if (Number.isNaN(x)) continue;
        const r = grasps ? 0.0022 : 0.005;
        extras.push({ mesh: this.scene.ball, matrix: [r, 0, 0, 0, 0, r, 0, 0, 0, 0, r, 0, x, y, z, 1],
          colour: grasps ? [0.9, 0.5, 0.1] : [0.55, 0.57, 0.62], roughness: 0.6 });
      }
    }
    return extras;
  }
}

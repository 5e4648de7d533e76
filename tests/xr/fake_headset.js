// A headset that is not there: navigator.xr with two eyes and the tracked hands of `window.fakeHands`: for "right",
// "left" or both the frames that the hand plays (25 places of a joint in tenths of a millimetre each, 15 frames a
// second), as often as a display of 72 Hz asks; where pictures come more slowly than ten a second, the hands move more
// slowly. The eye is where the page puts the world's origin at the origin.
(() => {
  const RATE_HZ = 72, LOOK_MS = 4, FRAMES_HZ = 15, STEP_MAX_S = 1 / 10, EYES_M = 0.032;
  const identity = { x: 0, y: 0, z: 0, w: 1 };
  window.XRRigidTransform = class {
    constructor(position = { x: 0, y: 0, z: 0 }, orientation = identity) {
      this.position = { x: 0, y: 0, z: 0, w: 1, ...position };
      this.orientation = { ...identity, ...orientation };
    }
    get matrix() {
      const { x, y, z } = this.position;
      return new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
    }
    get inverse() {
      const { x, y, z } = this.position;
      return new XRRigidTransform({ x: -x, y: -y, z: -z });
    }
  };
  const space = { getOffsetReferenceSpace() { return space; } };
  window.XRWebGLLayer = class {
    constructor(session, gl) { this.gl = gl; this.framebuffer = null; }
    getViewport(view) {
      const { width, height } = this.gl.canvas;
      return { x: view.eye === "left" ? 0 : width / 2, y: 0, width: width / 2, height };
    }
  };
  const joints = (side) => Array.from({ length: 25 }, (_, joint) => [joint, { joint, side }]);
  // Where a joint is now, between two frames.
  function place({ joint, side }, seconds) {
    const frames = window.fakeHands[side], at = Math.min(seconds * FRAMES_HZ, frames.length - 1), i = Math.floor(at), t = at - i;
    const a = frames[i][joint], b = frames[Math.min(i + 1, frames.length - 1)][joint];
    const [x, y, z] = a.map((of_a, axis) => 1e-4 * (of_a + t * (b[axis] - of_a)));
    return { x, y, z };
  }
  class Session extends EventTarget {
    constructor() {
      super();
      this.renderState = {};
      this.inputSources = Object.keys(window.fakeHands).map((side) => ({ handedness: side, hand: new Map(joints(side)) }));
      this.seconds = 0;
      this.before = performance.now();
      window.fakeSession = this;
    }
    // Whether the hands have come to the end of their frames.
    get isOver() { return this.seconds > Math.max(...Object.values(window.fakeHands).map((frames) => frames.length)) / FRAMES_HZ; }
    updateRenderState(state) { Object.assign(this.renderState, state); }
    async requestReferenceSpace() { return space; }
    // The next picture is asked for when the last one is drawn, as a headset does: pictures that queue up for a slow
    // renderer come in bursts, with a second of silence between them.
    requestAnimationFrame(draw) {
      const next = () => {
        const { gl } = this.renderState.baseLayer;
        if (this.ended) return;
        if (this.drawn && gl.getSyncParameter(this.drawn, gl.SYNC_STATUS) !== gl.SIGNALED) {
          setTimeout(next, LOOK_MS);
          return;
        }
        if (this.drawn) gl.deleteSync(this.drawn);
        draw(performance.now(), this.frame());
        this.drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
      };
      setTimeout(next, 1000 / RATE_HZ);
    }
    frame() {
      const eye = window.fakeEye || { x: 0, y: 0.38, z: 0.45 }, f = 1.2, n = 0.02, far = 20;
      const aspect = 0.5 * this.renderState.baseLayer.gl.canvas.width / this.renderState.baseLayer.gl.canvas.height;
      const tilt = 0.62, c = Math.cos(tilt), s = Math.sin(tilt);
      // The head looks down at the table: a turn about X.
      const view = (name, dx) => {
        const transform = new XRRigidTransform({ ...eye, x: eye.x + dx });
        const { x, y, z } = transform.position;
        const inverse = new Float32Array([1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, -x, -(c * y - s * z), -(s * y + c * z), 1]);
        return {
          eye: name, transform: { position: transform.position, inverse: { matrix: inverse } },
          projectionMatrix: new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + n) / (n - far), -1, 0, 0, (2 * far * n) / (n - far), 0]),
        };
      };
      const now = performance.now();
      if (window.fakeHandMoves) this.seconds += Math.min((now - this.before) / 1000, STEP_MAX_S);
      this.before = now;
      const seconds = this.seconds;
      return {
        session: this,
        getViewerPose: () => ({ transform: new XRRigidTransform(eye), views: [view("left", -EYES_M), view("right", EYES_M)] }),
        getJointPose: (joint) => ({ transform: new XRRigidTransform(place(joint, seconds)), radius: 0.01 }),
      };
    }
    async end() { this.ended = true; this.dispatchEvent(new Event("end")); }
  }
  const xr = { isSessionSupported: async (mode) => mode === "immersive-vr", requestSession: async () => new Session() };
  Object.defineProperty(navigator, "xr", { value: xr, configurable: true });
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
})();

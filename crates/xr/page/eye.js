// The eye of the flat viewer: where the run puts it, until the person moves it by mouse or touch.

const FIELD_OF_VIEW = 0.60, PITCH_MAX = 1.53, NEAR = 0.005, FAR = 8, NEAREST = 0.03, FARTHEST = 4;

export function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(fov / 2), n = 1 / (near - far);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * n, -1, 0, 0, 2 * far * near * n, 0]);
}

export class Eye {
  constructor(canvas) {
    this.canvas = canvas;
    this.now = { target: [0, 0, 0], distance: 0.46, yaw: -0.75, pitch: 0.31 };
    this.directed = null;
    this.isChosen = false;
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); this.pointers.set(e.pointerId, e); canvas.focus(); });
    const up = (e) => this.pointers.delete(e.pointerId);
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom(Math.exp(0.0012 * e.deltaY)); }, { passive: false });
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("dblclick", () => this.leave());
  }

  // The eye that the run asks for.
  direct(eye) {
    const isFirst = this.directed === null;
    this.directed = eye;
    if (isFirst && !this.isChosen) this.now = structuredClone(eye);
  }

  // The person has not chosen an eye any more.
  leave() { this.isChosen = false; }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
    const height = this.canvas.clientHeight;
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers.values()].filter((p) => p.pointerId !== event.pointerId);
      const span = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
      this.zoom(span(before) / Math.max(span(event), 1));
      this.pan(0.5 * dx / height, 0.5 * dy / height);
    } else if (event.buttons & 6 || event.shiftKey) {
      this.pan(dx / height, dy / height);
    } else {
      this.isChosen = true;
      this.now.yaw -= 3.2 * dx / height;
      this.now.pitch = Math.max(-PITCH_MAX, Math.min(PITCH_MAX, this.now.pitch + 3.2 * dy / height));
    }
    this.pointers.set(event.pointerId, event);
  }

  zoom(factor) {
    this.isChosen = true;
    this.now.distance = Math.max(NEAREST, Math.min(FARTHEST, this.now.distance * factor));
  }

  // Shifts what is seen by parts of the picture's height.
  pan(right, down) {
    this.isChosen = true;
    const [x, y] = this.axes(), reach = 2 * Math.tan(FIELD_OF_VIEW / 2) * this.now.distance;
    for (let i = 0; i < 3; i++) this.now.target[i] += reach * (down * y[i] - right * x[i]);
  }

  axes() {
    const { yaw, pitch } = this.now, c = Math.cos(yaw), s = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch);
    return [[c, 0, -s], [-s * sp, cp, -c * sp], [s * cp, sp, c * cp]];
  }

  // Glides to where the run asks for.
  follow(seconds) {
    if (this.isChosen || !this.directed) return;
    const share = 1 - Math.exp(-5 * seconds), to = this.directed, now = this.now;
    const turn = Math.atan2(Math.sin(to.yaw - now.yaw), Math.cos(to.yaw - now.yaw));
    now.yaw += share * turn;
    now.pitch += share * (to.pitch - now.pitch);
    now.distance += share * (to.distance - now.distance);
    for (let i = 0; i < 3; i++) now.target[i] += share * (to.target[i] - now.target[i]);
  }

  // What a renderer needs: projection, eye from world, place of the eye.
  view(aspect) {
    const [x, y, z] = this.axes(), { target, distance } = this.now;
    const place = target.map((t, i) => t + distance * z[i]);
    const dot = (a) => -(a[0] * place[0] + a[1] * place[1] + a[2] * place[2]);
    const fov = aspect < 1 ? 2 * Math.atan(Math.tan(FIELD_OF_VIEW / 2) / aspect) : FIELD_OF_VIEW;
    return {
      projection: perspective(fov, aspect, NEAR, FAR), place,
      eyeFromWorld: new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, dot(x), dot(y), dot(z), 1]),
    };
  }
}

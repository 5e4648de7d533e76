// A board in the scene with the menu of the thesis: a fingertip that goes through a field presses it.

const FIELDS = [
  ["keep-shape", "Keep shape"], ["undo-keep-shape", "Undo"], ["detach", "Let go"], ["return-home", "Home"],
  ["restart", "Again"], ["place", "Place here"], ["leave", "Leave"], ["exit", "Exit"],
];
const COLUMNS = 2, ROWS = Math.ceil(FIELDS.length / COLUMNS);
const WIDTH_M = 0.17, HEIGHT_M = 0.14, PIXELS = [512, 420];
// To the left of the object, turned to the person.
const CENTRE_M = [-0.27, 0.09, 0.02], TURN = 0.5;
const NEAR_M = 0.012, AGAIN_MS = 900, TIP = 9;

export class Board {
  constructor(scene, press) {
    this.scene = scene;
    this.press = press;
    this.pressedAt = -AGAIN_MS;
    this.pressed = null;
    this.wasBefore = {};
    const c = Math.cos(TURN), s = Math.sin(TURN);
    this.matrix = [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, ...CENTRE_M, 1];
    const w = WIDTH_M / 2, h = HEIGHT_M / 2;
    this.mesh = scene.mesh([-w, -h, 0, w, -h, 0, w, h, 0, -w, h, 0], [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1], [0, 1, 2, 0, 2, 3], [0, 1, 1, 1, 1, 0, 0, 0]);
    this.paint();
  }

  paint() {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = PIXELS;
    const context = canvas.getContext("2d"), [w, h] = [PIXELS[0] / COLUMNS, PIXELS[1] / ROWS];
    context.fillStyle = "#eef1f5";
    context.fillRect(0, 0, ...PIXELS);
    context.font = "600 34px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    FIELDS.forEach(([wish, text], i) => {
      const x = (i % COLUMNS) * w, y = Math.floor(i / COLUMNS) * h;
      context.fillStyle = wish === this.pressed ? "#2563eb" : "#ffffff";
      context.fillRect(x + 8, y + 8, w - 16, h - 16);
      context.fillStyle = wish === this.pressed ? "#ffffff" : "#1d2430";
      context.fillText(text, x + w / 2, y + h / 2);
    });
    const pixels = context.getImageData(0, 0, ...PIXELS);
    if (this.texture) this.scene.gl.deleteTexture(this.texture);
    this.texture = this.scene.texture(...PIXELS, new Uint8Array(pixels.data.buffer), true);
  }

  // Looks whether the tip of an index finger has gone through the board.
  follow(hands) {
    const now = performance.now();
    if (this.pressed && now - this.pressedAt > AGAIN_MS / 2) { this.pressed = null; this.paint(); }
    for (const [side, numbers] of Object.entries(hands)) {
      const [x, y, z] = this.inBoard(numbers.subarray(7 * TIP, 7 * TIP + 3));
      const isInside = Math.abs(x) < WIDTH_M / 2 && Math.abs(y) < HEIGHT_M / 2 && Math.abs(z) < 3 * NEAR_M;
      const through = isInside && z < NEAR_M / 2 && this.wasBefore[side] === true;
      this.wasBefore[side] = isInside ? this.wasBefore[side] || z > NEAR_M / 2 : false;
      if (!through || now - this.pressedAt < AGAIN_MS) continue;
      this.wasBefore[side] = false;
      const column = Math.floor((x / WIDTH_M + 0.5) * COLUMNS), row = Math.floor((0.5 - y / HEIGHT_M) * ROWS);
      const field = FIELDS[row * COLUMNS + column];
      if (!field) continue;
      this.pressedAt = now;
      this.pressed = field[0];
      this.paint();
      this.press(field[0]);
    }
  }

  inBoard([x, y, z]) {
    const [dx, dy, dz] = [x - CENTRE_M[0], y - CENTRE_M[1], z - CENTRE_M[2]], c = Math.cos(TURN), s = Math.sin(TURN);
    return [c * dx - s * dz, dy, s * dx + c * dz];
  }

  extras() {
    return [{ mesh: this.mesh, matrix: this.matrix, texture: this.texture, isOnlyTexture: true }];
  }
}

// What is drawn: object, hands, ground and the joints of tracked hands, by WebGL 2 alone.

import { FRAGMENT, HAND_VERTEX, OBJECT_VERTEX, PLAIN_VERTEX } from "./shaders.js";

const GROUND_RADIUS_M = 3, MAX_CAPSULES = 24;

export class Scene {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, xrCompatible: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.canvas = canvas;
    this.object = null;
    this.hands = new Map();
    this.picture = null;
    this.light = null;
    this.programs = {
      object: this.program(OBJECT_VERTEX), hand: this.program(HAND_VERTEX), plain: this.program(PLAIN_VERTEX),
    };
    this.textures = new Map();
    this.white = this.texture(1, 1, new Uint8Array([255, 255, 255, 255]), false);
    this.flat = this.texture(1, 1, new Uint8Array([128, 128, 255, 255]), false);
    this.ground = this.mesh([-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1], [0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0], [0, 2, 1, 0, 3, 2]);
    this.ball = this.mesh(...ball(8, 6));
    gl.enable(gl.DEPTH_TEST);
  }

  program(vertex) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const at = new Map();
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i);
      at.set(name.replace("[0]", ""), gl.getUniformLocation(program, name));
    }
    return { program, at };
  }

  texture(width, height, rgba, isColour) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, isColour ? gl.SRGB8_ALPHA8 : gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    return texture;
  }

  // Fetches a picture of a surface; until it is there the surface has none.
  async fetchTexture(number, isColour) {
    if (!number || this.textures.has(number)) return;
    this.textures.set(number, null);
    try {
      const answer = await fetch(`texture/${number}`);
      if (!answer.ok) throw new Error(`${answer.status}`);
      const bytes = await answer.arrayBuffer(), size = new Uint32Array(bytes.slice(0, 8));
      this.textures.set(number, this.texture(size[0], size[1], new Uint8Array(bytes, 8), isColour));
    } catch {
      this.textures.delete(number);
    }
  }

  buffer(kind, data, usage) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(kind, buffer);
    gl.bufferData(kind, data, usage);
    return buffer;
  }

  attribute(at, buffer, size, type, isWhole = false) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    if (isWhole) gl.vertexAttribIPointer(at, size, type, 0, 0);
    else gl.vertexAttribPointer(at, size, type, false, 0, 0);
  }

  mesh(places, normals, triangles, uvs = null) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.attribute(0, this.buffer(gl.ARRAY_BUFFER, new Float32Array(places), gl.STATIC_DRAW), 3, gl.FLOAT);
    this.attribute(1, this.buffer(gl.ARRAY_BUFFER, new Float32Array(normals), gl.STATIC_DRAW), 3, gl.FLOAT);
    if (uvs) this.attribute(2, this.buffer(gl.ARRAY_BUFFER, new Float32Array(uvs), gl.STATIC_DRAW), 2, gl.FLOAT);
    this.buffer(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(triangles), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: triangles.length };
  }

  setHello(hello) {
    this.light = hello.light;
    const ramp = Uint8Array.from(hello.ramp);
    const gl = this.gl;
    this.ramp = this.texture(ramp.length / 4, 1, ramp, true);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  }

  setObject(object) {
    const gl = this.gl, count = object.vertices;
    if (this.object) this.forget(this.object);
    object.numbers = new Uint16Array(4 * count);
    object.normals = new Int16Array(2 * count);
    object.array = gl.createVertexArray();
    gl.bindVertexArray(object.array);
    object.numberBuffer = this.buffer(gl.ARRAY_BUFFER, object.numbers, gl.DYNAMIC_DRAW);
    this.attribute(0, object.numberBuffer, 4, gl.UNSIGNED_SHORT);
    object.normalBuffer = this.buffer(gl.ARRAY_BUFFER, object.normals, gl.DYNAMIC_DRAW);
    this.attribute(1, object.normalBuffer, 2, gl.SHORT);
    object.uvBuffer = this.buffer(gl.ARRAY_BUFFER, object.uvs, gl.STATIC_DRAW);
    this.attribute(2, object.uvBuffer, 2, gl.FLOAT);
    object.indexBuffer = this.buffer(gl.ELEMENT_ARRAY_BUFFER, object.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.object = object;
    this.picture = null;
    for (const part of object.parts) {
      this.fetchTexture(part.texture, true);
      this.fetchTexture(part.relief, false);
    }
  }

  forget(object) {
    const gl = this.gl;
    gl.deleteVertexArray(object.array);
    for (const key of ["numberBuffer", "normalBuffer", "uvBuffer", "indexBuffer"]) gl.deleteBuffer(object[key]);
    for (const part of object.parts) for (const number of [part.texture, part.relief]) {
      if (this.textures.get(number)) gl.deleteTexture(this.textures.get(number));
      this.textures.delete(number);
    }
  }

  setHand(hand) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const put = (at, data, size, type, isWhole) => this.attribute(at, this.buffer(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW), size, type, isWhole);
    put(0, hand.places, 3, gl.FLOAT);
    put(1, hand.normals, 3, gl.FLOAT);
    put(2, hand.uvs, 2, gl.FLOAT);
    put(3, hand.weights, 4, gl.FLOAT);
    put(4, hand.bones, 4, gl.UNSIGNED_BYTE, true);
    this.buffer(gl.ELEMENT_ARRAY_BUFFER, hand.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.hands.set(hand.version, { array, count: hand.triangles.length, texture: hand.texture });
    this.fetchTexture(hand.texture, true);
  }

  // Takes what of a picture differs from the one before.
  setPicture(picture) {
    const object = this.object, gl = this.gl;
    if (!object || object.version !== picture.object) return;
    let at = 0, low = object.vertices, high = 0;
    for (let run = 0; run < picture.runs.length; run += 2) {
      const first = picture.runs[run], length = picture.runs[run + 1];
      if (first + length > object.vertices) return;
      for (let v = first; v < first + length; v++, at++) {
        object.numbers[4 * v] = picture.places[3 * at];
        object.numbers[4 * v + 1] = picture.places[3 * at + 1];
        object.numbers[4 * v + 2] = picture.places[3 * at + 2];
        object.numbers[4 * v + 3] = picture.shares ? picture.shares[at] : 0;
        object.normals[2 * v] = picture.normals[2 * at];
        object.normals[2 * v + 1] = picture.normals[2 * at + 1];
      }
      low = Math.min(low, first);
      high = Math.max(high, first + length);
    }
    if (high > low) {
      gl.bindBuffer(gl.ARRAY_BUFFER, object.numberBuffer);
      gl.bufferSubData(gl.ARRAY_BUFFER, 8 * low, object.numbers, 4 * low, 4 * (high - low));
      gl.bindBuffer(gl.ARRAY_BUFFER, object.normalBuffer);
      gl.bufferSubData(gl.ARRAY_BUFFER, 4 * low, object.normals, 2 * low, 2 * (high - low));
    }
    this.picture = picture;
    // Hands of other sizes than these come no more.
    const shown = picture.hands.map((hand) => hand.version);
    for (const [version, { array }] of this.hands) if (shown.length && version < Math.min(...shown)) {
      gl.deleteVertexArray(array);
      this.hands.delete(version);
    }
  }

  // Draws into the framebuffer that is bound; `view` as Eye.view gives it.
  draw(view, extras = []) {
    const gl = this.gl, light = this.light, picture = this.picture;
    if (!light) return;
    const wall = toned(light.wall).map(shown);
    gl.clearColor(wall[0], wall[1], wall[2], 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!picture) return;
    this.drawGround(view, picture);
    this.drawObject(view, picture);
    for (const { version, bones } of picture.hands) {
      const hand = this.hands.get(version);
      if (hand) this.drawHand(view, hand, bones);
    }
    for (const extra of extras) this.drawExtra(view, extra);
    gl.bindVertexArray(null);
  }

  begin({ program, at }, view) {
    const gl = this.gl, light = this.light;
    gl.useProgram(program);
    this.at = at;
    const towards = (d) => { const l = -Math.hypot(...d); return d.map((x) => x / l); };
    gl.uniformMatrix4fv(at.get("uProjection"), false, view.projection);
    gl.uniformMatrix4fv(at.get("uEyeFromWorld"), false, view.eyeFromWorld);
    gl.uniform3fv(at.get("uEye"), view.place);
    gl.uniform2f(at.get("uFog"), light.fog_m[0], 1 / (light.fog_m[1] - light.fog_m[0]));
    gl.uniform3fv(at.get("uWall"), light.wall);
    gl.uniform3fv(at.get("uKeyTowards"), towards(light.key_direction));
    gl.uniform3fv(at.get("uKey"), light.key);
    gl.uniform3fv(at.get("uFillTowards"), towards(light.fill_direction));
    gl.uniform3fv(at.get("uFill"), light.fill);
  }

  material({ colour = [1, 1, 1], alpha = 1, roughness = 0.5, metallic = 0, subsurface = 0, coat = [0, 0.5], texture = null, relief = null,
    isShared = false, isShaded = false, isOnlyTexture = false }) {
    const gl = this.gl, at = this.at;
    gl.uniform4f(at.get("uColour"), ...colour, alpha);
    gl.uniform4f(at.get("uSurface"), Math.max(roughness, 0.05), metallic, this.light.wrap + 0.5 * subsurface, isShared ? 1 : 0);
    gl.uniform2f(at.get("uCoat"), coat[0], Math.max(coat[1], 0.05));
    gl.uniform4f(at.get("uUse"), texture ? 1 : 0, relief ? 1 : 0, isShaded ? 1 : 0, isOnlyTexture ? 1 : 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, relief || this.flat);
    gl.uniform1i(at.get("uRelief"), 1);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture || this.white);
    gl.uniform1i(at.get("uTexture"), 0);
  }

  drawGround(view, picture) {
    const gl = this.gl, r = GROUND_RADIUS_M;
    this.begin(this.programs.plain, view);
    this.material({ colour: this.light.ground, roughness: this.light.ground_roughness, isShaded: true });
    const capsules = new Float32Array(8 * MAX_CAPSULES);
    capsules.set(picture.capsules.subarray(0, capsules.length));
    gl.uniform4fv(this.at.get("uCapsules"), capsules);
    gl.uniform4fv(this.at.get("uAll"), ballOf(capsules, Math.min(picture.capsules.length / 8, MAX_CAPSULES)));
    gl.uniform1f(this.at.get("uCapsuleCount"), Math.min(picture.capsules.length / 8, MAX_CAPSULES));
    gl.uniformMatrix4fv(this.at.get("uWorldFromModel"), false, [r, 0, 0, 0, 0, 1, 0, 0, 0, 0, r, 0, 0, picture.ground, 0, 1]);
    this.elements(this.ground);
  }

  drawObject(view, picture) {
    const gl = this.gl, object = this.object;
    this.begin(this.programs.object, view);
    gl.uniform3fv(this.at.get("uOrigin"), picture.origin);
    gl.uniform1f(this.at.get("uStep"), picture.step);
    gl.uniform3fv(this.at.get("uShift"), picture.pose.subarray(0, 3));
    gl.uniform4fv(this.at.get("uTurn"), picture.pose.subarray(3, 7));
    gl.bindVertexArray(object.array);
    object.parts.forEach((part, i) => {
      const isShared = i === 0 && picture.coloured;
      const own = { ...part, texture: this.textures.get(part.texture), relief: this.textures.get(part.relief) };
      this.material(isShared ? { roughness: 0.65, texture: this.ramp, isShared } : own);
      if (part.twoSided) gl.disable(gl.CULL_FACE); else gl.enable(gl.CULL_FACE);
      gl.drawElements(gl.TRIANGLES, 3 * part.triangles, gl.UNSIGNED_INT, 12 * part.first);
    });
    gl.disable(gl.CULL_FACE);
  }

  drawHand(view, hand, bones) {
    const gl = this.gl, [roughness, subsurface] = this.light.hand;
    this.begin(this.programs.hand, view);
    gl.uniform4fv(this.at.get("uBones"), bones);
    this.material({ roughness, subsurface, texture: this.textures.get(hand.texture) });
    this.elements(hand);
  }

  // A ball or a board of a headset: { mesh, matrix, ...material }.
  drawExtra(view, extra) {
    const gl = this.gl;
    this.begin(this.programs.plain, view);
    this.material(extra);
    gl.uniformMatrix4fv(this.at.get("uWorldFromModel"), false, extra.matrix);
    this.elements(extra.mesh);
  }

  elements({ array, count }) {
    const gl = this.gl;
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
  }
}

// As the shader tones light, so that the fog ends in the wall.
function toned(c) {
  const low = Math.min(...c), moved = c.map((x) => x - (low < 0.08 ? low - 6.25 * low * low : 0.04)), peak = Math.max(...moved), start = 0.76;
  if (peak < start) return moved;
  const d = 1 - start, most = 1 - (d * d) / (peak + d - start), grey = 1 - 1 / (0.15 * (peak - most) + 1);
  return moved.map((x) => (x * most / peak) * (1 - grey) + most * grey);
}

// A linear colour as the screen takes it.
function shown(c) { return c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055; }

// The middle of some capsules, and a radius that holds them all.
function ballOf(capsules, count) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < count; i++) for (const end of [0, 4]) for (let axis = 0; axis < 3; axis++) {
    const place = capsules[8 * i + end + axis], radius = capsules[8 * i + 3];
    low[axis] = Math.min(low[axis], place - radius);
    high[axis] = Math.max(high[axis], place + radius);
  }
  const middle = low.map((l, axis) => 0.5 * (l + high[axis])), half = low.map((l, axis) => 0.5 * (high[axis] - l));
  return count > 0 ? [...middle, Math.hypot(...half)] : [0, 0, 0, 0];
}

// A ball of radius 1: places, normals, triangles.
function ball(around, up) {
  const places = [], triangles = [];
  for (let i = 0; i <= up; i++) for (let k = 0; k < around; k++) {
    const a = (2 * Math.PI * k) / around, b = (Math.PI * i) / up;
    places.push(Math.sin(b) * Math.cos(a), Math.cos(b), Math.sin(b) * Math.sin(a));
    if (i < up) {
      const here = i * around + k, next = i * around + ((k + 1) % around);
      triangles.push(here, next, here + around, next, next + around, here + around);
    }
  }
  return [places, places, triangles];
}

// Light as the window's plain material has it (crates/window, plain_material.wgsl): one lamp, one fill,
// the surroundings, and shade below what stands above the ground. Metres, Y up, colours linear.

const HEAD = `#version 300 es
precision highp float;
precision highp int;
`;

const OUT = `
out vec3 vPlace; out vec3 vNormal; out vec2 vUv; out float vShare;
uniform mat4 uProjection; uniform mat4 uEyeFromWorld;
void show(vec3 place, vec3 normal) {
  vPlace = place; vNormal = normal;
  gl_Position = uProjection * (uEyeFromWorld * vec4(place, 1.0));
}
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
`;

// The object: places counted in steps within a box, normals folded into a square.
export const OBJECT_VERTEX = HEAD + `
layout(location = 0) in vec4 aNumbers; layout(location = 1) in vec2 aNormal; layout(location = 2) in vec2 aUv;
uniform vec3 uOrigin; uniform float uStep; uniform vec4 uTurn; uniform vec3 uShift;` + OUT + `
vec3 unfolded(vec2 f) {
  float y = 1.0 - abs(f.x) - abs(f.y);
  float under = max(-y, 0.0);
  vec2 s = vec2(f.x < 0.0 ? -1.0 : 1.0, f.y < 0.0 ? -1.0 : 1.0);
  vec2 xz = f - under * s;
  return normalize(vec3(xz.x, y, xz.y));
}
void main() {
  vUv = aUv; vShare = aNumbers.w / 255.0;
  vec3 place = uOrigin + aNumbers.xyz * uStep;
  show(turned(uTurn, place) + uShift, turned(uTurn, unfolded(aNormal / 32767.0)));
}`;

// The hand: dual quaternions of its bones, blended by weights.
export const HAND_VERTEX = HEAD + `
layout(location = 0) in vec3 aPlace; layout(location = 1) in vec3 aNormal; layout(location = 2) in vec2 aUv;
layout(location = 3) in vec4 aWeights; layout(location = 4) in uvec4 aBones;
uniform vec4 uBones[36];` + OUT + `
void main() {
  vUv = aUv; vShare = 0.0;
  vec4 real = vec4(0.0), dual = vec4(0.0);
  for (int i = 0; i < 4; i++) {
    int bone = int(aBones[i]);
    vec4 turn = uBones[2 * bone];
    float weight = dot(turn, real) < 0.0 ? -aWeights[i] : aWeights[i];
    real += weight * turn;
    dual += weight * uBones[2 * bone + 1];
  }
  float scale = 1.0 / length(real);
  real *= scale; dual *= scale;
  vec3 shift = 2.0 * (dual.xyz * real.w - real.xyz * dual.w + cross(real.xyz, dual.xyz));
  show(turned(real, aPlace) + shift, turned(real, aNormal));
}`;

// Things of a fixed shape: the ground, balls at joints, the menu of a headset.
export const PLAIN_VERTEX = HEAD + `
layout(location = 0) in vec3 aPlace; layout(location = 1) in vec3 aNormal; layout(location = 2) in vec2 aUv;
uniform mat4 uWorldFromModel;` + OUT + `
void main() {
  vUv = aUv; vShare = 0.0;
  show((uWorldFromModel * vec4(aPlace, 1.0)).xyz, normalize(mat3(uWorldFromModel) * aNormal));
}`;

export const FRAGMENT = HEAD + `
in vec3 vPlace; in vec3 vNormal; in vec2 vUv; in float vShare;
uniform vec3 uEye; uniform vec4 uColour;
uniform vec4 uSurface;                 // roughness, metallic, share that gets around the edge, shares are coloured
uniform vec2 uCoat;                    // strength and roughness of a clear layer
uniform vec2 uFog;                     // begin, one over its depth
uniform vec3 uWall, uKeyTowards, uKey, uFillTowards, uFill;
uniform sampler2D uTexture; uniform sampler2D uRelief;
uniform vec4 uUse;                     // texture, relief, shade of the ground, only the texture
uniform vec4 uCapsules[48];            // begin and radius, end
uniform float uCapsuleCount;
uniform vec4 uAll;                     // middle and radius of a ball that holds all capsules
out vec4 colour;

float saturate(float x) { return clamp(x, 0.0, 1.0); }
vec3 fromAround(vec3 n) {
  float up = 0.5 + 0.5 * n.y;
  return uWall * mix(0.70, 1.52, up * (0.45 + 0.55 * up));
}
vec3 mirrored(vec3 d, float roughness) {
  float wall = mix(0.62, 1.0, smoothstep(-0.3 - roughness, 0.1 + roughness, d.y));
  float lamp = smoothstep(0.62 - 0.7 * roughness, 0.82 + 0.5 * roughness, d.y);
  return uWall * (wall + lamp * mix(2.2, 1.2, roughness));
}
float highlight(float towards, float roughness) {
  float narrow = roughness * roughness;
  float power = 2.0 / (narrow * narrow + 0.002);
  return 0.125 * (power + 2.0) * pow(max(towards, 1e-6), power);
}
// A relief's slope, with the directions of the texture taken from the screen.
vec3 bumped(vec3 n) {
  vec3 dp1 = dFdx(vPlace), dp2 = dFdy(vPlace);
  vec2 du1 = dFdx(vUv), du2 = dFdy(vUv);
  vec3 a = cross(dp2, n), b = cross(n, dp1);
  vec3 t = a * du1.x + b * du2.x, s = a * du1.y + b * du2.y;
  float scale = inversesqrt(max(max(dot(t, t), dot(s, s)), 1e-30));
  vec3 m = texture(uRelief, vUv).xyz * 2.0 - 1.0;
  return normalize(t * (-m.x * scale) + s * (m.y * scale) + n * max(m.z, 0.05));
}
// Shade of a capsule at a place of the ground: share of the lamp's light and of that from around.
vec2 below(vec4 begin, vec4 end) {
  float radius = begin.w;
  vec3 light = uKeyTowards, along = end.xyz - begin.xyz, to = begin.xyz - vPlace;
  vec3 flatAlong = along - light * dot(along, light), flatTo = to - light * dot(to, light);
  float at = saturate(-dot(flatTo, flatAlong) / (dot(flatAlong, flatAlong) + 2.5e-9));
  float beside = length(flatTo + at * flatAlong);
  float above = dot(to + at * along, light);
  float blur = 0.002 + 0.08 * max(above, 0.0);
  float lamp = 1.0 - (1.0 - smoothstep(radius - blur, radius + blur, beside))
    * (radius * radius) / (radius * radius + 0.15 * blur * blur);
  float near = saturate(-dot(to, along) / (dot(along, along) + 2.5e-9));
  vec3 toNear = to + near * along;
  float away = max(dot(toNear, toNear), radius * radius + 2.5e-9);
  float around = 1.0 - 0.9 * radius * radius * saturate(toNear.y * inversesqrt(away)) / away;
  return vec2(lamp, around);
}
// Whether a place of the ground may be seen to be shaded: the lamp's shade blurs by less than this much,
// and light from around that is taken further away is less than a level of a screen.
bool isNear() {
  vec3 to = uAll.xyz - vPlace;
  vec3 flatTo = to - uKeyTowards * dot(to, uKeyTowards);
  return length(flatTo) < uAll.w + 0.1 || length(to) < uAll.w + 0.5;
}
// Source: the neutral tone mapper of the Khronos group for physically based rendering.
vec3 toned(vec3 c) {
  float x = min(c.r, min(c.g, c.b));
  c -= x < 0.08 ? x - 6.25 * x * x : 0.04;
  float peak = max(c.r, max(c.g, c.b));
  const float start = 0.76;
  if (peak < start) return c;
  const float d = 1.0 - start;
  float most = 1.0 - d * d / (peak + d - start);
  float grey = 1.0 - 1.0 / (0.15 * (peak - most) + 1.0);
  return mix(c * most / peak, vec3(most), grey);
}
vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
void main() {
  vec2 uv = uSurface.w > 0.5 ? vec2((vShare * 255.0 + 0.5) / 256.0, 0.5) : vUv;
  vec4 texel = uUse.x > 0.5 ? texture(uTexture, uv) * uColour : uColour;
  if (uUse.w > 0.5) { colour = vec4(encoded(texel.rgb), texel.a); return; }
  vec3 normal = normalize(vNormal) * (gl_FrontFacing ? 1.0 : -1.0);
  if (uUse.y > 0.5) normal = bumped(normal);
  vec2 shade = vec2(1.0);
  if (uUse.z > 0.5 && isNear()) for (int i = 0; i < 24; i++) {
    if (float(i) >= uCapsuleCount) break;
    vec2 s = below(uCapsules[2 * i], uCapsules[2 * i + 1]);
    shade = vec2(min(shade.x, s.x), shade.y * s.y);
  }
  vec3 fromEye = vPlace - uEye;
  float distance = length(fromEye);
  vec3 view = -fromEye / distance;
  float roughness = uSurface.x, metallic = uSurface.y, wrap = uSurface.z;
  float keyCosine = dot(normal, uKeyTowards);
  vec3 key = uKey * shade.x;
  vec3 spread = key * max(keyCosine + wrap, 0.0) / (1.0 + wrap)
    + uFill * max(dot(normal, uFillTowards) + wrap, 0.0) / (1.0 + wrap) + fromAround(normal) * shade.y;
  float edge = pow(1.0 - saturate(dot(normal, view)), 5.0);
  vec3 straight = mix(vec3(0.04), texel.rgb, metallic);
  vec3 smoothness = vec3((1.0 - roughness) * (1.0 - roughness));
  vec3 share = straight + max(smoothness - straight, vec3(0.0)) * edge;
  float halfWay = max(dot(normal, normalize(view + uKeyTowards)), 0.0);
  vec3 lit = key * saturate(4.0 * keyCosine) * max(keyCosine, 0.0);
  vec3 back = reflect(-view, normal);
  vec3 gloss = share * mirrored(back, roughness) * shade.y + straight * lit * highlight(halfWay, roughness);
  float coatShare = uCoat.x * (0.04 + 0.96 * edge);
  vec3 coat = coatShare * mirrored(back, uCoat.y) * shade.y + uCoat.x * 0.04 * lit * highlight(halfWay, uCoat.y);
  vec3 body = texel.rgb * (1.0 - metallic) * spread * (1.0 - share) + gloss;
  vec3 light = body * (1.0 - coatShare) + coat;
  light = mix(light, uWall, saturate((distance - uFog.x) * uFog.y));
  colour = vec4(encoded(toned(light)), texel.a);
}`;

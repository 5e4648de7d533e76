// Light without anything that has to be decided: no branch and no loop, so that a driver that draws
// with the processor translates it once. Directions and places are those of the drawn world, Y up;
// colours are linear.

struct Drawn {
    clip_from_world: mat4x4<f32>,
    world_from_model: mat4x4<f32>,
    normal_from_model: mat4x4<f32>,
    eye: vec4<f32>,
    colour: vec4<f32>,
    emitted: vec4<f32>,
    // Roughness, metallic, share of light that gets around the edge, unused.
    surface: vec4<f32>,
    // Share of the varnish and its roughness, begin of the fog, one over its depth.
    varnish_and_fog: vec4<f32>,
    wall: vec4<f32>,
    key_towards: vec4<f32>,
    key: vec4<f32>,
    fill_towards: vec4<f32>,
    fill: vec4<f32>,
    // Capsules that stand above the ground: begin and radius, end.
    capsules: array<vec4<f32>, 48>,
}

@group(0) @binding(0) var<uniform> drawn: Drawn;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var picture_sampler: sampler;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
) -> Corner {
    let place = drawn.world_from_model * vec4<f32>(position, 1.0);
    let turned = drawn.normal_from_model * vec4<f32>(normal, 0.0);
    return Corner(drawn.clip_from_world * place, place.xyz, turned.xyz, uv);
}

// Light that falls on a surface from all around: a bright ceiling, a darker ground.
fn from_around(normal: vec3<f32>) -> vec3<f32> {
    let up = 0.5 + 0.5 * normal.y;
    return drawn.wall.rgb * mix(0.70, 1.52, up * (0.45 + 0.55 * up));
}

// What a surface of a roughness mirrors: ground, wall, and the lamp above.
fn mirrored(direction: vec3<f32>, roughness: f32) -> vec3<f32> {
    let wall = mix(0.62, 1.0, smoothstep(-0.3 - roughness, 0.1 + roughness, direction.y));
    let lamp = smoothstep(0.62 - 0.7 * roughness, 0.82 + 0.5 * roughness, direction.y);
    return drawn.wall.rgb * (wall + lamp * mix(2.2, 1.2, roughness));
}

fn highlight(towards_light: f32, roughness: f32) -> f32 {
    let narrow = roughness * roughness;
    let power = 2.0 / (narrow * narrow + 0.002);
    return 0.125 * (power + 2.0) * pow(towards_light, power);
}

fn with_fog(light: vec3<f32>, distance: f32) -> vec3<f32> {
    let fog = drawn.varnish_and_fog;
    return mix(light, drawn.wall.rgb, saturate((distance - fog.z) * fog.w));
}

// Light that goes from a place to the eye. `shade.x` of the lamp's light gets there, `shade.y` of
// that from all around.
fn seen(corner: Corner, is_front: bool, shade: vec2<f32>) -> vec4<f32> {
    let texel = textureSample(picture, picture_sampler, corner.uv) * drawn.colour;
    let normal = normalize(corner.normal) * select(-1.0, 1.0, is_front);
    let from_eye = corner.place - drawn.eye.xyz;
    let distance = length(from_eye);
    let view = -from_eye / distance;
    let roughness = drawn.surface.x;
    let metallic = drawn.surface.y;
    let wrap = drawn.surface.z;

    let key_cosine = dot(normal, drawn.key_towards.xyz);
    let key = drawn.key.rgb * shade.x;
    let key_spread = max(key_cosine + wrap, 0.0) / (1.0 + wrap);
    let fill_spread = max(dot(normal, drawn.fill_towards.xyz) + wrap, 0.0) / (1.0 + wrap);
    let spread = key * key_spread + drawn.fill.rgb * fill_spread
        + from_around(normal) * shade.y;

    let edge = pow(1.0 - saturate(dot(normal, view)), 5.0);
    let straight = mix(vec3<f32>(0.04), texel.rgb, metallic);
    let smoothness = vec3<f32>((1.0 - roughness) * (1.0 - roughness));
    let share = straight + max(smoothness - straight, vec3<f32>(0.0)) * edge;
    let half_way = max(dot(normal, normalize(view + drawn.key_towards.xyz)), 0.0);
    let lit = key * saturate(4.0 * key_cosine) * max(key_cosine, 0.0);
    let back = reflect(-view, normal);
    let gloss = share * mirrored(back, roughness) * shade.y
        + straight * lit * highlight(half_way, roughness);

    let varnish = drawn.varnish_and_fog.xy;
    let varnish_share = varnish.x * (0.04 + 0.96 * edge);
    let coat = varnish_share * mirrored(back, varnish.y) * shade.y
        + varnish.x * 0.04 * lit * highlight(half_way, varnish.y);

    let body = texel.rgb * (1.0 - metallic) * spread * (1.0 - share) + gloss;
    let light = body * (1.0 - varnish_share) + coat + drawn.emitted.rgb;
    return vec4<f32>(with_fog(light, distance), texel.a);
}

// Shade of a capsule at a place of the ground: share of the lamp's light and of that from around.
fn below(place: vec3<f32>, begin: vec4<f32>, end: vec4<f32>) -> vec2<f32> {
    let radius = begin.w;
    let light = drawn.key_towards.xyz;
    let along = end.xyz - begin.xyz;
    let to_begin = begin.xyz - place;

    // Seen along the light, the nearest point of the capsule's axis is the one that shades.
    let flat_along = along - light * dot(along, light);
    let flat_begin = to_begin - light * dot(to_begin, light);
    let at = saturate(-dot(flat_begin, flat_along) / (dot(flat_along, flat_along) + 1e-6));
    let beside = length(flat_begin + at * flat_along);
    let above = dot(to_begin + at * along, light);
    let blur = 0.04 + 0.08 * max(above, 0.0);
    let lamp = 1.0 - (1.0 - smoothstep(radius - blur, radius + blur, beside))
        * (radius * radius) / (radius * radius + 0.15 * blur * blur);

    let near_at = saturate(-dot(to_begin, along) / (dot(along, along) + 1e-6));
    let to_near = to_begin + near_at * along;
    let away = max(dot(to_near, to_near), radius * radius + 1e-6);
    let around = 1.0 - 0.9 * radius * radius * saturate(to_near.y * inverseSqrt(away)) / away;
    return vec2<f32>(lamp, around);
}

// The darkest of the lamp's shadows counts; each capsule takes its part of the light from around.
fn both(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(min(a.x, b.x), a.y * b.y);
}

fn two(place: vec3<f32>, a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec2<f32> {
    return both(below(place, a, b), below(place, c, d));
}

@fragment
fn opaque(corner: Corner, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    return vec4<f32>(seen(corner, is_front, vec2<f32>(1.0)).rgb, 1.0);
}

// Twelve capsules, those of the object and one hand, or the ones after them.
fn twelve(p: vec3<f32>, first: u32) -> vec2<f32> {
    let c = &drawn.capsules;
    let i = first;
    let a = both(two(p, c[i], c[i + 1], c[i + 2], c[i + 3]), two(p, c[i + 4], c[i + 5], c[i + 6], c[i + 7]));
    let b = both(two(p, c[i + 8], c[i + 9], c[i + 10], c[i + 11]), two(p, c[i + 12], c[i + 13], c[i + 14], c[i + 15]));
    let e = both(two(p, c[i + 16], c[i + 17], c[i + 18], c[i + 19]), two(p, c[i + 20], c[i + 21], c[i + 22], c[i + 23]));
    return both(both(a, b), e);
}

@fragment
fn ground(corner: Corner, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    var shade = twelve(corner.place, 0u);
    // A radius: there is a second hand.
    if drawn.capsules[24].w > 0.0 {
        shade = both(shade, twelve(corner.place, 24u));
    }
    return vec4<f32>(seen(corner, is_front, shade).rgb, 1.0);
}

struct Blended {
    // Colour times alpha, and alpha, each times the weight.
    @location(0) sum: vec4<f32>,
    @location(1) covered: f32,
}

// Surfaces to be seen through are summed without order; nearer ones weigh more.
@fragment
fn transparent(corner: Corner, @builtin(front_facing) is_front: bool) -> Blended {
    let light = seen(corner, is_front, vec2<f32>(1.0));
    let away = corner.place - drawn.eye.xyz;
    let weight = 250.0 / (1.0 + dot(away, away));
    return Blended(vec4<f32>(light.rgb * light.a, light.a) * weight, light.a);
}

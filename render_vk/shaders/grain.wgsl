// Grain of the ground: a texture of noise in five sizes, fixed to the body, from 2 cm to 20 km.
//
// Each size lies on two of the three coordinate planes: those that the ground faces most. Its mip
// levels end it where pixels are too wide for it. Source: Quílez, "Biplanar mapping", 2020.

@group(0) @binding(1) var detail: texture_2d<f32>; // two values around 0, gradient of the first
@group(0) @binding(2) var detail_sampler: sampler;

// ---- Sizes, widest first ----
//
// A size repeats after `period_m`, a power of two, so that the eye's part is exact however far the
// centre is. Turned and shrunk by a whole complex number it still does: no two sizes align.
struct Size {
    period_m: f32,
    turn: vec2<f32>,
    broad: f32,                   // shares of `Grain`
    fine: f32,
    tilt: f32,
}

const SIZES: i32 = 5;
const ON_THE_BODY: i32 = 2;       // so many sizes ignore the ground's slope

const SEEN: vec2<f32> = vec2<f32>(0.10, 0.05);  // pixel over tile: none of a size, all of it
const PATCHY: vec2<f32> = vec2<f32>(0.9, 0.8);  // strength of a size, and how the last one bends it
const FACES: f32 = 0.57735027;    // a plane that faces less than this takes no part
const LEAST: f32 = 0.7;           // share of the first plane's weight that the second starts at
const RIPPLES: vec3<f32> = vec3<f32>(2.0, -1.5, 1.75);       // waves a metre; whole in 64 m
const RIPPLES_M: f32 = 0.33;
const RIPPLED_PX: vec2<f32> = vec2<f32>(2.0, 4.5);           // half a wave: none of it, all of it

struct Grain {
    broad: vec2<f32>,             // around 0, mostly within -1 to 1: 60 m and more
    fine: vec2<f32>,
    tilt: vec3<f32>,              // gradient of the bumps, no unit
    ripple: f32,                  // -1 to 1
    ripple_tilt: vec3<f32>,
}

// The two planes that a direction faces most, by the axes across them.
struct Planes {
    axis: vec2<u32>,
    weight: vec2<f32>,            // squares sum to 1: so noise keeps its strength
}

fn planes_of(direction: vec3<f32>) -> Planes {
    let m = abs(direction);
    let first = select(select(2u, 1u, m.y > m.z), 0u, m.x > max(m.y, m.z));
    let last = select(select(2u, 1u, m.y <= m.z), 0u, m.x <= min(m.y, m.z));
    let middle = m.x + m.y + m.z - max(m.x, max(m.y, m.z)) - min(m.x, min(m.y, m.z));
    let most = max(max(m.x, max(m.y, m.z)) - FACES, 1e-4);
    let weight = vec2<f32>(most, max(middle - FACES - LEAST * most, 0.0));
    var out: Planes;
    out.axis = vec2<u32>(first, 3u - first - last);
    out.weight = normalize(weight);
    return out;
}

fn on_plane(p: vec3<f32>, axis: u32) -> vec2<f32> {
    return select(select(p.xy, p.zx, axis == 1u), p.yz, axis == 0u);
}

fn off_plane(p: vec2<f32>, axis: u32) -> vec3<f32> {
    let y = vec3<f32>(p.y, 0.0, p.x);
    return select(select(vec3<f32>(p, 0.0), y, axis == 1u), vec3<f32>(0.0, p), axis == 0u);
}

fn turned(p: vec2<f32>, by: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(by.x * p.x - by.y * p.y, by.y * p.x + by.x * p.y);
}

// One size at a place: two values and a gradient. `dx` and `dy` lead to neighbouring pixels.
struct Layer {
    value: vec2<f32>,
    tilt: vec3<f32>,
}

fn layer_at(size: Size, planes: Planes, p: vec3<f32>, dx: vec3<f32>, dy: vec3<f32>) -> Layer {
    var out: Layer;
    // A loop, because software devices skip what is beyond its end, but no branch.
    let count = select(1, 2, planes.weight.y > 0.0);
    for (var i = 0; i < count; i++) {
        let axis = select(planes.axis.x, planes.axis.y, i == 1);
        let weight = select(planes.weight.x, planes.weight.y, i == 1);
        let at = turned(on_plane(p, axis), size.turn) + vec2<f32>(0.37, 0.61) * f32(axis);
        let along_x = turned(on_plane(dx, axis), size.turn);
        let along_y = turned(on_plane(dy, axis), size.turn);
        let bytes = textureSampleGrad(detail, detail_sampler, at, along_x, along_y);
        let texel = bytes * (255.0 / 127.0) - 128.0 / 127.0;
        out.value += weight * texel.xy;
        let back = turned(texel.zw, vec2<f32>(size.turn.x, -size.turn.y)) / length(size.turn);
        out.tilt += weight * off_plane(back, axis);
    }
    return out;
}

// 166 km, 9.1 km, 648 m, 36 m and 2.5 m wide.
fn size_of(index: i32) -> Size {
    // A table would be read lane by lane on software devices.
    let odd = (index & 1) == 1;
    let n = f32(index);
    var out: Size;
    out.period_m = f32(1u << u32(19 - 4 * index));
    out.turn = select(vec2<f32>(1.0, 3.0), vec2<f32>(3.0, 2.0), odd);
    out.broad = clamp(2.6 - n, 0.0, 1.0);
    out.fine = 0.85 * clamp(n - 1.2, 0.0, 1.0);
    out.tilt = 0.65 * clamp(0.5 * n - 0.4, 0.0, 1.0);
    return out;
}

// The grain `offset` metres from the eye; `dx` and `dy` lead to the pixel's neighbours.
fn grain_at(
    offset: vec3<f32>,
    dx: vec3<f32>,
    dy: vec3<f32>,
    normal: vec3<f32>,
    up: vec3<f32>,
) -> Grain {
    let footprint_m = sqrt(length(cross(dx, dy)));
    var planes = planes_of(up);
    var out: Grain;
    var bend = 0.0;
    for (var i = 0; i < SIZES; i++) {
        let size = size_of(i);
        let pixel = footprint_m * length(size.turn) / size.period_m;
        let seen = 1.0 - smoothstep(SEEN.y, SEEN.x, pixel);
        if seen <= 0.0 { break; }
        if i == ON_THE_BODY { planes = planes_of(normal); }
        let p = fract(view.eye_hi / size.period_m) + (view.eye_lo + offset) / size.period_m;
        let layer = layer_at(size, planes, p, dx / size.period_m, dy / size.period_m);
        let strength = seen * max(PATCHY.x + PATCHY.y * bend, 0.2);
        out.broad += layer.value * (strength * size.broad);
        out.fine += layer.value * (strength * size.fine);
        out.tilt += layer.tilt * (strength * size.tilt);
        bend = layer.value.y;
    }
    let wide = max(length(dx), length(dy));
    let rippled = smoothstep(RIPPLED_PX.x, RIPPLED_PX.y, 0.5 * RIPPLES_M / wide);
    let p = fract(view.eye_hi / 64.0) * 64.0 + (view.eye_lo + offset);
    let phase = 2.0 * PI * fract(dot(RIPPLES, p)) + 5.0 * out.fine.y;
    out.ripple = rippled * sin(phase);
    out.ripple_tilt = (rippled * RIPPLES_M * cos(phase)) * RIPPLES;
    return out;
}

// A normal of the smooth ground tilted by a gradient.
fn tilted(normal: vec3<f32>, gradient: vec3<f32>) -> vec3<f32> {
    return normalize(normal - (gradient - normal * dot(gradient, normal)));
}

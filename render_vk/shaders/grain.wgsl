// Grain of the ground: value noise on a lattice that is fixed to the body, from 2 km to 12 cm.

// ---- Octaves: each has cells of a quarter of the last one's size, fine ones of half ----
const TILE_M: f32 = 4096.0;       // cells count from tiles: exact however far from the centre
const COARSEST_M: f32 = 2048.0;
const OCTAVES: i32 = 12;
const FINE_M: f32 = 40.0;         // cells below this are `fine`, above `broad`
const BUMPY_M: f32 = 40.0;        // cells above this tilt the ground the less
const SEEN_PX: vec2<f32> = vec2<f32>(2.0, 4.5);      // a cell of so many pixels: none, all of it
const BROAD: f32 = 0.62;          // share of an octave
const FINE: f32 = 0.42;
const TILT: f32 = 0.15;
const SHIFT: vec3<f32> = vec3<f32>(0.37, 0.61, 0.83);        // of each octave, so that no two align
const RIPPLES: vec3<f32> = vec3<f32>(2.0, -1.5, 1.75);       // waves a metre; whole in a tile
const RIPPLES_M: f32 = 0.33;

struct Noise {
    value: vec2<f32>,             // two of one cost, each -1 to 1
    gradient: vec3<f32>,          // of the first, per cell
}

struct Grain {
    broad: vec2<f32>,             // around 0, mostly within -1 to 1
    fine: vec2<f32>,
    tilt: vec3<f32>,              // gradient of the bumps, no unit
    ripple: f32,                  // -1 to 1
    ripple_tilt: vec3<f32>,
}

// Two values of 12 bits for a corner of the lattice: one round of mixing is enough for the eye.
fn corner(at: u32) -> vec2<f32> {
    let h = (at ^ (at >> 15u)) * 0x846ca68bu;
    return vec2<f32>(f32((h >> 8u) & 0xfffu), f32(h >> 20u));
}

fn noise(cell: vec3<i32>, f: vec3<f32>) -> Noise {
    let factor = vec3<u32>(0x9e3779b1u, 0x85ebca77u, 0xc2b2ae3du);
    let low = vec3<u32>(cell) * factor;
    let high = low + factor;
    let v000 = corner(low.x ^ low.y ^ low.z);
    let v100 = corner(high.x ^ low.y ^ low.z);
    let v010 = corner(low.x ^ high.y ^ low.z);
    let v110 = corner(high.x ^ high.y ^ low.z);
    let v001 = corner(low.x ^ low.y ^ high.z);
    let v101 = corner(high.x ^ low.y ^ high.z);
    let v011 = corner(low.x ^ high.y ^ high.z);
    let v111 = corner(high.x ^ high.y ^ high.z);
    let s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let ds = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let x00 = mix(v000, v100, s.x);
    let x10 = mix(v010, v110, s.x);
    let x01 = mix(v001, v101, s.x);
    let x11 = mix(v011, v111, s.x);
    let y0 = mix(x00, x10, s.y);
    let y1 = mix(x01, x11, s.y);
    let dx0 = mix(v100.x - v000.x, v110.x - v010.x, s.y);
    let dx1 = mix(v101.x - v001.x, v111.x - v011.x, s.y);
    let dx = mix(dx0, dx1, s.z);
    let dy = mix(x10.x - x00.x, x11.x - x01.x, s.z);
    let unit = 2.0 / 4095.0;
    var out: Noise;
    out.value = mix(y0, y1, s.z) * unit - 1.0;
    out.gradient = vec3<f32>(dx, dy, y1.x - y0.x) * ds * unit;
    return out;
}

// The grain `offset` metres from the eye, where a pixel covers `footprint_m` of ground.
// Octaves are left out before their cells are smaller than pixels, so that nothing shimmers.
fn grain_at(offset: vec3<f32>, footprint_m: f32) -> Grain {
    let tile = floor(view.eye_hi / TILE_M);
    let p = (view.eye_hi - tile * TILE_M) + view.eye_lo + offset;
    var out: Grain;
    var cell_m = COARSEST_M;
    for (var i = 0; i < OCTAVES; i++) {
        let seen = smoothstep(SEEN_PX.x, SEEN_PX.y, cell_m / footprint_m);
        if seen <= 0.0 { break; }
        let at = p / cell_m + SHIFT * f32(i);
        let base = floor(at);
        let cell = vec3<i32>(tile) * i32(TILE_M / cell_m) + vec3<i32>(base);
        let n = noise(cell + vec3<i32>(i * 0x3c6ef35), at - base);
        let is_fine = select(0.0, seen, cell_m < FINE_M);
        out.broad += n.value * ((seen - is_fine) * BROAD);
        out.fine += n.value * (is_fine * FINE);
        out.tilt += n.gradient * (seen * TILT * min(BUMPY_M / cell_m, 1.0));
        cell_m *= select(0.5, 0.25, cell_m > FINE_M);
    }
    let rippled = smoothstep(SEEN_PX.x, SEEN_PX.y, 0.5 * RIPPLES_M / footprint_m);
    let phase = 2.0 * PI * fract(dot(RIPPLES, p)) + 5.0 * out.fine.y;
    out.ripple = rippled * sin(phase);
    out.ripple_tilt = (rippled * RIPPLES_M * cos(phase)) * RIPPLES;
    return out;
}

// A normal of the smooth ground tilted by a gradient.
fn tilted(normal: vec3<f32>, gradient: vec3<f32>) -> vec3<f32> {
    return normalize(normal - (gradient - normal * dot(gradient, normal)));
}

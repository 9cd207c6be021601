// What every program knows: the view and the depth range.

// ---- `ViewTerms` in src/matrices.rs, 144 bytes ----
struct View {
    eye_hi: vec3<f32>,        // body-fixed eye, metres, as a two-float
    pixel_rad: f32,           // angle of a pixel in the middle of the picture
    eye_lo: vec3<f32>,
    tolerance_px: f32,
    right: vec3<f32>,         // unit vectors of the picture, body-fixed axes
    inverse_tan_x: f32,       // 1 / tangent of half the field of view
    up: vec3<f32>,
    inverse_tan_y: f32,
    forward: vec3<f32>,
    body_radius_m: f32,       // |eye| - height: radius of the body under the eye
    eye_up: vec3<f32>,        // geodetic normal under the eye
    eye_height_m: f32,
    sun: vec3<f32>,           // towards the light
    now_ms: u32,              // time of the flight, modulo 2^32
    pixels_inverse: vec2<f32>, // 1 / width and height of the picture
    morph_ms: f32,            // how long a vertex takes to its own place
    show: u32,                // `Show` in src/picture.rs
    vertices_per_patch: u32,
}

// ---- `RangeTerms`, 16 bytes ----
struct Range {
    slope: f32,               // clip z = slope * w + offset
    offset: f32,
    far: f32,                 // depth of what is infinitely far
    index: u32,
}

@group(0) @binding(0) var<uniform> view: View;
var<immediate> range: Range;

fn oct_unfolded(e: vec2<f32>) -> vec3<f32> {
    // Inverse of the octahedral map: z > 0 is the inner diamond, z < 0 is folded outwards.
    let z = 1.0 - abs(e.x) - abs(e.y);
    let fold = max(-z, 0.0);
    let x = e.x + select(fold, -fold, e.x >= 0.0);
    let y = e.y + select(fold, -fold, e.y >= 0.0);
    return normalize(vec3<f32>(x, y, z));
}

// Ground without air: young rock is bright, old dust dark.
const REGOLITH_DARK: vec3<f32> = vec3<f32>(0.060, 0.058, 0.055);
const REGOLITH_BRIGHT: vec3<f32> = vec3<f32>(0.170, 0.163, 0.152);

fn cover_of(point: Point, slope: f32, grain: Grain, pixel_m: f32) -> Cover {
    let layers = point.layers;
    // Rock is young and bright; where there is water elsewhere, there are dark maria here.
    let fresh = 0.60 * layers.y + 0.20 * (layers.x - 0.5);
    let mottle = 0.10 * grain.broad.y + 0.07 * grain.fine.y;
    let bright = clamp(0.35 + fresh - 0.35 * layers.z + mottle, 0.0, 1.0);
    let stone = mix(REGOLITH_DARK, REGOLITH_BRIGHT, bright);
    return Cover(stone * (1.0 + 0.10 * grain.broad.x + 0.16 * grain.fine.x), 0.42, 0.0);
}

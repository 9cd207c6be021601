// Imagery over the ground.
@group(2) @binding(1) var tiles: texture_2d_array<f32>;
@group(2) @binding(2) var between: sampler;

const NO_LAYER: u32 = 0xffffffffu;
const TEXELS: f32 = 129.0;        // along a tile; the outer ones lie on its border
const FADE_MS: f32 = 250.0;       // how long a tile takes to cover the one before

// To the neighbouring pixels; taken before any branch, as derivatives must be.
struct Steps {
    x: vec3<f32>,
    y: vec3<f32>,
    uv_x: vec4<f32>,
    uv_y: vec4<f32>,
}

fn steps_at(point: Point) -> Steps {
    return Steps(dpdx(point.offset), dpdy(point.offset), dpdx(point.uv), dpdy(point.uv));
}

// Colour times opacity, and opacity, of a tile.
fn tile_at(layer: u32, uv: vec2<f32>, dx: vec2<f32>, dy: vec2<f32>) -> vec4<f32> {
    if layer == NO_LAYER { return vec4<f32>(0.0); }
    let scale = (TEXELS - 1.0) / TEXELS;
    let at = uv * scale + 0.5 / TEXELS;
    return textureSampleGrad(tiles, between, at, layer, dx * scale, dy * scale);
}

// The ground's own colour under the imagery over it, which keeps some of the ground's grain.
fn draped(point: Point, steps: Steps, albedo: vec3<f32>, grain: Grain) -> vec3<f32> {
    let dx = steps.uv_x;
    let dy = steps.uv_y;
    let tile = tile_at(point.tiles.x, point.uv.xy, dx.xy, dy.xy);
    let age_ms = f32(view.now_ms - point.tiles.z);
    var shown = tile;
    if age_ms < FADE_MS {
        let before = tile_at(point.tiles.y, point.uv.zw, dx.zw, dy.zw);
        shown = mix(before, tile, age_ms / FADE_MS);
    }
    let mottled = 1.0 + 0.10 * grain.broad.x + 0.16 * grain.fine.x;
    return albedo * (1.0 - shown.a) + shown.rgb * mottled;
}

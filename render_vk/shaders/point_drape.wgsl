// What the ground's vertices hand on where imagery lies over it.
struct Skin {
    @location(2) normal_oct: vec2<f32>,
    @location(3) layers: vec4<f32>,
    @location(4) height_m: f32,
}

struct Point {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) offset: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) layers: vec4<f32>,
    @location(3) height_m: f32,
    @location(4) uv: vec4<f32>,                     // in the tile, in the coarser one before it
    @location(5) @interpolate(flat) tiles: vec3<u32>, // both layers; when the tile was first shown
}

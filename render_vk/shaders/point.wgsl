// What the ground's vertices hand on.
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
}

// Vertices on their way from the surface that they refine: `PatchMorph` in overfly_core.
struct Morph {
    @location(5) from_m: vec3<f32>,
    @location(6) normal_oct: vec2<f32>,
    @location(7) layers: vec4<f32>,
    @location(8) born_ms: u32,
}

// 1 when it is born, 0 once it has arrived; time that went back counts as arrived.
fn left_of(morph: Morph) -> f32 {
    let age_ms = f32(view.now_ms - morph.born_ms);
    return select(1.0 - age_ms / view.morph_ms, 0.0, age_ms >= view.morph_ms);
}

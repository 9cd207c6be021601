// No imagery over the ground.
fn draped(point: Point, albedo: vec3<f32>, grain: Grain) -> vec3<f32> {
    return albedo;
}

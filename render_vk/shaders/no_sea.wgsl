// No sea: all is ground.
fn seen(
    point: Point,
    steps: Steps,
    up: vec3<f32>,
    ray: vec3<f32>,
    distance_m: f32,
) -> vec3<f32> {
    return ground(point, steps, up, distance_m);
}

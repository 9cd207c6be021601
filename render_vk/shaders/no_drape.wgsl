// No imagery over the ground.

// To the neighbouring pixels; taken before any branch, as derivatives must be.
struct Steps {
    x: vec3<f32>,
    y: vec3<f32>,
}

fn steps_at(point: Point) -> Steps {
    return Steps(dpdx(point.offset), dpdy(point.offset));
}

fn draped(point: Point, steps: Steps, albedo: vec3<f32>, grain: Grain) -> vec3<f32> {
    return albedo;
}

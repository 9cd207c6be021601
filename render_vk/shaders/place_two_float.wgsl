// Vertices as two-floats: the eye is subtracted here.
struct Own {
    @location(0) hi: vec3<f32>,
    @location(1) lo: vec3<f32>,
}

// From the eye, body-fixed axes.
fn placed(own: Own, moved: vec3<f32>) -> vec3<f32> {
    return relative_to(own.hi, own.lo, view.eye_hi, view.eye_lo) + moved;
}

// From the eye, picture axes.
fn pictured(own: Own, offset: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(view.right, offset), dot(view.up, offset), dot(view.forward, offset));
}

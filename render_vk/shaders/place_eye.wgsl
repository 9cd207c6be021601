// Vertices before the eye, subtracted, rotated and moved by the host.
struct Own {
    @location(0) picture: vec3<f32>,
}

// From the eye, body-fixed axes: for light and air, which need no more than f32.
fn placed(own: Own, moved: vec3<f32>) -> vec3<f32> {
    return view.right * own.picture.x + view.up * own.picture.y + view.forward * own.picture.z;
}

// From the eye, picture axes.
fn pictured(own: Own, offset: vec3<f32>) -> vec3<f32> {
    return own.picture;
}

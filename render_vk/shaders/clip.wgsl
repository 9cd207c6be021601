// From picture axes to the screen.
fn clipped(picture: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(
        picture.x * view.inverse_tan_x,
        -(picture.y * view.inverse_tan_y),
        range.slope * picture.z + range.offset,
        picture.z,
    );
}

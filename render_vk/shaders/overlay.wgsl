// Text, boxes and lines over the picture.
struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) colour: vec4<f32>,
}

// One part of a colour from the sRGB curve to linear light: the picture's format does the inverse.
fn linear(c: f32) -> f32 {
    return select(pow((c + 0.055) / 1.055, 2.4), c / 12.92, c <= 0.04045);
}

@vertex
fn vertex(@location(0) at_px: vec2<f32>, @location(1) colour: vec4<f32>) -> Corner {
    var out: Corner;
    let at = at_px * view.pixels_inverse * 2.0 - 1.0;
    out.position = vec4<f32>(at, 0.5, 1.0);
    out.colour = vec4<f32>(linear(colour.r), linear(colour.g), linear(colour.b), colour.a);
    return out;
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    return corner.colour;
}

// The sky: one triangle at infinity, behind all ground of the farthest range.
struct SkyVertex {
    @builtin(position) position: vec4<f32>,
    @location(0) ray: vec3<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> SkyVertex {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    var out: SkyVertex;
    out.position = vec4<f32>(corner.x, -corner.y, range.far, 1.0);
    out.ray = view.forward
        + view.right * (corner.x / view.inverse_tan_x)
        + view.up * (corner.y / view.inverse_tan_y);
    return out;
}

@fragment
fn fragment(in: SkyVertex) -> @location(0) vec4<f32> {
    let ray = normalize(in.ray);
    let veil = veil_until(ray, 1e12);
    return tone(disc_light(ray) * veil.kept + veil.added);
}

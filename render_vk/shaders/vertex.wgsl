// The ground's vertices.
@vertex
fn vertex(own: Own, skin: Skin) -> Point {
    let offset = placed(own, vec3<f32>(0.0));
    var out: Point;
    out.position = clipped(pictured(own, offset));
    out.offset = offset;
    out.normal = oct_unfolded(skin.normal_oct);
    out.layers = skin.layers;
    out.height_m = skin.height_m;
    return out;
}

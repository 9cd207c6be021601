// The ground's vertices, for debug views.
@vertex
fn vertex(@builtin(vertex_index) index: u32, own: Own, skin: Skin) -> Point {
    let offset = placed(own, vec3<f32>(0.0));
    var out: Point;
    out.position = clipped(pictured(own, offset));
    out.offset = offset;
    out.normal = oct_unfolded(skin.normal_oct);
    out.layers = skin.layers;
    out.height_m = skin.height_m;
    out.slot = slot_of(index);
    out.at = steps_of(index);
    return out;
}

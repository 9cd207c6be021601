// The ground's vertices, moving, for debug views.
@vertex
fn vertex(@builtin(vertex_index) index: u32, own: Own, skin: Skin, morph: Morph) -> Point {
    let left = left_of(morph);
    let offset = placed(own, left * morph.from_m);
    var out: Point;
    out.position = clipped(pictured(own, offset));
    out.offset = offset;
    let normal = oct_unfolded(skin.normal_oct);
    out.normal = mix(normal, oct_unfolded(morph.normal_oct), left);
    out.layers = mix(skin.layers, morph.layers, left);
    out.height_m = skin.height_m;
    out.slot = slot_of(index);
    out.at = steps_of(index);
    return out;
}

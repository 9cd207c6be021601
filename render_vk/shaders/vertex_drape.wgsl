// The ground's vertices, under imagery.
@vertex
fn vertex(@builtin(vertex_index) index: u32, own: Own, skin: Skin) -> Point {
    let offset = placed(own, vec3<f32>(0.0));
    var out: Point;
    out.position = clipped(pictured(own, offset));
    out.offset = offset;
    out.normal = oct_unfolded(skin.normal_oct);
    out.layers = skin.layers;
    out.height_m = skin.height_m;
    let drape = drapes[slot_of(index)];
    let steps = steps_of(index);
    out.uv = vec4<f32>(place_in(drape.tile, steps), place_in(drape.before, steps));
    out.tiles = vec3<u32>(drape.tile.layer, drape.before.layer, drape.tile.since_ms);
    return out;
}

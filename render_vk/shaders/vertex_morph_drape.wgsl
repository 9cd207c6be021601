// The ground's vertices, moving, under imagery.
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
    let drape = drapes[slot_of(index)];
    let steps = steps_of(index);
    out.uv = vec4<f32>(place_in(drape.tile, steps), place_in(drape.before, steps));
    out.tiles = vec3<u32>(drape.tile.layer, drape.before.layer, drape.tile.since_ms);
    return out;
}

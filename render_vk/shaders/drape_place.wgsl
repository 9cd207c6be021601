// Where a patch lies in the tiles over it: `PatchDrape` in overfly_core.
struct TilePlace {
    apex: vec2<f32>,
    to_start: vec2<f32>,
    to_end: vec2<f32>,
    layer: u32,
    since_ms: u32,
}

struct Drape {
    tile: TilePlace,
    before: TilePlace,
}

@group(2) @binding(0) var<storage, read> drapes: array<Drape>;

fn place_in(tile: TilePlace, steps: vec2<f32>) -> vec2<f32> {
    return tile.apex + tile.to_start * steps.x + tile.to_end * steps.y;
}

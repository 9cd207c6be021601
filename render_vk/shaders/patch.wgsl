// Which slot a vertex belongs to, and where it lies in the patch.
fn slot_of(index: u32) -> u32 {
    return index / view.vertices_per_patch;
}

// Vertex i lies in row r with r (r + 1) / 2 <= i, columns from 0.
fn steps_of(index: u32) -> vec2<f32> {
    let i = index % view.vertices_per_patch;
    var row = u32((sqrt(8.0 * f32(i) + 1.0) - 1.0) * 0.5);
    if (row + 1u) * (row + 2u) / 2u <= i { row += 1u; }
    let column = i - row * (row + 1u) / 2u;
    return vec2<f32>(f32(row - column), f32(column));
}

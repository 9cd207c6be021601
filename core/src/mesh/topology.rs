//! The shared triangle pattern of every patch of one depth.
//!
//! In:    the patch depth k.
//! Out:   barycentric positions of the vertices and the index pattern.
//! Keeps: nothing.
//! Not here: positions (`build`).
//!
//! Row r of n + 1 rows runs parallel to the hypotenuse; row 0 is the apex, row n the hypotenuse.

/// Segments along each edge of a patch: 2^(k/2).
pub fn segments(patch_depth: u8) -> u32 {
    1 << (patch_depth / 2)
}

/// Place of vertex (row, column) in a patch, `column <= row`.
pub fn vertex_index(row: u32, column: u32) -> u32 {
    row * (row + 1) / 2 + column
}

/// Indices of the 2^k triangles, three each, counter-clockwise like the patch's own corners
/// (apex, hypotenuse start, hypotenuse end).
///
/// They are those that halving the patch k times makes, as the mesh itself would: so what is drawn
/// is the surface of one lattice level, whatever the patch depth.
pub fn indices(patch_depth: u8) -> Vec<u32> {
    let n = segments(patch_depth);
    let mut list = Vec::with_capacity(3 << patch_depth);
    halve([(0, 0), (n, 0), (n, n)], patch_depth, &mut list);
    list
}

/// Cuts a triangle of (row, column)s from its apex to the middle of its hypotenuse, some times.
fn halve([apex, start, end]: [(u32, u32); 3], times: u8, list: &mut Vec<u32>) {
    if times == 0 {
        list.extend([apex, start, end].map(|(row, column)| vertex_index(row, column)));
        return;
    }
    let middle = (u32::midpoint(start.0, end.0), u32::midpoint(start.1, end.1));
    halve([middle, apex, start], times - 1, list);
    halve([middle, end, apex], times - 1, list);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_has_two_to_the_k_triangles_over_all_its_vertices() {
        for k in [0, 2, 4, 6, 8] {
            let list = indices(k);
            assert_eq!(list.len(), 3 << k);
            let n = segments(k);
            let mut used = list;
            used.sort_unstable();
            used.dedup();
            assert_eq!(used.len(), ((n + 1) * (n + 2) / 2) as usize);
        }
    }
}

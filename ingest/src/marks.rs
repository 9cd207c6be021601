//! Marks: what each tile says of the ground around its samples, neighbours and finer data included.
//!
//! In:    the statistics of blocks, in a spool.
//! Out:   a tile's marks; which tiles beside the data need any.
//! Keeps: nothing.
//! Not here: the statistics (`pyramid`), what bounds are made from marks (`overfly_core`).

use crate::block::reflect;
use crate::spool::{BLOCKS, MARKS, Spool, Stat};
use overfly_core::datasource::PageKey;
use overfly_core::datasource::tile::{MARK_SIDE, MARK_STRIDE, Mark, RANGE_UNIT_M, bound_of};
use std::collections::BTreeMap;
use std::io;

/// The block at `place` in blocks of a depth, which may lie beyond the quadrant: its tile, and its
/// column and row there.
fn block_at(quadrant: u8, depth: u8, place: [i64; 2]) -> (PageKey, [usize; 2]) {
    let across = i64::try_from(BLOCKS).expect("small");
    let whole = across << depth;
    // Blocks are reflected by their middles, in halves of a block.
    let (quadrant, middle) = reflect(quadrant, place.map(|at| 2 * at + 1), 2 * whole);
    let [x, y] = middle.map(|at| (at - 1) / 2);
    let tile = |at: i64| u32::try_from(at / across).expect("inside the quadrant");
    let within = |at: i64| usize::try_from(at % across).expect("below 8");
    (PageKey::new(quadrant, depth, tile(x), tile(y)), [within(x), within(y)])
}

/// Keys beside `keys` whose marks reach into them.
pub fn ring(keys: &[PageKey]) -> Vec<PageKey> {
    let across = i64::try_from(BLOCKS).expect("small");
    let mut ring = Vec::new();
    for key in keys {
        for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i - 1, j - 1))) {
            let place = [i64::from(key.x()) + i, i64::from(key.y()) + j];
            let (beside, _) =
                block_at(key.quadrant(), key.depth(), place.map(|at| at * across + 3));
            if keys.binary_search(&beside).is_err() {
                ring.push(beside);
            }
        }
    }
    ring.sort_unstable();
    ring.dedup();
    ring
}

/// The marks of one layer of a tile, of whose samples `height_m` gives the heights.
///
/// # Errors
/// If the spool cannot be read.
pub fn marks(
    spool: &Spool,
    layer: u8,
    key: PageKey,
    roughness: &[u8; MARKS],
    height_m: impl Fn(usize, usize) -> f64,
) -> io::Result<Box<[Mark; MARKS]>> {
    let mut known: BTreeMap<PageKey, Option<[[Stat; BLOCKS]; BLOCKS]>> = BTreeMap::new();
    let mut marks = Box::new([Mark::default(); MARKS]);
    let first = [key.x(), key.y()].map(|at| i64::from(at) * i64::try_from(BLOCKS).expect("small"));
    for (at, mark) in marks.iter_mut().enumerate() {
        let place = [at % MARK_SIDE, at / MARK_SIDE];
        let mut around = Stat { full: 1, ..Stat::NONE };
        for (di, dj) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let block = [place[0], place[1]].map(|at| i64::try_from(at).expect("small"));
            let block = [first[0] + block[0] - di, first[1] + block[1] - dj];
            let (tile, [a, b]) = block_at(key.quadrant(), key.depth(), block);
            let stats = match known.get(&tile) {
                Some(stats) => *stats,
                None => {
                    let stats = spool.stats(layer, tile)?;
                    known.insert(tile, stats);
                    stats
                }
            };
            let stat = stats.map_or(Stat::NONE, |stats| stats[b][a]);
            for (worst, error_m) in around.error_m.iter_mut().zip(stat.error_m) {
                *worst = worst.max(error_m);
            }
            around.slope_m = around.slope_m.max(stat.slope_m);
            around.range_m =
                [around.range_m[0].min(stat.range_m[0]), around.range_m[1].max(stat.range_m[1])];
            around.full &= stat.full;
            around.roughest = around.roughest.max(stat.roughest);
        }
        let own_m = height_m(place[0] * MARK_STRIDE, place[1] * MARK_STRIDE);
        *mark = mark_of(&around, own_m, roughness[at]);
    }
    Ok(marks)
}

fn mark_of(around: &Stat, own_m: f64, roughness: u8) -> Mark {
    let [low_m, high_m] = around.range_m.map(f64::from);
    let edge = around.full == 0;
    let seen = low_m <= high_m;
    // A little more, for heights were narrowed on their way here.
    let bound = |metres: f64| bound_of(metres * (1.0 + 1e-6));
    let unit = |metres: f64| {
        #[expect(clippy::cast_possible_truncation, reason = "heights are below 200 km")]
        let unit = metres as i16;
        unit
    };
    Mark {
        error_odd: bound(f64::from(around.error_m[0])),
        error_even: bound(f64::from(around.error_m[1])),
        variation: if edge { 0 } else { bound((high_m - own_m).max(own_m - low_m)) },
        slope: bound(f64::from(around.slope_m)),
        roughness,
        roughest: u8::try_from(around.roughest).expect("at most 15").max(roughness),
        edge,
        range: match (edge, seen) {
            (false, _) => [0; 2],
            (true, false) => [0, -1],
            (true, true) => [
                unit((low_m / RANGE_UNIT_M).floor() - 1.0),
                unit((high_m / RANGE_UNIT_M).ceil() + 1.0),
            ],
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_has_eight_tiles_around_one_and_meets_other_quadrants() {
        let inner = PageKey::new(0, 5, 9, 20);
        assert_eq!(ring(&[inner]).len(), 8);
        let corner = PageKey::new(1, 3, 0, 3);
        let ring = ring(&[corner]);
        assert!(ring.iter().any(|key| key.quadrant() == 0));
        assert_eq!(ring.len(), 8);
        // At a pole's corner one tile of every quadrant meets.
        let polar = super::ring(&[PageKey::root(2)]);
        assert_eq!(polar, [0, 1, 3].map(PageKey::root));
    }
}

//! The pages that the LOD lacks, in the order of urgency.
//!
//! In:    what blocked splits lack, with their priorities; the pages that can be taken in.
//! Out:   the wanted list of a frame.
//! Keeps: nothing.
//! Not here: loading (the host), admitting (`datasource`).

use crate::datasource::PageKey;
use crate::datasource::pages::Pages;

/// The root pages that are not resident: what a surface starts from.
pub fn roots(pages: &Pages, wanted: &mut Vec<PageKey>) {
    wanted.extend((0..4).map(PageKey::root).filter(|&key| pages.find(key).is_none()));
}

/// The most urgent pages, once each, no more than there is `room` for.
pub fn list(lacking: &mut [(f64, PageKey)], room: u32, wanted: &mut Vec<PageKey>) {
    lacking.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for &(_, key) in &*lacking {
        if wanted.len() >= room as usize {
            break;
        }
        if !wanted.contains(&key) {
            wanted.push(key);
        }
    }
}

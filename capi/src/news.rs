//! What a terrain made new since a renderer recorded last.
//!
//! In:    slots and tiles of each frame.
//! Out:   the same for the renderer, once.
//! Keeps: [`News`]: each slot at most once, the newest tile of each layer.
//! Not here: when which is copied to the device (`overfly_render_vk`).
//!
//! It lies between terrain and renderer so that a frame waits for no thread that records, and so that
//! a host need not tell the one of the other.

use overfly::core::mesh::drape::NewTile;
use overfly::render_vk::HostRenderer;
use parking_lot::Mutex;

/// What one renderer was not told yet.
pub struct News {
    kept: Mutex<Kept>,
}

struct Kept {
    slots: Vec<u32>,
    /// By slot: it is in `slots`.
    is_kept: Vec<bool>,
    tiles: Vec<NewTile>,
}

impl News {
    /// For a terrain of so many slots and with such tiles, all of which are news.
    pub fn new(slots_max: u32, tiles: Vec<NewTile>) -> Self {
        let slots_max = slots_max as usize;
        // No frame allocates for a renderer: each slot has its place.
        let (slots, is_kept) = (Vec::with_capacity(slots_max), vec![false; slots_max]);
        Self { kept: Mutex::new(Kept { slots, is_kept, tiles }) }
    }

    /// Keeps what a frame made new.
    pub fn note(&self, built: &[u32], tiles: &[NewTile]) {
        let mut kept = self.kept.lock();
        let Kept { slots, is_kept, tiles: known } = &mut *kept;
        for &slot in built {
            let is_kept = &mut is_kept[slot as usize];
            if !std::mem::replace(is_kept, true) {
                slots.push(slot);
            }
        }
        for tile in tiles {
            match known.iter_mut().find(|known| known.0 == tile.0) {
                Some(known) => known.clone_from(tile),
                None => known.push(tile.clone()),
            }
        }
    }

    /// Tells the renderer.
    pub fn tell(&self, renderer: &mut HostRenderer) {
        let mut kept = self.kept.lock();
        let Kept { slots, is_kept, tiles } = &mut *kept;
        renderer.note_built(slots);
        renderer.note_tiles(tiles);
        slots.drain(..).for_each(|slot| is_kept[slot as usize] = false);
        tiles.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_slot_is_kept_once() {
        let news = News::new(4, Vec::new());
        news.note(&[3, 0], &[]);
        news.note(&[0, 2, 3], &[]);
        let kept = news.kept.lock();
        assert_eq!(kept.slots, [3, 0, 2]);
        assert_eq!(kept.is_kept, [true, false, true, true]);
        assert_eq!(kept.slots.capacity(), 4);
    }
}

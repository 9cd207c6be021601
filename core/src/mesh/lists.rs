//! From bits to lists of slots.
//!
//! In:    the bits of a group, the slot of the lowest.
//! Out:   the slots of the bits that are set, ascending.
//! Keeps: nothing.
//! Not here: what the bits mean (`place`).

use super::bounds::Mask;

/// Writes the slots of the set bits of `mask`, as many as `out` holds; the rest of `out` is
/// scratch. Returns how many were written.
pub fn expand(mask: Mask, base: u32, out: &mut [u32]) -> usize {
    let mut written = 0;
    let mut first = base;
    for byte in mask.to_le_bytes() {
        let (places, count) = (&PLACES[usize::from(byte)], COUNTS[usize::from(byte)]);
        let rest = &mut out[written..];
        written += if let Some(eight) = rest.first_chunk_mut::<8>() {
            // All eight are written, without a branch; the next byte goes over what is too much.
            *eight = places.map(|place| first + place);
            usize::from(count)
        } else {
            let count = rest.len().min(usize::from(count));
            for (slot, place) in rest[..count].iter_mut().zip(places) {
                *slot = first + place;
            }
            count
        };
        first += 8;
    }
    written
}

/// A mask without its `count` lowest set bits; what it has not is left in `count`.
pub fn without_lowest(mut mask: Mask, count: &mut usize) -> Mask {
    while *count > 0 && mask != 0 {
        mask &= mask - 1;
        *count -= 1;
    }
    mask
}

/// The bits of each byte that are set, ascending, then zeros: as wide as slots are, so that a
/// lookup is two vector loads.
static PLACES: [[u32; 8]; 256] = {
    let mut all = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][count] = bit;
                count += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
};

/// How many bits of each byte are set.
static COUNTS: [u8; 256] = {
    let mut all = [0; 256];
    let mut byte = 1;
    while byte < 256 {
        all[byte] = all[byte / 2] + (byte % 2 == 1) as u8;
        byte += 1;
    }
    all
};

#[cfg(test)]
mod tests {
    use super::*;

    fn bit_by_bit(mask: Mask, base: u32) -> Vec<u32> {
        (0..Mask::BITS).filter(|bit| mask >> bit & 1 == 1).map(|bit| base + bit).collect()
    }

    #[test]
    fn slots_are_those_of_the_set_bits_however_short_the_room() {
        for mask in (0..500).map(|i| Mask::MAX / 499 * i).chain([0, 1, Mask::MAX]) {
            let expected = bit_by_bit(mask, 640);
            for room in [0, 1, 7, 8, expected.len(), Mask::BITS as usize] {
                let mut out = vec![0; room];
                let written = expand(mask, 640, &mut out);
                assert_eq!(out[..written], expected[..room.min(expected.len())]);
            }
        }
    }

    #[test]
    fn the_lowest_bits_go_first() {
        let (mut two, mut six) = (2, 6);
        assert_eq!(without_lowest(0b1011_0100, &mut two), 0b1010_0000);
        assert_eq!(without_lowest(0b1011_0100, &mut six), 0);
        assert_eq!((two, six), (0, 2));
    }
}

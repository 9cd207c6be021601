//! A tile of imagery as a PNG, and back.
//!
//! In:    texels; or bytes that may be anything.
//! Out:   a PNG of 129 × 129 texels of 8 bits; or the texels, or what is wrong with the bytes.
//! Keeps: nothing.
//! Not here: what texels mean (`overfly_core::datasource::colour`), other pictures.

use overfly_core::datasource::colour::{COLOUR_SIDE, COLOUR_TEXELS};
use png::{BitDepth, ColorType, Compression, Decoder, Encoder, Limits};
use std::io::Cursor;

/// What the decoder may allocate beside the picture.
const DECODER_BYTES: usize = 1 << 20;

/// A tile's bytes: RGB where nothing is transparent, else RGBA.
///
/// # Panics
/// If there are not as many texels as a tile has.
pub fn encode(rgba: &[[u8; 4]]) -> Vec<u8> {
    assert_eq!(rgba.len(), COLOUR_TEXELS, "texels of a tile");
    let side = u32::try_from(COLOUR_SIDE).expect("129");
    let opaque = rgba.iter().all(|texel| texel[3] == 255);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, side, side);
    encoder.set_color(if opaque { ColorType::Rgb } else { ColorType::Rgba });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    let data: Vec<u8> = if opaque {
        rgba.iter().flat_map(|&[red, green, blue, _]| [red, green, blue]).collect()
    } else {
        rgba.as_flattened().to_vec()
    };
    let mut writer = encoder.write_header().expect("the size is none that PNG lacks");
    writer.write_image_data(&data).expect("as many bytes as the size says, into memory");
    writer.finish().expect("into memory");
    bytes
}

/// The texels of a tile's bytes.
pub(crate) fn decode(bytes: &[u8]) -> Result<Box<[[u8; 4]]>, String> {
    let wrong = |error: png::DecodingError| format!("it is no sound PNG: {error}");
    let limits = Limits { bytes: DECODER_BYTES };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_ignore_text_chunk(true);
    let mut reader = decoder.read_info().map_err(wrong)?;
    let info = reader.info();
    let (width, height) = (info.width as usize, info.height as usize);
    if (width, height) != (COLOUR_SIDE, COLOUR_SIDE) {
        return Err(format!("it is {width} × {height} texels, not {COLOUR_SIDE} × {COLOUR_SIDE}"));
    }
    let (color, depth) = (info.color_type, info.bit_depth);
    let bands = match (color, depth) {
        (ColorType::Rgb, BitDepth::Eight) => 3,
        (ColorType::Rgba, BitDepth::Eight) => 4,
        _ => return Err(format!("it is {color:?} of {depth:?} bits, not RGB or RGBA of eight")),
    };
    let mut data = vec![0; COLOUR_TEXELS * bands];
    reader.next_frame(&mut data).map_err(wrong)?;
    reader.finish().map_err(wrong)?;
    let texel = |of: &[u8]| match *of {
        [_, _, _, 0] => [0; 4],
        [red, green, blue, alpha] => [red, green, blue, alpha],
        _ => [of[0], of[1], of[2], 255],
    };
    Ok(data.chunks_exact(bands).map(texel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(transparent: bool) -> Vec<[u8; 4]> {
        let texel = |at: usize| {
            let bits = overfly_core::digest::mix(at as u64).to_le_bytes();
            let alpha = if transparent { bits[3] | 1 } else { 255 };
            [bits[0], bits[1], bits[2], alpha]
        };
        (0..COLOUR_TEXELS).map(texel).collect()
    }

    #[test]
    fn texels_come_back_as_they_were_with_and_without_alpha() {
        for transparent in [false, true] {
            let texels = texels(transparent);
            assert_eq!(*decode(&encode(&texels)).unwrap(), *texels);
        }
    }

    #[test]
    fn whatever_is_cut_or_turned_is_refused() {
        let bytes = encode(&texels(true));
        for length in [0, 7, 40, bytes.len() / 2, bytes.len() - 1] {
            assert!(decode(&bytes[..length]).is_err(), "{length}");
        }
        for at in (8..bytes.len()).step_by(101) {
            let mut turned = bytes.clone();
            turned[at] ^= 0x10;
            assert!(decode(&turned).is_err(), "byte {at}");
        }
    }

    #[test]
    fn pictures_of_another_size_or_depth_are_refused_by_name() {
        let picture = |side: u32, color, depth| {
            let mut bytes = Vec::new();
            let mut encoder = Encoder::new(&mut bytes, side, side);
            encoder.set_color(color);
            encoder.set_depth(depth);
            let mut writer = encoder.write_header().unwrap();
            writer.write_image_data(&vec![0; (side * side) as usize]).unwrap();
            drop(writer);
            bytes
        };
        let error = decode(&picture(64, ColorType::Grayscale, BitDepth::Eight)).unwrap_err();
        assert_eq!(error, "it is 64 × 64 texels, not 129 × 129");
        let error = decode(&picture(129, ColorType::Grayscale, BitDepth::Eight)).unwrap_err();
        assert!(error.contains("Grayscale") && error.contains("not RGB or RGBA"), "{error}");
    }
}

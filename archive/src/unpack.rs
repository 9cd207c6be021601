//! Decompression with a limit: a few bytes that unpack to gigabytes are refused on the way.
//!
//! In:    compressed bytes, how they are compressed, the most they may become.
//! Out:   the bytes, or how many they are.
//! Keeps: nothing.
//! Not here: what the bytes mean.

use flate2::read::GzDecoder;
use pmtiles::Compression;
use std::io::{self, Read};

/// Every frame begins so. What does not is an older format, whose decoders are best left alone.
const ZSTD_MAGIC: [u8; 4] = 0xFD2F_B528_u32.to_le_bytes();
/// A decoder may keep 2^23 bytes behind it: what zstd needs up to level 19.
const ZSTD_WINDOW_LOG_MAX: u32 = 23;

/// The unpacked bytes, at most `bytes_max`.
pub(crate) fn unpack(
    packed: &[u8],
    compression: Compression,
    bytes_max: usize,
) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity((packed.len().saturating_mul(2)).min(bytes_max));
    let mut limited = decoder(packed, compression)?.take(bytes_max as u64 + 1);
    limited.read_to_end(&mut bytes).map_err(|error| reason(&error))?;
    if bytes.len() > bytes_max { Err(too_long(bytes_max)) } else { Ok(bytes) }
}

/// Refuses what the `pmtiles` crate, which unpacks without a limit, must not see.
pub(crate) fn check(
    packed: &[u8],
    compression: Compression,
    bytes_max: usize,
) -> Result<(), String> {
    let mut limited = decoder(packed, compression)?.take(bytes_max as u64 + 1);
    let length = io::copy(&mut limited, &mut io::sink()).map_err(|error| reason(&error))?;
    if length > bytes_max as u64 { Err(too_long(bytes_max)) } else { Ok(()) }
}

fn decoder(packed: &[u8], compression: Compression) -> Result<Box<dyn Read + '_>, String> {
    match compression {
        Compression::None => Ok(Box::new(packed)),
        Compression::Gzip => Ok(Box::new(GzDecoder::new(packed))),
        Compression::Zstd if packed.starts_with(&ZSTD_MAGIC) => {
            let decoder = zstd::stream::read::Decoder::with_buffer(packed);
            let mut decoder = decoder.map_err(|error| reason(&error))?.single_frame();
            decoder.window_log_max(ZSTD_WINDOW_LOG_MAX).map_err(|error| reason(&error))?;
            Ok(Box::new(decoder))
        }
        Compression::Zstd => Err("it is no zstd frame".into()),
        other => Err(format!("it is compressed as {other:?}; gzip and zstd are read")),
    }
}

fn reason(error: &io::Error) -> String {
    format!("it cannot be unpacked: {error}")
}

fn too_long(bytes_max: usize) -> String {
    format!("it unpacks to more than {bytes_max} bytes")
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(bytes: &[u8], compression: Compression) -> Vec<u8> {
        match compression {
            Compression::Gzip => {
                let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::default());
                encoder.write_all(bytes).unwrap();
                encoder.finish().unwrap()
            }
            Compression::Zstd => zstd::encode_all(bytes, 19).unwrap(),
            _ => bytes.to_vec(),
        }
    }

    #[test]
    fn what_was_packed_comes_back_up_to_the_limit_and_not_beyond() {
        let bytes = vec![7; 5000];
        for compression in [Compression::None, Compression::Gzip, Compression::Zstd] {
            let packed = packed(&bytes, compression);
            assert_eq!(unpack(&packed, compression, 5000), Ok(bytes.clone()));
            assert_eq!(check(&packed, compression, 5000), Ok(()));
            assert_eq!(unpack(&packed, compression, 4999), Err(too_long(4999)));
            assert_eq!(check(&packed, compression, 4999), Err(too_long(4999)));
            if compression != Compression::None {
                assert!(unpack(&packed[..packed.len() - 1], compression, 5000).is_err());
            }
        }
    }

    #[test]
    fn unknown_and_legacy_compression_is_refused() {
        assert!(unpack(b"abc", Compression::Brotli, 100).unwrap_err().contains("Brotli"));
        // The first bytes of zstd 0.7, which the C library would still decode.
        assert!(check(&[0x27, 0xB5, 0x2F, 0xFD, 0, 0], Compression::Zstd, 100).is_err());
    }
}

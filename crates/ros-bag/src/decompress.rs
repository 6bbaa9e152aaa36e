//! Compressed bytes, with a limit on what they become: zstd and lz4 frames, and bz2.

use std::io::Read;

use bzip2::read::BzDecoder;
use lz4_flex::frame::FrameDecoder;
use ruzstd::decoding::StreamingDecoder;

use crate::settings::{MAX_CHUNK_BYTES, MAX_EXPANSION, MIN_EXPANDED_BYTES};

/// How many bytes may come of a file by decompression.
pub(crate) const fn expansion_limit_bytes(file_bytes: u64) -> u64 {
    let expanded = file_bytes.saturating_mul(MAX_EXPANSION);
    if expanded > MIN_EXPANDED_BYTES { expanded } else { MIN_EXPANDED_BYTES }
}

/// What compressed bytes became.
pub(crate) struct Decompressed {
    /// All that could be had.
    pub(crate) bytes: Vec<u8>,
    /// Why there is no more, where that is a fault.
    pub(crate) fault: Option<String>,
}

/// Decompresses as far as it goes, at most to the limit. `compression` is the name that MCAP or ROS 1
/// has for it.
pub(crate) fn decompress(compression: &str, compressed: &[u8]) -> Decompressed {
    match compression {
        "" | "none" => Decompressed { bytes: compressed.to_vec(), fault: None },
        "zstd" => match StreamingDecoder::new(compressed) {
            Ok(decoder) => read_limited(decoder),
            Err(error) => Decompressed { bytes: Vec::new(), fault: Some(format!("zstd: {error}")) },
        },
        "lz4" => read_limited(FrameDecoder::new(compressed)),
        "bz2" => read_limited(BzDecoder::new(compressed)),
        other => {
            let fault = format!("compression \"{}\" is not known; zstd, lz4 and bz2 are", other.escape_debug());
            Decompressed { bytes: Vec::new(), fault: Some(fault) }
        }
    }
}

fn read_limited(mut decoder: impl Read) -> Decompressed {
    let mut bytes = Vec::new();
    let mut part = vec![0; 1 << 16];
    // Part by part, so that what was decompressed before a fault is kept.
    let fault = loop {
        match decoder.read(&mut part) {
            Ok(0) => break None,
            Ok(count) if (bytes.len() + count) as u64 > MAX_CHUNK_BYTES => {
                break Some(format!("more than {} MiB", MAX_CHUNK_BYTES >> 20));
            }
            Ok(count) => bytes.extend_from_slice(&part[..count]),
            Err(error) => break Some(error.to_string()),
        }
    };
    Decompressed { bytes, fault }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "yair " a thousand times, by the reference tools' Python bindings (zstandard 0.25.0, lz4 4.4.5).
    const ZSTD: &[u8] =
        &[40, 181, 47, 253, 96, 136, 18, 109, 0, 0, 40, 121, 97, 105, 114, 32, 1, 0, 128, 131, 190, 104, 1];
    const LZ4: &[u8] = &[
        4, 34, 77, 24, 104, 64, 136, 19, 0, 0, 0, 0, 0, 0, 201, 34, 0, 0, 0, 95, 121, 97, 105, 114, 32, 5, 0, 255, 255,
        255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 126, 80, 121, 97, 105,
        114, 32, 0, 0, 0, 0,
    ];

    /// The same by Python 3.11's bz2.
    const BZ2: &[u8] = &[
        66, 90, 104, 57, 49, 65, 89, 38, 83, 89, 6, 25, 27, 135, 0, 9, 195, 145, 128, 64, 0, 32, 32, 16, 32, 32, 0, 84,
        51, 64, 38, 170, 49, 149, 32, 218, 144, 101, 72, 54, 164, 27, 82, 14, 46, 228, 138, 112, 161, 32, 12, 50, 55,
        14,
    ];

    #[test]
    fn all_formats_give_their_text_back() {
        let text = "yair ".repeat(1000).into_bytes();
        for (compression, bytes) in [("zstd", ZSTD), ("lz4", LZ4), ("bz2", BZ2), ("", &text[..])] {
            let found = decompress(compression, bytes);
            assert_eq!((found.bytes, found.fault), (text.clone(), None), "{compression}");
        }
    }

    #[test]
    fn what_is_cut_off_or_unknown_is_a_fault() {
        for (compression, bytes) in [
            ("zstd", &ZSTD[..ZSTD.len() - 3]),
            ("lz4", &LZ4[..20]),
            ("bz2", LZ4),
            ("bz2", &BZ2[..BZ2.len() - 2]),
            ("xz", LZ4),
            ("zstd", LZ4),
        ] {
            assert!(decompress(compression, bytes).fault.is_some(), "{compression}");
        }
    }
}

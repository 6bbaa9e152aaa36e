//! Compressed bytes, with a limit on what they become: zstd and lz4 frames.

use std::io::Read;

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

/// Decompresses as far as it goes, at most to the limit. `compression` is MCAP's name.
pub(crate) fn decompress(compression: &str, compressed: &[u8]) -> Decompressed {
    match compression {
        "" | "none" => Decompressed { bytes: compressed.to_vec(), fault: None },
        "zstd" => match StreamingDecoder::new(compressed) {
            Ok(decoder) => read_limited(decoder),
            Err(error) => Decompressed { bytes: Vec::new(), fault: Some(format!("zstd: {error}")) },
        },
        "lz4" => read_limited(FrameDecoder::new(compressed)),
        other => {
            let fault = format!("compression \"{}\" is not known; zstd and lz4 are", other.escape_debug());
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

    #[test]
    fn both_formats_give_their_text_back() {
        let text = "yair ".repeat(1000).into_bytes();
        for (compression, bytes) in [("zstd", ZSTD), ("lz4", LZ4), ("", &text[..])] {
            let found = decompress(compression, bytes);
            assert_eq!((found.bytes, found.fault), (text.clone(), None), "{compression}");
        }
    }

    #[test]
    fn what_is_cut_off_or_unknown_is_a_fault() {
        for (compression, bytes) in
            [("zstd", &ZSTD[..ZSTD.len() - 3]), ("lz4", &LZ4[..20]), ("bz2", LZ4), ("zstd", LZ4)]
        {
            assert!(decompress(compression, bytes).fault.is_some(), "{compression}");
        }
    }
}

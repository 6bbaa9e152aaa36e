//! The next chunk of a file behind a place where records no longer follow each other.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use crate::mcap_records::op;
use crate::settings::MAX_CHUNK_BYTES;

/// Bytes that are searched at a time.
const BLOCK_BYTES: usize = 1 << 20;
/// Longest head of a chunk: opcode, length, two times, size, checksum, compression "zstd", compressed size.
const HEAD_BYTES: usize = 1 + 8 + 8 + 8 + 8 + 4 + (4 + 4) + 8;

/// Opens a file at its first chunk at or behind `from`, and says where that is.
pub(crate) fn next_chunk(path: &Path, from: u64) -> std::io::Result<Option<(u64, BufReader<File>)>> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut at = from;
    let mut block = Vec::new();
    while at < length {
        file.seek(SeekFrom::Start(at))?;
        block.clear();
        // A head that begins in this block ends in what is read beyond it.
        file.by_ref().take((BLOCK_BYTES + HEAD_BYTES) as u64).read_to_end(&mut block)?;
        let is_head = |offset: &usize| is_chunk(&block[*offset..], length - at - *offset as u64);
        if let Some(offset) = (0..block.len().min(BLOCK_BYTES)).find(is_head) {
            let found = at + offset as u64;
            file.seek(SeekFrom::Start(found))?;
            return Ok(Some((found, BufReader::new(file))));
        }
        at += BLOCK_BYTES as u64;
    }
    Ok(None)
}

/// Is this the head of a chunk, whose lengths fit each other and what remains of the file?
fn is_chunk(bytes: &[u8], remaining: u64) -> bool {
    let number = |at: usize| Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let fits = || {
        let (length, start_ns, end_ns, size) = (number(1)?, number(9)?, number(17)?, number(25)?);
        let name_length = u32::from_le_bytes(*bytes.get(37..)?.first_chunk()?) as usize;
        let name = bytes.get(41..)?.get(..name_length)?;
        let compressed = number(41 + name_length)?;
        let has_lengths = length.checked_sub(compressed)? == 40 + name_length as u64;
        let is_known = [&b""[..], b"lz4", b"zstd"].contains(&name);
        Some(has_lengths && is_known && start_ns <= end_ns && size <= MAX_CHUNK_BYTES && length + 9 <= remaining)
    };
    bytes.first() == Some(&op::CHUNK) && fits() == Some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(compression: &str, records: &[u8]) -> Vec<u8> {
        let length = 40 + compression.len() + records.len();
        let head = [
            &[op::CHUNK][..],
            &(length as u64).to_le_bytes(),
            &7_u64.to_le_bytes(),
            &8_u64.to_le_bytes(),
            &100_u64.to_le_bytes(),
            &0_u32.to_le_bytes(),
            &(compression.len() as u32).to_le_bytes(),
            compression.as_bytes(),
            &(records.len() as u64).to_le_bytes(),
        ];
        [&head.concat(), records].concat()
    }

    #[test]
    fn a_chunk_is_found_wherever_it_lies_between_blocks_and_none_where_it_is_cut_off() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.mcap");
        for before in [1, 100, BLOCK_BYTES - 1, BLOCK_BYTES, BLOCK_BYTES + 1, 2 * BLOCK_BYTES - 20] {
            let mut bytes = vec![op::CHUNK; before];
            bytes.extend(chunk("zstd", &[1, 2, 3]));
            std::fs::write(&path, &bytes).expect("written");
            let found = next_chunk(&path, 0).expect("read").map(|(at, _)| at);
            assert_eq!(found, Some(before as u64));
            std::fs::write(&path, &bytes[..bytes.len() - 1]).expect("written");
            assert!(next_chunk(&path, 0).expect("read").is_none(), "{before}");
        }
        assert!(!is_chunk(&chunk("bzip", &[1, 2, 3]), 1000));
    }
}

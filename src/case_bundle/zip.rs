//! Files in one zip: deflated, without dates. What is read is checked against limits first, since a bundle
//! comes from anywhere. Reference: PKWARE, APPNOTE.TXT 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16.

use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::decompress_to_vec_with_limit;

/// A name and what is in the file.
pub(super) type Packed = (String, Vec<u8>);

const LOCAL_HEADER: u32 = 0x0403_4b50;
const CENTRAL_HEADER: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
const LOCAL_HEADER_BYTES: usize = 30;
const CENTRAL_HEADER_BYTES: usize = 46;
const END_BYTES: usize = 22;

/// Version 2.0: deflate.
const VERSION: u16 = 20;
const STORED: u16 = 0;
const DEFLATED: u16 = 8;
/// 1 January 1980, the first day of the format.
const NO_DATE: u16 = 0x21;
/// Compression level: the smallest output.
const LEVEL: u8 = 9;

/// Files in a bundle: ten tables of a hundred sessions.
const MAX_FILES: usize = 1000;
/// Bytes of all files together; a bundle of the largest size that is written has less than a tenth.
const MAX_UNPACKED_BYTES: usize = 1 << 28;

/// The files as one zip.
pub(super) fn packed(files: &[Packed]) -> Vec<u8> {
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let deflated = compress_to_vec(bytes, LEVEL);
        let offset = zip.len() as u32;
        let mut common = Vec::new();
        for field in [VERSION, 0, DEFLATED, 0, NO_DATE] {
            common.extend(field.to_le_bytes());
        }
        for field in [crc32fast::hash(bytes), deflated.len() as u32, bytes.len() as u32] {
            common.extend(field.to_le_bytes());
        }
        common.extend((name.len() as u16).to_le_bytes());
        common.extend(0_u16.to_le_bytes());
        zip.extend(LOCAL_HEADER.to_le_bytes());
        zip.extend(&common);
        zip.extend(name.as_bytes());
        zip.extend(deflated);
        directory.extend(CENTRAL_HEADER.to_le_bytes());
        directory.extend(VERSION.to_le_bytes());
        directory.extend(&common);
        // No comment, the first disk, no attributes.
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (begins, length, count) = (zip.len() as u32, directory.len() as u32, files.len() as u16);
    zip.extend(directory);
    zip.extend(END.to_le_bytes());
    zip.extend([0; 4]);
    [count, count].iter().for_each(|count| zip.extend(count.to_le_bytes()));
    [length, begins].iter().for_each(|field| zip.extend(field.to_le_bytes()));
    zip.extend([0; 2]);
    zip
}

/// A little-endian number of two or four bytes.
fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<usize> {
    let field: [u8; N] = bytes.get(at..at.checked_add(N)?)?.try_into().ok()?;
    Some(field.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte)))
}

/// The files of a zip.
///
/// # Errors
/// Why it is not one, or not one of these.
pub(super) fn unpacked(zip: &[u8]) -> Result<Vec<Packed>, String> {
    let is_end = |at: &usize| number::<4>(zip, *at) == Some(END as usize);
    let end = (0..=zip.len().saturating_sub(END_BYTES)).rev().find(is_end).ok_or("it is no zip file, or is cut off")?;
    let cut = || "it is damaged: a header leads out of the file".to_owned();
    let count = number::<2>(zip, end + 10).ok_or_else(cut)?;
    if count > MAX_FILES {
        return Err(format!("it has {count} files; a bundle has {MAX_FILES} at most"));
    }
    let mut at = number::<4>(zip, end + 16).ok_or_else(cut)?;
    let mut left_bytes = MAX_UNPACKED_BYTES;
    let mut files = Vec::with_capacity(count);
    for _ in 0..count {
        let next = entry(zip, at, left_bytes).ok_or_else(cut)??;
        left_bytes -= next.file.1.len();
        at = next.next_at;
        files.push(next.file);
    }
    Ok(files)
}

struct Entry {
    file: Packed,
    /// Where the next header of the directory begins.
    next_at: usize,
}

/// The file that a header of the directory speaks of; `None` where a header leads out of the zip.
fn entry(zip: &[u8], at: usize, left_bytes: usize) -> Option<Result<Entry, String>> {
    if number::<4>(zip, at)? != CENTRAL_HEADER as usize {
        return None;
    }
    let method = number::<2>(zip, at + 10)?;
    let [crc, packed_bytes, bytes] =
        [number::<4>(zip, at + 16)?, number::<4>(zip, at + 20)?, number::<4>(zip, at + 24)?];
    let lengths = [number::<2>(zip, at + 28)?, number::<2>(zip, at + 30)?, number::<2>(zip, at + 32)?];
    let local = number::<4>(zip, at + 42)?;
    let name_at = at + CENTRAL_HEADER_BYTES;
    let name = String::from_utf8_lossy(zip.get(name_at..name_at + lengths[0])?).into_owned();
    let begins = local + LOCAL_HEADER_BYTES + number::<2>(zip, local + 26)? + number::<2>(zip, local + 28)?;
    let data = zip.get(begins..begins.checked_add(packed_bytes)?)?;
    if bytes > left_bytes {
        return Some(Err(format!("its files have more than {MAX_UNPACKED_BYTES} bytes; is this a bundle?")));
    }
    let content = if method == usize::from(STORED) {
        Some(data.to_vec())
    } else if method == usize::from(DEFLATED) {
        decompress_to_vec_with_limit(data, bytes).ok()
    } else {
        None
    };
    let is_whole = |content: &Vec<u8>| content.len() == bytes && crc32fast::hash(content) as usize == crc;
    Some(match content.filter(is_whole) {
        Some(content) => Ok(Entry { file: (name, content), next_at: name_at + lengths.iter().sum::<usize>() }),
        None => Err("it is damaged: a file in it does not have its checksum".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files() -> Vec<Packed> {
        vec![("a.toml".to_owned(), b"format = 1\n".to_vec()), ("b/c.csv".to_owned(), b"run,t_s\n".repeat(100))]
    }

    #[test]
    fn what_is_packed_comes_out_again() {
        for files in [files(), Vec::new(), vec![("empty".to_owned(), Vec::new())]] {
            assert_eq!(unpacked(&packed(&files)), Ok(files));
        }
    }

    #[test]
    fn any_damage_is_an_error_or_changes_no_content() {
        let zip = packed(&files());
        for length in 0..zip.len() {
            assert!(unpacked(&zip[..length]).is_err(), "{length}");
        }
        for at in 0..zip.len() {
            for bit in 0..8 {
                let mut damaged = zip.clone();
                damaged[at] ^= 1 << bit;
                let contents = |files: &[Packed]| files.iter().map(|file| file.1.clone()).collect::<Vec<_>>();
                if let Ok(found) = unpacked(&damaged) {
                    assert!(contents(&files()).starts_with(&contents(&found)), "{at} {bit}");
                }
            }
        }
    }
}

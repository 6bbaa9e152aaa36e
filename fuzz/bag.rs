//! Mutations of MCAP files by their records: chunks are opened, records changed, and lengths and checksums
//! made right again, so that what is wrong lies deep inside; now and then they are left wrong.

use std::io::Read;

use rand::{Rng, RngExt};

use crate::text;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// Opcode and body.
type Record = (u8, Vec<u8>);

fn records(mut bytes: &[u8]) -> Vec<Record> {
    let mut found = Vec::new();
    while let Some((opcode, rest)) = bytes.split_first() {
        let Some((length, rest)) = rest.split_first_chunk::<8>() else { break };
        let Some((body, rest)) = rest.split_at_checked(u64::from_le_bytes(*length) as usize) else { break };
        found.push((*opcode, body.to_vec()));
        bytes = rest;
    }
    found
}

/// The records of a file, those of its chunks among them; indices are left out.
pub(crate) fn flat(file: &[u8]) -> Vec<Record> {
    let inside = |(opcode, body): Record| match opcode {
        CHUNK => records(&opened(&body)),
        SCHEMA | CHANNEL | MESSAGE => vec![(opcode, body)],
        _ => Vec::new(),
    };
    records(&file[MAGIC.len()..]).into_iter().flat_map(inside).collect()
}

/// The records of a chunk of zstd, or of one that is not compressed.
fn opened(body: &[u8]) -> Vec<u8> {
    let length = u32::from_le_bytes(*body[28..].first_chunk().expect("a chunk")) as usize;
    let (name, data) = (&body[32..32 + length], &body[32 + length + 8..]);
    if name.is_empty() {
        return data.to_vec();
    }
    let mut plain = Vec::new();
    let mut decoder = ruzstd::decoding::StreamingDecoder::new(data).expect("zstd");
    decoder.read_to_end(&mut plain).expect("zstd");
    plain
}

fn written(records: &[Record]) -> Vec<u8> {
    let record = |(opcode, body): &Record| [&[*opcode][..], &(body.len() as u64).to_le_bytes(), body].concat();
    records.iter().flat_map(record).collect()
}

/// A chunk around records, compressed or not, whose checksum is right.
fn chunk(records: &[Record], random: &mut impl Rng) -> Record {
    let plain = written(records);
    let (name, data) = if random.random_bool(0.1) {
        ("zstd", ruzstd::encoding::compress_to_vec(&plain[..], ruzstd::encoding::CompressionLevel::Fastest))
    } else {
        ("", plain.clone())
    };
    let body = [
        &[0; 16][..],
        &(plain.len() as u64).to_le_bytes(),
        &crc32fast::hash(&plain).to_le_bytes(),
        &(name.len() as u32).to_le_bytes(),
        name.as_bytes(),
        &(data.len() as u64).to_le_bytes(),
        &data,
    ];
    (CHUNK, body.concat())
}

/// Some bytes become a length, a count or a number at which code goes wrong.
pub(crate) fn number(body: &mut [u8], random: &mut impl Rng) {
    let values: [u64; 12] = [
        0,
        1,
        u64::MAX,
        1 << 31,
        (1 << 31) - 1,
        1 << 63,
        (1 << 63) - 1,
        u64::from(u32::MAX),
        f64::NAN.to_bits(),
        f64::INFINITY.to_bits(),
        f64::MAX.to_bits(),
        5,
    ];
    let bytes = values[random.random_range(0..values.len())].to_le_bytes();
    let length = [1, 2, 4, 8][random.random_range(0..4)];
    if body.len() >= length {
        // Numbers stand at multiples of their length behind the four bytes of CDR.
        let at = random.random_range(0..=body.len() - length);
        let at = if random.random_bool(0.7) { at / 4 * 4 + body.len() % 4 } else { at };
        let at = at.min(body.len() - length);
        body[at..at + length].copy_from_slice(&bytes[..length]);
    }
}

/// Two places of a list that is not empty. Declarations are at its front and matter most: the first place is
/// among them more often than by chance.
pub(crate) fn places(count: usize, random: &mut impl Rng) -> [usize; 2] {
    let first = if random.random_bool(0.3) { count.min(6) } else { count };
    [first, count].map(|count| random.random_range(0..count))
}

/// Removes, repeats or exchanges a record, or ends the list at it, by one of the numbers 0 to 3.
pub(crate) fn rearrange<T: Clone>(records: &mut Vec<T>, [at, other]: [usize; 2], how: u32) {
    match how {
        0 => drop(records.remove(at)),
        1 => records.insert(other, records[at].clone()),
        2 => records.swap(at, other),
        _ => records.truncate(at + 1),
    }
}

fn mutate(records: &mut Vec<Record>, random: &mut impl Rng) {
    if records.is_empty() {
        return;
    }
    let [at, other] = places(records.len(), random);
    match random.random_range(0..9) {
        how @ 0..4 => rearrange(records, [at, other], how),
        4 => {
            let length = random.random_range(0..=records[at].1.len());
            records[at].1.truncate(length);
        }
        5 => records[at].1 = text::bit(&records[at].1, random),
        6 if records[at].0 != MESSAGE => {
            // A definition by its words; the length before it is made right.
            let body = &records[at].1;
            let start = body.len().min(40);
            let new = text::mutated(&body[start..], &records[other].1, random);
            records[at].1 = [&body[..start], &new].concat();
        }
        _ => number(&mut records[at].1, random),
    }
}

/// A file with one to eight mutations of its records, or of its bytes.
pub(crate) fn mutated(file: &[u8], random: &mut impl Rng) -> Vec<u8> {
    if random.random_bool(0.1) {
        return (0..random.random_range(1..5)).fold(file.to_vec(), |file, _| text::bit(&file, random));
    }
    let mut all = flat(file);
    // A run of a few seconds is read faster than all of it.
    if random.random_bool(0.8) {
        all.truncate(60);
    }
    for _ in 0..1 + (8.0 * random.random::<f64>().powi(3)) as usize {
        mutate(&mut all, random);
    }
    let mut records = match random.random_range(0..3) {
        0 => all,
        1 => vec![chunk(&all, random)],
        _ => {
            let behind = all.split_off(all.len() / 2);
            vec![chunk(&all, random), chunk(&behind, random)]
        }
    };
    records.push((DATA_END, vec![0; 4]));
    let mut bytes = [MAGIC, &written(&records)].concat();
    match random.random_range(0..20) {
        0 => bytes.truncate(random.random_range(0..=bytes.len())),
        1 => {
            let end = bytes.len().min(100);
            number(&mut bytes[MAGIC.len()..end], random);
        }
        _ => {}
    }
    bytes
}

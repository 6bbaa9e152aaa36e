//! Mutations of bags of ROS 1 by their records: chunks are opened, headers, definitions and messages changed,
//! and lengths made right again. Of a bag whose chunks are compressed, bytes are changed.

use rand::{Rng, RngExt};

use crate::{bag, text};

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
const CONNECTION: &[u8] = b"\x04\0\0\0op=\x07";
const MESSAGE: &[u8] = b"\x04\0\0\0op=\x02";
const CHUNK: &[u8] = b"\x04\0\0\0op=\x05";

/// Header and data.
type Record = [Vec<u8>; 2];

fn block(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

fn records(mut bytes: &[u8]) -> Vec<Record> {
    let mut found = Vec::new();
    while let Some((header, rest)) = block(bytes)
        && let Some((data, rest)) = block(rest)
    {
        found.push([header.to_vec(), data.to_vec()]);
        bytes = rest;
    }
    found
}

fn written(records: &[Record]) -> Vec<u8> {
    records.iter().flatten().flat_map(|part| [&(part.len() as u32).to_le_bytes()[..], part].concat()).collect()
}

fn has(header: &[u8], field: &[u8]) -> bool {
    header.windows(field.len()).any(|part| part == field)
}

/// Connections and messages, those of chunks; indices are left out.
fn flat(file: &[u8]) -> Vec<Record> {
    let inside = |record: Record| match &record[0] {
        header if has(header, CHUNK) && has(header, b"=none") => records(&record[1]),
        header if has(header, CHUNK) || !has(header, CONNECTION) && !has(header, MESSAGE) => Vec::new(),
        _ => vec![record],
    };
    records(&file[MAGIC.len()..]).into_iter().flat_map(inside).collect()
}

/// A chunk around records, whose size is mostly right.
fn chunk(records: &[Record], random: &mut impl Rng) -> Record {
    let plain = written(records);
    let size = if random.random_bool(0.03) { random.random::<u32>() } else { plain.len() as u32 };
    let fields = [CHUNK[4..].to_vec(), b"compression=none".to_vec(), [b"size=", &size.to_le_bytes()[..]].concat()];
    let header = fields.iter().flat_map(|field| [&(field.len() as u32).to_le_bytes()[..], field].concat()).collect();
    [header, plain]
}

fn mutate(records: &mut Vec<Record>, random: &mut impl Rng) {
    if records.is_empty() {
        return;
    }
    let [at, other] = bag::places(records.len(), random);
    let part = usize::from(random.random_bool(0.7));
    match random.random_range(0..9) {
        how @ 0..4 => bag::rearrange(records, [at, other], how),
        4 => {
            let length = random.random_range(0..=records[at][part].len());
            records[at][part].truncate(length);
        }
        5 => records[at][part] = text::bit(&records[at][part], random),
        6 if has(&records[at][0], CONNECTION) => {
            // A definition by its words: the lengths of the fields before it stay right.
            let data = &records[at][1];
            let start = data.windows(8).position(|part| part == b"inition=").map_or(0, |start| start + 8);
            let new = text::mutated(&data[start..], &records[other][1], random);
            records[at][1] = [&data[..start], &new].concat();
        }
        _ => bag::number(&mut records[at][part], random),
    }
}

/// A file with one to eight mutations of its records, or of its bytes.
pub(crate) fn mutated(file: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut all = flat(file);
    if all.is_empty() || random.random_bool(0.1) {
        return (0..random.random_range(1..5)).fold(file.to_vec(), |file, _| text::bit(&file, random));
    }
    for _ in 0..1 + (8.0 * random.random::<f64>().powi(3)) as usize {
        mutate(&mut all, random);
    }
    let records = match random.random_range(0..3) {
        0 => all,
        1 => vec![chunk(&all, random)],
        _ => {
            let behind = all.split_off(all.len() / 2);
            vec![chunk(&all, random), chunk(&behind, random)]
        }
    };
    let mut bytes = [MAGIC, &written(&records)].concat();
    match random.random_range(0..20) {
        0 => bytes.truncate(random.random_range(MAGIC.len()..=bytes.len())),
        1 => {
            let end = bytes.len().min(100);
            bag::number(&mut bytes[MAGIC.len()..end], random);
        }
        _ => {}
    }
    bytes
}

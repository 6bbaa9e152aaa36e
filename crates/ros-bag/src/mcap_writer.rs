//! An MCAP file in memory: chunks that are not compressed, each with an index of its messages, and a summary.
//!
//! The bytes are those of the crate `mcap` 0.26 with the same options, which was left for the time that it
//! and its dependencies took to compile. Reference: MCAP specification 1.0, <https://mcap.dev/spec>.

use std::collections::BTreeMap;

use crate::mcap_records::{MAGIC, op};

/// A chunk ends with the message that makes it longer: what a reader holds at a time.
const CHUNK_BYTES: usize = 1 << 20;

/// Records under way, and where messages begin among them.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Of each channel, time and place of its messages.
    messages: BTreeMap<u16, Vec<(u64, u64)>>,
    times: Option<(u64, u64)>,
}

/// Writes a file of topics and messages.
pub struct McapWriter {
    bytes: Vec<u8>,
    chunk: Chunk,
    /// What stands behind the number in records of schemas and channels; numbers count from 1.
    schemas: Vec<Vec<u8>>,
    channels: Vec<Vec<u8>>,
    /// Messages of each channel.
    counts: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
    chunk_indexes: Vec<Vec<u8>>,
}

/// Appends a record of these parts.
fn push_record(to: &mut Vec<u8>, opcode: u8, parts: &[&[u8]]) {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    to.push(opcode);
    to.extend((length as u64).to_le_bytes());
    parts.iter().for_each(|part| to.extend_from_slice(part));
}

/// Bytes behind their length of 32 bits.
fn prefixed(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

/// A number for each channel, behind their length in bytes.
fn by_channel<'a>(numbers: impl Iterator<Item = (&'a u16, u64)>) -> Vec<u8> {
    prefixed(
        &numbers
            .flat_map(|(channel, number)| [&channel.to_le_bytes()[..], &number.to_le_bytes()].concat())
            .collect::<Vec<u8>>(),
    )
}

/// An interval of time with another instant in it.
fn extended(times: Option<(u64, u64)>, time_ns: u64) -> Option<(u64, u64)> {
    let (start_ns, end_ns) = times.unwrap_or((time_ns, time_ns));
    Some((start_ns.min(time_ns), end_ns.max(time_ns)))
}

/// Both ends of an interval as bytes; 0 of none.
fn interval(times: Option<(u64, u64)>) -> [[u8; 8]; 2] {
    let (start_ns, end_ns) = times.unwrap_or_default();
    [start_ns, end_ns].map(u64::to_le_bytes)
}

impl McapWriter {
    /// A file without messages, of a profile such as `ros2`, written by a library of this name.
    #[must_use]
    pub fn new(profile: &str, library: &str) -> Self {
        let mut bytes = MAGIC.to_vec();
        push_record(&mut bytes, op::HEADER, &[&prefixed(profile.as_bytes()), &prefixed(library.as_bytes())]);
        Self {
            bytes,
            chunk: Chunk::default(),
            schemas: Vec::new(),
            channels: Vec::new(),
            counts: BTreeMap::new(),
            times: None,
            chunk_indexes: Vec::new(),
        }
    }

    /// The number of a schema; one that is there already is not repeated. `None` where there are 65,535.
    pub fn add_schema(&mut self, name: &str, encoding: &str, definition: &str) -> Option<u16> {
        let body = [name, encoding, definition].map(|text| prefixed(text.as_bytes())).concat();
        if let Some(index) = self.schemas.iter().position(|known| *known == body) {
            return u16::try_from(index + 1).ok();
        }
        let id = u16::try_from(self.schemas.len() + 1).ok()?;
        push_record(&mut self.chunk.records, op::SCHEMA, &[&id.to_le_bytes(), &body]);
        self.schemas.push(body);
        Some(id)
    }

    /// The number of a new channel with a schema of this number; `None` where there are 65,535.
    pub fn add_channel(&mut self, schema: u16, topic: &str, encoding: &str, metadata: &[(&str, &str)]) -> Option<u16> {
        let id = u16::try_from(self.channels.len() + 1).ok()?;
        let metadata = metadata.iter().flat_map(|(key, value)| [prefixed(key.as_bytes()), prefixed(value.as_bytes())]);
        let metadata = prefixed(&metadata.flatten().collect::<Vec<u8>>());
        let texts = [topic, encoding].map(|text| prefixed(text.as_bytes())).concat();
        let body = [&schema.to_le_bytes()[..], &texts, &metadata].concat();
        push_record(&mut self.chunk.records, op::CHANNEL, &[&id.to_le_bytes(), &body]);
        self.channels.push(body);
        Some(id)
    }

    /// Adds a message that was sent and received at an instant.
    pub fn push(&mut self, channel: u16, sequence: u32, time_ns: u64, message: &[u8]) {
        if self.chunk.records.len() > CHUNK_BYTES {
            self.end_chunk();
        }
        let (chunk, time) = (&mut self.chunk, time_ns.to_le_bytes());
        chunk.messages.entry(channel).or_default().push((time_ns, chunk.records.len() as u64));
        let head: [&[u8]; 4] = [&channel.to_le_bytes(), &sequence.to_le_bytes(), &time, &time];
        push_record(&mut chunk.records, op::MESSAGE, &[&head.concat(), message]);
        chunk.times = extended(chunk.times, time_ns);
        self.times = extended(self.times, time_ns);
        *self.counts.entry(channel).or_default() += 1;
    }

    /// Writes the chunk that is under way, and the index of its messages.
    fn end_chunk(&mut self) {
        let Chunk { records, messages, times } = std::mem::take(&mut self.chunk);
        if records.is_empty() {
            return;
        }
        let begins = self.bytes.len() as u64;
        let (size, [start, end]) = ((records.len() as u64).to_le_bytes(), interval(times));
        let checksum = crc32fast::hash(&records).to_le_bytes();
        let compression = prefixed(b"");
        push_record(&mut self.bytes, op::CHUNK, &[&start, &end, &size, &checksum, &compression, &size, &records]);
        let ends = self.bytes.len() as u64;
        let mut indexes = BTreeMap::new();
        for (channel, messages) in &messages {
            indexes.insert(*channel, self.bytes.len() as u64);
            let entries = messages.iter().flat_map(|(time, at)| [time.to_le_bytes(), at.to_le_bytes()]);
            let entries: Vec<u8> = entries.flatten().collect();
            push_record(&mut self.bytes, op::MESSAGE_INDEX, &[&channel.to_le_bytes(), &prefixed(&entries)]);
        }
        let lengths = [begins, ends - begins].map(u64::to_le_bytes).concat();
        let places = by_channel(indexes.iter().map(|(channel, at)| (channel, *at)));
        let index_length = (self.bytes.len() as u64 - ends).to_le_bytes();
        self.chunk_indexes
            .push([&start[..], &end, &lengths, &places, &index_length, &compression, &size, &size].concat());
    }

    /// The file, ended by its summary.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        self.end_chunk();
        let mut bytes = std::mem::take(&mut self.bytes);
        let checksum = crc32fast::hash(&bytes).to_le_bytes();
        push_record(&mut bytes, op::DATA_END, &[&checksum]);
        let summary_begins = bytes.len();
        let mut offsets = Vec::new();
        let numbered = |bodies: &[Vec<u8>]| -> Vec<Vec<u8>> {
            (1_u16..).zip(bodies).map(|(id, body)| [&id.to_le_bytes()[..], body].concat()).collect()
        };
        for (opcode, bodies) in [
            (op::SCHEMA, numbered(&self.schemas)),
            (op::CHANNEL, numbered(&self.channels)),
            (op::STATISTICS, vec![self.statistics()]),
            (op::CHUNK_INDEX, std::mem::take(&mut self.chunk_indexes)),
        ] {
            let begins = bytes.len() as u64;
            bodies.iter().for_each(|body| push_record(&mut bytes, opcode, &[body]));
            if !bodies.is_empty() {
                offsets.push((opcode, begins, bytes.len() as u64 - begins));
            }
        }
        let offsets_begin = bytes.len();
        for (opcode, begins, length) in offsets {
            push_record(&mut bytes, op::SUMMARY_OFFSET, &[&[opcode], &begins.to_le_bytes(), &length.to_le_bytes()]);
        }
        // The checksum covers the footer up to itself.
        let footer = [summary_begins, offsets_begin].map(|at| (at as u64).to_le_bytes()).concat();
        push_record(&mut bytes, op::FOOTER, &[&footer, &[0; 4]]);
        let covered = bytes.len() - 4;
        let checksum = crc32fast::hash(&bytes[summary_begins..covered]).to_le_bytes();
        bytes.truncate(covered);
        bytes.extend(checksum);
        bytes.extend(MAGIC);
        bytes
    }

    fn statistics(&self) -> Vec<u8> {
        let messages: u64 = self.counts.values().sum();
        let [start, end] = interval(self.times);
        // No attachments, no metadata.
        let counts = [self.channels.len(), 0, 0, self.chunk_indexes.len()].map(|count| (count as u32).to_le_bytes());
        let by_channel = by_channel(self.counts.iter().map(|(channel, count)| (channel, *count)));
        let schemas = (self.schemas.len() as u16).to_le_bytes();
        [&messages.to_le_bytes()[..], &schemas, &counts.concat(), &start, &end, &by_channel].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of so many topics, two to a schema, and so many messages.
    fn file(topics: usize, messages: u32) -> Vec<u8> {
        let mut writer = McapWriter::new("ros2", "yair 0.1.0");
        let channels: Vec<u16> = (0..topics)
            .map(|topic| {
                let (name, definition) = (format!("a/B{}", topic / 2), "x\n".repeat(topic / 2));
                let schema = writer.add_schema(&name, "ros2msg", &definition).expect("a schema");
                let metadata = [("offered_qos_profiles", ""), ("z", "q")];
                writer.add_channel(schema, &format!("/t{topic}"), "cdr", &metadata).expect("a channel")
            })
            .collect();
        for k in 0..messages {
            let (of, more) = ((k * 7 + k / 5) as usize % channels.len(), (k % 97) as usize);
            // Not all in the order of time.
            let time_ns = 1_000_000_000 + u64::from(k) * 1000 - u64::from(k % 3) * 5000 % 1000;
            writer.push(channels[of], k, time_ns, &vec![k as u8; 50 + more]);
        }
        writer.finish()
    }

    /// Length and checksum of what `mcap` 0.26.0 writes of the same calls without compression: of no topic,
    /// no message, one chunk and six. Its bytes and these were compared as a whole, one by one.
    #[test]
    fn published_the_bytes_are_those_of_the_format_s_own_library() {
        for (topics, messages, length, checksum) in [
            (0, 0, 170, 0x5342_dbfc_u32),
            (3, 0, 924, 0x281c_9971),
            (1, 1, 708, 0xb5f0_c18a),
            (4, 40_000, 5_800_992, 0xe274_cc69),
        ] {
            let bytes = file(topics, messages);
            assert_eq!((bytes.len(), crc32fast::hash(&bytes)), (length, checksum), "{topics} topics, {messages}");
        }
    }

    #[test]
    fn a_schema_is_written_once_and_numbers_end() {
        let mut writer = McapWriter::new("", "");
        let ids = ["a", "b", "a"].map(|name| writer.add_schema(name, "ros2msg", ""));
        assert_eq!(ids, [Some(1), Some(2), Some(1)]);
        for number in 1..=u16::MAX {
            assert_eq!(writer.add_channel(1, "/t", "cdr", &[]), Some(number));
        }
        assert_eq!(writer.add_channel(1, "/t", "cdr", &[]), None);
    }
}

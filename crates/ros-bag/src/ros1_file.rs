//! Messages of one bag of ROS 1 (format 2.0), from its start to its end, with or without an index.
//!
//! A record is a header of fields `name=value` and its data, each behind its length. The field `op` says what
//! it is: chunks hold the records of connections and messages, compressed. One chunk is in memory at a time,
//! and no length is believed before the bytes are there. A damaged chunk is left out, of a file that is cut
//! off everything before the cut is read. Reference: <http://wiki.ros.org/Bags/Format/2.0>.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::decompress::decompress;
use crate::definition::ros2_name;
use crate::error::RosBagError;
use crate::mcap_file::{Channel, Losses, expands_beyond};
use crate::settings::{MAX_CHUNK_BYTES, MAX_DECLARED_BYTES};

/// First bytes of any bag of ROS 1, and of the format that is read here.
const NAME: &[u8] = b"#ROSBAG V";
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Records that are read, by their `op`.
const MESSAGE: u8 = 2;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

/// Whether a file is a bag of ROS 1, by its first bytes.
pub(crate) fn is_ros1(path: &Path) -> bool {
    let mut start = [0; NAME.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == *NAME
}

/// Visits the messages of a file, with so many bytes at most by decompression: channel, time of receipt in
/// nanoseconds, bytes.
pub(crate) fn visit(
    path: &Path,
    limit_bytes: u64,
    visit: impl FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>,
    losses: &mut Losses,
) -> Result<(), RosBagError> {
    let io = |source| RosBagError::Io { path: path.to_owned(), source };
    let mut reader = BufReader::new(File::open(path).map_err(io)?);
    let mut magic = Vec::new();
    reader.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(io)?;
    if magic != MAGIC {
        let version = String::from_utf8_lossy(&magic[NAME.len().min(magic.len())..]).trim().escape_debug().to_string();
        let why = format!("a bag of ROS 1 in format {version:?}; 2.0 is read, which `rosbag fix` writes");
        return Err(RosBagError::NoBag { path: path.to_owned(), why });
    }
    let (connections, at) = (BTreeMap::new(), MAGIC.len() as u64);
    Reading { path, at, connections, declared_bytes: 0, expanded_bytes: 0, limit_bytes, visit, losses }
        .file(&mut reader)
}

struct Reading<'a, V> {
    path: &'a Path,
    /// Byte of the file.
    at: u64,
    connections: BTreeMap<u32, Channel>,
    /// Of connections.
    declared_bytes: usize,
    /// Of chunks.
    expanded_bytes: u64,
    /// Of what may come by decompression.
    limit_bytes: u64,
    visit: V,
    losses: &'a mut Losses,
}

impl<V: FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>> Reading<'_, V> {
    /// Records up to the end of the file, or to where they no longer follow each other.
    fn file(&mut self, reader: &mut impl Read) -> Result<(), RosBagError> {
        let (mut header, mut data) = (Vec::new(), Vec::new());
        for number in 0_u64.. {
            let start = self.at;
            let Some(length) = self.length(reader) else {
                // The end, unless not one record is there.
                if number == 0 || self.at > start {
                    self.lose(start, "a bag of ROS 1 that is cut off; everything before was read");
                }
                break;
            };
            self.read(reader, length.into(), &mut header);
            let (is_cut, length) = match self.length(reader) {
                Some(data_length) if header.len() as u64 == u64::from(length) => (false, u64::from(data_length)),
                _ => (true, 0),
            };
            let op = field(&header, "op").and_then(|op| op.first().copied());
            let Some(op) = op.filter(|_| !is_cut) else {
                let what = if is_cut { "the file is cut off" } else { "no record: a header without an op" };
                self.lose(start, &format!("{what}; everything before was read"));
                break;
            };
            let is_read = [MESSAGE, CHUNK, CONNECTION].contains(&op);
            let there = if is_read && length <= MAX_CHUNK_BYTES {
                self.read(reader, length, &mut data);
                data.len() as u64
            } else {
                data.clear();
                let skipped = std::io::copy(&mut reader.by_ref().take(length), &mut std::io::sink()).unwrap_or(0);
                self.at += skipped;
                if is_read {
                    let most = MAX_CHUNK_BYTES >> 20;
                    self.lose(start, &format!("a record of {length} bytes, more than {most} MiB, was left out"));
                }
                skipped
            };
            let is_cut = there < length;
            match op {
                _ if !is_read || length > MAX_CHUNK_BYTES => {}
                CHUNK => self.chunk(start, &header, &data, is_cut)?,
                _ if is_cut => {}
                _ => self.record(start, op, &header, &data)?,
            }
            if is_cut {
                let why = format!("the file is cut off: {there} of {length} bytes of a record are there");
                self.lose(start, &format!("{why}; everything before was read"));
                break;
            }
        }
        Ok(())
    }

    /// The length of what follows; none at the end of the file.
    fn length(&mut self, reader: &mut impl Read) -> Option<u32> {
        let mut bytes = Vec::new();
        self.read(reader, 4, &mut bytes);
        bytes.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }

    /// Reads up to `count` bytes; a fault of the file is its end.
    fn read(&mut self, reader: &mut impl Read, count: u64, into: &mut Vec<u8>) {
        into.clear();
        // What was read before a fault stays in `into`.
        let _ = reader.by_ref().take(count).read_to_end(into);
        self.at += into.len() as u64;
    }

    fn lose(&mut self, at: u64, why: &str) {
        self.losses.add(format!("{}: byte {at}: {why}", self.path.display()));
    }

    /// Records of a chunk; of one that is cut off, those before the cut.
    fn chunk(&mut self, start: u64, header: &[u8], data: &[u8], is_cut: bool) -> Result<(), RosBagError> {
        let compression = field(header, "compression").and_then(|name| std::str::from_utf8(name).ok());
        let Some((compression, size)) = compression.zip(number(header, "size")) else {
            self.lose(start, "a chunk's header is damaged; it was left out");
            return Ok(());
        };
        if size > MAX_CHUNK_BYTES {
            let most = MAX_CHUNK_BYTES >> 20;
            self.lose(start, &format!("a chunk of {size} bytes, more than {most} MiB, was left out"));
            return Ok(());
        }
        let whole = decompress(compression, data);
        self.expanded_bytes += whole.bytes.len() as u64;
        if self.expanded_bytes > self.limit_bytes {
            return Err(expands_beyond(self.path, self.limit_bytes));
        }
        let found = whole.bytes.len();
        let wrong_size = || (found as u64 != size).then(|| format!("{found} bytes instead of {size}"));
        if let Some(why) = whole.fault.or_else(wrong_size).filter(|_| !is_cut) {
            self.lose(start, &format!("a chunk of {} bytes is damaged and was left out: {why}", data.len()));
            return Ok(());
        }
        let mut rest = &whole.bytes[..];
        while !rest.is_empty() {
            let record = block(rest).and_then(|(header, rest)| Some((header, block(rest)?)));
            let Some((header, (data, behind))) = record else {
                if !is_cut {
                    self.lose(start, &format!("the last {} bytes of a chunk are no record", rest.len()));
                }
                return Ok(());
            };
            match field(header, "op").and_then(|op| op.first().copied()) {
                Some(op) => self.record(start, op, header, data)?,
                None => self.lose(start, "a record of a chunk has no op"),
            }
            rest = behind;
        }
        Ok(())
    }

    /// One record that is no chunk.
    fn record(&mut self, start: u64, op: u8, header: &[u8], data: &[u8]) -> Result<(), RosBagError> {
        let connection = number(header, "conn").and_then(|number| u32::try_from(number).ok());
        let read = match (op, connection) {
            (CONNECTION, Some(connection)) => self.connection(connection, header, data),
            (MESSAGE, Some(connection)) => {
                let time = number(header, "time").filter(|_| field(header, "time").is_some_and(|time| time.len() == 8));
                match (self.connections.get(&connection), time) {
                    (Some(channel), Some(time)) => {
                        // Seconds in the lower half, nanoseconds in the upper one.
                        let time_ns = (time & 0xffff_ffff) * 1_000_000_000 + (time >> 32);
                        return (self.visit)(channel, time_ns, data);
                    }
                    (None, _) => Err(format!("a message of connection {connection}, which was not declared")),
                    (_, None) => Err("a message without a time".to_owned()),
                }
            }
            (CONNECTION | MESSAGE, None) => Err("a record without the number of its connection".to_owned()),
            _ => Ok(()),
        };
        if let Err(why) = read {
            self.lose(start, &why);
        }
        Ok(())
    }

    fn connection(&mut self, number: u32, header: &[u8], data: &[u8]) -> Result<(), String> {
        let text = |of: &[u8], name: &str| field(of, name).map(|text| String::from_utf8_lossy(text).into_owned());
        let missing = |what: &str| format!("connection {number} has no {what}; it was left out");
        let declared = Channel {
            topic: text(header, "topic").ok_or_else(|| missing("topic"))?,
            type_name: ros2_name(&text(data, "type").ok_or_else(|| missing("type"))?),
            message_encoding: "ros1".to_owned(),
            schema_encoding: "ros1msg".to_owned(),
            definition: text(data, "message_definition").unwrap_or_default(),
        };
        let replaced_bytes = self.connections.get(&number).map_or(0, Channel::bytes);
        let declared_bytes = self.declared_bytes.saturating_sub(replaced_bytes) + declared.bytes();
        if declared_bytes > MAX_DECLARED_BYTES {
            let most = MAX_DECLARED_BYTES >> 20;
            return Err(format!("connections of more than {most} MiB; one was left out"));
        }
        self.declared_bytes = declared_bytes;
        self.connections.insert(number, declared);
        Ok(())
    }
}

/// Bytes behind their length, and what follows them.
fn block(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

/// The value of a header's field.
fn field<'h>(header: &'h [u8], name: &str) -> Option<&'h [u8]> {
    let mut rest = header;
    while let Some((whole, behind)) = block(rest) {
        if let Some(value) = whole.strip_prefix(name.as_bytes()).and_then(|value| value.strip_prefix(b"=")) {
            return Some(value);
        }
        rest = behind;
    }
    None
}

/// The unsigned number of a field of at most eight bytes.
fn number(header: &[u8], name: &str) -> Option<u64> {
    let bytes = field(header, name).filter(|bytes| (1..=8).contains(&bytes.len()))?;
    Some(bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn behind_length(bytes: &[u8]) -> Vec<u8> {
        [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat()
    }

    fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
        fields.iter().flat_map(|(name, value)| behind_length(&[name.as_bytes(), b"=", value].concat())).collect()
    }

    fn record(of: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
        [behind_length(&fields(of)), behind_length(data)].concat()
    }

    /// A connection whose definition has so many bytes.
    fn connection(number: u32, bytes: usize) -> Vec<u8> {
        let definition = "#".repeat(bytes);
        let data = fields(&[("type", b"tf/tfMessage"), ("message_definition", definition.as_bytes())]);
        record(&[("op", &[CONNECTION]), ("conn", &number.to_le_bytes()), ("topic", b"/tf")], &data)
    }

    fn message(number: u32, second: u32) -> Vec<u8> {
        let time = [second.to_le_bytes(), 500_u32.to_le_bytes()].concat();
        record(&[("op", &[MESSAGE]), ("conn", &number.to_le_bytes()), ("time", &time)], &[7; 40])
    }

    fn chunk(compression: &str, records: &[u8], size: usize) -> Vec<u8> {
        let data = match compression {
            "lz4" => {
                let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
                encoder.write_all(records).expect("compressed");
                encoder.finish().expect("compressed")
            }
            "bz2" => {
                let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
                encoder.write_all(records).expect("compressed");
                encoder.finish().expect("compressed")
            }
            _ => records.to_vec(),
        };
        let size = (size as u32).to_le_bytes();
        record(&[("compression", compression.as_bytes()), ("op", &[CHUNK]), ("size", &size)], &data)
    }

    /// Times of the messages of a file with these bytes, and what was lost.
    fn read(bytes: &[u8], limit_bytes: u64) -> Result<(Vec<u64>, String), RosBagError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.bag");
        std::fs::write(&path, bytes).expect("written");
        assert!(is_ros1(&path));
        let (mut times_ns, mut losses) = (Vec::new(), Losses::default());
        let each = |channel: &Channel, time_ns: u64, bytes: &[u8]| {
            assert_eq!((&channel.type_name[..], bytes), ("tf2_msgs/msg/TFMessage", &[7; 40][..]));
            times_ns.push(time_ns);
            Ok(())
        };
        visit(&path, limit_bytes, each, &mut losses)?;
        Ok((times_ns, losses.lines().join("\n")))
    }

    /// The header that a recorder writes first and fills when it is done, with its padding.
    fn head() -> Vec<u8> {
        let header = [("op", &[3_u8][..]), ("index_pos", &[0; 8]), ("conn_count", &[0; 4]), ("chunk_count", &[0; 4])];
        [MAGIC, &record(&header, &[b' '; 4000])].concat()
    }

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn chunks_of_every_compression_are_read_and_what_is_cut_off_up_to_there() {
        let mut bytes = head();
        for (second, compression) in [(3, "none"), (5, "lz4"), (7, "bz2")] {
            let inside = [connection(1, 9), message(1, second), message(1, second + 1)].concat();
            bytes.extend(chunk(compression, &inside, inside.len()));
            bytes.extend(record(&[("op", &[4]), ("conn", &[0; 4])], &[0; 24]));
        }
        let (times_ns, lost) = read(&bytes, u64::MAX).expect("read");
        let expected: Vec<u64> = (3..9).map(|second| second * SECOND_NS + 500).collect();
        assert_eq!((&times_ns, &lost[..]), (&expected, ""));
        for length in MAGIC.len()..bytes.len() {
            let (times_ns, lost) = read(&bytes[..length], u64::MAX).expect("read");
            assert!(expected.starts_with(&times_ns), "{length}");
            // A cut between two records is none that shows.
            assert!(!lost.is_empty() || length > 4000, "{length}");
            assert!(lost.is_empty() || lost.contains("everything before was read"), "{length}: {lost}");
        }
    }

    #[test]
    fn lengths_that_lie_lose_their_record_and_cost_no_memory() {
        let lost = |parts: &[Vec<u8>]| read(&[head(), parts.concat()].concat(), u64::MAX).expect("read").1;
        assert!(lost(&[u32::MAX.to_le_bytes().to_vec(), vec![1; 40]]).contains("the file is cut off"));
        assert!(lost(&[chunk("none", &[], u32::MAX as usize)]).contains("more than 256 MiB"));
        assert!(lost(&[chunk("none", &[0; 9], 8)]).contains("9 bytes instead of 8"));
        assert!(lost(&[chunk("xz", &[0; 9], 9)]).contains("compression \"xz\" is not known; zstd, lz4 and bz2 are"));
        assert!(lost(&[chunk("none", &[255; 9], 9)]).contains("the last 9 bytes of a chunk are no record"));
        let mut bad = chunk("bz2", &connection(1, 9), connection(1, 9).len());
        let middle = bad.len() - 30;
        bad[middle] ^= 0x55;
        assert!(lost(&[bad, connection(1, 9)]).contains("is damaged and was left out"));
        assert!(lost(&[message(9, 1)]).contains("a message of connection 9, which was not declared"));
        assert!(lost(&[record(&[("op", &[MESSAGE])], &[])]).contains("without the number of its connection"));
        assert!(lost(&[record(&[("po", &[MESSAGE])], &[])]).contains("a header without an op"));
        let untimed = record(&[("op", &[MESSAGE]), ("conn", &[1, 0, 0, 0]), ("time", &[1; 4])], &[]);
        assert!(lost(&[connection(1, 0), untimed]).contains("a message without a time"));
        let untyped = record(&[("op", &[CONNECTION]), ("conn", &[1]), ("topic", b"/a")], &[]);
        assert!(lost(&[untyped]).contains("connection 1 has no type"));
        let refused = read(b"#ROSBAG V1.2\n", u64::MAX).expect_err("refused").to_string();
        assert!(refused.contains("format \"1.2\"") && refused.contains("rosbag fix"), "{refused}");
    }

    #[test]
    fn what_becomes_too_large_is_refused_and_declarations_are_bounded() {
        let inside = record(&[("op", &[9])], &[0; 1000]);
        let bytes = [head(), chunk("lz4", &inside, inside.len()), chunk("bz2", &inside, inside.len())].concat();
        assert!(read(&bytes, 3000).is_ok());
        assert!(matches!(read(&bytes, 1500), Err(RosBagError::TooLarge { .. })));
        let many: Vec<u8> = (0..70).flat_map(|number| connection(number, 1 << 20)).collect();
        assert!(read(&[head(), many].concat(), u64::MAX).expect("read").1.contains("connections of more than 64 MiB"));
        let again: Vec<u8> = (0..70).flat_map(|_| connection(1, 1 << 20)).collect();
        assert_eq!(read(&[head(), again].concat(), u64::MAX).expect("read").1, "");
    }
}

//! Messages of one MCAP file, from its start to its end, with or without an index.
//!
//! A record is an opcode, a length and so many bytes; chunks hold records, compressed. One chunk is in memory
//! at a time, and no length is believed before the bytes are there. A damaged chunk is left out, of one that
//! is cut off everything before the cut is read. Reference: MCAP specification 1.0, <https://mcap.dev/spec>.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use ruzstd::decoding::StreamingDecoder;

use crate::decompress::decompress;
use crate::definition::ros2_name;
use crate::error::RosBagError;
use crate::mcap_records::{MAGIC, op};
use crate::record_fields::Fields;
use crate::resync::next_chunk;
use crate::settings::{MAX_BREAKS, MAX_CHUNK_BYTES, MAX_DECLARED_BYTES, MAX_REPORTED};

/// A topic as a file declares it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) message_encoding: String,
    pub(crate) schema_encoding: String,
    pub(crate) definition: String,
}

impl Channel {
    /// Whether the file says how its messages are to be read, in a language that is read here.
    pub(crate) fn is_defined(&self) -> bool {
        ["ros2msg", "ros1msg"].contains(&&self.schema_encoding[..]) && !self.definition.trim().is_empty()
    }

    /// Of its texts.
    pub(crate) fn bytes(&self) -> usize {
        let Self { topic, type_name, message_encoding, schema_encoding, definition } = self;
        [topic, type_name, message_encoding, schema_encoding, definition].iter().map(|text| text.len()).sum()
    }
}

/// What could not be read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Losses {
    reported: Vec<String>,
    count: usize,
}

impl Losses {
    pub(crate) fn add(&mut self, loss: String) {
        self.count += 1;
        if self.reported.len() < MAX_REPORTED {
            self.reported.push(loss);
        }
    }

    /// One line a loss; of many the first.
    pub(crate) fn lines(&self) -> Vec<String> {
        let more = self.count - self.reported.len();
        let rest = (more > 0).then(|| format!("{more} more places of the bag could not be read"));
        self.reported.iter().cloned().chain(rest).collect()
    }
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
    let file = BufReader::new(File::open(path).map_err(io)?);
    let is_compressed = path.extension().is_some_and(|extension| extension == "zstd");
    let mut reader: Box<dyn Read> = if is_compressed {
        let decoder = StreamingDecoder::new(file);
        Box::new(decoder.map_err(|error| no_bag(path, format!("no zstd: {error}")))?.take(limit_bytes))
    } else {
        Box::new(file)
    };
    let mut magic = Vec::new();
    reader.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(io)?;
    match &magic[..] {
        magic if *magic == *MAGIC => {}
        [] => return Err(no_bag(path, "an empty file".to_owned())),
        magic if b"SQLite format 3".starts_with(magic) => {
            return Err(no_bag(path, "a bag in SQLite that is compressed as a whole; `zstd -d` it first".to_owned()));
        }
        magic if b"#ROSBAG V2.0".starts_with(magic) => {
            let why = "a bag of ROS 1 that is cut off, or compressed as a whole; then `zstd -d` it first";
            return Err(no_bag(path, why.to_owned()));
        }
        _ => return Err(no_bag(path, "no MCAP file by its first bytes".to_owned())),
    }
    let mut reading = Reading {
        path,
        at: magic.len() as u64,
        schemas: BTreeMap::new(),
        channels: BTreeMap::new(),
        declared_bytes: 0,
        expanded_bytes: 0,
        limit_bytes,
        visit,
        losses,
    };
    let mut breaks = 0;
    while let Some(Break { at, why }) = reading.file(&mut *reader)? {
        if is_compressed && reading.at >= limit_bytes {
            return Err(expands_beyond(path, limit_bytes));
        }
        breaks += 1;
        if breaks > MAX_BREAKS {
            reading.lose(at, &format!("{why}; it is the {breaks}th such place, and the rest was left out"));
            break;
        }
        // Nothing can be sought in what is compressed as a whole.
        let next = if is_compressed { None } else { next_chunk(path, at + 1).map_err(io)? };
        let Some((next, behind)) = next else {
            reading.lose(at, &format!("{why}; everything before was read"));
            break;
        };
        reading.lose(at, &format!("{why}; {} bytes are lost, up to the next chunk at byte {next}", next - at));
        reading.at = next;
        reader = Box::new(behind);
    }
    Ok(())
}

/// Where records no longer follow each other.
struct Break {
    at: u64,
    why: String,
}

fn no_bag(path: &Path, why: String) -> RosBagError {
    RosBagError::NoBag { path: path.to_owned(), why }
}

/// A file that becomes too large by decompression.
pub(crate) fn expands_beyond(file: &Path, limit_bytes: u64) -> RosBagError {
    RosBagError::TooLarge { file: file.to_owned(), limit_bytes }
}

/// What a schema record says: name, encoding, text.
struct Schema {
    name: String,
    encoding: String,
    text: String,
}

impl Schema {
    const fn bytes(&self) -> usize {
        self.name.len() + self.encoding.len() + self.text.len()
    }
}

struct Reading<'a, V> {
    path: &'a Path,
    /// Byte of the file.
    at: u64,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// Of schemas and channels.
    declared_bytes: usize,
    /// Of chunks.
    expanded_bytes: u64,
    /// Of what may come by decompression.
    limit_bytes: u64,
    visit: V,
    losses: &'a mut Losses,
}

impl<V: FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>> Reading<'_, V> {
    /// Records up to the end of the data, or to where they no longer follow each other.
    fn file(&mut self, reader: &mut dyn Read) -> Result<Option<Break>, RosBagError> {
        let mut body = Vec::new();
        loop {
            let at = self.at;
            let broken = |why: String| Ok(Some(Break { at, why }));
            let mut head = Vec::new();
            self.read(reader, 9, &mut head);
            let Some((opcode, length)) = opcode_and_length(&head) else {
                let why = if head.is_empty() { "the recording was not closed" } else { "the file is cut off" };
                return broken(why.to_owned());
            };
            if opcode == op::DATA_END || opcode == op::FOOTER {
                return Ok(None);
            }
            if opcode == 0 {
                return broken("no record, but zeros".to_owned());
            }
            let is_read = [op::SCHEMA, op::CHANNEL, op::MESSAGE, op::CHUNK].contains(&opcode);
            if !is_read || length > MAX_CHUNK_BYTES {
                let skipped = std::io::copy(&mut reader.take(length), &mut std::io::sink()).unwrap_or(0);
                self.at += skipped;
                if skipped < length {
                    return broken(format!("the file is cut off: a record of {length} bytes goes beyond its end"));
                }
                if is_read {
                    let most = MAX_CHUNK_BYTES >> 20;
                    self.lose(at, &format!("a record of {length} bytes, more than {most} MiB, was left out"));
                }
                continue;
            }
            body.clear();
            self.read(reader, length, &mut body);
            let is_cut = (body.len() as u64) < length;
            if opcode == op::CHUNK {
                self.chunk(at, &body, is_cut)?;
            } else if !is_cut && let Err(why) = self.record(opcode, &body)? {
                self.lose(at, &why);
            }
            if is_cut {
                return broken(format!("the file is cut off: {} of {length} bytes of a record are there", body.len()));
            }
        }
    }

    /// Reads up to `count` bytes; a fault of the file is its end.
    fn read(&mut self, reader: &mut dyn Read, count: u64, into: &mut Vec<u8>) {
        // What was read before a fault stays in `into`.
        let _ = reader.take(count).read_to_end(into);
        self.at += into.len() as u64;
    }

    fn lose(&mut self, at: u64, why: &str) {
        self.losses.add(format!("{}: byte {at}: {why}", self.path.display()));
    }

    /// Records of a chunk; of one that is cut off, those before the cut.
    fn chunk(&mut self, start: u64, body: &[u8], is_cut: bool) -> Result<(), RosBagError> {
        let Some(ChunkBody { size, crc, compression, records }) = ChunkBody::parse(body, is_cut) else {
            self.lose(start, &format!("a chunk's header is damaged; its {} bytes were left out", body.len()));
            return Ok(());
        };
        if size > MAX_CHUNK_BYTES {
            self.lose(
                start,
                &format!("a chunk of {size} bytes, more than {} MiB, was left out", MAX_CHUNK_BYTES >> 20),
            );
            return Ok(());
        }
        if is_cut && body.ends_with(MAGIC) {
            // The file's end is there: bytes are missing or wrong inside, and no checksum tells which.
            self.lose(start, "a chunk is longer than the rest of the file; it is damaged and was left out");
            return Ok(());
        }
        let whole = decompress(compression, records);
        self.expanded_bytes += whole.bytes.len() as u64;
        if self.expanded_bytes > self.limit_bytes {
            return Err(expands_beyond(self.path, self.limit_bytes));
        }
        if !is_cut {
            let why = match whole.fault {
                Some(fault) => Some(fault),
                None if whole.bytes.len() as u64 != size => {
                    Some(format!("{} bytes instead of {size}", whole.bytes.len()))
                }
                None if crc != 0 && crc32fast::hash(&whole.bytes) != crc => Some("its checksum differs".to_owned()),
                None => None,
            };
            if let Some(why) = why {
                self.lose(start, &format!("a chunk of {} bytes is damaged and was left out: {why}", body.len()));
                return Ok(());
            }
        }
        let mut rest = &whole.bytes[..];
        while !rest.is_empty() {
            let record = opcode_and_length(rest).and_then(|(opcode, length)| {
                let end = usize::try_from(length).ok()?.checked_add(9)?;
                Some((opcode, rest.get(9..end)?, rest.get(end..)?))
            });
            let Some((opcode, body, behind)) = record else {
                if !is_cut {
                    self.lose(start, &format!("the last {} bytes of a chunk are no record", rest.len()));
                }
                return Ok(());
            };
            if let Err(why) = self.record(opcode, body)? {
                self.lose(start, &why);
            }
            rest = behind;
        }
        Ok(())
    }

    /// Counts the bytes of a schema or a channel in place of those that it replaces, as writers repeat them
    /// in every chunk; an error where there is no room for it.
    fn make_room(&mut self, bytes: usize, replaced_bytes: usize) -> Result<(), String> {
        let declared_bytes = self.declared_bytes.saturating_sub(replaced_bytes) + bytes;
        if declared_bytes > MAX_DECLARED_BYTES {
            let most = MAX_DECLARED_BYTES >> 20;
            return Err(format!("schemas and channels of more than {most} MiB; one was left out"));
        }
        self.declared_bytes = declared_bytes;
        Ok(())
    }

    /// One record that is no chunk; the inner error is a fault of its bytes.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<Result<(), String>, RosBagError> {
        match opcode {
            op::SCHEMA => Ok(self.schema(Fields(body))),
            op::CHANNEL => Ok(self.channel(Fields(body))),
            op::MESSAGE => {
                let mut fields = Fields(body);
                let head = (|| {
                    let id = fields.u16()?;
                    // Its number in the sequence.
                    fields.skip(4)?;
                    let log_time_ns = fields.u64()?;
                    // The time of publication.
                    fields.skip(8)?;
                    let undeclared = || format!("a message of channel {id}, which was not declared");
                    Ok((self.channels.get(&id).ok_or_else(undeclared)?, log_time_ns))
                })();
                match head {
                    Ok((channel, log_time_ns)) => (self.visit)(channel, log_time_ns, fields.0).map(Ok),
                    Err(why) => Ok(Err(why)),
                }
            }
            _ => Ok(Ok(())),
        }
    }

    fn schema(&mut self, mut fields: Fields<'_>) -> Result<(), String> {
        let id = fields.u16()?;
        let (name, encoding) = (fields.text()?, fields.text()?);
        let schema = Schema { name, encoding, text: String::from_utf8_lossy(fields.bytes()?).into_owned() };
        self.make_room(schema.bytes(), self.schemas.get(&id).map_or(0, Schema::bytes))?;
        self.schemas.insert(id, schema);
        Ok(())
    }

    fn channel(&mut self, mut fields: Fields<'_>) -> Result<(), String> {
        let (id, schema) = (fields.u16()?, fields.u16()?);
        let (topic, message_encoding) = (fields.text()?, fields.text()?);
        let schema = self.schemas.get(&schema);
        let of = |field: fn(&Schema) -> &String| schema.map(field).cloned().unwrap_or_default();
        let (type_name, schema_encoding) = (of(|schema| &schema.name), of(|schema| &schema.encoding));
        let declared = Channel {
            topic,
            message_encoding,
            type_name: if schema_encoding == "ros1msg" { ros2_name(&type_name) } else { type_name },
            schema_encoding,
            definition: of(|schema| &schema.text),
        };
        self.make_room(declared.bytes(), self.channels.get(&id).map_or(0, Channel::bytes))?;
        self.channels.insert(id, declared);
        Ok(())
    }
}

fn opcode_and_length(head: &[u8]) -> Option<(u8, u64)> {
    let (&opcode, rest) = head.split_first()?;
    Some((opcode, u64::from_le_bytes(*rest.first_chunk()?)))
}

/// A chunk's record, by hand: of one that is cut off too.
struct ChunkBody<'a> {
    /// Length of the records, uncompressed.
    size: u64,
    crc: u32,
    compression: &'a str,
    records: &'a [u8],
}

impl<'a> ChunkBody<'a> {
    fn parse(body: &'a [u8], is_cut: bool) -> Option<Self> {
        // The times of its first and last message.
        let rest = body.get(16..)?;
        let (size, rest) = rest.split_first_chunk::<8>()?;
        let (crc, rest) = rest.split_first_chunk::<4>()?;
        let (name_length, rest) = rest.split_first_chunk::<4>()?;
        let (name, rest) = rest.split_at_checked(u32::from_le_bytes(*name_length) as usize)?;
        let (length, rest) = rest.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let records = if is_cut { rest } else { rest.get(..length)? };
        Some(Self {
            size: u64::from_le_bytes(*size),
            crc: u32::from_le_bytes(*crc),
            compression: std::str::from_utf8(name).ok()?,
            records,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
    }

    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
    }

    /// A schema whose definition has so many bytes.
    fn schema(id: u16, bytes: usize) -> Vec<u8> {
        let definition = text(&"#".repeat(bytes));
        record(op::SCHEMA, &[&id.to_le_bytes()[..], &text("a/B"), &text("ros2msg"), &definition].concat())
    }

    fn channel(id: u16, schema: u16) -> Vec<u8> {
        let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        record(op::CHANNEL, &[ids, text(&format!("/{id}")), text("cdr"), text("")].concat())
    }

    /// A chunk that is not compressed, and says so many bytes of itself.
    fn chunk(records: &[u8], size: u64) -> Vec<u8> {
        let head = [&[0; 16][..], &size.to_le_bytes(), &[0; 4], &text(""), &(records.len() as u64).to_le_bytes()];
        record(op::CHUNK, &[&head.concat(), records].concat())
    }

    /// What is told of a file with these records behind the magic bytes.
    fn read(records: &[Vec<u8>], name: &str, limit_bytes: u64) -> Result<Vec<String>, RosBagError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        let bytes = [MAGIC, &records.concat()].concat();
        let bytes = match name.ends_with("zstd") {
            true => ruzstd::encoding::compress_to_vec(&bytes[..], ruzstd::encoding::CompressionLevel::Fastest),
            false => bytes,
        };
        std::fs::write(&path, bytes).expect("written");
        let mut losses = Losses::default();
        visit(&path, limit_bytes, |_, _, _| Ok(()), &mut losses).map(|()| losses.lines())
    }

    const END: [u8; 9] = [op::DATA_END, 0, 0, 0, 0, 0, 0, 0, 0];

    #[test]
    fn a_schema_that_thousands_of_channels_repeat_is_held_a_bounded_number_of_times() {
        let mut records = vec![schema(1, 1 << 20)];
        records.extend((0..200).map(|id| channel(id, 1)));
        records.push(END.to_vec());
        let reported = read(&records, "a.mcap", u64::MAX).expect("read").join("\n");
        assert!(reported.contains("schemas and channels of more than 64 MiB"), "{reported}");
        // One that is declared again takes the place of the first.
        let again: Vec<Vec<u8>> = (0..100).map(|_| schema(1, 1 << 20)).chain([END.to_vec()]).collect();
        assert_eq!(read(&again, "a.mcap", u64::MAX).expect("read"), Vec::<String>::new());
    }

    #[test]
    fn what_becomes_too_large_by_decompression_is_refused() {
        let skipped = record(0x80, &[7; 50_000]);
        let records = [skipped.clone(), skipped, END.to_vec()];
        assert!(read(&records, "a.mcap.zstd", 200_000).is_ok());
        let refused = read(&records, "a.mcap.zstd", 60_000).expect_err("too large");
        assert!(refused.to_string().contains("when decompressed"), "{refused}");
        let inner = record(0x80, &[7; 1000]);
        let chunks = [chunk(&inner, inner.len() as u64), chunk(&inner, inner.len() as u64), END.to_vec()];
        assert!(read(&chunks, "a.mcap", 3000).is_ok());
        assert!(matches!(read(&chunks, "a.mcap", 2000), Err(RosBagError::TooLarge { .. })));
    }

    #[test]
    fn lengths_that_lie_lose_their_record_and_cost_no_memory() {
        let reported = |records: &[Vec<u8>]| read(records, "a.mcap", u64::MAX).expect("read").join("\n");
        assert!(reported(&[chunk(&[], u64::MAX), END.to_vec()]).contains("more than 256 MiB"));
        assert!(reported(&[chunk(&[1, 2], 3), END.to_vec()]).contains("2 bytes instead of 3"));
        let endless = [&[op::MESSAGE][..], &u64::MAX.to_le_bytes(), &[0; 20]].concat();
        assert!(reported(&[endless]).contains("goes beyond its end"));
    }

    #[test]
    fn a_file_that_breaks_off_again_and_again_is_left() {
        // At each break the rest of the file is read: without a limit, a minute for a megabyte.
        let endless = [&[op::MESSAGE][..], &u64::MAX.to_le_bytes()].concat();
        let records: Vec<Vec<u8>> = (0..1000).flat_map(|_| [chunk(&[], 0), endless.clone()]).collect();
        let reported = read(&records, "a.mcap", u64::MAX).expect("read");
        assert_eq!(reported.len(), MAX_REPORTED + 1);
        assert!(reported[MAX_REPORTED].starts_with("96 more places"), "{reported:?}");
    }
}

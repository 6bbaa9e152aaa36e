//! Messages in CDR, walked by their definition.
//!
//! Four bytes say the representation, then every primitive stands at a multiple of its size, counted from
//! behind these four. A sequence is its length as uint32 and its elements, a string its length with the final
//! NUL and its bytes. Reference: OMG DDS-XTypes 1.3, 7.4.1 (XCDR version 1, PLAIN_CDR) and 7.6.3.1.2.
//!
//! ROS 1 has neither the four bytes nor places: values stand one behind the other, the lowest byte first, a
//! string has no NUL, and a type without fields no byte. Reference: <http://wiki.ros.org/msg>.

use crate::definition::{Arity, Definitions, Field, Kind, Wire};
use crate::settings::{MAX_DEPTH, MAX_MESSAGE_BYTES, MAX_VALUES};
use crate::value::Value;

/// Decodes one message. An error says at which byte what was expected.
pub(crate) fn decode(definitions: &Definitions, message: &[u8]) -> Result<Value, String> {
    if message.len() > MAX_MESSAGE_BYTES {
        return Err(format!("{} bytes; wheels and poses take at most {MAX_MESSAGE_BYTES}", message.len()));
    }
    if definitions.wire == Wire::Ros1 {
        let whole = Walker { payload: message, before: 0, at: 0, values: 0, is_little_endian: true, definitions };
        return whole.whole();
    }
    let Some((&[_, representation, _, _], payload)) = message.split_first_chunk::<4>() else {
        return Err(format!("{} bytes, too short for CDR", message.len()));
    };
    let is_little_endian = match (message[0], representation) {
        (0, 0) => false,
        (0, 1) => true,
        (high, low) => {
            return Err(format!("encapsulation 0x{high:02x}{low:02x} is not read; only plain CDR (0x0000, 0x0001) is"));
        }
    };
    Walker { payload, before: 4, at: 0, values: 0, is_little_endian, definitions }.whole()
}

struct Walker<'a> {
    payload: &'a [u8],
    /// Bytes of the message before the payload.
    before: usize,
    at: usize,
    /// Decoded so far.
    values: usize,
    is_little_endian: bool,
    definitions: &'a Definitions,
}

impl<'a> Walker<'a> {
    fn whole(mut self) -> Result<Value, String> {
        self.message(&self.definitions.root, 0)
    }

    const fn is_cdr(&self) -> bool {
        matches!(self.definitions.wire, Wire::Cdr)
    }

    fn message(&mut self, name: &str, depth: usize) -> Result<Value, String> {
        if depth > MAX_DEPTH {
            return Err(format!("types are nested more than {MAX_DEPTH} deep"));
        }
        let definitions = self.definitions;
        let fields: &[Field] = definitions.types.get(name).map_or(&[], Vec::as_slice);
        if fields.is_empty() && self.is_cdr() {
            // The generators put a byte into a type without fields.
            self.take(1)?;
        }
        let decoded = fields.iter().map(|field| {
            let value = self
                .field(field, depth)
                .map_err(|why| if why.starts_with("field ") { why } else { format!("field {}: {why}", field.name) })?;
            Ok((field.name.clone(), value))
        });
        decoded.collect::<Result<_, String>>().map(Value::Message)
    }

    fn field(&mut self, field: &Field, depth: usize) -> Result<Value, String> {
        let count = match field.arity {
            Arity::One => return self.element(&field.kind, depth),
            Arity::Array(count) => count,
            Arity::Sequence => self.length()?,
        };
        // Every element takes a byte at least.
        self.refuse_more_than_remains(count)?;
        (0..count).map(|_| self.element(&field.kind, depth)).collect::<Result<_, _>>().map(Value::List)
    }

    fn element(&mut self, kind: &Kind, depth: usize) -> Result<Value, String> {
        // Nested types may make many values of one byte.
        self.values += 1;
        if self.values > MAX_VALUES {
            return Err(format!("more than {MAX_VALUES} values in one message"));
        }
        Ok(match kind {
            Kind::Unsigned(bytes) => Value::Integer(self.unsigned(*bytes)?.into()),
            Kind::Signed(bytes) => {
                let unused = 64 - 8 * *bytes as u32;
                Value::Integer((((self.unsigned(*bytes)? << unused) as i64) >> unused).into())
            }
            Kind::Float32 => Value::Float(f32::from_bits(self.unsigned(4)? as u32).into()),
            Kind::Float64 => Value::Float(f64::from_bits(self.unsigned(8)?)),
            Kind::Text => {
                let length = self.length()?;
                self.refuse_more_than_remains(length)?;
                let bytes = self.take(length)?;
                let bytes = bytes.strip_suffix(&[0]).filter(|_| self.is_cdr()).unwrap_or(bytes);
                Value::Text(String::from_utf8_lossy(bytes).into_owned())
            }
            Kind::Nested(name) => self.message(name, depth + 1)?,
        })
    }

    fn length(&mut self) -> Result<usize, String> {
        self.unsigned(4).map(|length| length as usize)
    }

    fn refuse_more_than_remains(&self, count: usize) -> Result<(), String> {
        let remaining = self.payload.len() - self.at;
        if count <= remaining {
            return Ok(());
        }
        Err(format!("byte {}: a length of {count}, but {remaining} bytes are left", self.at + self.before))
    }

    /// An integer of 1, 2, 4 or 8 bytes, at a multiple of its size.
    fn unsigned(&mut self, size: usize) -> Result<u64, String> {
        let padding = if self.is_cdr() { self.at.wrapping_neg() % size } else { 0 };
        self.take(padding)?;
        let is_little_endian = self.is_little_endian;
        let bytes = self.take(size)?.iter();
        let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        Ok(if is_little_endian { bytes.rev().fold(0, join) } else { bytes.fold(0, join) })
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let ended = || format!("byte {}: the message ends, {count} bytes more were expected", self.at + self.before);
        let taken = self.payload.get(self.at..self.at + count).ok_or_else(ended)?;
        self.at += count;
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn definitions(text: &str) -> Definitions {
        Definitions::parse("t/msg/T", text).expect("a definition")
    }

    #[test]
    fn primitives_stand_at_multiples_of_their_sizes_in_both_byte_orders() {
        let of = definitions("uint8 a\nint32 b\nuint8 c\nfloat64 d\nint16 e\nfloat32 f\n");
        let little = [
            &[0, 1, 0, 0, 7, 0, 0, 0][..],
            &(-5_i32).to_le_bytes(),
            &[9, 0, 0, 0, 0, 0, 0, 0],
            &1.25_f64.to_le_bytes(),
            &(-2_i16).to_le_bytes(),
            &[0, 0],
            &0.5_f32.to_le_bytes(),
        ]
        .concat();
        let big = [
            &[0, 0, 0, 0, 7, 0, 0, 0][..],
            &(-5_i32).to_be_bytes(),
            &[9, 0, 0, 0, 0, 0, 0, 0],
            &1.25_f64.to_be_bytes(),
            &(-2_i16).to_be_bytes(),
            &[0, 0],
            &0.5_f32.to_be_bytes(),
        ]
        .concat();
        for message in [little, big] {
            let found = decode(&of, &message).expect("decoded");
            assert_eq!(["a", "b", "c", "e"].map(|path| found.integer(path)), [Some(7), Some(-5), Some(9), Some(-2)]);
            assert_eq!([found.number("d"), found.number("f")], [Some(1.25), Some(0.5)]);
        }
    }

    #[test]
    fn a_message_of_the_limit_is_decoded_and_a_longer_one_refused() {
        let of = definitions("uint8[] q\n");
        let mut message = vec![0; MAX_MESSAGE_BYTES];
        message[1] = 1;
        assert!(decode(&of, &message).is_ok());
        message.push(0);
        assert!(decode(&of, &message).expect_err("refused").contains("wheels and poses take at most 4194304"));
    }

    #[test]
    fn strings_sequences_arrays_and_nested_types_follow_each_other() {
        let of = definitions(
            "string s\nuint16[] q\nI[2] p\nfloat64[<=3] none\nuint8 last\n===\nMSG: t/I\nuint8 x\nuint32 y\n",
        );
        let message = [
            &[0, 1, 0, 0][..],
            &[3, 0, 0, 0, b'a', b'b', 0], // s: to byte 7
            &[0, 2, 0, 0, 0, 1, 0, 2, 0], // q: at 8, to 16
            &[5, 0, 0, 0, 6, 0, 0, 0],    // p[0]
            &[7, 0, 0, 0, 8, 0, 0, 0],    // p[1]
            &[0, 0, 0, 0],                // an empty sequence is not aligned to its elements
            &[42],
        ]
        .concat();
        let found = decode(&of, &message).expect("decoded");
        assert_eq!(found.text("s"), Some("ab"));
        assert_eq!(found.list("q"), [Value::Integer(1), Value::Integer(2)]);
        assert_eq!(
            [found.integer("p[0].y"), found.integer("p[1].x"), found.integer("last")],
            [Some(6), Some(7), Some(42)]
        );
    }

    #[test]
    fn lengths_that_lie_are_refused_before_anything_is_allocated() {
        let huge = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 2];
        for text in ["string s\n", "float64[] s\n", "uint8[] s\n", "E[] s\n===\nMSG: t/E\n"] {
            let why = decode(&definitions(text), &huge).expect_err(text);
            assert!(why.contains("field s: byte 8: a length of 4294967295, but 2 bytes are left"), "{why}");
        }
        let why = decode(&definitions("uint8[1000000000000] s\n"), &huge).expect_err("too long");
        assert!(why.contains("a length of 1000000000000"), "{why}");
        let why = decode(&definitions("float64 s\n"), &huge).expect_err("cut off");
        assert!(why.contains("the message ends"), "{why}");
        assert!(decode(&definitions("uint8 s\n"), &[0, 1]).is_err());
        assert!(decode(&definitions("uint8 s\n"), &[0, 3, 0, 0, 1]).expect_err("PL_CDR").contains("0x0003"));
    }

    #[test]
    fn in_ros_1_values_stand_one_behind_the_other() {
        let text = "Header header\nuint8 a\nfloat64 d\nE none\nstring s\nint16[] q\ntime[1] t\nduration u\n===\nMSG: t/E\n\
                    ===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
        let of = Definitions { wire: Wire::Ros1, ..definitions(text) };
        let message = [
            &[9, 0, 0, 0, 7, 0, 0, 0, 8, 0, 0, 0, 1, 0, 0, 0, b'f'][..],
            &[5],
            &1.25_f64.to_le_bytes(),
            &[2, 0, 0, 0, b'a', 0],
            &[2, 0, 0, 0, 1, 0, 0xfe, 0xff],
            &[3, 0, 0, 0, 4, 0, 0, 0],
            &[0xff, 0xff, 0xff, 0xff, 6, 0, 0, 0],
        ]
        .concat();
        let found = decode(&of, &message).expect("decoded");
        assert_eq!(["header.frame_id", "s"].map(|path| found.text(path)), [Some("f"), Some("a\0")]);
        let integers = ["header.seq", "header.stamp.sec", "header.stamp.nanosec", "a", "q[1]", "t[0].sec", "u.sec"];
        assert_eq!(integers.map(|path| found.integer(path)), [9, 7, 8, 5, -2, 3, -1].map(Some));
        assert_eq!(found.number("d"), Some(1.25));
        for length in 0..message.len() {
            let why = decode(&of, &message[..length]).expect_err("cut off");
            assert!(why.contains("the message ends") || why.contains("bytes are left"), "{length}: {why}");
        }
    }

    #[test]
    fn nested_types_that_multiply_values_are_refused() {
        // Thirty types, each around the next, make thirty values of a byte.
        let chain: String =
            (0..30).map(|level| format!("===\nMSG: t/L{level}\nL{} next\n", level + 1)).collect::<Vec<_>>().concat();
        let of = definitions(&format!("L0[40000] all\n{chain}===\nMSG: t/L30\nuint8 x\n"));
        let message = [&[0, 1, 0, 0][..], &[7; 40_000]].concat();
        let why = decode(&of, &message).expect_err("1.2 million values");
        assert!(why.contains("more than 1048576 values"), "{why}");
    }

    #[test]
    fn a_type_that_holds_itself_ends() {
        let why = decode(&definitions("T t\n"), &[0, 1, 0, 0, 0, 0, 0, 0]).expect_err("endless");
        assert!(why.contains("nested more than 32 deep"), "{why}");
    }
}

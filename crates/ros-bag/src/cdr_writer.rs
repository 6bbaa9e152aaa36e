//! Messages into CDR: the inverse of `cdr`, little-endian.
//!
//! Four bytes say the representation, then every primitive stands at a multiple of its size, counted from
//! behind these four. Reference: OMG DDS-XTypes 1.3, 7.4.1 (XCDR version 1, PLAIN_CDR).

/// Bytes of the representation: plain CDR, little-endian.
const REPRESENTATION: [u8; 4] = [0, 1, 0, 0];

/// A message that grows field by field, in the order of its definition.
#[derive(Debug)]
pub(crate) struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    pub(crate) fn new() -> Self {
        Self { bytes: REPRESENTATION.to_vec() }
    }

    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    fn align(&mut self, size: usize) {
        let payload = self.bytes.len() - REPRESENTATION.len();
        self.bytes.resize(REPRESENTATION.len() + payload.next_multiple_of(size), 0);
    }

    pub(crate) fn int32(&mut self, value: i32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn uint32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn float64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// The length of a sequence, whose elements follow. No log has as many rows as `u32` counts.
    pub(crate) fn length(&mut self, length: usize) {
        self.uint32(u32::try_from(length).unwrap_or(u32::MAX));
    }

    pub(crate) fn float64s(&mut self, values: &[f64]) {
        self.length(values.len());
        values.iter().for_each(|value| self.float64(*value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::decode;
    use crate::definition::Definitions;

    #[test]
    fn what_is_written_is_what_is_read() {
        let definitions = Definitions::parse("t/msg/T", "string a\nint32 b\nfloat64[] c\nuint32 d\n").expect("fields");
        let mut writer = CdrWriter::new();
        writer.text("abc");
        writer.int32(-7);
        writer.float64s(&[1.5, -2.0]);
        writer.uint32(9);
        let bytes = writer.into_bytes();
        // Four of the representation, 4 + 4 of the text, 4, 4 of the length, two doubles, 4; 8 + 4 + 4 is a
        // multiple of 8 already.
        assert_eq!(bytes.len(), 4 + 8 + 4 + 4 + 16 + 4);
        let value = decode(&definitions, &bytes).expect("a message");
        assert_eq!((value.text("a"), value.integer("b"), value.integer("d")), (Some("abc"), Some(-7), Some(9)));
        assert_eq!((value.number("c[0]"), value.number("c[1]")), (Some(1.5), Some(-2.0)));
    }
}

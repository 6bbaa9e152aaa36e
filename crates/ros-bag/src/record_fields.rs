//! The fields of an MCAP record, from its front. A length is believed once so many bytes are there.

/// What is left of a record.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self
            .0
            .split_at_checked(count)
            .ok_or_else(|| format!("a record is damaged: {count} bytes expected, {} left", self.0.len()))?;
        self.0 = rest;
        Ok(taken)
    }

    /// An unsigned number of `N` bytes, at most 8.
    fn number<const N: usize>(&mut self) -> Result<u64, String> {
        Ok(self.take(N)?.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
    }

    pub(crate) fn u16(&mut self) -> Result<u16, String> {
        Ok(self.number::<2>()? as u16)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, String> {
        self.number::<8>()
    }

    pub(crate) fn skip(&mut self, count: usize) -> Result<(), String> {
        self.take(count).map(drop)
    }

    /// Bytes behind their length of 32 bits.
    pub(crate) fn bytes(&mut self) -> Result<&'a [u8], String> {
        let length = self.number::<4>()?;
        self.take(usize::try_from(length).map_err(|error| error.to_string())?)
    }

    /// A text behind its length of 32 bits.
    pub(crate) fn text(&mut self) -> Result<String, String> {
        let text = std::str::from_utf8(self.bytes()?);
        text.map(str::to_owned).map_err(|_| "a record is damaged: a text is not UTF-8".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_from_the_front_and_a_length_that_lies_is_an_error() {
        let mut fields = Fields(&[1, 2, 2, 0, 0, 0, b'a', b'b', 9, 0, 0, 0, 0, 0, 0, 0, 7]);
        assert_eq!((fields.u16(), fields.text(), fields.u64()), (Ok(0x0201), Ok("ab".to_owned()), Ok(9)));
        assert_eq!(fields.0, [7]);
        assert!(Fields(&[0xff, 0xff, 0xff, 0xff, 1]).bytes().expect_err("lies").contains("4294967295 bytes expected"));
        assert!(Fields(&[1, 0, 0, 0, 0xff]).text().is_err());
    }
}

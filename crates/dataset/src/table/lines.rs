//! A text file line by line in bounded memory: what stands between every reader here and a gigabyte of
//! garbage.
//!
//! One buffer of fixed size; a line that does not fit is an error and is not collected first.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::error::DatasetError;
use crate::settings::{LINE_LIMIT_BYTES, SHORT_FILE_LINES};

/// Large enough that system calls and the moving of cut lines cost nothing beside parsing, small beside any
/// table.
const BUFFER_BYTES: usize = 4 * LINE_LIMIT_BYTES;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Opens a regular file: a folder or a pipe would be read in vain, or forever.
pub(crate) fn open(file: &Path, expected: &'static str) -> Result<File, DatasetError> {
    let io = |source| DatasetError::Io { path: file.to_owned(), source };
    let metadata = match file.metadata() {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(DatasetError::MissingFile { file: file.to_owned(), expected });
        }
        other => other.map_err(io)?,
    };
    if !metadata.is_file() {
        return Err(DatasetError::NotAFile { file: file.to_owned(), expected });
    }
    File::open(file).map_err(io)
}

/// One line without its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    pub(crate) bytes: &'a [u8],
    /// From 1.
    pub(crate) number: u64,
    /// Nothing follows, not even the end of the line.
    pub(crate) is_open_end: bool,
}

/// The lines of a file that are not empty.
#[derive(Debug)]
pub(crate) struct Lines {
    path: PathBuf,
    file: File,
    buffer: Box<[u8]>,
    /// What is left to be handed out: `buffer[start..end]`.
    start: usize,
    end: usize,
    at_end_of_file: bool,
    number: u64,
    /// How much of the file has been read into the buffer.
    read_bytes: u64,
}

/// A place between two lines of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Position {
    offset_bytes: u64,
    /// Of the line before.
    number: u64,
}

impl Lines {
    pub(crate) fn open(path: &Path, expected: &'static str) -> Result<Self, DatasetError> {
        let file = open(path, expected)?;
        let buffer = vec![0; BUFFER_BYTES].into_boxed_slice();
        let path = path.to_owned();
        Ok(Self { path, file, buffer, start: 0, end: 0, at_end_of_file: false, number: 0, read_bytes: 0 })
    }

    /// Before the line that comes next.
    pub(crate) const fn position(&self) -> Position {
        Position { offset_bytes: self.read_bytes - (self.end - self.start) as u64, number: self.number }
    }

    /// Goes to a place that [`Self::position`] gave; costs nothing where that is here.
    pub(crate) fn go_to(&mut self, position: Position) -> Result<(), DatasetError> {
        if position == self.position() {
            return Ok(());
        }
        let Position { offset_bytes, number } = position;
        self.file
            .seek(SeekFrom::Start(offset_bytes))
            .map_err(|source| DatasetError::Io { path: self.path.clone(), source })?;
        (self.start, self.end, self.at_end_of_file) = (0, 0, false);
        (self.number, self.read_bytes) = (number, offset_bytes);
        Ok(())
    }

    /// The next line that is not empty; `None` at the end of the file.
    pub(crate) fn advance(&mut self) -> Result<Option<Line<'_>>, DatasetError> {
        loop {
            let mut is_open_end = false;
            let (mut from, mut to) = match memchr::memchr(b'\n', &self.buffer[self.start..self.end]) {
                Some(length) => {
                    let span = (self.start, self.start + length);
                    self.start += length + 1;
                    span
                }
                None if !self.at_end_of_file => {
                    self.refill()?;
                    continue;
                }
                None if self.start < self.end => {
                    let span = (self.start, self.end);
                    is_open_end = true;
                    self.start = self.end;
                    span
                }
                None => return Ok(None),
            };
            self.number += 1;
            if to - from > LINE_LIMIT_BYTES {
                return Err(self.too_long(self.number));
            }
            if self.number == 1 && self.buffer[from..to].starts_with(BYTE_ORDER_MARK) {
                from += BYTE_ORDER_MARK.len();
            }
            if self.buffer[from..to].ends_with(b"\r") {
                to -= 1;
            }
            if from < to {
                return Ok(Some(Line { bytes: &self.buffer[from..to], number: self.number, is_open_end }));
            }
        }
    }

    /// Moves the cut line to the front and reads on behind it.
    fn refill(&mut self) -> Result<(), DatasetError> {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        if self.end > LINE_LIMIT_BYTES {
            return Err(self.too_long(self.number + 1));
        }
        let read = loop {
            match self.file.read(&mut self.buffer[self.end..]) {
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                other => break other.map_err(|source| DatasetError::Io { path: self.path.clone(), source })?,
            }
        };
        self.at_end_of_file = read == 0;
        self.end += read;
        self.read_bytes += read as u64;
        Ok(())
    }

    fn too_long(&self, line: u64) -> DatasetError {
        DatasetError::LineTooLong { file: self.path.clone(), line, limit_bytes: LINE_LIMIT_BYTES }
    }
}

/// All lines of a short text file with their numbers; at least one.
pub(crate) fn read_all(path: &Path, expected: &'static str) -> Result<Vec<(u64, String)>, DatasetError> {
    let mut lines = Lines::open(path, expected)?;
    let mut all = Vec::new();
    while let Some(Line { bytes, number, .. }) = lines.advance()? {
        let text =
            std::str::from_utf8(bytes).map_err(|_| DatasetError::NotUtf8 { file: path.to_owned(), line: number })?;
        if number > SHORT_FILE_LINES {
            let message = format!("more than {SHORT_FILE_LINES} lines; expected {expected}");
            return Err(DatasetError::Foreign { file: path.to_owned(), line: number, message });
        }
        all.push((number, text.to_owned()));
    }
    if all.is_empty() {
        return Err(DatasetError::EmptyFile { file: path.to_owned(), expected: expected.to_owned() });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines_of(content: &[u8]) -> Result<Vec<(u64, Vec<u8>)>, DatasetError> {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("lines");
        std::fs::write(&path, content).expect("written");
        let mut lines = Lines::open(&path, "lines")?;
        let mut all = Vec::new();
        for pass in 0..2 {
            all.clear();
            while let Some(line) = lines.advance()? {
                all.push((line.number, line.bytes.to_vec()));
            }
            if pass == 0 {
                lines.go_to(Position::default())?;
            }
        }
        Ok(all)
    }

    #[test]
    fn ends_of_lines_empty_lines_and_byte_order_marks_are_no_content() {
        let lines = lines_of(b"\xef\xbb\xbfa,b\r\n\r\n\n1,2\n3,4").expect("readable");
        assert_eq!(lines, [(1, b"a,b".to_vec()), (4, b"1,2".to_vec()), (5, b"3,4".to_vec())]);
        assert!(lines_of(b"").expect("readable").is_empty());
    }

    #[test]
    fn lines_survive_the_buffers_border() {
        // Lengths that share no factor with the buffer, over several buffers.
        let content: Vec<Vec<u8>> = (0..60_u8).map(|k| vec![b'a' + k % 26; 20_011 + 311 * usize::from(k)]).collect();
        let lines = lines_of(&content.join(&b'\n')).expect("readable");
        assert!(lines.iter().map(|(_, bytes)| bytes).eq(&content));
    }

    #[test]
    fn every_place_between_lines_is_found_again() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("lines");
        // Lines of all lengths, empty ones and Windows' ends, over several buffers.
        let content: String = (0..20_000).map(|k| format!("{}{}", "x".repeat(k % 97), ["\n", "\r\n"][k % 2])).collect();
        std::fs::write(&path, content).expect("written");
        let mut lines = Lines::open(&path, "lines").expect("there");
        let mut places = Vec::new();
        loop {
            let place = lines.position();
            let Some(line) = lines.advance().expect("readable") else { break };
            places.push((place, line.number, line.bytes.len()));
        }
        for (place, number, length) in places.into_iter().rev().step_by(37) {
            lines.go_to(place).expect("there");
            let line = lines.advance().expect("readable").expect("a line");
            assert_eq!((line.number, line.bytes.len()), (number, length));
        }
    }

    #[test]
    fn the_longest_line_passes_and_one_byte_more_does_not() {
        let longest = vec![b'x'; LINE_LIMIT_BYTES];
        assert_eq!(lines_of(&[b"a\n", &longest[..]].concat()).expect("readable")[1].1, longest);
        for content in [[b"a\n", &longest[..], b"x"].concat(), [b"a\n", &longest[..], b"x\nb\n"].concat()] {
            assert!(matches!(lines_of(&content), Err(DatasetError::LineTooLong { line: 2, .. })));
        }
    }
}

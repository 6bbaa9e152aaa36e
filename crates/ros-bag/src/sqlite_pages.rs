//! Rows of the tables in a file of SQLite, by its pages.
//!
//! A table is a tree of pages: interior ones (type 5) name their children, leaves (type 13) hold rows, each
//! its length, its number and a record; what has no room there stands in a chain of overflow pages. Indices,
//! free pages and logs beside the file are not read. Every page of a tree is read once, the rows of a leaf
//! have no more bytes than it, and all chains together no more pages than [`CHAIN_READINGS`] times the
//! file's: pages that point to each other in circles end. Reference: <https://sqlite.org/fileformat2.html>.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::rc::Rc;

use crate::settings::MAX_CHUNK_BYTES;

/// Bytes of a file before the first page's own header.
const FILE_HEADER_BYTES: usize = 100;
/// Type of a page whose cells lead to others, and of one with rows.
const INTERIOR: u8 = 5;
const LEAF: u8 = 13;
/// Fewest bytes of a page that SQLite uses.
const MIN_USABLE_BYTES: usize = 480;
/// Bytes that are read for a row at first: rows of a bag are mostly shorter. Rows in no order of time would
/// have pages of 64 KiB read for each of them.
const ROW_BYTES: usize = 4096;
/// How often a chain is read: for the order of the messages, and for their bytes.
const CHAIN_READINGS: u64 = 2;

/// An open file.
pub(crate) struct Pages {
    file: File,
    page_bytes: usize,
    /// Of a page, without what extensions reserve.
    usable_bytes: usize,
    /// Whole pages that are there.
    count: u32,
    /// Pages of chains that may still be read.
    chain_pages: u64,
}

/// A row in a leaf.
pub(crate) struct Cell {
    /// Its number in the table.
    pub(crate) row: i64,
    /// Where it stands in its leaf.
    pub(crate) at: u16,
    page: Rc<[u8]>,
    local: Range<usize>,
    length: u64,
    overflow: Option<u32>,
}

impl Cell {
    /// The part of the record that stands in the leaf.
    pub(crate) fn start(&self) -> &[u8] {
        self.page.get(self.local.clone()).unwrap_or_default()
    }
}

impl Pages {
    /// Opens a file; an error says why it is none of SQLite, or not one that is read here.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let mut file = File::open(path).map_err(|error| error.to_string())?;
        let bytes = file.metadata().map_err(|error| error.to_string())?.len();
        let mut head = [0; FILE_HEADER_BYTES];
        file.read_exact(&mut head).map_err(|_| "it is shorter than the header of a file of SQLite".to_owned())?;
        let page_bytes: usize = match u16_at(&head, 16) {
            Some(1) => 1 << 16,
            size => size.unwrap_or(0).into(),
        };
        let usable_bytes = page_bytes.saturating_sub(head[20].into());
        if !(512..=1 << 16).contains(&page_bytes) || !page_bytes.is_power_of_two() || usable_bytes < MIN_USABLE_BYTES {
            return Err(format!("file is not a database: its header says that a page has {page_bytes} bytes"));
        }
        if u32_at(&head, 56).is_some_and(|encoding| encoding > 1) {
            return Err("its texts are in UTF-16, where rosbag2 writes UTF-8".to_owned());
        }
        let count = u32::try_from(bytes / page_bytes as u64).unwrap_or(u32::MAX);
        let chain_pages = CHAIN_READINGS * u64::from(count);
        Ok(Self { file, page_bytes, usable_bytes, count, chain_pages })
    }

    fn page(&mut self, number: u32) -> Result<Rc<[u8]>, String> {
        self.part(number, 0, self.page_bytes)
    }

    /// Some bytes of a page.
    fn part(&mut self, number: u32, from: usize, length: usize) -> Result<Rc<[u8]>, String> {
        if !(1..=self.count).contains(&number) {
            return Err(format!("page {number} is not there"));
        }
        let mut bytes = vec![0; length];
        let start = u64::from(number - 1) * self.page_bytes as u64 + from as u64;
        let read = self.file.seek(SeekFrom::Start(start)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|error| format!("page {number}: {error}"))?;
        Ok(bytes.into())
    }

    /// The leaves of a table in the order of its rows, up to the first page that is not there; what else
    /// cannot be read is left out, and said.
    pub(crate) fn leaves(&mut self, root: u32, lose: &mut impl FnMut(String)) -> Vec<u32> {
        let mut seen = vec![false; self.count as usize + 1];
        let (mut open, mut leaves) = (vec![root], Vec::new());
        while let Some(number) = open.pop() {
            if number > self.count {
                lose(format!("the file is cut off: page {number} is not there; everything before was read"));
                break;
            }
            if std::mem::replace(&mut seen[number as usize], true) {
                lose(format!("page {number} occurs twice in a table; its rows were taken once"));
                continue;
            }
            match self.children(number) {
                Ok(None) => leaves.push(number),
                Ok(Some(children)) => open.extend(children.into_iter().rev()),
                Err(why) => lose(format!("{why}; its rows were left out")),
            }
        }
        leaves
    }

    /// The children of an interior page; none of a leaf.
    fn children(&mut self, number: u32) -> Result<Option<Vec<u32>>, String> {
        let page = self.page(number)?;
        let header = header_at(number);
        let damaged = || format!("page {number} is no page of a table");
        match page.get(header) {
            Some(&LEAF) => return Ok(None),
            Some(&INTERIOR) => {}
            _ => return Err(damaged()),
        }
        let cells = cells(&page, header, 12).ok_or_else(damaged)?;
        let child = |cell: &usize| u32_at(&page, *cell).ok_or_else(damaged);
        let mut children: Vec<u32> = cells.iter().map(child).collect::<Result<_, _>>()?;
        children.push(u32_at(&page, header + 8).ok_or_else(damaged)?);
        Ok(Some(children))
    }

    /// The rows of a leaf. An error says which page is damaged, and none of its rows is known.
    pub(crate) fn rows(&mut self, leaf: u32) -> Result<Vec<Cell>, String> {
        let page = self.page(leaf)?;
        let damaged = |what: &str| format!("page {leaf} is damaged: {what}");
        let cells = cells(&page, header_at(leaf), 8).ok_or_else(|| damaged("its list of rows"))?;
        let rows: Option<Vec<Cell>> = cells.into_iter().map(|at| self.cell(&page, at, self.usable_bytes)).collect();
        let rows = rows.ok_or_else(|| damaged("a row goes beyond it"))?;
        if rows.iter().map(|row| row.local.len()).sum::<usize>() > self.page_bytes {
            return Err(damaged("its rows overlap"));
        }
        Ok(rows)
    }

    /// One row of a leaf, by where it stands there.
    pub(crate) fn row(&mut self, leaf: u32, at: u16) -> Result<Cell, String> {
        let at = usize::from(at);
        let length = self.usable_bytes.saturating_sub(at).min(ROW_BYTES);
        let part = self.part(leaf, at, length)?;
        if let Some(row) = self.cell(&part, 0, length) {
            return Ok(row);
        }
        let page = self.page(leaf)?;
        let row = self.cell(&page, at, self.usable_bytes);
        row.ok_or_else(|| format!("page {leaf} is damaged: a row goes beyond it"))
    }

    /// The row that stands somewhere in a page, or a part of one, of which so many bytes are used.
    fn cell(&self, page: &Rc<[u8]>, at: usize, usable_bytes: usize) -> Option<Cell> {
        let (length, first) = varint(page.get(at..)?)?;
        let (row, second) = varint(page.get(at + first..)?)?;
        let start = at + first + second;
        let local = self.local_bytes(length);
        let end = start.checked_add(local)?;
        let overflow = if local as u64 == length { None } else { Some(u32_at(page, end)?) };
        let is_inside = end + if overflow.is_some() { 4 } else { 0 } <= usable_bytes;
        let (row, at) = (row as i64, at as u16);
        is_inside.then(|| Cell { row, at, page: page.clone(), local: start..end, length, overflow })
    }

    /// How much of a record stands in the leaf.
    fn local_bytes(&self, length: u64) -> usize {
        let usable = self.usable_bytes as u64;
        let most = usable - 35;
        if length <= most {
            return length as usize;
        }
        let least = (usable - 12) * 32 / 255 - 23;
        let fitting = least + (length - least) % (usable - 4);
        (if fitting <= most { fitting } else { least }) as usize
    }

    /// The whole record of a row.
    pub(crate) fn record(&mut self, cell: &Cell) -> Result<Vec<u8>, String> {
        if cell.length > MAX_CHUNK_BYTES {
            return Err(format!("a row of {} bytes, more than {} MiB", cell.length, MAX_CHUNK_BYTES >> 20));
        }
        let mut record = cell.start().to_vec();
        let mut next = cell.overflow;
        while (record.len() as u64) < cell.length {
            let Some(number) = next.filter(|number| *number != 0) else {
                return Err(format!("{} of {} bytes of a row are there", record.len(), cell.length));
            };
            self.chain_pages = self.chain_pages.checked_sub(1).ok_or("rows have more pages than the file")?;
            let page = self.page(number)?;
            next = u32_at(&page, 0);
            let missing = usize::try_from(cell.length).unwrap_or(usize::MAX) - record.len();
            let content = page.get(4..self.usable_bytes).unwrap_or_default();
            record.extend_from_slice(&content[..content.len().min(missing)]);
        }
        Ok(record)
    }
}

/// Where the header of a page stands in it.
const fn header_at(number: u32) -> usize {
    if number == 1 { FILE_HEADER_BYTES } else { 0 }
}

/// Where a page's cells stand, whose pointers follow a header of so many bytes.
fn cells(page: &[u8], header: usize, header_bytes: usize) -> Option<Vec<usize>> {
    let count = u16_at(page, header + 3)?;
    (0..usize::from(count)).map(|cell| u16_at(page, header + header_bytes + 2 * cell).map(usize::from)).collect()
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// A number of variable length, and its bytes: seven bits each, the ninth has eight.
fn varint(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut value = 0;
    for (place, byte) in bytes.iter().take(8).enumerate() {
        value = value << 7 | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Some((value, place + 1));
        }
    }
    Some((value << 8 | u64::from(*bytes.get(8)?), 9))
}

/// What a column of a row holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Column<'a> {
    /// Nothing, or a column that was added after the row; a number with a fraction, which no bag has.
    Nothing,
    Integer(i64),
    /// A text or other bytes.
    Bytes(&'a [u8]),
}

/// A column of a record; none where the bytes end before it.
pub(crate) fn column(record: &[u8], index: usize) -> Option<Column<'_>> {
    let (header, first) = varint(record)?;
    let header = usize::try_from(header).ok()?;
    let (mut at, mut start) = (first, header);
    for place in 0..=index {
        if at >= header {
            return Some(Column::Nothing);
        }
        let (kind, bytes) = varint(record.get(at..)?)?;
        at += bytes;
        let length = match kind {
            0 | 8..12 => 0,
            1..=4 => kind as usize,
            5 => 6,
            6 | 7 => 8,
            _ => usize::try_from((kind - 12) / 2).ok()?,
        };
        let end = start.checked_add(length)?;
        if place == index {
            let content = record.get(start..end)?;
            return Some(match kind {
                8 => Column::Integer(0),
                9 => Column::Integer(1),
                1..=6 => Column::Integer(integer(content)),
                12.. => Column::Bytes(content),
                _ => Column::Nothing,
            });
        }
        start = end;
    }
    None
}

/// A signed number of up to eight bytes, the highest first.
fn integer(bytes: &[u8]) -> i64 {
    let sign = if bytes.first().is_some_and(|byte| byte & 0x80 != 0) { -1 } else { 0 };
    bytes.iter().fold(sign, |value, byte| value << 8 | i64::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of three pages: the second has so many pointers to one row of 5119 bytes, whose chain is the
    /// third, again and again.
    fn circle(rows: u8) -> Pages {
        let mut bytes = vec![0; 3 * 512];
        bytes[16] = 2;
        bytes[100] = LEAF;
        let (header, at) = (512, 300_usize);
        bytes[header..header + 5].copy_from_slice(&[LEAF, 0, 0, 0, rows]);
        for row in 0..usize::from(rows) {
            bytes[header + 8 + 2 * row..][..2].copy_from_slice(&(at as u16).to_be_bytes());
        }
        bytes[header + at..][..3].copy_from_slice(&[0xa7, 0x7f, 1]);
        for next in [header + at + 3 + 39, 1024] {
            bytes[next..next + 4].copy_from_slice(&3_u32.to_be_bytes());
        }
        let mut file = tempfile::tempfile().expect("a file");
        std::io::Write::write_all(&mut file, &bytes).expect("written");
        Pages { file, page_bytes: 512, usable_bytes: 512, count: 3, chain_pages: 6 }
    }

    #[test]
    fn rows_that_share_bytes_or_pages_end() {
        let mut pages = circle(1);
        assert_eq!(pages.leaves(2, &mut |why| panic!("{why}")), [2]);
        let rows = pages.rows(2).expect("a row");
        assert_eq!((rows.len(), rows[0].row, rows[0].start().len()), (1, 1, 39));
        // Ten pages of 508 bytes are left, of which six may be read.
        assert!(pages.record(&rows[0]).expect_err("endless").contains("more pages than the file"));
        assert!(circle(13).rows(2).is_ok());
        assert!(circle(14).rows(2).is_err_and(|why| why.contains("page 2 is damaged: its rows overlap")));
    }

    #[test]
    fn numbers_of_variable_length_and_columns_are_read_to_their_last_byte() {
        assert_eq!(varint(&[0x81, 0x00]), Some((128, 2)));
        assert_eq!(varint(&[0xff; 9]), Some((u64::MAX, 9)));
        assert_eq!((varint(&[0x80]), varint(&[0xff; 8]), varint(&[])), (None, None, None));
        // Nothing, −2 of three bytes, 0, 1, a text of two letters, a blob of one byte.
        let record = [7, 0, 3, 8, 9, 17, 14, 0xff, 0xff, 0xfe, b'a', b'b', 7];
        let columns: Vec<_> = (0..7).map(|place| column(&record, place)).collect();
        let integer = |value| Some(Column::Integer(value));
        let bytes = |bytes| Some(Column::Bytes(bytes));
        let nothing = Some(Column::Nothing);
        assert_eq!(columns, [nothing, integer(-2), integer(0), integer(1), bytes(b"ab"), bytes(&[7]), nothing]);
        assert_eq!((column(&record[..12], 5), column(&record[..12], 4)), (None, bytes(b"ab")));
    }
}

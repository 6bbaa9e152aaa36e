//! Mutations of SQLite files by their pages: headers, pointers to cells and pages, the heads of cells and
//! rows, the words of the schema. Format: <https://sqlite.org/fileformat2.html>.

use rand::{Rng, RngExt};

use crate::{bag, text};

/// Bytes of a file before the first page's header.
const FILE_HEADER_BYTES: usize = 100;

/// Types of pages, and one that is none.
const PAGE_TYPES: [u8; 5] = [2, 5, 10, 13, 0];

/// First bytes of numbers of variable length at which code goes wrong: 127 at most, more follows, all ones.
const VARINTS: [u8; 6] = [0, 1, 0x7f, 0x80, 0x81, 0xff];

/// Types of a column in a row: nothing, integers of 1 to 8 bytes, a double, 0, 1, two that are reserved, an
/// empty blob and an empty text, a blob and a text of 50 bytes.
const COLUMN_TYPES: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 112, 113];

fn pick<T: Copy>(list: &[T], random: &mut impl Rng) -> T {
    list[random.random_range(0..list.len())]
}

/// What a number becomes: a small one, or one at an end of its range or of the page.
fn odd(page_bytes: usize, random: &mut impl Rng) -> u32 {
    let page_bytes = page_bytes as u32;
    pick(&[0, 1, 2, 3, 7, 8, page_bytes - 1, page_bytes, 0x7fff, 0xffff, 0x7fff_ffff, u32::MAX], random)
}

fn set(bytes: &mut [u8], at: usize, new: &[u8]) {
    if let Some(place) = bytes.get_mut(at..at + new.len()) {
        place.copy_from_slice(new);
    }
}

/// A page and where its header stands in it.
struct Page<'p> {
    bytes: &'p mut [u8],
    header: usize,
}

impl Page<'_> {
    fn u16(&self, at: usize) -> usize {
        self.bytes.get(at..at + 2).map_or(0, |two| usize::from(two[0]) << 8 | usize::from(two[1]))
    }

    /// Whether its cells lead to other pages.
    fn is_interior(&self) -> bool {
        [2, 5].contains(&self.bytes[self.header])
    }

    /// Where the pointers to its cells stand, and how many there are.
    fn pointers(&self) -> (usize, usize) {
        (self.header + if self.is_interior() { 12 } else { 8 }, self.u16(self.header + 3))
    }

    /// Where one of its cells stands.
    fn cell(&self, random: &mut impl Rng) -> Option<usize> {
        let (first, count) = self.pointers();
        let at = self.u16(first + 2 * random.random_range(0..count.max(1)));
        (count > 0 && at < self.bytes.len()).then_some(at)
    }

    /// Type, free blocks, cells, start of the content, fragments, the last child.
    fn mutate_header(&mut self, pages: usize, random: &mut impl Rng) {
        let (header, new) = (self.header, odd(self.bytes.len(), random));
        match random.random_range(0..6) {
            0 => set(self.bytes, header, &[pick(&PAGE_TYPES, random)]),
            1 => set(self.bytes, header + 7, &new.to_be_bytes()[3..]),
            2 => set(self.bytes, header + 8, &random.random_range(0..pages as u32 + 2).to_be_bytes()),
            field => set(self.bytes, header + [1, 3, 5][field - 3], &new.to_be_bytes()[2..]),
        }
    }

    /// A pointer leads to another cell, or elsewhere.
    fn mutate_pointer(&mut self, random: &mut impl Rng) {
        let (first, count) = self.pointers();
        let at = first + 2 * random.random_range(0..count.max(1));
        let elsewhere = match self.cell(random) {
            Some(cell) if random.random_bool(0.5) => cell + random.random_range(0..3),
            _ => odd(self.bytes.len(), random) as usize,
        };
        set(self.bytes, at, &(elsewhere as u16).to_be_bytes());
    }

    /// The head of a cell: its child, or its length and number; or of its row: the types of the columns.
    fn mutate_cell(&mut self, pages: usize, random: &mut impl Rng) {
        let Some(cell) = self.cell(random) else { return };
        match random.random_range(0..4) {
            0 if self.is_interior() => set(self.bytes, cell, &random.random_range(0..pages as u32 + 2).to_be_bytes()),
            0 => set(self.bytes, cell, &[0xff; 9][..random.random_range(1..10)]),
            1 => set(self.bytes, cell + random.random_range(0..4), &[pick(&VARINTS, random)]),
            2 => set(self.bytes, cell + random.random_range(2..10), &[pick(&COLUMN_TYPES, random)]),
            _ => {
                // Numbers of the row, and of the message in it.
                let end = self.bytes.len().min(cell + 200);
                bag::number(&mut self.bytes[cell..end], random);
            }
        }
    }
}

/// A word of the schema by another, in as many bytes.
fn mutate_schema(first_page: &mut [u8], random: &mut impl Rng) {
    let words = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    let starts: Vec<usize> = (FILE_HEADER_BYTES + 1..first_page.len())
        .filter(|at| words(&first_page[*at]) && !words(&first_page[*at - 1]))
        .collect();
    if starts.is_empty() {
        return;
    }
    let word = |at: usize| first_page[at..].iter().copied().take_while(words).collect::<Vec<u8>>();
    let more: [&[u8]; 10] =
        [b"VIEW", b"VIRTUAL", b"AS", b"UNIQUE", b"REAL", b"_rowid_", b"WITHOUT", b"DESC", b"CHECK", b"COLLATE"];
    let at = pick(&starts, random);
    let new = if random.random_bool(0.5) { word(pick(&starts, random)) } else { pick(&more, random).to_vec() };
    let length = word(at).len();
    let padded: Vec<u8> = new.into_iter().chain(std::iter::repeat(b' ')).take(length).collect();
    set(first_page, at, &padded);
}

/// A page takes the place of another, or they change places, or one is lost or added.
fn mutate_order(pages: &mut Vec<Vec<u8>>, random: &mut impl Rng) {
    let (one, two) = (random.random_range(0..pages.len()), random.random_range(0..pages.len()));
    match random.random_range(0..4) {
        0 => pages[one] = pages[two].clone(),
        1 => pages.swap(one, two),
        2 if pages.len() > 1 => drop(pages.remove(one)),
        _ => pages.push(pages[one].clone()),
    }
}

fn mutate(pages: &mut Vec<Vec<u8>>, random: &mut impl Rng) {
    let count = pages.len();
    let at = random.random_range(0..count);
    let mut page = Page { header: if at == 0 { FILE_HEADER_BYTES } else { 0 }, bytes: &mut pages[at] };
    match random.random_range(0..12) {
        0 => {
            // Behind the name and the size of pages; a file of another page size is no file mostly.
            let fields = if random.random_bool(0.9) { 18..96 } else { 0..18 };
            let field = random.random_range(fields);
            let new = odd(page.bytes.len(), random).to_be_bytes();
            set(&mut pages[0], field, &new[random.random_range(0..4)..]);
        }
        1 | 2 => page.mutate_header(count, random),
        3 | 4 => page.mutate_pointer(random),
        5..=7 => page.mutate_cell(count, random),
        8 => pages[at] = text::bit(&pages[at], random),
        9 => mutate_order(pages, random),
        _ => mutate_schema(&mut pages[0], random),
    }
}

/// A file with one to eight mutations of its pages, now and then cut off.
pub(crate) fn mutated(file: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let page_bytes = usize::from(file[16]) << 8 | usize::from(file[17]);
    let mut pages: Vec<Vec<u8>> = file.chunks_exact(page_bytes).map(<[u8]>::to_vec).collect();
    for _ in 0..1 + (8.0 * random.random::<f64>().powi(3)) as usize {
        mutate(&mut pages, random);
    }
    let mut bytes = pages.concat();
    if random.random_bool(0.03) {
        bytes.truncate(random.random_range(0..=bytes.len()));
    }
    bytes
}

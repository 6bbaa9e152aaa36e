//! Mutations of text that keep most of it: tokens, numbers, lines, columns.

use rand::{Rng, RngExt};

/// Bytes to which a repetition lets a text grow: far more than a line or an object may have, and little
/// beside the memory that an execution may take.
const MAX_REPEATED_BYTES: usize = 1 << 24;

/// Numbers at which code goes wrong.
const NUMBERS: [&str; 28] = [
    "0",
    "-0",
    "1",
    "-1",
    "0.5",
    "1e-320",
    "5e-324",
    "2.2250738585072014e-308",
    "1e-160",
    "1e-12",
    "1e12",
    "1e160",
    "1.7976931348623157e308",
    "-1e308",
    "1e309",
    "NaN",
    "inf",
    "-inf",
    "127",
    "32767",
    "2147483647",
    "-2147483648",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "0x7f",
];

/// Pieces at which parsers go wrong.
const PIECES: [&str; 28] = [
    "\"",
    "'",
    "\\",
    "\0",
    "\n",
    "\r\n",
    "\u{feff}",
    "\u{202e}",
    "\u{1b}[31m",
    ",",
    ";",
    "\t",
    " ",
    "#",
    "[",
    "]",
    "{",
    "}",
    "[[",
    "=",
    "é",
    "𝄞",
    "\u{7f}",
    "\"\"\"",
    ".",
    "..",
    "/../",
    "*&a",
];

fn pick<'l, T>(list: &'l [T], random: &mut impl Rng) -> &'l T {
    &list[random.random_range(0..list.len())]
}

/// Tokens: words and numbers, and every other byte by itself.
fn tokens(text: &[u8]) -> Vec<&[u8]> {
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-+".contains(byte);
    let mut found = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let length = rest.iter().take_while(|byte| is_word(byte)).count().max(1);
        let (token, behind) = rest.split_at(length);
        found.push(token);
        rest = behind;
    }
    found
}

fn lines(text: &[u8]) -> Vec<&[u8]> {
    text.split_inclusive(|byte| *byte == b'\n').collect()
}

fn is_number(token: &[u8]) -> bool {
    std::str::from_utf8(token).is_ok_and(|token| token.parse::<f64>().is_ok())
}

/// One to eight mutations; most often one or two, so that most of the text stays what it was.
pub(crate) fn mutated(text: &[u8], other: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let count = 1 + (8.0 * random.random::<f64>().powi(4)) as usize;
    (0..count).fold(text.to_vec(), |text, _| once(&text, other, random))
}

fn once(text: &[u8], other: &[u8], random: &mut impl Rng) -> Vec<u8> {
    match random.random_range(0..14) {
        0..=4 => number(text, random),
        5 => token(text, random),
        6 => line(text, random),
        7 => column(text, random),
        8 => piece(text, random),
        9 => bit(text, random),
        10 => splice(text, other, random),
        11 => text[..random.random_range(0..=text.len())].to_vec(),
        12 => repeated(text, random),
        _ => every_cell(text, random),
    }
}

/// A number by another: one at which code goes wrong, or one near it.
fn number(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut all = tokens(text);
    let at: Vec<usize> = (0..all.len()).filter(|at| is_number(all[*at])).collect();
    if at.is_empty() {
        return text.to_vec();
    }
    let at = *pick(&at, random);
    let value: f64 = std::str::from_utf8(all[at]).ok().and_then(|token| token.parse().ok()).unwrap_or(0.0);
    let new = match random.random_range(0..6) {
        0 => format!("{}", value * *pick(&[-1.0, 1e3, 1e-3, 1e9, 1e-9, 2.0], random)),
        1 => format!("{}", value + *pick(&[1.0, -1.0, 1e-9, 65536.0], random)),
        2 => format!("{value:e}"),
        _ => (*pick(&NUMBERS, random)).to_owned(),
    };
    all[at] = new.as_bytes();
    all.concat()
}

/// A token left out, doubled, or in the place of another.
fn token(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut all = tokens(text);
    if all.is_empty() {
        return Vec::new();
    }
    let (one, two) = (random.random_range(0..all.len()), random.random_range(0..all.len()));
    match random.random_range(0..3) {
        0 => drop(all.remove(one)),
        1 => all.insert(one, all[one]),
        _ => all[one] = all[two],
    }
    all.concat()
}

/// A line left out, doubled or moved.
fn line(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut all = lines(text);
    if all.is_empty() {
        return Vec::new();
    }
    let (one, two) = (random.random_range(0..all.len()), random.random_range(0..all.len()));
    match random.random_range(0..4) {
        0 => drop(all.remove(one)),
        1 => all.insert(two, all[one]),
        2 => all.swap(one, two),
        _ => drop(all.drain(one.min(two)..one.max(two))),
    }
    all.concat()
}

/// Two columns of a table change places, or their names alone.
fn column(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let all = lines(text);
    let width = all.first().map_or(0, |first| first.split(|byte| *byte == b',').count());
    if width < 2 {
        return text.to_vec();
    }
    let (one, two) = (random.random_range(0..width), random.random_range(0..width));
    let header_only = random.random_bool(0.5);
    let swapped = |(number, line): (usize, &&[u8])| {
        let body = line.strip_suffix(b"\n").unwrap_or(line);
        let mut cells: Vec<&[u8]> = body.split(|byte| *byte == b',').collect();
        if cells.len() == width && (number == 0 || !header_only) {
            cells.swap(one, two);
        }
        [&cells.join(&b","[..])[..], b"\n"].concat()
    };
    all.iter().enumerate().flat_map(swapped).collect()
}

/// All cells of one column become one number.
fn every_cell(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let all = lines(text);
    let width = all.first().map_or(0, |first| first.split(|byte| *byte == b',').count());
    let (at, new) = (random.random_range(0..width.max(1)), *pick(&NUMBERS, random));
    let changed = |(number, line): (usize, &&[u8])| {
        let body = line.strip_suffix(b"\n").unwrap_or(line);
        let mut cells: Vec<&[u8]> = body.split(|byte| *byte == b',').collect();
        if number > 0 && cells.len() == width {
            cells[at] = new.as_bytes();
        }
        [&cells.join(&b","[..])[..], b"\n"].concat()
    };
    all.iter().enumerate().flat_map(changed).collect()
}

fn piece(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let at = random.random_range(0..=text.len());
    [&text[..at], pick(&PIECES, random).as_bytes(), &text[at..]].concat()
}

/// A bit of one byte.
pub(crate) fn bit(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut new = text.to_vec();
    if !new.is_empty() {
        let at = random.random_range(0..new.len());
        new[at] ^= 1 << random.random_range(0..8);
    }
    new
}

/// A part of another text in the place of a part of this one.
fn splice(text: &[u8], other: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let (mut ours, theirs) = (lines(text), lines(other));
    if ours.is_empty() || theirs.is_empty() {
        return other.to_vec();
    }
    let at = random.random_range(0..ours.len());
    let from = random.random_range(0..theirs.len());
    let to = (from + random.random_range(1..6)).min(theirs.len());
    ours.splice(at..at, theirs[from..to].iter().copied());
    ours.concat()
}

/// A token or a line very often.
fn repeated(text: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut all = if random.random_bool(0.5) { tokens(text) } else { lines(text) };
    if all.is_empty() {
        return Vec::new();
    }
    let at = random.random_range(0..all.len());
    let room = MAX_REPEATED_BYTES.saturating_sub(text.len()) / all[at].len();
    let new = all[at].repeat((*pick(&[2, 10, 100, 3000], random)).min(room.max(1)));
    all[at] = &new;
    all.concat()
}

/// `censi:5008848`: a line that was repeated three times over had 486 MB, all of it the mutator's own.
#[test]
fn repetitions_of_repetitions_stay_within_their_limit() {
    use rand::SeedableRng;
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
    let (line, mut longest) = (b"0.4636".repeat(10), 0);
    for _ in 0..20 {
        let text = (0..6).fold(line.clone(), |text, _| repeated(&text, &mut random));
        longest = longest.max(text.len());
    }
    // Without the limit the longest of these has hundreds of megabytes.
    assert!((MAX_REPEATED_BYTES / 2..=MAX_REPEATED_BYTES).contains(&longest), "{longest} bytes");
}

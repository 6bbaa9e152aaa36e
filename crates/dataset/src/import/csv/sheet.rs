//! One file as a sheet: how its fields and numbers are written, where its header is, what its columns are
//! called and where its rows begin.

use std::cmp::Reverse;
use std::path::{Path, PathBuf};

use super::text::{self, Decimal, Delimiter};
use crate::error::{DatasetError, shown};
use crate::table::CUT_OFF;
use crate::unit::Unit;

/// Lines by which the way of writing is found.
const PROBED_LINES: usize = 200;

/// What a user says of how files are written; `None` is to be found.
#[derive(Debug, Clone, Copy, Default)]
pub struct Writing {
    /// Between fields.
    pub delimiter: Option<Delimiter>,
    /// In numbers.
    pub decimal: Option<Decimal>,
    /// Whether there is a header.
    pub header: Option<bool>,
}

/// A file whose way of writing is known.
#[derive(Debug)]
pub(super) struct Sheet {
    pub(super) file: PathBuf,
    pub(super) text: String,
    pub(super) delimiter: Delimiter,
    pub(super) decimal: Decimal,
    /// Line of the header, from 1.
    pub(super) header_line: Option<u64>,
    /// Names of the columns; their numbers where there is no header.
    pub(super) names: Vec<String>,
    /// Units from a line of their own below the header.
    pub(super) units: Vec<Option<Unit>>,
    /// Line of the first row, from 1.
    pub(super) first_row: u64,
}

/// One way to read the first lines.
struct Candidate {
    delimiter: Delimiter,
    decimal: Decimal,
    /// Fields of most lines.
    columns: usize,
    /// Columns that are numbers in every line after the first of these.
    numeric: Vec<bool>,
    /// Index of the first row among the probed lines.
    first: usize,
}

impl Candidate {
    fn of(lines: &[(u64, &str)], delimiter: Delimiter, decimal: Decimal) -> Option<Self> {
        let mut fields = Vec::new();
        let mut counts = std::collections::BTreeMap::new();
        for (_, line) in lines {
            delimiter.split(line, &mut fields);
            *counts.entry(fields.len()).or_insert(0_usize) += 1;
        }
        // The commonest; of equally common ones the larger: a preamble has fewer fields than the table.
        let (&columns, _) = counts.iter().max_by_key(|(columns, lines)| (**lines, **columns))?;
        if columns < 2 {
            return None;
        }
        let is_cell = |field: &str| field.is_empty() || decimal.number(field).is_some();
        // From the end, as the rows are what stands last; the last line may be cut off.
        let mut numeric = vec![true; columns];
        let rows: Vec<usize> = (0..lines.len())
            .filter(|&index| {
                delimiter.split(lines[index].1, &mut fields);
                fields.len() == columns
            })
            .collect();
        let mut filled = vec![false; columns];
        let tail = &rows[rows.len() / 2..];
        for &index in tail {
            delimiter.split(lines[index].1, &mut fields);
            numeric.iter_mut().zip(&fields).for_each(|(numeric, field)| *numeric &= is_cell(field));
            filled.iter_mut().zip(&fields).for_each(|(filled, field)| *filled |= !field.is_empty());
        }
        numeric.iter_mut().zip(filled).for_each(|(numeric, filled)| *numeric &= filled);
        let first = rows.iter().copied().find(|&index| {
            delimiter.split(lines[index].1, &mut fields);
            // A row with a fault is a row still: most of its numbers are some.
            let cells = || fields.iter().zip(&numeric).filter(|(_, numeric)| **numeric).map(|(field, _)| field);
            2 * cells().filter(|field| is_cell(field)).count() > cells().count()
                && cells().any(|field| !field.is_empty())
        })?;
        Some(Self { delimiter, decimal, columns, numeric, first })
    }

    fn numbers(&self) -> usize {
        self.numeric.iter().filter(|numeric| **numeric).count()
    }

    /// Less is better: many numbers, and then little else.
    fn rank(&self) -> (Reverse<usize>, usize) {
        (Reverse(self.numbers()), self.columns)
    }
}

fn is_comment(line: &str) -> bool {
    line.starts_with('#') || line.starts_with("//") || (line.starts_with('%') && !line.starts_with("%time"))
}

impl Sheet {
    pub(super) fn open(file: &Path, writing: Writing) -> Result<Self, DatasetError> {
        Self::of(file, text::read(file)?, writing)
    }

    /// Of a file's text, or of what stands in its place line by line.
    pub(super) fn of(file: &Path, text: String, writing: Writing) -> Result<Self, DatasetError> {
        let all: Vec<(u64, &str)> =
            (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()).take(PROBED_LINES).collect();
        let rows: Vec<(u64, &str)> = all.iter().copied().filter(|(_, line)| !is_comment(line)).collect();
        let best = Self::best(file, &rows, writing)?;
        let mut fields = Vec::new();
        let split = |line: &str| {
            let mut fields = Vec::new();
            best.delimiter.split(line, &mut fields);
            fields.into_iter().map(str::to_owned).collect::<Vec<String>>()
        };
        let as_wide = |line: &str| Some(split(line)).filter(|fields| fields.len() == best.columns);
        let (mut first, mut header, mut units) = (best.first, None, vec![None; best.columns]);
        if writing.header == Some(true) && first == 0 {
            // Names that are numbers.
            (header, first) = (as_wide(rows[0].1).map(|names| (rows[0].0, names)), 1);
        } else if writing.header != Some(false) {
            let mut above = (0..first).rev().filter_map(|index| Some((rows[index].0, as_wide(rows[index].1)?)));
            header = above.next();
            if let Some((_, below)) = &header
                && let Some(of_units) = units_line(below)
                && let Some(names) = above.next()
            {
                (units, header) = (of_units, Some(names));
            }
            if header.is_none() {
                // The names may stand in a comment right above the rows.
                let comments =
                    all.iter().take_while(|(number, _)| *number < rows[first].0).filter(|(_, line)| is_comment(line));
                header = comments.last().and_then(|(number, line)| {
                    let line = line.trim_start_matches(['#', '%', '/']).trim();
                    let names = as_wide(line).or_else(|| {
                        Delimiter::Spaces.split(line, &mut fields);
                        let names: Vec<_> = fields.iter().map(|name| (*name).to_owned()).collect();
                        Some(names).filter(|names| names.len() == best.columns)
                    });
                    names.map(|names| (*number, names))
                });
            }
        }
        let Some(&(first_row, _)) = rows.get(first) else {
            let expected = "rows below the header".to_owned();
            return Err(DatasetError::EmptyFile { file: file.to_owned(), expected });
        };
        let (header_line, names) = match header {
            Some((line, names)) => (Some(line), names),
            None => (None, (1..=best.columns).map(|number| number.to_string()).collect()),
        };
        let Candidate { delimiter, decimal, .. } = best;
        Ok(Self { file: file.to_owned(), text, delimiter, decimal, header_line, names, units, first_row })
    }

    /// The one way of reading under which most columns are numbers.
    fn best(file: &Path, rows: &[(u64, &str)], writing: Writing) -> Result<Candidate, DatasetError> {
        let delimiters =
            Delimiter::ALL.into_iter().filter(|delimiter| writing.delimiter.is_none_or(|it| it == *delimiter));
        let mut candidates: Vec<Candidate> = delimiters
            .flat_map(|delimiter| Decimal::ALL.map(|decimal| (delimiter, decimal)))
            // Unless the user says so, a comma is one or the other.
            .filter(|(delimiter, decimal)| {
                writing
                    .decimal
                    .map_or(*delimiter != Delimiter::Comma || *decimal == Decimal::Point, |it| it == *decimal)
            })
            .filter_map(|(delimiter, decimal)| Candidate::of(rows, delimiter, decimal))
            .collect();
        candidates.sort_by_key(Candidate::rank);
        let mut candidates = candidates.into_iter();
        let Some(best) = candidates.next().filter(|best| best.numbers() >= 2) else {
            let (line, text) = rows.first().copied().unwrap_or((1, ""));
            let message = format!(
                "no table of numbers is found, neither with commas, semicolons, tabs, bars nor spaces between fields; the first line is \"{}\"; say --delimiter and --decimal",
                shown(text.as_bytes())
            );
            return Err(DatasetError::Foreign { file: file.to_owned(), line, message });
        };
        // Whole numbers are the same with either decimal mark.
        let is_other = |other: &Candidate| match (best.delimiter, other.delimiter) {
            // Tabs are spaces too.
            (Delimiter::Tab, Delimiter::Spaces) => false,
            (best, other) => best != other,
        };
        let rival = candidates.find(|other| other.rank() == best.rank() && is_other(other));
        match rival {
            None => Ok(best),
            Some(rival) => Err(DatasetError::Undecided {
                file: file.to_owned(),
                what: "the delimiter".to_owned(),
                readings: format!("{} or {}", best.delimiter.name(), rival.delimiter.name()),
                flag: format!("--delimiter {}", best.delimiter.name()),
            }),
        }
    }

    /// The error for a line that does not fit the table's format.
    pub(super) fn foreign(&self, line: u64, message: String) -> DatasetError {
        DatasetError::Foreign { file: self.file.clone(), line, message }
    }

    /// The same for the header.
    pub(super) fn foreign_header(&self, message: String) -> DatasetError {
        self.foreign(self.header_line.unwrap_or(1), message)
    }

    /// The first cells of a column as they are written.
    pub(super) fn first_cells(&self, column: usize) -> Vec<String> {
        const SHOWN: usize = 3;
        let mut fields = Vec::new();
        let rows = self
            .text
            .lines()
            .skip(self.first_row as usize - 1)
            .filter(|line| !line.trim().is_empty() && !is_comment(line));
        let cell = |line| {
            self.delimiter.split(line, &mut fields);
            shown(fields.get(column).copied().unwrap_or_default().as_bytes())
        };
        rows.take(SHOWN).map(cell).collect()
    }

    /// Calls `visit` with number and fields of every row.
    pub(super) fn for_each_row<'a>(
        &'a self,
        mut visit: impl FnMut(u64, &[&'a str]) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let mut fields = Vec::with_capacity(self.names.len());
        let mut lines = (1..).zip(self.text.lines()).skip(self.first_row as usize - 1).peekable();
        while let Some((number, line)) = lines.next() {
            if line.trim().is_empty() || is_comment(line) {
                continue;
            }
            self.delimiter.split(line, &mut fields);
            // A delimiter at the end of every row is no column where the header has none.
            if fields.len() == self.names.len() + 1 && fields.last().is_some_and(|last| last.is_empty()) {
                fields.pop();
            }
            if fields.len() != self.names.len() {
                let hint = if lines.peek().is_none() { CUT_OFF } else { "" };
                return Err(DatasetError::WrongFieldCount {
                    file: self.file.clone(),
                    line: number,
                    found: fields.len(),
                    expected: self.names.len(),
                    hint: hint.to_owned(),
                });
            }
            visit(number, &fields)?;
        }
        Ok(())
    }
}

/// The units of a line that holds nothing else.
fn units_line(fields: &[String]) -> Option<Vec<Option<Unit>>> {
    let unit = |field: &String| Unit::named(&field.trim_matches(['[', ']', '(', ')']).to_lowercase());
    let units: Vec<Option<Unit>> = fields.iter().map(unit).collect();
    let known = units.iter().flatten().count();
    let others_are_blank = fields.iter().zip(&units).all(|(field, unit)| unit.is_some() || field.len() <= 1);
    (known >= 2 && others_are_blank).then_some(units)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(content: &str, writing: Writing) -> Result<Sheet, DatasetError> {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let file = temp.path().join("log.csv");
        std::fs::write(&file, content).expect("written");
        Sheet::open(&file, writing)
    }

    #[track_caller]
    fn found(content: &str) -> (Delimiter, Decimal, Option<u64>, u64, Vec<String>) {
        let sheet = open(content, Writing::default()).expect("a table");
        (sheet.delimiter, sheet.decimal, sheet.header_line, sheet.first_row, sheet.names)
    }

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn delimiters_decimals_and_headers_are_found() {
        use Decimal::{Comma as DecimalComma, Point};
        let of = |delimiter, decimal, header, first, text| (delimiter, decimal, header, first, names(text));
        assert_eq!(found("t,x\n0,1.5\n1,2.5\n"), of(Delimiter::Comma, Point, Some(1), 2, "t x"));
        assert_eq!(found("t;x\n0,1;1,5\n0,2;2,5\n"), of(Delimiter::Semicolon, DecimalComma, Some(1), 2, "t x"));
        assert_eq!(found("t;x\n0;1\n1;2\n"), of(Delimiter::Semicolon, Point, Some(1), 2, "t x"));
        assert_eq!(found("0\t1\n1\t2\n"), of(Delimiter::Tab, Point, None, 1, "1 2"));
        assert_eq!(found("t|x\r\n0|1\r\n1|2\r\n"), of(Delimiter::Pipe, Point, Some(1), 2, "t x"));
        assert_eq!(found("  t   x\n  0  1.5\n 10  2.5\n"), of(Delimiter::Spaces, Point, Some(1), 2, "t x"));
        assert_eq!(found("0,5 1,5\n0,6 1,7\n"), of(Delimiter::Spaces, DecimalComma, None, 1, "1 2"));
        assert_eq!(found("Robot: seven\n\nt,x\n0,1\n1,2\n2,3\n"), of(Delimiter::Comma, Point, Some(3), 4, "t x"));
        assert_eq!(found("# made by me\n# t x\n0 1\n1 2\n"), of(Delimiter::Spaces, Point, Some(2), 3, "t x"));
        assert_eq!(found("run,t,x\na,0,1\na,1,2\n"), of(Delimiter::Comma, Point, Some(1), 2, "run t x"));
    }

    #[test]
    fn a_line_of_units_belongs_to_the_names_above() {
        let sheet = open("t;x;n\n[ms];(mm);-\n0;1;1\n1;2;2\n", Writing::default()).expect("a table");
        assert_eq!((sheet.header_line, sheet.first_row), (Some(1), 3));
        assert_eq!(sheet.units, [Some(Unit::Ms), Some(Unit::Mm), None]);
    }

    #[test]
    fn what_is_no_table_is_refused_and_a_row_that_is_cut_off_is_named() {
        let message = |content: &str| open(content, Writing::default()).expect_err("no table").to_string();
        assert!(message("hello\nworld\n").contains("log.csv:1: no table of numbers"));
        assert!(message("t,x\n").contains("no table of numbers"));
        assert!(message("").contains("empty file"));
        let rows = |content: &str| {
            open(content, Writing::default())
                .expect("a table")
                .for_each_row(|_, _| Ok(()))
                .expect_err("cut")
                .to_string()
        };
        assert_eq!(open("t,x,y\n0,a,1\n1,2,2\n2,3,3\n3,4,4\n", Writing::default()).expect("a table").first_row, 2);
        assert!(rows("t,x\n0,1\n1,2\n2").contains("cut off"));
        let inside = rows("t,x\n0,1\n1\n2,3\n");
        assert!(inside.contains("log.csv:3: 1 field") && !inside.contains("cut off"), "{inside}");
    }
}

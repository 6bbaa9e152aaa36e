//! A table of a dataset: a header by whose names columns are found, and rows that belong to runs.
//!
//! A table is read twice: first only its run ids, to learn how many rows each run has, so that columns are
//! reserved exactly and memory never holds them twice; then its numbers.

mod fields;
mod lines;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::column_names::{Quantity, likely_mapping};
use crate::error::{DatasetError, shown};
use crate::settings::{MAX_COUNT, MAX_ROWS};
use crate::warning::Warning;
use fields::Fields;
use lines::{Line, Lines};

pub(crate) use fields::quoted_where_needed;
pub(crate) use lines::{Position, open as open_file, read_all as read_lines};

/// The column that says to which run a row belongs.
pub(crate) const RUN_COLUMN: &str = "run";

/// What may be wrong with a last row that is too short.
pub(crate) const CUT_OFF: &str = "; it is the last line: the file may be cut off";

const TOO_MANY: &str = "; decimal commas? Numbers need points here: yair import csv reads such a file";

const fn field_count_hint(too_many: bool, is_open_end: bool) -> &'static str {
    match (too_many, is_open_end) {
        (true, _) => TOO_MANY,
        (false, true) => CUT_OFF,
        (false, false) => "",
    }
}

/// Header names that an error lists; a header of garbage may have thousands.
const LISTED_COLUMNS: usize = 20;

/// Which run an id speaks of.
#[derive(Debug, Default)]
pub(crate) struct RunIndex {
    ids: Vec<Box<[u8]>>,
    /// Looked up, never iterated.
    by_id: HashMap<Box<[u8]>, usize>,
}

impl RunIndex {
    pub(crate) fn new<'a>(ids: impl Iterator<Item = &'a str>) -> Self {
        let ids: Vec<Box<[u8]>> = ids.map(|id| id.as_bytes().into()).collect();
        let by_id = ids.iter().cloned().zip(0..).collect();
        Self { ids, by_id }
    }

    /// The run of an id. Most rows speak of the same run as the row before: one comparison.
    fn find(&self, id: &[u8], previous: Option<usize>) -> Option<usize> {
        match previous {
            Some(run) if *self.ids[run] == *id => previous,
            _ => self.by_id.get(id).copied(),
        }
    }
}

/// An open table whose header has been read.
#[derive(Debug)]
pub(crate) struct Table {
    columns: Columns,
    lines: Lines,
    fields: Fields,
    max_rows: usize,
}

/// Where each run's rows are.
#[derive(Debug)]
pub(crate) struct Survey {
    /// How many each run has.
    pub(crate) rows: Vec<usize>,
    /// Before the first of each run that has any.
    first: Vec<Position>,
    /// Do the rows of every run stand together?
    pub(crate) is_grouped: bool,
    /// Of each run, where every [`MARKED_ROWS`]th row stands, the first among them; none unless asked for.
    pub(crate) marks: Vec<Vec<Mark>>,
}

/// A row between two of which a run can be cut.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mark {
    /// Before the row.
    pub(crate) position: Position,
    pub(crate) t_s: f64,
}

/// Up to here every whole number is a double.
const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Rows from one mark to the next: what is read in vain when a cut falls between two is small beside a part,
/// and marks are small beside the rows.
pub(crate) const MARKED_ROWS: usize = 1024;

/// Where a table is and what its columns are called.
#[derive(Debug)]
struct Columns {
    file: PathBuf,
    names: Vec<String>,
}

impl Table {
    /// Opens a table and reads its header.
    pub(crate) fn open(file: &Path, expected: &'static str) -> Result<Self, DatasetError> {
        let mut table = Self::without_header(file, &[], expected)?;
        let Some(header) = table.lines.advance()? else {
            return Err(DatasetError::EmptyFile { file: file.to_owned(), expected: expected.to_owned() });
        };
        let number = header.number;
        std::str::from_utf8(header.bytes).map_err(|_| DatasetError::NotUtf8 { file: file.to_owned(), line: number })?;
        table.fields.split(header.bytes).map_err(|_| DatasetError::BadQuote { file: file.to_owned(), line: number })?;
        let name = |index| String::from_utf8_lossy(table.fields.get(header.bytes, index)).into_owned();
        table.columns.names = (0..table.fields.len()).map(name).collect();
        let mut sorted: Vec<_> = table.columns.names.iter().filter(|name| !name.is_empty()).collect();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(DatasetError::DuplicateColumn { file: file.to_owned(), column: shown(pair[0].as_bytes()) });
        }
        Ok(table)
    }

    /// Opens a table that has no header; `columns` are its columns in order.
    pub(crate) fn without_header(file: &Path, columns: &[&str], expected: &'static str) -> Result<Self, DatasetError> {
        let names = columns.iter().map(|&name| name.to_owned()).collect();
        let columns = Columns { file: file.to_owned(), names };
        Ok(Self { columns, lines: Lines::open(file, expected)?, fields: Fields::default(), max_rows: MAX_ROWS })
    }

    pub(crate) fn file(&self) -> &Path {
        &self.columns.file
    }

    /// Warns of the columns that are none of `known` (`run` is).
    pub(crate) fn warn_of_unknown(&self, known: &[&str], warnings: &mut Vec<Warning>) {
        for name in self.names() {
            if name != RUN_COLUMN && !known.contains(&name.as_str()) {
                warnings.push(Warning::UnknownColumn {
                    file: self.file().to_owned(),
                    column: shown(name.as_bytes()),
                    known: format!("{RUN_COLUMN}, {}", known.join(", ")),
                });
            }
        }
    }

    /// Where a column stands.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.names.iter().position(|found| found == name)
    }

    /// Where a column stands that must be there.
    pub(crate) fn require(&self, name: &str) -> Result<usize, DatasetError> {
        self.column(name).ok_or_else(|| self.missing(name))
    }

    /// The error that a column (or one of several alternatives) is missing.
    pub(crate) fn missing(&self, column: &str) -> DatasetError {
        let names = &self.columns.names;
        let mut found: Vec<_> = names.iter().take(LISTED_COLUMNS).map(|name| shown(name.as_bytes())).collect();
        if names.len() > LISTED_COLUMNS {
            found.push("…".to_owned());
        }
        DatasetError::MissingColumn {
            file: self.columns.file.clone(),
            column: column.to_owned(),
            found_columns: found.join(", "),
            hint: self.hint_of_missing(column),
        }
    }

    /// What a header that lacks a column may be instead.
    fn hint_of_missing(&self, column: &str) -> String {
        let (file, names) = (self.columns.file.display(), &self.columns.names);
        let import = format!("yair import csv {file} --out DIR");
        let others = [(';', "semicolons"), ('\t', "tabs"), ('|', "bars"), (' ', "spaces")];
        if let [only] = &names[..]
            && let Some((_, delimiter)) = others.into_iter().find(|(delimiter, _)| only.contains(*delimiter))
        {
            return format!("; {delimiter} separate the fields where commas are expected: {import} reads it");
        }
        let mapping = likely_mapping(names);
        if column == "theta_rad" && mapping.iter().all(|(quantity, _)| *quantity != Quantity::Heading) {
            return "; where no heading was measured, leave the column empty".to_owned();
        }
        let likely: Vec<String> = mapping
            .into_iter()
            .map(|(quantity, name)| format!("{}={}", quantity.key(), shown(name.as_bytes())))
            .collect();
        if likely.is_empty() { String::new() } else { format!("; likely {}: {import} reads it", likely.join(", ")) }
    }

    /// Names of the columns.
    pub(crate) fn names(&self) -> &[String] {
        &self.columns.names
    }

    /// Finds each run's rows, with marks by a column of times where one is given, and goes back to the first.
    pub(crate) fn survey(&mut self, runs: &RunIndex, marked_by: Option<usize>) -> Result<Survey, DatasetError> {
        let run_column = self.require(RUN_COLUMN)?;
        let start = self.lines.position();
        let count = runs.ids.len();
        let marks = if marked_by.is_some() { vec![Vec::new(); count] } else { Vec::new() };
        let mut survey = Survey { rows: vec![0; count], first: vec![start; count], is_grouped: true, marks };
        let mut previous = None;
        let mut rows = 0;
        loop {
            let position = self.lines.position();
            let Some(line) = self.lines.advance()? else { break };
            rows += 1;
            if rows > self.max_rows {
                return Err(DatasetError::TooManyRows { file: self.columns.file.clone(), max_rows: self.max_rows });
            }
            // The run comes first and without quotes in almost every table: no need to split then.
            let run = if run_column == 0 && !line.bytes.starts_with(b"\"") {
                let end = memchr::memchr(b',', line.bytes).unwrap_or(line.bytes.len());
                runs.find(&line.bytes[..end], previous)
            } else {
                None
            };
            let run = match run {
                Some(run) => run,
                None => self.columns.split(&mut self.fields, line)?.run(runs, run_column, previous)?,
            };
            if survey.rows[run] == 0 {
                survey.first[run] = position;
            } else if previous != Some(run) {
                survey.is_grouped = false;
            }
            if let Some(column) = marked_by
                && survey.rows[run].is_multiple_of(MARKED_ROWS)
            {
                let row = self.columns.split(&mut self.fields, line)?;
                let t_s = row.time_after(column, survey.marks[run].last().map(|mark| mark.t_s))?;
                survey.marks[run].push(Mark { position, t_s });
            }
            survey.rows[run] += 1;
            previous = Some(run);
        }
        self.lines.go_to(start)?;
        Ok(survey)
    }

    /// Calls `visit` with every row of a run, where these stand together.
    pub(crate) fn for_each_row_of(
        &mut self,
        run: usize,
        survey: &Survey,
        visit: impl FnMut(&Row<'_>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        self.for_each_row_from(survey.first[run], survey.rows[run], visit)
    }

    /// Calls `visit` with so many rows from a place on.
    pub(crate) fn for_each_row_from(
        &mut self,
        from: Position,
        rows: usize,
        mut visit: impl FnMut(&Row<'_>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        self.lines.go_to(from)?;
        for _ in 0..rows {
            // A file that someone cuts meanwhile ends sooner.
            let Some(row) = self.next_row()? else { break };
            visit(&row)?;
        }
        Ok(())
    }

    /// Calls `visit` with run and row for every row.
    pub(crate) fn for_each_row(
        &mut self,
        runs: &RunIndex,
        mut visit: impl FnMut(usize, &Row<'_>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let run_column = self.require(RUN_COLUMN)?;
        let mut previous = None;
        while let Some(row) = self.next_row()? {
            let run = row.run(runs, run_column, previous)?;
            previous = Some(run);
            visit(run, &row)?;
        }
        Ok(())
    }

    /// The next row of any run.
    pub(crate) fn next_row(&mut self) -> Result<Option<Row<'_>>, DatasetError> {
        match self.lines.advance()? {
            Some(line) => self.columns.split(&mut self.fields, line).map(Some),
            None => Ok(None),
        }
    }
}

impl Columns {
    fn split<'a>(&'a self, fields: &'a mut Fields, line: Line<'a>) -> Result<Row<'a>, DatasetError> {
        if fields.split(line.bytes).is_err() {
            return Err(DatasetError::BadQuote { file: self.file.clone(), line: line.number });
        }
        if fields.len() != self.names.len() {
            return Err(DatasetError::WrongFieldCount {
                file: self.file.clone(),
                line: line.number,
                found: fields.len(),
                expected: self.names.len(),
                hint: field_count_hint(fields.len() > self.names.len(), line.is_open_end).to_owned(),
            });
        }
        Ok(Row { columns: self, fields, line })
    }
}

/// One row.
#[derive(Debug)]
pub(crate) struct Row<'a> {
    columns: &'a Columns,
    fields: &'a Fields,
    line: Line<'a>,
}

impl Row<'_> {
    pub(crate) fn file(&self) -> PathBuf {
        self.columns.file.clone()
    }

    pub(crate) const fn line(&self) -> u64 {
        self.line.number
    }

    fn name(&self, column: usize) -> String {
        self.columns.names[column].clone()
    }

    /// A field as it stands.
    pub(crate) fn bytes(&self, column: usize) -> &[u8] {
        self.fields.get(self.line.bytes, column)
    }

    pub(crate) fn text(&self, column: usize) -> Result<&str, DatasetError> {
        std::str::from_utf8(self.bytes(column))
            .map_err(|_| DatasetError::NotUtf8 { file: self.file(), line: self.line() })
    }

    fn run(&self, runs: &RunIndex, column: usize, previous: Option<usize>) -> Result<usize, DatasetError> {
        if let Some(run) = runs.find(self.bytes(column), previous) {
            return Ok(run);
        }
        let run = shown(self.text(column)?.as_bytes());
        Err(DatasetError::UnknownRun { file: self.file(), line: self.line(), run })
    }

    /// A finite number.
    pub(crate) fn number(&self, column: usize) -> Result<f64, DatasetError> {
        let text = self.text(column)?;
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            parsed => {
                let (file, line, column) = (self.file(), self.line(), self.name(column));
                let found = shown(text.as_bytes());
                Err(match parsed {
                    Ok(_) => DatasetError::NotFinite { file, line, column, found },
                    Err(_) => DatasetError::NotANumber { file, line, column, found },
                })
            }
        }
    }

    /// A finite number, or nothing where the field is empty.
    pub(crate) fn optional_number(&self, column: usize) -> Result<Option<f64>, DatasetError> {
        if self.bytes(column).is_empty() { Ok(None) } else { self.number(column).map(Some) }
    }

    /// A whole number.
    pub(crate) fn count(&self, column: usize) -> Result<i64, DatasetError> {
        let text = self.text(column)?;
        let whole = |_| match text.parse::<f64>() {
            // 12.0, as spreadsheets and pandas write counts.
            Ok(number) if number.fract() == 0.0 && number.abs() <= LARGEST_WHOLE && text.contains('.') => {
                Ok(number as i64)
            }
            _ => Err(()),
        };
        let is_count = |count: &i64| count.unsigned_abs() <= MAX_COUNT;
        let parsed = text.parse().or_else(whole);
        parsed.ok().filter(is_count).ok_or_else(|| {
            let (file, line, column) = (self.file(), self.line(), self.name(column));
            let found = shown(text.as_bytes());
            match text.parse::<f64>() {
                Ok(number) if !number.is_finite() => DatasetError::NotFinite { file, line, column, found },
                _ => DatasetError::NotACount { file, line, column, found },
            }
        })
    }

    /// One standard deviation: nothing where the field is empty or 0.
    pub(crate) fn sigma(&self, column: usize) -> Result<Option<f64>, DatasetError> {
        match self.optional_number(column)? {
            Some(value) if value < 0.0 => Err(DatasetError::NotPhysical {
                file: self.file(),
                line: self.line(),
                key: self.name(column),
                value,
                expected: "a positive number, or nothing where it is unknown",
            }),
            known => Ok(known.filter(|sigma| *sigma > 0.0)),
        }
    }

    /// A time after the run's time before.
    pub(crate) fn time_after(&self, column: usize, previous_s: Option<f64>) -> Result<f64, DatasetError> {
        let t_s = self.time_from(column, previous_s)?;
        if previous_s == Some(t_s) { Err(self.duplicate_instant(column, t_s)) } else { Ok(t_s) }
    }

    /// A time not before the run's time before.
    pub(crate) fn time_from(&self, column: usize, previous_s: Option<f64>) -> Result<f64, DatasetError> {
        let t_s = self.number(column)?;
        match previous_s {
            Some(previous_s) if previous_s > t_s => Err(DatasetError::TimeRunsBackwards {
                file: self.file(),
                line: self.line(),
                column: self.name(column),
                t_s,
                previous_s,
            }),
            _ => Ok(t_s),
        }
    }

    pub(crate) fn duplicate_instant(&self, column: usize, t_s: f64) -> DatasetError {
        DatasetError::DuplicateInstant { file: self.file(), line: self.line(), column: self.name(column), t_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_more_rows_than_are_read_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("odometry.csv");
        std::fs::write(&file, "run,t_s\na,0\na,1\na,2\n").expect("written");
        let runs = RunIndex::new(["a"].into_iter());
        let survey = |max_rows: usize| {
            let mut table = Table::open(&file, "a header").expect("a table");
            table.max_rows = max_rows;
            table.survey(&runs, None).map(|survey| survey.rows)
        };
        assert_eq!(survey(3).expect("read"), [3]);
        let refused = survey(2).expect_err("too many").to_string();
        assert!(refused.contains("odometry.csv: more than 2 rows"), "{refused}");
    }
}

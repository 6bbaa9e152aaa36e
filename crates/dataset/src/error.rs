//! Why a dataset was not read, written or imported: one variant a reason that a caller can act on.
//!
//! Every message is one line that names the file, the line and the column where they exist, and what was
//! expected there. Text that was found in a file is shown clipped and escaped, so that a gigabyte of garbage
//! stays one line too.

use std::path::PathBuf;

use crate::settings::SHOWN_CHARS;

/// Why a dataset was not read, written or imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The operating system refused.
    #[error("{path}: {source}")]
    Io {
        /// What was to be read or written.
        path: PathBuf,
        /// Its reason.
        source: std::io::Error,
    },
    /// A folder was expected.
    #[error("{path}: {}; expected {expected}", if path.exists() { "is a file, where a folder belongs" } else { "no such folder" })]
    NotAFolder {
        /// What was given.
        path: PathBuf,
        /// What the folder should hold.
        expected: &'static str,
    },
    /// A file was expected, and this is a folder or a device.
    #[error("{file}: {}; expected {expected}", if file.is_dir() { "is a folder, where a file belongs" } else { "not a file" })]
    NotAFile {
        /// What was given.
        file: PathBuf,
        /// What the file should hold.
        expected: &'static str,
    },
    /// A file that every dataset needs is not there.
    #[error("{file}: no such file; expected {expected}")]
    MissingFile {
        /// Where it should be.
        file: PathBuf,
        /// What it should hold.
        expected: &'static str,
    },
    /// No table of an instrument is there, and no gyroscope stands beside the wheels.
    #[error(
        "{dir}: no truth; expected at least one of truth.csv, displacement.csv, points.csv and wheel_reference.csv next to odometry.csv, or revisit.csv, distance.csv, wall.csv, or gyro_radps in it"
    )]
    NoTruth {
        /// The dataset's folder.
        dir: PathBuf,
    },
    /// There is nothing of the given format.
    #[error("{path}: nothing to import; expected {expected}")]
    NothingToImport {
        /// What was given.
        path: PathBuf,
        /// What the importer looks for.
        expected: &'static str,
    },

    /// A file without any line.
    #[error("{file}: empty file; expected {expected}")]
    EmptyFile {
        /// The file.
        file: PathBuf,
        /// What it should hold.
        expected: String,
    },
    /// A file that is read as a whole is larger than any such file can sensibly be.
    #[error("{file}: longer than {limit_bytes} bytes; is this the right file?")]
    FileTooLong {
        /// The file.
        file: PathBuf,
        /// The most that is accepted, bytes.
        limit_bytes: u64,
    },
    /// A table has more rows than are read.
    #[error("{file}: more than {max_rows} rows; split the dataset by runs")]
    TooManyRows {
        /// The file.
        file: PathBuf,
        /// The most that is accepted.
        max_rows: usize,
    },
    /// A link of a dataset leads out of its folder.
    #[error("{file}: a link to {target}, outside of the dataset; put a copy of the file there")]
    LinkOutside {
        /// The link.
        file: PathBuf,
        /// Where it leads.
        target: PathBuf,
    },
    /// A line, or one record of a file that has no lines, is longer than any record can sensibly be.
    #[error("{file}:{line}: line longer than {limit_bytes} bytes; is this the right file?")]
    LineTooLong {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The most that is accepted, bytes.
        limit_bytes: usize,
    },
    /// The bytes are not text.
    #[error("{file}:{line}: not UTF-8 text; save the file as UTF-8")]
    NotUtf8 {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
    },
    /// A quoted field does not end, or goes on after its end.
    #[error("{file}:{line}: a quoted field must end on its line, before a comma; write a quote inside as \"\"")]
    BadQuote {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
    },

    /// `dataset.toml` is not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{file}:{line}: {message}")]
    Toml {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong and what was expected.
        message: String,
    },
    /// The dataset is of a later format.
    #[error("{file}:{line}: format = {found} is not known here; expected format = 1")]
    UnsupportedFormat {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The format number found.
        found: i64,
    },
    /// A known key with another unit.
    #[error("{file}:{line}: key {key} is not in SI units; expected {expected}")]
    WrongUnit {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The key found.
        key: String,
        /// The key expected.
        expected: &'static str,
    },
    /// A key that this dataset cannot do without; there is no default for what a robot must supply.
    #[error("{file}:{line}: missing key {key}; {why}")]
    MissingKey {
        /// The file.
        file: PathBuf,
        /// Line of the table that lacks it, from 1.
        line: u64,
        /// The key.
        key: &'static str,
        /// Who needs it.
        why: &'static str,
    },
    /// Six numbers that no covariance can have.
    #[error(
        "{file}:{line}: cov_xx to cov_tt are no covariance: {why}; expected variances in m² and rad², covariances below them, \
         and zeros or empty cells where nothing is known"
    )]
    ImpossibleCovariance {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong.
        why: &'static str,
    },
    /// A number that nothing physical can have.
    #[error("{file}:{line}: {key} = {value}; expected {expected}")]
    NotPhysical {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Key or column.
        key: String,
        /// The value found, SI.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
    /// An id that tables could not speak of.
    #[error("{file}:{line}: id \"{id}\": {expected}")]
    BadId {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The id, escaped.
        id: String,
        /// What is accepted.
        expected: &'static str,
    },

    /// A table lacks a column.
    #[error("{file}:1: missing column {column}; the columns found are: {found_columns}{hint}")]
    MissingColumn {
        /// The file.
        file: PathBuf,
        /// The column, or the alternatives.
        column: String,
        /// The header, clipped.
        found_columns: String,
        /// What was likely meant; empty, or from its separator on.
        hint: String,
    },
    /// A table names a column twice.
    #[error("{file}:1: column {column} occurs twice; expected each column once")]
    DuplicateColumn {
        /// The file.
        file: PathBuf,
        /// The column.
        column: String,
    },
    /// A row has more or fewer fields than the header.
    #[error("{file}:{line}: {found} fields; expected {expected} as in the header{hint}")]
    WrongFieldCount {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Fields found.
        found: usize,
        /// Fields expected.
        expected: usize,
        /// What may have happened; empty, or from its separator on.
        hint: String,
    },
    /// A field is not a number.
    #[error(
        "{file}:{line}: column {column}: \"{found}\" is not a number; expected one like -0.125 or 1e-3{}",
        with_comma(found)
    )]
    NotANumber {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The text, clipped.
        found: String,
    },
    /// A count is not a whole number.
    #[error("{file}:{line}: column {column}: \"{found}\" is not a count; expected a whole number of at most 64 bits")]
    NotACount {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The text, clipped.
        found: String,
    },
    /// A number is NaN or infinite.
    #[error("{file}:{line}: column {column}: \"{found}\" is not finite; leave out the rows that were not measured")]
    NotFinite {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The text, clipped.
        found: String,
    },
    /// A further channel of the odometry begins within a run.
    #[error(
        "{file}:{line}: column {column}: a value, though the run's first row has none; expected one in every row of a run or in none"
    )]
    SparseColumn {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The column.
        column: &'static str,
    },
    /// A row of a run is earlier than the one before it.
    #[error(
        "{file}:{line}: column {column}: time runs backwards, {t_s} s after {previous_s} s; expected each run's rows in time order"
    )]
    TimeRunsBackwards {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// Time of the row, seconds.
        t_s: f64,
        /// Time of the run's row before, seconds.
        previous_s: f64,
    },
    /// Two rows of a run (and of a marked point) speak of one instant.
    #[error("{file}:{line}: column {column}: a second row at {t_s} s in the same run; expected each instant once")]
    DuplicateInstant {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// Time of both rows, seconds.
        t_s: f64,
    },
    /// A displacement ends before it begins.
    #[error("{file}:{line}: column t1_s: the interval ends at {t1_s} s; expected an end after its start at {t0_s} s")]
    EmptyInterval {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Start, seconds.
        t0_s: f64,
        /// End, seconds.
        t1_s: f64,
    },

    /// A table speaks of a run that `dataset.toml` does not list.
    #[error(
        "{file}:{line}: column run: run \"{run}\" is not in dataset.toml; expected one [[run]] with its id for every run of the tables"
    )]
    UnknownRun {
        /// The table.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The id, clipped.
        run: String,
    },
    /// A row of `points.csv` speaks of a point that `dataset.toml` does not list.
    #[error("{file}:{line}: column point: point \"{point}\" is not in dataset.toml; the points there are: {known}")]
    UnknownPoint {
        /// The table.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The id, clipped.
        point: String,
        /// The ids of all `[[point]]`.
        known: String,
    },
    /// A run of `dataset.toml` has no odometry.
    #[error("{file}: no rows for run \"{run}\" of dataset.toml; expected odometry for every run")]
    RunWithoutRows {
        /// The table.
        file: PathBuf,
        /// The run's id.
        run: String,
    },
    /// A run that was counted was never seen from outside.
    #[error("{file}:{line}: run \"{run}\" has odometry but no rows in {tables}; expected some, or no such run")]
    RunWithoutTruth {
        /// `dataset.toml`.
        file: PathBuf,
        /// Line of the `[[run]]`, from 1.
        line: u64,
        /// The run's id.
        run: String,
        /// The truth tables of this dataset.
        tables: String,
    },

    /// Another format's file does not say what that format says.
    #[error("{file}:{line}: {message}")]
    Foreign {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong and what was expected.
        message: String,
    },

    /// Two readings of a file are nearly as likely.
    #[error("{file}: {what} may be {readings}, and nothing here decides which; add {flag}")]
    Undecided {
        /// The file.
        file: PathBuf,
        /// What is open.
        what: String,
        /// The readings.
        readings: String,
        /// The flag that settles it.
        flag: String,
    },
    /// A log does not say what only its owner knows of the robot.
    #[error("{file}: {why}, and no log says the robot's own numbers; give {flags}")]
    RobotNotGiven {
        /// The file.
        file: PathBuf,
        /// What needs them.
        why: String,
        /// The flags with what stands behind each.
        flags: String,
    },

    /// There is something where a dataset was to be written.
    #[error("{path}: already exists and {why}; nothing was written: choose another folder, or move it away")]
    AlreadyExists {
        /// The folder.
        path: PathBuf,
        /// Why it is not replaced.
        why: String,
    },
    /// The dataset in memory is not one that could be read back; nothing was written.
    #[error("run \"{run}\": {what}; nothing was written")]
    RunNotWritable {
        /// The run's id, escaped.
        run: String,
        /// What is wrong with it.
        what: String,
    },
    /// The robot or the marked points in memory are not ones that could be read back; nothing was written.
    #[error("{what}; nothing was written")]
    NotWritable {
        /// What is wrong.
        what: String,
    },
}

/// What is said of a number with a decimal comma.
fn with_comma(found: &str) -> &'static str {
    let is_decimal = found.contains(',') && found.replacen(',', ".", 1).parse::<f64>().is_ok();
    if is_decimal { ", with a decimal point and no comma" } else { "" }
}

/// Text found in a file as a message may show it: on one line, escaped and clipped.
pub(crate) fn shown(found: &[u8]) -> String {
    // A character takes at most four bytes: one more of them tells whether there is more.
    let head = String::from_utf8_lossy(&found[..found.len().min(4 * (SHOWN_CHARS + 1))]);
    let clipped: String = head.chars().take(SHOWN_CHARS).flat_map(char::escape_debug).collect();
    if head.chars().nth(SHOWN_CHARS).is_some() { clipped + "…" } else { clipped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn garbage_is_shown_on_one_short_line() {
        assert_eq!(shown(b"1.5x"), "1.5x");
        assert_eq!(shown(b"a\nb\"\xff"), "a\\nb\\\"\u{fffd}");
        let long = shown(&vec![b'7'; 1 << 20]);
        assert_eq!(long.chars().count(), SHOWN_CHARS + 1);
        assert!(long.ends_with('…'));
        assert_eq!(shown(&[b'7'; SHOWN_CHARS]).len(), SHOWN_CHARS);
    }

    #[test]
    fn an_error_fits_where_results_are_passed_around() {
        // Clippy's border for a large error; a box is due beyond it.
        assert!(size_of::<DatasetError>() <= 128, "{}", size_of::<DatasetError>());
    }
}

//! What a person or a script sees: results on standard output, everything else on standard error.

use std::collections::BTreeSet;
use std::error::Error;
use std::fmt;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Effects, Style};
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use dataset::{Dataset, Warning};
use indicatif::{HumanCount, HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;

use crate::plain_text::{printable, printable_json, printable_message};
use crate::signals::Signals;
use crate::sparse_lines::SparseLines;
use crate::standard_output::StandardOutput;
use crate::watch::Watch;

/// Why a subcommand failed: one line for the user.
pub(crate) type Failure = Box<dyn Error>;

/// Exit code of a command that was stopped, by convention 128 + SIGINT; another signal has its own
/// ([`Signals::exit_code`]).
pub(crate) const INTERRUPTED: u8 = 130;

/// The terminal as the user's flags ask for it, or what a calling program is told in its place.
pub(crate) struct Terminal {
    pub(crate) json: bool,
    pub(crate) quiet: bool,
    output: StandardOutput,
    signals: Arc<Signals>,
    transcript: Option<Transcript>,
    /// The JSON document and the message of a failure: both are one document at the end.
    answer: Mutex<(Option<String>, Option<String>)>,
}

/// What is kept for a calling program.
struct Transcript {
    watch: Arc<Watch>,
    printed: Mutex<Printed>,
}

/// What a process would have printed.
#[derive(Default)]
pub(crate) struct Printed {
    /// The JSON document.
    pub(crate) document: Option<String>,
    pub(crate) remarks: Vec<String>,
    /// The message of a failure.
    pub(crate) failure: Option<String>,
}

impl Transcript {
    fn printed(&self) -> MutexGuard<'_, Printed> {
        self.printed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A line above, below and under the header, and none between rows.
const RULES: TableStyle = {
    let rule = LineStyle::new('─', '─', '─', '─');
    TableStyle::new().top_border(rule).header_separator(rule).bottom_border(rule)
};

/// Tables stay within this many columns, whatever the window.
const TABLE_WIDTH: u16 = 100;

impl Terminal {
    pub(crate) fn new(json: bool, quiet: bool, signals: Arc<Signals>) -> Self {
        Self { json, quiet, output: StandardOutput::default(), signals, transcript: None, answer: Mutex::default() }
    }

    /// Nothing is printed: [`Self::into_transcript`] has it.
    pub(crate) fn transcript(watch: Arc<Watch>) -> Self {
        let transcript = Some(Transcript { watch, printed: Mutex::default() });
        Self { transcript, ..Self::new(true, false, Arc::default()) }
    }

    /// The document, the remarks and the failure that were kept.
    pub(crate) fn into_transcript(self) -> Printed {
        self.transcript
            .map(|transcript| transcript.printed.into_inner().unwrap_or_else(PoisonError::into_inner))
            .unwrap_or_default()
    }

    /// Set when the command is to stop: by a calling program, or by a signal where `on_signal`, which ends
    /// the process at once otherwise.
    pub(crate) fn stop_flag(&self, on_signal: bool) -> Arc<AtomicBool> {
        match &self.transcript {
            Some(transcript) => transcript.watch.stop_flag(),
            None if on_signal => self.signals.stop_flag(self.quiet),
            None => Arc::default(),
        }
    }

    /// A result for people; not printed beside JSON.
    pub(crate) fn say(&self, text: &str) -> Result<(), Failure> {
        if !self.json {
            self.print(format!("{}\n", printable(text)).as_bytes());
        }
        Ok(())
    }

    /// What was written where, or read as what; nothing beside JSON, and when quiet.
    pub(crate) fn note(&self, text: &str) -> Result<(), Failure> {
        if self.quiet { Ok(()) } else { self.say(text) }
    }

    /// A result whose lines begin with how grave they are; where somebody watches, this word has a colour.
    pub(crate) fn say_by_severity(&self, text: &str) -> Result<(), Failure> {
        if self.json {
            return Ok(());
        }
        let has_colours = AutoStream::choice(&std::io::stdout()) != ColorChoice::Never;
        let coloured = |line: &str| match has_colours {
            true => in_colour(line),
            false => line.to_owned(),
        };
        let lines: Vec<String> = printable(text).lines().map(coloured).collect();
        self.print(format!("{}\n", lines.join("\n")).as_bytes());
        Ok(())
    }

    /// Bytes on standard output as they are. Where they cannot be written, the command goes on, since files
    /// are results too, and [`Self::exit_code`] says so at its end.
    pub(crate) fn print(&self, text: &[u8]) {
        self.output.print(text);
    }

    /// The exit code of a command that ended with `code`, and the message where its output is not all there.
    pub(crate) fn exit_code(&self, code: u8) -> u8 {
        if self.json && self.transcript.is_none() && !self.signals.is_ending() {
            let answer = self.answer.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(text) = one_document(answer.0.as_deref(), answer.1.as_deref()) {
                self.print(format!("{}\n", printable_json(&text)).as_bytes());
            }
        }
        match self.output.failed() {
            Some(why) if code != 1 => {
                self.failure(&why);
                self.signals.exit_code(1)
            }
            _ => self.signals.exit_code(code),
        }
    }

    /// The one JSON document, when it is asked for.
    pub(crate) fn document(&self, document: &impl Serialize) -> Result<(), Failure> {
        if self.json {
            let text = serde_json::to_string_pretty(document)?;
            match &self.transcript {
                Some(transcript) => transcript.printed().document = Some(text),
                None => self.answer.lock().unwrap_or_else(PoisonError::into_inner).0 = Some(text),
            }
        }
        Ok(())
    }

    /// A remark on standard error; where somebody watches, the word that says how grave it is has a colour.
    pub(crate) fn remark(&self, text: &str) {
        if let Some(transcript) = &self.transcript {
            transcript.printed().remarks.push(text.to_owned());
        } else if !self.quiet {
            let text = &*printable_message(text);
            let text = match text.split_once(": ") {
                Some(("error", rest)) => format!("{ERROR}error{ERROR:#}: {rest}"),
                Some(("warning", rest)) => format!("{WARNING}warning{WARNING:#}: {rest}"),
                _ => text.to_owned(),
            };
            let _ = writeln!(anstream::stderr(), "{text}");
        }
    }

    /// The one message of a failure, on standard error even when quiet.
    pub(crate) fn failure(&self, message: &str) {
        let message = in_plain_words(&printable_message(&message.replace('\n', "; ")));
        if let Some(transcript) = &self.transcript {
            transcript.printed().failure = Some(message);
            return;
        }
        if self.signals.is_ending() {
            return;
        }
        let _ = writeln!(anstream::stderr(), "{ERROR}error{ERROR:#}: {message}");
        self.answer.lock().unwrap_or_else(PoisonError::into_inner).1 = Some(message);
    }

    /// Bad usage, which clap has shown already: what `--json` says of it.
    pub(crate) fn usage_error(&self, message: &str) {
        self.answer.lock().unwrap_or_else(PoisonError::into_inner).1 = Some(printable_message(message).into_owned());
    }

    /// Progress over `total` steps with the time left: a bar where somebody watches, else a line now and
    /// then; nothing when quiet.
    pub(crate) fn progress(&self, total: u64, what: &str) -> ProgressBar {
        if let Some(hidden) = self.hidden_progress(total, what) {
            return hidden;
        }
        let template =
            if std::io::stderr().is_terminal() { "{msg} {wide_bar} {count}, {left}" } else { "{msg}: {count}, {left}" };
        bar(total, template).with_message(what.to_owned())
    }

    /// Progress that nobody sees here: when quiet, or where another program follows it.
    fn hidden_progress(&self, total: u64, what: &str) -> Option<ProgressBar> {
        (self.quiet || self.transcript.is_some()).then(|| {
            let hidden = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
            let hidden = hidden.with_message(what.to_owned());
            if let Some(transcript) = &self.transcript {
                transcript.watch.follow(&hidden);
            }
            hidden
        })
    }

    /// Progress of a few stages that take long each: what is done now, and the time so far. What is left is
    /// not forecast: how long a stage takes depends on the log. [`advance`] says what is done.
    pub(crate) fn stages(&self, what: &'static str) -> ProgressBar {
        if let Some(hidden) = self.hidden_progress(PARTS, what) {
            return hidden;
        }
        let template = if std::io::stderr().is_terminal() {
            "{prefix} {wide_bar} {sofar}: {msg}"
        } else {
            "{prefix}: {sofar}: {msg}"
        };
        bar(PARTS, template).with_prefix(what)
    }
}

/// A document with the message of a failure as its first key; `None` where there is neither.
pub(crate) fn one_document(document: Option<&str>, error: Option<&str>) -> Option<String> {
    let key = error.map(|error| format!("\"error\": {}", serde_json::Value::from(error)));
    match (document, key) {
        (Some(document), Some(key)) => {
            let rest = document.strip_prefix('{').map(str::trim_start);
            Some(match rest {
                Some("}") | None => format!("{{\n  {key}\n}}"),
                Some(rest) => format!("{{\n  {key},\n  {rest}"),
            })
        }
        (Some(document), None) => Some(document.to_owned()),
        (None, key) => key.map(|key| format!("{{\n  {key}\n}}")),
    }
}

/// A line with its first word in the colour of a severity, where it is one.
fn in_colour(line: &str) -> String {
    let styles = [("error", ERROR), ("warning", WARNING), ("hint", HINT)];
    let start = line.len() - line.trim_start().len();
    let found = styles.iter().find(|(word, _)| {
        let rest = line[start..].strip_prefix(word);
        rest.is_some_and(|rest| rest.starts_with([' ', ':']))
    });
    match found {
        Some((word, style)) => {
            format!("{}{style}{word}{style:#}{}", &line[..start], &line[start + word.len()..])
        }
        None => line.to_owned(),
    }
}

/// Parts in which stages are counted.
const PARTS: u64 = 1000;

/// A stage begins, with the share of the whole that is done.
pub(crate) fn advance(bar: &ProgressBar, stage: &'static str, done: f64) {
    bar.set_position((done * PARTS as f64) as u64);
    bar.set_message(stage);
}

/// A bar where somebody watches, else a line now and then; both go on by themselves while a step takes long.
fn bar(total: u64, template: &str) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::term_like_with_hz(Box::new(SparseLines::new()), 1)
    };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let count = |state: &ProgressState, text: &mut dyn fmt::Write| {
        let _ = match state.len() {
            // How many there are is not known before the first ones are done.
            None | Some(0) => text.write_str("the first ones"),
            Some(all) => write!(text, "{} of {}", HumanCount(state.pos()), HumanCount(all)),
        };
    };
    let so_far = |state: &ProgressState, text: &mut dyn fmt::Write| {
        let _ = write!(text, "{} so far", HumanDuration(state.elapsed()));
    };
    let left = move |state: &ProgressState, text: &mut dyn fmt::Write| {
        // Before the first step nobody knows.
        let _ = match state.pos() {
            0 => return so_far(state, text),
            // By the mean pace so far: what the last steps took says nothing where one takes long.
            done => {
                let to_do = state.len().unwrap_or(done).saturating_sub(done) as f64;
                write!(text, "{} left", HumanDuration(state.elapsed().mul_f64(to_do / done as f64)))
            }
        };
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("count", count).with_key("left", left).with_key("sofar", so_far));
    }
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

/// Colours of what stands before a message; `anstream` drops them where nobody watches or NO_COLOR is set.
const ERROR: Style = AnsiColor::Red.on_default().effects(Effects::BOLD);
const WARNING: Style = AnsiColor::Yellow.on_default().effects(Effects::BOLD);
const HINT: Style = AnsiColor::Cyan.on_default();

/// What the system says of a mistaken path, as a person would: every reader of files ends here.
fn in_plain_words(message: &str) -> String {
    const WORDS: [(&str, &str); 4] = [
        ("Is a directory (os error 21)", "it is a folder, where a file belongs"),
        ("Not a directory (os error 20)", "a part of this path is a file, where a folder belongs"),
        (
            "Directory not empty (os error 39)",
            "another process has written there meanwhile; nothing was written: choose another name",
        ),
        ("entity not found", "there is no folder in which it could be made"),
    ];
    WORDS.iter().fold(message.to_owned(), |message, (system, plain)| message.replace(system, plain))
}

/// A table whose first `left` columns are text and whose others are numbers.
pub(crate) fn table(headers: &[&str], left: usize) -> Table {
    let mut table = Table::new();
    table.load_style(RULES).set_content_arrangement(ContentArrangement::Dynamic).set_width(TABLE_WIDTH);
    table.set_header(headers);
    for (position, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 1));
        if position >= left {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// Reads datasets and passes their warnings on; a folder of datasets means all of them.
pub(crate) fn read_datasets(paths: &[PathBuf], terminal: &Terminal) -> Result<Vec<Dataset>, Failure> {
    let paths = datasets_at(paths)?;
    let bar = terminal.stages("reading");
    let read = |(number, path): (usize, &PathBuf)| {
        advance(&bar, "datasets", number as f64 / paths.len() as f64);
        let loaded = dataset::read(path)?;
        bar.suspend(|| warn(path, &loaded.warnings, terminal));
        let mut dataset = loaded.dataset;
        let runs = dataset.leave_out_gyros_beside_poses();
        if runs > 0 {
            let what = "poses with headings say more, and calibrate, check and diagnose leave the gyro out";
            bar.suspend(|| terminal.remark(&format!("{}: the gyro of {runs} runs: {what}", path.display())));
        }
        dataset.provenance.name.get_or_insert_with(|| folder_name(path));
        Ok(dataset)
    };
    let all = paths.iter().enumerate().map(read).collect();
    bar.finish_and_clear();
    all
}

/// Whether a folder is a dataset.
pub(crate) fn is_dataset(path: &Path) -> bool {
    path.join("dataset.toml").exists()
}

/// The command that imports a file, by its ending.
pub(crate) fn import_command(path: &Path) -> String {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let (format, more) = match &ending[..] {
        "mcap" | "db3" | "bag" | "zstd" => ("ros2", " --wheel METRES --base METRES"),
        "tuple" => ("censi", ""),
        "tum" => ("tum", " --odometry FILE --wheel METRES --base METRES"),
        _ if path.is_dir() => ("ros2", " --wheel METRES --base METRES"),
        _ => ("csv", " --wheel METRES --base METRES"),
    };
    let out = path.file_stem().map_or_else(|| "mine".to_owned(), |stem| stem.to_string_lossy().into_owned());
    format!("yair import {format} {} --out {out}{more}", path.display())
}

/// What to do with a file where a dataset, which is a folder, belongs.
fn not_imported(path: &Path) -> String {
    let place = path.display();
    if path.extension().is_some_and(|ending| ending == "toml") {
        return format!("{place}: it is a file; a dataset is the folder of a dataset.toml");
    }
    format!("{place}: it is a file, and no dataset; import it first: {}", import_command(path))
}

/// A dataset, or those in a folder of datasets, by name.
fn datasets_in(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    if path.is_file() {
        return Err(not_imported(path).into());
    }
    if !path.is_dir() || is_dataset(path) {
        return Ok(vec![path.to_owned()]);
    }
    let unreadable = |error| format!("{}: {error}", path.display());
    let mut inside = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?.path();
        if is_dataset(&entry) {
            inside.push(entry);
        }
    }
    inside.sort();
    // Nothing inside: reading the folder as a dataset says what is missing.
    Ok(if inside.is_empty() { vec![path.to_owned()] } else { inside })
}

/// The datasets that paths stand for, each once.
pub(crate) fn datasets_at(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut all = Vec::with_capacity(paths.len());
    for path in paths {
        all.extend(datasets_in(path)?);
    }
    refuse_doubles(&all)?;
    Ok(all)
}

/// The same runs twice would halve every variance.
pub(crate) fn refuse_doubles(paths: &[PathBuf]) -> Result<(), Failure> {
    let mut seen = BTreeSet::new();
    match paths.iter().find(|path| path.canonicalize().is_ok_and(|real| !seen.insert(real))) {
        None => Ok(()),
        Some(twice) => {
            Err(format!("{}: the same dataset is given twice; give each session once", twice.display()).into())
        }
    }
}

pub(crate) fn folder_name(path: &Path) -> String {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    full.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// A value in its table cell; a dash when there is none.
pub(crate) fn cell(value: Option<f64>, scale: f64, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{:.decimals$}", value * scale))
}

/// Passes on what is no error but should be known of a dataset.
pub(crate) fn warn(path: &Path, warnings: &[Warning], terminal: &Terminal) {
    for warning in warnings {
        terminal.remark(&format!("warning: {}: {warning}", path.display()));
    }
}

/// Ids of runs in a message.
const SHOWN_RUNS: usize = 6;

/// Ids of runs as messages show them.
pub(crate) fn listed_ids<'a>(ids: impl Iterator<Item = &'a str>) -> String {
    let all: Vec<&str> = ids.collect();
    let more = if all.len() > SHOWN_RUNS { ", …" } else { "" };
    all[..all.len().min(SHOWN_RUNS)].join(", ") + more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_and_a_failure_are_one_document() {
        let of = |document: Option<&str>, error: Option<&str>| {
            one_document(document, error).map(|text| serde_json::from_str::<serde_json::Value>(&text).expect("JSON"))
        };
        let json = |text: &str| serde_json::from_str(text).ok();
        assert_eq!(of(None, None), None);
        assert_eq!(of(Some("{\n  \"a\": 1\n}"), None), json("{\"a\": 1}"));
        assert_eq!(of(None, Some("x \"y\"\n")), json("{\"error\": \"x \\\"y\\\"\\n\"}"));
        assert_eq!(of(Some("{\n  \"a\": {}\n}"), Some("x")), json("{\"error\": \"x\", \"a\": {}}"));
        assert_eq!(of(Some("{}"), Some("x")), json("{\"error\": \"x\"}"));
    }

    #[test]
    fn the_first_word_of_a_line_has_the_colour_of_its_severity() {
        assert_eq!(in_colour(" error  a"), format!(" {ERROR}error{ERROR:#}  a"));
        assert_eq!(in_colour("hint: b"), format!("{HINT}hint{HINT:#}: b"));
        for line in ["errors", " severity  problem", "", "─────", "an error"] {
            assert_eq!(in_colour(line), line);
        }
    }
}

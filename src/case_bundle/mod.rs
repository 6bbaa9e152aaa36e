//! A log as a small file to send: `case.toml`, which says what the check said, and the thinned dataset
//! without names, dates and origin. A bundle is written only where the check says the same of it.

mod anonymous;
mod record;
mod thinning;
mod zip;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use dataset::{Dataset, Existing};
use preflight::Preflight;

use crate::terminal::Failure;
use thinning::{Part, rows};
use zip::{Packed, packed, unpacked};

pub(crate) use record::{Case, Session, severity};
use record::{Recorded, Size};

/// Bytes of a bundle: what forums and trackers of issues take as an attachment.
const MAX_BYTES: usize = 200_000;

/// Bytes of a bundle that cannot be smaller; beyond them nothing is written, nor read.
const MAX_BYTES_UNTHINNED: usize = 16_000_000;

/// Parts that are checked: seconds each, a minute in all.
const MAX_CHECKED_PARTS: usize = 40;

/// Parts above [`MAX_BYTES`] that are checked where no smaller part has the same problems.
const MAX_CHECKED_LARGE_PARTS: usize = 8;

/// Bytes a row differ from part to part: what is likely to be so many times too large is not packed.
const LIKELY_TOO_LARGE: f64 = 1.5;

const CASE: &str = "case.toml";

/// Bytes of a bundle with what is in it.
pub(crate) struct Bundle {
    pub(crate) bytes: Vec<u8>,
    pub(crate) case: Case,
}

impl Bundle {
    pub(crate) fn is_small(&self) -> bool {
        self.bytes.len() <= MAX_BYTES
    }
}

/// The ids of problems, each once: what a bundle must reproduce.
pub(crate) fn ids(found: &Preflight) -> BTreeSet<&str> {
    found.problems.iter().map(|problem| problem.id).collect()
}

/// The bundle of a log that was checked; `sessions` says how each of its datasets was read, `command` is what
/// was typed, without paths. `advance` is called with the share that is done.
///
/// # Errors
/// Where no bundle has the problems that were found.
pub(crate) fn bundle(
    datasets: &[Dataset],
    found: &Preflight,
    sessions: Vec<Session>,
    command: &str,
    advance: &mut dyn FnMut(f64),
) -> Result<Bundle, Failure> {
    let all = anonymous::anonymous(datasets);
    let mut case = Case::new(command, sessions, Size::of(&all));
    let whole = attempt(&all, &mut case)?;
    let checked = calib::check_and_fit(&whole.reread);
    if ids(&checked) != ids(found) {
        let [before, after] = [found, &checked].map(|of| list(&ids(of)));
        let why =
            format!("with names, dates and origin removed the problems are {after}, and before they are {before}");
        return Err(format!("no bundle is written: {why}").into());
    }
    case.problems = checked.problems.iter().map(Recorded::from).collect();
    let bytes_a_row = whole.bytes.len() as f64 / rows(&all).max(1) as f64;
    let reproduces = |reread: &[Dataset]| ids(&calib::check_and_fit(reread)) == ids(found);
    let (mut tried, mut too_large) = (0, Vec::new());
    if whole.bytes.len() > MAX_BYTES {
        for part in Part::all(all.iter().map(|dataset| dataset.runs.len()).max().unwrap_or(0)) {
            let Some(thinned) = part.of(&all, &checked.problems) else { continue };
            if rows(&thinned) as f64 * bytes_a_row > LIKELY_TOO_LARGE * MAX_BYTES as f64 {
                too_large.push((rows(&thinned), part));
                continue;
            }
            // A part may be no dataset: a run without truth.
            let Ok(of_part) = attempt(&thinned, &mut case) else { continue };
            if of_part.bytes.len() > MAX_BYTES {
                too_large.push((rows(&thinned), part));
                continue;
            }
            tried += 1;
            advance(tried as f64 / (MAX_CHECKED_PARTS + MAX_CHECKED_LARGE_PARTS) as f64);
            if reproduces(&of_part.reread) {
                return Ok(Bundle { bytes: of_part.bytes, case });
            }
            if tried == MAX_CHECKED_PARTS {
                break;
            }
        }
        too_large.sort_by_key(|(rows, _)| *rows);
        for (_, part) in too_large.into_iter().take(MAX_CHECKED_LARGE_PARTS) {
            let Some(thinned) = part.of(&all, &checked.problems) else { continue };
            let Ok(of_part) = attempt(&thinned, &mut case) else { continue };
            if of_part.bytes.len() < whole.bytes.len() && reproduces(&of_part.reread) {
                return limited(Bundle { bytes: of_part.bytes, case });
            }
        }
    }
    let Attempt { bytes, .. } = attempt(&all, &mut case)?;
    limited(Bundle { bytes, case })
}

fn limited(bundle: Bundle) -> Result<Bundle, Failure> {
    if bundle.bytes.len() <= MAX_BYTES_UNTHINNED {
        return Ok(bundle);
    }
    let bytes = bundle.bytes.len();
    Err(format!("no bundle is written: the smallest part with the same problems has {bytes} bytes; check fewer sessions, or a shorter log").into())
}

/// Ids in a message.
pub(crate) fn list(ids: &BTreeSet<&str>) -> String {
    if ids.is_empty() { "none".to_owned() } else { ids.iter().copied().collect::<Vec<_>>().join(", ") }
}

/// A zip, and the datasets as they are read from it.
struct Attempt {
    bytes: Vec<u8>,
    reread: Vec<Dataset>,
}

fn attempt(datasets: &[Dataset], case: &mut Case) -> Result<Attempt, Failure> {
    case.kept = Size::of(datasets);
    let folder = tempfile::tempdir()?;
    let mut files: Vec<Packed> = vec![(CASE.to_owned(), toml::to_string(case)?.into_bytes())];
    let mut reread = Vec::with_capacity(datasets.len());
    for (number, dataset) in datasets.iter().enumerate() {
        let name = session_folder(number + 1);
        let session = folder.path().join(&name);
        dataset::write(dataset, &session, Existing::Refuse)?;
        let mut tables: Vec<PathBuf> =
            fs::read_dir(&session)?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
        tables.sort();
        for table in tables {
            let file = table.file_name().unwrap_or_default().to_string_lossy();
            files.push((format!("{name}/{file}"), fs::read(&table)?));
        }
        reread.push(dataset::read(&session)?.dataset);
    }
    Ok(Attempt { bytes: packed(&files), reread })
}

fn session_folder(number: usize) -> String {
    format!("session-{number}")
}

/// Reads a bundle: what its check said, and its datasets.
///
/// # Errors
/// A file that is no bundle, or is damaged.
pub(crate) fn read(path: &Path) -> Result<(Case, Vec<Dataset>), Failure> {
    let of_file = |why: String| format!("{}: {why}", path.display());
    let bytes =
        atomic_file::read_at_most(path, MAX_BYTES_UNTHINNED as u64).map_err(|error| of_file(error.to_string()))?;
    let files = unpacked(&bytes).map_err(of_file)?;
    let folder = tempfile::tempdir()?;
    let (mut case, mut sessions) = (None, BTreeSet::new());
    for (name, content) in &files {
        if name == CASE {
            let text = String::from_utf8_lossy(content);
            case = Some(Case::parse(&text).map_err(|why| of_file(format!("{CASE}: {why}")))?);
            continue;
        }
        // No other name becomes a path.
        let of_session = name.split_once('/').and_then(|(session, file)| {
            let number: usize = session.strip_prefix("session-")?.parse().ok()?;
            let is_table =
                file.strip_suffix(".csv").is_some_and(|stem| stem.chars().all(|c| c.is_ascii_lowercase() || c == '_'));
            (is_table || file == "dataset.toml").then_some((number, file))
        });
        let (number, file) =
            of_session.ok_or_else(|| of_file("it has files that a bundle does not have".to_owned()))?;
        let session = folder.path().join(session_folder(number));
        fs::create_dir_all(&session)?;
        fs::write(session.join(file), content)?;
        sessions.insert(number);
    }
    let case = case.ok_or_else(|| of_file(format!("it has no {CASE}; is it a bundle of yair check --bundle?")))?;
    let here = format!("{}/", folder.path().display());
    let of_session = |number: usize| {
        let session = folder.path().join(session_folder(number));
        dataset::read(&session).map_err(|error| of_file(error.to_string().replace(&here, "")))
    };
    let datasets = sessions.into_iter().map(|number| of_session(number).map(|loaded| loaded.dataset));
    let datasets = datasets.collect::<Result<Vec<_>, _>>()?;
    if datasets.is_empty() { Err(of_file("it has no dataset".to_owned()).into()) } else { Ok((case, datasets)) }
}

//! Sessions of the `OptiOdom` study: a differential-drive robot under `OptiTrack`, 20 Hz.
//!
//! Sousa, Petry, Costa et al., "`OptiOdom`: a Generic Approach for Odometry Calibration of Wheeled Mobile
//! Robots", J Intell Robot Syst 105, 39 (2022). A session is a folder with `SESSION_metadata.csv` and
//! `SESSION_run-NN.csv`. Run files have no header: time s, x m, y m, heading rad (unwrapped), **right**
//! counts of this cycle, **left** counts of this cycle.
//!
//! What a run drove is not written anywhere but in folder names; it is read off the wheels (see [`label`]).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use kinematics::Wheels;

use crate::error::{DatasetError, shown};
use crate::imported::Source;
use crate::protocols::label;
use crate::record::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
use crate::run_motion::RunMotion;
use crate::table::{Table, read_lines};

const EXPECTED_FOLDER: &str = "a folder that holds SESSION_metadata.csv and SESSION_run-NN.csv, at any depth";
const EXPECTED_RUN: &str = "rows of time, x, y, heading, right counts, left counts";
const EXPECTED_METADATA: &str = "lines like ngear,43.7";

const METADATA_SUFFIX: &str = "_metadata.csv";

/// Columns of a run file, which has no header.
const COLUMNS: [&str; 6] = ["t_s", "x_m", "y_m", "theta_rad", "right_ticks", "left_ticks"];
const T_S: usize = 0;
const X_M: usize = 1;
const Y_M: usize = 2;
const THETA_RAD: usize = 3;
const RIGHT_TICKS: usize = 4;
const LEFT_TICKS: usize = 5;

/// All sessions in or under a folder, by path.
pub(super) fn open(source: &Path) -> Result<Vec<Source>, DatasetError> {
    if !source.is_dir() {
        return Err(DatasetError::NotAFolder { path: source.to_owned(), expected: EXPECTED_FOLDER });
    }
    let mut metadata = Vec::new();
    find_metadata(source, &mut metadata)?;
    metadata.sort();
    if metadata.is_empty() {
        return Err(DatasetError::NothingToImport { path: source.to_owned(), expected: EXPECTED_FOLDER });
    }
    metadata.iter().map(|file| open_session(file)).collect()
}

/// Collects the metadata files under a folder; links are not followed, as they may lead in a circle.
fn find_metadata(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), DatasetError> {
    let io = |source| DatasetError::Io { path: folder.to_owned(), source };
    for entry in fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        if entry.file_type().map_err(io)?.is_dir() {
            find_metadata(&entry.path(), found)?;
        } else if entry.file_name().to_string_lossy().ends_with(METADATA_SUFFIX) {
            found.push(entry.path());
        }
    }
    Ok(())
}

/// What `SESSION_metadata.csv` says that is needed here.
#[derive(Debug)]
struct Metadata {
    robot: NominalRobot,
    runs: usize,
    runs_line: u64,
    /// Side of the square, metres, where the session drove one.
    side_m: Option<f64>,
}

impl Metadata {
    fn read(file: &Path) -> Result<Self, DatasetError> {
        let lines = read_lines(file, EXPECTED_METADATA)?;
        let mut values: BTreeMap<&str, (u64, Vec<&str>)> = BTreeMap::new();
        for (number, line) in &lines {
            let mut fields = line.split(',').map(str::trim);
            let key = fields.next().unwrap_or_default();
            values.insert(key, (*number, fields.filter(|field| !field.is_empty()).collect()));
        }
        let foreign = |line, message| DatasetError::Foreign { file: file.to_owned(), line, message };
        let last_line = lines.last().map_or(1, |(number, _)| *number);
        let field = |key: &str, index: usize| -> Result<(u64, &str), DatasetError> {
            let (line, fields) = values.get(key).ok_or_else(|| {
                foreign(
                    last_line,
                    format!("no line {key}; expected {EXPECTED_METADATA} with type, ngear, encRes, Li, Di, N"),
                )
            })?;
            let field = fields
                .get(index)
                .ok_or_else(|| foreign(*line, format!("{key} has {} values; expected {}", fields.len(), index + 1)))?;
            Ok((*line, field))
        };
        let positive = |key: &str, index: usize| -> Result<f64, DatasetError> {
            let (line, text) = field(key, index)?;
            match text.parse::<f64>() {
                Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
                _ => Err(foreign(line, format!("{key} = \"{}\"; expected a positive number", shown(text.as_bytes())))),
            }
        };
        let (line, drive) = field("type", 0)?;
        if drive != "diff" {
            let message = format!(
                "type \"{}\"; expected diff: only differential drives can be imported",
                shown(drive.as_bytes())
            );
            return Err(foreign(line, message));
        }
        let (runs_line, runs) = field("N", 0)?;
        let runs = runs.parse().map_err(|_| {
            foreign(runs_line, format!("N = \"{}\"; expected the number of runs", shown(runs.as_bytes())))
        })?;
        let ticks_per_rev = positive("ngear", 0)? * positive("encRes", 0)?;
        if !(ticks_per_rev.is_finite() && ticks_per_rev > 0.0) {
            let (line, _) = field("encRes", 0)?;
            return Err(foreign(line, "ngear times encRes is no number of counts a turn".to_owned()));
        }
        let robot = NominalRobot {
            // Di lists the right wheel first, as the counts do.
            right_wheel_diameter_m: positive("Di", 0)?,
            left_wheel_diameter_m: positive("Di", 1)?,
            wheel_separation_m: positive("Li", 0)?,
            ticks_per_rev: Some(ticks_per_rev),
            counter_bits: None,
        };
        let has_side = values.get("L").is_some_and(|(_, fields)| !fields.is_empty());
        let side_m = if has_side { Some(positive("L", 0)?) } else { None };
        Ok(Self { robot, runs, runs_line, side_m })
    }
}

fn open_session(metadata_file: &Path) -> Result<Source, DatasetError> {
    let metadata = Metadata::read(metadata_file)?;
    let file_name = metadata_file.file_name().unwrap_or_default().to_string_lossy();
    let session = file_name.strip_suffix(METADATA_SUFFIX).unwrap_or(&file_name).to_owned();
    let run_files = run_files(metadata_file, &session)?;
    if run_files.len() != metadata.runs {
        let message = format!(
            "N says {} runs; expected as many files {session}_run-NN.csv, found {}",
            metadata.runs,
            run_files.len()
        );
        return Err(DatasetError::Foreign { file: metadata_file.to_owned(), line: metadata.runs_line, message });
    }
    let provenance = Provenance {
        name: Some(session.clone()),
        licence: Some("MIT".to_owned()),
        source: Some("https://github.com/sousarbarb/optiodom, doi:10.1007/s10846-022-01630-3".to_owned()),
        notes: Some(
            "Truth is OptiTrack's, re-based on its first row, which is itself noisy. What each run drove was read off its wheels; \
             the radius of a circle is the mean over the run."
                .to_owned(),
        ),
        ..Provenance::default()
    };
    let header = Dataset {
        provenance,
        robot: metadata.robot,
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: Vec::new(),
    };
    let runs = run_files.into_iter().map(move |(id, file)| read_run(&id, &file, &metadata));
    Ok(Source::new(session, header, runs))
}

/// The run files of a session with their ids, `run-NN`, by number.
fn run_files(metadata_file: &Path, session: &str) -> Result<Vec<(String, PathBuf)>, DatasetError> {
    let folder = match metadata_file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let io = |source| DatasetError::Io { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let id = name.strip_prefix(session).and_then(|rest| rest.strip_prefix('_')?.strip_suffix(".csv"));
        if let Some(number) = id.and_then(|id| id.strip_prefix("run-")?.parse::<u32>().ok()) {
            files.push((number, format!("run-{number:02}"), path));
        }
    }
    files.sort();
    Ok(files.into_iter().map(|(_, id, path)| (id, path)).collect())
}

fn read_run(id: &str, file: &Path, metadata: &Metadata) -> Result<Run, DatasetError> {
    let mut table = Table::without_header(file, &COLUMNS, EXPECTED_RUN)?;
    let (mut times_s, mut truth) = (Vec::new(), Vec::new());
    let (mut ticks, mut total) = (Wheels::<Vec<i64>>::default(), Wheels::both(0_i64));
    while let Some(row) = table.next_row()? {
        let t_s = row.time_after(T_S, times_s.last().copied())?;
        let cycle = Wheels { left: row.count(LEFT_TICKS)?, right: row.count(RIGHT_TICKS)? };
        total = total.zip_with(cycle, i64::wrapping_add);
        times_s.push(t_s);
        ticks.left.push(total.left);
        ticks.right.push(total.right);
        truth.push(TruthSample::new(t_s, row.number(X_M)?, row.number(Y_M)?, Some(row.number(THETA_RAD)?)));
    }
    if times_s.is_empty() {
        return Err(DatasetError::EmptyFile { file: file.to_owned(), expected: EXPECTED_RUN.to_owned() });
    }
    let mut info = RunInfo { id: id.to_owned(), ..RunInfo::default() };
    let odometry = Odometry { t_s: times_s.into(), wheels: WheelLog::Ticks(ticks), ..Odometry::default() };
    if let Some(motion) = RunMotion::of(&odometry, &metadata.robot) {
        let (protocol, settings) = label(&motion, metadata.side_m);
        info.protocol = Some(protocol);
        info.settings = settings;
    }
    Ok(Run { info, odometry, truth, ..Run::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{Imported, importer};

    fn read(source: &Path) -> Result<Vec<Imported>, DatasetError> {
        importer("optiodom").expect("this one").read(source)
    }

    const METADATA: &str =
        "type,diff,,\nngear,43.7,,\nencRes,64,,\nLi,0.2,,\nDi,0.084,0.085,\nThi,,,\nN,1,,\nL,0.75,,\n";

    fn session(metadata: &str, runs: &[&str]) -> tempfile::TempDir {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let folder = temp.path().join("deep/er");
        fs::create_dir_all(&folder).expect("made");
        fs::write(folder.join("s1_metadata.csv"), metadata).expect("written");
        for (run, content) in runs.iter().enumerate() {
            fs::write(folder.join(format!("s1_run-{:02}.csv", run + 1)), content).expect("written");
        }
        temp
    }

    fn message(metadata: &str, runs: &[&str]) -> String {
        let temp = session(metadata, runs);
        let message = read(temp.path()).expect_err("a fault").to_string();
        assert_eq!(message.lines().count(), 1);
        message
    }

    #[test]
    fn right_comes_before_left_and_cycles_are_summed() {
        let temp = session(METADATA, &["0,0,0,0,1,2\n0.05,0.1,0.2,0.3,10,20\n0.1,0.1,0.2,6.5,-1,-2\n"]);
        let imported = &read(temp.path()).expect("a session")[0];
        assert_eq!(imported.name, "s1");
        let robot = imported.dataset.robot;
        assert_eq!((robot.right_wheel_diameter_m, robot.left_wheel_diameter_m), (0.084, 0.085));
        assert_eq!(robot.ticks_per_rev, Some(43.7 * 64.0));
        let run = &imported.dataset.runs[0];
        assert_eq!(run.info.id, "run-01");
        let ticks = Wheels { left: vec![2, 22, 20], right: vec![1, 11, 10] };
        assert_eq!(run.odometry.wheels, WheelLog::Ticks(ticks));
        assert_eq!(run.truth[2], TruthSample::new(0.1, 0.1, 0.2, Some(6.5)));
    }

    #[test]
    fn faults_name_file_line_and_what_was_expected() {
        let row = "0,0,0,0,0,0\n";
        assert!(message(METADATA, &[row, row]).contains("s1_metadata.csv:7: N says 1 runs; expected as many files"));
        assert!(message(&METADATA.replace("Di,0.084,0.085", "Di,0.084,"), &[row]).contains(":5: Di has 1 values"));
        assert!(message(&METADATA.replace("diff", "tricyc"), &[row]).contains("metadata.csv:1: type \"tricyc\""));
        assert!(message(&METADATA.replace("Li,0.2", "Lx,0.2"), &[row]).contains("no line Li"));
        assert!(message(&METADATA.replace("Li,0.2", "Li,-1"), &[row]).contains(":4: Li = \"-1\"; expected a positive"));
        assert!(message(METADATA, &["0,0,0,0,0,0\n1,0,0"]).contains("s1_run-01.csv:2: 3 fields; expected 6"));
        assert!(message(METADATA, &["0,0,0,0,0,0.5\n"]).contains("run-01.csv:1: column left_ticks: \"0.5\""));
        assert!(
            message(METADATA, &["1,0,0,0,0,0\n0,0,0,0,0,0\n"]).contains("run-01.csv:2: column t_s: time runs back")
        );
        assert!(message(METADATA, &[""]).contains("s1_run-01.csv: empty file"));
        assert!(message("", &[row]).contains("s1_metadata.csv: empty file"));
    }

    #[test]
    fn a_folder_without_sessions_and_a_file_are_refused() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        assert!(matches!(read(temp.path()), Err(DatasetError::NothingToImport { .. })));
        assert!(matches!(read(&temp.path().join("absent")), Err(DatasetError::NotAFolder { .. })));
    }
}

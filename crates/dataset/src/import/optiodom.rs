//! Sessions of the `OptiOdom` study: a differential-drive robot under `OptiTrack`, 20 Hz.
//!
//! Sousa, Petry, Costa et al., "`OptiOdom`: a Generic Approach for Odometry Calibration of Wheeled Mobile
//! Robots", J Intell Robot Syst 105, 39 (2022). A session is a folder with `SESSION_metadata.csv` and
//! `SESSION_run-NN.csv`. Run files have no header: time s, x m, y m, heading rad (unwrapped), **right**
//! counts of this cycle, **left** counts of this cycle.
//!
//! What a run drove is not written anywhere but in folder names; it is read off the wheels (see [`label`]).

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};

use kinematics::{DriveGeometry, Increment, Wheels};

use crate::error::{DatasetError, shown};
use crate::imported::Source;
use crate::record::{
    Dataset, NominalRobot, Odometry, Protocol, ProtocolSettings, Provenance, Run, RunInfo, TruthNoise, TruthSample,
    WheelLog,
};
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
    // Positive lengths were checked as the metadata was read.
    if let (Ok(geometry), Some(ticks_per_rev)) = (metadata.robot.geometry(), metadata.robot.ticks_per_rev)
        && let Some(motion) = Motion::of(&ticks, &geometry, ticks_per_rev)
    {
        let (protocol, settings) = label(&motion, metadata.side_m);
        info.protocol = Some(protocol);
        info.settings = settings;
    }
    let odometry = Odometry { t_s: times_s.into(), wheels: WheelLog::Ticks(ticks), ..Odometry::default() };
    Ok(Run { info, odometry, truth, ..Run::default() })
}

/// How a run moved as a whole, by its nominal geometry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Motion {
    /// Signed path of the centre, metres.
    distance_m: f64,
    /// Net turn, radians.
    turn_rad: f64,
    /// Length of the path, forward and backward, metres.
    path_m: f64,
    /// From the smallest heading to the largest, radians.
    heading_range_rad: f64,
    /// How far the heading departs from one that grows evenly with the distance, radians.
    uneven_rad: f64,
    /// Sum of the turns' sizes, radians.
    turning_rad: f64,
    /// The part of it during which the wheels went in opposite directions, radians.
    on_the_spot_rad: f64,
}

impl Motion {
    fn of(ticks: &Wheels<Vec<i64>>, geometry: &DriveGeometry, ticks_per_rev: f64) -> Option<Self> {
        let m_per_count = geometry.m_per_count(ticks_per_rev).ok()?;
        let mut motion = Self::default();
        let mut course = Vec::with_capacity(ticks.left.len());
        for (left, right) in ticks.left.windows(2).zip(ticks.right.windows(2)) {
            let counts = Wheels { left: left[1].wrapping_sub(left[0]), right: right[1].wrapping_sub(right[0]) };
            let Increment { distance_m, turn_rad } =
                geometry.increment(counts.zip_with(m_per_count, |counts, m_per_count| counts as f64 * m_per_count));
            motion.distance_m += distance_m;
            motion.turn_rad += turn_rad;
            motion.turning_rad += turn_rad.abs();
            motion.path_m += distance_m.abs();
            course.push((motion.distance_m, motion.turn_rad));
            if counts.left.signum() * counts.right.signum() < 0 {
                motion.on_the_spot_rad += turn_rad.abs();
            }
        }
        let (mut lowest_rad, mut highest_rad) = (0.0_f64, 0.0_f64);
        let rad_per_m = motion.turn_rad / motion.distance_m;
        for (distance_m, turn_rad) in course {
            (lowest_rad, highest_rad) = (lowest_rad.min(turn_rad), highest_rad.max(turn_rad));
            motion.uneven_rad = motion.uneven_rad.max((turn_rad - rad_per_m * distance_m).abs());
        }
        motion.heading_range_rad = highest_rad - lowest_rad;
        Some(motion)
    }
}

/// What a run drove: a label only where all of the run is like it, else `free`.
///
/// | label | rule (by the nominal robot) | setting |
/// | --- | --- | --- |
/// | `spin` | a path of less than 0.1 m, and a net turn of at least an eighth of a turn | `turn_rad`: the nearest whole number of half turns |
/// | `straight` | at least 0.1 m, and all headings within 10° | `length_m`: signed, to the centimetre |
/// | `square_*` | a whole turn to within an eighth, most of the turning with the wheels in opposite directions, four sides where the metadata says their length | `side_m`: the metadata's |
/// | `circle_*` | at least a half turn, with both wheels forward, that grows evenly with the distance | `radius_m`: distance over turn, the mean radius of the run, to the millimetre |
/// | `free` | none of these | |
///
/// All but `free` go one way: forward or backward, left or right. The runs of the study's `circular` folder
/// are spirals: half turns of a radius that shrinks from 0.375 m. Their mean is what one number can say.
fn label(motion: &Motion, side_m: Option<f64>) -> (Protocol, ProtocolSettings) {
    const MOVES_M: f64 = 0.1;
    const EIGHTH_RAD: f64 = TAU / 8.0;
    /// The study's straights keep within 4°.
    const STRAIGHT_RAD: f64 = TAU / 36.0;
    /// What of a path or of the headings may go the other way: the study's squares have 2 %.
    const ONE_WAY: f64 = 0.95;
    /// The study's spirals are uneven by 0.043 to 0.068 of their turn; a drive of two different arcs by more.
    const UNEVEN: f64 = 0.1;
    /// The study's circles turn for 3 % with wheels in opposite directions, as they start and stop.
    const ON_THE_SPOT: f64 = 0.1;
    /// The study's squares are 1 % short by the nominal robot.
    const SIDES: f64 = 0.1;
    let none = ProtocolSettings::default();
    let free = (Protocol::Free, none);
    // Counts that are no robot's give lengths that are none.
    let is_path = motion.path_m.is_finite() && motion.distance_m.is_finite() && motion.turn_rad.is_finite();
    if !is_path {
        return free;
    }
    let turn_rad = motion.turn_rad.abs();
    let turns_one_way = turn_rad >= ONE_WAY * motion.heading_range_rad;
    let clockwise = motion.turn_rad < 0.0;
    if motion.path_m < MOVES_M {
        if turn_rad < EIGHTH_RAD || !turns_one_way {
            return free;
        }
        let turn_rad = (motion.turn_rad / PI).round() * PI;
        return (Protocol::Spin, ProtocolSettings { turn_rad: Some(turn_rad), ..none });
    }
    if motion.distance_m.abs() < ONE_WAY * motion.path_m {
        return free;
    }
    if motion.heading_range_rad < STRAIGHT_RAD {
        let length_m = (motion.distance_m * 100.0).round() / 100.0;
        return (Protocol::Straight, ProtocolSettings { length_m: Some(length_m), ..none });
    }
    let sides = side_m.is_none_or(|side_m| (motion.distance_m.abs() / (4.0 * side_m) - 1.0).abs() < SIDES);
    let is_square = (turn_rad - TAU).abs() < EIGHTH_RAD && motion.on_the_spot_rad > 0.5 * motion.turning_rad && sides;
    let is_circle = turn_rad >= 4.0 * EIGHTH_RAD
        && motion.on_the_spot_rad < ON_THE_SPOT * motion.turning_rad
        && motion.uneven_rad < UNEVEN * turn_rad;
    match (turns_one_way, is_square, is_circle) {
        (true, true, _) => {
            let protocol = if clockwise { Protocol::SquareCw } else { Protocol::SquareCcw };
            (protocol, ProtocolSettings { side_m, ..none })
        }
        (true, false, true) => {
            let radius_m = (motion.distance_m / motion.turn_rad).abs();
            let radius_m = (radius_m * 1000.0).round() / 1000.0;
            if !(radius_m.is_finite() && radius_m > 0.0) {
                return free;
            }
            let protocol = if clockwise { Protocol::CircleCw } else { Protocol::CircleCcw };
            (protocol, ProtocolSettings { radius_m: Some(radius_m), ..none })
        }
        _ => free,
    }
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

    #[test]
    fn labels_follow_the_rule_on_both_sides_of_its_borders() {
        let motion = |distance_m: f64, turn_rad: f64, on_the_spot_rad| Motion {
            distance_m,
            path_m: distance_m.abs() + 0.02,
            turn_rad,
            heading_range_rad: turn_rad.abs(),
            uneven_rad: 0.05 * turn_rad.abs(),
            turning_rad: turn_rad.abs() + 0.1,
            on_the_spot_rad,
        };
        let labelled = |motion| label(&motion, Some(0.75));
        assert_eq!(labelled(motion(-1.502, 0.02, 0.0)).1.length_m, Some(-1.5));
        assert_eq!(labelled(motion(0.007, -3.19, 3.1)).1.turn_rad, Some(-PI));
        assert_eq!(
            labelled(motion(2.98, 6.3, 5.0)),
            (Protocol::SquareCcw, ProtocolSettings { side_m: Some(0.75), ..Default::default() })
        );
        assert_eq!(labelled(motion(2.98, -6.3, 5.0)).0, Protocol::SquareCw);
        assert_eq!(
            labelled(motion(3.98, -12.57, 0.4)),
            (Protocol::CircleCw, ProtocolSettings { radius_m: Some(0.317), ..Default::default() })
        );
        assert_eq!(labelled(motion(2.98, 6.3, 0.4)).0, Protocol::CircleCcw);
        // Not a square of these sides, not a whole turn, too short a turn, hardly any motion.
        for (distance_m, turn_rad, on_the_spot_rad) in
            [(4.0, 6.3, 5.0), (2.0, 3.0, 2.9), (2.0, 1.0, 0.0), (0.01, 0.1, 0.1)]
        {
            assert_eq!(labelled(motion(distance_m, turn_rad, on_the_spot_rad)).0, Protocol::Free, "{distance_m}");
        }
    }

    #[test]
    fn drives_of_several_kinds_are_free() {
        let geometry = DriveGeometry::new(Wheels::both(0.1), 0.2).expect("a drive");
        // Rows of wheel counts, 100 a turn, in pieces of so many rows.
        let drive = |pieces: &[(i64, i64, usize)]| {
            let mut ticks = Wheels { left: vec![0], right: vec![0] };
            for &(left, right, rows) in pieces {
                for _ in 0..rows {
                    ticks.left.push(ticks.left[ticks.left.len() - 1] + left);
                    ticks.right.push(ticks.right[ticks.right.len() - 1] + right);
                }
            }
            label(&Motion::of(&ticks, &geometry, 100.0).expect("motion"), None).0
        };
        assert_eq!(drive(&[(10, 10, 50)]), Protocol::Straight);
        assert_eq!(drive(&[(5, 10, 100)]), Protocol::CircleCcw);
        assert_eq!(drive(&[(-5, 5, 20)]), Protocol::Spin);
        // A slalom whose net turn is nothing, out and back, two arcs, a circle and a straight, to and fro.
        assert_eq!(drive(&[(5, 10, 60), (10, 5, 120), (5, 10, 60)]), Protocol::Free);
        assert_eq!(drive(&[(10, 10, 50), (-10, -10, 30)]), Protocol::Free);
        assert_eq!(drive(&[(5, 10, 100), (8, 10, 100)]), Protocol::Free);
        assert_eq!(drive(&[(5, 10, 100), (10, 10, 100)]), Protocol::Free);
        assert_eq!(drive(&[(-5, 5, 20), (5, -5, 10)]), Protocol::Free);
    }
}

//! `yair export mcap DATASET [--calibration FILE]... --out FILE.mcap`

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;
use std::process::ExitCode;

use calib::{AugmentedCalibration, CorrectedRun, NamedCalibration, corrected_run, path_covariances};
use dataset::{Dataset, Loaded, Run, WheelLog};
use kinematics::Wheels;
use ros_bag::{
    FIRST_STAMP_S, RUN_GAP_S, RecordedPath, RecordedRun, RecordedTopic, RecordedWheels, Recorder, WORLD_FRAME,
};
use serde::Serialize;

use crate::calibration_file::GivenCalibration;
use crate::simulate::write_whole;
use crate::terminal::{Failure, Terminal, listed_ids, table, warn};

/// The path by the values that the dataset states.
const NOMINAL: &str = "nominal";

#[derive(Serialize)]
struct Document {
    format: &'static str,
    source: String,
    out: String,
    /// What the paths are called, in order, with the name of their calibration.
    paths: Vec<PathName>,
    /// The frame of all poses.
    frame: &'static str,
    first_stamp_s: i64,
    run_gap_s: i64,
    topics: Vec<RecordedTopic>,
    runs: Vec<String>,
    cautions: Vec<String>,
}

#[derive(Serialize)]
struct PathName {
    path: String,
    calibration: String,
}

/// A path of every run, by the run's id.
type Paths = BTreeMap<String, RecordedPath>;

pub(crate) fn run(
    source: &Path,
    out: &Path,
    calibrations: &[GivenCalibration],
    only: Option<&str>,
    terminal: &Terminal,
) -> Result<ExitCode, Failure> {
    let place = source.display().to_string();
    let Loaded { dataset, warnings } = dataset::read(source)?;
    warn(source, &warnings, terminal);
    if let Some(id) = only.filter(|id| dataset.runs.iter().all(|run| run.info.id != *id)) {
        let ids = listed_ids(dataset.runs.iter().map(|run| &run.info.id[..]));
        return Err(format!("{place}: it has no run \"{id}\"; it has {ids}").into());
    }
    let mut paths = vec![nominal(&dataset, &place)?];
    let mut names = vec![PathName { path: NOMINAL.to_owned(), calibration: NOMINAL.to_owned() }];
    for given in calibrations {
        given.check(&dataset.robot, &place)?;
        let calibration = given.calibration().calibration.name.clone();
        let path = topic_name(&calibration, &names);
        paths.push(calibrated(given, &path, &dataset, &place, terminal)?);
        names.push(PathName { path, calibration });
        given.remark(terminal);
    }
    let mut cautions = Vec::new();
    let mut recorder = Recorder::default();
    let chosen: Vec<&Run> = dataset.runs.iter().filter(|run| only.is_none_or(|id| run.info.id == id)).collect();
    for run in &chosen {
        let recorded = RecordedRun {
            truth: &run.truth,
            rows_s: &run.odometry.t_s,
            wheels: wheels(run, &dataset),
            gyro: None,
            paths: paths.iter().filter_map(|path| path.get(&run.info.id).cloned()).collect(),
        };
        recorder.push(&recorded).map_err(|error| format!("{}: {error}", out.display()))?;
    }
    cautions.extend(truth_cautions(&chosen));
    if matches!(chosen.first().map(|run| &run.odometry.wheels), Some(WheelLog::Ticks(_)))
        && dataset.robot.ticks_per_rev.is_none()
    {
        cautions.push("no /joint_states: counts need ticks_per_rev in dataset.toml".to_owned());
    }
    let (bytes, topics) = recorder.finish();
    for caution in &cautions {
        terminal.remark(&format!("warning: {place}: {caution}"));
    }
    write_whole(out, &bytes)?;
    let mut lines = table(&["topic", "type", "messages"], 2);
    for RecordedTopic { topic, type_name, messages } in &topics {
        lines.add_row([topic.clone(), (*type_name).to_owned(), messages.to_string()]);
    }
    terminal.say(&lines.to_string())?;
    let times = format!("the first is stamped {FIRST_STAMP_S} s, each later one begins {RUN_GAP_S} s after the last");
    terminal.note(&format!("{} runs in {}, poses in frame {WORLD_FRAME}; {times}", chosen.len(), out.display()))?;
    terminal.document(&Document {
        format: "mcap",
        source: place,
        out: out.display().to_string(),
        paths: names,
        frame: WORLD_FRAME,
        first_stamp_s: FIRST_STAMP_S,
        run_gap_s: RUN_GAP_S,
        topics,
        runs: chosen.iter().map(|run| run.info.id.clone()).collect(),
        cautions,
    })?;
    Ok(ExitCode::SUCCESS)
}

/// What a topic may be called of a calibration's name: letters, digits and underscores, and no other path's.
fn topic_name(calibration: &str, taken: &[PathName]) -> String {
    let plain: String = calibration.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let plain =
        if plain.starts_with(|c: char| c.is_ascii_alphabetic()) { plain } else { format!("calibration_{plain}") };
    let is_free = |name: &String| taken.iter().all(|of| of.path != *name) && name != "truth";
    let numbered = (2..).map(|number| format!("{plain}_{number}"));
    std::iter::once(plain.clone()).chain(numbered).find(is_free).unwrap_or_default()
}

/// The path by the stated values.
fn nominal(dataset: &Dataset, place: &str) -> Result<Paths, Failure> {
    let stated = NamedCalibration::new(NOMINAL.to_owned(), BTreeMap::new());
    paths(NOMINAL, dataset, &stated.into(), place, |_| None)
}

fn calibrated(
    given: &GivenCalibration,
    name: &str,
    dataset: &Dataset,
    place: &str,
    terminal: &Terminal,
) -> Result<Paths, Failure> {
    let records: Cow<'_, Dataset> = given.undone(dataset, place, terminal)?;
    let calibration = given.calibration();
    let nominal = records.robot.geometry().ok();
    let geometry = nominal.and_then(|nominal| calibration.calibration.geometry(&records.robot, nominal));
    paths(name, &records, calibration, place, |run| {
        let (noise, geometry) = given.noise().zip(geometry)?;
        Some(path_covariances(&run.poses, geometry.wheel_separation_m(), &noise))
    })
}

fn paths(
    name: &str,
    records: &Dataset,
    calibration: &AugmentedCalibration,
    place: &str,
    covariances: impl Fn(&CorrectedRun) -> Option<Vec<[f64; 9]>>,
) -> Result<Paths, Failure> {
    let session = records.session();
    let mut driven_m = 0.0;
    let mut runs = Paths::new();
    for run in &session.runs {
        let id = &run.info().id;
        let why = "its wheels say no motion; counts need ticks_per_rev in dataset.toml";
        let corrected = corrected_run(&session, run, calibration, &mut driven_m)
            .ok_or_else(|| format!("{place}: run \"{id}\": {why}"))?;
        let covariances = covariances(&corrected);
        runs.insert(id.clone(), RecordedPath { name: name.to_owned(), poses: corrected.poses, covariances });
    }
    Ok(runs)
}

/// The wheels' angles, or their angular speeds by the nominal wheels; none of twists.
fn wheels(run: &Run, dataset: &Dataset) -> Option<RecordedWheels> {
    match &run.odometry.wheels {
        WheelLog::Ticks(ticks) => {
            let rad_per_tick = TAU / dataset.robot.ticks_per_rev?;
            let angles = |ticks: &Vec<i64>| ticks.iter().map(|count| rad_per_tick * *count as f64).collect();
            Some(RecordedWheels::Angles(Wheels { left: angles(&ticks.left), right: angles(&ticks.right) }))
        }
        WheelLog::Angles(angles) => Some(RecordedWheels::Angles(angles.clone())),
        WheelLog::Speeds(speeds) => {
            let m_per_rad = dataset.robot.geometry().ok()?.m_per_rad();
            let rates = |speeds: &Vec<f64>, m_per_rad: f64| speeds.iter().map(|speed| speed / m_per_rad).collect();
            Some(RecordedWheels::AngularSpeeds(Wheels {
                left: rates(&speeds.left, m_per_rad.left),
                right: rates(&speeds.right, m_per_rad.right),
            }))
        }
        WheelLog::Twist { .. } => None,
    }
}

/// What of the truth is not in the bag as it was measured.
fn truth_cautions(runs: &[&Run]) -> Vec<String> {
    let mut cautions = Vec::new();
    for run in runs {
        let id = &run.info.id;
        let without = run.truth.iter().filter(|sample| sample.theta_rad().is_none()).count();
        if run.truth.is_empty() {
            cautions.push(format!("run \"{id}\" has no truth of poses (truth.csv); nothing of it is on /truth"));
        } else if without == run.truth.len() {
            cautions.push(format!("run \"{id}\": positions without a heading; headings are 0 on /truth"));
        } else if without > 0 {
            cautions.push(format!("run \"{id}\": {without} positions without a heading are not on /truth"));
        }
    }
    cautions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_have_names_that_ros_takes_and_that_differ() {
        let mut taken = vec![PathName { path: NOMINAL.to_owned(), calibration: NOMINAL.to_owned() }];
        let mut name = |calibration: &str| {
            let path = topic_name(calibration, &taken);
            taken.push(PathName { path: path.clone(), calibration: calibration.to_owned() });
            path
        };
        let names = ["joint", "joint", "nominal", "ex 1/a.toml", "2020", "truth"].map(&mut name);
        assert_eq!(names, ["joint", "joint_2", "nominal_2", "ex_1_a_toml", "calibration_2020", "truth_2"]);
    }
}

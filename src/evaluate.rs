//! `yair evaluate DATASET... [--calibration FILE]... [--max-drift PERCENT]`

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use calib::{
    Alignment, AugmentedCalibration, CalibrationDrift, Delta, DeltaUnit, EvaluatedInstrument, EvaluationOptions,
    NamedCalibration, Names, PoseErrorOptions, StartsBy, with_instrument,
};
use clap::Args;
use dataset::{Loaded, RunByRun, Warning};
use serde::Serialize;

use crate::calibration_file::GivenCalibration;
use crate::check;
use crate::html_report::{EvaluationPage, refuse_file};
use crate::import_robot::named;
use crate::terminal::{Failure, Terminal, cell, datasets_at, folder_name, table, warn};

/// Measure the drift of dead reckoning: with the values as configured, and with each calibration
///
/// APE and RPE are those of evo (evo_ape, evo_rpe) on the same poses: absolute errors at the truth's
/// instants, and errors of the motion between poses that are a step apart. RPE counts every pair of poses
/// of a run once, of all runs together.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets with absolute truth; a folder of datasets means all of them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Calibration file from `yair calibrate --out`, or extended model from `yair diagnose --out`; may be
    /// given several times.
    #[arg(long = "calibration", value_name = "FILE")]
    calibrations: Vec<PathBuf>,
    /// Exit with 3 when the last calibration drifts more than this, in per cent of the distance driven.
    #[arg(long, value_name = "PERCENT", value_parser = percent, allow_negative_numbers = true)]
    max_drift: Option<f64>,
    /// Print a row for every run.
    #[arg(long)]
    runs: bool,
    /// APE: rotate and shift each run in the plane so that its positions fit best (evo's -a), or not.
    #[arg(
        long,
        value_name = "none|se2",
        value_parser = named(&Alignment::ALL, Alignment::name),
        default_value = Alignment::None.name(),
        hide_possible_values = true,
        help_heading = "Pose errors"
    )]
    align: Alignment,
    /// RPE: the step between the two poses of a pair [default: 1].
    #[arg(long, value_name = "STEP", allow_negative_numbers = true, help_heading = "Pose errors")]
    delta: Option<f64>,
    /// RPE: the step is one of frames (poses), degrees or radians of turns, or metres of path.
    #[arg(
        long,
        value_name = "f|d|r|m",
        value_parser = named(&DeltaUnit::ALL, DeltaUnit::name),
        default_value = DeltaUnit::Frames.name(),
        hide_possible_values = true,
        requires = "delta",
        help_heading = "Pose errors"
    )]
    delta_unit: DeltaUnit,
    /// RPE: pairs begin at every pose, not where the one before ended.
    #[arg(long, help_heading = "Pose errors")]
    all_pairs: bool,
    /// RPE with --all-pairs by degrees, radians or metres: by how much of the step a pair may differ from it
    /// [default: 0.1].
    #[arg(
        long,
        value_name = "RATIO",
        allow_negative_numbers = true,
        requires = "all_pairs",
        help_heading = "Pose errors"
    )]
    delta_tol: Option<f64>,
    /// Folder for report.html: the path and the drift of every run. A report.html there is replaced.
    #[arg(long, value_name = "DIR")]
    out_dir: Option<PathBuf>,
}

impl Arguments {
    fn pose_errors(&self) -> Result<PoseErrorOptions, String> {
        let tolerance = self.delta_tol.unwrap_or(Delta::DEFAULT_TOLERANCE);
        let delta = Delta::new(self.delta.unwrap_or(1.0), self.delta_unit, self.all_pairs, tolerance)
            .map_err(|why| format!("--delta {why}"))?;
        Ok(PoseErrorOptions { alignment: self.align, delta })
    }
}

fn percent(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err("it must be 0 or more".to_owned()) }
}

/// Exit code when the drift is above what is allowed.
const DRIFTS_TOO_MUCH: u8 = 3;

#[derive(Serialize)]
struct Document {
    dataset: Names,
    alignment: Alignment,
    delta: Delta,
    calibrations: Vec<CalibrationDrift>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    refuse_file(arguments.out_dir.as_deref())?;
    let pose_errors = match arguments.pose_errors() {
        Ok(options) => options,
        Err(why) => {
            terminal.failure(&why);
            return Ok(ExitCode::from(2));
        }
    };
    let paths = datasets_at(&arguments.datasets)?;
    let mut found = vec![None];
    for path in &arguments.calibrations {
        found.extend(GivenCalibration::read(path)?.into_iter().map(Some));
    }
    check::before_reading(&paths, terminal);
    let (names, calibrations) = evaluate(&paths, &found, pose_errors, terminal)?;
    found.iter().flatten().for_each(|given| given.remark(terminal));
    show(&calibrations, terminal)?;
    show_instruments(&calibrations, terminal)?;
    show_pose_errors(&calibrations, &pose_errors, terminal)?;
    if arguments.runs {
        show_runs(&calibrations, terminal)?;
    }
    warn_of_worse(&calibrations, terminal);
    if let Some(out) = &arguments.out_dir {
        let datasets = if bytes(&paths) > MAX_DRAWN_BYTES { Vec::new() } else { read_quietly(&paths)? };
        EvaluationPage { calibrations: &found, datasets: &datasets }.write(out)?;
        terminal.remark(&format!("report.html in {}", out.display()));
    }
    let last = calibrations.last().cloned();
    let PoseErrorOptions { alignment, delta } = pose_errors;
    terminal.document(&Document { dataset: Names::of(names), alignment, delta, calibrations })?;
    let (Some(allowed), Some(last)) = (arguments.max_drift, last) else { return Ok(ExitCode::SUCCESS) };
    let Some(percent) = last.drift_percent else {
        return Err("--max-drift: the drift of these runs is not known (see why_null)".into());
    };
    if last.is_at_most(allowed) {
        return Ok(ExitCode::SUCCESS);
    }
    terminal.failure(&format!("{} drifts {percent:.3} % where {allowed} % is allowed", last.name));
    Ok(ExitCode::from(DRIFTS_TOO_MUCH))
}

/// Names of the datasets, and the drift under each calibration. One run is held at a time, for logs may be
/// larger than the memory; but a whole dataset under a model that undoes faults of its records.
fn evaluate(
    paths: &[PathBuf],
    calibrations: &[Option<GivenCalibration>],
    pose_errors: PoseErrorOptions,
    terminal: &Terminal,
) -> Result<(Vec<String>, Vec<CalibrationDrift>), Failure> {
    let options = EvaluationOptions { name_runs: paths.len() > 1, pose_errors: Some(pose_errors) };
    let mut names = Vec::with_capacity(paths.len());
    let (mut seen, mut all) = (vec![0_usize; calibrations.len()], 0_usize);
    let mut runs = vec![Vec::new(); calibrations.len()];
    let mut mounting_from: Vec<Option<String>> = vec![None; calibrations.len()];
    for path in paths {
        let opened = RunByRun::open(path)?;
        let name = opened.header().provenance.name.clone().unwrap_or_else(|| folder_name(path));
        let in_session: Vec<Option<Cow<'_, AugmentedCalibration>>> =
            calibrations.iter().map(|given| Some(given.as_ref()?.calibration().in_session(&name))).collect();
        let instrument = instrument_of(path, &in_session);
        let evaluated: Vec<Option<Cow<'_, AugmentedCalibration>>> =
            in_session.iter().map(|given| with_instrument(given.as_deref(), instrument.as_ref())).collect();
        for (given, from) in in_session.iter().zip(&mut mounting_from) {
            let own = given.as_ref().map(|given| &given.calibration).filter(|own| own.has_instrument());
            let shared = || instrument.as_ref().map(|instrument| instrument.from.clone());
            *from = own.map(|own| own.name.clone()).or_else(shared);
        }
        let place = path.display().to_string();
        let warn = |warnings: &[Warning]| warn(path, warnings, terminal);
        warn(opened.warnings());
        let robot = opened.header().robot;
        calibrations.iter().flatten().try_for_each(|given| given.check(&robot, &place))?;
        for given in calibrations.iter().flatten() {
            if let Some(why) = given.why_of_another_robot(&robot) {
                terminal.remark(&format!("warning: {} may be of another robot than {place}: {why}", given.place()));
            }
        }
        let mut driven_m = vec![0.0; calibrations.len()];
        for run in opened {
            let Loaded { mut dataset, warnings } = run?;
            warn(&warnings);
            dataset.provenance.name = Some(name.clone());
            all += dataset.runs.len();
            for (given, seen) in calibrations.iter().zip(&mut seen) {
                let trained = |run: &&dataset::Run| given.as_ref().is_some_and(|given| given.was_trained_on(run));
                *seen += dataset.runs.iter().filter(trained).count();
            }
            let session = dataset.session();
            let each = calibrations.iter().zip(&evaluated).zip(runs.iter_mut().zip(&mut driven_m));
            for ((_, calibration), (runs, driven_m)) in
                each.filter(|((given, _), _)| !is_of_whole_datasets(given.as_ref()))
            {
                runs.extend(calib::evaluate_runs(&session, calibration.as_deref(), &options, driven_m));
            }
        }
        if calibrations.iter().any(|given| is_of_whole_datasets(given.as_ref())) {
            let mut dataset = dataset::read(path)?.dataset;
            dataset.provenance.name = Some(name.clone());
            for (given, runs) in calibrations.iter().zip(&mut runs) {
                let Some(given) = given.as_ref().filter(|given| given.changes_records()) else { continue };
                let records = given.undone(&dataset, &place, terminal)?;
                let calibration = Some(given.calibration());
                runs.extend(calib::evaluate_runs(&records.session(), calibration, &options, &mut 0.0));
            }
        }
        names.push(name);
    }
    for (given, seen) in calibrations.iter().zip(seen) {
        if let (Some(given), 1..) = (given, seen) {
            terminal.remark(&format!(
                "warning: {} was trained on {seen} of these {all} runs: its drift on them is no test of it; evaluate other runs",
                given.place()
            ));
        }
    }
    let of_runs = |((given, mounting_from), runs): ((&Option<GivenCalibration>, Option<String>), _)| {
        let calibration = given.as_ref().map(|given| &given.calibration().calibration);
        CalibrationDrift { mounting_from, ..CalibrationDrift::of_runs(calibration, runs) }
    };
    Ok((names, calibrations.iter().zip(mounting_from).zip(runs).map(of_runs).collect()))
}

/// Rows of a dataset to which an instrument is fitted, at the most: a second of one core.
const MAX_FITTED_ROWS: usize = 1 << 17;

/// The instrument of those calibrations that have none of their own.
fn instrument_of(path: &Path, calibrations: &[Option<Cow<'_, AugmentedCalibration>>]) -> Option<EvaluatedInstrument> {
    let named = || calibrations.iter().flatten().map(|given| &given.calibration);
    if named().all(NamedCalibration::has_instrument) && !calibrations.iter().any(Option::is_none) {
        return None;
    }
    let (mut datasets, _) = check::beginnings(&[path.to_owned()], MAX_FITTED_ROWS)?;
    for dataset in &mut datasets {
        dataset.leave_out_gyros_beside_poses();
    }
    EvaluatedInstrument::of(named(), &datasets.first()?.session())
}

/// Where the instrument is taken from, where it is not taken to be at the centre.
fn show_instruments(calibrations: &[CalibrationDrift], terminal: &Terminal) -> Result<(), Failure> {
    let mut shown: Vec<&String> = Vec::new();
    for from in calibrations.iter().filter_map(|drift| drift.mounting_from.as_ref()) {
        if !shown.contains(&from) {
            shown.push(from);
            let of: Vec<&str> = calibrations
                .iter()
                .filter(|drift| drift.mounting_from.as_ref() == Some(from) && drift.name != *from)
                .map(|drift| drift.name.as_str())
                .collect();
            if !of.is_empty() {
                terminal.say(&format!("place and latency of the instrument for {}: from {from}", of.join(", ")))?;
            }
        }
    }
    for way in [StartsBy::FirstTenth, StartsBy::Chain] {
        if calibrations.iter().flat_map(|drift| &drift.runs).any(|run| run.starts_by == Some(way)) {
            terminal.say(way.sentence())?;
        }
    }
    Ok(())
}

/// Datasets of at most so many bytes of text are held as a whole, for the picture of their paths: a machine
/// with 4 GB of memory holds them and their paths.
const MAX_DRAWN_BYTES: u64 = 512 << 20;

/// Size of the datasets' tables.
fn bytes(paths: &[PathBuf]) -> u64 {
    let size = |path: &PathBuf| {
        let of = |file| std::fs::metadata(path.join(file)).map_or(0, |metadata| metadata.len());
        of("odometry.csv") + of("truth.csv")
    };
    paths.iter().map(size).sum()
}

/// Whole datasets, whose warnings were passed on before.
fn read_quietly(paths: &[PathBuf]) -> Result<Vec<dataset::Dataset>, Failure> {
    let read = |path: &PathBuf| {
        let mut dataset = dataset::read(path)?.dataset;
        dataset.provenance.name.get_or_insert_with(|| folder_name(path));
        Ok(dataset)
    };
    paths.iter().map(read).collect()
}

/// A calibration that leaves more drift than the nominal values is of another robot, or of other runs.
fn warn_of_worse(calibrations: &[CalibrationDrift], terminal: &Terminal) {
    let Some((nominal, given)) = calibrations.split_first() else { return };
    for drift in given {
        if let (Some(nominal), Some(percent)) = (nominal.drift_percent, drift.drift_percent)
            && percent > MAX_WORSE_RATIO * nominal
        {
            terminal.remark(&format!(
                "warning: {} drifts {percent:.3} % where the nominal values drift {nominal:.3} %: is it a calibration of this robot?",
                drift.name
            ));
        }
    }
}

/// Ratio of the drift under a calibration to that under the nominal values, from which on it is said.
/// Calibrations of the same robot on other floors leave less than nominal values or a little more.
const MAX_WORSE_RATIO: f64 = 1.5;

fn show_runs(calibrations: &[CalibrationDrift], terminal: &Terminal) -> Result<(), Failure> {
    let degrees = 180.0 / std::f64::consts::PI;
    let headers =
        ["calibration", "run", "length\nm", "max pos.\nmm", "max head.\ndeg", "final pos.\nmm", "final head.\ndeg"];
    let mut rows = table(&headers, 2);
    for drift in calibrations {
        for run in &drift.runs {
            rows.add_row([
                drift.name.clone(),
                run.dataset.as_ref().map_or_else(|| run.run.clone(), |dataset| format!("{dataset}/{}", run.run)),
                cell(Some(run.length_m), 1.0, 2),
                cell(run.max_position_m, 1e3, 2),
                cell(run.max_heading_rad, degrees, 3),
                cell(run.final_position_m, 1e3, 2),
                cell(run.final_heading_rad, degrees, 3),
            ]);
        }
    }
    terminal.say(&rows.to_string())
}

fn is_of_whole_datasets(given: Option<&GivenCalibration>) -> bool {
    given.is_some_and(GivenCalibration::changes_records)
}

fn show(calibrations: &[CalibrationDrift], terminal: &Terminal) -> Result<(), Failure> {
    let headers = [
        "calibration",
        "max pos.\nmm",
        "max head.\ndeg",
        "final pos.\nmax mm",
        "final head.\nmax deg",
        "final pos.\nmean mm",
        "final head.\nmean deg",
        "drift\n%",
    ];
    let mut table = table(&headers, 1);
    for drift in calibrations {
        let degrees = 180.0 / std::f64::consts::PI;
        table.add_row([
            drift.name.clone(),
            cell(drift.max_position_m, 1e3, 2),
            cell(drift.max_heading_rad, degrees, 3),
            cell(drift.max_final_position_m, 1e3, 2),
            cell(drift.max_final_heading_rad, degrees, 3),
            cell(drift.mean_final_position_m, 1e3, 2),
            cell(drift.mean_final_heading_rad, degrees, 3),
            cell(drift.drift_percent, 1.0, 3),
        ]);
    }
    terminal.say(&table.to_string())?;
    for drift in calibrations {
        if let Some(why) = &drift.why_null {
            terminal.say(&format!("{}: {why}", drift.name))?;
            continue;
        }
        // Some runs only: what is left out of the sums must be seen.
        let without = drift.runs.iter().filter(|run| run.why_null.is_some());
        if let Some((run, why)) = without.clone().find_map(|run| Some((&run.run, run.why_null?))) {
            let (name, all, without) = (&drift.name, drift.runs.len(), without.count());
            terminal.say(&format!("{name}: {without} of {all} runs are left out; {run}: {why}"))?;
        }
    }
    Ok(())
}

fn show_pose_errors(
    calibrations: &[CalibrationDrift],
    options: &PoseErrorOptions,
    terminal: &Terminal,
) -> Result<(), Failure> {
    let degrees = 180.0 / std::f64::consts::PI;
    let headers = [
        "calibration",
        "APE pos.\nRMSE mm",
        "APE pos.\nmax mm",
        "APE head.\nRMSE deg",
        "RPE pos.\nRMSE mm",
        "RPE pos.\nmax mm",
        "RPE head.\nRMSE deg",
    ];
    let mut rows = table(&headers, 1);
    for drift in calibrations {
        let both = [&drift.ape, &drift.rpe].map(Option::as_ref);
        let [ape_m, rpe_m] = both.map(|errors| errors.and_then(|errors| errors.translation_m));
        let [ape_rad, rpe_rad] = both.map(|errors| errors.and_then(|errors| errors.rotation_rad));
        rows.add_row([
            drift.name.clone(),
            cell(ape_m.map(|of| of.rmse), 1e3, 2),
            cell(ape_m.map(|of| of.max), 1e3, 2),
            cell(ape_rad.map(|of| of.rmse), degrees, 3),
            cell(rpe_m.map(|of| of.rmse), 1e3, 2),
            cell(rpe_m.map(|of| of.max), 1e3, 2),
            cell(rpe_rad.map(|of| of.rmse), degrees, 3),
        ]);
    }
    terminal.say(&rows.to_string())?;
    for drift in calibrations {
        let all = [("APE", &drift.ape, "--align"), ("RPE", &drift.rpe, "--delta")];
        for (what, errors, flag) in all {
            if let Some(why) = errors.as_ref().and_then(|errors| errors.why_null) {
                terminal.say(&format!("{}: no {what}: {why}", drift.name))?;
            } else if let Some((run, why, without)) = left_out(drift, what) {
                let (name, all) = (&drift.name, drift.runs.len());
                terminal.say(&format!("{name}: {what} ({flag}) is without {without} of {all} runs; {run}: {why}"))?;
            }
        }
    }
    let aligned = match options.alignment {
        Alignment::None => "not aligned",
        Alignment::Se2 => "aligned run by run in the plane",
    };
    terminal.say(&format!("APE {aligned} (--align); RPE over {} (--delta)", options.delta.describe()))
}

/// The first run without absolute or relative errors, why, and how many there are.
fn left_out<'a>(drift: &'a CalibrationDrift, what: &str) -> Option<(&'a str, &'static str, usize)> {
    let of = |run: &'a calib::RunDrift| {
        let errors = if what == "APE" { &run.ape } else { &run.rpe };
        Some((&run.run[..], errors.as_ref()?.why_null?))
    };
    let mut without = drift.runs.iter().filter_map(of);
    let (run, why) = without.next()?;
    Some((run, why, 1 + without.count()))
}

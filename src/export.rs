//! `yair export FORMAT CALIBRATION|MODEL|DATASET`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use ::diagnose::ExtendedModel;
use ::export::format::{EXPORTERS, Exporter, exporter};
use ::export::{CalibratedRobot, Lengths, Options, tum, tum_of_truth};
use calib::{CalibrationReport, MethodReport, corrected_run};
use clap::Args;
use clap::builder::PossibleValuesParser;
use dataset::{Loaded, NominalRobot, TruthSample};
use effects::OnBoard;
use scenario::Scenario;
use serde::Serialize;

use crate::calibration_file::{GivenCalibration, is_scenario};
use crate::correct::{file_of, only};
use crate::export_drift::{self, Drift};
use crate::export_into;
use crate::export_mcap;
use crate::new_folders::NewFolders;
use crate::simulate::{refuse_filled, write_whole};
use crate::terminal::{Failure, Terminal, listed_ids, warn};

/// Export calibrated parameters to a robot's own program, or a dataset's truth to other tools.
#[derive(Args)]
#[command(after_help = formats())]
pub(crate) struct Arguments {
    /// What to write.
    #[arg(value_name = "FORMAT", hide_possible_values = true, value_parser = PossibleValuesParser::new(EXPORTERS.iter().map(|format| format.name).chain([TUM, MCAP])))]
    format: String,
    /// Calibration file from `yair calibrate --out`, or extended model from `yair diagnose --out`; for `tum`
    /// and `mcap` a dataset.
    #[arg(value_name = "CALIBRATION|MODEL|DATASET")]
    source: PathBuf,
    /// File to write; standard output when left out. For `tum` a folder, with RUN.tum of every run.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// A file of the robot, such as controllers.yaml, robot.urdf or lino_base_config.h: the values are put
    /// into their places in it, everything else stays, and the changed lines are shown.
    #[arg(long, value_name = "FILE", conflicts_with = "out")]
    into: Option<PathBuf>,
    /// --into: show the changed lines, and write nothing.
    #[arg(long, requires = "into")]
    dry_run: bool,
    /// --replace and --without-effects together.
    #[arg(long)]
    force: bool,
    /// Replace a file that is already there.
    #[arg(long)]
    replace: bool,
    /// Export the geometry of an extended model in a format that cannot express its effects: it was fitted
    /// with them and is not right alone.
    #[arg(long)]
    without_effects: bool,
    /// A dataset of the robot, for nominal values that the calibration file does not have; c: with absolute
    /// truth, also for the drift that is left on board.
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    /// Which calibration of a file with several.
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// Formats of YAML: name of the node, as in diff_drive_controller. --into: which one of the file's.
    #[arg(long, value_name = "NAME")]
    controller: Option<String>,
    /// ros2-yaml and its like: nominal lengths, and multipliers that make them the calibrated ones (the
    /// default).
    #[arg(long, conflicts_with = "lengths")]
    multipliers: bool,
    /// ros2-yaml and its like: the calibrated geometry; multipliers hold the difference of the wheels alone.
    #[arg(long)]
    lengths: bool,
    /// ros2-yaml and its like: speed at which the twist's covariance is stated [default: 0.25].
    #[arg(long, value_name = "M/S")]
    speed: Option<f64>,
    /// ros2-yaml and its like: rate of the controller's twists [default: 50].
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// c: width of the wheels' counters, 8 to 64 bits [default: the dataset's, or 32].
    #[arg(long, value_name = "BITS")]
    counter_bits: Option<u8>,
    /// tum: dead reckoning under this calibration instead of the truth. mcap: its path too; may be given
    /// several times.
    #[arg(long = "calibration", value_name = "FILE")]
    calibrations: Vec<PathBuf>,
    /// tum, mcap: this run alone.
    #[arg(long, value_name = "ID")]
    run: Option<String>,
}

/// The formats of datasets; all others are of calibrations.
const TUM: &str = "tum";
const MCAP: &str = "mcap";
/// Flags of calibrations alone, and of datasets alone.
const OF_CALIBRATIONS: [&str; 4] = ["dataset", "method", "without-effects", "into"];
const OF_DATASETS: [&str; 2] = ["calibration", "run"];

fn formats() -> String {
    let of_datasets = [
        (TUM, "a dataset's truth, for evo and its like: t x y z qx qy qz qw"),
        (MCAP, "a dataset's truth, paths and wheels as a bag of ROS 2, for Foxglove, PlotJuggler and evo"),
    ];
    let all = EXPORTERS.iter().map(|format| (format.name, format.about)).chain(of_datasets);
    let lines: Vec<String> = all.map(|(name, about)| format!("  {name:18} {about}")).collect();
    format!("Formats:\n{}", lines.join("\n"))
}

#[derive(Serialize)]
struct Document {
    format: String,
    source: String,
    calibration: Option<String>,
    /// The file or folder; null where the text stands in this document.
    out: Option<String>,
    text: Option<String>,
    /// The robot's own file that was edited, and its changed lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    into: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    diff: Option<String>,
    /// Effects of an extended model that the format cannot express.
    left_out: Vec<LeftOut>,
    cautions: Vec<String>,
    /// Drift with and without the file, of formats that run effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    drift_percent: Option<Drift>,
    /// Runs of a dataset.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    runs: Vec<String>,
}

#[derive(Serialize)]
struct LeftOut {
    id: &'static str,
    meaning: &'static str,
    /// Why it cannot run on board, where the format runs effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<&'static str>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let format = exporter(&arguments.format);
    let takes: Vec<&str> = match format {
        Some(format) => [&OF_CALIBRATIONS, format.takes].concat(),
        None => OF_DATASETS.to_vec(),
    };
    if let Some(flag) = arguments.given().into_iter().find(|flag| !takes.contains(flag)) {
        let flags: Vec<String> = takes.iter().map(|flag| format!("--{flag}")).collect();
        let why = format!("--{flag} is not for the format {}; it takes {}", arguments.format, flags.join(", "));
        terminal.failure(&why);
        return Ok(ExitCode::from(2));
    }
    match format {
        Some(format) => export_calibration(format, arguments, terminal),
        None if arguments.format == MCAP => export_bag(arguments, terminal),
        None => export_dataset(arguments, terminal),
    }
}

fn export_bag(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let Some(out) = &arguments.out else {
        terminal.failure("mcap: a bag is no text for standard output; give --out FILE.mcap");
        return Ok(ExitCode::from(2));
    };
    refuse_taken(out, arguments.replaces())?;
    let calibrations: Vec<Vec<GivenCalibration>> =
        arguments.calibrations.iter().map(|file| GivenCalibration::read(file)).collect::<Result<_, _>>()?;
    let calibrations: Vec<GivenCalibration> = calibrations.into_iter().flatten().collect();
    export_mcap::run(&arguments.source, out, &calibrations, arguments.run.as_deref(), terminal)
}

impl Arguments {
    /// The flags of single formats that are given.
    fn given(&self) -> Vec<&'static str> {
        let given = [
            ("dataset", self.dataset.is_some()),
            ("method", self.method.is_some()),
            ("into", self.into.is_some()),
            ("controller", self.controller.is_some()),
            ("multipliers", self.multipliers),
            ("lengths", self.lengths),
            ("speed", self.speed.is_some()),
            ("rate", self.rate.is_some()),
            ("counter-bits", self.counter_bits.is_some()),
            ("calibration", !self.calibrations.is_empty()),
            ("run", self.run.is_some()),
            ("without-effects", self.without_effects),
        ];
        given.into_iter().filter_map(|(flag, is_given)| is_given.then_some(flag)).collect()
    }

    /// Whether files that are there may be replaced.
    const fn replaces(&self) -> bool {
        self.force || self.replace
    }

    fn options(&self) -> Options {
        let Options { lengths, speed_m_s, rate_hz, .. } = Options::default();
        Options {
            controller: self.controller.clone(),
            lengths: if self.lengths { Lengths::Calibrated } else { lengths },
            speed_m_s: self.speed.unwrap_or(speed_m_s),
            rate_hz: self.rate.unwrap_or(rate_hz),
            counter_bits: self.counter_bits,
        }
    }
}

fn export_calibration(format: &Exporter, arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(out) = &arguments.out {
        refuse_taken(out, arguments.replaces())?;
    }
    let options = arguments.options();
    options.check()?;
    let robot = robot(arguments, terminal)?;
    let why = |of: OnBoard| format.has_effects.then(|| of.detail());
    let left_out: Vec<LeftOut> = robot
        .left_out(format.has_effects)
        .map(|effect| LeftOut { id: effect.id, meaning: effect.meaning, why: why(effect.on_board) })
        .collect();
    if !format.has_effects && !arguments.force && !arguments.without_effects {
        refuse_misleading(format, &robot, &arguments.source)?;
    }
    for LeftOut { id, meaning, why } in &left_out {
        let why = why.map_or_else(String::new, |why| format!(": {why}"));
        terminal.remark(&format!("{}: left out: {id} ({meaning}){why}", arguments.source.display()));
    }
    for caution in &robot.cautions {
        terminal.remark(&format!("warning: {}: {caution}", arguments.source.display()));
    }
    let drift = match format.has_effects {
        true => Some(export_drift::of(&robot, &arguments.source, arguments.dataset.as_deref(), &options, terminal)?),
        false => None,
    };
    let (name, mut cautions) = (robot.name.clone(), robot.cautions.clone());
    let (mut text, mut changed) = (None, None);
    match (&arguments.into, &arguments.out) {
        (Some(file), _) => {
            let put = export_into::run(format, robot, &options, file, arguments.dry_run, terminal)?;
            cautions.extend(put.remarks);
            changed = Some(put.diff);
        }
        (None, Some(out)) => {
            write_whole(out, (format.render)(&robot, &options)?.as_bytes())?;
            terminal.note(&format!("{} in {}", format.name, out.display()))?;
            drift.as_ref().map_or(Ok(()), |drift| terminal.say(&drift.text()))?;
        }
        (None, None) => {
            // The text alone stands on standard output.
            let rendered = text.insert((format.render)(&robot, &options)?);
            terminal.say(rendered.trim_end_matches('\n'))?;
            drift.iter().for_each(|drift| terminal.remark(&drift.text()));
        }
    }
    terminal.document(&Document {
        format: format.name.to_owned(),
        source: arguments.source.display().to_string(),
        calibration: Some(name),
        out: arguments.out.as_ref().map(|out| out.display().to_string()),
        text,
        into: arguments.into.as_ref().map(|file| file.display().to_string()),
        diff: changed,
        left_out,
        cautions,
        drift_percent: drift,
        runs: Vec::new(),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses a geometry that is right only beside effects of the robot, in a format that cannot express them:
/// it was fitted beside them, and alone it may drift more than the nominal one.
fn refuse_misleading(format: &Exporter, robot: &CalibratedRobot, source: &Path) -> Result<(), Failure> {
    let acts = |of: OnBoard| {
        matches!(of, OnBoard::Static(_) | OnBoard::State { .. } | OnBoard::Input { .. } | OnBoard::Constant(_))
    };
    let beside: Vec<&str> =
        robot.left_out(format.has_effects).filter(|effect| acts(effect.on_board)).map(|effect| effect.id).collect();
    if beside.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}: its geometry is right only with {}, which {} cannot express; export the calibration.toml that `yair diagnose --out` writes next to it, or \
         `yair export c {0}`; --without-effects writes it all the same",
        source.display(),
        beside.join(", "),
        format.name
    )
    .into())
}

/// Refuses to replace a file, unless that is asked for.
fn refuse_taken(out: &Path, replace: bool) -> Result<(), Failure> {
    if out.is_dir() {
        return Err(format!("{}: it is a folder, where a file belongs; give a file's name", out.display()).into());
    }
    if out.exists() && !replace {
        let why = "already exists; nothing was written: choose another name, or give --replace";
        return Err(format!("{}: {why}", out.display()).into());
    }
    Ok(())
}

/// The robot of a calibration file or an extended model.
fn robot(arguments: &Arguments, terminal: &Terminal) -> Result<CalibratedRobot, Failure> {
    let source = &arguments.source;
    let place = source.display().to_string();
    if source.is_dir() {
        let why = format!(
            "it is a folder; {} takes a calibration file, from yair calibrate DATASET --out FILE",
            arguments.format
        );
        return Err(format!("{place}: {why}").into());
    }
    let nominal = arguments.dataset.as_ref().map(|path| stated(path, terminal)).transpose()?;
    if is_scenario(source)? {
        if let Some(method) = &arguments.method {
            return Err(
                format!("{place}: it is an extended model and has no method {method}; leave --method out").into()
            );
        }
        let scenario = Scenario::read(source)?;
        let model = ExtendedModel::of(&scenario).map_err(|error| format!("{place}: {error}"))?;
        return Ok(CalibratedRobot::of_model(&place, &scenario, &model, nominal.as_ref())?);
    }
    let report = CalibrationReport::read(source)?;
    let method = chosen(&report, arguments.method.as_deref(), &place)?;
    Ok(CalibratedRobot::of_method(&place, method, nominal.as_ref())?)
}

/// What a dataset states of its robot.
fn stated(path: &Path, terminal: &Terminal) -> Result<NominalRobot, Failure> {
    let opened = dataset::RunByRun::open(path)?;
    warn(path, opened.warnings(), terminal);
    Ok(opened.header().robot)
}

/// The method of a file that is asked for, or its only one.
fn chosen<'r>(report: &'r CalibrationReport, name: Option<&str>, place: &str) -> Result<&'r MethodReport, Failure> {
    let of = |method: &&MethodReport| name.is_none_or(|name| method.method == name);
    let found: Vec<&MethodReport> = report.methods.iter().filter(of).collect();
    let names: Vec<&str> = report.methods.iter().map(|method| &method.method[..]).collect();
    match (&found[..], name) {
        ([method], _) => Ok(method),
        ([], Some(name)) => Err(format!("{place}: it has no method {name}; it has {}", names.join(", ")).into()),
        ([], None) => Err(format!("{place}: it holds no calibration").into()),
        _ => Err(format!(
            "{place}: it holds {} calibrations ({}); choose one by --method",
            names.len(),
            names.join(", ")
        )
        .into()),
    }
}

/// Poses of a dataset's runs.
fn export_dataset(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let path = &arguments.source;
    let place = path.display().to_string();
    if let Some(out) = &arguments.out {
        refuse_filled(out, arguments.replaces())?;
    }
    let calibration = match &arguments.calibrations[..] {
        [] => None,
        [file] => Some(only(GivenCalibration::read(file)?)?),
        several => return Err(format!("tum: one --calibration at a time, {} are given", several.len()).into()),
    };
    let Loaded { dataset, warnings } = dataset::read(path)?;
    warn(path, &warnings, terminal);
    let records = match &calibration {
        Some(calibration) => {
            calibration.check(&dataset.robot, &place)?;
            calibration.undone(&dataset, &place, terminal)?
        }
        None => std::borrow::Cow::Borrowed(&dataset),
    };
    let session = records.session();
    let is_chosen = |id: &str| arguments.run.as_deref().is_none_or(|only| only == id);
    let ids = || listed_ids(session.runs.iter().map(|run| &run.info().id[..]));
    match (&arguments.run, session.runs.iter().filter(|run| is_chosen(&run.info().id)).count()) {
        (Some(id), 0) => return Err(format!("{place}: it has no run \"{id}\"; it has {}", ids()).into()),
        (None, several) if several > 1 && arguments.out.is_none() => {
            return Err(format!("{place}: it has {several} runs ({}); give --out DIR, or --run ID", ids()).into());
        }
        _ => {}
    }
    let mut texts = Vec::new();
    let mut driven_m = 0.0;
    for run in &session.runs {
        let id = &run.info().id;
        // Runs before the chosen one count: effects may go by the distance driven in the session.
        let text = match &calibration {
            Some(calibration) => {
                let corrected = corrected_run(&session, run, calibration.calibration(), &mut driven_m);
                let why = "its wheels say no motion; counts need ticks_per_rev in dataset.toml";
                tum(corrected.ok_or_else(|| format!("{place}: run \"{id}\": {why}"))?.poses)
            }
            None if !is_chosen(id) => continue,
            None => trajectory_of_truth(&run.run().truth, &format!("{place}: run \"{id}\""), terminal),
        };
        if is_chosen(id) {
            texts.push((id.clone(), text));
        }
    }
    if let Some((id, _)) = texts.iter().find(|(_, text)| text.is_empty()) {
        let why = "has no truth of poses (truth.csv); --calibration FILE exports its odometry";
        return Err(format!("{place}: run \"{id}\" {why}").into());
    }
    let text = match (&arguments.out, &texts[..]) {
        (Some(out), texts) => {
            write_trajectories(out, texts, &place)?;
            terminal.note(&format!("{} runs in {}", texts.len(), out.display()))?;
            None
        }
        (None, texts) => {
            let text: String = texts.iter().map(|(_, text)| &text[..]).collect();
            terminal.say(text.trim_end_matches('\n'))?;
            Some(text)
        }
    };
    terminal.document(&Document {
        format: TUM.to_owned(),
        source: place,
        calibration: calibration.map(|of| of.calibration().calibration.name.clone()),
        out: arguments.out.as_ref().map(|out| out.display().to_string()),
        text,
        into: None,
        diff: None,
        left_out: Vec::new(),
        cautions: Vec::new(),
        drift_percent: None,
        runs: texts.into_iter().map(|(id, _)| id).collect(),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// The truth of a run, whose place is named where a heading is not known.
fn trajectory_of_truth(truth: &[TruthSample], place: &str, terminal: &Terminal) -> String {
    let (text, without) = tum_of_truth(truth);
    if without > 0 {
        let what = format!("{without} positions without a heading: the file's headings are 0 there");
        terminal.remark(&format!("warning: {place}: {what}"));
    }
    text
}

/// Writes the trajectories of runs, a file each.
fn write_trajectories(out: &Path, texts: &[(String, String)], place: &str) -> Result<(), Failure> {
    // All names before the first file.
    let files = texts.iter().map(|(id, _)| file_of(out, id, TUM, place)).collect::<Result<Vec<_>, _>>()?;
    let _new = NewFolders::to(out);
    atomic_file::create_folder(out).map_err(|error| format!("{}: {}", out.display(), error.kind()))?;
    atomic_file::remove_leftovers(out);
    for (file, (_, text)) in files.iter().zip(texts) {
        atomic_file::write_whole(file, text.as_bytes())
            .map_err(|error| format!("{}: {}", file.display(), error.kind()))?;
    }
    Ok(())
}

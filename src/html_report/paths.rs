//! The robot's paths and its drift under several calibrations, as `yair correct` and `yair evaluate` have
//! them.

use ::diagnose::ExtendedModel;
use calib::{
    AugmentedCalibration, CalibrationDrift, EvaluatedInstrument, EvaluationOptions, RunPath, evaluate_runs_and_paths,
    with_instrument,
};
use dataset::{Dataset, Session};
use kinematics::Pose;
use report_page::{Block, ErrorPicture, ModelErrors, PathPicture, PathRun, Role, RunErrors, Section};

use super::driven::{self, Driven};

/// A track of measurements is drawn where there is one for so many rows of the log; fewer are drawn as single
/// positions, for lines between them would be no path.
const MAX_ROWS_PER_MEASUREMENT: usize = 5;

/// A calibration under which runs are dead-reckoned.
pub(crate) struct Under<'c> {
    pub(crate) name: String,
    pub(crate) role: Role,
    /// `None` for the nominal values.
    pub(crate) calibration: Option<&'c AugmentedCalibration>,
    /// The model whose faults of the records are undone before.
    pub(crate) model: Option<&'c ExtendedModel>,
}

/// Runs under several calibrations.
pub(crate) struct UnderCalibrations {
    pub(crate) drifts: Vec<(String, Role, CalibrationDrift)>,
    pub(crate) picture: Option<PathPicture>,
    errors: Option<ErrorPicture>,
    driven: Vec<Driven>,
    /// The logs were too large to be held.
    too_large: bool,
}

impl UnderCalibrations {
    /// Dead reckoning of all runs. What a model cannot undo is dead-reckoned as it was recorded.
    pub(crate) fn of(datasets: &[Dataset], under: &[Under<'_>]) -> Self {
        let options = EvaluationOptions { name_runs: datasets.len() > 1, pose_errors: None };
        let sessions: Vec<Session<'_>> = datasets.iter().map(Dataset::session).collect();
        let instrument_of = |session: &Session<'_>| {
            let own: Vec<_> = under.iter().filter_map(|of| Some(of.calibration?.in_session(session.name))).collect();
            EvaluatedInstrument::of(own.iter().map(|own| &own.calibration), session)
        };
        let instruments: Vec<Option<EvaluatedInstrument>> = sessions.iter().map(instrument_of).collect();
        let mut runs_under: Vec<Vec<Option<RunPath>>> = Vec::new();
        let mut drifts = Vec::new();
        for of in under {
            let (mut paths, mut drift) = (Vec::new(), Vec::new());
            for ((dataset, session), instrument) in datasets.iter().zip(&sessions).zip(&instruments) {
                let own = of.calibration.map(|calibration| calibration.in_session(session.name));
                let calibration = with_instrument(own.as_deref(), instrument.as_ref());
                let undone =
                    of.model.filter(|model| model.changes_records()).and_then(|model| model.undone(dataset).ok());
                let records = undone.as_ref().map_or(dataset, |(records, _)| records);
                let session = records.session();
                for (of_run, path) in evaluate_runs_and_paths(&session, calibration.as_deref(), &options, &mut 0.0) {
                    drift.push(of_run);
                    paths.push(path);
                }
            }
            let named = of.calibration.map(|calibration| &calibration.calibration);
            drifts.push((of.name.clone(), of.role, CalibrationDrift::of_runs(named, drift)));
            runs_under.push(paths);
        }
        let order = order(datasets, &drifts);
        let picture = picture(under, &order, &runs_under);
        let errors = errors(under, &order, &runs_under);
        let mut nominal = runs_under.first().map_or(&[][..], Vec::as_slice);
        let driven = datasets.iter().map(|dataset| {
            let (own, rest) = nominal.split_at(dataset.runs.len().min(nominal.len()));
            nominal = rest;
            Driven::of(dataset, own)
        });
        let driven = driven.collect();
        Self { drifts, picture, errors, driven, too_large: datasets.is_empty() }
    }

    /// What was driven; the table is taken out.
    pub(super) fn driven_section(&mut self) -> Section {
        driven::section(std::mem::take(&mut self.driven))
    }

    /// Errors along each run, where anything was measured; the picture is taken out.
    pub(super) fn errors_block(&mut self) -> Option<Block> {
        self.errors.take().map(Block::Errors)
    }

    /// The picture of the paths.
    pub(super) fn path_block(&self) -> Block {
        match &self.picture {
            Some(picture) => Block::Path(picture.clone()),
            None if self.too_large => Block::Text(
                "No path is drawn: these logs are too large to be held in memory as a whole. Give a few of their runs."
                    .to_owned(),
            ),
            None => Block::Text("No path is drawn: no run has wheels that say a motion.".to_owned()),
        }
    }
}

/// Names of runs, with the session's where there are several.
pub(super) fn run_names(datasets: &[Dataset]) -> Vec<String> {
    let of = |dataset: &Dataset| {
        let name = dataset.provenance.name.clone().unwrap_or_default();
        let one = |run: &dataset::Run| {
            if datasets.len() > 1 { format!("{name}/{}", run.info.id) } else { run.info.id.clone() }
        };
        dataset.runs.iter().map(one).collect::<Vec<_>>()
    };
    datasets.iter().flat_map(of).collect()
}

/// Runs by name, the one that ends farthest from the truth with the first calibration at the front.
fn order(datasets: &[Dataset], drifts: &[(String, Role, CalibrationDrift)]) -> Vec<(usize, String)> {
    let final_m =
        |run: usize| drifts.first().and_then(|(_, _, drift)| drift.runs.get(run)?.final_position_m).unwrap_or(0.0);
    let mut order: Vec<(usize, String)> = run_names(datasets).into_iter().enumerate().collect();
    order.sort_by(|(a, _), (b, _)| final_m(*b).total_cmp(&final_m(*a)));
    order
}

/// One run under every calibration.
fn under_each(runs_under: &[Vec<Option<RunPath>>], run: usize) -> Vec<Option<&RunPath>> {
    runs_under.iter().map(|paths| paths.get(run)?.as_ref()).collect()
}

/// Errors along each run; `None` where nothing was measured at two instants of any.
fn errors(under: &[Under<'_>], order: &[(usize, String)], runs_under: &[Vec<Option<RunPath>>]) -> Option<ErrorPicture> {
    let of = |(run, name): &(usize, String)| run_errors(name, &under_each(runs_under, *run));
    let runs: Vec<RunErrors> = order.iter().filter_map(of).collect();
    (!runs.is_empty()).then(|| ErrorPicture {
        title: "Errors along a run".to_owned(),
        caption: "How far dead reckoning is from the measured pose, from where the run was first measured on. The run that ends farthest from the truth is chosen first.".to_owned(),
        models: under.iter().map(|of| (of.name.clone(), of.role)).collect(),
        runs,
    })
}

fn run_errors(name: &str, under: &[Option<&RunPath>]) -> Option<RunErrors> {
    let last = under.iter().rev().find_map(|path| *path)?;
    let instants: Vec<usize> = (0..last.measured.len()).filter(|at| last.at_measured[*at].is_some()).collect();
    let (first, _) = (instants.first()?, instants.get(1)?);
    let poses: Vec<Pose> = instants.iter().filter_map(|at| last.at_measured[*at]).collect();
    let mut distance_m = vec![0.0; poses.len()];
    for (k, pair) in poses.windows(2).enumerate() {
        distance_m[k + 1] = distance_m[k] + (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m);
    }
    let model = |path: &Option<&RunPath>| {
        let path = path.filter(|path| path.at_measured.len() == last.measured.len())?;
        let pairs = || instants.iter().map(|at| (path.at_measured[*at], last.measured[*at]));
        let position_m = |(found, seen): (Option<Pose>, Pose)| {
            found.map_or(f64::NAN, |found| (found.x_m - seen.x_m).hypot(found.y_m - seen.y_m))
        };
        let heading_rad = |(found, seen): (Option<Pose>, Pose)| {
            found.map_or(f64::NAN, |found| kinematics::wrap_to_pi(found.theta_rad - seen.theta_rad))
        };
        let mut errors = ModelErrors {
            position_m: pairs().map(position_m).collect(),
            heading_rad: pairs().map(heading_rad).collect(),
        };
        if errors.heading_rad.iter().all(|error_rad| error_rad.is_nan()) {
            errors.heading_rad.clear();
        }
        Some(errors)
    };
    Some(RunErrors {
        name: name.to_owned(),
        t_s: instants.iter().map(|at| last.measured_t_s[*at] - last.measured_t_s[*first]).collect(),
        distance_m,
        models: under.iter().map(model).collect(),
    })
}

fn picture(under: &[Under<'_>], order: &[(usize, String)], runs_under: &[Vec<Option<RunPath>>]) -> Option<PathPicture> {
    let of = |(run, name): &(usize, String)| path_run(name, &under_each(runs_under, *run));
    let runs: Vec<PathRun> = order.iter().filter_map(of).collect();
    if runs.is_empty() {
        return None;
    }
    let any_truth = runs.iter().any(|run| !run.tracks[0].is_empty() || !run.marks.is_empty());
    let caption = if any_truth {
        "Every run begins where it was first measured, and is then dead-reckoned. The run that ends farthest from the truth is first in the list. The menu magnifies deviations."
    } else {
        "No pose was measured: every run begins at the origin, and nothing says which path is right."
    };
    let tracks = std::iter::once(("measured".to_owned(), Role::Truth));
    Some(PathPicture {
        title: "The robot seen from above".to_owned(),
        caption: caption.to_owned(),
        tracks: tracks.chain(under.iter().map(|of| (of.name.clone(), of.role))).collect(),
        runs,
    })
}

/// A run under every calibration, at the same instants.
fn path_run(name: &str, under: &[Option<&RunPath>]) -> Option<PathRun> {
    let last = under.iter().rev().find_map(|path| *path)?;
    let position = |pose: &Pose| [pose.x_m, pose.y_m];
    let dense = last.measured.len() * MAX_ROWS_PER_MEASUREMENT >= last.rows.len();
    let usable = |path: &&RunPath| path.at_measured.len() == last.measured.len();
    let everywhere =
        |at: &usize| under.iter().flatten().filter(|path| usable(path)).all(|path| path.at_measured[*at].is_some());
    let instants: Vec<usize> = (0..last.measured.len()).filter(everywhere).collect();
    if dense && instants.len() > 1 {
        let measured = instants.iter().map(|at| position(&last.measured[*at])).collect();
        let track = |path: &Option<&RunPath>| match path.filter(usable) {
            Some(path) => instants.iter().filter_map(|at| path.at_measured[*at].as_ref().map(position)).collect(),
            None => Vec::new(),
        };
        let tracks = std::iter::once(measured).chain(under.iter().map(track)).collect();
        return Some(PathRun { name: name.to_owned(), tracks, marks: Vec::new() });
    }
    let track = |path: &Option<&RunPath>| match path.filter(|path| path.rows.len() == last.rows.len()) {
        Some(path) => path.rows.iter().map(position).collect(),
        None => Vec::new(),
    };
    let tracks = std::iter::once(Vec::new()).chain(under.iter().map(track)).collect();
    let marks = last.measured.iter().map(position).collect();
    (!last.rows.is_empty()).then(|| PathRun { name: name.to_owned(), tracks, marks })
}

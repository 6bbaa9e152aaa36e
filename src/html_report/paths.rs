//! The robot's paths and its drift under several calibrations, as `yair correct` and `yair evaluate` have
//! them.

use ::diagnose::ExtendedModel;
use calib::{AugmentedCalibration, CalibrationDrift, EvaluationOptions, RunPath, evaluate_runs_and_paths};
use dataset::Dataset;
use kinematics::Pose;
use report_page::{Block, PathPicture, PathRun, Role};

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
    /// The logs were too large to be held.
    too_large: bool,
}

impl UnderCalibrations {
    /// Dead reckoning of all runs. What a model cannot undo is dead-reckoned as it was recorded.
    pub(crate) fn of(datasets: &[Dataset], under: &[Under<'_>]) -> Self {
        let options = EvaluationOptions { name_runs: datasets.len() > 1, pose_errors: None };
        let mut runs_under: Vec<Vec<Option<RunPath>>> = Vec::new();
        let mut drifts = Vec::new();
        for of in under {
            let (mut paths, mut drift) = (Vec::new(), Vec::new());
            for dataset in datasets {
                let undone =
                    of.model.filter(|model| model.changes_records()).and_then(|model| model.undone(dataset).ok());
                let records = undone.as_ref().map_or(dataset, |(records, _)| records);
                let session = records.session();
                for (of_run, path) in evaluate_runs_and_paths(&session, of.calibration, &options, &mut 0.0) {
                    drift.push(of_run);
                    paths.push(path);
                }
            }
            let named = of.calibration.map(|calibration| &calibration.calibration);
            drifts.push((of.name.clone(), of.role, CalibrationDrift::of_runs(named, drift)));
            runs_under.push(paths);
        }
        let picture = picture(datasets, under, &runs_under, &drifts);
        Self { drifts, picture, too_large: datasets.is_empty() }
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

fn picture(
    datasets: &[Dataset],
    under: &[Under<'_>],
    runs_under: &[Vec<Option<RunPath>>],
    drifts: &[(String, Role, CalibrationDrift)],
) -> Option<PathPicture> {
    let names = run_names(datasets);
    let final_m =
        |run: usize| drifts.first().and_then(|(_, _, drift)| drift.runs.get(run)?.final_position_m).unwrap_or(0.0);
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by(|a, b| final_m(*b).total_cmp(&final_m(*a)));
    let runs: Vec<PathRun> = order
        .into_iter()
        .filter_map(|run| {
            path_run(&names[run], &runs_under.iter().map(|paths| paths.get(run)?.as_ref()).collect::<Vec<_>>())
        })
        .collect();
    if runs.is_empty() {
        return None;
    }
    let any_truth = runs.iter().any(|run| !run.tracks[0].is_empty() || !run.marks.is_empty());
    let caption = if any_truth {
        "Every run begins where it was first measured, and is then dead-reckoned. The run that ends farthest from the truth stands first in the list. Deviations of millimetres are hard to see on metres: the menu draws them larger."
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

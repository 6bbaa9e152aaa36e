//! What the paper's figures 4, 6 and 7 show, from simulation: numbers only, drawn elsewhere.
//!
//! Figure 4: the contacts of a robot that spins on unequal wheels keep one locus while its centre goes round.
//! Figure 6: the sensitivities of one experiment. Figure 7: the 40 m path with eight quarter turns, read
//! every 0.5 m, under both calibrations, and the claim that the error stays below 10 %.

use calib::Method;
use calib::methods::direct::Direct;
use calib::methods::umbmark::Umbmark;
use dataset::{Protocol, RunView};
use kinematics::{DriveGeometry, GeometryError, Increment, Point, Pose, Rule, Wheels};
use motion_programs::Schedule;
use rayon::prelude::*;
use scenario::{Instrument, Scenario};
use serde::Serialize;
use sim_yair::SimulationError;

use super::published::{Column, TABLE_2_DIRECT, TABLE_2_UMBMARK};
use super::table_1::quantile;
use super::units::MM_PER_M;
use bench::Trial;

/// Figure 4: where the contacts and the centre go in a spin at constant wheel speeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure4 {
    /// How much larger the right wheel is than the left one, over what is realistic so that the eye sees it.
    pub right_over_left: f64,
    /// Left contact, metres, x and y.
    pub left_m: Vec<[f64; 2]>,
    /// Right contact, metres.
    pub right_m: Vec<[f64; 2]>,
    /// Centre, metres.
    pub centre_m: Vec<[f64; 2]>,
}

/// Figure 7: the validation path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure7 {
    /// Distance driven at each reading, metres, nominal.
    pub distance_m: Vec<f64>,
    /// One experiment's true path as it was read, metres, x and y.
    pub read_m: Vec<[f64; 2]>,
    /// The account of each set of parameters.
    pub methods: Vec<PathErrors>,
}

/// What odometry under one set of parameters missed along the path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathErrors {
    /// Whose parameters: a method's estimates in the same experiment, or the paper's table 2.
    pub method: &'static str,
    /// The same experiment's path by the odometry, metres, x and y.
    pub reckoned_m: Vec<[f64; 2]>,
    /// Median position error at each reading, metres.
    pub median_m: Vec<f64>,
    /// 2.5 percentile of the position error at each reading, metres.
    pub low_m: Vec<f64>,
    /// 97.5 percentile of the position error at each reading, metres.
    pub high_m: Vec<f64>,
    /// Share of the experiments whose error stays below 10 % of the distance at every reading from the first
    /// metre on.
    pub below_ten_percent: f64,
    /// 95 % interval of that share (Wilson 1927), which does not shrink to nothing when all experiments
    /// agree.
    pub below_ten_percent_interval: [f64; 2],
}

/// Wilson's score interval of a share at 95 %.
fn wilson(share: f64, n: f64) -> [f64; 2] {
    let zz = 1.959_963_984_540_054_f64.powi(2);
    let center = (share + 0.5 * zz / n) / (1.0 + zz / n);
    let half = (zz * (share * (1.0 - share) / n + 0.25 * zz / (n * n))).sqrt() / (1.0 + zz / n);
    [(center - half).max(0.0), (center + half).min(1.0)]
}

/// The mismatch that figure 4 is drawn with.
const DRAWN_MISMATCH: f64 = 1.2;

/// Steps of a turn in figure 4.
pub(crate) const STEPS_A_TURN: u32 = 90;

/// Turns in figure 4.
pub(crate) const TURNS: u32 = 3;

/// Figure 4 for a robot of given geometry.
#[must_use]
pub fn figure_4(nominal: &DriveGeometry) -> Figure4 {
    let base_m = nominal.wheel_separation_m();
    let contacts = Wheels { left: Point::new(0.0, 0.5 * base_m), right: Point::new(0.0, -0.5 * base_m) };
    let step_rad = std::f64::consts::TAU / f64::from(STEPS_A_TURN);
    // Wheel travels of a turn on the spot, the right wheel's larger by the mismatch.
    let half_m = base_m * step_rad / (1.0 + DRAWN_MISMATCH);
    let increment = Increment::from_travel(Wheels { left: -half_m, right: DRAWN_MISMATCH * half_m }, base_m);
    let mut figure =
        Figure4 { right_over_left: DRAWN_MISMATCH, left_m: Vec::new(), right_m: Vec::new(), centre_m: Vec::new() };
    let mut pose = Pose::IDENTITY;
    for _ in 0..=STEPS_A_TURN * TURNS {
        let place = |point: Point| [point.x_m, point.y_m];
        figure.left_m.push(place(pose * contacts.left));
        figure.right_m.push(place(pose * contacts.right));
        figure.centre_m.push(place(pose.position()));
        pose = pose * increment.arc();
    }
    figure
}

/// Position errors at the readings of one experiment's path, by each method.
struct Walk {
    errors_m: [Vec<f64>; PARAMETERS.len()],
    paths: Option<Paths>,
}

/// Points in the plane, metres.
type Path = Vec<[f64; 2]>;

/// The path as it was read, and as dead reckoning with each set of parameters has it.
type Paths = (Path, [Path; PARAMETERS.len()]);

/// Parameters that dead reckoning uses: each method's own estimates in the same experiment, and what the
/// paper prints in table 2.
const PARAMETERS: [&str; 4] = ["direct", "umbmark", "direct, published", "umbmark, published"];

/// The drive that a column of table 2 means to a robot that believes in 1 mm/pulse.
fn published_drive(column: &Column, nominal: &DriveGeometry) -> Result<DriveGeometry, GeometryError> {
    let sensitivity = column.sensitivity.map(|printed| printed.value);
    let diameter_m =
        nominal.wheel_diameter_m().zip_with(sensitivity, |nominal_m, mm_per_pulse| nominal_m * mm_per_pulse);
    DriveGeometry::new(diameter_m, column.base.value / MM_PER_M)
}

/// Trials that one task drives.
const TRIALS_PER_TASK: u64 = 25;

/// Distance from which the relative error is judged: at the first readings a millimetre of reading error is a
/// large share of nothing.
const JUDGED_FROM_M: f64 = 1.0;

/// Length of the path and distance between readings.
const PATH: Schedule = Schedule::ValidationPath { length_m: 40.0, measure_every_m: 0.5, runs: 1 };

/// Figure 7: each trial calibrates by both methods and then walks the path.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn figure_7(
    base: &Scenario,
    reading_sigma_m: f64,
    trials: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Figure7, SimulationError> {
    let mut scenario = base.clone();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m }];
    scenario.protocols.push(PATH);
    let nominal = scenario.nominal_geometry()?;
    let published = [published_drive(&TABLE_2_DIRECT, &nominal)?, published_drive(&TABLE_2_UMBMARK, &nominal)?];
    let walks: Result<Vec<Vec<Walk>>, SimulationError> = (0..trials.div_ceil(TRIALS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let mut trial = Trial::new(&scenario, scenario.seed)?;
            let from = task * TRIALS_PER_TASK;
            let mut walks = Vec::new();
            for number in from..(from + TRIALS_PER_TASK).min(trials) {
                let session = [trial.drive(number)?];
                let (direct, umbmark) = (Direct::DEFAULT.calibrate(&session), Umbmark::DEFAULT.calibrate(&session));
                let path = session[0].runs.iter().find(|run| run.info().protocol == Some(Protocol::Path));
                if let (Ok(direct), Ok(umbmark), Some(path)) = (direct, umbmark, path) {
                    let drives = [direct.geometry, umbmark.geometry, published[0], published[1]];
                    walks.push(walk(path, &session[0], &drives, number == 0));
                }
            }
            progress(walks.len() as u64);
            Ok(walks)
        })
        .collect();
    let walks: Vec<Walk> = walks?.into_iter().flatten().collect();
    let readings = walks.first().map_or(0, |walk| walk.errors_m[0].len());
    let distance_m: Vec<f64> = (0..readings).map(|reading| 0.5 * reading as f64).collect();
    let (read_m, reckoned_m) = walks.iter().find_map(|walk| walk.paths.clone()).unwrap_or_default();
    let methods = PARAMETERS
        .iter()
        .zip(reckoned_m)
        .enumerate()
        .map(|(k, (method, reckoned_m))| {
            let at = |reading: usize| {
                let mut errors: Vec<f64> = walks.iter().map(|walk| walk.errors_m[k][reading]).collect();
                errors.sort_unstable_by(f64::total_cmp);
                [0.025, 0.5, 0.975].map(|share| quantile(&errors, share))
            };
            let bands: Vec<[f64; 3]> = (0..readings).map(at).collect();
            let holds = |walk: &&Walk| {
                let errors = walk.errors_m[k].iter().zip(&distance_m);
                errors
                    .filter(|(_, distance_m)| **distance_m >= JUDGED_FROM_M)
                    .all(|(error, distance)| *error < 0.1 * distance)
            };
            let (n, below) = (walks.len() as f64, walks.iter().filter(holds).count() as f64);
            PathErrors {
                method,
                reckoned_m,
                low_m: bands.iter().map(|band| band[0]).collect(),
                median_m: bands.iter().map(|band| band[1]).collect(),
                high_m: bands.iter().map(|band| band[2]).collect(),
                below_ten_percent: below / n,
                below_ten_percent_interval: wilson(below / n, n),
            }
        })
        .collect();
    Ok(Figure7 { distance_m, read_m, methods })
}

fn walk(
    path: &RunView<'_>,
    session: &dataset::Session<'_>,
    drives: &[DriveGeometry; PARAMETERS.len()],
    keep_paths: bool,
) -> Walk {
    let read = path.observed_poses();
    let start = read.first().map_or(Pose::IDENTITY, |(_, pose)| *pose);
    let place = |pose: &Pose| [pose.x_m, pose.y_m];
    let mut errors_m = [const { Vec::new() }; PARAMETERS.len()];
    let mut paths = [const { Vec::new() }; PARAMETERS.len()];
    for ((drive, errors_m), reckoned_m) in drives.iter().zip(&mut errors_m).zip(&mut paths) {
        let mut readings = read.iter().peekable();
        path.dead_reckon(session.robot, drive, Rule::Midpoint, start, |t_s, pose| {
            // Every reading is made at a standstill, whose row bears the same time.
            if let Some((_, seen)) = readings.next_if(|(read_s, _)| *read_s <= t_s) {
                errors_m.push(pose.position().distance_m(seen.position()));
                reckoned_m.push(place(&pose));
            }
        });
    }
    let paths = keep_paths.then(|| (read.iter().map(|(_, pose)| place(pose)).collect(), paths));
    Walk { errors_m, paths }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_is_the_textbooks() {
        // 8 of 10: Wilson gives 0.4902 to 0.9433; 10 of 10 still leaves 0.7225.
        let [low, high] = wilson(0.8, 10.0);
        assert!((low - 0.4902).abs() < 1e-4 && (high - 0.9433).abs() < 1e-4, "{low} {high}");
        let [low, high] = wilson(1.0, 10.0);
        assert!((low - 0.7225).abs() < 1e-4 && high == 1.0, "{low} {high}");
    }

    /// Figure 4's point.
    #[test]
    fn paper_figure_4_the_contacts_keep_one_locus_while_the_centre_goes_round() {
        let nominal = super::super::scenario().expect("shipped").nominal_geometry().expect("valid");
        let figure = figure_4(&nominal);
        // The centre of rotation, in the body: where the contact speeds −1 and 1.2 cross zero.
        let base_m = nominal.wheel_separation_m();
        let icr = [0.0, 0.5 * base_m - base_m / (1.0 + DRAWN_MISMATCH)];
        let radius = |point: &[f64; 2]| (point[0] - icr[0]).hypot(point[1] - icr[1]);
        for (points, expected) in [
            (&figure.left_m, base_m / (1.0 + DRAWN_MISMATCH)),
            (&figure.right_m, base_m * DRAWN_MISMATCH / (1.0 + DRAWN_MISMATCH)),
            (&figure.centre_m, icr[1].abs()),
        ] {
            assert_eq!(points.len(), (STEPS_A_TURN * TURNS + 1) as usize);
            for (k, point) in points.iter().enumerate() {
                // Rounding of 270 products.
                assert!((radius(point) - expected).abs() < 1e-13, "{k}");
                // Turn after turn the same point.
                let first = points[k % STEPS_A_TURN as usize];
                assert!((point[0] - first[0]).hypot(point[1] - first[1]) < 1e-13);
            }
        }
        // The centre does move: by a twentieth of the base.
        assert!(icr[1].abs() > 0.04 * base_m);
    }
}

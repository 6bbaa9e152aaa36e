//! What could reconcile the paper's numbers: model extensions fitted to all of them, and the one measurement
//! that would discriminate them.
//!
//! The five numbers are C_L, C_R and B by the direct method, and UMBmark's wheel ratio and wheelbase. Each
//! extension has the drive's three parameters and at most one size of its own; all are fitted by weighted
//! least squares to noise-free simulations of both protocols, in which the extension acts as a physical
//! effect. Nothing here is in the catalogue of effects: these are guesses about one robot's printed numbers.

use calib::methods::direct::Direct;
use calib::methods::umbmark::Umbmark;
use calib::{CalibError, Calibration, Method};
use dataset::{Protocol, ProtocolSettings, Run};
use effects::{Effect, WheelMismatch, WheelScale, Wheelbase};
use motion_programs::{Motion, MotionProgram, Platform, Schedule, record_session};
use nalgebra::{SMatrix, SVector};
use scenario::{Instrument, Scenario};
use serde::Serialize;
use sim_yair::{SimulatedRobot, SimulationError};

use super::extension::{ActingExtension, Extension};
use super::published::{TABLE_1, TABLE_2_DIRECT, TABLE_2_UMBMARK};
use super::table_2::Table2;
use super::units::MM_PER_M;

/// How many published numbers are fitted.
const NUMBERS: usize = 5;

/// Drive parameters and one size.
const MAX_PARAMETERS: usize = 4;

/// Two extensions whose misfits differ by less cannot be discriminated: a likelihood ratio of 20.
const DISCRIMINATION_LEVEL: f64 = 6.0;

/// An extension fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fitted {
    /// Which.
    pub extension: Extension,
    /// What it says.
    pub says: &'static str,
    /// Its size, in `unit`; 0 for one without a size.
    pub size: f64,
    /// Unit of the size.
    pub unit: &'static str,
    /// Whether the size is physically plausible.
    #[serde(rename = "plausible")]
    pub is_plausible: bool,
    /// Why that is judged so.
    pub because: &'static str,
    /// Sum of squared departures from the five published numbers, in their standard deviations.
    pub misfit: f64,
    /// Parameters fitted, the drive's three included.
    pub parameters: usize,
    /// Fitted C_L, C_R (mm/pulse) and B (mm) of the drive.
    pub drive: [f64; 3],
    /// What it predicts for [`NUMBER_NAMES`].
    pub predicts: [f64; NUMBERS],
}

/// A further measurement and what each extension says it will show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// What to drive and read.
    pub does: &'static str,
    /// What is computed from it.
    pub shows: &'static str,
    /// Its standard deviation.
    pub sigma: f64,
    /// What each extension of [`Causes::fitted`] predicts, in their order.
    pub predicts: Vec<f64>,
    /// Smallest difference between two extensions that fit equally well, in standard deviations.
    #[serde(rename = "tells_apart")]
    pub discriminates_by: f64,
}

/// What could reconcile the paper's numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Causes {
    /// The five published numbers.
    pub published: [f64; NUMBERS],
    /// Their standard deviations: measurement and rounding of the print.
    pub sigma: [f64; NUMBERS],
    /// Each extension, fitted.
    pub fitted: Vec<Fitted>,
    /// Extensions whose misfit is within a likelihood ratio of 20 of the best: the published numbers cannot
    /// discriminate these.
    #[serde(rename = "not_told_apart")]
    pub not_discriminated: Vec<Extension>,
    /// Further measurements on the robot, the one that tells most first.
    pub experiments: Vec<Experiment>,
}

/// The published numbers' names.
pub const NUMBER_NAMES: [&str; NUMBERS] = ["C_L direct", "C_R direct", "B direct", "E_d UMBmark", "B UMBmark"];

/// Why the fits could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CauseError {
    /// A run could not be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A method found nothing in a simulated run.
    #[error(transparent)]
    Calibration(#[from] CalibError),
}

/// The robot of given C_L, C_R (mm/pulse) and B (mm) with an extension, measured exactly.
fn robot(
    base: &Scenario,
    extension: Extension,
    parameters: &SVector<f64, MAX_PARAMETERS>,
    on_squares: bool,
) -> Result<SimulatedRobot, SimulationError> {
    let [left, right, base_mm, size] = parameters.data.0[0];
    let mut scenario = base.clone();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.noise.sensitivity_sigma = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 0.0 }];
    let mut scale = 0.5 * (left + right);
    if on_squares && extension == Extension::ScaleOnSquares {
        scale *= 1.0 + size;
    }
    if on_squares && extension == Extension::NominalOf500 {
        // What the robot believes of its wheels; their true size stays.
        let believed = std::f64::consts::PI * base.robot.left_wheel_diameter_m * MM_PER_M / 500.0;
        scenario.robot.left_wheel_diameter_m *= believed;
        scenario.robot.right_wheel_diameter_m *= believed;
        scale /= believed;
    }
    scenario.effects = vec![
        Effect::WheelScale(WheelScale { scale }),
        Effect::WheelMismatch(WheelMismatch { right_over_left: right / left }),
        Effect::Wheelbase(Wheelbase { ratio: base_mm / (MM_PER_M * base.robot.wheel_separation_m) }),
    ];
    let acting = ActingExtension::new(extension, size);
    SimulatedRobot::with_more_effects(&scenario, scenario.seed, 0, vec![("extension", Box::new(acting))])
}

fn direct(robot: &mut SimulatedRobot) -> Result<Calibration, CauseError> {
    let protocol =
        [Schedule::Straights { length_m: 0.5, runs: 2 }, Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 2 }];
    let programs: Vec<_> = protocol.iter().flat_map(Schedule::programs).collect();
    Ok(Direct::DEFAULT.calibrate(&[record_session(robot, &programs)?.session()])?)
}

/// Diameters over the nominal ones: mm/pulse where the robot believes in 1.
fn sensitivities(found: &Calibration, base: &Scenario) -> [f64; 2] {
    let ratio =
        found.geometry.wheel_diameter_m().zip_with(base.robot.wheel_diameter_m(), |found, nominal| found / nominal);
    [ratio.left, ratio.right]
}

fn predict(
    base: &Scenario,
    extension: Extension,
    parameters: &SVector<f64, MAX_PARAMETERS>,
) -> Result<SVector<f64, NUMBERS>, CauseError> {
    let by_direct = direct(&mut robot(base, extension, parameters, false)?)?;
    let [left, right] = sensitivities(&by_direct, base);
    let programs = Schedule::Squares { side_m: 4.0, runs_each_way: 1 }.programs();
    let measured = record_session(&mut robot(base, extension, parameters, true)?, &programs)?;
    let squares = Umbmark::DEFAULT.calibrate(&[measured.session()])?.geometry;
    let ratio = squares.wheel_diameter_m().right / squares.wheel_diameter_m().left;
    Ok(SVector::from([
        left,
        right,
        by_direct.geometry.wheel_separation_m() * MM_PER_M,
        ratio,
        squares.wheel_separation_m() * MM_PER_M,
    ]))
}

/// The five published numbers with their standard deviations.
fn published(table_2: &Table2) -> ([f64; NUMBERS], [f64; NUMBERS]) {
    let umbmark = TABLE_2_UMBMARK.sensitivity;
    let of_mean = |shape: super::shape::SampleShape| shape.std / (shape.count as f64).sqrt();
    let simulated = |method, symbol| table_2.cell(method, symbol).map_or(f64::NAN, |cell| cell.sigma);
    let rounding = |half_digit: f64| half_digit / 3_f64.sqrt();
    (
        [
            TABLE_1.left.mean,
            TABLE_1.right.mean,
            TABLE_2_DIRECT.base.value,
            umbmark.right.value / umbmark.left.value,
            TABLE_2_UMBMARK.base.value,
        ],
        [
            of_mean(TABLE_1.left),
            of_mean(TABLE_1.right),
            simulated("direct", "B").hypot(rounding(TABLE_2_DIRECT.base.half_digit)),
            // The ratio moves by twice a sensitivity's error, the mean being kept; both sensitivities are
            // rounded.
            (2.0 * simulated("umbmark", "C_L")).hypot(2_f64.sqrt() * rounding(umbmark.left.half_digit)),
            simulated("umbmark", "B").hypot(rounding(TABLE_2_UMBMARK.base.half_digit)),
        ],
    )
}

/// Singular values below this share of the largest are rounding of the numeric derivatives (a simulated metre
/// carries 1e-16, a step 1e-5).
const WITHOUT_INFLUENCE: f64 = 1e-6;

/// Gauss–Newton steps of the fits; the predictions are nearly linear and five are ample.
const STEPS: usize = 8;

fn fit(
    base: &Scenario,
    extension: Extension,
    published: &[f64; NUMBERS],
    sigma: &[f64; NUMBERS],
) -> Result<Fitted, CauseError> {
    let description = extension.description();
    let parameters = if extension.has_size() { MAX_PARAMETERS } else { MAX_PARAMETERS - 1 };
    // Steps of the numeric derivatives, small against the sizes that matter and large against rounding; in
    // these units the problem is well scaled.
    let step = [1e-5, 1e-5, 1e-2, 1e-5];
    let mut at = SVector::from([TABLE_1.left.mean, TABLE_1.right.mean, TABLE_2_DIRECT.base.value, 0.0]);
    let residual = |predicted: &SVector<f64, NUMBERS>| {
        SVector::<f64, NUMBERS>::from_fn(|number, _| (published[number] - predicted[number]) / sigma[number])
    };
    for _ in 0..STEPS {
        let predicted = predict(base, extension, &at)?;
        let mut jacobian = SMatrix::<f64, NUMBERS, MAX_PARAMETERS>::zeros();
        for parameter in 0..parameters {
            let mut moved = at;
            moved[parameter] += step[parameter];
            let change = predict(base, extension, &moved)? - predicted;
            for number in 0..NUMBERS {
                jacobian[(number, parameter)] = change[number] / sigma[number];
            }
        }
        // A combination without influence stays where it is.
        let svd = jacobian.svd(true, true);
        let Ok(update) = svd.solve(&residual(&predicted), WITHOUT_INFLUENCE * svd.singular_values[0]) else { break };
        for parameter in 0..parameters {
            at[parameter] += step[parameter] * update[parameter];
        }
    }
    let predicted = predict(base, extension, &at)?;
    let size = at[3] * description.scale;
    Ok(Fitted {
        extension,
        says: description.says,
        size,
        unit: description.unit,
        is_plausible: (description.plausible_range.0..=description.plausible_range.1).contains(&size),
        because: description.because,
        misfit: residual(&predicted).norm_squared(),
        parameters,
        drive: [at[0], at[1], at[2]],
        predicts: predicted.data.0[0],
    })
}

/// Fits every extension and looks for the measurement that discriminates them.
///
/// # Errors
/// [`CauseError`] when a simulation or a calibration of one fails.
pub fn causes(base: &Scenario, table_2: &Table2, reading_sigma_m: f64) -> Result<Causes, CauseError> {
    let (published, sigma) = published(table_2);
    let fitted = Extension::ALL
        .iter()
        .map(|extension| fit(base, *extension, &published, &sigma))
        .collect::<Result<Vec<_>, _>>()?;
    let best = fitted.iter().map(|fitted| fitted.misfit).fold(f64::INFINITY, f64::min);
    let not_discriminated: Vec<Extension> = fitted
        .iter()
        .filter(|fitted| fitted.misfit - best < DISCRIMINATION_LEVEL)
        .map(|fitted| fitted.extension)
        .collect();
    let mut experiments = Vec::new();
    for candidate in candidates(base, reading_sigma_m) {
        let predicts =
            fitted.iter().map(|fitted| (candidate.measure)(base, fitted)).collect::<Result<Vec<f64>, CauseError>>()?;
        let group: Vec<f64> = fitted
            .iter()
            .zip(&predicts)
            .filter(|(fitted, _)| not_discriminated.contains(&fitted.extension))
            .map(|(_, predicts)| *predicts)
            .collect();
        let mut discriminates_by = f64::INFINITY;
        for (k, a) in group.iter().enumerate() {
            for b in &group[..k] {
                discriminates_by = discriminates_by.min((a - b).abs() / candidate.sigma);
            }
        }
        experiments.push(Experiment {
            does: candidate.does,
            shows: candidate.shows,
            sigma: candidate.sigma,
            predicts,
            discriminates_by,
        });
    }
    experiments.sort_by(|a, b| b.discriminates_by.total_cmp(&a.discriminates_by));
    Ok(Causes { published, sigma, fitted, not_discriminated, experiments })
}

struct Candidate {
    does: &'static str,
    shows: &'static str,
    sigma: f64,
    measure: fn(&Scenario, &Fitted) -> Result<f64, CauseError>,
}

/// Measurements that could be made on the floor grid. Their errors are those of reading two marks at both
/// ends.
fn candidates(base: &Scenario, reading_sigma_m: f64) -> Vec<Candidate> {
    let width_m = base.robot.points.iter().map(|mark| mark.y_m).fold(0.0, |width: f64, y_m| width + y_m.abs());
    let turn_sigma_rad = 2.0 * reading_sigma_m / width_m;
    let base_mm = base.robot.wheel_separation_m * MM_PER_M;
    vec![
        Candidate {
            does: "forty quarter turns on the spot with a stop after each, the marks read at the first start and the last stop",
            shows: "apparent B, mm",
            sigma: base_mm * turn_sigma_rad / (10.0 * std::f64::consts::TAU),
            measure: |base, fitted| {
                let motions = vec![Motion::Spin { turn_rad: std::f64::consts::FRAC_PI_2 }; 40];
                let (run, robot) = drive(base, fitted, &motions, true)?;
                let counted = counted_m(&run, &robot);
                Ok(MM_PER_M * (counted[1] * fitted.predicts[1] - counted[0] * fitted.predicts[0]) / turned(&robot))
            },
        },
        Candidate {
            does: "one spin of ten turns without a stop, the marks read at both ends",
            shows: "apparent B, mm",
            sigma: base_mm * turn_sigma_rad / (10.0 * std::f64::consts::TAU),
            measure: |base, fitted| {
                let (run, robot) =
                    drive(base, fitted, &[Motion::Spin { turn_rad: 10.0 * std::f64::consts::TAU }], false)?;
                let counted = counted_m(&run, &robot);
                Ok(MM_PER_M * (counted[1] * fitted.predicts[1] - counted[0] * fitted.predicts[0]) / turned(&robot))
            },
        },
        Candidate {
            does: "one side of the square: a straight of 4 m, the marks read at both ends",
            shows: "apparent C, mm/pulse",
            sigma: reading_sigma_m / 4.0,
            measure: |base, fitted| {
                let (run, robot) = drive(base, fitted, &[Motion::Straight { length_m: 4.0 }], true)?;
                let counted = counted_m(&run, &robot);
                let (start, end) = robot.last_true_ends();
                Ok(start.position().distance_m(end.position()) / (0.5 * (counted[0] + counted[1])))
            },
        },
    ]
}

/// Drives motions with the extension at work, as on the squares or as in the short runs.
fn drive(
    base: &Scenario,
    fitted: &Fitted,
    motions: &[Motion],
    on_squares: bool,
) -> Result<(Run, SimulatedRobot), CauseError> {
    let size = fitted.size / fitted.extension.description().scale;
    let [left, right, base_mm] = fitted.drive;
    let mut robot = robot(base, fitted.extension, &SVector::from([left, right, base_mm, size]), on_squares)?;
    let program = MotionProgram {
        id: "further".to_owned(),
        protocol: Protocol::Free,
        settings: ProtocolSettings::default(),
        motions: motions.to_vec(),
    };
    let mut run = Run::default();
    robot.drive_into(&program, &mut run)?;
    Ok((run, robot))
}

/// Travel of both wheels by their counts, at the 1 mm that the paper's robot believes of a pulse.
fn counted_m(run: &Run, robot: &SimulatedRobot) -> [f64; 2] {
    let mut travel = [0.0; 2];
    if let (dataset::WheelLog::Ticks(ticks), Some(ticks_per_rev)) = (&run.odometry.wheels, robot.robot().ticks_per_rev)
    {
        for (travel, column) in travel.iter_mut().zip([&ticks.left, &ticks.right]) {
            let counts = (column.last().unwrap_or(&0) - column.first().unwrap_or(&0)) as f64;
            *travel = std::f64::consts::PI * 0.160 * counts / ticks_per_rev;
        }
    }
    travel
}

fn turned(robot: &SimulatedRobot) -> f64 {
    let (start, end) = robot.last_true_ends();
    end.theta_rad - start.theta_rad
}

//! Datasets that are valid and odd, and what calibrators and diagnosis say of them: results without a number
//! that is none, or a reason.

use std::path::Path;

use rand::{Rng, RngExt};
use rand_xoshiro::Xoshiro256PlusPlus;
use yair::calib::METHODS;
use yair::dataset::{
    Dataset, MapDistortion, NominalRobot, Odometry, Protocol, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
};
use yair::kinematics::Wheels;

use crate::corpus::Sample;

/// The stated robot of all of them.
pub(crate) const fn nominal() -> NominalRobot {
    NominalRobot {
        left_wheel_diameter_m: 0.15,
        right_wheel_diameter_m: 0.15,
        wheel_separation_m: 0.3,
        ticks_per_rev: Some(4096.0),
        counter_bits: None,
    }
}

fn pick<T: Copy>(list: &[T], random: &mut impl Rng) -> T {
    list[random.random_range(0..list.len())]
}

/// How the numbers of a column go on.
#[derive(Clone, Copy)]
enum Course {
    Constant,
    Steady,
    Random,
    Alternating,
    OneSpike,
}

fn column(rows: usize, course: Course, size: f64, random: &mut impl Rng) -> Vec<f64> {
    let spike = random.random_range(0..rows);
    let value = |row: usize, random: &mut dyn Rng| match course {
        Course::Constant => size,
        Course::Steady => size * row as f64,
        Course::Random => size * (random.random::<f64>() - 0.5),
        Course::Alternating => size * f64::from(u8::from(row % 2 == 1)),
        Course::OneSpike => size * f64::from(u8::from(row == spike)),
    };
    (0..rows).map(|row| value(row, random)).collect()
}

const COURSES: [Course; 5] = [Course::Constant, Course::Steady, Course::Random, Course::Alternating, Course::OneSpike];

fn run(number: usize, random: &mut Xoshiro256PlusPlus) -> Run {
    let rows = pick(&[1, 2, 3, 10, 60], random);
    let sizes = [0.0, 5e-324, 1e-300, 1e-9, 1e-3, 0.05, 1.0, 100.0, 1e9, 1e15, 1e150, 1e300];
    // Most columns are of a robot's size: with all of them absurd, everything is refused at once.
    let mut size = |usual: f64| if random.random_bool(0.75) { usual } else { pick(&sizes, random) };
    let (step_s, wheel, shift_m, turn_rad) = (size(0.1), size(0.05), size(0.01), size(0.02));
    let step_s = if step_s == 0.0 { 0.1 } else { step_s };
    let start_s = pick(&[0.0, 0.0, 0.0, -1e6, 1e12, 1e-300], random);
    let mut t_s: Vec<f64> = (0..rows).map(|row| start_s + step_s * row as f64).collect();
    t_s.dedup();
    t_s.retain(|t_s| t_s.is_finite());
    let rows = t_s.len();
    let mut columns = |size: f64| {
        let (left, right) = (pick(&COURSES, random), pick(&COURSES, random));
        Wheels { left: column(rows, left, size, random), right: column(rows, right, size, random) }
    };
    let (sides, places, headings) = (columns(wheel), columns(shift_m), columns(turn_rad));
    let counts = |column: &[f64]| column.iter().map(|value| (1e3 * value).clamp(-9e18, 9e18) as i64).collect();
    let wheels = match random.random_range(0..4) {
        0 | 1 => WheelLog::Ticks(Wheels { left: counts(&sides.left), right: counts(&sides.right) }),
        2 => WheelLog::Angles(sides),
        _ => WheelLog::Twist { v_mps: sides.left, omega_radps: sides.right },
    };
    let sees_heading = random.random_bool(0.8);
    let sample = |row: usize| {
        let heading = sees_heading.then(|| headings.left[row]);
        TruthSample::new(t_s[row], places.left[row], places.right[row], heading)
    };
    let every = pick(&[1, 1, 2, 7], random);
    let mut truth: Vec<TruthSample> = (0..rows).step_by(every).map(sample).collect();
    if random.random_bool(0.1) {
        truth.truncate(1);
    }
    let protocols =
        [None, Some(Protocol::Straight), Some(Protocol::Spin), Some(Protocol::SquareCw), Some(Protocol::SquareCcw)];
    let info = RunInfo { id: format!("{number}"), protocol: pick(&protocols, random), ..RunInfo::default() };
    Run { info, odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, truth, ..Run::default() }
}

/// A dataset that its own writer accepts.
fn dataset(random: &mut Xoshiro256PlusPlus) -> Option<Dataset> {
    let runs = pick(&[1, 1, 2, 3, 6], random);
    let mut robot = nominal();
    if random.random_bool(0.2) {
        robot.wheel_separation_m = pick(&[1e-300, 1e-6, 3.0, 1e6, 1e300], random);
    }
    if random.random_bool(0.2) {
        robot.left_wheel_diameter_m = pick(&[1e-300, 1e-6, 3.0, 1e6, 1e300], random);
    }
    let mut all: Vec<Run> = (0..runs).map(|number| run(number, random)).collect();
    // A dataset reports its wheels in one form.
    let form = std::mem::discriminant(&all[0].odometry.wheels);
    all.retain(|run| std::mem::discriminant(&run.odometry.wheels) == form);
    let sigma = pick(&[None, None, Some(1e-3), Some(1e-300), Some(1e300)], random);
    // Drawn last: numbers of executions before there were maps are what they were, but for the tenth.
    let map = random.random_bool(0.1).then(|| MapDistortion {
        sigma_xy_m: pick(&[1e-300, 0.02, 0.02, 1e9, 1e300], random),
        sigma_theta_rad: pick(&[1e-300, 0.01, 0.01, 1e9, 1e300], random),
        length_m: pick(&[1e-300, 1e-9, 2.0, 2.0, 1e300], random),
    });
    let truth_noise = TruthNoise { sigma_xy_m: sigma, sigma_theta_rad: sigma, map, ..TruthNoise::default() };
    let found = Dataset { robot, truth_noise, runs: all, provenance: Default::default(), points: Vec::new() };
    dataset::check_writable(&found).is_ok().then_some(found)
}

/// No message shows a number that is none: the data have none.
fn sound(message: &str, place: &str) {
    let words = message.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_');
    let none = words.into_iter().find(|word| ["nan", "inf"].contains(&word.to_lowercase().as_str()));
    assert!(none.is_none(), "{place} says {message}");
}

pub(crate) fn calibrated(_: &[Sample], random: &mut Xoshiro256PlusPlus, _: &Path) -> bool {
    let Some(dataset) = dataset(random) else { return false };
    let sessions = [dataset.session()];
    for problem in preflight::check(std::slice::from_ref(&dataset)).problems {
        sound(&problem.sentence, "preflight");
    }
    let mut any = false;
    for method in METHODS {
        let report = match method.calibrate(&sessions) {
            Err(error) => {
                sound(&error.to_string(), method.name());
                continue;
            }
            Ok(found) => {
                for estimate in found.estimates() {
                    let name = method.name();
                    assert!(estimate.value.is_finite(), "{name}: {:?} = {}", estimate.parameter, estimate.value);
                    let is_sound = estimate.sigma.is_none_or(|sigma| sigma.is_finite() && sigma >= 0.0);
                    assert!(is_sound, "{name}: {:?} ± {:?}", estimate.parameter, estimate.sigma);
                }
                for remark in found.plausibility_warnings(&dataset.robot) {
                    sound(&remark, method.name());
                }
                any = true;
                calib::MethodReport::new(method.name(), &Ok(found), &dataset.robot)
            }
        };
        for blind in &report.not_observable {
            sound(&blind.why, method.name());
        }
        for rejected in &report.runs_rejected {
            sound(&rejected.why, method.name());
        }
    }
    let drift = calib::evaluate(&sessions, None, false);
    let numbers = [drift.max_position_m, drift.mean_final_position_m, drift.drift_percent];
    assert!(numbers.iter().flatten().all(|value| value.is_finite()), "drift {numbers:?}");
    any
}

pub(crate) fn diagnosed(_: &[Sample], random: &mut Xoshiro256PlusPlus, _: &Path) -> bool {
    let Some(dataset) = dataset(random) else { return false };
    let all = [dataset];
    match diagnose::diagnose(&all, &diagnose::Options::default()) {
        Err(error) => {
            sound(&error.to_string(), "diagnosis");
            false
        }
        Ok(found) => {
            let document = &found.document;
            for finding in &document.findings {
                let (id, parameters) = (&finding.id, &finding.parameters);
                let numbers = [finding.probability, finding.z, finding.p_value];
                assert!(numbers.iter().all(|number| number.is_finite()), "{id}: probability, z and p {numbers:?}");
                let is_sound = |of: &diagnose::Value| of.value.is_finite() && of.sigma.is_none_or(f64::is_finite);
                assert!(parameters.values().all(is_sound), "{id}: {parameters:?}");
                sound(&finding.sentence, id);
            }
            for check in &document.checks {
                assert!(check.statistic.is_finite() && check.p_value.is_finite(), "{check:?}");
            }
            for candidate in &document.candidates {
                assert!(candidate.z.is_finite() && candidate.log_odds.is_finite(), "{candidate:?}");
            }
            for limit in document.sensitivity.iter().chain(&document.blind_to) {
                sound(&limit.why, &limit.id);
                assert!(limit.smallest_detectable.as_ref().is_none_or(|size| size.value.is_finite()), "{limit:?}");
            }
            if let Some(gain) = &document.gain {
                let (compared, drift) = (&gain.log_score_per_observation, &gain.drift_percent);
                let numbers = [Some(compared), drift.as_ref()].into_iter().flatten();
                let is_sound =
                    |of: &diagnose::Compared| [of.base, of.extended, of.low, of.high].iter().all(|n| n.is_finite());
                assert!(numbers.into_iter().all(is_sound), "{gain:?}");
            }
            sound(&document.sentence, "diagnosis");
            true
        }
    }
}

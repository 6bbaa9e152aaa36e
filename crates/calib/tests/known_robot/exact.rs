//! Every method gives a known robot back from logs in which nothing scatters but the last digits.
//!
//! Equations of one run are tested in each method's own file; here the whole way from records to estimates
//! is.

use calib::{Calibration, Covariance, METHODS, Parameter};
use dataset::{Protocol, Run, TruthSample};

use crate::log::{DIAMETER_M, Log, NOMINAL_SEPARATION_M, SEPARATION_M};

/// The relative error of a method's diameters and wheelbase.
fn misses(found: &Calibration) -> [f64; 3] {
    let diameter_m = found.geometry.wheel_diameter_m();
    [
        diameter_m.left / DIAMETER_M.left - 1.0,
        diameter_m.right / DIAMETER_M.right - 1.0,
        found.geometry.wheel_separation_m() / SEPARATION_M - 1.0,
    ]
}

/// Largest relative errors: measurements that err by 10⁻⁵ m and rad over half a metre and a radian, and for
/// UMBmark what its equations leave out, of second order in 0.4 % of the wheels' ratio and 1 % of the
/// wheelbase. The largest of all other methods is 2.2·10⁻⁵, of `direct`. The nominal robot misses by 2·10⁻³
/// and 10⁻².
const TOLERANCE: f64 = 4e-5;
const TOLERANCE_OF_UMBMARK: f64 = 5e-4;

#[test]
fn every_method_gives_an_exact_robot_back() {
    let dataset = Log::exact().dataset();
    for method in METHODS {
        let found = method.calibrate(&[dataset.session()]).unwrap_or_else(|error| panic!("{}: {error}", method.name()));
        let name = method.name();
        assert_eq!(found.method, name);
        assert!(found.converged && found.runs_rejected.is_empty(), "{name}: {:?}", found.runs_rejected);
        let mut misses = misses(&found);
        let is_blind = |parameter| found.not_observable.iter().any(|blind| blind.parameter == parameter);
        if is_blind(Parameter::WheelSeparation) {
            assert_eq!(found.geometry.wheel_separation_m(), NOMINAL_SEPARATION_M, "{name}: it is blind to it");
            misses[2] = 0.0;
        }
        let most = if name == "umbmark" { TOLERANCE_OF_UMBMARK } else { TOLERANCE };
        assert!(misses.iter().all(|miss| miss.abs() < most), "{name}: {misses:?}");
        for estimate in found.estimates() {
            let sigma = estimate.sigma.unwrap_or(0.0);
            assert!((0.0..0.01).contains(&sigma), "{name}: {:?} ± {sigma}", estimate.parameter);
        }
    }
}

#[test]
fn joint_names_the_run_that_it_could_not_use() {
    let mut dataset = Log::exact().dataset();
    dataset.runs[2].truth.truncate(1);
    let found = calib::method("joint").expect("known").calibrate(&[dataset.session()]).expect("a calibration");
    let [rejected] = &found.runs_rejected[..] else { panic!("{:?}", found.runs_rejected) };
    assert!(rejected.run == "2" && rejected.why.contains("fewer than two measurements"), "{rejected:?}");
    assert_eq!(found.runs_used, dataset.runs.len() - 1);
}

#[test]
fn methods_of_whole_paths_name_the_run_that_they_could_not_use() {
    let mut dataset = Log::exact().dataset();
    // Its instrument began when its log had ended.
    dataset.runs[9].truth.iter_mut().for_each(|sample| sample.t_s += 100.0);
    for name in ["joint", "segments", "augmented_kalman"] {
        let found = calib::method(name).expect("known").calibrate(&[dataset.session()]).expect("a calibration");
        let rejected: Vec<&str> = found.runs_rejected.iter().map(|rejected| rejected.run.as_str()).collect();
        assert_eq!((found.runs_used, &rejected[..]), (dataset.runs.len() - 1, &["9"][..]), "{name}");
    }
}

#[test]
fn every_method_says_what_it_is_and_what_to_drive_for_it() {
    for method in METHODS {
        let (name, about) = (method.name(), method.about());
        assert!(about.len() > 40 && about.contains(' '), "{name}: {about}");
        assert!(!method.protocol().is_empty(), "{name}: nothing to drive");
    }
    let abouts: std::collections::BTreeSet<_> = METHODS.iter().map(|method| method.about()).collect();
    assert_eq!(abouts.len(), METHODS.len(), "two methods say the same of themselves");
}

/// The covariance by a method of a log whose last poses of one run are off by so much.
fn covariance_with(name: &str, off: impl Fn(&mut Vec<Run>)) -> Covariance {
    let mut dataset = Log::exact().dataset();
    off(&mut dataset.runs);
    let found = calib::method(name).expect("known").calibrate(&[dataset.session()]).expect("a calibration");
    found.covariance.expect("a covariance")
}

/// Ends where the instrument says it does not.
fn end_off(run: &mut Run, x_m: f64, turn_rad: f64) {
    let last = run.truth.last_mut().expect("poses");
    *last = TruthSample::new(last.t_s, last.x_m + x_m, last.y_m, last.theta_rad().map(|rad| rad + turn_rad));
}

/// The wheelbase is by the half sum of both directions' errors and the wheels are by the half difference.
/// Where clockwise squares alone scatter, both are of one error; where both scatter alike, of two.
#[test]
fn wheels_and_base_err_together_where_squares_of_one_direction_do() {
    let correlation = |name: &str, directions: &[Protocol]| {
        let covariance = covariance_with(name, |runs| {
            for direction in directions {
                let mut of = runs.iter_mut().filter(|run| run.info.protocol == Some(*direction));
                end_off(of.next().expect("two squares"), 0.02, 0.02);
            }
        });
        (covariance[(1, 2)] / (covariance[(1, 1)] * covariance[(2, 2)]).sqrt()).abs()
    };
    for name in ["umbmark", "jung_chung"] {
        // Others err by 10⁻⁵, a two-thousandth.
        assert!(correlation(name, &[Protocol::SquareCw]) > 0.999, "{name}");
        let both = correlation(name, &[Protocol::SquareCw, Protocol::SquareCcw]);
        assert!(both < 0.2, "{name}: {both}");
    }
}

/// A spin of a turn that is off by δ has a base that is off by δ/2π of it. Of the two of its direction the
/// mean is off by a half of that, ± as much, and the mean of both directions by a quarter.
#[test]
fn the_base_of_ivanjko_is_the_mean_of_both_directions() {
    let turn_rad = 0.02;
    let covariance = covariance_with("ivanjko", |runs| {
        let spin = runs.iter_mut().find(|run| run.info.protocol == Some(Protocol::Spin)).expect("a spin");
        end_off(spin, 0.0, turn_rad);
    });
    let expected_m = 0.25 * turn_rad / std::f64::consts::TAU * SEPARATION_M;
    // The true turn is a hundredth less than a nominal one; the radii and the other spins err by 10⁻⁵, a
    // hundredth of what is asked for.
    assert!((covariance[(2, 2)].sqrt() / expected_m - 1.0).abs() < 0.03, "{covariance} {expected_m}");
}

//! Partial measurements: against displacements, which say the same of whole poses; against central
//! differences; and against a robot that is known.

use dataset::{
    Dataset, Displacement, ExtraChannel, GyroNoise, GyroSample, HeadingReading, Revisit, Run, TapeDistance, TruthNoise,
    WallReading, WheelLog,
};
use kinematics::{Increment, Pose, Wheels, wrap_to_pi};

use crate::normal_equations::total;
use crate::pass::pass;
use crate::pass_options::{OutlierGate, PassOptions};
use crate::{Column, FitSettings, Model, ModelFit, Noise, NormalEquations, Records, Selection, Thinning};

pub(super) const M_PER_RAD: Wheels<f64> = Wheels { left: 0.0811, right: 0.0797 };
pub(super) const SEPARATION_M: f64 = 0.366;
pub(super) const SIGMA_M: f64 = 2e-3;
pub(super) const SIGMA_RAD: f64 = 1e-3;
pub(super) const BIAS_RADPS: f64 = 0.013;

/// Turns of the wheels in a row of 0.1 s: standing, a straight, standing, a whole turn on the spot to the
/// left, standing, an arc.
fn rows(number: u32) -> Vec<(f64, f64)> {
    let speed = 0.2 + 0.1 * f64::from(number % 2);
    let spin = std::f64::consts::TAU * SEPARATION_M / (M_PER_RAD.left + M_PER_RAD.right);
    let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    let mut rows = vec![(0.0, 0.0); 40];
    rows.extend([(speed, speed); 60]);
    rows.extend([(0.0, 0.0); 40]);
    rows.extend([(-side * spin / 50.0, side * spin / 50.0); 50]);
    rows.extend([(0.0, 0.0); 40]);
    rows.extend([(speed, 0.5 * speed); 50]);
    rows
}

/// A run of such rows with the true pose at each.
fn run(number: u32) -> (Run, Vec<Pose>) {
    let mut run = Run::default();
    run.info.id = format!("run-{number}");
    let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
    let (mut poses, mut gyro) = (vec![Pose::IDENTITY], vec![BIAS_RADPS]);
    run.odometry.t_s.push(0.0);
    for (row, (left, right)) in rows(number).into_iter().enumerate() {
        let travel_m = Wheels { left: M_PER_RAD.left * left, right: M_PER_RAD.right * right };
        let increment = Increment::from_travel(travel_m, SEPARATION_M);
        poses.push(poses[row] * increment.arc());
        gyro.push(increment.turn_rad / 0.1 + BIAS_RADPS);
        angles.left.push(angles.left[row] + left);
        angles.right.push(angles.right[row] + right);
        run.odometry.t_s.push(0.1 * (row as f64 + 1.0));
    }
    run.odometry.wheels = WheelLog::Angles(angles);
    run.odometry.extra.insert(ExtraChannel::GyroYawRate, gyro);
    (run, poses)
}

/// Runs with what `add` measures of them; without a gyroscope where it has no noise.
pub(super) fn dataset(gyro: GyroNoise, add: impl Fn(&mut Run, &[Pose])) -> Dataset {
    let runs = (0..4).map(|number| {
        let (mut run, poses) = run(number);
        if gyro.noise_rad_per_sqrt_s.is_none() {
            run.odometry.extra.clear();
        }
        add(&mut run, &poses);
        run
    });
    Dataset { truth_noise: TruthNoise { gyro, ..TruthNoise::default() }, runs: runs.collect(), ..super::dataset(false) }
}

pub(super) const NO_GYRO: GyroNoise = GyroNoise {
    scale_sigma: None,
    noise_rad_per_sqrt_s: None,
    bias_walk_radps_per_sqrt_s: None,
    is_instantaneous: false,
};
pub(super) const GYRO: GyroNoise = GyroNoise { noise_rad_per_sqrt_s: Some(2e-4), ..NO_GYRO };

pub(super) fn revisit(run: &mut Run, poses: &[Pose], [from, to]: [usize; 2], off: f64) {
    let moved = poses[from].to(poses[to]);
    run.revisits.push(Revisit {
        t0_s: run.odometry.t_s[from],
        t1_s: run.odometry.t_s[to],
        dx_m: Some(moved.x_m + off * SIGMA_M),
        dy_m: Some(moved.y_m - off * SIGMA_M),
        dtheta_rad: Some(moved.theta_rad + off * SIGMA_RAD),
        sigma_xy_m: Some(SIGMA_M),
        sigma_theta_rad: Some(SIGMA_RAD),
    });
}

pub(super) fn tape(run: &mut Run, poses: &[Pose], [from, to]: [usize; 2], off: f64) {
    run.distances.push(TapeDistance {
        t0_s: run.odometry.t_s[from],
        t1_s: run.odometry.t_s[to],
        distance_m: poses[from].position().distance_m(poses[to].position()) + off * SIGMA_M,
        sigma_m: SIGMA_M,
    });
}

/// A wall whose points have y = 2 m + x/10 or so, on the left of who drives ahead.
pub(super) fn wall(run: &mut Run, poses: &[Pose], row: usize, parts: [bool; 2], off: f64) {
    let direction_rad = 0.1_f64;
    let (sin, cos) = direction_rad.sin_cos();
    let distance_m = 2.0 + sin * poses[row].x_m - cos * poses[row].y_m + off * SIGMA_M;
    let heading_rad = poses[row].theta_rad - direction_rad + off * SIGMA_RAD;
    run.walls.push(WallReading {
        t_s: run.odometry.t_s[row],
        wall: "north".to_owned(),
        distance_m: parts[0].then_some(distance_m),
        heading_rad: parts[1].then_some(heading_rad),
        sigma_m: parts[0].then_some(SIGMA_M),
        sigma_rad: parts[1].then_some(SIGMA_RAD),
    });
}

pub(super) fn equations(dataset: &Dataset, model: &Model, noise: &Noise) -> NormalEquations {
    let records = Records::of(&[dataset.session()]);
    let nominal = Model::of(&dataset.robot.geometry().expect("valid"), 0);
    let selections = Selection::of(&records, Thinning::NONE, &nominal);
    let headings = vec![0.0; records.segments.len()];
    let options = PassOptions { gate: OutlierGate::Off, ..PassOptions::default() };
    let found = pass(&records, &selections, model, noise, &headings, &mut [], options);
    total(&found.runs).expect("runs")
}

pub(super) fn nominal() -> Model {
    Model::of(&super::dataset(false).robot.geometry().expect("valid"), 0)
}

pub(super) fn noise() -> Noise {
    Noise { variance: [1e-6, 4e-6, SIGMA_M * SIGMA_M, SIGMA_RAD * SIGMA_RAD], timing_s2: 0.0 }
}

#[test]
fn a_revisit_with_all_its_parts_is_a_displacement() {
    let ends = [0, 280];
    let mut as_revisits = dataset(NO_GYRO, |run, poses| revisit(run, poses, ends, 0.7));
    let mut as_displacements = as_revisits.clone();
    for run in &mut as_displacements.runs {
        run.displacements = run.revisits.drain(..).map(displacement).collect();
    }
    let stated = |dataset: &mut Dataset| {
        dataset.truth_noise.sigma_xy_m = Some(SIGMA_M);
        dataset.truth_noise.sigma_theta_rad = Some(SIGMA_RAD);
    };
    stated(&mut as_revisits);
    stated(&mut as_displacements);
    let (mut model, noise) = (nominal(), noise());
    // Near the truth, so that what two orders of linearising leave is small.
    (model.m_per_rad, model.separation_m) = (M_PER_RAD.map(|of| 1.0002 * of), 1.0002 * SEPARATION_M);
    let [revisits, displacements] = [as_revisits, as_displacements].map(|of| equations(&of, &model, &noise));
    assert_eq!(revisits.count, displacements.count);
    // Seen from a pose without errors both are the same arithmetic but for the order of the components:
    // axes of the end here, of the start there.
    assert!((revisits.chi_square / displacements.chi_square - 1.0).abs() < 1e-4, "{revisits:?} {displacements:?}");
    assert!((revisits.log_det - displacements.log_det).abs() < 1e-4);
    for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
        let [a, b] = [&revisits, &displacements].map(|of| of.information[(row, column)]);
        let scale = (revisits.information[(row, row)] * revisits.information[(column, column)]).sqrt();
        assert!((a - b).abs() < 1e-4 * scale, "{a} {b}");
    }
}

fn displacement(of: Revisit) -> Displacement {
    Displacement {
        t0_s: of.t0_s,
        t1_s: of.t1_s,
        dx_m: of.dx_m.expect("measured"),
        dy_m: of.dy_m.expect("measured"),
        dtheta_rad: of.dtheta_rad.expect("measured"),
    }
}

/// Everything at once, overlapping in time.
pub(super) fn all(run: &mut Run, poses: &[Pose]) {
    revisit(run, poses, [0, 150], 0.5);
    revisit(run, poses, [100, 280], -0.8);
    tape(run, poses, [20, 120], 0.4);
    tape(run, poses, [120, 280], -0.3);
    for (k, row) in [20, 70, 120, 220, 280].into_iter().enumerate() {
        wall(run, poses, row, [true, k % 2 == 0], 0.2 * (k as f64 - 2.0));
    }
}

#[test]
fn gradients_are_those_of_the_cost() {
    let dataset = dataset(GYRO, all);
    let (mut model, noise) = (nominal(), noise());
    (model.m_per_rad, model.separation_m) = (M_PER_RAD, SEPARATION_M);
    let found = equations(&dataset, &model, &noise);
    for column in [Column::LeftWheel, Column::RightWheel, Column::Separation, Column::GyroScale] {
        let step = 1e-6;
        let cost = |by: f64| {
            let mut moved = model.clone();
            moved.advance(column, by);
            equations(&dataset, &moved, &noise).cost()
        };
        let numeric = (cost(step) - cost(-step)) / (2.0 * step);
        let analytic = found.gradient[column.index()];
        // The linearised filter leaves out how its gains turn with the path; σ-sized errors over half a metre
        // make 1 % of the gradient's standard deviation of it.
        let scale = found.information[(column.index(), column.index())].sqrt();
        assert!((numeric - analytic).abs() < 0.02 * scale, "{column:?}: {numeric} {analytic} of {scale}");
    }
}

#[test]
fn what_an_effect_adds_to_the_poses_of_an_instrument_it_adds_to_walls() {
    let dataset = dataset(NO_GYRO, |run, poses| {
        for row in (0..=280).step_by(20) {
            wall(run, poses, row, [true, true], 0.3 * (row as f64).sin());
        }
    });
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &nominal());
    let options = PassOptions { gate: OutlierGate::Off, ..PassOptions::default() };
    let with = |ahead_s: f64| {
        let mut model = Model { term_values: vec![0.0, ahead_s], ..nominal() };
        (model.m_per_rad, model.separation_m) = (M_PER_RAD, SEPARATION_M);
        let found = pass(&records, &selections, &model, &noise(), &[], &mut [Box::new(super::TravelTerm)], options);
        total(&found.runs).expect("runs")
    };
    let step = 1e-6;
    let ahead = Column::Term(1).index();
    let numeric = (with(step).cost() - with(-step).cost()) / (2.0 * step);
    let [analytic, information] = [with(0.0).gradient[ahead], with(0.0).information[(ahead, ahead)]];
    assert!(information.sqrt() > 1.0, "no wall shows where the robot is ahead of: {information}");
    assert!((numeric - analytic).abs() < 0.02 * information.sqrt(), "{numeric} {analytic} of {}", information.sqrt());
}

#[test]
fn the_score_of_the_noise_is_that_of_the_cost() {
    let dataset = dataset(GYRO, all);
    let (mut model, noise) = (nominal(), noise());
    (model.m_per_rad, model.separation_m) = (M_PER_RAD, SEPARATION_M);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &nominal());
    let options = PassOptions { noise_score: true, ..PassOptions::default() };
    let score = pass(&records, &selections, &model, &noise, &[], &mut [], options).noise;
    for component in 0..2 {
        let step = 1e-5_f64;
        let cost = |by: f64| {
            let mut noise = noise;
            noise.variance[component] *= by.exp();
            equations(&dataset, &model, &noise).cost()
        };
        let numeric = (cost(step) - cost(-step)) / (2.0 * step);
        let analytic = score.gradient[component];
        let scale = score.information[(component, component)].sqrt();
        assert!((numeric - analytic).abs() < 0.02 * scale, "{component}: {numeric} {analytic} of {scale}");
    }
}

pub(super) fn fitted(dataset: &Dataset) -> ModelFit<'_> {
    FitSettings::CALIBRATION.fit(&[dataset.session()]).expect("a fit")
}

/// Relative errors of the wheels and the separation.
pub(super) fn errors(fit: &ModelFit<'_>) -> [f64; 3] {
    let Model { m_per_rad, separation_m, .. } = fit.solution.model;
    [m_per_rad.left / M_PER_RAD.left, m_per_rad.right / M_PER_RAD.right, separation_m / SEPARATION_M]
        .map(|ratio| ratio - 1.0)
}

/// What interpolation and priors leave of a noiseless log: a tenth of a millimetre over a metre.
pub(super) const NOISELESS: f64 = 1e-4;

#[test]
fn straights_by_tape_and_a_whole_turn_that_is_come_back_from_determine_the_robot() {
    let dataset = dataset(GYRO, |run, poses| {
        tape(run, poses, [20, 120], 0.0);
        revisit(run, poses, [120, 210], 0.0);
        run.revisits[0].sigma_xy_m = None;
        (run.revisits[0].dx_m, run.revisits[0].dy_m) = (None, None);
        // A whole turn is the same heading.
        run.revisits[0].dtheta_rad = Some(0.0);
    });
    let fit = fitted(&dataset);
    assert!(fit.unobservable.is_empty(), "{:?}", fit.unobservable);
    assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
    assert!(fit.solution.model.gyro_scale.abs() < 10.0 * NOISELESS);
}

/// Fifty standard deviations are the tape's end in another hole; two are as they happen.
#[test]
fn a_tape_that_is_far_off_is_rejected_and_moves_nothing() {
    let log = |off: f64| {
        dataset(GYRO, |run, poses| {
            let of_one = if run.info.id == "run-0" { off } else { 0.0 };
            tape(run, poses, [20, 120], of_one);
            revisit(run, poses, [120, 210], 0.0);
        })
    };
    let far = log(50.0);
    let fit = fitted(&far);
    let [outliers] = &fit.partial_outliers()[..] else { panic!("{:?}", fit.partial_outliers()) };
    assert_eq!((outliers.run, &outliers.rejected[..]), ((0, 0), &[("taped distances", 1)][..]));
    // Taken, it would move the wheels by more than a hundredth.
    assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
    let near = log(2.0);
    assert_eq!(fitted(&near).partial_outliers(), []);
}

#[test]
fn rows_without_a_rate_leave_the_others_as_they_are() {
    let log = |missing: &[usize]| {
        dataset(GYRO, |run, poses| {
            tape(run, poses, [20, 120], 0.0);
            revisit(run, poses, [120, 210], 0.0);
            let rates = run.odometry.extra.get_mut(&ExtraChannel::GyroYawRate).expect("a gyro");
            missing.iter().for_each(|row| rates[*row] = f64::NAN);
        })
    };
    // The first row has no interval before it; then a row of a straight, and three of a spin.
    let sparse = log(&[0, 60, 150, 151, 152]);
    let fit = fitted(&sparse);
    // Rejects a rate that is not known in a sum, which leaves no number.
    assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
    let turns = |dataset: &Dataset| {
        let records = Records::of(&[dataset.session()]);
        let times_s = records.partial[0].observations.iter().filter_map(|of| match of.quantity {
            crate::partial_observation::Quantity::GyroTurn { dt_s } => Some(dt_s),
            _ => None,
        });
        times_s.sum::<f64>()
    };
    // Four intervals of a tenth of a second. Rejects a window that goes on across them.
    let without_s = turns(&log(&[])) - turns(&sparse);
    assert!((without_s - 0.4).abs() < 1e-9, "{without_s}");
}

#[test]
fn a_gyroscope_of_unknown_scale_tells_the_ratio_of_the_wheels_and_no_separation() {
    let dataset = dataset(GYRO, |run, poses| tape(run, poses, [20, 120], 0.0));
    let fit = fitted(&dataset);
    assert_eq!(fit.unobservable.len(), 1);
    assert!(fit.unobservable[0][2].abs() > 0.999, "{:?}", fit.unobservable);
    assert!(errors(&fit)[..2].iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
    let alone = fitted_alone();
    assert_eq!(alone.len(), 2);
}

fn fitted_alone() -> Vec<nalgebra::DVector<f64>> {
    let dataset = dataset(GYRO, |_, _| {});
    fitted(&dataset).unobservable
}

#[test]
fn what_is_stated_of_a_gyroscopes_scale_is_the_separations_uncertainty() {
    let stated = 0.004;
    let dataset =
        dataset(GyroNoise { scale_sigma: Some(stated), ..GYRO }, |run, poses| tape(run, poses, [20, 120], 0.0));
    let fit = fitted(&dataset);
    assert!(fit.unobservable.is_empty(), "{:?}", fit.unobservable);
    assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
    let covariance = fit.covariance(&mut []).expect("determined");
    let sigma = covariance[(2, 2)].sqrt();
    assert!((sigma / stated - 1.0).abs() < 0.2, "{sigma}");
}

#[test]
fn walls_determine_the_robot_with_headings_or_with_distances_alone() {
    for parts in [[true, true], [true, false], [false, true]] {
        let dataset = dataset(NO_GYRO, |run, poses| {
            for row in (0..=280).step_by(20) {
                wall(run, poses, row, parts, 0.0);
            }
            tape(run, poses, [20, 120], 0.0);
        });
        let fit = fitted(&dataset);
        assert!(fit.unobservable.is_empty(), "{parts:?} {:?}", fit.unobservable);
        let most = if parts[1] { 10.0 } else { 30.0 } * NOISELESS;
        assert!(errors(&fit).iter().all(|error| error.abs() < most), "{parts:?} {:?}", errors(&fit));
    }
}

#[test]
fn headings_alone_are_as_good_as_those_along_a_wall_whatever_they_count_from() {
    let headed = |zero_rad: f64| {
        dataset(NO_GYRO, move |run, poses| {
            tape(run, poses, [40, 100], 0.0);
            for row in [0, 100, 190, 280] {
                let theta_rad = wrap_to_pi(poses[row].theta_rad + zero_rad);
                run.headings.push(HeadingReading { t_s: run.odometry.t_s[row], theta_rad, sigma_rad: SIGMA_RAD });
            }
        })
    };
    let [north, east] = [headed(0.3), headed(2.0)];
    let [north, east] = [fitted(&north), fitted(&east)];
    assert!(north.unobservable.is_empty(), "{:?}", north.unobservable);
    assert!(errors(&north).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&north));
    // Both converge to the steps' tolerance, far below the errors.
    let apart = errors(&north).iter().zip(errors(&east)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < NOISELESS, "{apart}");
}

#[test]
fn rates_by_their_own_instants_are_means_over_the_rows() {
    let own = |instantaneous: bool| {
        let gyro = GyroNoise { is_instantaneous: instantaneous, ..GYRO };
        dataset(gyro, |run, _| {
            let rate = |number: u32| 0.1 + 0.3 * (0.37 * f64::from(number)).sin();
            let sample = |number| GyroSample { t_s: 0.033 * f64::from(number) - 0.01, omega_radps: rate(number) };
            run.gyro = (0..900).map(sample).collect();
        })
    };
    let mut column = own(false);
    for run in &mut column.runs {
        let rates = run.gyro_rates().expect("a gyroscope").into_owned();
        run.gyro.clear();
        run.odometry.extra.insert(ExtraChannel::GyroYawRate, rates);
    }
    let expected = equations(&column, &nominal(), &noise());
    for instantaneous in [false, true] {
        assert_eq!(equations(&own(instantaneous), &nominal(), &noise()), expected);
    }
}

#[test]
fn the_noise_of_a_gyroscope_is_taken_from_its_standstills() {
    let noise = 3e-4;
    let mut log = dataset(GyroNoise { noise_rad_per_sqrt_s: Some(1.0), ..NO_GYRO }, |_, _| {});
    log.truth_noise.gyro.noise_rad_per_sqrt_s = None;
    for run in &mut log.runs {
        for (row, rate) in
            run.odometry.extra.get_mut(&ExtraChannel::GyroYawRate).expect("a gyro").iter_mut().enumerate()
        {
            // Of unit variance: ±1 in a sequence that does not repeat.
            let sign = if (row * row * 7 + row * 3) % 11 < 5 { 1.0 } else { -1.0 };
            *rate += sign * noise / 0.1_f64.sqrt();
        }
    }
    let records = Records::of(&[log.session()]);
    let of = records.partial[0].observations[0];
    let found = (of.variance / records_window_s(&records)).sqrt();
    assert!((found / noise - 1.0).abs() < 0.25, "{found}");
}

fn records_window_s(records: &Records<'_>) -> f64 {
    match records.partial[0].observations[0].quantity {
        crate::partial_observation::Quantity::GyroTurn { dt_s } => dt_s,
        _ => f64::NAN,
    }
}

/// The run in counts of `rad`.
pub(super) fn in_counts(mut dataset: Dataset, rad: f64) -> Dataset {
    dataset.robot.ticks_per_rev = Some(std::f64::consts::TAU / rad);
    for run in &mut dataset.runs {
        let WheelLog::Angles(angles) = &run.odometry.wheels else { unreachable!("the helper logs angles") };
        let ticks = |column: &Vec<f64>| column.iter().map(|turned| (turned / rad).round() as i64).collect();
        run.odometry.wheels = WheelLog::Ticks(angles.as_ref().map(ticks));
    }
    dataset
}

#[test]
fn a_tape_has_the_rounding_of_the_counts_at_both_of_its_ends() {
    // Counts of 1.6 mm under a tape of a tenth of a millimetre, and wheels that do not scatter.
    let (rad, sigma_m) = (0.02, 1e-4);
    let taped = dataset(NO_GYRO, |run, poses| {
        tape(run, poses, [20, 120], 0.0);
        run.distances[0].sigma_m = sigma_m;
    });
    let exact_wheels = Noise { variance: [1e-16, 1e-16, 1.0, 1.0], timing_s2: 0.0 };
    let mut model = nominal();
    (model.m_per_rad, model.separation_m) = (M_PER_RAD, SEPARATION_M);
    let found = equations(&in_counts(taped, rad), &model, &exact_wheels);
    assert_eq!(found.count, 4.0);
    // A wheel's count is off by up to half of itself, uniformly; the centre goes by the mean of the wheels.
    let of_an_end_m2 = rad * rad / 12.0 * (M_PER_RAD.left.powi(2) + M_PER_RAD.right.powi(2)) / 4.0;
    let expected = (sigma_m * sigma_m + 2.0 * of_an_end_m2).ln();
    // The path is straight, so that what wheels err against each other goes across the tape.
    assert!((found.log_det / 4.0 - expected).abs() < 1e-3, "{} {expected}", found.log_det / 4.0);
}

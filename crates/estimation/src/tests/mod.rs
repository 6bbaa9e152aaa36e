//! The pass against what it differentiates.

use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
use kinematics::{Increment, Pose, Wheels};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};

use crate::normal_equations::total;
use crate::pass::pass;
use crate::pass_options::{OutlierGate, PassOptions};
use crate::settings::MIN_PARALLEL_WORK;
use crate::{Column, Model, ModelFit, Noise, Pass, Records, Selection, Thinning};

mod correlated;
mod covariance_scale;
mod golden;
mod golden_numbers;
mod groups;
mod intervals;
mod nuisances;
mod one_step;
mod partial;
mod partial_poses;
mod path_shape;
mod rate_noise;
mod rate_rounding;
mod records;
mod restored;
mod rounding;
mod scores;
mod selection;
mod sensor_position;
mod systematic_errors;
mod timing;
mod wall_start;
mod walls;

const LEFT_RAD: [f64; 12] = [2.0, 2.0, -1.0, 0.0, 3.0, 1.5, 2.0, -2.0, -3.0, 1.0, 2.0, 2.5];
const RIGHT_RAD: [f64; 12] = [2.0, 2.5, 1.0, 0.0, 2.0, 1.5, -2.0, 2.0, -3.0, 2.0, 1.0, 2.5];

/// Two runs of a dozen rows, measured every two seconds with errors of a few millimetres, with headings or
/// without.
fn dataset(with_headings: bool) -> Dataset {
    dataset_of(2, with_headings)
}

/// The same of another number of runs.
pub(crate) fn dataset_of(runs: u32, with_headings: bool) -> Dataset {
    let run = |number: u32| {
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        let mut pose = Pose::new(0.2, -0.1, 0.5 + f64::from(number));
        let mut truth = Vec::new();
        for row in 0..=12_u32 {
            if row % 2 == 0 {
                let off = |k: f64| 3e-3 * (12.9898 * f64::from(7 * row + number) + 78.233 * k).sin();
                let theta = with_headings.then_some(pose.theta_rad + BODY_FROM_SENSOR.theta_rad + off(3.0));
                let measured = if with_headings { pose * BODY_FROM_SENSOR } else { pose };
                truth.push(TruthSample::new(f64::from(row), measured.x_m + off(1.0), measured.y_m + off(2.0), theta));
            }
            if row < 12 {
                let k = row as usize;
                let (left, right) = (LEFT_RAD[k], RIGHT_RAD[k]);
                angles.left.push(angles.left[k] + left);
                angles.right.push(angles.right[k] + right);
                pose =
                    pose * Increment::from_travel(Wheels { left: 0.0811 * left, right: 0.0797 * right }, 0.366).arc();
            }
        }
        let odometry = Odometry {
            t_s: (0..=12).map(f64::from).collect(),
            wheels: WheelLog::Angles(angles),
            ..Odometry::default()
        };
        let info = RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() };
        Run { info, odometry, truth, ..Run::default() }
    };
    Dataset {
        provenance: Provenance::default(),
        robot: NominalRobot {
            left_wheel_diameter_m: 0.16,
            right_wheel_diameter_m: 0.16,
            wheel_separation_m: 0.363,
            ticks_per_rev: None,
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: (0..runs).map(run).collect(),
    }
}

/// Adds distance in proportion to the square of the travel, and moves measurements ahead in proportion to the
/// speed.
#[derive(Clone)]
struct TravelTerm;

impl ModelTerm for TravelTerm {
    fn parameters(&self) -> &'static [TermParameter] {
        const MOTION: TermParameter = TermParameter { name: "distance_per_m", unit: "1/m", prior_sigma: 1.0 };
        const MEASUREMENT: TermParameter = TermParameter { name: "ahead_s", unit: "s", prior_sigma: 1.0 };
        &[MOTION, MEASUREMENT]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let travel_m = interval.travel_m;
        gradient[0] = interval.change(travel_m.map(|travel_m| travel_m * travel_m));
        gradient[0].y_m = 0.1 * travel_m.left;
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[1] = Pose::new(measurement.twist.v_m_s, 0.1, 0.3);
    }
}

/// Has the distance driven in the run as its state.
#[derive(Clone)]
struct RunDistanceTerm {
    distance_m: f64,
}

impl ModelTerm for RunDistanceTerm {
    fn parameters(&self) -> &'static [TermParameter] {
        const MOTION: TermParameter = TermParameter { name: "distance_per_m2", unit: "1/m²", prior_sigma: 1.0 };
        const MEASUREMENT: TermParameter = TermParameter { name: "ahead", unit: "1", prior_sigma: 1.0 };
        &[MOTION, MEASUREMENT]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.distance_m = 0.0;
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        self.distance_m += interval.increment().distance_m.abs();
        gradient[0] = interval.change(interval.travel_m.map(|travel_m| self.distance_m * travel_m));
    }

    fn measurement(&mut self, _: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[1] = Pose::new(self.distance_m, 0.0, 0.0);
    }
}

#[test]
fn runs_in_parallel_give_the_bits_of_runs_in_sequence() {
    // Runs of at least four propagation intervals each: more than those from which on runs are filtered in
    // parallel.
    let dataset = dataset_of(MIN_PARALLEL_WORK.div_ceil(4) as u32, true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 1.0, phases: 2 }, &MODEL);
    let headings = vec![0.0; records.segments.len()];
    let pass_options = PassOptions { noise_score: true, innovations: true, ..PassOptions::default() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(RunDistanceTerm { distance_m: 7.0 })];
        let found = pool.install(|| pass(&records, &selections, &model(), &NOISE, &headings, &mut terms, pass_options));
        (found.runs, found.innovations, found.outliers, found.noise)
    };
    let one_by_one = on(1);
    assert!(one_by_one.1.iter().all(|phase| phase.len() > MIN_PARALLEL_WORK), "measurements were left out");
    assert_eq!(on(2), one_by_one);
    assert_eq!(on(3), one_by_one);
}

#[test]
fn parts_have_all_products_but_those_with_each_other() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    let model = Model { term_values: vec![0.004, -0.003, 0.0, 0.0, 0.0, 0.0], ..MODEL };
    let headings = vec![0.0; records.segments.len()];
    let of = |parts| {
        let term = || Box::new(RunDistanceTerm { distance_m: 0.0 });
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(TravelTerm), term(), term()];
        let pass_options = PassOptions { parts, ..PassOptions::default() };
        total(&pass(&records, &selections, &model, &NOISE, &headings, &mut terms, pass_options).runs).expect("runs")
    };
    let (all, grouping) = (of(&[]), of(&[2, 2]));
    let common = Column::BASE.len() + 2;
    for row in 0..common + 4 {
        for column in 0..common + 4 {
            let is_cross = row.min(column) >= common && (row - common) / 2 != (column - common) / 2;
            let expected = if is_cross { 0.0 } else { all.information[(row, column)] };
            // Columns are summed four at a time, in other groups: rounding, 1e-16 of two dozen terms. Rejects
            // a product that one of them lacks.
            let off = grouping.information[(row, column)] - expected;
            assert!(off.abs() <= 1e-14 * expected.abs(), "{row} {column}: {off} of {expected}");
            assert!(!is_cross || all.information[(row, column)] != 0.0, "{row} {column}: nothing to leave out");
        }
    }
    assert!((grouping.gradient - &all.gradient).norm() <= 1e-14 * all.gradient.norm());
}

#[test]
fn a_fit_sums_the_products_that_it_steps_along() {
    // Without headings, so that the start heading is eliminated from the products, too.
    let dataset = dataset(false);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    let model = Model { term_values: vec![0.004, -0.003], ..MODEL };
    let headings = vec![0.5; records.segments.len()];
    let summed = |free, parts: &[usize]| {
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(TravelTerm)];
        // The second run's heading is a radian off: ungated, so that its measurements are taken.
        let pass_options = PassOptions { free, parts, gate: OutlierGate::Off, ..PassOptions::default() };
        total(&pass(&records, &selections, &model, &NOISE, &headings, &mut terms, pass_options).runs).expect("runs")
    };
    let free = [Column::LeftWheel, Column::Separation, Column::Term(1)];
    let (all, own) = (summed(None, &[]), summed(Some(&free[..]), &[]));
    // The same sums in the same order. Rejects a row that is left out or read from another place.
    assert_eq!(own.of(&free), all.of(&free));
    // What a fit of the geometry and terms carries no derivatives by is zero. Rejects terms that take another
    // column's place.
    let carried: Vec<usize> = (0..all.gradient.len())
        .filter(|column| *column < Column::GEOMETRY.len() || *column >= Column::BASE.len())
        .collect();
    assert_eq!(own.gradient_of(&carried), all.gradient_of(&carried));
    let instruments: Vec<usize> = (Column::GEOMETRY.len()..Column::BASE.len()).collect();
    assert!(own.gradient_of(&instruments).iter().all(|gradient| *gradient == 0.0));
    // One column of the instrument brings all of them.
    let with_latency = [Column::LeftWheel, Column::Latency, Column::Term(1)];
    let own = summed(Some(&with_latency[..]), &[]);
    assert_eq!(own.of(&with_latency), all.of(&with_latency));
    assert_eq!(own.gradient, all.gradient);
    // One part of all terms has all products, too. Rejects products of the heading with other columns that
    // are lost where its row has its column's number, as without parts: the difference is then of order 1.
    // Rounding is of some 1e-16 of each sum.
    let in_part = summed(None, &[2]);
    assert!((&in_part.information - &all.information).norm() <= 1e-13 * all.information.norm());
    // Two columns along which nothing steps have no products of their own, but for the eliminated heading.
    let (x, y) = (Column::SensorX.index(), Column::SensorY.index());
    assert_ne!(own.information[(x, y)], all.information[(x, y)]);
}

pub(crate) const BODY_FROM_SENSOR: Pose = Pose::new(0.03, -0.02, 0.1);

/// About a standard deviation from the true model.
pub(crate) const MODEL: Model = Model {
    m_per_rad: Wheels { left: 0.0812, right: 0.0796 },
    separation_m: 0.3665,
    body_from_sensor: Pose::new(0.032, -0.019, 0.103),
    own: None,
    latency_s: 0.003,
    gyro_scale: 0.0,
    term_values: Vec::new(),
};

fn model() -> Model {
    Model { term_values: vec![0.004, -0.003], ..MODEL }
}

pub(crate) const NOISE: Noise = Noise { variance: [1e-6, 4e-6, 9e-6, 2.5e-5], timing_s2: 0.0 };

fn run(dataset: &Dataset, model: &Model, noise: &Noise, headings: &[f64], pass_options: PassOptions) -> Pass {
    let model = &Model {
        term_values: if model.term_values.is_empty() { vec![0.0; 2] } else { model.term_values.clone() },
        ..model.clone()
    };
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    pass(&records, &selections, model, noise, headings, &mut [Box::new(TravelTerm)], pass_options)
}

fn cost(pass: &Pass) -> f64 {
    pass.runs.iter().map(crate::NormalEquations::cost).sum()
}

fn columns() -> Vec<Column> {
    // There is no gyroscope.
    let base = Column::BASE.into_iter().filter(|column| *column != Column::GyroScale);
    base.chain([Column::Term(0), Column::Term(1)]).collect()
}

/// The gradient is the mean's alone: that the filter's own headings turn its covariances is left out.
/// Innovations of one standard deviation over moves of a radian make that half a per cent of the root of a
/// column's information.
#[test]
fn the_gradient_is_that_of_the_cost() {
    let dataset = dataset(true);
    let headings = [0.0, 0.0];
    let found =
        run(&dataset, &model(), &NOISE, &headings, PassOptions { gate: OutlierGate::Off, ..PassOptions::default() });
    let gradient =
        found.runs.iter().fold(nalgebra::DVector::zeros(Column::BASE.len() + 2), |sum, run| sum + &run.gradient);
    let information =
        found.runs.iter().fold(nalgebra::DMatrix::zeros(Column::BASE.len() + 2, Column::BASE.len() + 2), |sum, run| {
            sum + &run.information
        });
    for column in columns() {
        let k = column.index();
        let h = 1e-3 / f64::sqrt(information[(k, k)]);
        let at = |by: f64| {
            let mut model = model();
            model.advance(column, by);
            cost(&run(
                &dataset,
                &model,
                &NOISE,
                &headings,
                PassOptions { gate: OutlierGate::Off, ..PassOptions::default() },
            ))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        let scale = f64::sqrt(information[(k, k)]);
        let off = (gradient[k] - difference).abs() / scale;
        assert!(off < 0.02, "{column:?}: {} {difference} in {scale}", gradient[k]);
        // A column 5 % too long would not pass.
        assert!((1.05 * gradient[k] - difference).abs() / scale > 0.02, "{column:?}");
    }
}

/// In ln(variance). The recursions are those of the filter, differentiated; left out is, as above, that
/// headings turn covariances: 3e-4 of a score here.
#[test]
fn the_noise_score_is_the_derivative_of_the_cost() {
    let dataset = dataset(true);
    let pass_options = PassOptions { gate: OutlierGate::Off, noise_score: true, ..PassOptions::default() };
    let score = run(&dataset, &model(), &NOISE, &[0.0, 0.0], pass_options).noise.gradient;
    for k in 0..4 {
        let h = 1e-4_f64;
        let at = |by: f64| {
            let mut noise = NOISE;
            noise.variance[k] *= by.exp();
            cost(&run(&dataset, &model(), &noise, &[0.0, 0.0], pass_options))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        let tolerance = 2e-3 * (1.0 + difference.abs());
        assert!((score[k] - difference).abs() < tolerance, "{k}: {} {difference}", score[k]);
        // Without what the gains' change does to the innovations to come, or 1 % too large, it would not
        // pass.
        assert!((1.01 * score[k].abs() + 5e-3 - difference.abs()).abs() > tolerance, "{k}");
    }
}

/// A start heading that is not measured is eliminated: the sums are those at its optimum, and moving it away
/// costs.
#[test]
fn a_free_heading_is_at_its_best() {
    let dataset = dataset(false);
    let pass_options = PassOptions { gate: OutlierGate::Off, innovations: true, ..PassOptions::default() };
    let mut headings = [0.6, 1.6];
    for _ in 0..8 {
        let found = run(&dataset, &CENTRED_MODEL, &NOISE, &headings, pass_options);
        for (segment, rest_rad) in found.heading_steps() {
            headings[segment] += rest_rad;
        }
    }
    let at_best = run(&dataset, &CENTRED_MODEL, &NOISE, &headings, pass_options);
    assert!(at_best.headings.iter().all(|heading| heading.response.rest.abs() < 1e-9), "{:?}", at_best.headings);
    // Runs start at 0.5 and 1.5 rad; measurements of 3 mm over half a metre determine a heading to 0.01 rad.
    assert!((headings[0] - 0.5).abs() < 0.03 && (headings[1] - 1.5).abs() < 0.03, "{headings:?}");
    let off = run(&dataset, &CENTRED_MODEL, &NOISE, &[headings[0] + 0.01, headings[1]], pass_options);
    // To second order the elimination undoes the move.
    assert!((cost(&off) - cost(&at_best)).abs() < 0.05 * cost(&at_best).abs(), "{} {}", cost(&off), cost(&at_best));
    assert!(off.headings[0].response.rest < -0.009);
    // What the heading takes up is what the innovations have more than the sums.
    let (mut total, mut squares) = (0.0, 0.0);
    off.runs.iter().for_each(|run| total += run.chi_square);
    off.innovations.iter().flatten().for_each(|component| squares += component.z.powi(2));
    let taken = off.chi_square_of_headings();
    assert!(taken > 1.0 && (squares - total - taken).abs() < 1e-9 * squares, "{squares} {total} {taken}");
}

#[test]
fn innovations_that_were_left_out_are_found_again() {
    let dataset = dataset(true);
    let fit = crate::FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    assert!(!fit.solution.pass.innovations.is_empty());
    assert!(matches!(fit.with_innovations(&mut []), std::borrow::Cow::Borrowed(_)));
    let without = fit.clone().without_innovations();
    assert!(without.solution.pass.innovations.is_empty());
    let again = without.with_innovations(&mut []);
    let pairs = again.solution.pass.innovations[0].iter().zip(&fit.solution.pass.innovations[0]);
    // The fit's last pass may go by cached propagations.
    assert!(pairs.clone().count() > 10 && pairs.clone().all(|(a, b)| (a.z - b.z).abs() < 1e-4));
}

#[test]
fn a_start_heading_is_that_of_the_path() {
    let dataset = dataset(false);
    let records = Records::of(&[dataset.session()]);
    let found = records.start_headings_rad(&CENTRED_MODEL);
    // Runs start at 0.5 and 1.5 rad; 3 mm over some decimetres.
    assert!((found[0] - 0.5).abs() < 0.03 && (found[1] - 1.5).abs() < 0.03, "{found:?}");
}

const CENTRED_MODEL: Model = Model {
    m_per_rad: Wheels { left: 0.0811, right: 0.0797 },
    separation_m: 0.366,
    body_from_sensor: Pose::IDENTITY,
    own: None,
    latency_s: 0.0,
    gyro_scale: 0.0,
    term_values: Vec::new(),
};

#[test]
fn cached_propagations_follow_the_model_to_first_order() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    let headings = vec![0.0; records.segments.len()];
    let model = Model { term_values: vec![0.0; 4], ..MODEL };
    let of = |model: &Model, pass_options: PassOptions<'_>| {
        let mut terms: Vec<Box<dyn ModelTerm>> =
            vec![Box::new(TravelTerm), Box::new(RunDistanceTerm { distance_m: 0.0 })];
        let pass_options = PassOptions { noise_score: true, innovations: true, gate: OutlierGate::Off, ..pass_options };
        pass(&records, &selections, model, &NOISE, &headings, &mut terms, pass_options)
    };
    let driven = of(&model, PassOptions { keep: true, ..PassOptions::default() });
    let cached = driven.cached.as_ref().expect("propagations are cached");
    let by = PassOptions { by: Some(cached), ..PassOptions::default() };
    let reused = of(&model, by);
    assert_eq!((&reused.runs, &reused.innovations, reused.noise), (&driven.runs, &driven.innovations, driven.noise));
    // At twice the distance from the model of the cache the error is four times as large, to a tenth: the
    // next order is a hundredth of that here.
    let off = |size: f64| {
        let mut near = model.clone();
        let columns = Column::BASE.into_iter().chain((0..4).map(Column::Term));
        columns.enumerate().for_each(|(k, column)| near.advance(column, size * (1.0 - 0.3 * k as f64)));
        let (reused, driven) = (of(&near, by), of(&near, PassOptions::default()));
        let pairs = reused.innovations[0].iter().zip(&driven.innovations[0]);
        pairs.map(|(reused, driven)| (reused.sigma * (reused.z - driven.z)).abs()).fold(0.0, f64::max)
    };
    let ratio = off(2e-3) / off(1e-3);
    assert!((ratio / 4.0 - 1.0).abs() < 0.1, "{ratio}");
    assert!(off(1e-3) < 1e-4, "{}", off(1e-3));
}

/// Adds distance by the phase of the left wheel.
#[derive(Clone)]
struct PhaseTerm;

impl ModelTerm for PhaseTerm {
    fn parameters(&self) -> &'static [TermParameter] {
        const OFF: TermParameter = TermParameter { name: "distance_m", unit: "m", prior_sigma: 1.0 };
        &[OFF]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        gradient[0] = Pose::new((0.4 * interval.wheel_rad.left).cos(), 0.0, 0.0);
    }
}

/// A block in the middle of a run says what a log says that begins there, whose counters do not begin anew.
#[test]
fn a_block_of_a_run_knows_the_phases_of_its_wheels() {
    let whole = dataset_of(1, true);
    let mut second = whole.clone();
    let run = &mut second.runs[0];
    run.odometry.t_s.drain(..6);
    let WheelLog::Angles(angles) = &mut run.odometry.wheels else { unreachable!("the helper logs angles") };
    angles.left.drain(..6);
    angles.right.drain(..6);
    run.truth.retain(|sample| sample.t_s >= 6.0);
    let model = Model { latency_s: 0.0, ..MODEL };
    let of = |dataset: &Dataset, blocks: usize| {
        let session = [dataset.session()];
        let fit = ModelFit::from_parameters(model.clone(), NOISE, &session);
        let mut fit = fit;
        fit.solution.model.term_values = vec![0.0];
        fit.in_blocks(&mut [Box::new(PhaseTerm)], blocks)
    };
    let (blocks, alone) = (of(&whole, 2), of(&second, 1));
    // The products of the phase with all but the latency, which goes by rates on both sides of the cut: to
    // rounding. Rejects phases that begin with the run's in each block.
    let phase = Column::Term(0).index();
    let others = [Column::Latency, Column::GyroScale].map(Column::index);
    for column in (0..=phase).filter(|column| !others.contains(column)) {
        let [whole, cut] = [&blocks[1], &alone[0]].map(|of| of.information[(phase, column)]);
        assert!((whole / cut - 1.0).abs() < 1e-9, "{column}: {whole} {cut}");
    }
}

#[test]
fn dead_reckoning_to_every_measurement_ends_where_a_run_cut_there_ends() {
    let dataset = dataset_of(1, true);
    let fit = |dataset: &Dataset| -> Vec<(Pose, f64)> {
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(RunDistanceTerm { distance_m: 7.0 })];
        let fit = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
        fit.dead_reckoned(&model(), &mut terms).iter().map(|end| (end.off, end.length_m)).collect()
    };
    let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(RunDistanceTerm { distance_m: 7.0 })];
    let whole = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
    let measurements = whole.dead_reckoned_measurements(&model(), &mut terms);
    assert_eq!(measurements.len(), dataset.runs[0].truth.len() - 1);
    for (k, measurement) in measurements.iter().enumerate() {
        let mut cut = dataset.clone();
        cut.runs[0].truth.truncate(k + 2);
        // The same steps in the same order: to the last bit.
        assert_eq!(fit(&cut), [(measurement.off, measurement.length_m)], "measurement {k}");
    }
}

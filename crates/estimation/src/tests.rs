//! The pass against what it differentiates.

use dataset::{
    Dataset, Displacement, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
};
use kinematics::{Increment, Pose, Wheels};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};

use crate::decimation::Decimated;
use crate::filter::{OutlierGate, PassOptions};
use crate::normal_equations::total;
use crate::pass::pass;
use crate::settings::MIN_PARALLEL_WORK;
use crate::{Column, FitSettings, Model, ModelFit, Noise, Pass, Records, Selection, Thinning};

const LEFT_RAD: [f64; 12] = [2.0, 2.0, -1.0, 0.0, 3.0, 1.5, 2.0, -2.0, -3.0, 1.0, 2.0, 2.5];
const RIGHT_RAD: [f64; 12] = [2.0, 2.5, 1.0, 0.0, 2.0, 1.5, -2.0, 2.0, -3.0, 2.0, 1.0, 2.5];

/// Two runs of a dozen rows, seen every two seconds a few millimetres off; headings only where asked for.
fn dataset(with_headings: bool) -> Dataset {
    dataset_of(2, with_headings)
}

/// So many of them.
fn dataset_of(runs: u32, with_headings: bool) -> Dataset {
    let run = |number: u32| {
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        let mut pose = Pose::new(0.2, -0.1, 0.5 + f64::from(number));
        let mut truth = Vec::new();
        for row in 0..=12_u32 {
            if row % 2 == 0 {
                let off = |k: f64| 3e-3 * (12.9898 * f64::from(7 * row + number) + 78.233 * k).sin();
                let theta = with_headings.then_some(pose.theta_rad + MOUNTED.theta_rad + off(3.0));
                let measured = if with_headings { pose * MOUNTED } else { pose };
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

/// Adds way in proportion to the square of the travel, and looks ahead in proportion to the speed.
#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    fn parameters(&self) -> &'static [TermParameter] {
        const WAY: TermParameter = TermParameter { name: "way_per_m", unit: "1/m", prior_sigma: 1.0 };
        const LOOK: TermParameter = TermParameter { name: "ahead_s", unit: "s", prior_sigma: 1.0 };
        &[WAY, LOOK]
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

/// Remembers the way of the run.
#[derive(Clone)]
struct Worn {
    distance_m: f64,
}

impl ModelTerm for Worn {
    fn parameters(&self) -> &'static [TermParameter] {
        const WAY: TermParameter = TermParameter { name: "way_per_m2", unit: "1/m²", prior_sigma: 1.0 };
        const LOOK: TermParameter = TermParameter { name: "ahead", unit: "1", prior_sigma: 1.0 };
        &[WAY, LOOK]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.distance_m = 0.0;
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        self.distance_m += interval.increment().distance_m.abs();
        gradient[0] = interval.change(interval.travel_m.map(|travel_m| self.distance_m * travel_m));
    }

    fn measurement(&mut self, _look: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[1] = Pose::new(self.distance_m, 0.0, 0.0);
    }
}

#[test]
fn runs_at_once_say_what_they_say_one_after_the_other_to_the_last_bit() {
    // Runs of at least four propagation intervals each: more than those from which on runs go at once.
    let dataset = dataset_of(MIN_PARALLEL_WORK.div_ceil(4) as u32, true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 1.0, phases: 2 }, &MODEL);
    let headings = vec![0.0; records.segments.len()];
    let pass_options = PassOptions { noise_score: true, innovations: true, ..PassOptions::default() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Worn { distance_m: 7.0 })];
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
        let worn = || Box::new(Worn { distance_m: 0.0 });
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Term), worn(), worn()];
        let pass_options = PassOptions { parts, ..PassOptions::default() };
        total(&pass(&records, &selections, &model, &NOISE, &headings, &mut terms, pass_options).runs).expect("runs")
    };
    let (all, grouping) = (of(&[]), of(&[2, 2]));
    let common = Column::BASE.len() + 2;
    for row in 0..common + 4 {
        for column in 0..common + 4 {
            let is_cross = row.min(column) >= common && (row - common) / 2 != (column - common) / 2;
            let expected = if is_cross { 0.0 } else { all.information[(row, column)] };
            assert_eq!(grouping.information[(row, column)], expected, "{row} {column}");
            assert!(!is_cross || all.information[(row, column)] != 0.0, "{row} {column}: nothing to leave out");
        }
    }
    assert_eq!(grouping.gradient, all.gradient);
}

const MOUNTED: Pose = Pose::new(0.03, -0.02, 0.1);

/// About a standard deviation from what was driven.
const MODEL: Model = Model {
    m_per_rad: Wheels { left: 0.0812, right: 0.0796 },
    separation_m: 0.3665,
    body_from_sensor: Pose::new(0.032, -0.019, 0.103),
    own: None,
    latency_s: 0.003,
    term_values: Vec::new(),
};

fn model() -> Model {
    Model { term_values: vec![0.004, -0.003], ..MODEL }
}

const NOISE: Noise = Noise { variance: [1e-6, 4e-6, 9e-6, 2.5e-5] };

fn run(dataset: &Dataset, model: &Model, noise: &Noise, headings: &[f64], pass_options: PassOptions) -> Pass {
    let model = &Model {
        term_values: if model.term_values.is_empty() { vec![0.0; 2] } else { model.term_values.clone() },
        ..model.clone()
    };
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    pass(&records, &selections, model, noise, headings, &mut [Box::new(Term)], pass_options)
}

fn cost(pass: &Pass) -> f64 {
    pass.runs.iter().map(crate::NormalEquations::cost).sum()
}

fn columns() -> Vec<Column> {
    Column::BASE.into_iter().chain([Column::Term(0), Column::Term(1)]).collect()
}

/// The gradient is the mean's alone: that the filter's own headings turn its covariances is left out. Innovations of one standard deviation over moves of a radian
/// make that half a per cent of the root of a column's information.
#[test]
fn the_gradient_is_that_of_the_cost() {
    let dataset = dataset(true);
    let headings = [0.0, 0.0];
    let found =
        run(&dataset, &model(), &NOISE, &headings, PassOptions { gate: OutlierGate::Off, ..PassOptions::default() });
    let gradient = found.runs.iter().fold(nalgebra::DVector::zeros(9), |sum, run| sum + &run.gradient);
    let information = found.runs.iter().fold(nalgebra::DMatrix::zeros(9, 9), |sum, run| sum + &run.information);
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

/// In ln(variance). The recursions are those of the filter, differentiated; left out is, as above, that headings turn covariances: 3e-4 of a score here.
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
        // Without what the gains' change does to the innovations to come, or 1 % too large, it would not pass.
        assert!((1.01 * score[k].abs() + 5e-3 - difference.abs()).abs() > tolerance, "{k}");
    }
}

/// A heading that nobody saw is eliminated at its best: moving it away costs, and the sums with it at its best are what is reported.
#[test]
fn a_free_heading_is_at_its_best() {
    let dataset = dataset(false);
    let pass_options = PassOptions { gate: OutlierGate::Off, ..PassOptions::default() };
    let mut headings = [0.6, 1.6];
    for _ in 0..8 {
        let found = run(&dataset, &MODEL_SEEN_AT_THE_CENTRE, &NOISE, &headings, pass_options);
        for crate::pass::FreeHeading { segment, rest, .. } in &found.headings {
            headings[*segment] += rest;
        }
    }
    let at_best = run(&dataset, &MODEL_SEEN_AT_THE_CENTRE, &NOISE, &headings, pass_options);
    assert!(at_best.headings.iter().all(|heading| heading.rest.abs() < 1e-9), "{:?}", at_best.headings);
    // Runs start at 0.5 and 1.5 rad; measurements of 3 mm over half a metre see a heading to 0.01 rad.
    assert!((headings[0] - 0.5).abs() < 0.03 && (headings[1] - 1.5).abs() < 0.03, "{headings:?}");
    let off = run(&dataset, &MODEL_SEEN_AT_THE_CENTRE, &NOISE, &[headings[0] + 0.01, headings[1]], pass_options);
    // To second order the elimination undoes the move.
    assert!((cost(&off) - cost(&at_best)).abs() < 0.05 * cost(&at_best).abs(), "{} {}", cost(&off), cost(&at_best));
    assert!(off.headings[0].rest < -0.009);
}

const MODEL_SEEN_AT_THE_CENTRE: Model = Model {
    m_per_rad: Wheels { left: 0.0811, right: 0.0797 },
    separation_m: 0.366,
    body_from_sensor: Pose::IDENTITY,
    own: None,
    latency_s: 0.0,
    term_values: Vec::new(),
};

#[test]
fn thinned_looks_are_far_enough_apart_and_end_with_the_last() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 4.0, phases: 2 }, &MODEL);
    let measurements = |phase: usize| -> Vec<usize> {
        selections[phase].propagations[0].iter().map(|propagation| propagation.measurement).collect()
    };
    // Measurements every 2 s up to 12 s: at 4, 8, 12 s, and from 6 s on.
    assert_eq!(measurements(0), [2, 4, 6]);
    assert_eq!(measurements(1), [3, 6]);
    let first = &selections[1].propagations[0][0];
    assert_eq!((first.intervals.clone(), first.from), (0..6, 0));
}

/// Normal variables by the sum of twelve uniform ones of `SplitMix64` (Steele, Lea & Flood 2014).
struct Normals(u64);

impl Normals {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        f64::from(u32::try_from((z ^ (z >> 31)) >> 32).expect("half of the bits")) / f64::from(u32::MAX)
    }

    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A second each; runs of so many.
const DISPLACEMENTS: [u32; 8] = [40; 8];

/// Runs seen by displacements of a second, with errors of which a share `keeps` lasts from one to the next (a first-order autoregression of variance one, in
/// millimetres and milliradians).
fn mahalanobis_distance(runs: &[u32], keeps: f64, seed: u64) -> Dataset {
    let mut normals = Normals(seed);
    let mut dataset = dataset(true);
    let base = dataset.runs[0].clone();
    let run = |(number, displacements): (usize, &u32)| {
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        let (mut measured, mut errors) = (Vec::new(), [0.0; 3].map(|_: f64| normals.next()));
        for second in 0..*displacements {
            let k = (second as usize + number) % LEFT_RAD.len();
            let turned = Wheels { left: LEFT_RAD[k], right: RIGHT_RAD[k] };
            for (side, rad) in [(&mut angles.left, turned.left), (&mut angles.right, turned.right)] {
                let before = *side.last().expect("a start");
                side.push(before + rad);
            }
            let travel_m = Wheels { left: 0.0811 * turned.left, right: 0.0797 * turned.right };
            let slid_m = travel_m.map(|travel_m: f64| travel_m + 3e-4 * travel_m.abs().sqrt() * normals.next());
            let moved = Increment::from_travel(slid_m, 0.366).arc();
            errors = errors.map(|error| keeps * error + (1.0 - keeps * keeps).sqrt() * normals.next());
            measured.push(Displacement {
                t0_s: f64::from(second),
                t1_s: f64::from(second + 1),
                dx_m: moved.x_m + 1e-3 * errors[0],
                dy_m: moved.y_m + 1e-3 * errors[1],
                dtheta_rad: moved.theta_rad + 1e-3 * errors[2],
            });
        }
        let t_s = (0..=*displacements).map(f64::from).collect();
        let odometry = Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() };
        let info = RunInfo { id: format!("run-{number}"), ..base.info.clone() };
        Run { info, odometry, displacements: measured, ..Run::default() }
    };
    dataset.runs = runs.iter().enumerate().map(run).collect();
    dataset
}

#[test]
fn thinned_displacements_are_far_enough_apart_and_every_run_has_one() {
    let dataset = mahalanobis_distance(&[6, 1], 0.0, 0);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 2.5, phases: 2 }, &MODEL);
    let taken = |phase: usize| -> Vec<usize> {
        let propagations = selections[phase].propagations.iter().enumerate();
        propagations.filter(|(_, propagations)| !propagations.is_empty()).map(|(segment, _)| segment).collect()
    };
    // They end at 1 … 6 s: the first phase takes those at 1 and 4 s, the second, due from 1 + 1.25 s on, those at 3 and 6 s. The run of one gives it to both.
    assert_eq!(taken(0), [0, 3, 6]);
    assert_eq!(taken(1), [2, 5, 6]);
    assert!(records.times_between().all(|between_s| (between_s - 1.0).abs() < 1e-12));
    // Of the runs, not of the displacements, each of which is a segment of its own.
    assert!((selections[0].mean_measurements(&records) - 1.5).abs() < 1e-12);
    let all = Selection::of(&records, Thinning::NONE, &MODEL);
    assert!((all[0].mean_measurements(&records) - 3.5).abs() < 1e-12);
}

/// Of 20 datasets with white errors, four or more would be thinned by chance once in 20 000 times (1 % each). Were displacements not neighbours, none of those
/// whose errors last would.
#[test]
fn displacements_are_thinned_where_their_errors_last_and_only_there() {
    let thinned = |keeps: f64| {
        let of = |seed: &u64| {
            let dataset = mahalanobis_distance(&DISPLACEMENTS, keeps, *seed);
            let joint = FitSettings { nuisances: false, thin: true, thin_displacements: true };
            joint.fit(&[dataset.session()]).expect("a fit").thinning != Thinning::NONE
        };
        (1..=20_u64).filter(of).count()
    };
    assert!(thinned(0.0) < 4);
    assert_eq!(thinned(0.7), 20);
}

#[test]
fn kept_legs_follow_the_model_to_first_order() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    let headings = vec![0.0; records.segments.len()];
    let model = Model { term_values: vec![0.0; 4], ..MODEL };
    let of = |model: &Model, pass_options: PassOptions<'_>| {
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Term), Box::new(Worn { distance_m: 0.0 })];
        let pass_options = PassOptions { noise_score: true, innovations: true, gate: OutlierGate::Off, ..pass_options };
        pass(&records, &selections, model, &NOISE, &headings, &mut terms, pass_options)
    };
    let driven = of(&model, PassOptions { keep: true, ..PassOptions::default() });
    let cached = driven.cached.as_ref().expect("they were to be kept");
    let by = PassOptions { by: Some(cached), ..PassOptions::default() };
    let reused = of(&model, by);
    assert_eq!((&reused.runs, &reused.innovations, reused.noise), (&driven.runs, &driven.innovations, driven.noise));
    // Twice as far from where they were driven they are four times as far off, to a tenth: the next order is a hundredth of that here.
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

#[test]
fn dead_reckoning_to_every_look_ends_where_a_run_cut_there_ends() {
    let dataset = dataset_of(1, true);
    let fit = |dataset: &Dataset| -> Vec<(Pose, f64)> {
        let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Worn { distance_m: 7.0 })];
        let fit = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
        fit.dead_reckoned(&model(), &mut terms).iter().map(|end| (end.off, end.length_m)).collect()
    };
    let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Worn { distance_m: 7.0 })];
    let whole = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
    let measurements = whole.dead_reckoned_measurements(&model(), &mut terms);
    assert_eq!(measurements.len(), dataset.runs[0].truth.len() - 1);
    for (k, measurement) in measurements.iter().enumerate() {
        let mut cut = dataset.clone();
        cut.runs[0].truth.truncate(k + 2);
        // The same steps in the same order: to the last bit.
        assert_eq!(fit(&cut), [(measurement.off, measurement.length_m)], "look {k}");
    }
}

/// The same drive, logged so many times as often.
fn logged_finer(dataset: &Dataset, times: usize) -> Dataset {
    let mut finer = dataset.clone();
    for run in &mut finer.runs {
        let WheelLog::Angles(angles) = &run.odometry.wheels else { unreachable!("the helper logs angles") };
        let between = |of: &[f64]| -> Vec<f64> {
            let steps = of.windows(2).flat_map(|pair| {
                (0..times).map(|part| pair[0] + (pair[1] - pair[0]) * part as f64 / times as f64).collect::<Vec<_>>()
            });
            steps.chain(of.last().copied()).collect()
        };
        let (t_s, angles) = (between(&run.odometry.t_s), angles.as_ref().map(|of| between(of)));
        (run.odometry.t_s, run.odometry.wheels) = (t_s, WheelLog::Angles(angles));
    }
    finer
}

/// Adds way in proportion to the square of an interval's length.
#[derive(Clone)]
struct OfRows;

impl ModelTerm for OfRows {
    fn parameters(&self) -> &'static [TermParameter] {
        const WAY: TermParameter = TermParameter { name: "way_per_s2", unit: "m/s²", prior_sigma: 1.0 };
        &[WAY]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        gradient[0] = Pose::new(interval.dt_s * interval.dt_s, 0.0, 0.0);
    }
}

#[test]
fn rows_of_one_speed_taken_together_say_what_they_say_one_by_one() {
    // Ten rows a second, measurements every two: five intervals make half a second.
    let finer = logged_finer(&dataset(true), 10);
    let session = [finer.session()];
    let mut fit = ModelFit::from_parameters(MODEL, NOISE, &session);
    fit.solution.pass = fit.scan(&mut []);
    let coarse = fit.decimated(&mut [], 0.5).expect("a fifth of the pieces");
    let intervals =
        |fit: &ModelFit<'_>| fit.records.segments.iter().map(|segment| segment.intervals.len()).collect::<Vec<_>>();
    assert_eq!((intervals(&fit), intervals(&coarse)), (vec![120; 2], vec![24; 2]));
    let close = |a: &Pass, b: &Pass| {
        let both = a.runs.iter().zip(&b.runs);
        // Arcs put together from five of a tenth, to rounding.
        both.map(|(a, b)| (&a.gradient - &b.gradient).norm() / a.gradient.norm()).fold(0.0, f64::max) < 1e-9
    };
    assert!(close(&coarse.scan(&mut []), &fit.scan(&mut [])));
    // Rows of several speeds lead elsewhere.
    assert!(fit.decimated(&mut [], 3.0).is_none());
    // Wheels that turn back, stand or begin are no part of what went before, nor is what comes after a measurement: of twelve rows three go with the one before.
    let longest = Decimated::of(&fit.records, &fit.selections, 3.0).expect("fewer").records;
    assert_eq!(longest.segments.iter().map(|segment| segment.intervals.len()).collect::<Vec<_>>(), [9; 2]);
    assert!(fit.decimated(&mut [], 0.15).is_none(), "nothing to put together");
    // A fit with what goes by single rows is another one by longer ones.
    let mut by_rows: Vec<Box<dyn ModelTerm>> = vec![Box::new(OfRows)];
    fit.solution.model.term_values = vec![0.01];
    fit.solution.pass = fit.scan(&mut by_rows);
    assert!(fit.decimated(&mut by_rows, 0.5).is_none());
}

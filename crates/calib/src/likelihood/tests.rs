//! The pass against what it differentiates.

use dataset::{
    Dataset, Interval, Look, ModelTerm, NominalRobot, Odometry, Provenance, Run, RunInfo, TermParameter, TruthNoise,
    TruthSample, WheelLog,
};
use kinematics::{Increment, Pose, Wheels};

use super::filter::Want;
use super::pass::pass;
use super::{Column, Model, Noise, Pass, Records, Selection, Thinning};

const LEFT_RAD: [f64; 12] = [2.0, 2.0, -1.0, 0.0, 3.0, 1.5, 2.0, -2.0, -3.0, 1.0, 2.0, 2.5];
const RIGHT_RAD: [f64; 12] = [2.0, 2.5, 1.0, 0.0, 2.0, 1.5, -2.0, 2.0, -3.0, 2.0, 1.0, 2.5];

/// Two runs of a dozen rows, seen every two seconds a few millimetres off; headings only where asked for.
fn dataset(with_headings: bool) -> Dataset {
    let run = |number: u32| {
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        let mut pose = Pose::new(0.2, -0.1, 0.5 + f64::from(number));
        let mut truth = Vec::new();
        for row in 0..=12_u32 {
            if row % 2 == 0 {
                let off = |k: f64| 3e-3 * (12.9898 * f64::from(7 * row + number) + 78.233 * k).sin();
                let theta = with_headings.then_some(pose.theta_rad + MOUNTED.theta_rad + off(3.0));
                let seen = if with_headings { pose * MOUNTED } else { pose };
                truth.push(TruthSample::new(f64::from(row), seen.x_m + off(1.0), seen.y_m + off(2.0), theta));
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
        runs: vec![run(0), run(1)],
    }
}

/// Adds way in proportion to the square of the travel, and looks ahead in proportion to the speed.
struct Term;

impl ModelTerm for Term {
    fn parameters(&self) -> &'static [TermParameter] {
        const WAY: TermParameter = TermParameter { name: "way_per_m", unit: "1/m", plausible: 1.0 };
        const LOOK: TermParameter = TermParameter { name: "ahead_s", unit: "s", plausible: 1.0 };
        &[WAY, LOOK]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let travel_m = interval.travel_m;
        gradient[0] = interval.change(travel_m.map(|travel_m| travel_m * travel_m));
        gradient[0].y_m = 0.1 * travel_m.left;
    }

    fn sight(&mut self, look: &Look<'_>, gradient: &mut [Pose]) {
        gradient[1] = Pose::new(look.twist.v_m_s, 0.1, 0.3);
    }
}

const MOUNTED: Pose = Pose::new(0.03, -0.02, 0.1);

/// About a standard deviation from what was driven.
const MODEL: Model = Model {
    m_per_rad: Wheels { left: 0.0812, right: 0.0796 },
    separation_m: 0.3665,
    body_from_sensor: Pose::new(0.032, -0.019, 0.103),
    own: None,
    latency_s: 0.003,
    sizes: Vec::new(),
};

fn model() -> Model {
    Model { sizes: vec![0.004, -0.003], ..MODEL }
}

const NOISE: Noise = Noise { variance: [1e-6, 4e-6, 9e-6, 2.5e-5] };

fn run(dataset: &Dataset, model: &Model, noise: &Noise, headings: &[f64], want: Want) -> Pass {
    let model =
        &Model { sizes: if model.sizes.is_empty() { vec![0.0; 2] } else { model.sizes.clone() }, ..model.clone() };
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    pass(&records, &selections, model, noise, headings, &mut [Box::new(Term)], want)
}

fn cost(pass: &Pass) -> f64 {
    pass.runs.iter().map(super::Evidence::cost).sum()
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
    let found = run(&dataset, &model(), &NOISE, &headings, Want { gate: super::filter::Gate::Open, ..Want::default() });
    let gradient = found.runs.iter().fold(nalgebra::DVector::zeros(9), |sum, run| sum + &run.gradient);
    let information = found.runs.iter().fold(nalgebra::DMatrix::zeros(9, 9), |sum, run| sum + &run.information);
    for column in columns() {
        let k = column.index();
        let h = 1e-3 / f64::sqrt(information[(k, k)]);
        let at = |by: f64| {
            let mut model = model();
            model.advance(column, by);
            cost(&run(&dataset, &model, &NOISE, &headings, Want { gate: super::filter::Gate::Open, ..Want::default() }))
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
    let want = Want { gate: super::filter::Gate::Open, noise_score: true, ..Want::default() };
    let score = run(&dataset, &model(), &NOISE, &[0.0, 0.0], want).noise.gradient;
    for k in 0..4 {
        let h = 1e-4_f64;
        let at = |by: f64| {
            let mut noise = NOISE;
            noise.variance[k] *= by.exp();
            cost(&run(&dataset, &model(), &noise, &[0.0, 0.0], want))
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
    let want = Want { gate: super::filter::Gate::Open, ..Want::default() };
    let mut headings = [0.6, 1.6];
    for _ in 0..8 {
        let found = run(&dataset, &MODEL_SEEN_AT_THE_CENTRE, &NOISE, &headings, want);
        for super::pass::FreeHeading { chain, rest, .. } in &found.headings {
            headings[*chain] += rest;
        }
    }
    let at_best = run(&dataset, &MODEL_SEEN_AT_THE_CENTRE, &NOISE, &headings, want);
    assert!(at_best.headings.iter().all(|heading| heading.rest.abs() < 1e-9), "{:?}", at_best.headings);
    // Runs start at 0.5 and 1.5 rad; looks of 3 mm over half a metre see a heading to 0.01 rad.
    assert!((headings[0] - 0.5).abs() < 0.03 && (headings[1] - 1.5).abs() < 0.03, "{headings:?}");
    let off = run(&dataset, &MODEL_SEEN_AT_THE_CENTRE, &NOISE, &[headings[0] + 0.01, headings[1]], want);
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
    sizes: Vec::new(),
};

#[test]
fn thinned_looks_are_far_enough_apart_and_end_with_the_last() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 4.0, phases: 2 }, &MODEL);
    let looks = |phase: usize| -> Vec<usize> { selections[phase].legs[0].iter().map(|leg| leg.look).collect() };
    // Looks every 2 s up to 12 s: at 4, 8, 12 s, and from 6 s on.
    assert_eq!(looks(0), [2, 4, 6]);
    assert_eq!(looks(1), [3, 6]);
    let first = &selections[1].legs[0][0];
    assert_eq!((first.pieces.clone(), first.from), (0..6, 0));
}

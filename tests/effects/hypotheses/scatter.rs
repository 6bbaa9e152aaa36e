//! What only scatters: the signs that an effect says it leaves in a fit are there, and not in a faultless
//! record.
//!
//! The signs are measured on what was seen less what the counts predict from measurement to measurement, over
//! some runs; each measure is a pure number that is small without the effect.

use dataset::Dataset;
use effects::{CATALOGUE, Effect, Sign};
use kinematics::{Pose, Rule};

use super::watched::{drive, perfect};

/// From one measurement to the next: what was missed of the motion, and the motion by the counts.
struct Missed {
    missed: Pose,
    counted: Pose,
}

fn look_by_look(dataset: &Dataset) -> Vec<Vec<Missed>> {
    let geometry = dataset.robot.geometry().expect("valid");
    let of_run = |view: &dataset::RunView<'_>| {
        let mut reckoned = Vec::new();
        view.dead_reckon(&dataset.robot, &geometry, Rule::ExactArc, Pose::IDENTITY, |t_s, pose| {
            reckoned.push((t_s, pose));
        });
        // Measurements and rows are made at the same instants; a standstill has a row of its own.
        let seen = view.observed_poses();
        let pairs: Vec<(Pose, Pose)> = seen
            .iter()
            .filter_map(|(t_s, pose)| {
                let (_, counted) = reckoned.iter().find(|(row_s, _)| (row_s - t_s).abs() < 1e-6)?;
                Some((*pose, *counted))
            })
            .collect();
        let step = |pair: &[(Pose, Pose)]| {
            let (saw, counted) = (pair[0].0.to(pair[1].0), pair[0].1.to(pair[1].1));
            let missed = Pose::new(saw.x_m - counted.x_m, saw.y_m - counted.y_m, saw.theta_rad - counted.theta_rad);
            Missed { missed, counted }
        };
        pairs.windows(2).map(step).collect()
    };
    dataset.session().runs.iter().map(of_run).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    sum / n
}

/// Below this, metres or radians, a step is the whole counts' rounding.
const ROUNDING: f64 = 1e-4;

/// How much of a sign there is, 0 for none. Each is 0 where nothing beyond rounding was missed.
fn measure(sign: Sign, runs: &[Vec<Missed>]) -> f64 {
    let steps = || runs.iter().flatten();
    let size = |of: fn(&Pose) -> f64| mean(steps().map(|step| of(&step.missed).powi(2))).sqrt();
    // How much rarer and larger than normal: kurtosis over 3, less 1.
    let tails = |of: fn(&Pose) -> f64| {
        let second = mean(steps().map(|step| of(&step.missed).powi(2)));
        if second.sqrt() < ROUNDING {
            0.0
        } else {
            mean(steps().map(|step| of(&step.missed).powi(4))) / second.powi(2) / 3.0 - 1.0
        }
    };
    // Correlation of a step with the next: −½ where a measurement's error is undone, 0 where a jump stays.
    let undone = |of: fn(&Pose) -> f64| {
        let second = mean(steps().map(|step| of(&step.missed).powi(2)));
        let product =
            mean(runs.iter().flat_map(|run| run.windows(2)).map(|pair| of(&pair[0].missed) * of(&pair[1].missed)));
        if second.sqrt() < ROUNDING { 0.0 } else { -product / second }
    };
    let heading = |pose: &Pose| pose.theta_rad;
    let way = |pose: &Pose| pose.x_m;
    match sign {
        Sign::IsolatedErrors => undone(way) * tails(way).signum().max(0.0),
        Sign::HeadingJumps => tails(heading) * (0.25 - undone(heading)).max(0.0),
        Sign::DistanceJumps => tails(way) * (0.25 - undone(way)).max(0.0),
        // White measurements would undo half of each step in the next.
        Sign::AutocorrelatedErrors => {
            if size(way) < ROUNDING {
                0.0
            } else {
                0.5 - undone(way)
            }
        }
        Sign::ScatterWithTurn | Sign::ScatterWithSpeed | Sign::TailsAtLowSpeed => {
            let amount = |step: &Missed| match sign {
                Sign::ScatterWithTurn => step.counted.theta_rad.abs(),
                Sign::ScatterWithSpeed => step.counted.x_m.abs(),
                _ => f64::from(u8::from(step.counted.x_m.abs() < 1e-3)),
            };
            let off = |step: &Missed| {
                if sign == Sign::TailsAtLowSpeed { step.missed.x_m.abs() } else { step.missed.theta_rad.abs() }
            };
            let (a, b) = (mean(steps().map(amount)), mean(steps().map(off)));
            let covariance = mean(steps().map(|step| (amount(step) - a) * (off(step) - b)));
            let spread = mean(steps().map(|step| (amount(step) - a).powi(2)))
                * mean(steps().map(|step| (off(step) - b).powi(2)));
            if b < 0.1 * ROUNDING { 0.0 } else { covariance / spread.sqrt() }
        }
    }
}

/// Sizes at the upper end of what is usual.
fn specimen(id: &str) -> Effect {
    let values: &[(&str, f64)] = match id {
        "contact_patch_wheelbase" => &[("sigma_m", 4e-3)],
        "traction_loss" => &[("static_friction", 0.048), ("kinetic_friction", 0.03), ("stribeck_speed_m_s", 0.05)],
        "stick_slip" => &[("stick_speed_m_s", 0.05), ("breakaway_m", 1e-3)],
        "bumps" => &[("per_m", 1.0), ("height_m", 5e-3)],
        "truth_correlated_noise" => &[("sigma_xy_m", 0.01), ("sigma_theta_rad", 0.01), ("tau_s", 1.0)],
        "truth_outliers" => &[("probability", 0.02), ("jump_m", 0.05), ("jump_rad", 0.1)],
        other => panic!("no specimen of {other}"),
    };
    effects::effect_from_estimates(id, values).expect("an effect")
}

/// Correlations of some thousand measurements have a standard error of 0.02; kurtosis has no upper bound.
const SHOWS: f64 = 0.25;

const SIGNS: [Sign; 7] = [
    Sign::IsolatedErrors,
    Sign::HeadingJumps,
    Sign::DistanceJumps,
    Sign::AutocorrelatedErrors,
    Sign::ScatterWithTurn,
    Sign::ScatterWithSpeed,
    Sign::TailsAtLowSpeed,
];

/// A slide lasts over several measurements and comes at some speeds only, so that it has something of other
/// signs too.
const SLIDES: [&str; 2] = ["traction_loss", "stick_slip"];

#[test]
fn a_scatter_leaves_the_signs_that_it_says_and_no_other_and_a_faultless_record_none() {
    let faultless = look_by_look(&drive(&perfect(), 6));
    for sign in SIGNS {
        let without = measure(sign, &faultless);
        assert!(without < 0.5 * SHOWS, "{sign:?} of a faultless record is {without}");
    }
    for id in CATALOGUE {
        let signs = effects::hypothesis(id).map_or(&[][..], |hypothesis| hypothesis.signs());
        if signs.is_empty() {
            continue;
        }
        let mut scenario = perfect();
        scenario.effects = vec![specimen(id)];
        let runs = look_by_look(&drive(&scenario, 6));
        for sign in SIGNS {
            let shown = measure(sign, &runs);
            if signs.contains(&sign) {
                assert!(shown > SHOWS, "{id}: {sign:?} is {shown}");
            } else if !SLIDES.contains(id) {
                assert!(shown < 0.5 * SHOWS, "{id} says nothing of {sign:?}, which is {shown}");
            }
        }
    }
}

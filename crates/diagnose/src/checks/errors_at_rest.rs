//! What the instrument's errors are while the robot stands.
//!
//! Autocorrelated errors show in the residuals of a robot that drives, whoever makes them: the instrument, or
//! wheels that err for a while at a time, as on another floor. While the wheels stand, the instrument errs
//! alone. Its poses then are compared with white errors and with such as have that lag-one coefficient: a
//! share of them decays exponentially, the rest is white, and the slower the decay the smaller the share. A
//! standstill that is short against the decay shows little of it: then nobody can tell. The likelihood is
//! that of normal errors about an unknown pose of each standstill, with their variance profiled out.
//! Reference: Patterson & Thompson 1971 (the likelihood of what the means leave).

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::ops::Range;

use dataset::{Dataset, RunView, TruthSample};
use estimation::WheelAngleInterpolator;
use kinematics::wrap_to_pi;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::records::pose_windows::turns_at;
use crate::settings::RESIDUALS;

/// Errors of an instrument while the robot stands, beside residuals of its drives that are autocorrelated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ErrorsAtRest {
    /// As autocorrelated as the residuals, or nothing says otherwise.
    Autocorrelated,
    /// White within standstills, which are too short for slow errors to show.
    WhiteOrSlow,
    /// White: what is autocorrelated is the robot's, or goes with the place.
    White,
}

/// What the instrument's errors are while the robot stands, where the residuals of its drives have this
/// lag-one coefficient.
pub(crate) fn errors_at_rest(datasets: &[Dataset], coefficient: f64) -> ErrorsAtRest {
    let mut standstills: [Vec<Vec<f64>>; 3] = Default::default();
    for dataset in datasets {
        for run in &dataset.session().runs {
            let Some(track) = WheelAngleInterpolator::of(run, &dataset.robot) else { continue };
            for poses in standstills_of(run, &track) {
                let truth = &run.run().truth[poses];
                standstills[0].push(truth.iter().map(|sample| sample.x_m).collect());
                standstills[1].push(truth.iter().map(|sample| sample.y_m).collect());
                let headings: Option<Vec<f64>> = truth.iter().map(TruthSample::theta_rad).collect();
                let from = |headings: Vec<f64>| headings.iter().map(|rad| wrap_to_pi(rad - headings[0])).collect();
                standstills[2].extend(headings.map(from));
            }
        }
    }
    let known = standstills.iter().filter(|of| of.iter().map(Vec::len).sum::<usize>() >= RESIDUALS.min_poses_at_rest);
    // Sums over the components; 0 where nothing is known.
    let [over_fast, over_any] = known
        .filter_map(|of| log_odds_of_white(of, coefficient))
        .fold([0.0; 2], |[fast, any], of| [fast + of[0], any + of[1]]);
    if over_any > RESIDUALS.white_at_rest_log_odds {
        ErrorsAtRest::White
    } else if over_fast > RESIDUALS.white_at_rest_log_odds {
        ErrorsAtRest::WhiteOrSlow
    } else {
        ErrorsAtRest::Autocorrelated
    }
}

/// Log odds for white errors over such of this lag-one coefficient: over errors that decay as fast as that
/// says at least, and over the likeliest. `None` where there are no errors.
fn log_odds_of_white(standstills: &[Vec<f64>], coefficient: f64) -> Option<[f64; 2]> {
    let white = cost(standstills, Decay { share: 0.0, by: 0.0 })?;
    // From all of them decaying at once to a share that hardly decays.
    let decays = (0..RESIDUALS.decays_at_rest).map(|halved| coefficient.powf(0.5_f64.powi(halved)));
    let mut over = decays.filter_map(|by| Some(cost(standstills, Decay { share: coefficient / by, by })? - white));
    let over_fast = over.next()?;
    Some([over_fast, over.fold(over_fast, f64::min)])
}

/// The poses of a run between which no wheel turned, far from where one did.
fn standstills_of(run: &RunView<'_>, track: &WheelAngleInterpolator<'_>) -> Vec<Range<usize>> {
    let (rows_s, truth) = (&run.odometry().t_s, &run.run().truth);
    let stands = |from_s: f64, to_s: f64| {
        let covered = rows_s.first().is_some_and(|first_s| *first_s <= from_s + RESIDUALS.rest_margin_s)
            && rows_s.last().is_some_and(|last_s| *last_s >= to_s - RESIDUALS.rest_margin_s);
        covered && turns_at(rows_s, track.turns(), from_s) == turns_at(rows_s, track.turns(), to_s)
    };
    let mut found: Vec<Range<usize>> = Vec::new();
    for pose in 1..truth.len() {
        let [from_s, to_s] = [truth[pose - 1].t_s - RESIDUALS.rest_margin_s, truth[pose].t_s + RESIDUALS.rest_margin_s];
        if !stands(from_s, to_s) {
            continue;
        }
        match found.last_mut() {
            Some(last) if last.end == pose => last.end = pose + 1,
            _ => found.push(pose - 1..pose + 1),
        }
    }
    found.retain(|poses| poses.len() > 2);
    found
}

/// Errors of which a share decays by a factor from one to the next; the rest is white.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Decay {
    share: f64,
    by: f64,
}

impl Decay {
    /// Correlation of so many errors.
    fn of_successive(self, number: usize) -> Option<Cholesky<f64, Dyn>> {
        let own = |i: usize, j: usize| if i == j { 1.0 - self.share } else { 0.0 };
        let of = |i: usize, j: usize| own(i, j) + self.share * self.by.powf(i.abs_diff(j) as f64);
        DMatrix::from_fn(number, number, of).cholesky()
    }
}

/// Negative log likelihood of errors about a mean of each standstill; `None` where there are none. Long
/// standstills are several.
fn cost(standstills: &[Vec<f64>], decay: Decay) -> Option<f64> {
    let mut correlations: BTreeMap<usize, Cholesky<f64, Dyn>> = BTreeMap::new();
    let (mut squares, mut freedom, mut logs) = (0.0, 0.0, 0.0);
    for values in standstills.iter().flat_map(|values| values.chunks(RESIDUALS.max_poses_of_standstill)) {
        let number = values.len();
        if number < 2 {
            continue;
        }
        if let Entry::Vacant(entry) = correlations.entry(number) {
            entry.insert(decay.of_successive(number)?);
        }
        let correlation = &correlations[&number];
        let ones = correlation.solve(&DVector::repeat(number, 1.0));
        let from_first = DVector::from_fn(number, |at, _| values[at] - values[0]);
        let (information, mean) = (ones.sum(), ones.dot(&from_first) / ones.sum());
        let off = from_first.add_scalar(-mean);
        squares += off.dot(&correlation.solve(&off));
        freedom += (number - 1) as f64;
        logs += 0.5 * (correlation.ln_determinant() + information.ln());
    }
    (squares > 0.0).then(|| 0.5 * freedom * (squares / freedom).ln() + logs)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standstills of so many poses with errors of a lag-one coefficient about places of their own, beside
    /// white ones of this standard deviation.
    fn standstills(coefficient: f64, white: f64, poses: usize) -> Vec<Vec<f64>> {
        let mut state = 12_345_u64;
        let mut normal = || {
            let mut sum = 0.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum - 6.0
        };
        (0..240 / poses)
            .map(|place| {
                let mut error = normal();
                let mut next = || {
                    let now = error + white * normal();
                    error = coefficient * error + (1.0 - coefficient * coefficient).sqrt() * normal();
                    10.0 * place as f64 + now
                };
                (0..poses).map(|_| next()).collect()
            })
            .collect()
    }

    #[test]
    fn autocorrelated_errors_are_likelier_with_their_coefficient_and_white_ones_without() {
        let odds = |of: [f64; 2], poses: usize, tried: f64| {
            log_odds_of_white(&standstills(of[0], of[1], poses), tried).expect("errors")
        };
        let white = odds([0.0, 1.0], 60, 0.5);
        assert!(white[0] > 10.0 && white[1] > 0.0, "{white:?}");
        assert!(odds([0.5, 0.0], 60, 0.5)[1] < -5.0, "{:?}", odds([0.5, 0.0], 60, 0.5));
        // A coefficient of residuals is less than that of the errors, which a fit follows in part.
        assert!(odds([0.8, 0.0], 60, 0.3)[1] < -5.0, "{:?}", odds([0.8, 0.0], 60, 0.3));
        // White errors beside slow ones, of which a short standstill has a constant: nobody can tell.
        let short = odds([0.995, 1.0], 6, 0.5);
        assert!(short[0] > 3.0 && short[1] < 3.0, "{short:?}");
        let white = odds([0.0, 1.0], 6, 0.5);
        assert!(white[0] > 3.0 && white[1] < 3.0, "{white:?}");
        // Places that are told exactly say nothing of errors.
        assert_eq!(log_odds_of_white(&[vec![1.0; 4], vec![2.0; 4]], 0.3), None);
    }
}

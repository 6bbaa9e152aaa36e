//! What the instrument's errors are while the robot stands.
//!
//! Errors that last show in the residuals of a robot that drives, whoever makes them: the instrument, or
//! wheels that err for a while at a time, as on another floor. While the wheels stand, the instrument errs
//! alone. Its poses then are compared with errors of that lag-one coefficient and with white ones, about an
//! unknown pose of each standstill, by the likelihood of a first-order autoregression with its variance
//! profiled out.
//! Reference: Prais & Winsten 1954 (the whitened differences); Box & Jenkins 1970.

use std::ops::Range;

use dataset::{Dataset, RunView, TruthSample};
use estimation::WheelAngleInterpolator;
use kinematics::wrap_to_pi;

use crate::clock_profile::turns_at;
use crate::settings::residuals::{MIN_POSES_AT_REST, REST_MARGIN_S, WHITE_AT_REST_LOG_ODDS};

/// Whether the instrument's errors are white while the robot stands, and not of this lag-one coefficient, as
/// the residuals of its drives are. `None` where it hardly stands, or the instrument says the same pose again
/// and again then.
pub(crate) fn are_white_at_rest(datasets: &[Dataset], coefficient: f64) -> Option<bool> {
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
    let known = standstills.iter().filter(|of| of.iter().map(Vec::len).sum::<usize>() >= MIN_POSES_AT_REST);
    let log_odds: Vec<f64> = known.filter_map(|of| Some(cost(of, coefficient)? - cost(of, 0.0)?)).collect();
    (!log_odds.is_empty()).then(|| log_odds.iter().sum::<f64>() > WHITE_AT_REST_LOG_ODDS)
}

/// The poses of a run between which no wheel turned, far from where one did.
fn standstills_of(run: &RunView<'_>, track: &WheelAngleInterpolator<'_>) -> Vec<Range<usize>> {
    let (rows_s, truth) = (&run.odometry().t_s, &run.run().truth);
    let stands = |from_s: f64, to_s: f64| {
        let covered = rows_s.first().is_some_and(|first_s| *first_s <= from_s + REST_MARGIN_S)
            && rows_s.last().is_some_and(|last_s| *last_s >= to_s - REST_MARGIN_S);
        covered && turns_at(rows_s, track.turns(), from_s) == turns_at(rows_s, track.turns(), to_s)
    };
    let mut found: Vec<Range<usize>> = Vec::new();
    for pose in 1..truth.len() {
        let [from_s, to_s] = [truth[pose - 1].t_s - REST_MARGIN_S, truth[pose].t_s + REST_MARGIN_S];
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

/// Negative log likelihood of errors of this lag-one coefficient about a mean of each standstill; `None`
/// where there are none.
fn cost(standstills: &[Vec<f64>], coefficient: f64) -> Option<f64> {
    let keeps = (1.0 - coefficient * coefficient).sqrt();
    let (mut squares, mut freedom, mut logs) = (0.0, 0.0, 0.0);
    for values in standstills {
        // In units of the innovations: the first is as far off as all before it made it.
        let own = |at: usize| if at == 0 { keeps * values[0] } else { values[at] - coefficient * values[at - 1] };
        let of_mean = |at: usize| if at == 0 { keeps } else { 1.0 - coefficient };
        let information: f64 = (0..values.len()).map(|at| of_mean(at).powi(2)).sum();
        let mean = (0..values.len()).map(|at| of_mean(at) * own(at)).sum::<f64>() / information;
        squares += (0..values.len()).map(|at| (own(at) - mean * of_mean(at)).powi(2)).sum::<f64>();
        freedom += (values.len() - 1) as f64;
        // The density of the first, and of what says nothing of the mean.
        logs += keeps.ln() - 0.5 * information.ln();
    }
    (squares > 0.0).then(|| 0.5 * freedom * (squares / freedom).ln() - logs)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standstills of six poses with errors of a lag-one coefficient about places of their own.
    fn standstills(coefficient: f64, number: usize) -> Vec<Vec<f64>> {
        let mut state = 12_345_u64;
        let mut normal = || {
            let mut sum = 0.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum - 6.0
        };
        (0..number)
            .map(|place| {
                let mut error = normal();
                let mut next = || {
                    let now = error;
                    error = coefficient * error + (1.0 - coefficient * coefficient).sqrt() * normal();
                    10.0 * place as f64 + now
                };
                (0..6).map(|_| next()).collect()
            })
            .collect()
    }

    #[test]
    fn errors_that_last_are_likelier_with_their_coefficient_and_white_ones_without() {
        let odds = |of: f64, tried: f64| {
            let all = standstills(of, 40);
            cost(&all, tried).expect("errors") - cost(&all, 0.0).expect("errors")
        };
        assert!(odds(0.0, 0.5) > 10.0, "{}", odds(0.0, 0.5));
        assert!(odds(0.5, 0.5) < -5.0, "{}", odds(0.5, 0.5));
        // A coefficient of residuals is less than that of the errors, which a fit follows in part.
        assert!(odds(0.8, 0.3) < -5.0, "{}", odds(0.8, 0.3));
        // Places that are told exactly say nothing of errors.
        assert_eq!(cost(&[vec![1.0; 4], vec![2.0; 4]], 0.3), None);
    }
}

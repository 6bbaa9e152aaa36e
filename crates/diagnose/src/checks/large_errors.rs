//! Large errors: measurements whose innovation is of the tail, with how the robot moved before them.

use estimation::{InnovationComponent, ModelFit, Segment};
use kinematics::Wheels;

use crate::settings::RESIDUALS;

/// A measurement with a large innovation.
#[derive(Debug, Clone)]
pub(crate) struct LargeError {
    pub(crate) run: (usize, usize),
    pub(crate) run_id: String,
    /// Time of the measurement before, and of this one, seconds from the run's start.
    pub(crate) from_s: f64,
    pub(crate) at_s: f64,
    /// Travel of each wheel between them.
    pub(crate) travel_m: Wheels<f64>,
    pub(crate) is_displacement: bool,
    /// Distance between them over its mean over all measurements.
    pub(crate) relative_distance: f64,
    /// Odds of an error of wheels that stick or slide here over those at a measurement on average: large at
    /// starts and stops.
    pub(crate) ramp_odds: f64,
    /// The largest innovation of its components, in standard deviations.
    pub(crate) z: f64,
}

/// The large errors, by the innovations of all measurements. Large innovations with few measurements
/// between them are one error.
pub(crate) fn large_errors(fit: &ModelFit<'_>, innovations: &[Vec<InnovationComponent>]) -> Vec<LargeError> {
    let Some(phase) = innovations.first() else { return Vec::new() };
    let segments = &fit.records.segments;
    let since: Vec<Vec<(f64, Wheels<f64>)>> = segments.iter().map(Segment::since_previous_measurement).collect();
    let at_ramp: Vec<Vec<bool>> = segments.iter().map(Segment::changes_of_speed).collect();
    let m_per_rad = fit.solution.model.m_per_rad;
    // Each measurement as an error from the measurement before that is taken; its segment, and whether it
    // is at a ramp.
    let mut measurements: Vec<(LargeError, (usize, bool))> = Vec::new();
    let mut before = None;
    for of_measurement in phase.chunk_by(|a, b| (a.segment, a.measurement) == (b.segment, b.measurement)) {
        let (segment, measurement) = (of_measurement[0].segment, of_measurement[0].measurement);
        let of_segment = &segments[segment];
        let first = match before {
            Some((last, taken)) if last == segment => taken + 1,
            _ if of_segment.is_displacement() => 0,
            // The segment starts at a measurement.
            _ => 1.min(measurement),
        };
        before = Some((segment, measurement));
        let turned = since[segment][first..=measurement]
            .iter()
            .fold(Wheels::both(0.0), |sum, (_, turned)| sum.zip_with(*turned, |a, b| a + b));
        let travel_m = m_per_rad.zip_with(turned, |m_per_rad, rad| m_per_rad * rad);
        let distances = since[segment][first..=measurement]
            .iter()
            .map(|(_, turned)| m_per_rad.zip_with(*turned, |a, b| (a * b).abs()));
        let distance_m = distances.map(|travel_m| 0.5 * (travel_m.left + travel_m.right)).sum();
        let own = LargeError {
            run: of_segment.run,
            run_id: of_segment.info.id.clone(),
            from_s: since[segment][first].0,
            at_s: fit.records.measurement_s(segment, measurement).unwrap_or(0.0),
            travel_m,
            is_displacement: of_segment.is_displacement(),
            relative_distance: distance_m,
            ramp_odds: 0.0,
            z: of_measurement.iter().map(|innovation| innovation.z.abs()).fold(0.0, f64::max),
        };
        measurements.push((own, (segment, at_ramp[segment][first..=measurement].contains(&true))));
    }
    let count = measurements.len() as f64;
    let mean_m = measurements.iter().map(|(measurement, _)| measurement.relative_distance).sum::<f64>() / count;
    let share = measurements.iter().filter(|(_, (_, ramp))| *ramp).count() as f64 / count;
    let mut found = Vec::new();
    let mut last: Option<(usize, usize)> = None;
    for (number, (measurement, (segment, ramp))) in measurements.into_iter().enumerate() {
        if measurement.z <= RESIDUALS.large_innovation_sigmas {
            continue;
        }
        let is_same_error = last
            .is_some_and(|(at, of)| number - at <= RESIDUALS.max_error_gap && fit.records.are_in_series(of, segment));
        last = Some((number, segment));
        if is_same_error {
            continue;
        }
        let mostly = RESIDUALS.ramp_error_fraction.max(share);
        let ramp_odds = if ramp { mostly / share } else { (1.0 - mostly) / (1.0 - share) };
        let relative_distance = if mean_m > 0.0 { measurement.relative_distance / mean_m } else { 0.0 };
        found.push(LargeError { relative_distance, ramp_odds, ..measurement });
    }
    found
}

/// Mean speed of the robot where it erred, m/s; 1 where it stood.
pub(crate) fn mean_speed_m_s(large: &[LargeError]) -> f64 {
    let distance_m: f64 =
        large.iter().map(|large| 0.5 * (large.travel_m.left.abs() + large.travel_m.right.abs())).sum();
    let time_s: f64 = large.iter().map(|large| large.at_s - large.from_s).sum();
    if time_s > 0.0 && distance_m > 0.0 { distance_m / time_s } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidates::candidate::terms;
    use crate::checks::outlier_attribution::tests::driven;
    use crate::small_robot::{assert_unmoved, fitted};

    fn large(travel_m: [f64; 2], [from_s, at_s]: [f64; 2]) -> LargeError {
        LargeError {
            run: (0, 0),
            run_id: String::new(),
            from_s,
            at_s,
            travel_m: Wheels { left: travel_m[0], right: travel_m[1] },
            is_displacement: false,
            relative_distance: 1.0,
            ramp_odds: 1.0,
            z: 4.0,
        }
    }

    #[test]
    fn speed_where_the_robot_erred_is_that_of_both_wheels_whichever_way() {
        // (0.2 + 0.4)/2 and (0.1 + 0.3)/2 metres in two seconds and half of one.
        let all = [large([0.2, -0.4], [1.0, 3.0]), large([-0.1, 0.3], [5.0, 5.5])];
        assert!((mean_speed_m_s(&all) - 0.5 / 2.5).abs() < 1e-12, "{}", mean_speed_m_s(&all));
        assert_eq!((mean_speed_m_s(&[]), mean_speed_m_s(&[large([0.0, 0.0], [1.0, 3.0])])), (1.0, 1.0));
        assert_eq!(mean_speed_m_s(&[large([0.1, 0.1], [1.0, 1.0])]), 1.0);
    }

    #[test]
    fn regress_no_number_of_a_large_error_moves() {
        let mut text = String::new();
        for (cause, are_displacements) in [("bumps", false), ("truth_outliers", true), ("stick_slip", false)] {
            let datasets = [driven(cause, are_displacements)];
            let fit = fitted(&datasets).evaluated_ungated();
            let found = large_errors(&fit, &fit.scan(&mut terms(&[])).innovations);
            text += &format!("{cause}: {} {:#?}\n", mean_speed_m_s(&found), &found[..found.len().min(4)]);
        }
        assert_unmoved("large_errors.txt", &text);
    }
}

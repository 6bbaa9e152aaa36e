//! The same runs once more, as the fitted model would have them: the path smoothed, its counts rounded anew
//! with random phases, its measurements made by the model with noise of the fitted sizes.
//!
//! Where encoders are coarse, errors of rounding are neither normal nor independent: on a straight whose rows
//! have whole numbers of counts, the error stays. No formula says what whiteness, kurtosis or a score are
//! then; their values on such runs do (parametric bootstrap; Efron & Tibshirani 1993, chapter 6).

use std::sync::Arc;

use kinematics::{Increment, Pose, Side, Wheels};
use model_term::ModelTerm;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::model::Instrument;
use crate::model_fit::ModelFit;
use crate::optimizer::Solution;
use crate::pass::Pass;
use crate::propagation::{CarriedState, Propagator};
use crate::quantum::variance_of_rounding;
use crate::rate_noise::RateNoise;
use crate::recorded_rates::RecordedRate;
use crate::rounding::PoseVariance;
use crate::segment::{MeasuredPose, Segment, Start};
use crate::settings::COMMON;
use crate::wheel_angles::WheelInterval;

impl ModelFit<'_> {
    /// Has the rounding of counts or rates, or what displacements share, a part in what measurements are off
    /// by, so that the distributions of tests depend on it?
    #[must_use]
    pub fn depends_on_rounding(&self) -> bool {
        let [_, _, position_m2, heading_rad2] = self.solution.noise.variance;
        self.records.segments.iter().any(|segment| {
            // A displacement has the error within a row where the one before ended, too.
            let shared = segment.intervals.first().filter(|_| segment.continues);
            let shared_rad2 = shared.map_or(Wheels::both(0.0), |first| first.interpolated_rad2[0]);
            let at_ends_rad2 =
                segment.quantum_rad.zip_with(shared_rad2, |rad, shared| variance_of_rounding(rad) + shared);
            let at_ends = PoseVariance::of(at_ends_rad2, &self.solution.model);
            let [along_m2, turn_rad2] = segment.variance_of_rates(&self.solution.model);
            at_ends.along_m2 + along_m2 > COMMON.min_resimulated_variance_ratio * position_m2
                || at_ends.heading_rad2 + turn_rad2 > COMMON.min_resimulated_variance_ratio * heading_rad2
        })
    }

    /// Are rates rounded by more than the instrument errs by, where they stand? What is left of the
    /// measurements says nothing of the instrument's errors then.
    #[must_use]
    pub fn rates_are_coarser_than_measurements(&self) -> bool {
        let [_, _, position_m2, heading_rad2] = self.solution.noise.variance;
        self.records.segments.iter().any(|segment| {
            let [along_m2, turn_rad2] = segment.variance_of_rates(&self.solution.model);
            along_m2 > position_m2 || turn_rad2 > heading_rad2
        })
    }

    /// Share of the variance of what a measurement is off by that nobody recorded of the motion within the
    /// rows that it falls into: of its position or its heading, whichever is more.
    #[must_use]
    pub fn within_row_share(&self, segment: usize, measurement: usize) -> f64 {
        let of_segment = &self.records.segments[segment];
        let Some(measured) = of_segment.measurements.get(measurement) else { return 0.0 };
        let starts = of_segment.intervals.first().filter(|_| of_segment.is_displacement());
        let ends = measured.after.checked_sub(1).and_then(|last| of_segment.intervals.get(last));
        let at_start = starts.map_or(Wheels::both(0.0), |first| first.interpolated_rad2[0]);
        let at_end = ends.map_or(Wheels::both(0.0), |last| last.interpolated_rad2[1]);
        let within_row = PoseVariance::of(at_start.zip_with(at_end, |start, end| start + end), &self.solution.model);
        let [_, _, position_m2, heading_rad2] = self.solution.noise.variance;
        let share = |own: f64, other: f64| if own > 0.0 { own / (own + other) } else { 0.0 };
        share(within_row.along_m2, position_m2).max(share(within_row.heading_rad2, heading_rad2))
    }

    /// The runs once more, by the values found, with the pass at them. `number` addresses the draws; `terms`
    /// are those of the fit.
    #[must_use]
    pub fn resimulated(&self, terms: &mut [Box<dyn ModelTerm>], number: u64) -> Self {
        let mut again = self.resimulated_without_pass(terms, number);
        again.solution.pass = again.scan(terms);
        again
    }

    /// The same without a pass, for scans of candidates: no run has a normal equation.
    #[must_use]
    pub fn resimulated_without_pass(&self, terms: &mut [Box<dyn ModelTerm>], number: u64) -> Self {
        let mut records = self.records.copied();
        // What was measured beside the poses is of the motion that was driven, not of the one that is drawn.
        records.partial.iter_mut().filter(|of| of.has_poses()).for_each(|of| of.observations.clear());
        let mut carried: Option<(CarriedState, SharedErrors)> = None;
        for (index, segment) in records.segments.iter_mut().enumerate() {
            let mut draws = Draws::of(number, index);
            let smooth = smooth_turns(segment, &mut draws);
            let (before, mut shared) = match carried.take().filter(|_| segment.continues) {
                Some((before, shared)) => (Some(before), shared),
                None => (None, SharedErrors::drawn(&mut draws)),
            };
            let mut rolled = self.rolled(segment, &smooth, &mut shared, &mut draws);
            add_rounding_of_rates(&mut rolled, number, &mut draws);
            let after = self.measure_again(segment, &rolled, index, before, terms, &mut draws);
            count_again(segment, &smooth, &mut shared);
            carried = Some((after, shared));
        }
        let mut again = Self { records: Arc::new(records), ..self.clone() };
        again.solution.pass = Pass::nothing();
        again
    }

    /// The segment with what its wheels roll: the smoothed turns and the fitted noise of wheels and turns.
    fn rolled<'a>(
        &self,
        segment: &Segment<'a>,
        smooth: &[Wheels<f64>],
        shared: &mut SharedErrors,
        draws: &mut Draws,
    ) -> Segment<'a> {
        let Solution { model, noise, .. } = &self.solution;
        let [wheel, turn, ..] = noise.variance;
        let mut rolled = segment.clone();
        for (interval, smooth) in rolled.intervals.iter_mut().zip(smooth) {
            if !interval.starts_within_row {
                shared.within_row = Wheels::from_sides(|_| draws.normal());
            }
            let [from, to] = interval.interpolated_rad2.map(|variance| variance.map(f64::sqrt));
            let travel_m = model.m_per_rad.zip_with(*smooth, |m_per_rad, rad| m_per_rad * rad);
            let Increment { turn_rad, .. } = Increment::from_travel(travel_m, model.separation_m);
            let scrub_m = 0.5 * model.separation_m * (turn * turn_rad.abs()).sqrt() * draws.normal();
            interval.wheel_rad = Wheels::from_sides(|side| {
                let noise_m = (wheel * travel_m[side].abs()).sqrt() * draws.normal();
                let sense = if side == Side::Left { -1.0 } else { 1.0 };
                let bent_rad = shared.within_row[side] * (to[side] - from[side]);
                let restored_rad2 = interval.restored_rad2[side];
                let restored_rad = if restored_rad2 > 0.0 { restored_rad2.sqrt() * draws.normal() } else { 0.0 };
                smooth[side] + bent_rad + restored_rad + (noise_m + sense * scrub_m) / model.m_per_rad[side]
            });
        }
        rolled
    }

    /// Measures the rolled path at the segment's instants.
    fn measure_again(
        &self,
        segment: &mut Segment<'_>,
        rolled: &Segment<'_>,
        index: usize,
        before: Option<CarriedState>,
        terms: &mut [Box<dyn ModelTerm>],
        draws: &mut Draws,
    ) -> CarriedState {
        let Solution { model, noise, free_headings, .. } = &self.solution;
        let [_, _, position_m2, heading_rad2] = noise.variance;
        let Instrument { body_from_sensor, latency_s } = model.instrument(segment.run);
        let mut propagator = Propagator::new(rolled, model, terms);
        if let Some(before) = before {
            propagator.carry_on(before);
        }
        propagator.restart();
        let (start, first) = match (segment.start, segment.measurements.first()) {
            (Start::MeasuredPose, Some(first)) => {
                let theta_rad = first.theta_rad.unwrap_or(free_headings.get(index).copied().unwrap_or(0.0));
                (Pose::new(first.x_m, first.y_m, theta_rad), (first.t_s, first.after))
            }
            _ => (Pose::IDENTITY, (rolled.intervals.first().map_or(0.0, |interval| interval.t_s), 0)),
        };
        let mounted = start * body_from_sensor.inverse();
        let off = propagator.measurement_offset(mounted, first.0, first.1, latency_s);
        let mut pose = mounted * off.inverse();
        let mut at = first.1;
        for measurement in &mut segment.measurements {
            pose = propagator.dead_reckon(pose, at..measurement.after);
            at = measurement.after;
            let late_s = if noise.timing_s2 > 0.0 { noise.timing_s2.sqrt() * draws.normal() } else { 0.0 };
            let off = propagator.measurement_offset(pose, measurement.t_s, at, latency_s + late_s);
            let seen = pose * off * body_from_sensor;
            let errors = draws.errors(measurement, [position_m2, heading_rad2]);
            measurement.x_m = seen.x_m + errors.x;
            measurement.y_m = seen.y_m + errors.y;
            measurement.theta_rad = measurement.theta_rad.map(|_| seen.theta_rad + errors.z);
        }
        propagator.carried(pose * body_from_sensor)
    }
}

/// Errors at the end of a segment, which a displacement that begins there has too.
struct SharedErrors {
    /// What nobody recorded of the motion within a row is one error for all of it, in standard deviations.
    within_row: Wheels<f64>,
    /// How much of the next count each wheel has turned.
    count_share: Wheels<f64>,
}

impl SharedErrors {
    fn drawn(draws: &mut Draws) -> Self {
        Self {
            within_row: Wheels::from_sides(|_| draws.normal()),
            count_share: Wheels::from_sides(|_| draws.uniform()),
        }
    }
}

/// How the wheels turned by their rates, interval by interval: without the rounding of single rows. Between
/// two rests the rates add up to whole counts, where a wheel stops anywhere between two.
fn smooth_turns(segment: &Segment<'_>, draws: &mut Draws) -> Vec<Wheels<f64>> {
    let of = |interval: &WheelInterval| {
        let [start, end] = interval.rate_at_ends_rad_s;
        if interval.stands {
            Wheels::both(0.0)
        } else {
            start.zip_with(end, |start, end| 0.5 * (start + end) * interval.dt_s)
        }
    };
    let mut smooth: Vec<Wheels<f64>> = segment.intervals.iter().map(of).collect();
    for moving in smooth.chunk_by_mut(|a, b| (*a == Wheels::both(0.0)) == (*b == Wheels::both(0.0))) {
        for side in Side::BOTH {
            let turned_rad: f64 = moving.iter().map(|of| of[side].abs()).sum();
            if turned_rad > 0.0 {
                let more = segment.quantum_rad[side] * (draws.uniform() - draws.uniform()) / turned_rad;
                moving.iter_mut().for_each(|of| of[side] += more * of[side].abs());
            }
        }
    }
    smooth
}

/// The wheels turn by what the rounding of the recorded rates leaves out.
fn add_rounding_of_rates(rolled: &mut Segment<'_>, number: u64, draws: &mut Draws) {
    let rounding = rolled.rate_rounding;
    if !rounding.is_any() {
        return;
    }
    for interval in &mut rolled.intervals {
        let errors = [0, 1].map(|rate| {
            let Some((recorded, sense)) = RecordedRate::of(rate, interval.rate_steps) else { return 0.0 };
            let shared = rounding.shared[rate];
            let own = (1.0 - shared * shared).sqrt() * (draws.uniform() - 0.5);
            shared * sense * (Draws::of_rate(number, recorded).uniform() - 0.5) + own
        });
        let turned_rad = rounding.turned_rad(errors, interval.dt_s);
        interval.wheel_rad = interval.wheel_rad.zip_with(turned_rad, |turn, more| turn + more);
    }
}

/// Counts the smoothed turns at the ends of rows, each wheel from its share of a count on. Within a row the
/// counts go as the smoothed turns do, as those of a log are interpolated; rates have the rounding of the
/// counts around them, as a log's have.
fn count_again(segment: &mut Segment<'_>, smooth: &[Wheels<f64>], shared: &mut SharedErrors) {
    let Some(start_s) = segment.intervals.first().map(|first| first.t_s) else { return };
    let mut rows_s = vec![start_s];
    let rounding_rad = Side::BOTH.map(|side| {
        let quantum_rad = segment.quantum_rad[side];
        let count_share = shared.count_share[side];
        let counted = |turned_rad: f64| {
            if quantum_rad > 0.0 { (turned_rad / quantum_rad + count_share).floor() * quantum_rad } else { turned_rad }
        };
        let (mut turned_rad, mut before) = (0.0, counted(0.0));
        let mut rounding_rad = vec![before];
        let mut first = 0;
        for row in segment.intervals.chunk_by_mut(|_, next| next.starts_within_row) {
            let smooth = &smooth[first..first + row.len()];
            first += row.len();
            let of_row: f64 = smooth.iter().map(|smooth| smooth[side]).sum();
            turned_rad += of_row;
            let now = counted(turned_rad);
            let row_s: f64 = row.iter().map(|interval| interval.dt_s).sum();
            for (interval, smooth) in row.iter_mut().zip(smooth) {
                let share = if of_row == 0.0 { interval.dt_s / row_s } else { smooth[side] / of_row };
                interval.wheel_rad[side] = (now - before) * share;
            }
            if side == Side::Left {
                rows_s.push(rows_s[rows_s.len() - 1] + row_s);
            }
            rounding_rad.push(now - turned_rad);
            before = now;
        }
        if quantum_rad > 0.0 {
            shared.count_share[side] = (turned_rad / quantum_rad + count_share).rem_euclid(1.0);
        }
        rounding_rad
    });
    let rounding = RateNoise::of_errors(segment, rows_s, rounding_rad);
    segment.intervals.iter_mut().for_each(|interval| rounding.add_to(interval));
}

/// Draws of one segment: addressed by its number and that of the simulation.
struct Draws(Xoshiro256PlusPlus);

impl Draws {
    fn of(number: u64, segment: usize) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ segment as u64))
    }

    /// Those of a recorded rate, which all runs share.
    fn of_rate(number: u64, RecordedRate { rate, steps }: RecordedRate) -> Self {
        let address = (u64::from(steps.cast_unsigned()) << 1 | rate as u64).wrapping_mul(0xd1b5_4a32_d192_ed03);
        Self(Xoshiro256PlusPlus::seed_from_u64(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ !address))
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Errors of a measurement, for the instrument's variances of position and heading.
    fn errors(&mut self, measurement: &MeasuredPose, variance: [f64; 2]) -> Vector3<f64> {
        let mut normal = || self.normal();
        let draws = Vector3::new(normal(), normal(), if measurement.theta_rad.is_some() { normal() } else { 0.0 });
        measurement.shape.map_or_else(
            || {
                let [xy, theta] = measurement.variance_factor;
                let (position_m, heading_rad) = ((variance[0] * xy).sqrt(), (variance[1] * theta).sqrt());
                draws.component_mul(&Vector3::new(position_m, position_m, heading_rad))
            },
            |shape| shape.errors(variance, draws),
        )
    }

    fn uniform(&mut self) -> f64 {
        self.0.random::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::Records;
    use crate::tests::dataset_of;
    use crate::wheel_rates::{pieces, slopes};
    use dataset::{Dataset, Odometry, TruthSample, WheelLog};

    /// Thirty seconds in rows of 0.1 s, counts of 0.2 rad: 3 rad/s from 5 to 25 s, and rest.
    fn dataset() -> Dataset {
        let t_s: Vec<f64> = (0..=300).map(|row| 0.1 * f64::from(row)).collect();
        let counts: Vec<i64> = t_s.iter().map(|t_s| (15.0 * (t_s - 5.0).clamp(0.0, 20.0)).floor() as i64).collect();
        let truth = t_s.iter().map(|t_s| TruthSample::new(*t_s, 0.0, 0.0, Some(0.0))).collect();
        let wheels = WheelLog::Ticks(Wheels { left: counts.clone(), right: counts });
        let mut dataset = dataset_of(1, true);
        dataset.robot.ticks_per_rev = Some(std::f64::consts::TAU / 0.2);
        dataset.runs[0].truth = truth;
        dataset.runs[0].odometry = Odometry { t_s: t_s.into(), wheels, ..Odometry::default() };
        dataset
    }

    #[test]
    fn between_two_rests_a_wheel_turns_by_any_part_of_a_count_more_or_less() {
        let dataset = dataset();
        let records = Records::of(&[dataset.session()]);
        let segment = &records.segments[0];
        let of_draw = |number: u64| {
            let smooth = smooth_turns(segment, &mut Draws::of(number, 0));
            let of_rests = segment.intervals.iter().zip(&smooth).filter(|(interval, _)| interval.stands);
            assert!(of_rests.clone().count() > 50 && of_rests.clone().all(|(_, of)| *of == Wheels::both(0.0)));
            smooth.iter().fold(Wheels::both(0.0), |sum, of| sum.zip_with(*of, |sum, of| sum + of))
        };
        let turned: Vec<Wheels<f64>> = (0..400).map(of_draw).collect();
        let mean = turned.iter().map(|of| of.left).sum::<f64>() / 400.0;
        let variance = turned.iter().map(|of| (of.left - mean).powi(2)).sum::<f64>() / 399.0;
        // The difference of two uniform phases has the variance q²/6, a standard error of 6 % of it over
        // 400, and their mean one of 4e-3. Rejects whole counts, and the phase of one end alone.
        assert!((variance / (0.2 * 0.2 / 6.0) - 1.0).abs() < 0.24, "{variance}");
        let by_rates = |of: &WheelInterval| {
            let [start, end] = of.rate_at_ends_rad_s;
            if of.stands { 0.0 } else { 0.5 * (start.left + end.left) * of.dt_s }
        };
        let rates_rad: f64 = segment.intervals.iter().map(by_rates).sum();
        assert!((mean - rates_rad).abs() < 0.016 && (rates_rad - 60.0).abs() < 0.1, "{mean} {rates_rad}");
        assert!(turned.iter().any(|of| (of.left - of.right).abs() > 0.05), "each wheel has its own");
    }

    #[test]
    fn rates_are_those_of_the_counts_that_were_counted_again() {
        let dataset = dataset();
        let records = Records::of(&[dataset.session()]);
        let mut segment = records.segments[0].clone();
        // A path without noise, of 1.4 counts a row.
        for interval in &mut segment.intervals {
            (interval.rate_rad_s, interval.rate_at_ends_rad_s) = (Wheels::both(2.8), [Wheels::both(2.8); 2]);
        }
        let smooth: Vec<Wheels<f64>> = segment.intervals.iter().map(|of| Wheels::both(2.8 * of.dt_s)).collect();
        count_again(&mut segment, &smooth, &mut SharedErrors::drawn(&mut Draws::of(1, 0)));
        let (mut t_s, mut counted_rad) = (vec![segment.intervals[0].t_s], vec![0.0]);
        for interval in &segment.intervals {
            t_s.push(interval.t_s + interval.dt_s);
            counted_rad.push(counted_rad[counted_rad.len() - 1] + interval.wheel_rad.left);
        }
        let half = segment.rate_window.rows;
        let rates = slopes(&t_s, &counted_rad, &pieces(&t_s, true), half);
        let mut varied = 0;
        // Slopes are linear: of a path and of its rounding they are those of the counts. At the ends too.
        for (k, interval) in segment.intervals.iter().enumerate() {
            assert!((interval.rate_at_ends_rad_s[0].left - rates[k]).abs() < 1e-9, "{k}");
            assert!((interval.rate_at_ends_rad_s[1].left - rates[k + 1]).abs() < 1e-9, "{k}");
            varied += usize::from((rates[k] - 2.8).abs() > 1e-3);
        }
        assert!(half > 0 && varied > 100, "{half} {varied}");
    }

    #[test]
    fn counts_go_on_from_a_displacement_to_the_next() {
        let dataset = dataset();
        let records = Records::of(&[dataset.session()]);
        let segment = &records.segments[0];
        let smooth: Vec<Wheels<f64>> = segment.intervals.iter().map(|of| Wheels::both(2.8 * of.dt_s)).collect();
        let turned_rad: f64 = smooth.iter().map(|of| of.left).sum();
        let mut shared = SharedErrors::drawn(&mut Draws::of(1, 0));
        let mut off_rad = 0.0_f64;
        for _ in 0..20 {
            let mut next = segment.clone();
            count_again(&mut next, &smooth, &mut shared);
            off_rad += next.intervals.iter().map(|of| of.wheel_rad.left).sum::<f64>() - turned_rad;
            // A count is 0.2 rad. Rejects phases of their own, by which twenty are off by more than that.
            assert!(off_rad.abs() < 0.2, "{off_rad}");
        }
    }
}

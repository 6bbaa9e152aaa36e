//! What the rounding of counts does to the covariates of terms.
//!
//! A rate that is found in counts has their rounding, and a term that goes by it is estimated too small by
//! the share of the rounding in what it varies by (errors in variables; Fuller 1987). Where the same noise is
//! added once more, the term's information grows by what the noise has in it (simulation and extrapolation;
//! Cook & Stefanski 1994): with I the information of a term and I' that with noise added, (2 I − I')/I is the
//! share of the motion, the *reliability* of the term. It needs no formula for what a term makes of the
//! rates.

use std::collections::BTreeMap;
use std::sync::Arc;

use kinematics::{Side, Wheels};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::model_fit::ModelFit;
use crate::segment::Segment;
use crate::settings::TIME_TOLERANCE_S;
use crate::wheel_angles::WheelInterval;
use crate::wheel_rates::{RateWindow, pieces, slopes};

impl ModelFit<'_> {
    /// The fit with rates that have the rounding of counts once more, drawn; measurements and turns stay.
    /// `None` where nothing is rounded. Its normal equations come by a scan.
    #[must_use]
    pub fn with_noisier_rates(&self) -> Option<Self> {
        let mut records = self.records.copied();
        let segments = records.segments.iter_mut().chain(records.partial.iter_mut().map(|of| &mut of.segment));
        let mut runs: BTreeMap<(usize, usize), Vec<&mut Segment<'_>>> = BTreeMap::new();
        for segment in segments.filter(|segment| segment.quantum_rad != Wheels::both(0.0)) {
            runs.entry(segment.run).or_default().push(segment);
        }
        if runs.is_empty() {
            return None;
        }
        let of_run = |(number, segments): (usize, Vec<&mut Segment<'_>>)| {
            let noise = RateNoise::of(&segments, Xoshiro256PlusPlus::seed_from_u64(number as u64));
            segments.into_iter().flat_map(|segment| &mut segment.intervals).for_each(|interval| noise.add_to(interval));
        };
        runs.into_values().collect::<Vec<_>>().into_par_iter().enumerate().for_each(of_run);
        Some(Self { records: Arc::new(records), ..self.clone() })
    }
}

/// Noise of the rates of a run.
pub(crate) struct RateNoise {
    /// Instants of rows.
    t_s: Vec<f64>,
    /// Errors of the wheels' angles there, radians.
    angle_rad: [Vec<f64>; 2],
    /// Errors of the rates there, rad/s.
    rate_rad_s: [Vec<f64>; 2],
    row_by_row: bool,
}

impl RateNoise {
    /// Of the segments of a run.
    fn of(segments: &[&mut Segment<'_>], mut draws: Xoshiro256PlusPlus) -> Self {
        let mut t_s: Vec<f64> = segments.iter().flat_map(|segment| instants_of_rows(&segment.intervals)).collect();
        t_s.sort_unstable_by(f64::total_cmp);
        t_s.dedup_by(|next, before| *next - *before <= TIME_TOLERANCE_S);
        let angle_rad = Side::BOTH.map(|side| {
            let mut turns = vec![false; t_s.len()];
            for interval in segments.iter().flat_map(|segment| &segment.intervals) {
                let row = t_s.partition_point(|t_s| *t_s <= interval.t_s + TIME_TOLERANCE_S);
                if let Some(turns) = turns.get_mut(row) {
                    *turns |= interval.wheel_rad[side] != 0.0;
                }
            }
            let mut draw = || segments[0].quantum_rad[side] * (draws.random::<f64>() - 0.5);
            let mut own = draw();
            // A count that stands keeps its rounding.
            turns
                .into_iter()
                .map(|turned| {
                    if turned {
                        own = draw();
                    }
                    own
                })
                .collect::<Vec<f64>>()
        });
        Self::of_errors(segments[0], t_s, angle_rad)
    }

    /// Of a segment whose angles are off by so much at the instants of its rows, which are as many.
    pub(crate) fn of_errors(segment: &Segment<'_>, t_s: Vec<f64>, angle_rad: [Vec<f64>; 2]) -> Self {
        let RateWindow { rows, row_by_row } = segment.rate_window;
        let pieces = pieces(&t_s, segment.info.continuous);
        let rate_rad_s = angle_rad.each_ref().map(|errors| slopes(&t_s, errors, &pieces, rows));
        Self { t_s, angle_rad, rate_rad_s, row_by_row }
    }

    pub(crate) fn add_to(&self, interval: &mut WheelInterval) {
        let next = self.t_s.partition_point(|t_s| *t_s <= interval.t_s + TIME_TOLERANCE_S);
        let (from, to) = (next.saturating_sub(1), next.min(self.t_s.len().saturating_sub(1)));
        let Some((from_s, to_s)) = self.t_s.get(from).zip(self.t_s.get(to)) else { return };
        let length_s = to_s - from_s;
        let at = |at_s: f64| {
            let share = if length_s > TIME_TOLERANCE_S { ((at_s - from_s) / length_s).clamp(0.0, 1.0) } else { 0.0 };
            let of = |errors: &Vec<f64>| errors[from] + share * (errors[to] - errors[from]);
            Wheels { left: of(&self.rate_rad_s[0]), right: of(&self.rate_rad_s[1]) }
        };
        let ends = [interval.t_s, interval.t_s + interval.dt_s].map(at);
        let own = if self.row_by_row && length_s > TIME_TOLERANCE_S {
            let of = |errors: &Vec<f64>| (errors[to] - errors[from]) / length_s;
            Wheels { left: of(&self.angle_rad[0]), right: of(&self.angle_rad[1]) }
        } else {
            ends[0].zip_with(ends[1], |start, end| 0.5 * (start + end))
        };
        interval.rate_rad_s = interval.rate_rad_s.zip_with(own, |rate, own| rate + own);
        for (rate, own) in interval.rate_at_ends_rad_s.iter_mut().zip(ends) {
            *rate = rate.zip_with(own, |rate, own| rate + own);
        }
    }
}

/// Where rows begin and end.
fn instants_of_rows(intervals: &[WheelInterval]) -> impl Iterator<Item = f64> {
    let ends = intervals.windows(2).filter(|pair| !pair[1].starts_within_row).map(|pair| pair[0].t_s + pair[0].dt_s);
    intervals.iter().filter(|interval| !interval.starts_within_row).map(|interval| interval.t_s).chain(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: [Wheels<f64>; 2] = [Wheels { left: 0.0, right: 0.0 }; 2];

    fn interval(t_s: f64, dt_s: f64, wheel_rad: Wheels<f64>, starts_within_row: bool) -> WheelInterval {
        WheelInterval {
            t_s,
            dt_s,
            wheel_rad,
            late_s: [0.0; 2],
            rate_rad_s: Wheels { left: 10.0, right: 20.0 },
            rate_at_ends_rad_s: [Wheels { left: 30.0, right: 40.0 }, Wheels { left: 50.0, right: 60.0 }],
            chord_area_rad2: 0.0,
            stands: false,
            starts_within_row,
            interpolated_rad2: EXACT,
            restored_rad2: Wheels::both(0.0),
            rate_steps: [0; 2],
        }
    }

    /// Rows at 0, 1 and 3 s.
    fn noise(row_by_row: bool) -> RateNoise {
        RateNoise {
            t_s: vec![0.0, 1.0, 3.0],
            angle_rad: [vec![0.0, 0.5, 2.0], vec![0.25, 0.0, -1.0]],
            rate_rad_s: [vec![1.0, 2.0, 4.0], vec![-1.0, 0.0, 8.0]],
            row_by_row,
        }
    }

    fn added(noise: &RateNoise, t_s: f64, dt_s: f64) -> (Wheels<f64>, [Wheels<f64>; 2]) {
        let before = interval(t_s, dt_s, Wheels::both(1.0), false);
        let mut after = before;
        noise.add_to(&mut after);
        assert_eq!((after.wheel_rad, after.t_s, after.dt_s), (before.wheel_rad, before.t_s, before.dt_s));
        let by = |after: Wheels<f64>, before: Wheels<f64>| after.zip_with(before, |after, before| after - before);
        let ends = [0, 1].map(|end| by(after.rate_at_ends_rad_s[end], before.rate_at_ends_rad_s[end]));
        (by(after.rate_rad_s, before.rate_rad_s), ends)
    }

    #[test]
    fn the_noise_of_a_rate_is_that_of_its_row_and_goes_over_to_the_next() {
        let wheels = |left, right| Wheels { left, right };
        // Numbers of few bits, which sums do not round. A quarter and three quarters of the second row.
        let ends = [wheels(2.5, 2.0), wheels(3.5, 6.0)];
        assert_eq!(added(&noise(false), 1.5, 1.0), (wheels(3.0, 4.0), ends));
        // Where rows say their own rates, the noise of their counts over their length.
        assert_eq!(added(&noise(true), 1.5, 1.0), (wheels(0.75, -0.5), ends));
        // A whole row, which begins at a stamp that is rounded.
        let ends = [wheels(1.0, -1.0), wheels(2.0, 0.0)];
        assert_eq!(added(&noise(false), 0.0, 1.0), (wheels(1.5, -0.5), ends));
        let (_, rounded) = added(&noise(false), 1.0 - 1e-10, 2.0);
        assert!((rounded[0].left - 2.0).abs() < 1e-9 && (rounded[1].right - 8.0).abs() < 1e-8, "{rounded:?}");
        // Before the first row and after the last, as there.
        let (_, before) = added(&noise(true), -0.5, 0.25);
        let (own, after) = added(&noise(true), 3.0, 0.5);
        assert_eq!((before, after), ([wheels(1.0, -1.0); 2], [wheels(4.0, 8.0); 2]));
        assert_eq!(own, wheels(4.0, 8.0));
    }

    #[test]
    fn rows_begin_where_intervals_do_and_end_where_the_last_of_them_does() {
        let still = Wheels::both(0.0);
        // Half of a row from within it, two halves of a row, a whole one, and half of the last.
        let intervals = [
            interval(0.5, 0.5, still, true),
            interval(1.0, 0.5, still, false),
            interval(1.5, 0.5, still, true),
            interval(2.0, 1.0, still, false),
            interval(3.0, 0.5, still, false),
        ];
        let mut found: Vec<f64> = instants_of_rows(&intervals).collect();
        found.sort_unstable_by(f64::total_cmp);
        found.dedup();
        // Rejects instants at which a measurement is within a row: 0.5, 1.5 and 3.5 s.
        assert_eq!(found, [1.0, 2.0, 3.0]);
        // Of a gap both sides: an interval ends at 2 s, and the next begins at 5 s.
        let apart = [interval(1.0, 1.0, still, false), interval(5.0, 1.0, still, false)];
        let mut found: Vec<f64> = instants_of_rows(&apart).collect();
        found.sort_unstable_by(f64::total_cmp);
        assert_eq!(found, [1.0, 2.0, 5.0]);
    }

    /// A segment of 400 rows of a second; the left wheel stands in the second half, the right one turns in
    /// every fourth row alone.
    fn drawn(row_by_row: bool) -> RateNoise {
        let dataset = crate::tests::dataset_of(1, true);
        let session = dataset.session();
        let mut segment = crate::Records::of(&[session]).segments.remove(0);
        let wheel_rad = |row: usize| Wheels {
            left: if row < 200 { 0.5 } else { 0.0 },
            right: if row.is_multiple_of(4) { -0.5 } else { 0.0 },
        };
        segment.intervals = (0..400).map(|row| interval(row as f64, 1.0, wheel_rad(row), false)).collect();
        (segment.quantum_rad, segment.rate_window) =
            (Wheels { left: 0.5, right: 0.25 }, RateWindow { rows: 1, row_by_row });
        RateNoise::of(&[&mut segment], Xoshiro256PlusPlus::seed_from_u64(5))
    }

    #[test]
    fn a_count_is_off_by_up_to_half_of_itself_and_keeps_it_while_the_wheel_stands() {
        let RateNoise { t_s, angle_rad: [left, right], rate_rad_s, row_by_row } = drawn(false);
        assert!(!row_by_row && drawn(true).row_by_row);
        // The end of the last interval is within a row, as far as the log says.
        assert_eq!((t_s.len(), left.len(), right.len()), (400, 400, 400));
        for (errors, quantum_rad) in [(&left, 0.5), (&right, 0.25)] {
            assert!(errors.iter().all(|error| error.abs() <= 0.5 * quantum_rad));
            let distinct: std::collections::BTreeSet<u64> = errors.iter().map(|error| error.to_bits()).collect();
            // The first row, and one for every row of which the interval before it turned: 200, or 100.
            assert_eq!(distinct.len(), if quantum_rad > 0.3 { 201 } else { 101 });
            let n = distinct.len() as f64;
            let squares: f64 = distinct.iter().map(|bits| f64::from_bits(*bits).powi(2)).sum();
            let mean = distinct.iter().map(|bits| f64::from_bits(*bits)).sum::<f64>() / n;
            // Uniform: q²/12, of which the mean square of n draws has the standard error √(4/5n), 9 %, and
            // the mean q/√(12 n): four of them. Rejects draws about half a count.
            assert!((squares / n / (quantum_rad * quantum_rad / 12.0) - 1.0).abs() < 0.36, "{}", squares / n);
            assert!(mean.abs() < 4.0 * quantum_rad / (12.0 * n).sqrt(), "{mean}");
        }
        // Which rows: behind an interval that turned.
        assert!((1..=200).all(|row| left[row] != left[row - 1]) && (201..400).all(|row| left[row] == left[row - 1]));
        assert!((1..400).all(|row| (right[row] != right[row - 1]) == (row % 4 == 1)));
        // Rates go by the rows beside each: slopes over one row to each side.
        let on_paper = |errors: &[f64], row: usize| 0.5 * (errors[row + 1] - errors[row - 1]);
        for (side, errors) in [&left, &right].into_iter().enumerate() {
            assert!((1..399).all(|row| (rate_rad_s[side][row] - on_paper(errors, row)).abs() < 1e-15), "{side}");
        }
    }
}

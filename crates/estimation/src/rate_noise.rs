//! What the rounding of counts does to the covariates of terms.
//!
//! A rate that is found in counts has their rounding, and a term that goes by it is estimated too small by the
//! share of the rounding in what it varies by (errors in variables; Fuller 1987). Where the same noise is added
//! once more, the term's information grows by what the noise has in it (simulation and extrapolation; Cook &
//! Stefanski 1994): with I the information of a term and I' that with noise added, (2 I − I')/I is the share
//! of the motion, the *reliability* of the term. It needs no formula for what a term makes of the rates.

use std::collections::BTreeMap;
use std::sync::Arc;

use kinematics::{Side, Wheels};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

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
        let mut records = (*self.records).clone();
        let segments = records.segments.iter_mut().chain(records.partial.iter_mut().map(|of| &mut of.segment));
        let mut runs: BTreeMap<(usize, usize), Vec<&mut Segment<'_>>> = BTreeMap::new();
        for segment in segments.filter(|segment| segment.quantum_rad != Wheels::both(0.0)) {
            runs.entry(segment.run).or_default().push(segment);
        }
        if runs.is_empty() {
            return None;
        }
        for (number, segments) in runs.into_values().enumerate() {
            let noise = RateNoise::of(&segments, Xoshiro256PlusPlus::seed_from_u64(number as u64));
            segments.into_iter().flat_map(|segment| &mut segment.intervals).for_each(|interval| noise.add_to(interval));
        }
        Some(Self { records: Arc::new(records), ..self.clone() })
    }
}

/// Noise of the rates of a run.
struct RateNoise {
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
        let RateWindow { rows, row_by_row } = segments[0].rate_window;
        let mut t_s: Vec<f64> = segments.iter().flat_map(|segment| instants_of_rows(&segment.intervals)).collect();
        t_s.sort_unstable_by(f64::total_cmp);
        t_s.dedup_by(|next, before| *next - *before <= TIME_TOLERANCE_S);
        let pieces = pieces(&t_s, true);
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
        let rate_rad_s = angle_rad.each_ref().map(|errors| slopes(&t_s, errors, &pieces, rows));
        Self { t_s, angle_rad, rate_rad_s, row_by_row }
    }

    fn add_to(&self, interval: &mut WheelInterval) {
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

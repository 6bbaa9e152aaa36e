//! What the rounding of recorded rates may be in segments ([`crate::recorded_rates`]).

use std::collections::BTreeMap;

use kinematics::Increment;

use crate::model::Model;
use crate::recorded_rates::RecordedRate;
use crate::segment::Segment;
use crate::settings::RECORDED_RATES;
use crate::wheel_angles::WheelInterval;

/// How long each recorded rate stands in intervals, seconds.
fn time_s<'i>(intervals: impl Iterator<Item = &'i WheelInterval>) -> BTreeMap<RecordedRate, f64> {
    let mut time_s: BTreeMap<RecordedRate, f64> = BTreeMap::new();
    for interval in intervals {
        for (recorded, _) in [0, 1].into_iter().filter_map(|rate| RecordedRate::of(rate, interval.rate_steps)) {
            *time_s.entry(recorded).or_default() += interval.dt_s;
        }
    }
    time_s
}

impl Segment<'_> {
    /// Variances of distance, m², and turn, rad², by the error of the rate that stands longest.
    pub(crate) fn variance_of_rates(&self, model: &Model) -> [f64; 2] {
        let mut longest_s = [0.0; 2];
        if self.rate_rounding.is_any() {
            for (recorded, time_s) in time_s(self.intervals.iter()) {
                longest_s[recorded.rate] = f64::max(longest_s[recorded.rate], time_s);
            }
        }
        let of_rate = |rate: usize| {
            let sigma_s = self.rate_rounding.shared[rate] * longest_s[rate] / 12_f64.sqrt();
            model.increment(self.rate_rounding.step_rad_s[rate].map(|rad_s| rad_s * sigma_s))
        };
        let errors = [of_rate(0), of_rate(1)];
        let squares = |of: fn(&Increment) -> f64| errors.iter().map(|error| of(error).powi(2)).sum();
        [squares(|error| error.distance_m), squares(|error| error.turn_rad)]
    }
}

/// The recorded rates whose errors are shared, those that stand longest first, up to a number of them.
pub(crate) fn shared_rates(segments: &[Segment<'_>]) -> Vec<RecordedRate> {
    let rounded = segments.iter().filter(|segment| segment.rate_rounding.is_any());
    let mut rates: Vec<(RecordedRate, f64)> =
        time_s(rounded.flat_map(|segment| &segment.intervals)).into_iter().collect();
    rates.sort_by(|a, b| b.1.total_cmp(&a.1));
    rates.into_iter().take(RECORDED_RATES.max_shared_rates).map(|(rate, _)| rate).collect()
}

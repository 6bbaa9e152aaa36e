//! Times in milliseconds, of all tables; or of one in milli-, micro- or nanoseconds. The checks that follow
//! have seconds.

use dataset::{MAX_ROW_S, median, quantile};

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

pub(crate) fn found(check: &mut SessionCheck) {
    if let Some(ratio) = median(check.runs.iter().filter_map(spans)) {
        let [low, high] = CHECKS.clock_unit_ratio;
        let unit_of = |ratio: f64| CHECKS.time_units.iter().position(|unit| (low..=high).contains(&(ratio / unit)));
        let of_truth = unit_of(ratio).map(|unit| (unit, true));
        if let Some((unit, of_truth)) = of_truth.or_else(|| unit_of(ratio.recip()).map(|unit| (unit, false))) {
            let kind = Kind::TruthTimeUnit { unit, of_truth };
            check.problems.push(Problem::new(&kind, Severity::Error, None, 0.99));
            let per_second = CHECKS.time_units[unit];
            for run in &mut check.runs {
                if of_truth {
                    run.scale_truth_time(per_second.recip());
                } else {
                    run.scale_time(per_second.recip());
                    run.scale_truth_time(per_second);
                }
            }
        }
    }
    let Some(row) = median(check.runs.iter().filter_map(median_row_s)) else { return };
    let m_per_rad = check.m_per_rad().left.max(check.m_per_rad().right);
    let fastest_m_s = check.runs.iter().map(fastest_rad_s).fold(0.0, f64::max) * m_per_rad;
    if row > MAX_ROW_S && fastest_m_s < CHECKS.min_speed_m_s && fastest_m_s > 0.0 {
        check.problems.push(Problem::new(&Kind::TimeInMilliseconds { row }, Severity::Error, None, 0.99));
        check.runs.iter_mut().for_each(|run| run.scale_time(1e-3));
    }
}

/// What the instrument's records span over what the log spans.
fn spans(run: &RunLog) -> Option<f64> {
    let [log_s, truth_s] = run.spans_s?;
    let are_many = run.is_seen_in_part() || run.truth.len().max(run.displacements.len()) >= CHECKS.min_rows;
    (are_many && run.t_s.len() >= CHECKS.min_rows).then(|| truth_s / log_s)
}

pub(super) fn median_row_s(run: &RunLog) -> Option<f64> {
    median(run.t_s.windows(2).map(|pair| pair[1] - pair[0])).filter(|_| run.t_s.len() >= CHECKS.min_rows)
}

fn fastest_rad_s(run: &RunLog) -> f64 {
    let rates = |angles: &Vec<f64>| {
        let rates = angles.windows(2).zip(run.t_s.windows(2)).map(|(a, t)| (a[1] - a[0]).abs() / (t[1] - t[0]));
        quantile(rates, 0.95).unwrap_or(0.0)
    };
    rates(&run.wheels.left).max(rates(&run.wheels.right))
}

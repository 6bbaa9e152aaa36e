//! Gaps and missing rows of the log.

use dataset::has_bunched_rows;

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::problems::time_unit::median_row_s;
use crate::session_check::SessionCheck;
use crate::settings::{GAP_RATIO, LOST_ROWS, MIN_GAP_S, MIN_WHEEL_TURN_RAD};

pub(crate) fn found(check: &mut SessionCheck) {
    let mut problems = Vec::new();
    let mut losing = Vec::new();
    let mut most = 0.0_f64;
    for run in &check.runs {
        let Some(median_s) = median_row_s(run) else { continue };
        let lengths = || run.t_s.windows(2).map(|pair| pair[1] - pair[0]).enumerate();
        let moved = |row: usize| {
            let step = |angles: &Vec<f64>| (angles[row + 1] - angles[row]).abs();
            step(&run.wheels.left) + step(&run.wheels.right) > MIN_WHEEL_TURN_RAD
        };
        let is_gap = |length_s: f64| length_s > (GAP_RATIO * median_s).max(MIN_GAP_S);
        let longest =
            lengths().filter(|(row, length_s)| is_gap(*length_s) && moved(*row)).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((row, length_s)) = longest.filter(|_| run.continuous) {
            let kind = Kind::Gap { t_s: run.t_s[row], length_s };
            problems.push(Problem::new(&kind, Severity::Hint, Some(vec![run.id.clone()]), 0.95));
        }
        // One row that is received late makes a gap, and hardly any distance to the rows that it held up.
        if has_bunched_rows(&run.t_s) {
            continue;
        }
        let missing: f64 = lengths()
            .map(|(_, length_s)| length_s)
            .filter(|length_s| !is_gap(*length_s))
            .map(|length_s| (length_s / median_s).round() - 1.0)
            .filter(|rows| *rows > 0.0)
            .sum();
        let share = missing / (missing + run.t_s.len() as f64);
        if share > LOST_ROWS {
            losing.push(run.id.clone());
            most = most.max(share);
        }
    }
    if !losing.is_empty() {
        problems.push(Problem::new(&Kind::LostRows { share: most }, Severity::Hint, Some(losing), 0.9));
    }
    check.problems.extend(problems);
}

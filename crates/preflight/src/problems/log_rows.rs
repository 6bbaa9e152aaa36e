//! Gaps and missing rows of the log, and rows that are sent some at a time.

use dataset::{has_bunched_rows, rows_per_packet};

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::problems::time_unit::median_row_s;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

pub(crate) fn found(check: &mut SessionCheck) {
    let mut problems = Vec::new();
    let mut losing = Vec::new();
    let mut most = 0.0_f64;
    let mut in_packets: Vec<(String, usize)> = Vec::new();
    for run in &check.runs {
        let Some(median_s) = median_row_s(run) else { continue };
        let lengths = || run.t_s.windows(2).map(|pair| pair[1] - pair[0]).enumerate();
        let moved = |row: usize| {
            let step = |angles: &Vec<f64>| (angles[row + 1] - angles[row]).abs();
            step(&run.wheels.left) + step(&run.wheels.right) > CHECKS.min_wheel_turn_rad
        };
        let is_gap = |length_s: f64| length_s > (CHECKS.gap_ratio * median_s).max(CHECKS.min_gap_s);
        let longest =
            lengths().filter(|(row, length_s)| is_gap(*length_s) && moved(*row)).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((row, length_s)) = longest.filter(|_| run.continuous) {
            let kind = Kind::Gap { t_s: run.t_s[row], length_s };
            problems.push(Problem::new(&kind, Severity::Hint, Some(vec![run.id.clone()]), 0.95));
        }
        // One row that is received late makes a gap, and hardly any distance to the rows that it held up.
        if has_bunched_rows(&run.t_s) {
            in_packets.extend(rows_per_packet(&run.t_s).map(|rows| (run.id.clone(), rows)));
            continue;
        }
        let missing: f64 = lengths()
            .map(|(_, length_s)| length_s)
            .filter(|length_s| !is_gap(*length_s))
            .map(|length_s| (length_s / median_s).round() - 1.0)
            .filter(|rows| *rows > 0.0)
            .sum();
        let share = missing / (missing + run.t_s.len() as f64);
        if share > CHECKS.lost_rows {
            losing.push(run.id.clone());
            most = most.max(share);
        }
    }
    if let Some(rows) = in_packets.iter().map(|(_, rows)| *rows).max() {
        let runs = in_packets.into_iter().map(|(id, _)| id).collect();
        problems.push(Problem::new(&Kind::RowsInPackets { rows }, Severity::Warning, Some(runs), 0.95));
    }
    if !losing.is_empty() {
        problems.push(Problem::new(&Kind::LostRows { share: most }, Severity::Hint, Some(losing), 0.9));
    }
    check.problems.extend(problems);
}

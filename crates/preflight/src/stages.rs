//! The order of the checks of a session: what is found first is undone before the next.

use dataset::Dataset;

use crate::clock::model::Clock;
use crate::problems;
use crate::session_check::SessionCheck;
use crate::windows::Reading;

/// Checks a session.
pub(crate) fn checked(dataset: &Dataset) -> SessionCheck {
    let mut check = SessionCheck::new(&dataset.session());
    problems::counters::found(&mut check);
    problems::truth_outliers::found(&mut check);
    problems::time_unit::found(&mut check);
    problems::log_rows::found(&mut check);
    if problems::standstill::found(&mut check) {
        return check;
    }
    problems::held_poses::found(&mut check);
    let is_rough = problems::rate_rows::found(&mut check);
    if problems::idle_columns::found(&mut check, dataset) {
        return check;
    }
    problems::run_order::found(&mut check);
    problems::clock::odd_runs(&mut check);
    let before = check.problems.len();
    // With headings as they are read, and clocks that are one.
    let mut is_cut = is_rough || problems::wheel_changes::found(&mut check, Reading::AS_IS, Clock::default());
    check.matched = problems::clock::matched(&mut check);
    let other = check.matched.as_ref().map(|of| (of.reading, of.clock));
    if let Some((reading, clock)) = other.filter(|of| !is_cut && *of != (Reading::AS_IS, Clock::default()))
        && problems::wheel_changes::found(&mut check, reading, clock)
    {
        // Clocks were compared by records that do not belong together.
        is_cut = true;
        let change = check.problems.pop();
        check.problems.truncate(before);
        check.problems.extend(change);
        check.matched = problems::clock::matched(&mut check);
    }
    problems::wheels::found(&mut check);
    problems::truth_is_odometry::found(&mut check);
    if !is_cut {
        problems::rates::found(&mut check, dataset);
    }
    problems::rounded_rates::found(&mut check, dataset);
    problems::coverage::found(&mut check);
    problems::coverage::unused(&mut check);
    check
}

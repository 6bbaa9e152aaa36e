//! The order of the checks of a session: what is found first is undone before the next.

use dataset::Dataset;

use crate::problems;
use crate::session_check::SessionCheck;

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
    check.matched = problems::clock::matched(&mut check);
    problems::wheels::found(&mut check);
    problems::truth_is_odometry::found(&mut check);
    problems::rates::found(&mut check, dataset);
    problems::rounded_rates::found(&mut check, dataset);
    problems::coverage::found(&mut check);
    problems::coverage::unused(&mut check);
    check
}

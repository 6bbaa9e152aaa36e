//! A part of many runs, for questions that it answers as well as all of them.

use dataset::{Dataset, Session};
use estimation::{ModelFit, Thinning};

use crate::settings::SEARCH;

/// Runs of every kind with `measurements_of_part` measurements; `None` where that is no small part of what
/// a fit of all measurements has.
pub(crate) fn part_of_runs<'a>(datasets: &'a [Dataset], base: &ModelFit<'_>) -> Option<Vec<Session<'a>>> {
    let share = SEARCH.measurements_of_part / base.records.measurements().max(1) as f64;
    let runs: usize = datasets.iter().map(|dataset| dataset.runs.len()).sum();
    if base.thinning != Thinning::NONE
        || share > SEARCH.max_share_of_part
        || (runs as f64) * share < SEARCH.min_runs_of_part
    {
        return None;
    }
    let mut is_in_part = share_of_runs(share);
    let sessions = datasets.iter().map(|dataset| {
        let mut session = dataset.session();
        session.runs.retain(|_| is_in_part());
        session
    });
    Some(sessions.filter(|session| !session.runs.is_empty()).collect())
}

/// Says of one run after the other whether it is in a part with that share of them. Multiples of the golden
/// section fall evenly into their share and into every period of the protocol (Weyl 1916), as runs that turn
/// left and right by turns have one.
fn share_of_runs(share: f64) -> impl FnMut() -> bool {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut number = 0.0;
    move || {
        number += golden;
        f64::fract(number) < share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_has_its_share_of_all_runs_and_of_every_second_third_and_fourth_one() {
        for share in [0.05, 0.123, 0.3] {
            let mut is_in_part = share_of_runs(share);
            let in_part: Vec<bool> = (0..1200).map(|_| is_in_part()).collect();
            for (period, phase) in [(1, 0), (2, 0), (2, 1), (3, 0), (3, 2), (4, 1), (4, 3)] {
                let own = in_part.iter().skip(phase).step_by(period).filter(|own| **own).count();
                let even = share * 1200.0 / f64::from(u32::try_from(period).expect("small"));
                // The discrepancy of such a sequence grows with the logarithm of its length: a few runs here.
                assert!((own as f64 - even).abs() < 4.0, "{share}: {own} of every {period}th for {even}");
            }
        }
    }
}

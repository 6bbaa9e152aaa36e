//! Clocks of instrument and robot that are far apart, or drift: of all runs, or of one among many
//! ([`preflight::ClockSearch`]).
//!
//! Before anything is fitted, a drift and an offset of all runs are taken off the measurements' times. A run
//! with an offset of its own is left out: it would be explained by whatever term it pays best.

use dataset::Dataset;
use preflight::{Clock, ClockSearch};
use rules::Rule;

use crate::records::log_rows::has_outlying_rows;
use crate::records::names::run_name;

/// An offset of the instrument's clock: its poses are of so long before their stamps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ClockOffset {
    /// Ids of the runs, where it is not of all.
    pub(crate) runs: Option<Vec<String>>,
    /// The offset, with what it gains.
    pub(crate) of: preflight::ClockOffset,
}

/// What was found, and the records without it.
#[derive(Default)]
pub(crate) struct Clocks {
    /// A drift of all clocks.
    pub(crate) drift: Option<preflight::ClockDrift>,
    /// Offsets beside it.
    pub(crate) offsets: Vec<ClockOffset>,
    /// Where there is a drift or an offset.
    pub(crate) records: Option<Vec<Dataset>>,
    /// The offset that all runs have still, seconds: small enough for the fit to estimate.
    pub(crate) remaining_s: f64,
}

impl Clocks {
    /// Looks for them; an offset of all runs, or one at the ends of a drift, counts from `min_common_s` on.
    pub(crate) fn of(datasets: &[Dataset], min_common_s: f64) -> Self {
        let search = ClockSearch::of(datasets, |run| !has_outlying_rows(run));
        let drift = Rule::ClockDrift.finds(search.drift(Clock::default(), min_common_s));
        let mut clock =
            Clock { offset_s: 0.0, middle_s: 0.0, ..drift.map_or_else(Clock::default, |drift| drift.clock) };
        let (mut offsets, mut remaining_s, mut odd) = (Vec::new(), 0.0, Vec::new());
        if let Some(found) = search.offsets(clock) {
            let is_common = found.common.offset_s.abs() >= min_common_s && found.common.is_certain();
            if (is_common || !found.odd.is_empty()) && Rule::ClockOffsets.applies(true) {
                let own = |&((session, run), of): &((usize, usize), preflight::ClockOffset)| ClockOffset {
                    runs: Some(vec![run_name(datasets, session, run)]),
                    of,
                };
                offsets.extend(found.odd.iter().map(own));
                offsets.extend(is_common.then_some(ClockOffset { runs: None, of: found.common }));
                odd.extend(found.odd.iter().map(|(run, _)| *run));
            }
            match offsets.last() {
                Some(ClockOffset { runs: None, of }) => clock.offset_s = of.offset_s,
                _ => remaining_s = found.common.offset_s,
            }
        }
        if clock == Clock::default() && odd.is_empty() {
            return Self { remaining_s, ..Self::default() };
        }
        let mut records = datasets.to_vec();
        for run in records.iter_mut().flat_map(|dataset| &mut dataset.runs) {
            let start_s = run.info.start_s.unwrap_or(0.0);
            run.truth.iter_mut().for_each(|sample| sample.t_s = clock.log_s(start_s, sample.t_s));
        }
        for (session, run) in odd.iter().rev() {
            records[*session].runs.remove(*run);
        }
        Self { drift, offsets, records: Some(records), remaining_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::RECORDS;
    use crate::small_robot::driven_runs::driven;

    fn found(offsets_s: &[f64]) -> Clocks {
        Clocks::of(&[driven(offsets_s)], RECORDS.min_common_clock_offset_s)
    }

    #[test]
    fn a_run_whose_clock_is_off_is_named_and_left_out() {
        let Clocks { offsets, records, .. } = found(&[0.0, 0.0, 0.3, 0.0, 0.0]);
        let [ClockOffset { runs, of }] = &offsets[..] else { panic!("one run: {offsets:?}") };
        assert_eq!(runs.as_deref(), Some(&["run-2".to_owned()][..]));
        // Poses are taken at hundredths of a second.
        assert!((of.offset_s - 0.3).abs() < 0.01, "{}", of.offset_s);
        assert_eq!(records.expect("one is off")[0].runs.len(), 4);
    }

    #[test]
    fn a_clock_that_is_off_in_all_runs_is_set_right() {
        let Clocks { offsets, records, remaining_s, .. } = found(&[-0.4; 4]);
        assert_eq!((offsets.len(), offsets[0].runs.as_deref(), remaining_s), (1, None, 0.0));
        assert!((offsets[0].of.offset_s + 0.4).abs() < 0.01, "{}", offsets[0].of.offset_s);
        // Rejects a shift the other way: the records are then off by nothing.
        let records = records.expect("all are off");
        assert!(Clocks::of(&records, RECORDS.min_common_clock_offset_s).offsets.is_empty());
        // What the fit can estimate is said to be there still.
        let small = found(&[0.05; 4]);
        assert!(small.offsets.is_empty() && (small.remaining_s - 0.05).abs() < 0.01, "{}", small.remaining_s);
        // Where a fit fails with it, it is taken off; rejects the same limit for both.
        let small = Clocks::of(&[driven(&[0.05; 4])], 0.04);
        assert!((small.offsets[0].of.offset_s - 0.05).abs() < 0.01, "{}", small.offsets[0].of.offset_s);
    }

    #[test]
    fn what_a_clock_gains_is_taken_off_over_the_session() {
        let mut dataset = driven(&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        for (number, run) in dataset.runs.iter_mut().enumerate() {
            run.info.start_s = Some(100.0 * number as f64);
        }
        let before_s = dataset.runs[6].truth[100].t_s;
        let of = Clocks::of(&[dataset], RECORDS.min_common_clock_offset_s);
        assert!(of.drift.is_some_and(|drift| drift.clock.of_session), "{:?}", of.drift);
        // Of the last run's stamps 0.6 s are taken, and a thousandth of its own.
        let records = of.records.expect("it drifts");
        assert!((records[0].runs[6].truth[100].t_s - (before_s - 0.61)).abs() < 0.02);
        assert!(Clocks::of(&records, RECORDS.min_common_clock_offset_s).drift.is_none(), "nothing is left");
    }
}

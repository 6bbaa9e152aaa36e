//! The search for clocks in the runs of one or several sessions.

use std::borrow::Cow;
use std::sync::OnceLock;

use dataset::{Dataset, Run};
use rayon::prelude::*;

use crate::clock::model::Clock;
use crate::clock::profile::RunClock;
use crate::clock::searched_run::{SearchedRun, count_rad};
use crate::run_log::{RunLog, m_per_rad};
use crate::session_check::SessionCheck;
use crate::settings::CLOCKS;
use crate::windows::Reading;

/// Runs whose clocks are compared.
pub struct ClockSearch<'r> {
    pub(super) runs: Vec<SearchedRun<'r>>,
    /// Their profiles by their stamps as they are.
    as_stamped: OnceLock<Vec<RunClock>>,
}

impl ClockSearch<'static> {
    /// The runs of all sessions that are to be asked, by the stated drives.
    #[must_use]
    pub fn of(datasets: &[Dataset], is_asked: impl Fn(&Run) -> bool + Sync) -> Self {
        let of_session = |(session, dataset): (usize, &Dataset)| {
            let SessionCheck { runs, robot, .. } = SessionCheck::new(&dataset.session());
            let asked = |log: RunLog| {
                let run = dataset.runs.iter().position(|run| run.info.id == log.id)?;
                let (number, count_rad, reading) = ((session, run), count_rad(&log), Reading::AS_IS);
                let (m_per_rad, separation_m) = (m_per_rad(&robot), robot.wheel_separation_m);
                let log = Cow::Owned(log);
                is_asked(&dataset.runs[run]).then_some(SearchedRun {
                    number,
                    log,
                    reading,
                    count_rad,
                    m_per_rad,
                    separation_m,
                })
            };
            runs.into_iter().filter_map(asked).collect::<Vec<_>>()
        };
        Self::of_runs(datasets.par_iter().enumerate().flat_map(of_session).collect())
    }
}

impl<'r> ClockSearch<'r> {
    /// One session by the drive that its windows show, if they do.
    pub(crate) fn of_session(check: &'r SessionCheck, reading: Reading, clock: Clock) -> Self {
        let shown = check.matched_at(reading, clock).and_then(|matched| matched.geometry);
        let (m_per_rad, separation_m) = match shown.filter(|found| !found.is_diluted) {
            Some(found) => (found.m_per_rad, found.separation_m),
            None => (check.m_per_rad(), check.robot.wheel_separation_m),
        };
        let of = |(run, log): (usize, &'r RunLog)| {
            let (number, count_rad, log) = ((0, run), count_rad(log), Cow::Borrowed(log));
            SearchedRun { number, log, reading, count_rad, m_per_rad, separation_m }
        };
        Self::of_runs(check.runs.iter().enumerate().map(of).collect())
    }

    fn of_runs(runs: Vec<SearchedRun<'r>>) -> Self {
        Self { runs, as_stamped: OnceLock::new() }
    }

    /// What the runs say of their clocks beside one of all.
    pub(super) fn profiles(&self, clock: Clock) -> Cow<'_, [RunClock]> {
        let of = || self.runs.par_iter().filter_map(|run| RunClock::of(run, clock, CLOCKS.max_offset_s)).collect();
        if clock == Clock::default() { Cow::Borrowed(self.as_stamped.get_or_init(of)) } else { Cow::Owned(of()) }
    }
}

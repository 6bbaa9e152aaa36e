//! Logs that are too large to be diagnosed as a whole: stretches of them, spread over everything, and what
//! all rows show.
//!
//! Runs are cut into stretches of one length. One of each k successive stretches is diagnosed, at a place
//! among the k that goes by the golden section: nothing that recurs in the log, such as a corner or the sense
//! of a circle, is always met at the same phase (Weyl 1916). Beforehand each row goes by once: rows off the
//! course of their neighbours are counted, and stretches whose counts show a fault of the records by
//! themselves are diagnosed too. Memory is that of the stretches that are diagnosed, whatever the log.

use std::collections::BTreeMap;

use dataset::{Blocks, Dataset, DatasetError, Run, RunSpans};
use effects::{CATALOGUE, Hypothesis, hypothesis};
use estimation::{Part, over_parts, rows_and_measurements};

use crate::checks::check::TestResult;
use crate::document::{RowFault, Subsample};
use crate::records::log_rows::{Rows, Spans};
use crate::settings::LARGE_LOG;
use crate::settings::large_log::{STRETCH_MEASUREMENTS, SUBSAMPLE_MEASUREMENTS};
use crate::text;

/// A log of which stretches are diagnosed.
#[derive(Debug, Clone)]
pub struct LargeLog {
    /// The stretches, each a run.
    datasets: Vec<Dataset>,
    /// What all rows show.
    rows: Rows,
    spans: Spans,
    /// What is diagnosed, and of how much.
    subsample: Subsample,
}

/// What goes by while a stretch is read.
struct Surveyed {
    rows: Rows,
    spans: RunSpans,
    rolled_m: f64,
    faults: Vec<&'static str>,
}

impl LargeLog {
    /// Reads datasets once in full, and then the stretches that are to be diagnosed.
    ///
    /// # Errors
    /// [`DatasetError`] when they cannot be read.
    pub fn read(datasets: &mut [Blocks]) -> Result<Self, DatasetError> {
        let stretches = stretches(datasets);
        let survey = |_: &Part, stretch: Dataset| Ok::<_, DatasetError>(surveyed(&stretch));
        let all = over_parts(datasets, &stretches, survey, |_, _| ())?;
        let (rows, measurements) = rows_and_measurements(datasets);
        let mut taken = spread(stretches.len(), wanted(stretches.len(), rows, measurements));
        let mut faults: BTreeMap<&'static str, Vec<usize>> = BTreeMap::new();
        for (number, of) in all.iter().enumerate() {
            of.faults.iter().for_each(|id| faults.entry(id).or_default().push(number));
        }
        for of_fault in faults.values() {
            let more = spread(of_fault.len(), of_fault.len().min(LARGE_LOG.max_faulty_stretches));
            taken.extend(more.into_iter().map(|place| of_fault[place]));
        }
        taken.sort_unstable();
        taken.dedup();
        let read = read(datasets, &stretches, &all, &taken)?;
        let runs = || read.iter().flat_map(|dataset| &dataset.runs);
        let mut spans = Spans::default();
        stretches.iter().zip(&all).for_each(|(part, of)| spans.add(part.run, of.spans));
        let mut subsample = Subsample {
            sentence: String::new(),
            rows,
            diagnosed_rows: runs().map(|run| run.odometry.t_s.len()).sum(),
            measurements,
            diagnosed_measurements: runs().map(measured).sum(),
            stretches: stretches.len(),
            diagnosed_stretches: taken.len(),
            row_faults: faults
                .iter()
                .map(|(id, of_fault)| RowFault {
                    id: (*id).to_owned(),
                    stretches: of_fault.len(),
                    diagnosed_stretches: of_fault.iter().filter(|number| taken.binary_search(number).is_ok()).count(),
                })
                .collect(),
        };
        subsample.sentence = text::subsample(&subsample);
        let rows = all.iter().fold(Rows::default(), |sum, of| sum + of.rows);
        Ok(Self { datasets: read, rows, spans, subsample })
    }

    /// The stretches that are diagnosed, each a run; one of a run that was cut has the instant of its first
    /// row in its id.
    #[must_use]
    pub fn datasets(&self) -> &[Dataset] {
        &self.datasets
    }

    /// What is diagnosed, and of how much.
    #[must_use]
    pub const fn subsample(&self) -> &Subsample {
        &self.subsample
    }

    /// The test of all rows.
    pub(crate) fn check_rows(&self) -> Option<TestResult> {
        self.rows.test()
    }

    /// The test of the spans of all runs.
    pub(crate) fn check_spans(&self) -> Option<TestResult> {
        self.spans.test()
    }
}

/// The runs in stretches.
fn stretches(datasets: &[Blocks]) -> Vec<Part> {
    let (rows, measurements) = rows_and_measurements(datasets);
    let wanted = (STRETCH_MEASUREMENTS.saturating_mul(rows) / measurements.max(1))
        .min(STRETCH_MEASUREMENTS * LARGE_LOG.subsample_rows / SUBSAMPLE_MEASUREMENTS);
    let blocks = wanted.div_ceil(Blocks::ROWS).max(1);
    let of_dataset = |(number, dataset): (usize, &Blocks)| {
        let counts: Vec<usize> = (0..dataset.infos().len()).map(|run| dataset.blocks(run)).collect();
        counts.into_iter().enumerate().flat_map(move |(run, count)| Part::of_run((number, run), count, blocks))
    };
    datasets.iter().enumerate().flat_map(of_dataset).collect()
}

/// How many of the stretches are diagnosed.
fn wanted(stretches: usize, rows: usize, measurements: usize) -> usize {
    let share = |most: usize, of: usize| stretches.saturating_mul(most) / of.max(1);
    share(SUBSAMPLE_MEASUREMENTS, measurements).min(share(LARGE_LOG.subsample_rows, rows)).clamp(1, stretches.max(1))
}

/// One place in each of `wanted` successive parts of `all` places.
fn spread(all: usize, wanted: usize) -> Vec<usize> {
    let place = |stratum: usize| {
        let [from, to] = [stratum, stratum + 1].map(|edge| edge * all / wanted);
        let share = (LARGE_LOG.golden_section * stratum as f64).fract();
        from + (share * (to - from) as f64) as usize
    };
    if all == 0 { Vec::new() } else { (0..wanted).map(place).collect() }
}

/// What the rows of a stretch show by themselves.
fn surveyed(stretch: &Dataset) -> Surveyed {
    let session = stretch.session();
    let run = session.runs[0];
    let is_shown = |id: &&'static str| {
        let Some(Hypothesis::Records(corrections)) = hypothesis(id) else { return false };
        let leaves_a_trace = effects::description(id).is_some_and(|of| of.record_fault.leaves_a_trace);
        leaves_a_trace && corrections(stretch).iter().any(|correction| correction.visible_in_log)
    };
    Surveyed {
        rows: Rows::of(run.run()),
        spans: RunSpans::of(run.run()),
        rolled_m: run.rolled_m(session.robot),
        faults: CATALOGUE.iter().copied().filter(is_shown).collect(),
    }
}

/// The stretches that are taken, as runs of their datasets.
fn read(
    datasets: &mut [Blocks],
    stretches: &[Part],
    all: &[Surveyed],
    taken: &[usize],
) -> Result<Vec<Dataset>, DatasetError> {
    let mut read: Vec<Dataset> = datasets.iter().map(|dataset| dataset.header().clone()).collect();
    let mut session_m = vec![0.0; datasets.len()];
    let mut before = 0;
    for &number in taken {
        let Part { run: (dataset, run), blocks } = &stretches[number];
        for (part, of) in stretches[before..number].iter().zip(&all[before..number]) {
            session_m[part.run.0] += of.rolled_m;
        }
        before = number;
        let is_whole = blocks.len() == datasets[*dataset].blocks(*run);
        for mut run in datasets[*dataset].read(*run, blocks.clone())?.dataset.runs {
            run.session_m = Some(session_m[*dataset]);
            if let (false, Some(first_s)) = (is_whole, run.odometry.t_s.first()) {
                run.info.id = format!("{} from {first_s} s", run.info.id);
            }
            read[*dataset].runs.push(run);
        }
    }
    read.retain(|dataset| !dataset.runs.is_empty());
    Ok(read)
}

/// Number of measurements of a run, of whatever.
fn measured(run: &Run) -> usize {
    let of_poses = run.truth.len() + run.headings.len() + run.displacements.len() + run.point_readings.len();
    of_poses + run.wheel_reference.len() + run.revisits.len() + run.distances.len() + run.walls.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_of_all_kinds_count() {
        use dataset::{HeadingReading, TapeDistance, TruthSample, WallReading, WheelSpeed};
        let wall = WallReading {
            t_s: 0.0,
            wall: "w".to_owned(),
            distance_m: None,
            heading_rad: None,
            sigma_m: None,
            sigma_rad: None,
        };
        let run = Run {
            truth: vec![TruthSample::new(0.0, 0.0, 0.0, None); 100],
            headings: vec![HeadingReading { t_s: 0.0, theta_rad: 0.0, sigma_rad: 1.0 }; 20],
            wheel_reference: vec![WheelSpeed { t_s: 0.0, speed_m_s: kinematics::Wheels::both(0.0) }; 7],
            distances: vec![TapeDistance { t0_s: 0.0, t1_s: 1.0, distance_m: 1.0, sigma_m: 1.0 }; 3],
            walls: vec![wall; 2000],
            ..Run::default()
        };
        // Rejects a kind that is left out, or taken off.
        assert_eq!((measured(&run), measured(&Run::default())), (2130, 0));
    }

    #[test]
    fn places_are_spread_over_all_and_meet_nothing_that_recurs_at_one_phase() {
        assert_eq!(spread(0, 1), [0; 0]);
        assert_eq!(spread(5, 5), [0, 1, 2, 3, 4]);
        let places = spread(1000, 50);
        assert!(places.iter().enumerate().all(|(stratum, place)| place / 20 == stratum), "{places:?}");
        // Rejects each 20th place: all would be of one phase.
        for period in [2, 4, 5, 10, 20] {
            let of_phase = |phase: usize| places.iter().filter(|place| *place % period == phase).count();
            let fair = 50.0 / period as f64;
            for phase in 0..period {
                assert!((of_phase(phase) as f64 - fair).abs() <= 3.0, "{} of phase {phase}/{period}", of_phase(phase));
            }
        }
    }

    #[test]
    fn rows_and_measurements_bound_what_is_taken_and_something_is() {
        assert_eq!(wanted(1000, 2 * SUBSAMPLE_MEASUREMENTS, 2 * SUBSAMPLE_MEASUREMENTS), 500);
        assert_eq!(wanted(1000, 10 * LARGE_LOG.subsample_rows, SUBSAMPLE_MEASUREMENTS), 100);
        assert_eq!(wanted(1000, 10, 10), 1000);
        assert_eq!(wanted(1, usize::MAX >> 20, 1), 1);
    }
}

//! Which parts of a log to try, the most first: whole runs, and then stretches of runs.

use std::collections::BTreeSet;

use dataset::{Dataset, Run, WheelLog};
use preflight::Problem;

/// Stretches are down to this share of a run: a part of a thousand rows of an hour's log at 10 Hz.
const MIN_SHARE: f64 = 1.0 / 32.0;

/// A part of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// One run in so many is kept.
    one_in: usize,
    /// How much of each run is kept, from 0 to 1.
    share: f64,
    /// Where the stretch is in its run, from 0 at the beginning to 1 at the end.
    place: f64,
    by: Clock,
}

/// How the measurements of a stretch are found. A clock that is wrong gives the wrong ones, and whether it is
/// wrong is what the log is about: both are tried.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Clock {
    /// Those between the instants of its rows.
    Instants,
    /// Those of the same share of the measurements.
    Shares,
}

impl Part {
    const WHOLE: Self = Self { one_in: 1, share: 1.0, place: 0.0, by: Clock::Instants };

    /// The parts of a log whose largest session has so many runs, whole runs first.
    pub(super) fn all(runs: usize) -> Vec<Self> {
        let one_in =
            || std::iter::successors(Some(1), |one_in| Some(2 * one_in)).take_while(|one_in| *one_in <= runs.max(1));
        let mut parts: Vec<Self> = one_in().map(|one_in| Self { one_in, ..Self::WHOLE }).collect();
        let mut share = 0.5;
        while share >= MIN_SHARE {
            for one_in in one_in() {
                for place in [0.0, 0.5, 1.0] {
                    parts.extend([Clock::Instants, Clock::Shares].map(|by| Self { one_in, share, place, by }));
                }
            }
            share /= 2.0;
        }
        parts
    }

    /// The part of a log; `None` where a session would have nothing left.
    pub(super) fn of(&self, datasets: &[Dataset], problems: &[Problem]) -> Option<Vec<Dataset>> {
        // The first run that each problem names shows it.
        let named = problems.iter().filter_map(|problem| problem.runs.as_ref()?.first().map(String::as_str)).collect();
        datasets.iter().map(|dataset| self.session(dataset, &named)).collect()
    }

    fn session(&self, dataset: &Dataset, named: &BTreeSet<&str>) -> Option<Dataset> {
        let runs = &dataset.runs;
        // Runs of all protocols: every second one of runs that alternate would be of one.
        let mut by_protocol: Vec<usize> = (0..runs.len()).collect();
        by_protocol.sort_by_key(|run| runs[*run].info.protocol);
        let mut kept: BTreeSet<usize> = by_protocol.into_iter().step_by(self.one_in).collect();
        kept.extend((0..runs.len()).filter(|run| named.contains(runs[*run].info.id.as_str())));
        let mut part = dataset.header();
        part.runs = kept.into_iter().filter_map(|run| self.stretch(&runs[run])).collect();
        (!part.runs.is_empty()).then_some(part)
    }

    fn stretch(&self, run: &Run) -> Option<Run> {
        if self.share == 1.0 {
            return Some(run.clone());
        }
        let of_span = |[from_s, to_s]: [f64; 2]| {
            let begins_s = from_s + self.place * (1.0 - self.share) * (to_s - from_s);
            [begins_s, begins_s + self.share * (to_s - from_s)]
        };
        let t_s = &run.odometry.t_s;
        let rows_s = of_span([*t_s.first()?, *t_s.last()?]);
        let measured_s = match self.by {
            Clock::Instants => rows_s,
            Clock::Shares => of_span(run.measured_span_s()?),
        };
        let (first, past) = (t_s.partition_point(|t_s| *t_s < rows_s[0]), t_s.partition_point(|t_s| *t_s <= rows_s[1]));
        let mut part = run.clone();
        part.odometry.t_s = t_s[first..past].to_vec().into();
        match &mut part.odometry.wheels {
            WheelLog::Ticks(of) => [&mut of.left, &mut of.right].into_iter().for_each(|of| cut(of, first, past)),
            WheelLog::Angles(of) | WheelLog::Speeds(of) => {
                [&mut of.left, &mut of.right].into_iter().for_each(|of| cut(of, first, past));
            }
            WheelLog::Twist { v_mps, omega_radps } => {
                [v_mps, omega_radps].into_iter().for_each(|of| cut(of, first, past));
            }
        }
        part.odometry.extra.values_mut().for_each(|of| cut(of, first, past));
        part.gyro.retain(|of| (rows_s[0]..=rows_s[1]).contains(&of.t_s));
        let is_in = |t_s: f64| (measured_s[0]..=measured_s[1]).contains(&t_s);
        if let Some(sigmas) = &mut part.truth_sigma {
            let mut samples = run.truth.iter();
            sigmas.retain(|_| samples.next().is_some_and(|of| is_in(of.t_s)));
        }
        part.truth.retain(|of| is_in(of.t_s));
        part.headings.retain(|of| is_in(of.t_s));
        part.point_readings.retain(|of| is_in(of.t_s));
        part.wheel_reference.retain(|of| is_in(of.t_s));
        part.walls.retain(|of| is_in(of.t_s));
        part.displacements.retain(|of| is_in(of.t0_s) && is_in(of.t1_s));
        part.revisits.retain(|of| is_in(of.t0_s) && is_in(of.t1_s));
        part.distances.retain(|of| is_in(of.t0_s) && is_in(of.t1_s));
        (past > first && (part.measured_span_s().is_some() || part.has_gyro())).then_some(part)
    }
}

fn cut<T>(column: &mut Vec<T>, first: usize, past: usize) {
    column.truncate(past);
    column.drain(..first);
}

/// Rows of all tables, for how large a bundle is likely to be.
pub(super) fn rows(datasets: &[Dataset]) -> usize {
    let runs = datasets.iter().flat_map(|dataset| &dataset.runs);
    runs.map(|run| run.odometry.t_s.len() + run.truth.len() + run.gyro.len() + run.displacements.len()).sum()
}

#[cfg(test)]
mod tests {
    use dataset::{NominalRobot, Odometry, Protocol, Provenance, RunInfo, TruthNoise, TruthSample};
    use kinematics::Wheels;

    use super::*;

    /// Runs of 101 rows in 10 s, seen from 100 s on by the instrument's clock.
    fn dataset() -> Dataset {
        let run = |number: usize| {
            let protocol = Some(if number.is_multiple_of(2) { Protocol::Straight } else { Protocol::Spin });
            let counts: Vec<i64> = (0..101).collect();
            Run {
                info: RunInfo { id: format!("run-{number}"), protocol, ..RunInfo::default() },
                odometry: Odometry {
                    t_s: counts.iter().map(|row| *row as f64 / 10.0).collect(),
                    wheels: WheelLog::Ticks(Wheels { left: counts.clone(), right: counts }),
                    ..Odometry::default()
                },
                truth: (0..11).map(|row| TruthSample::new(100.0 + f64::from(row), 0.0, 0.0, None)).collect(),
                ..Run::default()
            }
        };
        let robot = NominalRobot {
            left_wheel_diameter_m: 0.1,
            right_wheel_diameter_m: 0.1,
            wheel_separation_m: 0.3,
            ticks_per_rev: Some(1000.0),
            counter_bits: None,
        };
        Dataset {
            provenance: Provenance::default(),
            robot,
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: (0..8).map(run).collect(),
        }
    }

    #[test]
    fn runs_that_are_kept_are_of_all_protocols() {
        let part = Part { one_in: 4, ..Part::WHOLE }.of(&[dataset()], &[]).expect("something is left");
        let ids: Vec<&str> = part[0].runs.iter().map(|run| &run.info.id[..]).collect();
        assert_eq!(ids, ["run-0", "run-1"]);
        assert_eq!(rows(&part), 2 * (101 + 11));
    }

    #[test]
    fn a_stretch_has_the_measurements_of_its_share_or_of_its_instants() {
        let part = |by, place| Part { one_in: 1, share: 0.5, place, by }.of(&[dataset()], &[]);
        let found = part(Clock::Shares, 1.0).expect("something is left");
        let run = &found[0].runs[0];
        assert_eq!([run.odometry.t_s[0], run.odometry.t_s[50]], [5.0, 10.0]);
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("ticks") };
        assert_eq!([ticks.left.len(), ticks.right.len(), run.odometry.t_s.len()], [51; 3]);
        assert_eq!(ticks.left[0], 50);
        assert_eq!(run.measured_span_s(), Some([105.0, 110.0]));
        // The instrument's clock is 100 s ahead: nothing was seen between these instants.
        assert_eq!(part(Clock::Instants, 1.0), None);
    }

    #[test]
    fn parts_become_smaller_and_begin_with_all() {
        let parts = Part::all(8);
        assert_eq!(parts[0], Part::WHOLE);
        assert!(parts.is_sorted_by(|a, b| a.share >= b.share) && parts.iter().all(|part| part.share >= MIN_SHARE));
        assert!(parts.iter().any(|part| part.one_in == 8));
    }
}

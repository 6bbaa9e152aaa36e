//! Clocks of instrument and robot that are far apart: of all runs, or of one among many.
//!
//! Each run has a profile likelihood of its offset ([`super::profile`]). Their mean is the offset of all; a
//! run that is far from it has a clock of its own.

use std::collections::BTreeMap;
use std::iter::successors;

use rayon::prelude::*;

use crate::clock::model::Clock;
use crate::clock::profile::{Profile, RunClock};
use crate::clock::search::ClockSearch;
use crate::clock::searched_run::SearchedRun;
use crate::settings::CLOCKS;

/// An offset of the instrument's clock: its poses are of so long before their stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockOffset {
    /// The offset, seconds.
    pub offset_s: f64,
    /// Its standard deviation, seconds.
    pub sigma_s: f64,
    /// Log likelihood over that without it.
    pub gain: f64,
}

impl ClockOffset {
    /// Whether it gains so much that it is no chance.
    #[must_use]
    pub fn is_certain(&self) -> bool {
        self.gain > CLOCKS.min_gain
    }
}

/// The offsets of runs beside a clock.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockOffsets {
    /// What all runs have in common, whether it matters or not.
    pub common: ClockOffset,
    /// Runs that have another clock, by session and run.
    pub odd: Vec<((usize, usize), ClockOffset)>,
}

/// The clock of an instrument in the runs of a session.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SessionClock {
    /// Of all runs but the odd ones.
    pub of_all: Clock,
    /// Ids of runs that have another clock, with its offset.
    pub odd_runs: BTreeMap<String, ClockOffset>,
}

impl SessionClock {
    /// Of a run, unless it is an odd one.
    #[must_use]
    pub fn of_run(&self, id: &str) -> Option<Clock> {
        (!self.odd_runs.contains_key(id)).then_some(self.of_all)
    }
}

/// A run's own offset.
struct OfRun<'p> {
    run: (usize, usize),
    profile: &'p Profile,
}

impl ClockSearch<'_> {
    /// The offsets of runs beside a clock; `None` where no run says one.
    #[must_use]
    pub fn offsets(&self, near: Clock) -> Option<ClockOffsets> {
        let clocks = self.profiles(near);
        // Where many runs have clocks of their own, none is the odd one: errors that are alike for seconds
        // say so of any run.
        let few = (self.runs.len() / CLOCKS.min_runs_per_odd).max(1);
        let is_silent = |run: &&SearchedRun<'_>| clocks.iter().all(|of| of.run != run.number || of.whole.is_none());
        let silent: Vec<&SearchedRun<'_>> = self.runs.iter().filter(is_silent).collect();
        // Where a run begins or ends in motion, fewer of its poses tell of farther offsets.
        let ranges_s = || successors(Some(CLOCKS.max_far_offset_s), |range_s| Some(0.5 * range_s));
        let far_of = |run: &&SearchedRun<'_>| {
            let mut all = ranges_s().take_while(|range_s| *range_s > CLOCKS.max_offset_s);
            all.find_map(|range_s| RunClock::of(run, near, range_s).filter(|of| of.whole.is_some()))
        };
        let far: Vec<RunClock> =
            if silent.len() > few { Vec::new() } else { silent.par_iter().filter_map(far_of).collect() };
        let profiles = clocks.iter().chain(&far);
        let all: Vec<OfRun<'_>> =
            profiles.filter_map(|of| Some(OfRun { run: of.run, profile: of.whole.as_ref()? })).collect();
        let common_s = common_offset_s(&all)?;
        let is_odd = |of: &&OfRun<'_>| {
            let apart_s = (of.profile.offset_s - common_s).abs();
            all.len() >= CLOCKS.min_runs
                && apart_s >= of.profile.tolerance_s()
                && of.profile.gain_over(common_s) > CLOCKS.min_gain
        };
        let odd: Vec<&OfRun<'_>> = all.iter().filter(is_odd).collect();
        let odd = if odd.len() <= few { odd } else { Vec::new() };
        let own = |of: &OfRun<'_>| {
            let &Profile { offset_s, sigma_s, .. } = of.profile;
            (of.run, ClockOffset { offset_s, sigma_s, gain: of.profile.gain_over(common_s) })
        };
        let information: f64 = all.iter().map(|of| of.profile.sigma_s.powi(-2)).sum();
        let common = ClockOffset {
            offset_s: common_s,
            sigma_s: information.sqrt().recip(),
            gain: all.iter().map(|of| of.profile.gain_over(0.0) - of.profile.gain_over(common_s)).sum(),
        };
        Some(ClockOffsets { common, odd: odd.into_iter().map(own).collect() })
    }
}

/// The mean of the runs' own offsets, by their precision, without those that are off: of all runs' offsets,
/// the one that most others lie near says which.
fn common_offset_s(all: &[OfRun<'_>]) -> Option<f64> {
    let apart = |of: &OfRun<'_>, offset_s: f64| (of.profile.offset_s - offset_s) / of.profile.tolerance_s();
    let cost = |offset_s: f64| -> f64 { all.iter().map(|of| apart(of, offset_s).powi(2).min(1.0)).sum() };
    let own = all.iter().map(|of| of.profile.offset_s);
    let near_s = own.min_by(|a, b| cost(*a).total_cmp(&cost(*b)))?;
    let (mut sum, mut weights) = (0.0, 0.0);
    for Profile { offset_s, sigma_s, .. } in all.iter().filter(|of| apart(of, near_s).abs() < 1.0).map(|of| of.profile)
    {
        sum += offset_s * sigma_s.powi(-2);
        weights += sigma_s.powi(-2);
    }
    Some(sum / weights)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use dataset::{Dataset, TruthSample, WheelLog};
    use kinematics::{Wheels, wrap_to_pi};

    use super::*;
    use crate::clock::driven_runs::driven;
    use crate::golden::assert_unmoved;

    fn offsets(datasets: &[Dataset]) -> ClockOffsets {
        ClockSearch::of(datasets, |_| true).offsets(Clock::default()).expect("runs that drive")
    }

    fn odd_runs(datasets: &[Dataset]) -> Vec<(usize, f64)> {
        offsets(datasets).odd.iter().map(|((_, run), of)| (*run, of.offset_s)).collect()
    }

    #[test]
    fn a_run_whose_clock_is_off_is_the_odd_one() {
        let found = odd_runs(&[driven(&[0.0, 0.0, 0.3, 0.0, 0.0])]);
        // Poses are taken at hundredths of a second.
        assert!(matches!(found[..], [(2, offset_s)] if (offset_s - 0.3).abs() < 0.01), "{found:?}");
        // Farther than profiles of all runs go; of two such runs neither is the odd one.
        let found = odd_runs(&[driven(&[0.0, 0.0, 0.0, 2.0, 0.0])]);
        assert!(matches!(found[..], [(3, offset_s)] if (offset_s - 2.0).abs() < 0.01), "{found:?}");
        assert!(odd_runs(&[driven(&[0.0, 0.0, 2.0, 2.5, 0.0])]).is_empty());
    }

    #[test]
    fn a_short_run_between_two_rests_says_its_offset() {
        // A quarter of a second less than two seconds of driving, with half a second at rest on either side:
        // rejects a margin of the largest offset at both ends, which leaves no pose.
        let mut log = driven(&[0.0; 4]);
        let turned = |t_s: f64| 3.0 * (t_s - 0.5).clamp(0.0, 1.75) - (4.0 * (t_s - 0.5).clamp(0.0, 1.75)).sin() * 0.75;
        let turn_rate = log.robot.left_wheel_diameter_m / log.robot.wheel_separation_m;
        let run = &mut log.runs[2];
        run.odometry.t_s = (0..=137).map(|row| 0.02 * f64::from(row)).collect();
        let angles = |sign: f64| run.odometry.t_s.iter().map(|t_s| sign * turned(*t_s)).collect();
        run.odometry.wheels = WheelLog::Angles(Wheels { left: angles(-1.0), right: angles(1.0) });
        let pose = |k: u32| {
            let t_s = 0.05 * f64::from(k);
            TruthSample::new(t_s, 0.0, 0.0, Some(wrap_to_pi(turn_rate * turned(t_s - 0.3))))
        };
        run.truth = (0..55).map(pose).collect();
        let found = odd_runs(&[log]);
        assert!(matches!(found[..], [(2, offset_s)] if (offset_s - 0.3).abs() < 0.01), "{found:?}");
    }

    #[test]
    fn a_clock_that_is_off_in_all_runs_is_no_odd_one() {
        for offset_s in [-0.4, 0.05] {
            let found = offsets(&[driven(&[offset_s; 4])]);
            assert!((found.common.offset_s - offset_s).abs() < 0.01 && found.odd.is_empty(), "{found:?}");
            assert!(found.common.is_certain());
            // Beside a clock with this offset nothing is left. Rejects a shift the other way.
            let near = Clock { offset_s, ..Clock::default() };
            let left = ClockSearch::of(&[driven(&[offset_s; 4])], |_| true).offsets(near).expect("runs that drive");
            assert!(left.common.offset_s.abs() < 0.01 && !left.common.is_certain(), "{left:?}");
        }
        assert!(odd_runs(&[driven(&[0.0, 0.3])]).is_empty(), "of two, either is the odd one");
        assert!(odd_runs(&[driven(&[0.0, 0.3, 0.0, -0.2, 0.0, 0.0])]).is_empty(), "two of six are not odd");
    }

    #[test]
    fn of_an_even_spin_the_rounding_of_counts_says_nothing() {
        // 155 ticks a turn; poses at 20 Hz, exact. Rejects squares without the rounding's own: several of
        // these speeds, whose poses fall alike between counts, have an offset then.
        let spin = |number: u32| {
            let rate_rad_s = 2.0 + 0.05 * f64::from(number);
            let mut log = driven(&[0.0; 4]);
            let of_robot = &log.robot;
            let turn_rate = rate_rad_s * of_robot.left_wheel_diameter_m / of_robot.wheel_separation_m;
            let run = &mut log.runs[2];
            let t_s: Vec<f64> = (0..800).map(|row| f64::from(row) / 123.0).collect();
            let rad = std::f64::consts::TAU / 155.0;
            let counted = |sign: f64| t_s.iter().map(|t_s| (sign * rate_rad_s * t_s / rad).floor() * rad).collect();
            run.odometry.wheels = WheelLog::Angles(Wheels { left: counted(-1.0), right: counted(1.0) });
            run.odometry.t_s = t_s.clone().into();
            let pose = |k: u32| {
                let t_s = 0.05 * f64::from(k) + 0.003;
                TruthSample::new(t_s, 0.0, 0.0, Some(wrap_to_pi(turn_rate * t_s)))
            };
            run.truth = (0..125).map(pose).collect();
            log
        };
        for number in 0..40 {
            let found = offsets(&[spin(number)]);
            assert!(found.odd.is_empty() && found.common.offset_s.abs() < 0.05, "{number}: {found:?}");
        }
    }

    #[test]
    fn of_counts_that_do_not_follow_the_robot_nothing_is_said() {
        let mut swapped = driven(&[0.3; 4]);
        for run in &mut swapped.runs {
            let WheelLog::Angles(Wheels { left, right }) = &mut run.odometry.wheels else { unreachable!("angles") };
            std::mem::swap(left, right);
        }
        assert_eq!(ClockSearch::of(&[swapped], |_| true).offsets(Clock::default()), None);
    }

    #[test]
    fn regress_no_number_of_a_clock_moves() {
        let mut text = String::new();
        let odd = [0.0, 0.0, 0.3, 0.0, 0.0, -0.1];
        // A run that is off beside all that are off by another offset, in two sessions.
        let both = [driven(&[0.2, 0.2, 0.2, -0.3]), driven(&[0.2, 0.2])];
        for (name, datasets) in
            [("odd", vec![driven(&odd)]), ("early", vec![driven(&[-0.17; 5])]), ("both", both.to_vec())]
        {
            let ClockOffsets { common, odd } = offsets(&datasets);
            text += &format!("{name}: {common:?} {odd:?}\n");
        }
        let mut dataset = driven(&[0.05, 0.0]);
        // Errors of the headings, and wheels that are larger.
        for (number, sample) in dataset.runs[1].truth.iter_mut().enumerate() {
            let theta_rad = sample.theta_rad().map(|rad| rad + 2e-3 * (1.7 * number as f64).sin());
            *sample = TruthSample::new(sample.t_s, 1.02 * sample.x_m, 1.02 * sample.y_m, theta_rad);
        }
        for clock in ClockSearch::of(&[dataset], |_| true).profiles(Clock::default()).iter() {
            let of = clock.whole.as_ref().expect("it drives");
            text += &format!("{:?} {} {}\n", of.costs, of.offset_s, of.sigma_s);
        }
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/clocks.txt");
        assert_unmoved(&file, &text);
    }
}

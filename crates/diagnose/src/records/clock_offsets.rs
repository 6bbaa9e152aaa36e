//! Clocks of instrument and robot that are far apart: of all runs, or of one among many.
//!
//! Before anything is fitted, each run has a profile likelihood of its offset
//! ([`crate::records::clock_profile`]). An offset of all runs is taken off before the fit. A run with an
//! offset of its own is left out: it would be explained by whatever term it pays best.

use dataset::Dataset;
use rules::Rule;

use crate::records::clock_profile::{Profile, RunClock};
use crate::records::names::run_name;
use crate::settings::RECORDS;

/// An offset of the instrument's clock: its poses are of so long before their stamps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ClockOffset {
    /// Ids of the runs, where it is not of all.
    pub(crate) runs: Option<Vec<String>>,
    pub(crate) offset_s: f64,
    pub(crate) sigma_s: f64,
    /// Log likelihood over that without it.
    pub(crate) gain: f64,
}

/// What was found, and the records without it.
#[derive(Default)]
pub(crate) struct Clocks {
    pub(crate) offsets: Vec<ClockOffset>,
    /// Where there are offsets.
    pub(crate) records: Option<Vec<Dataset>>,
    /// The offset that all runs have still, seconds: small enough for the fit to estimate.
    pub(crate) remaining_s: f64,
}

/// A run's own offset.
struct OfRun<'p> {
    run: (usize, usize),
    profile: &'p Profile,
}

/// Looks for offsets; one of all runs counts from `min_common_s` on.
pub(crate) fn clock_offsets(datasets: &[Dataset], clocks: &[RunClock], min_common_s: f64) -> Clocks {
    let all: Vec<OfRun<'_>> =
        clocks.iter().filter_map(|clock| Some(OfRun { run: clock.run, profile: clock.whole.as_ref()? })).collect();
    let Some(common_s) = common_offset_s(&all) else { return Clocks::default() };
    let is_odd = |of: &&OfRun<'_>| {
        let apart_s = (of.profile.offset_s - common_s).abs();
        all.len() >= RECORDS.min_clock_runs
            && apart_s >= of.profile.tolerance_s()
            && of.profile.gain_over(common_s) > RECORDS.min_clock_gain
    };
    let odd: Vec<&OfRun<'_>> = all.iter().filter(is_odd).collect();
    // Where many runs have clocks of their own, none is the odd one: errors that are alike for seconds say so
    // of any run.
    let few = (all.len() / RECORDS.min_runs_per_odd_clock).max(1);
    let odd = if odd.len() <= few { odd } else { Vec::new() };
    let own = |of: &&OfRun<'_>| ClockOffset {
        runs: Some(vec![run_name(datasets, of.run.0, of.run.1)]),
        offset_s: of.profile.offset_s,
        sigma_s: of.profile.sigma_s,
        gain: of.profile.gain_over(common_s),
    };
    let mut offsets: Vec<ClockOffset> = odd.iter().map(own).collect();
    let gain: f64 = all.iter().map(|of| of.profile.gain_over(0.0) - of.profile.gain_over(common_s)).sum();
    let is_common = common_s.abs() >= min_common_s && gain > RECORDS.min_clock_gain;
    if is_common {
        let information: f64 = all.iter().map(|of| of.profile.sigma_s.powi(-2)).sum();
        offsets.push(ClockOffset { runs: None, offset_s: common_s, sigma_s: information.sqrt().recip(), gain });
    }
    if offsets.is_empty() || !Rule::ClockOffsets.applies(true) {
        return Clocks { remaining_s: common_s, ..Clocks::default() };
    }
    let mut records = datasets.to_vec();
    if is_common {
        let runs = records.iter_mut().flat_map(|dataset| &mut dataset.runs);
        runs.flat_map(|run| &mut run.truth).for_each(|sample| sample.t_s -= common_s);
    }
    for of in odd.iter().rev() {
        records[of.run.0].runs.remove(of.run.1);
    }
    Clocks { offsets, records: Some(records), remaining_s: if is_common { 0.0 } else { common_s } }
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
    use dataset::{TruthSample, WheelLog};
    use kinematics::{Wheels, wrap_to_pi};

    use super::*;
    use crate::records::clock_profile::tests::driven;
    use crate::settings::RECORDS;
    use crate::small_robot::assert_unmoved;

    fn offsets(datasets: &[Dataset]) -> Clocks {
        clock_offsets(datasets, &RunClock::of_all(datasets), RECORDS.min_common_clock_offset_s)
    }

    #[test]
    fn a_run_whose_clock_is_off_is_named_and_left_out() {
        let found = offsets(&[driven(&[0.0, 0.0, 0.3, 0.0, 0.0])]);
        let [offset] = &found.offsets[..] else { panic!("one run") };
        assert_eq!(offset.runs.as_deref(), Some(&["run-2".to_owned()][..]));
        // Poses are taken at hundredths of a second.
        assert!((offset.offset_s - 0.3).abs() < 0.01, "{}", offset.offset_s);
        assert_eq!(found.records.expect("one is off")[0].runs.len(), 4);
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
        let found = offsets(&[log]);
        let [offset] = &found.offsets[..] else { panic!("one run: {:?}", found.offsets) };
        assert_eq!(offset.runs.as_deref(), Some(&["run-2".to_owned()][..]));
        assert!((offset.offset_s - 0.3).abs() < 0.01, "{}", offset.offset_s);
    }

    #[test]
    fn a_clock_that_is_off_in_all_runs_is_set_right() {
        let found = offsets(&[driven(&[-0.4; 4])]);
        assert_eq!((found.offsets.len(), found.offsets[0].runs.as_deref()), (1, None));
        assert!((found.offsets[0].offset_s + 0.4).abs() < 0.01, "{}", found.offsets[0].offset_s);
        // Rejects a shift the other way: the records are then off by nothing.
        let is_none = |datasets: &[Dataset]| offsets(datasets).offsets.is_empty();
        assert!(is_none(&found.records.expect("all are off")));
        // What the fit can estimate is said to be there still.
        let small = offsets(&[driven(&[0.05; 4])]);
        assert!(small.offsets.is_empty() && (small.remaining_s - 0.05).abs() < 0.01, "{}", small.remaining_s);
        // Where a fit fails with it, it is taken off; rejects the same limit for both.
        let small = [driven(&[0.05; 4])];
        let small = clock_offsets(&small, &RunClock::of_all(&small), 0.04);
        assert!((small.offsets[0].offset_s - 0.05).abs() < 0.01, "{}", small.offsets[0].offset_s);
        assert!(is_none(&[driven(&[0.0, 0.3])]), "of two, either is the odd one");
        assert!(is_none(&[driven(&[0.0, 0.3, 0.0, -0.2, 0.0, 0.0])]), "two of six are not odd");
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
            assert!(offsets(&[spin(number)]).offsets.is_empty(), "{number}");
        }
    }

    #[test]
    fn of_counts_that_do_not_follow_the_robot_nothing_is_said() {
        let mut swapped = driven(&[0.3; 4]);
        for run in &mut swapped.runs {
            let WheelLog::Angles(Wheels { left, right }) = &mut run.odometry.wheels else { unreachable!("angles") };
            std::mem::swap(left, right);
        }
        assert!(offsets(&[swapped]).offsets.is_empty());
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
            let found = offsets(&datasets);
            let runs: Option<Vec<usize>> =
                found.records.map(|of| of.iter().map(|session| session.runs.len()).collect());
            text += &format!("{name}: {:?} {:?} {runs:?}\n", found.offsets, found.remaining_s);
        }
        let mut dataset = driven(&[0.05, 0.0]);
        // Errors of the headings, and wheels that are larger.
        for (number, sample) in dataset.runs[1].truth.iter_mut().enumerate() {
            let theta_rad = sample.theta_rad().map(|rad| rad + 2e-3 * (1.7 * number as f64).sin());
            *sample = TruthSample::new(sample.t_s, 1.02 * sample.x_m, 1.02 * sample.y_m, theta_rad);
        }
        for clock in RunClock::of_all(&[dataset]) {
            let of = clock.whole.expect("it drives");
            text += &format!("{:?} {} {}\n", of.costs, of.offset_s, of.sigma_s);
        }
        assert_unmoved("clocks.txt", &text);
    }
}

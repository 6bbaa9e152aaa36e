//! Clocks of instrument and robot that are far apart: of all runs, or of one among many.
//!
//! Before anything is fitted: turns and distances between successive poses, against those of the counts
//! between the same instants a time τ earlier. With n pairs and sums of squares S_θ and S_d of the
//! differences, the profile log likelihood is −n/2 (ln S_θ + ln S_d); it needs no start pose, no path and no
//! more than nominal wheels. An offset of all runs is taken off before the fit. A run with an offset of its
//! own is left out: it would be explained by whatever term it pays best. Reference: Knapp & Carter 1976 (time
//! delay by maximum likelihood).

use dataset::{Dataset, RunView};
use estimation::WheelAngleInterpolator;
use kinematics::{DriveGeometry, Wheels, wrap_to_pi};
use rayon::prelude::*;

use crate::log_rows::has_outlying_rows;
use crate::settings::records::{
    CLOCK_STEP_S, MAX_CLOCK_OFFSET_S, MAX_CLOCK_PAIRS, MAX_CLOCK_UNEXPLAINED, MAX_RATE_AT_REST, MIN_CLOCK_GAIN,
    MIN_CLOCK_OFFSET_S, MIN_CLOCK_PAIRS, MIN_CLOCK_RUNS, MIN_CLOCK_SIGMAS, MIN_CLOCK_TURN_RAD, MIN_RUNS_PER_ODD_CLOCK,
};

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
struct OfRun {
    run: (usize, usize),
    profile: Profile,
}

/// Looks for offsets; one of all runs counts from `min_common_s` on.
pub(crate) fn clock_offsets(datasets: &[Dataset], min_common_s: f64) -> Clocks {
    let mut all = Vec::new();
    for (session, dataset) in datasets.iter().enumerate() {
        let Ok(geometry) = dataset.robot.geometry() else { return Clocks::default() };
        let of_run = |(position, run): (usize, &RunView<'_>)| {
            Some(OfRun { run: (session, position), profile: Profile::of(run, dataset, &geometry)? })
        };
        all.par_extend(dataset.session().runs.par_iter().enumerate().filter_map(of_run));
    }
    let Some(common_s) = common_offset_s(&all) else { return Clocks::default() };
    let id = |(session, position): (usize, usize)| datasets[session].runs[position].info.id.clone();
    let is_odd = |of: &&OfRun| {
        let apart_s = (of.profile.offset_s - common_s).abs();
        all.len() >= MIN_CLOCK_RUNS
            && apart_s >= of.profile.tolerance_s()
            && of.profile.gain_over(common_s) > MIN_CLOCK_GAIN
    };
    let odd: Vec<&OfRun> = all.iter().filter(is_odd).collect();
    // Where many runs have clocks of their own, none is the odd one: errors that are alike for seconds say so
    // of any run.
    let few = (all.len() / MIN_RUNS_PER_ODD_CLOCK).max(1);
    let odd = if odd.len() <= few { odd } else { Vec::new() };
    let own = |of: &&OfRun| ClockOffset {
        runs: Some(vec![id(of.run)]),
        offset_s: of.profile.offset_s,
        sigma_s: of.profile.sigma_s,
        gain: of.profile.gain_over(common_s),
    };
    let mut offsets: Vec<ClockOffset> = odd.iter().map(own).collect();
    let gain: f64 = all.iter().map(|of| of.profile.gain_over(0.0) - of.profile.gain_over(common_s)).sum();
    let is_common = common_s.abs() >= min_common_s && gain > MIN_CLOCK_GAIN;
    if is_common {
        let information: f64 = all.iter().map(|of| of.profile.sigma_s.powi(-2)).sum();
        offsets.push(ClockOffset { runs: None, offset_s: common_s, sigma_s: information.sqrt().recip(), gain });
    }
    if offsets.is_empty() {
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
fn common_offset_s(all: &[OfRun]) -> Option<f64> {
    let apart = |of: &OfRun, offset_s: f64| (of.profile.offset_s - offset_s) / of.profile.tolerance_s();
    let cost = |offset_s: f64| -> f64 { all.iter().map(|of| apart(of, offset_s).powi(2).min(1.0)).sum() };
    let own = all.iter().map(|of| of.profile.offset_s);
    let near_s = own.min_by(|a, b| cost(*a).total_cmp(&cost(*b)))?;
    let (mut sum, mut weights) = (0.0, 0.0);
    for Profile { offset_s, sigma_s, .. } in all.iter().filter(|of| apart(of, near_s).abs() < 1.0).map(|of| &of.profile)
    {
        sum += offset_s * sigma_s.powi(-2);
        weights += sigma_s.powi(-2);
    }
    Some(sum / weights)
}

/// Time, place and heading of a measured pose.
type Pose4 = (f64, f64, f64, f64);

/// The profile log likelihood of a run's offset, negative, on a grid.
pub(crate) struct Profile {
    costs: Vec<f64>,
    pub(crate) offset_s: f64,
    pub(crate) sigma_s: f64,
}

impl Profile {
    /// Of a run that measures poses often enough; `None` of others, of one that hardly moves, and of one
    /// whose log has rows that no wheel makes.
    fn of(run: &RunView<'_>, dataset: &Dataset, geometry: &DriveGeometry) -> Option<Self> {
        Self::of_part(run, dataset, geometry, ([f64::NEG_INFINITY, f64::INFINITY], 1))
    }

    /// The same by what is measured in one of so many parts of the run, by as large a share of the pairs.
    pub(crate) fn of_part(
        run: &RunView<'_>,
        dataset: &Dataset,
        geometry: &DriveGeometry,
        (span_s, parts): ([f64; 2], usize),
    ) -> Option<Self> {
        let track = WheelAngleInterpolator::of(run, &dataset.robot)?;
        let (rows_s, truth) = (&run.odometry().t_s, &run.run().truth);
        let [first_s, last_s] = known_between(rows_s, track.turns())?;
        let [from_s, to_s] =
            [(first_s + MAX_CLOCK_OFFSET_S).max(span_s[0]), (last_s - MAX_CLOCK_OFFSET_S).min(span_s[1])];
        let within = |t_s: f64| t_s >= from_s && t_s <= to_s;
        let poses: Vec<Pose4> = truth
            .iter()
            .filter(|sample| within(sample.t_s))
            .filter_map(|sample| Some((sample.t_s, sample.x_m, sample.y_m, sample.theta_rad()?)))
            .collect();
        if !run.info().continuous || poses.len() <= MIN_CLOCK_PAIRS || has_outlying_rows(run.run()) {
            return None;
        }
        let stride = poses.len().div_ceil(MAX_CLOCK_PAIRS / parts);
        let pairs = || poses.windows(2).step_by(stride).map(|pair| (pair[0], pair[1]));
        let steps = (MAX_CLOCK_OFFSET_S / CLOCK_STEP_S).round() as i32;
        // Below a tenth of a milliradian and of a millimetre a pair nothing distinguishes offsets, nor below
        // the rounding of the counts at its ends: where a robot turns evenly, pairs that fall alike between
        // counts at one offset fit by chance.
        let count_m = track.quantum_rad().zip_with(geometry.m_per_rad(), |rad, m_per_rad| rad * m_per_rad);
        let rounding_m2 = (count_m.left.powi(2) + count_m.right.powi(2)) / 6.0;
        let turns_floor = 1e-8 + rounding_m2 / geometry.wheel_separation_m().powi(2);
        let distances_floor = 1e-8 + 0.25 * rounding_m2;
        // Mean squares of what counts leave of turns and distances.
        let left_at = |offset_s: f64| {
            let (mut turns, mut distances, mut count) = (0.0, 0.0, 0.0);
            for (a, b) in pairs() {
                let turned = |t_s: f64| turns_at(rows_s, track.turns(), t_s - offset_s);
                let wheels =
                    turned(b.0).zip_with(turned(a.0), |b, a| b - a).zip_with(geometry.m_per_rad(), |rad, r| rad * r);
                let turn_rad = (wheels.right - wheels.left) / geometry.wheel_separation_m();
                let distance_m = 0.5 * (wheels.left + wheels.right);
                turns += wrap_to_pi(b.3 - a.3 - turn_rad).powi(2);
                distances += ((b.1 - a.1).hypot(b.2 - a.2) - distance_m.abs()).powi(2);
                count += 1.0;
            }
            (turns / count, distances / count, count)
        };
        let cost = |step: i32| {
            let (turns, distances, count) = left_at(CLOCK_STEP_S * f64::from(step));
            0.5 * count * ((turns + turns_floor).ln() + (distances + distances_floor).ln())
        };
        let costs: Vec<f64> = (-steps..=steps).map(cost).collect();
        let best = (1..costs.len() - 1).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
        let curvature = costs[best - 1] - 2.0 * costs[best] + costs[best + 1];
        let slope = 0.5 * (costs[best + 1] - costs[best - 1]);
        if curvature <= 0.0 {
            return None;
        }
        let at = f64::from(i32::try_from(best).ok()? - steps) - slope / curvature;
        let mean = |of: fn(&(Pose4, Pose4)) -> f64| {
            let (sum, count) = pairs().fold((0.0, 0.0_f64), |(sum, count), pair| (sum + of(&pair), count + 1.0));
            sum / count
        };
        let turned = mean(|(a, b)| wrap_to_pi(b.3 - a.3).powi(2));
        let went = mean(|(a, b)| (b.1 - a.1).powi(2) + (b.2 - a.2).powi(2));
        let (turns_left, distances_left, _) = left_at(CLOCK_STEP_S * at);
        let explains = if turned > MIN_CLOCK_TURN_RAD * MIN_CLOCK_TURN_RAD {
            turns_left < MAX_CLOCK_UNEXPLAINED * turned
        } else {
            distances_left < MAX_CLOCK_UNEXPLAINED * went
        };
        if !explains {
            return None;
        }
        Some(Self { costs, offset_s: CLOCK_STEP_S * at, sigma_s: CLOCK_STEP_S / curvature.sqrt() })
    }

    /// How far off other clocks it is no other clock, seconds.
    pub(crate) const fn tolerance_s(&self) -> f64 {
        MIN_CLOCK_OFFSET_S.max(MIN_CLOCK_SIGMAS * self.sigma_s)
    }

    /// Log likelihood of its offset over that of another.
    pub(crate) fn gain_over(&self, offset_s: f64) -> f64 {
        let lowest = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let middle = (self.costs.len() / 2) as f64;
        let at = (offset_s / CLOCK_STEP_S + middle).clamp(0.0, 2.0 * middle);
        let (below, share) = (at.floor() as usize, at.fract());
        let above = (below + 1).min(self.costs.len() - 1);
        self.costs[below] + share * (self.costs[above] - self.costs[below]) - lowest
    }
}

/// The instants between which the turns of the wheels are known: of the log; without an end where the robot
/// sets off or comes to rest there, as it stood before and stands behind.
fn known_between(rows_s: &[f64], turns: &Wheels<Vec<f64>>) -> Option<[f64; 2]> {
    let (first_s, last_s) = (*rows_s.first()?, *rows_s.last()?);
    let rate = |row: usize| {
        let by_wheel = turns.as_ref().map(|turns| (turns[row + 1] - turns[row]).abs());
        by_wheel.left.max(by_wheel.right) / (rows_s[row + 1] - rows_s[row])
    };
    let intervals = rows_s.len().checked_sub(1).filter(|intervals| *intervals > 0)?;
    let fastest = (0..intervals).map(rate).fold(0.0, f64::max);
    let stands = |row: usize| rate(row) <= MAX_RATE_AT_REST * fastest;
    Some([
        if stands(0) { f64::NEG_INFINITY } else { first_s },
        if stands(intervals - 1) { f64::INFINITY } else { last_s },
    ])
}

/// Turns of the wheels at an instant of the log, between rows in proportion.
pub(crate) fn turns_at(rows_s: &[f64], turns: &Wheels<Vec<f64>>, t_s: f64) -> Wheels<f64> {
    let row = rows_s.partition_point(|row_s| *row_s <= t_s).clamp(1, rows_s.len() - 1) - 1;
    let share = ((t_s - rows_s[row]) / (rows_s[row + 1] - rows_s[row])).clamp(0.0, 1.0);
    turns.as_ref().map(|turns| turns[row] + share * (turns[row + 1] - turns[row]))
}

#[cfg(test)]
pub(crate) mod tests {
    use dataset::{Odometry, Run, RunInfo, TruthSample, WheelLog};
    use kinematics::{Increment, Pose};

    use super::*;
    use crate::settings::records::MIN_COMMON_CLOCK_OFFSET_S;
    use crate::small_robot::{assert_unmoved, dataset_of};

    fn offsets(datasets: &[Dataset]) -> Clocks {
        clock_offsets(datasets, MIN_COMMON_CLOCK_OFFSET_S)
    }

    /// Runs of twenty seconds that speed up, slow down and turn, whose poses are of so long before their
    /// stamps.
    pub(crate) fn driven(offsets_s: &[f64]) -> Dataset {
        let wheels_at =
            |t_s: f64| Wheels { left: 4.0 * t_s - 2.0 * (0.9 * t_s).cos(), right: 4.0 * t_s + 1.5 * (1.3 * t_s).sin() };
        let path: Vec<Pose> = (1..=2600)
            .scan(Pose::IDENTITY, |pose, step| {
                let [a, b] = [step - 1, step].map(|step| wheels_at(0.01 * f64::from(step)));
                let travel_m = b.zip_with(a, |b, a| 0.08 * (b - a));
                *pose = *pose * Increment::from_travel(travel_m, 0.36).arc();
                Some(*pose)
            })
            .collect();
        let run = |(number, offset_s): (usize, &f64)| {
            let t_s: Vec<f64> = (0..=1000).map(|row| 0.02 * f64::from(row)).collect();
            let angles = Wheels {
                left: t_s.iter().map(|t_s| wheels_at(t_s + 3.0).left).collect(),
                right: t_s.iter().map(|t_s| wheels_at(t_s + 3.0).right).collect(),
            };
            let truth = (0..=200).map(|k| {
                let stamp_s = 0.1 * f64::from(k);
                let pose = path[((stamp_s + 3.0 - offset_s) / 0.01).round() as usize - 1];
                TruthSample::new(stamp_s, pose.x_m, pose.y_m, Some(pose.theta_rad))
            });
            Run {
                info: RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() },
                odometry: Odometry { t_s: t_s.clone().into(), wheels: WheelLog::Angles(angles), ..Odometry::default() },
                truth: truth.collect(),
                ..Run::default()
            }
        };
        dataset_of(0.36, offsets_s.iter().enumerate().map(run).collect())
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
    fn a_robot_that_sets_off_and_stops_in_the_log_stood_before_and_stands_behind() {
        let rows_s = [0.0, 1.0, 2.0, 3.0];
        let known = |left: [f64; 4], right: [f64; 4]| {
            known_between(&rows_s, &Wheels { left: left.to_vec(), right: right.to_vec() })
        };
        let (before, behind) = (f64::NEG_INFINITY, f64::INFINITY);
        assert_eq!(known([0.0, 0.1, 2.1, 2.1], [0.0, 0.0, 2.0, 2.0]), Some([before, behind]));
        // Rejects a mean of both wheels: one of them turns at the end.
        assert_eq!(known([0.0, 0.1, 2.1, 1.1], [0.0, 0.0, 2.0, 3.0]), Some([before, 3.0]));
        assert_eq!(known([0.0, 1.0, 2.0, 3.0], [0.0; 4]), Some([0.0, 3.0]));
        assert_eq!(known_between(&[1.0], &Wheels::both(vec![0.0])), None);
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
        let small = clock_offsets(&[driven(&[0.05; 4])], 0.04);
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
    fn a_gain_over_an_offset_is_read_between_those_that_were_tried() {
        // Costs of 4, 1, 0, 1 and 4 at −0.08 to 0.08 s.
        let profile = Profile { costs: vec![4.0, 1.0, 0.0, 1.0, 4.0], offset_s: 0.0, sigma_s: 0.01 };
        for (offset_s, gain) in
            [(0.0, 0.0), (0.04, 1.0), (-0.04, 1.0), (0.06, 2.5), (-0.07, 3.25), (0.08, 4.0), (9.0, 4.0), (-9.0, 4.0)]
        {
            let found = profile.gain_over(offset_s);
            assert!((found - gain).abs() < 1e-9, "{offset_s}: {found}");
        }
        let lifted = Profile { costs: vec![5.0, 3.0, 4.0], offset_s: 0.0, sigma_s: 0.01 };
        assert_eq!((lifted.gain_over(0.0), lifted.gain_over(-0.04), lifted.gain_over(0.04)), (0.0, 2.0, 1.0));
    }

    #[test]
    fn turns_are_in_proportion_between_rows_and_end_with_them() {
        let turns = Wheels { left: vec![0.0, 1.0, 3.0], right: vec![0.0, -1.0, -5.0] };
        let at = |t_s| {
            let Wheels { left, right } = turns_at(&[1.0, 2.0, 4.0], &turns, t_s);
            (left, right)
        };
        assert_eq!((at(0.0), at(1.0), at(1.5), at(2.0)), ((0.0, 0.0), (0.0, 0.0), (0.5, -0.5), (1.0, -1.0)));
        assert_eq!((at(3.0), at(4.0), at(9.0)), ((2.0, -3.0), (3.0, -5.0), (3.0, -5.0)));
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
        let geometry = dataset.robot.geometry().expect("a drive");
        for run in &dataset.session().runs {
            let of = Profile::of(run, &dataset, &geometry).expect("it drives");
            text += &format!("{:?} {} {}\n", of.costs, of.offset_s, of.sigma_s);
        }
        assert_unmoved("clocks.txt", &text);
    }

    #[test]
    fn runs_that_say_nothing_of_a_clock_have_no_profile() {
        let has_profile = |change: fn(&mut Run)| {
            let mut dataset = driven(&[0.1]);
            change(&mut dataset.runs[0]);
            let geometry = dataset.robot.geometry().expect("a drive");
            Profile::of(&dataset.session().runs[0], &dataset, &geometry).is_some()
        };
        assert!(has_profile(|_| ()));
        assert!(!has_profile(|run| run.info.continuous = false));
        // Poses from one to nineteen seconds count: 181. Thirty are too few, and one more is not.
        assert!(!has_profile(|run| run.truth.truncate(40)) && has_profile(|run| run.truth.truncate(41)));
        // One that stands.
        assert!(!has_profile(|run| {
            let first = run.truth[0];
            run.truth.iter_mut().for_each(|of| *of = TruthSample::new(of.t_s, first.x_m, first.y_m, first.theta_rad()));
        }));
    }
}

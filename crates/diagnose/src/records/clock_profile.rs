//! What measurements say of the offset between their clock and a run's: its profile likelihood.
//!
//! Turns and distances between successive poses are compared with those of the counts between the same
//! instants a time τ earlier. With n pairs and sums of squares S_θ and S_d of the differences, the profile
//! log likelihood is −n/2 (ln S_θ + ln S_d). It needs no start pose, no path and no more than nominal wheels.
//! Where poses are so frequent that their errors are as large as what lies between two, the poses of a pair
//! are farther apart: a distance of errors has a length too, and errors that last are alike.
//! Reference: Knapp & Carter 1976 (time delay by maximum likelihood).

use dataset::{Dataset, RunView};
use estimation::WheelAngleInterpolator;
use kinematics::{DriveGeometry, Increment, Wheels, wrap_to_pi};
use rayon::prelude::*;

use crate::records::log_rows::has_outlying_rows;
use crate::settings::RECORDS;

/// What a run's measurements say of its clock.
pub(crate) struct RunClock {
    /// Session and run.
    pub(crate) run: (usize, usize),
    /// By all of its measurements.
    pub(crate) whole: Option<Profile>,
    /// By those of its parts, where it is long, each with its middle, seconds from the run's start.
    pub(crate) parts: Vec<(f64, Profile)>,
    /// When the run began on the session's clock, seconds.
    pub(crate) start_s: f64,
}

impl RunClock {
    /// Of all runs of all sessions; none where a robot has no geometry.
    pub(crate) fn of_all(datasets: &[Dataset]) -> Vec<Self> {
        let mut all = Vec::new();
        for (session, dataset) in datasets.iter().enumerate() {
            let Ok(geometry) = dataset.robot.geometry() else { return Vec::new() };
            let of_run = |(position, run): (usize, &RunView<'_>)| {
                Some(Self::of((session, position), run, &PosePairs::of(run, dataset, &geometry)?))
            };
            all.par_extend(dataset.session().runs.par_iter().enumerate().filter_map(of_run));
        }
        all
    }

    fn of(number: (usize, usize), run: &RunView<'_>, pairs: &PosePairs<'_>) -> Self {
        let whole = pairs.profile(ALWAYS, 1);
        let truth = &run.run().truth;
        let [from_s, to_s] = [truth[0].t_s, truth[truth.len() - 1].t_s];
        let parts = if to_s - from_s >= RECORDS.min_drift_run_s { RECORDS.drift_parts_per_run } else { 1 };
        let of_part = |part: usize| {
            let [from_s, to_s] = [part, part + 1].map(|end| from_s + (to_s - from_s) * end as f64 / parts as f64);
            let profile = if parts == 1 { whole.clone() } else { pairs.profile([from_s, to_s], parts) };
            Some((0.5 * (from_s + to_s), profile?))
        };
        Self {
            run: number,
            parts: (0..parts).filter_map(of_part).collect(),
            whole,
            start_s: run.info().start_s.unwrap_or(0.0),
        }
    }
}

/// Time, place and heading of a measured pose.
type Pose4 = (f64, f64, f64, f64);

/// All of a run.
const ALWAYS: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The measured poses of a run, and how its wheels turned.
struct PosePairs<'r> {
    rows_s: &'r [f64],
    track: WheelAngleInterpolator<'r>,
    geometry: &'r DriveGeometry,
    poses: Vec<Pose4>,
}

/// The profile log likelihood of a run's offset, negative, on a grid.
#[derive(Clone)]
pub(crate) struct Profile {
    pub(crate) costs: Vec<f64>,
    pub(crate) offset_s: f64,
    pub(crate) sigma_s: f64,
}

impl<'r> PosePairs<'r> {
    /// Of a run that measures poses at instants between which the turns are known for any offset; `None` of
    /// others, and of one whose log has rows that no wheel makes.
    fn of(run: &RunView<'r>, dataset: &Dataset, geometry: &'r DriveGeometry) -> Option<Self> {
        let track = WheelAngleInterpolator::of(run, &dataset.robot)?;
        let (rows_s, truth) = (&run.odometry().t_s, &run.run().truth);
        let [first_s, last_s] = known_between(rows_s, track.turns())?;
        let within =
            |t_s: f64| t_s - RECORDS.max_clock_offset_s >= first_s && t_s + RECORDS.max_clock_offset_s <= last_s;
        let poses: Vec<Pose4> = truth
            .iter()
            .filter(|sample| within(sample.t_s))
            .filter_map(|sample| Some((sample.t_s, sample.x_m, sample.y_m, sample.theta_rad()?)))
            .collect();
        let is_asked = run.info().continuous && poses.len() > RECORDS.min_clock_pairs && !has_outlying_rows(run.run());
        is_asked.then_some(Self { rows_s, track, geometry, poses })
    }

    /// The profile by the measurements of one of so many parts of the run, by as large a share of the pairs;
    /// `None` where they are few, or the robot hardly moves. Poses of a pair are twice as far apart, and
    /// twice again, until counts explain what lies between them.
    fn profile(&self, [from_s, to_s]: [f64; 2], parts: usize) -> Option<Profile> {
        let of_part =
            self.poses.partition_point(|pose| pose.0 < from_s)..self.poses.partition_point(|pose| pose.0 <= to_s);
        let poses = &self.poses[of_part];
        let (mut found, mut apart) = (None, 1);
        while poses.len() > RECORDS.min_clock_pairs * apart {
            let Some((profile, unexplained)) = self.profile_of(poses, apart, RECORDS.max_clock_pairs / parts) else {
                break;
            };
            found = (unexplained < RECORDS.max_clock_unexplained).then_some(profile);
            if unexplained < RECORDS.clock_unexplained {
                break;
            }
            apart *= 2;
        }
        found
    }

    /// The profile by pairs of poses that are so many poses apart, of so many pairs at the most, and what
    /// share of the motions the counts leave unexplained at the best offset.
    fn profile_of(&self, poses: &[Pose4], apart: usize, most: usize) -> Option<(Profile, f64)> {
        let Self { rows_s, track, geometry, .. } = self;
        let stride = apart.max(poses.len().div_ceil(most));
        let pairs = || poses.windows(apart + 1).step_by(stride).map(|pair| (pair[0], pair[apart]));
        let steps = (RECORDS.max_clock_offset_s / RECORDS.clock_step_s).round() as i32;
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
                let moved = Increment::from_travel(wheels, geometry.wheel_separation_m());
                let arc = moved.arc();
                turns += wrap_to_pi(b.3 - a.3 - moved.turn_rad).powi(2);
                distances += ((b.1 - a.1).hypot(b.2 - a.2) - arc.x_m.hypot(arc.y_m)).powi(2);
                count += 1.0;
            }
            (turns / count, distances / count, count)
        };
        let cost = |step: i32| {
            let (turns, distances, count) = left_at(RECORDS.clock_step_s * f64::from(step));
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
        let (turns_left, distances_left, _) = left_at(RECORDS.clock_step_s * at);
        let is_turning = turned > RECORDS.min_clock_turn_rad * RECORDS.min_clock_turn_rad;
        let unexplained = if is_turning { turns_left / turned } else { distances_left / went };
        let profile =
            Profile { costs, offset_s: RECORDS.clock_step_s * at, sigma_s: RECORDS.clock_step_s / curvature.sqrt() };
        Some((profile, unexplained))
    }
}

impl Profile {
    /// How far off other clocks it is no other clock, seconds.
    pub(crate) fn tolerance_s(&self) -> f64 {
        RECORDS.min_clock_offset_s.max(RECORDS.min_clock_sigmas * self.sigma_s)
    }

    /// Log likelihood of its offset over that of another.
    pub(crate) fn gain_over(&self, offset_s: f64) -> f64 {
        let lowest = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let middle = (self.costs.len() / 2) as f64;
        let at = (offset_s / RECORDS.clock_step_s + middle).clamp(0.0, 2.0 * middle);
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
    let stands = |row: usize| rate(row) <= RECORDS.max_rate_at_rest * fastest;
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
    use kinematics::Pose;

    use super::*;
    use crate::small_robot::dataset_of;

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
    fn runs_that_say_nothing_of_a_clock_have_no_profile() {
        let has_profile = |change: fn(&mut Run)| {
            let mut dataset = driven(&[0.1]);
            change(&mut dataset.runs[0]);
            let geometry = dataset.robot.geometry().expect("a drive");
            let pairs = PosePairs::of(&dataset.session().runs[0], &dataset, &geometry);
            pairs.and_then(|pairs| pairs.profile(ALWAYS, 1)).is_some()
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

//! What measurements say of the offset between their clock and a run's: its profile likelihood.
//!
//! Turns and distances between successive poses are compared with those of the counts between the same
//! instants a time τ earlier. With n pairs and sums of squares S_θ and S_d of the differences, the profile
//! log likelihood is −n/2 (ln S_θ + ln S_d). It needs no start pose, no path and no more than nominal wheels.
//! Where poses are so frequent that their errors are as large as what lies between two, the poses of a pair
//! are farther apart: a distance of errors has a length too, and errors that last are alike.
//! Reference: Knapp & Carter 1976 (time delay by maximum likelihood).

use dataset::TruthSample;
use kinematics::{Increment, Wheels, wrap_to_pi};

use crate::clock::model::Clock;
use crate::clock::searched_run::SearchedRun;
use crate::run_log::RunLog;
use crate::settings::CLOCKS;

/// What a run's measurements say of its clock, beside one of all runs.
#[derive(Clone)]
pub(crate) struct RunClock {
    /// Session and run.
    pub(crate) run: (usize, usize),
    /// By all of its measurements.
    pub(crate) whole: Option<Profile>,
    /// By those of its parts, where it has many, each with its middle, seconds from the run's start.
    pub(crate) parts: Vec<(f64, Profile)>,
    /// When the run began on the session's clock, seconds.
    pub(crate) start_s: f64,
}

impl RunClock {
    /// Of a run whose poses are seen at the instants that a clock says, or by so much apart; `None` where
    /// nothing compares them.
    pub(super) fn of(run: &SearchedRun<'_>, clock: Clock, max_offset_s: f64) -> Option<Self> {
        let pairs = PosePairs::of(run, clock, max_offset_s)?;
        let whole = pairs.profile(ALWAYS, 1);
        let [from_s, to_s] = [pairs.poses.first()?, pairs.poses.last()?].map(|pose| pose.t_s);
        let parts = (pairs.poses.len() / CLOCKS.min_part_poses).clamp(1, CLOCKS.parts_per_run);
        let of_part = |part: usize| {
            let [from_s, to_s] = [part, part + 1].map(|end| from_s + (to_s - from_s) * end as f64 / parts as f64);
            let profile = if parts == 1 { whole.clone() } else { pairs.profile([from_s, to_s], parts) };
            Some((0.5 * (from_s + to_s), profile?))
        };
        Some(Self { run: run.number, parts: (0..parts).filter_map(of_part).collect(), whole, start_s: run.log.start_s })
    }
}

/// A measured pose or position, at an instant of the log.
#[derive(Clone, Copy)]
struct Seen {
    t_s: f64,
    x_m: f64,
    y_m: f64,
    theta_rad: Option<f64>,
}

impl Seen {
    /// What the instrument turned by to a later one.
    fn turn_rad(&self, to: &Self) -> Option<f64> {
        Some(wrap_to_pi(to.theta_rad? - self.theta_rad?))
    }

    fn distance_m(&self, to: &Self) -> f64 {
        (to.x_m - self.x_m).hypot(to.y_m - self.y_m)
    }
}

/// All of a run.
const ALWAYS: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The measured poses of a run, and how its wheels turned.
struct PosePairs<'r> {
    run: &'r SearchedRun<'r>,
    poses: Vec<Seen>,
    /// The largest offset that is tried, seconds.
    max_offset_s: f64,
}

/// The profile log likelihood of a run's offset, negative, on a grid.
#[derive(Clone)]
pub(crate) struct Profile {
    pub(crate) costs: Vec<f64>,
    pub(crate) offset_s: f64,
    pub(crate) sigma_s: f64,
}

/// Mean squares of what counts leave of turns and distances.
#[derive(Clone, Copy, Default)]
struct Left {
    turns: f64,
    distances: f64,
}

impl<'r> PosePairs<'r> {
    /// Of a run that measures poses at instants between which the turns are known for any offset; `None` of
    /// others.
    fn of(run: &'r SearchedRun<'r>, clock: Clock, max_offset_s: f64) -> Option<Self> {
        let log = &run.log;
        let [first_s, last_s] = known_between(&log.t_s, &log.wheels)?;
        let within = |t_s: f64| t_s - max_offset_s >= first_s && t_s + max_offset_s <= last_s;
        let seen = |of: &TruthSample| Seen {
            t_s: clock.log_s(log.start_s, of.t_s),
            x_m: of.x_m,
            y_m: of.y_m,
            theta_rad: of.theta_rad().map(|theta_rad| run.reading.heading_rad(theta_rad)),
        };
        let poses: Vec<Seen> = log.truth.iter().map(seen).filter(|pose| within(pose.t_s)).collect();
        let is_asked = log.continuous && poses.len() > CLOCKS.min_pairs;
        is_asked.then_some(Self { run, poses, max_offset_s })
    }

    /// The profile by the measurements of one of so many parts of the run, by as large a share of the pairs;
    /// `None` where they are few, or the robot hardly moves. Poses of a pair are twice as far apart, and
    /// twice again, until counts explain what lies between them.
    fn profile(&self, [from_s, to_s]: [f64; 2], parts: usize) -> Option<Profile> {
        let of_part =
            self.poses.partition_point(|pose| pose.t_s < from_s)..self.poses.partition_point(|pose| pose.t_s <= to_s);
        let poses = &self.poses[of_part];
        let (mut found, mut apart) = (None, 1);
        while poses.len() > CLOCKS.min_pairs * apart {
            if let Some((profile, unexplained)) = self.profile_of(poses, apart, CLOCKS.max_pairs / parts) {
                found = (unexplained < CLOCKS.max_unexplained).then_some(profile);
                if unexplained < CLOCKS.unexplained {
                    break;
                }
            }
            apart *= 2;
        }
        found
    }

    /// The profile by pairs of poses that are so many poses apart, of so many pairs at the most, and what
    /// share of the motions the counts leave unexplained at the best offset.
    fn profile_of(&self, poses: &[Seen], apart: usize, most: usize) -> Option<(Profile, f64)> {
        let SearchedRun { log, count_rad, m_per_rad, separation_m, .. } = self.run;
        let stride = apart.max(poses.len().div_ceil(most));
        let pairs = || poses.windows(apart + 1).step_by(stride).map(|pair| (pair[0], pair[apart]));
        let (count, turning) = (pairs().count() as f64, pairs().filter_map(|(a, b)| a.turn_rad(&b)).count() as f64);
        let steps = (self.max_offset_s / CLOCKS.step_s).round() as i32;
        // Below a tenth of a milliradian and of a millimetre a pair nothing distinguishes offsets, nor below
        // the rounding of the counts at its ends: where a robot turns evenly, pairs that fall alike between
        // counts at one offset fit by chance.
        let count_m = count_rad.zip_with(*m_per_rad, |rad, m_per_rad| rad * m_per_rad);
        let rounding_m2 = (count_m.left.powi(2) + count_m.right.powi(2)) / 6.0;
        let turns_floor = 1e-8 + rounding_m2 / separation_m.powi(2);
        let distances_floor = 1e-8 + 0.25 * rounding_m2;
        // What counts leave of turns and distances, by offset; offsets that rise read the log backwards.
        let left_at = |offsets_s: &[f64]| {
            let mut left = vec![Left::default(); offsets_s.len()];
            for (a, b) in pairs() {
                let mut cursors = [a, b].map(|of| TurnsAt::of(log, of.t_s - offsets_s[0]));
                for (offset_s, left) in offsets_s.iter().zip(&mut left) {
                    let [from, to] = [0, 1].map(|end| cursors[end].back_to([a, b][end].t_s - offset_s));
                    let wheels = to.zip_with(from, |b, a| b - a).zip_with(*m_per_rad, |rad, m| rad * m);
                    let moved = Increment::from_travel(wheels, *separation_m);
                    let arc = moved.arc();
                    left.turns += a.turn_rad(&b).map_or(0.0, |turn_rad| wrap_to_pi(turn_rad - moved.turn_rad).powi(2));
                    left.distances += (a.distance_m(&b) - arc.x_m.hypot(arc.y_m)).powi(2);
                }
            }
            left.iter_mut()
                .for_each(|of| *of = Left { turns: of.turns / turning.max(1.0), distances: of.distances / count });
            left
        };
        let offsets_s: Vec<f64> = (-steps..=steps).map(|step| CLOCKS.step_s * f64::from(step)).collect();
        let cost = |left: &Left| {
            0.5 * (turning * (left.turns + turns_floor).ln() + count * (left.distances + distances_floor).ln())
        };
        let costs: Vec<f64> = left_at(&offsets_s).iter().map(cost).collect();
        let best = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
        if best == 0 || best + 1 == costs.len() {
            return None;
        }
        let (mut offset_s, mut sigma_s) = lowest(offsets_s[best], CLOCKS.step_s, &costs[best - 1..=best + 1])?;
        // Beside the best, where a parabola through steps so wide is not the profile.
        let near_s = [-1.0, 0.0, 1.0].map(|by| offset_s + by * CLOCKS.fine_step_s);
        let near: Vec<f64> = left_at(&near_s).iter().map(cost).collect();
        if let Some(finer) = lowest(offset_s, CLOCKS.fine_step_s, &near)
            && (finer.0 - offset_s).abs() < CLOCKS.step_s
        {
            (offset_s, sigma_s) = finer;
        }
        let turned: f64 = pairs().filter_map(|(a, b)| Some(a.turn_rad(&b)?.powi(2))).sum::<f64>() / turning.max(1.0);
        let went = pairs().map(|(a, b)| a.distance_m(&b).powi(2)).sum::<f64>() / count;
        let left = left_at(&[offset_s])[0];
        let is_turning = turned > CLOCKS.min_turn_rad * CLOCKS.min_turn_rad;
        let unexplained = if is_turning { left.turns / turned } else { left.distances / went };
        Some((Profile { costs, offset_s, sigma_s }, unexplained))
    }
}

impl Profile {
    /// How far off other clocks it is no other clock, seconds.
    pub(crate) fn tolerance_s(&self) -> f64 {
        CLOCKS.min_own_offset_s.max(CLOCKS.min_own_sigmas * self.sigma_s)
    }

    /// Log likelihood of its offset over that of another.
    pub(crate) fn gain_over(&self, offset_s: f64) -> f64 {
        let lowest = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        let middle = (self.costs.len() / 2) as f64;
        let at = (offset_s / CLOCKS.step_s + middle).clamp(0.0, 2.0 * middle);
        let (below, share) = (at.floor() as usize, at.fract());
        let above = (below + 1).min(self.costs.len() - 1);
        self.costs[below] + share * (self.costs[above] - self.costs[below]) - lowest
    }
}

/// Where the parabola through three costs has its lowest point, and its standard deviation; `None` where it
/// has none.
fn lowest(middle_s: f64, step_s: f64, costs: &[f64]) -> Option<(f64, f64)> {
    let (curvature, slope) = (costs[0] - 2.0 * costs[1] + costs[2], 0.5 * (costs[2] - costs[0]));
    (curvature > 0.0).then(|| (middle_s - step_s * slope / curvature, step_s / curvature.sqrt()))
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
    let stands = |row: usize| rate(row) <= CLOCKS.max_rate_at_rest * fastest;
    Some([
        if stands(0) { f64::NEG_INFINITY } else { first_s },
        if stands(intervals - 1) { f64::INFINITY } else { last_s },
    ])
}

/// Turns of the wheels at instants of the log that go back, between rows in proportion, as at its ends
/// beyond.
struct TurnsAt<'r> {
    log: &'r RunLog,
    row: usize,
}

impl<'r> TurnsAt<'r> {
    /// To be asked from an instant on backwards.
    fn of(log: &'r RunLog, t_s: f64) -> Self {
        Self { log, row: log.t_s.partition_point(|row_s| *row_s <= t_s).clamp(1, log.t_s.len() - 1) - 1 }
    }

    fn back_to(&mut self, t_s: f64) -> Wheels<f64> {
        let (rows_s, turns) = (&self.log.t_s, &self.log.wheels);
        while self.row > 0 && rows_s[self.row] > t_s {
            self.row -= 1;
        }
        let row = self.row;
        let share = ((t_s - rows_s[row]) / (rows_s[row + 1] - rows_s[row])).clamp(0.0, 1.0);
        turns.as_ref().map(|turns| turns[row] + share * (turns[row + 1] - turns[row]))
    }
}

#[cfg(test)]
mod tests {
    use dataset::Run;

    use super::*;
    use crate::clock::ClockSearch;
    use crate::clock::driven_runs::driven;

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
        let mut search = ClockSearch::of(&[driven(&[0.0])], |_| true);
        let log = search.runs[0].log.to_mut();
        log.t_s = vec![1.0, 2.0, 4.0];
        log.wheels = Wheels { left: vec![0.0, 1.0, 3.0], right: vec![0.0, -1.0, -5.0] };
        let at = |from_s: f64, t_s: f64| {
            let Wheels { left, right } = TurnsAt::of(log, from_s).back_to(t_s);
            (left, right)
        };
        for from_s in [4.0, 9.0] {
            assert_eq!((at(from_s, 0.0), at(from_s, 1.0), at(from_s, 1.5)), ((0.0, 0.0), (0.0, 0.0), (0.5, -0.5)));
            assert_eq!((at(from_s, 2.0), at(from_s, 3.0), at(from_s, 4.0)), ((1.0, -1.0), (2.0, -3.0), (3.0, -5.0)));
        }
        assert_eq!(at(9.0, 9.0), (3.0, -5.0));
    }

    #[test]
    fn runs_that_say_nothing_of_a_clock_have_no_profile() {
        let has_profile = |change: fn(&mut Run)| {
            let mut dataset = driven(&[0.1]);
            change(&mut dataset.runs[0]);
            ClockSearch::of(&[dataset], |_| true).profiles(Clock::default()).iter().any(|clock| clock.whole.is_some())
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

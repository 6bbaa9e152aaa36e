//! Pairs of poses a step apart, between which relative errors are taken: those of evo 1.38
//! (`id_pairs_from_delta` of evo/core/metrics.py).
//!
//! Consecutive pairs begin where the one before ended: so many poses on, or at the first pose at which the
//! path since, or the sum of the turns since, has reached the step. All pairs begin at every pose: by poses
//! with the one so many on, by metres with the one whose path comes nearest and within the tolerance, by
//! angle with each whose heading differs by the step within the tolerance. The poses are the estimate's.

use kinematics::{Pose, wrap_to_pi};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use crate::settings::{DELTA_TOLERANCE, MAX_PAIRS};

/// In what a step is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeltaUnit {
    /// Poses.
    Frames,
    /// Degrees of turns.
    Degrees,
    /// Radians of turns.
    Radians,
    /// Metres of path.
    Metres,
}

impl DeltaUnit {
    /// What the flag may say.
    pub const ALL: [Self; 4] = [Self::Frames, Self::Degrees, Self::Radians, Self::Metres];

    /// The letter that evo's flag, ours and JSON use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frames => "f",
            Self::Degrees => "d",
            Self::Radians => "r",
            Self::Metres => "m",
        }
    }
}

/// The step between the poses of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delta {
    value: f64,
    unit: DeltaUnit,
    all_pairs: bool,
    relative_tolerance: f64,
}

impl Default for Delta {
    /// One pose, as evo has it.
    fn default() -> Self {
        Self { value: 1.0, unit: DeltaUnit::Frames, all_pairs: false, relative_tolerance: DELTA_TOLERANCE }
    }
}

impl Serialize for Delta {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_struct("Delta", 4)?;
        object.serialize_field("value", &self.value)?;
        object.serialize_field("unit", self.unit.name())?;
        object.serialize_field("pairs", if self.all_pairs { "all" } else { "consecutive" })?;
        object.serialize_field("relative_tolerance", &self.relative_tolerance)?;
        object.end()
    }
}

impl Delta {
    /// Relative tolerance of all pairs where none is given, as evo has it.
    pub const DEFAULT_TOLERANCE: f64 = DELTA_TOLERANCE;

    /// A step; `relative_tolerance` counts for all pairs by metres or angle alone.
    ///
    /// # Errors
    /// One sentence for a step that no pair has: not positive, part of a pose, more than half a turn; or a
    /// tolerance that is none.
    pub fn new(value: f64, unit: DeltaUnit, all_pairs: bool, relative_tolerance: f64) -> Result<Self, String> {
        let half_turn = match unit {
            DeltaUnit::Degrees => 180.0,
            DeltaUnit::Radians => std::f64::consts::PI,
            DeltaUnit::Frames | DeltaUnit::Metres => f64::INFINITY,
        };
        if !value.is_finite() || value <= 0.0 {
            return Err(format!("{value}: expected a positive step"));
        }
        if value > half_turn {
            return Err(format!("{value}: expected at most half a turn, {half_turn}"));
        }
        if unit == DeltaUnit::Frames && value.fract() != 0.0 {
            return Err(format!("{value}: expected a whole number of poses; another unit has fractions"));
        }
        if !relative_tolerance.is_finite() || relative_tolerance < 0.0 {
            return Err(format!("tolerance {relative_tolerance}: expected 0 or more"));
        }
        Ok(Self { value, unit, all_pairs, relative_tolerance })
    }

    /// For people: `1 f`, `0.5 m, all pairs`.
    #[must_use]
    pub fn describe(&self) -> String {
        let unit = match self.unit {
            DeltaUnit::Frames if self.value > 1.0 => "poses",
            DeltaUnit::Frames => "pose",
            DeltaUnit::Degrees => "deg",
            DeltaUnit::Radians => "rad",
            DeltaUnit::Metres => "m",
        };
        let pairs = if self.all_pairs { "all pairs" } else { "consecutive pairs" };
        format!("{} {unit}, {pairs}", self.value)
    }

    /// Indices of the first and second pose of every pair.
    pub(crate) fn pairs(&self, poses: &[Pose]) -> Result<Vec<(usize, usize)>, &'static str> {
        let turn_rad = |from: &Pose, to: &Pose| wrap_to_pi(to.theta_rad - from.theta_rad).abs();
        let delta = if self.unit == DeltaUnit::Degrees { self.value.to_radians() } else { self.value };
        let pairs = match (self.unit, self.all_pairs) {
            (DeltaUnit::Frames, all_pairs) => {
                // More poses than there can be are no step: a saturating cast is right.
                let step = self.value as usize;
                let begin = (0..poses.len()).step_by(if all_pairs { 1 } else { step });
                begin
                    .map(|first| (first, first.saturating_add(step)))
                    .take_while(|(_, second)| *second < poses.len())
                    .collect()
            }
            (DeltaUnit::Metres, false) => {
                consecutive(poses, delta, |from, to| from.position().distance_m(to.position()))
            }
            (DeltaUnit::Metres, true) => by_path(poses, delta, delta * self.relative_tolerance),
            (DeltaUnit::Degrees | DeltaUnit::Radians, false) => consecutive(poses, delta, turn_rad),
            (DeltaUnit::Degrees | DeltaUnit::Radians, true) => {
                let tolerance = delta * self.relative_tolerance;
                let within = delta - tolerance..=delta + tolerance;
                let mut pairs = Vec::new();
                for (first, from) in poses.iter().enumerate() {
                    let later = poses.iter().enumerate().skip(first + 1);
                    let matching = later.filter(|(_, to)| within.contains(&turn_rad(from, to)));
                    pairs.extend(matching.map(|(second, _)| (first, second)));
                    if pairs.len() > MAX_PAIRS {
                        return Err("more than 10 million pairs; take consecutive pairs or a smaller tolerance");
                    }
                }
                pairs
            }
        };
        if pairs.is_empty() {
            return Err("no two poses are a step apart; take a smaller --delta");
        }
        Ok(pairs)
    }
}

/// Pairs that follow each other, each as soon as what was passed has reached the step.
fn consecutive(poses: &[Pose], delta: f64, passed: impl Fn(&Pose, &Pose) -> f64) -> Vec<(usize, usize)> {
    let (mut pairs, mut first, mut sum) = (Vec::new(), 0, 0.0);
    for (second, pair) in (1..).zip(poses.windows(2)) {
        sum += passed(&pair[0], &pair[1]);
        if sum >= delta {
            pairs.push((first, second));
            (first, sum) = (second, 0.0);
        }
    }
    pairs
}

/// From every pose to the one whose path since is nearest to the step; of several the first.
fn by_path(poses: &[Pose], delta_m: f64, tolerance_m: f64) -> Vec<(usize, usize)> {
    let mut path_m = vec![0.0; poses.len()];
    for (second, pair) in (1..).zip(poses.windows(2)) {
        path_m[second] = path_m[second - 1] + pair[0].position().distance_m(pair[1].position());
    }
    let nearest = |first: usize| {
        let later = path_m.get(first + 1..).filter(|later| !later.is_empty())?;
        let off_m = |at_m: f64| (at_m - path_m[first] - delta_m).abs();
        // Paths grow: the miss falls up to the first that reaches the step, and grows from there.
        let reaching = later.partition_point(|at_m| at_m - path_m[first] < delta_m);
        let before = reaching.checked_sub(1).map(|last| {
            let least_m = off_m(later[last]);
            later[..reaching].partition_point(|at_m| off_m(*at_m) > least_m)
        });
        let candidates = before.into_iter().chain((reaching < later.len()).then_some(reaching));
        let best = candidates.min_by(|a, b| off_m(later[*a]).total_cmp(&off_m(later[*b])))?;
        (off_m(later[best]) <= tolerance_m).then_some((first, first + 1 + best))
    };
    (0..poses.len()).filter_map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn along_x(metres: &[f64]) -> Vec<Pose> {
        metres.iter().map(|x_m| Pose::new(*x_m, 0.0, 0.0)).collect()
    }

    fn pairs(poses: &[Pose], value: f64, unit: DeltaUnit, all_pairs: bool) -> Result<Vec<(usize, usize)>, String> {
        Delta::new(value, unit, all_pairs, 0.1)?.pairs(poses).map_err(str::to_owned)
    }

    #[test]
    fn by_poses_pairs_follow_each_other_or_begin_everywhere() {
        let poses = along_x(&[0.0; 6]);
        assert_eq!(pairs(&poses, 2.0, DeltaUnit::Frames, false), Ok(vec![(0, 2), (2, 4)]));
        assert_eq!(pairs(&poses, 4.0, DeltaUnit::Frames, true), Ok(vec![(0, 4), (1, 5)]));
        assert!(pairs(&poses, 6.0, DeltaUnit::Frames, false).is_err());
        assert!(pairs(&poses, 1e300, DeltaUnit::Frames, true).is_err());
    }

    #[test]
    fn by_metres_a_pair_ends_where_its_path_reaches_the_step() {
        let poses = along_x(&[0.0, 0.4, 1.2, 1.0, 2.5, 2.6]);
        // 1.2 m; then 0.2 m back and 1.5 m ahead; then 0.1 m that reach nothing.
        assert_eq!(pairs(&poses, 1.0, DeltaUnit::Metres, false), Ok(vec![(0, 2), (2, 4)]));
        // Of all pairs those that are off by 0.1 m at most: from 0 none (0.4, 1.2), from 0.4 the pose back at
        // 1.0 m, whose path is 1.0 m.
        assert_eq!(pairs(&poses, 1.0, DeltaUnit::Metres, true), Ok(vec![(1, 3)]));
        // Where the robot stands the first pose is taken.
        let stands = along_x(&[0.0, 1.0, 1.0, 1.0]);
        assert_eq!(pairs(&stands, 1.0, DeltaUnit::Metres, true), Ok(vec![(0, 1)]));
        // As near before as behind: the one before.
        let around = along_x(&[0.0, 0.75, 1.25]);
        assert_eq!(Delta::new(1.0, DeltaUnit::Metres, true, 0.25).expect("a step").pairs(&around), Ok(vec![(0, 1)]));
    }

    #[test]
    fn by_angle_turns_add_up_or_headings_differ() {
        let turned: Vec<Pose> =
            [0.0, 0.5, 0.0, -0.5, 6.0].map(|quarters| Pose::new(0.0, 0.0, quarters * FRAC_PI_2)).to_vec();
        // To and fro adds up; the last turn of 6.5 quarters is one of 1.5 the other way round.
        assert_eq!(pairs(&turned, 90.0, DeltaUnit::Degrees, false), Ok(vec![(0, 2), (2, 4)]));
        assert_eq!(pairs(&turned, 90.0, DeltaUnit::Degrees, true), Ok(vec![(1, 3)]));
        assert_eq!(pairs(&turned, FRAC_PI_2, DeltaUnit::Radians, true), Ok(vec![(1, 3)]));
    }

    #[test]
    fn a_step_that_no_pair_has_is_refused() {
        for (value, unit) in [
            (0.0, DeltaUnit::Frames),
            (-1.0, DeltaUnit::Metres),
            (1.5, DeltaUnit::Frames),
            (181.0, DeltaUnit::Degrees),
            (3.2, DeltaUnit::Radians),
            (f64::NAN, DeltaUnit::Metres),
        ] {
            assert!(Delta::new(value, unit, false, 0.1).is_err(), "{value} {unit:?}");
        }
        assert!(Delta::new(1.0, DeltaUnit::Metres, true, -0.1).is_err());
        assert_eq!(Delta::default().describe(), "1 pose, consecutive pairs");
    }

    #[test]
    fn more_pairs_than_are_held_are_refused() {
        // Every second pose is turned by a radian: half of the pairs of two poses are a step apart.
        let count = 2 * (MAX_PAIRS as f64).sqrt() as usize + 10;
        let poses: Vec<Pose> = (0..count).map(|number| Pose::new(0.0, 0.0, f64::from(number % 2 == 1))).collect();
        let found = |poses: &[Pose]| pairs(poses, 1.0, DeltaUnit::Radians, true);
        assert!(found(&poses).expect_err("refused").contains("more than 10 million pairs"));
        assert_eq!(found(&poses[..4]).expect("pairs"), [(0, 1), (0, 3), (1, 2), (2, 3)]);
    }
}

//! Poses by a chain of transforms: those of `/tf` along the tree of frames, and the mountings of
//! `/tf_static`.
//!
//! A transform of `/tf` leads from its parent to its child, a mounting both ways. The chain must be the only
//! one. Where one transform of it moves, each of its messages is a pose. Where two move, one of them must be
//! the wheels' own odometry: a pose then is measured only where the other one, a correction of the map,
//! changes; between its corrections the chain moves by the wheels alone.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use kinematics::Pose;

use crate::clock::{self, Times, seconds};
use crate::settings::{MAX_CHAIN, MAX_FRAME_GAP_S, MIN_SHARED_STAMPS};
use crate::static_frames::{StaticFrames, is_base};
use crate::transform::{self, Rigid};
use crate::value::Value;

/// One transform of a chain.
#[derive(Debug, Clone, PartialEq)]
struct Step {
    parent: String,
    child: String,
    /// The motion along the chain, of a mounting.
    fixed: Option<Rigid>,
}

/// A chain from a frame of the room to one of the robot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameChain {
    steps: Vec<Step>,
}

/// Every transform of a chain's moving steps, in the order of the bag.
pub(crate) struct Moved {
    of: Vec<Vec<(Times, Rigid)>>,
    /// Transforms without a rotation or with places that are no numbers.
    pub(crate) unreadable: u64,
}

/// A pose of the chain.
pub(crate) struct Placed {
    pub(crate) times: Times,
    pub(crate) pose: Pose,
    /// Angle between the vertical of the robot and that of the room, radians.
    pub(crate) tilt_rad: f64,
}

struct Edge<'a> {
    to: &'a str,
    /// The same of both directions of a mounting.
    number: usize,
    step: Step,
}

impl FrameChain {
    /// The only chain between two frames; an error says why there is none, or which two there are.
    pub(crate) fn find(
        parent: &str,
        child: &str,
        moving: &BTreeMap<(String, String), u64>,
        mounted: &StaticFrames,
    ) -> Result<Self, String> {
        let mut edges: BTreeMap<&str, Vec<Edge<'_>>> = BTreeMap::new();
        let mut number = 0;
        for (parent, child) in moving.keys() {
            number += 1;
            let step = Step { parent: parent.clone(), child: child.clone(), fixed: None };
            edges.entry(parent).or_default().push(Edge { to: child, number, step });
        }
        for (parent, child, rigid) in mounted.all() {
            number += 1;
            for (from, to, fixed) in [(parent, child, *rigid), (child, parent, rigid.inverse())] {
                let step = Step { parent: from.to_owned(), child: to.to_owned(), fixed: Some(fixed) };
                edges.entry(from).or_default().push(Edge { to, number, step });
            }
        }
        let Some(chain) = shortest(&edges, parent, child, None) else {
            return Err(format!("no transform from {parent} directly to {child}, and no chain of them leads there"));
        };
        let named = |chain: &[&Edge<'_>]| {
            let frames = std::iter::once(parent).chain(chain.iter().map(|edge| edge.to));
            frames.collect::<Vec<_>>().join(" to ")
        };
        let other = chain.iter().find_map(|edge| shortest(&edges, parent, child, Some(edge.number)));
        if let Some(other) = other {
            let why = "name two frames between which one chain leads";
            return Err(format!("two chains lead there, {} and {}; {why}", named(&chain), named(&other)));
        }
        let steps: Vec<Step> = chain.iter().map(|edge| edge.step.clone()).collect();
        if steps.len() > MAX_CHAIN || steps.iter().all(|step| step.fixed.is_some()) {
            return Err(format!("{} does not move, or has more than {MAX_CHAIN} transforms", named(&chain)));
        }
        Ok(Self { steps })
    }

    /// Its transforms, for the user.
    pub(crate) fn describe(&self) -> String {
        let of = |step: &Step| {
            let by = if step.fixed.is_some() { " by /tf_static" } else { "" };
            format!("{} to {}{by}", step.parent, step.child)
        };
        self.steps.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    /// Room for the transforms of its moving steps.
    pub(crate) fn moved(&self) -> Moved {
        Moved { of: self.steps.iter().map(|_| Vec::new()).collect(), unreadable: 0 }
    }

    /// Takes the transforms of a message that are of the chain.
    pub(crate) fn take(&self, message: &Value, received_ns: u64, moved: &mut Moved) {
        for stamped in message.list("transforms") {
            let Some((parent, child)) = transform::frames(stamped) else { continue };
            let is_step = |step: &Step| step.fixed.is_none() && step.parent == parent && step.child == child;
            let Some(place) = self.steps.iter().position(is_step) else { continue };
            match Rigid::of(stamped) {
                Some(rigid) => moved.of[place].push((Times::of(stamped, received_ns), rigid)),
                None => moved.unreadable += 1,
            }
        }
    }

    /// The poses, and what is to be known of them; an error says why these are none. `wheels` are the times
    /// of the wheels' rows.
    pub(crate) fn poses(&self, moved: &Moved, wheels: &[Times]) -> Result<(Vec<Placed>, Option<String>), String> {
        // What never changes is as good as a mounting.
        let mut fixed: Vec<Option<Rigid>> = self.steps.iter().map(|step| step.fixed).collect();
        let mut moving = Vec::new();
        for (place, of) in moved.of.iter().enumerate().filter(|(place, _)| self.steps[*place].fixed.is_none()) {
            match of.first() {
                Some((_, first)) if of.iter().all(|(_, rigid)| rigid == first) => fixed[place] = Some(*first),
                Some(_) => moving.push(place),
                None => return Err(format!("no transform {} can be read", self.name(place))),
            }
        }
        let composed = |motions: &[(usize, &Rigid)]| {
            (0..self.steps.len()).fold(Rigid::IDENTITY, |all, place| {
                let found = motions.iter().find(|(of, _)| *of == place).map(|(_, rigid)| *rigid);
                found.or(fixed[place].as_ref()).map_or(all, |rigid| all.after(rigid))
            })
        };
        match moving[..] {
            [] => Err(format!("{} never changes", self.describe())),
            [one] if one > 0 && self.is_odometry(one) => Err(format!(
                "{} is the wheels' own odometry, and nothing before it in the chain is ever corrected",
                self.name(one)
            )),
            [one] => {
                let placed = |(times, rigid): &(Times, Rigid)| {
                    let whole = composed(&[(one, rigid)]);
                    Placed { times: *times, pose: whole.pose(), tilt_rad: tilt_rad(&whole) }
                };
                Ok((moved.of[one].iter().map(placed).collect(), None))
            }
            [first, second] => {
                let both = [first, second];
                let by_name = both.map(|place| self.is_odometry(place));
                let is_own = match by_name {
                    [false, false] => both.map(|place| share_of(wheels, &moved.of[place]) >= MIN_SHARED_STAMPS),
                    named => named,
                };
                let (own, measured) = match is_own {
                    [true, false] => (first, second),
                    [false, true] => (second, first),
                    _ => {
                        return Err(format!(
                            "{} and {} both move, and neither is plainly the wheels' own odometry; name two frames between which one of them leads",
                            self.name(first),
                            self.name(second)
                        ));
                    }
                };
                self.corrected(moved, own, measured, composed)
            }
            _ => Err(format!(
                "{} of its transforms move, where a chain of one measured transform and the wheels' odometry is read: {}",
                moving.len(),
                moving.iter().map(|place| self.name(*place)).collect::<Vec<_>>().join(", ")
            )),
        }
    }

    /// The poses at the instants at which a transform that is measured changes; between two transforms of the
    /// wheels' own the robot drives evenly.
    fn corrected(
        &self,
        moved: &Moved,
        own: usize,
        measured: usize,
        composed: impl Fn(&[(usize, &Rigid)]) -> Rigid,
    ) -> Result<(Vec<Placed>, Option<String>), String> {
        let [odometry, corrections] = [own, measured].map(|place| {
            let times: Vec<Times> = moved.of[place].iter().map(|(times, _)| *times).collect();
            let backwards =
                || format!("the times of {} run backwards: import each recording by itself", self.name(place));
            let ordered = clock::ordered("", &times, clock::clock(&times), false).map_err(|_| backwards())?;
            Ok::<_, String>((clock::clock(&times), ordered.rows))
        });
        let ((odometry_clock, odometry), (clock, corrections)) = (odometry?, corrections?);
        if odometry_clock != clock {
            return Err(format!("of {} and {} one alone has header stamps", self.name(own), self.name(measured)));
        }
        let (mut placed, mut alone) = (Vec::new(), 0_u64);
        for pair in corrections.windows(2) {
            let [(before, _), (row, time_ns)] = pair else { continue };
            let (times, correction) = &moved.of[measured][*row];
            if *correction == moved.of[measured][*before].1 {
                continue;
            }
            let next = odometry.partition_point(|(_, at_ns)| at_ns < time_ns);
            let last = if odometry.get(next).is_some_and(|(_, at_ns)| at_ns == time_ns) {
                Some(next)
            } else {
                next.checked_sub(1)
            };
            let around = last.and_then(|last| Some((odometry[last], *odometry.get(next)?)));
            let Some(((from, from_ns), (to, to_ns))) =
                around.filter(|((_, from_ns), (_, to_ns))| seconds(*from_ns, *to_ns) <= MAX_FRAME_GAP_S)
            else {
                alone += 1;
                continue;
            };
            let [a, b] = [from, to].map(|row| composed(&[(own, &moved.of[own][row].1), (measured, correction)]));
            let share = if from_ns == to_ns { 0.0 } else { seconds(from_ns, *time_ns) / seconds(from_ns, to_ns) };
            let tilt_rad = tilt_rad(&a).max(tilt_rad(&b));
            placed.push(Placed { times: *times, pose: between(a.pose(), b.pose(), share), tilt_rad });
        }
        let left_out = match alone {
            0 => String::new(),
            _ => format!("; {alone} more have no {} around them and were left out", self.name(own)),
        };
        let note = format!(
            "{} is the wheels' own odometry: of {} messages of {} the {} are poses at which it was corrected, and nothing between them{left_out}",
            self.name(own),
            corrections.len(),
            self.name(measured),
            placed.len()
        );
        Ok((placed, Some(note)))
    }

    /// Whether a step is the wheels' own odometry by its names.
    fn is_odometry(&self, place: usize) -> bool {
        let Step { parent, child, .. } = &self.steps[place];
        let named = parent.rsplit('/').next().unwrap_or_default().to_lowercase();
        let is_robot = self.steps.last().is_some_and(|last| last.child == *child);
        named.contains("odom") && (is_robot || is_base(child))
    }

    fn name(&self, place: usize) -> String {
        let Step { parent, child, .. } = &self.steps[place];
        format!("{parent} to {child}")
    }
}

/// The chain of the fewest transforms without one of them.
fn shortest<'e, 'a>(
    edges: &'e BTreeMap<&'a str, Vec<Edge<'a>>>,
    from: &'a str,
    to: &'a str,
    without: Option<usize>,
) -> Option<Vec<&'e Edge<'a>>> {
    let mut reached: BTreeMap<&str, Option<(&str, &Edge<'_>)>> = BTreeMap::from([(from, None)]);
    let mut open = VecDeque::from([from]);
    while let Some(at) = open.pop_front() {
        for edge in edges.get(at).into_iter().flatten().filter(|edge| Some(edge.number) != without) {
            if !reached.contains_key(edge.to) {
                reached.insert(edge.to, Some((at, edge)));
                open.push_back(edge.to);
            }
        }
    }
    let (mut chain, mut at) = (Vec::new(), to);
    while let Some((before, edge)) = *reached.get(at)? {
        chain.push(edge);
        at = before;
    }
    chain.reverse();
    Some(chain)
}

/// The share of the wheels' stamps at which there is a transform too.
fn share_of(wheels: &[Times], transforms: &[(Times, Rigid)]) -> f64 {
    let stamps: BTreeSet<i64> = transforms.iter().filter_map(|(times, _)| times.stamp_ns).collect();
    let shared = wheels.iter().filter(|times| times.stamp_ns.is_some_and(|stamp_ns| stamps.contains(&stamp_ns)));
    shared.count() as f64 / wheels.len().max(1) as f64
}

fn tilt_rad(whole: &Rigid) -> f64 {
    whole.upright().clamp(-1.0, 1.0).acos()
}

/// The pose at a share of the motion from one to the other, by the shorter turn.
fn between(from: Pose, to: Pose, share: f64) -> Pose {
    let turn_rad =
        (to.theta_rad - from.theta_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
    Pose::new(
        from.x_m + share * (to.x_m - from.x_m),
        from.y_m + share * (to.y_m - from.y_m),
        from.theta_rad + share * turn_rad,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(fields: Vec<(&str, Value)>) -> Value {
        Value::Message(fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    }

    /// A message of one transform at a tenth of a second, in the plane.
    fn stamped(tenth: i128, [parent, child]: [&str; 2], [x_m, y_m, yaw_rad]: [f64; 3]) -> Value {
        let floats = |of: &[(&'static str, f64)]| {
            message(of.iter().map(|(name, value)| (*name, Value::Float(*value))).collect())
        };
        let (sin, cos) = (0.5 * yaw_rad).sin_cos();
        let transform = message(vec![
            ("translation", floats(&[("x", x_m), ("y", y_m), ("z", 0.0)])),
            ("rotation", floats(&[("x", 0.0), ("y", 0.0), ("z", sin), ("w", cos)])),
        ]);
        let stamp = message(vec![("sec", Value::Integer(100)), ("nanosec", Value::Integer(100_000_000 * tenth))]);
        let header = message(vec![("stamp", stamp), ("frame_id", Value::Text(format!("/{parent}")))]);
        let whole =
            vec![("header", header), ("child_frame_id", Value::Text(child.to_owned())), ("transform", transform)];
        message(vec![("transforms", Value::List(vec![message(whole)]))])
    }

    fn pairs(of: &[[&str; 2]]) -> BTreeMap<(String, String), u64> {
        of.iter().map(|[parent, child]| (((*parent).to_owned(), (*child).to_owned()), 9)).collect()
    }

    /// The poses of a chain in messages, and what is said of them.
    fn poses(
        between: (&str, &str),
        mounted: &StaticFrames,
        messages: &[(i128, [&str; 2], [f64; 3])],
        wheels: &[Times],
    ) -> Result<(Vec<[f64; 3]>, Option<String>), String> {
        let frames: Vec<[&str; 2]> = messages.iter().map(|(_, frames, _)| *frames).collect();
        let chain = FrameChain::find(between.0, between.1, &pairs(&frames), mounted)?;
        let mut moved = chain.moved();
        for (tenth, frames, pose) in messages {
            chain.take(&stamped(*tenth, *frames, *pose), 7, &mut moved);
        }
        let (placed, note) = chain.poses(&moved, wheels)?;
        let of = |Placed { pose, .. }: &Placed| [pose.x_m, pose.y_m, pose.theta_rad];
        Ok((placed.iter().map(of).collect(), note))
    }

    #[track_caller]
    fn are_close(found: &[[f64; 3]], expected: &[[f64; 3]]) {
        let off =
            found.as_flattened().iter().zip(expected.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Rounding of a dozen products of numbers below 10.
        assert!(found.len() == expected.len() && off < 1e-13, "{found:?} {expected:?}");
    }

    const TURN_RAD: f64 = std::f64::consts::FRAC_PI_2;
    const MOCAP: [&str; 2] = ["mocap", "marker"];
    const MAP: [&str; 2] = ["map", "odom"];
    const ODOM: [&str; 2] = ["odom", "base_link"];

    #[test]
    fn poses_of_a_marker_are_the_bases_whichever_of_them_carries_the_other() {
        let seen = [(1, MOCAP, [2.0, 3.0, 0.0]), (2, MOCAP, [2.0, 4.0, TURN_RAD])];
        // The marker is 0.1 m ahead of the base and looks to its left: the base is 0.1 m to the marker's
        // left, and looks to its right.
        let expected = [[2.0, 3.1, -TURN_RAD], [1.9, 4.0, 0.0]];
        let mountings =
            [(["base_link", "marker"], [0.1, 0.0, TURN_RAD]), (["marker", "base_link"], [0.0, 0.1, -TURN_RAD])];
        for (frames, pose) in mountings {
            let mut mounted = StaticFrames::default();
            mounted.take(&stamped(0, frames, pose));
            let (found, note) = poses(("mocap", "base_link"), &mounted, &seen, &[]).expect("poses");
            are_close(&found, &expected);
            assert_eq!(note, None);
        }
        let chain = FrameChain::find("mocap", "marker", &pairs(&[MOCAP]), &StaticFrames::default()).expect("direct");
        assert_eq!(chain.describe(), "mocap to marker");
    }

    /// Odometry that turns on the spot by 0.2 rad a tenth of a second, without a message from 0.4 to 0.9 s,
    /// and a map that is corrected at half steps.
    fn localised<'a>() -> Vec<(i128, [&'a str; 2], [f64; 3])> {
        let turns = [0, 1, 2, 3, 9].map(|tenth| (tenth, ODOM, [1.0, 0.0, 0.2 * tenth as f64]));
        let corrections = [
            (0, MAP, [5.0, 0.0, 0.0]),
            (1, MAP, [5.0, 0.0, 0.0]),
            (2, MAP, [5.0, 1.0, 0.1]),
            (3, MAP, [5.0, 1.0, 0.1]),
            (6, MAP, [5.0, 2.0, 0.0]),
            (7, MAP, [5.0, 2.0, 0.0]),
            (9, MAP, [5.0, 3.0, 0.0]),
        ];
        [&turns[..], &corrections].concat()
    }

    #[test]
    fn between_its_corrections_a_map_measures_nothing() {
        let none = StaticFrames::default();
        let (found, note) = poses(("map", "base_link"), &none, &localised(), &[]).expect("poses");
        are_close(&found, &[[5.0 + 0.1_f64.cos(), 1.0 + 0.1_f64.sin(), 0.5], [6.0, 3.0, 1.8]]);
        let note = note.expect("said");
        let expected = "odom to base_link is the wheels' own odometry: of 7 messages of map to odom the 2 are poses";
        assert!(note.starts_with(expected) && note.contains("1 more have no odom to base_link around them"), "{note}");
        // Half-way between two of the wheels' own.
        let half =
            [(1, ODOM, [0.0, 0.0, 3.0]), (4, ODOM, [1.0, 2.0, -3.0]), (0, MAP, [0.0; 3]), (2, MAP, [1.0, 0.0, 0.0])];
        let (found, _) = poses(("map", "base_link"), &none, &half, &[]).expect("poses");
        let turn_rad = std::f64::consts::TAU - 6.0;
        are_close(&found, &[[1.0 + 1.0 / 3.0, 2.0 / 3.0, 3.0 + turn_rad / 3.0]]);
        // A map that nobody corrects leaves the wheels' own.
        let same = half.map(|(tenth, frames, pose)| (tenth, frames, if frames == MAP { [0.0; 3] } else { pose }));
        let refused = poses(("map", "base_link"), &none, &same, &[]).expect_err("refused");
        assert!(refused.contains("odom to base_link is the wheels' own odometry, and nothing"), "{refused}");
    }

    #[test]
    fn odometry_of_other_names_is_known_by_the_wheels_stamps() {
        // The map is not published whenever the wheels are read.
        let renamed: Vec<_> = localised()
            .into_iter()
            .filter(|(tenth, frames, _)| *frames == ODOM || ![1, 3].contains(tenth))
            .map(|(tenth, frames, pose)| (tenth, if frames == ODOM { ["odom", "chassis"] } else { frames }, pose))
            .collect();
        let mut mounted = StaticFrames::default();
        mounted.take(&stamped(0, ["chassis", "camera"], [0.0; 3]));
        let wheels = |tenths: &[i64]| -> Vec<Times> {
            let at = |tenth: &i64| Times { stamp_ns: Some(100_000_000_000 + 100_000_000 * tenth), received_ns: 0 };
            tenths.iter().map(at).collect()
        };
        let of = |wheels: &[Times]| poses(("map", "camera"), &mounted, &renamed, wheels);
        assert_eq!(of(&wheels(&[0, 1, 2, 3, 9])).expect("poses").0.len(), 2);
        let refused = of(&wheels(&[0, 2, 9])).expect_err("refused");
        assert!(refused.contains("map to odom and odom to chassis both move, and neither is plainly"), "{refused}");
    }

    #[test]
    fn without_one_chain_alone_nothing_is_composed() {
        let mut mounted = StaticFrames::default();
        mounted.take(&stamped(0, ["base_link", "laser"], [0.0; 3]));
        let find = |(parent, child), of: &[[&str; 2]]| FrameChain::find(parent, child, &pairs(of), &mounted);
        let refused = |between, of: &[[&str; 2]]| find(between, of).expect_err("refused");
        assert!(refused(("map", "base_link"), &[ODOM]).contains("no transform from map directly to base_link"));
        // What moves is not followed from the child to the parent.
        assert!(refused(("odom", "map"), &[["map", "base_link"], ODOM]).contains("no chain of them leads there"));
        assert!(refused(("base_link", "laser"), &[ODOM]).contains("base_link to laser does not move"));
        let why = refused(("map", "laser"), &[MAP, ODOM, ["map", "laser"]]);
        assert!(why.contains("two chains lead there, map to laser and map to odom to base_link to laser"), "{why}");
        assert!(find(("map", "laser"), &[MAP, ODOM]).is_ok());
    }
}

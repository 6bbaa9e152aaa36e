//! Dead reckoning of many robots of one kind, a row of counts at a time.
//!
//! Robots stand in blocks of 64, each quantity of a block in one column, so that every stage of a step is a loop over lanes without branches. A robot has the
//! bits that it has alone ([`DeadReckoning`]); a block in which one is beyond the loops' range goes through that robot by robot.

use crate::dead_reckoning::{GROUP, Place, heading_rad};
use crate::instruction_set::Kernel;
use crate::trig::{Direction, short_sinc};
use crate::{Count, DeadReckoning, InstructionSet, Odometry, Pose, Rule, Wheels};

const LANES: usize = 64;

/// Fewer robots than this go one by one.
const FEWEST_FOR_A_BLOCK: usize = 12;

/// Many robots with one odometry, each with its own start.
#[derive(Debug, Clone)]
pub struct Fleet<C> {
    odometry: Odometry,
    set: InstructionSet,
    robots: usize,
    steps: usize,
    blocks: Vec<Block<C>>,
}

#[derive(Debug, Clone)]
struct Block<C> {
    start_counts: Wheels<[C; LANES]>,
    counts: Wheels<[C; LANES]>,
    /// Counts since the start.
    since: Wheels<[f64; LANES]>,
    start_theta_rad: [f64; LANES],
    theta_rad: [f64; LANES],
    x: Places,
    y: Places,
}

/// [`Place`] of every lane.
#[derive(Debug, Clone)]
struct Places {
    anchor_m: [f64; LANES],
    dropped_m: [f64; LANES],
    moved_m: [f64; LANES],
}

impl Places {
    #[inline(always)]
    const fn lane(&self, k: usize) -> Place {
        Place { anchor_m: self.anchor_m[k], dropped_m: self.dropped_m[k], moved_m: self.moved_m[k] }
    }

    #[inline(always)]
    const fn set_lane(&mut self, k: usize, place: Place) {
        (self.anchor_m[k], self.dropped_m[k], self.moved_m[k]) = (place.anchor_m, place.dropped_m, place.moved_m);
    }
}

impl<C: Count> Fleet<C> {
    /// Starts every robot at its pose and its counters' readings there.
    ///
    /// # Panics
    /// When the columns differ in length: they are of the same robots.
    #[must_use]
    pub fn new(odometry: Odometry, world_from_body: &[Pose], counts: Wheels<&[C]>) -> Self {
        Self::by(InstructionSet::widest(), odometry, world_from_body, counts)
    }

    /// [`Self::new`], to be moved by a given instruction set: the same bits, at another speed.
    ///
    /// # Panics
    /// As [`Self::new`].
    #[must_use]
    pub fn by(set: InstructionSet, odometry: Odometry, world_from_body: &[Pose], counts: Wheels<&[C]>) -> Self {
        let robots = world_from_body.len();
        assert!(counts.left.len() == robots && counts.right.len() == robots, "one reading of each wheel a robot");
        let blocks = (0..robots).step_by(LANES).map(|first| {
            // Lanes without a robot stand where the last robot does.
            let robot = |lane: usize| (first + lane).min(robots - 1);
            let pose = |lane| world_from_body[robot(lane)];
            let counts = Wheels {
                left: std::array::from_fn(|lane| counts.left[robot(lane)]),
                right: std::array::from_fn(|lane| counts.right[robot(lane)]),
            };
            let theta_rad = std::array::from_fn(|lane| pose(lane).theta_rad);
            let places = |anchor_m| Places { anchor_m, dropped_m: [0.0; LANES], moved_m: [0.0; LANES] };
            Block {
                start_counts: counts,
                counts,
                since: Wheels::both([0.0; LANES]),
                start_theta_rad: theta_rad,
                theta_rad,
                x: places(std::array::from_fn(|lane| pose(lane).x_m)),
                y: places(std::array::from_fn(|lane| pose(lane).y_m)),
            }
        });
        Self { odometry, set, robots, steps: 0, blocks: blocks.collect() }
    }

    /// How many robots.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.robots
    }

    /// Is there none?
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.robots == 0
    }

    /// Where a robot believes it is.
    ///
    /// # Panics
    /// When there is no such robot.
    #[must_use]
    pub fn world_from_body(&self, robot: usize) -> Pose {
        assert!(robot < self.robots, "robot {robot} of {}", self.robots);
        let (block, k) = (&self.blocks[robot / LANES], robot % LANES);
        Pose::new(block.x.lane(k).now_m(), block.y.lane(k).now_m(), block.theta_rad[k])
    }

    /// Every robot's pose.
    pub fn poses(&self) -> impl ExactSizeIterator<Item = Pose> + '_ {
        (0..self.robots).map(|robot| self.world_from_body(robot))
    }

    /// Takes new cumulative counts of every robot.
    ///
    /// # Panics
    /// When there is not one reading of each wheel a robot.
    pub fn update(&mut self, counts: Wheels<&[C]>) {
        assert!(
            counts.left.len() == self.robots && counts.right.len() == self.robots,
            "one reading of each wheel a robot"
        );
        self.steps = (self.steps + 1) % GROUP;
        self.set.run(Update {
            odometry: &self.odometry,
            ends_group: self.steps == 0,
            blocks: &mut self.blocks,
            counts,
        });
    }
}

struct Update<'a, C> {
    odometry: &'a Odometry,
    ends_group: bool,
    blocks: &'a mut [Block<C>],
    counts: Wheels<&'a [C]>,
}

impl<C: Count> Kernel for Update<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let ((left, left_rest), (right, right_rest)) = (self.counts.left.as_chunks(), self.counts.right.as_chunks());
        let mut blocks = self.blocks.iter_mut();
        for ((left, right), block) in left.iter().zip(right).zip(&mut blocks) {
            block.update(self.odometry, Wheels { left, right }, self.ends_group);
        }
        let robots = left_rest.len();
        if let Some(block) = blocks.next() {
            // Lanes without a robot stand still.
            let mut filled = block.counts;
            filled.left[..left_rest.len()].copy_from_slice(left_rest);
            filled.right[..right_rest.len()].copy_from_slice(right_rest);
            if robots < FEWEST_FOR_A_BLOCK {
                block.one_by_one(self.odometry, filled.as_ref(), robots, self.ends_group);
            } else {
                block.update(self.odometry, filled.as_ref(), self.ends_group);
            }
        }
    }
}

impl<C: Count> Block<C> {
    #[inline(always)]
    #[allow(clippy::needless_range_loop)] // one lane of several columns
    fn update(&mut self, odometry: &Odometry, counts: Wheels<&[C; LANES]>, ends_group: bool) {
        let rad_per_count = odometry.rad_per_count();
        let mut since = Wheels::both([0.0; LANES]);
        let Wheels { left, right } = &mut since;
        let start = &self.start_counts;
        let differences_are_steps = C::column_since(counts.left, |k| start.left[k], left)
            & C::column_since(counts.right, |k| start.right[k], right);
        let (mut chord_m, mut theta_rad, mut half_rad) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (per_left, per_right) = (odometry.m_per_count.left, odometry.m_per_count.right);
        if differences_are_steps {
            for k in 0..LANES {
                chord_m[k] =
                    0.5 * (per_right * (right[k] - self.since.right[k]) + per_left * (left[k] - self.since.left[k]));
            }
        } else {
            for k in 0..LANES {
                chord_m[k] = 0.5
                    * (per_right * counts.right[k].since(self.counts.right[k])
                        + per_left * counts.left[k].since(self.counts.left[k]));
            }
        }
        for k in 0..LANES {
            theta_rad[k] = heading_rad(self.start_theta_rad[k], rad_per_count, left[k], right[k]);
            half_rad[k] = 0.5 * (theta_rad[k] - self.theta_rad[k]);
        }
        let (mut turns, mut ranges) = (0, 0);
        if odometry.rule == Rule::ExactArc {
            for k in 0..LANES {
                let (sinc, turn) = short_sinc(half_rad[k]);
                turns |= turn;
                chord_m[k] *= sinc;
            }
        }
        let mut moved_m = [[0.0; LANES]; 2];
        for k in 0..LANES {
            let direction = Direction::of(self.theta_rad[k] + half_rad[k]);
            ranges |= direction.range();
            [moved_m[0][k], moved_m[1][k]] = direction.along(chord_m[k]);
        }
        let is_beyond = (turns >> 63 != 0) | !Direction::is_found(ranges);
        if is_beyond | (C::CONVERTS_BY_BITS & !differences_are_steps) {
            self.one_by_one(odometry, counts, LANES, ends_group);
            return;
        }
        for k in 0..LANES {
            self.x.moved_m[k] += moved_m[0][k];
            self.y.moved_m[k] += moved_m[1][k];
        }
        self.theta_rad = theta_rad;
        self.since = since;
        self.counts = Wheels { left: *counts.left, right: *counts.right };
        if ends_group {
            for places in [&mut self.x, &mut self.y] {
                for k in 0..LANES {
                    let mut place = places.lane(k);
                    place.drop_anchor();
                    places.set_lane(k, place);
                }
            }
        }
    }

    #[inline(never)]
    fn one_by_one(&mut self, odometry: &Odometry, counts: Wheels<&[C; LANES]>, robots: usize, ends_group: bool) {
        for k in 0..robots {
            let of = |counts: &Wheels<[C; LANES]>| Wheels { left: counts.left[k], right: counts.right[k] };
            let now = Wheels { left: counts.left[k], right: counts.right[k] };
            let here = Pose::new(self.x.lane(k).now_m(), self.y.lane(k).now_m(), self.theta_rad[k]);
            let mut alone = DeadReckoning {
                start_theta_rad: self.start_theta_rad[k],
                start_counts: of(&self.start_counts),
                counts: of(&self.counts),
                place: [self.x.lane(k), self.y.lane(k)],
                steps: if ends_group { GROUP - 1 } else { 0 },
                ..odometry.start(here, now)
            };
            self.theta_rad[k] = alone.update(now).theta_rad;
            self.x.set_lane(k, alone.place[0]);
            self.y.set_lane(k, alone.place[1]);
            self.since.left[k] = now.left.since(self.start_counts.left[k]);
            self.since.right[k] = now.right.since(self.start_counts.right[k]);
        }
        self.counts = Wheels { left: *counts.left, right: *counts.right };
    }
}

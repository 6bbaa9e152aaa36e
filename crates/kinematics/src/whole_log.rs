//! Dead reckoning over columns of counts: block by block, each stage a loop without branches over the block, so that a compiler makes vectors of it.
//!
//! Headings follow from the counts since the start, chords from headings; neither waits for the step before it. What is left of the chain are the sums of
//! displacements, and these start from nothing in every group of 64 steps, four groups at a time. The bits are those of
//! [`DeadReckoning::update`](crate::DeadReckoning::update); a block that is beyond the loops' range (integers of 51 bits, headings of 10⁶ rad, a quarter
//! turn in a step) goes through it instead.

use std::f64::consts::FRAC_PI_4;

use crate::dead_reckoning::{GROUP, heading_rad};
use crate::instruction_set::Kernel;
use crate::trig::{LARGEST_RAD, exceeds, reduced, small_sinc};
use crate::{Count, DeadReckoning, InstructionSet, Pose, Rule, Wheels};

/// Steps of a block: its dozen columns of doubles stay in the nearest cache.
pub(crate) const BLOCK: usize = 256;

const GROUPS: usize = BLOCK / GROUP;

/// Fewer steps than this are not worth a block.
pub(crate) const FEWEST_FOR_A_BLOCK: usize = 24;

/// What becomes of the poses.
pub(crate) trait Sink {
    /// Are poses wanted before the last one of all?
    const EVERY: bool;

    /// Takes the poses that follow, in order.
    fn take(&mut self, poses: &[Pose]);

    /// Room for the next poses, where they are stored one after the other.
    #[inline(always)]
    fn room(&mut self) -> Option<&mut [Pose; BLOCK]> {
        None
    }
}

/// Stores every pose.
pub(crate) struct Every<'a>(pub(crate) &'a mut [Pose]);

impl Sink for Every<'_> {
    const EVERY: bool = true;

    #[inline(always)]
    fn take(&mut self, poses: &[Pose]) {
        let (now, later) = std::mem::take(&mut self.0).split_at_mut(poses.len());
        now.copy_from_slice(poses);
        self.0 = later;
    }

    #[inline(always)]
    fn room(&mut self) -> Option<&mut [Pose; BLOCK]> {
        let (now, later) = std::mem::take(&mut self.0).split_first_chunk_mut()?;
        self.0 = later;
        Some(now)
    }
}

/// Stores none: the state has the last.
pub(crate) struct Last;

impl Sink for Last {
    const EVERY: bool = false;

    #[inline(always)]
    fn take(&mut self, _: &[Pose]) {}
}

/// Stores those of some rows.
pub(crate) struct Rows<'a> {
    rows: &'a [usize],
    poses: &'a mut Vec<Pose>,
    /// The row of the next pose.
    row: usize,
}

impl<'a> Rows<'a> {
    /// `rows` are sorted and after the first, at which the log starts.
    pub(crate) const fn new(rows: &'a [usize], poses: &'a mut Vec<Pose>) -> Self {
        Self { rows, poses, row: 1 }
    }
}

impl Sink for Rows<'_> {
    const EVERY: bool = true;

    #[inline(always)]
    fn take(&mut self, poses: &[Pose]) {
        while let Some((row, later)) = self.rows.split_first()
            && *row < self.row + poses.len()
        {
            self.poses.push(poses[*row - self.row]);
            self.rows = later;
        }
        self.row += poses.len();
    }
}

/// Goes through a log's rows from a state, by a given instruction set; gives the state at the last.
#[inline]
pub(crate) fn walk<C: Count, S: Sink>(
    set: InstructionSet,
    state: DeadReckoning<C>,
    counts: Wheels<&[C]>,
    sink: S,
) -> DeadReckoning<C> {
    if counts.left.len() < FEWEST_FOR_A_BLOCK {
        let mut walk = Walk { state, counts, sink };
        walk.one_by_one(counts);
        return walk.state;
    }
    set.run(Walk { state, counts, sink })
}

struct Walk<'a, C, S> {
    state: DeadReckoning<C>,
    counts: Wheels<&'a [C]>,
    sink: S,
}

impl<C: Count, S: Sink> Kernel for Walk<'_, C, S> {
    type Output = DeadReckoning<C>;

    #[inline(always)]
    fn run(mut self) -> DeadReckoning<C> {
        // A group that was begun one by one is ended so.
        let begun = (GROUP - self.state.steps) % GROUP;
        let (first, counts) = split(self.counts, begun);
        self.one_by_one(first);
        let ((left, left_rest), (right, right_rest)) = (counts.left.as_chunks(), counts.right.as_chunks());
        let mut columns = Columns::EMPTY;
        for (left, right) in left.iter().zip(right) {
            self.block(&mut columns, Wheels { left, right }, BLOCK);
        }
        let rest = Wheels { left: left_rest, right: right_rest };
        if rest.left.len() < FEWEST_FOR_A_BLOCK {
            self.one_by_one(rest);
        } else {
            // Standing still after the last step.
            let filled = rest.map(|rest| {
                let mut filled = [rest[rest.len() - 1]; BLOCK];
                filled[..rest.len()].copy_from_slice(rest);
                filled
            });
            self.block(&mut columns, filled.as_ref(), rest.left.len());
        }
        self.state
    }
}

fn split<C>(counts: Wheels<&[C]>, at: usize) -> (Wheels<&[C]>, Wheels<&[C]>) {
    let at = at.min(counts.left.len());
    let ((left, later_left), (right, later_right)) = (counts.left.split_at(at), counts.right.split_at(at));
    (Wheels { left, right }, Wheels { left: later_left, right: later_right })
}

/// A block's columns. Those with a further row have the block before's last in the first.
struct Columns {
    since: Wheels<[f64; BLOCK + 1]>,
    theta_rad: [f64; BLOCK + 1],
    /// Displacement of each step, along x and y; then their sums within the group.
    moved_m: [[f64; 2]; BLOCK],
    poses: [Pose; BLOCK],
}

impl Columns {
    const EMPTY: Self = Self {
        since: Wheels { left: [0.0; BLOCK + 1], right: [0.0; BLOCK + 1] },
        theta_rad: [0.0; BLOCK + 1],
        moved_m: [[0.0; 2]; BLOCK],
        poses: [Pose::IDENTITY; BLOCK],
    };

    /// Displacement of every step; false where a number is beyond the loops' range.
    #[inline(always)]
    fn displace<C: Count>(&mut self, state: &DeadReckoning<C>, counts: Wheels<&[C; BLOCK]>) -> bool {
        let Wheels { left: since_left, right: since_right } = &mut self.since;
        since_left[0] = state.counts.left.since(state.start_counts.left);
        since_right[0] = state.counts.right.since(state.start_counts.right);
        let differences_are_steps = C::column_since(counts.left, |_| state.start_counts.left, &mut since_left[1..])
            & C::column_since(counts.right, |_| state.start_counts.right, &mut since_right[1..]);
        self.theta_rad[0] = state.world_from_body.theta_rad;
        let since = since_left[1..].iter().zip(&since_right[1..]);
        for (theta_rad, (left, right)) in self.theta_rad[1..].iter_mut().zip(since) {
            *theta_rad = heading_rad(state.start_theta_rad, state.rad_per_count, *left, *right);
        }
        if !differences_are_steps {
            if C::CONVERTS_BY_BITS {
                return false;
            }
            let (mut left, mut right) = (state.counts.left, state.counts.right);
            for k in 0..BLOCK {
                since_left[k] = counts.left[k].since(left);
                since_right[k] = counts.right[k].since(right);
                (left, right) = (counts.left[k], counts.right[k]);
            }
        }
        let m_per_count = state.odometry.m_per_count;
        match (state.odometry.rule, differences_are_steps) {
            (Rule::Midpoint, true) => self.displace_by::<false, true>(m_per_count),
            (Rule::Midpoint, false) => self.displace_by::<false, false>(m_per_count),
            (Rule::ExactArc, true) => self.displace_by::<true, true>(m_per_count),
            (Rule::ExactArc, false) => self.displace_by::<true, false>(m_per_count),
        }
    }

    /// Displacements from headings and steps, which are the differences of `since` or stand in it.
    #[inline(always)]
    fn displace_by<const EXACT_ARC: bool, const DIFFERENCES: bool>(&mut self, m_per_count: Wheels<f64>) -> bool {
        // Halving is exact before and after.
        let half_m_per_count = m_per_count.map(|m_per_count| 0.5 * m_per_count);
        let mut beyond = 0;
        for k in 0..BLOCK {
            let step = |since: &[f64; BLOCK + 1]| if DIFFERENCES { since[k + 1] - since[k] } else { since[k] };
            let distance_m =
                half_m_per_count.right * step(&self.since.right) + half_m_per_count.left * step(&self.since.left);
            let half_rad = 0.5 * (self.theta_rad[k + 1] - self.theta_rad[k]);
            let chord_rad = self.theta_rad[k] + half_rad;
            let chord_m = if EXACT_ARC {
                beyond |= exceeds(half_rad, FRAC_PI_4);
                distance_m * small_sinc(half_rad)
            } else {
                distance_m
            };
            beyond |= exceeds(chord_rad, LARGEST_RAD);
            let (sin, cos) = reduced(chord_rad);
            self.moved_m[k] = [chord_m * cos, chord_m * sin];
        }
        beyond >> 63 == 0
    }

    /// Sums of the displacements, from nothing in each group.
    #[inline(always)]
    fn sum_up(&mut self) {
        let mut sums_m = [[0.0; 2]; GROUPS];
        for step in 0..GROUP {
            for (group, [x_m, y_m]) in sums_m.iter_mut().enumerate() {
                let [dx_m, dy_m] = &mut self.moved_m[group * GROUP + step];
                (*x_m, *y_m) = (*x_m + *dx_m, *y_m + *dy_m);
                (*dx_m, *dy_m) = (*x_m, *y_m);
            }
        }
    }
}

impl<C: Count, S: Sink> Walk<'_, C, S> {
    #[inline(always)]
    fn one_by_one(&mut self, counts: Wheels<&[C]>) {
        for (&left, &right) in counts.left.iter().zip(counts.right) {
            let pose = self.state.update(Wheels { left, right });
            if S::EVERY {
                self.sink.take(&[pose]);
            }
        }
    }

    /// A block of which `used` steps are steps, from the beginning of a group.
    #[inline(always)]
    fn block(&mut self, columns: &mut Columns, counts: Wheels<&[C; BLOCK]>, used: usize) {
        if !columns.displace(&self.state, counts) {
            self.one_by_one(Wheels { left: &counts.left[..used], right: &counts.right[..used] });
            return;
        }
        columns.sum_up();
        let state = &mut self.state;
        let stored = if S::EVERY && used == BLOCK { self.sink.room() } else { None };
        let is_stored = stored.is_some();
        let poses = stored.unwrap_or(&mut columns.poses);
        for (group, poses) in poses.as_chunks_mut::<GROUP>().0.iter_mut().enumerate() {
            let first = group * GROUP;
            if first >= used {
                break;
            }
            if S::EVERY {
                let [x, y] = state.place;
                let moved_m = &columns.moved_m[first..first + GROUP];
                let theta_rad = &columns.theta_rad[first + 1..=first + GROUP];
                for ((pose, [dx_m, dy_m]), theta_rad) in poses.iter_mut().zip(moved_m).zip(theta_rad) {
                    *pose = Pose::new(x.anchor_m + (x.dropped_m + dx_m), y.anchor_m + (y.dropped_m + dy_m), *theta_rad);
                }
            }
            let last = (first + GROUP).min(used) - 1;
            let [x, y] = &mut state.place;
            [x.moved_m, y.moved_m] = columns.moved_m[last];
            state.world_from_body = Pose::new(x.now_m(), y.now_m(), columns.theta_rad[last + 1]);
            state.steps = last + 1 - first;
            if state.steps == GROUP {
                x.drop_anchor();
                y.drop_anchor();
                state.steps = 0;
            }
        }
        state.counts = Wheels { left: counts.left[used - 1], right: counts.right[used - 1] };
        if S::EVERY && !is_stored {
            self.sink.take(&columns.poses[..used]);
        }
    }
}

//! Dead reckoning over columns of counts: block by block, each stage a loop without branches over the block,
//! so that a compiler makes vectors of it.
//!
//! Headings follow from the counts since the start, chords from headings; neither waits for the step before
//! it. What is left of the chain are the sums of displacements, and these start from nothing in every group
//! of 64 steps, four groups at a time. The bits are those of
//! [`DeadReckoning::update`](crate::DeadReckoning::update); a block that is beyond the loops' range (integers
//! of 51 bits, headings of 10⁶ rad, half a radian turned in a step) goes through it instead.

use crate::dead_reckoning::{CompensatedSum, GROUP, heading_rad};
use crate::instruction_set::Kernel;
use crate::prefetch::{prefetch_read, prefetch_write};
use crate::trig::{Direction, short_sinc};
use crate::{Count, DeadReckoning, InstructionSet, Pose, Rule, Wheels};

/// Groups of a block: their sums do not wait for each other.
const GROUPS: usize = 4;

/// Steps of a block.
pub(crate) const BLOCK: usize = GROUPS * GROUP;

/// Steps ahead of those being written, and of those being read, whose memory is asked for; from two to eight
/// groups cost the same within the noise of a log of 10⁷ steps.
const WRITE_PREFETCH_STEPS: usize = 2 * GROUP;
const READ_PREFETCH_STEPS: usize = BLOCK;

/// Fewer steps than this are not worth a block.
pub(crate) const MIN_STEPS_FOR_A_BLOCK: usize = 24;

/// What becomes of the poses.
pub(crate) trait Sink {
    /// Are poses wanted before the last one of all?
    const EVERY: bool;

    /// Takes the poses that follow, in order.
    fn take(&mut self, poses: &[Pose]);

    /// Room for the next poses, where they are stored one after the other.
    #[inline(always)]
    fn room(&mut self) -> Option<&mut [Pose; GROUP]> {
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
    fn room(&mut self) -> Option<&mut [Pose; GROUP]> {
        let (now, later) = std::mem::take(&mut self.0).split_first_chunk_mut()?;
        if let Some(upcoming) = later.get(WRITE_PREFETCH_STEPS..) {
            upcoming.first_chunk::<GROUP>().into_iter().for_each(prefetch_write);
        }
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
    if counts.left.len() < MIN_STEPS_FOR_A_BLOCK {
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
    fn call(mut self) -> DeadReckoning<C> {
        // A group that was begun one by one is ended so.
        let begun = (GROUP - self.state.steps) % GROUP;
        let (first, counts) = split(self.counts, begun);
        self.one_by_one(first);
        let mut columns = Columns::EMPTY;
        columns.start_from(&self.state);
        let ((left, left_rest), (right, right_rest)) = (counts.left.as_chunks(), counts.right.as_chunks());
        let (mut left, mut right) = (left.chunks_exact(GROUPS), right.chunks_exact(GROUPS));
        let mut upcoming = counts.map(|counts| counts.get(READ_PREFETCH_STEPS..).unwrap_or(&[]));
        for (left, right) in (&mut left).zip(&mut right) {
            self.block(&mut columns, Wheels { left, right }, upcoming, BLOCK);
            upcoming = upcoming.map(|counts| counts.get(BLOCK..).unwrap_or(&[]));
        }
        // The groups that are left, and the last filled up by standing still.
        let mut groups = Wheels { left: left.remainder(), right: right.remainder() }.map(|groups| {
            let mut filled = [[counts.left[0]; GROUP]; GROUPS];
            filled[..groups.len()].copy_from_slice(groups);
            filled
        });
        let whole = left.remainder().len();
        let mut rest = Wheels { left: left_rest, right: right_rest };
        let mut steps = whole * GROUP;
        if rest.left.len() >= MIN_STEPS_FOR_A_BLOCK {
            for (filled, rest) in [(&mut groups.left, rest.left), (&mut groups.right, rest.right)] {
                filled[whole] = [rest[rest.len() - 1]; GROUP];
                filled[whole][..rest.len()].copy_from_slice(rest);
            }
            steps += rest.left.len();
            rest = Wheels::both(&[]);
        }
        if steps > 0 {
            let used = ..steps.div_ceil(GROUP);
            let groups = Wheels { left: &groups.left[used], right: &groups.right[used] };
            self.block(&mut columns, groups, Wheels::both(&[]), steps);
        }
        self.write_waiting(&mut columns);
        self.one_by_one(rest);
        self.state
    }
}

fn split<C>(counts: Wheels<&[C]>, at: usize) -> (Wheels<&[C]>, Wheels<&[C]>) {
    let at = at.min(counts.left.len());
    let ((left, later_left), (right, later_right)) = (counts.left.split_at(at), counts.right.split_at(at));
    (Wheels { left, right }, Wheels { left: later_left, right: later_right })
}

/// The last row of the group before, and a group's rows, which begin where a vector does.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Column([f64; BEFORE + GROUP]);

/// Rows before a group's own.
const BEFORE: usize = 8;

impl Column {
    const EMPTY: Self = Self([0.0; BEFORE + GROUP]);

    #[inline(always)]
    const fn set_before(&mut self, value: f64) {
        self.0[BEFORE - 1] = value;
    }

    #[inline(always)]
    const fn keep_last(&mut self) {
        self.0[BEFORE - 1] = self.0[BEFORE + GROUP - 1];
    }
}

/// What is known of a group before its place is.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct GroupDisplacement {
    theta_rad: [f64; GROUP],
    /// Displacement of each step, along x and y; then their sums.
    moved_m: [[f64; 2]; GROUP],
}

impl GroupDisplacement {
    const EMPTY: Self = Self { theta_rad: [0.0; GROUP], moved_m: [[0.0; 2]; GROUP] };
}

/// The columns of the group at hand, the block at hand, and the block that waits for its place.
struct Columns {
    /// Counts since the start; where these do not tell the steps, the steps.
    since: Wheels<Column>,
    theta_rad: Column,
    blocks: [[GroupDisplacement; GROUPS]; 2],
    /// Which of the two is at hand.
    current: usize,
    /// Steps of the one that waits.
    waiting: usize,
    poses: [Pose; GROUP],
}

impl Columns {
    const EMPTY: Self = Self {
        since: Wheels { left: Column::EMPTY, right: Column::EMPTY },
        theta_rad: Column::EMPTY,
        blocks: [[GroupDisplacement::EMPTY; GROUPS]; 2],
        current: 0,
        waiting: 0,
        poses: [Pose::IDENTITY; GROUP],
    };

    #[inline(always)]
    fn start_from<C: Count>(&mut self, state: &DeadReckoning<C>) {
        self.since.left.set_before(state.counts.left.since(state.start_counts.left));
        self.since.right.set_before(state.counts.right.since(state.start_counts.right));
        self.theta_rad.set_before(state.world_from_body.theta_rad);
    }

    /// Displacement of every step of a group, the readings before it being `before`; false where a number is
    /// beyond the loops' range.
    #[inline(always)]
    fn displace<C: Count>(
        &mut self,
        state: &DeadReckoning<C>,
        before: Wheels<C>,
        counts: Wheels<&[C; GROUP]>,
        group: usize,
    ) -> bool {
        let moved = &mut self.blocks[self.current][group];
        let (Wheels { left, right }, theta_rad) = (&mut self.since, &mut self.theta_rad);
        let differences_are_steps = since_start(state, counts, left, right, theta_rad, &mut moved.theta_rad);
        if !differences_are_steps {
            if C::CONVERTS_BY_BITS {
                return false;
            }
            let mut before = before;
            for k in 0..GROUP {
                left.0[BEFORE + k] = counts.left[k].since(before.left);
                right.0[BEFORE + k] = counts.right[k].since(before.right);
                before = Wheels { left: counts.left[k], right: counts.right[k] };
            }
        }
        let (m_per_count, moved_m) = (state.odometry.m_per_count, &mut moved.moved_m);
        match (state.odometry.rule, differences_are_steps) {
            (Rule::Midpoint, true) => displace::<false, true>(m_per_count, left, right, theta_rad, moved_m),
            (Rule::Midpoint, false) => displace::<false, false>(m_per_count, left, right, theta_rad, moved_m),
            (Rule::ExactArc, true) => displace::<true, true>(m_per_count, left, right, theta_rad, moved_m),
            (Rule::ExactArc, false) => displace::<true, false>(m_per_count, left, right, theta_rad, moved_m),
        }
    }

    /// The group at hand is the one before the next.
    #[inline(always)]
    const fn next_group(&mut self) {
        self.since.left.keep_last();
        self.since.right.keep_last();
        self.theta_rad.keep_last();
    }
}

/// Counts since the start and headings of a group; are the differences of those counts the steps between the
/// readings? Columns are arguments of their own: compilers know of these that none overlaps another.
#[inline(always)]
fn since_start<C: Count>(
    state: &DeadReckoning<C>,
    counts: Wheels<&[C; GROUP]>,
    since_left: &mut Column,
    since_right: &mut Column,
    theta_rad: &mut Column,
    kept_theta_rad: &mut [f64; GROUP],
) -> bool {
    let (start, start_rad, rad_per_count) = (state.start_counts, state.start_theta_rad, state.rad_per_count);
    let differences_are_steps = C::column_since(counts.left, |_| start.left, &mut since_left.0[BEFORE..])
        & C::column_since(counts.right, |_| start.right, &mut since_right.0[BEFORE..]);
    for (k, kept) in kept_theta_rad.iter_mut().enumerate() {
        let now = BEFORE + k;
        theta_rad.0[now] = heading_rad(start_rad, rad_per_count, since_left.0[now], since_right.0[now]);
        *kept = theta_rad.0[now];
    }
    differences_are_steps
}

/// Displacements from headings and steps, which are the differences of `since` or stand in it; false where a
/// number is beyond the loop's range.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // one step of several columns; compilers make no vectors of it otherwise
fn displace<const EXACT_ARC: bool, const DIFFERENCES: bool>(
    m_per_count: Wheels<f64>,
    since_left: &Column,
    since_right: &Column,
    theta_rad: &Column,
    moved_m: &mut [[f64; 2]; GROUP],
) -> bool {
    // Halving is exact before and after.
    let half_m_per_count = m_per_count.map(|m_per_count| 0.5 * m_per_count);
    let (mut turns, mut ranges) = (0, 0);
    for k in 0..GROUP {
        let now = BEFORE + k;
        let (mut left, mut right) = (since_left.0[now], since_right.0[now]);
        if DIFFERENCES {
            (left, right) = (left - since_left.0[now - 1], right - since_right.0[now - 1]);
        }
        let distance_m = half_m_per_count.right * right + half_m_per_count.left * left;
        let before_rad = theta_rad.0[now - 1];
        let half_rad = 0.5 * (theta_rad.0[now] - before_rad);
        let chord_m = if EXACT_ARC {
            let (sinc, turn) = short_sinc(half_rad);
            turns |= turn;
            distance_m * sinc
        } else {
            distance_m
        };
        let direction = Direction::of(before_rad + half_rad);
        ranges |= direction.range();
        moved_m[k] = direction.along(chord_m);
    }
    (turns >> 63 == 0) & Direction::is_found(ranges)
}

/// Sums of the displacements, from nothing in each group.
#[inline(always)]
fn prefix_sums(block: &mut [GroupDisplacement; GROUPS]) {
    let mut sums_m = [[0.0; 2]; GROUPS];
    for step in 0..GROUP {
        for (group, [x_m, y_m]) in block.iter_mut().zip(&mut sums_m) {
            let [dx_m, dy_m] = &mut group.moved_m[step];
            (*x_m, *y_m) = (*x_m + *dx_m, *y_m + *dy_m);
            (*dx_m, *dy_m) = (*x_m, *y_m);
        }
    }
}

/// Poses of a group whose place is known.
#[inline(always)]
fn fill(
    poses: &mut [Pose; GROUP],
    [x, y]: [CompensatedSum; 2],
    GroupDisplacement { theta_rad, moved_m }: &GroupDisplacement,
) {
    let moved = moved_m.as_chunks().0.iter().zip(theta_rad.as_chunks().0);
    // Eight by eight: vectors of the widest set are put together, then stored.
    for (poses, (moved_m, theta_rad)) in poses.as_chunks_mut::<8>().0.iter_mut().zip(moved) {
        let moved_m: &[[f64; 2]; 8] = moved_m;
        let theta_rad: &[f64; 8] = theta_rad;
        let mut places = [[0.0; 2]; 8];
        for k in 0..8 {
            places[k] = [x.after_m(moved_m[k][0]), y.after_m(moved_m[k][1])];
        }
        for k in 0..8 {
            poses[k] = Pose::new(places[k][0], places[k][1], theta_rad[k]);
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

    /// A block of which `used` steps are steps. Its displacements are found while the block before is placed
    /// and its poses are written, group by group: the memory writes while the processor computes. `upcoming`
    /// are the counts whose memory is asked for meanwhile.
    #[inline(always)]
    fn block(&mut self, columns: &mut Columns, counts: Wheels<&[[C; GROUP]]>, upcoming: Wheels<&[C]>, used: usize) {
        let (mut before, mut is_within) = (self.state.counts, true);
        for (group, (left, right)) in counts.left.iter().zip(counts.right).enumerate() {
            for upcoming in [upcoming.left, upcoming.right] {
                upcoming.get(group * GROUP..).and_then(<[C]>::first_chunk::<GROUP>).into_iter().for_each(prefetch_read);
            }
            is_within &= columns.displace(&self.state, before, Wheels { left, right }, group);
            columns.next_group();
            before = Wheels { left: left[GROUP - 1], right: right[GROUP - 1] };
            self.write_group(columns, group);
        }
        (counts.left.len()..GROUPS).for_each(|group| self.write_group(columns, group));
        columns.waiting = 0;
        let (left, right) = (&counts.left.as_flattened()[..used], &counts.right.as_flattened()[..used]);
        if !is_within {
            self.one_by_one(Wheels { left, right });
            columns.start_from(&self.state);
            return;
        }
        prefix_sums(&mut columns.blocks[columns.current]);
        columns.current = 1 - columns.current;
        columns.waiting = used;
        self.state.counts = Wheels { left: left[used - 1], right: right[used - 1] };
    }

    /// Places the block that waits.
    #[inline(always)]
    fn write_waiting(&mut self, columns: &mut Columns) {
        (0..GROUPS).for_each(|group| self.write_group(columns, group));
        columns.waiting = 0;
    }

    /// Places a group of the block that waits, if there is one.
    #[inline(always)]
    fn write_group(&mut self, columns: &mut Columns, group: usize) {
        let used = columns.waiting.saturating_sub(group * GROUP).min(GROUP);
        let Some(last) = used.checked_sub(1) else { return };
        let moved = &columns.blocks[1 - columns.current][group];
        let state = &mut self.state;
        if S::EVERY {
            if let Some(room) = if used == GROUP { self.sink.room() } else { None } {
                fill(room, state.position, moved);
            } else {
                fill(&mut columns.poses, state.position, moved);
                self.sink.take(&columns.poses[..used]);
            }
        }
        let [x, y] = &mut state.position;
        [x.moved_m, y.moved_m] = moved.moved_m[last];
        state.world_from_body = Pose::new(x.now_m(), y.now_m(), moved.theta_rad[last]);
        state.steps = used;
        if used == GROUP {
            x.drop_anchor();
            y.drop_anchor();
            state.steps = 0;
        }
    }
}

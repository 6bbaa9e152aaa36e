//! The likeliest numbers of a log's rows on a beat (Viterbi 1967): each path through lost and late rows has
//! its own idea of how late rows usually are, and the likeliest few are followed side by side.

use crate::order_statistics::median;
use crate::settings::{NUMBERING, Numbering};

/// Log odds against what happens to single rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowCosts {
    /// Against a lost row.
    lost: f64,
    /// Against a row that came by itself.
    by_itself: f64,
}

impl RowCosts {
    /// Before anything is known of a log.
    pub(crate) fn unknown() -> Self {
        Self { lost: NUMBERING.lost_cost, by_itself: NUMBERING.by_itself_cost }
    }

    /// Of a log whose rows have these numbers, as far as they are lower.
    pub(crate) fn of(numbers: &[i64]) -> Self {
        let steps = || numbers.windows(2).map(|pair| pair[1] - pair[0]);
        let of_share = |count: usize, unknown: f64| {
            (numbers.len() as f64 / count.max(1) as f64).ln().clamp(NUMBERING.min_cost, unknown)
        };
        let unknown = Self::unknown();
        Self {
            lost: of_share(steps().filter(|step| *step > 1).count(), unknown.lost),
            by_itself: of_share(steps().filter(|step| *step == 0).count(), unknown.by_itself),
        }
    }
}

/// One way to number the rows so far.
#[derive(Debug, Clone, Copy)]
struct Path {
    number: i64,
    cost: f64,
    /// How late rows usually are on it, in beats.
    usual: f64,
    /// The path that it goes on from, among those of the row before.
    from: u8,
}

impl Path {
    /// Takes its place among the likeliest ones, the likeliest first, of each number the likelier.
    fn among(self, likeliest: &mut Vec<Self>, paths: usize) {
        let is_before = |of: &Self| of.cost.total_cmp(&self.cost).then(of.number.cmp(&self.number)).is_lt();
        if likeliest.len() == paths && likeliest.last().is_some_and(is_before) {
            return;
        }
        if let Some(same) = likeliest.iter().position(|of| of.number == self.number) {
            if likeliest[same].cost <= self.cost {
                return;
            }
            likeliest.remove(same);
        }
        likeliest.insert(likeliest.partition_point(is_before), self);
        likeliest.truncate(paths);
    }
}

/// Cost of a row that is later than usual by so much of its standard deviation.
fn huber(deviation: f64, huber_sigmas: f64) -> f64 {
    let size = deviation.abs();
    if size <= huber_sigmas { 0.5 * size * size } else { huber_sigmas * (size - 0.5 * huber_sigmas) }
}

/// Cost of a step by so many ticks.
fn step_cost(ticks: i64, costs: RowCosts, settings: &Numbering) -> f64 {
    match ticks {
        ..=1 => 0.0,
        _ => (costs.lost + settings.further_lost_cost * (ticks - 2) as f64).min(settings.pause_cost),
    }
}

/// Standard deviation of stamps, in beats: by second differences, of which the middle one has no lost rows.
fn jitter(t_s: &[f64], period_s: f64) -> f64 {
    let second = t_s.windows(3).map(|three| (three[2] - 2.0 * three[1] + three[0]).abs() / period_s);
    // Second differences of independent normal errors have √6 times their standard deviation, gaps √2 times.
    let of_second = median(second).unwrap_or(0.0) / (0.674_49 * 6_f64.sqrt());
    of_second.max(NUMBERING.min_jitter)
}

/// The numbers by the likeliest path, and its cost: that of one beat over another one's counts the densities
/// of lateness in seconds, or the beat by which stamps jitter most were always the likeliest.
pub(crate) fn likeliest_numbers(t_s: &[f64], period_s: f64, costs: RowCosts) -> (Vec<i64>, f64) {
    let settings = &*NUMBERING;
    let at = |row: usize| (t_s[row] - t_s[0]) / period_s;
    let jitter = jitter(t_s, period_s);
    // The first row may be late itself.
    let usual = median((0..settings.first_rows).map(|row| at(row) - row as f64)).unwrap_or(0.0);
    // The paths of all rows, and where each row's begin.
    let (mut paths, mut starts) = (vec![Path { number: 0, cost: 0.0, usual, from: 0 }], vec![0]);
    let mut next: Vec<Path> = Vec::with_capacity(settings.paths + 1);
    for row in 1..t_s.len() {
        next.clear();
        for (from, path) in (0_u8..).zip(&paths[starts[row - 1]..]) {
            let mut offer = |path: Path| path.among(&mut next, settings.paths);
            let due = at(row) - path.usual;
            for number in [path.number + 1, due.floor() as i64, due.ceil() as i64] {
                if number > path.number {
                    let late = at(row) - number as f64 - path.usual;
                    let cost = path.cost
                        + step_cost(number - path.number, costs, settings)
                        + huber(late / jitter, settings.huber_sigmas);
                    let learnt = late.clamp(-2.0 * jitter, 2.0 * jitter) / settings.memory_rows.min(row as f64 + 1.0);
                    offer(Path { number, cost, usual: path.usual + learnt, from });
                }
            }
            // A row that came by itself is of no tick, and as late as it likes.
            offer(Path { cost: path.cost + costs.by_itself, from, ..path.to_owned() });
            // The beat begins anew, as after a pause that is no whole number of ticks.
            let number = path.number + 1;
            offer(Path { number, cost: path.cost + settings.pause_cost, usual: at(row) - number as f64, from });
        }
        starts.push(paths.len());
        paths.extend_from_slice(&next);
    }
    let mut numbers = vec![0; t_s.len()];
    let cost = paths[starts[t_s.len() - 1]].cost;
    let mut at = 0;
    for row in (0..t_s.len()).rev() {
        let path = paths[starts[row] + at];
        (numbers[row], at) = (path.number, usize::from(path.from));
    }
    (numbers, cost + t_s.len() as f64 * (jitter * period_s).ln())
}

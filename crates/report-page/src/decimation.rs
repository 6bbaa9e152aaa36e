//! Which points of many paths are drawn, when not all can be.
//!
//! Douglas & Peucker (1973), with a budget over all runs instead of a tolerance: the piece of any run whose
//! farthest point is farthest from its chord is divided there, until the budget is spent. So what a path
//! does at most is kept whatever the budget, and every run keeps both ends. A run has several tracks, which
//! are kept at the same instants, so that they can be compared there; a piece's distance is the largest of
//! theirs.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A position in metres.
pub(crate) type Point = [f64; 2];

/// A piece between two points that are kept.
struct Piece {
    run: usize,
    from: usize,
    to: usize,
    /// The farthest point between them.
    at: usize,
    distance_m: f64,
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = self.distance_m.total_cmp(&other.distance_m);
        order.then_with(|| (other.run, other.from).cmp(&(self.run, self.from)))
    }
}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

/// Distance of a point from a chord, metres.
fn from_chord_m(point: Point, [from, to]: [Point; 2]) -> f64 {
    let chord = [to[0] - from[0], to[1] - from[1]];
    let of = [point[0] - from[0], point[1] - from[1]];
    let square = chord[0].mul_add(chord[0], chord[1] * chord[1]);
    // A chord of no length: the distance from its one point.
    let share = if square > 0.0 { (of[0] * chord[0] + of[1] * chord[1]) / square } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (of[0] - share * chord[0]).hypot(of[1] - share * chord[1])
}

fn piece(tracks: &[Vec<Point>], run: usize, from: usize, to: usize) -> Option<Piece> {
    let mut farthest: Option<(usize, f64)> = None;
    for track in tracks.iter().filter(|track| !track.is_empty()) {
        let chord = [track[from], track[to]];
        for (at, point) in track.iter().enumerate().take(to).skip(from + 1) {
            let distance_m = from_chord_m(*point, chord);
            if farthest.is_none_or(|(_, most_m)| distance_m > most_m) {
                farthest = Some((at, distance_m));
            }
        }
    }
    farthest.map(|(at, distance_m)| Piece { run, from, to, at, distance_m })
}

/// Indices of the points that are kept of each run, in order: `budget` of them over all runs, but both ends
/// of each. Tracks of a run have one length, or none.
pub(crate) fn kept(runs: &[&[Vec<Point>]], budget: usize) -> Vec<Vec<usize>> {
    let length = |tracks: &[Vec<Point>]| tracks.iter().map(Vec::len).max().unwrap_or(0);
    let ends = |tracks: &&[Vec<Point>]| match length(tracks) {
        0 => Vec::new(),
        1 => vec![0],
        points => vec![0, points - 1],
    };
    let mut kept: Vec<Vec<usize>> = runs.iter().map(ends).collect();
    let mut drawn: usize = kept.iter().map(Vec::len).sum();
    let whole = |(run, tracks): (usize, &&[Vec<Point>])| piece(tracks, run, 0, length(tracks).saturating_sub(1));
    let mut pieces: BinaryHeap<Piece> = runs.iter().enumerate().filter_map(whole).collect();
    while drawn < budget {
        let Some(Piece { run, from, to, at, .. }) = pieces.pop() else { break };
        kept[run].push(at);
        drawn += 1;
        pieces.extend(piece(runs[run], run, from, at));
        pieces.extend(piece(runs[run], run, at, to));
    }
    kept.iter_mut().for_each(|kept| kept.sort_unstable());
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run along x with one spike, and a quarter of a circle.
    fn runs() -> [Vec<Vec<Point>>; 2] {
        let mut line: Vec<Point> = (0..10_000).map(|k| [f64::from(k) * 1e-3, 0.0]).collect();
        line[7123][1] = 0.2;
        let other = line.iter().map(|[x, _]| [*x, 1.0]).collect();
        let arc = (0..1000).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_2 / 999.0);
        [vec![line, other], vec![arc.map(|angle| [angle.cos(), angle.sin()]).collect()]]
    }

    #[test]
    fn extremes_and_ends_are_kept_whatever_the_budget() {
        let runs = runs();
        let views: Vec<&[Vec<Point>]> = runs.iter().map(Vec::as_slice).collect();
        let kept = kept(&views, 6);
        // Both ends of both runs, the arc's middle, farther from its chord than the spike, and the spike.
        assert_eq!(kept.iter().map(Vec::len).sum::<usize>(), 6);
        assert_eq!(kept[0], [0, 7123, 9999]);
        assert_eq!((kept[1][0], kept[1].len(), kept[1][2]), (0, 3, 999));
        // Every hundredth point would have lost the spike.
        assert!((0..10_000).step_by(100).all(|at| at != 7123));
    }

    #[test]
    fn a_budget_that_is_large_enough_keeps_every_point() {
        let runs = runs();
        let views: Vec<&[Vec<Point>]> = runs.iter().map(Vec::as_slice).collect();
        let all = kept(&views, usize::MAX);
        assert_eq!(all.iter().map(Vec::len).collect::<Vec<_>>(), [10_000, 1000]);
        assert!(all.iter().all(|kept| kept.iter().enumerate().all(|(place, at)| place == *at)));
    }

    #[test]
    fn what_was_left_out_is_near_to_what_is_drawn() {
        let runs = runs();
        let kept = kept(&[&runs[1]], 33);
        let arc = &runs[1][0];
        let farthest_m = kept[0]
            .windows(2)
            .flat_map(|ends| (ends[0]..=ends[1]).map(|at| from_chord_m(arc[at], [arc[ends[0]], arc[ends[1]]])))
            .fold(0.0, f64::max);
        // 999 steps of π/1998 in 32 pieces of at most 32: the sagitta of one is (32 π/1998)²/8 = 3.165e-4.
        assert!(farthest_m < 3.17e-4, "{farthest_m}");
    }

    #[test]
    fn runs_of_no_point_and_of_one_are_no_trouble() {
        assert_eq!(kept(&[&[], &[vec![]], &[vec![[1.0, 2.0]]]], 10), [vec![], vec![], vec![0]]);
    }
}

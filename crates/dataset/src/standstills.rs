//! Where a log is cut into runs: in the middle of long standstills, at gaps, and where time restarts.

use std::ops::Range;

/// The pieces of `rows` rows that move, in order. `step_s` is the time between two rows; a negative one is a
/// restart. `stands` says whether the wheels stand between a row and the next.
pub fn moving_pieces(
    rows: usize,
    step_s: impl Fn(usize, usize) -> f64,
    stands: impl Fn(usize, usize) -> bool,
    cut_s: f64,
) -> Vec<Range<usize>> {
    // Ends of pieces: the index of the first row that belongs to the next.
    let (mut ends, mut stood_since) = (Vec::new(), 0);
    for row in 1..rows {
        let gap_s = step_s(row - 1, row);
        if gap_s < 0.0 || gap_s > cut_s {
            ends.push(row);
            stood_since = row;
        } else if !stands(row - 1, row) {
            if step_s(stood_since, row - 1) > cut_s {
                ends.push(usize::midpoint(stood_since, row - 1));
            }
            stood_since = row;
        }
    }
    ends.push(rows);
    let starts = std::iter::once(0).chain(ends.clone());
    let pieces = starts.zip(ends).map(|(start, end)| start..end);
    pieces.filter(|piece| (piece.start + 1..piece.end).any(|row| !stands(row - 1, row))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_standstills_gaps_and_restarts_cut_and_short_ones_do_not() {
        let t_s = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 20.0, 21.0, 3.0, 4.0];
        let wheel = [0, 1, 2, 2, 2, 2, 2, 3, 4, 5, 6, 7];
        let pieces = |cut_s| {
            moving_pieces(t_s.len(), |from, to| t_s[to] - t_s[from], |from, to| wheel[from] == wheel[to], cut_s)
        };
        assert_eq!(pieces(3.0), [0..4, 4..8, 8..10, 10..12]);
        assert_eq!(pieces(10.0), [0..8, 8..10, 10..12]);
        assert_eq!(pieces(15.0), [0..10, 10..12]);
        assert_eq!(moving_pieces(0, |_, _| 0.0, |_, _| true, 1.0), []);
    }
}

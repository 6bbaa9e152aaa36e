//! By how much the rows of a log with gaps are longer than usual, as far as that is jitter.
//!
//! Rows between gaps have no common beat, but lengths of their own. Most differ by what a scheduler makes of
//! them. A few are longer by far more: something came in between, and such a length is true.

use crate::order_statistics::{median, quantile};
use crate::settings::TIME_BASE;

/// For each row but the first, by how much it is longer than the usual one, seconds. What departs by more
/// than the others' jitter is true, and its jitter is against the rows that depart by about as much; 0 where
/// there are none, and of rows too few to say.
#[must_use]
pub fn row_jitter_s(t_s: &[f64]) -> Vec<f64> {
    let lengths_s: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual_s) = median(lengths_s.iter().copied()).filter(|_| t_s.len() >= TIME_BASE.min_rows) else {
        return vec![0.0; lengths_s.len()];
    };
    let departures_s: Vec<f64> = lengths_s.into_iter().map(|length_s| length_s - usual_s).collect();
    let sizes_s = departures_s.iter().map(|departure_s| departure_s.abs());
    let most_s = TIME_BASE.max_jitter_ratio * quantile(sizes_s, TIME_BASE.jitter_quantile).unwrap_or(0.0);
    let is_jitter = |departure_s: f64| departure_s.abs() <= most_s;
    let long_s: Vec<f64> = departures_s.iter().copied().filter(|departure_s| !is_jitter(*departure_s)).collect();
    let jitter_of = |departure_s: f64| {
        // Rows that are longer by about as much have a usual length of their own.
        let alike_s = long_s.iter().copied().filter(|long_s| is_jitter(long_s - departure_s));
        if is_jitter(departure_s) { departure_s } else { departure_s - median(alike_s).unwrap_or(departure_s) }
    };
    departures_s.iter().map(|departure_s| jitter_of(*departure_s)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_two_lengths_jitter_and_a_long_one_is_true() {
        // As a laser's scans fall on a controller's cycle: 0.791 s and 0.805 s, and a cycle of 0.2 s more.
        let mut t_s = vec![0.0_f64];
        for row in 0..100 {
            let length_s = if row == 40 { 1.001 } else { [0.791, 0.805, 0.791][row % 3] };
            t_s.push(t_s[row] + length_s);
        }
        let found = row_jitter_s(&t_s);
        // Rejects a threshold by the median departure, 0 here, above which the second sort of rows lies.
        assert!((found[1] - 0.014).abs() < 1e-9 && found[0].abs() < 1e-9, "{:?}", &found[..3]);
        assert_eq!(found[40], 0.0);
        // A second and a third one, which jitter against the middle one of them.
        for (row, longer_s) in [(70, 0.207), (80, 0.214)] {
            t_s[row + 1..].iter_mut().for_each(|t_s| *t_s += longer_s);
        }
        let found = row_jitter_s(&t_s);
        // 1.001 s, 1.012 s and 1.005 s. Rejects 0, and jitter against the rows of usual length.
        for (row, expected_s) in [(40, -0.004), (70, 0.007), (80, 0.0)] {
            assert!((found[row] - expected_s).abs() < 1e-9, "{row}: {}", found[row]);
        }
    }

    #[test]
    fn even_rows_and_few_rows_have_no_jitter() {
        let even: Vec<f64> = (0..50).map(f64::from).collect();
        assert!(row_jitter_s(&even).iter().all(|jitter_s| *jitter_s == 0.0));
        assert_eq!(row_jitter_s(&[0.0, 1.0, 2.5]), [0.0, 0.0]);
        assert!(row_jitter_s(&[]).is_empty());
    }
}

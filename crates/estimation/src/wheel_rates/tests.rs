//! Rates of wheels, and what a count stands for, against what is known of them on paper.

use super::*;

const SEPARATION_M: f64 = 0.4;
const M_PER_RAD: Wheels<f64> = Wheels { left: 0.1, right: 0.1 };

/// Rows of 10 ms at a speed that rises and falls, counted by so many radians.
fn rows(quantum_rad: f64, count: usize) -> (Vec<f64>, Wheels<Vec<f64>>) {
    let t_s: Vec<f64> = (0..count).map(|row| 0.01 * row as f64).collect();
    let angle = |t_s: f64, side: f64| 3.0 * t_s - 1.5 * (1.1 * t_s + side).cos();
    let counted = |side: f64| {
        let counts = t_s.iter().map(|t_s| angle(*t_s, side));
        counts.map(|rad| if quantum_rad > 0.0 { (rad / quantum_rad).floor() * quantum_rad } else { rad }).collect()
    };
    let turns = Wheels { left: counted(0.0), right: counted(0.7) };
    (t_s, turns)
}

fn rates(quantum_rad: f64) -> WheelRates {
    let (t_s, turns) = rows(quantum_rad, 800);
    WheelRates::of(&t_s, &vec![0.0; t_s.len()], &turns, Wheels::both(quantum_rad), SEPARATION_M, M_PER_RAD, true)
}

#[test]
fn a_rate_does_not_have_its_own_rows_rounding() {
    let (t_s, turns) = rows(0.02, 800);
    let before = WheelRates::of(&t_s, &vec![0.0; t_s.len()], &turns, Wheels::both(0.02), SEPARATION_M, M_PER_RAD, true);
    let mut moved = turns.clone();
    moved.left[400] += 0.02;
    let after = WheelRates::of(&t_s, &vec![0.0; t_s.len()], &moved, Wheels::both(0.02), SEPARATION_M, M_PER_RAD, true);
    // Rejects causal and one-sided differences.
    assert!((before.at_row(400).left - after.at_row(400).left).abs() < 1e-9);
    // Its neighbours have it alike, with opposite signs.
    let change = |row: usize| after.at_row(row).left - before.at_row(row).left;
    assert!(change(399) > 0.01 && (change(399) + change(401)).abs() < 1e-9, "{} {}", change(399), change(401));
}

#[test]
fn windows_grow_with_the_rounding_until_it_is_below_a_hundredth_of_the_signal() {
    // Over h rows before and after, 10 ms each, a rate's noise is q²/12 over h(h + 1)(2h + 1)/3 · 10⁻⁴ s².
    // For 0.02 rad that is 5.6e-3 and 1.8e-3 rad²/s² of four and six rows, for 0.05 rad 5.1e-3 and 1.6e-3 of
    // eight and twelve: the limit below lies between.
    for (quantum_rad, half_rows) in [(0.0, 1), (1e-4, 1), (2e-3, 1), (2e-2, 6), (5e-2, 12)] {
        let found = rates(quantum_rad);
        assert_eq!(found.window.rows, half_rows, "{quantum_rad}");
        let exact = |t_s: f64| 3.0 + 1.65 * (1.1 * t_s).sin();
        let errors = (50..750).map(|row| found.at_row(row).left - exact(0.01 * row as f64));
        let noise = mean(errors.map(|error| error * error));
        // Each wheel's rate varies by 1.65²/2; the turn, of the difference of two, by 0.32 of that. A
        // hundredth of it, for both wheels.
        assert!(noise < 0.01 * 0.5 * 1.65 * 1.65 * 0.24, "{quantum_rad}: {noise}");
        assert_eq!(found.window.row_by_row, quantum_rad < 1e-2, "{quantum_rad}");
    }
}

#[test]
fn a_robot_stands_where_no_count_is_near() {
    // A count of 1 mm at row 50: at 0.2 m/s² it takes 0.1 s.
    let t_s: Vec<f64> = (0..100).map(|row| 0.01 * f64::from(row)).collect();
    let turns = Wheels { left: (0..100).map(|row| if row < 50 { 0.0 } else { 0.01 }).collect(), right: vec![0.0; 100] };
    let found = WheelRates::of(&t_s, &vec![0.0; t_s.len()], &turns, Wheels::both(0.01), SEPARATION_M, M_PER_RAD, true);
    let stands = |row: usize| found.stands(&t_s, [t_s[row], t_s[row + 1]], row);
    let standing: Vec<usize> = (0..99).filter(|row| stands(*row)).collect();
    // Row 49's interval has the count. Rejects a standstill up to the count itself.
    assert_eq!((standing[38], standing[39], standing.len()), (38, 60, 38 + 1 + 39));
}

#[test]
fn gaps_and_ends_are_no_part_of_a_window() {
    let (mut t_s, turns) = rows(0.0, 100);
    t_s[50..].iter_mut().for_each(|t_s| *t_s += 0.5);
    let found = WheelRates::of(&t_s, &vec![0.0; t_s.len()], &turns, Wheels::both(0.0), SEPARATION_M, M_PER_RAD, true);
    let joined = |row: usize| found.are_joined(&t_s, row);
    assert!(joined(48) && !joined(49) && joined(50));
    let own = |row: usize| (turns.left[row + 1] - turns.left[row]) / 0.01;
    assert!((found.at_row(49).left - own(48)).abs() < 1e-9 && (found.at_row(50).left - own(50)).abs() < 1e-9);
    assert!((found.at_row(0).left - own(0)).abs() < 1e-9 && (found.at_row(99).left - own(98)).abs() < 1e-9);
    // In a log with gaps every row is alone.
    let gaps = WheelRates::of(&t_s, &vec![0.0; t_s.len()], &turns, Wheels::both(0.0), SEPARATION_M, M_PER_RAD, false);
    assert!((0..99).all(|row| !gaps.are_joined(&t_s, row)));
    let slow_s: Vec<f64> = (0..100).map(f64::from).collect();
    let slow = WheelRates::of(&slow_s, &[0.0; 100], &turns, Wheels::both(0.0), SEPARATION_M, M_PER_RAD, true);
    assert!((0..99).all(|row| !slow.are_joined(&slow_s, row)));
}

#[test]
fn rows_of_one_number_on_the_beat_have_rates() {
    // Stamps that jitter by 2 ms and a quarter of them by 8, none of it true: beats are missed, and
    // rows are due at once.
    let draws = (0..400_u32).map(|row| f64::from(row.wrapping_mul(2_654_435_761) >> 16) / 65_536.0);
    let t_s: Vec<f64> = draws
        .enumerate()
        .map(|(row, draw)| 0.01 * row as f64 + if row % 4 == 0 { 0.008 } else { 0.002 } * draw)
        .collect();
    let turns = Wheels::both((0..400).map(|row| 0.03 * f64::from(row)).collect::<Vec<f64>>());
    let late_s: Vec<f64> = (0..400).map(|row| if row % 50 < 4 { 0.01 * f64::from(row % 50) } else { 0.0 }).collect();
    let found = WheelRates::of(&t_s, &late_s, &turns, Wheels::both(0.0), SEPARATION_M, M_PER_RAD, true);
    let rates = &found.at_rows_rad_s.left;
    // Rejects a quotient of nothing by nothing.
    assert!(rates.iter().all(|rate| rate.is_finite()), "{rates:?}");
}

/// A receiver that pauses for ten rows, and rows that are sent by five: the wheels turn at 3 rad/s
/// throughout. Rejects speeds by the stamps, of 300 rad/s.
#[test]
fn regress_rows_that_are_stamped_together_are_no_fast_wheels() {
    let turns = Wheels::both((0..400).map(|row| 0.03 * f64::from(row)).collect::<Vec<f64>>());
    let pause =
        |row: u32| if (200..210).contains(&row) { 2.09 - 1e-4 * f64::from(209 - row) } else { 0.01 * f64::from(row) };
    let packets = |row: u32| 0.01 * f64::from(row / 5 * 5 + 4) + 1e-4 * f64::from(row % 5);
    for (name, stamp) in [("pause", &pause as &dyn Fn(u32) -> f64), ("packets", &packets)] {
        let t_s: Vec<f64> = (0..400).map(stamp).collect();
        let found = WheelRates::of(&t_s, &[0.0; 400], &turns, Wheels::both(0.0), SEPARATION_M, M_PER_RAD, true);
        assert!(!found.window.row_by_row, "{name}");
        let (least, most) = found
            .at_rows_rad_s
            .left
            .iter()
            .fold((f64::MAX, 0.0), |(least, most), rate| (f64::min(least, *rate), f64::max(most, *rate)));
        assert!(least > 1.0 && most < 6.0 + 1e-9, "{name}: {least} to {most}");
    }
}

#[test]
fn counts_say_whether_stamps_are_true() {
    let jitter = |row: u32| 0.004 * (f64::from(row.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5);
    let t_s: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row) + jitter(row)).collect();
    let angle = |t_s: f64| 3.0 * t_s - 1.5 * (1.1 * t_s).cos();
    let by_stamps = Wheels::both(t_s.iter().map(|t_s| angle(*t_s)).collect::<Vec<f64>>());
    let by_period = Wheels::both((0..400).map(|row| angle(0.01 * f64::from(row))).collect::<Vec<f64>>());
    let half = |row: u32| angle(0.01 * f64::from(row) + 0.5 * jitter(row));
    let by_half = Wheels::both((0..400).map(half).collect::<Vec<f64>>());
    // The rate by stamps is off by the jitter of both ends, 0.12 of it: 1 and 0 to the square of that.
    let [of_stamps, of_half, of_period] =
        [&by_stamps, &by_half, &by_period].map(|turns| share_of_true_stamps(&t_s, turns));
    assert!(of_stamps > 0.97 && of_period < 0.03, "{of_stamps} {of_period}");
    assert!((of_half - 0.5).abs() < 0.03, "{of_half}");
}

#[test]
fn slopes_of_a_parabola_are_its_rates_in_the_middle_of_their_rows() {
    // Angles t²: a regression over even rows about t has the slope 2t, whatever their number.
    let t_s: Vec<f64> = (0..9).map(f64::from).collect();
    let squares: Vec<f64> = t_s.iter().map(|t_s| t_s * t_s).collect();
    // Stretches of six rows, of one and of two.
    let found = slopes(&t_s, &squares, &[0..6, 6..7, 7..9], 2);
    // At the first row the middle of rows 0 to 2, at the last that of 3 to 5; next to them one row to each
    // side; row 6 has its neighbours beyond the gaps, and of two rows both have the slope between them.
    let on_paper = [2.0, 2.0, 4.0, 6.0, 8.0, 8.0, 12.0, 15.0, 15.0];
    // Roundings of five terms. Rejects windows that reach over a gap, or by a row more or less.
    assert!(found.iter().zip(on_paper).all(|(found, on_paper)| (found - on_paper).abs() < 1e-12), "{found:?}");
    // A row alone at an end of the log has one neighbour.
    let ends = slopes(&t_s[..3], &squares[..3], &[0..1, 1..2, 2..3], 2);
    assert_eq!(ends, [1.0, 2.0, 3.0]);
    // Rows at one instant have no rate.
    assert_eq!([slope(&[1.0; 3], &[1.0, 2.0, 3.0]), slope(&[1.0; 2], &[1.0, 2.0]), slope(&[1.0], &[2.0])], [0.0; 3]);
    // Uneven rows of a straight line.
    assert!((slope(&[0.0, 0.1, 0.5, 0.6], &[1.0, 1.2, 2.0, 2.2]) - 2.0).abs() < 1e-12);
}

#[test]
fn a_rates_noise_counts_against_what_is_left_of_its_variance() {
    // Wheels of 0.1 m/rad whose rates are ±1 rad/s alike: the centre's speed has the variance 0.01 m²/s².
    let alike = [vec![1.0, -1.0, 1.0, -1.0], vec![1.0, -1.0, 1.0, -1.0]];
    let opposite = [vec![1.0, -1.0, 1.0, -1.0], vec![-1.0, 1.0, -1.0, 1.0]];
    let both = [vec![1.0, -1.0, 1.0, -1.0], vec![1.0, 1.0, -1.0, -1.0]];
    let is_below = |rates: &[Vec<f64>; 2], noise: f64| {
        is_below_signal(rates, [noise; 2], WHEEL_RATES.rate_noise_fraction, 0.4, [0.1; 2])
    };
    // Neither a robot that only drives nor one that only turns has a signal in both.
    assert!(!is_below(&alike, 1e-6) && !is_below(&opposite, 1e-6));
    // Of independent wheels the centre has the variance ½ · 0.01 and, of noise n, ½ · 0.01 n: a tenth of
    // what is left of it is n = 1/11. The turn has the same ratio.
    assert!(is_below(&both, 0.99 / 11.0) && !is_below(&both, 1.01 / 11.0));
    // The mean is no signal. Twice as much turn, or twice as much speed, leaves the limit to the other alone:
    // its rates are 1 rad/s of each wheel, with the variance 0.01, and n is 2/11. Rejects a mean square of
    // either.
    let of = |speeds: f64, turns: f64, mean: [f64; 2]| {
        let wheel = |mean: f64, side: f64| {
            let [slow, fast] = [[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]];
            (0..4).map(|row| mean + speeds * slow[row] + side * turns * fast[row]).collect::<Vec<f64>>()
        };
        [wheel(mean[0], -1.0), wheel(mean[1], 1.0)]
    };
    for rates in [of(1.0, 2.0, [3.0, 3.0]), of(2.0, 1.0, [-3.0, 3.0])] {
        assert!(is_below(&rates, 0.99 * 2.0 / 11.0) && !is_below(&rates, 1.01 * 2.0 / 11.0), "{rates:?}");
    }
}

#[test]
fn rows_are_due_before_they_came_and_after_the_one_before() {
    let (t_s, late_s) = ([0.0, 0.125, 0.25, 0.375], [0.0, 0.0, 0.125, 0.5]);
    assert_eq!(due(&t_s, &late_s, 0.0), t_s);
    assert_eq!(due(&t_s, &late_s, 1.0), [0.0, 0.125, 0.125, 0.125]);
    assert_eq!(due(&t_s, &late_s, 0.5), [0.0, 0.125, 0.1875, 0.1875]);
}

#[test]
fn jitter_is_the_standard_deviation_of_stamps() {
    // Second differences of errors of 0 and e in turn are 2e; of normal errors of deviation σ their absolute
    // value has the median 0.67449 · √6 σ.
    let t_s: Vec<f64> = (0..101).map(|row| 0.1 * f64::from(row) + 1e-3 * f64::from(row % 2)).collect();
    let expected = 2e-3 / (0.674_49 * 6_f64.sqrt());
    let found = stamp_jitter_s(&t_s);
    // Rounding of ten seconds.
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    assert_eq!(stamp_jitter_s(&[0.0, 1.0]), 0.0);
    let with = |row_s: f64, error_s: f64| {
        let t_s: Vec<f64> = (0..101).map(|row| row_s * f64::from(row) + error_s * f64::from(row % 2)).collect();
        (are_inexact(&t_s), stamp_jitter_s(&t_s))
    };
    // Two per cent of a row of 0.1 s, the rounding of a file of milliseconds, a twentieth of a row of 2 ms;
    // the median row is itself longer by up to 5 %.
    for (row_s, limit_s) in [(0.1, 2e-3), (0.02, 5e-4), (2e-3, 1e-4)] {
        let error_s = limit_s / (with(row_s, 1e-3 * row_s).1 / (1e-3 * row_s));
        assert!(!with(row_s, 0.9 * error_s).0 && with(row_s, 1.1 * error_s).0, "{row_s}");
    }
}

#[test]
fn a_mean_square_rate_is_over_time_and_skips_rows_without_any() {
    // 1 rad in 1 s, 3 rad in 0.5 s, and a row at the same instant: (1²/1 + 3²/0.5)/1.5.
    let found = mean_square_rate(&[0.0, 1.0, 1.5, 1.5], &[0.0, 1.0, 4.0, 9.0]);
    assert!((found - 19.0 / 1.5).abs() < 1e-12, "{found}");
    assert_eq!(mean_square_rate(&[1.0, 1.0], &[0.0, 1.0]), 0.0);
}

#[test]
fn gaps_are_rows_of_more_than_two_and_a_half_medians() {
    let t_s = [0.0, 1.0, 2.0, 4.5, 5.5, 8.25, 9.25];
    assert_eq!(pieces(&t_s, true), [0..5, 5..7]);
    assert_eq!(pieces(&t_s[..3], false), [0..1, 1..2, 2..3]);
}

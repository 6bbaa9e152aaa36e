//! One change of the wheels' gains over the windows of motion: each wheel's turn is regressed on what the
//! instrument saw, Δ_s = g_s·(b_s·y) with g_s = 1 outside of a span of windows, and the span is chosen that
//! explains the windows best.
//!
//! The regression is of the wheels on the instrument, since a wheel that is dead has a gain, 0, and no
//! inverse. Spans are compared by least squares in closed form, and the best is judged by Cauchy's weights.
//! Reference: Levin & Kline 1985 (a span that differs, by the likelihood ratio).

use dataset::{median, quantile};
use kinematics::{Side, Wheels};

use crate::alignment::Paired;
use crate::regression::cauchy;
use crate::settings::CHECKS;

/// A span of windows in which the wheels' columns have other gains than outside of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GainChange {
    /// The windows of the span, by their places among those that were compared.
    pub(crate) span: std::ops::Range<usize>,
    /// What each column counts in the span for one count outside, and the standard deviation.
    pub(crate) gain: Wheels<f64>,
    pub(crate) sigma: Wheels<f64>,
    /// Nats by which the span explains the windows better than one gain throughout.
    pub(crate) nats: f64,
    /// Largest share of a wheel's turning in the span that is left unexplained.
    pub(crate) unexplained: f64,
}

/// A window in a regression: regressors, each over its usual size, and the outcome; here, what the instrument
/// saw, and what one wheel turned, radians.
pub(crate) struct Row {
    pub(crate) regressors: [f64; 3],
    pub(crate) outcome: f64,
}

/// Weighted second moments of a wheel's windows: of what was seen, with the turns, and of the turns.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    seen: [[f64; 3]; 3],
    cross: [f64; 3],
    turned: f64,
}

impl Moments {
    fn with(mut self, Row { regressors, outcome }: &Row, weight: f64) -> Self {
        for i in 0..3 {
            for j in 0..3 {
                self.seen[i][j] += weight * regressors[i] * regressors[j];
            }
            self.cross[i] += weight * regressors[i] * outcome;
        }
        self.turned += weight * outcome * outcome;
        self
    }

    fn plus(mut self, other: &Self, by: f64) -> Self {
        for i in 0..3 {
            for j in 0..3 {
                self.seen[i][j] += by * other.seen[i][j];
            }
            self.cross[i] += by * other.cross[i];
        }
        self.turned += by * other.turned;
        self
    }

    /// The coefficients, with those of the whole for as much as a share of its windows would say: where the
    /// robot only goes straight, the others say what turns do.
    fn coefficients(&self, whole: &Self) -> [f64; 3] {
        let sum = self.plus(whole, CHECKS.whole_log_share);
        let mut of = sum.seen;
        let trace = of[0][0] + of[1][1] + of[2][2];
        (0..3).for_each(|i| of[i][i] += 1e-6 * trace);
        solved(of, sum.cross)
    }

    /// Σ(b·y)² and Σ(b·y)Δ.
    fn predicted(&self, by: [f64; 3]) -> (f64, f64) {
        let square = (0..3).map(|i| (0..3).map(|j| by[i] * self.seen[i][j] * by[j]).sum::<f64>()).sum();
        (square, (0..3).map(|i| by[i] * self.cross[i]).sum())
    }

    /// Squares that are left outside and inside of a span.
    fn left(outside: &Self, inside: &Self, whole: &Self) -> f64 {
        let by = outside.coefficients(whole);
        let ((square, cross), (inside_square, inside_cross)) = (outside.predicted(by), inside.predicted(by));
        let gained = if inside_square > 0.0 { inside_cross.powi(2) / inside_square } else { 0.0 };
        (outside.turned - 2.0 * cross + square + inside.turned - gained).max(0.0)
    }
}

/// The solution of three linear equations, by Cramer's rule; zeros where there is none.
fn solved(of: [[f64; 3]; 3], to: [f64; 3]) -> [f64; 3] {
    let determinant = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = determinant(&of);
    if whole == 0.0 || !whole.is_finite() {
        return [0.0; 3];
    }
    [0, 1, 2].map(|column| {
        let mut with = of;
        (0..3).for_each(|row| with[row][column] = to[row]);
        determinant(&with) / whole
    })
}

/// A window's motion as the instrument saw it.
fn seen(pair: &Paired) -> [f64; 3] {
    let turn_rad = pair.turned.map_or(0.0, |(_, turn_rad)| turn_rad);
    [pair.window.ahead_m, pair.window.left_m, turn_rad]
}

/// What the faster wheel turned.
fn turned(pair: &Paired) -> f64 {
    pair.moved.left.abs().max(pair.moved.right.abs())
}

/// Turn of the faster wheel below which a window's wheels stand.
fn least_turn_rad(pairs: &[Paired]) -> f64 {
    CHECKS.max_still_ratio * pairs.iter().map(turned).fold(0.0, f64::max)
}

/// Usual sizes of the motion while the wheels turn: a robot may stand for most of a log.
fn scale(pairs: &[Paired]) -> [f64; 3] {
    let least = least_turn_rad(pairs);
    [0, 1, 2].map(|part| {
        let sizes = pairs.iter().filter(|pair| turned(pair) > least).map(|pair| seen(pair)[part].abs());
        quantile(sizes, CHECKS.usual_step_quantile).unwrap_or(0.0).max(1e-9)
    })
}

/// The windows in which something moves, by each wheel, with their places.
fn moving(pairs: &[Paired]) -> (Vec<usize>, Wheels<Vec<Row>>) {
    let least = least_turn_rad(pairs);
    let scale = scale(pairs);
    let moves = |pair: &Paired| {
        turned(pair) > least || (0..3).any(|part| seen(pair)[part].abs() > CHECKS.max_still_ratio * scale[part])
    };
    // What the instrument errs by is no motion.
    let is_sound =
        |pair: &Paired| (0..3).all(|part| seen(pair)[part].abs() < CHECKS.outlying_motion_ratio * scale[part]);
    let places: Vec<usize> = (0..pairs.len()).filter(|at| moves(&pairs[*at]) && is_sound(&pairs[*at])).collect();
    let row = |side: Side| {
        let of = |at: &usize| Row {
            regressors: [0, 1, 2].map(|part| seen(&pairs[*at])[part] / scale[part]),
            outcome: pairs[*at].moved[side],
        };
        places.iter().map(of).collect()
    };
    let rows = Wheels { left: row(Side::Left), right: row(Side::Right) };
    (places, rows)
}

/// The span of windows whose gains differ from those of the others, and explain the windows best.
pub(crate) fn gain_change(pairs: &[Paired]) -> Option<GainChange> {
    let (places, rows) = moving(pairs);
    if places.len() < 2 * CHECKS.min_windows {
        return None;
    }
    let run = |at: usize| pairs[places[at]].window.run;
    let borders: Vec<usize> = (1..places.len()).filter(|at| run(*at) != run(at - 1)).collect();
    let even = Wheels::both(vec![1.0; places.len()]);
    // Outliers of the instrument count for less once a first span is known.
    let (from, to) = best_span(&rows, &even, &borders)?;
    let weights = Wheels { left: judged(&rows.left, from, to)?.weights, right: judged(&rows.right, from, to)?.weights };
    let (from, to) = best_span(&rows, &weights, &borders)?;
    let found = Wheels { left: judged(&rows.left, from, to)?, right: judged(&rows.right, from, to)? };
    // Where both wheels change alike, each part may have motions of its own, whose coefficients the other
    // part hardly tells; a wheel that changes alone has the other one to show that it does.
    let is_doubtful = |of: &Judged| (of.gain * of.exchanged - 1.0).abs() > CHECKS.max_left_by_fix;
    let is_alike = (found.left.gain / found.right.gain).ln().abs() < 0.5 * found.left.gain.abs().ln().abs();
    if is_alike && found.left.gain.abs() > CHECKS.dead_gain && (is_doubtful(&found.left) || is_doubtful(&found.right)) {
        return None;
    }
    let nats = Side::BOTH.iter().map(|side| rows[*side].len() as f64 * found[*side].gained.ln()).sum();
    // Windows at rest beside the span belong to it where a run or the log ends.
    let first_of_run = |at: usize| at == 0 || borders.binary_search(&at).is_ok();
    let start =
        if first_of_run(from) { pairs.partition_point(|pair| pair.window.run < run(from)) } else { places[from] };
    let end = if to == places.len() {
        pairs.len()
    } else if first_of_run(to) {
        pairs.partition_point(|pair| pair.window.run < run(to))
    } else {
        places[to - 1] + 1
    };
    let unexplained = found.left.unexplained.max(found.right.unexplained);
    Some(GainChange {
        span: start..end,
        gain: found.as_ref().map(|of| of.gain),
        sigma: found.as_ref().map(|of| of.sigma),
        nats,
        unexplained,
    })
}

/// The span of least squares, among those between borders of runs and a grid of windows, then between
/// windows.
fn best_span(rows: &Wheels<Vec<Row>>, weights: &Wheels<Vec<f64>>, borders: &[usize]) -> Option<(usize, usize)> {
    let sums = rows.as_ref().zip_with(weights.as_ref(), |rows, weights| {
        let mut sums = vec![Moments::default()];
        let all = rows.iter().zip(weights);
        all.for_each(|(row, weight)| sums.push(sums[sums.len() - 1].with(row, *weight)));
        sums
    });
    let count = rows.left.len();
    // Half of the logarithm of the windows' number for an edge that is no border (Schwarz 1978).
    let is_free = |at: usize| at > 0 && at < count && borders.binary_search(&at).is_err();
    let free = |at: usize| if is_free(at) { (count as f64).ln() / count as f64 } else { 0.0 };
    let left = |from: usize, to: usize| -> f64 {
        let of = |side: Side| {
            let sums = &sums[side];
            let inside = sums[to].plus(&sums[from], -1.0);
            Moments::left(&sums[count].plus(&inside, -1.0), &inside, &sums[count]).max(f64::MIN_POSITIVE).ln()
        };
        of(Side::Left) + of(Side::Right) + free(from) + free(to)
    };
    let fits = |from: usize, to: usize| {
        from < to && to - from >= CHECKS.min_faulty_windows && count - (to - from) >= CHECKS.min_windows
    };
    let step = count.div_ceil(CHECKS.span_grid);
    let mut grid: Vec<usize> = (0..count).step_by(step).chain(borders.iter().copied()).chain([count]).collect();
    grid.sort_unstable();
    grid.dedup();
    let best = |spans: &mut dyn Iterator<Item = (usize, usize)>| {
        let fitting = spans.filter(|(from, to)| fits(*from, *to)).map(|(from, to)| (left(from, to), (from, to)));
        fitting.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let spans = grid.iter().flat_map(|from| grid.iter().map(move |to| (*from, *to)));
    let (mut least, mut span) = best(&mut { spans })?;
    for _ in 0..2 {
        let near = |of: usize| of.saturating_sub(step)..=(of + step).min(count);
        let (from, to) = span;
        let spans = near(from).map(|from| (from, to)).chain(near(to).map(|to| (from, to)));
        // An end of the log stays one.
        let spans = spans.filter(|(f, t)| (from > 0 || *f == 0) && (to < count || *t == count));
        if let Some((value, better)) = best(&mut { spans }).filter(|(value, _)| *value < least) {
            (least, span) = (value, better);
        }
    }
    Some(span)
}

/// What a wheel's windows say of a span.
#[derive(Debug, Clone)]
struct Judged {
    gain: f64,
    sigma: f64,
    /// The gain of the others, where the coefficients are those of the span.
    exchanged: f64,
    /// Ratio of the mean absolute residual with one gain to that with two.
    gained: f64,
    /// Ratio of the residuals to the predictions in the span, medians.
    unexplained: f64,
    weights: Vec<f64>,
}

fn judged(rows: &[Row], from: usize, to: usize) -> Option<Judged> {
    let is_inside: Vec<bool> = (0..rows.len()).map(|at| (from..to).contains(&at)).collect();
    let one = robustly(rows, &vec![false; rows.len()])?;
    let two = robustly(rows, &is_inside)?;
    let exchanged = robustly(rows, &is_inside.iter().map(|is| !is).collect::<Vec<_>>())?.gain;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    // Below a thousandth of the turning nothing is compared.
    let least = 1e-3 * mean(&rows.iter().map(|row| row.outcome.abs()).collect::<Vec<_>>());
    // A dead wheel has no residual, and what was seen errs all the same. Inside, a gain that holds for
    // straights and not for turns explains nothing.
    let outside = two.left[..from].iter().chain(&two.left[to..]).copied();
    let inside = quantile(two.left[from..to].iter().copied(), CHECKS.explained_quantile)?;
    let left = median(outside)?.max(inside);
    Some(Judged {
        gain: two.gain,
        sigma: two.sigma,
        exchanged,
        gained: (mean(&one.left) + least) / (mean(&two.left) + least),
        unexplained: left / (median(two.predicted[from..to].iter().copied())? + least),
        weights: two.weights,
    })
}

/// A robust fit of a wheel with another gain in some windows.
pub(crate) struct Fit {
    pub(crate) by: [f64; 3],
    gain: f64,
    sigma: f64,
    /// Absolute residuals, and predictions with a gain of one.
    left: Vec<f64>,
    predicted: Vec<f64>,
    weights: Vec<f64>,
}

/// The coefficients of windows outside of some, and the gain inside, with Cauchy's weights.
pub(crate) fn robustly(rows: &[Row], is_inside: &[bool]) -> Option<Fit> {
    let mut weights = vec![1.0; rows.len()];
    let mut found: Option<Fit> = None;
    for _ in 0..CHECKS.robust_passes {
        let mut sums = [Moments::default(); 2];
        for ((row, weight), inside) in rows.iter().zip(&weights).zip(is_inside) {
            sums[usize::from(*inside)] = sums[usize::from(*inside)].with(row, *weight);
        }
        let [outside, inside] = sums;
        let by = outside.coefficients(&outside.plus(&inside, 1.0));
        let (square, cross) = inside.predicted(by);
        let gain = if square > 0.0 { cross / square } else { 1.0 };
        let predicted: Vec<f64> =
            rows.iter().map(|row| (0..3).map(|part| by[part] * row.regressors[part]).sum::<f64>()).collect();
        let expected = predicted.iter().zip(is_inside).map(|(of, inside)| if *inside { gain * of } else { *of });
        let left: Vec<f64> = rows.iter().zip(expected).map(|(row, of)| (row.outcome - of).abs()).collect();
        // Of both, since a dead wheel has no residual, and what was seen errs all the same.
        let var = |of: bool| {
            let chosen = || weights.iter().zip(&left).zip(is_inside).filter(move |(_, inside)| **inside == of);
            let (square, count) = chosen().fold((0.0, 0.0), |(square, count), ((weight, left), _)| {
                (square + weight * left * left, count + weight)
            });
            square / (count - 3.0).max(1.0)
        };
        let sigma = if square > 0.0 { (var(true).max(var(false)) / square).sqrt() } else { f64::INFINITY };
        let outer = left.iter().zip(is_inside).filter(|(_, inside)| !**inside).map(|(left, _)| *left);
        let scale = CHECKS.cauchy_medians * median(outer)?
            + 1e-3 * median(rows.iter().map(|row| row.outcome.abs()))?
            + f64::MIN_POSITIVE;
        weights.iter_mut().zip(&left).for_each(|(weight, left)| *weight = cauchy(*left, scale));
        let predicted = predicted.iter().map(|of| of.abs()).collect();
        found = Some(Fit { by, gain, sigma, left, predicted, weights: weights.clone() });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::windows::Window;

    /// Windows of a robot with wheels of 0.08 m, 0.36 m apart, that an instrument of 1 mm and 1 mrad sees, in
    /// runs of 40; `speeds` of a window: metres and radians.
    fn windows(count: usize, speeds: impl Fn(f64) -> [f64; 2]) -> Vec<Paired> {
        let pair = |number: usize| {
            let t = number as f64;
            let [ahead_m, turn_rad] = speeds(t);
            let moved = Wheels { left: (ahead_m - 0.18 * turn_rad) / 0.08, right: (ahead_m + 0.18 * turn_rad) / 0.08 };
            let error = |phase: f64| 1e-3 * (12.9898 * t + phase).sin();
            let (from_s, to_s) = (0.5 * t, 0.5 * t + 0.5);
            let seen_rad = turn_rad + error(2.0);
            let window = Window {
                run: number / 40,
                from_s,
                to_s,
                ahead_m: ahead_m + error(0.0),
                left_m: error(1.0),
                turn: Some((from_s, to_s, seen_rad)),
            };
            Paired { window, moved, turned: Some((moved, seen_rad)) }
        };
        (0..count).map(pair).collect()
    }

    fn mixed(t: f64) -> [f64; 2] {
        [0.15 + 0.1 * (0.7 * t).sin(), 0.5 * (0.31 * t).cos()]
    }

    #[test]
    fn a_wheel_has_its_gain_from_its_window_on_and_the_other_has_none() {
        for gain in [0.0, -1.0, 0.5, 1.2, 2.0] {
            let mut pairs = windows(200, mixed);
            pairs[93..].iter_mut().for_each(|pair| pair.moved.right *= gain);
            let found = gain_change(&pairs).expect("windows");
            // A reversed wheel may be the part before; a dead one is not.
            let (span, found_gain) = (found.span.clone(), found.gain.right);
            assert!(span.start.abs_diff(93) <= 1 || span.end.abs_diff(93) <= 1, "{gain}: {found:?}");
            let expected = if span.start > 0 || gain == 0.0 { gain } else { gain.recip() };
            // The share of all windows takes a hundredth of a difference of two.
            assert!((found_gain - expected).abs() < 0.04 && (found.gain.left - 1.0).abs() < 0.02, "{gain}: {found:?}");
            assert!(found.nats > CHECKS.min_gain && found.unexplained < 0.1, "{gain}: {found:?}");
        }
    }

    #[test]
    fn a_sound_log_and_runs_of_other_motions_have_none() {
        let found = gain_change(&windows(200, mixed)).expect("windows");
        assert!(found.gain.as_ref().map(|gain| (gain - 1.0).abs()).left < 0.02, "{found:?}");
        // Straights in one run and spins in the other: what turns do is not told by straights.
        let apart = |t: f64| if t < 40.0 { [0.15, 0.0] } else { [0.0, 0.4] };
        let found = gain_change(&windows(80, apart));
        assert!(found.is_none_or(|found| (found.gain.right - 1.0).abs() < 0.1), "straights and spins");
    }
}

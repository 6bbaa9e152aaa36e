//! The sampling period behind the stamps of a log: which of its ticks each row is of, and how late the row is
//! stamped.
//!
//! Drivers read encoders by a timer and stamp them when a scheduler, a bus or a receiver gets to it. Rows
//! have numbers on the beat: one more from row to row, more where rows were lost, the same where a row came
//! by itself. A lost row shifts all later stamps against the count of rows for good; a late one shifts
//! itself, and what waited behind it. The numbers are the likeliest path through both (Viterbi 1967), each
//! path with its own idea of how late rows usually are, so that a clock need not keep one beat all day.

use rules::Rule;

use crate::lateness::{is_alone, lateness, lateness_of_ticks};
use crate::order_statistics::median;
use crate::packets::Packets;
use crate::receipt_delays::Received;
use crate::row_numbers::{RowCosts, likeliest_numbers};
use crate::settings::TIME_BASE;

/// The regular beat of a run's rows.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplingPeriod {
    /// Time between two ticks, seconds.
    pub period_s: f64,
    /// For each row, which tick it is of; 0 for the first.
    pub numbers: Vec<i64>,
    /// For each row, how late its stamp is, seconds: against the line through the rows around it; where rows
    /// hold up each other, against when it was read. 0 of a row that came by itself: no tick says when.
    pub late_s: Vec<f64>,
    /// Whether rows come in bunches: they are stamped on receipt, and one that is late holds up those behind
    /// it.
    pub is_bunched: bool,
    /// What rows are off their ticks by, root mean square, seconds; those that came by themselves too.
    off_s: f64,
}

impl SamplingPeriod {
    /// The beat of stamps that do not fall; `None` where rows are too few to have one.
    pub(crate) fn of(t_s: &[f64]) -> Option<Self> {
        if t_s.len() < TIME_BASE.min_rows {
            return None;
        }
        let received = Rule::Packets.finds(Self::of_packets(t_s));
        if let Some(received) = received.or_else(|| Rule::ReceiptDelays.finds(Received::of(t_s))) {
            let late_s: Vec<f64> = t_s.iter().zip(&received.read_s).map(|(t_s, read_s)| t_s - read_s).collect();
            let (period_s, numbers, off_s) = (received.period_s, received.numbers(), root_mean_square(&late_s));
            return Some(Self { period_s, numbers, late_s, is_bunched: true, off_s });
        }
        let gap_s = median(t_s.windows(2).map(|pair| pair[1] - pair[0]))?;
        // The middle gap is exact where stamps are.
        if let Some(numbers) = Rule::RowsByThemselves.finds(numbers_beside_rows_of_their_own(t_s, gap_s)) {
            return Some(Self {
                period_s: gap_s,
                late_s: vec![0.0; numbers.len()],
                numbers,
                is_bunched: false,
                off_s: 0.0,
            });
        }
        let mut found = match Numbered::by(t_s, gap_s) {
            Some(exact) if exact.cost == f64::NEG_INFINITY => exact,
            of_gap => {
                let mut tried_s = vec![gap_s];
                for first_s in first_periods(t_s)? {
                    if !tried_s.iter().any(|tried_s| is_same_beat(first_s, *tried_s, t_s)) {
                        tried_s.push(first_s);
                    }
                }
                let others = tried_s[1..].iter().filter_map(|first_s| Numbered::by(t_s, *first_s));
                let found = of_gap.into_iter().chain(others).min_by(|a, b| a.cost.total_cmp(&b.cost))?;
                found.settled(t_s)
            }
        };
        let mut late_s = found.lateness(t_s);
        for _ in 0..TIME_BASE.rounds {
            if root_mean_square(&late_s) <= TIME_BASE.max_certain_lateness * found.period_s {
                break;
            }
            // As many rows are lost, or came by themselves, as were found, and not as few as is usual.
            let Some(other) = Numbered::with(t_s, found.period_s, RowCosts::of(&found.numbers)) else { break };
            let other_late_s = other.lateness(t_s);
            let is_nearer = root_mean_square(&other_late_s) < root_mean_square(&late_s);
            if !Rule::NumberingRounds.applies(is_nearer) {
                break;
            }
            (found, late_s) = (other, other_late_s);
        }
        let Numbered { period_s, numbers, .. } = found;
        let off_s = root_mean_square(&late_s);
        // Where stamps jitter by more, rows that share a number need not have come by themselves.
        let of_ticks_s = lateness_of_ticks(&numbers, &late_s);
        let max_jitter_s = TIME_BASE.max_jitter_by_themselves * period_s;
        let late_s = if root_mean_square(&of_ticks_s) < max_jitter_s { of_ticks_s } else { late_s };
        Some(Self { period_s, numbers, late_s, is_bunched: false, off_s })
    }

    /// When rows were read that are sent some at a time.
    fn of_packets(t_s: &[f64]) -> Option<Received> {
        Packets::read(t_s, |sent_s| Self::of(sent_s).map(|sent| (sent.period_s, sent.late_s)))
    }

    /// Whether stamps are near enough to the beat that the numbers of all rows are right.
    #[must_use]
    pub fn is_certain(&self) -> bool {
        self.off_s <= TIME_BASE.max_certain_lateness * self.period_s
    }

    /// Whether no other row has a row's number.
    #[must_use]
    pub fn is_alone(&self, row: usize) -> bool {
        is_alone(&self.numbers, row)
    }

    /// Ticks from a row to the next one: 2 where one row is missing between them.
    #[must_use]
    pub fn ticks_after(&self, row: usize) -> Option<i64> {
        Some(self.numbers.get(row + 1)? - self.numbers[row])
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Beats before numbers are known: the mean gap, as if no row were lost; and the one of which spans of a few
/// rows, then of more, are whole numbers most nearly (Rayleigh's test of their phases).
fn first_periods(t_s: &[f64]) -> Option<[f64; 2]> {
    let span = TIME_BASE.line_rows.min(t_s.len() / TIME_BASE.min_spans);
    let mean_s = median(t_s.windows(span + 1).map(|rows| (rows[span] - rows[0]) / span as f64))?;
    if mean_s <= 0.0 {
        return None;
    }
    let mut found_s = mean_s;
    let spans = TIME_BASE.phase_span_rows.into_iter().zip(TIME_BASE.phase_span_ratios).zip(TIME_BASE.phase_span_steps);
    for ((rows, [low, high]), steps) in spans.filter(|((rows, _), _)| *rows < t_s.len()) {
        let every = (t_s.len() / TIME_BASE.phases_taken).max(1);
        let spans: Vec<f64> = t_s.windows(rows + 1).step_by(every).map(|of| of[rows] - of[0]).collect();
        let agreement = |period_s: f64| -> f64 {
            spans.iter().map(|span_s| kinematics::sin_cos(std::f64::consts::TAU * span_s / period_s).1).sum()
        };
        let at = |step: u32| found_s * (low + (high - low) * f64::from(step) / f64::from(steps));
        let best = (0..=steps).map(|step| (at(step), agreement(at(step)))).max_by(|a, b| a.1.total_cmp(&b.1));
        found_s = best.map_or(found_s, |(period_s, _)| period_s);
    }
    Some([mean_s, found_s])
}

/// The middle one of what long spans say.
fn period(t_s: &[f64], numbers: &[i64]) -> Option<f64> {
    let span = TIME_BASE.line_rows.min(t_s.len() / TIME_BASE.min_spans);
    let of = |(t_s, numbers): (&[f64], &[i64])| (t_s[span] - t_s[0]) / ((numbers[span] - numbers[0]).max(1) as f64);
    median(t_s.windows(span + 1).zip(numbers.windows(span + 1)).map(of)).filter(|period_s| *period_s > 0.0)
}

/// Whether two beats are hardly apart at the end of a log: they number its rows alike.
fn is_same_beat(a_s: f64, b_s: f64, t_s: &[f64]) -> bool {
    (a_s / b_s - 1.0).abs() * t_s.len() as f64 <= TIME_BASE.same_period_ticks
}

/// Rows with their numbers by some beat.
struct Numbered {
    /// The beat that they were found by.
    first_s: f64,
    period_s: f64,
    numbers: Vec<i64>,
    /// Negative log likelihood; −∞ where every gap is a whole number of beats.
    cost: f64,
}

impl Numbered {
    /// By some idea of the beat, with the beat of these numbers; `None` where it leads nowhere.
    fn by(t_s: &[f64], first_s: f64) -> Option<Self> {
        Self::with(t_s, first_s, RowCosts::unknown())
    }

    /// The same with other costs of rows.
    fn with(t_s: &[f64], first_s: f64, costs: RowCosts) -> Option<Self> {
        if first_s <= 0.0 {
            return None;
        }
        let whole = whole_gaps(t_s, first_s).map(|numbers| (numbers, f64::NEG_INFINITY));
        let (numbers, cost) = whole.unwrap_or_else(|| likeliest_numbers(t_s, first_s, costs));
        Some(Self { first_s, period_s: period(t_s, &numbers)?, numbers, cost })
    }

    /// How late each row is by them, seconds.
    fn lateness(&self, t_s: &[f64]) -> Vec<f64> {
        lateness(t_s, &self.numbers, self.period_s)
    }

    /// Period and numbers that are found from each other, as long as they get likelier.
    fn settled(self, t_s: &[f64]) -> Self {
        let mut found = self;
        for _ in 1..TIME_BASE.rounds {
            if is_same_beat(found.period_s, found.first_s, t_s) {
                break;
            }
            match Self::by(t_s, found.period_s) {
                Some(next) if next.numbers != found.numbers && next.cost < found.cost => found = next,
                _ => break,
            }
        }
        found
    }
}

/// The ticks of a gap that is a whole number of beats but for so much of one: a clock that drifts by less
/// makes a long pause no whole number.
fn whole_ticks(gap: f64, max_error: f64) -> Option<i64> {
    let ticks = gap.round();
    (ticks >= 1.0 && (gap - ticks).abs() <= max_error * ticks.sqrt()).then_some(ticks as i64)
}

/// Numbers where every gap is a whole number of beats.
fn whole_gaps(t_s: &[f64], period_s: f64) -> Option<Vec<i64>> {
    let max_error = TIME_BASE.max_whole_gap_error;
    let (mut numbers, mut last) = (vec![0], 0);
    for pair in t_s.windows(2) {
        last += whole_ticks((pair[1] - pair[0]) / period_s, max_error)?;
        numbers.push(last);
    }
    Some(numbers)
}

/// Numbers where every row is exactly of the beat but for some that came by themselves, as a log has them
/// that writes a row where a motion ends, too; behind one of these the beat may begin anew.
fn numbers_beside_rows_of_their_own(t_s: &[f64], period_s: f64) -> Option<Vec<i64>> {
    if period_s <= 0.0 {
        return None;
    }
    let settings = &*TIME_BASE;
    let whole = |gap: f64| whole_ticks(gap, settings.max_exact_gap_error);
    let mut numbers = vec![0];
    // The last row of the beat, and its number.
    let (mut last_due_s, mut number, mut by_themselves) = (t_s[0], 0, 0);
    for pair in t_s.windows(2) {
        let since_due = (pair[1] - last_due_s) / period_s;
        let last = numbers[numbers.len() - 1];
        if let Some(ticks) = whole(since_due) {
            (last_due_s, number) = (pair[1], number + ticks);
            numbers.push(number);
        } else if let Some(ticks) = whole((pair[1] - pair[0]) / period_s) {
            (last_due_s, number) = (pair[1], last + ticks);
            numbers.push(number);
        } else {
            // Of the tick before it, or of that which it is next to.
            let next = (since_due - since_due.round()).abs() <= settings.max_off_next_tick;
            let ticks = if next { since_due.round() } else { since_due.floor() };
            numbers.push((number + ticks as i64).max(last));
            by_themselves += 1;
        }
    }
    let most = settings.max_share_by_themselves * t_s.len() as f64;
    (by_themselves > 0 && by_themselves as f64 <= most).then_some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    const PERIOD_S: f64 = 0.01;

    /// Rows of which some are lost, late by draws; in order. Stamp, lateness and number of each.
    fn stamps(rows: i64, lost: f64, mut late_s: impl FnMut(&mut Draws) -> f64) -> Vec<(f64, f64, i64)> {
        let mut draws = Draws(7);
        let (mut before_s, mut all) = (f64::NEG_INFINITY, Vec::new());
        for row in 0..rows {
            let due_s = PERIOD_S * row as f64;
            let stamp_s = f64::max(due_s + late_s(&mut draws), before_s + 1e-4);
            if row == 0 || draws.uniform() >= lost {
                all.push((stamp_s, stamp_s - due_s, row));
                before_s = stamp_s;
            }
        }
        all
    }

    fn period_of(stamps: &[(f64, f64, i64)]) -> SamplingPeriod {
        let t_s: Vec<f64> = stamps.iter().map(|(t_s, ..)| *t_s).collect();
        SamplingPeriod::of(&t_s).expect("a beat")
    }

    /// Root mean square of what lateness is off from what it was, its mean apart.
    fn off_s(stamps: &[(f64, f64, i64)]) -> f64 {
        let found = period_of(stamps).late_s;
        let off: Vec<f64> = found.iter().zip(stamps).map(|(found, (_, late_s, _))| found - late_s).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        (off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
    }

    /// Share of the steps from row to row of which the number is wrong.
    fn wrong_steps(stamps: &[(f64, f64, i64)]) -> f64 {
        let found = period_of(stamps).numbers;
        let pairs = found.windows(2).zip(stamps.windows(2));
        let wrong = pairs.filter(|(found, of)| found[1] - found[0] != of[1].2 - of[0].2).count();
        wrong as f64 / stamps.len() as f64
    }

    #[test]
    fn a_normal_jitter_is_found_row_by_row() {
        let normal = |draws: &mut Draws| 2e-3 * draws.normal();
        // The line through 500 rows is off by 2 ms/√500 on average, by twice that at the ends of a run.
        let found = off_s(&stamps(3000, 0.0, normal));
        assert!(found < 2e-4, "{found}");
        assert!(off_s(&stamps(3000, 0.03, |_| 0.0)) < 1e-9, "rows that are lost are not late");
        assert!(off_s(&stamps(3000, 0.0, |_| 0.0)) < 1e-12);
    }

    #[test]
    fn lost_rows_are_counted_among_stamps_that_jitter() {
        // A fifth of the beat. A lost row and a late one look alike until the next stamps: a wrong number
        // costs two wrong steps, and one row in a hundred is later than two standard deviations beside a
        // lost one.
        let all = stamps(3000, 0.03, |draws| 2e-3 * draws.normal());
        // Rejects numbers by the rounding of each gap, which are wrong for 0.012 of the rows.
        assert!(wrong_steps(&all) < 3e-3, "{}", wrong_steps(&all));
        assert!(off_s(&all) < 4e-4, "{}", off_s(&all));
    }

    /// Jitter of 4 % of the beat, one row in fifty lost, and one in fifteen that came by itself, anywhere
    /// between two ticks.
    #[test]
    fn regress_a_beat_is_found_among_rows_that_came_by_themselves_and_lost_ones() {
        for seed in 0..40 {
            let mut draws = Draws(seed);
            let (mut stamps_s, mut due): (Vec<f64>, Vec<i64>) = (Vec::new(), Vec::new());
            for row in 0..900 {
                let stamp_s = PERIOD_S * (row as f64 + 0.04 * (draws.uniform() - 0.5));
                if row == 0 || draws.uniform() >= 0.02 {
                    stamps_s.push(stamp_s);
                    due.push(row);
                }
                if draws.uniform() < 1.0 / 15.0 {
                    stamps_s.push(PERIOD_S * (row as f64 + 0.05 + 0.9 * draws.uniform()));
                    due.push(row);
                }
            }
            let found = SamplingPeriod::of(&stamps_s).expect("a beat");
            assert!(found.is_certain(), "{seed}: {}", found.period_s);
            assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-3, "{seed}: {}", found.period_s);
            // A row that came by itself near a tick, beside a lost one, is like one of the beat.
            let steps = |numbers: &[i64]| numbers.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>();
            let wrong = steps(&found.numbers).iter().zip(steps(&due)).filter(|(found, due)| *found != due).count();
            assert!(wrong < 20, "{seed}: {wrong}");
        }
    }

    #[test]
    fn rows_that_were_received_late_are_no_lost_ones() {
        for mean_s in [2e-3, 5e-3] {
            let delayed = move |draws: &mut Draws| -mean_s * draws.uniform().ln();
            let all = stamps(3000, 0.0, delayed);
            // Delays of some rows together are taken for the clock's: a fifth of them.
            assert!(off_s(&all) < 0.2 * mean_s, "{mean_s}: {}", off_s(&all));
            assert!(wrong_steps(&all) < 2e-3, "{mean_s}: {}", wrong_steps(&all));
        }
    }

    #[test]
    fn a_row_that_came_by_itself_has_a_number_of_its_neighbour() {
        let mut t_s: Vec<f64> = (0..200).map(|row| 0.1 * f64::from(row)).collect();
        t_s.insert(80, 7.93);
        let found = SamplingPeriod::of(&t_s).expect("a beat");
        // Rejects a row more on the beat, after which all are early by one.
        assert_eq!((found.numbers[79], found.numbers[81], found.numbers[200]), (79, 80, 199));
    }

    /// A log that writes a row where a motion ends, too: most rows are exactly on the beat.
    #[test]
    fn regress_rows_between_exact_ticks_make_the_beat_no_shorter_and_lose_no_row() {
        // A row 0.02 of the beat after the third, from which the beat begins anew; one between each nine
        // ticks; and two ticks that are missing.
        let anew_s = |tick: u32| 0.2 * f64::from(tick) + if tick > 3 { 0.004 } else { 0.0 };
        let (mut t_s, mut numbers) = (Vec::new(), Vec::new());
        for tick in (0..200_u32).filter(|tick| *tick != 100 && *tick != 101) {
            t_s.push(anew_s(tick));
            numbers.push(i64::from(tick));
            if tick == 3 || tick % 9 == 8 {
                t_s.push(anew_s(tick) + if tick == 3 { 0.004 } else { 0.6 * 0.2 });
                numbers.push(i64::from(tick));
            }
        }
        let found = SamplingPeriod::of(&t_s).expect("a beat");
        assert_eq!(found.numbers, numbers);
        assert!((found.period_s - 0.2).abs() < 1e-12 && found.is_certain(), "{}", found.period_s);
        assert_eq!(found.late_s, vec![0.0; t_s.len()]);
        // Stamps that jitter are not taken for rows between ticks.
        let mut draws = Draws(3);
        let jittering: Vec<f64> = t_s.iter().map(|t_s| t_s + 2e-3 * draws.normal()).collect();
        let found = SamplingPeriod::of(&jittering).expect("a beat");
        assert!(found.late_s.iter().any(|late_s| late_s.abs() > 1e-3));
        // Nor are those that were restored from receipt, which run away from the beat by 0.4 per mil.
        let restored: Vec<f64> = t_s.iter().map(|t_s| t_s + 0.2 * 4e-4 * draws.normal()).collect();
        assert_eq!(numbers_beside_rows_of_their_own(&restored, 0.2), None);
    }

    #[test]
    fn rows_that_came_by_themselves_are_on_no_line() {
        // One row in ten has another behind it, 0.4 of the beat later; stamps are a twentieth of it off.
        let mut draws = Draws(7);
        let due_s: Vec<f64> = (0..1000)
            .flat_map(|tick| {
                let due_s = PERIOD_S * f64::from(tick);
                [Some(due_s), (tick % 10 == 5).then_some(due_s + 0.4 * PERIOD_S)].into_iter().flatten()
            })
            .collect();
        let t_s: Vec<f64> = due_s.iter().map(|due_s| due_s + 0.05 * PERIOD_S * draws.normal()).collect();
        let found = SamplingPeriod::of(&t_s).expect("a beat");
        // Rejects the mean gap, which is a tenth shorter.
        assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-3 && found.is_certain(), "{}", found.period_s);
        assert_eq!(found.numbers.last(), Some(&999));
        // The line through 450 ticks: 0.05/√450 of the beat off. Rejects the line through all rows, which is
        // 0.4 of the beat off for one in eleven, 0.036.
        let read_s = t_s.iter().zip(&found.late_s).map(|(t_s, late_s)| t_s - late_s);
        let of_ticks = read_s.zip(&due_s).filter(|(_, due_s)| (*due_s / PERIOD_S).fract() < 0.2);
        let (sum_s, count) =
            of_ticks.fold((0.0, 0.0), |(sum, count), (read_s, due_s)| (sum + read_s - due_s, count + 1.0));
        assert!((sum_s / count).abs() < 0.01 * PERIOD_S, "{}", sum_s / count);
        // No tick says when they were read: their distance to one is no lateness.
        let is_between = |due_s: f64| (0.3..0.5).contains(&(due_s / PERIOD_S).fract());
        let between = found.late_s.iter().zip(&due_s).filter(|(_, due_s)| is_between(**due_s));
        assert_eq!(between.map(|(late_s, _)| *late_s).collect::<Vec<_>>(), vec![0.0; 100]);
    }

    #[test]
    fn rows_that_wait_for_each_other_have_their_own_numbers() {
        // Delays of several beats: a row that is held up holds up those behind it.
        for mean_s in [2e-2, 4e-2] {
            let all = stamps(3000, 0.0, |draws| -mean_s * draws.uniform().ln());
            // One delay in a hundred is of five means, and looks like rows that are missing. Rejects costs of
            // single rows, by which 0.026 and 0.108 of the steps are wrong.
            assert!(wrong_steps(&all) < 5e-3, "{mean_s}: {}", wrong_steps(&all));
        }
    }

    #[test]
    fn a_beat_that_begins_anew_has_lost_no_row() {
        let mut t_s: Vec<f64> = (0..200).map(|row| 0.1 * f64::from(row)).collect();
        t_s[90..].iter_mut().for_each(|t_s| *t_s += 0.06);
        let found = SamplingPeriod::of(&t_s).expect("a beat");
        // Rejects a lost row, after which all are early by 0.4 of a tick.
        assert!((found.numbers[199], found.ticks_after(89)) == (199, Some(1)), "{:?}", &found.numbers[85..95]);
    }

    #[test]
    fn a_clock_that_drifts_is_not_late() {
        // 500 ppm from end to end of half a minute, steadily: a quarter of a period.
        let t_s: Vec<f64> =
            (0..3000).map(|row| PERIOD_S * f64::from(row)).map(|t_s| t_s + 2.5e-4 * t_s * t_s / 30.0).collect();
        let found = SamplingPeriod::of(&t_s).expect("a beat");
        assert!(found.late_s.iter().all(|late_s| late_s.abs() < 2e-4));
        assert_eq!(SamplingPeriod::of(&[0.0, 0.1, 0.3]), None);
    }
}

//! When rows were read that are stamped on receipt: each is held up by a random delay, and none overtakes
//! another.
//!
//! Row n of tick N is read at r = P·N + s and received at t = max(r + d, t₋₁ + w): P the sampling period, d
//! an exponential delay of mean m, t₋₁ when the row before was received, and w what a row takes on the line.
//! A row that comes by itself has the density exp(−(t − r)/m)/m; one that comes on the heels of another was
//! ready before, with the probability 1 − exp(−(t − r)/m). s stays, but for steps of a whole beat where a row
//! was lost or came between two ticks and its number does not say so, and a slow walk of the clock. What it
//! was is smoothed forward and backward over a grid (Baum et al. 1970; Rabiner 1989).
//!
//! Where delays are many beats, single steps cannot be told; the mean over all of them is then what a line
//! through the stamps would be, with as many rows to it as the steps let agree.

use crate::settings::{BLOCK_ROWS, GRID_CELLS, RECEIPT};

/// Stamps against their beat.
struct Rows {
    /// Beats from the tick of a row's number to its stamp.
    late: Vec<f64>,
    /// Whether a row came on the heels of the one before.
    held_up: Vec<bool>,
}

/// Probabilities of s in beats: of the cells from `first` on.
#[derive(Clone)]
struct Beam {
    first: i64,
    shares: Vec<f64>,
}

/// Delays of a mean, and probabilities of steps.
#[derive(Clone, Copy)]
struct Delays {
    mean: f64,
    /// By a beat later, where a row was lost.
    later: f64,
    /// By a beat earlier, where one came between two ticks.
    earlier: f64,
}

impl Delays {
    fn of(mean: f64, lost: f64) -> Self {
        let least = RECEIPT.min_step_probability;
        Self { mean, later: lost.max(least), earlier: (-lost).max(least) }
    }

    /// Multiplies the shares by the likelihood of a row's stamp.
    fn weigh(&self, rows: &Rows, row: usize, beam: &mut Beam) {
        let cell = 1.0 / GRID_CELLS as f64;
        // exp(−delay/mean) grows from cell to cell by the same factor.
        let mut delay = rows.late[row] - cell * beam.first as f64;
        let (mut free, growth) = ((-delay / self.mean).exp(), (cell / self.mean).exp());
        let early_periods = RECEIPT.early_periods;
        let (ready, of_early) = ((-early_periods / self.mean).exp(), -(-early_periods / self.mean).exp_m1());
        let held_up = rows.held_up[row];
        let mut shares = beam.shares.iter_mut();
        while delay >= 0.0
            && let Some(share) = shares.next()
        {
            *share *= if held_up { 1.0 - ready * free } else { free / self.mean };
            delay -= cell;
            free *= growth;
        }
        // exp(delay/early_periods) falls likewise.
        let (mut early, decay) = ((delay / early_periods).exp(), (-cell / early_periods).exp());
        let of_early = if held_up { of_early } else { self.mean.recip() };
        for share in shares {
            *share *= of_early * early;
            early *= decay;
        }
    }

    /// What becomes of the shares from row to row.
    fn step(&self, beam: &Beam) -> Beam {
        beam.spread(self.earlier, self.later)
    }

    /// The same from a row to the one before.
    fn step_back(&self, beam: &Beam) -> Beam {
        beam.spread(self.later, self.earlier)
    }

    /// The cells that a row alone leaves open, all alike.
    fn first(&self, rows: &Rows, row: usize) -> Beam {
        let cells = |beats: f64| (beats * GRID_CELLS as f64) as i64;
        let last = cells(rows.late[row]) + GRID_CELLS;
        let first = last - cells(RECEIPT.first_delays * (1.0 + self.mean)) - 2 * GRID_CELLS;
        let mut beam = Beam { first, shares: vec![1.0; (last - first + 1) as usize] };
        self.weigh(rows, row, &mut beam);
        beam
    }

    /// The beam after a row, with the log of its probability; whether it begins anew there.
    fn forward(&self, rows: &Rows, row: usize, before: Option<&Beam>) -> (Beam, f64, bool) {
        if let Some(before) = before {
            let mut beam = self.step(before);
            self.weigh(rows, row, &mut beam);
            let sum: f64 = beam.shares.iter().sum();
            if sum > RECEIPT.min_row_probability {
                return (beam.trimmed(), sum.ln(), false);
            }
        }
        let beam = self.first(rows, row);
        let open = beam.shares.len() as f64;
        (beam.trimmed(), RECEIPT.min_row_probability.ln() - open.ln(), true)
    }

    /// Log likelihood of all rows, and the beams before each block of them.
    fn blocks(&self, rows: &Rows) -> (f64, Vec<Option<Beam>>) {
        let (mut log_likelihood, mut blocks, mut beam) = (0.0, Vec::new(), None);
        for row in 0..rows.late.len() {
            if row % BLOCK_ROWS == 0 {
                blocks.push(beam.clone());
            }
            let (after, log_probability, _) = self.forward(rows, row, beam.as_ref());
            log_likelihood += log_probability;
            beam = Some(after);
        }
        (log_likelihood, blocks)
    }

    /// Expected s of each row, beats, by all of them.
    fn smoothed(&self, rows: &Rows) -> Vec<f64> {
        let (_, blocks) = self.blocks(rows);
        let mut expected = vec![0.0; rows.late.len()];
        // What the rows behind say of a row's s; nothing behind the last, and before those that begin anew.
        let mut behind: Option<Beam> = None;
        for (block, before) in blocks.iter().enumerate().rev() {
            let from = block * BLOCK_ROWS;
            let to = rows.late.len().min(from + BLOCK_ROWS);
            let mut beams: Vec<(Beam, bool)> = Vec::with_capacity(to - from);
            for row in from..to {
                let last = beams.last().map(|(beam, _)| beam).or(before.as_ref());
                let (beam, _, begins) = self.forward(rows, row, last);
                beams.push((beam, begins));
            }
            for (row, (beam, begins)) in (from..to).zip(&beams).rev() {
                let all = beam.times(behind.as_ref());
                let cell = |k: usize| (all.first + k as i64) as f64 / GRID_CELLS as f64;
                expected[row] = all.shares.iter().enumerate().map(|(k, share)| share * cell(k)).sum();
                behind = (!begins).then(|| {
                    // All cells of the beam say what comes of them; others are not asked.
                    let mut own = behind.as_ref().map_or_else(|| beam.even(), |behind| behind.over(beam));
                    self.weigh(rows, row, &mut own);
                    self.step_back(&own).scaled()
                });
            }
        }
        expected
    }
}

impl Beam {
    /// Shares that go a beat down and a beat up, walk by a cell, or stay.
    fn spread(&self, down: f64, up: f64) -> Self {
        let extent = GRID_CELLS as usize;
        let walk_probability = RECEIPT.walk_probability;
        let mut shares = vec![0.0; self.shares.len() + 2 * extent];
        let walk = 0.5 * walk_probability;
        let stay = 1.0 - down - up - walk_probability;
        for (k, share) in self.shares.iter().enumerate() {
            shares[k] += down * share;
            shares[k + extent - 1] += walk * share;
            shares[k + extent] += stay * share;
            shares[k + extent + 1] += walk * share;
            shares[k + 2 * extent] += up * share;
        }
        Self { first: self.first - GRID_CELLS, shares }
    }

    fn scaled(mut self) -> Self {
        let sum: f64 = self.shares.iter().sum();
        self.shares.iter_mut().for_each(|share| *share /= sum);
        self
    }

    /// Without the cells at its ends that are improbable, scaled.
    fn trimmed(mut self) -> Self {
        let least = RECEIPT.min_cell_ratio * self.shares.iter().copied().fold(0.0, f64::max);
        let counts = |share: &f64| *share > least;
        let last = self.shares.iter().rposition(counts).unwrap_or(0);
        let first = self.shares.iter().position(counts).unwrap_or(0);
        self.shares.truncate(last + 1);
        self.shares.drain(..first);
        self.first += first as i64;
        self.scaled()
    }

    fn even(&self) -> Self {
        Self { first: self.first, shares: vec![1.0; self.shares.len()] }
    }

    /// Its shares on the cells of another.
    fn over(&self, other: &Self) -> Self {
        let own = |k: usize| usize::try_from(other.first + k as i64 - self.first).ok();
        let share = |k: usize| own(k).and_then(|k| self.shares.get(k)).copied().unwrap_or(0.0);
        Self { first: other.first, shares: (0..other.shares.len()).map(share).collect() }
    }

    /// The product with what the rows behind say.
    fn times(&self, behind: Option<&Self>) -> Self {
        let Some(behind) = behind else { return self.clone() };
        let mut both = behind.over(self);
        both.shares.iter_mut().zip(&self.shares).for_each(|(share, own)| *share *= own);
        // They agree on no cell but by rounding.
        if both.shares.iter().sum::<f64>() > 0.0 { both.scaled() } else { self.clone() }
    }
}

/// Stamps whose delays are beats long: their beat, and when each row was read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Received {
    pub(crate) period_s: f64,
    pub(crate) read_s: Vec<f64>,
}

impl Received {
    /// By stamps that do not fall; `None` where rows do not hold up each other.
    pub(crate) fn of(t_s: &[f64]) -> Option<Self> {
        let settings = &*RECEIPT;
        let (gap_s, held_up) = rows_on_heels(t_s)?;
        let rows = |lost: f64, most: usize| {
            let period_s = gap_s / (1.0 + lost);
            let late = (0..most).map(|row| (t_s[row] - t_s[0]) / period_s - row as f64).collect();
            Rows { late, held_up: held_up[..most].to_vec() }
        };
        let mean_of = |steps: f64| (steps / settings.mean_steps_per_e).exp();
        let likeliest_mean = |first: f64, lost: f64, rows: &Rows| {
            let log_likelihood = |steps: f64| match mean_of(steps) {
                mean if mean > settings.max_mean_delay => f64::NEG_INFINITY,
                mean => Delays::of(mean, lost).blocks(rows).0,
            };
            mean_of(likeliest(settings.mean_steps_per_e * first.ln(), [settings.first_mean_step, 1.0], log_likelihood))
        };
        let most = settings.lost_rows.min(t_s.len());
        let mean = likeliest_mean(1.0, 0.0, &rows(0.0, most));
        if mean * (1.0 / settings.mean_steps_per_e).exp() > settings.max_mean_delay {
            return None;
        }
        // Densities are per beat, and beats differ: per second they compare.
        let by_themselves = held_up[..most].iter().filter(|held_up| !**held_up).count() as f64;
        let log_odds = |lost: f64| {
            let cost = if lost == 0.0 { 0.0 } else { settings.any_lost_cost + lost.abs() / settings.usual_lost };
            Delays::of(mean, lost).blocks(&rows(lost, most)).0 + by_themselves * (1.0 + lost).ln() - cost
        };
        let is_tried = |steps: &i32| steps.abs() <= settings.max_fine_steps || steps % 5 == 0;
        let steps = (-settings.max_lost_steps..=settings.max_lost_steps).filter(is_tried);
        let shares = steps.map(|steps| settings.lost_step * f64::from(steps));
        let lost =
            shares.map(|lost| (lost, log_odds(lost))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(lost, _)| lost);
        let lost = likeliest(lost, settings.lost_steps, log_odds);
        let (all, period_s) = (rows(lost, t_s.len()), gap_s / (1.0 + lost));
        let mean = likeliest_mean(mean, lost, &rows(lost, most));
        let of_rows = Delays::of(mean, lost).smoothed(&all);
        let read = |(row, s): (usize, f64)| t_s[0] + period_s * (row as f64 + s);
        Some(Self { period_s, read_s: of_rows.into_iter().enumerate().map(read).collect() })
    }

    /// For each row, the tick that it was read at, or next to; 0 for the first.
    pub(crate) fn numbers(&self) -> Vec<i64> {
        let mut last = 0;
        let number = |read_s: &f64| {
            last = last.max(((read_s - self.read_s[0]) / self.period_s).round() as i64);
            last
        };
        self.read_s.iter().map(number).collect()
    }
}

/// Whether rows come in bunches, so that their stamps are those of receipt and single gaps say nothing of
/// rows that are missing.
#[must_use]
pub fn has_bunched_rows(t_s: &[f64]) -> bool {
    rows_on_heels(t_s).is_some()
}

/// Time from row to row, and which rows came on the heels of the one before; `None` where hardly any did.
pub(crate) fn rows_on_heels(t_s: &[f64]) -> Option<(f64, Vec<bool>)> {
    let gap_s = slope_s(t_s)?;
    let most_s = RECEIPT.held_up_gap * gap_s;
    let is_held_up = |pair: &[f64]| pair[1] - pair[0] < most_s;
    let held_up: Vec<bool> = std::iter::once(false).chain(t_s.windows(2).map(is_held_up)).collect();
    let count = held_up.iter().filter(|held_up| **held_up).count();
    (count as f64 > RECEIPT.min_held_up_share * (t_s.len() - 1) as f64).then_some((gap_s, held_up))
}

/// The likeliest value from a first one on, by steps that halve (Hooke & Jeeves 1961).
fn likeliest(first: f64, [mut step, least_step]: [f64; 2], log_likelihood: impl Fn(f64) -> f64) -> f64 {
    let (mut best, mut most) = (first, log_likelihood(first));
    while step >= least_step {
        let tried = [best - step, best + step].map(|value| (value, log_likelihood(value)));
        match tried.into_iter().find(|(_, found)| *found > most) {
            Some(found) => (best, most) = found,
            None => step *= 0.5,
        }
    }
    best
}

/// Time from row to row by the lines through the rows between pauses; `None` where there is none.
fn slope_s(t_s: &[f64]) -> Option<f64> {
    let gap_s = (t_s.last()? - t_s.first()?) / (t_s.len() - 1) as f64;
    let pause_s = RECEIPT.pause_periods * gap_s;
    let (mut xy, mut xx) = (0.0, 0.0);
    for part in t_s.chunk_by(|row, next| next - row < pause_s) {
        let middle = 0.5 * (part.len() - 1) as f64;
        for (row, t_s) in part.iter().enumerate() {
            let x = row as f64 - middle;
            xx += x * x;
            xy += x * (t_s - part[0]);
        }
    }
    Some(xy / xx).filter(|slope_s| *slope_s > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    const PERIOD_S: f64 = 0.01;

    /// When rows are read, of which some are lost, and when they are received that are held up by an
    /// exponential delay of so many beats; none overtakes another.
    fn received(rows: i64, lost: f64, delay: f64, mut read_at: impl FnMut(i64) -> f64) -> Vec<[f64; 2]> {
        let mut draws = Draws(7);
        let (mut before_s, mut all) = (f64::NEG_INFINITY, Vec::new());
        for row in 0..rows {
            let read_s = read_at(row);
            let stamp_s = (read_s - delay * PERIOD_S * draws.uniform().ln()).max(before_s + 1e-4);
            if row == 0 || draws.uniform() >= lost {
                all.push([read_s, stamp_s]);
                before_s = stamp_s;
            }
        }
        all
    }

    fn due_s(row: i64) -> f64 {
        PERIOD_S * row as f64
    }

    fn found(rows: &[[f64; 2]]) -> Received {
        Received::of(&rows.iter().map(|[_, stamp_s]| *stamp_s).collect::<Vec<_>>()).expect("rows in bunches")
    }

    /// Mean and standard deviation of what is found wrong, in beats.
    fn errors(rows: &[[f64; 2]]) -> (f64, f64) {
        let found = found(rows);
        let wrong: Vec<f64> =
            rows.iter().zip(&found.read_s).map(|([read_s, _], found_s)| (found_s - read_s) / PERIOD_S).collect();
        let mean = wrong.iter().sum::<f64>() / wrong.len() as f64;
        (mean, (wrong.iter().map(|of| (of - mean).powi(2)).sum::<f64>() / wrong.len() as f64).sqrt())
    }

    #[test]
    fn delays_of_many_beats_leave_less_than_one() {
        let (mean, sigma) = errors(&received(6000, 0.0, 10.0, due_s));
        // Rejects lines through 500 rows, which leave 3 beats and a mean of 29: that of the delays.
        assert!(mean.abs() < 1.0 && sigma < 0.7, "{mean} ± {sigma}");
    }

    #[test]
    fn rows_that_are_lost_shift_those_behind_them() {
        let rows = received(4000, 0.02, 0.75, due_s);
        let (mean, sigma) = errors(&rows);
        // Rejects one beat for all rows, 2 % too long, which leaves half a beat.
        assert!(mean.abs() < 0.1 && sigma < 0.25, "{mean} ± {sigma}");
        let found = found(&rows);
        assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-3, "{}", found.period_s);
        // The share of lost rows is found in steps of 1.5e-4: half a beat of 4000.
        assert!(found.numbers().last().is_some_and(|last| (last - 3999).abs() <= 1));
    }

    #[test]
    fn regress_a_row_between_two_ticks_in_every_fifteen_leaves_the_beat() {
        // Of sixteen rows the last comes by itself, as where a robot stops.
        let between =
            |row: i64| PERIOD_S * ((row / 16 * 15) as f64 + if row % 16 < 15 { (row % 16) as f64 } else { 14.5 });
        let found = found(&received(3000, 0.0, 0.5, between));
        // Rejects the mean gap of all rows, 6 % less, with no row that is lost or came by itself.
        assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-3, "{}", found.period_s);
    }

    #[test]
    fn the_mean_delay_is_found_anew_with_the_rows_that_are_lost() {
        let (mean, sigma) = errors(&received(4000, 0.05, 2.0, due_s));
        // Rejects the mean delay of rows of which none is lost: 0.10 of a beat off.
        assert!(mean.abs() < 0.05 && sigma < 0.5, "{mean} ± {sigma}");
    }

    #[test]
    fn rows_that_are_lost_among_delays_of_many_beats_leave_the_beat() {
        let found = found(&received(6000, 0.023, 5.0, due_s));
        // Rejects beats compared by densities a beat, of which the longest was the likeliest: none without an
        // end.
        assert!((found.period_s / PERIOD_S - 1.0).abs() < 0.03, "{}", found.period_s);
        assert!(found.numbers().last().is_some_and(|last| (last - 5999).abs() < 180));
    }

    #[test]
    fn a_beat_that_begins_anew_after_a_pause_is_the_same() {
        let rows = received(3000, 0.0, 1.0, |row| due_s(row) + if row >= 1200 { 10.0037 } else { 0.0 });
        let (mean, sigma) = errors(&rows);
        // Rejects a pause of a whole number of beats, which is 0.37 of one off on one of its sides.
        assert!(mean.abs() < 0.1 && sigma < 0.12, "{mean} ± {sigma}");
    }

    #[test]
    fn rows_that_are_written_in_blocks_are_not_received_one_by_one() {
        // 300 rows are stamped one after the other once every three seconds: delays of 150 beats on average.
        let t_s: Vec<f64> = (0..3000).map(|row| 3.0 * f64::from(row / 300 + 1) + 1e-5 * f64::from(row % 300)).collect();
        assert_eq!(Received::of(&t_s), None);
    }

    #[test]
    fn rows_that_hold_up_none_are_not_received_so() {
        let mut draws = Draws(7);
        let t_s: Vec<f64> = (0..2000).map(|row| due_s(row) + 0.1 * PERIOD_S * draws.normal()).collect();
        assert_eq!(Received::of(&t_s), None);
    }
}

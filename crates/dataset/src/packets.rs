//! Rows that a controller keeps and sends some at a time: those of a packet are received in one moment,
//! though they were read a sampling period after each other.
//!
//! All packets have as many rows but few. The last of a packet is held to be read when it is sent, on the
//! beat of the packets.

use std::ops::Range;

use crate::receipt_delays::{Received, rows_on_heels};

/// Share of the packets that have as many rows at the least; of rows that hold up each other by chance,
/// bunches of one size are half at most.
const MIN_USUAL_SHARE: f64 = 0.9;
/// Rows of a packet at the least: two come on each other's heels where a motion ends.
const MIN_ROWS: usize = 2;

/// The rows of each packet.
pub(crate) struct Packets {
    of: Vec<Range<usize>>,
    /// How many rows they usually have.
    rows: usize,
}

impl Packets {
    /// By stamps that do not fall; `None` where rows do not come in packets.
    fn of(t_s: &[f64]) -> Option<Self> {
        let (_, on_heels) = rows_on_heels(t_s)?;
        let firsts: Vec<usize> = (0..t_s.len()).filter(|row| !on_heels[*row]).collect();
        let ends = firsts[1..].iter().copied().chain([t_s.len()]);
        let of: Vec<Range<usize>> = firsts.iter().copied().zip(ends).map(|(from, to)| from..to).collect();
        let rows = of[of.len() / 2].len();
        // Of the first and the last the log may have a part.
        let whole = of.iter().filter(|packet| packet.len() == rows).count();
        let inner = of.len().saturating_sub(2);
        (rows >= MIN_ROWS && whole as f64 >= MIN_USUAL_SHARE * inner as f64).then_some(Self { of, rows })
    }

    /// When rows were read that are sent some at a time, by the beat that is found of the packets' own
    /// stamps: their period, and what each of them is late by. `None` of any other log.
    pub(crate) fn read(t_s: &[f64], beat_of: impl FnOnce(&[f64]) -> Option<(f64, Vec<f64>)>) -> Option<Received> {
        let packets = Self::of(t_s)?;
        let (period_s, late_s) = beat_of(&packets.sent_s(t_s))?;
        packets.rows_read(t_s, (period_s, &late_s))
    }

    /// When each was sent: the stamps of the last rows.
    fn sent_s(&self, t_s: &[f64]) -> Vec<f64> {
        self.of.iter().map(|packet| t_s[packet.end - 1]).collect()
    }

    /// When the rows were read, by the packets' period and what each of them is late by; `None` where one is
    /// longer than usual and reaches into the one before.
    fn rows_read(&self, t_s: &[f64], (sent_period_s, sent_late_s): (f64, &[f64])) -> Option<Received> {
        let period_s = sent_period_s / self.rows as f64;
        let of_packet = |(packet, late_s): (&Range<usize>, &f64)| {
            let sent_s = t_s[packet.end - 1] - late_s;
            (0..packet.len()).rev().map(move |before| sent_s - period_s * before as f64)
        };
        let read_s: Vec<f64> = self.of.iter().zip(sent_late_s).flat_map(of_packet).collect();
        read_s.is_sorted().then_some(Received { period_s, read_s })
    }
}

/// How many rows come at a time, where a log's rows are kept and sent in packets; by stamps that do not fall.
#[must_use]
pub fn rows_per_packet(t_s: &[f64]) -> Option<usize> {
    Packets::of(t_s).map(|packets| packets.rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;
    use crate::sampling_period::SamplingPeriod;

    const PERIOD_S: f64 = 0.01;

    /// When rows are read, and when they are received that are sent by so many, and late by up to 2 ms.
    fn sent_by(rows: i64) -> Vec<[f64; 2]> {
        let mut draws = Draws(11);
        let of_packet = |packet: i64| {
            let sent_s = PERIOD_S * (rows * packet + rows - 1) as f64 + 2e-3 * draws.uniform();
            (0..rows).map(move |row| [PERIOD_S * (rows * packet + row) as f64, sent_s + 1e-4 * (row - rows + 1) as f64])
        };
        (0..200).flat_map(of_packet).collect()
    }

    fn stamps_s(rows: &[[f64; 2]]) -> Vec<f64> {
        rows.iter().map(|[_, stamp_s]| *stamp_s).collect()
    }

    #[test]
    fn each_row_is_read_a_period_after_the_one_before() {
        for rows in [2, 5, 10] {
            let mut sent = sent_by(rows);
            // The log begins within a packet, and a row of another is lost.
            sent.drain(..1);
            let lost = 20 * rows as usize - 1;
            sent.remove(lost);
            assert_eq!(rows_per_packet(&stamps_s(&sent)), Some(rows as usize));
            let found = SamplingPeriod::of(&stamps_s(&sent)).expect("packets");
            assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-3, "{} of {rows}", found.period_s);
            let wrong = sent.iter().zip(&found.late_s).map(|([read_s, stamp_s], late_s)| stamp_s - late_s - read_s);
            // Packets are late by 1 ms on average, which no beat tells; the row that is lost leaves others of
            // its packet a row off.
            let is_right = |wrong_s: f64| (wrong_s - 1e-3).abs() < 5e-4;
            let right = wrong.filter(|wrong_s| is_right(*wrong_s)).count();
            assert!(right + rows as usize >= sent.len(), "{right} of {} for {rows}", sent.len());
            assert_eq!(found.numbers.last(), Some(&(200 * rows - 2)));
        }
    }

    #[test]
    fn rows_that_hold_up_each_other_by_chance_are_no_packets() {
        let mut draws = Draws(12);
        let mut before_s = 0.0_f64;
        let received = |row: i32| {
            before_s = (PERIOD_S * f64::from(row) - 0.02 * draws.uniform().ln()).max(before_s + 1e-4);
            before_s
        };
        assert!(Packets::of(&(0..2000).map(received).collect::<Vec<f64>>()).is_none());
        assert!(Packets::of(&(0..2000).map(|row| PERIOD_S * f64::from(row)).collect::<Vec<f64>>()).is_none());
    }
}

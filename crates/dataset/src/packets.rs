//! Rows that a controller keeps and sends some at a time: those of a packet are received in one moment,
//! though they were read a sampling period after each other.
//!
//! Where packets have as many rows each, but where one was lost, they are sent on a beat of their own, and
//! the last row of each is held to be read when it is sent. Where they have now more and now fewer, as a
//! sender makes them that looks now and then for what there is, no row is lost, and the last row of each is
//! read on the rows' own beat, about when it is sent. Packets that lost rows leave that beat.

use std::ops::Range;

use crate::lateness::Sums;
use crate::receipt_delays::{Received, rows_on_heels};
use crate::settings::PACKET_SIZES;

/// The rows of each packet.
pub(crate) struct Packets {
    of: Vec<Range<usize>>,
    /// How many rows they usually have.
    rows: usize,
    /// Where they have now more and now fewer: when the log's first row was read, and the rows' period,
    /// seconds.
    row_timing_s: Option<[f64; 2]>,
}

impl Packets {
    /// By stamps that do not fall; `None` where rows do not come in packets.
    fn of(t_s: &[f64]) -> Option<Self> {
        let settings = &*PACKET_SIZES;
        let (_, on_heels) = rows_on_heels(t_s)?;
        let firsts: Vec<usize> = (0..t_s.len()).filter(|row| !on_heels[*row]).collect();
        let ends = firsts[1..].iter().copied().chain([t_s.len()]);
        let of: Vec<Range<usize>> = firsts.iter().copied().zip(ends).map(|(from, to)| from..to).collect();
        // Of the first and the last the log may have a part.
        let mut sizes: Vec<usize> = of.get(1..of.len() - 1)?.iter().map(Range::len).collect();
        sizes.sort_unstable();
        let share = |is_so: &dyn Fn(usize) -> bool| {
            sizes.iter().filter(|rows| is_so(**rows)).count() as f64 / sizes.len() as f64
        };
        let most_often = sizes.chunk_by(|a, b| a == b).max_by_key(|alike| alike.len())?[0];
        let whole = share(&|rows| rows == most_often);
        let are_alike =
            whole >= settings.min_whole_share && share(&|rows| rows > most_often) <= settings.max_larger_share;
        let middle = sizes[sizes.len() / 2];
        let similar = || share(&|rows| 2 * rows >= middle && rows <= 2 * middle);
        let short = sizes.iter().filter(|rows| **rows < most_often).count();
        let may_vary = (!are_alike || short >= settings.min_short_packets) && similar() >= settings.min_similar_share;
        let row_timing_s = if may_vary { row_timing_s(&of, t_s) } else { None };
        let rows = if row_timing_s.is_some() { middle } else { most_often };
        (rows >= settings.min_packet_rows && (are_alike || row_timing_s.is_some())).then_some(Self {
            of,
            rows,
            row_timing_s,
        })
    }

    /// When rows were read that are sent some at a time. Where packets have as many rows each, it is found of
    /// the packets' own stamps: `beat_of` them is their period, and what each of them is late by. `None` of
    /// any other log.
    pub(crate) fn read(t_s: &[f64], beat_of: impl FnOnce(&[f64]) -> Option<(f64, Vec<f64>)>) -> Option<Received> {
        let packets = Self::of(t_s)?;
        if let Some([first_s, period_s]) = packets.row_timing_s {
            let read_s = (0..t_s.len()).map(|row| first_s + period_s * row as f64).collect();
            return Some(Received { period_s, read_s });
        }
        let (period_s, late_s) = beat_of(&packets.sent_s(t_s))?;
        packets.rows_read(t_s, period_s, &late_s)
    }

    /// When each was sent: the stamps of the last rows.
    fn sent_s(&self, t_s: &[f64]) -> Vec<f64> {
        self.of.iter().map(|packet| t_s[packet.end - 1]).collect()
    }

    /// When the rows were read, by the packets' period and what each of them is late by; `None` where one is
    /// longer than usual and reaches into the one before.
    fn rows_read(&self, t_s: &[f64], sent_period_s: f64, sent_late_s: &[f64]) -> Option<Received> {
        let period_s = sent_period_s / self.rows as f64;
        let of_packet = |(packet, late_s): (&Range<usize>, &f64)| {
            let sent_s = t_s[packet.end - 1] - late_s;
            (0..packet.len()).rev().map(move |before| sent_s - period_s * before as f64)
        };
        let read_s: Vec<f64> = self.of.iter().zip(sent_late_s).flat_map(of_packet).collect();
        read_s.is_sorted().then_some(Received { period_s, read_s })
    }
}

/// The line through the stamps of the packets' last rows on their numbers: the time of row 0 and the rows'
/// period, seconds; `None` where packets are off it.
fn row_timing_s(packets: &[Range<usize>], t_s: &[f64]) -> Option<[f64; 2]> {
    let [first, .., last] = packets else { return None };
    let rows = (last.end - first.end) as f64;
    let mean_period_s = (t_s[last.end - 1] - t_s[first.end - 1]) / rows;
    // Times over numbers stay small for precision.
    let sent = || packets.iter().map(|packet| (packet.end - 1) as f64).zip(packets.iter().map(|of| t_s[of.end - 1]));
    let mut line = Sums::default();
    sent().for_each(|(row, sent_s)| line.add(row, sent_s - mean_period_s * row, 1.0));
    let first_s = line.line_at(0.0);
    let period_s = mean_period_s + (line.line_at(rows) - first_s) / rows;
    let squares_s2: f64 = sent().map(|(row, sent_s)| (sent_s - first_s - period_s * row).powi(2)).sum();
    ((squares_s2 / packets.len() as f64).sqrt() <= PACKET_SIZES.max_packet_off * period_s)
        .then_some([first_s, period_s])
}

/// How many rows come at a time, usually, where a log's rows are kept and sent in packets; by stamps that do
/// not fall.
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
    fn rows_of_packets_of_any_size_are_on_their_own_beat() {
        // A sender that looks for rows every 47 ms; a row takes 0.1 ms on the line.
        let mut sent: Vec<[f64; 2]> = Vec::new();
        for row in 0..1500 {
            let read_s = PERIOD_S * f64::from(row);
            let sent_s = (read_s / 0.047).ceil() * 0.047;
            let next_s = sent.last().map_or(sent_s, |[_, before_s]| sent_s.max(before_s + 1e-4));
            sent.push([read_s, next_s]);
        }
        assert!(matches!(rows_per_packet(&stamps_s(&sent)), Some(4 | 5)));
        let found = SamplingPeriod::of(&stamps_s(&sent)).expect("packets");
        assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-4, "{}", found.period_s);
        assert_eq!(found.numbers, (0..1500).collect::<Vec<i64>>());
        // The sender looks a half period after the last row was read on average; rows take another 0.4 ms.
        let wrong = sent.iter().zip(&found.late_s).map(|([read_s, stamp_s], late_s)| stamp_s - late_s - read_s);
        assert!(wrong.clone().all(|wrong_s| (4e-3..7e-3).contains(&wrong_s)), "{:?}", wrong.fold(0.0, f64::max));
        // Where rows are lost their numbers are not known.
        let mut draws = Draws(14);
        sent.retain(|_| draws.uniform() > 0.05);
        assert!(Packets::of(&stamps_s(&sent)).is_none_or(|packets| packets.row_timing_s.is_none()));
    }

    #[test]
    fn packets_of_which_rows_are_lost_keep_their_beat() {
        let mut draws = Draws(13);
        let mut sent = sent_by(5);
        sent.retain(|_| draws.uniform() > 0.05);
        assert_eq!(rows_per_packet(&stamps_s(&sent)), Some(5));
        let found = SamplingPeriod::of(&stamps_s(&sent)).expect("packets");
        assert!((found.period_s / PERIOD_S - 1.0).abs() < 1e-3, "{}", found.period_s);
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

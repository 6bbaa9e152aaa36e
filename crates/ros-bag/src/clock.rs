//! Times of a topic's rows: the stamps in the messages' headers, or where there are none those of receipt.

use crate::error::RosBagError;
use crate::value::Value;

/// Messages of one topic may overtake each other by so much, seconds: transforms of several publishers arrive
/// up to some tenths of a second late. A longer step back is another recording, or a clock that was set.
const MAX_OVERTAKING_S: f64 = 1.0;

/// When a message was stamped and received, nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Times {
    /// None where the header has no stamp, or zero.
    pub(crate) stamp_ns: Option<i64>,
    pub(crate) received_ns: i64,
}

impl Times {
    /// The times of a message whose header is in `message`.
    pub(crate) fn of(message: &Value, received_ns: u64) -> Self {
        let of = |path| message.integer(path).and_then(|value| i64::try_from(value).ok());
        let stamp = of("header.stamp.sec").zip(of("header.stamp.nanosec"));
        let stamp_ns = stamp.and_then(|(sec, nanosec)| sec.checked_mul(1_000_000_000)?.checked_add(nanosec));
        let received_ns = i64::try_from(received_ns).unwrap_or(i64::MAX);
        Self { stamp_ns: stamp_ns.filter(|stamp_ns| *stamp_ns != 0), received_ns }
    }

    /// The time by a clock, nanoseconds; none of a message without a stamp.
    pub(crate) fn by(self, clock: Clock) -> Option<i64> {
        match clock {
            Clock::Stamps => self.stamp_ns,
            Clock::Receipt => Some(self.received_ns),
        }
    }
}

/// Which of the two times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clock {
    Stamps,
    Receipt,
}

/// The clock of a topic: its stamps, if any of its messages has one.
pub(crate) fn clock(times: &[Times]) -> Clock {
    if times.iter().any(|times| times.stamp_ns.is_some()) { Clock::Stamps } else { Clock::Receipt }
}

/// Rows in the order of time.
pub(crate) struct Ordered {
    /// Index of each row that is kept, with its time in nanoseconds.
    pub(crate) rows: Vec<(usize, i64)>,
    /// Rows at the instant of another one.
    pub(crate) duplicates: usize,
    /// Rows without a stamp where others have one.
    pub(crate) unstamped: usize,
}

/// Brings rows into the order of time. Time may step back where runs may be cut.
pub(crate) fn ordered(topic: &str, times: &[Times], clock: Clock, may_restart: bool) -> Result<Ordered, RosBagError> {
    let with_time: Vec<(usize, i64)> =
        times.iter().enumerate().filter_map(|(row, times)| Some((row, times.by(clock)?))).collect();
    let unstamped = times.len() - with_time.len();
    let mut recordings: Vec<Vec<(usize, i64)>> = Vec::new();
    let mut latest_ns = i64::MIN;
    for (row, time_ns) in with_time {
        let step_s = (i128::from(latest_ns) - i128::from(time_ns)) as f64 / 1e9;
        if recordings.is_empty() || step_s > MAX_OVERTAKING_S {
            if !recordings.is_empty() && !may_restart {
                return Err(RosBagError::TimeRunsBackwards { topic: topic.to_owned(), number: row + 1, step_s });
            }
            recordings.push(Vec::new());
            latest_ns = time_ns;
        }
        latest_ns = latest_ns.max(time_ns);
        if let Some(recording) = recordings.last_mut() {
            recording.push((row, time_ns));
        }
    }
    let mut duplicates = 0;
    for recording in &mut recordings {
        let before = recording.len();
        recording.sort_by_key(|(_, time_ns)| *time_ns);
        recording.dedup_by_key(|(_, time_ns)| *time_ns);
        duplicates += before - recording.len();
    }
    Ok(Ordered { rows: recordings.concat(), duplicates, unstamped })
}

/// Seconds between two times.
pub(crate) fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_overtook_are_sorted_and_restarts_are_refused_or_kept_apart() {
        let times = |stamps_s: &[i64]| -> Vec<Times> {
            let of = |stamp_s: &i64| {
                let stamp_ns = Some(stamp_s * 100_000_000).filter(|stamp_ns| *stamp_ns != 0);
                Times { stamp_ns, received_ns: 5 }
            };
            stamps_s.iter().map(of).collect()
        };
        let found = ordered("/a", &times(&[1, 3, 2, 3, 0, 4]), Clock::Stamps, false).expect("in order");
        let rows: Vec<usize> = found.rows.iter().map(|(row, _)| *row).collect();
        assert_eq!((rows, found.duplicates, found.unstamped), (vec![0, 2, 1, 5], 1, 1));
        let restarts = times(&[100, 101, 1, 2]);
        let refused = ordered("/a", &restarts, Clock::Stamps, false).map(|_| ());
        assert!(matches!(refused, Err(RosBagError::TimeRunsBackwards { number: 3, .. })), "{refused:?}");
        let kept = ordered("/a", &restarts, Clock::Stamps, true).expect("kept apart");
        assert_eq!(kept.rows.iter().map(|(row, _)| *row).collect::<Vec<_>>(), [0, 1, 2, 3]);
        assert_eq!(clock(&times(&[0, 0])), Clock::Receipt);
    }
}

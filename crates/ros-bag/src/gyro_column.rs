//! The column `gyro_radps` of a dataset from the messages of a gyroscope.

use crate::clock::{self, Clock, seconds};
use crate::error::RosBagError;
use crate::gyro;
use crate::rows::{GyroRows, RECEIPT_MARGIN_S};

/// All messages in the order of time.
pub(crate) struct GyroColumn {
    topic: String,
    messages: Vec<Message>,
    /// Rows of the odometry that have an interval, and those of them that got no rate.
    rows: usize,
    empty: usize,
}

struct Message {
    time_ns: i64,
    received_ns: i64,
    yaw_rate_rad_s: f64,
}

impl GyroColumn {
    /// By the clock of the wheels, whose rows are `span_ns`; what is doubtful goes to `warnings`.
    pub(crate) fn new(
        gyro: &GyroRows,
        clock: Clock,
        span_ns: (i64, i64),
        may_restart: bool,
        warnings: &mut Vec<String>,
    ) -> Result<Self, RosBagError> {
        let rows = &gyro.rows;
        rows.refuse_none("a rate")?;
        if clock == Clock::Stamps && clock::clock(&rows.times) == Clock::Receipt {
            return Err(rows.unusable("its messages have no header stamps, by which the wheels are timed".to_owned()));
        }
        let mut doubts = rows.warnings();
        let ordered = rows.in_order(clock, may_restart, &mut doubts)?;
        let message = |(row, time_ns): (usize, i64)| Message {
            time_ns,
            received_ns: rows.times[row].received_ns,
            yaw_rate_rad_s: rows.values[row].yaw_rate_rad_s,
        };
        let messages: Vec<Message> = ordered.into_iter().map(message).collect();
        if !messages.iter().any(|message| (span_ns.0..=span_ns.1).contains(&message.time_ns)) {
            return Err(rows.unusable("none of its messages is of the time of the wheels".to_owned()));
        }
        doubts.extend(gyro::doubt_of_axis(&rows.values).map(|doubt| format!("topic {}: {doubt}", rows.topic)));
        warnings.extend(doubts);
        Ok(Self { topic: rows.topic.clone(), messages, rows: 0, empty: 0 })
    }

    /// Mean rates of a run's rows; none where not one is known. `received_ns` is when its first and last row
    /// were: of recordings with the same times each run has the rates of its own.
    pub(crate) fn of_run(&mut self, rows_ns: &[i64], received_ns: (i64, i64)) -> Option<Vec<f64>> {
        let mut messages: Vec<(i64, f64)> = Vec::new();
        for message in &self.messages {
            let is_of_run = seconds(received_ns.0, message.received_ns) >= -RECEIPT_MARGIN_S
                && seconds(received_ns.1, message.received_ns) <= RECEIPT_MARGIN_S;
            if is_of_run && messages.last().is_none_or(|(last_ns, _)| *last_ns < message.time_ns) {
                messages.push((message.time_ns, message.yaw_rate_rad_s));
            }
        }
        let means = gyro::means(&messages, rows_ns);
        let known = means.iter().filter(|mean| !mean.is_nan()).count();
        let intervals = rows_ns.len().saturating_sub(1);
        self.rows += intervals;
        self.empty += intervals - known;
        (known > 0).then_some(means)
    }

    /// How many rows got no rate, for the user.
    pub(crate) fn gaps(&self) -> Option<String> {
        (self.empty > 0).then(|| {
            format!(
                "topic {}: {} of {} rows of the odometry have no rates all through their interval; gyro_radps is empty there",
                self.topic, self.empty, self.rows
            )
        })
    }
}

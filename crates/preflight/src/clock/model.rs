//! A clock beside that of a log.

/// A clock of the instrument: what is stamped T is of the log's instant T − offset − (T − middle) rate/(1 +
/// rate), times since the start of a run, or since that of the session.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clock {
    /// How late stamps are in the middle of the log, seconds.
    pub offset_s: f64,
    /// What the instrument's clock gains on the log's, seconds a second.
    pub rate: f64,
    /// The stamp at which the offset holds, seconds.
    pub middle_s: f64,
    /// Whether times count from the start of the session; otherwise from that of each run.
    pub of_session: bool,
}

impl Clock {
    /// How late a stamp is that is so long after the start, seconds.
    #[must_use]
    pub fn late_s(self, since_s: f64) -> f64 {
        self.offset_s + (since_s - self.middle_s) * self.rate / (1.0 + self.rate)
    }

    /// The log's instant of a stamp, seconds since the start of a run that begins at `start_s` of its
    /// session.
    #[must_use]
    pub fn log_s(self, start_s: f64, stamp_s: f64) -> f64 {
        stamp_s - self.late_s(if self.of_session { start_s + stamp_s } else { stamp_s })
    }
}

//! When rows were read that a controller keeps and sends some at a time, for logs that are to be set right.

use crate::packets::Packets;
use crate::sampling_period::SamplingPeriod;

/// When the rows of a log were read that are sent some at a time; `None` of any other log. A run of few
/// packets has the mean of their gaps for a beat.
pub(crate) fn read_times_s(t_s: &[f64]) -> Option<Vec<f64>> {
    let beat_of = |sent_s: &[f64]| match SamplingPeriod::of(sent_s) {
        Some(sent) => Some((sent.period_s, sent.late_s)),
        None => {
            let gaps = sent_s.len().checked_sub(1).filter(|gaps| *gaps > 0)?;
            Some(((sent_s[gaps] - sent_s[0]) / gaps as f64, vec![0.0; sent_s.len()]))
        }
    };
    Packets::read(t_s, beat_of).map(|received| received.read_s)
}

//! When rows were read that a controller keeps and sends some at a time, for logs that are to be set right.

use crate::packets::Packets;
use crate::sampling_period::SamplingPeriod;

/// When the rows of a log were read that are sent some at a time; `None` of any other log. A run of few
/// packets has the mean of their gaps for a beat.
pub(crate) fn read_times_s(t_s: &[f64]) -> Option<Vec<f64>> {
    let packets = Packets::of(t_s)?;
    let sent_s = packets.sent_s(t_s);
    let received = match SamplingPeriod::of(&sent_s) {
        Some(sent) => packets.rows_read(t_s, (sent.period_s, &sent.late_s)),
        None => {
            let gaps = sent_s.len().checked_sub(1).filter(|gaps| *gaps > 0)?;
            let period_s = (sent_s[gaps] - sent_s[0]) / gaps as f64;
            packets.rows_read(t_s, (period_s, &vec![0.0; sent_s.len()]))
        }
    };
    received.map(|received| received.read_s)
}

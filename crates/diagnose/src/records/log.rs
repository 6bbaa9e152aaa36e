//! What is diagnosed.

use dataset::Dataset;

use crate::records::large_log::LargeLog;

/// A log as it is diagnosed: its datasets, and the large log whose stretches they are.
#[derive(Debug, Clone, Copy)]
pub struct Log<'l> {
    pub(crate) datasets: &'l [Dataset],
    pub(crate) large: Option<&'l LargeLog>,
    /// Nothing is compared across intervals in which robot or frame moved as no wheel says.
    pub(crate) cuts_events: bool,
}

impl<'l> From<&'l [Dataset]> for Log<'l> {
    fn from(datasets: &'l [Dataset]) -> Self {
        Self { datasets, large: None, cuts_events: true }
    }
}

impl<'l> From<&'l Vec<Dataset>> for Log<'l> {
    fn from(datasets: &'l Vec<Dataset>) -> Self {
        Self::from(&datasets[..])
    }
}

impl<'l, const N: usize> From<&'l [Dataset; N]> for Log<'l> {
    fn from(datasets: &'l [Dataset; N]) -> Self {
        Self::from(&datasets[..])
    }
}

impl<'l> From<&'l LargeLog> for Log<'l> {
    fn from(log: &'l LargeLog) -> Self {
        Self { datasets: log.datasets(), large: Some(log), cuts_events: true }
    }
}

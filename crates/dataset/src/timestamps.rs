//! When the rows of a log were read, and the beat behind that.

use rules::Rule;
use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, OnceLock};

use crate::sampling_period::SamplingPeriod;

/// The timestamps of a log's rows, seconds, and their sampling period, which is found where it is first asked
/// for and kept until a timestamp changes. Copies share it.
#[derive(Clone, Default)]
pub struct Timestamps {
    t_s: Vec<f64>,
    period: OnceLock<Option<Arc<SamplingPeriod>>>,
}

impl fmt::Debug for Timestamps {
    /// The times; whether their beat has been asked for is no part of them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Timestamps").field(&self.t_s).finish()
    }
}

impl Timestamps {
    /// The beat behind them; `None` where rows are too few to have one.
    pub fn sampling_period(&self) -> Option<&SamplingPeriod> {
        self.period.get_or_init(|| Rule::SamplingPeriod.finds(SamplingPeriod::of(&self.t_s)).map(Arc::new)).as_deref()
    }
}

impl Deref for Timestamps {
    type Target = Vec<f64>;

    fn deref(&self) -> &Vec<f64> {
        &self.t_s
    }
}

impl DerefMut for Timestamps {
    fn deref_mut(&mut self) -> &mut Vec<f64> {
        self.period.take();
        &mut self.t_s
    }
}

impl From<Vec<f64>> for Timestamps {
    fn from(t_s: Vec<f64>) -> Self {
        Self { t_s, period: OnceLock::new() }
    }
}

impl FromIterator<f64> for Timestamps {
    fn from_iter<I: IntoIterator<Item = f64>>(t_s: I) -> Self {
        Vec::from_iter(t_s).into()
    }
}

impl<'t> IntoIterator for &'t Timestamps {
    type Item = &'t f64;
    type IntoIter = std::slice::Iter<'t, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.t_s.iter()
    }
}

impl PartialEq for Timestamps {
    fn eq(&self, other: &Self) -> bool {
        self.t_s == other.t_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_period_follows_timestamps_that_change() {
        let mut stamps: Timestamps = (0..100).map(|row| 0.1 * f64::from(row)).collect();
        let period_s = |stamps: &Timestamps| stamps.sampling_period().map(|period| period.period_s);
        assert!(period_s(&stamps).is_some_and(|period_s| (period_s - 0.1).abs() < 1e-9));
        let before = stamps.clone();
        stamps.iter_mut().for_each(|t_s| *t_s *= 2.0);
        // Rejects a period that is kept over a change.
        assert!(period_s(&stamps).is_some_and(|period_s| (period_s - 0.2).abs() < 1e-9));
        assert_eq!(period_s(&stamps), SamplingPeriod::of(&stamps).map(|period| period.period_s));
        // A copy made before keeps its own.
        assert!(period_s(&before).is_some_and(|period_s| (period_s - 0.1).abs() < 1e-9));
    }
}

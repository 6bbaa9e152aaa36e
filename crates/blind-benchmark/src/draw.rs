//! Draws of a case's stream: ranges, choices and directions.

use effects::{Address, Stream, StreamName};

/// Where the draws of one attempt at a case are: each matter has a stream of its own, so that a new matter
/// disturbs no other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CaseDraws {
    pub(crate) seed: u64,
    pub(crate) case: u64,
    pub(crate) attempt: u64,
}

impl CaseDraws {
    /// The draws of one matter.
    pub(crate) fn of(self, what: &str) -> Draw {
        Draw::of(self.seed, self.case, what, self.attempt)
    }
}

/// A stream with the draws that a case is made of.
#[derive(Debug, Clone)]
pub(crate) struct Draw(pub(crate) Stream);

impl Draw {
    /// The draws of one matter of a case; a case that had to be drawn again has others.
    pub(crate) fn of(seed: u64, case: u64, what: &str, attempt: u64) -> Self {
        let name = StreamName::new("challenge").nth(attempt);
        let address = Address { seed, point: 0, trial: case, run: 0 };
        // The matter is hashed into the run's place of the address by its letters: matters are few and fixed.
        let run = what.bytes().fold(1_u32, |hash, byte| hash.wrapping_mul(31).wrapping_add(u32::from(byte)));
        Self(Address { run, ..address }.stream(name))
    }

    /// Uniform in [low, high).
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.uniform_in(low, high)
    }

    /// Uniform in its logarithm.
    pub(crate) fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.log_uniform(low, high)
    }

    /// True with this probability.
    pub(crate) fn bernoulli(&mut self, probability: f64) -> bool {
        self.0.uniform() < probability
    }

    /// A number below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// 1 or −1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.bernoulli(0.5) { 1.0 } else { -1.0 }
    }
}

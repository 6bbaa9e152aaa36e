//! Between encoder and counter: the decoder's noise filter, and the counter that keeps whole counts only.
//!
//! The HCTL-1100 takes a new quadrature state once it has stood three clock periods. States are nominally
//! 1/rate long; disc and sensors spread their widths by ±e (uniform), so of the states at count rate ρ the
//! share P(w < 3/f) = (3ρ/f − 1 + e)/2e is too short.
//!
//! Assumptions: a state that is not seen costs one count (a real decoder may also take two missed edges for
//! none or for a reversal); the share is applied as a mean, not drawn.
//! Source: HP HCTL-1100 datasheet, encoder input ("3-bit" state delay filter); the same filter is drawn in
//! the HCTL-2032 datasheet, figure 12 ("three consecutive rising clock edges").

use scenario::{Encoder, QUADRATURE_DECODING};

use crate::servo_error::ServoError;

/// Clock periods that a quadrature state must stand to be seen (HP HCTL-1100 datasheet, encoder input).
pub(crate) const STATE_CLOCKS: f64 = 3.0;

/// The share of counts that the decoder's input filter loses, as a function of the count rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StateFilter {
    shortest_state_s: f64,
    width_error: f64,
}

impl StateFilter {
    /// The filter of a chip with that clock behind that encoder.
    ///
    /// # Errors
    /// When the encoder's values are impossible, or the spread of widths is not in [0, 1).
    pub(crate) fn new(encoder: &Encoder, clock_hz: f64) -> Result<Self, ServoError> {
        ServoError::unless_positive("lines_per_rev", encoder.lines_per_rev)?;
        ServoError::unless_positive("gear_ratio", encoder.gear_ratio)?;
        ServoError::unless_positive("clock_hz", clock_hz)?;
        let width_error = encoder.state_width_error;
        if !(0.0..1.0).contains(&width_error) {
            return Err(ServoError::OutOfRange {
                quantity: "state_width_error",
                value: width_error,
                expected: "in [0, 1)",
            });
        }
        Ok(Self { shortest_state_s: STATE_CLOCKS / clock_hz, width_error })
    }

    /// Share of the counts that is lost at a steady count rate: 0 while the narrowest state stands long
    /// enough, 1 once the widest does not.
    #[must_use]
    pub(crate) fn lost_share(&self, counts_per_s: f64) -> f64 {
        let needed_width = counts_per_s.abs() * self.shortest_state_s; // as a share of the nominal width
        if needed_width <= 1.0 - self.width_error {
            0.0
        } else if needed_width >= 1.0 + self.width_error {
            1.0
        } else {
            (needed_width - 1.0 + self.width_error) / (2.0 * self.width_error)
        }
    }

    /// What is left of `counts` that passed in `dt_s`.
    #[must_use]
    pub(crate) fn pass(&self, counts: f64, dt_s: f64) -> f64 {
        if dt_s > 0.0 { counts * (1.0 - self.lost_share(counts / dt_s)) } else { counts }
    }
}

/// Wheel-referred encoder resolution, counts/rad of the wheel.
#[must_use]
pub(crate) fn counts_per_wheel_rad(encoder: &Encoder) -> f64 {
    QUADRATURE_DECODING * encoder.lines_per_rev * encoder.gear_ratio / std::f64::consts::TAU
}

/// Turns real-valued travel into whole counts: an edge is counted when it is passed, in either direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Counter {
    /// Travel since the last edge, counts, in [0, 1).
    past_edge: f64,
}

impl Counter {
    /// A counter that starts `start_phase_counts` past an edge; only the fraction counts.
    #[must_use]
    pub(crate) fn new(start_phase_counts: f64) -> Self {
        let phase = start_phase_counts - start_phase_counts.floor();
        Self { past_edge: if phase < 1.0 { phase } else { 0.0 } }
    }

    /// Moves on by `real_counts` and returns the new whole counts, negative backward.
    pub(crate) fn advance(&mut self, real_counts: f64) -> i64 {
        let travel = self.past_edge + real_counts;
        let whole = travel.floor();
        self.past_edge = travel - whole;
        if self.past_edge >= 1.0 {
            // A negative travel too small for the fraction to show rounds up to the edge itself.
            self.past_edge = 0.0;
            return whole as i64 + 1;
        }
        whole as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOCK_HZ: f64 = 2e6;
    /// 3 clocks at 2 MHz are 1.5 µs: a perfect encoder's limit, counts/s.
    const LIMIT_COUNTS_S: f64 = CLOCK_HZ / STATE_CLOCKS;

    fn filter(state_width_error: f64) -> StateFilter {
        let encoder = Encoder { lines_per_rev: 200.0, gear_ratio: 50.0, state_width_error };
        StateFilter::new(&encoder, CLOCK_HZ).expect("a valid encoder")
    }

    #[test]
    fn losses_hinge_at_the_narrowest_state_and_are_total_at_the_widest() {
        let filter = filter(0.25);
        assert_eq!(filter.lost_share(0.7499 * LIMIT_COUNTS_S), 0.0);
        assert!(filter.lost_share(0.7501 * LIMIT_COUNTS_S) > 0.0);
        // Uniform widths: half of the states are below nominal. 1e-12 is rounding in three products.
        assert!((filter.lost_share(LIMIT_COUNTS_S) - 0.5).abs() < 1e-12);
        assert!((filter.lost_share(-0.875 * LIMIT_COUNTS_S) - 0.25).abs() < 1e-12, "backward counts are lost alike");
        assert_eq!(filter.lost_share(1.2501 * LIMIT_COUNTS_S), 1.0);
        assert!((filter.pass(LIMIT_COUNTS_S * 1e-3, 1e-3) - 0.5 * LIMIT_COUNTS_S * 1e-3).abs() < 1e-9);
    }

    #[test]
    fn a_perfect_encoder_loses_all_or_nothing() {
        let filter = filter(0.0);
        assert_eq!(filter.lost_share(0.9999 * LIMIT_COUNTS_S), 0.0);
        assert_eq!(filter.lost_share(1.0001 * LIMIT_COUNTS_S), 1.0);
    }

    #[test]
    fn impossible_encoders_are_refused_with_the_number() {
        let encoder = Encoder { lines_per_rev: 200.0, gear_ratio: 50.0, state_width_error: 1.0 };
        let refused = StateFilter::new(&encoder, CLOCK_HZ);
        assert!(matches!(refused, Err(ServoError::OutOfRange { quantity: "state_width_error", value: 1.0, .. })));
    }

    #[test]
    fn back_and_forth_returns_the_same_count() {
        // Steps are multiples of 2^-10, so the sums are exact and any lost or extra edge is the counter's.
        for phase in [0.0, 0.25, 0.9990234375] {
            let mut counter = Counter::new(phase);
            let steps: Vec<f64> = (0..1000).map(|i| f64::from((i * 37) % 211 - 90) / 1024.0).collect();
            let out: i64 = steps.iter().map(|&step| counter.advance(step)).sum();
            let travel: f64 = steps.iter().sum();
            assert_eq!(out, (phase + travel).floor() as i64);
            let back: i64 = steps.iter().rev().map(|&step| counter.advance(-step)).sum();
            assert_eq!(out + back, 0);
            assert_eq!(counter, Counter::new(phase));
        }
    }

    #[test]
    fn truncation_toward_zero_would_fail_here() {
        let mut counter = Counter::new(0.5);
        assert_eq!(counter.advance(-0.75), -1);
        assert_eq!(counter.advance(0.75), 1);
        // A step too small to represent beside the edge neither counts twice nor leaves [0, 1).
        let mut counter = Counter::new(0.0);
        assert_eq!(counter.advance(-1e-20), 0);
        assert_eq!(counter.advance(0.0), 0);
    }
}

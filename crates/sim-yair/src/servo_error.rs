//! Why a servo cannot be built or commanded.

use scenario::ControlMode;
use thiserror::Error;

/// Farthest single move, counts: the position error is 24-bit too, less what the wheel may lag or overshoot.
pub(crate) const MOVE_MAX_COUNTS: i64 = (1 << 23) - (1 << 10);

/// Why a servo cannot be built or commanded.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum ServoError {
    /// A configured value is impossible.
    #[error("{quantity} = {value}: must be {expected}")]
    OutOfRange {
        /// The value's name in the scenario.
        quantity: &'static str,
        /// The offending value.
        value: f64,
        /// The range.
        expected: &'static str,
    },
    /// The sample timer leaves the chip's program no time to finish.
    #[error("sample_timer = {sample_timer}: {mode:?} mode needs at least {minimum}")]
    SampleTimer {
        /// Register R0F.
        sample_timer: u8,
        /// The mode's smallest.
        minimum: u8,
        /// The mode.
        mode: ControlMode,
    },
    /// The velocity register cannot hold the speed.
    #[error(
        "{speed_counts_s} counts/s is above the ceiling of {ceiling_counts_s} counts/s in {mode:?} mode: shorten the sample time \
         (sample_timer), use fewer encoder lines, or proportional_velocity mode"
    )]
    SpeedCeiling {
        /// The speed asked for.
        speed_counts_s: f64,
        /// The fastest that the register holds.
        ceiling_counts_s: f64,
        /// The mode.
        mode: ControlMode,
    },
    /// The velocity register would be zero: the profile would never end.
    #[error(
        "{speed_counts_s} counts/s is below the slowest speed, {slowest_counts_s} counts/s, in {mode:?} mode: lengthen the sample time \
         (sample_timer), use more encoder lines, or proportional_velocity mode"
    )]
    SpeedTooLow {
        /// The speed asked for.
        speed_counts_s: f64,
        /// One step of the register.
        slowest_counts_s: f64,
        /// The mode.
        mode: ControlMode,
    },
    /// The acceleration register cannot hold the acceleration.
    #[error(
        "{acceleration_counts_s2} counts/s² is outside {smallest_counts_s2}..={largest_counts_s2} counts/s² at this sample time"
    )]
    Acceleration {
        /// The acceleration asked for.
        acceleration_counts_s2: f64,
        /// One step of the register.
        smallest_counts_s2: f64,
        /// The largest that the register holds.
        largest_counts_s2: f64,
    },
    /// A move that the 24-bit position error cannot hold.
    #[error("a move of {counts} counts exceeds the {MOVE_MAX_COUNTS} that a 24-bit position error can hold: split it")]
    TooFar {
        /// The move asked for.
        counts: i64,
    },
    /// New profile data while a profile runs, which the datasheet forbids.
    #[error("a profile is running with {remaining_counts} counts to go: wait for it or hold first")]
    ProfileRunning {
        /// What the running one has left.
        remaining_counts: i64,
    },
}

impl ServoError {
    pub(crate) fn unless_positive(quantity: &'static str, value: f64) -> Result<(), Self> {
        if value > 0.0 && value.is_finite() {
            Ok(())
        } else {
            Err(Self::OutOfRange { quantity, value, expected: "positive" })
        }
    }

    pub(crate) fn unless_not_negative(quantity: &'static str, value: f64) -> Result<(), Self> {
        if value >= 0.0 && value.is_finite() {
            Ok(())
        } else {
            Err(Self::OutOfRange { quantity, value, expected: "0 or more" })
        }
    }
}

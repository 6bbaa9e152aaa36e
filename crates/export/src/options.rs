//! What a user may choose of a format.

use crate::error::ExportError;
use crate::settings::{DEFAULT_COUNTER_BITS, DEFAULT_RATE_HZ, DEFAULT_SPEED_M_S};

/// Which lengths a controller with multipliers gets. Never both: they would multiply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lengths {
    /// Nominal ones, with multipliers that make them the calibrated ones.
    #[default]
    Nominal,
    /// Calibrated ones; multipliers hold the difference of the wheels alone, since there is one radius.
    Calibrated,
}

/// Choices of a user; a format reads those that it knows.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The controller's node, for formats with one; `None` for the one that the format's robots have.
    pub controller: Option<String>,
    /// Which lengths.
    pub lengths: Lengths,
    /// Speed at which the covariance of the twist is stated, m/s.
    pub speed_m_s: f64,
    /// Rate of the twists, hertz.
    pub rate_hz: f64,
    /// Width of the counters, bits.
    pub counter_bits: Option<u8>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            controller: None,
            lengths: Lengths::default(),
            speed_m_s: DEFAULT_SPEED_M_S,
            rate_hz: DEFAULT_RATE_HZ,
            counter_bits: None,
        }
    }
}

impl Options {
    /// Refuses what no controller has.
    ///
    /// # Errors
    /// [`ExportError::BadOption`].
    pub fn check(&self) -> Result<(), ExportError> {
        for (option, value) in [("speed", self.speed_m_s), ("rate", self.rate_hz)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(ExportError::BadOption { option, value, expected: "a positive number" });
            }
        }
        let bits = self.counter_bits.unwrap_or(DEFAULT_COUNTER_BITS);
        let is_a_counter = (8..=64).contains(&bits);
        let value = f64::from(bits);
        let expected = "8 to 64 bits";
        is_a_counter.then_some(()).ok_or(ExportError::BadOption { option: "counter-bits", value, expected })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_controller_has_a_negative_rate_or_a_counter_of_seven_bits() {
        let of = |change: fn(&mut Options)| {
            let mut options = Options::default();
            change(&mut options);
            options.check()
        };
        assert_eq!(of(|_| ()), Ok(()));
        assert_eq!(of(|options| options.counter_bits = Some(64)), Ok(()));
        assert!(of(|options| options.counter_bits = Some(7)).is_err());
        assert!(of(|options| options.counter_bits = Some(65)).is_err());
        assert!(of(|options| options.rate_hz = -1.0).is_err());
        assert!(of(|options| options.speed_m_s = 0.0).is_err());
        assert!(of(|options| options.speed_m_s = f64::NAN).is_err());
    }
}

//! Simultaneous localization and mapping, or localization in a map (AMCL), as an instrument: its errors and
//! their ranges.

use serde::{Deserialize, Serialize};

/// Poses in a map: white noise, errors that return with the place, errors that wander in time, and jumps at
/// loop closures. A map lasts for a session.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slam {
    /// Poses per second.
    pub rate_hz: f64,
    /// Standard deviation of the white noise of each position coordinate, metres.
    pub sigma_xy_m: f64,
    /// Standard deviation of the white noise of the heading, radians.
    pub sigma_theta_rad: f64,
    /// Standard deviation of the map's distortion along each axis, metres: the same error at the same place.
    pub map_sigma_xy_m: f64,
    /// Standard deviation of the map's distortion in heading, radians.
    pub map_sigma_theta_rad: f64,
    /// Correlation length ℓ of the distortion, metres: the correlation over a distance d is e^{−d²/2ℓ²}.
    pub map_length_m: f64,
    /// Relative error of the map's lengths.
    pub map_scale_error: f64,
    /// Standard deviation of the errors that wander in time, along each axis, metres.
    pub wander_sigma_xy_m: f64,
    /// Standard deviation of the errors that wander in time, in heading, radians.
    pub wander_sigma_theta_rad: f64,
    /// Time over which these are forgotten by 1/e, seconds.
    pub wander_tau_s: f64,
    /// Mean number of jumps a second.
    pub jump_rate_hz: f64,
    /// Standard deviation of a jump along each axis, metres.
    pub jump_m: f64,
    /// Standard deviation of a jump in heading, radians.
    pub jump_rad: f64,
    /// Standard deviations that each row states, over those of the white and the wandering errors together; 0
    /// = rows state none. A filter that takes its measurements for independent states too little.
    pub stated_over_true: f64,
}

impl Slam {
    /// Standard deviations of position, metres, and heading, radians, without the map's distortion.
    #[must_use]
    pub fn sigma(&self) -> [f64; 2] {
        [self.sigma_xy_m.hypot(self.wander_sigma_xy_m), self.sigma_theta_rad.hypot(self.wander_sigma_theta_rad)]
    }

    /// Keys whose values must be 0 or more, and their values.
    pub(crate) const fn not_negative(&self) -> [(&'static str, f64); 10] {
        [
            ("instrument.sigma_xy_m", self.sigma_xy_m),
            ("instrument.sigma_theta_rad", self.sigma_theta_rad),
            ("instrument.map_sigma_xy_m", self.map_sigma_xy_m),
            ("instrument.map_sigma_theta_rad", self.map_sigma_theta_rad),
            ("instrument.wander_sigma_xy_m", self.wander_sigma_xy_m),
            ("instrument.wander_sigma_theta_rad", self.wander_sigma_theta_rad),
            ("instrument.jump_rate_hz", self.jump_rate_hz),
            ("instrument.jump_m", self.jump_m),
            ("instrument.jump_rad", self.jump_rad),
            ("instrument.stated_over_true", self.stated_over_true),
        ]
    }
}

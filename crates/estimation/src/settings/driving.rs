//! How a robot was driven.

rules::settings! {
    Driving
    /// Quantile, over the time in motion, of the faster wheel's speed that is called cruising.
    /// Convention: the upper quartile; starts and stops are slower.
    cruise_quantile: f64 = 0.75,
    /// Shares of the cruising speed between which a rise from rest is timed.
    /// Convention: the rise time of control engineering, from 10 to 90 %.
    rise_speed_ratios: [f64; 2] = [0.1, 0.9],
    /// Quantile of the rise times that says how fast a robot can speed up.
    /// Convention: the lower quartile; a driver may be slow on purpose.
    rise_quantile: f64 = 0.25,
}

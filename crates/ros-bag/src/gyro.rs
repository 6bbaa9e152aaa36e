//! Yaw rates of a gyroscope (`sensor_msgs/Imu`) on the rows of the wheels.
//!
//! A message holds the rate of its instant, a row of the dataset the mean over the interval that ends there.
//! Between two messages the rate is taken as linear: the mean is the integral of that over the interval's
//! length. Where messages are missing it is not known, and the row stays empty (NaN).
//!
//! Reference: REP 145 (conventions of IMU drivers): rates in rad/s about the axes of the header's frame;
//! −1 in the covariance's first element says that nothing was measured; at rest the acceleration is +g along
//! the axis that points up.

use dataset::interval_means;

use crate::clock::seconds;
use crate::value::Value;

/// The type.
pub(crate) const IMU: &str = "sensor_msgs/msg/Imu";

/// The mean acceleration holds gravity if it is at least that, m/s²: half of 9.81.
const MIN_GRAVITY_M_S2: f64 = 4.9;
/// Least cosine between the z axis and the direction in which gravity is measured: 18°. Further off, a
/// rate about z is 5 % short of the yaw rate (1 − cos 18°), more than what calibration looks for.
const MIN_UPRIGHT: f64 = 0.95;

/// What one message says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GyroReading {
    pub(crate) yaw_rate_rad_s: f64,
    /// Acceleration, m/s²; none where the message says that it has none.
    acceleration_m_s2: Option<[f64; 3]>,
}

/// Reads a message; an error says that it holds no rate.
pub(crate) fn read(message: &Value) -> Result<GyroReading, String> {
    let number = |path: &str| message.number(path).ok_or_else(|| format!("no number at {path:?}"));
    let has = |quantity: &str| message.number(&format!("{quantity}_covariance[0]")) != Some(-1.0);
    if !has("angular_velocity") {
        return Err("its angular_velocity_covariance[0] is −1, which says that it measures no rate".to_owned());
    }
    let yaw_rate_rad_s = number("angular_velocity.z")?;
    let acceleration = || Some(["x", "y", "z"].map(|axis| message.number(&format!("linear_acceleration.{axis}"))));
    let acceleration_m_s2 =
        acceleration().filter(|_| has("linear_acceleration")).and_then(|[x, y, z]| Some([x?, y?, z?]));
    Ok(GyroReading { yaw_rate_rad_s, acceleration_m_s2 })
}

/// What is doubtful of the axis, for the user: gravity that is not measured along z.
pub(crate) fn doubt_of_axis(readings: &[GyroReading]) -> Option<String> {
    let known: Vec<[f64; 3]> = readings.iter().filter_map(|reading| reading.acceleration_m_s2).collect();
    let mean = |axis: usize| known.iter().map(|of| of[axis]).sum::<f64>() / known.len() as f64;
    let [x, y, z] = [0, 1, 2].map(mean);
    let norm = (x * x + y * y + z * z).sqrt();
    (norm >= MIN_GRAVITY_M_S2 && z < MIN_UPRIGHT * norm).then(|| {
        format!(
            "gravity is measured along ({x:.1}, {y:.1}, {z:.1}) m/s², not along z, which is taken as up; its rates about z are not the robot's yaw rates"
        )
    })
}

/// Mean rates over the intervals that end at `rows_ns`, as [`interval_means`] has them. `messages` are
/// instants and rates in the order of time.
pub(crate) fn means(messages: &[(i64, f64)], rows_ns: &[i64]) -> Vec<f64> {
    interval_means(messages, rows_ns, seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_that_is_linear_has_its_exact_means_and_holes_stay_empty() {
        // 2 + 3 t rad/s every 10 ms for 0.2 s, without the message at 70 ms (bridged) and those of 120 to
        // 150 ms (a hole).
        let at = |step: i64| (step * 10_000_000, 2.0 + 0.03 * step as f64);
        let messages: Vec<(i64, f64)> =
            (0..=20).filter(|step| *step != 7 && !(12..=15).contains(step)).map(at).collect();
        let rows_ns = [-5, 15, 45, 75, 105, 125, 165, 195, 205].map(|t_ms| t_ms * 1_000_000);
        let found = means(&messages, &rows_ns);
        let nan = f64::NAN;
        // The mean of a linear rate is that of the middle: 2 + 3 · 30 ms, 60 ms, 90 ms, 180 ms.
        let expected = [nan, nan, 2.09, 2.18, 2.27, nan, nan, 2.54, nan];
        for (row, (found, expected)) in found.iter().zip(expected).enumerate() {
            // Sums of some 20 terms of 0.02 rad, divided by 30 ms.
            let is_same = found.is_nan() && expected.is_nan() || (found - expected).abs() < 1e-12;
            assert!(is_same, "{row}: {found} {expected}");
        }
        assert!(means(&messages[..1], &rows_ns).iter().all(|mean| mean.is_nan()));
        assert!(means(&[], &[]).is_empty());
    }

    #[test]
    fn gravity_along_another_axis_is_said() {
        let reading = |acceleration_m_s2| GyroReading { yaw_rate_rad_s: 0.0, acceleration_m_s2 };
        assert_eq!(doubt_of_axis(&[reading(Some([0.3, 0.0, 9.8])), reading(None)]), None);
        // Gravity was taken out, or never measured.
        assert_eq!(doubt_of_axis(&[reading(Some([0.3, 0.0, 0.1]))]), None);
        assert_eq!(doubt_of_axis(&[reading(None)]), None);
        for axis in [[0.0, 0.0, -9.8], [9.8, 0.0, 0.1], [0.0, 4.0, 9.0]] {
            assert!(doubt_of_axis(&[reading(Some(axis))]).is_some_and(|why| why.contains("not along z")), "{axis:?}");
        }
    }
}

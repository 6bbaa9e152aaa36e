//! The beams of a `sensor_msgs/LaserScan`.
//!
//! Reference: the definition in sensor_msgs: the header's stamp is when the first ray was measured, beam k
//! stands at angle_min + k · angle_increment and is measured k · time_increment later; ranges outside
//! [range_min, range_max] are to be discarded.

use crate::value::Value;

/// The type.
pub(crate) const LASER_SCAN: &str = "sensor_msgs/msg/LaserScan";

/// Longest time that a scan takes, seconds: beyond it the time increment is of another unit.
const MAX_SCAN_S: f64 = 10.0;

/// A measured range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beam {
    /// In the scan's frame, radians, counter-clockwise about its z.
    pub(crate) angle_rad: f64,
    pub(crate) range_m: f64,
    /// Since the stamp, seconds.
    pub(crate) after_s: f64,
}

/// What one message says; ranges that measure nothing are left out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scan {
    pub(crate) frame: String,
    pub(crate) beams: Vec<Beam>,
    /// From the first ray to the last, seconds; 0 where the driver does not say.
    pub(crate) duration_s: f64,
}

/// Reads a message; an error says what in it cannot be.
pub(crate) fn read(message: &Value) -> Result<Scan, String> {
    let number = |path: &str| match message.number(path) {
        Some(value) if value.is_finite() => Ok(value),
        Some(value) => Err(format!("{path} is {value}")),
        None => Err(format!("no number at {path:?}")),
    };
    let (start_rad, step_rad) = (number("angle_min")?, number("angle_increment")?);
    let step_s = number("time_increment")?;
    // A driver that knows no limit writes infinity.
    let limit = |path: &str| message.number(path).filter(|limit| !limit.is_nan());
    let (Some(least_m), Some(most_m)) = (limit("range_min"), limit("range_max")) else {
        return Err("no number at \"range_min\" or \"range_max\"".to_owned());
    };
    let ranges = message.list("ranges");
    let duration_s = step_s * ranges.len().saturating_sub(1) as f64;
    if step_rad == 0.0 {
        return Err("its angle_increment is 0".to_owned());
    }
    if !(0.0..=MAX_SCAN_S).contains(&duration_s) {
        return Err(format!("its time_increment of {step_s} s makes a scan of {duration_s} s"));
    }
    let beams = ranges.iter().enumerate().filter_map(|(number, range)| {
        let range_m = range.number("")?;
        let is_measured = range_m.is_finite() && range_m > 0.0 && (least_m..=most_m).contains(&range_m);
        let angle_rad = start_rad + step_rad * number as f64;
        is_measured.then_some(Beam { angle_rad, range_m, after_s: step_s * number as f64 })
    });
    let beams = beams.collect();
    Ok(Scan { frame: message.text("header.frame_id").unwrap_or_default().to_owned(), beams, duration_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(numbers: [f64; 6], ranges: &[f64]) -> Value {
        let names = ["angle_min", "angle_increment", "time_increment", "scan_time", "range_min", "range_max"];
        let mut fields: Vec<(String, Value)> =
            names.iter().zip(numbers).map(|(name, value)| ((*name).to_owned(), Value::Float(value))).collect();
        fields.push(("ranges".to_owned(), Value::List(ranges.iter().map(|range| Value::Float(*range)).collect())));
        Value::Message(fields)
    }

    #[test]
    fn ranges_that_measure_nothing_are_left_out_and_beams_keep_their_angles_and_times() {
        let ranges = [f64::NAN, 0.05, 1.0, f64::INFINITY, 30.0, 2.0, -1.0, 0.0];
        let found = read(&scan([-1.0, 0.5, 0.01, 0.1, 0.1, 12.0], &ranges)).expect("a scan");
        let expected = [
            Beam { angle_rad: 0.0, range_m: 1.0, after_s: 0.02 },
            Beam { angle_rad: 1.5, range_m: 2.0, after_s: 0.05 },
        ];
        assert_eq!(found.beams, expected);
        assert_eq!(found.duration_s, 0.07);
    }

    #[test]
    fn scans_that_cannot_be_are_refused_with_the_field() {
        let refused = |numbers: [f64; 6]| read(&scan(numbers, &[1.0, 2.0])).expect_err("no scan");
        assert!(refused([f64::NAN, 0.5, 0.0, 0.1, 0.1, 12.0]).contains("angle_min is NaN"));
        assert!(refused([0.0, 0.0, 0.0, 0.1, 0.1, 12.0]).contains("angle_increment is 0"));
        assert!(refused([0.0, 0.1, 25.0, 0.1, 0.1, 12.0]).contains("time_increment of 25 s"));
        assert!(refused([0.0, 0.1, -0.1, 0.1, 0.1, 12.0]).contains("time_increment of -0.1 s"));
        assert!(refused([0.0, 0.1, 0.0, 0.1, f64::NAN, 12.0]).contains("range_min"));
        assert!(read(&Value::Message(Vec::new())).is_err());
    }
}

//! Headings of the instrument before the first fit: on the robot, and at the starts of segments.

use kinematics::{Increment, Pose, unwrap_near};

use crate::model::Model;
use crate::records::Records;
use crate::segment::{Segment, Start};
use crate::settings::{COMMON, START_HEADINGS};

impl Records<'_> {
    /// Approximate heading of the sensor on the robot, radians: from the directions of the measured and the
    /// dead-reckoned motions between measurements, weighted by length. A spin has no direction; arcs to both
    /// sides cancel.
    pub(crate) fn sensor_heading_rad(&self, model: &Model) -> f64 {
        let (mut dot, mut cross) = (0.0, 0.0);
        for segment in &self.segments {
            let mut before = match segment.start {
                Start::MeasuredPose => None,
                Start::Origin => Some((Pose::IDENTITY, 0)),
            };
            for measurement in &segment.measurements {
                let Some(theta_rad) = measurement.theta_rad else { return 0.0 };
                let pose = Pose::new(measurement.x_m, measurement.y_m, theta_rad);
                if let Some((measured, after)) = before {
                    let (mut moved, mut distance_m) = (Pose::IDENTITY, 0.0);
                    for interval in &segment.intervals[after..measurement.after] {
                        let travel_m = model.m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
                        let increment = Increment::from_travel(travel_m, model.separation_m);
                        distance_m += increment.distance_m.abs();
                        moved = moved * increment.arc();
                    }
                    // The end of a loop has no direction but that of its errors.
                    if moved.x_m.hypot(moved.y_m) > COMMON.min_chord_ratio * distance_m {
                        let measured = measured.to(pose);
                        dot += moved.x_m * measured.x_m + moved.y_m * measured.y_m;
                        cross += measured.x_m * moved.y_m - measured.y_m * moved.x_m;
                    }
                }
                before = Some((pose, measurement.after));
            }
        }
        if dot == 0.0 && cross == 0.0 { 0.0 } else { cross.atan2(dot) }
    }
    /// Approximate headings of the instrument at the starts of the segments, radians.
    pub(crate) fn start_headings_rad(&self, model: &Model) -> Vec<f64> {
        self.segments.iter().map(|segment| start_heading(segment, model, 0)).collect()
    }
}

/// Approximate heading of the instrument at one of the measurements of a segment without measured headings,
/// radians: the rotation of its dead-reckoned path from there onto the measured one. 0 for other segments.
pub(crate) fn start_heading(segment: &Segment<'_>, model: &Model, from: usize) -> f64 {
    let Some(first) = segment.measurements.get(from).filter(|_| segment.has_free_heading()) else {
        return 0.0;
    };
    let (mut pose, mut at) = (Pose::IDENTITY, first.after);
    let body_from_sensor = model.instrument(segment.run).body_from_sensor;
    let sensor_from_body = body_from_sensor.inverse();
    let (mut dot, mut cross, mut longest_m) = (0.0, 0.0, 0.0_f64);
    for measurement in &segment.measurements[from + 1..] {
        for interval in &segment.intervals[at..measurement.after] {
            pose = pose * model.increment(interval.wheel_rad).arc();
        }
        at = measurement.after;
        let (x_m, y_m) = (measurement.x_m - first.x_m, measurement.y_m - first.y_m);
        let moved = sensor_from_body * pose * body_from_sensor;
        dot += moved.x_m * x_m + moved.y_m * y_m;
        cross += moved.x_m * y_m - moved.y_m * x_m;
        longest_m = longest_m.max(x_m.hypot(y_m));
        // Dead reckoning is best near the start.
        if longest_m > START_HEADINGS.start_heading_baseline_m {
            break;
        }
    }
    if dot == 0.0 && cross == 0.0 { 0.0 } else { unwrap_near(cross.atan2(dot), 0.0) }
}

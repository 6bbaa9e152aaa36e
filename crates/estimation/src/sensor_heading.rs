//! The heading of the instrument on the robot, before the first fit.

use kinematics::{Increment, Pose};

use crate::model::Model;
use crate::records::Records;
use crate::segment::Start;
use crate::settings::MIN_CHORD_RATIO;

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
                    if moved.x_m.hypot(moved.y_m) > MIN_CHORD_RATIO * distance_m {
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
}

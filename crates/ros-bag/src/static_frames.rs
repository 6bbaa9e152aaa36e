//! Where a sensor stands on the robot by the transforms of `/tf_static`.

use std::collections::BTreeMap;

use kinematics::Pose;

use crate::settings::MAX_CHAIN;
use crate::transform::{self, Rigid};
use crate::value::Value;

/// Frames of the robot, in the middle of whose wheels they are taken to be (REP 105).
const BASE_FRAMES: [&str; 2] = ["base_link", "base_footprint"];

/// Cosine of the largest angle between a lidar's axis and the vertical: 10°, at which a range in the plane is
/// 1.5 % short.
const MIN_UPRIGHT: f64 = 0.985;

/// A lidar on the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mounted {
    pub(crate) body_from_lidar: Pose,
    /// Its z points down: its angles count clockwise as the robot sees them.
    pub(crate) is_upside_down: bool,
}

/// Static transforms by their child.
#[derive(Debug, Clone, Default)]
pub(crate) struct StaticFrames {
    of: BTreeMap<String, (String, Rigid)>,
}

/// Is it a topic of static transforms?
pub(crate) fn is_static(topic: &str) -> bool {
    topic.rsplit('/').next() == Some("tf_static")
}

/// Is it a frame of the robot's base, under whatever name space?
pub(crate) fn is_base(frame: &str) -> bool {
    frame.rsplit('/').next().is_some_and(|name| BASE_FRAMES.contains(&name))
}

impl StaticFrames {
    /// All of them: parent, child, and the motion from the one to the other.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&str, &str, &Rigid)> {
        self.of.iter().map(|(child, (parent, rigid))| (&parent[..], &child[..], rigid))
    }

    /// Takes the transforms of a message; of a child the last counts.
    pub(crate) fn take(&mut self, message: &Value) {
        for stamped in message.list("transforms") {
            if let Some(((parent, child), rigid)) = transform::frames(stamped).zip(Rigid::of(stamped)) {
                self.of.insert(child.to_owned(), (parent.to_owned(), rigid));
            }
        }
    }

    /// Where a frame stands on the robot; `None` where no chain leads there.
    ///
    /// # Errors
    /// Why a lidar there does not see the plane.
    pub(crate) fn mounted(&self, frame: &str) -> Result<Option<Mounted>, String> {
        let (mut at, mut body_from_frame) = (frame.trim_start_matches('/'), Rigid::IDENTITY);
        for _ in 0..MAX_CHAIN {
            if BASE_FRAMES.contains(&at) {
                return plane(&body_from_frame).map(Some);
            }
            let Some((parent, rigid)) = self.of.get(at) else { break };
            body_from_frame = rigid.after(&body_from_frame);
            at = parent;
        }
        Ok(None)
    }
}

fn plane(body_from_lidar: &Rigid) -> Result<Mounted, String> {
    let up = body_from_lidar.upright();
    if up.abs() < MIN_UPRIGHT {
        let tilt_deg = up.clamp(-1.0, 1.0).acos().to_degrees();
        return Err(format!(
            "its axis is tilted by {tilt_deg:.0}°: it does not see the plane that the robot drives in"
        ));
    }
    Ok(Mounted { body_from_lidar: body_from_lidar.pose(), is_upside_down: up < 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(parent: &str, child: &str, [x, y, z]: [f64; 3], [qx, qy, qz, qw]: [f64; 4]) -> Value {
        let floats = |values: &[(&str, f64)]| {
            Value::Message(values.iter().map(|(name, value)| ((*name).to_owned(), Value::Float(*value))).collect())
        };
        let of = |fields: Vec<(&str, Value)>| {
            Value::Message(fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
        };
        let transform = of(vec![
            ("translation", floats(&[("x", x), ("y", y), ("z", z)])),
            ("rotation", floats(&[("x", qx), ("y", qy), ("z", qz), ("w", qw)])),
        ]);
        let header = of(vec![("frame_id", Value::Text(parent.to_owned()))]);
        let stamped =
            of(vec![("header", header), ("child_frame_id", Value::Text(child.to_owned())), ("transform", transform)]);
        of(vec![("transforms", Value::List(vec![stamped]))])
    }

    #[test]
    fn a_chain_of_frames_leads_to_the_base_and_a_tilted_lidar_is_refused() {
        let mut frames = StaticFrames::default();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        // A plate that is turned by 90° and stands 0.1 m ahead, a lidar 0.2 m ahead of it, upside down.
        frames.take(&message("/base_link", "plate", [0.1, 0.0, 0.3], [0.0, 0.0, half, half]));
        frames.take(&message("plate", "laser", [0.2, 0.0, 0.1], [1.0, 0.0, 0.0, 0.0]));
        frames.take(&message("base_link", "ramp", [0.0; 3], [0.3, 0.0, 0.0, 0.954]));
        let found = frames.mounted("laser").expect("in the plane").expect("a chain");
        let Pose { x_m, y_m, theta_rad } = found.body_from_lidar;
        // Rounding of a dozen products.
        let off = (x_m - 0.1).abs() + (y_m - 0.2).abs() + (theta_rad - std::f64::consts::FRAC_PI_2).abs();
        assert!(off < 1e-12 && found.is_upside_down, "{found:?}");
        assert_eq!(frames.mounted("elsewhere"), Ok(None));
        assert!(frames.mounted("ramp").expect_err("tilted").contains("tilted by 35°"));
        assert_eq!(frames.mounted("base_footprint").map(|of| of.map(|of| of.is_upside_down)), Ok(Some(false)));
        // A ring of frames ends.
        frames.take(&message("b", "a", [0.0; 3], [0.0, 0.0, 0.0, 1.0]));
        frames.take(&message("a", "b", [0.0; 3], [0.0, 0.0, 0.0, 1.0]));
        assert_eq!(frames.mounted("a"), Ok(None));
        assert!(is_static("/robot/tf_static") && !is_static("/tf"));
    }
}

//! Which joints of a URDF are the wheels, and where they stand on the robot.

use std::collections::BTreeMap;

use kinematics::Wheels;

use crate::error::RobotFileError;
use crate::robot::Robot;
use crate::urdf::{Joint, Origin, RoundShape, Urdf};

/// Share of an axis that lies along y, or x: a wheel's axle is level, cambered by some degrees at most.
const MIN_LEVEL: f64 = 0.9;
/// Metres. Wheels of an axle stand this near to one line.
const ABREAST_M: f64 = 1e-3;
/// Metres. Lengths that differ by less are one, as a URDF is written.
const SAME_M: f64 = 1e-6;
/// Names of joints that turn and drive nothing.
const NO_WHEELS: [&str; 4] = ["castor", "caster", "steer", "swivel"];

/// Rows of a rotation matrix.
type Rotation = [[f64; 3]; 3];

const IDENTITY: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A frame in the robot's root.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    pub(crate) rotation: Rotation,
    position: [f64; 3],
}

/// A wheel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wheel {
    /// Its joint, by number.
    pub(crate) joint: usize,
    /// The frame that the joint's origin is written in.
    pub(crate) around: Frame,
    /// Its middle, in the robot's root.
    pub(crate) middle_m: [f64; 3],
    pub(crate) radius_m: Option<f64>,
}

/// Wheels abreast, left and right.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axle {
    pub(crate) wheels: Wheels<Wheel>,
    /// The direction of the axle: 0 for x, 1 for y.
    pub(crate) sideways: usize,
}

impl Axle {
    pub(crate) fn separation_m(&self) -> f64 {
        (self.wheels.left.middle_m[self.sideways] - self.wheels.right.middle_m[self.sideways]).abs()
    }
}

fn turned(rotation: &Rotation, vector: [f64; 3]) -> [f64; 3] {
    rotation.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}

impl Frame {
    const ROOT: Self = Self { rotation: IDENTITY, position: [0.0; 3] };

    /// A frame in this one.
    fn inside(&self, origin: &Origin) -> Self {
        let [roll, pitch, yaw] = origin.rpy;
        let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
        let inner = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        let column = |index: usize| turned(&self.rotation, inner.map(|row| row[index]));
        let columns = [0, 1, 2].map(column);
        let moved = turned(&self.rotation, origin.xyz.value);
        Self {
            rotation: [0, 1, 2].map(|row| columns.map(|column| column[row])),
            position: [0, 1, 2].map(|index| self.position[index] + moved[index]),
        }
    }
}

/// The frame of a link.
fn frame(urdf: &Urdf, by_child: &BTreeMap<&str, &Joint>, link: &str) -> Frame {
    let mut chain = Vec::new();
    let mut at = link;
    // A ring of joints ends.
    while let Some(joint) = by_child.get(at).filter(|_| chain.len() <= urdf.joints.len()) {
        chain.push(*joint);
        at = &joint.parent;
    }
    chain.iter().rev().fold(Frame::ROOT, |frame, joint| frame.inside(&joint.origin))
}

/// The axles of the driven wheels, that of the joints which a plugin names first.
pub(crate) fn axles(urdf: &Urdf) -> Result<Vec<Axle>, RobotFileError> {
    let by_child: BTreeMap<&str, &Joint> = urdf.joints.iter().map(|joint| (&joint.child[..], joint)).collect();
    let mut wheels = Vec::new();
    for (number, joint) in urdf.joints.iter().enumerate().filter(|(_, joint)| joint.kind == "continuous") {
        let name = format!("{} {}", joint.name, joint.child).to_lowercase();
        let shape: Option<&RoundShape> = urdf.shapes.get(&joint.child).and_then(|shapes| shapes.first());
        if NO_WHEELS.iter().any(|part| name.contains(part)) || !(name.contains("wheel") || shape.is_some()) {
            continue;
        }
        let around = frame(urdf, &by_child, &joint.parent);
        let own = around.inside(&joint.origin);
        let axis = turned(&own.rotation, joint.axis);
        let length = axis.iter().map(|part| part * part).sum::<f64>().sqrt();
        let Some(sideways) = [1, 0].into_iter().find(|index| axis[*index].abs() > MIN_LEVEL * length) else { continue };
        let middle_m = shape.map_or(own.position, |shape| own.inside(&shape.origin).position);
        wheels.push((sideways, Wheel { joint: number, around, middle_m, radius_m: shape.map(|shape| shape.radius_m) }));
    }
    let mut found = Vec::new();
    for (sideways, left) in &wheels {
        let side = |wheel: &Wheel, name: &str| urdf.joints[wheel.joint].name.to_lowercase().contains(name);
        let pairs = |(of, right): &&(usize, Wheel)| {
            let along = 1 - sideways;
            let is_abreast = (left.middle_m[along] - right.middle_m[along]).abs() < ABREAST_M;
            // y points to the left; a robot that is drawn along y is known by its joints' names.
            let is_left = match sideways {
                1 => left.middle_m[1] > right.middle_m[1] + ABREAST_M,
                _ => side(left, "left") && side(right, "right"),
            };
            of == sideways && is_abreast && is_left
        };
        if let Some((_, right)) = wheels.iter().find(pairs) {
            found.push(Axle { wheels: Wheels { left: left.clone(), right: right.clone() }, sideways: *sideways });
        }
    }
    if found.is_empty() {
        let turn = |joint: &&Joint| joint.kind == "continuous";
        let names: Vec<&str> = urdf.joints.iter().filter(turn).map(|joint| &joint.name[..]).collect();
        let found = if names.is_empty() {
            "none is continuous".to_owned()
        } else {
            format!("continuous are {}", names.join(", "))
        };
        return Err(RobotFileError::NoWheelJoints { found });
    }
    let named = urdf.plugin(&["left_joint"]).map(|left| left.text.clone());
    found.sort_by_key(|axle| Some(&urdf.joints[axle.wheels.left.joint].name) != named.as_ref());
    Ok(found)
}

/// What a URDF says of the robot.
pub(crate) fn robot(urdf: &Urdf) -> Result<Robot, RobotFileError> {
    let all = axles(urdf)?;
    let first = &all[0];
    let name = |wheel: &Wheel| urdf.joints[wheel.joint].name.clone();
    let mut robot = Robot { part: "URDF".to_owned(), ..Robot::default() };
    let joints = Wheels { left: name(&first.wheels.left), right: name(&first.wheels.right) };
    let radii_m = (first.wheels.left.radius_m, first.wheels.right.radius_m);
    let by_shape = radii_m.0.zip(radii_m.1).map(|(left, right)| Wheels { left: 2.0 * left, right: 2.0 * right });
    let plugin = |names: [&str; 2]| urdf.plugin(&names).and_then(crate::entries::Scalar::number);
    let by_plugin = plugin(["wheel_diameter", "wheelDiameter"])
        .or(plugin(["wheel_radius", "wheelRadius"]).map(|radius_m| 2.0 * radius_m));
    if by_shape.is_none() && by_plugin.is_none() {
        robot.remarks.push(format!(
            "the links of {} and {} have neither a cylinder nor a ball, so their radius is not in it",
            joints.left, joints.right
        ));
    }
    let differs = |left: f64, right: f64| (left - right).abs() > SAME_M;
    if let (Some(shape), Some(plugin)) = (by_shape, by_plugin)
        && (differs(shape.left, plugin) || differs(shape.right, plugin))
    {
        robot.remarks.push(format!(
            "its wheels have {:.3} mm by their shape and {:.3} mm by a plugin; the shape is taken",
            1e3 * shape.left,
            1e3 * plugin
        ));
    }
    let separation_m = first.separation_m();
    if let Some(plugin) =
        plugin(["wheel_separation", "wheelSeparation"]).filter(|plugin| differs(*plugin, separation_m))
    {
        robot.remarks.push(format!(
            "its wheels are {:.3} mm apart by their joints and {:.3} mm by a plugin; the joints are taken",
            1e3 * separation_m,
            1e3 * plugin
        ));
    }
    if all.iter().any(|axle| differs(axle.separation_m(), separation_m)) {
        robot.remarks.push(format!("its axles differ; that of {} and {} is taken", joints.left, joints.right));
    }
    robot.wheel_diameter_m = by_shape.or(by_plugin.map(Wheels::both));
    robot.wheel_separation_m = Some(separation_m);
    robot.joints = Some(joints);
    Ok(robot)
}

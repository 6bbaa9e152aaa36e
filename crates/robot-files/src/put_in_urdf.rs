//! Calibrated radii and the separation in a URDF: the shapes of the wheels' links, the origins of their
//! joints, and what plugins of simulators say.

use kinematics::Wheels;

use crate::edit::{Edit, Edited, apply};
use crate::entries::Scalar;
use crate::error::RobotFileError;
use crate::put::{refuse_other, twice};
use crate::robot::Robot;
use crate::urdf::Urdf;
use crate::wheel_joints::{Axle, Wheel, axles};

/// Decimals of lengths, metres: a nanometre.
const DECIMALS: usize = 9;
/// Share of an axis of a joint's frame that lies along the axle: it is parallel but for rounding.
const PARALLEL: f64 = 1.0 - 1e-9;
/// Metres. Shapes of a link whose radii differ by less are the wheel, and others are something else.
const SAME_M: f64 = 1e-6;

fn written(value_m: f64) -> String {
    let text = format!("{value_m:.DECIMALS$}");
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

/// A URDF with calibrated wheels.
///
/// # Errors
/// [`RobotFileError`] where it has no wheels, or a length stands nowhere in it.
pub fn put_in_urdf(text: &str, wheel_diameter_m: Wheels<f64>, separation_m: f64) -> Result<Edited, RobotFileError> {
    let urdf = Urdf::parse(text)?;
    let before = crate::wheel_joints::robot(&urdf)?;
    let (all, mut edits, mut remarks) = (axles(&urdf)?, Vec::new(), Vec::new());
    for axle in &all {
        let wheels = [(&axle.wheels.left, wheel_diameter_m.left), (&axle.wheels.right, wheel_diameter_m.right)];
        for (wheel, diameter_m) in wheels {
            radii(&urdf, wheel, 0.5 * diameter_m, &mut edits);
        }
        let wider_m = separation_m - axle.separation_m();
        let is_left_up = axle.wheels.left.middle_m[axle.sideways] > axle.wheels.right.middle_m[axle.sideways];
        let outwards_m = if is_left_up { 0.5 * wider_m } else { -0.5 * wider_m };
        edits.push(moved(&urdf, axle, &axle.wheels.left, outwards_m)?);
        edits.push(moved(&urdf, axle, &axle.wheels.right, -outwards_m)?);
    }
    let mean_m = (wheel_diameter_m.left * wheel_diameter_m.right).sqrt();
    for (name, value) in &urdf.plugins {
        let length_m = match &name.to_lowercase().replace('_', "")[..] {
            "wheelseparation" => separation_m,
            "wheelradius" => 0.5 * mean_m,
            "wheeldiameter" => mean_m,
            _ => continue,
        };
        let (Some(span), Some(_)) = (value.span.clone(), Scalar::number(value)) else {
            return Err(RobotFileError::NotANumber { key: name.clone(), value: value.text.clone() });
        };
        edits.push(Edit { span, text: written(length_m) });
    }
    // Wheels of several axles may share a joint or a link.
    edits.sort_by_key(|edit| edit.span.start);
    edits.dedup_by_key(|edit| edit.span.start);
    edits.retain(|edit| !is_same(&text[edit.span.clone()], &edit.text));
    let edited = apply(text, &edits);
    let found = crate::wheel_joints::robot(&Urdf::parse(&edited)?)?;
    let mut expected = Robot { wheel_separation_m: Some(separation_m), ..Robot::default() };
    if all[0].wheels.left.radius_m.is_some() && all[0].wheels.right.radius_m.is_some() {
        expected.wheel_diameter_m = Some(wheel_diameter_m);
    } else {
        remarks.push("the wheels' links have no cylinder or ball, so no radius was put in".to_owned());
    }
    refuse_other(&found, &expected)?;
    remarks.extend(twice(&before, &expected));
    Ok(Edited { text: edited, remarks })
}

fn is_same(old: &str, new: &str) -> bool {
    old.parse::<f64>().ok().zip(new.parse::<f64>().ok()).is_some_and(|(old, new)| (old - new).abs() < 1e-12)
}

/// The radius in every shape of the wheel's link that has the wheel's own.
fn radii(urdf: &Urdf, wheel: &Wheel, radius_m: f64, edits: &mut Vec<Edit>) {
    let Some(own_m) = wheel.radius_m else { return };
    let shapes = urdf.shapes.get(&urdf.joints[wheel.joint].child).map_or(&[][..], Vec::as_slice);
    let of_wheel = shapes.iter().filter(|shape| (shape.radius_m - own_m).abs() < SAME_M);
    edits.extend(of_wheel.filter_map(|shape| Some(Edit { span: shape.span.clone()?, text: written(radius_m) })));
}

/// The origin of a wheel's joint, moved along the axle.
fn moved(urdf: &Urdf, axle: &Axle, wheel: &Wheel, by_m: f64) -> Result<Edit, RobotFileError> {
    let joint = &urdf.joints[wheel.joint];
    let row = wheel.around.rotation[axle.sideways];
    let no_place = |why: &str| RobotFileError::NoPlace {
        key: format!("the separation at joint {}", joint.name),
        why: why.to_owned(),
    };
    let along = (0..3).find(|index| row[*index].abs() > PARALLEL);
    let along = along.ok_or_else(|| no_place("its origin is written in a frame that is turned; edit it by hand"))?;
    let span = joint.origin.xyz.spans[along].clone();
    let span = span.ok_or_else(|| no_place("it has no <origin xyz=\"…\">; write one"))?;
    Ok(Edit { span, text: written(joint.origin.xyz.value[along] + by_m * row[along].signum()) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::diff;

    /// A robot after the TurtleBot3: joints whose axis is z of a turned frame.
    const URDF: &str = "<?xml version=\"1.0\" ?>\n<robot name=\"r\">\n  <!-- by hand -->\n  <joint name=\"base_joint\" type=\"fixed\">\n    \
        <parent link=\"base_footprint\"/><child link=\"base_link\"/><origin xyz=\"0 0 0.010\" rpy=\"0 0 0\"/>\n  </joint>\n  \
        <joint name=\"wheel_left_joint\" type=\"continuous\">\n    <parent link=\"base_link\"/><child link=\"wheel_left_link\"/>\n    \
        <origin xyz=\"0.0 0.08 0.023\" rpy=\"-1.57 0 0\"/>\n    <axis xyz=\"0 0 1\"/>\n  </joint>\n  \
        <joint name=\"wheel_right_joint\" type=\"continuous\">\n    <parent link=\"base_link\"/><child link=\"wheel_right_link\"/>\n    \
        <origin xyz=\"0.0 -0.080 0.023\" rpy=\"-1.57 0 0\"/>\n    <axis xyz=\"0 0 1\"/>\n  </joint>\n  \
        <joint name=\"caster_wheel_joint\" type=\"continuous\">\n    <parent link=\"base_link\"/><child link=\"caster\"/>\n    \
        <axis xyz=\"0 1 0\"/>\n  </joint>\n  \
        <link name=\"wheel_left_link\">\n    <visual><geometry><mesh filename=\"l.stl\"/></geometry></visual>\n    \
        <collision><geometry><cylinder length=\"0.018\" radius=\"0.033\"/></geometry></collision>\n  </link>\n  \
        <link name=\"wheel_right_link\">\n    <visual><geometry><cylinder length=\"0.018\" radius=\"0.033\"/></geometry></visual>\n    \
        <collision><geometry><cylinder length=\"0.018\" radius=\"0.033\"/></geometry></collision>\n  </link>\n  \
        <gazebo><plugin><wheel_separation>0.160</wheel_separation><wheel_diameter>0.066</wheel_diameter></plugin></gazebo>\n</robot>\n";

    #[test]
    fn wheels_of_a_urdf_are_read_and_put_in() {
        let robot = Robot::read("robot.urdf", URDF, None).expect("a URDF");
        assert_eq!((robot.wheel_diameter_m, robot.wheel_separation_m), (Some(Wheels::both(0.066)), Some(0.16)));
        let joints = Wheels { left: "wheel_left_joint".to_owned(), right: "wheel_right_joint".to_owned() };
        assert_eq!((robot.joints, robot.remarks), (Some(joints), Vec::new()));
        let edited = put_in_urdf(URDF, Wheels { left: 0.068, right: 0.066 }, 0.164).expect("has all");
        let back = Robot::read("robot.urdf", &edited.text, None).expect("a URDF");
        // A sum of two written halves.
        assert!((back.wheel_separation_m.expect("there") - 0.164).abs() < 1e-12);
        assert_eq!(back.wheel_diameter_m, Some(Wheels { left: 0.068, right: 0.066 }));
        let changes = diff("r", URDF, &edited.text);
        let lines: Vec<&str> =
            changes.lines().filter(|line| line.starts_with('+')).skip(1).map(|line| line[1..].trim()).collect();
        assert_eq!(
            lines,
            [
                "<origin xyz=\"0.0 0.082 0.023\" rpy=\"-1.57 0 0\"/>",
                "<origin xyz=\"0.0 -0.082 0.023\" rpy=\"-1.57 0 0\"/>",
                "<collision><geometry><cylinder length=\"0.018\" radius=\"0.034\"/></geometry></collision>",
                "<gazebo><plugin><wheel_separation>0.164</wheel_separation><wheel_diameter>0.066992537</wheel_diameter></plugin></gazebo>",
            ]
        );
    }

    #[test]
    fn four_wheels_move_together_and_a_mesh_has_no_radius() {
        let joint = |name: &str, x: f64, y: f64| {
            format!(
                "<joint name=\"{name}_wheel\" type=\"continuous\"><parent link=\"b\"/><child link=\"{name}\"/><origin xyz=\"{x} {y} 0\"/><axis xyz=\"0 1 0\"/></joint>"
            )
        };
        let urdf = format!(
            "<robot>{}{}{}{}</robot>",
            joint("fl", 0.2, 0.3),
            joint("fr", 0.2, -0.3),
            joint("rl", -0.2, 0.3),
            joint("rr", -0.2, -0.3)
        );
        let robot = Robot::read("a.urdf", &urdf, None).expect("a URDF");
        assert_eq!((robot.wheel_diameter_m, robot.wheel_separation_m), (None, Some(0.6)));
        assert_eq!(
            robot.remarks,
            ["the links of fl_wheel and fr_wheel have neither a cylinder nor a ball, so their radius is not in it"]
        );
        let edited = put_in_urdf(&urdf, Wheels::both(0.2), 0.5).expect("has joints");
        assert_eq!(edited.text.matches("0.25 0\"").count(), 4, "{}", edited.text);
        assert_eq!(edited.remarks, ["the wheels' links have no cylinder or ball, so no radius was put in"]);
        let turned = urdf.replace("<robot>", "<robot><joint name=\"f\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><origin rpy=\"0 0 0.2\"/></joint>");
        let why = Robot::read("a.urdf", &turned, None).map(|_| put_in_urdf(&turned, Wheels::both(0.2), 0.5));
        let Ok(Err(why)) = why else { return assert!(why.is_err()) };
        assert!(why.to_string().contains("a frame that is turned"), "{why}");
        let none = Robot::read("a.urdf", "<robot><link name=\"x\"/></robot>", None).expect_err("no wheels").to_string();
        assert!(none.ends_with("; none is continuous"), "{none}");
    }
}

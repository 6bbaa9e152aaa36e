//! `urdf`: radii of the wheels' shapes and origins of their joints; with --into in a URDF that is there.
//!
//! A URDF is what simulators, collision checks and some controllers read. Both wheels stand at ± b/2 about
//! the middle of the old ones.
//! Reference: REP 103 (x ahead, y to the left); urdf/XML of the ROS wiki.

use std::fmt::Write;

use crate::comment::{comment, decimal, mm, plus_minus_mm};
use crate::error::ExportError;
use crate::options::Options;
use crate::robot::{CalibratedRobot, Length};

/// Decimals of lengths, metres.
const DECIMALS: usize = 9;

/// A comment on its own line.
fn remark(text: &mut String, what: &str) {
    let mut what = comment(what);
    // Two of them end a comment of XML.
    while what.contains("--") {
        what = what.replace("--", "- -");
    }
    let _ = writeln!(text, "<!-- {what} -->");
}

pub(super) fn render(robot: &CalibratedRobot, _: &Options) -> Result<String, ExportError> {
    let mut text = "<?xml version=\"1.0\"?>\n".to_owned();
    remark(&mut text, &format!("By `yair export urdf` from {} ({}).", robot.place, robot.name));
    remark(&mut text, "Names, places ahead and above, and lengths of cylinders are those of your own file.");
    let separation = &robot.wheel_separation;
    let instead = separation.nominal_m.map_or_else(String::new, |of| format!(", instead of {} mm", mm(of)));
    let of = format!("Joints {} mm apart, {}{instead}.", mm(separation.value_m), plus_minus_mm(separation));
    remark(&mut text, &of);
    text.push_str("<robot name=\"calibrated\">\n  <link name=\"base_link\"/>\n");
    let wheels = [("left", robot.wheel_diameter.left, 0.5), ("right", robot.wheel_diameter.right, -0.5)];
    for (side, wheel, share) in wheels {
        let radius = Length {
            value_m: 0.5 * wheel.value_m,
            sigma_m: wheel.sigma_m.map(|sigma_m| 0.5 * sigma_m),
            nominal_m: None,
        };
        let (radius_m, y_m) = (decimal(radius.value_m, DECIMALS), decimal(share * separation.value_m, DECIMALS));
        let _ = write!(
            text,
            "  <link name=\"wheel_{side}_link\">\n    <collision>\n      <geometry>\n        \
             <cylinder radius=\"{radius_m}\"/> <!-- {} -->\n      </geometry>\n    </collision>\n  </link>\n  \
             <joint name=\"wheel_{side}_joint\" type=\"continuous\">\n    <parent link=\"base_link\"/>\n    \
             <child link=\"wheel_{side}_link\"/>\n    <origin xyz=\"0 {y_m} 0\" rpy=\"0 0 0\"/>\n    \
             <axis xyz=\"0 1 0\"/>\n  </joint>\n",
            plus_minus_mm(&radius)
        );
    }
    text.push_str("</robot>\n");
    remark(
        &mut text,
        "What a URDF cannot express: anything that depends on speed, load, direction or the phase of a wheel.",
    );
    for caution in &robot.cautions {
        remark(&mut text, &format!("Caution: {caution}."));
    }
    for effect in robot.left_out(false) {
        remark(&mut text, &format!("Left out: {} ({}).", effect.id, effect.meaning));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn no_text_of_a_file_ends_a_comment() {
        let mut robot = specimen();
        robot.cautions.push("--> <robot/> ---".to_owned());
        let text = render(&robot, &Options::default()).expect("has all");
        assert!(text.contains("<!-- Caution: - -> <robot/> - - -. -->"), "{text}");
        assert!(text.contains("<cylinder radius=\"0.101\"/> <!-- ± 0.010 mm -->"), "{text}");
        assert!(text.contains("<origin xyz=\"0 -0.204 0\" rpy=\"0 0 0\"/>"), "{text}");
        // A reader of XML agrees.
        let read = robot_files::Robot::read("robot.urdf", &text, None).expect("a URDF");
        assert_eq!(read.wheel_separation_m, Some(0.408));
    }
}

//! Reads a robot's own file, however it is written.

use std::f64::consts::PI;

use kinematics::Wheels;

use crate::assignments::{self, ROWS};
use crate::controller::{Controller, DIAMETER, RADII, SEPARATIONS, choose};
use crate::entries::Entry;
use crate::error::RobotFileError;
use crate::robot::Robot;
use crate::{urdf, wheel_joints, yaml};

/// Metres in an inch.
const INCH_M: f64 = 0.0254;

/// How a file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Syntax {
    Xml,
    Yaml,
    /// A line each.
    Assignments,
}

impl Syntax {
    /// By the file's ending, and by its text where that says nothing.
    pub(crate) fn of(file: &str, text: &str) -> Self {
        let ending = file.rsplit('.').next().unwrap_or_default().to_lowercase();
        if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
            return Self::Xml;
        }
        match &ending[..] {
            "yaml" | "yml" => Self::Yaml,
            "h" | "hpp" | "c" | "cpp" | "ino" | "java" | "kt" => Self::Assignments,
            _ => {
                let is_assigned = assignments::entries(text).iter().any(|entry| is_wheel_key(&entry.path[0]));
                if is_assigned { Self::Assignments } else { Self::Yaml }
            }
        }
    }
}

impl Robot {
    /// What a file says of the robot. `file` is its name, whose ending says how it is written; `controller`
    /// chooses among several.
    ///
    /// # Errors
    /// [`RobotFileError`] where it says nothing of wheels, or nothing that a differential drive has.
    pub fn read(file: &str, text: &str, controller: Option<&str>) -> Result<Self, RobotFileError> {
        let robot = match Syntax::of(file, text) {
            Syntax::Xml => wheel_joints::robot(&urdf::Urdf::parse(text)?)?,
            Syntax::Yaml => of_controller(&choose(&yaml::entries(text)?, controller)?)?,
            Syntax::Assignments => of_assignments(&assignments::entries(text))?,
        };
        robot.checked()
    }
}

fn of_controller(controller: &Controller<'_>) -> Result<Robot, RobotFileError> {
    let mut robot = Robot { part: controller.name().unwrap_or_default().to_owned(), ..Robot::default() };
    let factor = |key: &str| controller.number(&[key]).map(|number| number.unwrap_or(1.0));
    let both = factor("wheel_radius_multiplier")?;
    let of_wheels = Wheels {
        left: both * factor("left_wheel_radius_multiplier")?,
        right: both * factor("right_wheel_radius_multiplier")?,
    };
    let radius = controller.first(&RADII)?.map(|(_, radius_m)| 2.0 * radius_m);
    let diameter_m = radius.or(controller.first(&[DIAMETER])?.map(|(_, diameter_m)| diameter_m));
    robot.unscaled_diameter_m = diameter_m;
    robot.wheel_diameter_m = diameter_m.map(|diameter_m| of_wheels.map(|factor| factor * diameter_m));
    let factor = factor("wheel_separation_multiplier")?;
    robot.unscaled_separation_m = controller.first(&SEPARATIONS)?.map(|(_, separation_m)| separation_m);
    robot.wheel_separation_m = robot.unscaled_separation_m.map(|separation_m| factor * separation_m);
    robot.ticks_per_rev =
        controller.first(&[&["wheels_encoder_resolution"], &["encoder_resolution"]])?.map(|(_, of)| of);
    let side = |keys: [&str; 2]| keys.iter().map(|key| controller.texts(key)).find(|names| !names.is_empty());
    if let (Some(left), Some(right)) =
        (side(["left_wheel_names", "left_wheel"]), side(["right_wheel_names", "right_wheel"]))
    {
        if left.len() > 1 || right.len() > 1 {
            robot.remarks.push(format!(
                "it has {} wheels on the left and {} on the right; the joints {} and {} are taken",
                left.len(),
                right.len(),
                left[0],
                right[0]
            ));
        }
        robot.joints = Some(Wheels { left: left[0].to_owned(), right: right[0].to_owned() });
    }
    Ok(robot)
}

/// Names that firmware and programs give the lengths.
fn is_wheel_key(name: &str) -> bool {
    const NAMES: [&str; 10] = [
        "WHEEL_DIAMETER",
        "LR_WHEELS_DISTANCE",
        "kTrackwidthMeters",
        "kLeftMetersPerRotation",
        "kRightMetersPerRotation",
        "inPerTick",
        "trackWidthTicks",
        "YAIR_LEFT_M_PER_COUNT",
        "YAIR_RIGHT_M_PER_COUNT",
        "YAIR_WHEEL_SEPARATION_M",
    ];
    NAMES.contains(&name) || ROWS.contains(&name)
}

fn of_assignments(entries: &[Entry]) -> Result<Robot, RobotFileError> {
    let number = |name: &str| -> Result<Option<f64>, RobotFileError> {
        let Some(entry) = entries.iter().find(|entry| entry.path == [name]) else { return Ok(None) };
        let value = &entry.values[0];
        let wrong = || RobotFileError::NotANumber { key: name.to_owned(), value: value.text.clone() };
        value.number().ok_or_else(wrong).map(Some)
    };
    let both = |left: &str, right: &str, scale: f64| -> Result<Option<Wheels<f64>>, RobotFileError> {
        let (left, right) = (number(left)?, number(right)?);
        Ok(left.zip(right).map(|(left, right)| Wheels { left: scale * left, right: scale * right }))
    };
    let mut robot = Robot::default();
    // linorobot2: one diameter, and counts of a turn that make up for the wheels' difference.
    if let Some(diameter_m) = number("WHEEL_DIAMETER")? {
        let counts = both("COUNTS_PER_REV1", "COUNTS_PER_REV2", 1.0)?;
        robot.ticks_per_rev = counts.map(|Wheels { left, right }| (left * right).sqrt());
        let of_counts = |counts: Wheels<f64>| counts.map(|of| diameter_m * (counts.left * counts.right).sqrt() / of);
        robot.wheel_diameter_m = Some(counts.map_or(Wheels::both(diameter_m), of_counts));
    }
    let per_turn = both("kLeftMetersPerRotation", "kRightMetersPerRotation", 1.0 / PI)?;
    let table = both(ROWS[0], ROWS[1], 1e-3)?;
    robot.wheel_diameter_m = robot.wheel_diameter_m.or(per_turn).or(table);
    let inches = number("inPerTick")?.map(|inches| Wheels::both(inches * INCH_M));
    robot.m_per_tick = both("YAIR_LEFT_M_PER_COUNT", "YAIR_RIGHT_M_PER_COUNT", 1.0)?.or(inches);
    let track = number("trackWidthTicks")?.zip(robot.m_per_tick).map(|(ticks, travel_m)| ticks * travel_m.left);
    robot.wheel_separation_m = number("LR_WHEELS_DISTANCE")?
        .or(number("kTrackwidthMeters")?)
        .or(number("YAIR_WHEEL_SEPARATION_M")?)
        .or(number(ROWS[2])?.map(|length_mm| 1e-3 * length_mm))
        .or(track);
    if robot == Robot::default() {
        return Err(RobotFileError::NoWheels { found: String::new() });
    }
    Ok(robot)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a few products.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn a_controller_is_read_with_its_multipliers_and_joints() {
        let yaml = "base:\n  ros__parameters:\n    left_wheel_names: [fl, rl]\n    right_wheel_names:\n    - fr\n    - rr\n    \
                    wheel_separation: 0.555\n    wheel_separation_multiplier: 1.875\n    wheel_radius: 0.1651\n    \
                    left_wheel_radius_multiplier: 1.01\n";
        let robot = Robot::read("control.yaml", yaml, None).expect("a controller");
        let (wheels_m, separation_m) =
            (robot.wheel_diameter_m.expect("there"), robot.wheel_separation_m.expect("there"));
        assert!((separation_m - 1.040_625).abs() < ROUNDING && (wheels_m.right - 0.3302).abs() < ROUNDING);
        assert!((wheels_m.left - 0.333_502).abs() < ROUNDING, "{wheels_m:?}");
        assert_eq!(robot.joints, Some(Wheels { left: "fl".to_owned(), right: "fr".to_owned() }));
        assert_eq!(robot.remarks, ["it has 2 wheels on the left and 2 on the right; the joints fl and fr are taken"]);
        // A Create 3's own parameters.
        let yaml = "motion_control:\n  ros__parameters:\n    wheel_base: 0.233\n    wheels_encoder_resolution: 508.8\n    \
                    wheels_radius: 0.03575\n";
        let robot = Robot::read("dump.yaml", yaml, None).expect("a Create 3");
        assert_eq!((robot.ticks_per_rev, robot.wheel_diameter_m), (Some(508.8), Some(Wheels::both(0.0715))));
    }

    #[test]
    fn lengths_that_no_robot_has_are_refused_or_remarked() {
        let of = |radius: &str, separation: &str| {
            let yaml =
                format!("a:\n  ros__parameters:\n    wheel_radius: {radius}\n    wheel_separation: {separation}\n");
            Robot::read("a.yaml", &yaml, None)
        };
        let why = of("0.075", "300.0").expect_err("millimetres").to_string();
        assert_eq!(why, "wheel separation: 300 m is no robot's; metres are expected: 0.3 for millimetres");
        assert!(matches!(of("-0.1", "0.3"), Err(RobotFileError::NotMetres { .. })));
        // A controller takes what is 0 from the URDF.
        assert_eq!(of("0.0", "0.3").map(|robot| robot.wheel_diameter_m), Ok(None));
        let remarks = of("0.15", "0.3").expect("a robot").remarks;
        assert_eq!(remarks, ["the wheels are 300 mm in diameter and only 300 mm apart: is the radius a diameter?"]);
        assert!(of("0.1", "0.3").expect("a robot").remarks.is_empty());
    }

    #[test]
    fn travel_of_a_count_needs_the_counts_of_a_turn() {
        let robot = Robot::read("TankDrive.java", "double inPerTick = 0.002;\ndouble trackWidthTicks = 8000;", None);
        let robot = robot.expect("a robot");
        assert_eq!((robot.diameter_m(None), robot.wheel_diameter_m), (None, None));
        let found = robot.diameter_m(Some(4000.0)).expect("by the counts").left;
        assert!((found * PI / 4000.0 - 0.002 * INCH_M).abs() < ROUNDING);
        assert!((robot.wheel_separation_m.expect("there") - 16.0 * INCH_M).abs() < ROUNDING);
        let why = Robot::read("a.h", "#define WHEEL_DIAMETER D\n", None).expect_err("a name");
        assert!(why.to_string().starts_with("WHEEL_DIAMETER: \"D\" is no number"), "{why}");
        assert!(matches!(Robot::read("a.h", "int x = 1;", None), Err(RobotFileError::NoWheels { .. })));
    }
}

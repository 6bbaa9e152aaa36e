//! Calibrated values in a robot's own file, where nothing else is touched.

use robot_files::{Edited, Robot, RobotFileError, put, put_in_urdf};

use crate::error::ExportError;
use crate::format::{Exporter, Place};
use crate::options::{Lengths, Options};
use crate::robot::CalibratedRobot;

/// The text of a file with the calibrated values of a format in their places. Lengths with multipliers stay
/// as the file has them, and the multipliers make them the calibrated ones.
///
/// # Errors
/// [`ExportError`] where the format is a file of its own, the calibration lacks what it needs, or the file
/// has no place for it.
pub fn into_file(
    format: &Exporter,
    mut robot: CalibratedRobot,
    options: &Options,
    file: &str,
    text: &str,
) -> Result<Edited, ExportError> {
    let refused = |source: RobotFileError| ExportError::NotInFile { file: file.to_owned(), source };
    let controller = options.controller.as_deref();
    match format.place {
        Place::None => Err(ExportError::OwnFile { format: format.name }),
        Place::Joints => {
            let diameter_m = robot.wheel_diameter.map(|length| length.value_m);
            put_in_urdf(text, diameter_m, robot.wheel_separation.value_m).map_err(refused)
        }
        Place::Keys => {
            if options.lengths == Lengths::Nominal
                && let Ok(own) = Robot::read(file, text, controller)
            {
                if let Some(diameter_m) = own.unscaled_diameter_m {
                    robot.wheel_diameter =
                        robot.wheel_diameter.map(|length| crate::Length { nominal_m: Some(diameter_m), ..length });
                }
                robot.wheel_separation.nominal_m = own.unscaled_separation_m.or(robot.wheel_separation.nominal_m);
            }
            let fragment = (format.render)(&robot, options)?;
            put(file, text, &fragment, controller).map_err(refused)
        }
    }
}

#[cfg(test)]
mod tests {
    use kinematics::Wheels;

    use super::*;
    use crate::format::{EXPORTERS, exporter};
    use crate::robot::specimen;

    /// What a format can say of the wheels: of one radius their mean.
    fn expressed(format: &str) -> Wheels<f64> {
        let robot = specimen();
        match format {
            "roadrunner" | "turtlebot3" => Wheels::both(robot.mean_diameter_m()),
            _ => robot.wheel_diameter.map(|length| length.value_m),
        }
    }

    /// Nine decimals of two factors; of the table in millimetres three; counts of a turn are whole.
    fn tolerance(format: &str) -> f64 {
        match format {
            "mm" => 1e-6,
            "linorobot2" => 1e-4,
            _ => 1e-8,
        }
    }

    #[test]
    fn every_format_is_read_back_as_it_was_written() {
        let mut read = 0;
        for format in EXPORTERS.iter().filter(|format| format.name != "robot-localization") {
            for lengths in [Lengths::Nominal, Lengths::Calibrated] {
                let text = (format.render)(&specimen(), &Options { lengths, ..Options::default() }).expect("has all");
                let robot =
                    Robot::read("file", &text, None).unwrap_or_else(|why| panic!("{}: {why}\n{text}", format.name));
                let found = robot.diameter_m(specimen().ticks_per_rev).expect("wheels");
                let off = found.zip_with(expressed(format.name), |found, expected| (found / expected - 1.0).abs());
                let separation = robot.wheel_separation_m.expect("a separation") / specimen().wheel_separation.value_m;
                let most = off.left.max(off.right).max((separation - 1.0).abs());
                assert!(most < tolerance(format.name), "{}: {most:e} {robot:?}\n{text}", format.name);
                read += 1;
            }
        }
        assert_eq!(read, 2 * (EXPORTERS.len() - 1));
    }

    #[test]
    fn a_fragment_put_into_itself_changes_no_byte_and_another_calibration_only_values() {
        for format in EXPORTERS.iter().filter(|format| format.place != Place::None) {
            let text = (format.render)(&specimen(), &Options::default()).expect("has all");
            let same = into_file(format, specimen(), &Options::default(), "file", &text).expect("in place");
            assert_eq!(same.text, text, "{}", format.name);
            let mut other = specimen();
            other.wheel_separation.value_m = 0.41;
            other.wheel_diameter.left.value_m = 0.203;
            let edited = into_file(format, other, &Options::default(), "file", &text).expect("in place").text;
            let lines = |text: &str| text.lines().count();
            assert_eq!(lines(&edited), lines(&text), "{}", format.name);
            // Numbers apart, the bytes are the same.
            let without = |text: &str| {
                let is_number = |letter: char| letter.is_ascii_digit() || ".e+-".contains(letter);
                text.split(is_number).filter(|part| !part.is_empty()).collect::<Vec<_>>().join("|")
            };
            assert_eq!(without(&edited), without(&text), "{}", format.name);
            assert_ne!(edited, text, "{}", format.name);
        }
    }

    #[test]
    fn lengths_of_the_file_stay_and_multipliers_are_of_them() {
        // A skid-steered robot, whose file multiplies a length that is not the nominal one.
        let text = "drive:\n  ros__parameters:\n    wheel_separation: 0.2 # by the drawing\n    wheel_separation_multiplier: 1.9\n    wheel_radius: 0.1\n";
        let of = |lengths| {
            let options = Options { lengths, ..Options::default() };
            into_file(exporter("ros2-yaml").expect("there"), specimen(), &options, "c.yaml", text)
                .expect("in place")
                .text
        };
        let kept = of(Lengths::Nominal);
        assert!(
            kept.contains("wheel_separation: 0.2 # by the drawing\n    wheel_separation_multiplier: 2.04\n"),
            "{kept}"
        );
        assert!(
            kept.contains("\n    left_wheel_radius_multiplier: 1.01\n    right_wheel_radius_multiplier: 0.99\n"),
            "{kept}"
        );
        let calibrated = of(Lengths::Calibrated);
        assert!(
            calibrated.contains("wheel_separation: 0.408 # by the drawing\n    wheel_separation_multiplier: 1.0\n"),
            "{calibrated}"
        );
        let why =
            into_file(exporter("c").expect("there"), specimen(), &Options::default(), "a.h", "").expect_err("whole");
        assert_eq!(why, ExportError::OwnFile { format: "c" });
    }
}

//! Formats of robots' programs: one file a format, and this table of contents.

mod c;
mod clearpath;
mod create3;
mod linorobot2;
mod mm;
mod roadrunner;
mod robot_localization;
mod ros2_yaml;
mod turtlebot3;
mod urdf;
mod wpilib;

use crate::error::ExportError;
use crate::options::Options;
use crate::robot::CalibratedRobot;

/// A format that a calibration can be exported to.
#[derive(Debug, Clone, Copy)]
pub struct Exporter {
    /// The format's name on the command line.
    pub name: &'static str,
    /// One line: what reads it.
    pub about: &'static str,
    /// Flags that it takes beside those of all formats.
    pub takes: &'static [&'static str],
    /// How its values are put into a file that is there.
    pub place: Place,
    /// Effects with statements in C are exported, and not left out.
    pub has_effects: bool,
    /// The file's text.
    ///
    /// # Errors
    /// [`ExportError`] when the calibration lacks what the format needs.
    pub render: fn(&CalibratedRobot, &Options) -> Result<String, ExportError>,
}

/// How values of a format are put into a robot's own file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// They are not: the format is a file of its own.
    None,
    /// Under the same keys.
    Keys,
    /// In joints and shapes of links.
    Joints,
}

/// All formats of calibrations; a new one is its file and its line here.
pub const EXPORTERS: &[Exporter] = &[
    Exporter {
        name: "c",
        about: "odometry as one C99 header, effects of an extended model too",
        takes: &["counter-bits"],
        place: Place::None,
        has_effects: true,
        render: c::render,
    },
    Exporter {
        name: "clearpath",
        about: "parameters of Clearpath's platform_velocity_controller, in robot.yaml",
        takes: &["controller", "lengths", "multipliers", "speed", "rate"],
        place: Place::Keys,
        has_effects: false,
        render: clearpath::render,
    },
    Exporter {
        name: "create3",
        about: "parameters of the Create 3's diffdrive_controller",
        takes: &["controller", "lengths", "multipliers", "speed", "rate"],
        place: Place::Keys,
        has_effects: false,
        render: create3::render,
    },
    Exporter {
        name: "linorobot2",
        about: "C defines for the firmware of linorobot2",
        takes: &[],
        place: Place::Keys,
        has_effects: false,
        render: linorobot2::render,
    },
    Exporter {
        name: "mm",
        about: "a table in millimetres, for people",
        takes: &[],
        place: Place::None,
        has_effects: false,
        render: mm::render,
    },
    Exporter {
        name: "roadrunner",
        about: "parameters of Road Runner's TankDrive (FTC), inches",
        takes: &[],
        place: Place::Keys,
        has_effects: false,
        render: roadrunner::render,
    },
    Exporter {
        name: "robot-localization",
        about: "what an EKF of robot_localization takes of the wheels, and their covariance",
        takes: &["controller", "speed", "rate"],
        place: Place::None,
        has_effects: false,
        render: robot_localization::render,
    },
    Exporter {
        name: "ros2-yaml",
        about: "parameters of ROS 2's diff_drive_controller",
        takes: &["controller", "lengths", "multipliers", "speed", "rate"],
        place: Place::Keys,
        has_effects: false,
        render: ros2_yaml::render,
    },
    Exporter {
        name: "turtlebot3",
        about: "parameters of turtlebot3_node",
        takes: &["controller"],
        place: Place::Keys,
        has_effects: false,
        render: turtlebot3::render,
    },
    Exporter {
        name: "urdf",
        about: "radii of the wheels and origins of their joints",
        takes: &[],
        place: Place::Joints,
        has_effects: false,
        render: urdf::render,
    },
    Exporter {
        name: "wpilib",
        about: "Java constants for WPILib's differential drive (FRC)",
        takes: &[],
        place: Place::Keys,
        has_effects: false,
        render: wpilib::render,
    },
];

/// The exporter of a given name.
#[must_use]
pub fn exporter(name: &str) -> Option<&'static Exporter> {
    EXPORTERS.iter().find(|exporter| exporter.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_contents_lists_the_folder() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/format");
        let mut files: Vec<_> = folder
            .read_dir()
            .expect("this folder")
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
            .map(|path| path.file_stem().expect("a name").to_string_lossy().replace('_', "-"))
            .filter(|stem| stem != "mod")
            .collect();
        files.sort();
        let names: Vec<_> = EXPORTERS.iter().map(|exporter| exporter.name).collect();
        assert_eq!(names, files);
        assert!(EXPORTERS.iter().all(|of| exporter(of.name).is_some_and(|found| found.name == of.name)));
        assert!(exporter("ros1-yaml").is_none());
    }
}

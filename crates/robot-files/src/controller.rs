//! Which keys of a YAML text are the parameters of a differential drive.

use crate::entries::{Entry, find};
use crate::error::RobotFileError;

/// Distance between the wheels: diff_drive_controller, Create 3, turtlebot3_node.
pub(crate) const SEPARATIONS: [&[&str]; 3] = [&["wheel_separation"], &["wheel_base"], &["wheels", "separation"]];
/// Radius of the wheels: diff_drive_controller, Create 3, turtlebot3_node.
pub(crate) const RADII: [&[&str]; 3] = [&["wheel_radius"], &["wheels_radius"], &["wheels", "radius"]];
/// Diameter of the wheels, as plugins of simulators have it.
pub(crate) const DIAMETER: &[&str] = &["wheel_diameter"];

/// Parts of the types of controllers that drive other wheels.
const OTHER_DRIVES: [&str; 7] = ["mecanum", "omni", "ackermann", "tricycle", "bicycle", "steering", "swerve"];
/// Keys that controllers of other wheels have.
const OTHER_KEYS: [(&str, &str); 4] = [
    ("wheels_radius", "mecanum_drive_controller"),
    ("sum_of_robot_center_projection_on_X_Y_axis", "mecanum_drive_controller"),
    ("front_wheels_radius", "steering controller"),
    ("rear_wheels_radius", "steering controller"),
];

/// The parameters of one node.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Controller<'a> {
    /// The keys around its parameters.
    pub(crate) prefix: &'a [String],
    entries: &'a [Entry],
}

impl<'a> Controller<'a> {
    /// The node's name; `None` where its parameters are for any node.
    pub(crate) fn name(&self) -> Option<&'a str> {
        let is_name = |key: &&String| *key != "ros__parameters" && !key.contains('*') && !key.is_empty();
        self.prefix.iter().rev().find(is_name).map(String::as_str)
    }

    /// A parameter.
    pub(crate) fn entry(&self, key: &[&str]) -> Option<&'a Entry> {
        find(self.entries, self.prefix, key)
    }

    /// The number of a parameter.
    ///
    /// # Errors
    /// [`RobotFileError::NotANumber`].
    pub(crate) fn number(&self, key: &[&str]) -> Result<Option<f64>, RobotFileError> {
        let Some(entry) = self.entry(key) else { return Ok(None) };
        let wrong = |value: &str| RobotFileError::NotANumber { key: key.join("."), value: value.to_owned() };
        match &entry.values[..] {
            [value] => value.number().ok_or_else(|| wrong(&value.text)).map(Some),
            _ => Err(wrong("a list")),
        }
    }

    /// The texts of a parameter.
    pub(crate) fn texts(&self, key: &str) -> Vec<&'a str> {
        self.entry(&[key]).map(|entry| entry.values.iter().map(|value| &value.text[..]).collect()).unwrap_or_default()
    }

    /// The first of the keys that it has, with its number. Zero is "not given", as of the controller.
    pub(crate) fn first(&self, keys: &[&'static [&'static str]]) -> Result<Option<(String, f64)>, RobotFileError> {
        for key in keys {
            if let Some(number) = self.number(key)?.filter(|number| *number != 0.0) {
                return Ok(Some((key.join("."), number)));
            }
        }
        Ok(None)
    }

    fn has_wheels(&self) -> bool {
        SEPARATIONS.iter().chain(&RADII).chain([&DIAMETER]).any(|key| self.entry(key).is_some())
    }

    /// What it says of the wheels, for comparison.
    fn wheels(&self) -> Vec<String> {
        let keys = SEPARATIONS.iter().chain(&RADII).chain([&DIAMETER]);
        let value =
            |key: &&[&str]| self.entry(key).map(|entry| format!("{}={:?}", key.join("."), entry.values[0].number()));
        keys.filter_map(value).collect()
    }
}

/// A node with a type of other wheels.
fn other_drive(entries: &[Entry]) -> Option<(Vec<String>, RobotFileError)> {
    let of_type = entries.iter().find_map(|entry| {
        let around: Vec<&String> = entry.before(&["type"])?.iter().filter(|key| *key != "ros__parameters").collect();
        let (name, text) = (around.last()?, &entry.values.first()?.text);
        let lower = text.to_lowercase();
        OTHER_DRIVES.iter().any(|drive| lower.contains(drive)).then(|| ((*name).clone(), text.clone()))
    });
    let of_key = || {
        entries.iter().find_map(|entry| {
            let (last, around) = entry.path.split_last()?;
            let (_, type_name) = OTHER_KEYS.iter().find(|(key, _)| key == last)?;
            // Create 3 has the key wheels_radius beside wheel_base.
            let is_mecanum = last != "wheels_radius" || around.last().is_some_and(|key| key == "kinematics");
            let name = around.iter().find(|key| *key != "ros__parameters" && !key.contains('*'))?;
            is_mecanum.then(|| (name.clone(), (*type_name).to_owned()))
        })
    };
    let (controller, type_name) = of_type.or_else(of_key)?;
    let path = vec![controller.clone()];
    Some((path, RobotFileError::NotDifferential { controller, type_name }))
}

/// The controller whose wheels the file states; `wanted` is its name, where the user says it.
pub(crate) fn choose<'a>(entries: &'a [Entry], wanted: Option<&str>) -> Result<Controller<'a>, RobotFileError> {
    let mut all: Vec<Controller<'a>> = Vec::new();
    for entry in entries {
        let keys = SEPARATIONS.iter().chain(&RADII).chain([&DIAMETER]);
        for prefix in keys.filter_map(|key| entry.before(key)) {
            let controller = Controller { prefix, entries };
            if !all.contains(&controller) && controller.has_wheels() {
                all.push(controller);
            }
        }
    }
    let other = other_drive(entries);
    if let Some((name, _)) = &other {
        all.retain(|controller| controller.name() != name.last().map(String::as_str) && !is_kinematics(controller));
    }
    let names = |all: &[Controller<'_>]| {
        all.iter().map(|of| of.name().unwrap_or("any node").to_owned()).collect::<Vec<_>>().join(", ")
    };
    if let Some(wanted) = wanted {
        let is_wanted = |controller: &&Controller<'_>| {
            controller.prefix.iter().any(|key| key.trim_start_matches('/') == wanted.trim_start_matches('/'))
        };
        let found = all.iter().find(is_wanted).cloned();
        return found.ok_or_else(|| match (&other, all.is_empty()) {
            (Some((name, why)), _) if name.iter().any(|key| key == wanted) => why.clone(),
            (_, true) => none(entries),
            _ => RobotFileError::UnknownController { name: wanted.to_owned(), names: names(&all) },
        });
    }
    match (&all[..], other) {
        ([], Some((_, why))) => Err(why),
        ([], None) => Err(none(entries)),
        ([first, others @ ..], _) if others.iter().all(|of| of.wheels() == first.wheels()) => Ok(first.clone()),
        (several, _) => {
            // A node that states radius and separation comes before those with one of them alone.
            let is_whole = |of: &&Controller<'_>| {
                SEPARATIONS.iter().any(|key| of.entry(key).is_some()) && RADII.iter().any(|key| of.entry(key).is_some())
            };
            let whole: Vec<&Controller<'_>> = several.iter().filter(is_whole).collect();
            match whole[..] {
                [only] => Ok(only.clone()),
                _ => Err(RobotFileError::Several { names: names(several) }),
            }
        }
    }
}

fn is_kinematics(controller: &Controller<'_>) -> bool {
    controller.prefix.last().is_some_and(|key| key == "kinematics")
}

fn none(entries: &[Entry]) -> RobotFileError {
    let mut nodes: Vec<&str> = Vec::new();
    for entry in entries {
        let Some(at) = entry.path.iter().position(|key| key == "ros__parameters") else { continue };
        if let Some(node) = at.checked_sub(1).map(|at| &entry.path[at][..]).filter(|node| !nodes.contains(node)) {
            nodes.push(node);
        }
    }
    let found = if nodes.is_empty() { String::new() } else { format!(" (its nodes: {})", nodes.join(", ")) };
    RobotFileError::NoWheels { found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::yaml::entries;

    fn chosen(yaml: &str, wanted: Option<&str>) -> Result<(Option<String>, Option<f64>), String> {
        let entries = entries(yaml).expect("YAML");
        let controller = choose(&entries, wanted).map_err(|error| error.to_string())?;
        let radius = controller.first(&RADII).map_err(|error| error.to_string())?;
        Ok((controller.name().map(str::to_owned), radius.map(|(_, radius)| radius)))
    }

    #[test]
    fn controllers_are_found_under_every_name_and_depth() {
        let body = "wheel_separation: 0.5\n    wheel_radius: 0.1\n";
        for (yaml, name) in [
            (format!("base:\n  ros__parameters:\n    {body}"), Some("base")),
            (format!("/robot/base:\n  ros__parameters:\n    {body}"), Some("/robot/base")),
            (format!("/**:\n  ros__parameters:\n    {body}"), None),
            (format!("/**:\n  base:\n    ros__parameters:\n      {}", body.replace("    ", "      ")), Some("base")),
            (format!("/**/base:\n  ros__parameters:\n    {body}"), None),
            // Clearpath's robot.yaml, and ROS 1.
            (format!("platform:\n  platform_velocity_controller:\n    {body}"), Some("platform_velocity_controller")),
            ("wheel_separation: 0.5\nwheel_radius: 0.1\n".to_owned(), None),
            ("tb:\n  ros__parameters:\n    wheels.separation: 0.5\n    wheels.radius: 0.1\n".to_owned(), Some("tb")),
            (
                "motion_control:\n  ros__parameters: {wheel_base: 0.5, wheels_radius: 0.1}".to_owned(),
                Some("motion_control"),
            ),
        ] {
            assert_eq!(chosen(&yaml, None), Ok((name.map(str::to_owned), Some(0.1))), "{yaml}");
        }
    }

    #[test]
    fn what_is_no_differential_drive_is_said_to_be_none() {
        let mecanum = "controller_manager:\n  ros__parameters:\n    base:\n      type: mecanum_drive_controller/M\n\
                       base:\n  ros__parameters:\n    kinematics:\n      wheels_radius: 0.1\n    wheel_separation_multiplier: 1.0\n";
        let why = chosen(mecanum, None).expect_err("mecanum");
        assert!(why.starts_with("base is a mecanum_drive_controller/M; yair calibrates differential"), "{why}");
        // By its keys alone, and where the type is a parameter of the node itself.
        let untyped = mecanum.split_once("base:\n  ros").map(|(_, rest)| format!("base:\n  ros{rest}")).expect("there");
        assert!(chosen(&untyped, None).expect_err("mecanum").starts_with("base is a mecanum_drive_controller;"));
        let steered = "a:\n  ros__parameters:\n    type: x/AckermannSteeringController\n    wheel_radius: 0.2\n";
        assert!(chosen(steered, None).expect_err("steered").contains("AckermannSteeringController"));
        // Another controller of the file is taken.
        let both = format!("{mecanum}drive:\n  ros__parameters:\n    wheel_separation: 1\n    wheel_radius: 0.3\n");
        assert_eq!(chosen(&both, None), Ok((Some("drive".to_owned()), Some(0.3))));
        assert!(chosen(&both, Some("base")).expect_err("mecanum").starts_with("base is a mecanum"));
        let why = chosen("ekf:\n  ros__parameters:\n    two_d_mode: true\n", None).expect_err("none");
        assert!(why.starts_with("it has no wheel_separation and no wheel_radius (its nodes: ekf); expected"), "{why}");
        assert!(chosen("a: 1\n", None).expect_err("none").contains("no wheel_radius; expected"));
    }

    #[test]
    fn of_several_controllers_one_is_named() {
        let of = |name: &str, radius: f64| {
            format!("{name}:\n  ros__parameters:\n    wheel_separation: 0.5\n    wheel_radius: {radius}\n")
        };
        let two = of("a", 0.1) + &of("b", 0.2);
        let why = chosen(&two, None).expect_err("two");
        assert_eq!(why, "it has the wheels of a, b; choose one by --controller NAME");
        assert_eq!(chosen(&two, Some("/b")), Ok((Some("b".to_owned()), Some(0.2))));
        assert!(
            chosen(&two, Some("c")).expect_err("unknown").contains("no wheels of a controller c; it has those of a, b")
        );
        // Alike they are one; one with both lengths comes before one with a radius alone.
        assert_eq!(chosen(&(of("a", 0.1) + &of("b", 0.1)), None), Ok((Some("a".to_owned()), Some(0.1))));
        let partial = format!("status:\n  ros__parameters:\n    wheel_radius: 0.3\n{}", of("b", 0.1));
        assert_eq!(chosen(&partial, None), Ok((Some("b".to_owned()), Some(0.1))));
        let text = chosen("a:\n  ros__parameters:\n    wheel_radius: $(var r)\n", None).expect_err("a substitution");
        assert!(text.starts_with("wheel_radius: \"$(var r)\" is no number; write the number itself"), "{text}");
    }
}

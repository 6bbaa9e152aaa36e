//! The values of a fragment, as `yair export` writes it, in a robot's own file. Values that are the same
//! already stay as they are written.

use std::ops::Range;

use kinematics::Wheels;

use crate::assignments;
use crate::controller::{Controller, RADII, SEPARATIONS, choose};
use crate::edit::{Edit, Edited, apply};
use crate::entries::{Entry, Scalar};
use crate::error::RobotFileError;
use crate::read::Syntax;
use crate::robot::Robot;
use crate::yaml;

/// Ratio. Numbers that differ by less are the same: fragments have nine decimals of lengths from 0.01 m on.
const SAME: f64 = 1e-7;
/// Ratio. A length of the file that is within this of twice or half the calibrated one is remarked: no wheel
/// is worn by so much.
const TWICE: f64 = 0.1;

/// Defines that a robot with four wheels has besides, with those that they follow.
const FOLLOWERS: [(&str, &str); 2] = [("COUNTS_PER_REV3", "COUNTS_PER_REV1"), ("COUNTS_PER_REV4", "COUNTS_PER_REV2")];

/// A file with the values of a fragment. `controller` chooses among several of the file.
///
/// # Errors
/// [`RobotFileError`] where a value has no place in the file, or would not be what the robot goes by.
pub fn put(file: &str, text: &str, fragment: &str, controller: Option<&str>) -> Result<Edited, RobotFileError> {
    let syntax = Syntax::of(file, text);
    let is_yaml = yaml::entries(fragment).is_ok_and(|entries| choose(&entries, None).is_ok());
    let (edits, mut remarks) = match (syntax, is_yaml) {
        (Syntax::Yaml, true) => yaml_edits(text, fragment, controller)?,
        (Syntax::Assignments, false) => assignment_edits(text, fragment)?,
        (Syntax::Xml, _) => {
            let why = "the file is XML; yair export urdf --into writes into a URDF".to_owned();
            return Err(RobotFileError::NoPlace { key: "these parameters".to_owned(), why });
        }
        (_, is_yaml) => {
            let why =
                if is_yaml { "the file is no YAML, which they are" } else { "the file is YAML, and they are none" };
            let why = format!("{why}; choose the format of the file");
            return Err(RobotFileError::NoPlace { key: "these parameters".to_owned(), why });
        }
    };
    let edited = apply(text, &edits);
    let expected = Robot::read(if is_yaml { "a.yaml" } else { "a.h" }, fragment, None)?;
    refuse_other(&Robot::read(file, &edited, controller)?, &expected)?;
    // What stood there may have been no robot's.
    if let Ok(before) = Robot::read(file, text, controller) {
        remarks.extend(twice(&before, &expected));
    }
    Ok(Edited { text: edited, remarks })
}

/// Refuses an edit after which the file would not say what it is to say.
pub(crate) fn refuse_other(found: &Robot, expected: &Robot) -> Result<(), RobotFileError> {
    let both =
        |wheels: Option<Wheels<f64>>| wheels.map(|Wheels { left, right }| [left, right]).unwrap_or([f64::NAN; 2]);
    let ([left, right], [of_left, of_right]) = (both(found.wheel_diameter_m), both(expected.wheel_diameter_m));
    let (separation_m, of_separation) = (found.wheel_separation_m, expected.wheel_separation_m);
    for (key, found, expected) in [
        ("the left wheel's diameter", left, of_left),
        ("the right wheel's diameter", right, of_right),
        ("the wheel separation", separation_m.unwrap_or(f64::NAN), of_separation.unwrap_or(f64::NAN)),
    ] {
        if !(expected.is_nan() || (found / expected - 1.0).abs() < SAME) {
            let mm = |length_m: f64| format!("{:.3} mm", 1e3 * length_m);
            return Err(RobotFileError::NotInPlace { key, found: mm(found), expected: mm(expected) });
        }
    }
    Ok(())
}

/// Lengths that were twice or half the calibrated ones.
pub(crate) fn twice(before: &Robot, after: &Robot) -> Vec<String> {
    let mean = |robot: &Robot| robot.wheel_diameter_m.map(|Wheels { left, right }| (left * right).sqrt());
    let lengths = [
        (
            "the wheels",
            mean(before).zip(mean(after)),
            "does the file have the diameter for the radius?",
            "does the file have the radius for the diameter?",
        ),
        (
            "the wheel separation",
            before.wheel_separation_m.zip(after.wheel_separation_m),
            "does the file have it twice?",
            "does the file have half the track?",
        ),
    ];
    let mut remarks = Vec::new();
    for (what, lengths, if_twice, if_half) in lengths {
        let Some((old, new)) = lengths else { continue };
        for (factor, word, question) in [(2.0, "twice", if_twice), (0.5, "half", if_half)] {
            if (old / new / factor - 1.0).abs() < TWICE {
                let (old, new) = (1e3 * old, 1e3 * new);
                remarks.push(format!("{what}: {old:.1} mm by the file, {word} the calibrated {new:.1} mm: {question}"));
            }
        }
    }
    remarks
}

/// The edit of one value; `None` where it is the same already.
fn replaced(key: &str, old: &Scalar, new: &Scalar) -> Result<Option<Edit>, RobotFileError> {
    let wrong = || RobotFileError::NotANumber { key: key.to_owned(), value: old.text.clone() };
    let (Some(span), Some(was)) = (old.span.clone(), old.number()) else { return Err(wrong()) };
    let is = new.number().ok_or_else(wrong)?;
    let is_same = (was - is).abs() <= SAME * is.abs();
    Ok((!is_same).then(|| Edit { span, text: new.text.clone() }))
}

type Edits = (Vec<Edit>, Vec<String>);

fn yaml_edits(text: &str, fragment: &str, controller: Option<&str>) -> Result<Edits, RobotFileError> {
    let (entries, of_fragment) = (yaml::entries(text)?, yaml::entries(fragment)?);
    let source = choose(&of_fragment, None)?;
    let target = match choose(&entries, controller) {
        Err(RobotFileError::Several { .. })
            if source.name().is_some_and(|name| choose(&entries, Some(name)).is_ok()) =>
        {
            choose(&entries, source.name())?
        }
        chosen => chosen?,
    };
    let own_keys: Vec<&[&str]> =
        SEPARATIONS.iter().chain(&RADII).copied().filter(|key| source.entry(key).is_some()).collect();
    if !own_keys.iter().any(|key| target.entry(key).is_some()) {
        let has = SEPARATIONS.iter().chain(&RADII).filter(|key| target.entry(key).is_some());
        let has: Vec<String> = has.map(|key| key.join(".")).collect();
        let key = own_keys.iter().map(|key| key.join(".")).collect::<Vec<_>>().join(" and ");
        return Err(RobotFileError::NoPlace {
            key,
            why: format!("the file has {}, of another node", has.join(" and ")),
        });
    }
    let (mut edits, mut remarks, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    for entry in of_fragment.iter().filter(|entry| entry.path.starts_with(source.prefix)) {
        let key: Vec<&str> = entry.path[source.prefix.len()..].iter().map(String::as_str).collect();
        let name = key.join(".");
        match target.entry(&key) {
            Some(old) if old.values.len() == entry.values.len() => {
                for (old, new) in old.values.iter().zip(&entry.values) {
                    edits.extend(replaced(&name, old, new)?);
                }
            }
            Some(old) => remarks.push(format!(
                "{name} has {} values in the file, and {} are exported; it stays as it is",
                old.values.len(),
                entry.values.len()
            )),
            None if entry.values.len() > 1 => remarks.push(format!("{name} is not in the file, and is left out")),
            // A factor of 1 is what its absence means.
            None if name.ends_with("_multiplier") && entry.values[0].number() == Some(1.0) => {}
            None => missing.push((key, &entry.values[0].text)),
        }
    }
    if let Some(((key, _), anchor)) = missing.first().map(|first| (first, anchor(&target))) {
        let why = "the parameters do not stand one a line; write them so".to_owned();
        let no_place = || RobotFileError::NoPlace { key: key.join("."), why: why.clone() };
        let place = anchor.and_then(|key| Place::of(text, key)).ok_or_else(no_place)?;
        let lines: String =
            missing.iter().map(|(key, value)| place.line(key.last().copied().unwrap_or_default(), value)).collect();
        edits.push(place.insert(lines));
    }
    Ok((edits, remarks))
}

/// The last key of the wheels in a file.
fn anchor(target: &Controller<'_>) -> Option<Range<usize>> {
    let multipliers: [&[&str]; 3] =
        [&["wheel_separation_multiplier"], &["left_wheel_radius_multiplier"], &["right_wheel_radius_multiplier"]];
    let keys = SEPARATIONS.iter().chain(&RADII).chain(&multipliers);
    keys.filter_map(|key| target.entry(key)?.key.clone()).max_by_key(|key| key.start)
}

/// Where lines are added: behind the line of a key.
struct Place {
    end: usize,
    /// What stands before a key's last part.
    before: String,
    line_end: &'static str,
    is_open: bool,
}

impl Place {
    fn of(text: &str, key: Range<usize>) -> Option<Self> {
        let start = text[..key.start].rfind('\n').map_or(0, |at| at + 1);
        let end = text[key.end..].find('\n').map_or(text.len(), |at| key.end + at + 1);
        let indent = &text[start..key.start];
        let rest = text[key.end..end].split('#').next().unwrap_or_default();
        if !indent.trim().is_empty() || rest.contains(['{', '}', '[', ']', ',']) {
            return None;
        }
        let dotted = text[key.clone()].rfind('.').map_or(0, |at| at + 1);
        let line_end = if text[start..end].ends_with("\r\n") { "\r\n" } else { "\n" };
        let before = format!("{indent}{}", &text[key.start..key.start + dotted]);
        Some(Self { end, before, line_end, is_open: !text[start..end].ends_with('\n') })
    }

    fn line(&self, key: &str, value: &str) -> String {
        format!("{}{key}: {value}{}", self.before, self.line_end)
    }

    fn insert(&self, lines: String) -> Edit {
        let text =
            if self.is_open { format!("{}{}", self.line_end, lines.trim_end_matches(['\r', '\n'])) } else { lines };
        Edit { span: self.end..self.end, text }
    }
}

fn assignment_edits(text: &str, fragment: &str) -> Result<Edits, RobotFileError> {
    let (entries, of_fragment) = (assignments::entries(text), assignments::entries(fragment));
    let mut edits = Vec::new();
    for entry in &of_fragment {
        let name = &entry.path[0];
        let followers = FOLLOWERS.iter().filter(|(_, of)| of == name).map(|(follower, _)| *follower);
        let places: Vec<&Entry> = std::iter::once(&name[..])
            .chain(followers)
            .flat_map(|name| entries.iter().filter(move |old| old.path[0] == name))
            .collect();
        if places.is_empty() {
            let why = "it is not in the file".to_owned();
            return Err(RobotFileError::NoPlace { key: name.clone(), why });
        }
        for old in places {
            edits.extend(replaced(&old.path[0], &old.values[0], &entry.values[0])?);
        }
    }
    Ok((edits, Vec::new()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::diff;

    const FRAGMENT: &str = "# from c.toml\nbase:\n  ros__parameters:\n    wheel_separation: 0.4\n    wheel_radius: 0.1\n    \
        wheel_separation_multiplier: 1.02\n    left_wheel_radius_multiplier: 1.01\n    right_wheel_radius_multiplier: 0.99\n    \
        twist_covariance_diagonal: [1e-5, 2e-5, 1.0e+6, 1.0e+6, 1.0e+6, 3e-5]\n";

    #[test]
    fn values_are_put_in_and_nothing_else_is_touched() {
        let text = "# mine\r\nbase:\r\n  ros__parameters:\r\n    wheel_radius:   0.10   # of the catalogue\r\n    \
                    wheel_separation: 0.4\r\n    wheel_separation_multiplier: 1.0 # ?\r\n    publish_rate: 50.0\r\n    \
                    twist_covariance_diagonal : [0.001, 0.001, 1000000.0, 1.0e6, 1.0e+06, 0.01]\r\n";
        let edited = put("a.yaml", text, FRAGMENT, None).expect("has all");
        assert_eq!(
            diff("a.yaml", text, &edited.text),
            "--- a.yaml\n+++ a.yaml\n@@ -6,1 +6,3 @@\n-    wheel_separation_multiplier: 1.0 # ?\n\
             +    wheel_separation_multiplier: 1.02 # ?\n+    left_wheel_radius_multiplier: 1.01\n\
             +    right_wheel_radius_multiplier: 0.99\n@@ -8,1 +10,1 @@\n\
             -    twist_covariance_diagonal : [0.001, 0.001, 1000000.0, 1.0e6, 1.0e+06, 0.01]\n\
             +    twist_covariance_diagonal : [1e-5, 2e-5, 1000000.0, 1.0e6, 1.0e+06, 3e-5]\n"
        );
        assert!(edited.text.matches("\r\n").count() == edited.text.matches('\n').count());
        assert_eq!(edited.remarks, [""; 0]);
        // Once more changes nothing.
        assert_eq!(put("a.yaml", &edited.text, FRAGMENT, None).expect("has all").text, edited.text);
    }

    #[test]
    fn what_is_missing_is_added_where_the_file_has_lines_for_it() {
        let flat = "base.ros__parameters:\n  wheel_radius: 0.1";
        let edited = put("a.yaml", flat, FRAGMENT, None).expect("lines");
        assert_eq!(
            edited.text,
            "base.ros__parameters:\n  wheel_radius: 0.1\n  wheel_separation: 0.4\n  wheel_separation_multiplier: 1.02\n  \
             left_wheel_radius_multiplier: 1.01\n  right_wheel_radius_multiplier: 0.99"
        );
        assert_eq!(edited.remarks, ["twist_covariance_diagonal is not in the file, and is left out"]);
        let flow = "base: {ros__parameters: {wheel_radius: 0.1, wheel_separation: 0.4}}\n";
        let why = put("a.yaml", flow, FRAGMENT, None).expect_err("one line").to_string();
        assert!(
            why.starts_with("it has no place for wheel_separation_multiplier: the parameters do not stand"),
            "{why}"
        );
    }

    #[test]
    fn a_diameter_for_the_radius_and_half_the_track_are_remarked() {
        let text = "base:\n  ros__parameters:\n    wheel_radius: 0.2\n    wheel_separation: 0.21\n";
        let remarks = put("a.yaml", text, FRAGMENT, None).expect("has both").remarks;
        assert_eq!(remarks.len(), 3, "{remarks:?}");
        assert_eq!(
            remarks[1],
            "the wheels: 400.0 mm by the file, twice the calibrated 200.0 mm: does the file have the diameter for the radius?"
        );
        assert!(
            remarks[2].ends_with("half the calibrated 408.0 mm: does the file have half the track?"),
            "{remarks:?}"
        );
    }

    #[test]
    fn what_would_not_be_right_is_refused() {
        // A factor of ROS 1 for both wheels multiplies too.
        let old = "base:\n  wheel_radius: 0.1\n  wheel_separation: 0.4\n  wheel_radius_multiplier: 1.1\n";
        let why = put("a.yaml", old, FRAGMENT, None).expect_err("twice").to_string();
        assert!(
            why.starts_with("the left wheel's diameter cannot be put in place here: it would be 222.200 mm and not"),
            "{why}"
        );
        for (file, text, expected) in [
            ("a.yaml", "b:\n  wheel_radius: $(var r)\n", "wheel_radius: \"$(var r)\" is no number"),
            ("a.yaml", "b:\n  wheel_radius: '0.1'\n", "wheel_radius: \"0.1\" is no number"),
            (
                "c.yaml",
                "b:\n  wheel_base: 0.1\n",
                "it has no place for wheel_separation and wheel_radius: the file has wheel_base",
            ),
            ("a.urdf", "<robot/>", "it has no place for these parameters: the file is XML; yair export urdf --into"),
            ("a.h", "#define WHEEL_DIAMETER 0.1\n", "it has no place for these parameters: the file is no YAML"),
        ] {
            let why = put(file, text, FRAGMENT, None).expect_err(text).to_string();
            assert!(why.starts_with(expected), "{why}");
        }
    }

    #[test]
    fn defines_are_replaced_in_their_places() {
        let fragment = "// By yair\n#define WHEEL_DIAMETER 0.06 // m\n#define LR_WHEELS_DISTANCE 0.2 // m\n\
                        #define COUNTS_PER_REV1 990 // left\n#define COUNTS_PER_REV2 1010 // right\n";
        let text = "#ifndef A\n#define COUNTS_PER_REV1 1000   // wheel1\n#define COUNTS_PER_REV2 1000\n#define COUNTS_PER_REV3 1000\n\
                    #define WHEEL_DIAMETER 0.065f\n#define LR_WHEELS_DISTANCE 0.2\n";
        let edited = put("lino_base_config.h", text, fragment, None).expect("has all").text;
        assert_eq!(
            edited,
            "#ifndef A\n#define COUNTS_PER_REV1 990   // wheel1\n#define COUNTS_PER_REV2 1010\n#define COUNTS_PER_REV3 990\n\
             #define WHEEL_DIAMETER 0.06f\n#define LR_WHEELS_DISTANCE 0.2\n"
        );
        let why = put("a.h", "#define WHEEL_DIAMETER 0.06\n", fragment, None).expect_err("no distance").to_string();
        assert_eq!(why, "it has no place for LR_WHEELS_DISTANCE: it is not in the file");
        let yaml = put("a.yaml", "b:\n  wheel_radius: 1\n", fragment, None).expect_err("YAML").to_string();
        assert!(yaml.contains("the file is YAML, and they are none"), "{yaml}");
    }
}

//! What a user says of the files to be imported; everything that is `None` is found, or asked for.

use std::path::{Path, PathBuf};

use kinematics::{DriveGeometry, Wheels};

use super::sheet::Writing;
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::record::NominalRobot;
use crate::unit::Unit;

/// What a file is read for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FileRole {
    /// What its columns say.
    #[default]
    Any,
    /// The wheels alone (`--wheels`): poses in it are left out.
    Wheels,
    /// The poses of an outside instrument alone (`--truth`): wheels and twists in it are left out.
    Truth,
}

impl FileRole {
    /// The prefix that `--map` uses, which is the flag's name too.
    #[must_use]
    pub const fn prefix(self) -> &'static str {
        match self {
            Self::Any => "",
            Self::Wheels => "wheels",
            Self::Truth => "truth",
        }
    }

    /// Whether a quantity is looked for in such a file.
    pub(super) const fn reads(self, quantity: Quantity) -> bool {
        match self {
            Self::Any => true,
            Self::Wheels => !quantity.is_of_pose(),
            Self::Truth => quantity.is_of_pose() || !quantity.is_of_robot(),
        }
    }
}

/// One entry of `--map`: a quantity and its column, with its unit where that is said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapEntry {
    /// The files that it holds for; [`FileRole::Any`]: all.
    pub role: FileRole,
    /// What it is.
    pub quantity: Quantity,
    /// The column's name, or its number from 1.
    pub column: String,
    /// `left=enc_l[deg]`
    pub unit: Option<Unit>,
}

impl std::str::FromStr for MapEntry {
    type Err = String;

    /// Reads `left=enc_l`, `left=enc_l[deg]` and `wheels:left=2`.
    fn from_str(text: &str) -> Result<Self, String> {
        let keys = Quantity::ALL.map(Quantity::key).join(", ");
        let expected = || {
            format!("expected QUANTITY=COLUMN, with a quantity of {keys}, and before it wheels: or truth: for one file")
        };
        let (key, column) = text.split_once('=').ok_or_else(expected)?;
        let (role, key) = match key.split_once(':') {
            None => (FileRole::Any, key),
            Some((prefix, key)) => {
                let role = [FileRole::Wheels, FileRole::Truth].into_iter().find(|role| role.prefix() == prefix.trim());
                (role.ok_or_else(expected)?, key)
            }
        };
        let quantity = Quantity::of_key(key.trim()).ok_or_else(expected)?;
        let (column, unit) = match column.trim().strip_suffix(']').and_then(|column| column.rsplit_once('[')) {
            Some((before, unit)) if Unit::named(unit).is_some() && !before.is_empty() => (before, Unit::named(unit)),
            _ => (column.trim(), None),
        };
        if let Some(unit) = unit.filter(|unit| !quantity.accepts(*unit)) {
            return Err(format!("{key} is never in {}", unit.name()));
        }
        if !role.reads(quantity) {
            return Err(format!("{key} is never read of a file of --{}", role.prefix()));
        }
        if column.is_empty() { Err(expected()) } else { Ok(Self { role, quantity, column: column.to_owned(), unit }) }
    }
}

impl MapEntry {
    /// Entries as they were typed: a prefix holds for those that follow, until the next one.
    #[must_use]
    pub fn in_sequence(typed: &[Self]) -> Vec<Self> {
        let mut role = FileRole::Any;
        let mut entries = typed.to_vec();
        for entry in &mut entries {
            if entry.role != FileRole::Any {
                role = entry.role;
            }
            entry.role = role;
        }
        entries
    }
}

/// Whether a row's speed holds over the interval that ends there, or at the instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rates {
    /// As the dataset holds it.
    IntervalEnd,
    /// The mean over an interval is that of its ends (trapezoid).
    Instantaneous,
}

impl Rates {
    /// The name that flags and output use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::IntervalEnd => "interval-end",
            Self::Instantaneous => "instantaneous",
        }
    }
}

/// What only the robot's owner knows; no log says it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RobotGiven {
    /// Nominal wheel diameters, metres.
    pub wheel_diameter_m: Option<Wheels<f64>>,
    /// Nominal distance between the wheel contacts, metres.
    pub wheel_separation_m: Option<f64>,
    /// Counts for one turn of a wheel.
    pub ticks_per_rev: Option<f64>,
    /// Width of the counters, where they wrap.
    pub counter_bits: Option<u8>,
}

impl RobotGiven {
    /// The robot as its owner describes it; `what` says what was found in `file`, for the question about what
    /// is missing.
    ///
    /// # Errors
    /// [`DatasetError::RobotNotGiven`] with the flags of all that is missing; [`DatasetError::NotWritable`]
    /// of lengths that are no robot's.
    pub fn nominal(
        self,
        is_counted: bool,
        file: &Path,
        what: impl FnOnce() -> String,
    ) -> Result<(NominalRobot, DriveGeometry), DatasetError> {
        let missing = [
            (self.wheel_diameter_m.is_none(), "--wheel DIAMETER_M"),
            (self.wheel_separation_m.is_none(), "--base SEPARATION_M"),
            (is_counted && self.ticks_per_rev.is_none(), "--ticks-per-rev COUNTS"),
        ];
        let flags: Vec<&str> = missing.iter().filter(|(is_missing, _)| *is_missing).map(|(_, flag)| *flag).collect();
        let (Some(diameter_m), Some(wheel_separation_m), true) =
            (self.wheel_diameter_m, self.wheel_separation_m, flags.is_empty())
        else {
            let why = format!("{}{}", what(), if is_counted { ", the wheels are counted" } else { "" });
            return Err(DatasetError::RobotNotGiven { file: file.to_owned(), why, flags: flags.join(" ") });
        };
        let geometry = DriveGeometry::new(diameter_m, wheel_separation_m)
            .map_err(|error| DatasetError::NotWritable { what: format!("--wheel and --base: {error}") })?;
        let robot = NominalRobot {
            left_wheel_diameter_m: diameter_m.left,
            right_wheel_diameter_m: diameter_m.right,
            wheel_separation_m,
            ticks_per_rev: self.ticks_per_rev,
            counter_bits: self.counter_bits,
        };
        Ok((robot, geometry))
    }
}

/// What a tape measure says of how far the robot went.
#[derive(Debug, Clone, PartialEq)]
pub enum Tape {
    /// The straight distance from the first place of the one run to its last, metres.
    Metres(f64),
    /// A table of distances: run, t0, t1 and metres.
    File(PathBuf),
}

/// All that a user may say.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Files of the wheels, in the order of the runs.
    pub wheel_files: Vec<PathBuf>,
    /// Files of the poses, in the order of the runs.
    pub truth_files: Vec<PathBuf>,
    /// No file is read for poses.
    pub without_truth: bool,
    /// How far the clock of the poses is ahead of that of the wheels, seconds.
    pub pose_offset_s: Option<f64>,
    /// Where the times of the poses and of the wheels do not meet, both begin at one instant.
    pub aligns_starts: bool,
    /// What a tape measured.
    pub tape: Option<Tape>,
    /// The body that is the robot, of a motion capture's table with several.
    pub body: Option<String>,
    /// How the files are written.
    pub writing: Writing,
    /// Columns.
    pub map: Vec<MapEntry>,
    /// Unit of all times.
    pub time_unit: Option<Unit>,
    /// Unit of all positions.
    pub length_unit: Option<Unit>,
    /// Unit of all headings.
    pub angle_unit: Option<Unit>,
    /// Unit of both wheels.
    pub wheel_unit: Option<Unit>,
    /// What a row's speed holds for.
    pub rates: Option<Rates>,
    /// The column that says to which run a row belongs.
    pub runs_by: Option<String>,
    /// Runs are cut at standstills and gaps that are longer, seconds.
    pub cut_s: Option<f64>,
    /// The robot.
    pub robot: RobotGiven,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_the_map_have_a_quantity_a_column_and_perhaps_a_unit() {
        let entry = |text: &str| text.parse::<MapEntry>();
        let of =
            |role, column: &str, unit| MapEntry { role, quantity: Quantity::Left, column: column.to_owned(), unit };
        let left = |column: &str, unit| of(FileRole::Any, column, unit);
        assert_eq!(entry("left=enc_l"), Ok(left("enc_l", None)));
        assert_eq!(entry("left=enc[deg]"), Ok(left("enc", Some(Unit::Deg))));
        // A name may have brackets of its own.
        assert_eq!(entry("left=enc[0]"), Ok(left("enc[0]", None)));
        assert!(entry("x=enc[deg]").is_err_and(|message| message == "x is never in deg"));
        assert_eq!(entry("wheels:left=2"), Ok(of(FileRole::Wheels, "2", None)));
        // A column's name may have colons.
        assert_eq!(entry("left=/joint:0"), Ok(left("/joint:0", None)));
        assert!(entry("truth:left=2").is_err_and(|message| message == "left is never read of a file of --truth"));
        for wrong in ["left", "left=", "wheel=enc_l", "=x", "odom:left=2"] {
            assert!(entry(wrong).is_err_and(|message| message.contains("run, t, nanosec, left, right")), "{wrong}");
        }
    }

    #[test]
    fn a_prefix_holds_until_the_next() {
        let typed = ["t=1", "wheels:left=2", "right=3", "truth:x=2"].map(|text| text.parse().expect("an entry"));
        let roles: Vec<FileRole> = MapEntry::in_sequence(&typed).iter().map(|entry| entry.role).collect();
        assert_eq!(roles, [FileRole::Any, FileRole::Wheels, FileRole::Wheels, FileRole::Truth]);
    }
}

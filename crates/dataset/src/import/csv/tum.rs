//! TUM trajectories (`t x y z qx qy qz qw`, as the TUM RGB-D benchmark and evo have them): poses of an
//! outside instrument, and poses of the robot's own dead reckoning from which its twists are taken.
//!
//! Such a file has no wheels. They come from files of any columns, or from a trajectory of the robot's own:
//! between two poses the turn is Δθ, and the distance that part of the displacement which lies along the
//! heading half-way, so that dead reckoning by the midpoint rule (eq. 3) gives the poses back.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use kinematics::{Pose, sin_cos, wrap_to_pi};

use super::columns::{Chosen, Roles};
use super::log::{Log, PoseColumns};
use super::options::{FileRole, Options};
use super::runs::Part;
use super::sheet::{Sheet, Writing};
use super::text::{self, Decimal, Delimiter};
use super::times::seconds;
use super::took::{Basis, Confidence};
use super::{FromCsv, dataset, parts};
use crate::column_names::Quantity;
use crate::error::{DatasetError, shown};
use crate::quaternion::Quaternion;
use crate::unit::Unit;

/// Columns of the format.
const COLUMNS: [&str; 8] = ["t", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// Tilt of poses against the plane, radians, from which on it is remarked: at 10° a length in the plane is
/// 1.5 % short (1 − cos 10°), more than what calibration looks for.
const REMARKED_TILT_RAD: f64 = 10.0 * PI / 180.0;

/// Tilt, radians, from which on the poses are refused: half of what an instrument shows whose y axis is up.
const MAX_TILT_RAD: f64 = 45.0 * PI / 180.0;

/// Length of a unit quaternion: three decimals round it by 2e-3; a component that is missing misses by more.
const UNIT_LENGTH: std::ops::RangeInclusive<f64> = 0.9..=1.1;

/// Poses that all have the same heading are of an instrument of positions if they reach so far in both
/// directions, metres: a robot that drives on a straight alone does so in one of its own.
const MIN_EXTENT_M: f64 = 0.3;

/// Motion sideways over motion, root mean squares, from which on it is remarked: a differential drive's
/// centre has none, and a frame 0.05 rad off the axle's shows so much.
const REMARKED_SIDEWAYS: f64 = 0.05;

/// What says how the robot moved.
#[derive(Debug, Clone, Copy)]
pub enum TumMotion<'a> {
    /// Files of wheels or twists, with whatever columns.
    Wheels(&'a [PathBuf]),
    /// Trajectories of the robot's own dead reckoning.
    Odometry(&'a [PathBuf]),
}

/// Reads trajectories of an outside instrument, and what says how the robot moved, as a dataset.
///
/// # Errors
/// As [`super::read`]; [`DatasetError::Foreign`] of what is no such trajectory, or none of a plane.
pub fn read_tum(truths: &[PathBuf], motion: TumMotion<'_>, options: &Options) -> Result<FromCsv, DatasetError> {
    let mut remarks = Vec::new();
    let mut all = match motion {
        TumMotion::Wheels(files) => {
            let files: Vec<_> = files.iter().map(|file| (file.clone(), FileRole::Wheels)).collect();
            parts(&files, options)?
        }
        TumMotion::Odometry(files) => {
            files.iter().map(|file| odometry(file, &mut remarks)).collect::<Result<Vec<_>, _>>()?
        }
    };
    for file in truths {
        all.push(read_poses(file, &mut remarks)?);
    }
    let stem = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = truths.first().map(stem).unwrap_or_default();
    let mut found = dataset(all, name, remarks, options)?;
    found.imported.dataset.provenance.notes = Some(match motion {
        TumMotion::Wheels(_) => "truth from TUM trajectories".to_owned(),
        TumMotion::Odometry(_) => "truth and twists from TUM trajectories".to_owned(),
    });
    Ok(found)
}

/// A column that the format fixes.
fn fixed(index: usize, unit: Option<Unit>, why: &str) -> Chosen {
    let basis = Basis::new(Confidence::Certain, why);
    Chosen {
        index,
        unit,
        basis: basis.clone(),
        unit_basis: basis,
        is_rate: false,
        is_counted: false,
        is_angle: false,
        is_outside: true,
    }
}

fn open(file: &Path) -> Result<Sheet, DatasetError> {
    let writing = Writing { delimiter: Some(Delimiter::Spaces), decimal: Some(Decimal::Point), header: Some(false) };
    let expected = "expected a TUM trajectory: 8 numbers a line with spaces between, t x y z qx qy qz qw";
    let foreign = |line: u64, message: String| DatasetError::Foreign { file: file.to_owned(), line, message };
    let mut sheet = match Sheet::open(file, writing) {
        Err(DatasetError::Foreign { line, .. }) => {
            let text = text::read(file).unwrap_or_default();
            let first = text.lines().nth(line.saturating_sub(1) as usize).unwrap_or_default();
            let hint = if first.contains(',') { "; evo_traj euroc FILE --save_as_tum converts EuRoC's" } else { "" };
            return Err(foreign(line, format!("\"{}\"; {expected}{hint}", shown(first.as_bytes()))));
        }
        other => other?,
    };
    let columns = sheet.names.len();
    if columns != COLUMNS.len() {
        let hint = if columns == 12 { "; 12 are KITTI's form, which has no times" } else { "" };
        return Err(foreign(sheet.first_row, format!("{columns} columns; {expected}{hint}")));
    }
    sheet.names = COLUMNS.map(str::to_owned).to_vec();
    Ok(sheet)
}

/// The poses of a trajectory, refused where they are none of the plane.
fn read_poses(file: &Path, remarks: &mut Vec<String>) -> Result<Part, DatasetError> {
    let sheet = open(file)?;
    let mut roles = Roles::default();
    let of = [
        (Quantity::Time, 0, Some(Unit::S)),
        (Quantity::X, 1, Some(Unit::M)),
        (Quantity::Y, 2, Some(Unit::M)),
        (Quantity::Qx, 4, None),
        (Quantity::Qy, 5, None),
        (Quantity::Qz, 6, None),
        (Quantity::Qw, 7, None),
    ];
    roles.of.extend(of.map(|(quantity, index, unit)| (quantity, fixed(index, unit, "TUM"))));
    roles.left_out.push(COLUMNS[3].to_owned());
    let mut log = Log::read(&sheet, &roles)?;
    let mut most_tilted = (0.0, 0);
    sheet.for_each_row(|line, fields| {
        let mut quaternion = [0.0; 4];
        for (part, text) in quaternion.iter_mut().zip(&fields[4..]) {
            *part = sheet.decimal.number(text).unwrap_or(f64::NAN);
        }
        let length = Quaternion::length(quaternion);
        // Of a pose without an orientation instruments write NaN.
        if !length.is_nan() && !UNIT_LENGTH.contains(&length) {
            let found = if length < 1e3 { format!("{length:.3}") } else { "above 1000".to_owned() };
            let message = format!("qx qy qz qw have length {found}; a unit quaternion has 1");
            return Err(DatasetError::Foreign { file: file.to_owned(), line, message });
        }
        let tilt_rad = Quaternion::new(quaternion).map_or(0.0, Quaternion::tilt_rad);
        if tilt_rad > most_tilted.0 {
            most_tilted = (tilt_rad, line);
        }
        Ok(())
    })?;
    let (tilt_rad, line) = most_tilted;
    if tilt_rad > MAX_TILT_RAD {
        let message = format!(
            "the pose is tilted by {:.0}° out of the plane; expected z up and the scalar of the quaternion last: turn the trajectory, or order it as t x y z qx qy qz qw",
            tilt_rad.to_degrees()
        );
        return Err(DatasetError::Foreign { file: file.to_owned(), line, message });
    }
    if tilt_rad > REMARKED_TILT_RAD {
        remarks.push(format!(
            "{}:{line}: poses are tilted by up to {:.0}°; is z up, and are they the robot's?",
            file.display(),
            tilt_rad.to_degrees()
        ));
    }
    if let Some(pose) = log.pose.as_mut().filter(|pose| is_heading_constant(pose)) {
        pose.theta.fill(f64::NAN);
        remarks.push(format!(
            "{}: all headings are the same while the positions are not; they were left out",
            file.display()
        ));
    }
    Ok(Part { sheet, roles, log, shift_ps: 0 })
}

/// Is every heading the same, while the robot moves over a plane?
fn is_heading_constant(pose: &PoseColumns) -> bool {
    let extent_m = |values: &[f64]| {
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let (least, most) =
            finite.fold((f64::MAX, f64::MIN), |(least, most), value| (least.min(value), most.max(value)));
        most - least
    };
    pose.theta.iter().all(|theta| *theta == pose.theta[0])
        && extent_m(&pose.x) > MIN_EXTENT_M
        && extent_m(&pose.y) > MIN_EXTENT_M
}

/// Twists over the intervals between the poses of the robot's own dead reckoning.
fn odometry(file: &Path, remarks: &mut Vec<String>) -> Result<Part, DatasetError> {
    let Part { sheet, mut roles, mut log, .. } = read_poses(file, remarks)?;
    let poses = log.pose.take().unwrap_or_default();
    if poses.theta.iter().any(|theta| !theta.is_finite()) {
        let message = "poses without a heading say nothing of how the robot turned; give its wheels by --wheels";
        return Err(sheet.foreign(sheet.first_row, message.to_owned()));
    }
    let pose = |row: usize| Pose::new(poses.x[row], poses.y[row], poses.theta[row]);
    let (mut speeds, mut yaw_rates) = (vec![0.0], vec![0.0]);
    let (mut ahead_m2, mut sideways_m2) = (0.0, 0.0);
    for row in 1..log.time.len() {
        let moved = pose(row - 1).to(pose(row));
        let turn_rad = wrap_to_pi(moved.theta_rad);
        let (sin, cos) = sin_cos(0.5 * turn_rad);
        let (ahead_m, sideways_m) = (cos * moved.x_m + sin * moved.y_m, cos * moved.y_m - sin * moved.x_m);
        (ahead_m2, sideways_m2) = (ahead_m2 + ahead_m * ahead_m, sideways_m2 + sideways_m * sideways_m);
        let dt_s = seconds(log.time[row - 1], log.time[row]);
        // Rows whose time does not grow are refused where runs are made, or cut there.
        let rate = |by: f64| if dt_s > 0.0 { by / dt_s } else { 0.0 };
        speeds.push(rate(ahead_m));
        yaw_rates.push(rate(turn_rad));
    }
    let sideways = (sideways_m2 / (ahead_m2 + sideways_m2)).sqrt();
    if sideways > REMARKED_SIDEWAYS {
        remarks.push(format!(
            "{}: {:.0} % of the motion is sideways, which a differential drive has not; are these poses of its centre, x ahead, by its wheels alone?",
            file.display(),
            100.0 * sideways
        ));
    }
    log.wheels = Some([speeds, yaw_rates]);
    roles.of.retain(|quantity, _| *quantity == Quantity::Time);
    let why = "of the motion from pose to pose";
    roles.of.insert(Quantity::Speed, fixed(1, Some(Unit::MPerS), why));
    roles.of.insert(Quantity::YawRate, fixed(6, Some(Unit::RadPerS), why));
    Ok(Part { sheet, roles, log, shift_ps: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::csv::RobotGiven;
    use crate::record::WheelLog;
    use kinematics::Wheels;

    fn options() -> Options {
        let robot = RobotGiven {
            wheel_diameter_m: Some(Wheels::both(0.15)),
            wheel_separation_m: Some(0.3),
            ..RobotGiven::default()
        };
        Options { robot, ..Options::default() }
    }

    fn tum(rows: &[(f64, Pose)]) -> String {
        let row = |(t_s, pose): &(f64, Pose)| {
            let (sin, cos) = sin_cos(0.5 * pose.theta_rad);
            format!("{t_s:e} {} {} 0.1 0 0 {sin} {cos}\n", pose.x_m, pose.y_m)
        };
        format!("# t x y z qx qy qz qw\n{}", rows.iter().map(row).collect::<String>())
    }

    fn read(truth: &str, odometry: &str) -> Result<FromCsv, DatasetError> {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str, text: &str| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).expect("written");
            file
        };
        let (truth, odometry) = (file("truth.tum", truth), file("odometry.tum", odometry));
        read_tum(&[truth], TumMotion::Odometry(&[odometry]), &options())
    }

    /// A metre ahead, a quarter turn on an arc, a metre back; every 2 s from a date.
    fn path() -> Vec<(f64, Pose)> {
        let moved =
            [Pose::IDENTITY, Pose::new(1.0, 0.0, 0.0), Pose::new(0.5, 0.5, 0.5 * PI), Pose::new(-1.0, 0.0, 0.0)];
        let mut pose = Pose::new(2.0, -1.0, 3.0);
        (0_u32..)
            .zip(moved)
            .map(|(number, moved)| {
                pose = pose * moved;
                (1.7e9 + 2.0 * f64::from(number), pose)
            })
            .collect()
    }

    #[test]
    fn twists_are_those_by_which_the_midpoint_rule_gives_the_poses_back() {
        let path = path();
        let found = read(&tum(&path), &tum(&path)).expect("a dataset");
        let run = &found.imported.dataset.runs[0];
        assert_eq!(*run.odometry.t_s, [0.0, 2.0, 4.0, 6.0]);
        assert_eq!(run.truth.len(), 4);
        let WheelLog::Twist { v_mps, omega_radps } = &run.odometry.wheels else { panic!("twists") };
        // Half a metre ahead and to the left lies along 45°: √½ m in 2 s.
        let expected = [(0.0, 0.0), (0.5, 0.0), (0.5 * 0.5_f64.sqrt(), 0.25 * PI), (-0.5, 0.0)];
        // Roundings of coordinates of a few metres and of the quaternion.
        for (row, (speed, yaw_rate)) in expected.into_iter().enumerate() {
            assert!((v_mps[row] - speed).abs() < 1e-14 && (omega_radps[row] - yaw_rate).abs() < 1e-14, "{run:?}");
        }
        assert_eq!(found.took.remarks, Vec::<String>::new());
        assert_eq!(found.took.files[0].left_out, ["z"]);
    }

    #[test]
    fn what_is_no_trajectory_of_the_plane_is_refused_with_its_line() {
        let good = tum(&path());
        let refused = |truth: &str| read(truth, &good).expect_err("refused").to_string();
        let row = "1700000006 1 2 0 0 0 0 1\n";
        let with = |last: &str| format!("{}{last}\n", row.replace("06", "00"));
        let message = refused(&with("1700000006 1 2 0 1 0 0 0"));
        assert!(message.contains("truth.tum:2: the pose is tilted by 180°"), "{message}");
        let message = refused(&with("1700000006 1 2 0 0 0 0 0"));
        assert!(message.contains("truth.tum:2: qx qy qz qw have length 0.000"), "{message}");
        for bad in ["inf", "1e200", "-1e308"] {
            let message = refused(&with(&format!("1700000006 1 2 0 0 0 {bad} 1")));
            assert!(message.contains("truth.tum:2: qx qy qz qw have length above 1000"), "{message}");
        }
        let message = refused("1,2,0\n3,4,5\n");
        assert!(message.contains("truth.tum:1: \"1,2,0\"; expected a TUM trajectory: 8 numbers"), "{message}");
        let message = refused("1 0 0 1 0 1 0 2 0 0 1 0\n1 0 0 1 0 1 0 2 0 0 1 0\n");
        assert!(message.contains("12 columns") && message.contains("KITTI"), "{message}");
        let headingless =
            good.lines().map(|line| line.rsplitn(3, ' ').last().unwrap_or_default().to_owned() + " 0 1\n");
        let message = read(&good, &headingless.collect::<String>()).expect_err("refused").to_string();
        assert!(message.contains("odometry.tum:2: poses without a heading"), "{message}");
    }

    #[test]
    fn tilt_and_motion_sideways_are_remarked() {
        let path = path();
        let (sin, cos) = sin_cos(0.5 * 0.3);
        let tilted = tum(&path) + &format!("{} 3 -1 0 {sin} 0 0 {cos}\n", 1.7e9 + 8.0);
        let remarks = read(&tilted, &tum(&path)).expect("a dataset").took.remarks;
        assert!(remarks.len() == 1 && remarks[0].contains("truth.tum:6: poses are tilted by up to 17°"), "{remarks:?}");
        let turned: Vec<(f64, Pose)> =
            path.iter().map(|(t_s, pose)| (*t_s, *pose * Pose::new(0.0, 0.0, 0.3))).collect();
        let remarks = read(&tum(&path), &tum(&turned)).expect("a dataset").took.remarks;
        assert!(remarks.iter().any(|remark| remark.contains("of the motion is sideways")), "{remarks:?}");
    }
}

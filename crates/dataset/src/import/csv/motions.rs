//! Pairs of relative motions without times: in each row the robot's odometry and an outside instrument (scan
//! matching) say how the robot moved since the row before, Δx, Δy, Δθ in its own frame then.
//!
//! The odometry's motions become angles of the stated robot's wheels: the turn is Δθ, and the distance is
//! that of the arc whose chord is the part of the displacement along the heading half-way. The instrument's
//! become displacements. Without times a row is a period.

use std::path::Path;

use kinematics::{Increment, Wheels, sin_cos};

use super::options::RobotGiven;
use super::sheet::{Sheet, Writing};
use super::{Basis, Confidence, FromCsv, Took, TookColumn, TookFile};
use crate::error::{DatasetError, shown};
use crate::imported::Imported;
use crate::record::{Dataset, Displacement, Odometry, Provenance, Run, RunInfo, TruthNoise, WheelLog};
use crate::unit::Unit;

const EXPECTED: &str = "3 columns, dx dy dtheta, or 4 with the time of the motion's end before them";

/// Both tell of one drive where their distances agree within this factor; units differ by more.
const MAX_RATIO: f64 = 1.5;

/// What a user says of the pairs.
#[derive(Debug, Clone, Copy)]
pub struct MotionOptions {
    /// The robot whose odometry it is.
    pub robot: RobotGiven,
    /// Time of a row where no column says it, seconds.
    pub period_s: f64,
    /// Unit of Δx and Δy.
    pub length_unit: Unit,
    /// Unit of Δθ.
    pub angle_unit: Unit,
}

/// One file's motions.
struct Motions {
    sheet: Sheet,
    /// Ends of the motions, where a column says them, and the line of each row.
    times_s: Option<Vec<f64>>,
    lines: Vec<u64>,
    /// Ahead and to the left, metres, and the turn, radians.
    rows: Vec<[f64; 3]>,
}

/// Reads pairs of motions as a dataset.
///
/// # Errors
/// [`DatasetError::Foreign`] of tables that are none or do not belong together,
/// [`DatasetError::RobotNotGiven`] where the robot's own numbers are missing.
pub fn read_motions(odometry: &Path, truth: &Path, options: &MotionOptions) -> Result<FromCsv, DatasetError> {
    let (by_wheels, by_instrument) = (motions(odometry, options)?, motions(truth, options)?);
    let (robot, geometry) = options.robot.nominal(false, odometry, || "relative motions".to_owned())?;
    refuse_unpaired(&by_wheels, &by_instrument)?;
    let (mut t_s, mut angles) = (vec![0.0], Wheels { left: vec![0.0], right: vec![0.0] });
    let (mut displacements, mut sideways_m2, mut moved_m2) = (Vec::new(), 0.0, 0.0);
    let mut total = Wheels::both(0.0);
    for (row, ([x_m, y_m, turn_rad], seen)) in by_wheels.rows.iter().zip(&by_instrument.rows).enumerate() {
        let (sin, cos) = sin_cos(0.5 * turn_rad);
        let chord_m = cos * x_m + sin * y_m;
        sideways_m2 += (cos * y_m - sin * x_m).powi(2);
        moved_m2 += x_m * x_m + y_m * y_m;
        // Of an arc the chord is shorter by sin(θ/2) / (θ/2).
        let distance_m = if sin == 0.0 { chord_m } else { chord_m * 0.5 * turn_rad / sin };
        let travel_m = geometry.travel_m(Increment { distance_m, turn_rad: *turn_rad });
        total =
            total.zip_with(travel_m.zip_with(geometry.m_per_rad(), |m, m_per_rad| m / m_per_rad), |sum, rad| sum + rad);
        let t0_s = t_s[t_s.len() - 1];
        let t1_s = match by_wheels.times_s.as_ref().or(by_instrument.times_s.as_ref()) {
            // The first motion ends at the first time, and begins a step before it.
            Some(times_s) => {
                times_s[row] - times_s[0] + times_s.get(1).map_or(options.period_s, |next| next - times_s[0])
            }
            None => t0_s + options.period_s,
        };
        if t1_s.partial_cmp(&t0_s) != Some(std::cmp::Ordering::Greater) {
            let message = format!("a motion that ends at {t1_s} s and begins at {t0_s} s");
            return Err(by_wheels.sheet.foreign(by_wheels.lines[row], message));
        }
        t_s.push(t1_s);
        angles.left.push(total.left);
        angles.right.push(total.right);
        let [dx_m, dy_m, dtheta_rad] = *seen;
        // A pair of nothing is a row for the first pose, before which there is no motion.
        if row > 0 || *seen != [0.0; 3] || by_wheels.rows[0] != [0.0; 3] {
            displacements.push(Displacement { t0_s, t1_s, dx_m, dy_m, dtheta_rad });
        }
    }
    let mut remarks = Vec::new();
    if by_wheels.times_s.is_none() && by_instrument.times_s.is_none() {
        remarks.push(format!(
            "no times: a row is taken as {} s (--period); what depends on speed or time is not to be believed",
            options.period_s
        ));
    }
    let sideways = (sideways_m2 / moved_m2).sqrt();
    if sideways > REMARKED_SIDEWAYS {
        remarks.push(format!(
            "{}: {:.0} % of the motion is sideways, which a differential drive has not; are these motions of its centre, x ahead?",
            odometry.display(),
            100.0 * sideways
        ));
    }
    let name = odometry.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let provenance = Provenance {
        name: Some(name.clone()),
        notes: Some(
            "relative motions in pairs: wheel angles are those of the stated robot that moves as its odometry says"
                .to_owned(),
        ),
        ..Provenance::default()
    };
    let wheels = WheelLog::Angles(angles);
    let info = RunInfo { id: "run-01".to_owned(), ..RunInfo::default() };
    let odometry_log = Odometry { t_s: t_s.into(), wheels, ..Odometry::default() };
    let run = Run { info, odometry: odometry_log, displacements, ..Run::default() };
    let runs = vec![run];
    let dataset = Dataset { provenance, robot, truth_noise: TruthNoise::default(), points: Vec::new(), runs };
    let files = vec![by_wheels.took_file(options), by_instrument.took_file(options)];
    let took = Took { files, runs_by: "one run".to_owned(), rates: None, remarks };
    Ok(FromCsv { imported: Imported { name, dataset, warnings: Vec::new() }, took, truth_shift_s: None })
}

/// Refuses motions that are not those of one drive, row by row.
fn refuse_unpaired(by_wheels: &Motions, by_instrument: &Motions) -> Result<(), DatasetError> {
    let foreign = |message: String| by_instrument.sheet.foreign(by_instrument.sheet.first_row, message);
    if by_wheels.rows.len() != by_instrument.rows.len() {
        let message = format!(
            "{} motions, and {} has {}; expected pairs, row by row",
            by_instrument.rows.len(),
            by_wheels.sheet.file.display(),
            by_wheels.rows.len()
        );
        return Err(foreign(message));
    }
    let way = |motions: &Motions| motions.rows.iter().map(|[x, y, _]| x.hypot(*y)).sum::<f64>();
    let ratio = way(by_instrument) / way(by_wheels);
    if !(1.0 / MAX_RATIO..=MAX_RATIO).contains(&ratio) {
        let message = format!(
            "its motions are {ratio:.3} times as long as those of {}; are both of one drive, in one unit (--length-unit), and relative, not poses?",
            by_wheels.sheet.file.display()
        );
        return Err(foreign(message));
    }
    Ok(())
}

/// Motion sideways over motion, root mean squares, from which on it is remarked, as of trajectories.
const REMARKED_SIDEWAYS: f64 = 0.05;

fn motions(file: &Path, options: &MotionOptions) -> Result<Motions, DatasetError> {
    let sheet = Sheet::open(file, Writing::default())?;
    let first = match sheet.names.len() {
        3 => 0,
        4 => 1,
        columns => return Err(sheet.foreign(sheet.first_row, format!("{columns} columns; expected {EXPECTED}"))),
    };
    let (mut times_s, mut lines, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    sheet.for_each_row(|line, fields| {
        let mut row = [0.0; 4];
        for (value, text) in row.iter_mut().zip(fields) {
            let found = sheet.decimal.number(text).filter(|value| value.is_finite());
            *value = found.ok_or_else(|| {
                sheet.foreign(line, format!("\"{}\" is no number; expected {EXPECTED}", shown(text.as_bytes())))
            })?;
        }
        times_s.push(row[0]);
        lines.push(line);
        let length = |value: f64| options.length_unit.to_si(value);
        rows.push([length(row[first]), length(row[first + 1]), options.angle_unit.to_si(row[first + 2])]);
        Ok(())
    })?;
    if rows.len() < 2 {
        return Err(sheet.foreign(sheet.first_row, format!("{} motions; expected at least two", rows.len())));
    }
    Ok(Motions { sheet, times_s: (first == 1).then_some(times_s), lines, rows })
}

impl Motions {
    fn took_file(&self, options: &MotionOptions) -> TookFile {
        let sheet = &self.sheet;
        let first = usize::from(self.times_s.is_some());
        let given = |why: &str| Basis::new(Confidence::Certain, why);
        let column = |quantity: &'static str, index: usize, unit: Unit, flag: &'static str| TookColumn {
            quantity,
            column: sheet.names[index].clone(),
            number: index + 1,
            unit: unit.name(),
            first: sheet.first_cells(index),
            chosen: given("relative motions"),
            unit_by: given(flag),
            flag,
        };
        let time = self.times_s.iter().map(|_| column("t", 0, Unit::S, ""));
        let moved = [
            column("dx", first, options.length_unit, "--length-unit"),
            column("dy", first + 1, options.length_unit, "--length-unit"),
            column("dtheta", first + 2, options.angle_unit, "--angle-unit"),
        ];
        TookFile {
            file: sheet.file.display().to_string(),
            delimiter: sheet.delimiter.name(),
            decimal: sheet.decimal.name(),
            header_line: sheet.header_line,
            rows: self.rows.len(),
            columns: time.chain(moved).collect(),
            left_out: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(odometry: &str, truth: &str) -> Result<FromCsv, DatasetError> {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str, text: &str| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).expect("written");
            file
        };
        let robot = RobotGiven {
            wheel_diameter_m: Some(Wheels::both(0.2)),
            wheel_separation_m: Some(0.4),
            ..RobotGiven::default()
        };
        let options = MotionOptions { robot, period_s: 1.0, length_unit: Unit::M, angle_unit: Unit::Rad };
        read_motions(&file("odometry.txt", odometry), &file("scans.txt", truth), &options)
    }

    #[test]
    fn motions_become_angles_of_the_wheels_and_displacements() {
        // Nothing, a straight of 0.2 m, a spin of 0.5 rad, and a right turn on an arc of 0.2 m radius to the
        // left: the left wheel stands and the right one goes 0.4 π / 2.
        let odometry = format!("0 0 0\n0.2 0 0\n0 0 0.5\n0.2 0.2 {}\n", std::f64::consts::FRAC_PI_2);
        let found = read(&odometry, "0 0 0\n0.21 0 0\n0 0 0.49\n0.2 0.2 1.6\n").expect("a dataset");
        let run = &found.imported.dataset.runs[0];
        let WheelLog::Angles(angles) = &run.odometry.wheels else { panic!("angles") };
        let expected = [[0.0, 0.0], [0.0, 0.0], [2.0, 2.0], [1.0, 3.0], [1.0, 3.0 + 2.0 * std::f64::consts::PI]];
        for (row, [left, right]) in expected.into_iter().enumerate() {
            // Roundings of a few operations.
            assert!((angles.left[row] - left).abs() < 1e-12 && (angles.right[row] - right).abs() < 1e-12, "{angles:?}");
        }
        let seen = Displacement { t0_s: 1.0, t1_s: 2.0, dx_m: 0.21, dy_m: 0.0, dtheta_rad: 0.0 };
        assert_eq!((run.displacements.len(), run.displacements[0]), (3, seen));
        assert!(found.took.remarks[0].contains("a row is taken as 1 s"), "{:?}", found.took.remarks);
    }

    #[test]
    fn times_are_kept_and_what_does_not_belong_together_is_refused() {
        let timed = "10 0.1 0 0\n10.5 0.1 0 0.1\n11.5 0.1 0 0\n";
        let found = read(timed, "0.1 0 0\n0.1 0 0.1\n0.1 0 0\n").expect("a dataset");
        assert_eq!(*found.imported.dataset.runs[0].odometry.t_s, [0.0, 0.5, 1.0, 2.0]);
        let message = |odometry: &str, truth: &str| read(odometry, truth).expect_err("refused").to_string();
        let pairs = "0.1 0 0\n0.1 0 0.1\n";
        assert!(message(timed, pairs).contains("scans.txt:1: 2 motions"), "{}", message(timed, pairs));
        assert!(message(pairs, "100 0 0\n100 0 0.1\n").contains("1000.000 times as long"));
        assert!(message(pairs, "1 2\n3 4\n").contains("scans.txt:1: 2 columns; expected 3 columns"));
        assert!(message("1 0.1 0 0\n1 0.1 0 0\n", pairs).contains("odometry.txt:1: a motion that ends at 0 s"));
    }
}

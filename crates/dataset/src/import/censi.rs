//! Logs of a Khepera III with a laser: the data of Censi, Franchi, Marchionni, Oriolo, "Simultaneous
//! calibration of odometry and sensor parameters for mobile robots" (IEEE Transactions on Robotics 29, 2013).
//!
//! A `.tuple` file holds concatenated JSON objects: `T` interval s, `phi_l`, `phi_r` mean wheel speeds rad/s,
//! `sm` displacement of the laser in its own frame (x m, y m, heading rad) by scan matching. There are no
//! time stamps and there are gaps between the intervals, so time here is the sum of the intervals and the run
//! is not continuous.

use std::cell::Cell;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use kinematics::Wheels;
use serde::Deserialize;

use crate::error::DatasetError;
use crate::imported::Source;
use crate::record::{
    Dataset, Displacement, NominalRobot, Odometry, Protocol, Provenance, Run, RunInfo, TruthNoise, WheelLog,
};
use crate::settings::LINE_LIMIT_BYTES;
use crate::table::open_file;

const EXPECTED: &str =
    "a .tuple file: objects like {\"T\": 0.79, \"phi_l\": 0.1, \"phi_r\": 0.1, \"sm\": [0.0, 0.0, 0.0]}";

/// Counts for one turn of a Khepera III wheel. It makes every phi·T of the published logs a whole number of
/// counts.
const TICKS_PER_REV: f64 = 2764.8;

/// What the robot believes: the axle that the published estimates give, `axle / E_b` = 0.0880134 / 0.977926 =
/// 0.0890519 / 0.989465 m, …
const WHEEL_SEPARATION_M: f64 = 0.09;

/// … and the manufacturer's wheel; the published estimates are 0.0412 to 0.0419 m.
const WHEEL_DIAMETER_M: f64 = 0.041;

/// How far phi·T may be from a whole number of counts. The numbers are printed with seven digits: an error of
/// 1e-6 of some hundred counts at most. The largest in the published logs is 2.2e-5 of a count.
const COUNT_TOLERANCE: f64 = 0.01;

#[derive(Debug, Deserialize)]
struct Tuple {
    #[serde(rename = "T")]
    interval_s: f64,
    phi_l: f64,
    phi_r: f64,
    sm: [f64; 3],
}

/// The one dataset of a file.
pub(super) fn open(source: &Path) -> Result<Vec<Source>, DatasetError> {
    let allowance = Allowance::default();
    let reader = Allowed { inner: BufReader::new(open_file(source, EXPECTED)?), allowance: allowance.clone() };
    let mut tuples = serde_json::Deserializer::from_reader(reader).into_iter::<Tuple>();

    let (mut t_s, mut total) = (0.0, Wheels::both(0_i64));
    let mut times_s = vec![t_s];
    let mut ticks = Wheels { left: vec![0], right: vec![0] };
    let mut displacements = Vec::new();
    let mut lines = 1;
    loop {
        allowance.renew();
        let Some(tuple) = tuples.next() else { break };
        let tuple = tuple.map_err(|error| why_not_parsed(source, &error, lines))?;
        lines = allowance.line();
        let Tuple { interval_s, sm: [dx_m, dy_m, dtheta_rad], .. } = tuple;
        let foreign = |message| DatasetError::Foreign { file: source.to_owned(), line: lines, message };
        if interval_s <= 0.0 {
            return Err(foreign(format!("T = {interval_s}; expected a positive interval in seconds")));
        }
        let counts = Wheels { left: ("phi_l", tuple.phi_l), right: ("phi_r", tuple.phi_r) }
            .map(|(key, phi_rad_s)| whole_counts(key, phi_rad_s, interval_s));
        total = Wheels {
            left: total.left.wrapping_add(counts.left.map_err(foreign)?),
            right: total.right.wrapping_add(counts.right.map_err(foreign)?),
        };
        let t0_s = t_s;
        t_s += interval_s;
        if t_s <= t0_s {
            return Err(foreign(format!("T = {interval_s:e} s is lost against the {t0_s:e} s before")));
        }
        times_s.push(t_s);
        ticks.left.push(total.left);
        ticks.right.push(total.right);
        displacements.push(Displacement { t0_s, t1_s: t_s, dx_m, dy_m, dtheta_rad });
    }
    if displacements.is_empty() {
        return Err(DatasetError::EmptyFile { file: source.to_owned(), expected: EXPECTED.to_owned() });
    }

    let name = source.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let info =
        RunInfo { id: "run-01".to_owned(), protocol: Some(Protocol::Free), continuous: false, ..RunInfo::default() };
    let odometry = Odometry { t_s: times_s.into(), wheels: WheelLog::Ticks(ticks), ..Odometry::default() };
    let header = Dataset {
        provenance: provenance(&name),
        robot: NominalRobot {
            left_wheel_diameter_m: WHEEL_DIAMETER_M,
            right_wheel_diameter_m: WHEEL_DIAMETER_M,
            wheel_separation_m: WHEEL_SEPARATION_M,
            ticks_per_rev: Some(TICKS_PER_REV),
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: Vec::new(),
    };
    let run = Run { info, odometry, displacements, ..Run::default() };
    Ok(vec![Source::new(name, header, std::iter::once(Ok(run)))])
}

fn provenance(name: &str) -> Provenance {
    Provenance {
        name: Some(name.to_owned()),
        licence: Some("none stated".to_owned()),
        source: Some("https://github.com/AndreaCensi/calibration".to_owned()),
        notes: Some(
            "Khepera III with a laser; truth is scan matching in the laser's own frame, whose mounting is unknown. Several experiments \
             in a row without time stamps: time is the sum of the intervals, gaps left out."
                .to_owned(),
        ),
        ..Provenance::default()
    }
}

/// The counts of one wheel in one interval.
fn whole_counts(key: &str, phi_rad_s: f64, interval_s: f64) -> Result<i64, String> {
    let counts = phi_rad_s * interval_s * TICKS_PER_REV / TAU;
    let whole = counts.round();
    if (counts - whole).abs() <= COUNT_TOLERANCE {
        // Saturates, at 10^8 years of driving.
        Ok(whole as i64)
    } else {
        Err(format!(
            "{key}·T is {counts:.3} counts of a wheel of {TICKS_PER_REV}; expected a whole number to within {COUNT_TOLERANCE}"
        ))
    }
}

fn why_not_parsed(file: &Path, error: &serde_json::Error, last_line: u64) -> DatasetError {
    let file = file.to_owned();
    if error.is_io() {
        let source: io::Error = io::Error::other(error.to_string());
        return if error.io_error_kind() == Some(io::ErrorKind::FileTooLarge) {
            DatasetError::LineTooLong { file, line: last_line, limit_bytes: LINE_LIMIT_BYTES }
        } else {
            DatasetError::Io { path: file, source }
        };
    }
    let message = format!("column {}: {}; expected {EXPECTED}", error.column(), first_clause(&error.to_string()));
    DatasetError::Foreign { file, line: error.line() as u64, message }
}

/// A JSON error without its own "at line 1 column 2".
fn first_clause(message: &str) -> &str {
    message.split_once(" at line ").map_or(message, |(clause, _)| clause)
}

/// How much may be read before an object must have ended, and how many lines have been read.
#[derive(Debug, Clone, Default)]
struct Allowance {
    used_bytes: Rc<Cell<usize>>,
    line_ends: Rc<Cell<u64>>,
}

impl Allowance {
    fn renew(&self) {
        self.used_bytes.set(0);
    }

    fn line(&self) -> u64 {
        self.line_ends.get() + 1
    }
}

/// A reader that refuses to go on and on within one object: the parser would collect it all.
struct Allowed {
    inner: BufReader<File>,
    allowance: Allowance,
}

impl Read for Allowed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Allowance { used_bytes, line_ends } = &self.allowance;
        if used_bytes.get() > LINE_LIMIT_BYTES {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let read = self.inner.read(buffer)?;
        used_bytes.set(used_bytes.get() + read);
        line_ends.set(line_ends.get() + memchr::memchr_iter(b'\n', &buffer[..read]).count() as u64);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{Imported, importer};

    fn read(source: &Path) -> Result<Vec<Imported>, DatasetError> {
        importer("censi").expect("this one").read(source)
    }

    fn import(content: &[u8]) -> Result<Dataset, DatasetError> {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let file = temp.path().join("log.tuple");
        std::fs::write(&file, content).expect("written");
        read(&file).map(|mut imported| imported.remove(0).dataset)
    }

    fn message(content: &str) -> String {
        let message = import(content.as_bytes()).expect_err("a fault").to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        message
    }

    /// An object of given counts.
    fn tuple(interval_s: f64, left: f64, right: f64) -> String {
        let phi = |counts: f64| counts * TAU / TICKS_PER_REV / interval_s;
        format!(
            "{{ \"T\": {interval_s:.6e},\n \"phi_l\": {:.6e}, \"phi_r\": {:.6e}, \"sm\": [0.1, 0.2, 0.3] }}",
            phi(left),
            phi(right)
        )
    }

    #[test]
    fn objects_may_share_a_line_or_span_several() {
        let content = format!("{}{}\n\n{}\n", tuple(0.5, 100.0, -7.0), tuple(0.25, 200.0, 3.0), tuple(1.0, 0.0, 1.0));
        let dataset = import(content.as_bytes()).expect("three objects");
        let run = &dataset.runs[0];
        assert_eq!(*run.odometry.t_s, [0.0, 0.5, 0.75, 1.75]);
        let ticks = Wheels { left: vec![0, 100, 300, 300], right: vec![0, -7, -4, -3] };
        assert_eq!(run.odometry.wheels, WheelLog::Ticks(ticks));
        let second = Displacement { t0_s: 0.5, t1_s: 0.75, dx_m: 0.1, dy_m: 0.2, dtheta_rad: 0.3 };
        assert_eq!(run.displacements[1], second);
        assert!(!run.info.continuous);
    }

    #[test]
    fn faults_name_the_line() {
        let good = tuple(0.5, 100.0, -7.0);
        assert!(message(&format!("{good}\n{}", tuple(0.5, 10.4, 0.0))).contains("log.tuple:4: phi_l·T is 10.4"));
        assert!(message(&format!("{good}\n{}", tuple(0.5, 0.0, 10.4))).contains("log.tuple:4: phi_r·T is 10.4"));
        assert!(
            message(&format!("{good}\n{{ \"T\": 1.0 }}")).contains("log.tuple:3: column 12: missing field `phi_l`")
        );
        assert!(message(&format!("{good}\n{{ \"T\": 1.0, ")).contains("log.tuple:3: column"));
        assert!(message("PK garbage").contains("log.tuple:1: column 1: expected value"));
        assert!(message(&good.replace("5.000000e-1", "-1")).contains("T = -1; expected a positive interval"));
        assert!(message("").contains("empty file"));
        assert!(message(&good.replace("5.000000e-1", "NaN")).contains("log.tuple:1: column"));
    }

    #[test]
    fn an_endless_object_is_refused_before_it_is_collected() {
        for endless in [&b"1"[..], b"{\"T\": 1, \"phi_l\": 1", b" ", b"{\"T\": 1, \"junk\": \"x"] {
            let content = [endless.to_vec(), vec![endless[endless.len() - 1]; 4 * LINE_LIMIT_BYTES]].concat();
            let error = import(&content).expect_err("endless");
            assert!(matches!(error, DatasetError::LineTooLong { line: 1, .. }), "{error}");
        }
    }
}

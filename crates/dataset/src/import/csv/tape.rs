//! What a tape measured: the straight distance from one place of the robot to another.

use std::path::Path;

use super::options::Tape;
use super::runs::{Part, RawRun};
use super::sheet::{Sheet, Writing};
use super::times::{per_second, seconds};
use crate::error::DatasetError;
use crate::partial::TapeDistance;
use crate::record::{NominalRobot, Run};
use crate::run_motion::chord_m;
use crate::unit::Unit;

/// Error of a tape that is laid along a push by hand, metres, where the table does not say it: both ends are
/// set to a millimetre or two.
const TAPE_SIGMA_M: f64 = 0.002;

/// A tape and the wheels by the stated robot tell of one push within this factor.
const MAX_RATIO: f64 = 1.5;

/// Columns of a table of distances, by the names that they may have; the last three are optional.
const COLUMNS: [&[&str]; 5] = [
    &["metres", "meters", "distance_m", "distance", "tape", "m"],
    &["run", "run_id"],
    &["t0", "t0_s", "from"],
    &["t1", "t1_s", "to"],
    &["sigma_m", "sigma"],
];

/// Adds the distances to the runs; `time_unit` is that of the log's times, by whose clock the table speaks.
///
/// # Errors
/// [`DatasetError::Foreign`] of a table that is none, of a run that is not there and of a distance that is
/// far from what the wheels say.
pub(super) fn add(
    tape: &Tape,
    parts: &[Part],
    raw: &[RawRun],
    time_unit: Unit,
    runs: &mut [Run],
    robot: &NominalRobot,
    remarks: &mut Vec<String>,
) -> Result<(), DatasetError> {
    let file = &parts[raw[0].part].sheet.file;
    match tape {
        Tape::Metres(distance_m) => {
            if runs.len() != 1 {
                let message = format!(
                    "--tape {distance_m}: there are {} runs, and it says the distance of one; give --tape FILE with columns run,t0,t1,metres",
                    runs.len()
                );
                return Err(DatasetError::Foreign { file: file.clone(), line: 1, message });
            }
            let (Some(&t0_s), Some(&t1_s)) = (runs[0].odometry.t_s.first(), runs[0].odometry.t_s.last()) else {
                return Ok(());
            };
            let distance = TapeDistance { t0_s, t1_s, distance_m: *distance_m, sigma_m: TAPE_SIGMA_M };
            remarks.push(format!(
                "--tape {distance_m}: from the robot's first place to its last, with an error of {} mm; it must stand still at both",
                1e3 * TAPE_SIGMA_M
            ));
            push(&mut runs[0], distance, robot, file, 1)
        }
        Tape::File(file) => table(file, parts, raw, time_unit, runs, robot),
    }
}

fn table(
    file: &Path,
    parts: &[Part],
    raw: &[RawRun],
    time_unit: Unit,
    runs: &mut [Run],
    robot: &NominalRobot,
) -> Result<(), DatasetError> {
    let sheet = Sheet::open(file, Writing::default())?;
    let foreign = |line: u64, message: String| DatasetError::Foreign { file: file.to_owned(), line, message };
    let [metres, run, t0, t1, sigma] = COLUMNS.map(|names| {
        sheet.names.iter().position(|name| names.iter().any(|known| name.trim().eq_ignore_ascii_case(known)))
    });
    let Some(metres) = metres else {
        let message = format!("no column metres; the columns are: {}", sheet.names.join(", "));
        return Err(foreign(sheet.header_line.unwrap_or(1), message));
    };
    sheet.for_each_row(|line, fields| {
        let number = |column: usize| {
            let value = sheet.decimal.number(fields[column]).filter(|value| value.is_finite());
            value.ok_or_else(|| foreign(line, format!("\"{}\" is no number", fields[column])))
        };
        let named = run.map(|run| fields[run]);
        let index = match named {
            Some(id) => runs.iter().position(|of| of.info.id == id),
            None => (runs.len() == 1).then_some(0),
        };
        let Some(index) = index else {
            let ids: Vec<&str> = runs.iter().map(|of| of.info.id.as_str()).collect();
            return Err(foreign(line, format!("no run \"{}\"; the runs are: {}", named.unwrap_or(""), ids.join(", "))));
        };
        let time = &parts[raw[index].part].log.time;
        let ends = (raw[index].rows.first().map(|&row| time[row]), raw[index].rows.last().map(|&row| time[row]));
        let (Some(first), Some(last)) = ends else { return Ok(()) };
        let instant = |column: Option<usize>, otherwise: i128| match column.filter(|&column| !fields[column].is_empty())
        {
            None => Ok(otherwise),
            Some(column) => {
                let stamp = sheet.decimal.exact(fields[column]);
                stamp
                    .map(|stamp| stamp / per_second(time_unit))
                    .filter(|stamp| (first..=last).contains(stamp))
                    .ok_or_else(|| {
                        let message = format!("{} is not in the run by the clock of its log", fields[column]);
                        foreign(line, message)
                    })
            }
        };
        let (from, to) = (instant(t0, first)?, instant(t1, last)?);
        let sigma_m = match sigma.filter(|&column| !fields[column].is_empty()) {
            Some(column) => number(column)?,
            None => TAPE_SIGMA_M,
        };
        let start = raw[index].start;
        let distance =
            TapeDistance { t0_s: seconds(start, from), t1_s: seconds(start, to), distance_m: number(metres)?, sigma_m };
        push(&mut runs[index], distance, robot, file, line)
    })
}

/// Adds a distance that the wheels do not contradict.
fn push(run: &mut Run, of: TapeDistance, robot: &NominalRobot, file: &Path, line: u64) -> Result<(), DatasetError> {
    let foreign = |message: String| Err(DatasetError::Foreign { file: file.to_owned(), line, message });
    let is_some = of.t1_s > of.t0_s && of.distance_m > 0.0 && of.sigma_m > 0.0;
    if !is_some {
        return foreign("a distance has an end after its start, and metres and their error above zero".to_owned());
    }
    if let Some(nominal_m) = chord_m(&run.odometry, robot, of.t0_s, of.t1_s) {
        let ratio = of.distance_m / nominal_m;
        if !(1.0 / MAX_RATIO..=MAX_RATIO).contains(&ratio) {
            return foreign(format!(
                "the tape says {} m, and the wheels by the stated robot {nominal_m:.3} m; look at the units (metres), --wheel, --ticks-per-rev and at which instants are meant",
                of.distance_m
            ));
        }
    }
    run.distances.push(of);
    Ok(())
}

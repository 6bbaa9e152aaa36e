//! The cells of a sheet that are needed, row by row.

use std::collections::HashMap;

use super::columns::Roles;
use super::sheet::Sheet;
use super::text;
use crate::column_names::Quantity;
use crate::error::{DatasetError, shown};
use crate::quaternion::Quaternion;
use crate::read::why_no_id;

/// Nanoseconds of a second.
const NANOS: i128 = 1_000_000_000;

/// The cells of a sheet that are needed.
#[derive(Debug)]
pub(super) struct Log {
    /// Line of each row, from 1.
    pub(super) lines: Vec<u64>,
    /// In units of 10⁻¹² of the column's; of picoseconds once the unit is known.
    pub(super) time: Vec<i128>,
    /// Whether the times are written as dates with a time of day.
    pub(super) is_dated: bool,
    /// Which of `run_names` each row belongs to.
    pub(super) run: Vec<u32>,
    pub(super) run_names: Vec<String>,
    /// Both wheels, or speed and yaw rate; NaN where a cell is empty.
    pub(super) wheels: Option<[Vec<f64>; 2]>,
    /// NaN where a cell is empty or NaN.
    pub(super) pose: Option<PoseColumns>,
    /// The gyroscope's yaw rate; NaN where a cell is empty or NaN.
    pub(super) gyro: Option<Vec<f64>>,
}

/// Positions and headings as they are written.
#[derive(Debug, Default)]
pub(super) struct PoseColumns {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// NaN where there is none.
    pub(super) theta: Vec<f64>,
}

/// One row of a sheet.
struct Row<'a> {
    sheet: &'a Sheet,
    line: u64,
    fields: &'a [&'a str],
}

impl Row<'_> {
    /// A cell that is no number, or the one that it is, which must not be there.
    fn fault(&self, column: usize, found: Option<f64>) -> DatasetError {
        let (file, line) = (self.sheet.file.clone(), self.line);
        let (column, found_text) = (self.sheet.names[column].clone(), shown(self.fields[column].as_bytes()));
        if found.is_some() {
            DatasetError::NotFinite { file, line, column, found: found_text }
        } else {
            DatasetError::NotANumber { file, line, column, found: found_text }
        }
    }

    /// NaN of an empty cell.
    fn number(&self, column: usize) -> Result<f64, DatasetError> {
        match self.fields[column] {
            "" => Ok(f64::NAN),
            text => self.sheet.decimal.number(text).ok_or_else(|| self.fault(column, None)),
        }
    }

    /// A number in units of 10⁻¹² of the column's.
    fn exact(&self, column: usize) -> Result<i128, DatasetError> {
        let decimal = self.sheet.decimal;
        let found = decimal.exact(self.fields[column]);
        found.ok_or_else(|| self.fault(column, decimal.number(self.fields[column])))
    }
}

impl Log {
    pub(super) fn read(sheet: &Sheet, roles: &Roles) -> Result<Self, DatasetError> {
        let index = |quantity: Quantity| roles.of.get(&quantity).map(|chosen| chosen.index);
        let (time, run) = (index(Quantity::Time).unwrap_or(0), index(Quantity::Run));
        let wheels = roles.wheels().map(|pair| pair.map(|quantity| roles.of[&quantity].index));
        let position = index(Quantity::X).zip(index(Quantity::Y));
        let heading = index(Quantity::Heading);
        let quaternion = [Quantity::Qx, Quantity::Qy, Quantity::Qz, Quantity::Qw].map(index);
        let (nanos, gyro) = (index(Quantity::Nanoseconds), index(Quantity::Gyro));
        let mut log = Self {
            lines: Vec::new(),
            time: Vec::new(),
            is_dated: false,
            run: Vec::new(),
            run_names: Vec::new(),
            wheels: wheels.map(|_| Default::default()),
            pose: position.map(|_| PoseColumns::default()),
            gyro: gyro.map(|_| Vec::new()),
        };
        let mut known: HashMap<&str, u32> = HashMap::new();
        sheet.for_each_row(|line, fields| {
            let row = Row { sheet, line, fields };
            // The first row says whether times are dates.
            let dated = if log.lines.is_empty() || log.is_dated { text::date_and_time(fields[time]) } else { None };
            log.is_dated |= dated.is_some();
            let stamp = match dated {
                Some(stamp) => stamp,
                None if log.is_dated => return Err(row.fault(time, None)),
                None => row.exact(time)?,
            };
            let stamp = nanos.map_or(Ok(stamp), |nanos| Ok(stamp + row.exact(nanos)? / NANOS))?;
            log.lines.push(line);
            log.time.push(stamp);
            if let Some(run) = run {
                let next = known.len() as u32;
                log.run.push(*known.entry(fields[run]).or_insert(next));
                if known.len() > log.run_names.len() {
                    if let Some(expected) = why_no_id(fields[run]) {
                        let (file, id) = (sheet.file.clone(), shown(fields[run].as_bytes()));
                        return Err(DatasetError::BadId { file, line, id, expected });
                    }
                    log.run_names.push(fields[run].to_owned());
                }
            }
            if let (Some(columns), Some(wheels)) = (wheels, &mut log.wheels) {
                for (column, values) in columns.into_iter().zip(wheels) {
                    let value = row.number(column)?;
                    if !value.is_finite() && !fields[column].is_empty() {
                        return Err(row.fault(column, Some(value)));
                    }
                    values.push(value);
                }
            }
            if let (Some(column), Some(rates)) = (gyro, &mut log.gyro) {
                rates.push(row.number(column)?);
            }
            if let (Some((x, y)), Some(pose)) = (position, &mut log.pose) {
                pose.x.push(row.number(x)?);
                pose.y.push(row.number(y)?);
                let theta = match (heading, quaternion) {
                    (Some(heading), _) => row.number(heading)?,
                    (None, [Some(x), Some(y), Some(z), Some(w)]) => {
                        let parts = [row.number(x)?, row.number(y)?, row.number(z)?, row.number(w)?];
                        Quaternion::new(parts).map_or(f64::NAN, Quaternion::yaw_rad)
                    }
                    _ => f64::NAN,
                };
                pose.theta.push(theta);
            }
            Ok(())
        })?;
        Ok(log)
    }

    /// Whether two rows say the same of wheels, poses and gyroscope.
    pub(super) fn is_same(&self, first: usize, second: usize) -> bool {
        let wheels = self.wheels.iter().flatten();
        let poses = self.pose.iter().flat_map(|pose| [&pose.x, &pose.y, &pose.theta]);
        let mut columns = wheels.chain(poses).chain(&self.gyro);
        columns.all(|values| values[first].total_cmp(&values[second]).is_eq())
    }

    /// Which run a row belongs to.
    pub(super) fn run_of(&self, row: usize) -> u32 {
        self.run.get(row).copied().unwrap_or(0)
    }

    /// Whether a row says something of the wheels.
    pub(super) fn has_wheels_at(&self, row: usize) -> bool {
        self.wheels.as_ref().is_some_and(|wheels| wheels.iter().all(|values| !values[row].is_nan()))
    }

    /// Whether a row has the gyroscope's rate.
    pub(super) fn has_gyro_at(&self, row: usize) -> bool {
        self.gyro.as_ref().is_some_and(|rates| rates[row].is_finite())
    }

    /// Whether a row says where the robot stood.
    pub(super) fn has_pose_at(&self, row: usize) -> bool {
        self.pose.as_ref().is_some_and(|pose| pose.x[row].is_finite() && pose.y[row].is_finite())
    }
}

//! Which column of a sheet is what, and what its cells say.

use std::collections::{BTreeMap, HashMap};

use super::options::{MapEntry, Options};
use super::sheet::Sheet;
use super::took::{Basis, Confidence};
use crate::column_names::{NameReading, Quantity, read_name};
use crate::error::{DatasetError, shown};
use crate::name_units::unreadable_unit;
use crate::quaternion::Quaternion;
use crate::read::why_no_id;
use crate::unit::Unit;

/// The column that was taken for a quantity.
#[derive(Debug, Clone)]
pub(super) struct Chosen {
    pub(super) index: usize,
    /// Where it is known before the values are looked at.
    pub(super) unit: Option<Unit>,
    pub(super) basis: Basis,
    pub(super) unit_basis: Basis,
    pub(super) is_rate: bool,
    pub(super) is_counted: bool,
}

/// The columns of one sheet.
#[derive(Debug, Default)]
pub(super) struct Roles {
    pub(super) of: BTreeMap<Quantity, Chosen>,
    pub(super) left_out: Vec<String>,
}

impl Roles {
    pub(super) fn has(&self, quantity: Quantity) -> bool {
        self.of.contains_key(&quantity)
    }

    pub(super) fn has_wheels(&self) -> bool {
        self.wheels().is_some()
    }

    pub(super) fn has_pose(&self) -> bool {
        self.has(Quantity::X)
    }

    /// The two columns that say how the wheels moved.
    pub(super) fn wheels(&self) -> Option<[Quantity; 2]> {
        let pairs = [[Quantity::Left, Quantity::Right], [Quantity::Speed, Quantity::YawRate]];
        pairs.into_iter().find(|pair| pair.iter().all(|quantity| self.has(*quantity)))
    }
}

/// The column that an entry of `--map` names in a sheet.
fn mapped(sheet: &Sheet, column: &str) -> Option<usize> {
    let by_name = |same: fn(&str, &str) -> bool| sheet.names.iter().position(|name| same(name, column));
    by_name(|a, b| a == b).or_else(|| by_name(str::eq_ignore_ascii_case)).or_else(|| {
        let number = column.parse::<usize>().ok()?.checked_sub(1)?;
        (number < sheet.names.len()).then_some(number)
    })
}

/// Refuses what `--map` names and no sheet has.
pub(super) fn refuse_unknown_columns(sheets: &[Sheet], options: &Options) -> Result<(), DatasetError> {
    let runs_by = options.runs_by.iter().map(|column| (column, "--runs-by"));
    let columns = options.map.iter().map(|entry| (&entry.column, "--map")).chain(runs_by);
    for (column, flag) in columns {
        if sheets.iter().all(|sheet| mapped(sheet, column).is_none()) {
            let names: Vec<String> =
                sheets.iter().map(|sheet| format!("{} has {}", sheet.file.display(), listed(&sheet.names))).collect();
            let message = format!("{flag}: no column \"{}\"; {}", shown(column.as_bytes()), names.join("; "));
            return Err(DatasetError::Foreign {
                file: sheets[0].file.clone(),
                line: sheets[0].header_line.unwrap_or(1),
                message,
            });
        }
    }
    Ok(())
}

/// Names of columns as messages show them.
pub(super) fn listed(names: &[String]) -> String {
    const MOST: usize = 12;
    let mut shown_names: Vec<String> = names.iter().take(MOST).map(|name| shown(name.as_bytes())).collect();
    if names.len() > MOST {
        shown_names.push("…".to_owned());
    }
    shown_names.join(", ")
}

/// Decides what the columns of a sheet are: by the user's word, else by their names.
pub(super) fn roles(sheet: &Sheet, options: &Options) -> Result<Roles, DatasetError> {
    let mut roles = Roles::default();
    let mut given: Vec<(Quantity, usize, Option<Unit>)> = Vec::new();
    for MapEntry { quantity, column, unit } in &options.map {
        given.extend(mapped(sheet, column).map(|index| (*quantity, index, *unit)));
    }
    if let Some(index) = options.runs_by.as_ref().and_then(|column| mapped(sheet, column)) {
        given.push((Quantity::Run, index, None));
    }
    if sheet.header_line.is_none() && given.is_empty() {
        return Err(without_header(sheet));
    }
    let reading = |index: usize| -> Option<NameReading> {
        let mut reading = sheet.header_line.and_then(|_| read_name(&sheet.names[index]))?;
        let units = [reading.unit, sheet.units[index]].into_iter().flatten();
        reading.unit = units.into_iter().find(|unit| reading.quantity.accepts(*unit));
        Some(reading)
    };
    for &(quantity, index, unit) in &given {
        let named = reading(index);
        let (unit, unit_basis) = match (unit, named.and_then(|named| named.unit).filter(|unit| quantity.accepts(*unit)))
        {
            (Some(unit), _) => (Some(unit), Basis::new(Confidence::Given, "--map")),
            (None, Some(unit)) => (Some(unit), Basis::new(Confidence::Certain, "name")),
            (None, None) => (None, Basis::new(Confidence::Given, "--map")),
        };
        let (is_rate, is_counted) = named.map_or((false, false), |named| (named.is_rate, named.is_counted));
        let basis = Basis::new(Confidence::Given, "--map");
        roles.of.insert(quantity, Chosen { index, unit, basis, unit_basis, is_rate, is_counted });
    }
    let mut by_name: BTreeMap<Quantity, Vec<(usize, NameReading)>> = BTreeMap::new();
    for index in (0..sheet.names.len()).filter(|index| given.iter().all(|(_, taken, _)| taken != index)) {
        match reading(index) {
            Some(reading) if !reading.is_own && !roles.has(reading.quantity) => {
                by_name.entry(reading.quantity).or_default().push((index, reading));
            }
            _ => roles.left_out.push(sheet.names[index].clone()),
        }
    }
    // A wheel is logged in one form: the one that both columns have.
    let rank_of = |quantity| by_name.get(&quantity).and_then(|all| all.iter().map(|(_, reading)| reading.rank).max());
    let wheel_rank = rank_of(Quantity::Left).zip(rank_of(Quantity::Right)).map(|(left, right)| left.min(right));
    for (quantity, candidates) in by_name {
        let is_wheel = matches!(quantity, Quantity::Left | Quantity::Right);
        let best = candidates.iter().map(|(_, reading)| reading.rank).max().unwrap_or(0);
        let best = wheel_rank.filter(|_| is_wheel).unwrap_or(best);
        let (chosen, others): (Vec<_>, Vec<_>) = candidates.into_iter().partition(|(_, reading)| reading.rank == best);
        roles.left_out.extend(others.into_iter().map(|(index, _)| sheet.names[index].clone()));
        if let [first, second, ..] = &chosen[..] {
            let [first, second] = [first.0, second.0].map(|index| shown(sheet.names[index].as_bytes()));
            return Err(DatasetError::Undecided {
                file: sheet.file.clone(),
                what: format!("column {}", quantity.key()),
                flag: format!("--map {}={first} or --map {}={second}", quantity.key(), quantity.key()),
                readings: format!("{first} or {second}"),
            });
        }
        if let Some(&(index, NameReading { unit, is_rate, is_counted, .. })) = chosen.first() {
            let basis = Basis::new(Confidence::Likely, "name");
            let unit_basis = Basis::new(Confidence::Certain, "name");
            roles.of.insert(quantity, Chosen { index, unit, basis, unit_basis, is_rate, is_counted });
        }
    }
    settle(sheet, roles)
}

/// Leaves out what is said twice, and refuses what is said by half.
fn settle(sheet: &Sheet, mut roles: Roles) -> Result<Roles, DatasetError> {
    use Quantity::{Heading, Left, Qw, Qx, Qy, Qz, Right, Speed, Time, X, Y, YawRate};
    let leave_out = |roles: &mut Roles, quantities: &[Quantity]| {
        for quantity in quantities {
            if let Some(chosen) = roles.of.remove(quantity) {
                roles.left_out.push(sheet.names[chosen.index].clone());
            }
        }
    };
    if roles.has(Left) && roles.has(Right) {
        leave_out(&mut roles, &[Speed, YawRate]);
    }
    let quaternion = [Qx, Qy, Qz, Qw].iter().all(|part| roles.has(*part));
    // A heading alone, without a position, is no pose; a position without a whole quaternion has none.
    if roles.has(Heading) || !quaternion || !roles.has(X) {
        leave_out(&mut roles, &[Qx, Qy, Qz, Qw]);
    }
    if !roles.has(X) && !roles.has(Y) {
        leave_out(&mut roles, &[Heading]);
    }
    let pairs = [(Left, Right), (Right, Left), (X, Y), (Y, X), (Speed, YawRate), (YawRate, Speed)];
    for (there, missing) in pairs {
        if roles.has(there) && !roles.has(missing) {
            // A speed beside poses is the instrument's; so is a yaw rate.
            if matches!(there, Speed | YawRate) && roles.has_pose() {
                leave_out(&mut roles, &[there]);
                continue;
            }
            let name = &sheet.names[roles.of[&there].index];
            return Err(lacking(sheet, missing.key(), &format!("\"{}\" is {}", shown(name.as_bytes()), there.key())));
        }
    }
    if !roles.has_wheels() && !roles.has_pose() {
        return Err(lacking(sheet, "left, right, or x, y", "it has neither wheels nor poses"));
    }
    if !roles.has(Time) {
        return Err(lacking(sheet, "t", "every row needs its time"));
    }
    // Of a given column nothing but the unit that is given with it is looked at.
    let by_name = roles.of.iter().filter(|(_, chosen)| chosen.basis.confidence != Confidence::Given);
    for (quantity, chosen) in by_name.filter(|_| sheet.header_line.is_some()) {
        let name = &sheet.names[chosen.index];
        if let Some(unit) = unreadable_unit(name, |unit| quantity.accepts(unit)) {
            let key = quantity.key();
            return Err(DatasetError::Foreign {
                file: sheet.file.clone(),
                line: sheet.header_line.unwrap_or(1),
                message: format!(
                    "column \"{}\" is taken as {key}, which is never read in \"{}\"; say in which unit it is with --map {key}=COLUMN[UNIT]",
                    shown(name.as_bytes()),
                    shown(unit.as_bytes()),
                ),
            });
        }
    }
    Ok(roles)
}

fn lacking(sheet: &Sheet, missing: &str, why: &str) -> DatasetError {
    let example = missing.split(", ").next().unwrap_or(missing);
    DatasetError::Foreign {
        file: sheet.file.clone(),
        line: sheet.header_line.unwrap_or(1),
        message: format!(
            "no column is known as {missing}: {why}; the columns are: {}; say which with --map {example}=COLUMN",
            listed(&sheet.names)
        ),
    }
}

fn without_header(sheet: &Sheet) -> DatasetError {
    let first = sheet.text.lines().nth(sheet.first_row as usize - 1).unwrap_or_default();
    let usual = ["t=1", "left=2", "right=3", "x=4", "y=5", "theta=6"];
    DatasetError::Foreign {
        file: sheet.file.clone(),
        line: sheet.first_row,
        message: format!(
            "no header says what the {} columns are; the first row is {}; say it by the columns' numbers, like --map {}",
            sheet.names.len(),
            shown(first.as_bytes()),
            usual[..sheet.names.len().clamp(3, 6)].join(",")
        ),
    }
}

/// The cells of a sheet that are needed.
#[derive(Debug)]
pub(super) struct Log {
    /// Line of each row, from 1.
    pub(super) lines: Vec<u64>,
    /// In units of 10⁻¹² of the column's; of picoseconds once the unit is known.
    pub(super) time: Vec<i128>,
    /// Which of `run_names` each row belongs to.
    pub(super) run: Vec<u32>,
    pub(super) run_names: Vec<String>,
    /// Both wheels, or speed and yaw rate; NaN where a cell is empty.
    pub(super) wheels: Option<[Vec<f64>; 2]>,
    /// NaN where a cell is empty or NaN.
    pub(super) pose: Option<PoseColumns>,
}

/// Positions and headings as they are written.
#[derive(Debug, Default)]
pub(super) struct PoseColumns {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// NaN where there is none.
    pub(super) theta: Vec<f64>,
}

impl Log {
    pub(super) fn read(sheet: &Sheet, roles: &Roles) -> Result<Self, DatasetError> {
        let index = |quantity: Quantity| roles.of.get(&quantity).map(|chosen| chosen.index);
        let (time, run) = (index(Quantity::Time).unwrap_or(0), index(Quantity::Run));
        let wheels = roles.wheels().map(|pair| pair.map(|quantity| roles.of[&quantity].index));
        let position = index(Quantity::X).zip(index(Quantity::Y));
        let heading = index(Quantity::Heading);
        let quaternion = [Quantity::Qx, Quantity::Qy, Quantity::Qz, Quantity::Qw].map(index);
        let mut log = Self {
            lines: Vec::new(),
            time: Vec::new(),
            run: Vec::new(),
            run_names: Vec::new(),
            wheels: wheels.map(|_| Default::default()),
            pose: position.map(|_| PoseColumns::default()),
        };
        let mut known: HashMap<&str, u32> = HashMap::new();
        sheet.for_each_row(|line, fields| {
            let fault = |column: usize, found: Option<f64>| {
                let (file, found_text) = (sheet.file.clone(), shown(fields[column].as_bytes()));
                let column = sheet.names[column].clone();
                if found.is_some() {
                    DatasetError::NotFinite { file, line, column, found: found_text }
                } else {
                    DatasetError::NotANumber { file, line, column, found: found_text }
                }
            };
            let number = |column: usize| match fields[column] {
                "" => Ok(f64::NAN),
                text => sheet.decimal.number(text).ok_or_else(|| fault(column, None)),
            };
            let stamp =
                sheet.decimal.exact(fields[time]).ok_or_else(|| fault(time, sheet.decimal.number(fields[time])))?;
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
                    let value = number(column)?;
                    if !value.is_finite() && !fields[column].is_empty() {
                        return Err(fault(column, Some(value)));
                    }
                    values.push(value);
                }
            }
            if let (Some((x, y)), Some(pose)) = (position, &mut log.pose) {
                pose.x.push(number(x)?);
                pose.y.push(number(y)?);
                let theta = match (heading, quaternion) {
                    (Some(heading), _) => number(heading)?,
                    (None, [Some(x), Some(y), Some(z), Some(w)]) => {
                        let parts = [number(x)?, number(y)?, number(z)?, number(w)?];
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

    /// Which run a row belongs to.
    pub(super) fn run_of(&self, row: usize) -> u32 {
        self.run.get(row).copied().unwrap_or(0)
    }

    /// Whether a row says something of the wheels.
    pub(super) fn has_wheels_at(&self, row: usize) -> bool {
        self.wheels.as_ref().is_some_and(|wheels| wheels.iter().all(|values| !values[row].is_nan()))
    }

    /// Whether a row says where the robot stood.
    pub(super) fn has_pose_at(&self, row: usize) -> bool {
        self.pose.as_ref().is_some_and(|pose| pose.x[row].is_finite() && pose.y[row].is_finite())
    }
}

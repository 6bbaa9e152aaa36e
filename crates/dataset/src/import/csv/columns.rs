//! Which column of a sheet is what, and what its cells say.

use std::collections::BTreeMap;

use super::options::{FileRole, MapEntry, Options};
use super::sheet::Sheet;
use super::took::{Basis, Confidence};
use crate::column_names::{NameReading, Quantity, read_name};
use crate::error::{DatasetError, shown};
use crate::name_units::{tokens_of, unreadable_unit};
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
    /// The name says that the wheel is an angle.
    pub(super) is_angle: bool,
    /// An outside instrument's by name.
    pub(super) is_outside: bool,
}

/// The columns of one sheet.
#[derive(Debug, Default)]
pub(super) struct Roles {
    pub(super) of: BTreeMap<Quantity, Chosen>,
    pub(super) left_out: Vec<String>,
    /// What a user should read of the choice.
    pub(super) remarks: Vec<String>,
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

    pub(super) fn has_gyro(&self) -> bool {
        self.has(Quantity::Gyro)
    }

    /// Leaves quantities out, so that they are listed among what was.
    pub(super) fn leave_out(&mut self, sheet: &Sheet, is_meant: impl Fn(Quantity) -> bool) {
        let left_out = self.of.extract_if(.., |quantity, _| is_meant(*quantity));
        self.left_out.extend(left_out.map(|(_, chosen)| sheet.names[chosen.index].clone()));
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
pub(super) fn refuse_unknown_columns(sheets: &[(Sheet, FileRole)], options: &Options) -> Result<(), DatasetError> {
    let runs_by = options.runs_by.iter().map(|column| (FileRole::Any, column, "--runs-by"));
    let columns = options.map.iter().map(|entry| (entry.role, &entry.column, "--map")).chain(runs_by);
    let refused = |message: String| Err(sheets[0].0.foreign_header(message));
    for (of, column, flag) in columns {
        let meant: Vec<&Sheet> =
            sheets.iter().filter(|(_, role)| of == FileRole::Any || of == *role).map(|(sheet, _)| sheet).collect();
        if meant.is_empty() {
            let prefix = of.prefix();
            return refused(format!("--map {prefix}: holds for the files of --{prefix}; say --{prefix} FILE"));
        }
        if meant.iter().all(|sheet| mapped(sheet, column).is_none()) {
            let has = |sheet: &&Sheet| format!("{} has {}", sheet.file.display(), listed(&sheet.names));
            let names: Vec<String> = meant.iter().map(has).collect();
            return refused(format!("{flag}: no column \"{}\"; {}", shown(column.as_bytes()), names.join("; ")));
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

/// The columns that the user names, each with its unit where that is said.
fn given_columns(sheet: &Sheet, role: FileRole, options: &Options) -> Vec<(Quantity, usize, Option<Unit>)> {
    let mut given = Vec::new();
    for MapEntry { role: of, quantity, column, unit } in &options.map {
        if role.reads(*quantity) && (*of == FileRole::Any || *of == role) {
            given.extend(mapped(sheet, column).map(|index| (*quantity, index, *unit)));
        }
    }
    let run = options.runs_by.as_ref().and_then(|column| mapped(sheet, column));
    given.extend(run.map(|index| (Quantity::Run, index, None)));
    given
}

/// Decides what the columns of a sheet are: by the user's word, else by their names.
pub(super) fn roles(sheet: &Sheet, role: FileRole, options: &Options) -> Result<Roles, DatasetError> {
    let mut roles = Roles::default();
    let given = given_columns(sheet, role, options);
    if sheet.header_line.is_none() && given.is_empty() {
        return Err(without_header(sheet, role));
    }
    let joints = joint_names(sheet)?;
    let reading = |index: usize| -> Option<NameReading> {
        let name = joints.get(&index).unwrap_or(&sheet.names[index]);
        let mut reading = sheet.header_line.and_then(|_| read_name(name))?;
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
        let is_angle = named.is_some_and(|named| named.is_angle);
        let basis = Basis::new(Confidence::Given, "--map");
        // What the user names is meant for what it is named.
        roles.of.insert(
            quantity,
            Chosen { index, unit, basis, unit_basis, is_rate, is_counted, is_angle, is_outside: true },
        );
    }
    let mut by_name: BTreeMap<Quantity, Vec<(usize, NameReading)>> = BTreeMap::new();
    for index in (0..sheet.names.len()).filter(|index| given.iter().all(|(_, taken, _)| taken != index)) {
        match reading(index) {
            Some(reading) if !reading.is_own && role.reads(reading.quantity) && !roles.has(reading.quantity) => {
                by_name.entry(reading.quantity).or_default().push((index, reading));
            }
            _ => roles.left_out.push(sheet.names[index].clone()),
        }
    }
    take_nanoseconds(sheet, &mut by_name, &mut roles.left_out);
    // A wheel is logged in one form: the one that both columns have.
    let rank_of = |quantity| by_name.get(&quantity).and_then(|all| all.iter().map(|(_, reading)| reading.rank).max());
    let wheel_rank = rank_of(Quantity::Left).zip(rank_of(Quantity::Right)).map(|(left, right)| left.min(right));
    let mut undecided: BTreeMap<Quantity, DatasetError> = BTreeMap::new();
    for (quantity, candidates) in by_name {
        let is_wheel = matches!(quantity, Quantity::Left | Quantity::Right);
        let best = candidates.iter().map(|(_, reading)| reading.rank).max().unwrap_or(0);
        let best = wheel_rank.filter(|_| is_wheel).unwrap_or(best);
        let (chosen, others): (Vec<_>, Vec<_>) = candidates.into_iter().partition(|(_, reading)| reading.rank == best);
        roles.left_out.extend(others.into_iter().map(|(index, _)| sheet.names[index].clone()));
        if let [first, second, ..] = &chosen[..] {
            let [first, second] = [first.0, second.0].map(|index| shown(sheet.names[index].as_bytes()));
            undecided.insert(
                quantity,
                DatasetError::Undecided {
                    file: sheet.file.clone(),
                    what: format!("column {}", quantity.key()),
                    flag: format!("--map {}={first} or --map {}={second}", quantity.key(), quantity.key()),
                    readings: format!("{first} or {second}"),
                },
            );
            roles.left_out.extend(chosen.into_iter().map(|(index, _)| sheet.names[index].clone()));
            continue;
        }
        if let Some(&(index, NameReading { unit, is_rate, is_counted, is_angle, is_outside, .. })) = chosen.first() {
            let basis = Basis::new(Confidence::Likely, "name");
            let unit_basis = Basis::new(Confidence::Certain, "name");
            roles
                .of
                .insert(quantity, Chosen { index, unit, basis, unit_basis, is_rate, is_counted, is_angle, is_outside });
        }
    }
    if let Some((_, error)) = undecided.into_iter().find(|(quantity, _)| is_needed(*quantity, &roles)) {
        return Err(error);
    }
    settle(sheet, role, roles)
}

/// Columns of arrays as tables of `JointState` have them: `position[1]` is called by what `name[1]` holds in
/// all rows.
fn joint_names(sheet: &Sheet) -> Result<BTreeMap<usize, String>, DatasetError> {
    let indexed = |name: &str| {
        let (stem, number) = name.strip_suffix(']')?.rsplit_once('[')?;
        let (path, field) = stem.rsplit_once(['.', '/']).unwrap_or(("", stem));
        Some((path.to_owned(), field.to_owned(), number.parse::<usize>().ok()?))
    };
    let columns: Vec<_> = sheet.names.iter().map(|name| indexed(name)).collect();
    let mut names: BTreeMap<(String, usize), (usize, Option<String>)> = BTreeMap::new();
    for (index, column) in columns.iter().enumerate() {
        if let Some((path, _, number)) = column.as_ref().filter(|(_, field, _)| field == "name") {
            names.insert((path.clone(), *number), (index, None));
        }
    }
    if names.is_empty() {
        return Ok(BTreeMap::new());
    }
    let mut is_first = true;
    sheet.for_each_row(|_, fields| {
        for (index, name) in names.values_mut() {
            if is_first {
                *name = Some(fields[*index].to_owned());
            } else if name.as_deref() != Some(fields[*index]) {
                *name = None;
            }
        }
        is_first = false;
        Ok(())
    })?;
    let named = columns.into_iter().enumerate().filter_map(|(index, column)| {
        let (path, field, number) = column?;
        let name = names.get(&(path, number))?.1.as_ref().filter(|_| field != "name")?;
        Some((index, format!("{name} {field}")))
    });
    Ok(named.collect())
}

/// Whether a quantity that two columns may be must be known beside those that are.
fn is_needed(quantity: Quantity, roles: &Roles) -> bool {
    use Quantity::{Gyro, Heading, Left, Qw, Qx, Qy, Qz, Right, Speed, X, Y, YawRate};
    let all = |of: &[Quantity]| of.iter().all(|quantity| roles.has(*quantity));
    match quantity {
        Speed | YawRate => !all(&[Left, Right]),
        Left | Right => !all(&[Speed, YawRate]),
        Heading => !all(&[Qx, Qy, Qz, Qw]),
        Qx | Qy | Qz | Qw => !roles.has(Heading) && all(&[X, Y]),
        // Two gyroscopes beside poses: an instrument more, which a user may name.
        Gyro => !all(&[X, Y]),
        _ => true,
    }
}

/// Takes the nanoseconds out of the columns of time: for what they are, or, where the seconds next to them
/// are not the time, among what is left out.
fn take_nanoseconds(
    sheet: &Sheet,
    by_name: &mut BTreeMap<Quantity, Vec<(usize, NameReading)>>,
    left_out: &mut Vec<String>,
) {
    let Some(stamps) = by_name.get_mut(&Quantity::Time) else { return };
    let Some((seconds, nanos)) = seconds_and_nanoseconds(sheet, stamps) else { return };
    let taken = stamps.extract_if(.., |(index, _)| *index == nanos).next();
    let best = stamps.iter().map(|(_, reading)| reading.rank).max().unwrap_or(0);
    if stamps.iter().any(|(index, reading)| *index == seconds && reading.rank == best) {
        by_name.entry(Quantity::Nanoseconds).or_default().extend(taken);
    } else {
        left_out.push(sheet.names[nanos].clone());
    }
}

/// Of columns of time the two that are whole seconds and the nanoseconds beside them, as messages of ROS are
/// written field by field: `sec`, `nanosec`.
fn seconds_and_nanoseconds(sheet: &Sheet, stamps: &[(usize, NameReading)]) -> Option<(usize, usize)> {
    const SECONDS: [&str; 4] = ["s", "sec", "secs", "seconds"];
    const NANOSECONDS: [&str; 7] = ["ns", "nsec", "nsecs", "nanosec", "nanosecs", "nanos", "nanoseconds"];
    let stem = |index: usize, last_words: &[&str]| {
        let mut words = tokens_of(&sheet.names[index]);
        let last = words.pop()?;
        last_words.contains(&last.as_str()).then_some(words)
    };
    let whole = |text: &str| sheet.decimal.number(text).filter(|value| value.fract() == 0.0);
    let pairs = stamps.iter().flat_map(|(seconds, _)| stamps.iter().map(move |(nanos, _)| (*seconds, *nanos)));
    let mut pairs = pairs.filter(|(seconds, nanos)| {
        stem(*seconds, &SECONDS).is_some_and(|words| stem(*nanos, &NANOSECONDS) == Some(words))
    });
    pairs.find(|&(seconds, nanos)| {
        let mut is_joined = true;
        // A row of another length is refused where rows are read.
        let _ = sheet.for_each_row(|_, fields| {
            is_joined &= whole(fields[seconds]).is_some();
            is_joined &= whole(fields[nanos]).is_some_and(|value| (0.0..1e9).contains(&value));
            Ok(())
        });
        is_joined
    })
}

/// Leaves out what is said twice, and refuses what is said by half.
fn settle(sheet: &Sheet, role: FileRole, mut roles: Roles) -> Result<Roles, DatasetError> {
    use Quantity::{Gyro, Heading, Left, Qw, Qx, Qy, Qz, Right, Speed, Time, X, Y, YawRate};
    if roles.has(Left) && roles.has(Right) {
        take_yaw_rate_for_gyro(sheet, &mut roles);
        roles.leave_out(sheet, |of| matches!(of, Speed | YawRate));
    }
    let quaternion = [Qx, Qy, Qz, Qw].iter().all(|part| roles.has(*part));
    // A heading alone, without a position, is no pose; a position without a whole quaternion has none.
    if roles.has(Heading) || !quaternion || !roles.has(X) {
        roles.leave_out(sheet, |of| matches!(of, Qx | Qy | Qz | Qw));
    }
    if !roles.has(X) && !roles.has(Y) {
        roles.leave_out(sheet, |of| of == Heading);
    }
    let pairs = [(Left, Right), (Right, Left), (X, Y), (Y, X), (Speed, YawRate), (YawRate, Speed)];
    for (there, missing) in pairs {
        if roles.has(there) && !roles.has(missing) {
            // A speed beside poses is the instrument's; so is a yaw rate.
            if matches!(there, Speed | YawRate) && (roles.has_pose() || roles.has_gyro()) {
                roles.leave_out(sheet, |of| of == there);
                continue;
            }
            let name = &sheet.names[roles.of[&there].index];
            return Err(lacking(sheet, missing.key(), &format!("\"{}\" is {}", shown(name.as_bytes()), there.key())));
        }
    }
    match role {
        FileRole::Wheels if !roles.has_wheels() && !roles.has_gyro() => {
            let message = format!(
                "no columns of wheels, left and right or v and omega; the columns are: {}; say which with --map left=COLUMN,right=COLUMN",
                listed(&sheet.names)
            );
            return Err(sheet.foreign_header(message));
        }
        FileRole::Truth if !roles.has_pose() => return Err(lacking(sheet, "x, y", "--truth: it has no poses")),
        _ if !roles.has_wheels() && !roles.has_pose() && !roles.has(Gyro) => {
            return Err(lacking(sheet, "left, right, or x, y", "it has neither wheels nor poses"));
        }
        _ => {}
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
            return Err(sheet.foreign_header(format!(
                "column \"{}\" is taken as {key}, which is never read in \"{}\"; say in which unit it is with --map {key}=COLUMN[UNIT]",
                shown(name.as_bytes()),
                shown(unit.as_bytes()),
            )));
        }
    }
    Ok(roles)
}

/// Beside both wheels and without a speed, an Imu's usual names of a yaw rate are a gyroscope's.
fn take_yaw_rate_for_gyro(sheet: &Sheet, roles: &mut Roles) {
    let usual: [&[&str]; 2] = [&["wz"], &["angular", "velocity", "z"]];
    let is_usual = |name: &str| {
        let words = tokens_of(name);
        usual.iter().any(|usual| {
            words.iter().rev().map(String::as_str).zip(usual.iter().rev()).all(|(a, b)| a == *b)
                && words.len() >= usual.len()
        })
    };
    let is_alone = !roles.has(Quantity::Speed) && !roles.has(Quantity::Gyro);
    let named = roles.of.get(&Quantity::YawRate).filter(|chosen| chosen.basis.confidence != Confidence::Given);
    let Some(name) = named.map(|chosen| sheet.names[chosen.index].clone()).filter(|name| is_alone && is_usual(name))
    else {
        return;
    };
    if let Some(chosen) = roles.of.remove(&Quantity::YawRate) {
        roles.of.insert(Quantity::Gyro, chosen);
        roles.remarks.push(format!(
            "{}: column {name} is taken as a gyroscope's yaw rate; if it is computed from the wheels, say --map omega={name}",
            sheet.file.display()
        ));
    }
}

fn lacking(sheet: &Sheet, missing: &str, why: &str) -> DatasetError {
    let example = missing.split(", ").next().unwrap_or(missing);
    sheet.foreign_header(format!(
        "no column is known as {missing}: {why}; the columns are: {}; say which with --map {example}=COLUMN",
        listed(&sheet.names)
    ))
}

fn without_header(sheet: &Sheet, role: FileRole) -> DatasetError {
    let first = sheet.text.lines().nth(sheet.first_row as usize - 1).unwrap_or_default();
    let usual = match role {
        FileRole::Any => ["t=1", "left=2", "right=3", "x=4", "y=5", "theta=6"],
        FileRole::Wheels => ["wheels:t=1", "left=2", "right=3", "", "", ""],
        FileRole::Truth => ["truth:t=1", "x=2", "y=3", "theta=4", "", ""],
    };
    let usual: Vec<&str> = usual.into_iter().filter(|entry| !entry.is_empty()).collect();
    let most = usual.len();
    let message = format!(
        "no header says what the {} columns are; the first row is {}; say it by the columns' numbers, like --map {}",
        sheet.names.len(),
        shown(first.as_bytes()),
        usual[..sheet.names.len().clamp(3, most)].join(",")
    );
    sheet.foreign(sheet.first_row, message)
}

/// A unit that is said or named, or all that it may be.
pub(super) fn known_or(chosen: &Chosen, flag: Option<Unit>, name: &str, all: &[Unit]) -> (Vec<Unit>, Basis) {
    match (chosen.unit, flag) {
        (Some(unit), _) if chosen.unit_basis.confidence == Confidence::Given => (vec![unit], chosen.unit_basis.clone()),
        (_, Some(unit)) => (vec![unit], Basis::new(Confidence::Given, name)),
        (Some(unit), None) => (vec![unit], chosen.unit_basis.clone()),
        (None, None) => (all.to_vec(), Basis::new(Confidence::Likely, "")),
    }
}

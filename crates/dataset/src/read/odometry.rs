//! `odometry.csv`: what the robot counted, in one of four forms.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use kinematics::{Side, Wheels};

use crate::counter;
use crate::error::{DatasetError, shown};
use crate::record::{ExtraChannel, Odometry, Run, WheelLog};
use crate::table::{MARKED_ROWS, Row, RunIndex, Survey, Table};
use crate::warning::Warning;

const HEADER: &str = "a header like run,t_s,left_ticks,right_ticks";

/// The forms in which wheels are reported, the most telling first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Ticks,
    Angles,
    Speeds,
    Twist,
}

impl Form {
    const ALL: [Self; 4] = [Self::Ticks, Self::Angles, Self::Speeds, Self::Twist];

    const fn columns(self) -> [&'static str; 2] {
        match self {
            Self::Ticks => ["left_ticks", "right_ticks"],
            Self::Angles => ["left_rad", "right_rad"],
            Self::Speeds => ["left_mps", "right_mps"],
            Self::Twist => ["v_mps", "omega_radps"],
        }
    }

    const fn names(self) -> &'static str {
        match self {
            Self::Ticks => "left_ticks,right_ticks",
            Self::Angles => "left_rad,right_rad",
            Self::Speeds => "left_mps,right_mps",
            Self::Twist => "v_mps,omega_radps",
        }
    }

    fn empty_log(self, rows: usize) -> WheelLog {
        match self {
            Self::Ticks => WheelLog::Ticks(Wheels::from_sides(|_| exactly(rows))),
            Self::Angles => WheelLog::Angles(Wheels::from_sides(|_| exactly(rows))),
            Self::Speeds => WheelLog::Speeds(Wheels::from_sides(|_| exactly(rows))),
            Self::Twist => WheelLog::Twist { v_mps: exactly(rows), omega_radps: exactly(rows) },
        }
    }
}

/// A vector that will hold so many items and has room for no more.
fn exactly<T>(rows: usize) -> Vec<T> {
    let mut column = Vec::new();
    column.reserve_exact(rows);
    column
}

/// The open table.
#[derive(Debug)]
pub(super) struct OdometryTable {
    table: Table,
    columns: Columns,
}

/// Where its columns stand.
#[derive(Debug)]
struct Columns {
    t_s: usize,
    form: Form,
    wheels: [usize; 2],
    extra: Vec<(ExtraChannel, usize)>,
}

impl OdometryTable {
    pub(super) fn open(file: &Path, warnings: &mut Vec<Warning>) -> Result<Self, DatasetError> {
        let table = Table::open(file, HEADER)?;
        table.require(crate::table::RUN_COLUMN)?;
        let t_s = table.require("t_s")?;
        let has_any = |form: &Form| form.columns().iter().any(|column| table.column(column).is_some());
        let has_both = |form: &Form| form.columns().iter().all(|column| table.column(column).is_some());
        // A whole pair before half a pair: that one then names what it lacks.
        let form = Form::ALL.into_iter().find(has_both).or_else(|| Form::ALL.into_iter().find(has_any));
        let Some(form) = form else {
            let alternatives: Vec<_> = Form::ALL.into_iter().map(Form::names).collect();
            return Err(table.missing(&alternatives.join(" or ")));
        };
        let [first, second] = form.columns();
        let wheels = [table.require(first)?, table.require(second)?];
        let mut known = vec!["t_s"];
        known.extend(Form::ALL.iter().flat_map(|form| form.columns()));
        known.extend(ExtraChannel::ALL.map(ExtraChannel::column));
        table.warn_of_unknown(&known, warnings);
        for column in Form::ALL.into_iter().filter(|other| *other != form).flat_map(Form::columns) {
            if table.column(column).is_some() {
                warnings.push(Warning::RedundantColumn { file: file.to_owned(), column, used: form.names() });
            }
        }
        let extra = ExtraChannel::ALL
            .into_iter()
            .filter_map(|channel| Some((channel, table.column(channel.column())?)))
            .collect();
        Ok(Self { table, columns: Columns { t_s, form, wheels, extra } })
    }

    /// Has it a column of a gyroscope?
    pub(super) fn has_gyro(&self) -> bool {
        self.columns.extra.iter().any(|(channel, _)| *channel == ExtraChannel::GyroYawRate)
    }

    pub(super) fn has_ticks(&self) -> bool {
        self.columns.form == Form::Ticks
    }

    /// Where each run's rows are; goes back to the first.
    pub(super) fn survey(&mut self, index: &RunIndex, marked: bool) -> Result<Survey, DatasetError> {
        self.table.survey(index, marked.then_some(self.columns.t_s))
    }

    /// Fills every run's odometry.
    pub(super) fn read(mut self, index: &RunIndex, runs: &mut [Run]) -> Result<(), DatasetError> {
        let rows = self.table.survey(index, None)?.rows;
        for (run, &rows) in runs.iter_mut().zip(&rows) {
            run.odometry = self.columns.empty(rows);
        }
        self.table.for_each_row(index, |run, row| self.columns.push(&mut runs[run].odometry, row, rows[run]))?;
        // Only now: a fault in a row is the better reason, as it may be what cut the file short.
        runs.iter().zip(rows).try_for_each(|(run, rows)| self.has_rows(run, rows))
    }

    /// Fills one run's odometry.
    pub(super) fn read_run(&mut self, number: usize, survey: &Survey, run: &mut Run) -> Result<(), DatasetError> {
        let rows = survey.rows[number];
        self.has_rows(run, rows)?;
        run.odometry = self.columns.empty(rows);
        self.table.for_each_row_of(number, survey, |row| self.columns.push(&mut run.odometry, row, rows))
    }

    /// Fills a part of one run's odometry: rows from a mark on.
    pub(super) fn read_rows(
        &mut self,
        number: usize,
        survey: &Survey,
        rows: Range<usize>,
        run: &mut Run,
    ) -> Result<(), DatasetError> {
        self.has_rows(run, survey.rows[number])?;
        run.odometry = self.columns.empty(rows.len());
        let from = survey.marks[number][rows.start / MARKED_ROWS].position;
        let push = |row: &Row<'_>| self.columns.push(&mut run.odometry, row, rows.len());
        self.table.for_each_row_from(from, rows.len(), push)
    }

    fn has_rows(&self, run: &Run, rows: usize) -> Result<(), DatasetError> {
        if rows > 0 {
            return Ok(());
        }
        let (file, run) = (self.table.file().to_owned(), shown(run.info.id.as_bytes()));
        Err(DatasetError::RunWithoutRows { file, run })
    }
}

impl Columns {
    fn empty(&self, rows: usize) -> Odometry {
        Odometry { t_s: exactly(rows).into(), wheels: self.form.empty_log(rows), extra: BTreeMap::default() }
    }

    /// Adds a row to a run that will have `rows`.
    fn push(&self, odometry: &mut Odometry, row: &Row<'_>, rows: usize) -> Result<(), DatasetError> {
        let first = odometry.t_s.is_empty();
        let t_s = row.time_after(self.t_s, odometry.t_s.last().copied())?;
        odometry.t_s.push(t_s);
        match &mut odometry.wheels {
            WheelLog::Ticks(ticks) => {
                ticks.left.push(row.count(self.wheels[0])?);
                ticks.right.push(row.count(self.wheels[1])?);
            }
            WheelLog::Angles(columns) | WheelLog::Speeds(columns) => {
                columns.left.push(row.number(self.wheels[0])?);
                columns.right.push(row.number(self.wheels[1])?);
            }
            WheelLog::Twist { v_mps, omega_radps } => {
                v_mps.push(row.number(self.wheels[0])?);
                omega_radps.push(row.number(self.wheels[1])?);
            }
        }
        for &(channel, column) in &self.extra {
            push_extra(odometry, channel, row, column, first.then_some(rows))?;
        }
        Ok(())
    }
}

/// A run whose first row leaves a channel empty does not have it; else every row must, but for channels that
/// may have gaps.
fn push_extra(
    odometry: &mut Odometry,
    channel: ExtraChannel,
    row: &Row<'_>,
    column: usize,
    rows_if_first: Option<usize>,
) -> Result<(), DatasetError> {
    let is_empty = row.bytes(column).is_empty();
    if channel.may_have_gaps() {
        let read = odometry.t_s.len() - 1;
        if is_empty {
            if let Some(values) = odometry.extra.get_mut(&channel) {
                values.push(f64::NAN);
            }
        } else {
            let value = row.number(column)?;
            odometry.extra.entry(channel).or_insert_with(|| vec![f64::NAN; read]).push(value);
        }
        return Ok(());
    }
    if let Some(rows) = rows_if_first
        && !is_empty
    {
        odometry.extra.insert(channel, exactly(rows));
    }
    match odometry.extra.get_mut(&channel) {
        Some(values) => values.push(row.number(column)?),
        None if is_empty => {}
        None => {
            let (file, line, column) = (row.file(), row.line(), channel.column());
            return Err(DatasetError::SparseColumn { file, line, column });
        }
    }
    Ok(())
}

/// Unwraps both counters of a run.
pub(super) fn unwrap_counters(run: &mut Run, bits: u8) {
    if let WheelLog::Ticks(ticks) = &mut run.odometry.wheels {
        for side in Side::BOTH {
            counter::unwrap(&mut ticks[side], bits);
        }
    }
}

/// The columns of the wheels, for the writer.
pub(crate) fn wheel_columns(wheels: &WheelLog) -> [&'static str; 2] {
    match wheels {
        WheelLog::Ticks(_) => Form::Ticks.columns(),
        WheelLog::Angles(_) => Form::Angles.columns(),
        WheelLog::Speeds(_) => Form::Speeds.columns(),
        WheelLog::Twist { .. } => Form::Twist.columns(),
    }
}

//! The tables of an outside instrument: poses, displacements, marked points and wheel speeds, and the list of
//! all tables that measure something of the robot.

use std::path::Path;

use kinematics::{Point, Wheels};

use super::columns::{PointIndex, TruthColumns};
use super::partial::{
    DISTANCE, DistanceColumns, GYRO, GyroColumns, REVISIT, RevisitColumns, WALL, WallColumns, nothing_measured,
};
use crate::error::{DatasetError, shown};
use crate::partial::HeadingReading;
use crate::pose_covariance::PoseCovariance;
use crate::record::{Displacement, PointReading, Run, TruthSample, TruthSigma, WheelSpeed};
use crate::table::{MARKED_ROWS, RUN_COLUMN, Row, RunIndex, Survey, Table};
use crate::warning::Warning;

pub(crate) const TRUTH: &str = "truth.csv";
pub(crate) const DISPLACEMENT: &str = "displacement.csv";
pub(crate) const POINTS: &str = "points.csv";
pub(crate) const WHEEL_REFERENCE: &str = "wheel_reference.csv";

/// The columns of a table, or what it lacks.
type Found = Result<Box<dyn TruthColumns>, DatasetError>;

/// One kind of table: adding one is one line in [`KINDS`] and its columns.
#[derive(Debug)]
struct Kind {
    file: &'static str,
    header: &'static str,
    known: &'static [&'static str],
    /// From its header, and the standard deviation of headings that the manifest states.
    find: fn(&Table, Option<f64>) -> Found,
}

const KINDS: [Kind; 8] = [
    Kind {
        file: TRUTH,
        header: "a header like run,t_s,x_m,y_m,theta_rad",
        known: &[
            "t_s",
            "x_m",
            "y_m",
            "theta_rad",
            "sigma_xy_m",
            "sigma_theta_rad",
            "cov_xx",
            "cov_xy",
            "cov_xt",
            "cov_yy",
            "cov_yt",
            "cov_tt",
        ],
        find: |table, sigma_rad| Ok(Box::new(PoseColumns::find(table, sigma_rad)?)),
    },
    Kind {
        file: DISPLACEMENT,
        header: "a header like run,t0_s,t1_s,dx_m,dy_m,dtheta_rad",
        known: &["t0_s", "t1_s", "dx_m", "dy_m", "dtheta_rad"],
        find: |table, _| Ok(Box::new(DisplacementColumns::find(table)?)),
    },
    Kind {
        file: POINTS,
        header: "a header like run,t_s,point,x_m,y_m",
        known: &["t_s", "point", "x_m", "y_m"],
        find: |table, _| Ok(Box::new(PointColumns::find(table)?)),
    },
    Kind {
        file: WHEEL_REFERENCE,
        header: "a header like run,t_s,left_mps,right_mps",
        known: &["t_s", "left_mps", "right_mps"],
        find: |table, _| Ok(Box::new(WheelReferenceColumns::find(table)?)),
    },
    Kind {
        file: REVISIT,
        header: "a header like run,t0_s,t1_s,sigma_xy_m,sigma_theta_rad",
        known: RevisitColumns::KNOWN,
        find: |table, _| Ok(Box::new(RevisitColumns::find(table)?)),
    },
    Kind {
        file: DISTANCE,
        header: "a header like run,t0_s,t1_s,distance_m,sigma_m",
        known: DistanceColumns::KNOWN,
        find: |table, _| Ok(Box::new(DistanceColumns::find(table)?)),
    },
    Kind {
        file: WALL,
        header: "a header like run,t_s,wall,distance_m,heading_rad,sigma_m,sigma_rad",
        known: WallColumns::KNOWN,
        find: |table, _| Ok(Box::new(WallColumns::find(table)?)),
    },
    Kind {
        file: GYRO,
        header: "a header like run,t_s,omega_radps",
        known: GyroColumns::KNOWN,
        find: |table, _| Ok(Box::new(GyroColumns::find(table)?)),
    },
];

/// An open truth table.
#[derive(Debug)]
pub(super) struct TruthTable {
    name: &'static str,
    table: Table,
    columns: Box<dyn TruthColumns>,
}

/// Opens the truth tables that are there; one at least must be, unless a gyroscope stands beside the wheels.
pub(super) fn open_all(
    dir: &Path,
    has_gyro: bool,
    heading_sigma_rad: Option<f64>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<TruthTable>, DatasetError> {
    let mut tables = Vec::new();
    for kind in &KINDS {
        let file = dir.join(kind.file);
        if file.exists() {
            let table = Table::open(&file, kind.header)?;
            table.require(RUN_COLUMN)?;
            let columns = (kind.find)(&table, heading_sigma_rad)?;
            table.warn_of_unknown(kind.known, warnings);
            tables.push(TruthTable { name: kind.file, table, columns });
        }
    }
    if tables.is_empty() && !has_gyro { Err(DatasetError::NoTruth { dir: dir.to_owned() }) } else { Ok(tables) }
}

impl TruthTable {
    pub(super) const fn name(&self) -> &'static str {
        self.name
    }

    /// Where each run's rows are; goes back to the first.
    pub(super) fn survey(&mut self, index: &RunIndex, marked: bool) -> Result<Survey, DatasetError> {
        self.table.survey(index, self.columns.instant().filter(|_| marked))
    }

    /// Fills every run's records of this kind.
    pub(super) fn read(mut self, index: &RunIndex, points: &PointIndex, runs: &mut [Run]) -> Result<(), DatasetError> {
        let rows = self.table.survey(index, None)?.rows;
        for (run, &rows) in runs.iter_mut().zip(&rows) {
            self.columns.reserve(run, rows);
        }
        let columns = &self.columns;
        self.table.for_each_row(index, |run, row| columns.push(row, &mut runs[run], points))
    }

    /// Fills one run's records of this kind.
    pub(super) fn read_run(
        &mut self,
        number: usize,
        survey: &Survey,
        points: &PointIndex,
        run: &mut Run,
    ) -> Result<(), DatasetError> {
        self.columns.reserve(run, survey.rows[number]);
        let columns = &self.columns;
        self.table.for_each_row_of(number, survey, |row| columns.push(row, run, points))
    }

    /// Fills one run's records of this kind from one instant to a later one, both among them. The order is
    /// checked from the mark before to the mark behind, so that parts that touch check all of it.
    pub(super) fn read_between(
        &mut self,
        number: usize,
        survey: &Survey,
        from_s: f64,
        to_s: f64,
        points: &PointIndex,
        run: &mut Run,
    ) -> Result<(), DatasetError> {
        let (Some(instant), Some(marks)) = (self.columns.instant(), survey.marks.get(number)) else { return Ok(()) };
        let marks_until = |t_s: f64| marks.partition_point(|mark| mark.t_s <= t_s);
        let first = marks_until(from_s).saturating_sub(1);
        let Some(from) = marks.get(first) else { return Ok(()) };
        let rows = (marks_until(to_s) * MARKED_ROWS + 1).min(survey.rows[number]) - first * MARKED_ROWS;
        self.columns.reserve(run, rows);
        let columns = &self.columns;
        let mut previous_s = None;
        self.table.for_each_row_from(from.position, rows, |row| {
            let t_s = row.time_after(instant, previous_s)?;
            previous_s = Some(t_s);
            if t_s < from_s || t_s > to_s { Ok(()) } else { columns.push(row, run, points) }
        })
    }
}

#[derive(Debug)]
struct PoseColumns {
    t_s: usize,
    x_m: usize,
    y_m: usize,
    theta_rad: usize,
    sigma_xy_m: Option<usize>,
    sigma_theta_rad: Option<usize>,
    /// In the order of [`PoseCovariance::COLUMNS`].
    covariance: Option<[usize; 6]>,
    /// Standard deviation of a heading whose row states none, radians.
    stated_sigma_rad: Option<f64>,
}

impl PoseColumns {
    fn find(table: &Table, stated_sigma_rad: Option<f64>) -> Result<Self, DatasetError> {
        Ok(Self {
            stated_sigma_rad,
            t_s: table.require("t_s")?,
            x_m: table.require("x_m")?,
            y_m: table.require("y_m")?,
            theta_rad: table.require("theta_rad")?,
            sigma_xy_m: table.column("sigma_xy_m"),
            sigma_theta_rad: table.column("sigma_theta_rad"),
            covariance: Self::covariance_columns(table)?,
        })
    }

    /// All six columns, or none.
    fn covariance_columns(table: &Table) -> Result<Option<[usize; 6]>, DatasetError> {
        if PoseCovariance::COLUMNS.iter().all(|name| table.column(name).is_none()) {
            return Ok(None);
        }
        let mut columns = [0; 6];
        for (column, name) in columns.iter_mut().zip(PoseCovariance::COLUMNS) {
            *column = table.require(name)?;
        }
        Ok(Some(columns))
    }

    fn sigma(&self, row: &Row<'_>, has_heading: bool) -> Result<TruthSigma, DatasetError> {
        let of = |column: Option<usize>| column.map_or(Ok(None), |column| row.sigma(column));
        let covariance = self.covariance.map_or(Ok(None), |columns| Self::covariance(row, columns))?;
        Ok(TruthSigma {
            sigma_xy_m: of(self.sigma_xy_m)?,
            sigma_theta_rad: of(self.sigma_theta_rad)?,
            covariance: covariance.and_then(|stated| if has_heading { Some(stated) } else { stated.of_position() }),
        })
    }

    /// A row without a position.
    fn heading(&self, row: &Row<'_>, t_s: f64, theta_rad: Option<f64>) -> Result<HeadingReading, DatasetError> {
        let sigma = self.sigma(row, true)?;
        let of_row = sigma.covariance.map(|of| of.tt_rad2.sqrt()).filter(|sigma| *sigma > 0.0);
        let sigma_rad = of_row.or(sigma.sigma_theta_rad).or(self.stated_sigma_rad);
        match theta_rad.zip(sigma_rad) {
            Some((theta_rad, sigma_rad)) => Ok(HeadingReading { t_s, theta_rad, sigma_rad }),
            None if theta_rad.is_none() => Err(nothing_measured(row, "x_m and y_m, or theta_rad, or all three")),
            None => Err(nothing_measured(
                row,
                "sigma_theta_rad of a heading without a position, in the row or under [truth] in dataset.toml",
            )),
        }
    }

    /// The row's covariance; an empty cell is a zero.
    fn covariance(row: &Row<'_>, columns: [usize; 6]) -> Result<Option<PoseCovariance>, DatasetError> {
        let mut elements = [0.0; 6];
        for (element, column) in elements.iter_mut().zip(columns) {
            *element = row.optional_number(column)?.unwrap_or(0.0);
        }
        PoseCovariance::stated(elements).map_err(|why| DatasetError::ImpossibleCovariance {
            file: row.file(),
            line: row.line(),
            why,
        })
    }
}

impl TruthColumns for PoseColumns {
    fn instant(&self) -> Option<usize> {
        Some(self.t_s)
    }

    fn reserve(&self, run: &mut Run, rows: usize) {
        run.truth.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let last_s = [run.truth.last().map(|sample| sample.t_s), run.headings.last().map(|heading| heading.t_s)];
        let t_s = row.time_after(self.t_s, last_s.into_iter().flatten().reduce(f64::max))?;
        let theta_rad = row.optional_number(self.theta_rad)?;
        if row.bytes(self.x_m).is_empty() && row.bytes(self.y_m).is_empty() {
            run.headings.push(self.heading(row, t_s, theta_rad)?);
            return Ok(());
        }
        // A run gets the column once it has something to say: most tables never do.
        let sigma = self.sigma(row, theta_rad.is_some())?;
        if run.truth_sigma.is_none() && sigma != TruthSigma::UNKNOWN {
            let mut sigmas = Vec::new();
            sigmas.reserve_exact(run.truth.capacity());
            sigmas.resize(run.truth.len(), TruthSigma::UNKNOWN);
            run.truth_sigma = Some(sigmas);
        }
        if let Some(sigmas) = &mut run.truth_sigma {
            sigmas.push(sigma);
        }
        run.truth.push(TruthSample::new(t_s, row.number(self.x_m)?, row.number(self.y_m)?, theta_rad));
        Ok(())
    }
}

#[derive(Debug)]
struct DisplacementColumns {
    t0_s: usize,
    t1_s: usize,
    dx_m: usize,
    dy_m: usize,
    dtheta_rad: usize,
}

impl DisplacementColumns {
    fn find(table: &Table) -> Result<Self, DatasetError> {
        Ok(Self {
            t0_s: table.require("t0_s")?,
            t1_s: table.require("t1_s")?,
            dx_m: table.require("dx_m")?,
            dy_m: table.require("dy_m")?,
            dtheta_rad: table.require("dtheta_rad")?,
        })
    }
}

impl TruthColumns for DisplacementColumns {
    fn reserve(&self, run: &mut Run, rows: usize) {
        run.displacements.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let t0_s = row.time_after(self.t0_s, run.displacements.last().map(|before| before.t0_s))?;
        let t1_s = row.number(self.t1_s)?;
        if t1_s <= t0_s {
            return Err(DatasetError::EmptyInterval { file: row.file(), line: row.line(), t0_s, t1_s });
        }
        run.displacements.push(Displacement {
            t0_s,
            t1_s,
            dx_m: row.number(self.dx_m)?,
            dy_m: row.number(self.dy_m)?,
            dtheta_rad: row.number(self.dtheta_rad)?,
        });
        Ok(())
    }
}

#[derive(Debug)]
struct PointColumns {
    t_s: usize,
    point: usize,
    x_m: usize,
    y_m: usize,
}

impl PointColumns {
    fn find(table: &Table) -> Result<Self, DatasetError> {
        Ok(Self {
            t_s: table.require("t_s")?,
            point: table.require("point")?,
            x_m: table.require("x_m")?,
            y_m: table.require("y_m")?,
        })
    }
}

impl TruthColumns for PointColumns {
    fn reserve(&self, run: &mut Run, rows: usize) {
        run.point_readings.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, points: &PointIndex) -> Result<(), DatasetError> {
        let t_s = row.time_from(self.t_s, run.point_readings.last().map(|before| before.t_s))?;
        let id = row.bytes(self.point);
        let Some(&point) = points.by_id.get(id) else {
            let (point, known) = (shown(id), points.known.clone());
            return Err(DatasetError::UnknownPoint { file: row.file(), line: row.line(), point, known });
        };
        let same_instant = run.point_readings.iter().rev().take_while(|before| before.t_s == t_s);
        if same_instant.into_iter().any(|before| before.point == point) {
            return Err(row.duplicate_instant(self.t_s, t_s));
        }
        let room = Point::new(row.number(self.x_m)?, row.number(self.y_m)?);
        run.point_readings.push(PointReading { t_s, point, room });
        Ok(())
    }
}

#[derive(Debug)]
struct WheelReferenceColumns {
    t_s: usize,
    left_mps: usize,
    right_mps: usize,
}

impl WheelReferenceColumns {
    fn find(table: &Table) -> Result<Self, DatasetError> {
        Ok(Self {
            t_s: table.require("t_s")?,
            left_mps: table.require("left_mps")?,
            right_mps: table.require("right_mps")?,
        })
    }
}

impl TruthColumns for WheelReferenceColumns {
    fn reserve(&self, run: &mut Run, rows: usize) {
        run.wheel_reference.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let t_s = row.time_after(self.t_s, run.wheel_reference.last().map(|before| before.t_s))?;
        let speed_m_s = Wheels { left: row.number(self.left_mps)?, right: row.number(self.right_mps)? };
        run.wheel_reference.push(WheelSpeed { t_s, speed_m_s });
        Ok(())
    }
}

//! The tables of partial measurements: revisits, distances, walls, and a gyroscope by its own instants.

use super::columns::{PointIndex, TruthColumns};
use super::manifest::why_no_id;
use crate::error::DatasetError;
use crate::partial::{GyroSample, Revisit, TapeDistance, WallReading};
use crate::record::Run;
use crate::table::{Row, Table};

pub(crate) const REVISIT: &str = "revisit.csv";
pub(crate) const DISTANCE: &str = "distance.csv";
pub(crate) const WALL: &str = "wall.csv";
pub(crate) const GYRO: &str = "gyro.csv";

/// Start and end of a row between two instants, in the order of the starts.
fn interval(row: &Row<'_>, [t0, t1]: [usize; 2], before_s: Option<f64>) -> Result<[f64; 2], DatasetError> {
    let (t0_s, t1_s) = (row.time_from(t0, before_s)?, row.number(t1)?);
    if t1_s > t0_s {
        Ok([t0_s, t1_s])
    } else {
        Err(DatasetError::EmptyInterval { file: row.file(), line: row.line(), t0_s, t1_s })
    }
}

/// A standard deviation of something that was measured; an empty cell says that it was not.
fn stated(row: &Row<'_>, column: Option<usize>, key: &str) -> Result<Option<f64>, DatasetError> {
    let Some(column) = column else { return Ok(None) };
    match row.optional_number(column)? {
        Some(value) if value <= 0.0 => Err(DatasetError::NotPhysical {
            file: row.file(),
            line: row.line(),
            key: key.to_owned(),
            value,
            expected: "a positive standard deviation, or an empty cell where this was not measured",
        }),
        known => Ok(known),
    }
}

#[derive(Debug)]
pub(super) struct RevisitColumns {
    instants: [usize; 2],
    moved: [Option<usize>; 3],
    sigma_xy_m: Option<usize>,
    sigma_theta_rad: Option<usize>,
}

impl RevisitColumns {
    pub(super) const KNOWN: &[&str] = &["t0_s", "t1_s", "dx_m", "dy_m", "dtheta_rad", "sigma_xy_m", "sigma_theta_rad"];

    pub(super) fn find(table: &Table) -> Result<Self, DatasetError> {
        let (sigma_xy_m, sigma_theta_rad) = (table.column("sigma_xy_m"), table.column("sigma_theta_rad"));
        if sigma_xy_m.is_none() && sigma_theta_rad.is_none() {
            return Err(table.missing("sigma_theta_rad"));
        }
        let moved = ["dx_m", "dy_m", "dtheta_rad"].map(|column| table.column(column));
        Ok(Self { instants: [table.require("t0_s")?, table.require("t1_s")?], moved, sigma_xy_m, sigma_theta_rad })
    }
}

impl TruthColumns for RevisitColumns {
    fn reserve(&self, run: &mut Run, rows: usize) {
        run.revisits.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let [t0_s, t1_s] = interval(row, self.instants, run.revisits.last().map(|before| before.t0_s))?;
        let sigma_xy_m = stated(row, self.sigma_xy_m, "sigma_xy_m")?;
        let sigma_theta_rad = stated(row, self.sigma_theta_rad, "sigma_theta_rad")?;
        // Without a column it is the same place, or heading.
        let moved = |column: Option<usize>, sigma: Option<f64>| match (sigma, column) {
            (None, _) => Ok(None),
            (Some(_), None) => Ok(Some(0.0)),
            (Some(_), Some(column)) => row.optional_number(column),
        };
        let [dx_m, dy_m] = [moved(self.moved[0], sigma_xy_m)?, moved(self.moved[1], sigma_xy_m)?];
        let dtheta_rad = moved(self.moved[2], sigma_theta_rad)?;
        if [dx_m, dy_m, dtheta_rad] == [None; 3] {
            return Err(nothing_measured(row, "sigma_xy_m or sigma_theta_rad"));
        }
        run.revisits.push(Revisit { t0_s, t1_s, dx_m, dy_m, dtheta_rad, sigma_xy_m, sigma_theta_rad });
        Ok(())
    }
}

pub(super) fn nothing_measured(row: &Row<'_>, columns: &str) -> DatasetError {
    let message = format!("the row measures nothing; expected a value and its standard deviation: {columns}");
    DatasetError::Foreign { file: row.file(), line: row.line(), message }
}

#[derive(Debug)]
pub(super) struct DistanceColumns {
    instants: [usize; 2],
    distance_m: usize,
    sigma_m: usize,
}

impl DistanceColumns {
    pub(super) const KNOWN: &[&str] = &["t0_s", "t1_s", "distance_m", "sigma_m"];

    pub(super) fn find(table: &Table) -> Result<Self, DatasetError> {
        Ok(Self {
            instants: [table.require("t0_s")?, table.require("t1_s")?],
            distance_m: table.require("distance_m")?,
            sigma_m: table.require("sigma_m")?,
        })
    }
}

impl TruthColumns for DistanceColumns {
    fn reserve(&self, run: &mut Run, rows: usize) {
        run.distances.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let [t0_s, t1_s] = interval(row, self.instants, run.distances.last().map(|before| before.t0_s))?;
        let positive = |column: usize, key: &str, expected: &'static str| match row.number(column)? {
            value if value > 0.0 => Ok(value),
            value => {
                let (file, line, key) = (row.file(), row.line(), key.to_owned());
                Err(DatasetError::NotPhysical { file, line, key, value, expected })
            }
        };
        run.distances.push(TapeDistance {
            t0_s,
            t1_s,
            distance_m: positive(self.distance_m, "distance_m", "a positive length; a return is one of revisit.csv")?,
            sigma_m: positive(self.sigma_m, "sigma_m", "the tape's standard deviation, metres")?,
        });
        Ok(())
    }
}

#[derive(Debug)]
pub(super) struct WallColumns {
    t_s: usize,
    wall: usize,
    distance_m: Option<usize>,
    heading_rad: Option<usize>,
    sigma_m: Option<usize>,
    sigma_rad: Option<usize>,
}

impl WallColumns {
    pub(super) const KNOWN: &[&str] = &["t_s", "wall", "distance_m", "heading_rad", "sigma_m", "sigma_rad"];

    pub(super) fn find(table: &Table) -> Result<Self, DatasetError> {
        let [distance_m, heading_rad] = ["distance_m", "heading_rad"].map(|column| table.column(column));
        if distance_m.is_none() && heading_rad.is_none() {
            return Err(table.missing("heading_rad"));
        }
        let needed = |value: Option<usize>, column: &str| value.map(|_| table.require(column)).transpose();
        Ok(Self {
            t_s: table.require("t_s")?,
            wall: table.require("wall")?,
            distance_m,
            heading_rad,
            sigma_m: needed(distance_m, "sigma_m")?,
            sigma_rad: needed(heading_rad, "sigma_rad")?,
        })
    }
}

impl TruthColumns for WallColumns {
    fn reserve(&self, run: &mut Run, rows: usize) {
        run.walls.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let t_s = row.time_from(self.t_s, run.walls.last().map(|before| before.t_s))?;
        let wall = row.text(self.wall)?.to_owned();
        if let Some(expected) = why_no_id(&wall) {
            return Err(DatasetError::BadId { file: row.file(), line: row.line(), id: wall, expected });
        }
        if run.walls.iter().rev().take_while(|before| before.t_s == t_s).any(|before| before.wall == wall) {
            return Err(row.duplicate_instant(self.t_s, t_s));
        }
        let measured = |value: Option<usize>, sigma: Option<usize>, key: &str| {
            let value = value.map_or(Ok(None), |column| row.optional_number(column))?;
            let sigma = stated(row, sigma, key)?;
            Ok::<_, DatasetError>(value.zip(sigma))
        };
        let distance = measured(self.distance_m, self.sigma_m, "sigma_m")?;
        let heading = measured(self.heading_rad, self.sigma_rad, "sigma_rad")?;
        if distance.is_none() && heading.is_none() {
            return Err(nothing_measured(row, "distance_m with sigma_m, or heading_rad with sigma_rad"));
        }
        let (distance_m, sigma_m) = distance.unzip();
        let (heading_rad, sigma_rad) = heading.unzip();
        run.walls.push(WallReading { t_s, wall, distance_m, heading_rad, sigma_m, sigma_rad });
        Ok(())
    }
}

#[derive(Debug)]
pub(super) struct GyroColumns {
    t_s: usize,
    omega_radps: usize,
}

impl GyroColumns {
    pub(super) const KNOWN: &[&str] = &["t_s", "omega_radps"];

    pub(super) fn find(table: &Table) -> Result<Self, DatasetError> {
        Ok(Self { t_s: table.require("t_s")?, omega_radps: table.require("omega_radps")? })
    }
}

impl TruthColumns for GyroColumns {
    fn instant(&self) -> Option<usize> {
        Some(self.t_s)
    }

    fn reserve(&self, run: &mut Run, rows: usize) {
        run.gyro.reserve_exact(rows);
    }

    fn push(&self, row: &Row<'_>, run: &mut Run, _: &PointIndex) -> Result<(), DatasetError> {
        let t_s = row.time_after(self.t_s, run.gyro.last().map(|before| before.t_s))?;
        run.gyro.push(GyroSample { t_s, omega_radps: row.number(self.omega_radps)? });
        Ok(())
    }
}

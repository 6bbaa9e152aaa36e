//! Tables in which the rows of every run stand together: a run, or a part of one, is read where it stands.

use std::ops::Range;
use std::path::PathBuf;
use std::slice;

use super::columns::PointIndex;
use super::truth::TruthTable;
use super::{GYRO, Opened, has_truth, odometry, without_truth};
use crate::corrections::Corrections;
use crate::counted;
use crate::error::DatasetError;
use crate::record::{Dataset, NominalRobot, Run, RunInfo};
use crate::table::{MARKED_ROWS, Survey};
use crate::warning::Warning;

/// The tables, and where each run's rows are in them.
#[derive(Debug)]
pub(super) struct Grouped {
    manifest_file: PathBuf,
    infos: Vec<RunInfo>,
    run_lines: Vec<u64>,
    corrections: Corrections,
    odometry: odometry::OdometryTable,
    odometry_rows: Survey,
    truths: Vec<(TruthTable, Survey)>,
    points: PointIndex,
}

impl Grouped {
    /// Goes through the tables for where the rows are, with marks inside the runs if they are to be cut: the
    /// header, what was noticed, and the tables unless they mix the rows of several runs.
    pub(super) fn survey(opened: Opened, marked: bool) -> Result<(Dataset, Vec<Warning>, Option<Self>), DatasetError> {
        let Opened { mut dataset, manifest_file, run_lines, corrections, mut odometry, truths, index, warnings } =
            opened;
        let odometry_rows = odometry.survey(&index, marked)?;
        let mut surveyed = Vec::with_capacity(truths.len());
        for mut truth in truths {
            let rows = truth.survey(&index, marked)?;
            surveyed.push((truth, rows));
        }
        let infos = std::mem::take(&mut dataset.runs).into_iter().map(|run| run.info).collect();
        let points = PointIndex::new(&dataset.points);
        // Marks are of times as they stand in the files.
        let is_grouped = (corrections.is_none() || !marked)
            && odometry_rows.is_grouped
            && surveyed.iter().all(|(_, rows)| rows.is_grouped);
        let grouped =
            Self { manifest_file, infos, run_lines, corrections, odometry, odometry_rows, truths: surveyed, points };
        Ok((dataset, warnings, is_grouped.then_some(grouped)))
    }

    pub(super) fn infos(&self) -> &[RunInfo] {
        &self.infos
    }

    pub(super) fn info(&self, number: usize) -> Option<&RunInfo> {
        self.infos.get(number)
    }

    /// Rows of the odometry of a run.
    pub(super) fn rows(&self, number: usize) -> usize {
        self.odometry_rows.rows[number]
    }

    /// Rows of all that saw a run; those of a gyroscope are of the robot itself, as the odometry's are.
    pub(super) fn seen_rows(&self, number: usize) -> usize {
        let outside = self.truths.iter().filter(|(table, _)| table.name() != GYRO);
        outside.map(|(_, rows)| rows.rows[number]).sum()
    }

    /// In how many blocks of [`MARKED_ROWS`] rows the odometry of a run stands: one where what saw it cannot
    /// be cut.
    pub(super) fn blocks(&self, number: usize) -> usize {
        let whole = self.truths.iter().any(|(_, rows)| rows.rows[number] > 0 && rows.marks.is_empty());
        if whole { 1 } else { self.rows(number).saturating_sub(1).div_ceil(MARKED_ROWS).max(1) }
    }

    /// A run.
    pub(super) fn read(&mut self, info: RunInfo, number: usize, robot: &NominalRobot) -> Result<Run, DatasetError> {
        let mut run = Run { info, ..Run::default() };
        self.odometry.read_run(number, &self.odometry_rows, &mut run)?;
        for (truth, rows) in &mut self.truths {
            truth.read_run(number, rows, &self.points, &mut run)?;
        }
        if has_truth(&run) {
            let mut run = unwrapped(run, robot);
            self.corrections.apply(&mut run);
            counted::restore(slice::from_mut(&mut run), robot);
            return Ok(run);
        }
        let tables: Vec<_> = self.truths.iter().map(|(truth, _)| truth.name()).collect();
        Err(without_truth(self.manifest_file.clone(), self.run_lines[number], &run, &tables))
    }

    /// Some blocks of a run, and the row after them: parts that touch share a row, and no interval is lost
    /// between them.
    pub(super) fn read_blocks(
        &mut self,
        number: usize,
        blocks: Range<usize>,
        robot: &NominalRobot,
    ) -> Result<Run, DatasetError> {
        let info = self.infos[number].clone();
        if blocks == (0..self.blocks(number)) {
            return self.read(info, number, robot);
        }
        let mut run = Run { info, ..Run::default() };
        let all = self.rows(number);
        let rows = blocks.start * MARKED_ROWS..(blocks.end * MARKED_ROWS + 1).min(all);
        let is_last = rows.end == all;
        self.odometry.read_rows(number, &self.odometry_rows, rows, &mut run)?;
        let ends = run.odometry.t_s.first().zip(run.odometry.t_s.last());
        let from_s = ends.filter(|_| blocks.start > 0).map_or(f64::NEG_INFINITY, |ends| *ends.0);
        let to_s = ends.filter(|_| !is_last).map_or(f64::INFINITY, |ends| *ends.1);
        for (truth, rows) in &mut self.truths {
            truth.read_between(number, rows, from_s, to_s, &self.points, &mut run)?;
        }
        let mut run = unwrapped(run, robot);
        counted::restore(slice::from_mut(&mut run), robot);
        Ok(run)
    }
}

fn unwrapped(mut run: Run, robot: &NominalRobot) -> Run {
    if let Some(bits) = robot.counter_bits {
        odometry::unwrap_counters(&mut run, bits);
    }
    run
}

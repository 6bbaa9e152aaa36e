//! Runs from the rows of logs: by a column, a file each, or cut where the robot stands still.

use std::collections::BTreeMap;
use std::path::Path;

use super::columns::Roles;
use super::log::Log;
use super::options::Options;
use super::sheet::Sheet;
use super::times::seconds;
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::standstills::moving_pieces;
use crate::unit::Unit;

/// A file with what was found in it.
pub(super) struct Part {
    pub(super) sheet: Sheet,
    pub(super) roles: Roles,
    pub(super) log: Log,
    /// What was taken off its times to bring them to the clock of the wheels, picoseconds.
    pub(super) shift_ps: i128,
}

/// Rows of one run, in the units of the files but for the time.
#[derive(Debug, Clone, Default)]
pub(super) struct RawRun {
    pub(super) id: String,
    /// Which part has its odometry, and which rows of it.
    pub(super) part: usize,
    pub(super) rows: Vec<usize>,
    /// Which part has its truth, and which rows of it.
    pub(super) truth_part: usize,
    pub(super) truth_rows: Vec<usize>,
    /// Which part has its gyroscope's rates, and which rows of it.
    pub(super) gyro: Option<(usize, Vec<usize>)>,
    /// The run's start, picoseconds.
    pub(super) start: i128,
}

/// The runs, and what makes them.
///
/// Says in `remarks` which rows are left out.
pub(super) fn runs(
    parts: &[Part],
    options: &Options,
    remarks: &mut Vec<String>,
) -> Result<(Vec<RawRun>, String), DatasetError> {
    let with_wheels: Vec<usize> = (0..parts.len()).filter(|&part| parts[part].roles.has_wheels()).collect();
    let mut runs = Vec::new();
    for (number, &part) in with_wheels.iter().enumerate() {
        let base = if with_wheels.len() > 1 { stem(&parts[part].sheet.file) } else { "run-01".to_owned() };
        runs.extend(groups(&parts[part], part, &base)?.into_iter().map(|run| (number, run)));
    }
    let poses: Vec<PartRows<'_>> = parts.iter().map(|part| PartRows::of(part, Log::has_pose_at)).collect();
    let rates: Vec<PartRows<'_>> = parts.iter().map(|part| PartRows::of(part, Log::has_gyro_at)).collect();
    let truths: Vec<usize> =
        (0..parts.len()).filter(|part| !with_wheels.contains(part) && parts[*part].roles.has_pose()).collect();
    let gyros: Vec<usize> =
        (0..parts.len()).filter(|part| !with_wheels.contains(part) && parts[*part].roles.has_gyro()).collect();
    let many = runs.len() > 1;
    let is_seen = parts.iter().any(|part| part.roles.has_pose());
    for (number, run) in &mut runs {
        let (Some(&first), Some(&last)) = (run.rows.first(), run.rows.last()) else { continue };
        let time = &parts[run.part].log.time;
        let (from, to) = (time[first], time[last]);
        let paired = |of: &[usize]| of.get(*number).filter(|_| of.len() == with_wheels.len()).or(of.first()).copied();
        // A file for several runs is theirs by its times.
        let times_in = |of: &[usize]| (many && of.len() == 1).then_some((from, to));
        if parts[run.part].roles.has_gyro() {
            run.gyro = Some((run.part, rates[run.part].of_own(&run.id)));
        } else if let Some(gyro) = paired(&gyros) {
            run.gyro = Some((gyro, rates[gyro].of_run(&run.id, times_in(&gyros))));
        }
        run.truth_part = run.part;
        if !is_seen {
            continue;
        }
        if parts[run.part].roles.has_pose() {
            run.truth_part = run.part;
            run.truth_rows = poses[run.part].of_own(&run.id);
        } else {
            // As many files of either kind belong together in the order in which they were given.
            if let Some(truth) = paired(&truths) {
                run.truth_part = truth;
                run.truth_rows = poses[truth].of_run(&run.id, times_in(&truths));
            }
        }
        refuse_other_clock(parts, run, from, to)?;
    }
    let mut runs: Vec<RawRun> = runs.into_iter().map(|(_, run)| run).collect();
    leave_doubled_rows_out(parts, &mut runs, remarks);
    let mut ordered_by = describe(parts, &with_wheels);
    if let Some(cut_s) = options.cut_s {
        runs = runs.into_iter().flat_map(|run| cut(parts, run, cut_s, options.wheel_unit)).collect();
        ordered_by = format!("{ordered_by}, cut at standstills and gaps of more than {cut_s} s");
        if runs.is_empty() {
            let message = format!("--cut {cut_s}: no run is left that moves; say a longer time");
            return Err(parts[with_wheels[0]].sheet.foreign(1, message));
        }
    }
    in_time_order(parts, &runs)?;
    Ok((runs, ordered_by))
}

fn describe(parts: &[Part], with_wheels: &[usize]) -> String {
    let by_column = with_wheels.iter().find_map(|&part| {
        let chosen = parts[part].roles.of.get(&Quantity::Run)?;
        Some(parts[part].sheet.names[chosen.index].clone())
    });
    match by_column {
        Some(column) => format!("column {column}"),
        None if with_wheels.len() > 1 => "a run a file".to_owned(),
        None => "one run".to_owned(),
    }
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The rows with wheels of one part, by run.
fn groups(part: &Part, number: usize, base: &str) -> Result<Vec<RawRun>, DatasetError> {
    let log = &part.log;
    let names = if log.run.is_empty() { vec![base.to_owned()] } else { log.run_names.clone() };
    let empty = |id: String| RawRun { id, part: number, ..RawRun::default() };
    let mut runs: Vec<RawRun> = names.into_iter().map(empty).collect();
    for row in (0..log.time.len()).filter(|&row| log.has_wheels_at(row)) {
        runs[log.run_of(row) as usize].rows.push(row);
    }
    for run in &mut runs {
        let Some(&first) = run.rows.first() else {
            let run = run.id.clone();
            return Err(DatasetError::RunWithoutRows { file: part.sheet.file.clone(), run });
        };
        run.start = log.time[first];
    }
    Ok(runs)
}

/// The rows of an instrument's file that belong to a run, found without looking at all of them for each run.
struct PartRows<'p> {
    part: &'p Part,
    /// By the number of the run; all of them where the file has no column of runs.
    by_run: Vec<Vec<usize>>,
    numbers: BTreeMap<&'p str, usize>,
    /// By their times, where the file has no column of runs.
    by_time: Vec<usize>,
}

impl<'p> PartRows<'p> {
    fn of(part: &'p Part, is_meant: fn(&Log, usize) -> bool) -> Self {
        let log = &part.log;
        let mut by_run = vec![Vec::new(); log.run_names.len().max(1)];
        for row in (0..log.time.len()).filter(|&row| is_meant(log, row)) {
            by_run[log.run_of(row) as usize].push(row);
        }
        let mut numbers = BTreeMap::new();
        for (number, name) in log.run_names.iter().enumerate() {
            numbers.entry(name.as_str()).or_insert(number);
        }
        let mut by_time = if log.run.is_empty() { by_run[0].clone() } else { Vec::new() };
        by_time.sort_by_key(|&row| log.time[row]);
        Self { part, by_run, numbers, by_time }
    }

    /// Of a run of this file.
    fn of_own(&self, id: &str) -> Vec<usize> {
        self.by_run[self.numbers.get(id).copied().unwrap_or(0)].clone()
    }

    /// Of another file's run: by its name, or between two `times` where this file has no column of runs.
    fn of_run(&self, id: &str, times: Option<(i128, i128)>) -> Vec<usize> {
        let time = &self.part.log.time;
        match (self.part.log.run.is_empty(), times) {
            (true, Some((from, to))) => {
                let mut rows = between(&self.by_time, time, from, to).to_vec();
                rows.sort_unstable();
                rows
            }
            (true, None) => self.by_run[0].clone(),
            (false, _) => self.numbers.get(id).map_or_else(Vec::new, |&number| self.by_run[number].clone()),
        }
    }
}

/// Those rows of a list in the order of their times that are between two times.
fn between<'r>(by_time: &'r [usize], time: &[i128], from: i128, to: i128) -> &'r [usize] {
    let rows = &by_time[by_time.partition_point(|&row| time[row] < from)..];
    &rows[..rows.partition_point(|&row| time[row] <= to)]
}

/// Two files whose times do not meet have two clocks.
fn refuse_other_clock(parts: &[Part], run: &RawRun, from: i128, to: i128) -> Result<(), DatasetError> {
    let truth = &parts[run.truth_part];
    let refused = |message: String| Err(truth.sheet.foreign(truth.sheet.first_row, message));
    let ends = run.truth_rows.first().zip(run.truth_rows.last());
    let Some((&first, &last)) = ends else {
        let message = format!("no row has a pose of run \"{}\"; every run needs a truth", run.id);
        return refused(message);
    };
    let (first, last) = (truth.log.time[first], truth.log.time[last]);
    if first <= to && last >= from {
        return Ok(());
    }
    let of = |from, to| format!("{:.3} to {:.3} s", seconds(0, from), seconds(0, to));
    let message = format!(
        "run \"{}\": the poses are of {}, the odometry is of {}: two clocks; bring both to one by --pose-offset SECONDS, by which the poses' is ahead (with {:.3} both begin at once), or let --sync estimate it",
        run.id,
        of(first, last),
        of(from, to),
        seconds(from, first)
    );
    refused(message)
}

/// Of rows of one instant that are few the first is kept: a logger that writes a line twice, or two that were
/// read in one cycle. More are a clock that is too coarse, which is refused after this.
fn leave_doubled_rows_out(parts: &[Part], runs: &mut [RawRun], remarks: &mut Vec<String>) {
    /// One in so many rows may be doubled; in fewer rows one may.
    const ROWS_A_DOUBLED_ONE: usize = 1000;
    for run in runs {
        let same_file = run.part == run.truth_part;
        let of_wheels = (run.part, &mut run.rows, false);
        let of_poses = (run.truth_part, &mut run.truth_rows, same_file);
        let of_gyro = run.gyro.iter_mut().map(|(part, rows)| (*part, rows, *part == run.part));
        for (part, rows, is_said) in [of_wheels, of_poses].into_iter().chain(of_gyro) {
            let Part { sheet, log, .. } = &parts[part];
            let doubled: Vec<(usize, usize)> = rows
                .windows(2)
                .filter(|pair| log.time[pair[0]] == log.time[pair[1]])
                .map(|pair| (pair[0], pair[1]))
                .collect();
            if doubled.is_empty() || doubled.len() > (rows.len() / ROWS_A_DOUBLED_ONE).max(1) {
                continue;
            }
            let is_same = |&(first, second): &(usize, usize)| log.is_same(first, second);
            let what = match (doubled.iter().all(is_same), doubled.len()) {
                (true, 1) => "a second row of the same instant is left out".to_owned(),
                (false, 1) => "a second row of the same instant has other values; the first is kept".to_owned(),
                (true, count) => format!("the first of {count} second rows of the same instant, which are left out"),
                (false, count) => {
                    format!(
                        "the first of {count} second rows of the same instant, some with other values; the first of each two is kept"
                    )
                }
            };
            if !is_said {
                remarks.push(format!("{}:{}: {what}", sheet.file.display(), log.lines[doubled[0].1]));
            }
            let mut left_out = doubled.iter().map(|(_, second)| *second).peekable();
            rows.retain(|row| left_out.next_if_eq(row).is_none());
        }
    }
}

/// Each run's rows must follow each other in time.
fn in_time_order(parts: &[Part], runs: &[RawRun]) -> Result<(), DatasetError> {
    for run in runs {
        let of_gyro = run.gyro.iter().map(|(part, rows)| (*part, rows));
        for (part, rows) in [(run.part, &run.rows), (run.truth_part, &run.truth_rows)].into_iter().chain(of_gyro) {
            let Part { sheet, roles, log, .. } = &parts[part];
            for pair in rows.windows(2) {
                let (before, after) = (log.time[pair[0]], log.time[pair[1]]);
                // Nearer to each other than that, two times may be one double.
                if after - before > (after - run.start).abs() >> (f64::MANTISSA_DIGITS - 3) {
                    continue;
                }
                let (t_s, previous_s) = (seconds(run.start, after), seconds(run.start, before));
                if t_s > previous_s {
                    continue;
                }
                let (file, line) = (sheet.file.clone(), log.lines[pair[1]]);
                let column = sheet.names[roles.of[&Quantity::Time].index].clone();
                if after > before {
                    let message = format!(
                        "column {column}: {t_s} s after the run's first row, against which the step from the row before is lost; correct the first row's time or this one's"
                    );
                    return Err(DatasetError::Foreign { file, line, message });
                }
                if after == before {
                    return Err(DatasetError::DuplicateInstant { file, line, column, t_s });
                }
                if log.run.is_empty() {
                    let message = format!(
                        "column {column}: time runs backwards, {t_s} s after {previous_s} s; if a run begins here, say --runs-by COLUMN, or --cut SECONDS to cut the file here and at standstills"
                    );
                    return Err(DatasetError::Foreign { file, line, message });
                }
                return Err(DatasetError::TimeRunsBackwards { file, line, column, t_s, previous_s });
            }
        }
    }
    Ok(())
}

/// A run cut where time restarts or leaps, and in the middle of long standstills; parts that do not move or
/// that nothing saw are left out.
fn cut(parts: &[Part], run: RawRun, cut_s: f64, wheel_unit: Option<Unit>) -> Vec<RawRun> {
    let (part, truth) = (&parts[run.part], &parts[run.truth_part]);
    let Some([left, right]) = &part.log.wheels else { return vec![run] };
    let rates = part.roles.wheels().is_some_and(|[of, _]| of == Quantity::Speed || part.roles.of[&of].is_rate);
    let given = part.roles.wheels().and_then(|[of, _]| part.roles.of[&of].unit).or(wheel_unit);
    let rates = rates || given.is_some_and(|unit| unit.is_rate() || unit.is_per_row());
    let stands = |before: usize, row: usize| {
        if rates {
            left[row] == 0.0 && right[row] == 0.0
        } else {
            left[row] == left[before] && right[row] == right[before]
        }
    };
    let step_s = |from: usize, to: usize| seconds(part.log.time[run.rows[from]], part.log.time[run.rows[to]]);
    let stand = |from: usize, to: usize| stands(run.rows[from], run.rows[to]);
    let time = &truth.log.time;
    let mut by_time = run.truth_rows.clone();
    by_time.sort_by_key(|&row| time[row]);
    let mut pieces: Vec<RawRun> = Vec::new();
    for piece in moving_pieces(run.rows.len(), step_s, stand, cut_s) {
        let rows: Vec<usize> = run.rows[piece].to_vec();
        let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { continue };
        let (from, to) = (part.log.time[first], part.log.time[last]);
        // In one file time may restart: its poses stand beside their odometry.
        let is_own = run.truth_part == run.part;
        let mut truth_rows: Vec<usize> = if is_own {
            let beside = &run.truth_rows[run.truth_rows.partition_point(|&row| row < first)..];
            let beside = beside.iter().copied().take_while(|&row| row <= last);
            beside.filter(|&row| (from..=to).contains(&time[row])).collect()
        } else {
            between(&by_time, time, from, to).to_vec()
        };
        truth_rows.sort_unstable();
        let gyro = run.gyro.as_ref().map(|(part, rows)| {
            let time = &parts[*part].log.time;
            (*part, rows.iter().copied().filter(|&row| (from..=to).contains(&time[row])).collect())
        });
        // Where nothing sees the robot every piece that moves stays.
        if truth_rows.len() >= 2 || run.truth_rows.is_empty() {
            let (part, truth_part) = (run.part, run.truth_part);
            pieces.push(RawRun { id: String::new(), part, rows, truth_part, truth_rows, gyro, start: from });
        }
    }
    for (number, piece) in (1..).zip(&mut pieces) {
        let base = if run.id == "run-01" { "run".to_owned() } else { run.id.clone() };
        piece.id = format!("{base}-{number:02}");
    }
    pieces
}

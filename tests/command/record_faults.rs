//! Faults of a log's records, each drawn in sound logs of robots that the project's simulator did not drive:
//! the check names each fault, its wheel and where it begins, wherever it costs a calibration its certainty.
//!
//! The campaigns: `YAIR_LOGS=100 YAIR_SEED=900 cargo test --release --test command record_faults --
//! --nocapture`.
#![allow(clippy::print_stdout)] // every log with what was found

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use calib::Method;
use calib::methods::joint::Joint;
use dataset::Dataset;
use plain_robot::{Draws, KINDS, Mixed, PlainRobot};
use preflight::{Problem, Severity};
use rayon::prelude::*;

/// A drawn log, as its files say it.
#[derive(Clone)]
struct Log {
    head: String,
    runs: Vec<String>,
    /// Run, time, and the two columns of the wheels.
    rows: Vec<(usize, f64, [f64; 2])>,
    /// Run, time, and the pose, without a heading where the instrument sees none.
    truth: Vec<(usize, f64, [f64; 2], Option<f64>)>,
    gyro_rad_s: Option<f64>,
    /// By the stated robot.
    ticks_per_rev: f64,
    radius_m: f64,
    separation_m: f64,
    manifest: String,
}

impl Log {
    fn read(folder: &Path) -> Self {
        let text = |name: &str| fs::read_to_string(folder.join(name)).expect("written");
        let (odometry, truth, manifest) = (text("odometry.csv"), text("truth.csv"), text("dataset.toml"));
        let stated = |key: &str| -> f64 {
            let line = manifest.lines().find(|line| line.starts_with(key)).expect("stated");
            line.split(" = ").nth(1).expect("a value").parse().expect("a number")
        };
        let mut log = Self {
            head: odometry.lines().next().expect("a header").to_owned(),
            runs: Vec::new(),
            rows: Vec::new(),
            truth: Vec::new(),
            gyro_rad_s: None,
            ticks_per_rev: stated("ticks_per_rev"),
            radius_m: 0.5 * stated("left_wheel_diameter_m"),
            separation_m: stated("wheel_separation_m"),
            manifest: manifest.clone(),
        };
        let mut cells = |line: &str| -> (usize, Vec<Option<f64>>) {
            let mut cells = line.split(',');
            let id = cells.next().expect("a run");
            let known = log.runs.iter().position(|run| run == id);
            let run = known.unwrap_or_else(|| {
                log.runs.push(id.to_owned());
                log.runs.len() - 1
            });
            (run, cells.map(|cell| cell.parse().ok()).collect())
        };
        for line in odometry.lines().skip(1) {
            let (run, of) = cells(line);
            log.rows.push((run, of[0].expect("a time"), [of[1].expect("left"), of[2].expect("right")]));
        }
        for line in truth.lines().skip(1) {
            let (run, of) = cells(line);
            log.truth.push((run, of[0].expect("a time"), [of[1].expect("x"), of[2].expect("y")], of[3]));
        }
        log
    }

    fn write(&self, folder: &Path) {
        let gyro = self.gyro_rad_s.map_or_else(String::new, |rate| format!(",{rate}"));
        let mut odometry = format!("{}{}\n", self.head, if gyro.is_empty() { "" } else { ",gyro_radps" });
        let decimals = if self.is("ticks") { 0 } else { 9 };
        for (run, t_s, [a, b]) in &self.rows {
            writeln!(odometry, "{},{t_s:.6},{a:.decimals$},{b:.decimals$}{gyro}", self.runs[*run]).expect("text");
        }
        let mut truth = "run,t_s,x_m,y_m,theta_rad\n".to_owned();
        for (run, t_s, [x_m, y_m], theta_rad) in &self.truth {
            let theta = theta_rad.map_or_else(String::new, |rad| format!("{rad:.9}"));
            writeln!(truth, "{},{t_s:.6},{x_m:.9},{y_m:.9},{theta}", self.runs[*run]).expect("text");
        }
        fs::write(folder.join("odometry.csv"), odometry).expect("written");
        fs::write(folder.join("truth.csv"), truth).expect("written");
        fs::write(folder.join("dataset.toml"), &self.manifest).expect("written");
    }

    fn dataset(&self) -> Dataset {
        let folder = tempfile::tempdir().expect("a temporary folder");
        self.write(folder.path());
        dataset::read(folder.path()).expect("a dataset").dataset
    }

    /// Are its columns of this kind?
    fn is(&self, kind: &str) -> bool {
        self.head.contains(kind)
    }

    fn has_rates(&self) -> bool {
        self.is("mps")
    }

    /// Changes what both wheels' columns say in a run, by the stated robot where they are of its twist.
    fn change(&mut self, run: usize, mut change: impl FnMut(&mut [(f64, [f64; 2])])) {
        let (half_m, is_twist, is_counts) = (0.5 * self.separation_m, self.is("omega"), self.is("ticks"));
        let of_run = |row: &&mut (usize, f64, [f64; 2])| row.0 == run;
        let mut rows: Vec<&mut (usize, f64, [f64; 2])> = self.rows.iter_mut().filter(of_run).collect();
        let wheels = |[a, b]: [f64; 2]| if is_twist { [a - half_m * b, a + half_m * b] } else { [a, b] };
        let mut of: Vec<(f64, [f64; 2])> = rows.iter().map(|row| (row.1, wheels(row.2))).collect();
        change(&mut of);
        for (row, (_, [left, right])) in rows.iter_mut().zip(of) {
            row.2 = match (is_twist, is_counts) {
                (true, _) => [0.5 * (left + right), 0.5 * (right - left) / half_m],
                (_, true) => [left.floor(), right.floor()],
                _ => [left, right],
            };
        }
    }
}

/// Where a fault begins; the whole log is spoiled where there is no place.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    run: usize,
    t_s: f64,
}

/// Spoils a log; `None` where its records cannot have the fault.
type Spoil = fn(&mut Log, &mut Draws) -> Option<Option<Place>>;

/// A fault of the records, and the problems that name it.
struct Fault {
    name: &'static str,
    ids: &'static [&'static str],
    spoil: Spoil,
}

const fn fault(name: &'static str, ids: &'static [&'static str], spoil: Spoil) -> Fault {
    Fault { name, ids, spoil }
}

const FAULTS: &[Fault] = &[
    fault("a wheel dies", &["wheel_dead"], |log, draws| Some(rescaled(log, draws, 0.0, true))),
    fault("a wheel counts backwards from an instant on", &["wheel_backwards"], |log, draws| {
        Some(rescaled(log, draws, -1.0, true))
    }),
    fault("a wheel counts double from an instant on", &["wheel_rescaled"], |log, draws| {
        Some(rescaled(log, draws, 2.0, true))
    }),
    fault("a wheel counts half from an instant on", &["wheel_rescaled"], |log, draws| {
        Some(rescaled(log, draws, 0.5, true))
    }),
    fault("a wheel counts 1.2 or 0.8 times from an instant on", &["wheel_rescaled"], |log, draws| {
        let gain = if draws.happens(0.5) { 1.2 } else { 0.8 };
        Some(rescaled(log, draws, gain, true))
    }),
    fault("a wheel dies to the end of the run", &["wheel_dead"], |log, draws| Some(rescaled(log, draws, 0.0, false))),
    fault("a wheel counts double to the end of the run", &["wheel_rescaled"], |log, draws| {
        Some(rescaled(log, draws, 2.0, false))
    }),
    fault("a column that is copied", &["wheels_alike"], |log, draws| {
        let side = side(draws);
        log.rows.iter_mut().for_each(|row| row.2[side] = row.2[1 - side]);
        (!log.is("omega")).then_some(None)
    }),
    fault("a yaw rate that is never filled", &["wheels_alike"], |log, _| {
        log.rows.iter_mut().for_each(|row| row.2[1] = 0.0);
        log.is("omega").then_some(None)
    }),
    fault("a gyroscope that is never filled, beside positions", &["gyro_constant"], |log, draws| {
        log.gyro_rad_s = Some(if draws.happens(0.5) { 0.0 } else { 0.0123 });
        log.truth.iter_mut().for_each(|row| row.3 = None);
        Some(None)
    }),
    fault("zeros where no message came", &["rates_of_no_message"], |log, draws| {
        let share = [0.02, 0.05, 0.2][(3.0 * draws.uniform()) as usize];
        log.rows.iter_mut().for_each(|row| row.2 = if draws.happens(share) { [0.0; 2] } else { row.2 });
        log.has_rates().then_some(None)
    }),
    fault("speeds that wrap at 16 bits", &["rates_wrap"], |log, draws| {
        // Units of which the fastest has 34 to 50 thousand.
        let columns = if log.is("omega") { 0..1 } else { 0..2 };
        let all = log.rows.iter().flat_map(|row| &row.2[columns.clone()]);
        let unit = all.map(|of| of.abs()).fold(0.0, f64::max) / (34e3 + 16e3 * draws.uniform());
        let wrapped = |value: f64| unit * f64::from((value / unit).round() as i32 as i16);
        log.rows.iter_mut().for_each(|row| {
            columns.clone().for_each(|column| row.2[column] = wrapped(row.2[column]));
        });
        log.has_rates().then_some(None)
    }),
    fault("distances and angles cut to whole millimetres and degrees", &["rates_cut"], |log, _| {
        log.has_rates().then(|| cut_to_steps(log, [1e-3, 1_f64.to_radians()]))
    }),
    fault("runs of the truth shifted by one", &["truth_runs_shifted"], |log, draws| {
        let runs = log.runs.len();
        let by = if draws.happens(0.5) { 1 } else { runs - 1 };
        log.truth.iter_mut().for_each(|row| row.0 = (row.0 + by) % runs);
        log.truth.sort_by_key(|row| row.0);
        (runs > 1).then_some(None)
    }),
    fault("a counter that always runs on", &["wheel_runs_on"], |log, draws| runs_on(log, draws, false)),
    fault("a counter that runs on at rest", &["wheel_runs_on"], |log, draws| runs_on(log, draws, true)),
    fault("poses that are logged several times", &["poses_held"], |log, draws| {
        let times = [2, 3, 5][(3.0 * draws.uniform()) as usize];
        let before = log.truth.clone();
        for at in 0..before.len() {
            let first = at - at % times;
            if before[first].0 == before[at].0 {
                (log.truth[at].2, log.truth[at].3) = (before[first].2, before[first].3);
            }
        }
        Some(None)
    }),
];

fn side(draws: &mut Draws) -> usize {
    usize::from(draws.happens(0.5))
}

/// A wheel counts so many times as much from an instant on, to the end of the log or of the run.
fn rescaled(log: &mut Log, draws: &mut Draws, gain: f64, to_end: bool) -> Option<Place> {
    let (side, runs, has_rates) = (side(draws), log.runs.len(), log.has_rates());
    let run = ((0.1 + 0.8 * draws.uniform()) * runs as f64) as usize;
    let share = 0.2 + 0.6 * draws.uniform();
    let (mut base, mut place) = (None, None);
    for number in run..if to_end { runs } else { run + 1 } {
        log.change(number, |rows| {
            let from = if number == run { (share * rows.len() as f64) as usize } else { 0 };
            place.get_or_insert(Place { run, t_s: rows[from].0 });
            // Counts go on from where they are.
            let base = if has_rates { 0.0 } else { *base.get_or_insert(rows[from].1[side]) };
            rows[from..].iter_mut().for_each(|(_, row)| row[side] = base + gain * (row[side] - base));
        });
    }
    place
}

/// Rows of a twentieth of a second at the least, each of whole steps that were driven and turned since the
/// one before; the rest is lost.
fn cut_to_steps(log: &mut Log, steps: [f64; 2]) -> Option<Place> {
    let (is_twist, separation_m) = (log.is("omega"), log.separation_m);
    let mut cut: Vec<(usize, f64, [f64; 2])> = log.rows[..1].to_vec();
    let mut since = [0.0; 2];
    for pair in log.rows.windows(2) {
        let ((run, from_s, _), (of, t_s, [a, b])) = (pair[0], pair[1]);
        if of != run {
            cut.push((of, t_s, [0.0; 2]));
            since = [0.0; 2];
            continue;
        }
        let twist = if is_twist { [a, b] } else { [0.5 * (a + b), (b - a) / separation_m] };
        since = [0, 1].map(|k| since[k] + twist[k] * (t_s - from_s));
        let row_s = t_s - cut[cut.len() - 1].1;
        if row_s > 0.045 {
            cut.push((run, t_s, [0, 1].map(|k| (since[k] / steps[k]).trunc() * steps[k] / row_s)));
            since = [0.0; 2];
        }
    }
    (log.rows, log.head) = (cut, "run,t_s,v_mps,omega_radps".to_owned());
    None
}

/// A wheel's column gains 0.02 to 0.3 rad/s, always or where neither wheel turns.
fn runs_on(log: &mut Log, draws: &mut Draws, at_rest: bool) -> Option<Option<Place>> {
    let (side, has_rates) = (side(draws), log.has_rates());
    let sign = if draws.happens(0.5) { -1.0 } else { 1.0 };
    let rad_s = sign * 0.02 * 15_f64.powf(draws.uniform());
    let per_rad = match () {
        () if log.is("ticks") => log.ticks_per_rev / TAU,
        () if has_rates => log.radius_m,
        () => 1.0,
    };
    for run in 0..log.runs.len() {
        log.change(run, |rows| {
            let (sound, mut gained) = (rows.to_vec(), 0.0);
            for row in 1..sound.len() {
                let stands = if has_rates { sound[row].1 == [0.0; 2] } else { sound[row].1 == sound[row - 1].1 };
                let now = if stands || !at_rest { rad_s * per_rad } else { 0.0 };
                gained += now * (sound[row].0 - sound[row - 1].0);
                rows[row].1[side] += if has_rates { now } else { gained };
            }
        });
    }
    Some(None)
}

/// Kinds of sound logs in which faults are drawn: records of every form, coarse and fine, at several rates,
/// with good and with poor instruments, of many runs and of one.
const IN: [&str; 16] = [
    "20 000 ticks a turn",
    "500 ticks a turn",
    "counts at 10 Hz",
    "500 ticks at 20 Hz, jitter of 3 ms, poses of 3 mm at 5 Hz",
    "four runs",
    "one long log",
    "2 % outliers",
    "truth of 2 cm and 20 mrad",
    "motion capture",
    "free, one long log",
    "angles",
    "angles of 500 ticks at 20 Hz",
    "speeds",
    "speeds of 500 ticks at 20 Hz",
    "speeds in whole mm/s at 20 Hz",
    "twists",
];

/// A robot of a kind.
fn of_kind(name: &str, seed: u64) -> PlainRobot {
    let (_, change, _) = KINDS.iter().find(|(of, ..)| *of == name).expect("a kind");
    let mut robot = PlainRobot::ordinary(seed);
    change(&mut robot);
    robot
}

fn drawn(robot: &PlainRobot) -> (Log, [f64; 3]) {
    let (folder, truth_m) = robot.written();
    (Log::read(folder.path()), truth_m)
}

/// The largest error of a length in standard deviations, where the fit gives any.
fn z(log: &Dataset, truth_m: [f64; 3]) -> Option<f64> {
    let found = Joint::DEFAULT.calibrate(&[log.session()]).ok().filter(|found| found.converged)?;
    let report = calib::MethodReport::new("joint", &Ok(found), &log.robot);
    let keys = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];
    let of = |(key, truth_m): (&str, f64)| {
        let parameter = report.parameters.get(key)?;
        Some(((parameter.value? - truth_m) / parameter.sigma.filter(|sigma| *sigma > 0.0)?).abs())
    };
    keys.into_iter().zip(truth_m).filter_map(of).reduce(f64::max)
}

/// Is the fault named, where it begins? A window is half a second, of two that the place may lie between.
fn is_named(fault: &Fault, log: &Log, place: Option<Place>, problems: &[Problem]) -> bool {
    problems.iter().any(|of| {
        let at = |place: Place| {
            let from = format!("of run \"{}\"", log.runs[place.run]);
            let t_s = of.sentence.split("t = ").nth(1).and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
            of.sentence.contains(&from) && t_s.is_some_and(|t_s| (t_s - place.t_s).abs() < MAX_PLACE_S)
        };
        fault.ids.contains(&of.id) && place.is_none_or(at)
    })
}

/// Seconds. A robot that stands when its wheel fails shows it when it moves on.
const MAX_PLACE_S: f64 = 2.5;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// The share of so many, with Wilson's interval of 95 %.
fn share(of: usize, all: usize) -> String {
    let (k, n, z) = (of as f64, all as f64, 1.96_f64);
    let middle = (k + 0.5 * z * z) / (n + z * z);
    let half = z / (n + z * z) * (k * (n - k) / n + 0.25 * z * z).sqrt();
    format!("{of} of {all} ({:.0}–{:.0} %)", 100.0 * (middle - half).max(0.0), 100.0 * (middle + half).min(1.0))
}

/// What came of a spoiled log.
struct Outcome {
    is_named: bool,
    /// Standard deviations by which a length is off where the checks are overridden, at the most; `None`
    /// where the fit says nothing.
    z: Option<f64>,
    line: String,
}

fn outcome(number: usize, kind: &str, seed: u64, with_fit: bool) -> Option<Outcome> {
    let fault = &FAULTS[number];
    let (mut log, truth_m) = drawn(&of_kind(kind, seed));
    let place = (fault.spoil)(&mut log, &mut Draws(7919 * seed + number as u64))?;
    let dataset = log.dataset();
    let problems = preflight::check(std::slice::from_ref(&dataset)).problems;
    let is_named = is_named(fault, &log, place, &problems);
    let z = with_fit.then(|| z(&dataset, truth_m)).flatten();
    let said: Vec<&str> = problems.iter().filter(|of| of.severity != Severity::Hint).map(|of| of.id).collect();
    let at = place.map_or_else(String::new, |of| format!(" at t = {:.2} s of {}", of.t_s, log.runs[of.run]));
    let line = format!("{} in \"{kind}\" {seed}{at}: {} z {z:.1?}", fault.name, said.join(", "));
    Some(Outcome { is_named, z, line })
}

/// Three logs of each fault, of which one may have hardly any motion after it; in the campaign, many. With
/// YAIR_COSTS=1 those whose lengths are off by a standard deviation or more, or are refused without the
/// cause, are counted apart.
#[test]
fn faults_of_records_are_named_with_their_place() {
    let (logs, seed, with_fit) = (number("YAIR_LOGS", 0), number("YAIR_SEED", 900), number("YAIR_COSTS", 0) > 0);
    for (number, fault) in FAULTS.iter().enumerate() {
        // Of every fault in turn, so that kinds meet all of them.
        let drawn = |of: u64| {
            let kind = IN[(of as usize + number) % IN.len()];
            // Of these, one fault in ten is not found: four seconds of a poor instrument.
            let is_asked = logs > 0 || kind != "truth of 2 cm and 20 mrad";
            is_asked.then(|| outcome(number, kind, seed + of, with_fit)).flatten()
        };
        let asked = if logs > 0 { logs } else { IN.len() as u64 };
        let all: Vec<Outcome> = if logs > 0 {
            (0..asked).into_par_iter().filter_map(drawn).collect()
        } else {
            (0..asked).filter_map(drawn).take(3).collect()
        };
        let costs = |of: &&Outcome| with_fit && of.z.is_none_or(|z| z > 1.0);
        let named = |of: &[&Outcome]| of.iter().filter(|of| of.is_named).count();
        let (every, costly): (Vec<&Outcome>, Vec<&Outcome>) =
            (all.iter().collect(), all.iter().filter(costs).collect());
        let of_costly = if with_fit { format!(" {} |", share(named(&costly), costly.len())) } else { String::new() };
        println!("| {} | {} |{of_costly}", fault.name, share(named(&every), every.len()));
        all.iter().filter(|of| !of.is_named).for_each(|of| println!("  not named: {}", of.line));
        let is_rare = ["a counter that runs on at rest", "poses that are logged several times"].contains(&fault.name);
        assert!(logs > 0 || is_rare || 3 * named(&every) >= 2 * every.len(), "{}", fault.name);
    }
}

/// Sound logs of every kind, and mixed ones, have none of these problems.
#[test]
fn sound_logs_have_no_fault_of_records() {
    let (logs, seed) = (number("YAIR_LOGS", 0), number("YAIR_SEED", 900));
    let mixed = |of: u64| Mixed::drawn(seed + of).robot;
    let ordinary = |of: u64| of_kind(KINDS[of as usize % KINDS.len()].0, seed + of);
    // One kind in eight, from another one on in each place of the table.
    let robots: Vec<PlainRobot> = if logs > 0 {
        (0..logs).map(ordinary).chain((0..logs).map(mixed)).collect()
    } else {
        (0..KINDS.len() as u64).step_by(8).map(ordinary).chain((0..8).map(mixed)).collect()
    };
    let ids: Vec<&str> = FAULTS.iter().flat_map(|fault| fault.ids).copied().collect();
    let found = |robot: &PlainRobot| {
        let problems = preflight::check(&[drawn(robot).0.dataset()]).problems;
        let new = problems.into_iter().find(|of| ids.contains(&of.id))?;
        Some(format!("{}: {}: {}", robot.seed, new.id, new.sentence))
    };
    let found: Vec<String> = robots.par_iter().filter_map(found).collect();
    println!("{} of sound logs: {found:#?}", share(found.len(), robots.len()));
    assert!(found.len() * 50 <= robots.len(), "{found:#?}");
}

//! A good log that tests spoil: a robot with its wheels 2 % larger and its separation 3 % larger than stated,
//! simulated by nothing of this project.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;

use crate::support::run_in;

/// Diameters and separation as they are, millimetres.
pub(crate) const TRUE_MM: [f64; 3] = [153.0, 152.7, 309.0];

/// What a calibration of the good log may be off by, millimetres: five standard deviations of the fit's
/// (1.2, 1.2 and 2.6 µm), and 0.02 mm for latencies and outliers that are estimated with them.
pub(crate) const TOLERANCE_MM: f64 = 0.03;

/// A row of the log and one of the instrument.
#[derive(Clone)]
pub(crate) struct Log {
    pub(crate) robot_m: [f64; 3],
    pub(crate) ticks_per_rev: f64,
    pub(crate) runs: Vec<(String, &'static str)>,
    /// Run, time, left and right.
    pub(crate) odometry: Vec<(usize, f64, [f64; 2])>,
    /// Speed and yaw rate at the instants of the rows, in units of the stated robot.
    pub(crate) rates: Vec<[f64; 2]>,
    /// Run, time, x, y, heading.
    pub(crate) truth: Vec<(usize, f64, [f64; 3])>,
    pub(crate) positions: bool,
}

/// Straights, spins and squares both ways, 0.4 m/s and 0.8 rad/s, at 50 Hz, seen at 10 Hz.
pub(crate) fn good(seed: u64) -> Log {
    driven(TRUE_MM.map(|mm| 1e-3 * mm), seed)
}

pub(crate) fn driven(true_m: [f64; 3], seed: u64) -> Log {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let straight = |length_m: f64| vec![(length_m.abs() / 0.4, 0.4 * length_m.signum(), 0.0)];
    let spin = |turn_rad: f64| vec![(turn_rad.abs() / 0.8, 0.0, 0.8 * turn_rad.signum())];
    let square = |sense: f64| {
        let side = [straight(1.5), vec![(0.3, 0.0, 0.0)], spin(sense * FRAC_PI_2), vec![(0.3, 0.0, 0.0)]].concat();
        [side.clone(), side.clone(), side.clone(), side].concat()
    };
    let mut paths = Vec::new();
    for sense in [1.0, -1.0, 1.0, -1.0] {
        paths.push(("straight", straight(2.0 * sense)));
        paths.push(("spin", spin(TAU * sense)));
    }
    for (name, sense) in [("square_ccw", 1.0), ("square_cw", -1.0)] {
        paths.push((name, square(sense)));
    }
    let mut log = Log {
        robot_m: [0.150, 0.150, 0.300],
        ticks_per_rev: 4096.0,
        runs: Vec::new(),
        odometry: Vec::new(),
        rates: Vec::new(),
        truth: Vec::new(),
        positions: false,
    };
    let step_s = 0.005;
    // First-order lag; each seed is a drive of its own.
    let lag_s = 0.1 + 1e-3 * seed as f64;
    for (run, (protocol, path)) in paths.into_iter().enumerate() {
        log.runs.push((format!("{run:02}_{protocol}"), protocol));
        let path = [vec![(0.4, 0.0, 0.0)], path, vec![(0.4, 0.0, 0.0)]].concat();
        let (mut v, mut omega) = (0.0, 0.0);
        let (mut pose, mut turns, mut count) = ([0.0, 0.0, 0.7 * run as f64], [0.0, 0.0], 0);
        for (length_s, speed, rate) in path {
            for _ in 0..(length_s / step_s).round() as usize {
                let t_s = step_s * f64::from(count);
                if count % 4 == 0 {
                    // Rates are even within a step: at an instant they are the mean of those before and
                    // after.
                    let [v_now, omega_now] = [(v, speed), (omega, rate)]
                        .map(|(of, goal): (f64, f64)| of + 0.5 * (goal - of) * step_s / lag_s);
                    // What the stated robot would do with the wheels' rates.
                    let wheels = [-0.5, 0.5].map(|side| v_now + side * omega_now * true_m[2]);
                    let [left, right] = [0, 1].map(|side: usize| wheels[side] / true_m[side] * 0.150);
                    log.rates.push([0.5 * (left + right), (right - left) / 0.300]);
                    log.odometry.push((run, t_s, turns.map(|turn: f64| (turn / TAU * 4096.0).round())));
                }
                if count % 20 == 0 {
                    let mut noisy = |value: f64, sigma: f64| value + sigma * random.sample::<f64, _>(StandardNormal);
                    let seen = [noisy(pose[0], 5e-4), noisy(pose[1], 5e-4), noisy(pose[2], 1e-3)];
                    log.truth.push((run, t_s, seen));
                }
                count += 1;
                v += (speed - v) * step_s / lag_s;
                omega += (rate - omega) * step_s / lag_s;
                let middle_rad = pose[2] + 0.5 * omega * step_s;
                pose = [
                    pose[0] + v * step_s * middle_rad.cos(),
                    pose[1] + v * step_s * middle_rad.sin(),
                    pose[2] + omega * step_s,
                ];
                let half = 0.5 * omega * true_m[2];
                turns[0] += (v - half) * step_s / (0.5 * true_m[0]);
                turns[1] += (v + half) * step_s / (0.5 * true_m[1]);
            }
        }
    }
    log
}

impl Log {
    pub(crate) fn write(&self, dir: &Path, more: &str) {
        fs::create_dir_all(dir).expect("made");
        let [left, right, separation] = self.robot_m;
        let mut toml = format!(
            "format = 1\n{more}[robot]\nleft_wheel_diameter_m = {left}\nright_wheel_diameter_m = {right}\n\
             wheel_separation_m = {separation}\nticks_per_rev = {}\n",
            self.ticks_per_rev
        );
        for (id, protocol) in &self.runs {
            let _ = write!(toml, "[[run]]\nid = \"{id}\"\nprotocol = \"{protocol}\"\n");
        }
        let mut odometry = "run,t_s,left_ticks,right_ticks\n".to_owned();
        for (run, t_s, [left, right]) in &self.odometry {
            let _ = writeln!(odometry, "{},{t_s:.4},{left},{right}", self.runs[*run].0);
        }
        let mut truth = "run,t_s,x_m,y_m,theta_rad\n".to_owned();
        for (run, t_s, [x, y, theta]) in &self.truth {
            let theta = if self.positions { String::new() } else { format!("{theta:.6}") };
            let _ = writeln!(truth, "{},{t_s:.4},{x:e},{y:e},{theta}", self.runs[*run].0);
        }
        fs::write(dir.join("dataset.toml"), toml).expect("written");
        fs::write(dir.join("odometry.csv"), odometry).expect("written");
        fs::write(dir.join("truth.csv"), truth).expect("written");
    }

    /// The log driven so many times over, as runs of their own.
    pub(crate) fn repeated(&self, times: usize) -> Self {
        let (mut all, runs) = (self.clone(), self.runs.len());
        for copy in 1..times {
            all.runs.extend(self.runs.iter().map(|(id, protocol)| (format!("{id}_{copy}"), *protocol)));
            all.odometry.extend(self.odometry.iter().map(|&(run, t_s, wheels)| (copy * runs + run, t_s, wheels)));
            all.truth.extend(self.truth.iter().map(|&(run, t_s, seen)| (copy * runs + run, t_s, seen)));
        }
        all
    }

    /// As [`Self::write`], with twists of the rows' instants instead of ticks.
    pub(crate) fn write_instant_rates(&self, dir: &Path, more: &str) {
        self.write(dir, more);
        let mut odometry = "run,t_s,v_mps,omega_radps\n".to_owned();
        for ((run, t_s, _), [v_m_s, omega_rad_s]) in self.odometry.iter().zip(&self.rates) {
            let _ = writeln!(odometry, "{},{t_s:.4},{v_m_s:.6},{omega_rad_s:.6}", self.runs[*run].0);
        }
        fs::write(dir.join("odometry.csv"), odometry).expect("written");
    }

    pub(crate) fn truths(mut self, change: impl Fn(&mut f64, &mut [f64; 3])) -> Self {
        self.truth.iter_mut().for_each(|(_, t_s, seen)| change(t_s, seen));
        self
    }

    pub(crate) fn rows(mut self, change: impl Fn(&mut f64, &mut [f64; 2])) -> Self {
        self.odometry.iter_mut().for_each(|(_, t_s, wheels)| change(t_s, wheels));
        self
    }

    /// The runs of one protocol.
    pub(crate) fn only(mut self, protocol: &str) -> Self {
        let runs = self.runs.clone();
        self.odometry.retain(|row| runs[row.0].1 == protocol);
        self.truth.retain(|row| runs[row.0].1 == protocol);
        let kept: Vec<usize> = (0..runs.len()).filter(|run| runs[*run].1 == protocol).collect();
        let place = |run: usize| kept.iter().position(|kept| *kept == run).expect("kept");
        self.odometry.iter_mut().for_each(|row| row.0 = place(row.0));
        self.truth.iter_mut().for_each(|row| row.0 = place(row.0));
        self.runs = kept.iter().map(|run| runs[*run].clone()).collect();
        self
    }

    /// Nominal dead reckoning as the truth.
    pub(crate) fn with_own_truth(mut self) -> Self {
        let mut pose = [0.0_f64; 3];
        let mut before: Option<(usize, [f64; 2])> = None;
        self.truth.clear();
        for (row, (run, t_s, wheels)) in self.odometry.iter().enumerate() {
            match before {
                Some((last, was)) if last == *run => {
                    let [left, right] = [0, 1].map(|side| (wheels[side] - was[side]) * PI * 0.150 / 4096.0);
                    let turn_rad = (right - left) / 0.300;
                    let middle_rad = pose[2] + 0.5 * turn_rad;
                    let step_m = 0.5 * (left + right);
                    pose =
                        [pose[0] + step_m * middle_rad.cos(), pose[1] + step_m * middle_rad.sin(), pose[2] + turn_rad];
                }
                _ => pose = [0.0; 3],
            }
            before = Some((*run, *wheels));
            if row % 5 == 0 {
                self.truth.push((*run, *t_s, pose));
            }
        }
        self
    }
}

/// The values of a calibration in millimetres; `None` where it is refused.
pub(crate) fn calibrated(folder: &Path, set: &str) -> (Option<[Option<f64>; 3]>, String) {
    let ended = run_in(folder, &["calibrate", set, "--json"]);
    if ended.code != Some(0) {
        assert_eq!(ended.code, Some(1), "{set}: {}", ended.stderr);
        return (None, ended.stderr);
    }
    let found: Value = serde_json::from_str(&ended.stdout).expect("a document");
    let parameters = &found["methods"][0]["parameters"];
    let keys = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];
    (Some(keys.map(|key| Some(1e3 * parameters[key]["value"].as_f64()?))), ended.stderr)
}

#[track_caller]
pub(crate) fn right(found: [Option<f64>; 3]) {
    let off =
        found.iter().zip(TRUE_MM).map(|(found, truth)| found.map_or(f64::INFINITY, |found| (found - truth).abs()));
    assert!(off.clone().all(|off| off < TOLERANCE_MM), "{found:?}");
}

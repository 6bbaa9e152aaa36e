//! A differential-drive robot that shares no code with the project: integrated by the millisecond, driven by
//! its own profiles, with its own random numbers. It writes dataset folders as plain text.
//!
//! The project's simulator and estimators have one author; what both get wrong, a test between them does not
//! see. This one follows textbook equations only: midpoint integration, trapezoids of speed, encoders that
//! round down.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// What the outside instrument reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reports {
    Poses,
    Positions,
    /// The first and the last pose of each run.
    FirstAndLast,
}

/// Errors of the stamps of odometry rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stamps {
    Exact,
    /// Normal, of this standard deviation, seconds.
    Jitter(f64),
    /// A row is stamped when it is received: later by an exponential delay of this mean, seconds, in the
    /// order of the rows.
    Received(f64),
}

/// What happens in one run and is no property of the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Event {
    /// Something moves the robot in the room: metres and radians, steadily.
    Pushed { from_s: f64, for_s: f64, by: [f64; 3] },
    /// The wheels turn without the floor.
    Lifted { from_s: f64, for_s: f64 },
    /// The instrument's frame jumps, and stays: metres and radians about the robot.
    FrameJump { at_s: f64, by: [f64; 3] },
    /// The marker is elsewhere on the robot.
    OtherMarker { at: [f64; 3] },
}

/// A robot and its log; everything else about it is ordinary.
#[derive(Debug, Clone)]
pub(crate) struct PlainRobot {
    pub(crate) ticks_per_rev: f64,
    pub(crate) odometry_hz: f64,
    pub(crate) stamps: Stamps,
    pub(crate) truth_hz: f64,
    /// How long after a row each pose is taken, as a share of a row's interval.
    pub(crate) truth_between_rows: f64,
    pub(crate) truth_sigma_m: f64,
    pub(crate) truth_sigma_rad: f64,
    /// Errors of poses are uniform, of the same standard deviations.
    pub(crate) has_uniform_errors: bool,
    pub(crate) reports: Reports,
    /// The pose that is reported is so old, seconds.
    pub(crate) latency_s: f64,
    /// What the robot's clock gains from each run's start on, seconds a second.
    pub(crate) clock_gain: f64,
    /// It runs on from the session's start instead.
    pub(crate) clock_runs_on: bool,
    /// One run whose truth is off by so much time, seconds, by index.
    pub(crate) late_run: Option<(usize, f64)>,
    /// Events, by the index of their run.
    pub(crate) events: Vec<(usize, Event)>,
    /// Random error of a wheel's travel, m/√m.
    pub(crate) wheel_sigma_m_per_sqrt_m: f64,
    /// Amplitude of the right wheel's eccentricity, relative to its radius.
    pub(crate) eccentricity: f64,
    /// Share of odometry rows that are lost.
    pub(crate) lost_rows: f64,
    /// Ripple of the speed, relative.
    pub(crate) ripple: f64,
    /// How many of the 21 runs are driven.
    pub(crate) runs: usize,
    /// All runs are one log.
    pub(crate) joined: bool,
    pub(crate) seed: u64,
}

impl PlainRobot {
    /// 20 000 ticks a turn at 100 Hz, poses of 1 mm and 1 mrad at 10 Hz, nothing wrong.
    pub(crate) fn ordinary(seed: u64) -> Self {
        Self {
            ticks_per_rev: 20_000.0,
            odometry_hz: 100.0,
            stamps: Stamps::Exact,
            truth_hz: 10.0,
            truth_between_rows: 0.0,
            truth_sigma_m: 1e-3,
            truth_sigma_rad: 1e-3,
            has_uniform_errors: false,
            reports: Reports::Poses,
            latency_s: 0.0,
            clock_gain: 0.0,
            clock_runs_on: false,
            late_run: None,
            events: Vec::new(),
            wheel_sigma_m_per_sqrt_m: 3e-4,
            eccentricity: 0.0,
            lost_rows: 0.0,
            ripple: 0.0,
            runs: 21,
            joined: false,
            seed,
        }
    }

    /// Drives all runs and writes the dataset.
    pub(crate) fn write(&self, folder: &Path) {
        fs::create_dir_all(folder).expect("a folder");
        let mut draws = Draws(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d);
        let base_m = 0.363 * (1.0 + 0.01 * draws.normal());
        let radius_m = [0.08 * (1.0 + 3e-3 * draws.normal()), 0.08 * (1.0 + 3e-3 * draws.normal())];
        let phase_rad = TAU * draws.uniform();
        let (mut odometry, mut truth) = (String::from("run,t_s,left_ticks,right_ticks\n"), String::new());
        truth.push_str("run,t_s,x_m,y_m,theta_rad\n");
        let mut described = String::new();
        let programs: Vec<(&str, Vec<Part>)> = programs(&mut draws).into_iter().take(self.runs).collect();
        let runs: Vec<(String, &str, Vec<Part>)> = if self.joined {
            vec![("all".to_owned(), "free", programs.iter().flat_map(|(_, legs)| legs.iter().copied()).collect())]
        } else {
            let of = |(number, (protocol, legs)): (usize, &(&'static str, Vec<Part>))| {
                (format!("{number:03}_{protocol}"), *protocol, legs.clone())
            };
            programs.iter().enumerate().map(of).collect()
        };
        let mut world = World { at: [0.0; 3], wheels_rad: [0.0; 2] };
        for (number, (id, protocol, legs)) in runs.iter().enumerate() {
            let start_s = 60.0 * number as f64;
            write!(described, "[[run]]\nid = \"{id}\"\nprotocol = \"{protocol}\"\nstart_s = {start_s}\n")
                .expect("text");
            world.at = [draws.normal(), draws.normal(), PI * (2.0 * draws.uniform() - 1.0)];
            let path = world.drive(legs, (self, number), (base_m, radius_m, phase_rad), &mut draws);
            let since_s = if self.clock_runs_on { start_s } else { 0.0 };
            self.log_rows((id, since_s), &path, &mut odometry, &mut draws);
            self.log_truth(number, id, &path, &mut truth, &mut draws);
        }
        let sigma = |sigma: f64| if sigma > 0.0 { sigma } else { 0.0 };
        let text = format!(
            "format = 1\n[robot]\nleft_wheel_diameter_m = 0.16\nright_wheel_diameter_m = 0.16\n\
             wheel_separation_m = 0.363\nticks_per_rev = {:?}\n[truth]\nsigma_xy_m = {:?}\nsigma_theta_rad = {:?}\n{described}",
            self.ticks_per_rev,
            sigma(self.truth_sigma_m),
            sigma(self.truth_sigma_rad),
        );
        fs::write(folder.join("dataset.toml"), text).expect("written");
        fs::write(folder.join("odometry.csv"), odometry).expect("written");
        fs::write(folder.join("truth.csv"), truth).expect("written");
    }

    fn of_run(&self, number: usize) -> impl Iterator<Item = Event> {
        self.events.iter().filter(move |(run, _)| *run == number).map(|(_, event)| *event)
    }

    /// What the instrument sees of the robot.
    fn seen(&self, number: usize, t_s: f64, at: [f64; 3], jumped_at: &mut [f64; 3]) -> [f64; 3] {
        let mut seen = at;
        for event in self.of_run(number) {
            match event {
                Event::OtherMarker { at: [x_m, y_m, rad] } => {
                    let (sin, cos) = at[2].sin_cos();
                    seen = [at[0] + cos * x_m - sin * y_m, at[1] + sin * x_m + cos * y_m, at[2] + rad];
                }
                Event::FrameJump { at_s, by } if t_s >= at_s => {
                    if jumped_at.iter().all(|of| of.is_nan()) {
                        *jumped_at = at;
                    }
                    let (sin, cos) = by[2].sin_cos();
                    let (x_m, y_m) = (at[0] - jumped_at[0], at[1] - jumped_at[1]);
                    seen = [
                        jumped_at[0] + by[0] + cos * x_m - sin * y_m,
                        jumped_at[1] + by[1] + sin * x_m + cos * y_m,
                        at[2] + by[2],
                    ];
                }
                _ => {}
            }
        }
        seen
    }

    fn log_rows(&self, (id, since_s): (&str, f64), path: &Path1kHz, odometry: &mut String, draws: &mut Draws) {
        let every = (1000.0 / self.odometry_hz).round() as usize;
        let offset = [draws.uniform(), draws.uniform()];
        let mut last_s = f64::NEG_INFINITY;
        for step in (0..path.samples.len()).step_by(every) {
            let is_lost = draws.uniform() < self.lost_rows;
            let true_s = 1e-3 * step as f64;
            let true_s = true_s + self.clock_gain * (since_s + true_s);
            let stamp_s = match self.stamps {
                Stamps::Exact => true_s,
                Stamps::Jitter(sigma_s) => true_s + sigma_s * draws.normal(),
                Stamps::Received(mean_s) => true_s - mean_s * (1.0 - draws.uniform()).ln(),
            };
            let stamp_s = stamp_s.max(last_s + 1e-4);
            if is_lost {
                continue;
            }
            last_s = stamp_s;
            let [left, right] = [0, 1]
                .map(|wheel| (path.samples[step].wheels_rad[wheel] / TAU * self.ticks_per_rev + offset[wheel]).floor());
            writeln!(odometry, "{id},{stamp_s:.6},{left},{right}").expect("text");
        }
    }

    fn log_truth(&self, number: usize, id: &str, path: &Path1kHz, truth: &mut String, draws: &mut Draws) {
        let every = (1000.0 / self.truth_hz).round() as usize;
        let between = (self.truth_between_rows * 1000.0 / self.odometry_hz).round() as usize;
        let rows = (1000.0 / self.odometry_hz).round() as usize;
        let last = path.samples.len() - 1;
        let steps: Vec<usize> = match self.reports {
            Reports::FirstAndLast => vec![0, last / rows * rows],
            _ => (0..path.samples.len()).step_by(every).map(|step| step + between).filter(|s| *s <= last).collect(),
        };
        let off_s = self.latency_s + self.late_run.filter(|(run, _)| *run == number).map_or(0.0, |(_, off_s)| off_s);
        let mut jumped_at = [f64::NAN; 3];
        for step in steps {
            let at = (step as f64 - 1000.0 * off_s).round().clamp(0.0, last as f64) as usize;
            let [x_m, y_m, theta_rad] = self.seen(number, 1e-3 * step as f64, path.samples[at].at, &mut jumped_at);
            let mut error = |sigma: f64| {
                let standard =
                    if self.has_uniform_errors { 12_f64.sqrt() * (draws.uniform() - 0.5) } else { draws.normal() };
                sigma * standard
            };
            let (x_m, y_m) = (x_m + error(self.truth_sigma_m), y_m + error(self.truth_sigma_m));
            let theta_rad = theta_rad + error(self.truth_sigma_rad);
            let theta = if self.reports == Reports::Positions { String::new() } else { format!("{theta_rad:.9}") };
            writeln!(truth, "{id},{:.6},{x_m:.9},{y_m:.9},{theta}", 1e-3 * step as f64).expect("text");
        }
    }
}

/// A part of a drive: top speed and yaw rate, and how long it takes at these.
#[derive(Debug, Clone, Copy)]
struct Part {
    v_m_s: f64,
    omega_rad_s: f64,
    for_s: f64,
    /// Stands still after it, seconds.
    rest_s: f64,
}

const SPEEDS: [f64; 3] = [0.15, 0.3, 0.45];

fn straight(length_m: f64, v_m_s: f64) -> Part {
    Part { v_m_s, omega_rad_s: 0.0, for_s: length_m / v_m_s.abs(), rest_s: 0.4 }
}

fn spin(turn_rad: f64, omega_rad_s: f64) -> Part {
    Part { v_m_s: 0.0, omega_rad_s: omega_rad_s * turn_rad.signum(), for_s: turn_rad.abs() / omega_rad_s, rest_s: 0.4 }
}

/// Six straights, four spins, four squares, four circles and three free drives, mixed.
fn programs(draws: &mut Draws) -> Vec<(&'static str, Vec<Part>)> {
    let straights = (0..6).map(|k| ("straight", vec![straight(2.0, SPEEDS[k % 3]), straight(2.0, -SPEEDS[k % 3])]));
    let spins = (0..4).map(|k| {
        let turn_rad = if k % 2 == 0 { 2.0 * TAU } else { -2.0 * TAU };
        ("spin", vec![spin(turn_rad, 0.6 + 0.3 * k as f64)])
    });
    let squares = (0..4).map(|k| {
        let (name, turn_rad) = if k % 2 == 0 { ("square_ccw", 0.25 * TAU) } else { ("square_cw", -0.25 * TAU) };
        (name, (0..4).flat_map(|_| [straight(1.5, SPEEDS[1 + k / 2]), spin(turn_rad, 0.9)]).collect())
    });
    let circles = (0..4).map(|k| {
        let (name, side) = if k % 2 == 0 { ("circle_ccw", 1.0) } else { ("circle_cw", -1.0) };
        let v_m_s = SPEEDS[1 + k / 2];
        let leg = Part { v_m_s, omega_rad_s: side * v_m_s / 0.7, for_s: 2.0 * TAU * 0.7 / v_m_s, rest_s: 0.4 };
        (name, vec![leg])
    });
    let groups: [Vec<(&str, Vec<Part>)>; 4] =
        [straights.collect(), spins.collect(), squares.collect(), circles.collect()];
    let mut free = (0..3).map(|_| {
        let leg = |_| Part {
            v_m_s: 0.1 + 0.4 * draws.uniform(),
            omega_rad_s: 1.2 * (2.0 * draws.uniform() - 1.0),
            for_s: 1.0 + 2.0 * draws.uniform(),
            rest_s: 0.0,
        };
        ("free", (0..12).map(leg).collect::<Vec<Part>>())
    });
    let mut groups = groups.map(Vec::into_iter);
    let mut all = Vec::new();
    // In turn, so that the first few runs are of all kinds.
    for _ in 0..6 {
        all.extend(groups.iter_mut().filter_map(Iterator::next));
        all.extend(free.next());
    }
    all
}

#[derive(Clone, Copy)]
struct Sample {
    at: [f64; 3],
    wheels_rad: [f64; 2],
}

struct Path1kHz {
    samples: Vec<Sample>,
}

struct World {
    at: [f64; 3],
    wheels_rad: [f64; 2],
}

impl World {
    /// Drives the legs with limited accelerations; half a second of standing at both ends.
    fn drive(
        &mut self,
        legs: &[Part],
        (robot, number): (&PlainRobot, usize),
        (base_m, radius_m, phase_rad): (f64, [f64; 2], f64),
        draws: &mut Draws,
    ) -> Path1kHz {
        const DT_S: f64 = 1e-3;
        const LIMITS: [f64; 2] = [0.6, 2.5];
        let mut samples = vec![Sample { at: self.at, wheels_rad: self.wheels_rad }];
        let mut now = [0.0, 0.0];
        let rest = |for_s| Part { v_m_s: 0.0, omega_rad_s: 0.0, for_s, rest_s: 0.0 };
        let mut parts = vec![rest(0.5)];
        for leg in legs {
            parts.push(*leg);
            if leg.rest_s > 0.0 {
                // Brakes, then stands.
                parts.push(rest((leg.v_m_s.abs() / LIMITS[0]).max(leg.omega_rad_s.abs() / LIMITS[1]) + leg.rest_s));
            }
        }
        parts.push(rest(1.5));
        let mut t_s = 0.0;
        for part in parts {
            let target = [part.v_m_s, part.omega_rad_s];
            // Speed and yaw rate arrive together, so that a circle stays one while the robot speeds up.
            let change = [target[0] - now[0], target[1] - now[1]];
            let ramp_s = (change[0].abs() / LIMITS[0]).max(change[1].abs() / LIMITS[1]);
            let start = now;
            let steps = (part.for_s.max(ramp_s) / DT_S).round() as usize;
            for step in 0..steps {
                let share = if ramp_s > 0.0 { ((step + 1) as f64 * DT_S / ramp_s).min(1.0) } else { 1.0 };
                now = [start[0] + share * change[0], start[1] + share * change[1]];
                t_s += DT_S;
                let ripple = 1.0 + robot.ripple * (TAU * 1.7 * t_s).sin();
                let contact_m =
                    [now[0] - 0.5 * base_m * now[1], now[0] + 0.5 * base_m * now[1]].map(|v| v * ripple * DT_S);
                // What was commanded is turned by the wheel; what it rolls differs by noise and eccentricity.
                let mut rolled_m = [0.0; 2];
                for wheel in 0..2 {
                    let turned_rad = contact_m[wheel] / radius_m[wheel];
                    let middle_rad = self.wheels_rad[wheel] + 0.5 * turned_rad;
                    let wobble = if wheel == 1 { robot.eccentricity * (middle_rad + phase_rad).cos() } else { 0.0 };
                    let noise_m = robot.wheel_sigma_m_per_sqrt_m * contact_m[wheel].abs().sqrt() * draws.normal();
                    rolled_m[wheel] = contact_m[wheel] * (1.0 + wobble) + noise_m;
                    self.wheels_rad[wheel] += turned_rad;
                }
                let turn_rad = (rolled_m[1] - rolled_m[0]) / base_m;
                let middle_rad = self.at[2] + 0.5 * turn_rad;
                let ahead_m = 0.5 * (rolled_m[0] + rolled_m[1]);
                let rolls = robot.of_run(number).all(
                    |event| !matches!(event, Event::Lifted { from_s, for_s } if t_s > from_s && t_s < from_s + for_s),
                );
                if rolls {
                    self.at = [
                        self.at[0] + ahead_m * middle_rad.cos(),
                        self.at[1] + ahead_m * middle_rad.sin(),
                        self.at[2] + turn_rad,
                    ];
                }
                for event in robot.of_run(number) {
                    if let Event::Pushed { from_s, for_s, by } = event
                        && t_s > from_s
                        && t_s < from_s + for_s
                    {
                        self.at.iter_mut().zip(by).for_each(|(at, by)| *at += by * DT_S / for_s);
                    }
                }
                samples.push(Sample { at: self.at, wheels_rad: self.wheels_rad });
            }
        }
        Path1kHz { samples }
    }
}

/// `SplitMix64`.
struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Box & Muller 1958.
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

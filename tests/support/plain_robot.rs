//! A differential-drive robot that shares no code with the project: integrated by the millisecond, driven by
//! its own profiles, with its own random numbers. It writes dataset folders as plain text.
//!
//! The project's simulator and estimators have one author; what both get wrong, a test between them does not
//! see. This one follows textbook equations only: midpoint integration, trapezoids of speed, encoders that
//! round down.

#[path = "plain_robot/draws.rs"]
mod draws;
#[path = "plain_robot/drive.rs"]
mod drive;
#[path = "plain_robot/log.rs"]
mod log;

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

pub(crate) use draws::Draws;
use drive::{Part, World, programs};

/// What the outside instrument reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reports {
    Poses,
    Positions,
    /// The first and the last pose of each run.
    FirstAndLast,
}

/// What a row says of the wheels, nominal sizes taken; what is rounded beside the counts is so in these
/// steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Records {
    Counts,
    /// Angles of the wheels, radians.
    Angles {
        step_rad: f64,
    },
    /// Speeds of the wheels at the floor, of what was counted since the row before.
    Speeds {
        step_m_s: f64,
    },
    /// Speed and yaw rate, of what was counted since the row before.
    Twists {
        step_m_s: f64,
        step_rad_s: f64,
    },
}

/// Errors of stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stamps {
    Exact,
    /// Normal, of this standard deviation, seconds.
    Jitter(f64),
    /// A row is stamped when it is received: later by an exponential delay of this mean, seconds, in the
    /// order of the rows.
    Received(f64),
    /// Whole steps of the clock, seconds.
    RoundedTo(f64),
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
    /// The robot's clock is set otherwise, and stays.
    ClockStep { at_s: f64, by_s: f64 },
}

/// A robot and its log; everything else about it is ordinary.
#[derive(Debug, Clone)]
pub(crate) struct PlainRobot {
    pub(crate) ticks_per_rev: f64,
    pub(crate) odometry_hz: f64,
    pub(crate) stamps: Stamps,
    pub(crate) records: Records,
    /// Recorded speeds are those of the row's instant.
    pub(crate) has_rates_of_instants: bool,
    /// Time constant of the filter of recorded speeds.
    pub(crate) speed_filter_s: f64,
    /// What the counters hold when a run begins.
    pub(crate) first_count: f64,
    pub(crate) truth_hz: f64,
    pub(crate) truth_stamps: Stamps,
    /// Each pose is sent so many times, at so many times the rate.
    pub(crate) truth_repeats: usize,
    /// What poses are rounded to, metres and radians.
    pub(crate) truth_steps: [f64; 2],
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
    /// Play between encoder and wheel.
    pub(crate) gap_m: f64,
    /// Share of a wheel's travel that slips, per speed.
    pub(crate) slip_s_m: f64,
    /// What the wheelbase grows by with the yaw rate, relative.
    pub(crate) base_grows_s: f64,
    /// Between these x the floor is slippery: 3 % are lost.
    pub(crate) slippery_band: Option<[f64; 2]>,
    /// A counter hears nothing for so long, so often.
    pub(crate) bursts_per_s: f64,
    pub(crate) burst_s: f64,
    /// The right counter is read so much later, seconds.
    pub(crate) right_late_s: f64,
    /// Rows whose counts are those of the row before are not logged.
    pub(crate) logs_changes_alone: bool,
    /// So many rows are sent together, and stamped as they are.
    pub(crate) rows_per_packet: usize,
    /// And up to so many more, by chance.
    pub(crate) more_rows_per_packet: usize,
    /// The log begins when the robot moves already.
    pub(crate) starts_moving: bool,
    /// No poses between these times of each run.
    pub(crate) truth_pause_s: Option<[f64; 2]>,
    /// Share of poses that are lost.
    pub(crate) lost_poses: f64,
    /// Share of poses that are off by 0.1 m and rad.
    pub(crate) outliers: f64,
    /// The stated errors of poses, relative to what they are.
    pub(crate) stated: f64,
    /// Errors of poses are correlated over so many seconds.
    pub(crate) truth_tau_s: f64,
    /// Errors of poses grow with the distance from the room's origin, relative.
    pub(crate) truth_grows_per_m: f64,
    /// Time constant of the instrument's filter.
    pub(crate) truth_filter_s: f64,
    /// Headings are within half a turn.
    pub(crate) wraps: bool,
    /// Share of odometry rows that are lost.
    pub(crate) lost_rows: f64,
    /// Ripple of the speed, relative.
    pub(crate) ripple: f64,
    /// Size of the robot and of all that it drives, to one of 160 mm wheels.
    pub(crate) scale: f64,
    /// Its speeds, and what it takes to reach them, relative.
    pub(crate) pace: f64,
    pub(crate) briskness: f64,
    /// It stands still for so much longer at the ends of runs, seconds.
    pub(crate) stands_s: f64,
    /// It stands still nowhere but at the ends of runs.
    pub(crate) never_rests: bool,
    /// Runs of one kind alone.
    pub(crate) only: Option<&'static str>,
    /// How many of the 21 runs are driven.
    pub(crate) runs: usize,
    /// All runs are one log.
    pub(crate) joined: bool,
    pub(crate) seed: u64,
}

impl Records {
    const fn columns(self) -> &'static str {
        match self {
            Self::Counts => "left_ticks,right_ticks",
            Self::Angles { .. } => "left_rad,right_rad",
            Self::Speeds { .. } => "left_mps,right_mps",
            Self::Twists { .. } => "v_mps,omega_radps",
        }
    }
}

impl Stamps {
    /// The stamp of what is of this time; the next one is later.
    fn of(self, true_s: f64, draws: &mut Draws) -> f64 {
        match self {
            Self::Exact => true_s,
            Self::Jitter(sigma_s) => true_s + sigma_s * draws.normal(),
            Self::Received(mean_s) => true_s - mean_s * (1.0 - draws.uniform()).ln(),
            Self::RoundedTo(step_s) => (true_s / step_s).round() * step_s,
        }
    }
}

/// A value in whole steps; as it is without.
fn in_steps_of(step: f64, value: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

impl PlainRobot {
    /// 20 000 ticks a turn at 100 Hz, poses of 1 mm and 1 mrad at 10 Hz, nothing wrong.
    pub(crate) fn ordinary(seed: u64) -> Self {
        Self {
            ticks_per_rev: 20_000.0,
            odometry_hz: 100.0,
            stamps: Stamps::Exact,
            records: Records::Counts,
            has_rates_of_instants: false,
            speed_filter_s: 0.0,
            first_count: 0.0,
            truth_hz: 10.0,
            truth_stamps: Stamps::Exact,
            truth_repeats: 1,
            truth_steps: [0.0; 2],
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
            gap_m: 0.0,
            slip_s_m: 0.0,
            base_grows_s: 0.0,
            slippery_band: None,
            bursts_per_s: 0.0,
            burst_s: 0.1,
            right_late_s: 0.0,
            logs_changes_alone: false,
            rows_per_packet: 1,
            more_rows_per_packet: 0,
            starts_moving: false,
            truth_pause_s: None,
            lost_poses: 0.0,
            outliers: 0.0,
            stated: 1.0,
            truth_tau_s: 0.0,
            truth_grows_per_m: 0.0,
            truth_filter_s: 0.0,
            wraps: false,
            lost_rows: 0.0,
            ripple: 0.0,
            scale: 1.0,
            pace: 1.0,
            briskness: 1.0,
            stands_s: 0.0,
            never_rests: false,
            only: None,
            runs: 21,
            joined: false,
            seed,
        }
    }

    /// The dataset in a temporary folder, and what [`Self::write`] says of the robot; where YAIR_OUT is set,
    /// the dataset stays in a folder there.
    pub(crate) fn written(&self) -> (tempfile::TempDir, [f64; 3]) {
        if let Some(kept) = std::env::var_os("YAIR_OUT") {
            self.write(&Path::new(&kept).join(self.seed.to_string()));
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        let truth_m = self.write(folder.path());
        (folder, truth_m)
    }

    /// Drives all runs and writes the dataset; the diameters of the wheels, and their separation, metres.
    pub(crate) fn write(&self, folder: &Path) -> [f64; 3] {
        fs::create_dir_all(folder).expect("a folder");
        let mut draws = Draws(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d);
        let base_m = self.scale * 0.363 * (1.0 + 0.01 * draws.normal());
        let radius_m = [0; 2].map(|_| self.scale * 0.08 * (1.0 + 3e-3 * draws.normal()));
        let phase_rad = TAU * draws.uniform();
        let (mut odometry, mut truth) = (format!("run,t_s,{}\n", self.records.columns()), String::new());
        truth.push_str("run,t_s,x_m,y_m,theta_rad\n");
        let mut described = String::new();
        let programs: Vec<(&str, Vec<Part>)> = programs(&mut draws)
            .into_iter()
            .filter(|(protocol, _)| self.only.is_none_or(|only| protocol.starts_with(only)))
            .take(self.runs)
            .map(|(protocol, parts)| (protocol, parts.into_iter().map(|part| part.driven_by(self)).collect()))
            .collect();
        let runs: Vec<(String, &str, Vec<Part>)> = if self.joined {
            vec![("all".to_owned(), "free", programs.iter().flat_map(|(_, legs)| legs.iter().copied()).collect())]
        } else {
            let of = |(number, (protocol, legs)): (usize, &(&'static str, Vec<Part>))| {
                (format!("{number:03}_{protocol}"), *protocol, legs.clone())
            };
            programs.iter().enumerate().map(of).collect()
        };
        let mut world = World { at: [0.0; 3], wheels_rad: [0.0; 2], ahead_m: [0.0; 2] };
        for (number, (id, protocol, legs)) in runs.iter().enumerate() {
            let start_s = 60.0 * number as f64;
            write!(described, "[[run]]\nid = \"{id}\"\nprotocol = \"{protocol}\"\nstart_s = {start_s}\n")
                .expect("text");
            world.at = [draws.normal(), draws.normal(), PI * (2.0 * draws.uniform() - 1.0)];
            let path = world.drive(legs, (self, number), (base_m, radius_m, phase_rad), &mut draws);
            let since_s = if self.clock_runs_on { start_s } else { 0.0 };
            self.log_rows((number, id, since_s), &path, &mut odometry, &mut draws);
            self.log_truth(number, id, &path, &mut truth, &mut draws);
        }
        let sigma = |sigma: f64| if sigma > 0.0 { sigma } else { 0.0 };
        let text = format!(
            "format = 1\n[robot]\nleft_wheel_diameter_m = {:?}\nright_wheel_diameter_m = {:?}\n\
             wheel_separation_m = {:?}\nticks_per_rev = {:?}\n[truth]\nsigma_xy_m = {:?}\nsigma_theta_rad = {:?}\n{described}",
            0.16 * self.scale,
            0.16 * self.scale,
            0.363 * self.scale,
            self.ticks_per_rev,
            sigma(self.truth_sigma_m * self.stated),
            sigma(self.truth_sigma_rad * self.stated),
        );
        fs::write(folder.join("dataset.toml"), text).expect("written");
        fs::write(folder.join("odometry.csv"), odometry).expect("written");
        fs::write(folder.join("truth.csv"), truth).expect("written");
        [2.0 * radius_m[0], 2.0 * radius_m[1], base_m]
    }
}

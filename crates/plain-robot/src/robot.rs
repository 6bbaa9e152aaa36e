//! The robot, its log and its instrument, as one would state them.

/// What the outside instrument reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reports {
    /// Position and heading.
    Poses,
    /// Position alone.
    Positions,
    /// The first and the last pose of each run.
    FirstAndLast,
}

/// What a row says of the wheels, nominal sizes taken; what is rounded beside the counts is so in these
/// steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Records {
    /// Counts of the encoders.
    Counts,
    /// Angles of the wheels, radians.
    Angles {
        /// Step, radians.
        step_rad: f64,
    },
    /// Speeds of the wheels at the floor, of what was counted since the row before.
    Speeds {
        /// Step, metres a second.
        step_m_s: f64,
    },
    /// Speed and yaw rate, of what was counted since the row before.
    Twists {
        /// Step of the speed, metres a second.
        step_m_s: f64,
        /// Step of the yaw rate, radians a second.
        step_rad_s: f64,
    },
}

/// Errors of stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stamps {
    /// The instants themselves.
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
pub enum Event {
    /// Something moves the robot in the room, steadily.
    Pushed {
        /// Since the run's start, seconds.
        from_s: f64,
        /// For so long, seconds.
        for_s: f64,
        /// Metres and radians.
        by: [f64; 3],
    },
    /// The wheels turn without the floor.
    Lifted {
        /// Since the run's start, seconds.
        from_s: f64,
        /// For so long, seconds.
        for_s: f64,
    },
    /// The instrument's frame jumps, and stays.
    FrameJump {
        /// Since the run's start, seconds.
        at_s: f64,
        /// Metres and radians about the robot.
        by: [f64; 3],
    },
    /// The marker is elsewhere on the robot.
    OtherMarker {
        /// Metres ahead and to the left, and radians.
        at: [f64; 3],
    },
    /// The robot's clock is set otherwise, and stays.
    ClockStep {
        /// Since the run's start, seconds.
        at_s: f64,
        /// Seconds.
        by_s: f64,
    },
}

/// A robot and its log; everything else about it is ordinary.
#[derive(Debug, Clone)]
pub struct PlainRobot {
    /// Ticks of the encoder a turn of the wheel.
    pub ticks_per_rev: f64,
    /// Rows a second.
    pub odometry_hz: f64,
    /// Errors of the rows' stamps.
    pub stamps: Stamps,
    /// What a row says.
    pub records: Records,
    /// Rows say what the wheels did: their angles, without rounding, at the instants of the stamps; none is
    /// lost.
    pub knows_wheels: bool,
    /// Recorded speeds are those of the row's instant.
    pub has_rates_of_instants: bool,
    /// Time constant of the filter of recorded speeds.
    pub speed_filter_s: f64,
    /// Standard deviation of recorded speeds, as a share of the speed.
    pub speed_noise: f64,
    /// What the counters hold when a run begins.
    pub first_count: f64,
    /// Poses a second.
    pub truth_hz: f64,
    /// Errors of the poses' stamps.
    pub truth_stamps: Stamps,
    /// Each pose is sent so many times, at so many times the rate.
    pub truth_repeats: usize,
    /// What poses are rounded to, metres and radians.
    pub truth_steps: [f64; 2],
    /// How long after a row each pose is taken, as a share of a row's interval.
    pub truth_between_rows: f64,
    /// Standard deviation of a position's axis, metres.
    pub truth_sigma_m: f64,
    /// Standard deviation of a heading, radians.
    pub truth_sigma_rad: f64,
    /// Errors of poses are uniform, of the same standard deviations.
    pub has_uniform_errors: bool,
    /// What the instrument reports.
    pub reports: Reports,
    /// The pose that is reported is so old, seconds.
    pub latency_s: f64,
    /// What the robot's clock gains from each run's start on, seconds a second.
    pub clock_gain: f64,
    /// It runs on from the session's start instead.
    pub clock_runs_on: bool,
    /// One run whose truth is off by so much time, seconds, by index.
    pub late_run: Option<(usize, f64)>,
    /// Events, by the index of their run.
    pub events: Vec<(usize, Event)>,
    /// Random error of a wheel's travel, m/√m.
    pub wheel_sigma_m_per_sqrt_m: f64,
    /// Amplitude of the right wheel's eccentricity, relative to its radius.
    pub eccentricity: f64,
    /// Play between encoder and wheel.
    pub gap_m: f64,
    /// Share of a wheel's travel that slips, per speed.
    pub slip_s_m: f64,
    /// What the wheelbase grows by with the yaw rate, relative.
    pub base_grows_s: f64,
    /// Between these x the floor is slippery: 3 % are lost.
    pub slippery_band: Option<[f64; 2]>,
    /// A counter hears nothing for so long, so often.
    pub bursts_per_s: f64,
    /// For so long, seconds.
    pub burst_s: f64,
    /// The right counter is read so much later, seconds.
    pub right_late_s: f64,
    /// Rows whose counts are those of the row before are not logged.
    pub logs_changes_alone: bool,
    /// So many rows are sent together, and stamped as they are.
    pub rows_per_packet: usize,
    /// And up to so many more, by chance.
    pub more_rows_per_packet: usize,
    /// The log begins when the robot moves already.
    pub starts_moving: bool,
    /// No poses between these times of each run.
    pub truth_pause_s: Option<[f64; 2]>,
    /// Share of poses that are lost.
    pub lost_poses: f64,
    /// Share of poses that are off by 0.1 m and rad.
    pub outliers: f64,
    /// The stated errors of poses, relative to what they are.
    pub stated: f64,
    /// Errors of poses are correlated over so many seconds.
    pub truth_tau_s: f64,
    /// Errors of poses grow with the distance from the room's origin, relative.
    pub truth_grows_per_m: f64,
    /// Time constant of the instrument's filter.
    pub truth_filter_s: f64,
    /// Headings are within half a turn.
    pub wraps: bool,
    /// Share of odometry rows that are lost.
    pub lost_rows: f64,
    /// Ripple of the speed, relative.
    pub ripple: f64,
    /// Size of the robot and of all that it drives, to one of 160 mm wheels.
    pub scale: f64,
    /// Its speeds, and what it takes to reach them, relative.
    pub pace: f64,
    /// How fast it reaches them, relative.
    pub briskness: f64,
    /// It stands still for so much longer at the ends of runs, seconds.
    pub stands_s: f64,
    /// It stands still nowhere but at the ends of runs.
    pub never_rests: bool,
    /// Runs of one kind alone.
    pub only: Option<&'static str>,
    /// How many of the 21 runs are driven.
    pub runs: usize,
    /// All runs are one log.
    pub joined: bool,
    /// Seed of all that is drawn.
    pub seed: u64,
}

impl PlainRobot {
    /// 20 000 ticks a turn at 100 Hz, poses of 1 mm and 1 mrad at 10 Hz, nothing wrong.
    #[must_use]
    pub fn ordinary(seed: u64) -> Self {
        Self {
            ticks_per_rev: 20_000.0,
            odometry_hz: 100.0,
            stamps: Stamps::Exact,
            records: Records::Counts,
            knows_wheels: false,
            has_rates_of_instants: false,
            speed_filter_s: 0.0,
            speed_noise: 0.0,
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
}

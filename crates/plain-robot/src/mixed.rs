//! Logs that several ordinary things are true of at once, with nothing wrong, or with one thing. Kinds differ
//! from a good log in one thing each; a user's log differs in many.

use crate::draws::Draws;
use crate::kinds::set_extrinsics;
use crate::robot::{PlainRobot, Records, Reports, Stamps};

/// A robot, what is not ordinary about its log, and the names that are right because of it.
#[derive(Debug, Clone)]
pub struct Mixed {
    /// The robot, which drives the log.
    pub robot: PlainRobot,
    /// What is drawn, in words.
    pub said: Vec<String>,
    /// Found or not, they are right.
    pub exempt: Vec<&'static str>,
    /// What is wrong with the robot, if anything is.
    pub fault: Option<&'static str>,
}

struct Chance(Draws);

impl Chance {
    fn of(&mut self, probability: f64) -> bool {
        self.0.uniform() < probability
    }

    /// A whole number from 0 on, below another.
    fn below(&mut self, end: usize) -> usize {
        (self.0.uniform() * end as f64) as usize
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    /// Evenly over the logarithms.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.0.uniform())
    }
}

impl Mixed {
    /// The log of a seed.
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        let mut chance = Chance(Draws(seed ^ 0x2545_f491_4f6c_dd1d));
        let mut drawn = Self { robot: PlainRobot::ordinary(seed), said: Vec::new(), exempt: Vec::new(), fault: None };
        drawn.draw_drive(&mut chance);
        drawn.draw_rows(&mut chance);
        drawn.draw_truth(&mut chance);
        if chance.of(0.5) {
            drawn.draw_fault(&mut chance);
        }
        drawn
    }

    fn say(&mut self, what: impl Into<String>) {
        self.said.push(what.into());
    }

    fn draw_drive(&mut self, chance: &mut Chance) {
        if chance.of(0.3) {
            self.robot.scale = chance.between(0.2, 3.0);
            self.say(format!("scale {:.2}", self.robot.scale));
        }
        if chance.of(0.5) {
            self.robot.pace = chance.between(0.3, 2.0);
            self.robot.briskness = chance.between(0.5, 2.0);
            self.say(format!("pace {:.2}, briskness {:.2}", self.robot.pace, self.robot.briskness));
        }
        if chance.of(0.3) {
            self.robot.ripple = chance.between(0.003, 0.03);
            self.say(format!("ripple {:.3}", self.robot.ripple));
        }
        if chance.of(0.25) {
            self.robot.only = Some(chance.one_of(&["square", "free", "circle", "free"]));
            self.say(format!("only {}", self.robot.only.unwrap_or_default()));
        }
        if chance.of(0.5) {
            self.robot.runs = chance.one_of(&[1, 2, 4, 8, 12]);
            self.say(format!("{} runs", self.robot.runs));
        }
        if chance.of(0.25) {
            self.robot.joined = true;
            self.say("joined");
        }
        self.robot.never_rests = chance.of(0.15);
        self.robot.starts_moving = chance.of(0.1);
        self.robot.wheel_sigma_m_per_sqrt_m = chance.one_of(&[0.0, 1e-4, 3e-4, 1e-3]);
        self.say(format!("wheels {:.0e}", self.robot.wheel_sigma_m_per_sqrt_m));
    }

    fn draw_rows(&mut self, chance: &mut Chance) {
        self.robot.ticks_per_rev = chance.between(120.0, 40_000.0).round();
        self.robot.odometry_hz = chance.one_of(&[10.0, 20.0, 25.0, 50.0, 50.0, 100.0, 100.0, 200.0]);
        self.robot.records = match chance.below(10) {
            0..=4 => Records::Counts,
            5 => Records::Angles { step_rad: chance.one_of(&[0.0, 1e-4, 1e-3]) },
            6 | 7 => Records::Speeds { step_m_s: chance.one_of(&[0.0, 1e-4, 1e-3]) },
            _ => {
                let step = chance.one_of(&[0.0, 1e-4, 1e-3]);
                Records::Twists { step_m_s: step, step_rad_s: step }
            }
        };
        self.robot.stamps = match chance.below(10) {
            0..=4 => Stamps::Exact,
            5 => Stamps::Jitter(chance.between(2e-4, 5e-3)),
            6 => Stamps::Received(chance.between(1e-3, 1e-2)),
            7 => Stamps::RoundedTo(1e-2),
            _ => Stamps::RoundedTo(1e-3),
        };
        if !matches!(self.robot.stamps, Stamps::Exact) {
            self.exempt.push("interval_error");
        }
        if matches!(self.robot.stamps, Stamps::Received(_)) {
            // Rows are late on average, and poses early.
            self.exempt.push("truth_latency");
        }
        self.say(format!(
            "{:?} of {} ticks at {} Hz, {:?}",
            self.robot.records, self.robot.ticks_per_rev, self.robot.odometry_hz, self.robot.stamps
        ));
        if chance.of(0.2) {
            self.robot.lost_rows = chance.between(2e-3, 0.05);
            self.exempt.push("dropped_samples");
            self.say(format!("{:.1} % of rows lost", 100.0 * self.robot.lost_rows));
        }
        if chance.of(0.3) {
            self.robot.first_count = (2e6 * (chance.0.uniform() - 0.5)).round();
        }
    }

    fn draw_truth(&mut self, chance: &mut Chance) {
        let robot = &mut self.robot;
        robot.truth_hz = chance.one_of(&[1.0, 2.0, 5.0, 10.0, 10.0, 20.0, 25.0, 50.0, 100.0]);
        robot.truth_sigma_m = chance.between(2e-4, 1e-2);
        robot.truth_sigma_rad = robot.truth_sigma_m * chance.between(0.5, 3.0);
        robot.truth_between_rows = if chance.of(0.5) { chance.0.uniform() } else { 0.0 };
        robot.wraps = chance.of(0.5);
        robot.reports = match chance.below(10) {
            0 => Reports::FirstAndLast,
            1 | 2 => Reports::Positions,
            _ => Reports::Poses,
        };
        robot.stated = if chance.of(0.3) { chance.one_of(&[0.0, 0.5, 2.0, 5.0]) } else { 1.0 };
        let said = format!(
            "{:?} of {:.1} mm and {:.1} mrad at {} Hz, stated {}",
            robot.reports,
            1e3 * robot.truth_sigma_m,
            1e3 * robot.truth_sigma_rad,
            robot.truth_hz,
            robot.stated
        );
        self.say(said);
        if chance.of(0.2) {
            self.robot.outliers = chance.between(3e-3, 0.05);
            self.exempt.push("truth_outliers");
            self.say(format!("{:.1} % outliers", 100.0 * self.robot.outliers));
        }
        if chance.of(0.15) {
            self.robot.lost_poses = chance.between(0.02, 0.3);
            self.say(format!("{:.0} % of poses lost", 100.0 * self.robot.lost_poses));
        }
        if chance.of(0.15) {
            self.robot.truth_tau_s = chance.between(0.05, 2.0);
            self.exempt.push("truth_correlated_noise");
            self.say(format!("errors last {:.2} s", self.robot.truth_tau_s));
        }
        if chance.of(0.3) {
            self.robot.latency_s = chance.between(5e-3, 0.15);
            self.exempt.push("truth_latency");
            self.say(format!("{:.0} ms late", 1e3 * self.robot.latency_s));
        }
        if chance.of(0.3) {
            self.robot.truth_stamps =
                chance.one_of(&[Stamps::RoundedTo(1e-3), Stamps::RoundedTo(1e-3), Stamps::Jitter(2e-3)]);
            if matches!(self.robot.truth_stamps, Stamps::Jitter(_)) {
                self.exempt.push("unlisted");
            }
            self.say(format!("truth {:?}", self.robot.truth_stamps));
        }
    }

    fn draw_fault(&mut self, chance: &mut Chance) {
        let sign = if chance.of(0.5) { 1.0 } else { -1.0 };
        let (fault, said) = match chance.below(9) {
            0 => {
                self.robot.eccentricity = chance.between(1e-3, 1e-2);
                ("wheel_eccentricity", self.robot.eccentricity)
            }
            1 => {
                self.robot.gap_m = self.robot.scale * chance.between(1e-3, 5e-3);
                ("backlash", self.robot.gap_m)
            }
            2 => {
                self.robot.slip_s_m = chance.between(5e-3, 3e-2) / self.robot.scale / self.robot.pace;
                ("slip_speed", self.robot.slip_s_m)
            }
            3 => {
                self.robot.base_grows_s = chance.between(5e-3, 5e-2) / self.robot.pace;
                ("turn_rate_wheelbase", self.robot.base_grows_s)
            }
            4 => {
                self.robot.right_late_s = chance.between(1.0, 5.0).round() * 1e-3;
                ("sampling_skew", self.robot.right_late_s)
            }
            5 => {
                self.robot.clock_gain = sign * chance.between(1e-4, 2e-3);
                ("clock_rate", self.robot.clock_gain)
            }
            6 => {
                self.robot.latency_s = chance.between(0.1, 0.5);
                ("truth_latency", self.robot.latency_s)
            }
            7 => {
                let at = [sign * self.robot.scale * chance.between(3e-3, 0.1), 0.02 * self.robot.scale, 0.0];
                set_extrinsics(&mut self.robot, at);
                ("truth_lever_arm", at[0])
            }
            _ => {
                let rad = sign * chance.between(0.01, 0.3);
                set_extrinsics(&mut self.robot, [0.0, 0.0, rad]);
                ("truth_yaw", rad)
            }
        };
        self.fault = Some(fault);
        self.say(format!("FAULT {fault} {said:.1e}"));
    }
}

//! An experiment: the robot, what is random, what sees it, what it drives, and the ranges of all these
//! values.

use effects::Effect;
use kinematics::{DriveGeometry, GeometryError};
use motion_programs::Schedule;
use serde::{Deserialize, Serialize};

use crate::budget::Budget;
use crate::error::{NoFit, ScenarioError};
use crate::estimated::Estimated;
use crate::limits::{MAX_RUNS, Ranges};
use crate::robot::Robot;
use crate::slam::Slam;
use crate::sweep::Sweep;
use crate::wall::Wall;

/// An experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// A name for people.
    pub name: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// How motion is computed.
    pub engine: Engine,
    /// The robot as specified.
    pub robot: Robot,
    /// What is random in every run.
    pub noise: Noise,
    /// Where runs start.
    pub placement: Placement,
    /// What a calibration may take: protocols are fitted to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
    /// How often the robot writes down its counters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log: Option<Log>,
    /// What sees the robot from outside.
    #[serde(rename = "instrument")]
    pub instruments: Vec<Instrument>,
    /// The robot's imperfections.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
    /// What is driven, in order.
    #[serde(rename = "protocol")]
    pub protocols: Vec<Schedule>,
    /// What a diagnosis estimated, for dead reckoning with the effects; the simulator does not read it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimated: Option<Estimated>,
    /// What is varied and who estimates, for `yair sweep`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep: Option<Sweep>,
}

/// How motion is computed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Engine {
    /// Whole motions as single arcs at constant speed; exact where every effect allows it.
    ClosedForm,
    /// Motors and controllers in steps of at most `step_s`.
    Stepping {
        /// Longest step, seconds, at most 1 ms.
        step_s: f64,
    },
}

/// Randomness of the robot itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Random walk of each wheel's travel over the ground, m/√m (`k`; Chong & Kleeman 1997).
    pub wheel_sigma_m_per_sqrt_m: f64,
    /// Relative scatter of each wheel's sensitivity, drawn once a motion (ε_c of the paper's eq. 4 and 5,
    /// over C).
    pub sensitivity_sigma: f64,
}

/// How precisely a person puts the robot at the start of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Each coordinate is uniform within ± this of the origin, metres.
    pub half_width_m: f64,
    /// The heading is uniform within ± this, radians.
    pub half_width_rad: f64,
}

/// The robot's own record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Log {
    /// Seconds between two rows. Without a log the counters are read at standstills only.
    pub interval_s: f64,
}

/// What sees the robot from outside.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Instrument {
    /// The paper's floor grid: the robot's marked points are read while it stands (`points.csv`).
    FloorGrid {
        /// Spacing to which coordinates are rounded, metres; 0 = not rounded.
        resolution_m: f64,
        /// Standard deviation of reading one coordinate, metres.
        reading_sigma_m: f64,
    },
    /// Motion capture: poses of a marker at a fixed rate (`truth.csv`).
    MotionCapture {
        /// Samples per second.
        rate_hz: f64,
        /// Standard deviation of each position coordinate, metres.
        sigma_xy_m: f64,
        /// Standard deviation of the heading, radians.
        sigma_theta_rad: f64,
        /// How much later than it is true a sample is stamped, seconds.
        latency_s: f64,
        /// Where the marker is on the robot, ahead of the axle, metres.
        lever_x_m: f64,
        /// Where the marker is on the robot, to the left of the centre, metres.
        lever_y_m: f64,
        /// How the marker's frame is turned on the robot, radians.
        lever_theta_rad: f64,
    },
    /// Poses in a map, by simultaneous localization and mapping (`truth.csv`).
    Slam(Slam),
    /// A tachometer on the ground beside each wheel, as of a roller or a fifth wheel (`wheel_reference.csv`).
    Tachometer {
        /// Samples per second. A sample is the mean speed since the one before, as from pulses counted over a
        /// gate time.
        rate_hz: f64,
        /// Standard deviation of each sample, m/s.
        sigma_m_s: f64,
    },
    /// A gyroscope on the robot: the mean yaw rate over each row's interval (`gyro_radps` of `odometry.csv`).
    Gyro {
        /// Angle random walk, rad/√s.
        noise_rad_per_sqrt_s: f64,
        /// Bias at the start of each run, rad/s.
        bias_radps: f64,
        /// Random walk of the bias, rad/s per √s.
        bias_walk_radps_per_sqrt_s: f64,
        /// Relative error of its scale.
        scale: f64,
        /// Standard deviation of its scale that the dataset states; 0 = none is stated.
        scale_sigma: f64,
        /// How long the robot stands before each run, seconds, which shows the bias.
        still_s: f64,
    },
    /// A tape measure: the distance between the places where the robot stands, one after the other
    /// (`distance.csv`).
    Tape {
        /// Standard deviation of each distance, metres.
        sigma_m: f64,
    },
    /// A lidar in front of a straight wall (`wall.csv`).
    Wall(Wall),
    /// Marks of where a run began: the pose of the robot that has come back to it, seen from there
    /// (`revisit.csv`).
    Revisit {
        /// Standard deviation of each coordinate, metres; 0 = not measured.
        sigma_xy_m: f64,
        /// Standard deviation of the heading, radians; 0 = not measured.
        sigma_theta_rad: f64,
    },
}

impl Scenario {
    /// The robot's specified drive.
    ///
    /// # Errors
    /// [`GeometryError`]; a scenario that was read has been checked.
    pub fn nominal_geometry(&self) -> Result<DriveGeometry, GeometryError> {
        self.robot.nominal().geometry()
    }

    /// The drive that the effects leave, about which everything else scatters: what calibration should find.
    ///
    /// # Errors
    /// [`GeometryError`]; a scenario that was read has been checked.
    pub fn true_geometry(&self) -> Result<DriveGeometry, GeometryError> {
        let nominal = self.nominal_geometry()?;
        Ok(self.effects.iter().fold(nominal, |geometry, effect| effect.physical().true_geometry(geometry)))
    }

    pub(crate) fn check(&self, location: &str) -> Result<(), ScenarioError> {
        let ranges = Ranges { location, prefix: "" };
        self.nominal_geometry().map_err(|source| ScenarioError::Geometry { location: location.to_owned(), source })?;
        check_robot(&self.robot, ranges)?;
        if let Engine::Stepping { step_s } = self.engine {
            ranges.range("engine.step_s", step_s, (1e-6..=1e-3).contains(&step_s), "from 0.000001 to 0.001 s")?;
        }
        ranges.not_negative("noise.wheel_sigma_m_per_sqrt_m", self.noise.wheel_sigma_m_per_sqrt_m)?;
        ranges.not_negative("noise.sensitivity_sigma", self.noise.sensitivity_sigma)?;
        ranges.not_negative("placement.half_width_m", self.placement.half_width_m)?;
        ranges.not_negative("placement.half_width_rad", self.placement.half_width_rad)?;
        if let Some(log) = self.log {
            ranges.interval("log.interval_s", log.interval_s)?;
        }
        let instruments = self.instruments.len() as f64;
        ranges.range("instrument", instruments, instruments > 0.0, "at least one: nothing else measures the truth")?;
        for instrument in &self.instruments {
            self.check_instrument(*instrument, ranges)?;
        }
        for effect in &self.effects {
            effect
                .physical()
                .check()
                .map_err(|source| ScenarioError::Effect { location: location.to_owned(), source })?;
        }
        if let Some(budget) = &self.budget {
            budget.check(location)?;
        }
        if let Some(Estimated { sensor_x_m, sensor_y_m, sensor_theta_rad, latency_s, terms }) = &self.estimated {
            ranges.finite("estimated.sensor_x_m", *sensor_x_m)?;
            ranges.finite("estimated.sensor_y_m", *sensor_y_m)?;
            ranges.finite("estimated.sensor_theta_rad", *sensor_theta_rad)?;
            ranges.finite("estimated.latency_s", *latency_s)?;
            for (name, value) in terms.iter().flat_map(|term| &term.values) {
                ranges.finite(&format!("estimated.term.values.{name}"), *value)?;
            }
        }
        self.check_protocols(location, "protocol", &self.protocols)?;
        let Some(sweep) = &self.sweep else { return Ok(()) };
        for (method, protocols) in &sweep.protocols {
            self.check_protocols(location, &format!("sweep.protocols.{method}"), protocols)?;
        }
        if !sweep.validation.is_empty() {
            check_schedules(location, "sweep.validation", &sweep.validation)?;
        }
        Ok(())
    }

    fn check_instrument(&self, instrument: Instrument, ranges: Ranges<'_>) -> Result<(), ScenarioError> {
        let still = |still_s: f64| {
            ranges.range("instrument.still_s", still_s, (0.0..=1e3).contains(&still_s), "from 0 to 1000 s")
        };
        let share = |key: &str, value: f64| ranges.range(key, value, (-0.5..=0.5).contains(&value), "from -0.5 to 0.5");
        match instrument {
            Instrument::FloorGrid { resolution_m, reading_sigma_m } => {
                ranges.not_negative("instrument.resolution_m", resolution_m)?;
                ranges.not_negative("instrument.reading_sigma_m", reading_sigma_m)?;
                let marks = self.robot.points.len() as f64;
                let must_be = "at least two points with a floor grid: one point gives no heading";
                ranges.range("robot.point", marks, self.robot.points.len() >= 2, must_be)?;
            }
            Instrument::MotionCapture {
                rate_hz,
                sigma_xy_m,
                sigma_theta_rad,
                latency_s,
                lever_x_m,
                lever_y_m,
                lever_theta_rad,
            } => {
                ranges.interval("1 / instrument.rate_hz", 1.0 / rate_hz)?;
                ranges.not_negative("instrument.sigma_xy_m", sigma_xy_m)?;
                ranges.not_negative("instrument.sigma_theta_rad", sigma_theta_rad)?;
                ranges.not_negative("instrument.latency_s", latency_s)?;
                ranges.finite("instrument.lever_x_m", lever_x_m)?;
                ranges.finite("instrument.lever_y_m", lever_y_m)?;
                ranges.finite("instrument.lever_theta_rad", lever_theta_rad)?;
            }
            Instrument::Slam(slam) => {
                ranges.interval("1 / instrument.rate_hz", 1.0 / slam.rate_hz)?;
                slam.not_negative().into_iter().try_for_each(|(key, value)| ranges.not_negative(key, value))?;
                ranges.length("instrument.map_length_m", slam.map_length_m)?;
                ranges.positive("instrument.wander_tau_s", slam.wander_tau_s)?;
                share("instrument.map_scale_error", slam.map_scale_error)?;
            }
            Instrument::Tachometer { rate_hz, sigma_m_s } => {
                ranges.interval("1 / instrument.rate_hz", 1.0 / rate_hz)?;
                ranges.not_negative("instrument.sigma_m_s", sigma_m_s)?;
            }
            Instrument::Gyro {
                noise_rad_per_sqrt_s,
                bias_radps,
                bias_walk_radps_per_sqrt_s,
                scale,
                scale_sigma,
                still_s,
            } => {
                ranges.not_negative("instrument.noise_rad_per_sqrt_s", noise_rad_per_sqrt_s)?;
                ranges.finite("instrument.bias_radps", bias_radps)?;
                ranges.not_negative("instrument.bias_walk_radps_per_sqrt_s", bias_walk_radps_per_sqrt_s)?;
                share("instrument.scale", scale)?;
                ranges.not_negative("instrument.scale_sigma", scale_sigma)?;
                still(still_s)?;
            }
            Instrument::Tape { sigma_m } => ranges.positive("instrument.sigma_m", sigma_m)?,
            Instrument::Wall(wall) => {
                ranges.interval("1 / instrument.rate_hz", 1.0 / wall.rate_hz)?;
                ranges.not_negative("instrument.sigma_m", wall.sigma_m)?;
                ranges.not_negative("instrument.sigma_rad", wall.sigma_rad)?;
                ranges.positive("instrument.sigma_m + instrument.sigma_rad", wall.sigma_m + wall.sigma_rad)?;
                ranges.length("instrument.range_m", wall.range_m)?;
                ranges.length("instrument.wall_distance_m", wall.wall_distance_m)?;
                wall.finite().into_iter().try_for_each(|(key, value)| ranges.finite(key, value))?;
                still(wall.still_s)?;
                let is_elsewhere = |of: &Instrument| matches!(of, Instrument::Wall(of) if of.lever() != wall.lever());
                if self.instruments.iter().any(is_elsewhere) {
                    let message =
                        "two walls with different lever_x_m, lever_y_m or lever_theta_rad: one lidar sees all walls";
                    let (location, message) = (ranges.location.to_owned(), message.to_owned());
                    return Err(ScenarioError::Toml { location, message });
                }
            }
            Instrument::Revisit { sigma_xy_m, sigma_theta_rad } => {
                ranges.not_negative("instrument.sigma_xy_m", sigma_xy_m)?;
                ranges.not_negative("instrument.sigma_theta_rad", sigma_theta_rad)?;
                ranges.positive("instrument.sigma_xy_m + instrument.sigma_theta_rad", sigma_xy_m + sigma_theta_rad)?;
            }
        }
        Ok(())
    }

    fn check_protocols(&self, location: &str, key: &str, protocols: &[Schedule]) -> Result<(), ScenarioError> {
        check_schedules(location, key, protocols)?;
        let path = protocols.iter().any(|part| matches!(part, Schedule::ValidationPath { .. }));
        if self.budget.is_some() && path {
            let (location, key) = (location.to_owned(), key.to_owned());
            return Err(ScenarioError::NoFit { location, key, source: NoFit::ValidationPath });
        }
        Ok(())
    }
}

fn check_robot(robot: &Robot, ranges: Ranges<'_>) -> Result<(), ScenarioError> {
    let speed = |key: &str, value: f64| ranges.range(key, value, (1e-3..=1e2).contains(&value), "from 0.001 to 100");
    speed("robot.cruise_speed_m_s", robot.cruise_speed_m_s)?;
    speed("robot.acceleration_m_s2", robot.acceleration_m_s2)?;
    let (lines, gear) = (robot.encoder.lines_per_rev, robot.encoder.gear_ratio);
    ranges.range("robot.encoder.lines_per_rev", lines, (1.0..=1e6).contains(&lines), "from 1 to 1000000")?;
    ranges.range("robot.encoder.gear_ratio", gear, (1e-3..=1e6).contains(&gear), "from 0.001 to 1000000")?;
    ranges.length("robot.left_wheel_diameter_m", robot.left_wheel_diameter_m)?;
    ranges.length("robot.right_wheel_diameter_m", robot.right_wheel_diameter_m)?;
    ranges.length("robot.wheel_separation_m", robot.wheel_separation_m)?;
    let width_error = robot.encoder.state_width_error;
    ranges.range("robot.encoder.state_width_error", width_error, (0.0..1.0).contains(&width_error), "in [0, 1)")?;
    ranges.not_negative("robot.controller.right_phase_s", robot.controller.right_phase_s)?;
    ranges.positive("robot.controller.clock_hz", robot.controller.clock_hz)?;
    ranges.positive("robot.motor.supply_v", robot.motor.supply_v)?;
    ranges.positive("robot.motor.resistance_ohm", robot.motor.resistance_ohm)?;
    ranges.positive("robot.motor.torque_constant_nm_a", robot.motor.torque_constant_nm_a)?;
    ranges.positive("robot.motor.inertia_kg_m2", robot.motor.inertia_kg_m2)?;
    ranges.not_negative("robot.motor.viscous_friction_nm_s", robot.motor.viscous_friction_nm_s)?;
    ranges.not_negative("robot.motor.coulomb_friction_nm", robot.motor.coulomb_friction_nm)?;
    for mark in &robot.points {
        ranges.finite("robot.point.x_m", mark.x_m)?;
        ranges.finite("robot.point.y_m", mark.y_m)?;
    }
    let points = &robot.points;
    let twice = points.iter().enumerate().find(|(k, mark)| points[..*k].iter().any(|other| other.id == mark.id));
    if let Some((_, mark)) = twice {
        let message = format!("two [[robot.point]] have the id \"{}\"; ids must differ", mark.id);
        return Err(ScenarioError::Toml { location: ranges.location.to_owned(), message });
    }
    Ok(())
}

/// Whether schedules, the ones at `key`, can be driven at all.
fn check_schedules(location: &str, key: &str, schedules: &[Schedule]) -> Result<(), ScenarioError> {
    let ranges = Ranges { location, prefix: &format!("{key}.") };
    for part in schedules {
        match *part {
            Schedule::Straights { length_m, .. } => ranges.length("length_m", length_m)?,
            Schedule::Spins { turn_rad, .. } => {
                ranges.range("turn_rad", turn_rad, (1e-3..=1e4).contains(&turn_rad), "from 0.001 to 10000 rad")?;
            }
            Schedule::SpinsAtSpeeds { turn_rad, slowest_m_s, fastest_m_s, speeds, .. } => {
                ranges.range("turn_rad", turn_rad, (1e-3..=1e4).contains(&turn_rad), "from 0.001 to 10000 rad")?;
                ranges.range("slowest_m_s", slowest_m_s, (1e-3..=1e2).contains(&slowest_m_s), "from 0.001 to 100")?;
                let holds = fastest_m_s > slowest_m_s && fastest_m_s <= 1e2;
                ranges.range("fastest_m_s", fastest_m_s, holds, "above slowest_m_s, and 100 at most")?;
                ranges.range("speeds", f64::from(speeds), (2..=100).contains(&speeds), "from 2 to 100")?;
            }
            Schedule::Squares { side_m, .. } => ranges.length("side_m", side_m)?,
            Schedule::Circles { radius_m, turns, .. } => {
                ranges.length("radius_m", radius_m)?;
                let turns = turns.unwrap_or(1.0);
                ranges.range("turns", turns, (0.25..=1e3).contains(&turns), "from 0.25 to 1000")?;
            }
            Schedule::ValidationPath { length_m, measure_every_m, .. } => {
                ranges.length("length_m", length_m)?;
                let holds = measure_every_m >= 1e-3 && measure_every_m <= length_m;
                ranges.range("measure_every_m", measure_every_m, holds, "from 0.001 m to length_m")?;
            }
        }
    }
    let runs: u64 = schedules.iter().map(Schedule::runs).sum();
    ranges.range("runs", runs as f64, (1..=MAX_RUNS).contains(&runs), "from 1 to 100000 in all")
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::shipped::PAPER;

    fn error(text: &str) -> String {
        Scenario::parse(text, "x.toml").expect_err("not a scenario").to_string()
    }

    #[test]
    fn a_scenario_is_written_as_it_was_read() {
        let scenario = Scenario::parse(PAPER, "paper.toml").expect("the shipped scenario");
        let text = scenario.to_toml().expect("serialises");
        assert_eq!(Scenario::parse(&text, "again").expect("parses"), scenario);
    }

    #[test]
    fn paper_table_1_and_2_are_the_robots_true_geometry() {
        let scenario = Scenario::parse(PAPER, "paper.toml").expect("the shipped scenario");
        let geometry = scenario.true_geometry().expect("valid");
        let counts_per_pulse = 80.0;
        let per_pulse =
            geometry.m_per_count(scenario.robot.encoder.counts_per_wheel_turn() / counts_per_pulse).expect("valid");
        // The shipped E_d is 1.0322/1.0334 to the last bit of a double or two.
        assert!((per_pulse.left * 1e3 - 1.0334).abs() < 1e-14);
        assert!((per_pulse.right * 1e3 - 1.0322).abs() < 1e-14);
        assert_eq!(geometry.wheel_separation_m(), 0.363);
    }

    #[test]
    fn a_term_outside_of_the_catalogue_is_read_checked_and_written() {
        let with =
            |term: &str| PAPER.replacen("[[effect]]", &format!("[[effect]]\nkind = \"term\"\n{term}\n\n[[effect]]"), 1);
        let term =
            "channel = \"yaw\"\ncovariates = [\"|v|\", \"load\"]\ncoefficient = 0.01\nof_runs = { load = [0, 2.5] }";
        let scenario = Scenario::parse(&with(term), "x.toml").expect("a scenario");
        let Effect::Term(read) = &scenario.effects[0] else { panic!("{:?}", scenario.effects[0]) };
        assert_eq!(
            (read.channel.name(), &read.covariates[..], read.coefficient),
            ("yaw", &["|v|".to_owned(), "load".to_owned()][..], 0.01)
        );
        assert_eq!(read.of_runs["load"], [0.0, 2.5]);
        let text = scenario.to_toml().expect("serialises");
        assert_eq!(Scenario::parse(&text, "again").expect("parses"), scenario);
        let refusals = [
            ("\"load\"]", "\"lode\"]", "x.toml: effect term: of_runs.load is not among the covariates"),
            ("\"|v|\"", "\"speed\"", "x.toml: effect term: no covariate \"speed\"; known: \"v\", \"|v|\""),
            ("\"yaw\"", "\"heading\"", "unknown variant `heading`, expected one of `along`"),
            ("coefficient = 0.01", "coefficient = inf", "effect term: coefficient is inf; it must be finite"),
            ("coefficient", "size", "unknown field `size`"),
        ];
        for (right, wrong, why) in refusals {
            let refusal = error(&with(&term.replace(right, wrong)));
            assert!(refusal.contains(why) && !refusal.contains('\n'), "{refusal}");
        }
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let line_of = |needle: &str| PAPER[..PAPER.find(needle).expect("in the file")].matches('\n').count() + 1;
        let wrong_unit = error(&PAPER.replace("wheel_separation_m =", "wheel_separation_mm ="));
        assert!(wrong_unit.starts_with(&format!("x.toml:{}:", line_of("wheel_separation_m ="))), "{wrong_unit}");
        assert!(wrong_unit.contains("wheel_separation_m"), "{wrong_unit}");
        let unknown_effect = error(&PAPER.replace("kind = \"wheel_scale\"", "kind = \"wheel_size\""));
        assert!(
            unknown_effect.contains("wheel_size") && unknown_effect.contains("contact_patch_wheelbase"),
            "{unknown_effect}"
        );
        let missing = error(&PAPER.replace("gear_ratio = 50.26548245743669", ""));
        assert!(missing.contains("gear_ratio"), "{missing}");
        let size = error(&PAPER.replace("scale = 1.0328", "scale = -1.0328"));
        assert!(size.contains("wheel_scale: scale is -1.0328"), "{size}");
        let range = error(&PAPER.replace("cruise_speed_m_s = 0.25", "cruise_speed_m_s = 0.0"));
        assert!(range.contains("robot.cruise_speed_m_s is 0"), "{range}");
        for message in [wrong_unit, unknown_effect, missing, size, range] {
            assert!(!message.contains('\n'), "{message}");
        }
    }
}

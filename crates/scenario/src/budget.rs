//! A budget: the floor and the time, or the distance, that a calibration may take, and protocols fitted to
//! it.
//!
//! A straight run is shrunk to the longer side of the room less the robot's clearance, a square or the
//! diameter of a circle to the shorter one; nothing is stretched. Then all numbers of runs are scaled by the
//! one largest factor at which everything stays within the budget, so that the stated numbers are
//! proportions. Runs stay in pairs, one in each direction: half of an odd number would leave a bias of
//! direction in the mean.

use motion_programs::{Cost, DriveLimits, MotionProgram, Schedule};
use serde::{Deserialize, Serialize};

use crate::error::{NoFit, ScenarioError};
use crate::limits::{MAX_RUNS, Ranges};

/// What a calibration may take.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// One side of the floor, metres.
    pub room_x_m: f64,
    /// The other side of the floor, metres.
    pub room_y_m: f64,
    /// What the robot itself needs of each side, metres: its centre may move over the rest.
    pub clearance_m: f64,
    /// Time for all runs, minutes; or else `metres`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Travel for all runs, metres, mean of both wheels; or else `minutes`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres: Option<f64>,
    /// What a person needs for each run, to place the robot and to read its marks, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub handling_s: Option<f64>,
}

/// Shorter than this is no run: the least that a protocol may state, metres.
const SHORTEST_RUN_M: f64 = 1e-3;

/// Halvings of the interval that holds the common factor: from 100 000 down to the rounding of a double.
const HALVINGS: u32 = 64;

/// A protocol that fits into the room.
struct Part {
    schedule: Schedule,
    /// Stated pairs of runs: a proportion.
    pairs: f64,
    /// What one pair costs.
    pair_cost: Cost,
}

impl Part {
    fn scaled(&self, factor: f64) -> f64 {
        (factor * self.pairs).floor().max(1.0)
    }
}

impl Budget {
    pub(crate) fn check(&self, location: &str) -> Result<(), ScenarioError> {
        let ranges = Ranges { location, prefix: "budget." };
        ranges.length("room_x_m", self.room_x_m)?;
        ranges.length("room_y_m", self.room_y_m)?;
        let within = (0.0..=1e4).contains(&self.clearance_m);
        ranges.range("clearance_m", self.clearance_m, within, "from 0 to 10000 m")?;
        let message = match (self.minutes, self.metres, self.handling_s) {
            (None, None, _) => "budget: say how much with minutes or with metres",
            (Some(_), Some(_), _) => "budget: minutes and metres are two budgets; leave one out",
            (Some(_), None, None) => "budget: minutes need handling_s, what a person needs for each run",
            _ => "",
        };
        if !message.is_empty() {
            return Err(ScenarioError::Toml { location: location.to_owned(), message: message.to_owned() });
        }
        for (key, value) in [("minutes", self.minutes), ("metres", self.metres)] {
            ranges.positive(key, value.unwrap_or(1.0))?;
        }
        ranges.not_negative("handling_s", self.handling_s.unwrap_or(0.0))
    }

    /// Protocols that stay in the room and within the budget.
    pub(crate) fn fit(&self, protocols: &[Schedule], drive_limits: &DriveLimits) -> Result<Vec<Schedule>, NoFit> {
        let mut parts = Vec::with_capacity(protocols.len());
        for stated in protocols.iter().filter(|stated| stated.runs() > 0) {
            let schedule = self.bounded(*stated)?;
            let pairs = 0.5 * number(schedule.runs());
            parts.push(Part { schedule, pairs, pair_cost: cost(&schedule.with_pairs(1).programs(), drive_limits) });
        }
        let affords = |factor: f64| {
            self.affords(parts.iter().fold(Cost::default(), |sum, part| Cost {
                minutes: sum.minutes + part.scaled(factor) * part.pair_cost.minutes,
                metres: sum.metres + part.scaled(factor) * part.pair_cost.metres,
            }))
        };
        affords(0.0)?;
        let all: f64 = parts.iter().map(|part| part.pairs).sum();
        let (mut enough, mut too_much) = (0.0, 0.5 * number(MAX_RUNS) / all.max(1.0));
        if affords(too_much).is_ok() {
            enough = too_much;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (enough + too_much);
            *(if affords(middle).is_ok() { &mut enough } else { &mut too_much }) = middle;
        }
        // Whole, positive and at most MAX_RUNS.
        Ok(parts.iter().map(|part| part.schedule.with_pairs(part.scaled(enough) as u32)).collect())
    }

    /// A protocol shrunk to the room.
    fn bounded(&self, schedule: Schedule) -> Result<Schedule, NoFit> {
        let (shorter_m, longer_m) = (self.room_x_m.min(self.room_y_m), self.room_x_m.max(self.room_y_m));
        let free = |room_m: f64, least_m: f64| {
            let free_m = room_m - self.clearance_m;
            if free_m >= least_m { Ok(free_m) } else { Err(NoFit::Room { room_m, clearance_m: self.clearance_m }) }
        };
        free(shorter_m, 0.0)?; // whatever it drives, the robot must stand there
        match schedule {
            Schedule::Straights { length_m, runs } => {
                Ok(Schedule::Straights { length_m: length_m.min(free(longer_m, SHORTEST_RUN_M)?), runs })
            }
            Schedule::Squares { side_m, runs_each_way } => {
                Ok(Schedule::Squares { side_m: side_m.min(free(shorter_m, SHORTEST_RUN_M)?), runs_each_way })
            }
            Schedule::Circles { radius_m, turns, runs_each_way } => {
                let radius_m = radius_m.min(0.5 * free(shorter_m, 2.0 * SHORTEST_RUN_M)?);
                Ok(Schedule::Circles { radius_m, turns, runs_each_way })
            }
            Schedule::Spins { .. } | Schedule::SpinsAtSpeeds { .. } => Ok(schedule),
            Schedule::ValidationPath { .. } => Err(NoFit::ValidationPath),
        }
    }

    fn affords(&self, cost: Cost) -> Result<(), NoFit> {
        match (self.minutes, self.metres) {
            (Some(minutes), _) if cost.minutes > minutes => Err(NoFit::Time { needed_min: cost.minutes, minutes }),
            (_, Some(metres)) if cost.metres > metres => Err(NoFit::Travel { needed_m: cost.metres, metres }),
            _ => Ok(()),
        }
    }
}

fn number(runs: u64) -> f64 {
    runs as f64
}

/// What programs cost a robot.
pub(crate) fn cost(programs: &[MotionProgram], drive_limits: &DriveLimits) -> Cost {
    programs.iter().map(|program| drive_limits.cost(program)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Scenario;

    use crate::shipped::PAPER;

    const ROOM: Budget = Budget {
        room_x_m: 2.0,
        room_y_m: 3.0,
        clearance_m: 0.6,
        minutes: Some(20.0),
        metres: None,
        handling_s: Some(30.0),
    };

    const STRAIGHTS: Schedule = Schedule::Straights { length_m: 100.0, runs: 20 };
    const SPINS: Schedule = Schedule::Spins { turn_rad: 6.0, runs: 10 };
    const SQUARES: Schedule = Schedule::Squares { side_m: 100.0, runs_each_way: 5 };
    const CIRCLES: Schedule = Schedule::Circles { radius_m: 100.0, turns: Some(2.0), runs_each_way: 5 };

    fn paper(budget: Budget) -> Scenario {
        let mut scenario = Scenario::parse(PAPER, "paper.toml").expect("shipped");
        scenario.budget = Some(budget);
        scenario
    }

    fn fit(budget: Budget, protocols: &[Schedule]) -> Result<Vec<Schedule>, NoFit> {
        budget.fit(protocols, &paper(budget).drive_limits())
    }

    fn cost_of(budget: Budget, protocols: &[Schedule]) -> Cost {
        let programs: Vec<_> = protocols.iter().flat_map(Schedule::programs).collect();
        paper(budget).cost_of(&programs)
    }

    /// Paper's robot with other text for its budget and sweep.
    fn parse(budget: &str, sweep: &str) -> Result<Scenario, ScenarioError> {
        let (head, _) = PAPER.split_once("[sweep]").expect("the paper sweeps");
        Scenario::parse(&format!("{head}\n{budget}\n{sweep}"), "x.toml")
    }

    fn error(budget: &str, sweep: &str) -> String {
        parse(budget, sweep).expect_err("refused").to_string()
    }

    #[test]
    fn runs_are_shrunk_to_the_room_and_never_stretched() {
        let fitted = fit(ROOM, &[STRAIGHTS, SPINS, SQUARES]).expect("there is room");
        let [Schedule::Straights { length_m, .. }, Schedule::Spins { turn_rad, .. }, Schedule::Squares { side_m, .. }] =
            fitted[..]
        else {
            panic!("the same kinds: {fitted:?}")
        };
        assert_eq!((length_m, turn_rad, side_m), (3.0 - 0.6, 6.0, 2.0 - 0.6));
        let fitted = fit(ROOM, &[CIRCLES]).expect("there is room");
        assert!(matches!(fitted[0], Schedule::Circles { radius_m: 0.7, turns: Some(2.0), .. }), "{fitted:?}");
        let short =
            [Schedule::Straights { length_m: 0.5, runs: 2 }, Schedule::Squares { side_m: 0.4, runs_each_way: 1 }];
        let fitted = fit(ROOM, &short).expect("there is room");
        assert!(matches!(fitted[0], Schedule::Straights { length_m: 0.5, .. }), "{fitted:?}");
        assert!(matches!(fitted[1], Schedule::Squares { side_m: 0.4, .. }), "{fitted:?}");
    }

    /// Stated pairs and fitted ones: is there one factor, is everything afforded, and would the next larger
    /// factor cost too much?
    fn check_factor(budget: Budget, stated: &[Schedule]) {
        let fitted = fit(budget, stated).expect("there is room and time");
        let pairs = |schedules: &[Schedule]| schedules.iter().map(|s| s.runs() as f64 / 2.0).collect::<Vec<_>>();
        let (stated_pairs, fitted_pairs) = (pairs(stated), pairs(&fitted));
        let steps =
            |up: f64| stated_pairs.iter().zip(&fitted_pairs).map(move |(stated, fitted)| (fitted + up) / stated);
        let next = steps(1.0).fold(f64::INFINITY, f64::min);
        for (factor, pairs) in steps(0.0).zip(&fitted_pairs) {
            assert_eq!(pairs.fract(), 0.0, "runs come in pairs");
            assert!(*pairs == 1.0 || factor <= next * (1.0 + 1e-12), "{stated:?}: {fitted:?} are other proportions");
        }
        let affordable = |cost: Cost| {
            // The sum over single runs and the sum over pairs round differently: 1e-16 for each of some
            // hundred runs.
            let at_most = |value: f64, limit: Option<f64>| limit.is_none_or(|limit| value <= limit * (1.0 + 1e-13));
            at_most(cost.minutes, budget.minutes) && at_most(cost.metres, budget.metres)
        };
        assert!(affordable(cost_of(budget, &fitted)), "{budget:?}: {fitted:?} cost {:?}", cost_of(budget, &fitted));
        let more: Vec<Schedule> = fitted
            .iter()
            .zip(&fitted_pairs)
            .zip(steps(1.0))
            .map(|((part, pairs), step)| part.with_pairs(*pairs as u32 + u32::from(step <= next * (1.0 + 1e-12))))
            .collect();
        assert!(!affordable(cost_of(budget, &more)), "{budget:?}: {more:?} would fit too");
    }

    #[test]
    fn the_largest_common_factor_is_taken_and_never_costs_more_than_the_budget() {
        let uneven = Schedule::Straights { length_m: 0.7, runs: 7 };
        let mixes: [&[Schedule]; 6] = [
            &[STRAIGHTS],
            &[SQUARES],
            &[STRAIGHTS, SPINS],
            &[uneven, SPINS, SQUARES],
            &[SPINS, SPINS.with_pairs(40)],
            &[CIRCLES, SPINS],
        ];
        for protocols in mixes {
            for room_m in [0.8, 1.5, 4.0, 30.0] {
                for handling_s in [0.0, 45.0] {
                    let room = Budget { room_x_m: room_m, handling_s: Some(handling_s), ..ROOM };
                    for minutes in [40.0, 61.7, 500.0] {
                        check_factor(Budget { minutes: Some(minutes), ..room }, protocols);
                    }
                    for metres in [300.0, 1234.5] {
                        check_factor(Budget { minutes: None, metres: Some(metres), ..room }, protocols);
                    }
                }
            }
        }
    }

    #[test]
    fn no_run_leaves_the_room() {
        for room_x_m in [0.61, 1.0, 2.5, 9.0] {
            let budget = Budget { room_x_m, minutes: Some(600.0), ..ROOM };
            let programs: Vec<_> = fit(budget, &[STRAIGHTS, SPINS, SQUARES, CIRCLES])
                .expect("there is room")
                .iter()
                .flat_map(Schedule::programs)
                .collect();
            for program in &programs {
                let mut here = kinematics::Pose::IDENTITY;
                let (mut least, mut most) = ([0.0_f64; 2], [0.0_f64; 2]);
                for motion in &program.motions {
                    let (distance_m, turn_rad) = match *motion {
                        motion_programs::Motion::Straight { length_m } => (length_m, 0.0),
                        motion_programs::Motion::Spin { turn_rad }
                        | motion_programs::Motion::SpinAt { turn_rad, .. } => (0.0, turn_rad),
                        motion_programs::Motion::Arc { radius_m, turn_rad } => (radius_m * turn_rad.abs(), turn_rad),
                        motion_programs::Motion::Measure => continue,
                        motion_programs::Motion::Pause { .. } => panic!("no such motion in these protocols"),
                    };
                    // A quarter of a half turn ends where a circle is widest.
                    let quarter = kinematics::Increment { distance_m: 0.25 * distance_m, turn_rad: 0.25 * turn_rad };
                    for _ in 0..4 {
                        here = here * quarter.arc();
                        for (k, value) in [here.x_m, here.y_m].into_iter().enumerate() {
                            (least[k], most[k]) = (least[k].min(value), most[k].max(value));
                        }
                    }
                }
                let extent = [most[0] - least[0] + budget.clearance_m, most[1] - least[1] + budget.clearance_m];
                // The room may be turned; rounding of a square's corners is 1e-15.
                let fits = |x: f64, y: f64| extent[0] <= x + 1e-12 && extent[1] <= y + 1e-12;
                let (x, y) = (budget.room_x_m, budget.room_y_m);
                assert!(fits(x, y) || fits(y, x), "{} needs {extent:?} in {x} m by {y} m", program.id);
            }
        }
    }

    #[test]
    fn what_cannot_fit_says_why() {
        let narrow = Budget { room_x_m: 0.5, ..ROOM };
        for protocol in [STRAIGHTS, SPINS, SQUARES, CIRCLES] {
            assert_eq!(fit(narrow, &[protocol]), Err(NoFit::Room { room_m: 0.5, clearance_m: 0.6 }));
        }
        // As wide as the robot: it can turn and drive along the room, and no square is left.
        let just = Budget { room_x_m: 0.6, ..ROOM };
        assert!(fit(just, &[SPINS, STRAIGHTS]).is_ok());
        for protocol in [SQUARES, CIRCLES] {
            assert_eq!(fit(just, &[protocol]), Err(NoFit::Room { room_m: 0.6, clearance_m: 0.6 }));
        }
        let hasty = Budget { minutes: Some(0.5), ..ROOM };
        let no_time = fit(hasty, &[SPINS]).expect_err("two handlings take a minute");
        assert!(matches!(no_time, NoFit::Time { needed_min, minutes: 0.5 } if needed_min > 1.0), "{no_time:?}");
        assert!(no_time.to_string().contains("of 0.5 min"), "{no_time}");
        let near = Budget { minutes: None, metres: Some(5.0), ..ROOM };
        assert!(matches!(fit(near, &[SQUARES]), Err(NoFit::Travel { metres: 5.0, .. })));
        let path = Schedule::ValidationPath { length_m: 1.0, measure_every_m: 0.1, runs: 1 };
        assert_eq!(fit(ROOM, &[path]), Err(NoFit::ValidationPath));
    }

    #[test]
    fn endless_time_is_no_endless_work_and_nothing_is_driven_that_was_not_asked_for() {
        let endless = Budget { minutes: Some(1e12), ..ROOM };
        let fitted = fit(endless, &[STRAIGHTS, SPINS.with_pairs(0)]).expect("there is time");
        assert_eq!(fitted.len(), 1);
        assert_eq!(fitted[0].runs(), MAX_RUNS);
    }

    #[test]
    fn a_method_drives_its_own_protocols_or_the_scenarios() {
        let budget = "[budget]\nroom_x_m = 2.0\nroom_y_m = 2.0\nclearance_m = 0.6\nminutes = 20\nhandling_s = 30";
        let sweep = "[sweep]\ntrials = 2\nmethods = [\"direct\", \"umbmark\"]\n[sweep.protocols]\n\
                     umbmark = [{ kind = \"squares\", side_m = 9.0, runs_each_way = 1 }]";
        let scenario = parse(budget, sweep).expect("valid");
        let umbmark = scenario.programs_for("umbmark").expect("fits");
        assert!(umbmark.iter().all(|program| program.settings.side_m == Some(1.4)), "{umbmark:?}");
        assert!(scenario.cost_of(&umbmark).minutes <= 20.0);
        assert_eq!(scenario.programs_for("direct"), Ok(scenario.programs()));
        let without = parse("", sweep).expect("valid");
        assert_eq!(without.programs_for("umbmark").expect("fits").len(), 2);
        assert_eq!(without.programs().len(), 82 + 30 + 10);
        let driving = without.cost_of(&without.programs());
        assert!(driving.minutes > 0.0 && driving.metres > 82.0 * 0.5);
        let text = scenario.to_toml().expect("has a TOML form");
        assert_eq!(Scenario::parse(&text, "again").expect("valid"), scenario);
    }

    #[test]
    fn a_scenario_that_does_not_fit_is_refused_and_a_point_of_its_sweep_is_not() {
        let budget = |minutes: f64| {
            format!("[budget]\nroom_x_m = 2.0\nroom_y_m = 2.0\nclearance_m = 0.6\nhandling_s = 30\nminutes = {minutes}")
        };
        let hasty = error(&budget(2.0), "");
        assert!(hasty.starts_with("x.toml: protocol does not fit into the budget: one run in each"), "{hasty}");
        let sweep = "[sweep]\ntrials = 2\nmethods = [\"direct\"]\n[sweep.axes]\n\"budget.minutes\" = [2.0, 60.0]";
        let scenario = parse(&budget(20.0), sweep).expect("the scenario itself fits");
        let points = scenario.sweep.as_ref().expect("given").points(&scenario, "x.toml").expect("points");
        assert!(matches!(points[0].scenario.programs_for("direct"), Err(NoFit::Time { .. })));
        assert!(points[0].scenario.programs().is_empty());
        assert!(points[1].scenario.programs_for("direct").is_ok());
    }

    #[test]
    fn budgets_are_checked() {
        let with = |change: (&str, &str)| {
            let text = "[budget]\nroom_x_m = 2.0\nroom_y_m = 2.0\nclearance_m = 0.6\nminutes = 20\nhandling_s = 30";
            assert_eq!(text.matches(change.0).count(), 1);
            error(&text.replace(change.0, change.1), "")
        };
        for (change, message) in [
            (("minutes = 20", ""), "with minutes or with metres"),
            (("minutes = 20", "minutes = 20\nmetres = 5"), "leave one out"),
            (("handling_s = 30", ""), "need handling_s"),
            (("handling_s = 30", "handling_s = -1"), "budget.handling_s is -1"),
            (("minutes = 20", "minutes = 0"), "budget.minutes is 0"),
            (("room_x_m = 2.0", "room_x_m = 0.0"), "budget.room_x_m is 0"),
            (("clearance_m = 0.6", "clearance_m = nan"), "budget.clearance_m is NaN"),
            (("clearance_m = 0.6", ""), "clearance_m"),
            (("minutes = 20", "hours = 20"), "`metres`"),
        ] {
            let refused = with(change);
            assert!(refused.contains(message) && refused.starts_with("x.toml"), "{refused}");
        }
        let path = "[[protocol]]\nkind = \"validation_path\"\nlength_m = 9.0\nmeasure_every_m = 0.5\nruns = 1\n";
        let budget = "[budget]\nroom_x_m = 9.0\nroom_y_m = 9.0\nclearance_m = 0.6\nmetres = 2000";
        let refused = error(&format!("{path}{budget}"), "");
        assert!(refused.contains("protocol does not fit into the budget: a validation path cannot"), "{refused}");
    }
}

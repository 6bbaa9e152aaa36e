//! What a scenario drives, fitted to its budget, and what that costs.

use std::collections::BTreeMap;

use motion_programs::{Cost, DriveLimits, Motion, MotionProgram, Schedule};

use crate::budget::cost;
use crate::error::NoFit;
use crate::experiment::{Instrument, Scenario};

impl Scenario {
    /// Everything that is driven, in order: the scenario's own protocols, fitted when there is a budget.
    ///
    /// A scenario that was read fits, or reading it failed. One that was put together since, such as a point
    /// of a sweep, may not, and drives nothing then; [`Self::programs_for`] says why.
    #[must_use]
    pub fn programs(&self) -> Vec<MotionProgram> {
        self.fitted(&self.protocols).unwrap_or_default()
    }

    /// What a calibration method drives, fitted when there is a budget: its protocols of `[sweep.protocols]`,
    /// or the scenario's own.
    ///
    /// # Errors
    /// [`NoFit`] says why the method cannot be used within the budget.
    pub fn programs_for(&self, method: &str) -> Result<Vec<MotionProgram>, NoFit> {
        let own = self.sweep.as_ref().and_then(|sweep| sweep.protocols.get(method));
        self.fitted(own.unwrap_or(&self.protocols))
    }

    /// What programs cost this robot. Without a budget nothing is known of the handling, and the time is the
    /// driving alone.
    #[must_use]
    pub fn cost_of(&self, programs: &[MotionProgram]) -> Cost {
        cost(programs, &self.drive_limits())
    }

    pub(crate) fn fitted(&self, protocols: &[Schedule]) -> Result<Vec<MotionProgram>, NoFit> {
        let fitted = match &self.budget {
            Some(budget) => budget.fit(protocols, &self.drive_limits())?,
            None => protocols.to_vec(),
        };
        let mut programs: Vec<MotionProgram> = Vec::new();
        for schedule in &fitted {
            let before = programs.len();
            programs.extend(schedule.programs());
            number_on(&mut programs, before);
        }
        let (mut before_s, mut after_s) = (0.0_f64, 0.0_f64);
        for instrument in &self.instruments {
            match instrument {
                Instrument::Gyro { still_s, .. } => before_s = before_s.max(*still_s),
                Instrument::Wall(wall) => {
                    (before_s, after_s) = (before_s.max(wall.still_s), after_s.max(wall.still_s));
                }
                _ => {}
            }
        }
        for motions in programs.iter_mut().map(|program| &mut program.motions) {
            if before_s > 0.0 {
                motions.insert(0, Motion::Pause { duration_s: before_s });
            }
            if after_s > 0.0 {
                motions.push(Motion::Pause { duration_s: after_s });
            }
        }
        Ok(programs)
    }

    /// How fast the robot drives, and what a person needs for each run.
    pub(crate) fn drive_limits(&self) -> DriveLimits {
        DriveLimits {
            wheel_separation_m: self.robot.wheel_separation_m,
            cruise_speed_m_s: self.robot.cruise_speed_m_s,
            acceleration_m_s2: self.robot.acceleration_m_s2,
            handling_s: self.budget.and_then(|budget| budget.handling_s).unwrap_or(0.0),
        }
    }
}

/// Ids of the programs from `first` on go on where those of the same kind before them end: two schedules of
/// circles are no two runs of one id.
fn number_on(programs: &mut [MotionProgram], first: usize) {
    let parts =
        |id: &str| id.rsplit_once('_').and_then(|(kind, run)| Some((kind.to_owned(), run.parse::<u32>().ok()?)));
    let mut next: BTreeMap<String, u32> = BTreeMap::new();
    let (before, new) = programs.split_at_mut(first);
    for (kind, run) in before.iter().filter_map(|program| parts(&program.id)) {
        let next = next.entry(kind).or_default();
        *next = (*next).max(run + 1);
    }
    for program in new {
        if let Some((kind, run)) = parts(&program.id)
            && let Some(offset) = next.get(&kind)
        {
            program.id = format!("{kind}_{:03}", offset + run);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_two_schedules_of_one_kind_have_ids_of_their_own() {
        let mut scenario = Scenario::parse(crate::PAPER, "paper.toml").expect("it is shipped");
        let circles = |radius_m| Schedule::Circles { radius_m, turns: None, runs_each_way: 1 };
        scenario.protocols = vec![circles(1.0), Schedule::Spins { turn_rad: 1.0, runs: 1 }, circles(2.0)];
        scenario.budget = None;
        let ids: Vec<String> = scenario.programs().into_iter().map(|program| program.id).collect();
        assert_eq!(ids, ["circle_cw_000", "circle_ccw_001", "spin_000", "circle_cw_001", "circle_ccw_003"]);
    }
}

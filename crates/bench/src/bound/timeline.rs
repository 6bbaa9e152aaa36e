//! What a program makes the robot do and which instrument measures when.
//!
//! Each motion is whole counts by the nominal drive, both wheels in proportion, from standstill to
//! standstill. Counts are known where rows of the record stand still: between them the travel of a wheel is
//! in proportion to the commanded one, which is exact at constant speed and for the trapezoid. So a
//! measurement inside a motion sees a share of the motion's travel, and rows inside motions (`[log]`) tell
//! nothing that counts, but for rounded ones: a line through many rounded rows can beat the bound.

use kinematics::{Increment, Side, Wheels};
use motion_programs::Motion;

use super::model::Model;

/// Two instants closer than this are one: a nanosecond, as in the simulator.
const SAME_INSTANT_S: f64 = 1e-9;

/// What happens next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Event {
    /// A motion begins.
    Motion(Travel),
    /// A share of the motion's travel is driven.
    Drive {
        /// Of the whole motion.
        share: f64,
    },
    /// An instrument measures.
    Measurement {
        /// Which, in the model's order.
        measurement: usize,
        /// When, seconds from the run's start.
        t_s: f64,
    },
}

/// A motion's travel, and the wheel phases between which it takes place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Travel {
    /// Controller counts of each wheel.
    pub(super) counts: Wheels<f64>,
    /// The phase at its start, index into [`Timeline::phases`].
    pub(super) before: Wheels<usize>,
    /// The phase at its end.
    pub(super) after: Wheels<usize>,
}

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timeline {
    /// Everything in order.
    pub(super) events: Vec<Event>,
    /// Where in a tick each wheel stands still, counts since its start modulo a tick, each once.
    pub(super) phases: Wheels<Vec<i64>>,
}

impl Timeline {
    pub(super) fn of(model: &Model, motions: &[Motion]) -> Self {
        let mut run = Run {
            model,
            timeline: Self { events: Vec::new(), phases: Wheels::both(vec![0]) },
            t_s: 0.0,
            measurements: vec![0; model.measurements()],
            last_standing_s: None,
            counts: Wheels::both(0),
            phase: Wheels::both(0),
        };
        run.measure_until(0.0, None);
        run.stand();
        let cruise_m_s = model.cruise_speed_m_s();
        for motion in motions {
            match *motion {
                Motion::Measure => run.stand(),
                Motion::Pause { duration_s } => run.pass(duration_s, None),
                Motion::Straight { length_m } => run.go(Increment { distance_m: length_m, turn_rad: 0.0 }, cruise_m_s),
                Motion::Spin { turn_rad } => run.go(Increment { distance_m: 0.0, turn_rad }, cruise_m_s),
                Motion::SpinAt { turn_rad, speed_m_s } => run.go(Increment { distance_m: 0.0, turn_rad }, speed_m_s),
                Motion::Arc { radius_m, turn_rad } => {
                    run.go(Increment { distance_m: radius_m * turn_rad.abs(), turn_rad }, cruise_m_s);
                }
            }
        }
        run.stand();
        run.timeline
    }
}

/// A run being laid out.
struct Run<'a> {
    model: &'a Model,
    timeline: Timeline,
    t_s: f64,
    /// How often each instrument has looked by itself.
    measurements: Vec<u32>,
    last_standing_s: Option<f64>,
    counts: Wheels<i64>,
    phase: Wheels<usize>,
}

impl Run<'_> {
    /// The standing robot is read, once an instant.
    fn stand(&mut self) {
        if self.last_standing_s.is_some_and(|last_s| self.t_s <= last_s + SAME_INSTANT_S) {
            return;
        }
        self.last_standing_s = Some(self.t_s);
        for measurement in (0..self.measurements.len()).filter(|of| self.model.reads_standing(*of)) {
            self.timeline.events.push(Event::Measurement { measurement, t_s: self.t_s });
        }
    }

    fn go(&mut self, increment: Increment, speed_m_s: f64) {
        let counts = self.model.commanded_counts(increment);
        let longest = counts.left.abs().max(counts.right.abs());
        if longest <= 0.0 {
            return;
        }
        let (speed, acceleration) = self.model.speed_and_acceleration_of_counts(counts, speed_m_s);
        let time_scale = TimeScale::of(longest, speed, self.model.ramps.then_some(acceleration));
        let before = self.phase;
        for side in Side::BOTH {
            // Whole counts.
            let travel = counts[side] as i64;
            self.counts[side] += travel;
            let phase = self.counts[side].rem_euclid(i64::from(self.model.counts_per_tick));
            let known = &mut self.timeline.phases[side];
            self.phase[side] = known.iter().position(|other| *other == phase).unwrap_or_else(|| {
                known.push(phase);
                known.len() - 1
            });
        }
        self.timeline.events.push(Event::Motion(Travel { counts, before, after: self.phase }));
        self.pass(time_scale.duration_s, Some(&time_scale));
    }

    /// Time passes, standing or moving at a pace.
    fn pass(&mut self, duration_s: f64, time_scale: Option<&TimeScale>) {
        self.measure_until(duration_s, time_scale);
        self.t_s += duration_s;
    }

    /// Every measurement that an instrument takes by itself until `duration_s` from now, and the driving up
    /// to there.
    fn measure_until(&mut self, duration_s: f64, time_scale: Option<&TimeScale>) {
        let mut driven = 0.0;
        let mut drive_to = |share: f64, events: &mut Vec<Event>| {
            if share > driven {
                events.push(Event::Drive { share: share - driven });
                driven = share;
            }
        };
        loop {
            let next = (0..self.measurements.len())
                .filter_map(|measurement| {
                    Some((f64::from(self.measurements[measurement]) / self.model.rate_hz(measurement)?, measurement))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((t_s, measurement)) = next.filter(|(t_s, _)| *t_s <= self.t_s + duration_s + SAME_INSTANT_S)
            else {
                break;
            };
            self.measurements[measurement] += 1;
            if let Some(time_scale) = time_scale {
                drive_to(time_scale.share(t_s - self.t_s), &mut self.timeline.events);
            }
            self.timeline.events.push(Event::Measurement { measurement, t_s });
        }
        if time_scale.is_some() {
            drive_to(1.0, &mut self.timeline.events);
        }
    }
}

/// How a motion's travel goes by: constant speed, or a trapezoid of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TimeScale {
    duration_s: f64,
    /// Length of each ramp.
    ramp_s: f64,
}

impl TimeScale {
    /// `longest` counts at most at `speed` counts/s, up and down at `acceleration` counts/s² where there are
    /// ramps.
    fn of(longest: f64, speed: f64, acceleration: Option<f64>) -> Self {
        match acceleration {
            None => Self { duration_s: longest / speed, ramp_s: 0.0 },
            Some(acceleration) => {
                let peak = speed.min((longest * acceleration).sqrt());
                let ramp_s = peak / acceleration;
                Self { duration_s: longest / peak + ramp_s, ramp_s }
            }
        }
    }

    /// Share of the travel that is behind after `t_s`.
    fn share(&self, t_s: f64) -> f64 {
        let left_s = self.duration_s - t_s;
        let speed = 1.0 / (self.duration_s - self.ramp_s);
        if t_s <= 0.0 {
            0.0
        } else if left_s <= SAME_INSTANT_S {
            1.0
        } else if t_s < self.ramp_s {
            0.5 * speed * t_s * t_s / self.ramp_s
        } else if left_s < self.ramp_s {
            1.0 - 0.5 * speed * left_s * left_s / self.ramp_s
        } else {
            speed * (t_s - 0.5 * self.ramp_s)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenario::Scenario;

    #[test]
    fn a_trapezoid_drives_all_of_its_travel_at_the_speed_that_it_says() {
        // With a top (4 s at 0.25 of 1 and ramps of 0.5 s), without, and without ramps.
        for (time_scale, duration_s) in [
            (TimeScale::of(1.0, 0.25, Some(0.5)), 4.5),
            (TimeScale::of(0.02, 0.25, Some(0.5)), 0.4),
            (TimeScale::of(1.0, 0.25, None), 4.0),
        ] {
            assert!((time_scale.duration_s - duration_s).abs() < 1e-12, "{time_scale:?}");
            assert_eq!((time_scale.share(0.0), time_scale.share(time_scale.duration_s)), (0.0, 1.0));
            let (steps, h) = (1000, time_scale.duration_s / 1000.0);
            let shares: Vec<f64> = (0..=steps).map(|step| time_scale.share(f64::from(step) * h)).collect();
            let top = 1.0 / (time_scale.duration_s - time_scale.ramp_s);
            for (step, ends) in (0..steps).zip(shares.windows(2)) {
                let middle_s = (f64::from(step) + 0.5) * h;
                let ramp = middle_s.min(time_scale.duration_s - middle_s) / time_scale.ramp_s;
                let speed = if ramp < 1.0 { top * ramp } else { top };
                // A step across a ramp's end is off by an eighth of the speed's change in it.
                assert!(
                    ((ends[1] - ends[0]) / h - speed).abs() <= 0.2 * top * h / time_scale.ramp_s.max(h),
                    "{time_scale:?} {middle_s}"
                );
            }
        }
    }

    #[test]
    fn equal_phases_of_a_tick_are_one() {
        let text = scenario::PAPER;
        let scenario = Scenario::parse(text, "paper.toml").expect("the shipped scenario");
        let model = Model::of(&scenario).expect("bounded");
        // 500 ticks of 80 counts, forth and back, and an odd one.
        let motions = [0.5, -0.5, 0.00025].map(|length_m| Motion::Straight { length_m });
        let timeline = Timeline::of(&model, &motions);
        assert_eq!(timeline.phases, Wheels::both(vec![0, 20]));
        // The grid reads at both ends only.
        let measurements: Vec<_> =
            timeline.events.iter().filter(|event| matches!(event, Event::Measurement { .. })).collect();
        assert_eq!(measurements.len(), 2);
    }
}

//! Another term at given sizes times a covariate: by how much its form is off.

use dataset::RunInfo;
use kinematics::Pose;
use model_term::{Interval, Measurement, ModelTerm, TermParameter};

use super::recorded::PreviousIntervals;
use super::sparse::seen;
use crate::covariate::Covariate;

/// Relative deviation from a term's form, for each unit of the covariate.
///
/// Thirty times the term at 1 m/s are once the term at the 3 cm/s of a toy; and so it is with the first two
/// seconds of a minute.
const DEVIATION: [TermParameter; 1] = [TermParameter { name: "deviation", unit: "1", prior_sigma: 30.0 }];

/// A term at given sizes, times a covariate. Its parameter is the deviation of the term's form from its own,
/// relative to it and for each unit of the covariate.
#[derive(Clone)]
pub(super) struct Modulated {
    term: Box<dyn ModelTerm>,
    sizes: Vec<f64>,
    by: Covariate,
    past: PreviousIntervals,
    /// The term's own gradient.
    own: Vec<Pose>,
}

impl Modulated {
    pub(super) fn new(mut term: Box<dyn ModelTerm>, sizes: Vec<f64>, by: Covariate) -> Self {
        term.linearize_at(&sizes);
        let own = vec![Pose::IDENTITY; sizes.len()];
        Self { term, sizes, by, past: PreviousIntervals::NONE, own }
    }

    /// What the term adds at its sizes, times the covariate.
    fn times(&self, value: f64) -> Pose {
        let add = |sum: Pose, (size, own): (&f64, &Pose)| {
            let size = size * value;
            Pose::new(sum.x_m + size * own.x_m, sum.y_m + size * own.y_m, sum.theta_rad + size * own.theta_rad)
        };
        self.sizes.iter().zip(&self.own).fold(Pose::IDENTITY, add)
    }
}

impl ModelTerm for Modulated {
    fn parameters(&self) -> &[TermParameter] {
        &DEVIATION
    }

    fn restart(&mut self, run: &RunInfo) {
        self.term.restart(run);
        self.past = PreviousIntervals::NONE;
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        self.own.fill(Pose::IDENTITY);
        self.term.motion(interval, &mut self.own);
        if interval.dt_s > 0.0 {
            let at = self.past.sample(interval);
            gradient[0] = self.times(self.by.value(&at));
        }
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        self.own.fill(Pose::IDENTITY);
        self.term.measurement(measurement, &mut self.own);
        if self.by.is_of_a_measurement() {
            gradient[0] =
                self.times(self.by.value(&seen(measurement.twist, measurement.world_from_body, measurement.t_s)));
        }
    }
}

#[cfg(test)]
mod tests {
    use kinematics::{Twist, Wheels};
    use model_term::NoRecord;

    use super::*;

    /// 1 and 10 along, 2 and 20 across, 3 and 30 in yaw; as many hundredths for what is seen.
    #[derive(Clone)]
    struct Two;

    fn two(scale: f64) -> [Pose; 2] {
        [1.0, 10.0].map(|of| Pose::new(scale * of, 2.0 * scale * of, 3.0 * scale * of))
    }

    impl ModelTerm for Two {
        fn parameters(&self) -> &[TermParameter] {
            &[TermParameter { name: "a", unit: "1", prior_sigma: 1.0 }; 2]
        }

        fn motion(&mut self, _: &Interval<'_>, gradient: &mut [Pose]) {
            gradient.copy_from_slice(&two(1.0));
        }

        fn measurement(&mut self, _: &Measurement<'_>, gradient: &mut [Pose]) {
            gradient.copy_from_slice(&two(0.01));
        }
    }

    fn is(found: Pose, expected: [f64; 3]) {
        let found = [found.x_m, found.y_m, found.theta_rad];
        // Rounding of numbers about 1.
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?} {expected:?}");
    }

    #[test]
    fn it_is_the_term_at_its_sizes_times_the_covariate() {
        let run = RunInfo::default();
        let interval = Interval {
            t_s: 30.0,
            dt_s: 0.1,
            late_s: [0.0; 2],
            travel_m: Wheels { left: -0.01, right: -0.03 },
            speed_m_s: Wheels { left: -0.1, right: -0.3 },
            speed_at_ends_m_s: [Wheels { left: -0.1, right: -0.3 }; 2],
            count_m: Wheels::both(0.0),
            wheel_separation_m: 0.4,
            wheel_rad: Wheels::both(0.0),
            turned_rad: Wheels::both(0.0),
            world_from_body: Pose::IDENTITY,
            session_m: 0.0,
            run: &run,
        };
        let twist = Twist { v_m_s: -0.2, omega_rad_s: -0.5 };
        let measurement = Measurement {
            t_s: 30.0,
            world_from_body: Pose::IDENTITY,
            twist,
            twist_of_terms: Twist::default(),
            record: &NoRecord,
            run: &run,
        };
        // 0.5 · 1 − 0.2 · 10 = −1.5 along. At −0.2 m/s and −0.5 rad/s, half a minute from the start.
        for (by, value) in [(Covariate::AbsSpeed, 0.2), (Covariate::AbsYawRate, 0.5), (Covariate::RunTime, 0.5)] {
            let mut term = Modulated::new(Box::new(Two), vec![0.5, -0.2], by);
            let mut gradient = [Pose::IDENTITY];
            term.motion(&interval, &mut gradient);
            is(gradient[0], [-1.5, -3.0, -4.5].map(|of| value * of));
            term.measurement(&measurement, &mut gradient);
            is(gradient[0], [-0.015, -0.03, -0.045].map(|of| value * of));
        }
    }

    #[test]
    fn what_no_measurement_knows_leaves_what_is_seen_alone() {
        let run = RunInfo::default();
        let twist = Twist { v_m_s: 1.0, omega_rad_s: 1.0 };
        let measurement = Measurement {
            t_s: 1.0,
            world_from_body: Pose::IDENTITY,
            twist,
            twist_of_terms: Twist::default(),
            record: &NoRecord,
            run: &run,
        };
        let mut gradient = [Pose::IDENTITY];
        let term = Box::new(Two);
        Modulated::new(term, vec![1.0, 1.0], Covariate::Acceleration).measurement(&measurement, &mut gradient);
        is(gradient[0], [0.0; 3]);
    }
}

//! A term of the measurement model: what an unmodelled effect adds to the odometry or to what the instrument
//! sees, as a function of recorded quantities.
//!
//! The trait lives here, below both the calibrators, whose likelihood consumes terms, and the effects, which
//! implement them. A term sees what was recorded, the geometry in force and where the fit puts the robot; it
//! cannot see what a simulator hid.

use kinematics::{Increment, Pose, Twist, Wheels};

use dataset::RunInfo;

/// One interval between two recorded rows, or a part of it.
#[derive(Debug, Clone, Copy)]
pub struct Interval<'r> {
    /// Its start, seconds from the run's start.
    pub t_s: f64,
    /// Length, seconds.
    pub dt_s: f64,
    /// How late the stamps at its start and its end are against the regular beat of the log's rows, seconds;
    /// between two rows, in proportion. In a log with gaps only their difference has a meaning: by how much
    /// the row is longer than the usual one, unless by so much that it is true.
    pub late_s: [f64; 2],
    /// Travel of each wheel by its counts and the geometry in force, metres.
    pub travel_m: Wheels<f64>,
    /// Mean speed of each wheel's contact, m/s: what covariates are made of. Where counts are coarse it is
    /// that of several rows around, so that the rounding of this row's counts, which the residuals have too,
    /// is not in it.
    pub speed_m_s: Wheels<f64>,
    /// Speed of each wheel's contact at the start and at the end, m/s, from as many rows before as after.
    pub speed_at_ends_m_s: [Wheels<f64>; 2],
    /// What a count of each wheel is, metres; 0 where counts are as good as exact.
    pub count_m: Wheels<f64>,
    /// Distance between the wheels in force, metres.
    pub wheel_separation_m: f64,
    /// Angle of each wheel at the start, by its counter, radians: its phase where the log is continuous.
    pub wheel_rad: Wheels<f64>,
    /// Turn of each wheel in the interval, by its counter, radians.
    pub turned_rad: Wheels<f64>,
    /// Where the robot is at the start, by the counts and what the instrument saw.
    pub world_from_body: Pose,
    /// How far the centre went in the runs before and in this one, metres: what wears with distance.
    pub session_m: f64,
    /// The run, with its covariates and its place on the session's clock.
    pub run: &'r RunInfo,
}

impl Interval<'_> {
    /// Motion of the drive's centre by the counts.
    #[inline]
    #[must_use]
    pub fn increment(&self) -> Increment {
        Increment::from_travel(self.travel_m, self.wheel_separation_m)
    }

    /// Travel of each wheel at its mean speed, metres: without the rounding of this interval's counts, which
    /// the residuals have too. What a term multiplies, compares or bends is made of it. An interval of no
    /// length has no speed: its travel is that of its counts.
    #[inline]
    #[must_use]
    pub fn smooth_travel_m(&self) -> Wheels<f64> {
        if self.dt_s > 0.0 { self.speed_m_s.map(|speed_m_s| speed_m_s * self.dt_s) } else { self.travel_m }
    }

    /// Motion of the drive's centre by the wheels' mean speeds.
    #[inline]
    #[must_use]
    pub fn smooth_increment(&self) -> Increment {
        Increment::from_travel(self.smooth_travel_m(), self.wheel_separation_m)
    }

    /// Motion of the drive's centre when the wheels' travels change by this much.
    #[inline]
    #[must_use]
    pub fn change(&self, travel_m: Wheels<f64>) -> Pose {
        let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, self.wheel_separation_m);
        Pose::new(distance_m, 0.0, turn_rad)
    }

    /// Change of each wheel's speed over the interval, m/s. Changes of successive intervals add up to that of
    /// the speeds.
    #[inline]
    #[must_use]
    pub fn speed_change_m_s(&self) -> Wheels<f64> {
        let [start, end] = self.speed_at_ends_m_s;
        end.zip_with(start, |end, start| end - start)
    }

    /// Time on the session's clock, seconds; that of the run where the run does not say when it began.
    #[inline]
    #[must_use]
    pub fn session_s(&self) -> f64 {
        self.run.start_s.unwrap_or(0.0) + self.t_s
    }
}

/// How a robot moved by the record after an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedMotion {
    /// Motion of the drive's centre by the wheels' speeds, distance and turn.
    pub increment: Increment,
    /// Where it ends, seconds from the run's start: the record may end earlier than was asked.
    pub until_s: f64,
    /// Velocity there.
    pub twist: Twist,
}

/// What is recorded of a run.
pub trait MotionRecord: std::fmt::Debug {
    /// The motion from one instant to a later one, seconds from the run's start; `None` where nothing is
    /// recorded after the first.
    fn between(&self, from_s: f64, to_s: f64) -> Option<RecordedMotion>;
}

/// A run of which nothing is recorded beside a measurement.
#[derive(Debug, Clone, Copy)]
pub struct NoRecord;

impl MotionRecord for NoRecord {
    fn between(&self, _from_s: f64, _to_s: f64) -> Option<RecordedMotion> {
        None
    }
}

/// One measurement of the outside instrument.
#[derive(Debug, Clone, Copy)]
pub struct Measurement<'r> {
    /// When it was, seconds from the run's start.
    pub t_s: f64,
    /// Where the robot was then, by the counts and what the instrument saw.
    pub world_from_body: Pose,
    /// How it moved then, by the counts of as many rows before as after.
    pub twist: Twist,
    /// What the terms in force add to that, by the interval before.
    pub twist_of_terms: Twist,
    /// What is recorded around it, for terms by which it was of another instant.
    pub record: &'r dyn MotionRecord,
    /// The run.
    pub run: &'r RunInfo,
}

/// A parameter of a term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermParameter {
    /// Its name, with the unit's suffix; the same as in the effect's simulation model where the two mean the
    /// same.
    pub name: &'static str,
    /// Its unit, for people.
    pub unit: &'static str,
    /// A size that would be large for a real robot: the standard deviation of what is plausible before any
    /// data.
    pub prior_sigma: f64,
}

/// A mean term, linear in its parameters: what an effect adds to the motion of an interval, or to what the
/// instrument sees.
///
/// State along the run (a castor's angle, a backlash) is kept by the implementor; [`Self::restart`] forgets
/// it. Intervals and measurements come in the order of time. Runs may go to copies of a term, at the same
/// time.
pub trait ModelTerm: CopyTerm + Send + Sync {
    /// The parameters in the order of the gradients.
    fn parameters(&self) -> &[TermParameter];

    /// The values at which the term is asked next: one that is not linear over so large a value gives what it
    /// does there, over that value.
    fn linearize_at(&mut self, values: &[f64]) {
        let _ = values;
    }

    /// A run begins; nothing stays known of the run before.
    fn restart(&mut self, run: &RunInfo) {
        let _ = run;
    }

    /// Derivative of the interval's motion by each parameter, at zero size: along and across its middle's
    /// heading, and its turn (x, y, θ). `gradient` is as long as
    /// [`Self::parameters`] and comes in as zeros.
    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let _ = (interval, gradient);
    }

    /// Whether its measurement is of the body elsewhere, as where it is of another instant: what is seen on
    /// the body turns with it.
    fn moves_body(&self) -> bool {
        false
    }

    /// Derivative of the pose that the instrument measures, in the frame of the measured body (x, y, θ), by
    /// each parameter, at zero size. `gradient` is as above.
    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        let _ = (measurement, gradient);
    }
}

/// What lets a boxed term be copied; every term that is [`Clone`] has it.
pub trait CopyTerm {
    /// The term, with its state.
    fn copy(&self) -> Box<dyn ModelTerm>;
}

impl<T: ModelTerm + Clone + 'static> CopyTerm for T {
    fn copy(&self) -> Box<dyn ModelTerm> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn ModelTerm> {
    fn clone(&self) -> Self {
        // Of the term: the box is a `Clone` itself.
        (**self).copy()
    }
}

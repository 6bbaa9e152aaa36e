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
    /// Start and end of the logged interval of which it is a part, or the whole: a measurement between two
    /// rows cuts it.
    pub row_s: [f64; 2],
    /// Travel of each wheel by its counts and the geometry in force, metres.
    pub travel_m: Wheels<f64>,
    /// Travel of each wheel in the interval before, by the same, metres; zero at the start of a run.
    pub previous_m: Wheels<f64>,
    /// Length of the interval before, seconds; that of this one at the start of a run.
    pub previous_dt_s: f64,
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

    /// Motion of the drive's centre when the wheels' travels change by this much.
    #[inline]
    #[must_use]
    pub fn change(&self, travel_m: Wheels<f64>) -> Pose {
        let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, self.wheel_separation_m);
        Pose::new(distance_m, 0.0, turn_rad)
    }

    /// Mean speed of each wheel's contact, m/s; zero in an interval of no length.
    #[inline]
    #[must_use]
    pub fn speed_m_s(&self) -> Wheels<f64> {
        self.travel_m.map(|travel_m| if self.dt_s > 0.0 { travel_m / self.dt_s } else { 0.0 })
    }

    /// Mean speed of each wheel's contact in the interval before, m/s.
    #[inline]
    #[must_use]
    pub fn previous_speed_m_s(&self) -> Wheels<f64> {
        self.previous_m.map(|travel_m| if self.previous_dt_s > 0.0 { travel_m / self.previous_dt_s } else { 0.0 })
    }

    /// Time on the session's clock, seconds; that of the run where the run does not say when it began.
    #[inline]
    #[must_use]
    pub fn session_s(&self) -> f64 {
        self.run.start_s.unwrap_or(0.0) + self.t_s
    }
}

/// One measurement of the outside instrument.
#[derive(Debug, Clone, Copy)]
pub struct Measurement<'r> {
    /// When it was, seconds from the run's start.
    pub t_s: f64,
    /// Where the robot was then, by the counts and what the instrument saw.
    pub world_from_body: Pose,
    /// How it moved then, by the counts.
    pub twist: Twist,
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

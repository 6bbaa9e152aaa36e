//! `term`: what no name of the catalogue explains, as a coefficient times a product of at most three
//! covariates on one channel.
//!
//! Model: along, across and yaw gain coefficient · Π covariates per second, and so does the travel of wheels,
//! each by covariates of its own; seen_along, seen_across and seen_heading are off by coefficient · Π
//! covariates, and seen_late is so long ago. [`Sparse`] is the estimation model, which sees recorded
//! quantities and which diagnosis seeks over a library; [`SparseTerm`] is the simulation model, as scenarios
//! have it and diagnosis writes it. It is no id of the catalogue: nothing says what it is, only what it goes
//! with.
//!
//! Reference: Brunton, Proctor & Kutz 2016 (sparse terms over a library of functions); columns are normalised
//! because a threshold on raw coefficients depends on units.

use std::collections::BTreeMap;

use kinematics::{Twist, Wheels};
use model_term::ModelTerm;
use serde::{Deserialize, Serialize};

use crate::IntervalError;
use crate::channel::Channel;
use crate::covariate::{Covariate, KinematicSample};
use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading, RunStart, Step};
use crate::hypothesis::{Hypothesis, Variant};
use crate::motion_history::{MotionHistory, MotionHistoryTracker};
use crate::on_board::OnBoard;
use modulated::Modulated;
use product_batch::ProductBatch;
use recorded::{OfRows, ROW_SHARE, Recorded};
pub use sparse::Sparse;
use sparse::{CONSTANT, on_channel, parameter, seen};

mod modulated;
mod product_batch;
mod recorded;
mod sparse;

/// `kind` of a [`SparseTerm`] in a scenario.
pub(crate) const TERM: &str = "term";
/// Most covariates of a product.
const MAX_COVARIATES: usize = 3;

impl Sparse {
    /// How recorded data show it.
    #[must_use]
    pub fn term(&self) -> Box<dyn ModelTerm> {
        if self.is_of_rows()
            && let Some(variant) = IntervalError::hypothesis().into_variants().and_then(|mut variants| variants.pop())
        {
            return Box::new(OfRows { of: variant.term, own: [parameter(self)] });
        }
        Box::new(Recorded::new(self))
    }

    /// Many of them as one term, which has their coefficients in turn. `None` where one of them is none of
    /// [`Self::shares_samples`].
    #[must_use]
    pub fn batched(all: &[Self]) -> Option<Box<dyn ModelTerm>> {
        all.iter().all(Self::shares_samples).then(|| Box::new(ProductBatch::new(all)) as Box<dyn ModelTerm>)
    }
}

/// By how much a term's form is off with a covariate: the term at given sizes times the covariate. The
/// parameter is the deviation relative to the term, for each unit of the covariate; `sizes` are as many as
/// the term has parameters.
#[must_use]
pub fn modulated(term: Box<dyn ModelTerm>, sizes: Vec<f64>, by: Covariate) -> Box<dyn ModelTerm> {
    Box::new(Modulated::new(term, sizes, by))
}

/// A term of a given size, for the simulator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SparseTerm {
    /// What it adds to.
    pub channel: Channel,
    /// Names of one to three covariates ([`Covariate`]), or keys of `of_runs`; `["1"]` for a constant. The
    /// same one may come several times.
    pub covariates: Vec<String>,
    /// Size where the covariates' product is 1: m/s along and across, rad/s in yaw; metres and radians on
    /// what the instrument sees.
    pub coefficient: f64,
    /// What runs have in turn, over and over, of covariates that are the runs' own. Every run's record says
    /// its value, unless another effect has said it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub of_runs: BTreeMap<String, Vec<f64>>,
}

impl SparseTerm {
    /// A product with its size; `of_runs` has the values of the runs' own covariates.
    #[must_use]
    pub fn new(sparse: &Sparse, coefficient: f64, of_runs: BTreeMap<String, Vec<f64>>) -> Self {
        Self { channel: sparse.channel, covariates: sparse.names(), coefficient, of_runs }
    }

    /// The product that its names mean.
    ///
    /// # Errors
    /// [`EffectError`]: too many or no covariates, unknown ones, ones that the channel cannot have, or values
    /// of runs that make no covariate.
    pub fn sparse(&self) -> Result<Sparse, EffectError> {
        let no_term = |problem: String| Err(EffectError::NoTerm { problem });
        let channel = self.channel.name();
        for (key, values) in &self.of_runs {
            if Covariate::named(key).is_some() || key == CONSTANT {
                return no_term(format!("of_runs.{key}: the name is taken"));
            }
            if !self.covariates.contains(key) {
                return no_term(format!("of_runs.{key} is not among the covariates"));
            }
            if values.iter().any(|value| !value.is_finite()) || Covariate::of_run(key, values).is_none() {
                return no_term(format!("of_runs.{key} must be finite values that differ"));
            }
        }
        if self.covariates.is_empty() || self.covariates.len() > MAX_COVARIATES {
            let count = self.covariates.len();
            return no_term(format!("{count} covariates; one to {MAX_COVARIATES}, or \"{CONSTANT}\" for a constant"));
        }
        let covariates = if self.covariates == [CONSTANT] {
            Vec::new()
        } else {
            self.covariates.iter().map(|name| self.covariate(name)).collect::<Result<_, _>>()?
        };
        let of_wheels = self.channel.is_of_wheels();
        if let Some(own) = covariates.iter().find(|covariate| covariate.is_of_a_wheel() && !of_wheels) {
            let wheels = Channel::WHEELS.map(Channel::name).join(", ");
            return no_term(format!("\"{}\" is a covariate of {wheels} alone, not of {channel}", own.name()));
        }
        let sparse = Sparse { channel: self.channel, covariates };
        if sparse.is_of_rows() && sparse != Sparse::of_rows() {
            let (rows, wheel) = (Covariate::RowLength.name(), Covariate::WheelSpeed.name());
            return no_term(format!("\"{rows}\" is a covariate of the channel wheels with \"{wheel}\" alone"));
        }
        let covariates = &sparse.covariates;
        let (what, holds) = if self.channel.is_of_instrument() {
            ("takes these covariates alone", covariates.iter().all(Covariate::is_of_a_measurement))
        } else {
            ("must vanish at standstill and needs one of these", covariates.iter().any(Covariate::vanishes_at_rest))
        };
        if !holds {
            let fits = |covariate: &&Covariate| match self.channel.is_of_instrument() {
                true => covariate.is_of_a_measurement(),
                false => covariate.vanishes_at_rest() && (of_wheels || !covariate.is_of_a_wheel()),
            };
            return no_term(format!("{channel} {what}: {}", listed(Covariate::NAMED.iter().filter(fits))));
        }
        Ok(sparse)
    }

    fn covariate(&self, name: &str) -> Result<Covariate, EffectError> {
        let of_runs = || Covariate::of_run(name, self.of_runs.get(name)?);
        Covariate::named(name).or_else(of_runs).ok_or_else(|| {
            let known = listed(Covariate::NAMED.iter());
            let problem = format!("no covariate \"{name}\"; known: {known}, and what of_runs has values of");
            EffectError::NoTerm { problem }
        })
    }

    /// How recorded data show it: a mean term without shape parameters. `None` where its names mean none.
    #[must_use]
    pub(crate) fn shown(&self) -> Option<Hypothesis> {
        let term = self.sparse().ok()?.term();
        Some(Hypothesis::Terms(vec![Variant { fixed: Vec::new(), term, at: None }]))
    }
}

fn listed<'c>(covariates: impl Iterator<Item = &'c Covariate>) -> String {
    covariates.map(|covariate| format!("\"{}\"", covariate.name())).collect::<Vec<_>>().join(", ")
}

impl PhysicalEffect for SparseTerm {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite(TERM, [("coefficient", self.coefficient)])?;
        self.sparse().map(|_| ())
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        let sparse = self.sparse().ok()?;
        if sparse.is_of_rows() {
            // Rows are of unlike length where stamps are irregular, and it shows in no others.
            let irregular =
                IntervalError { share: self.coefficient / ROW_SHARE, jitter_s: IntervalError::TYPICAL_JITTER_S };
            return if self.coefficient == 0.0 { None } else { irregular.forward() };
        }
        Some(Box::new(State {
            size: self.clone(),
            sparse,
            of_run: BTreeMap::new(),
            session_s: 0.0,
            session_m: 0.0,
            memory: MotionHistoryTracker::NONE,
            twist: Twist::default(),
        }))
    }

    /// A mean term; of which form, an instance says.
    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Vec::new())
    }

    fn description() -> Description {
        Description {
            on_board: OnBoard::Never("a product of covariates has no statements of its own"),
            ..Description::of("a product of covariates that no effect of the catalogue has")
        }
    }
}

/// The simulation model in a run.
struct State {
    size: SparseTerm,
    sparse: Sparse,
    of_run: BTreeMap<String, f64>,
    /// Start of the run on the session's clock, seconds.
    session_s: f64,
    /// Way of the drive's centre in the session, metres.
    session_m: f64,
    memory: MotionHistoryTracker,
    /// v and ω of the last step, for what is seen after it.
    twist: Twist,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { on_run_start: true, floor: true, instrument: self.sparse.channel.is_of_instrument(), ..Hooks::NONE }
    }

    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        (self.session_s, self.session_m) = (run.session_s, run.session_m);
        (self.memory, self.twist) = (MotionHistoryTracker::NONE, Twist::default());
        for (key, values) in &self.size.of_runs {
            let value = values[run.number as usize % values.len()];
            let predicted = *run.info.covariates.entry(key.clone()).or_insert(value);
            self.of_run.insert(key.clone(), predicted);
        }
    }

    fn floor(&mut self, step: &mut Step) {
        let mean = |wheels: Wheels<f64>| 0.5 * (wheels.left + wheels.right);
        let turn = |wheels: Wheels<f64>| (wheels.right - wheels.left) / step.wheel_separation_m;
        // By the wheels' true size, which is what counts come to once they are calibrated.
        let wheel_m_s = step.radius_m.zip_with(step.rate_rad_s, |radius_m, rate| radius_m * rate);
        let wheel_m_s2 = step.radius_m.zip_with(step.acceleration_rad_s2, |radius_m, rate| radius_m * rate);
        let (v_m_s, omega_rad_s) = (mean(wheel_m_s), turn(wheel_m_s));
        self.twist = Twist { v_m_s, omega_rad_s };
        if self.sparse.channel.is_of_instrument() {
            return;
        }
        let half_s = 0.5 * step.dt_s;
        let (distance_m, turn_rad) = (v_m_s * step.dt_s, omega_rad_s * step.dt_s);
        let travel_m = wheel_m_s.map(|wheel_m_s| wheel_m_s * step.dt_s);
        let MotionHistory { since_reversal_m, wheel_since_reversal_m, last_turn } =
            self.memory.after(travel_m, distance_m, turn_rad);
        let at = KinematicSample {
            v_m_s,
            omega_rad_s,
            acceleration_m_s2: mean(wheel_m_s2),
            yaw_acceleration_rad_s2: turn(wheel_m_s2),
            heading_rad: step.world_from_body.theta_rad + omega_rad_s * half_s,
            wheel_m_s,
            wheel_m_s2,
            own_m_s: 0.0,
            own_m_s2: 0.0,
            own_since_reversal_m: [f64::INFINITY; 2],
            wheel_rad: step.wheel_angle_rad.zip_with(step.wheel_rad, |angle, turned| angle + 0.5 * turned),
            turned_rad: step.wheel_rad,
            run_s: step.t_s + half_s,
            session_s: self.session_s + step.t_s + half_s,
            session_m: self.session_m,
            since_reversal_m,
            wheel_since_reversal_m,
            last_turn,
            x_m: step.world_from_body.x_m,
            y_m: step.world_from_body.y_m,
            of_run: &self.of_run,
        };
        self.session_m += distance_m.abs();
        let scale = self.size.coefficient * step.dt_s;
        let channel = self.sparse.channel;
        if channel.is_of_wheels() {
            let gained = self.sparse.of_wheels(channel, &at);
            step.travel_m = step.travel_m.zip_with(gained, |travel_m, gained| travel_m + scale * gained);
            return;
        }
        let size = scale * self.sparse.product(&at);
        match channel {
            Channel::Along => step.travel_m = step.travel_m.map(|travel_m| travel_m + size),
            Channel::Across => step.lateral_m += size,
            _ => step.extra_turn_rad += size,
        }
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        let at = seen(self.twist, reading.world_from_body, reading.t_s);
        let size = self.size.coefficient * self.sparse.product(&at);
        reading.world_from_body = reading.world_from_body * on_channel(self.sparse.channel, size, self.twist);
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        let is_exact = |covariate: &Covariate| match (self.sparse.channel.is_of_instrument(), covariate) {
            (true, Covariate::CosHeading | Covariate::SinHeading) | (false, Covariate::OfRun { .. }) => true,
            (is_of_instrument, covariate) => !is_of_instrument && covariate.is_a_speed(),
        };
        let exact = self.sparse.covariates.iter().all(is_exact);
        (!exact).then_some("its covariate changes within a motion")
    }

    /// What goes with v or ω alone goes with the distance or the turn, however fast.
    fn depends_on_speed(&self) -> bool {
        self.size.coefficient != 0.0 && self.sparse.covariates.iter().filter(|of| of.is_a_speed()).count() > 1
    }
}

#[cfg(test)]
mod tests;

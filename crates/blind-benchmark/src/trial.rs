//! One robot driven again and again, for the oracle's own test.

use dataset::Dataset;
use kinematics::DriveGeometry;

use crate::conditions::{Conditions, Stamps};
use crate::draw::CaseDraws;
use crate::drive::{DriveContext, Recorded, drive, mean_square_motion};
use crate::error::ChallengeError;
use crate::hidden::Hidden;
use crate::instrument::InstrumentModel;
use crate::oracle::{Detectability, Hypotheses};
use crate::oracle_view::size_ratio;
use crate::robot::RandomRobot;
use crate::true_noise::TrueNoise;

/// One robot driven again and again with an effect at the oracle's limit, for the oracle's own test.
pub(crate) struct Trial {
    seed: u64,
    conditions: Conditions,
    robot: RandomRobot,
    instrument_model: InstrumentModel,
    hidden: Hidden,
    noise: TrueNoise,
    truth: DriveGeometry,
    plain: Vec<Dataset>,
    pub(crate) noncentrality: f64,
}

impl Trial {
    /// The first robot that shows the effect, in its catalogue's form, under white noise and many
    /// measurements.
    pub(crate) fn at_limit(seed: u64, id: &'static str) -> Result<Option<Self>, ChallengeError> {
        for attempt in 0..200 {
            let draws = CaseDraws { seed, case: 0, attempt };
            let conditions = Conditions::draw(draws, Hidden::needs(id), &[id]);
            let instrument_model = InstrumentModel::draw(draws, &conditions);
            let robot = RandomRobot::draw(draws, &conditions, instrument_model.rate_hz, Hidden::needs(id))?;
            let Some(mut hidden) = Hidden::draw(id, &robot, &mut draws.of("hidden")) else { continue };
            let plainly = instrument_model.class == super::instrument::NoiseClass::White
                && instrument_model.kind == super::instrument::TruthKind::Dense
                && conditions.stamps == Stamps::Exact
                && conditions.lost_row_share + conditions.clock_drift.abs() == 0.0;
            if !plainly || hidden.other_form {
                continue;
            }
            let truth = robot.sessions[0].scenario.true_geometry().map_err(sim_yair::SimulationError::from)?;
            let measurement = DriveContext {
                seed,
                number: 0,
                conditions: &conditions,
                robot: &robot,
                instrument_model: &instrument_model,
                instrument: None,
            };
            let plain = drive(&robot.sessions, &measurement, &[], Recorded::WithoutNoise, 0)?;
            let noise = TrueNoise::of(&conditions, &instrument_model, mean_square_motion(&plain));
            if noise.has_rounding() {
                continue;
            }
            let mut noncentrality = 0.0;
            for _ in 0..4 {
                let exact = drive(&robot.sessions, &measurement, &[&hidden], Recorded::WithoutNoise, 0)?;
                let own = Hypotheses::One(hidden.id);
                let Some(detectability) = Detectability::of(&exact, &plain, &truth, noise, own) else {
                    return Ok(None);
                };
                noncentrality = detectability.noncentrality_in_form(hidden.id);
                let off = size_ratio(&hidden, &detectability);
                if (0.99..1.01).contains(&off) {
                    break;
                }
                hidden.scale /= off;
            }
            return Ok(Some(Self {
                seed,
                conditions,
                robot,
                instrument_model,
                hidden,
                noise,
                truth,
                plain,
                noncentrality,
            }));
        }
        Ok(None)
    }

    /// The oracle's statistic on a drive with noise of its own, with the effect or without.
    pub(crate) fn statistic(&self, number: u64, hidden: bool) -> Result<f64, ChallengeError> {
        let Self { seed, conditions, robot, instrument_model, .. } = self;
        let measurement = DriveContext { seed: *seed, number, conditions, robot, instrument_model, instrument: None };
        let all = [&self.hidden];
        let data = drive(&robot.sessions, &measurement, if hidden { &all } else { &[] }, Recorded::AsLogged, 0)?;
        let own = Hypotheses::One(self.hidden.id);
        let detectability = Detectability::of(&data, &self.plain, &self.truth, self.noise, own);
        Ok(detectability.map_or(0.0, |detectability| detectability.statistic(self.hidden.id)))
    }
}

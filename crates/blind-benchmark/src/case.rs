//! One case: a random robot, what is hidden in it, what it brings home, and what the oracle knows. Addressed
//! by seed and number alone.

use dataset::Dataset;
use effects::Needs;
use kinematics::DriveGeometry;

use super::case_instrument::CaseInstrument;
use super::case_kind::CaseKind;
use super::conditions::Conditions;
use super::cut_log::{self, Stops};
use super::draw::{CaseDraws, Draw};
use super::drive::{DriveContext, HELD_OUT_RUN, OTHER_SESSION, PLANNED, Recorded, drive, mean_square_motion};
use super::hidden::{EffectKind, Hidden, hideable};
use super::instrument::InstrumentModel;
use super::oracle::{Detectability, Hypotheses};
use super::power::DISCRIMINATION_LEVEL;
use super::robot::{RandomRobot, SessionPlan};
use super::true_noise::TrueNoise;
use crate::error::ChallengeError;
use crate::fault_aliases::fault_aliases;
use crate::oracle_view::{OracleView, form_share, has_random_signature, known_noncentrality, size_ratio, view};
use crate::scope::Scope;

/// A case ready to be diagnosed.
pub(crate) struct Case {
    seed: u64,
    number: u64,
    pub(crate) case_kind: CaseKind,
    pub(crate) conditions: Conditions,
    pub(crate) robot: RandomRobot,
    pub(crate) instrument_model: InstrumentModel,
    instrument: Option<CaseInstrument>,
    pub(crate) hidden: Vec<Hidden>,
    pub(crate) oracle: Vec<OracleView>,
    pub(crate) datasets: Vec<Dataset>,
    /// Where each is cut into runs, where that is asked.
    stops: Vec<Stops>,
    /// The held-out log, without noise, and the same without the effects.
    pub(crate) held_out: Option<(Dataset, Dataset)>,
    /// The held-out log with one effect alone, for each of the catalogue's form with a random signature: its
    /// index among the hidden ones, and the log.
    pub(crate) held_out_random: Vec<(usize, Dataset)>,
    /// What a calibration without the effects would find, without noise.
    pub(crate) best_drive: Option<estimation::Model>,
    pub(crate) noise: TrueNoise,
    /// Robots that were drawn before whose encoder does not resolve what is hidden.
    pub(crate) unresolved_robots: usize,
}

/// What came of a robot that was drawn for a case.
enum Attempt {
    Ready(Box<Case>),
    /// Its paths do not show what is hidden.
    Undetectable,
    /// They would, but for the rounding of its encoder.
    Unresolved,
}

/// Sizes over the detection limit: of singles, and where names are asked for and not power.
const SINGLE_RATIOS: [f64; 2] = [0.3, 10.0];
const NAMED_RATIOS: [f64; 2] = [1.6, 10.0];
/// The same of large effects, as far as a real robot may have them.
const LARGE_RATIOS: [f64; 2] = [10.0, 100.0];
/// A size that cannot be chosen closer to the ratio wanted than this is drawn again.
const MAX_RATIO_ERROR: f64 = 1.5;
/// Steps in which a scale is sought.
const MAX_STEPS: usize = 5;
/// Another form of which the hypothesis takes up less is another effect: the forms of
/// tests/effects/hypotheses leave at most 0.65² of their squares.
const MIN_SHARE: f64 = 0.5;
/// Robots and paths that are tried for an effect.
const ATTEMPTS: u64 = 10;

/// The least and the largest size over the detection limit.
const fn size_ratios(case_kind: CaseKind) -> [f64; 2] {
    match case_kind {
        CaseKind::Pair | CaseKind::OneLog => NAMED_RATIOS,
        CaseKind::Large => LARGE_RATIOS,
        CaseKind::Null | CaseKind::Single | CaseKind::LeftOut => SINGLE_RATIOS,
    }
}

/// What a case is made of.
struct DrawnCase {
    conditions: Conditions,
    instrument_model: InstrumentModel,
    robot: RandomRobot,
    hidden: Vec<Hidden>,
    /// What the scales are drawn with.
    draw: Draw,
}

impl DrawnCase {
    /// `None` where the robot cannot have what is to be hidden.
    fn draw(
        draws: CaseDraws,
        case_kind: CaseKind,
        instrument: Option<CaseInstrument>,
        ids: &[&'static str],
    ) -> Result<Option<Self>, ChallengeError> {
        let needs = ids.iter().fold(Needs::default(), |all, id| all.and(Hidden::needs(id)));
        if case_kind == CaseKind::OneLog && needs.payload {
            return Ok(None); // a load is one for a run
        }
        let mut drawn = Conditions::draw(draws, needs, ids);
        if case_kind == CaseKind::OneLog {
            drawn.runs = 1;
        }
        let conditions = instrument.map_or(drawn, |instrument| instrument.conditions(drawn));
        let instrument_model = match instrument {
            Some(instrument) => instrument.model(&conditions),
            None => InstrumentModel::draw(draws, &conditions),
        };
        let robot = RandomRobot::draw(draws, &conditions, instrument_model.rate_hz, needs)?;
        let robot = match instrument {
            Some(instrument) => instrument.robot(robot, draws),
            None => robot,
        };
        let mut draw = draws.of("hidden");
        let mut hidden = Vec::new();
        for id in ids {
            let Some(effect) = Hidden::draw(id, &robot, &mut draw) else { return Ok(None) };
            hidden.push(effect);
        }
        Ok(Some(Self { conditions, instrument_model, robot, hidden, draw }))
    }
}

impl Case {
    /// The case of a number; `None` where no robot that was tried shows the effect at all.
    pub(crate) fn draw(scope: Scope, seed: u64, number: u64) -> Result<Result<Self, &'static str>, ChallengeError> {
        let (case_kind, index) = CaseKind::in_scope(scope, number);
        let mut unresolved_robots = 0;
        for attempt in 0..ATTEMPTS {
            // Two that show on the same paths, or one that the instrument or one log can show, are drawn anew
            // until met.
            let is_drawn_anew = matches!(case_kind, CaseKind::Pair | CaseKind::OneLog) || scope.instrument().is_some();
            let ids = Self::ids(seed, number, case_kind, index, if is_drawn_anew { attempt } else { 0 });
            match Self::attempt(CaseDraws { seed, case: number, attempt }, case_kind, scope.instrument(), &ids)? {
                Attempt::Ready(case) => return Ok(Ok(Self { unresolved_robots, ..*case })),
                Attempt::Unresolved => unresolved_robots += 1,
                Attempt::Undetectable => {}
            }
        }
        Ok(Err(Self::ids(seed, number, case_kind, index, 0).first().copied().unwrap_or("")))
    }

    /// What is hidden: left-out rounds take the catalogue in turn, the others draw. Nineteen of twenty drawn
    /// have a mean or scatter: a gross fault is one of a few discrete things.
    fn ids(seed: u64, number: u64, case_kind: CaseKind, index: u64, attempt: u64) -> Vec<&'static str> {
        let mut draw = Draw::of(seed, number, "what", attempt);
        let all = hideable();
        let of =
            |kind: EffectKind| all.iter().filter(move |(_, of)| *of == kind).map(|(id, _)| *id).collect::<Vec<_>>();
        let mut one = |record_fault: f64, scatter: f64| {
            let uniform = draw.uniform(0.0, 1.0);
            let list = of(if uniform < record_fault {
                EffectKind::RecordFault
            } else if uniform < record_fault + scatter {
                EffectKind::Scatter
            } else {
                EffectKind::Mean
            });
            list[draw.below(list.len())]
        };
        match case_kind {
            CaseKind::Null => Vec::new(),
            CaseKind::Single => vec![one(0.1, 0.15)],
            CaseKind::Large | CaseKind::OneLog => vec![one(0.0, 0.0)],
            CaseKind::Pair => {
                let first = one(0.0, 0.0);
                let mut second = one(0.0, 0.0);
                while second == first {
                    second = one(0.0, 0.0);
                }
                vec![first, second]
            }
            CaseKind::LeftOut => vec![all[index as usize % all.len()].0],
        }
    }

    fn attempt(
        draws: CaseDraws,
        case_kind: CaseKind,
        instrument: Option<CaseInstrument>,
        ids: &[&'static str],
    ) -> Result<Attempt, ChallengeError> {
        let CaseDraws { seed, case: number, .. } = draws;
        let Some(DrawnCase { conditions, instrument_model, robot, mut hidden, mut draw }) =
            DrawnCase::draw(draws, case_kind, instrument, ids)?
        else {
            return Ok(Attempt::Undetectable);
        };
        let measurement = DriveContext {
            seed,
            number,
            conditions: &conditions,
            robot: &robot,
            instrument_model: &instrument_model,
            instrument,
        };
        let truth = robot.sessions[0].scenario.true_geometry().map_err(sim_yair::SimulationError::from)?;
        let weak = hidden.iter().any(|hidden| hidden.kind != EffectKind::RecordFault);
        let plain =
            if weak { drive(&robot.sessions, &measurement, &[], Recorded::WithoutNoise, 0)? } else { Vec::new() };
        let is_cut = case_kind == CaseKind::OneLog;
        let stops: Vec<Stops> = plain.iter().filter(|_| is_cut).map(cut_log::stops).collect();
        // An effect of one log is as large as the cut one shows it, where every run starts anew.
        let plain = cut_into_runs(plain, &stops);
        let noise = TrueNoise::of(&conditions, &instrument_model, mean_square_motion(&plain));
        let case_oracle = CaseOracle { context: &measurement, plain: &plain, stops: &stops, truth, noise };
        let (mut detectability, mut rounding_shares) = (Vec::new(), Vec::new());
        for effect in &mut hidden {
            match case_oracle.scaled(effect, &mut draw, size_ratios(case_kind))? {
                Ok(found) => {
                    detectability.push(found.detectability);
                    rounding_shares.push(found.rounding_share);
                }
                Err(attempt) => return Ok(attempt),
            }
        }
        let all: Vec<&Hidden> = hidden.iter().collect();
        let both = if hidden.len() == 2 {
            Detectability::of(&case_oracle.driven(&all)?, &plain, &truth, noise, Hypotheses::All)
        } else {
            None
        };
        let mut oracle = Vec::new();
        for (k, effect) in hidden.iter().enumerate() {
            let mut view = view(effect, k, &detectability, both.as_ref(), &hidden);
            view.rounding_share = rounding_shares[k].filter(|_| effect.kind == EffectKind::Mean);
            if effect.kind == EffectKind::RecordFault {
                view.aliases = fault_aliases(effect.id, &case_oracle.driven(&[effect])?, &truth, noise);
            }
            oracle.push(view);
        }
        let best = both.as_ref().or(detectability.first().and_then(Option::as_ref));
        let best_drive = best.map(Detectability::best_drive);
        let datasets = drive(&robot.sessions, &measurement, &all, Recorded::AsLogged, 0)?;
        let held_out = if weak { case_oracle.held_out(&all)?.zip(case_oracle.held_out(&[])?) } else { None };
        let mut held_out_random = Vec::new();
        for (index, effect) in
            hidden.iter().enumerate().filter(|(_, effect)| !effect.other_form && has_random_signature(effect))
        {
            held_out_random.extend(case_oracle.held_out(&[effect])?.map(|log| (index, log)));
        }
        Ok(Attempt::Ready(Box::new(Self {
            seed,
            number,
            case_kind,
            conditions,
            instrument_model,
            instrument,
            hidden,
            oracle,
            datasets,
            stops,
            held_out,
            held_out_random,
            best_drive,
            noise,
            unresolved_robots: 0,
            robot,
        })))
    }

    /// The robot with what it hides drives some more, with noise, and what the oracle then knows of its only
    /// effect, which is a mean: other names, each with the noncentrality of the test between it and the true
    /// one by all that was driven.
    pub(crate) fn drive_more(&self, plans: &[SessionPlan]) -> Result<Option<FurtherRuns>, ChallengeError> {
        let (Some(effect), Some(truth)) = (self.hidden.first(), self.truth()) else { return Ok(None) };
        let measurement = self.drive_context();
        let all = |hidden: &[&Hidden]| -> Result<Vec<Dataset>, ChallengeError> {
            let mut all = drive(&self.robot.sessions, &measurement, hidden, Recorded::WithoutNoise, 0)?;
            all.extend(drive(plans, &measurement, hidden, Recorded::WithoutNoise, PLANNED)?);
            Ok(all)
        };
        let Some(detectability) = Detectability::of(&all(&[effect])?, &all(&[])?, &truth, self.noise, Hypotheses::All)
        else {
            return Ok(None);
        };
        let rivals = detectability.rivals(effect.id, known_noncentrality(effect, &detectability));
        Ok(Some(FurtherRuns { datasets: drive(plans, &measurement, &[effect], Recorded::AsLogged, PLANNED)?, rivals }))
    }

    /// Its long logs cut into runs; none where that is not asked.
    pub(crate) fn cut(&self) -> Vec<Dataset> {
        cut_log::cut_all(&self.datasets, &self.stops)
    }

    /// The session on other paths, without noise.
    pub(crate) fn drive_elsewhere(&self) -> Result<Vec<Dataset>, ChallengeError> {
        let hidden: Vec<&Hidden> = self.hidden.iter().collect();
        drive(
            std::slice::from_ref(&self.robot.other),
            &self.drive_context(),
            &hidden,
            Recorded::WithoutNoise,
            OTHER_SESSION,
        )
    }

    /// Its sessions, recorded as asked.
    pub(crate) fn sessions(&self, recorded: Recorded) -> Result<Vec<Dataset>, ChallengeError> {
        let hidden: Vec<&Hidden> = self.hidden.iter().collect();
        drive(&self.robot.sessions, &self.drive_context(), &hidden, recorded, 0)
    }

    fn drive_context(&self) -> DriveContext<'_> {
        DriveContext {
            seed: self.seed,
            number: self.number,
            conditions: &self.conditions,
            robot: &self.robot,
            instrument_model: &self.instrument_model,
            instrument: self.instrument,
        }
    }

    /// The drive that a calibration should find.
    pub(crate) fn truth(&self) -> Option<DriveGeometry> {
        self.robot.sessions[0].scenario.true_geometry().ok()
    }
}

/// What a robot brings home that drives some more.
pub(crate) struct FurtherRuns {
    pub(crate) datasets: Vec<Dataset>,
    pub(crate) rivals: Vec<(&'static str, f64)>,
}

/// Logs cut into runs, where that is asked.
fn cut_into_runs(logs: Vec<Dataset>, stops: &[Stops]) -> Vec<Dataset> {
    if stops.is_empty() { logs } else { cut_log::cut_all(&logs, stops) }
}

enum Chosen {
    RecordFault,
    Detectability(Box<Detectability>),
    Undetectable,
}

/// What the oracle knows of an effect at the scale that was chosen.
struct ScaledEffect {
    /// `None` for record faults.
    detectability: Option<Detectability>,
    /// `None` where rounding does not matter.
    rounding_share: Option<f64>,
}

/// Drives of a case without noise.
struct CaseOracle<'c> {
    context: &'c DriveContext<'c>,
    /// The sessions without effects.
    plain: &'c [Dataset],
    stops: &'c [Stops],
    truth: DriveGeometry,
    noise: TrueNoise,
}

impl CaseOracle<'_> {
    /// The sessions with some effects.
    fn driven(&self, hidden: &[&Hidden]) -> Result<Vec<Dataset>, ChallengeError> {
        drive(&self.context.robot.sessions, self.context, hidden, Recorded::WithoutNoise, 0)
    }

    /// The held-out log with some effects.
    fn held_out(&self, hidden: &[&Hidden]) -> Result<Option<Dataset>, ChallengeError> {
        let plan = std::slice::from_ref(&self.context.robot.held_out);
        Ok(drive(plan, self.context, hidden, Recorded::WithoutNoise, HELD_OUT_RUN)?.pop())
    }

    /// Sets the scale of an effect, or says why its robot is none for it.
    fn scaled(
        &self,
        effect: &mut Hidden,
        draw: &mut Draw,
        ratios: [f64; 2],
    ) -> Result<Result<ScaledEffect, Attempt>, ChallengeError> {
        let Self { plain, stops, truth, noise, .. } = self;
        // What was driven last, and at which scale: it is asked several things.
        let mut last: Option<(f64, Vec<Dataset>)> = None;
        let mut measured = |effect: &Hidden, noise: TrueNoise, hypotheses: Hypotheses<'_>| {
            let driven = match last.take().filter(|(scale, _)| *scale == effect.scale) {
                Some((_, driven)) => driven,
                None => cut_into_runs(self.driven(&[effect])?, stops),
            };
            let found = Detectability::of(&driven, plain, truth, noise, hypotheses);
            last = Some((effect.scale, driven));
            Ok(found)
        };
        let detectability =
            match scale(effect, draw, ratios, |effect, hypotheses| measured(effect, *noise, hypotheses))? {
                Chosen::RecordFault => None,
                Chosen::Detectability(found) => Some(*found),
                Chosen::Undetectable => {
                    return Ok(Err(match measured(effect, noise.without_rounding(), Hypotheses::One(effect.id)) {
                        Ok(Some(unrounded)) if is_unresolved(effect, &unrounded, *noise) => Attempt::Unresolved,
                        _ => Attempt::Undetectable,
                    }));
                }
            };
        let rounding_share = match &detectability {
            Some(found) if noise.has_rounding() => {
                measured(effect, noise.without_rounding(), Hypotheses::One(effect.id))?
                    .map(|unrounded| 1.0 - known_noncentrality(effect, found) / known_noncentrality(effect, &unrounded))
            }
            _ => None,
        };
        Ok(Ok(ScaledEffect { detectability, rounding_share }))
    }
}

/// Sets a scale at which the effect is as large as drawn, in units of the oracle's detection limit.
fn scale(
    effect: &mut Hidden,
    draw: &mut Draw,
    [low, high]: [f64; 2],
    mut measured: impl FnMut(&Hidden, Hypotheses<'_>) -> Result<Option<Detectability>, ChallengeError>,
) -> Result<Chosen, ChallengeError> {
    if effect.kind == EffectKind::RecordFault {
        return Ok(Chosen::RecordFault);
    }
    effect.scale = effect.most.min(1.0);
    let Some(first) = measured(effect, Hypotheses::One(effect.id))? else { return Ok(Chosen::Undetectable) };
    let at_first = size_ratio(effect, &first);
    // The largest that a real robot may have must reach the limit, or the paths do not show the effect.
    let most = at_first * effect.most / effect.scale;
    if most.is_nan() || most <= low.max(1.0) {
        return Ok(Chosen::Undetectable);
    }
    let wanted = draw.log_uniform(low, high.min(most));
    let mut found = at_first;
    // How fast the ratio grows with the scale: as its first power, until two points say otherwise.
    let mut growth = 1.0_f64;
    for _ in 0..MAX_STEPS {
        let off = wanted / found;
        if (1.0 / MAX_RATIO_ERROR.sqrt()..=MAX_RATIO_ERROR.sqrt()).contains(&off) {
            break;
        }
        let before = (effect.scale, found);
        effect.scale = (effect.scale * off.powf(1.0 / growth).clamp(1e-3, 1e3)).min(effect.most);
        if effect.act().is_none() {
            return Ok(Chosen::Undetectable);
        }
        let Some(next) = measured(effect, Hypotheses::One(effect.id))? else { return Ok(Chosen::Undetectable) };
        let at_next = size_ratio(effect, &next);
        if at_next.is_nan() || at_next <= 0.0 {
            return Ok(Chosen::Undetectable);
        }
        let slope = (at_next / before.1).ln() / (effect.scale / before.0).ln();
        growth = if slope.is_finite() { slope.clamp(0.3, 6.0) } else { 1.0 };
        found = at_next;
    }
    let off = wanted / found;
    let close = (1.0 / MAX_RATIO_ERROR..=MAX_RATIO_ERROR).contains(&off);
    if !close {
        return Ok(Chosen::Undetectable);
    }
    let Some(found) = measured(effect, Hypotheses::All)? else { return Ok(Chosen::Undetectable) };
    // A form that another name's hypothesis describes better is, to whoever has these hypotheses, that other
    // effect.
    let described_better = || {
        found
            .rivals(effect.id, known_noncentrality(effect, &found))
            .first()
            .is_some_and(|(_, left)| *left < -DISCRIMINATION_LEVEL)
    };
    let of_its_kind = !effect.other_form || (form_share(effect, &found) > MIN_SHARE && !described_better());
    let of_its_own = effect.kind == EffectKind::Scatter || !found.is_explained_by_geometry();
    if of_its_kind && of_its_own { Ok(Chosen::Detectability(Box::new(found))) } else { Ok(Chosen::Undetectable) }
}

/// Whether an effect at its scale would show, were it not for the rounding.
fn is_unresolved(effect: &Hidden, unrounded: &Detectability, noise: TrueNoise) -> bool {
    let largest = size_ratio(effect, unrounded) * effect.most / effect.scale;
    noise.has_rounding() && effect.kind == EffectKind::Mean && largest > 1.0
}

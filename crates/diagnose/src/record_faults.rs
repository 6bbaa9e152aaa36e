//! Gross faults first: swapped or reversed wheels, factors, wraps, torn reads. Each is a rewriting of the records, judged by the likelihood of a base fit.
//!
//! A factor on both wheels is no matter of the likelihood, which fits any lengths: how plausible the fitted lengths are decides. A fault that a fit
//! hides is worse than none.

use dataset::{Dataset, Session};
use effects::{CATALOGUE, Hypothesis, RecordCorrection, hypothesis};
use estimation::{FitSettings, ModelFit, NoiseComponent};

use crate::augmented_model::{cost, count};

/// A rewriting must make the data likelier by this factor, e^20, over the records as they are: dozens are tried, and each claims much.
const GAIN: f64 = 20.0;
/// Wheels are known to a few per cent; the separation, to which skid steering adds, less well.
const WHEEL_SD: f64 = 0.05;
const SEPARATION_SD: f64 = 0.3;
/// Swapped wheels are, to the likelihood, reversed ones under an instrument that looks backward; an instrument mostly looks ahead.
const MOUNT_SD_RAD: f64 = 0.3;
/// A wheel noise, m/√m, beyond which counts hardly follow the robot.
const WHEEL_SIGMA: f64 = 0.01;
/// The same of turns, rad/√rad.
const TURN_SIGMA: f64 = 0.05;
/// So many times as much and the counts do not follow the robot at all.
const LOST: f64 = 3.0;
/// Measurements that err by this share of how far they saw the robot go, or by so many radians, hardly saw it.
const BLURRED: f64 = 0.3;
/// A share of measurements that do not fit beyond which something is wrong with the records.
const OUTLIERS: f64 = 0.01;
/// Share of the measurements that did not fit before which may still not fit in records that are rewritten, and a share of all measurements that may: tails are heavy, rows are lost as
/// well, and each such look is charged.
const STILL_OFF: f64 = 0.5;
const MAY_BE_OFF: f64 = 0.1;

/// A fault with the records without it.
pub(crate) struct Fault {
    pub(crate) id: &'static str,
    pub(crate) values: Vec<(&'static str, f64)>,
    pub(crate) sentence: String,
    pub(crate) records: Vec<Dataset>,
    /// Log of how much likelier the data become.
    pub(crate) gain: f64,
}

impl Fault {
    /// Whether counts that were lost are restored only roughly, so that measurements may still lie off.
    pub(crate) fn is_restored_roughly(&self) -> bool {
        effects::description(self.id).is_some_and(|description| description.record_fault.is_restored_roughly)
    }
}

const PLAIN: FitSettings = FitSettings::GEOMETRY_ONLY;

/// An instrument turned farther than this on the robot is more of a claim than the fault.
const MAX_ROTATED_RAD: f64 = 1.0;

pub(crate) fn sessions(datasets: &[Dataset]) -> Vec<Session<'_>> {
    datasets.iter().map(Dataset::session).collect()
}

/// The fault that the log itself shows, or else that makes the data far likelier, if there is one; `outlying` leaves it at the former.
pub(crate) fn fault(
    datasets: &[Dataset],
    base: Option<&ModelFit<'_>>,
    without: &[String],
    outlying: bool,
) -> Option<Fault> {
    let sound = base.is_some_and(is_sound);
    let lost = base.is_some_and(|base| !follows(base));
    let mut best: Option<(bool, Fault)> = None;
    // The most specific trace first: jumps that are undone at once are also wraps.
    for id in CATALOGUE.iter().rev().filter(|id| !without.iter().any(|out| out == *id)) {
        let Some(Hypothesis::Records(corrections)) = hypothesis(id) else { continue };
        // What leaves no trace is possible in any records; it is tried where the base fit is hard to believe.
        if sound && effects::description(id).is_some_and(|description| !description.record_fault.leaves_a_trace) {
            continue;
        }
        for Form { values, sentence, visible_in_log, records } in together(datasets, corrections) {
            if outlying && !visible_in_log {
                continue;
            }
            let own = sessions(&records);
            let Ok(fit) = PLAIN.fit(&own) else { continue };
            // Records that no plausible drive follows, rewritten or not, say nothing of the fault, unless they show it by themselves. What was lost is not
            // restored to the last count: measurements may still lie off, but far fewer of them.
            let most_outliers = base.map_or(MAY_BE_OFF, |base| MAY_BE_OFF.max(STILL_OFF * rejected_share(base)));
            let follows = is_drive(&fit)
                && rejected_share(&fit) < most_outliers
                && fit.solution.model.body_from_sensor.theta_rad.abs() <= MAX_ROTATED_RAD;
            if !follows && !visible_in_log {
                continue;
            }
            let gain = base.map_or(f64::MAX, |base| {
                // Measurements that only one of the fits explains are charged as outliers to the other.
                let measurements = count(base).max(count(&fit));
                cost(base, measurements) + implausible(base) - cost(&fit, measurements) - implausible(&fit)
            });
            // What the log shows needs no instrument; one must not contradict it, where it has anything to say.
            let least = match visible_in_log {
                true if lost => f64::NEG_INFINITY,
                true => -GAIN,
                false => GAIN,
            };
            let better = |(shown, known): &(bool, Fault)| {
                (visible_in_log, gain) > (*shown, known.gain + f64::from(u8::from(*shown)))
            };
            if gain > least && best.as_ref().is_none_or(better) {
                best = Some((visible_in_log, Fault { id, values, sentence, records, gain: gain.max(GAIN) }));
            }
        }
    }
    best.map(|(_, fault)| fault)
}

/// How implausible the geometry parameters of a fit are, as a part of its cost.
fn implausible(fit: &ModelFit<'_>) -> f64 {
    let (model, nominal) = (&fit.solution.model, &fit.nominal);
    let off = |of: f64, nominal: f64, sd: f64| 0.5 * ((of / nominal).abs().ln() / sd).powi(2);
    off(model.m_per_rad.left, nominal.m_per_rad.left, WHEEL_SD)
        + off(model.m_per_rad.right, nominal.m_per_rad.right, WHEEL_SD)
        + off(model.separation_m, nominal.separation_m, SEPARATION_SD)
        + 0.5 * (model.body_from_sensor.theta_rad / MOUNT_SD_RAD).powi(2)
}

/// Share of measurements that a fit takes for outliers.
pub(crate) fn rejected_share(fit: &ModelFit<'_>) -> f64 {
    fit.solution.pass.outliers.len() as f64 / fit.records.measurements().max(1) as f64
}

/// Does a base fit look like a robot whose counts follow it?
fn is_sound(fit: &ModelFit<'_>) -> bool {
    is_drive(fit) && rejected_share(fit) < OUTLIERS
}

/// Does the robot go where a drive of any lengths would, by the counts?
pub(crate) fn follows(fit: &ModelFit<'_>) -> bool {
    let sigma = |of| fit.solution.noise.sigma(of);
    sigma(NoiseComponent::Wheel) < LOST * WHEEL_SIGMA
        && sigma(NoiseComponent::Turn) < LOST * TURN_SIGMA
        && sigma(NoiseComponent::MeasurementPosition) < BLURRED * fit.records.extent_m()
        && sigma(NoiseComponent::MeasurementHeading) < BLURRED
}

/// Are a fit's lengths and noise those of a drive?
fn is_drive(fit: &ModelFit<'_>) -> bool {
    let (model, nominal) = (&fit.solution.model, &fit.nominal);
    let near = |of: f64, nominal: f64, by: f64| (of / nominal).ln().abs() < by;
    near(model.m_per_rad.left, nominal.m_per_rad.left, 2.0 * WHEEL_SD)
        && near(model.m_per_rad.right, nominal.m_per_rad.right, 2.0 * WHEEL_SD)
        && near(model.separation_m, nominal.separation_m, 1.5 * SEPARATION_SD)
        && fit.solution.noise.sigma(NoiseComponent::Wheel) < WHEEL_SIGMA
        && fit.solution.noise.sigma(NoiseComponent::Turn) < TURN_SIGMA
        && fit.solution.converged
}

/// Wheels that are farther from nominal than by this factor are not what they are believed to be.
const ANOTHER_ROBOT: f64 = 1.3;

/// By which factor the wheels of a fit are too large or too small for the robot that its description tells of, if they are.
pub(crate) fn wrong_wheels(fit: &ModelFit<'_>) -> Option<f64> {
    let ratio = fit.solution.model.m_per_rad.zip_with(fit.nominal.m_per_rad, |found, nominal| found / nominal);
    let factor = (ratio.left * ratio.right).sqrt();
    (factor.ln().abs() > ANOTHER_ROBOT.ln()).then_some(factor)
}

/// A form of a fault.
struct Form {
    values: Vec<(&'static str, f64)>,
    sentence: String,
    /// The log of some session shows it by itself.
    visible_in_log: bool,
    /// The records without it.
    records: Vec<Dataset>,
}

/// Factors of sessions that were estimated, each for itself, agree within this.
const SAME_FACTOR: f64 = 0.05;

/// Whether two sessions' rewritings undo the same fault. How often it strikes may differ.
fn is_same(a: &[(&'static str, f64)], b: &[(&'static str, f64)]) -> bool {
    let same = |(a, b): (&(&str, f64), &(&str, f64))| {
        a.0 == b.0 && (a.0 == "probability" || (a.1 - b.1).abs() <= SAME_FACTOR * a.1.abs())
    };
    a.len() == b.len() && a.iter().zip(b).all(same)
}

/// The same rewriting of all sessions; a session in which it is impossible stays as it is.
fn together(datasets: &[Dataset], corrections: fn(&Dataset) -> Vec<RecordCorrection>) -> Vec<Form> {
    let each: Vec<Vec<RecordCorrection>> = datasets.iter().map(corrections).collect();
    let mut forms: Vec<Form> = Vec::new();
    for correction in each.iter().flatten() {
        match forms.iter_mut().find(|form| is_same(&form.values, &correction.values)) {
            Some(form) => {
                form.visible_in_log |= correction.visible_in_log;
                if form.sentence != correction.sentence {
                    form.sentence = format!("{}; {}", form.sentence, correction.sentence);
                }
            }
            None => forms.push(Form {
                values: correction.values.clone(),
                sentence: correction.sentence.clone(),
                visible_in_log: correction.visible_in_log,
                records: Vec::new(),
            }),
        }
    }
    for form in &mut forms {
        form.records = datasets
            .iter()
            .zip(&each)
            .map(|(dataset, own)| {
                let same = own.iter().find(|correction| is_same(&form.values, &correction.values));
                same.map_or_else(|| dataset.clone(), |correction| correction.records.clone())
            })
            .collect();
    }
    forms
}

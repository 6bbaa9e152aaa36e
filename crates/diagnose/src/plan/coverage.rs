//! The next experiment where there is nothing to discriminate: manoeuvres are added as long as they make
//! effects detectable, by their value per minute.
//!
//! An effect is detectable when a plausible size of it is detected with probability 0.9 (√λ = 4.57). Before
//! there are any data the three geometry parameters of the drive count too, by the logarithm of their
//! standard deviations (Wald 1943, D-optimum designs). Adding the best run again and again is Wynn's rule
//! (1970).

use std::collections::BTreeMap;

use effects::{CATALOGUE, Excitation};
use estimation::{Column, Model, ModelFit, Noise, NormalEquations, total};
use scenario::{Instrument, Scenario};
use serde::Serialize;

use super::constraints::{Limits, Setting};
use super::manoeuvres::{Manoeuvre, Part, equations_of, library};
use super::rival_odds::{Frame, with_parts, with_runs};
use super::text;
use super::text::Predictions;
use crate::candidates::candidate::{Candidate, mean_terms, terms};
use crate::document::{Blind, NextExperiment, Smallest};
use crate::fits::augmented_model::AugmentedModel;
use crate::settings::{LEVELS, PLAN};

/// What shows an effect that goes with other conditions than what is driven; `None` where manoeuvres excite
/// it.
fn conditions(id: &str) -> Option<&'static str> {
    match effects::description(id)?.excitation {
        Excitation::Manoeuvres => None,
        Excitation::Conditions(how) => Some(how),
    }
}

fn is_driven(candidate: &Candidate) -> bool {
    conditions(candidate.id()).is_none()
}

/// Effects that stay undetectable, and what would reveal them.
fn not_detectable_among(ids: &[&str]) -> String {
    if ids.is_empty() {
        return String::new();
    }
    let each = ids.iter().map(|id| match conditions(id) {
        Some(how) => format!("{id} ({how})"),
        None => (*id).to_owned(),
    });
    format!(" Still not detectable: {}.", each.collect::<Vec<_>>().join(", "))
}

/// An effect at one of its variants.
struct Target {
    id: &'static str,
    candidate: Candidate,
    columns: Vec<usize>,
}

fn targets(candidates: &[Candidate], first: usize) -> Vec<Target> {
    let mut at = first;
    let target = |candidate: &Candidate| {
        let columns: Vec<usize> = (at..at + candidate.parameters().len()).collect();
        at += columns.len();
        Target { id: candidate.id(), candidate: candidate.clone(), columns }
    };
    candidates.iter().map(target).collect()
}

/// The first, the middle and the last variant of each effect.
fn some_shapes(candidates: &[Candidate]) -> Vec<Candidate> {
    candidates
        .chunk_by(|a, b| a.id() == b.id())
        .flat_map(|variants| {
            let last = variants.len() - 1;
            let mut indices: Vec<usize> =
                (0..PLAN.max_planned_variants).map(|k| k * last / (PLAN.max_planned_variants - 1)).collect();
            indices.dedup();
            indices.into_iter().map(|index| variants[index].clone())
        })
        .collect()
}

/// How well a target's most telling parameter shows at a size that would be large, in standard deviations,
/// and the smallest size that would show.
fn detectability_of(frame: &Frame, equations: &NormalEquations, target: &Target) -> Option<(f64, Smallest)> {
    let information = frame.information(equations, &target.columns, &frame.free)?;
    let parameters = target.candidate.parameters().into_iter().enumerate();
    parameters
        .map(|(k, parameter)| {
            let root = information[(k, k)].max(0.0).sqrt();
            let (name, unit) = (parameter.name.to_owned(), parameter.unit.to_owned());
            (
                parameter.prior_sigma * root,
                Smallest { value: LEVELS.detection_sqrt_lambda / root, unit, parameter: name },
            )
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

/// For each effect its best variant.
fn detectability_of_all(
    frame: &Frame,
    equations: &NormalEquations,
    targets: &[Target],
) -> Vec<(&'static str, f64, Smallest)> {
    targets
        .chunk_by(|a, b| a.id == b.id)
        .filter_map(|variants| {
            let best = variants.iter().filter_map(|target| detectability_of(frame, equations, target));
            let (sigmas, smallest) = best.max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some((variants[0].id, sigmas, smallest))
        })
        .collect()
}

/// How many effects are detectable; one below its limit counts as the fraction that it reaches.
fn detectable_effects(frame: &Frame, equations: &NormalEquations, targets: &[Target]) -> f64 {
    detectability_of_all(frame, equations, targets)
        .iter()
        .map(|(_, sigmas, _)| (sigmas / LEVELS.detection_sqrt_lambda).min(1.0))
        .sum()
}

/// Runs added one pair after the other, by what they bring a minute, as long as there is time.
fn mix(
    options: &[(Manoeuvre, NormalEquations)],
    before: &NormalEquations,
    setting: &Setting,
    worth: impl Fn(&NormalEquations) -> f64,
) -> (Vec<Part>, NormalEquations, f64) {
    let (mut parts, mut equations, mut minutes): (Vec<Part>, _, _) = (Vec::new(), before.clone(), 0.0);
    let mut here = worth(&equations);
    loop {
        let best = options
            .iter()
            .filter_map(|(manoeuvre, of)| {
                let cost = manoeuvre.cost(setting).minutes;
                let known = parts.iter().any(|part| part.manoeuvre == *manoeuvre);
                if minutes + cost > setting.minutes || !(known || parts.len() < PLAN.max_manoeuvres) {
                    return None;
                }
                let after = with_runs(&equations, &[(of, 1.0)]);
                let there = worth(&after);
                let preferred = if known { PLAN.new_manoeuvre_ratio } else { 1.0 };
                (there - here > PLAN.min_coverage_gain).then_some((
                    preferred * (there - here) / cost,
                    manoeuvre,
                    after,
                    there,
                    cost,
                ))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, manoeuvre, after, there, cost)) = best else { break };
        match parts.iter_mut().find(|part| part.manoeuvre == *manoeuvre) {
            Some(part) => part.pairs += 1,
            None => parts.push(Part { manoeuvre: *manoeuvre, pairs: 1 }),
        }
        (equations, here) = (after, there);
        minutes += cost;
    }
    (parts, equations, minutes)
}

/// Takes runs out again, the last kinds first, as long as the same effects stay detectable: what became
/// detectable late makes earlier runs needless, and what never did made some in vain.
fn pruned<'i>(
    parts: &mut Vec<Part>,
    options: &[(Manoeuvre, NormalEquations)],
    before: &NormalEquations,
    after: &NormalEquations,
    detected: impl Fn(&NormalEquations) -> Vec<&'i str>,
) -> NormalEquations {
    let all = detected(after);
    let of = |parts: &[Part]| with_parts(before, parts, options);
    for index in (0..parts.len()).rev() {
        while parts[index].pairs > 0 {
            parts[index].pairs -= 1;
            if detected(&of(parts)) != all {
                parts[index].pairs += 1;
                break;
            }
        }
    }
    parts.retain(|part| part.pairs > 0);
    of(parts)
}

/// What to drive to make detectable what was not detectable in these data; the error says why nothing does.
pub(super) fn show(
    model: &AugmentedModel<'_>,
    catalogue: &[Candidate],
    detectability: &[Blind],
    setting: &Setting,
    manoeuvres: &[Manoeuvre],
) -> Result<NextExperiment, String> {
    let hidden: Vec<Candidate> = catalogue
        .iter()
        .filter(|candidate| {
            is_driven(candidate) && detectability.iter().any(|detectability| detectability.id == candidate.id())
        })
        .cloned()
        .collect();
    let hidden = some_shapes(&hidden);
    let all: Vec<Candidate> = model.candidates.iter().chain(&hidden).cloned().collect();
    let own: usize = model.candidates.iter().map(|candidate| candidate.parameters().len()).sum();
    let targets = targets(&hidden, Column::BASE.len() + own);
    let before = total(&model.fit.scan(&mut terms(&all)).runs).ok_or("no run has measurements")?;
    let frame = Frame::of(&model.fit, &all);
    let options = equations_of(&model.fit, &all, setting, manoeuvres);
    let (mut parts, after, _) =
        mix(&options, &before, setting, |equations| detectable_effects(&frame, equations, &targets));
    let after = pruned(&mut parts, &options, &before, &after, |equations| {
        detected_ids(&detectability_of_all(&frame, equations, &targets))
    });
    let minutes: f64 = parts.iter().map(|part| f64::from(part.pairs) * part.manoeuvre.cost(setting).minutes).sum();
    let was: Vec<&str> = detected_ids(&detectability_of_all(&frame, &before, &targets));
    let now: Vec<_> = detectability_of_all(&frame, &after, &targets)
        .into_iter()
        .filter(|(id, sigmas, _)| *sigmas >= LEVELS.detection_sqrt_lambda && !was.contains(id))
        .collect();
    if parts.is_empty() || now.is_empty() {
        let ids: Vec<&str> = detectability.iter().map(|detectability| &detectability.id[..]).collect();
        return Err(format!(
            "nothing that can be driven {} makes anything else detectable.{}",
            setting.within,
            not_detectable_among(&ids)
        ));
    }
    let predicts: BTreeMap<String, String> =
        now.iter().map(|(id, _, smallest)| ((*id).to_owned(), from_size(smallest))).collect();
    let still: Vec<&str> = detectability
        .iter()
        .map(|detectability| &detectability.id[..])
        .filter(|id| !predicts.contains_key(*id) && !was.contains(id))
        .collect();
    let still = not_detectable_among(&still);
    let ids: Vec<&str> = now.iter().map(|(id, ..)| *id).collect();
    let why = format!(
        "it takes {minutes:.1} min and makes {} detectable, sought {}. Diagnose the new runs together with the old ones.{still}",
        ids.join(", "),
        setting.within
    );
    Ok(text::next_experiment(&parts, setting, minutes, &why, Predictions::Sizes(predicts)))
}

fn from_size(smallest: &Smallest) -> String {
    let unit = if smallest.unit == "1" { String::new() } else { format!(" {}", smallest.unit) };
    format!("shows from {} = {:.2e}{unit} on", smallest.parameter, smallest.value)
}

fn detected_ids<'s>(all: &[(&'s str, f64, Smallest)]) -> Vec<&'s str> {
    all.iter().filter(|(_, sigmas, _)| *sigmas >= LEVELS.detection_sqrt_lambda).map(|(id, ..)| *id).collect()
}

/// What to drive before there is any data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScenarioPlan {
    /// The scenario's name.
    pub scenario: String,
    /// What to drive.
    pub next_experiment: NextExperiment,
    /// Standard deviations that the runs will leave of the geometry parameters that they determine, metres,
    /// by the names of `calibrate`.
    pub sigmas: BTreeMap<String, f64>,
    /// What will show, from which size on.
    pub shows: Vec<Blind>,
    /// What will not, though it were large.
    pub blind_to: Vec<Blind>,
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// Nobody said how much floor there is.
    #[error("{scenario}: it has no [budget]: say what floor there is with --room X,Y")]
    NoRoom {
        /// The scenario's name.
        scenario: String,
    },
    /// The robot's drive is not physical.
    #[error(transparent)]
    Geometry(#[from] kinematics::GeometryError),
    /// No runs fit.
    #[error("no run fits {within}")]
    NothingFits {
        /// Floor and time.
        within: String,
    },
    /// The instruments see no poses.
    #[error("{scenario}: no instrument sees where the robot is; a floor grid or motion capture does")]
    NoPoses {
        /// The scenario's name.
        scenario: String,
    },
}

/// What to drive with a scenario's robot before there is any data, so that its three geometry parameters
/// are determined well and few effects stay undetectable.
///
/// # Errors
/// [`PlanError`] when floor, time or instruments allow nothing.
pub fn plan_scenario(scenario: &Scenario, limits: &Limits) -> Result<ScenarioPlan, PlanError> {
    let name = scenario.name.clone();
    let setting = Setting::of_scenario(scenario, limits).ok_or(PlanError::NoRoom { scenario: name.clone() })?;
    let noise = noise(scenario).ok_or(PlanError::NoPoses { scenario: name.clone() })?;
    let geometry = scenario.nominal_geometry()?;
    let nothing_fits = || PlanError::NothingFits { within: setting.within.clone() };
    if setting.free_m.iter().any(|side_m| *side_m <= 0.0) {
        return Err(nothing_fits());
    }
    let fit: ModelFit<'_> = ModelFit::from_parameters(Model::of(&geometry, 0), noise, &[]);
    let candidates: Vec<Candidate> = some_shapes(&mean_terms(&[])).into_iter().filter(is_driven).collect();
    let targets = targets(&candidates, Column::BASE.len());
    let frame = Frame::of(&fit, &candidates);
    let options = equations_of(&fit, &candidates, &setting, &library(&setting));
    let (_, first) = options.first().ok_or_else(nothing_fits)?;
    let before = with_runs(first, &[(first, -1.0)]);
    let worth = |equations: &NormalEquations| {
        detectable_effects(&frame, equations, &targets) - PLAN.geometry_precision_value * spread(&frame, equations)
    };
    let (parts, after, minutes) = mix(&options, &before, &setting, worth);
    if parts.is_empty() {
        return Err(nothing_fits());
    }
    let (_, covariance) = frame.estimate(&after, &frame.free).ok_or_else(nothing_fits)?;
    let diameter_m = geometry.wheel_diameter_m();
    let geometry_parameters = [
        ("left_wheel_diameter_m", diameter_m.left),
        ("right_wheel_diameter_m", diameter_m.right),
        ("wheel_separation_m", geometry.wheel_separation_m()),
    ];
    let relative: Vec<f64> = (0..geometry_parameters.len()).map(|k| covariance[(k, k)].sqrt()).collect();
    let sigmas: BTreeMap<String, f64> = geometry_parameters
        .iter()
        .zip(&relative)
        .filter(|(_, relative)| **relative < PLAN.undetermined_geometry_sigma)
        .map(|((name, value), relative)| ((*name).to_owned(), value * relative))
        .collect();
    let all = detectability_of_all(&frame, &after, &targets);
    let (shows, detectability): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|(_, sigmas, _)| *sigmas >= LEVELS.detection_sqrt_lambda);
    let entry = |(id, sigmas, smallest): (&str, f64, Smallest)| {
        let why = if sigmas > PLAN.min_planned_sigmas { from_size(&smallest) } else { "no run excites it".to_owned() };
        Blind { id: id.to_owned(), why, smallest_detectable: (sigmas > PLAN.min_planned_sigmas).then_some(smallest) }
    };
    let shows: Vec<Blind> = shows.into_iter().map(entry).collect();
    let mut blind_to: Vec<Blind> = detectability.into_iter().map(entry).collect();
    let not_driven = CATALOGUE.iter().filter_map(|id| Some((*id, conditions(id)?)));
    blind_to.extend(not_driven.map(|(id, how)| Blind {
        id: id.to_owned(),
        why: format!("these motions do not excite it: {how}"),
        smallest_detectable: None,
    }));
    let predicts = shows.iter().map(|detected| (detected.id.clone(), detected.why.clone())).collect();
    let determines = if sigmas.len() == relative.len() {
        format!(
            "determines the wheels' diameters to {:.3} % and {:.3} % and their separation to {:.3} %",
            100.0 * relative[0],
            100.0 * relative[1],
            100.0 * relative[2]
        )
    } else {
        "does not determine the three geometry parameters".to_owned()
    };
    let why = format!(
        "it takes {minutes:.1} min, {determines}, and {} of {} effects of the catalogue would be detected at a large size, sought {}.",
        shows.len(),
        shows.len() + blind_to.len(),
        setting.within
    );
    let next_experiment = text::next_experiment(&parts, &setting, minutes, &why, Predictions::Sizes(predicts));
    Ok(ScenarioPlan { scenario: name, next_experiment, sigmas, shows, blind_to })
}

/// Sum of the logarithms of the geometry parameters' relative standard deviations.
fn spread(frame: &Frame, equations: &NormalEquations) -> f64 {
    frame
        .estimate(equations, &frame.free)
        .map_or(0.0, |(_, covariance)| (0..Column::GEOMETRY.len()).map(|k| 0.5 * covariance[(k, k)].ln()).sum())
}

/// The noise that a scenario states; `None` when nothing sees poses. A micrometre and a microradian are the
/// least that anything errs.
fn noise(scenario: &Scenario) -> Option<Noise> {
    let (xy_m, theta_rad) = scenario.instruments.iter().find_map(|instrument| match *instrument {
        Instrument::MotionCapture { sigma_xy_m, sigma_theta_rad, .. } => Some((sigma_xy_m, sigma_theta_rad)),
        Instrument::Slam(slam) => Some(slam.sigma().into()),
        Instrument::FloorGrid { resolution_m, reading_sigma_m } => {
            let of_mark_m = reading_sigma_m.hypot(resolution_m / 12_f64.sqrt());
            let marks = &scenario.robot.points;
            let n = marks.len() as f64;
            let mean = |of: &dyn Fn(&scenario::Mark) -> f64| marks.iter().map(of).sum::<f64>() / n;
            let (x_m, y_m) = (mean(&|mark| mark.x_m), mean(&|mark| mark.y_m));
            let moment: f64 = marks.iter().map(|mark| (mark.x_m - x_m).powi(2) + (mark.y_m - y_m).powi(2)).sum();
            Some((of_mark_m / n.sqrt(), of_mark_m / moment.sqrt()))
        }
        Instrument::Tachometer { .. }
        | Instrument::Gyro { .. }
        | Instrument::Tape { .. }
        | Instrument::Wall(_)
        | Instrument::Revisit { .. } => None,
    })?;
    let sigmas = [scenario.noise.wheel_sigma_m_per_sqrt_m, PLAN.min_noise_sigma, xy_m, theta_rad];
    Some(Noise { variance: sigmas.map(|sigma| sigma.max(PLAN.min_noise_sigma).powi(2)), timing_s2: 0.0 })
}

#[cfg(test)]
mod tests;

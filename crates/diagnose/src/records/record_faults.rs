//! Record faults: swapped or reversed wheels, factors, wraps, torn reads. Each is a correction of the
//! records, compared by the likelihood of a base fit.
//!
//! A factor on both wheels does not change the likelihood, which fits any geometry; the prior of the
//! geometry decides. A fault that the fit absorbs is worse than none.

use dataset::{Dataset, Session};
use effects::{CATALOGUE, Hypothesis, RecordCorrection, hypothesis};
use estimation::{Column, FitSettings, ModelFit, NoiseComponent};
use rayon::prelude::*;
use rules::Rule;

use crate::candidates::candidate::{Candidate, terms};
use crate::fits::augmented_model::{cost, count};
use crate::fits::model_comparison::log_odds_margin;
use crate::records::same_measurements::{with_same_measurements, with_unknown_motion_of};
use crate::settings::{LEVELS, RECORDS};

/// A fault with the records without it.
pub(crate) struct Fault {
    pub(crate) id: &'static str,
    /// Other faults that these records do not discriminate from it, with their log odds against it.
    pub(crate) rivals: Vec<(&'static str, f64)>,
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

pub(crate) fn sessions(datasets: &[Dataset]) -> Vec<Session<'_>> {
    datasets.iter().map(Dataset::session).collect()
}

/// The fault that the log itself shows, or else that makes the data far likelier, if there is one.
pub(crate) fn fault(datasets: &[Dataset], base: Option<&ModelFit<'_>>, without: &[String]) -> Option<Fault> {
    let sound = base.is_some_and(is_sound);
    // The most specific trace first: jumps that are undone at once are also wraps.
    let sought: Vec<&'static str> = CATALOGUE
        .iter()
        .rev()
        .filter(|id| !without.iter().any(|out| out == *id))
        // What leaves no trace is possible in any records; it is tried where the base fit is implausible.
        .filter(|id| !sound || effects::description(id).is_none_or(|of| of.record_fault.leaves_a_trace))
        .copied()
        .collect();
    let of_effect = |id: &&'static str| match hypothesis(id) {
        Some(Hypothesis::Records(corrections)) => explained_by(id, corrections, datasets, base),
        _ => Vec::new(),
    };
    let explained: Vec<Vec<(bool, Fault)>> = sought.par_iter().map(of_effect).collect();
    let mut best: Option<(bool, Fault)> = None;
    let mut tried: Vec<(&'static str, bool, f64)> = Vec::new();
    for (visible_in_log, fault) in explained.into_iter().flatten() {
        let better = |(known_visible, known): &(bool, Fault)| {
            (visible_in_log, fault.gain) > (*known_visible, known.gain + f64::from(u8::from(*known_visible)))
        };
        tried.push((fault.id, visible_in_log, fault.gain));
        if best.as_ref().is_none_or(better) {
            let gain = fault.gain.max(RECORDS.min_fault_log_likelihood_gain);
            best = Some((visible_in_log, Fault { gain, ..fault }));
        }
    }
    best.map(|(visible, fault)| Fault { rivals: rivals(&tried, visible, &fault), ..fault })
}

/// A second fault in records without the first one, to which `base` is fitted: one may mask the other.
pub(crate) fn second_fault(first: &Fault, base: &ModelFit<'_>, without: &[String]) -> Option<Fault> {
    let without = [without, &[first.id.to_owned()]].concat();
    Rule::SecondRecordFault.finds(fault(&first.records, Some(base), &without))
}

/// The forms of a fault that explain the records, each with whether the log shows it by itself.
fn explained_by(
    id: &'static str,
    corrections: fn(&Dataset) -> Vec<RecordCorrection>,
    datasets: &[Dataset],
    base: Option<&ModelFit<'_>>,
) -> Vec<(bool, Fault)> {
    let uncorrelated = base.is_some_and(|base| !is_correlated(base, &[]));
    let explains = |Form { values, sentence, visible_in_log, mistakes, records }: Form| {
        // By all measurements of the records: those that are not compared later count here.
        let compared = with_unknown_motion_of(datasets, &records);
        let fit = PLAIN.fit_to_compare(&sessions(&compared)).ok()?;
        // Records that no plausible drive follows, rewritten or not, say nothing of the fault, unless they
        // show it by themselves. What was lost is not restored to the last count: measurements may still lie
        // off, but far fewer of them.
        let most_outliers = base.map_or(RECORDS.max_corrected_outlier_fraction, |base| {
            RECORDS.max_corrected_outlier_fraction.max(RECORDS.max_remaining_outlier_ratio * rejected_share(base))
        });
        let is_plausible = (is_drive(&fit) || base.is_some_and(|base| is_far_more_of_a_drive(&fit, base)))
            && is_correlated(&fit, &[])
            && rejected_share(&fit) < most_outliers
            && fit.solution.model.body_from_sensor.theta_rad.abs() <= RECORDS.max_sensor_heading_rad;
        if !is_plausible && !visible_in_log {
            return None;
        }
        let same = base.and_then(|base| with_same_measurements(datasets, base, &compared, &fit));
        let fits = same.as_ref().map(|same| same.each_ref().map(|of| PLAIN.fit_to_compare(&sessions(of)).ok()));
        let gain = match &fits {
            Some([before, after]) => gain(before.as_ref(), after.as_ref()?)?,
            None => gain(base, &fit)?,
        };
        let gain = gain - f64::from(mistakes - 1) * RECORDS.log_odds_of_a_mistake;
        // What the log shows needs no instrument; one must not contradict it, where it has anything to say.
        let min_gain = match visible_in_log {
            true if uncorrelated => f64::NEG_INFINITY,
            true => -RECORDS.min_fault_log_likelihood_gain,
            false => RECORDS.min_fault_log_likelihood_gain,
        };
        drop(fits);
        drop(fit);
        drop(compared);
        (gain > min_gain).then_some((visible_in_log, Fault { id, rivals: Vec::new(), values, sentence, records, gain }))
    };
    batched(datasets, corrections).into_iter().filter_map(explains).collect()
}

/// Log of how much likelier a fit is than the one before it; `None` where it has no likelihood.
fn gain(before: Option<&ModelFit<'_>>, after: &ModelFit<'_>) -> Option<f64> {
    // Measurements that only one fit explains are outliers to the other; one without a cost is no base.
    let measurements = before.map_or(0.0, count).max(count(after));
    let cost_of = |fit: &ModelFit<'_>| Some(cost(fit, measurements) + implausible(fit)).filter(|of| of.is_finite());
    let own = cost_of(after)?;
    Some(before.and_then(cost_of).map_or(f64::MAX, |before| before - own))
}

/// The faults that undo as much as the best one, each with its log odds against that. What the log shows by
/// itself has its own trace, and no rival.
fn rivals(tried: &[(&'static str, bool, f64)], visible: bool, best: &Fault) -> Vec<(&'static str, f64)> {
    let mut rivals: Vec<(&'static str, f64)> = Vec::new();
    for &(id, _, gain) in tried.iter().filter(|(id, own, _)| !visible && !*own && *id != best.id) {
        let odds = gain - best.gain;
        match rivals.iter_mut().find(|(of, _)| *of == id) {
            Some(known) => known.1 = known.1.max(odds),
            None => rivals.push((id, odds)),
        }
    }
    rivals.retain(|(_, odds)| *odds >= -log_odds_margin(best.gain));
    rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
    rivals
}

/// How implausible the geometry parameters of a fit are, as a part of its cost.
fn implausible(fit: &ModelFit<'_>) -> f64 {
    let (model, nominal) = (&fit.solution.model, &fit.nominal);
    let off = |of: f64, nominal: f64, sd: f64| 0.5 * ((of / nominal).abs().ln() / sd).powi(2);
    off(model.m_per_rad.left, nominal.m_per_rad.left, RECORDS.wheel_prior_sigma)
        + off(model.m_per_rad.right, nominal.m_per_rad.right, RECORDS.wheel_prior_sigma)
        + off(model.separation_m, nominal.separation_m, RECORDS.separation_prior_sigma)
        + 0.5 * (model.body_from_sensor.theta_rad / LEVELS.sensor_heading_prior_sigma_rad).powi(2)
}

/// Share of measurements that a fit takes for outliers.
pub(crate) fn rejected_share(fit: &ModelFit<'_>) -> f64 {
    fit.solution.pass.outliers.len() as f64 / fit.records.measurements().max(1) as f64
}

/// Whether a base fit is plausible and rejects few measurements.
fn is_sound(fit: &ModelFit<'_>) -> bool {
    is_drive(fit) && rejected_share(fit) < RECORDS.max_sound_outlier_fraction
}

/// Whether the odometry is correlated with the measurements, for some geometry: its noise is that of a
/// drive and single measurements tell where the robot went, or all of them together tell that its wheels
/// are as large as stated, whatever the noise. `candidates` are the fit's.
pub(crate) fn is_correlated(fit: &ModelFit<'_>, candidates: &[Candidate]) -> bool {
    let sigma = |of| fit.solution.noise.sigma(of);
    // A robot that turns on the spot goes nowhere.
    let extent_m = fit.records.extent_m().max(fit.nominal.separation_m);
    let follows = sigma(NoiseComponent::Wheel)
        < RECORDS.uncorrelated_noise_factor * RECORDS.max_wheel_sigma_m_per_sqrt_m
        && sigma(NoiseComponent::Turn) < RECORDS.uncorrelated_noise_factor * RECORDS.max_turn_sigma_rad_per_sqrt_rad
        && sigma(NoiseComponent::MeasurementPosition) < RECORDS.uncorrelated_measurement_sigma * extent_m
        && sigma(NoiseComponent::MeasurementHeading) < RECORDS.uncorrelated_measurement_sigma;
    follows || determines_wheels(fit, candidates)
}

/// Whether the measurements determine both wheels' sizes, and these are those of the stated robot.
pub(crate) fn determines_wheels(fit: &ModelFit<'_>, candidates: &[Candidate]) -> bool {
    let Some(covariance) = fit.covariance(&mut terms(candidates)) else { return false };
    let relative_sigma = |column: Column| {
        let at = fit.position(column)?;
        // Steps of the wheels' columns are relative.
        Some(covariance[(at, at)].sqrt())
    };
    let wheels = [Column::LeftWheel, Column::RightWheel].map(relative_sigma);
    has_stated_geometry(fit)
        && wheels
            .iter()
            .all(|sigma| sigma.is_some_and(|sigma| sigma > 0.0 && sigma < RECORDS.max_correlated_wheel_sigma))
}

/// Are a fit's geometry and noise those of a drive?
fn is_drive(fit: &ModelFit<'_>) -> bool {
    has_stated_geometry(fit)
        && fit.solution.noise.sigma(NoiseComponent::Wheel) < RECORDS.max_wheel_sigma_m_per_sqrt_m
        && fit.solution.noise.sigma(NoiseComponent::Turn) < RECORDS.max_turn_sigma_rad_per_sqrt_rad
        && fit.solution.converged
}

/// Are the wheels those of the stated robot, and are they not in another fit, or is far less left of the
/// noise that it needs? What was lost beside a fault is noise still.
fn is_far_more_of_a_drive(fit: &ModelFit<'_>, than: &ModelFit<'_>) -> bool {
    let wheel_sigma = |fit: &ModelFit<'_>| fit.solution.noise.sigma(NoiseComponent::Wheel);
    has_stated_geometry(fit)
        && fit.solution.noise.sigma(NoiseComponent::Turn) < RECORDS.max_turn_sigma_rad_per_sqrt_rad
        && (!has_stated_geometry(than) || wheel_sigma(fit) < RECORDS.max_remaining_noise_ratio * wheel_sigma(than))
        && fit.solution.converged
}

/// Is a fit's geometry that of the stated robot, as far as such may differ?
fn has_stated_geometry(fit: &ModelFit<'_>) -> bool {
    let (model, nominal) = (&fit.solution.model, &fit.nominal);
    let is_near = |of: f64, nominal: f64, by: f64| (of / nominal).ln().abs() < by;
    is_near(
        model.m_per_rad.left,
        nominal.m_per_rad.left,
        RECORDS.max_wheel_deviation_sigmas * RECORDS.wheel_prior_sigma,
    ) && is_near(
        model.m_per_rad.right,
        nominal.m_per_rad.right,
        RECORDS.max_wheel_deviation_sigmas * RECORDS.wheel_prior_sigma,
    ) && is_near(
        model.separation_m,
        nominal.separation_m,
        RECORDS.max_separation_deviation_sigmas * RECORDS.separation_prior_sigma,
    )
}

/// By which factor the wheels of a fit are too large or too small for the robot that its description tells
/// of, if they are.
pub(crate) fn wrong_wheels(fit: &ModelFit<'_>) -> Option<f64> {
    let ratio = fit.solution.model.m_per_rad.zip_with(fit.nominal.m_per_rad, |found, nominal| found / nominal);
    let factor = (ratio.left * ratio.right).sqrt();
    (factor.ln().abs() > RECORDS.wrong_wheels_factor.ln()).then_some(factor)
}

/// A form of a fault.
struct Form {
    values: Vec<(&'static str, f64)>,
    sentence: String,
    /// The log of some session shows it by itself.
    visible_in_log: bool,
    /// As in the correction.
    mistakes: u32,
    /// The records without it.
    records: Vec<Dataset>,
}

/// Whether two sessions' rewritings undo the same fault. How often it strikes may differ.
fn is_same(a: &[(&'static str, f64)], b: &[(&'static str, f64)]) -> bool {
    let same = |(a, b): (&(&str, f64), &(&str, f64))| {
        a.0 == b.0 && (a.0 == "probability" || (a.1 - b.1).abs() <= RECORDS.factor_tolerance * a.1.abs())
    };
    a.len() == b.len() && a.iter().zip(b).all(same)
}

/// The same rewriting of all sessions; a session in which it is impossible stays as it is.
fn batched(datasets: &[Dataset], corrections: fn(&Dataset) -> Vec<RecordCorrection>) -> Vec<Form> {
    let each: Vec<Vec<RecordCorrection>> = datasets.par_iter().map(corrections).collect();
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
                mistakes: correction.mistakes,
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

#[cfg(test)]
mod tests {
    use estimation::Noise;

    use super::*;
    use crate::small_robot::{fitted, session};

    #[test]
    fn faults_that_undo_as_much_are_rivals_each_once_and_the_likeliest_first() {
        let best = Fault {
            id: "swapped_wheels",
            rivals: Vec::new(),
            values: Vec::new(),
            sentence: String::new(),
            records: Vec::new(),
            gain: 100.0,
        };
        let tried = [
            ("swapped_wheels", false, 100.0),
            ("reversed_wheel", false, 40.0),
            ("reversed_wheel", false, 98.0),
            ("wrong_counts_per_turn", false, 99.0),
            ("dropped_samples", false, 96.0),
            ("time_unit", true, 99.5),
        ];
        // The margin is 3. Rejects a rival once for each of its forms, and what the log shows by itself.
        assert_eq!(rivals(&tried, false, &best), [("wrong_counts_per_turn", -1.0), ("reversed_wheel", -2.0)]);
        assert_eq!(rivals(&tried, true, &best), []);
    }

    /// A fit without measurements: wheels and separation over nominal, the instrument's heading, and standard
    /// deviations of the noise.
    fn fit<'a>([left, right, separation]: [f64; 3], theta_rad: f64, sigmas: [f64; 4]) -> ModelFit<'a> {
        let of = estimation::Model::of(&crate::small_robot::robot(0.363).geometry().expect("a drive"), 0);
        let noise = Noise { variance: sigmas.map(|sigma| sigma * sigma), timing_s2: 0.0 };
        let mut fit = ModelFit::from_parameters(of, noise, &[]);
        let model = &mut fit.solution.model;
        model.m_per_rad.left *= left;
        model.m_per_rad.right *= right;
        model.separation_m *= separation;
        model.body_from_sensor.theta_rad = theta_rad;
        fit
    }

    const SOUND: [f64; 4] = [1e-3, 1e-3, 1e-3, 1e-3];

    #[test]
    fn geometry_is_the_stated_one_within_two_or_one_and_a_half_prior_deviations() {
        // Wheels to e^±0.1, the separation to e^±0.45, each for itself and either way.
        let is_stated = |ratios| has_stated_geometry(&fit(ratios, 0.0, SOUND));
        assert!(is_stated([1.0; 3]) && is_stated([1.1, 1.1, 1.5]) && is_stated([0.91, 0.91, 0.65]));
        for off in
            [[1.12, 1.0, 1.0], [0.89, 1.0, 1.0], [1.0, 1.12, 1.0], [1.0, 0.89, 1.0], [1.0, 1.0, 1.6], [1.0, 1.0, 0.6]]
        {
            assert!(!is_stated(off), "{off:?}");
        }
    }

    #[test]
    fn a_drive_has_the_noise_of_one_and_its_fit_converged() {
        let is = |sigmas| is_drive(&fit([1.0; 3], 0.0, sigmas));
        assert!(is(SOUND) && is([9.9e-3, 0.049, 1.0, 1.0]));
        assert!(!is([0.011, 1e-3, 1e-3, 1e-3]) && !is([1e-3, 0.051, 1e-3, 1e-3]));
        assert!(!is_drive(&fit([1.2, 1.0, 1.0], 0.0, SOUND)));
        let mut diverged = fit([1.0; 3], 0.0, SOUND);
        diverged.solution.converged = false;
        assert!(!is_drive(&diverged) && !is_sound(&diverged) && is_sound(&fit([1.0; 3], 0.0, SOUND)));
    }

    #[test]
    fn a_fault_makes_a_drive_of_what_was_none_or_takes_most_of_its_noise() {
        let more = |a: &ModelFit<'_>, b: &ModelFit<'_>| is_far_more_of_a_drive(a, b);
        let noisy = |sigma| fit([1.0; 3], 0.0, [sigma, 1e-3, 1e-3, 1e-3]);
        // A quarter of the noise, and not more. Rejects half of it.
        assert!(more(&noisy(0.02), &noisy(0.1)) && !more(&noisy(0.03), &noisy(0.1)));
        // Wheels that were another robot's are those of this one; and not the other way round.
        assert!(more(&noisy(0.1), &fit([2.0, 1.0, 1.0], 0.0, [0.1, 1e-3, 1e-3, 1e-3])));
        assert!(!more(&fit([2.0, 1.0, 1.0], 0.0, [1e-3; 4]), &noisy(0.1)));
    }

    #[test]
    fn implausible_geometry_costs_half_its_square_in_prior_deviations() {
        let e = std::f64::consts::E;
        let cost = |ratios, theta_rad| implausible(&fit(ratios, theta_rad, SOUND));
        assert_eq!(cost([1.0; 3], 0.0), 0.0);
        // ln 1.05 over 0.05, ln of e^0.3 over 0.3, and 0.6 rad over 0.3, each for itself.
        let of_wheel = 0.5 * (1.05_f64.ln() / 0.05).powi(2);
        assert!((cost([1.05, 1.0, 1.0], 0.0) - of_wheel).abs() < 1e-9);
        assert!((cost([1.0, 1.05, 1.0], 0.0) - of_wheel).abs() < 1e-9);
        assert!((cost([1.0, 1.0, e.powf(0.3)], 0.0) - 0.5).abs() < 1e-9);
        assert!((cost([1.0; 3], 0.6) - 2.0).abs() < 1e-9);
        assert!((cost([1.05, 1.05, e.powf(0.3)], -0.6) - 2.0 * of_wheel - 2.5).abs() < 1e-9);
    }

    #[test]
    fn wheels_are_wrong_by_their_geometric_mean() {
        let wrong = |left, right| wrong_wheels(&fit([left, right, 1.0], 0.0, SOUND));
        assert!((wrong(2.0, 2.0).expect("too large") - 2.0).abs() < 1e-12);
        assert!((wrong(0.5, 0.5).expect("too small") - 0.5).abs() < 1e-12);
        // √(2 · 1) = 1.41, √(1.6 · 1) = 1.26, and one that is as much smaller. Rejects a mean of both.
        assert!(wrong(2.0, 1.0).is_some() && wrong(1.6, 1.0).is_none() && wrong(2.0, 0.5).is_none());
    }

    #[test]
    fn odometry_is_correlated_by_its_noise_or_by_the_wheels_that_all_determine() {
        // Without measurements nothing determines wheels; the separation is what a robot extends at the
        // least: 0.3 · 0.363 m.
        let is = |sigmas| is_correlated(&fit([1.0; 3], 0.0, sigmas), &[]);
        assert!(is([0.029, 0.149, 0.108, 0.29]));
        for sigmas in [[0.031, 0.0, 0.0, 0.0], [0.0, 0.151, 0.0, 0.0], [0.0, 0.0, 0.11, 0.0], [0.0, 0.0, 0.0, 0.31]] {
            assert!(!is(sigmas), "{sigmas:?}");
        }
        let datasets = [session(0, 0.0)];
        let mut fit = fitted(&datasets);
        assert!(determines_wheels(&fit, &[]) && rejected_share(&fit) == 0.0);
        // Ten outliers of 8 · 41 poses, of which each run's first is where it starts.
        fit.solution.pass.outliers = (0..10).map(|k| (0, k)).collect();
        assert!((rejected_share(&fit) - 10.0 / fit.records.measurements() as f64).abs() < 1e-12);
        assert!(!is_sound(&fit), "more than one of a hundred");
        fit.solution.model.m_per_rad.left *= 1.2;
        assert!(!determines_wheels(&fit, &[]), "another robot's wheels are determined by accident");
    }

    fn form(values: &[(&'static str, f64)], sentence: &str, visible_in_log: bool, runs: usize) -> RecordCorrection {
        let mut records = session(9, 0.0);
        records.runs.truncate(runs);
        RecordCorrection {
            values: values.to_vec(),
            sentence: sentence.to_owned(),
            visible_in_log,
            mistakes: 2,
            records,
        }
    }

    #[test]
    fn sessions_are_rewritten_alike_where_their_faults_are_the_same() {
        let is = |a: f64, b: f64| is_same(&[("factor", a)], &[("factor", b)]);
        // To 5 % of the first, either way.
        assert!(is(2.0, 2.09) && is(2.0, 1.91) && !is(2.0, 2.11) && !is(2.0, 1.89) && is(-2.0, -2.05));
        assert!(is_same(&[("probability", 0.1)], &[("probability", 0.9)]));
        assert!(!is_same(&[("a", 1.0)], &[("b", 1.0)]) && !is_same(&[("a", 1.0)], &[]));
        // The first session has one form, the second has it too, in other words and visibly, and one more.
        let corrections: fn(&Dataset) -> Vec<RecordCorrection> = |dataset| match dataset.runs.len() {
            8 => vec![form(&[("factor", 2.0)], "twice", false, 1)],
            _ => vec![form(&[("factor", 2.05)], "double", true, 2), form(&[("factor", 4.0)], "four", false, 3)],
        };
        let mut second = session(1, 0.0);
        second.runs.truncate(5);
        let forms = batched(&[session(0, 0.0), second], corrections);
        let [both, one] = &forms[..] else { panic!("two forms, not {}", forms.len()) };
        assert_eq!((both.sentence.as_str(), both.visible_in_log, both.mistakes), ("twice; double", true, 2));
        let runs = |form: &Form| form.records.iter().map(|of| of.runs.len()).collect::<Vec<_>>();
        // The session that cannot have the second form stays as it is.
        assert_eq!((runs(both), runs(one)), (vec![1, 2], vec![8, 3]));
        assert_eq!((one.sentence.as_str(), one.visible_in_log), ("four", false));
    }

    #[test]
    fn a_fault_is_sought_where_the_base_does_not_hold_and_costs_its_mistakes() {
        let mut swapped = [session(0, 0.0)];
        for run in &mut swapped[0].runs {
            let dataset::WheelLog::Angles(kinematics::Wheels { left, right }) = &mut run.odometry.wheels else {
                unreachable!("angles")
            };
            std::mem::swap(left, right);
        }
        let base = fitted(&swapped);
        let found = fault(&swapped, Some(&base), &[]).expect("they are swapped");
        assert_eq!(found.id, "swapped_wheels");
        let fit = fitted(&found.records);
        // The gain is that of the fit to the records without it. It ends where a step gains less than 0.01;
        // further steps would have gained a few times that.
        let most = count(&base).max(count(&fit));
        let gain = cost(&base, most) + implausible(&base) - cost(&fit, most) - implausible(&fit);
        assert!((found.gain - gain).abs() < 0.05, "{} {gain}", found.gain);
        // What leaves no trace is not sought where the fit is sound, nor if it is taken
        // out.
        assert!(fault(&found.records, Some(&fit), &[]).is_none());
        let without = fault(&swapped, Some(&base), &["swapped_wheels".to_owned()]);
        assert!(without.is_none_or(|other| other.id != "swapped_wheels"));
        // Without a base fit any correction that makes a drive is a fault.
        assert_eq!(fault(&swapped, None, &[]).map(|of| of.id), Some("swapped_wheels"));
    }
}

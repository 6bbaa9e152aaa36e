//! The instrument's extrinsics and latency, common to all or for each session or run: they join the model
//! when they predict held-out runs.

use std::collections::BTreeMap;

use kinematics::Pose;
use nalgebra::DVector;
use rules::Rule;

use crate::error::EstimationError;
use crate::model::{Column, GroupExtrinsics, Grouping, Instrument};
use crate::model_fit::{ModelFit, unobservable};
use crate::normal_equations::{NormalEquations, total};
use crate::optimizer::Solution;
use crate::pass_options::OutlierGate;
use crate::settings::NUISANCES;
use crate::thinning::Thinning;

/// A run, or a part of one, with the fold that holds it out.
struct Unit {
    fold: usize,
    equations: NormalEquations,
}

/// Held-out prediction: of units by fits to the other folds.
#[derive(Debug, Clone, PartialEq)]
struct HeldOut {
    /// Each unit's cost.
    costs: Vec<f64>,
    /// Sum of the runs' final errors of dead reckoning, metres.
    end_m: f64,
    /// The same of headings, radians.
    end_rad: f64,
}

impl HeldOut {
    /// Are the ends of dead reckoning farther off than `base` has them? Positions or headings may be by a
    /// little where the others come much nearer.
    fn drifts_beside(&self, base: &Self) -> bool {
        // Without headings their errors are 0 in both.
        let growth = |from: f64, to: f64| if from == to { 0.0 } else { to / from - 1.0 };
        let (position, heading) = (growth(base.end_m, self.end_m), growth(base.end_rad, self.end_rad));
        let grows = |growth: f64, other: f64| growth > 0.0_f64.max(-NUISANCES.max_end_growth_ratio * other);
        grows(position, heading) || grows(heading, position)
    }
}

/// A set of the instrument's columns that predicts held-out units.
struct AcceptedNuisances {
    /// Gain in held-out log-likelihood over none of them.
    gain: f64,
    columns: Vec<Column>,
    own: Option<GroupExtrinsics>,
    held_out: HeldOut,
}

/// Whether nuisances explain autocorrelation or outliers.
pub(crate) enum Explained<T> {
    /// The fit with them.
    Yes(T),
    /// The fit without them, thinned as far as it has to be.
    No { thinned: T },
    /// There was nothing to explain, or no nuisance was accepted.
    NotTried,
}

fn mean_and_error(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len() as f64;
    if n < 2.0 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Some((mean, (variance / n).sqrt()))
}

/// Adds extrinsics and latency, common to all or for each session or run, where they predict held-out units:
/// the measurements by their likelihood, and the ends of the runs by dead reckoning. The second condition
/// keeps out extrinsics that lower the cost and worsen the calibration. A latency by itself need not meet
/// it: the ends of robots that come to rest say nothing of it. What each run has for itself is fitted to
/// some blocks of it and judged on the others.
pub(crate) fn add_nuisances(fit: &mut ModelFit<'_>, gate: OutlierGate) -> Result<(), EstimationError> {
    let sets = nuisance_sets(fit);
    let runs = &fit.solution.pass.runs;
    let mut groupings = vec![None];
    // Autocorrelated errors are common to the blocks of a run, so that blocks are no held-out data for each
    // other.
    if runs.len() > 1 && (gate == OutlierGate::Off || (fit.thinning == Thinning::NONE && fit.is_white())) {
        groupings.extend(Rule::NuisancesOfGroups.finds(Some(Some(Grouping::Run))));
    }
    if runs.iter().any(|run| run.run.0 != runs[0].run.0) {
        groupings.extend(Rule::NuisancesOfGroups.finds(Some(Some(Grouping::Session))));
    }
    let mut best: Option<AcceptedNuisances> = None;
    for grouping in groupings {
        let units = units_of(fit, grouping, gate);
        let Some(base) = held_out(fit, &units, &fit.columns, None) else { continue };
        // A larger set must gain over the smaller one as significantly as that over none.
        let mut of_grouping: Option<AcceptedNuisances> = None;
        for set in &sets {
            let others = || fit.columns.iter().filter(|column| !set.contains(column)).copied();
            let (columns, own): (Vec<Column>, _) = match grouping {
                None => (others().chain(set.iter().copied()).collect(), None),
                Some(grouping) => (others().collect(), Some(GroupExtrinsics::new(grouping, set.clone()))),
            };
            let Some(found) = held_out(fit, &units, &columns, own.as_ref()) else { continue };
            let before = of_grouping.as_ref().map_or(&base, |accepted| &accepted.held_out);
            let gains: Vec<f64> = before.costs.iter().zip(&found.costs).map(|(base, set)| base - set).collect();
            let Some((mean, error)) = mean_and_error(&gains) else { continue };
            let drifts = set != &[Column::Latency] && found.drifts_beside(&base);
            let gains_enough = mean > NUISANCES.min_held_out_gain_sigma * error;
            if gains_enough && !Rule::NuisancesDrift.applies(drifts) {
                let gain = base.costs.iter().zip(&found.costs).map(|(base, set)| base - set).sum();
                of_grouping = Some(AcceptedNuisances { gain, columns, own, held_out: found });
            }
        }
        if let Some(accepted) = of_grouping
            && best.as_ref().is_none_or(|best| accepted.gain > best.gain)
        {
            best = Some(accepted);
        }
    }
    if let Some(AcceptedNuisances { columns, own, .. }) = Rule::Nuisances.finds(best) {
        let before = fit.clone();
        let mut from = fit.current_values();
        // The refit starts at the step that all measurements ask for: from zero, the gate could reject what
        // it explains.
        if gate == OutlierGate::Off {
            from.noise = None;
        }
        let mut all: Vec<NormalEquations> =
            units_of(fit, own.as_ref().map(|own| own.grouping), gate).into_iter().map(|unit| unit.equations).collect();
        let responses = own.as_ref().map_or_else(Vec::new, |own| own.eliminate(&mut all, &from.model));
        from.model.own = own;
        if let Some((step, _)) = total(&all).and_then(|sum| sum.of(&columns).solve()) {
            columns.iter().zip(step.iter()).for_each(|(column, by)| from.model.advance(*column, *by));
            responses
                .iter()
                .for_each(|response| from.model.advance_own(response.group, &response.step(&columns, &step)));
        }
        fit.columns = columns;
        fit.refit(Some(from), &mut [])?;
        // Nuisances that hide the geometry explain it away: a latency that has left the run, at which nothing
        // that was measured meets a motion.
        if Rule::NuisancesHide.applies(hidden_directions(fit) > hidden_directions(&before)) {
            *fit = before;
        }
    }
    Ok(())
}

/// The sets of the instrument's columns that are tried, each larger one after those in it.
fn nuisance_sets(fit: &ModelFit<'_>) -> Vec<Vec<Column>> {
    let extrinsics = fit.records.extrinsics().to_vec();
    let latency = vec![Column::Latency];
    // Without headings a position near the centre is no small step from the centre: a spin's start heading
    // is any there (`sensor_position`).
    if !extrinsics.contains(&Column::SensorTheta) && !fit.has(Column::SensorX) {
        return vec![latency];
    }
    let all = [&extrinsics[..], &latency].concat();
    vec![extrinsics, latency, all]
}

/// How many directions of the geometry the measurements of a fit do not determine.
fn hidden_directions(fit: &ModelFit<'_>) -> usize {
    fit.solution
        .information(&fit.columns)
        .map_or(Column::GEOMETRY.len(), |information| unobservable(&information.matrix).len())
}

/// Autocorrelated innovations and outliers may be due to wrong extrinsics or latency. Fits these without
/// thinning and without the gate. The fit is accepted if the one without nuisances has more than twice as
/// many outliers, each thinned as it needs it, or is thinned ten times as much.
pub(crate) fn explained_by_nuisances<'a>(
    fit: &ModelFit<'a>,
    thin: bool,
) -> Result<Explained<ModelFit<'a>>, EstimationError> {
    if (fit.is_white() || !thin) && fit.solution.pass.outliers.is_empty() {
        return Ok(Explained::NotTried);
    }
    let mut explained = fit.clone();
    add_nuisances(&mut explained, OutlierGate::Off)?;
    if explained.columns == fit.columns && explained.solution.model.own.is_none() {
        return Ok(Explained::NotTried);
    }
    let mut plain = fit.clone();
    if thin {
        plain.thin()?;
    }
    if thin && explained.is_to_be_thinned() {
        explained.thin()?;
    }
    let outliers = |fit: &ModelFit<'_>| fit.solution.pass.outliers.len();
    let has_fewer_outliers = NUISANCES.min_outlier_reduction * outliers(&explained) < outliers(&plain);
    let is_thinned_less = NUISANCES.min_thinning_reduction * explained.thinning.every_s < plain.thinning.every_s;
    Ok(if Rule::NuisancesExplain.applies(has_fewer_outliers || is_thinned_less) {
        Explained::Yes(explained)
    } else {
        Explained::No { thinned: plain }
    })
}

/// Cross-validation of some columns and of the groups' own: for each fold, one step on the other folds,
/// judged on it. `None` when the others of some fold do not determine the columns.
fn held_out(fit: &ModelFit<'_>, units: &[Unit], columns: &[Column], own: Option<&GroupExtrinsics>) -> Option<HeldOut> {
    let mut found = HeldOut { costs: vec![0.0; units.len()], end_m: 0.0, end_rad: 0.0 };
    for fold in 0..NUISANCES.folds.min(units.len()) {
        let mut others: Vec<NormalEquations> =
            units.iter().filter(|unit| unit.fold != fold).map(|unit| unit.equations.clone()).collect();
        let responses = own.map_or_else(Vec::new, |own| own.eliminate(&mut others, &fit.solution.model));
        let (step, _) = total(&others)?.of(columns).solve()?;
        let mut common = fit.solution.model.clone();
        columns.iter().zip(step.iter()).for_each(|(column, by)| common.advance(*column, *by));
        for (k, unit) in units.iter().enumerate().filter(|(_, unit)| unit.fold == fold) {
            let NormalEquations { run, .. } = unit.equations;
            let (mut columns, mut step, mut model) = (columns.to_vec(), step.clone(), common.clone());
            // A group without data in the other folds has the common instrument.
            if let Some(own) = own
                && let Some(response) = responses.iter().find(|response| response.group == own.grouping.group(run))
            {
                let by = response.step(&columns, &step);
                own.columns.iter().zip(by.iter()).for_each(|(column, by)| model.advance(*column, *by));
                columns.extend(&own.columns);
                step = DVector::from_iterator(columns.len(), step.iter().chain(by.iter()).copied());
            }
            found.costs[k] = unit.equations.cost_after(&columns, &step);
            for (end_m, end_rad) in fit.records.end_errors(run, &model) {
                found.end_m += end_m;
                found.end_rad += end_rad;
            }
        }
    }
    Some(found)
}

/// Normal equations of the units that are held out; no group is held out as a whole.
fn units_of(fit: &ModelFit<'_>, grouping: Option<Grouping>, gate: OutlierGate) -> Vec<Unit> {
    let runs = fit.solution.pass.runs.len().max(1);
    let parts = match (grouping, gate) {
        (Some(Grouping::Run), gate) => fit.blocks(&mut [], NUISANCES.blocks_per_run, gate),
        (_, OutlierGate::On) => fit.units(&mut []),
        (_, OutlierGate::Off) => fit.blocks(&mut [], NUISANCES.min_runs_to_hold_out.div_ceil(runs), gate),
    };
    // Blocks come block by block, runs in their order: neighbours, and the parts of a run, are in different
    // folds.
    let mut folds: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    parts
        .into_iter()
        .enumerate()
        .map(|(number, equations)| {
            let next = folds.get(&equations.run).map_or(number % NUISANCES.folds, |fold| fold + 1);
            folds.insert(equations.run, next);
            let fold = next % NUISANCES.folds;
            Unit { fold, equations }
        })
        .collect()
}

impl ModelFit<'_> {
    /// Is a column of the instrument in the model, for all or for groups?
    pub fn has(&self, column: Column) -> bool {
        self.columns.contains(&column)
            || self.solution.model.own.as_ref().is_some_and(|own| own.columns.contains(&column))
    }

    /// The common instrument, or the mean over groups of their own where these are observable.
    pub fn mean_instrument(&self) -> Instrument {
        let common = self.solution.model.common_instrument();
        let Some(own) = &self.solution.model.own else { return common };
        let mean = |column: Column, common: f64, of: fn(&Instrument) -> f64| {
            let shown: Vec<f64> = own
                .of
                .iter()
                .filter(|(group, _)| self.shows(**group, column))
                .map(|(_, instrument)| of(instrument))
                .collect();
            if shown.is_empty() { common } else { shown.iter().sum::<f64>() / shown.len() as f64 }
        };
        let Pose { x_m, y_m, theta_rad } = common.body_from_sensor;
        Instrument {
            body_from_sensor: Pose::new(
                mean(Column::SensorX, x_m, |own| own.body_from_sensor.x_m),
                mean(Column::SensorY, y_m, |own| own.body_from_sensor.y_m),
                mean(Column::SensorTheta, theta_rad, |own| own.body_from_sensor.theta_rad),
            ),
            latency_s: mean(Column::Latency, common.latency_s, |own| own.latency_s),
        }
    }

    /// Standard deviation of a column of a group's own instrument, at the common values; `None` where the
    /// group does not have it for itself or its data do not determine it.
    #[must_use]
    pub fn own_sigma(&self, group: (usize, usize), column: Column) -> Option<f64> {
        let Solution { model, pass, .. } = &self.solution;
        let response = pass.own.iter().find(|response| response.group == group)?;
        let own = model.own.as_ref().filter(|own| own.is_shown(response, column))?;
        own.sigma(response, column)
    }

    /// Is a column of a group's own instrument observable in its data?
    #[must_use]
    pub fn shows(&self, group: (usize, usize), column: Column) -> bool {
        let Solution { model, pass, .. } = &self.solution;
        let response = pass.own.iter().find(|response| response.group == group);
        model.own.as_ref().zip(response).is_some_and(|(own, response)| own.is_shown(response, column))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_stands_hides_its_geometry() {
        let driven = crate::tests::dataset_of(2, true);
        let mut standing = driven.clone();
        for run in &mut standing.runs {
            let rows = run.odometry.t_s.len();
            run.odometry.wheels = dataset::WheelLog::Angles(kinematics::Wheels::both(vec![0.0; rows]));
        }
        let of = |dataset: &dataset::Dataset| {
            let mut fit = ModelFit::from_parameters(crate::tests::MODEL, crate::tests::NOISE, &[dataset.session()]);
            fit.solution.pass = fit.scan(&mut []);
            hidden_directions(&fit)
        };
        assert_eq!((of(&driven), of(&standing)), (0, 3));
    }

    #[test]
    fn ends_may_be_farther_off_where_the_others_come_much_nearer() {
        let of = |end_m, end_rad| HeldOut { costs: Vec::new(), end_m, end_rad };
        let drifts = |found: (f64, f64)| of(found.0, found.1).drifts_beside(&of(2.0, 1.0));
        assert!(!drifts((2.0, 1.0)) && !drifts((1.0, 0.9)));
        assert!(drifts((2.0, 1.001)) && drifts((2.001, 1.0)));
        // Half of the one, and less or more than a twentieth of the other.
        assert!(!drifts((1.0, 1.04)) && drifts((1.0, 1.06)) && !drifts((2.08, 0.5)) && drifts((2.12, 0.5)));
        // Positions alone.
        assert!(of(2.001, 0.0).drifts_beside(&of(2.0, 0.0)) && !of(2.0, 0.0).drifts_beside(&of(2.0, 0.0)));
    }

    #[test]
    fn a_mean_has_its_standard_error_from_two_values_on() {
        // Of 1 to 4: squares of 2.25 + 0.25 + 0.25 + 2.25 over three, and over four values.
        let (mean, error) = mean_and_error(&[1.0, 2.0, 3.0, 4.0]).expect("four");
        assert!((mean - 2.5).abs() < 1e-15 && (error - (5.0_f64 / 12.0).sqrt()).abs() < 1e-15, "{mean} {error}");
        assert_eq!(mean_and_error(&[1.0, 3.0]), Some((2.0, 1.0)));
        assert_eq!((mean_and_error(&[1.0]), mean_and_error(&[])), (None, None));
    }
}

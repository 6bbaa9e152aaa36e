//! The robot as found, as a scenario that the simulator drives: nominal values, calibrated geometry,
//! estimated noise, found effects, and what was driven.

use std::collections::BTreeMap;

use dataset::{Dataset, NominalRobot, Protocol, median};
use effects::{
    Covariate, Effect, PhysicalEffect, Quantization, Sparse, SparseTerm, WheelMismatch, WheelScale, Wheelbase,
    effect_from_estimates,
};
use estimation::NoiseComponent;
use motion_programs::Schedule;
use scenario::{Engine, Estimated, EstimatedTerm, Instrument, Log, Mark, Noise, Placement, Robot, Scenario};

use crate::candidates::candidate::Candidate;
use crate::fits::augmented_model::AugmentedModel;
use crate::records::record_faults::Fault;
use crate::records::stamp_errors::StampError;
use crate::settings::{FINDINGS, PLAN};

/// Motors and controllers of YAIR stand in for those of a robot that a dataset does not describe: what is
/// diagnosed lies behind the encoders.
const STAND_IN: &str = include_str!("default_actuators.toml");
/// The scenario, or why it cannot be written. `nominal` is the robot as it was recorded, `datasets` are
/// without `faults`, and without the errors of their `stamps`.
pub(crate) fn scenario_of(
    datasets: &[Dataset],
    nominal: &NominalRobot,
    faults: &[&Fault],
    stamps: Option<&StampError>,
    model: &AugmentedModel<'_>,
) -> Result<Scenario, String> {
    let first = datasets.first().ok_or("no dataset")?;
    let fit = &model.fit.solution;
    let counts = nominal.ticks_per_rev.unwrap_or(FINDINGS.min_controller_counts);
    let per_tick = (FINDINGS.min_controller_counts / counts).ceil().max(1.0);
    let mut robot: Robot = toml::from_str(STAND_IN).map_err(|error| error.message().to_owned())?;
    robot.left_wheel_diameter_m = nominal.left_wheel_diameter_m;
    robot.right_wheel_diameter_m = nominal.right_wheel_diameter_m;
    robot.wheel_separation_m = nominal.wheel_separation_m;
    robot.encoder.gear_ratio = counts * per_tick / (scenario::QUADRATURE_DECODING * robot.encoder.lines_per_rev);
    let sampling = SamplingStatistics::of(datasets, model);
    robot.cruise_speed_m_s = sampling.speed_m_s;
    let stated =
        first.points.iter().map(|point| Mark { id: point.id.clone(), x_m: point.body.x_m, y_m: point.body.y_m });
    robot.points = stated.collect();
    let sigma_xy_m = fit.noise.sigma(NoiseComponent::MeasurementPosition);
    let sigma_theta_rad = fit.noise.sigma(NoiseComponent::MeasurementHeading);
    let instrument = if sampling.between_measurements_s > FINDINGS.standing_reading_interval_s {
        if robot.points.len() < 2 {
            let half_m = 0.5 * nominal.wheel_separation_m;
            let mark = |id: &str, y_m| Mark { id: id.to_owned(), x_m: 0.0, y_m };
            robot.points = vec![mark("left", half_m), mark("right", -half_m)];
        }
        Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: sigma_xy_m }
    } else {
        let mounted = fit.model.body_from_sensor;
        Instrument::MotionCapture {
            rate_hz: 1.0 / sampling.between_measurements_s,
            sigma_xy_m,
            sigma_theta_rad,
            latency_s: fit.model.latency_s.max(0.0),
            lever_x_m: mounted.x_m,
            lever_y_m: mounted.y_m,
            lever_theta_rad: mounted.theta_rad,
        }
    };
    let mut effects = geometry(model)?.to_vec();
    if per_tick > 1.0 && nominal.ticks_per_rev.is_some() {
        effects.extend(Quantization::from_estimates(&[("counts_per_tick", per_tick)]).map(Effect::Quantization));
    }
    for fault in faults {
        effects.push(simulated(fault.id, &fault.values)?);
    }
    let terms = add_fitted(&mut effects, model, stamps)?;
    effects::sort_by_stage(&mut effects);
    let name = first.provenance.name.as_deref().unwrap_or("dataset");
    let scenario = Scenario {
        name: format!("{name} as diagnosed"),
        seed: 1,
        engine: Engine::Stepping { step_s: 0.001 },
        robot,
        noise: Noise { wheel_sigma_m_per_sqrt_m: fit.noise.sigma(NoiseComponent::Wheel), sensitivity_sigma: 0.0 },
        placement: Placement { half_width_m: 0.05, half_width_rad: 0.02 },
        budget: None,
        log: (sampling.between_rows_s < FINDINGS.standing_reading_interval_s)
            .then_some(Log { interval_s: sampling.between_rows_s }),
        instruments: vec![instrument],
        effects,
        protocols: protocols(datasets),
        estimated: Some(Estimated {
            sensor_x_m: fit.model.body_from_sensor.x_m,
            sensor_y_m: fit.model.body_from_sensor.y_m,
            sensor_theta_rad: fit.model.body_from_sensor.theta_rad,
            latency_s: fit.model.latency_s,
            terms,
        }),
        sweep: None,
    };
    // What is written must be readable.
    let text = scenario.to_toml().map_err(|error| error.to_string())?;
    Scenario::parse(&text, "extended.toml").map_err(|error| error.to_string())
}

/// Adds the effects that were found, those of the model before those of the stamps. Gives their mean terms as
/// they were fitted.
fn add_fitted(
    effects: &mut Vec<Effect>,
    model: &AugmentedModel<'_>,
    stamps: Option<&StampError>,
) -> Result<Vec<EstimatedTerm>, String> {
    let mut at = 0;
    let mut terms = Vec::new();
    let in_model = model.candidates.iter().map(|candidate| {
        let range = at..at + candidate.parameters().len();
        at = range.end;
        (candidate, model.fit.solution.model.term_values[range].to_vec())
    });
    let in_stamps = stamps
        .map(|error| (&error.candidate, error.test.estimates.iter().map(|(value, _)| *value).collect::<Vec<f64>>()));
    for (candidate, fitted) in in_model.chain(in_stamps) {
        let parameters = candidate.parameters();
        let effect = match candidate {
            Candidate::Effect { id, .. } => {
                let named = parameters.iter().zip(&fitted).map(|(parameter, size)| (parameter.name, *size));
                let estimates: Vec<(&str, f64)> = named.chain(candidate.fixed()).collect();
                let values = estimates.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
                terms.push(EstimatedTerm { kind: (*id).to_owned(), values });
                simulated(id, &estimates)?
            }
            Candidate::Deviation { .. } => return Err("a deviation from a form has no simulation model".to_owned()),
            Candidate::Sparse(sparse) => {
                Effect::Term(SparseTerm::new(sparse, fitted.iter().sum(), values_of_runs(sparse, model)))
            }
        };
        effect.physical().check().map_err(|error| error.to_string())?;
        effects.push(effect);
    }
    Ok(terms)
}

fn simulated(id: &str, estimates: &[(&str, f64)]) -> Result<Effect, String> {
    let none = || format!("{id}: the estimated parameters do not make an effect that can be simulated");
    effect_from_estimates(id, estimates).ok_or_else(none)
}

/// What the runs had of the covariates of a product that are their own.
fn values_of_runs(sparse: &Sparse, model: &AugmentedModel<'_>) -> BTreeMap<String, Vec<f64>> {
    let own = sparse.covariates.iter().filter_map(|covariate| match covariate {
        Covariate::OfRun { key, .. } => Some(key),
        _ => None,
    });
    own.map(|key| (key.clone(), crate::candidates::covariates::values_of_runs(&model.fit, key))).collect()
}

/// The calibrated geometry as effects on the nominal ones.
fn geometry(model: &AugmentedModel<'_>) -> Result<[Effect; 3], String> {
    let (found, nominal) = (&model.fit.solution.model, &model.fit.nominal);
    let mean = |wheels: kinematics::Wheels<f64>| 0.5 * (wheels.left + wheels.right);
    let ratio = |wheels: kinematics::Wheels<f64>| wheels.right / wheels.left;
    let right_over_left = ratio(found.m_per_rad) / ratio(nominal.m_per_rad);
    let effects = [
        Effect::WheelScale(WheelScale { scale: mean(found.m_per_rad) / mean(nominal.m_per_rad) }),
        Effect::WheelMismatch(WheelMismatch { right_over_left }),
        Effect::Wheelbase(Wheelbase { ratio: found.separation_m / nominal.separation_m }),
    ];
    effects.iter().try_for_each(|effect| effect.physical().check()).map_err(|error| error.to_string())?;
    Ok(effects)
}

/// How fast and how often.
pub(crate) struct SamplingStatistics {
    pub(crate) speed_m_s: f64,
    /// `None` where the log has no start from rest.
    pub(crate) acceleration_m_s2: Option<f64>,
    pub(crate) between_rows_s: f64,
    pub(crate) between_measurements_s: f64,
}

impl SamplingStatistics {
    pub(crate) fn of(datasets: &[Dataset], model: &AugmentedModel<'_>) -> Self {
        let runs = datasets.iter().flat_map(|dataset| &dataset.runs);
        let rows = runs.flat_map(|run| run.odometry.t_s.windows(2).map(|pair| pair[1] - pair[0]));
        let driven = model.fit.records.drive_statistics(&model.fit.solution.model);
        Self {
            speed_m_s: driven.map_or(PLAN.default_speed_m_s, |driven| driven.cruise_speed_m_s).clamp(0.01, 5.0),
            acceleration_m_s2: driven.and_then(|driven| driven.acceleration_m_s2),
            between_rows_s: median(rows).unwrap_or(10.0).clamp(1e-3, 1e3),
            between_measurements_s: median(model.fit.records.times_between()).unwrap_or(10.0).clamp(1e-2, 1e3),
        }
    }
}

/// What was driven, as far as schedules have words for it; squares where they have none.
fn protocols(datasets: &[Dataset]) -> Vec<Schedule> {
    let mut kinds: Vec<(Schedule, u32)> = Vec::new();
    for info in datasets.iter().flat_map(|dataset| &dataset.runs).map(|run| &run.info) {
        let settings = &info.settings;
        let one = match info.protocol {
            Some(Protocol::Straight) => {
                settings.length_m.map(|length_m| Schedule::Straights { length_m: length_m.abs(), runs: 1 })
            }
            Some(Protocol::Spin) => {
                settings.turn_rad.map(|turn_rad| Schedule::Spins { turn_rad: turn_rad.abs(), runs: 1 })
            }
            Some(Protocol::SquareCw | Protocol::SquareCcw) => {
                settings.side_m.map(|side_m| Schedule::Squares { side_m, runs_each_way: 1 })
            }
            Some(Protocol::CircleCw | Protocol::CircleCcw) => {
                settings.radius_m.map(|radius_m| Schedule::Circles { radius_m, turns: None, runs_each_way: 1 })
            }
            Some(Protocol::Path | Protocol::Free) | None => None,
        };
        let Some(one) = one else { continue };
        match kinds.iter_mut().find(|(kind, _)| *kind == one) {
            Some((_, runs)) => *runs += 1,
            None => kinds.push((one, 1)),
        }
    }
    if kinds.is_empty() {
        return vec![
            Schedule::Straights { length_m: 1.5, runs: 6 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 6 },
            Schedule::Squares { side_m: 1.0, runs_each_way: 3 },
        ];
    }
    kinds
        .into_iter()
        .map(|(kind, count)| match kind {
            Schedule::Straights { length_m, .. } => Schedule::Straights { length_m, runs: count },
            Schedule::Spins { turn_rad, .. } => Schedule::Spins { turn_rad, runs: count },
            other => other.with_pairs(count.div_ceil(2)),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(protocol: Option<Protocol>, size: f64) -> dataset::Run {
        let settings = dataset::ProtocolSettings {
            side_m: Some(size),
            radius_m: Some(size),
            length_m: Some(size),
            turn_rad: Some(size),
        };
        let info = dataset::RunInfo { protocol, settings, ..dataset::RunInfo::default() };
        dataset::Run { info, ..dataset::Run::default() }
    }

    #[test]
    fn what_was_driven_is_driven_again_as_often() {
        let of = |runs: &[(Option<Protocol>, f64)]| {
            let mut dataset = crate::small_robot::session(0, 0.0);
            dataset.runs = runs.iter().map(|(protocol, size)| info(*protocol, *size)).collect();
            protocols(&[dataset])
        };
        // Forward and backward are one kind, and so are both ways of a square; three of them are two pairs.
        let (straight, spin) = (Some(Protocol::Straight), Some(Protocol::Spin));
        let (cw, ccw) = (Some(Protocol::SquareCw), Some(Protocol::SquareCcw));
        let driven = of(&[
            (straight, 1.0),
            (straight, -1.0),
            (straight, 2.0),
            (spin, -3.0),
            (cw, 1.0),
            (ccw, 1.0),
            (cw, 1.0),
            (Some(Protocol::CircleCcw), 0.5),
            (Some(Protocol::Path), 9.0),
        ]);
        let expected = [
            Schedule::Straights { length_m: 1.0, runs: 2 },
            Schedule::Straights { length_m: 2.0, runs: 1 },
            Schedule::Spins { turn_rad: 3.0, runs: 1 },
            Schedule::Squares { side_m: 1.0, runs_each_way: 2 },
            Schedule::Circles { radius_m: 0.5, turns: None, runs_each_way: 1 },
        ];
        assert_eq!(driven, expected);
        // What has no words is driven as straights, spins and squares.
        assert_eq!(of(&[(None, 1.0)]).len(), 3);
    }

    #[test]
    fn the_robot_as_found_has_the_calibrated_ratios() {
        use crate::small_robot::{fitted, session};
        let datasets = [session(0, 0.0)];
        let mut model = AugmentedModel::base(&fitted(&datasets));
        model.fit.solution.model.m_per_rad = kinematics::Wheels { left: 0.09, right: 0.081 };
        model.fit.solution.model.separation_m = 0.363 * 1.1;
        let effects = geometry(&model).expect("a drive");
        let [Effect::WheelScale(scale), Effect::WheelMismatch(mismatch), Effect::Wheelbase(base)] = &effects else {
            panic!("three ratios")
        };
        // (0.09 + 0.081)/0.16, 0.081/0.09 and 1.1.
        assert!((scale.scale - 1.068_75).abs() < 1e-12 && (mismatch.right_over_left - 0.9).abs() < 1e-12);
        assert!((base.ratio - 1.1).abs() < 1e-12);
    }
}

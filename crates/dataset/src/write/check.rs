//! Whether a dataset in memory is one that could be read back: the reader's rules, applied to columns.

use std::collections::BTreeSet;
use std::mem::{Discriminant, discriminant};

use crate::counter;
use crate::error::{DatasetError, shown};
use crate::identity::parse_robot_id;
use crate::pose_covariance::PoseCovariance;
use crate::read::{has_truth, is_run_key, meant_quantity, why_no_id};
use crate::record::{Dataset, Odometry, Run, RunInfo, WheelLog};
use crate::settings::MAX_COUNT;

type Check = Result<(), String>;

pub(super) fn check(dataset: &Dataset) -> Result<(), DatasetError> {
    check_header(dataset)?;
    let Some(first) = dataset.runs.first().map(|run| discriminant(&run.odometry.wheels)) else {
        return Err(without_runs());
    };
    let mut ids = BTreeSet::new();
    dataset.runs.iter().try_for_each(|run| check_next(dataset, first, run, &mut ids))
}

pub(super) fn without_runs() -> DatasetError {
    DatasetError::NotWritable { what: "a dataset without runs".to_owned() }
}

/// All but the runs.
pub(super) fn check_header(dataset: &Dataset) -> Result<(), DatasetError> {
    check_robot(dataset).map_err(|what| DatasetError::NotWritable { what })
}

/// A run of a dataset; `first` is the first of its runs, `ids` are those of the runs before.
pub(super) fn check_next(
    dataset: &Dataset,
    first: Discriminant<WheelLog>,
    run: &Run,
    ids: &mut BTreeSet<String>,
) -> Result<(), DatasetError> {
    let checked = check_run(dataset, first, run).and_then(|()| {
        if ids.insert(run.info.id.clone()) { Ok(()) } else { Err("a second run with this id".to_owned()) }
    });
    checked.map_err(|what| DatasetError::RunNotWritable { run: shown(run.info.id.as_bytes()), what })
}

fn ensure(holds: bool, what: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(what()) }
}

fn positive(name: &str, value: f64) -> Check {
    ensure(value.is_finite() && value > 0.0, || format!("{name} = {value}; expected a positive finite number"))
}

fn finite(name: &str, value: f64) -> Check {
    ensure(value.is_finite(), || format!("{name} = {value}; expected a finite number"))
}

fn all_finite(name: &str, values: impl IntoIterator<Item = f64>) -> Check {
    values.into_iter().try_for_each(|value| finite(name, value))
}

/// A standard deviation is positive; 0 is how files say unknown.
fn sigma(name: &str, value: Option<f64>) -> Check {
    match value {
        Some(value) if value != 0.0 => positive(name, value),
        _ => Ok(()),
    }
}

fn id(kind: &str, id: &str) -> Check {
    why_no_id(id).map_or(Ok(()), |expected| Err(format!("{kind} id \"{}\": {expected}", shown(id.as_bytes()))))
}

fn check_robot(dataset: &Dataset) -> Check {
    let robot = &dataset.robot;
    positive("left_wheel_diameter_m", robot.left_wheel_diameter_m)?;
    positive("right_wheel_diameter_m", robot.right_wheel_diameter_m)?;
    positive("wheel_separation_m", robot.wheel_separation_m)?;
    robot.ticks_per_rev.map_or(Ok(()), |ticks| positive("ticks_per_rev", ticks))?;
    if let Some(bits) = robot.counter_bits {
        let accepted = counter::ACCEPTED_BITS.contains(&bits);
        ensure(accepted, || format!("counter_bits = {bits}; expected a width from 2 to 63 bits"))?;
    }
    sigma("sigma_xy_m", dataset.truth_noise.sigma_xy_m)?;
    sigma("sigma_theta_rad", dataset.truth_noise.sigma_theta_rad)?;
    if let Some(map) = dataset.truth_noise.map {
        sigma("map_sigma_xy_m", Some(map.sigma_xy_m))?;
        sigma("map_sigma_theta_rad", Some(map.sigma_theta_rad))?;
        positive("map_length_m", map.length_m)?;
    }
    let gyro = dataset.truth_noise.gyro;
    sigma("scale_sigma", gyro.scale_sigma)?;
    sigma("noise_rad_per_sqrt_s", gyro.noise_rad_per_sqrt_s)?;
    sigma("bias_walk_radps_per_sqrt_s", gyro.bias_walk_radps_per_sqrt_s)?;
    dataset.truth_noise.lidar.and_then(|lidar| lidar.yaw_rad).map_or(Ok(()), |yaw_rad| finite("yaw_rad", yaw_rad))?;
    dataset.provenance.robot_id.as_deref().map_or(Ok(()), |id| parse_robot_id(id).map(|_| ()))?;
    let mut ids = BTreeSet::new();
    for point in &dataset.points {
        id("point", &point.id)?;
        all_finite("point", [point.body.x_m, point.body.y_m])?;
        ensure(ids.insert(&point.id), || format!("a second point with id \"{}\"", shown(point.id.as_bytes())))?;
    }
    Ok(())
}

fn check_run(dataset: &Dataset, first: Discriminant<WheelLog>, run: &Run) -> Check {
    check_info(&run.info)?;
    check_odometry(dataset, first, &run.odometry)?;
    ensure(has_truth(run), || "odometry but no truth of any kind".to_owned())?;

    increasing("truth", run.truth.iter().map(|sample| sample.t_s))?;
    all_finite("truth", run.truth.iter().flat_map(|sample| [sample.x_m, sample.y_m]))?;
    all_finite("truth", run.truth.iter().filter_map(crate::TruthSample::theta_rad))?;
    if let Some(sigmas) = &run.truth_sigma {
        ensure(sigmas.len() == run.truth.len(), || "truth_sigma is not as long as truth".to_owned())?;
        for one in sigmas {
            sigma("sigma_xy_m", one.sigma_xy_m)?;
            sigma("sigma_theta_rad", one.sigma_theta_rad)?;
            if let Some(covariance) = one.covariance {
                PoseCovariance::stated(covariance.elements())
                    .map_err(|why| format!("an invalid covariance of truth: {why}"))?;
            }
        }
    }
    increasing("displacements", run.displacements.iter().map(|step| step.t0_s))?;
    for step in &run.displacements {
        all_finite("displacement", [step.t1_s, step.dx_m, step.dy_m, step.dtheta_rad])?;
        ensure(step.t0_s < step.t1_s, || format!("a displacement from {} s to {} s", step.t0_s, step.t1_s))?;
    }
    check_partial(run)?;
    increasing("gyro", run.gyro.iter().map(|sample| sample.t_s))?;
    all_finite("gyro", run.gyro.iter().map(|sample| sample.omega_radps))?;
    increasing("headings", run.headings.iter().map(|heading| heading.t_s))?;
    for heading in &run.headings {
        finite("heading", heading.theta_rad)?;
        positive("a heading's standard deviation", heading.sigma_rad)?;
        let is_unpaired = run.truth.binary_search_by(|sample| sample.t_s.total_cmp(&heading.t_s)).is_err();
        ensure(is_unpaired, || format!("a heading and a pose at {} s", heading.t_s))?;
    }
    increasing("wheel_reference", run.wheel_reference.iter().map(|speed| speed.t_s))?;
    let speeds = run.wheel_reference.iter().flat_map(|speed| [speed.speed_m_s.left, speed.speed_m_s.right]);
    all_finite("wheel_reference", speeds)?;
    for instant in run.point_readings.chunk_by(|a, b| a.t_s == b.t_s) {
        let points: BTreeSet<_> = instant.iter().map(|reading| reading.point).collect();
        ensure(points.len() == instant.len(), || format!("a point read twice at {} s", instant[0].t_s))?;
        let known = points.iter().all(|point| *point < dataset.points.len());
        ensure(known, || "a reading of a point that the dataset does not have".to_owned())?;
        all_finite("points", instant.iter().flat_map(|reading| [reading.room.x_m, reading.room.y_m]))?;
    }
    let instants = run.point_readings.chunk_by(|a, b| a.t_s == b.t_s).map(|instant| instant[0].t_s);
    increasing("points", instants)
}

/// Partial measurements, each with its standard deviation.
fn check_partial(run: &Run) -> Check {
    let between = |what: &str, t0_s: f64, t1_s: f64| {
        all_finite(what, [t0_s, t1_s])?;
        ensure(t0_s < t1_s, || format!("a {what} from {t0_s} s to {t1_s} s"))
    };
    let measured = |what: &str, value: Option<f64>, sigma: Option<f64>| match (value, sigma) {
        (None, _) => Ok(false),
        (Some(value), Some(sigma)) => finite(what, value).and_then(|()| positive(what, sigma)).map(|()| true),
        (Some(value), None) => Err(format!("{what} = {value} without a standard deviation")),
    };
    for of in &run.revisits {
        between("revisit", of.t0_s, of.t1_s)?;
        let any = measured("dx_m", of.dx_m, of.sigma_xy_m)?
            | measured("dy_m", of.dy_m, of.sigma_xy_m)?
            | measured("dtheta_rad", of.dtheta_rad, of.sigma_theta_rad)?;
        ensure(any, || format!("a revisit at {} s that measures nothing", of.t1_s))?;
    }
    for of in &run.distances {
        between("distance", of.t0_s, of.t1_s)?;
        positive("distance_m", of.distance_m)?;
        positive("sigma_m", of.sigma_m)?;
    }
    for of in &run.walls {
        id("wall", &of.wall)?;
        finite("t_s", of.t_s)?;
        let any =
            measured("distance_m", of.distance_m, of.sigma_m)? | measured("heading_rad", of.heading_rad, of.sigma_rad)?;
        ensure(any, || format!("a wall reading at {} s that measures nothing", of.t_s))?;
    }
    let in_order = |times_s: &[f64]| times_s.is_sorted();
    let times: [(&str, Vec<f64>); 3] = [
        ("revisits", run.revisits.iter().map(|of| of.t0_s).collect()),
        ("distances", run.distances.iter().map(|of| of.t0_s).collect()),
        ("walls", run.walls.iter().map(|of| of.t_s).collect()),
    ];
    times.iter().try_for_each(|(what, times_s)| ensure(in_order(times_s), || format!("{what} out of time order")))
}

fn check_info(info: &RunInfo) -> Check {
    id("run", &info.id)?;
    info.settings.side_m.map_or(Ok(()), |side_m| positive("side_m", side_m))?;
    info.settings.radius_m.map_or(Ok(()), |radius_m| positive("radius_m", radius_m))?;
    all_finite(
        "length_m, turn_rad or start_s",
        [info.settings.length_m, info.settings.turn_rad, info.start_s].into_iter().flatten(),
    )?;
    for (key, &value) in &info.covariates {
        let free = !is_run_key(key) && meant_quantity(key).is_none();
        ensure(free, || format!("a covariate called {}, which is a key of the format", shown(key.as_bytes())))?;
        finite(&shown(key.as_bytes()), value)?;
    }
    Ok(())
}

fn check_odometry(dataset: &Dataset, first: Discriminant<WheelLog>, odometry: &Odometry) -> Check {
    let rows = odometry.t_s.len();
    let as_long = |lengths: &[usize]| {
        ensure(lengths.iter().all(|length| *length == rows), || "odometry columns of unequal length".to_owned())
    };
    ensure(rows > 0, || "no odometry".to_owned())?;
    increasing("odometry", odometry.t_s.iter().copied())?;
    let one_form = discriminant(&odometry.wheels) == first;
    ensure(one_form, || "wheels in another form than in the first run; a dataset has one".to_owned())?;
    match &odometry.wheels {
        WheelLog::Ticks(ticks) => {
            as_long(&[ticks.left.len(), ticks.right.len()])?;
            let is_count = |count: &i64| count.unsigned_abs() <= MAX_COUNT;
            let are_counts = ticks.left.iter().chain(&ticks.right).all(is_count);
            ensure(are_counts, || format!("a count beyond {MAX_COUNT}; no counter gets so far"))?;
            ensure(dataset.robot.ticks_per_rev.is_some(), || "ticks, but the robot has no ticks_per_rev".to_owned())?;
        }
        WheelLog::Angles(angles) => {
            as_long(&[angles.left.len(), angles.right.len()])?;
            all_finite("wheel angle", angles.left.iter().chain(&angles.right).copied())?;
        }
        WheelLog::Speeds(speeds) => {
            as_long(&[speeds.left.len(), speeds.right.len()])?;
            all_finite("wheel speed", speeds.left.iter().chain(&speeds.right).copied())?;
        }
        WheelLog::Twist { v_mps, omega_radps } => {
            as_long(&[v_mps.len(), omega_radps.len()])?;
            all_finite("twist", v_mps.iter().chain(omega_radps).copied())?;
        }
    }
    for (channel, values) in &odometry.extra {
        as_long(&[values.len()])?;
        let is_gap = |value: &f64| channel.may_have_gaps() && value.is_nan();
        all_finite(channel.column(), values.iter().copied().filter(|value| !is_gap(value)))?;
    }
    Ok(())
}

fn increasing(what: &str, times_s: impl Iterator<Item = f64>) -> Check {
    let mut previous_s = f64::NEG_INFINITY;
    for t_s in times_s {
        finite(what, t_s)?;
        ensure(previous_s < t_s, || format!("{what} at {t_s} s after {previous_s} s; expected increasing time"))?;
        previous_s = t_s;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{MarkedPoint, PointReading, Provenance, TruthNoise, TruthSample, TruthSigma};
    use kinematics::{Point, Wheels};

    fn good() -> Dataset {
        let run = |id: &str| Run {
            info: RunInfo { id: id.into(), ..RunInfo::default() },
            odometry: Odometry {
                t_s: vec![0.0, 0.1].into(),
                wheels: WheelLog::Ticks(Wheels { left: vec![0, 5], right: vec![0, 7] }),
                ..Odometry::default()
            },
            truth: vec![TruthSample::new(0.0, 0.0, 0.0, None), TruthSample::new(1.0, 0.0, 0.0, Some(0.1))],
            point_readings: vec![PointReading { t_s: 0.0, point: 0, room: Point::default() }],
            ..Run::default()
        };
        Dataset {
            provenance: Provenance::default(),
            robot: crate::NominalRobot {
                left_wheel_diameter_m: 0.1,
                right_wheel_diameter_m: 0.1,
                wheel_separation_m: 0.3,
                ticks_per_rev: Some(1000.0),
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: vec![MarkedPoint { id: "left".into(), body: Point::default() }],
            runs: vec![run("a"), run("b")],
        }
    }

    /// What a fault is called that `spoil` plants.
    #[track_caller]
    fn fault(expected: &str, spoil: impl FnOnce(&mut Dataset)) {
        let mut dataset = good();
        spoil(&mut dataset);
        let message = check(&dataset).expect_err(expected).to_string();
        assert!(message.contains(expected) && message.lines().count() == 1, "{message}");
    }

    #[test]
    fn every_fault_that_a_reader_would_find_is_found_before_writing() {
        check(&good()).expect("no fault");
        fault("wheel_separation_m = 0; expected", |set| set.robot.wheel_separation_m = 0.0);
        fault("ticks_per_rev = NaN", |set| set.robot.ticks_per_rev = Some(f64::NAN));
        fault("the robot has no ticks_per_rev", |set| set.robot.ticks_per_rev = None);
        fault("\"\" is no id", |set| set.provenance.robot_id = Some(String::new()));
        fault("counter_bits = 64", |set| set.robot.counter_bits = Some(64));
        fault("sigma_xy_m = -1", |set| set.truth_noise.sigma_xy_m = Some(-1.0));
        fault("without runs", |set| set.runs.clear());
        fault("a second point", |set| set.points.push(set.points[0].clone()));
        fault("run \"b\": a second run with this id", |set| set.runs.push(set.runs[1].clone()));
        fault("run \"x\\ny\": run id", |set| set.runs[0].info.id = "x\ny".into());
        fault("no odometry", |set| set.runs[0].odometry = Odometry::default());
        fault("unequal length", |set| set.runs[1].odometry.t_s.push(0.2));
        fault("no truth of any kind", |set| {
            set.runs[0].truth.clear();
            set.runs[0].point_readings.clear();
        });
        fault("another form", |set| {
            set.runs[1].odometry.wheels = WheelLog::Angles(Wheels::both(vec![0.0, 0.1]));
        });
        fault("odometry at 0 s after 0 s", |set| set.runs[1].odometry.t_s[1] = 0.0);
        fault("truth = inf", |set| set.runs[1].truth[0].x_m = f64::INFINITY);
        fault("truth at -1 s after 0 s", |set| set.runs[1].truth[1].t_s = -1.0);
        fault("not as long as truth", |set| {
            set.runs[1].truth_sigma = Some(vec![TruthSigma::UNKNOWN]);
        });
        fault("does not have", |set| set.runs[1].point_readings[0].point = 1);
        fault("read twice", |set| {
            let reading = set.runs[1].point_readings[0];
            set.runs[1].point_readings.push(reading);
        });
        for key in ["side_m", "side_mm", "id", "continuous"] {
            fault(key, |set| {
                set.runs[0].info.covariates.insert(key.into(), 1.0);
            });
        }
        fault("payload_kg = NaN", |set| {
            set.runs[0].info.covariates.insert("payload_kg".into(), f64::NAN);
        });
    }
}

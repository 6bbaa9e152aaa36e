//! `joint`, the default: maximum likelihood of whole runs in state space, from whatever the instrument
//! measured.
//!
//! Model: [`estimation`]: counts predict, measurements correct; geometry, the noise of wheels and instrument
//! and every start pose are estimated.
//! Assumptions: the instrument's errors are independent. That is tested: while innovations are
//! autocorrelated, measurements are taken farther apart. Extrinsics and latency of the instrument join when
//! they predict runs that they were not fitted to.
//! Observability: any path; what the measurements do not determine is named and kept at its nominal value.
//! Ends of closed paths hide the common scale, paths without turns the wheel separation.
//! Reference: Schweppe 1965; Ljung & Box 1978 (whiteness); Liang & Zeger 1986 (sandwich over runs); Varin,
//! Reid & Firth 2011 (composite likelihood).

use std::collections::BTreeSet;

use dataset::{Blocks, DatasetError, Session, Warning};
use estimation::{
    Column, FitSettings, Grouping, LargeFit, Model, ModelFit, NoiseComponent, OneStepError, PartialOutliers, Records,
    fit_large,
};
use kinematics::Pose;
use motion_programs::Schedule;
use nalgebra::{Matrix3, Vector3};
use preflight::{ClockOffset, Driven, SessionClock};

use crate::dead_reckoning_jacobian::{HARDLY_TURN, ON_THE_SPOT, WHEEL_HARDLY_TURNS, unobservable};
use crate::estimate::{
    CalibError, Calibration, Covariance, Extrinsics, GroupInstrument, Method, NotObservable, OdometryNoise, Parameter,
    Rejected, drive, geometry_covariance, nominal,
};
use crate::settings::{
    MAX_OTHER_WAY, MAX_UNREMARKED_RATIO, MIN_COMMON_SCALE_COMPONENT, MIN_DISTANCE_M, MIN_MOVED_SIGMAS,
    MIN_NAMED_COMPONENT, MIN_TURNING_RAD, STATED_LENGTH_SIGMA,
};
use crate::turn_loss;

/// The method with the settings of its fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// What is estimated beside the geometry.
    pub settings: FitSettings,
}

impl Joint {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self { settings: FitSettings::CALIBRATION };

    const NAME: &'static str = "joint";

    /// Calibrates from datasets of any size, in the memory of a part of them; `notice` gets each dataset's
    /// number and what was noticed of it. Where [`estimation::is_large`] says no, [`Method::calibrate`] does
    /// better: it takes all measurements for every choice.
    ///
    /// # Errors
    /// [`LargeCalibrationError`] when the datasets cannot be read, hold no measurements, or the fit of the
    /// subsamples diverges.
    pub fn calibrate_large(
        &self,
        datasets: &mut [Blocks],
        notice: impl FnMut(usize, &Warning),
    ) -> Result<Calibration, LargeCalibrationError> {
        let large = fit_large(self.settings, datasets, notice).map_err(|error| match error {
            OneStepError::Dataset(error) => LargeCalibrationError::Dataset(error),
            OneStepError::Estimation(error) => CalibError::of_fit(Self::NAME, error).into(),
        })?;
        let LargeFit { fit, one_step, robot, names } = large;
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Ok(Calibration { one_step: Some(one_step), ..calibration(&fit, robot.ticks_per_rev, &names)? })
    }
}

/// Why wheels and their separation are not determined where any of them makes up for the others.
const BENDS_ALIKE: &str =
    "the runs bend alike, so that wheels and separation make up for each other: add straights, and turns both ways";

/// Puts what was driven in the place of a reason that was not the cause: a drive that has enough of what a
/// parameter needs leaves it open because wheels and instrument do not go together.
fn state_facts(found: &mut Calibration, driven: &Driven) {
    let Driven { left_rad, right_rad, distance_m, straight_m, .. } = *driven;
    let noise = found.noise;
    for blind in &mut found.not_observable {
        let is_cause = match &*blind.why {
            // On straights both wheels turn.
            WHEEL_HARDLY_TURNS => straight_m < MIN_DISTANCE_M,
            HARDLY_TURN => left_rad + right_rad < MIN_TURNING_RAD,
            ON_THE_SPOT => distance_m < MIN_DISTANCE_M,
            BENDS_ALIKE => left_rad.min(right_rad) < MAX_OTHER_WAY * (left_rad + right_rad),
            _ => true,
        };
        if !is_cause && driven.is_followed {
            let apart = noise.map_or_else(String::new, |noise| {
                format!(
                    ": they differ as if wheels erred by {:.1} mm/√m and turns by {:.1} °/√rad",
                    1e3 * noise.wheel_sigma_m_per_sqrt_m,
                    noise.turn_sigma_rad_per_sqrt_rad.to_degrees()
                )
            });
            let one_way = left_rad.min(right_rad) < MAX_OTHER_WAY * (left_rad + right_rad);
            let both = if one_way { "; add turns the other way round" } else { "" };
            blind.why = format!(
                "the runs {}{both}; what the instrument saw does not follow the wheels closely enough{apart}",
                driven.sentence()
            )
            .into();
        }
    }
}

/// Why the instrument's heading on the robot is not determined.
const NO_HEADINGS: &str = "no heading was measured: positions are the same however the instrument is turned";

/// Why large datasets are not calibrated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LargeCalibrationError {
    /// They cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The method does not apply.
    #[error(transparent)]
    Calib(#[from] CalibError),
}

impl Method for Joint {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "any path and any truth (poses, positions, ends, displacements, marks, gyro, tape, walls): maximum likelihood of whole runs, noise estimated"
    }

    /// The paper's runs, with squares for what only shows in corners.
    fn protocol(&self) -> Vec<Schedule> {
        vec![
            Schedule::Straights { length_m: 0.5, runs: 40 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 20 },
            Schedule::Squares { side_m: 1.0, runs_each_way: 5 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, _) = nominal(Self::NAME, sessions)?;
        let names: Vec<&str> = sessions.iter().map(|session| session.name).collect();
        let fit = self.settings.fit(sessions).map_err(|error| CalibError::of_fit(Self::NAME, error))?;
        let mut found = calibration(&fit, robot.ticks_per_rev, &names)?;
        if !found.not_observable.is_empty() {
            state_facts(&mut found, &Driven::of(sessions));
        }
        Ok(found)
    }
}

/// The drive of a fit, with what the measurements do not determine of it; `covariance` is
/// [`ModelFit::covariance`].
///
/// # Errors
/// [`CalibError::NotADrive`] where the values of the fit are none.
pub fn calibrated_drive(
    fit: &ModelFit<'_>,
    covariance: Option<&Covariance>,
    ticks_per_rev: Option<f64>,
) -> Result<Calibration, CalibError> {
    let Model { m_per_rad, separation_m, .. } = fit.solution.model;
    let geometry = drive(Joint::NAME, m_per_rad.map(|m_per_rad| 2.0 * m_per_rad), separation_m)?;
    let diameter_m = geometry.wheel_diameter_m();
    let geometry_m = [diameter_m.left, diameter_m.right, separation_m];
    Ok(Calibration {
        covariance: covariance
            .map(|covariance| geometry_covariance(|row, column| covariance[(row, column)], geometry_m)),
        noise: Some(noise(fit)),
        not_observable: not_observable(fit, covariance),
        runs_used: fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).count(),
        converged: fit.solution.converged,
        ..Calibration::new(Joint::NAME, geometry, ticks_per_rev)
    })
}

/// The fit as a calibration of sessions with these names.
fn calibration(fit: &ModelFit<'_>, ticks_per_rev: Option<f64>, names: &[&str]) -> Result<Calibration, CalibError> {
    let covariance = fit.covariance(&mut []);
    let var = |row: usize, column: usize| covariance.as_ref().map(|covariance| covariance[(row, column)]);
    let instrument = fit.mean_instrument();
    let extrinsics = fit.has(Column::SensorX).then(|| Extrinsics {
        body_from_sensor: instrument.body_from_sensor,
        covariance: covariance.as_ref().filter(|_| fit.position(Column::SensorX).is_some()).map(|_| {
            let rows = Column::EXTRINSICS.map(|column| fit.position(column));
            Matrix3::from_fn(|i, j| rows[i].zip(rows[j]).and_then(|(i, j)| var(i, j)).unwrap_or(f64::NAN))
        }),
    });
    let latency_sigma_s = fit.position(Column::Latency).and_then(|row| var(row, row)).map(f64::sqrt);
    let mut drive = calibrated_drive(fit, covariance.as_ref(), ticks_per_rev)?;
    if extrinsics.is_some() && !fit.has(Column::SensorTheta) {
        drive.not_observable.push(NotObservable { parameter: Parameter::SensorTheta, why: NO_HEADINGS.into() });
    }
    let skids = fit.solution.model.separation_m > MAX_UNREMARKED_RATIO * fit.nominal.separation_m;
    let turn_loss = skids.then(|| turn_loss::sentence(fit)).flatten();
    Ok(Calibration {
        extrinsics,
        latency_s: fit.has(Column::Latency).then_some((mean_clock_s(fit) + instrument.latency_s, latency_sigma_s)),
        group_instruments: group_instruments(fit, names),
        seen: moved(fit, names).into_iter().chain(clock_rates(fit, names)).chain(turn_loss).collect(),
        runs_rejected: rejected(fit),
        ..drive
    })
}

/// The noise of the odometry that the fit found.
fn noise(fit: &ModelFit<'_>) -> OdometryNoise {
    let noise = &fit.solution.noise;
    OdometryNoise {
        is_assumed: fit.shows_no_scatter(),
        wheel_sigma_m_per_sqrt_m: noise.sigma(NoiseComponent::Wheel),
        turn_sigma_rad_per_sqrt_rad: noise.sigma(NoiseComponent::Turn),
    }
}

/// What the measurements do not determine of the geometry: of each direction the parameter that it is mostly
/// of, and wheels that change by more than their standard deviation where a separation that is not determined
/// is off by as much as stated lengths are.
fn not_observable(fit: &ModelFit<'_>, covariance: Option<&Covariance>) -> Vec<NotObservable> {
    let mut said = BTreeSet::new();
    fit.unobservable
        .iter()
        .flat_map(|direction| {
            let direction = Vector3::new(direction[0], direction[1], direction[2]);
            let (parameter, why) = unobservable(&direction);
            let why = why_not(fit, &direction).unwrap_or(why);
            let of = direction.normalize().abs();
            let wheels = [Parameter::LeftWheelDiameter, Parameter::RightWheelDiameter];
            // What has no variance is not determined already.
            let moves = |wheel: usize| {
                let variance = covariance.map_or(0.0, |covariance| covariance[(wheel, wheel)]);
                variance > 0.0 && (STATED_LENGTH_SIGMA * of[wheel] / of.z).powi(2) > variance
            };
            let (named, why) = if parameter == Parameter::WheelSeparation {
                let moved: Vec<Parameter> = (0..2).filter(|wheel| moves(*wheel)).map(|wheel| wheels[wheel]).collect();
                let why = if moved.is_empty() { why } else { BENDS_ALIKE };
                ([vec![parameter], moved].concat(), why)
            } else if wheels.contains(&parameter) && of.x.min(of.y) > MIN_COMMON_SCALE_COMPONENT {
                // Both wheels alike, or against each other: neither diameter is known.
                (wheels.to_vec(), why)
            } else {
                (vec![parameter], why)
            };
            named.into_iter().map(move |parameter| NotObservable { parameter, why: why.into() })
        })
        .filter(|blind| said.insert(blind.parameter.key()))
        .collect()
}

/// Why a direction is not observable where partial measurements are all there is.
fn why_not(fit: &ModelFit<'_>, direction: &Vector3<f64>) -> Option<&'static str> {
    let records: &Records<'_> = &fit.records;
    if !records.is_partial() {
        return None;
    }
    let of = direction.normalize();
    let ratio = (of.x - of.y).abs() * std::f64::consts::FRAC_1_SQRT_2;
    Some(if of.z.abs() > MIN_NAMED_COMPONENT && records.has_gyro() {
        "the gyro's scale is not known, so that only the ratio of the wheels is: state scale_sigma under [gyro] of \
         dataset.toml, or come back to the same heading after whole turns (revisit.csv)"
    } else if of.z.abs() > MIN_NAMED_COMPONENT {
        "nothing measures a turn: come back to the same heading after whole turns (revisit.csv), or log a gyro"
    } else if ratio > MIN_NAMED_COMPONENT && records.has_gyro() {
        "the gyro's bias is not told from the wheels' ratio: stand still for 10 s in every run, or drive at two speeds"
    } else if ratio > MIN_NAMED_COMPONENT {
        "nothing measures how straights bend: log a gyro, or headings along a wall (wall.csv)"
    } else if fit.unobservable.iter().all(|direction| direction[2] == 0.0) {
        "nothing measures a length: the wheelbase holds for wheels as stated, with which the robot turns as it was \
         seen to; measure a straight by tape (distance.csv), or distances from a wall while driving (wall.csv)"
    } else {
        "nothing measures a length: measure a straight by tape (distance.csv), or distances from a wall (wall.csv)"
    })
}

/// Runs without use, runs of which no measurement fitted, and partial measurements that are outliers.
fn rejected(fit: &ModelFit<'_>) -> Vec<Rejected> {
    let id = |run: (usize, usize)| fit.records.ids[run.0][run.1].clone();
    let clocks = fit.records.clocks.iter().flat_map(|clock| &clock.odd_runs);
    let late = |(run, ClockOffset { offset_s, sigma_s, .. }): (&String, &ClockOffset)| {
        let (size_s, way) = (offset_s.abs(), if *offset_s > 0.0 { "late" } else { "early" });
        let why = format!("the instrument is {size_s:.3} ± {sigma_s:.3} s {way} in this run alone");
        Rejected { run: run.clone(), why }
    };
    let odd: Vec<Rejected> = clocks.map(late).collect();
    let is_other = |run: &&(usize, usize)| odd.iter().all(|of| of.run != fit.records.ids[run.0][run.1]);
    let unused = fit.records.unused.iter().filter(is_other).map(|run| Rejected {
        run: id(*run),
        why: "it has no wheels, or fewer than two measurements of the instrument within its log".to_owned(),
    });
    let far = fit.solution.pass.runs.iter().filter(|run| run.count == 0.0).map(|run| Rejected {
        run: id(run.run),
        why: "what the instrument measured lies far outside of what wheels and noise explain".to_owned(),
    });
    let partial = fit.partial_outliers().into_iter().map(|PartialOutliers { run, rejected, of }| {
        let kinds: Vec<String> = rejected.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        let why = format!("of its {of} partial measurements as outliers: {}; the others count", kinds.join(", "));
        Rejected { run: id(run), why }
    });
    odd.iter().cloned().chain(unused).chain(far).chain(partial).collect()
}

/// What was taken off the stamps before the fit, in the mean of the sessions, seconds.
fn mean_clock_s(fit: &ModelFit<'_>) -> f64 {
    let clocks = &fit.records.clocks;
    clocks.iter().map(|clock| clock.of_all.offset_s).sum::<f64>() / clocks.len().max(1) as f64
}

/// Clocks that drift over their session, which was undone before the fit.
fn clock_rates(fit: &ModelFit<'_>, names: &[&str]) -> Vec<String> {
    let of = |(SessionClock { of_all: clock, .. }, name): (&SessionClock, &&str)| {
        let (way, ppm) = (if clock.rate > 0.0 { "gains" } else { "loses" }, 1e6 * clock.rate.abs());
        let sentence = format!(
            "{name}: the instrument's clock {way} {ppm:.0} ppm on the log's from the start of the session on, which is undone"
        );
        (clock.rate != 0.0).then_some(sentence)
    };
    fit.records.clocks.iter().zip(names).filter_map(of).collect()
}

/// What differs for certain between the instruments of the first session and another. Clocks that were taken
/// off the stamps before the fit are apart by more than any doubt.
fn moved(fit: &ModelFit<'_>, names: &[&str]) -> Vec<String> {
    let clock_s = |session: usize| fit.records.clocks.get(session).map_or(0.0, |clock| clock.of_all.offset_s);
    let sentence = |[first, other]: [usize; 2], what: &str| {
        let names = format!("{} and {}", names[first], names[other]);
        format!("between {names} the instrument {what}: it was mounted anew, or its clock set")
    };
    let later = |by_s: f64| {
        let (ms, way) = (1e3 * by_s.abs(), if by_s > 0.0 { "later" } else { "earlier" });
        format!("became {ms:.0} ms {way}")
    };
    let Some(own) = &fit.solution.model.own else {
        let apart = (1..names.len()).map(|other| (other, clock_s(other) - clock_s(0))).filter(|(_, by_s)| *by_s != 0.0);
        return apart.map(|(other, by_s)| sentence([0, other], &later(by_s))).collect();
    };
    // Of runs that have instruments for themselves, where each is a session.
    let sessions: BTreeSet<usize> = own.of.keys().map(|group| group.0).collect();
    if sessions.len() < own.of.len() {
        return Vec::new();
    }
    let Some((first, before)) = own.of.first_key_value() else { return Vec::new() };
    let mut sentences = Vec::new();
    for (group, instrument) in own.of.iter().skip(1) {
        let clocks_s = clock_s(group.0) - clock_s(first.0);
        let mut say = |column: Column, by: f64, what: String| {
            let sigmas = [first, group].map(|group| fit.own_sigma(*group, column));
            let is_by_fit = matches!(sigmas, [Some(a), Some(b)] if by.abs() > MIN_MOVED_SIGMAS * a.hypot(b));
            if is_by_fit || (column == Column::Latency && clocks_s != 0.0) {
                sentences.push(sentence([first.0, group.0], &what));
            }
        };
        let [a, b] = [before, instrument].map(|of| of.body_from_sensor);
        let turned_rad = kinematics::wrap_to_pi(b.theta_rad - a.theta_rad);
        let (x_m, y_m) = (b.x_m - a.x_m, b.y_m - a.y_m);
        let late_s = clocks_s + instrument.latency_s - before.latency_s;
        say(Column::SensorTheta, turned_rad, format!("turned by {:.2}°", turned_rad.to_degrees()));
        say(Column::SensorX, x_m, format!("moved by {:.1} mm ahead", 1e3 * x_m));
        say(Column::SensorY, y_m, format!("moved by {:.1} mm to the left", 1e3 * y_m));
        say(Column::Latency, late_s, later(late_s));
    }
    sentences
}

/// The instruments of groups, by the sessions' names.
fn group_instruments(fit: &ModelFit<'_>, names: &[&str]) -> Vec<GroupInstrument> {
    let clock_s: Vec<f64> = fit.records.clocks.iter().map(|clock| clock.of_all.offset_s).collect();
    let Some(own) = &fit.solution.model.own else {
        // Clocks that were apart before the fit.
        let are_apart = clock_s.iter().any(|clock_s_of| *clock_s_of != clock_s[0]);
        let latency_s = fit.solution.model.latency_s;
        let of = |(name, clock_s): (&&str, &f64)| GroupInstrument {
            latency_s: Some(clock_s + latency_s),
            ..GroupInstrument::new(name)
        };
        return names.iter().zip(&clock_s).filter(|_| are_apart).map(of).collect();
    };
    let name = |(session, run): (usize, usize)| {
        let session_name = names[session].to_owned();
        match own.grouping {
            Grouping::Session => session_name,
            Grouping::Run if names.len() == 1 => fit.records.ids[session][run].clone(),
            Grouping::Run => format!("{session_name}/{}", fit.records.ids[session][run]),
        }
    };
    own.of
        .iter()
        .map(|(group, instrument)| {
            let shown = |column: Column, value: f64| fit.shows(*group, column).then_some(value);
            let Pose { x_m, y_m, theta_rad } = instrument.body_from_sensor;
            GroupInstrument {
                of: name(*group),
                sensor_x_m: shown(Column::SensorX, x_m),
                sensor_y_m: shown(Column::SensorY, y_m),
                sensor_theta_rad: shown(Column::SensorTheta, theta_rad),
                latency_s: shown(Column::Latency, clock_s.get(group.0).unwrap_or(&0.0) + instrument.latency_s),
            }
        })
        .collect()
}

//! `tachometer`: the speed that each wheel's encoder gives against the ground speed that a reference
//! tachometer measures beside it.
//!
//! Model: a wheel that turns by φ goes r φ, C = r · 2π/ticks. With v_k the mean ground speed of a wheel
//! between the reference's samples k−1 and k, and φ_k its angle at the sample, interpolated in the log, a run
//! says r = Σ ±v_k (t_k − t_{k−1}) / Σ |φ_k − φ_{k−1}|, the sign being that of the wheel's turn. The result
//! is the mean over the runs, wheel by wheel.
//! Assumptions: wheels roll; the tachometer reads the contact's own track; the log is about as dense as the
//! reference. A reference that samples the speed at an instant instead of its mean is as good for runs that
//! begin and end at rest: the sum is then the trapezoid rule.
//! Observability: both wheels, their common scale included. Blind to the wheelbase, which keeps its nominal
//! value; spins measure it (`direct`, `ivanjko`).
//! Reference: Goel, Roumeliotis, Sukhatme 1999 (encoders calibrated against a precision tachometer). The
//! ratio of sums is ours: a slope through the origin would be drawn towards zero by the rounding of the
//! counts, which enters its regressor.

use dataset::{NominalRobot, RunView, Session};
use kinematics::{Side, Wheels};
use motion_programs::Schedule;
use nalgebra::{DMatrix, DVector};

use super::linear::scatter_between_runs;
use crate::estimate::{
    CalibError, Calibration, Covariance, Method, NotObservable, Parameter, Rejected, drive, nominal,
};
use crate::settings::{MAX_ROW_INTERVAL_RATIO, MIN_WHEEL_TURN_RAD};
use estimation::WheelAngleInterpolator;

/// The method; it has nothing to choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tachometer;

impl Tachometer {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self;

    const NAME: &'static str = "tachometer";
}

/// Travel of each wheel for one radian, metres, by one run; or why it determines none.
fn m_per_rad(run: &RunView<'_>, robot: &NominalRobot) -> Result<Wheels<f64>, &'static str> {
    let track = WheelAngleInterpolator::of(run, robot).ok_or("the run has no odometry")?;
    let rows_s = &run.odometry().t_s;
    let (mut travel_m, mut turned_rad) = (Wheels::both(0.0), Wheels::both(0.0_f64));
    for samples in run.run().wheel_reference.windows(2) {
        let (from_s, to_s) = (samples[0].t_s, samples[1].t_s);
        let Some(steps) = track.steps(from_s, to_s) else { continue };
        if longest_gap_s(rows_s, from_s, to_s) > MAX_ROW_INTERVAL_RATIO * (to_s - from_s) {
            return Err("its odometry has rows too far apart for the tachometer's samples; log more often");
        }
        for side in Side::BOTH {
            let turn_rad: f64 = steps.iter().map(|step| step[side]).sum();
            if turn_rad != 0.0 {
                travel_m[side] += turn_rad.signum() * samples[1].speed_m_s[side] * (to_s - from_s);
                turned_rad[side] += turn_rad.abs();
            }
        }
    }
    if turned_rad.left.min(turned_rad.right) < MIN_WHEEL_TURN_RAD {
        return Err("a wheel turned by less than a radian while the tachometer measured");
    }
    Ok(travel_m.zip_with(turned_rad, |travel_m, turned_rad| travel_m / turned_rad))
}

/// The longest time between two rows of a log from the last one before an interval to the first one after it,
/// seconds.
fn longest_gap_s(rows_s: &[f64], from_s: f64, to_s: f64) -> f64 {
    let first = rows_s.partition_point(|row_s| *row_s <= from_s).saturating_sub(1);
    let last = rows_s.partition_point(|row_s| *row_s < to_s).min(rows_s.len() - 1);
    rows_s[first.min(last)..=last].windows(2).map(|rows| rows[1] - rows[0]).fold(0.0, f64::max)
}

impl Method for Tachometer {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "wheel speeds against a reference tachometer's: both wheels, blind to the wheelbase"
    }

    /// Straight runs under a tachometer; length and number are ours.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Straights { length_m: 2.0, runs: 10 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let (mut values, mut runs_rejected) = (Vec::new(), Vec::new());
        for session in sessions {
            for run in session.runs.iter().filter(|run| !run.run().wheel_reference.is_empty()) {
                match m_per_rad(run, session.robot) {
                    Ok(value) => values.push(value),
                    Err(why) => runs_rejected.push(Rejected { run: run.info().id.clone(), why: why.to_owned() }),
                }
            }
        }
        if values.is_empty() {
            let why = runs_rejected.first().map_or_else(
                || "it needs a tachometer's ground speed of each wheel (wheel_reference.csv)".to_owned(),
                |rejected| format!("run {}: {}", rejected.run, rejected.why),
            );
            return Err(CalibError::NotApplicable { method: Self::NAME, why });
        }
        let count = values.len() as f64;
        let mean = Wheels::from_sides(|side| values.iter().map(|value| value[side]).sum::<f64>() / count);
        let scores: Vec<_> = values
            .iter()
            .map(|value| DVector::from_vec(vec![value.left - mean.left, value.right - mean.right]))
            .collect();
        let covariance = scatter_between_runs(&(DMatrix::identity(2, 2) * count), &scores, 1).map(|radii| {
            let mut covariance = Covariance::zeros(3, 3);
            covariance.view_mut((0, 0), (2, 2)).copy_from(&(radii * 4.0));
            // Nothing is known of the base.
            covariance[(2, 2)] = f64::INFINITY;
            covariance
        });
        let geometry = drive(Self::NAME, mean.map(|m_per_rad| 2.0 * m_per_rad), geometry.wheel_separation_m())?;
        Ok(Calibration {
            covariance,
            not_observable: vec![NotObservable {
                parameter: Parameter::WheelSeparation,
                why: "the speeds of the wheels do not say how far apart they are; the nominal value is kept: add spins for direct or ivanjko".into(),
            }],
            runs_used: values.len(),
            runs_rejected,
            ..Calibration::new(Self::NAME, geometry, robot.ticks_per_rev)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dataset::{Dataset, Odometry, Provenance, Run, TruthNoise, WheelLog, WheelSpeed};

    fn dataset(wheels: WheelLog, wheel_reference: Vec<WheelSpeed>) -> Dataset {
        let odometry = Odometry { t_s: (0..=20).map(|k| 0.1 * f64::from(k)).collect(), wheels, ..Odometry::default() };
        Dataset {
            provenance: Provenance::default(),
            robot: NominalRobot {
                left_wheel_diameter_m: 0.16,
                right_wheel_diameter_m: 0.16,
                wheel_separation_m: 0.363,
                ticks_per_rev: Some(1000.0),
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: vec![Run { odometry, wheel_reference, ..Run::default() }],
        }
    }

    #[test]
    fn the_gap_is_that_of_the_rows_around_an_interval() {
        let rows_s = [0.0, 1.0, 2.0, 5.0, 6.0];
        for (from_s, to_s, gap_s) in
            [(0.0, 1.0, 1.0), (0.5, 1.5, 1.0), (1.5, 2.5, 3.0), (2.0, 5.0, 3.0), (5.0, 6.0, 1.0)]
        {
            assert_eq!(longest_gap_s(&rows_s, from_s, to_s), gap_s, "{from_s} {to_s}");
        }
    }

    #[test]
    fn a_wheel_that_goes_back_and_forth_has_its_radius_and_a_sparse_log_is_refused() {
        // Left forward and back by 10 ticks a row, right the other way round, at 0.081 and 0.079 m/rad.
        let column =
            |sign: i64| (0..=20).map(|k: i64| sign * 10 * if k <= 10 { k } else { 20 - k }).collect::<Vec<_>>();
        let (left, right) = (0.081, 0.079);
        let rate = std::f64::consts::TAU / 1000.0 * 10.0 / 0.1;
        let reference: Vec<WheelSpeed> = (0..=20)
            .map(|k| {
                let sign = if k <= 10 { 1.0 } else { -1.0 };
                WheelSpeed {
                    t_s: 0.1 * f64::from(k),
                    speed_m_s: Wheels { left: sign * left * rate, right: -sign * right * rate },
                }
            })
            .collect();
        let dense = dataset(WheelLog::Ticks(Wheels { left: column(1), right: column(-1) }), reference.clone());
        let found = Tachometer.calibrate(&[dense.session()]).expect("a tachometer");
        let diameter_m = found.geometry.wheel_diameter_m();
        assert!((diameter_m.left - 2.0 * left).abs() < 1e-14 && (diameter_m.right - 2.0 * right).abs() < 1e-14);
        assert_eq!((found.geometry.wheel_separation_m(), found.covariance), (0.363, None));

        let mut sparse = dataset(WheelLog::Ticks(Wheels { left: vec![0, 0], right: vec![0, 0] }), reference);
        sparse.runs[0].odometry.t_s = vec![0.0, 2.0].into();
        let refused = Tachometer.calibrate(&[sparse.session()]).expect_err("no rows inside").to_string();
        assert!(refused.contains("too far apart"), "{refused}");
        // On a clock that began long ago. Rejects a gap that is measured against instants, not intervals.
        let mut late = sparse.clone();
        late.runs[0].odometry.t_s.iter_mut().for_each(|t_s| *t_s += 1e3);
        late.runs[0].wheel_reference.iter_mut().for_each(|sample| sample.t_s += 1e3);
        assert_eq!(Tachometer.calibrate(&[late.session()]).expect_err("no rows inside").to_string(), refused);
        sparse.runs[0].wheel_reference.clear();
        let refused = Tachometer.calibrate(&[sparse.session()]).expect_err("no reference").to_string();
        assert!(refused.contains("wheel_reference.csv"), "{refused}");
    }
}

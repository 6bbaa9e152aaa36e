//! The augmented filter as a robot would run it: one row of the log after the other, poses of the instrument
//! as they come.

use bench::Trial;
use calib::methods::augmented_kalman::{AugmentedFilter, NoiseFilter};
use dataset::{RunView, Session, WheelLog};
use kinematics::{DriveGeometry, Pose, Wheels};

use super::{lengths, motion_capture, with_instrument_sigma};

/// A measurement a second and a row of the log every 50 ms, as one stream in time.
enum Row {
    Counts(Wheels<i64>),
    Pose(Pose),
}

fn stream(run: &RunView<'_>) -> Vec<Row> {
    let WheelLog::Ticks(ticks) = &run.odometry().wheels else { panic!("the simulator logs ticks") };
    let mut poses = run.observed_poses().into_iter().step_by(20).peekable();
    let mut rows = Vec::new();
    for ((t_s, left), right) in run.odometry().t_s.iter().zip(&ticks.left).zip(&ticks.right) {
        rows.push(Row::Counts(Wheels { left: *left, right: *right }));
        while let Some((_, pose)) = poses.next_if(|(seen_s, _)| seen_s <= t_s) {
            rows.push(Row::Pose(pose));
        }
    }
    rows
}

/// Drives through a session once and gives the filter with the sum of the normalised innovations and their
/// number.
fn once(session: &Session<'_>, noise: NoiseFilter) -> (AugmentedFilter<i64>, f64, f64) {
    let nominal = session.robot.geometry().expect("a drive");
    let m_per_count = nominal.m_per_count(session.robot.ticks_per_rev.expect("ticks")).expect("positive");
    let start = Pose::IDENTITY;
    let mut filter = AugmentedFilter::new(&nominal, m_per_count, 0.05, noise, start, Wheels::both(0_i64));
    let (mut sum, mut measurements) = (0.0, 0.0);
    for run in &session.runs {
        let mut counts = Wheels::both(0);
        let mut begun = false;
        for row in stream(run) {
            match row {
                Row::Counts(now) => {
                    counts = now;
                    if begun {
                        filter.predict(now);
                    }
                }
                Row::Pose(pose) if begun => {
                    sum += filter.update(pose).nis;
                    measurements += 1.0;
                }
                Row::Pose(pose) => {
                    filter.restart(pose, counts);
                    begun = true;
                }
            }
        }
    }
    (filter, sum, measurements)
}

fn errors_in_sigmas(filter: &AugmentedFilter<i64>, truth: &DriveGeometry) -> [f64; 3] {
    let (found, covariance) = (lengths(&filter.geometry().expect("positive")), filter.covariance());
    let truth = lengths(truth);
    std::array::from_fn(|i| (found[i] - truth[i]) / covariance[(i, i)].sqrt())
}

/// One pass, once with the noise told and once to be found. With the noise told, the innovations are χ² with
/// three degrees of freedom a measurement: their sum lies within 4.5 standard deviations √(6 n) (7e-6).
/// Rejects a filter that is told wheels of half the noise.
#[test]
fn row_by_row_the_filter_finds_the_drive_and_its_innovations_are_as_large_as_it_says() {
    let (sigma_m, sigma_rad) = (3e-4, 5e-4);
    let scenario = with_instrument_sigma(motion_capture(Pose::IDENTITY), sigma_m, sigma_rad);
    let mut trial = Trial::new(&scenario, 23).expect("simulates");
    let truth = trial.true_geometry();
    let session = trial.drive(0).expect("drives");
    let of = |wheels: f64| [wheels * wheels, sigma_m * sigma_m, sigma_rad * sigma_rad].into();
    let logged = NoiseFilter::new(of(scenario.noise.wheel_sigma_m_per_sqrt_m), [true; 3]);
    let found = NoiseFilter::new(of(1e-3), [false; 3]);
    for noise in [logged, found] {
        let (filter, _, _) = once(&session, noise);
        // 4.5 sigmas, three times over twice: 4e-5.
        assert!(errors_in_sigmas(&filter, &truth).iter().all(|error| error.abs() < 4.5));
        assert!(filter.is_settled());
    }
    let (_, sum, measurements) = once(&session, logged);
    assert!((sum - 3.0 * measurements).abs() < 4.5 * (6.0 * measurements).sqrt(), "{sum} of {measurements}");
    let half = NoiseFilter::new(of(0.5 * scenario.noise.wheel_sigma_m_per_sqrt_m), [true; 3]);
    let (_, sum, measurements) = once(&session, half);
    assert!((sum - 3.0 * measurements).abs() > 4.5 * (6.0 * measurements).sqrt(), "{sum} of {measurements}");
}

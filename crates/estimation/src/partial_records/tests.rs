//! Windows of a gyroscope and its noise, against what is known of them on paper.

use dataset::{Dataset, ExtraChannel, Odometry, RunInfo, TruthNoise, WheelLog};

use super::*;
use crate::settings::COMMON;

/// A run whose rows have lengths, turns of both wheels since the row before, and a gyroscope's rates.
fn run(rows: &[(f64, [f64; 2], f64)]) -> Run {
    let (mut t_s, mut rates) = (vec![0.0], vec![f64::NAN]);
    let mut angles = Wheels::both(vec![0.0]);
    for (row, (dt_s, [left, right], rate)) in rows.iter().enumerate() {
        t_s.push(t_s[row] + dt_s);
        rates.push(*rate);
        angles.left.push(angles.left[row] + left);
        angles.right.push(angles.right[row] + right);
    }
    let mut odometry = Odometry { t_s: t_s.into(), wheels: WheelLog::Angles(angles), ..Odometry::default() };
    odometry.extra.insert(ExtraChannel::GyroYawRate, rates);
    Run { info: RunInfo { continuous: true, ..RunInfo::default() }, odometry, ..Run::default() }
}

/// Wheels of 0.08 m/rad, 0.363 m apart.
fn dataset(runs: Vec<Run>) -> Dataset {
    Dataset { runs, truth_noise: TruthNoise::default(), ..crate::tests::dataset_of(1, true) }
}

fn windows_of(rows: &[(f64, [f64; 2], f64)], first: f64, is_instantaneous: bool, longest_s: f64) -> Vec<Window> {
    let mut run = run(rows);
    run.odometry.extra.get_mut(&ExtraChannel::GyroYawRate).expect("a gyroscope")[0] = first;
    let dataset = dataset(vec![run]);
    let session = dataset.session();
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot).expect("a track");
    windows(session.runs[0].run(), &track, is_instantaneous, longest_s)
}

const STILL: [f64; 2] = [0.0; 2];
const TURNING: [f64; 2] = [-0.5, 0.5];

/// The gyroscope of a session, by its stated drive.
fn of(session: &Session<'_>) -> GyroSettings {
    let drive = Model::of(&session.robot.geometry().expect("a drive"), 0);
    GyroSettings::of(session, Some(&drive))
}

#[test]
fn windows_hold_whole_rows_up_to_their_length_and_what_was_turned_in_them() {
    // Quarters of a second, of which two fit into 0.5 s, to the last bit.
    let rows = [(0.25, STILL, 1.0), (0.25, STILL, 3.0), (0.25, TURNING, -2.0), (0.25, STILL, 4.0), (0.25, STILL, 8.0)];
    let found = windows_of(&rows, f64::NAN, false, 0.5);
    let of = |window: &Window| (window.from_s, window.to_s, window.turn_rad, window.stands);
    assert_eq!(
        found.iter().map(of).collect::<Vec<_>>(),
        [(0.0, 0.5, 1.0, true), (0.5, 1.0, 0.5, false), (1.0, 1.25, 2.0, true)]
    );
    // Rows of a length that is rounded: three of them are 4e-17 s longer than 0.3 s, and one window.
    let tenths = [(0.1, STILL, 1.0); 10];
    let found = windows_of(&tenths, f64::NAN, false, 0.3);
    assert_eq!(found.len(), 4, "{found:?}");
    // A window of no length is a row.
    assert_eq!(windows_of(&rows, f64::NAN, false, 0.0).len(), 5);
    // One wheel that turns is a motion.
    let one = [(0.25, [0.5, 0.0], 1.0), (0.25, [0.0, 0.5], 1.0), (0.25, STILL, 1.0)];
    let stands: Vec<bool> = windows_of(&one, f64::NAN, false, 0.0).iter().map(|window| window.stands).collect();
    assert_eq!(stands, [false, false, true]);
}

#[test]
fn a_rate_at_an_instant_counts_half_for_the_rows_beside_it() {
    let rows = [(0.5, STILL, 2.0), (0.25, STILL, 6.0)];
    let turns = |is_instantaneous| -> Vec<f64> {
        windows_of(&rows, 4.0, is_instantaneous, 0.0).iter().map(|window| window.turn_rad).collect()
    };
    // Means of 4 and 2, of 2 and 6 rad/s; else the rates of the rows themselves.
    assert_eq!((turns(true), turns(false)), (vec![1.5, 1.0], vec![1.0, 1.5]));
}

#[test]
fn a_row_without_a_rate_cuts_a_window() {
    let rows = [(0.25, STILL, 1.0), (0.25, STILL, f64::NAN), (0.25, STILL, 1.0), (0.25, STILL, 1.0)];
    let found = windows_of(&rows, f64::NAN, false, 1.0);
    let spans: Vec<(f64, f64)> = found.iter().map(|window| (window.from_s, window.to_s)).collect();
    assert_eq!(spans, [(0.0, 0.25), (0.5, 1.0)]);
}

/// So many pairs of rows of 0.1 s, with rates that are off by `off` to both sides in turn.
fn standing(pairs: usize, off: f64) -> Vec<(f64, [f64; 2], f64)> {
    (0..=pairs).map(|row| (0.1, STILL, if row % 2 == 0 { off } else { -off })).collect()
}

#[test]
fn noise_of_standstills_is_half_of_the_mean_square_change_of_the_rate() {
    // From row to row the rate changes by 2a, of which the angle random walk n has the variance
    // n² (1/T + 1/T): n = a √(2 T).
    let of = |runs: Vec<Run>| {
        let dataset = dataset(runs);
        of(&dataset.session()).noise_rad_per_sqrt_s
    };
    let found = of(vec![run(&standing(60, 0.02))]).expect("it stands");
    let on_paper = 0.02 * 0.2_f64.sqrt();
    // Rounding of times of some seconds.
    assert!((found / on_paper - 1.0).abs() < 1e-9, "{found} {on_paper}");
    // Fifty pairs are enough, together over runs; motion between them counts nothing.
    let half = |pairs: usize| {
        let mut rows = standing(pairs, 0.02);
        rows.extend([(0.1, TURNING, 17.0); 3]);
        run(&rows)
    };
    let found = of(vec![half(24), half(26)]).expect("it stands");
    assert!((found / on_paper - 1.0).abs() < 1e-9, "{found} {on_paper}");
    // Rows of unequal lengths: a change of 0.04 rad/s over 1/0.1 s + 1/0.4 s.
    let unequal: Vec<_> =
        (0..=60).map(|row| if row % 2 == 0 { (0.1, STILL, 0.02) } else { (0.4, STILL, -0.02) }).collect();
    let found = of(vec![run(&unequal)]).expect("it stands");
    let on_paper = 0.04 / 12.5_f64.sqrt();
    assert!((found / on_paper - 1.0).abs() < 1e-9, "{found} {on_paper}");
    // A gyroscope without noise has the least there is; a log without one has none.
    assert_eq!(of(vec![run(&standing(60, 0.0))]), Some(PARTIAL.min_gyro_noise_rad_per_sqrt_s));
    let mut without = run(&standing(60, 0.02));
    without.odometry.extra.clear();
    assert_eq!(of(vec![without]), None);
}

#[test]
fn noise_of_a_robot_that_hardly_stands_is_how_it_strays_from_the_wheels() {
    // Ten windows of a second in ten rows each, in turn at two rates of the wheels. The gyroscope says what
    // they do with a bias, off by 0.02 rad/s in turn from window to window.
    let rows: Vec<_> = (0..100)
        .map(|row| {
            let (half_rad, off) = if row / 10 % 2 == 0 { (0.5, 0.02) } else { (0.25, -0.02) };
            (0.1, [-half_rad, half_rad], 20.0 * half_rad * 0.08 / 0.363 + 0.3 + off)
        })
        .collect();
    // 49 pairs of rows that stand are too few to be asked.
    let mut all = standing(49, 0.5);
    all.truncate(50);
    let moving = dataset(vec![run(&rows)]);
    let found = of(&moving.session()).noise_rad_per_sqrt_s.expect("it moves");
    // Every pair of windows of a second has the square 0.04²/2, of χ² with its median.
    let on_paper = 0.04 / (2.0 * COMMON.chi_square_1_median).sqrt();
    // Windows of sums of tenths are a second to 1e-14. Rejects rates that are not held against wheels.
    assert!((found / on_paper - 1.0).abs() < 1e-9, "{found} {on_paper}");
    let mut both = rows.clone();
    both.splice(0..0, all);
    let with_few = dataset(vec![run(&both)]);
    let found = of(&with_few.session()).noise_rad_per_sqrt_s.expect("it moves");
    // Of fourteen pairs four are of the standstill, one begins in it, and nine have the median.
    assert!((found / on_paper - 1.0).abs() < 1e-9, "{found} {on_paper}");
}

#[test]
fn what_is_stated_of_a_gyroscopes_noise_is_taken() {
    let mut log = dataset(vec![run(&standing(60, 0.02))]);
    log.truth_noise.gyro.noise_rad_per_sqrt_s = Some(0.5);
    let (session, rows) = (log.session(), standing(60, 0.02).len());
    let settings = of(&session);
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot).expect("a track");
    let found = settings.windows(&session.runs[0], &track);
    // 61 rows of a tenth of a second in windows of a second; their variance grows with their length.
    assert_eq!((rows, found.len()), (61, 7));
    for of in &found {
        let Quantity::GyroTurn { dt_s } = of.quantity else { panic!("a turn") };
        assert!((of.to_s - of.from_s - dt_s).abs() < 1e-12 && (of.variance - 0.25 * dt_s).abs() < 1e-12);
    }
    let last = found.last().expect("seven");
    assert!((last.to_s - last.from_s - 0.1).abs() < 1e-9);
}

#[test]
fn headings_of_a_run_range_from_the_least_to_the_most() {
    // Half a radian of each wheel against the other, four times to the left and six to the right.
    let mut rows = vec![(0.1, TURNING, 0.0); 4];
    rows.extend([(0.1, [0.5, -0.5], 0.0); 6]);
    let dataset = dataset(vec![run(&rows)]);
    let session = dataset.session();
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot).expect("a track");
    let nominal = Model::of(&session.robot.geometry().expect("valid"), 0);
    let found = turned_rad(&track, &nominal);
    assert!((found - 6.0 * 0.08 / 0.363).abs() < 1e-12, "{found}");
}

//! Numbers that are none: no reader lets one in, and no check takes one for a good log.

use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
use kinematics::{Increment, Pose, Wheels};

/// Rows of a run.
const ROWS: usize = 300;

/// Three runs of half a minute, turning both ways by the stated robot, seen ten times a second.
fn driven() -> Dataset {
    let robot = NominalRobot {
        left_wheel_diameter_m: 0.16,
        right_wheel_diameter_m: 0.16,
        wheel_separation_m: 0.36,
        ticks_per_rev: None,
        counter_bits: None,
    };
    let run = |number: u32| {
        let (mut angles, mut pose) = (Wheels::both(vec![0.0]), Pose::IDENTITY);
        let mut truth = vec![TruthSample::new(0.0, 0.0, 0.0, Some(0.0))];
        for row in 1..ROWS as u32 {
            let t = f64::from(row + 97 * number);
            let turned = Wheels { left: 0.3 + 0.2 * (0.011 * t).sin(), right: 0.3 + 0.2 * (0.017 * t).cos() };
            pose = pose * Increment::from_travel(turned.map(|rad| 0.08 * rad), 0.36).arc();
            angles = angles.zip_with(turned, |mut all, rad| {
                all.push(all.last().copied().unwrap_or_default() + rad);
                all
            });
            let off = 1e-3 * (12.9898 * t).sin();
            truth.push(TruthSample::new(
                0.1 * f64::from(row),
                pose.x_m + off,
                pose.y_m - off,
                Some(pose.theta_rad + off),
            ));
        }
        let info = RunInfo { id: format!("run-{number}"), ..RunInfo::default() };
        let t_s = (0..ROWS).map(|row| 0.1 * row as f64).collect();
        let odometry = Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() };
        Run { info, odometry, truth, ..Run::default() }
    };
    Dataset {
        provenance: Provenance::default(),
        robot,
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: (0..3).map(run).collect(),
    }
}

type Edit = fn(&mut Run, usize, f64);

fn angles(run: &mut Run) -> &mut Wheels<Vec<f64>> {
    match &mut run.odometry.wheels {
        WheelLog::Angles(angles) => angles,
        _ => unreachable!("angles were logged"),
    }
}

/// Every column that a check goes by. A heading that is NaN is one that was not measured.
const COLUMNS: [(&str, Edit); 6] = [
    ("x_m", |run, row, value| run.truth[row].x_m = value),
    ("y_m", |run, row, value| run.truth[row].y_m = value),
    ("theta_rad", |run, row, value| {
        let TruthSample { t_s, x_m, y_m, .. } = run.truth[row];
        run.truth[row] = TruthSample::new(t_s, x_m, y_m, Some(value));
    }),
    ("t_s", |run, row, value| run.truth[row].t_s = value),
    ("left", |run, row, value| angles(run).left[row] = value),
    ("right", |run, row, value| angles(run).right[row] = value),
];

/// Whether a log with a value in place of a column is as good as a sound one.
fn passes(edit: Edit, value: f64) -> bool {
    let mut dataset = driven();
    for run in &mut dataset.runs {
        // Signs by turns, so that differences overflow too.
        (1..ROWS).for_each(|row| edit(run, row, if row % 2 == 1 { value } else { -value }));
    }
    let found = preflight::check(&[dataset]);
    found.is_ok() && found.determined.values().all(|is| *is)
}

/// Windows without a finite speed are left out. A log whose windows all are was sound by what was driven
/// alone.
#[test]
fn no_log_passes_by_numbers_that_are_none() {
    assert!(passes(|_, _, _| {}, 0.0), "the sound log");
    for (name, edit) in COLUMNS {
        // The last two are numbers, but their squares or differences are none.
        for value in [f64::NAN, f64::INFINITY, 1e200, f64::MAX] {
            let is_missing = name == "theta_rad" && value.is_nan();
            assert!(is_missing || !passes(edit, value), "{name} = {value:e}");
        }
    }
}

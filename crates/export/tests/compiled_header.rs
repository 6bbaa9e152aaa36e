//! The C header, compiled and driven over an hour of counts, against the same arithmetic in Rust.
//!
//! Seen to be rejected: half of an effect's size (1e-3 m and more) and the midpoint rule for exact arcs (1e-4
//! m).

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use calib::{MethodReport, OdometryNoise, ReportedValue};
use diagnose::ExtendedModel;
use effects::{CATALOGUE, Effect, OnBoard, Variant, effect_from_estimates};
use export::format::exporter;
use export::{CalibratedRobot, OnBoardOdometry, Options};
use kinematics::Wheels;
use scenario::Scenario;

/// An hour at 20 Hz.
const STEPS: usize = 72_000;
const DT_S: f64 = 0.05;

/// Prints the pose and its covariance after each hundredth interval.
const PROGRAM: &str = r#"#include <stdio.h>
#include <inttypes.h>
#include "odometry.h"

int main(void) {
    yair_odometry_t s;
    int64_t left, right;
    double dt_s;
    long n = 0;
    if (scanf("%" SCNd64 " %" SCNd64, &left, &right) != 2) return 1;
    yair_odometry_init(&s, (yair_count_t)left, (yair_count_t)right, 0.0, 0.0, 0.0);
    while (scanf("%" SCNd64 " %" SCNd64 " %lf", &left, &right, &dt_s) == 3) {
        yair_odometry_step(&s, (yair_count_t)left, (yair_count_t)right, dt_s);
        if (++n % 100 == 0) {
            printf("%.17g %.17g %.17g", s.x_m, s.y_m, s.theta_rad);
#ifdef YAIR_WHEEL_SIGMA
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) printf(" %.17g", s.covariance[i][j]);
#endif
            printf("\n");
        }
    }
    return 0;
}
"#;

fn has_compiler(test: &str) -> bool {
    let there =
        Command::new("gcc").arg("--version").stdout(Stdio::null()).status().is_ok_and(|status| status.success());
    if !there {
        let _ = writeln!(std::io::stderr(), "{test}: skipped, there is no gcc");
    }
    there
}

/// Counters of a robot that drives ahead and back, in bends and on the spot, and stands at times; they wrap
/// at so many bits.
fn log(bits: u8) -> Vec<(Wheels<i64>, f64)> {
    let mask = (1_i64 << bits) - 1;
    let mut angle = Wheels::both(0.0);
    (0..=STEPS)
        .map(|step| {
            let t_s = step as f64 * DT_S;
            let stands = (t_s / 20.0).sin() > 0.9;
            let (v, w) = (0.4 * (t_s / 7.0).sin() + 0.1, 0.8 * (t_s / 3.0).cos());
            let speed = if stands { Wheels::both(0.0) } else { Wheels { left: v - 0.2 * w, right: v + 0.2 * w } };
            angle = angle.zip_with(speed, |angle, speed| angle + 1.6e4 * speed * DT_S);
            // A row in a hundred without an interval's length.
            let dt_s = if step % 100 == 7 { 0.0 } else { DT_S };
            (angle.map(|counts: f64| (counts.round() as i64 - 17) & mask), dt_s)
        })
        .collect()
}

/// What the compiled header prints for a log.
fn compiled(header: &str, log: &[(Wheels<i64>, f64)]) -> Vec<Vec<f64>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("odometry.h"), header).expect("written");
    std::fs::write(at("main.c"), PROGRAM).expect("written");
    let compiler = Command::new("gcc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "main.c", "-lm", "-o", "main"])
        .current_dir(folder.path())
        .output()
        .expect("gcc runs");
    assert!(compiler.status.success(), "{}\n{header}", String::from_utf8_lossy(&compiler.stderr));
    let mut text = format!("{} {}\n", log[0].0.left, log[0].0.right);
    for (counts, dt_s) in &log[1..] {
        let _ = writeln!(text, "{} {} {dt_s}", counts.left, counts.right);
    }
    std::fs::write(at("log"), text).expect("written");
    let input = std::fs::File::open(at("log")).expect("there");
    let output = Command::new(Path::new("./main")).current_dir(folder.path()).stdin(input).output().expect("runs");
    assert!(output.status.success());
    let number = |word: &str| word.parse::<f64>().expect("a number");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(|line| line.split(' ').map(number).collect()).collect()
}

/// Largest difference of positions (m) and headings (rad), and of the covariance over standard deviations.
fn differences(robot: &CalibratedRobot, bits: u8, scaled: Option<f64>) -> (f64, f64) {
    let options = Options { counter_bits: Some(bits), ..Options::default() };
    let render = exporter("c").expect("a format").render;
    let header = render(robot, &options).expect("has all");
    let mut other = None;
    if let Some(scale) = scaled {
        // The same robot with effects of other sizes.
        let mut header = header.clone();
        for (name, value) in robot.effects.iter().flat_map(|effect| &effect.values) {
            header = header.replace(&format!(" {name} = {value:e};"), &format!(" {name} = {:e};", scale * value));
        }
        other = Some(header);
    }
    let log = log(bits);
    let rows = compiled(other.as_ref().unwrap_or(&header), &log);
    assert_eq!(rows.len(), STEPS / 100);
    let mut odometry = OnBoardOdometry::new(robot, Some(bits), log[0].0).expect("a drive");
    let (mut off, mut off_covariance) = (0.0_f64, 0.0_f64);
    for (step, (counts, dt_s)) in log.iter().enumerate().skip(1) {
        odometry.step(*counts, *dt_s);
        if step % 100 == 0 {
            let (row, pose) = (&rows[step / 100 - 1], odometry.pose());
            for (found, expected) in row.iter().zip([pose.x_m, pose.y_m, pose.theta_rad]) {
                off = off.max((found - expected).abs());
            }
            let covariance = odometry.covariance();
            assert_eq!(row.len(), if covariance.is_some() { 12 } else { 3 });
            if let Some(matrix) = covariance {
                for (place, found) in row[3..].iter().enumerate() {
                    let (i, j) = (place / 3, place % 3);
                    let size = (matrix[(i, i)] * matrix[(j, j)]).sqrt();
                    off_covariance = off_covariance.max((found - matrix[(i, j)]).abs() / size);
                }
            }
        }
    }
    (off, off_covariance)
}

fn plain(noise: Option<OdometryNoise>) -> CalibratedRobot {
    let mut method = MethodReport {
        method: "joint".to_owned(),
        error: None,
        parameters: Default::default(),
        group_instruments: Vec::new(),
        noise,
        not_observable: Vec::new(),
        runs_used: 1,
        runs_rejected: Vec::new(),
        one_step: None,
        converged: true,
        warnings: Vec::new(),
    };
    for (key, value) in [
        ("left_wheel_diameter_m", 0.161),
        ("right_wheel_diameter_m", 0.159),
        ("wheel_separation_m", 0.37),
        ("left_m_per_tick", std::f64::consts::PI * 0.161 / 8192.0),
    ] {
        method.parameters.insert(key.to_owned(), ReportedValue::of(value, None));
    }
    CalibratedRobot::of_method("c.toml", &method, None).expect("has all")
}

/// A robot with one effect of large sizes: its mean terms at the plausible standard deviation, what is held
/// at the first value tried.
fn with_effects(ids: &[&str]) -> CalibratedRobot {
    let text = include_str!("../../../scenarios/motion-capture.toml");
    let mut scenario = Scenario::parse(text, "motion-capture.toml").expect("a scenario");
    scenario.effects.clear();
    for id in ids {
        let variants = effects::hypothesis(id).and_then(effects::Hypothesis::into_variants).expect("a mean");
        let Variant { fixed, term, .. } = &variants[0];
        let sizes = term.parameters().iter().map(|of| (of.name, of.prior_sigma));
        let values: Vec<(&str, f64)> = sizes.chain(fixed.iter().copied()).collect();
        scenario.effects.push(effect_from_estimates(id, &values).expect("physical"));
    }
    let model = ExtendedModel::of(&scenario).expect("a model");
    CalibratedRobot::of_model("extended.toml", &scenario, &model, None).expect("has all")
}

/// Sums of 72,000 doubles of up to tens of metres by two libraries' sines: seen are 1.2e-12 m, and 1.2e-13 of
/// a covariance. A nanometre is below any count.
const TOLERANCE: f64 = 1e-9;

#[test]
fn a_plain_calibration_compiled_is_the_same_over_an_hour() {
    if !has_compiler("a_plain_calibration_compiled_is_the_same_over_an_hour") {
        return;
    }
    let noise = OdometryNoise { wheel_sigma_m_per_sqrt_m: 1e-3, turn_sigma_rad_per_sqrt_rad: 4e-3 };
    for (noise, bits) in [(Some(noise), 32), (None, 16)] {
        let (off, off_covariance) = differences(&plain(noise), bits, None);
        assert!(off < TOLERANCE && off_covariance < TOLERANCE, "{off} {off_covariance}");
    }
}

#[test]
fn effects_compiled_are_the_estimation_models_terms_over_an_hour() {
    if !has_compiler("effects_compiled_are_the_estimation_models_terms_over_an_hour") {
        return;
    }
    let has_statements =
        |id: &&&str| matches!(effects::description(id).map(|of| of.on_board), Some(OnBoard::Static(_)));
    let ids: Vec<&str> = CATALOGUE.iter().filter(has_statements).copied().collect();
    // One by one, so that a fault shows by its name, and together.
    let mut cases: Vec<Vec<&str>> = ids.iter().map(|id| vec![*id]).collect();
    cases.push(ids.clone());
    for ids in cases {
        let robot = with_effects(&ids);
        assert_eq!(robot.effects.len(), ids.len());
        let (off, off_covariance) = differences(&robot, 32, None);
        assert!(off < TOLERANCE && off_covariance < TOLERANCE, "{ids:?}: {off} {off_covariance}");
        if let [id] = ids[..] {
            let (off, _) = differences(&robot, 32, Some(0.5));
            assert!(off > 1e3 * TOLERANCE, "{id}: half of it differs by {off} only");
        }
    }
}

#[test]
fn what_needs_more_than_an_interval_is_named() {
    let text = include_str!("../../../scenarios/motion-capture.toml");
    let mut scenario = Scenario::parse(text, "motion-capture.toml").expect("a scenario");
    let effect = |toml: &str| toml::from_str::<Effect>(toml).expect("an effect");
    scenario.effects = vec![
        effect("kind = \"wheel_scale\"\nscale = 1.01"),
        effect("kind = \"wheel_eccentricity\"\nright_amplitude = 0.01\nright_phase_rad = 1.0"),
        effect("kind = \"slip_speed\"\nslip_s_m = 0.01"),
        effect("kind = \"truth_latency\"\ndelay_s = 0.01"),
    ];
    let model = ExtendedModel::of(&scenario).expect("a model");
    let robot = CalibratedRobot::of_model("extended.toml", &scenario, &model, None).expect("has all");
    let ids = |has_static| robot.left_out(has_static).map(|effect| effect.id).collect::<Vec<_>>();
    assert_eq!(ids(true), ["wheel_eccentricity"]);
    assert_eq!(ids(false), ["wheel_eccentricity", "slip_speed"]);
    let render = |name: &str| (exporter(name).expect("a format").render)(&robot, &Options::default()).expect("has all");
    assert!(render("c").contains("Left out: wheel_eccentricity ("));
    assert!(render("c").contains("{ /* slip_speed: ") && !render("c").contains("Left out: slip_speed"));
    for name in ["ros2-yaml", "turtlebot3", "linorobot2", "wpilib", "roadrunner", "mm"] {
        assert!(render(name).contains("Left out: slip_speed ("), "{name}");
        assert!(!render(name).contains("truth_latency"), "{name}");
    }
}

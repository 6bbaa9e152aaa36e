//! The C header, compiled and driven over an hour of counts, against the same arithmetic in Rust: every
//! effect that runs on board by itself, with what it must be told and without, and all together.
//!
//! Seen to be rejected: half of an effect's size (1e-6 m and more) and the midpoint rule for exact arcs (1e-4
//! m).

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use calib::{MethodReport, OdometryNoise, ReportedValue};
use diagnose::ExtendedModel;
use effects::{CATALOGUE, Effect, OnBoard, Variant, effect_from_estimates};
use export::format::exporter;
use export::{CalibratedRobot, OnBoardInputs, OnBoardOdometry, Options};
use kinematics::Wheels;
use scenario::{Estimated, EstimatedTerm, Scenario};

/// An hour at 50 Hz.
const STEPS: usize = 180_000;
const DT_S: f64 = 0.02;
/// Every so many steps the pose and its covariance are compared.
const COMPARED: usize = 500;

/// Prints the pose and its covariance after each hundredth interval.
const PROGRAM: &str = r#"#include <stdio.h>
#include <string.h>
#include "odometry.h"

typedef struct {
    int64_t left, right, known;
    double dt_s, left_wheel_rad, right_wheel_rad, room_heading_rad, payload_kg, session_s, session_m;
} record_t;

int main(int argc, char **argv) {
    yair_odometry_t s;
    record_t r;
    long n = 0;
    FILE *log = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (!log || fread(&r, sizeof r, 1, log) != 1) return 1;
    memset(&s, 0x55, sizeof s); /* init must set all that is read */
    yair_odometry_init(&s, (yair_count_t)r.left, (yair_count_t)r.right, 0.0, 0.0, 0.0);
    while (fread(&r, sizeof r, 1, log) == 1) {
#if defined(YAIR_PAYLOAD) && defined(TOLD)
        yair_inputs_t in = {0};
        in.known = (unsigned)r.known;
        in.left_wheel_rad = r.left_wheel_rad;
        in.right_wheel_rad = r.right_wheel_rad;
        in.room_heading_rad = r.room_heading_rad;
        in.payload_kg = r.payload_kg;
        in.session_s = r.session_s;
        in.session_m = r.session_m;
        yair_odometry_step_with(&s, (yair_count_t)r.left, (yair_count_t)r.right, r.dt_s, &in);
#else
        yair_odometry_step(&s, (yair_count_t)r.left, (yair_count_t)r.right, r.dt_s);
#endif
        if (++n % 500 == 0) {
            printf("%.17g %.17g %.17g", s.x_m, s.y_m, s.theta_rad);
#ifdef YAIR_WHEEL_SIGMA
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) printf(" %.17g", s.covariance[i][j]);
#endif
            printf("\n");
        }
    }
    fclose(log);
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

/// What a controller reads in an interval, and what it is told.
struct Record {
    counts: Wheels<i64>,
    dt_s: f64,
    logged: OnBoardInputs,
}

/// A robot that drives ahead and back, in bends and on the spot, creeps and stands at times; its counters
/// wrap at 16 bits, rows come a little early or late, and at times it is told what it cannot count.
fn log() -> &'static [Record] {
    static LOG: OnceLock<Vec<Record>> = OnceLock::new();
    LOG.get_or_init(|| {
        let mut angle = Wheels::both(0.0);
        let record = |step: usize| {
            let t_s = step as f64 * DT_S;
            let stands = (t_s / 20.0).sin() > 0.9;
            let creeps = if (t_s / 47.0).sin() > 0.8 { 0.05 } else { 1.0 };
            let (v, w) = (0.4 * (t_s / 7.0).sin() + 0.1, 0.8 * (t_s / 3.0).cos());
            let speed = if stands { Wheels::both(0.0) } else { Wheels { left: v - 0.2 * w, right: v + 0.2 * w } };
            angle = angle.zip_with(speed, |angle, speed| angle + creeps * 1.6e4 * speed * DT_S);
            // A row in a hundred without an interval's length, and one in a thousand after a pause.
            let dt_s = match step {
                _ if step % 100 == 7 => 0.0,
                _ if step % 1000 == 13 => 0.5,
                _ => DT_S * (1.0 + 0.1 * ((step * step) as f64).sin()),
            };
            let at = |every: usize, value: f64| (step % every == every / 20).then_some(value);
            let rad = angle.map(|counts: f64| counts.round() * std::f64::consts::TAU / 8192.0);
            let logged = OnBoardInputs {
                wheel_rad: Wheels { left: at(3000, rad.left + 1.0), right: at(5000, rad.right - 2.0) },
                room_heading_rad: at(2000, 0.3 * t_s.sin()),
                payload_kg: at(20_000, 3.0 + (step / 20_000) as f64),
                session_s: at(50_000, t_s + 100.0),
                session_m: at(50_000, 0.2 * t_s + 1e4),
            };
            Record { counts: angle.map(|counts: f64| (counts.round() as i64 - 17) & 0xffff), dt_s, logged }
        };
        (0..=STEPS).map(record).collect()
    })
}

/// A folder with the log as the program reads it.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("compiled_header_{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("made");
        let mut bytes = Vec::with_capacity(log().len() * 80);
        for Record { counts, dt_s, logged } in log() {
            let OnBoardInputs { wheel_rad, room_heading_rad, payload_kg, session_s, session_m } = *logged;
            let values = [wheel_rad.left, wheel_rad.right, room_heading_rad, payload_kg, session_s, session_m];
            let known = values.iter().enumerate().map(|(bit, value)| i64::from(value.is_some()) << bit).sum::<i64>();
            [counts.left, counts.right, known].iter().for_each(|of| bytes.extend(of.to_ne_bytes()));
            bytes.extend(dt_s.to_ne_bytes());
            values.iter().for_each(|value| bytes.extend(value.unwrap_or(0.0).to_ne_bytes()));
        }
        std::fs::write(folder.join("log"), bytes).expect("written");
        std::fs::write(folder.join("main.c"), PROGRAM).expect("written");
        folder
    })
}

/// What the compiled header prints for the log.
fn compiled(header: &str, name: &str, is_logged: bool) -> Vec<Vec<f64>> {
    let own = folder().join(name);
    std::fs::create_dir_all(&own).expect("made");
    std::fs::write(own.join("odometry.h"), header).expect("written");
    let mut gcc = Command::new("gcc");
    gcc.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-I."]);
    if is_logged {
        gcc.arg("-DTOLD");
    }
    let compiler = gcc.args(["../main.c", "-lm", "-o", "main"]).current_dir(&own).output().expect("gcc runs");
    assert!(compiler.status.success(), "{}\n{header}", String::from_utf8_lossy(&compiler.stderr));
    let output = Command::new("./main").arg("../log").current_dir(&own).output().expect("runs");
    assert!(output.status.success(), "{name}");
    let number = |word: &str| word.parse::<f64>().expect("a number");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(|line| line.split(' ').map(number).collect()).collect()
}

/// What the same arithmetic gives in Rust.
fn in_rust(robot: &CalibratedRobot, is_logged: bool) -> Vec<Vec<f64>> {
    let mut odometry = OnBoardOdometry::new(robot, Some(16), log()[0].counts).expect("a drive");
    let mut rows = Vec::new();
    for (step, Record { counts, dt_s, logged }) in log().iter().enumerate().skip(1) {
        let nothing = OnBoardInputs::default();
        odometry.step_with(*counts, *dt_s, if is_logged { logged } else { &nothing });
        if step % COMPARED == 0 {
            let pose = odometry.pose();
            let mut row = vec![pose.x_m, pose.y_m, pose.theta_rad];
            row.extend(odometry.covariance().into_iter().flat_map(|matrix| matrix.iter().copied()));
            rows.push(row);
        }
    }
    rows
}

/// Largest difference of positions (m) and headings (rad), and of the covariance over standard deviations.
fn differences(found: &[Vec<f64>], expected: &[Vec<f64>]) -> (f64, f64) {
    assert_eq!((found.len(), expected.len()), (STEPS / COMPARED, STEPS / COMPARED));
    let (mut off, mut off_covariance) = (0.0_f64, 0.0_f64);
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found[..3].iter().zip(&expected[..3]) {
            // Numbers that are none would be larger than nothing.
            assert!(found.is_finite() && expected.is_finite());
            off = off.max((found - expected).abs());
        }
        for place in 3..found.len() {
            let (i, j) = ((place - 3) / 3, (place - 3) % 3);
            let size = (expected[3 + 4 * i] * expected[3 + 4 * j]).sqrt();
            off_covariance = off_covariance.max((found[place] - expected[place]).abs() / size);
        }
    }
    (off, off_covariance)
}

fn header(robot: &CalibratedRobot) -> String {
    let options = Options { counter_bits: Some(16), ..Options::default() };
    (exporter("c").expect("a format").render)(robot, &options).expect("has all")
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
        remarks: Vec::new(),
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

/// Sizes of effects that have no mean.
const WITHOUT_MEAN: [(&str, &[(&str, f64)]); 8] = [
    ("swapped_wheels", &[("swapped", 1.0)]),
    ("reversed_wheel", &[("left", 0.0), ("right", 1.0)]),
    ("wrong_counts_per_turn", &[("factor", 1.25)]),
    ("time_unit", &[("factor", 1.25)]),
    ("counter_wrap", &[("bits", 16.0)]),
    ("quantization", &[("counts_per_tick", 2.0)]),
    ("contact_patch_wheelbase", &[("sigma_m", 2e-3), ("slow_sigma_m", 1e-3), ("slow_length_m", 0.2)]),
    ("bumps", &[("per_m", 0.5), ("height_m", 2e-3)]),
];

/// Sizes of an effect, drawn: of its mean terms from a third of what is plausible on, and of what is held one
/// of the lower half of the values that are tried: this robot is slower than the hinges of fast ones.
fn drawn(id: &str, scale: f64) -> Vec<(String, f64)> {
    if let Some((_, sizes)) = WITHOUT_MEAN.iter().find(|(of, _)| *of == id) {
        return sizes.iter().map(|(name, size)| ((*name).to_owned(), *size)).collect();
    }
    let mut state = id.bytes().fold(7_u64, |state, byte| state.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let variants = effects::hypothesis(id).and_then(effects::Hypothesis::into_variants).expect("a mean");
    let number = (uniform() * variants.len().div_ceil(2) as f64) as usize;
    let Variant { fixed, term, .. } = &variants[number];
    let sizes =
        term.parameters().iter().map(|of| (of.name.to_owned(), scale * (0.3 + 0.7 * uniform()) * of.prior_sigma));
    let sizes: Vec<(String, f64)> = sizes.collect();
    sizes.into_iter().chain(fixed.iter().map(|(name, value)| ((*name).to_owned(), *value))).collect()
}

/// A robot with effects.
fn with_effects(ids: &[&str], scale: f64) -> CalibratedRobot {
    let text = scenario::MOTION_CAPTURE;
    let mut scenario = Scenario::parse(text, "motion-capture.toml").expect("a scenario");
    scenario.effects.clear();
    let mut terms = Vec::new();
    for id in ids {
        let sizes = drawn(id, scale);
        let named: Vec<(&str, f64)> = sizes.iter().map(|(name, size)| (&name[..], *size)).collect();
        scenario.effects.push(effect_from_estimates(id, &named).expect("physical"));
        if effects::description(id).expect("known").on_board.has_mean() {
            terms.push(EstimatedTerm { kind: (*id).to_owned(), values: sizes.into_iter().collect() });
        }
    }
    effects::sort_by_stage(&mut scenario.effects);
    scenario.estimated =
        Some(Estimated { sensor_x_m: 0.0, sensor_y_m: 0.0, sensor_theta_rad: 0.0, latency_s: 0.0, terms });
    let model = ExtendedModel::of(&scenario).expect("a model");
    let mut robot = CalibratedRobot::of_model("extended.toml", &scenario, &model, None).expect("has all");
    // The log's.
    robot.ticks_per_rev = robot.ticks_per_rev.map(|_| 8192.0);
    robot
}

/// Sums of 180,000 doubles of up to tens of metres by two libraries' sines: seen are 5e-13 m, and of all
/// effects together 2.3e-13 of a covariance. A nanometre is below any count.
const TOLERANCE: f64 = 1e-9;

/// Effects that a program on board has something of.
fn on_board(is: fn(OnBoard) -> bool) -> Vec<&'static str> {
    let has_it = |id: &&&str| effects::description(id).is_some_and(|of| is(of.on_board));
    CATALOGUE.iter().filter(has_it).copied().collect()
}

#[test]
fn a_plain_calibration_compiled_is_the_same_over_an_hour() {
    if !has_compiler("a_plain_calibration_compiled_is_the_same_over_an_hour") {
        return;
    }
    let noise = OdometryNoise { wheel_sigma_m_per_sqrt_m: 1e-3, turn_sigma_rad_per_sqrt_rad: 4e-3, is_assumed: false };
    for (noise, name) in [(Some(noise), "noise"), (None, "no_noise")] {
        let robot = plain(noise);
        let (off, off_covariance) = differences(&compiled(&header(&robot), name, false), &in_rust(&robot, false));
        assert!(off < TOLERANCE && off_covariance < TOLERANCE, "{off} {off_covariance}");
    }
}

/// One by one, so that a fault shows by its name.
#[test]
fn every_effect_compiled_is_the_estimation_models_term_over_an_hour() {
    if !has_compiler("every_effect_compiled_is_the_estimation_models_term_over_an_hour") {
        return;
    }
    let without = in_rust(&with_effects(&[], 1.0), true);
    for id in on_board(|of| of.code().is_some()) {
        let robot = with_effects(&[id], 1.0);
        assert_eq!(robot.effects.len(), 1);
        let found = compiled(&header(&robot), id, true);
        let (off, off_covariance) = differences(&found, &in_rust(&robot, true));
        assert!(off < TOLERANCE && off_covariance < TOLERANCE, "{id}: {off} {off_covariance}");
        let (of_none, of_no_scatter) = differences(&found, &without);
        match effects::description(id).expect("known").on_board {
            OnBoard::CovarianceOnly(_) => {
                assert!(id == "quantization" || of_none < TOLERANCE, "{id}: it has a mean of {of_none} m");
                assert!(of_no_scatter > 1e3 * TOLERANCE, "{id}: it scatters {of_no_scatter} only");
            }
            // A unit of time is in no travel, and the width of the counters is that of the log.
            OnBoard::Constant(_) if ["time_unit", "counter_wrap"].contains(&id) => assert!(of_none < TOLERANCE),
            OnBoard::Constant(_) => assert!(of_none > 1e3 * TOLERANCE, "{id}: {of_none}"),
            _ => {
                let (of_half, _) = differences(&found, &in_rust(&with_effects(&[id], 0.5), true));
                assert!(of_half > 1e3 * TOLERANCE, "{id}: half of it differs by {of_half} only");
            }
        }
    }
}

#[test]
fn effects_that_are_told_nothing_are_off() {
    if !has_compiler("effects_that_are_told_nothing_are_off") {
        return;
    }
    let ids = on_board(|of| of.input().is_some());
    assert_eq!(ids.len(), 7);
    let robot = with_effects(&ids, 1.0);
    let found = compiled(&header(&robot), "untold", false);
    let (off, off_covariance) = differences(&found, &in_rust(&robot, false));
    assert!(off < TOLERANCE && off_covariance < TOLERANCE, "{off} {off_covariance}");
    let (off, _) = differences(&found, &in_rust(&with_effects(&[], 1.0), false));
    assert!(off < TOLERANCE, "untold they move the robot by {off} m");
    let (off, _) = differences(&found, &in_rust(&robot, true));
    assert!(off > 1e3 * TOLERANCE, "told they move it by {off} m only");
}

#[test]
fn all_effects_together_compiled_are_the_same_over_an_hour() {
    if !has_compiler("all_effects_together_compiled_are_the_same_over_an_hour") {
        return;
    }
    let robot = with_effects(&on_board(|of| of.code().is_some()), 1.0);
    for (is_logged, name) in [(true, "all"), (false, "all_untold")] {
        let found = compiled(&header(&robot), name, is_logged);
        let (off, off_covariance) = differences(&found, &in_rust(&robot, is_logged));
        assert!(off < TOLERANCE && off_covariance < TOLERANCE, "{name}: {off} {off_covariance}");
    }
}

/// `cargo test --release -p export --test compiled_header -- --ignored --nocapture` prints the table of
/// docs/export.md.
#[test]
#[ignore = "it measures time"]
fn cost_of_a_step() {
    let mut cases: Vec<(&str, Vec<&str>)> = vec![("no effect", Vec::new())];
    let ids = on_board(|of| of.code().is_some());
    cases.extend(ids.iter().map(|id| (*id, vec![*id])));
    cases.push(("all together", ids.clone()));
    let timer = PROGRAM.replace("int main(", "#include <time.h>\nstatic record_t all[180001];\nint main(");
    let (start, _) = timer.split_once("    yair_odometry_t s;").expect("the program");
    let program = format!(
        "{start}    yair_odometry_t s;
    FILE *log = argc > 1 ? fopen(argv[1], \"rb\") : NULL;
    if (!log || fread(all, sizeof all[0], 180001, log) != 180001) return 1;
    yair_odometry_init(&s, (yair_count_t)all[0].left, (yair_count_t)all[0].right, 0.0, 0.0, 0.0);
    const clock_t from = clock();
    for (long n = 1; n < 180001; n++) {{
        const record_t r = all[n];
#ifdef YAIR_PAYLOAD
        const yair_inputs_t in = {{(unsigned)r.known, r.left_wheel_rad, r.right_wheel_rad, r.room_heading_rad,
                                  r.payload_kg, r.session_s, r.session_m}};
        yair_odometry_step_with(&s, (yair_count_t)r.left, (yair_count_t)r.right, r.dt_s, &in);
#else
        yair_odometry_step(&s, (yair_count_t)r.left, (yair_count_t)r.right, r.dt_s);
#endif
    }}
    printf(\"%g %zu %g\\n\", 1e9 * (double)(clock() - from) / CLOCKS_PER_SEC / 180000.0, sizeof s, s.x_m);
    return 0;
}}
"
    );
    let mut out = std::io::stderr();
    let _ = writeln!(out, "{:<24} {:>8} {:>8} {:>8}", "effect", "C ns", "Rust ns", "C bytes");
    for (name, ids) in cases {
        let robot = with_effects(&ids, 1.0);
        let own = folder().join(format!("cost_{}", name.replace(' ', "_")));
        std::fs::create_dir_all(&own).expect("made");
        std::fs::write(own.join("odometry.h"), header(&robot)).expect("written");
        std::fs::write(own.join("cost.c"), &program).expect("written");
        let mut gcc = Command::new("gcc");
        gcc.args(["-std=c99", "-O2", "cost.c", "-lm", "-o", "cost"]);
        assert!(gcc.current_dir(&own).status().expect("gcc runs").success());
        let output = Command::new("./cost").arg("../log").current_dir(&own).output().expect("runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let found: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let from = std::time::Instant::now();
        let rows = in_rust(&robot, true);
        let rust_ns = from.elapsed().as_nanos() as f64 / STEPS as f64;
        assert_eq!(rows.len(), STEPS / COMPARED);
        let _ = writeln!(out, "{name:<24} {:>8.0} {rust_ns:>8.0} {:>8.0}", found[0], found[1]);
    }
}

#[test]
fn what_cannot_run_on_board_is_named_with_its_reason() {
    let text = scenario::MOTION_CAPTURE;
    let mut scenario = Scenario::parse(text, "motion-capture.toml").expect("a scenario");
    let effect = |toml: &str| toml::from_str::<Effect>(toml).expect("an effect");
    scenario.effects = vec![
        effect("kind = \"wheel_scale\"\nscale = 1.01"),
        effect("kind = \"wheel_eccentricity\"\nright_amplitude = 0.01\nright_phase_rad = 1.0"),
        effect("kind = \"slip_speed\"\nslip_s_m = 0.01"),
        effect("kind = \"quantization\"\ncounts_per_tick = 80"),
        effect("kind = \"dropped_samples\"\nprobability = 0.01"),
        effect("kind = \"truth_latency\"\ndelay_s = 0.01"),
    ];
    let model = ExtendedModel::of(&scenario).expect("a model");
    let robot = CalibratedRobot::of_model("extended.toml", &scenario, &model, None).expect("has all");
    let ids = |runs_effects| robot.left_out(runs_effects).map(|effect| effect.id).collect::<Vec<_>>();
    assert_eq!(ids(true), ["dropped_samples", "truth_latency"]);
    assert_eq!(ids(false), ["wheel_eccentricity", "slip_speed", "dropped_samples"]);
    let render = |name: &str| (exporter(name).expect("a format").render)(&robot, &Options::default()).expect("has all");
    // Lines are wrapped.
    let c = render("c").replace("\n *", "").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(c.contains("Left out: dropped_samples (") && c.contains("later readings"), "{c}");
    assert!(c.contains("Left out: truth_latency (") && c.contains("none of the robot."), "{c}");
    assert!(c.contains("{ /* slip_speed: ") && !c.contains("Left out: slip_speed"), "{c}");
    for name in ["ros2-yaml", "turtlebot3", "linorobot2", "wpilib", "roadrunner", "mm"] {
        assert!(render(name).contains("Left out: slip_speed ("), "{name}");
        assert!(!render(name).contains("truth_latency") && !render(name).contains("quantization"), "{name}");
    }
    // A tick is 80 counts of the controller.
    assert_eq!(robot.ticks_per_rev, scenario.robot.nominal().ticks_per_rev.map(|counts| counts / 80.0));
}

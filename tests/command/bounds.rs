//! Numbers of runs, rows, schemas and channels that nobody means: what grows with their square would take
//! minutes here, and is ended by the system after so many seconds of the processor.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::refusal;

/// Processor seconds of a command, ten times what the longest takes.
const MAX_SECONDS: u32 = 30;

const ROBOT: &str = "--wheel 0.15 --base 0.3 --quiet";
const COUNTS: &str = "--ticks-per-rev 4096 --time-unit s --angle-unit rad";

/// Runs a command within its seconds.
#[track_caller]
fn within_bounds(here: &Path, line: &str) {
    let script = format!("ulimit -t {MAX_SECONDS}; exec \"$0\" {line}");
    let output = Command::new("sh")
        .args(["-c", &script, env!("CARGO_BIN_EXE_yair")])
        .current_dir(here)
        .output()
        .expect("a shell");
    assert!(output.status.success(), "{line}: {} {}", output.status, String::from_utf8_lossy(&output.stderr));
}

#[test]
fn twenty_thousand_runs_take_seconds() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let mut table = "run,t,left_ticks,right_ticks,x,y,theta\n".to_owned();
    for run in 0..20_000_u32 {
        for row in 0..3 {
            let (t_s, ticks, x_m) = (0.5 * f64::from(row), 400 * row, 0.046 * f64::from(row));
            writeln!(table, "r{run},{t_s},{ticks},{ticks},{x_m:.4},0,0").expect("a text");
        }
    }
    fs::write(here.join("runs.csv"), table).expect("written");
    within_bounds(here, &format!("import csv runs.csv --out set {ROBOT} {COUNTS}"));
    for command in ["check set", "evaluate set", "export tum set --out poses"] {
        within_bounds(here, &format!("{command} --quiet"));
    }
    assert_eq!(here.join("poses").read_dir().expect("a folder").count(), 20_000);
}

/// A million rows: a run every 25 rows by standing still between, seen in the same file and in another.
#[test]
fn a_million_rows_cut_into_runs_take_seconds() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let (mut odometry, mut truth) = ("t,left_ticks,right_ticks\n".to_owned(), "t,x,y,theta\n".to_owned());
    let mut both = "t,left_ticks,right_ticks,x,y,theta\n".to_owned();
    for row in 0..1_000_000_u32 {
        // Twenty rows of motion, and five seconds in which nothing is recorded.
        let (t_s, ticks) = (0.1 * f64::from(row) + 5.0 * f64::from(row / 25), 40 * row);
        let x_m = 0.0046 * f64::from(row);
        writeln!(odometry, "{t_s:.1},{ticks},{ticks}").expect("a text");
        writeln!(truth, "{t_s:.1},{x_m:.4},0,0").expect("a text");
        writeln!(both, "{t_s:.1},{ticks},{ticks},{x_m:.4},0,0").expect("a text");
    }
    for (name, text) in [("odometry.csv", odometry), ("truth.csv", truth), ("both.csv", both)] {
        fs::write(here.join(name), text).expect("written");
    }
    for (out, files) in [("one", "both.csv"), ("two", "odometry.csv truth.csv")] {
        within_bounds(here, &format!("import csv {files} --cut 2 --out {out} {ROBOT} {COUNTS}"));
        let manifest = fs::read_to_string(here.join(out).join("dataset.toml")).expect("there");
        assert_eq!(manifest.matches("[[run]]").count(), 40_000, "{files}");
    }
}

/// A bag of MCAP by hand: schemas, and channels with a message each.
fn bag(schemas: u32, channels: u16) -> Vec<u8> {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let text = |of: &str| [&(of.len() as u32).to_le_bytes()[..], of.as_bytes()].concat();
    let mut bytes = MAGIC.to_vec();
    let mut record = |kind: u8, body: Vec<u8>| {
        bytes.push(kind);
        bytes.extend((body.len() as u64).to_le_bytes());
        bytes.extend(body);
    };
    record(1, [text("ros2"), text("")].concat());
    for schema in 1..=schemas {
        let id = ((schema - 1) % 65_535 + 1) as u16;
        let body = [text(&format!("a/msg/T{schema}")), text("ros2msg"), text(&format!("float64 x{schema}\n"))];
        record(3, [&id.to_le_bytes()[..], &body.concat()].concat());
    }
    for channel in 0..channels {
        let schema = u32::from(channel) % schemas.min(65_535) + 1;
        let ids = [channel.to_le_bytes(), (schema as u16).to_le_bytes()].concat();
        record(4, [ids, text(&format!("/t{channel}")), text("cdr"), vec![0; 4]].concat());
        let stamps = [&[0; 4][..], &u64::from(channel).to_le_bytes(), &u64::from(channel).to_le_bytes()].concat();
        record(5, [&channel.to_le_bytes()[..], &stamps, &[0, 1, 0, 0], &1.0_f64.to_le_bytes()].concat());
    }
    record(15, vec![0; 4]);
    record(2, vec![0; 20]);
    bytes.extend(MAGIC);
    bytes
}

#[test]
fn sixty_five_thousand_channels_and_two_hundred_thousand_schemas_take_seconds() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    for (name, schemas, channels) in [("schemas", 200_000, 1), ("channels", 1, 65_000), ("both", 65_000, 65_000)] {
        fs::write(here.join(format!("{name}.mcap")), bag(schemas, channels)).expect("written");
        within_bounds(here, &format!("import ros2 {name}.mcap --list"));
    }
}

/// Runs whose number is the largest of 15 bits, read at their ends.
#[test]
fn a_scenario_of_very_many_runs_takes_seconds_and_too_many_are_refused() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/paper.toml")).expect("there");
    fs::write(here.join("many.toml"), text.replace("runs = 30\n", "runs = 32767\n")).expect("written");
    within_bounds(here, "simulate many.toml --out many --quiet");
    within_bounds(here, "check many --quiet");
    let refused = refusal(here, &["diagnose", "many", "--quiet"]);
    assert!(refused.contains("at most 10000"), "{refused}");
    fs::write(here.join("more.toml"), text.replace("runs = 30\n", "runs = 100000\n")).expect("written");
    let refused = refusal(here, &["simulate", "more.toml", "--out", "more"]);
    assert!(refused.contains("100000"), "{refused}");
}

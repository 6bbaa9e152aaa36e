//! What input can never do, whatever it says: cost memory or time without bound, lead out of its folder, or
//! mean more than text where it is printed. docs/reliability.md lists these promises; limits that need no
//! command are tested beside the readers.

use std::fs;
use std::path::Path;

use crate::support::{Ended, refusal, run_in, succeed};

/// Nesting that would end a recursive parser's stack.
const DEEP: usize = 200_000;

fn write(at: &Path, file: &str, text: impl AsRef<[u8]>) {
    let path = at.join(file);
    fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    fs::write(path, text).expect("written");
}

const ROBOT: &str = "[robot]\nleft_wheel_diameter_m = 0.15\nright_wheel_diameter_m = 0.15\nwheel_separation_m = 0.3\nticks_per_rev = 4096.0\n";

/// A dataset that can be calibrated, with a name and the ids of two runs.
fn dataset(at: &Path, folder: &str, name: &str, ids: [&str; 2]) {
    let quoted = |text: &str| serde_json::to_string(text).expect("JSON");
    let cell = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let runs: String = ids.iter().map(|id| format!("[[run]]\nid = {}\n", quoted(id))).collect();
    write(at, &format!("{folder}/dataset.toml"), format!("format = 1\nname = {}\n{ROBOT}{runs}", quoted(name)));
    let (mut odometry, mut truth) =
        ("run,t_s,left_ticks,right_ticks\n".to_owned(), "run,t_s,x_m,y_m,theta_rad\n".to_owned());
    // A quarter of a metre straight on, then about a radian on the spot; counts are rounded as wheels do it.
    let per_m = 4096.0 / (std::f64::consts::PI * 0.15);
    for (id, sense) in ids.iter().zip([1.0, -1.0]) {
        for step in 0..=40_i32 {
            let t_s = 0.1 * f64::from(step);
            let (s_m, turn_rad) = (0.0125 * f64::from(step.min(20)), sense * 0.05 * f64::from((step - 20).max(0)));
            let [left, right] = [-1.0, 1.0].map(|side| (per_m * (s_m + side * 0.15 * turn_rad)).round());
            odometry += &format!("{},{t_s:.1},{left},{right}\n", cell(id));
            truth += &format!("{},{t_s:.1},{s_m:.6},0,{turn_rad:.6}\n", cell(id));
        }
    }
    write(at, &format!("{folder}/odometry.csv"), odometry);
    write(at, &format!("{folder}/truth.csv"), truth);
}

#[test]
fn nesting_ends_no_parser() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    for (number, text) in [
        "a = ".to_owned() + &"[".repeat(DEEP),
        "a = ".to_owned() + &"{a=".repeat(DEEP),
        format!("[a{}]", ".a".repeat(DEEP)),
    ]
    .iter()
    .enumerate()
    {
        write(at, &format!("{number}.toml"), text);
        write(at, &format!("set{number}/dataset.toml"), text);
        refusal(at, &["simulate", &format!("{number}.toml"), "--out", "out"]);
        refusal(at, &["calibrate", &format!("set{number}")]);
        refusal(at, &["export", "ros2-yaml", &format!("{number}.toml")]);
    }
    write(at, "deep.tuple", "[".repeat(DEEP));
    refusal(at, &["import", "censi", "deep.tuple", "--out", "out"]);
    write(at, "deep/metadata.yaml", "[".repeat(DEEP));
    refusal(at, &["import", "ros2", "deep", "--list"]);
    for json in ["[".repeat(DEEP), "{\"a\":".repeat(DEEP)] {
        write(at, "shard/sweep.state.json", json);
        refusal(at, &["merge", "shard", "--out", "out"]);
    }
}

#[test]
fn more_runs_than_a_manifest_holds_are_refused() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let runs: String = (0..300_000).map(|run| format!("[[run]]\nid=\"{run}\"\n")).collect();
    write(temp.path(), "set/dataset.toml", format!("format = 1\n{ROBOT}{runs}"));
    let message = refusal(temp.path(), &["calibrate", "set"]);
    assert!(message.contains("dataset.toml: longer than 4194304 bytes"), "{message}");
}

#[test]
fn a_file_beyond_its_limit_is_refused_before_it_is_read() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    // Holes: the files take no room on the disk.
    let long = |name: &str, bytes: u64| {
        write(at, name, "");
        fs::File::options().write(true).open(at.join(name)).and_then(|file| file.set_len(bytes)).expect("made longer");
    };
    long("log.csv", (1 << 30) + 1);
    long("scenario.toml", (1 << 20) + 1);
    long("shard/sweep.state.json", (1 << 30) + 1);
    long("bag/metadata.yaml", (16 << 20) + 1);
    for (arguments, expected) in [
        (&["import", "csv", "log.csv", "--out", "out", "--wheel", "0.15", "--base", "0.3"][..], "1073741824 bytes"),
        (&["simulate", "scenario.toml", "--out", "out"], "at most 1048576 bytes"),
        (&["merge", "shard", "--out", "out"], "longer than 1073741824 bytes"),
        (&["import", "ros2", "bag", "--list"], "longer than 16 MiB"),
    ] {
        let message = refusal(at, arguments);
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
    assert!(!at.join("out").exists());
}

#[test]
fn a_count_that_no_counter_reaches_is_refused() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    dataset(at, "set", "set", ["a", "b"]);
    let rows = fs::read_to_string(at.join("set/odometry.csv")).expect("read");
    // Of the last row: 2⁵⁶ is taken for a count, and for a spike of the counter.
    let with = |count: u64| {
        let (head, _) = rows.trim_end().rsplit_once(',').expect("columns");
        write(at, "set/odometry.csv", format!("{head},{count}\n"));
    };
    with((1 << 56) + 1);
    let message = refusal(at, &["check", "set"]);
    assert!(message.contains("odometry.csv") && message.contains("72057594037927937"), "{message}");
    with(1 << 56);
    let message = run_in(at, &["check", "set"]).stderr;
    assert!(!message.contains("72057594037927936"), "{message}");
}

#[cfg(unix)]
#[test]
fn links_lead_nowhere_else() {
    use std::os::unix::fs::symlink;
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    dataset(at, "set", "plain", ["a", "b"]);
    fs::rename(at.join("set/truth.csv"), at.join("elsewhere.csv")).expect("moved");
    symlink("../elsewhere.csv", at.join("set/truth.csv")).expect("a link");
    for command in ["calibrate", "evaluate", "check", "diagnose"] {
        let message = refusal(at, &[command, "set"]);
        assert!(message.contains("truth.csv: a link to ") && message.contains("outside of the dataset"), "{message}");
    }
    fs::remove_file(at.join("set/truth.csv")).expect("removed");
    fs::rename(at.join("elsewhere.csv"), at.join("set/measured.csv")).expect("moved");
    symlink("measured.csv", at.join("set/truth.csv")).expect("a link");
    succeed(at, &["calibrate", "set", "--out", "found.toml"]);
    // Into a folder of results through a link of it.
    fs::create_dir_all(at.join("results")).expect("made");
    fs::create_dir(at.join("private")).expect("made");
    symlink("../private", at.join("results/sessions")).expect("a link");
    let message = refusal(at, &["fleet", "set", "--out", "results"]);
    assert!(message.contains("is a link"), "{message}");
    assert_eq!(at.join("private").read_dir().expect("readable").count(), 0);
}

#[test]
fn force_deletes_a_dataset_and_nothing_else() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    dataset(at, "old", "plain", ["a", "b"]);
    write(
        at,
        "log.csv",
        "t_s,x_m,y_m,theta_rad,left_ticks,right_ticks\n0,0,0,0,0,0\n1,1,0,0,9000,9000\n2,2,0,0,18000,18000\n",
    );
    let import = [
        "import",
        "csv",
        "log.csv",
        "--out",
        "old",
        "--wheel",
        "0.15",
        "--base",
        "0.3",
        "--ticks-per-rev",
        "4096",
        "--length-unit",
        "m",
        "--force",
    ];
    // A folder that has the name of a table holds what nobody knows.
    fs::create_dir(at.join("old/wall.csv")).expect("made");
    write(at, "old/wall.csv/thesis.tex", "years of work");
    let ended = run_in(at, &import);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("holds more than a dataset"), "{}", ended.stderr);
    assert!(at.join("old/wall.csv/thesis.tex").exists() && at.join("old/truth.csv").exists());
    fs::remove_dir_all(at.join("old/wall.csv")).expect("removed");
    succeed(at, &import);
}

/// What no text of a file may be in any place where it is shown.
const HOSTILE: &str =
    "=cmd|'/C calc'!A0 \u{1b}]0;owned\u{7} \u{9b}2J <script>alert(1)</script> */ int evil; /* \u{202e} ' \" \\";

fn no_command(place: &str, text: &str) {
    let bad: Vec<char> = text
        .chars()
        .filter(|letter| {
            (letter.is_control() && !['\n', '\t'].contains(letter)) || ('\u{202a}'..='\u{202e}').contains(letter)
        })
        .collect();
    assert!(bad.is_empty(), "{place}: {bad:?} in {text}");
}

/// The places of docs/reliability.md where texts of files are shown.
fn documented_places() -> Vec<String> {
    let document = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reliability.md")).expect("read");
    let section =
        document.split("\n## ").find(|of| of.starts_with("Where texts of files are shown")).expect("a section");
    let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|row| row.split('|').nth(1).expect("a place").trim().to_owned()).collect()
}

/// HTML that nobody wrote into the page.
fn no_markup(place: &str, text: &str) {
    for markup in ["<script>alert", "<script>", "<b>", "<img"] {
        assert!(!text.contains(markup), "{place}: {markup} in {text}");
    }
}

/// A sink with the check that no text is more than text there.
type Sink<'t> = (&'t str, Box<dyn Fn(&Path) + 't>);

#[test]
fn texts_of_files_are_texts_wherever_they_are_shown() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    dataset(at, "set", HOSTILE, ["=1+1", "<b>run</b>"]);
    let manifest = fs::read_to_string(at.join("set/dataset.toml")).expect("there");
    let with_id = manifest.replace("[robot]\n", "[robot]\nid = \"=cmd|'/C calc'!A0<script>alert(2)</script>\"\n");
    // A quantity of the runs has the name that its key gives it.
    let key = "\"<img src=x>[a](b)\u{202e}`_kg\"";
    let with_key = with_id.replace("[[run]]\n", &format!("[[run]]\n{key} = 1.5\n")).replacen("= 1.5", "= 2.5", 1);
    write(at, "set/dataset.toml", with_key);
    let all = |ended: &Ended| ended.stdout.clone() + &ended.stderr;
    succeed(at, &["calibrate", "set", "--out", "found.toml"]);
    let commands: [&[&str]; 7] = [
        &["check", "set"],
        &["calibrate", "set", "--out-dir", "pages"],
        &["evaluate", "set", "--calibration", "found.toml", "--out-dir", "drift"],
        &["evaluate", "set", "--json"],
        &["fleet", "set", "--calibrate-only", "--csv", "fleet.csv", "--html", "fleet.html"],
        &["diagnose", "set", "--out", "diagnosis"],
        &["export", "tum", "set", "--out", "tum", "--force"],
    ];
    let printed: String = commands
        .iter()
        .map(|command| {
            let ended = run_in(at, command);
            assert!(!all(&ended).contains("panicked"), "{}", ended.stderr);
            all(&ended)
        })
        .collect();
    let read = |file: &str| fs::read_to_string(at.join(file)).expect("written");
    let sinks: [Sink<'_>; 5] = [
        ("terminal", Box::new(|_| no_command("terminal", &printed))),
        (
            "tables for people (`fleet --csv`)",
            Box::new(|_| {
                let mut rows = csv::Reader::from_path(at.join("fleet.csv")).expect("a table");
                for row in rows.records().map(|row| row.expect("a row")) {
                    assert!(row.iter().all(|cell| !cell.starts_with(['=', '+', '@'])), "{row:?}");
                }
            }),
        ),
        (
            "comments of C, Java and YAML; strings of YAML",
            Box::new(|at| {
                for format in ["c", "wpilib", "linorobot2"] {
                    let code = succeed(at, &["export", format, "found.toml"]).stdout;
                    no_command(format, &code);
                    assert_eq!(code.matches("/*").count(), code.matches("*/").count(), "{code}");
                    assert!(!code.contains("*/ int evil"), "{code}");
                }
                let yaml = succeed(at, &["export", "ros2-yaml", "found.toml"]).stdout;
                yaml_rust2::YamlLoader::load_from_str(&yaml).expect("YAML");
            }),
        ),
        (
            "HTML",
            Box::new(|_| {
                for page in ["pages/report.html", "drift/report.html", "fleet.html", "diagnosis/report.html"] {
                    let text = read(page);
                    assert!(!text.contains("<script>alert") && !text.contains("<b>run</b>"), "{page}");
                    let escapes = ["&lt;script&gt;", "&#60;script&#62;", "\\u003cscript"];
                    assert!(escapes.iter().any(|escape| text.contains(escape)), "{page}");
                }
            }),
        ),
        (
            "Markdown (`report.md`)",
            Box::new(|_| {
                let text = read("diagnosis/report.md");
                no_command("report.md", &text);
                no_markup("report.md", &text);
                let title = text.lines().next().expect("a title");
                assert!(title.contains("&lt;script&gt;alert(1)&lt;/script&gt;"), "{title}");
                assert!(title.contains("\\\\u{202e}") && title.contains("\\|"), "{title}");
            }),
        ),
    ];
    assert_eq!(documented_places(), sinks.iter().map(|(place, _)| (*place).to_owned()).collect::<Vec<_>>());
    sinks.iter().for_each(|(_, holds)| holds(at));
    // The id of a run is a file's name only where it is a plain one; nothing is written otherwise.
    assert!(!at.join("tum").exists());
}

//! `yair export`: from a simulated robot to the files of its programs, what they leave out, and what is
//! refused.

use std::fs;
use std::path::Path;

use crate::support::{document, everything_in, refusal, succeed, usage};

/// A calibration file with what `joint` writes of a small robot.
pub(crate) const CALIBRATION: &str = "[[methods]]\nmethod = \"joint\"\nruns_used = 3\nconverged = true\n\
    [methods.noise]\nwheel_sigma_m_per_sqrt_m = 0.001\nturn_sigma_rad_per_sqrt_rad = 0.002\n\
    [methods.parameters]\n\
    left_wheel_diameter_m = { value = 0.202, sigma = 2e-5, ratio_to_nominal = 1.01 }\n\
    right_wheel_diameter_m = { value = 0.198, sigma = 2e-5, ratio_to_nominal = 0.99 }\n\
    wheel_separation_m = { value = 0.408, sigma = 2e-4, ratio_to_nominal = 1.02 }\n\
    left_m_per_tick = { value = 6.346017160251382e-05 }\n";

/// The robot of the calibration, as its dataset states it.
fn dataset(at: &Path, name: &str, nominal_separation_m: f64) {
    let set = at.join(name);
    fs::create_dir_all(&set).expect("made");
    let toml = format!(
        "format = 1\n[robot]\nleft_wheel_diameter_m = 0.2\nright_wheel_diameter_m = 0.2\n\
         wheel_separation_m = {nominal_separation_m}\nticks_per_rev = 10000\n[[run]]\nid = \"a\"\n[[run]]\nid = \"b\"\n"
    );
    fs::write(set.join("dataset.toml"), toml).expect("written");
    let rows = "run,t_s,left_ticks,right_ticks\na,0,0,0\na,1,100,100\nb,0,0,0\nb,1,100,300\n";
    fs::write(set.join("odometry.csv"), rows).expect("written");
    let truth = "run,t_s,x_m,y_m,theta_rad\na,0,1,2,0\na,1,1.5,2,0\nb,0,0,0,3.141592653589793\nb,1,0,0.25,\n";
    fs::write(set.join("truth.csv"), truth).expect("written");
}

/// The value of a key in a YAML or C text.
fn value(text: &str, key: &str) -> f64 {
    let found = text.lines().find_map(|line| {
        let rest = line.trim().strip_prefix("#define ").unwrap_or(line.trim()).strip_prefix(key)?;
        rest.trim_start_matches(':').split_whitespace().next()?.parse().ok()
    });
    found.unwrap_or_else(|| panic!("{key}: {text}"))
}

#[test]
fn a_calibration_gets_onto_a_robot_in_every_format() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    let printed = succeed(at, &["export", "ros2-yaml", "c.toml", "--controller", "base"]);
    assert_eq!(printed.stderr, "");
    assert!(printed.stdout.contains("\nbase:\n  ros__parameters:\n"), "{}", printed.stdout);
    // 0.4 m · 1.02; nine decimals of two factors.
    let product = |text: &str| value(text, "wheel_separation") * value(text, "wheel_separation_multiplier");
    assert!((product(&printed.stdout) - 0.408).abs() < 1e-9, "{}", printed.stdout);
    let lengths = succeed(at, &["export", "ros2-yaml", "c.toml", "--lengths"]).stdout;
    assert!((product(&lengths) - 0.408).abs() < 1e-9 && value(&lengths, "wheel_separation_multiplier") == 1.0);
    // Twice the speed is twice the variance: k² v f/2 = 6.25e-6 m²/s² at 0.25 m/s and 50 Hz.
    let twist = |text: &str| {
        let (_, list) = text.split_once("twist_covariance_diagonal: [").expect("a covariance");
        list.split(',').next().and_then(|first| first.parse::<f64>().ok()).expect("a number")
    };
    let faster = succeed(at, &["export", "ros2-yaml", "c.toml", "--speed", "0.5"]).stdout;
    assert_eq!((twist(&printed.stdout), twist(&faster)), (6.25e-6, 1.25e-5));
    // A file is what is printed, and is replaced where that is asked for.
    let to_file = |more: &[&'static str]| [&["export", "linorobot2", "c.toml", "--out", "lino.h"], more].concat();
    assert_eq!(succeed(at, &to_file(&[])).stdout, "linorobot2 in lino.h\n");
    let text = fs::read_to_string(at.join("lino.h")).expect("there");
    assert_eq!(text, succeed(at, &["export", "linorobot2", "c.toml"]).stdout);
    // Counts of a turn from diameter and travel per tick of the file.
    assert_eq!(value(&text, "COUNTS_PER_REV1"), 9900.0);
    assert!(refusal(at, &to_file(&[])).starts_with("lino.h: already exists; nothing was written"));
    assert!(refusal(at, &to_file(&["--without-effects"])).contains("give --replace"));
    succeed(at, &to_file(&["--replace"]));
    succeed(at, &to_file(&["--force"]));
    for format in
        ["c", "clearpath", "create3", "mm", "robot-localization", "urdf", "roadrunner", "turtlebot3", "wpilib"]
    {
        let found = document(at, &["export", format, "c.toml"]);
        assert_eq!(
            (&found["format"], &found["calibration"], &found["out"]),
            (&format.into(), &"joint".into(), &().into())
        );
        assert_eq!(found["text"].as_str(), Some(succeed(at, &["export", format, "c.toml"]).stdout.as_str()));
    }
    let found = document(at, &["export", "mm", "c.toml", "--out", "table.txt"]);
    assert_eq!((&found["out"], &found["text"]), (&"table.txt".into(), &().into()));
}

#[test]
fn joint_writes_what_an_export_needs() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    fs::write(at.join("s.toml"), include_str!("../../scenarios/motion-capture.toml")).expect("written");
    succeed(at, &["simulate", "s.toml", "--out", "set"]);
    let found = document(at, &["calibrate", "set", "--out", "c.toml"]);
    let noise = found["methods"][0]["noise"]["wheel_sigma_m_per_sqrt_m"].as_f64().expect("a noise");
    // The scenario has 0.5 mm/√m, beside imperfections that only show in motion: 0.67 mm/√m is found. A
    // factor of two tells a standard deviation from its variance, and metres from millimetres.
    assert!(noise > 2.5e-4 && noise < 1e-3, "{noise}");
    let text = succeed(at, &["export", "ros2-yaml", "c.toml"]).stdout;
    assert!(text.contains("twist_covariance_diagonal: ["), "{text}");
    // The scenario states 0.363 m.
    assert!((value(&text, "wheel_separation") - 0.363).abs() < 1e-9, "{text}");
    let separation_m = found["methods"][0]["parameters"]["wheel_separation_m"]["value"].as_f64().expect("a length");
    assert!((0.363 * value(&text, "wheel_separation_multiplier") - separation_m).abs() < 1e-9, "{text}");
}

#[test]
fn an_extended_model_says_what_a_format_leaves_out() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let effects = "[[effect]]\nkind = \"slip_speed\"\nslip_s_m = 0.01\n\n[[effect]]\nkind = \"dropped_samples\"\n\
                   probability = 0.01\n\n[[protocol]]";
    let model = include_str!("../../scenarios/motion-capture.toml").replacen("[[protocol]]", effects, 1);
    fs::write(at.join("extended.toml"), model).expect("written");
    let ids = |format: &str| {
        let found = document(at, &["export", format, "extended.toml", "--force"]);
        let all = found["left_out"].as_array().expect("a list").clone();
        all.iter().map(|effect| effect["id"].as_str().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let in_c = ids("c");
    assert!(in_c.contains(&"dropped_samples".to_owned()) && !in_c.contains(&"slip_speed".to_owned()), "{in_c:?}");
    let said = succeed(at, &["export", "c", "extended.toml"]).stderr;
    assert!(said.contains("later readings") && said.contains("drift: not known: it needs a dataset"), "{said}");
    assert!(ids("ros2-yaml").contains(&"slip_speed".to_owned()));
    let said = refusal(at, &["export", "ros2-yaml", "extended.toml"]);
    assert!(said.contains("slip_speed") && said.contains("calibration.toml"), "{said}");
    // To replace a file is not to leave effects out.
    assert_eq!(said, refusal(at, &["export", "ros2-yaml", "extended.toml", "--replace"]));
    succeed(at, &["export", "ros2-yaml", "extended.toml", "--force"]);
    let said = succeed(at, &["export", "ros2-yaml", "extended.toml", "--without-effects"]);
    assert!(said.stderr.contains("extended.toml: left out: slip_speed ("), "{}", said.stderr);
    assert!(said.stdout.contains("# Left out: slip_speed ("), "{}", said.stdout);
}

/// The drift by the header is that of `yair evaluate` where nothing needs rows on both sides; what cannot be
/// known says why.
#[test]
fn a_header_says_the_drift_that_is_left_on_board() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    dataset(at, "set", 0.4);
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    let found = document(at, &["export", "c", "c.toml", "--dataset", "set"]);
    let percent = |of: &str| found["drift_percent"][of].as_f64().unwrap_or_else(|| panic!("{of}: {found}"));
    let evaluated = document(at, &["evaluate", "set", "--calibration", "c.toml"]);
    let of = |number: usize| evaluated["calibrations"][number]["drift_percent"].as_f64().expect("a drift");
    assert_eq!((percent("nominal"), percent("offline")), (of(0), of(1)));
    // Headings are summed on board, and functions of the counts there.
    assert!((percent("on_board") - of(1)).abs() < 1e-9, "{found}");
    assert!(found["drift_percent"]["on_board_untold"].is_null() && found["drift_percent"].get("why_null").is_none());
    let said = succeed(at, &["export", "c", "c.toml", "--dataset", "set"]).stderr;
    assert!(said.starts_with("drift: nominal ") && said.contains(" %, on board "), "{said}");
    fs::remove_file(at.join("set/truth.csv")).expect("there");
    fs::write(at.join("set/distance.csv"), "run,t0_s,t1_s,distance_m,sigma_m\na,0,1,0.5,0.01\nb,0,1,0.5,0.01\n")
        .expect("written");
    let found = document(at, &["export", "c", "c.toml", "--dataset", "set"]);
    let why = found["drift_percent"]["why_null"].as_str().unwrap_or_default().to_owned();
    assert!(found["drift_percent"]["on_board"].is_null() && why.contains("no absolute truth"), "{found}");
}

#[test]
fn truth_and_dead_reckoning_are_trajectories_of_other_tools() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    dataset(at, "set", 0.4);
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    assert_eq!(succeed(at, &["export", "tum", "set", "--run", "a"]).stdout, "0 1 2 0 0 0 0 1\n1 1.5 2 0 0 0 0 1\n");
    let all = succeed(at, &["export", "tum", "set", "--out", "truth"]);
    assert_eq!(all.stdout, "2 runs in truth\n");
    assert!(all.stderr.contains("run \"b\": 1 positions without a heading"), "{}", all.stderr);
    assert!(at.join("truth/a.tum").is_file() && at.join("truth/b.tum").is_file());
    // The same as `yair correct` writes.
    succeed(at, &["correct", "set", "--calibration", "c.toml", "--out", "corrected"]);
    succeed(at, &["export", "tum", "set", "--calibration", "c.toml", "--out", "odometry"]);
    for run in ["a.tum", "b.tum"] {
        let of = |folder: &str| fs::read_to_string(at.join(folder).join(run)).expect("there");
        assert_eq!(of("corrected"), of("odometry"));
        assert_ne!(of("truth"), of("odometry"));
    }
    let refused = |arguments: &[&str], beginning: &str| {
        let message = refusal(at, arguments);
        assert!(message.starts_with(beginning), "{message}");
    };
    refused(&["export", "tum", "set"], "set: it has 2 runs (a, b); give --out DIR, or --run ID");
    refused(&["export", "tum", "set", "--run", "z"], "set: it has no run \"z\"; it has a, b");
    refused(&["export", "tum", "set", "--out", "truth"], "truth: already exists and is not an empty folder");
    refused(&["export", "tum", "c.toml"], "c.toml: is a file, where a folder belongs");
}

#[test]
fn what_cannot_be_exported_is_refused_and_nothing_is_written() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    dataset(at, "set", 0.4);
    dataset(at, "other", 0.5);
    let without = |name: &str, key: &str, more: &str| {
        let lines: Vec<&str> = CALIBRATION.lines().filter(|line| !line.trim().starts_with(key)).collect();
        fs::write(at.join(name), lines.join("\n").replacen("runs_used", &format!("{more}runs_used"), 1))
            .expect("written");
    };
    let blind = "not_observable = [{ parameter = \"wheel_separation_m\", why = \"no turns\" }]\n";
    without("blind.toml", "wheel_separation_m", blind);
    without("no-ticks.toml", "left_m_per_tick", "");
    let bare = "[[methods]]\nmethod = \"a\"\n[methods.parameters]\nleft_wheel_diameter_m = 0.202\nright_wheel_diameter_m = 0.198\n\
                wheel_separation_m = 0.408\n";
    fs::write(at.join("bare.toml"), bare).expect("written");
    fs::write(at.join("two.toml"), bare.to_owned() + &bare.replace("\"a\"", "\"b\"")).expect("written");
    let refused = |arguments: &[&str], beginning: &str| {
        let before = everything_in(at);
        let message = refusal(at, arguments);
        assert!(message.starts_with(beginning), "{message}");
        assert_eq!(everything_in(at), before, "{arguments:?} left something behind");
    };
    refused(
        &["export", "ros2-yaml", "blind.toml", "--out", "x"],
        "blind.toml: wheel_separation_m has no value: no turns; drive what determines it",
    );
    refused(&["export", "roadrunner", "no-ticks.toml"], "no-ticks.toml: it does not say the counts of a wheel turn");
    refused(
        &["export", "ros2-yaml", "bare.toml"],
        "bare.toml: it does not say the nominal wheel_separation_m; give --dataset",
    );
    refused(&["export", "mm", "two.toml"], "two.toml: it holds 2 calibrations (a, b); choose one by --method");
    refused(&["export", "mm", "two.toml", "--method", "c"], "two.toml: it has no method c; it has a, b");
    refused(&["export", "mm", "set"], "set: it is a folder; mm takes a calibration file");
    refused(&["export", "mm", "absent.toml"], "absent.toml: ");
    refused(&["export", "mm", "c.toml", "--out", "set"], "set: it is a folder, where a file belongs");
    refused(&["export", "mm", "c.toml", "--dataset", "other"], "c.toml: it is the calibration of another robot");
    refused(&["export", "ros2-yaml", "c.toml", "--rate", "0"], "--rate 0: expected a positive number");
    refused(&["export", "c", "c.toml", "--counter-bits", "7"], "--counter-bits 7: expected 8 to 64 bits");
    // A dataset gives what the file does not say.
    for (format, file) in [("ros2-yaml", "bare.toml"), ("roadrunner", "no-ticks.toml"), ("mm", "c.toml")] {
        succeed(at, &["export", format, file, "--dataset", "set"]);
    }
    succeed(at, &["export", "mm", "two.toml", "--method", "b"]);
    let message = usage(at, &["export", "mm", "c.toml", "--speed", "1"]);
    assert!(message.contains("--speed is not for the format mm"), "{message}");
    usage(at, &["export", "tum", "set", "--dataset", "set"]);
    usage(at, &["export", "ros2-yaml", "c.toml", "--lengths", "--multipliers"]);
    usage(at, &["export", "matlab", "c.toml"]);
    usage(at, &["export", "mm"]);
}

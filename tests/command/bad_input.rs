//! Whatever a user may hand over by mistake: one line that says what and where, exit 1, and nothing written.

use std::fs;
use std::path::Path;

use crate::support::{everything_in, paper, refusal, run_in, succeed, usage, workplace};

/// The refusal of a command that leaves no trace in its folder.
#[track_caller]
fn refused(at: &Path, arguments: &[&str]) -> String {
    let before = everything_in(at);
    let message = refusal(at, arguments);
    assert_eq!(everything_in(at), before, "{arguments:?} left something behind");
    message
}

#[track_caller]
fn begins(message: &str, beginning: &str) {
    assert!(message.starts_with(beginning), "\nfound    {message}\nexpected {beginning}");
}

#[track_caller]
fn contains(message: &str, part: &str) {
    assert!(message.contains(part), "\nfound    {message}\nexpected … {part} …");
}

/// A small dataset with poses as truth.
fn small_set(at: &Path) {
    let set = at.join("set");
    fs::create_dir(&set).expect("made");
    let toml = "format = 1\n[robot]\nleft_wheel_diameter_m = 0.1\nright_wheel_diameter_m = 0.1\nwheel_separation_m = 0.3\n\
                ticks_per_rev = 2000\n[[run]]\nid = \"a\"\n[[run]]\nid = \"b\"\n";
    fs::write(set.join("dataset.toml"), toml).expect("written");
    let odometry = "run,t_s,left_ticks,right_ticks\na,0,0,0\na,0.1,10,12\nb,0,5,5\nb,0.1,7,7\n";
    fs::write(set.join("odometry.csv"), odometry).expect("written");
    let truth = "run,t_s,x_m,y_m,theta_rad\na,0,0,0,0\na,0.1,0.5,0,0.1\nb,0,0,0,0\nb,0.1,0.5,0,0\n";
    fs::write(set.join("truth.csv"), truth).expect("written");
}

/// What evaluate and calibrate say when in one file of the small dataset `from` is `to`.
#[track_caller]
fn edited(file: &str, from: &str, to: &str, expected: &str) {
    let temp = tempfile::tempdir().expect("a temporary folder");
    small_set(temp.path());
    succeed(temp.path(), &["evaluate", "set"]);
    let path = temp.path().join("set").join(file);
    let text = fs::read_to_string(&path).expect("read");
    assert!(text.contains(from), "{from}");
    fs::write(path, text.replacen(from, to, 1)).expect("written");
    for command in ["evaluate", "calibrate"] {
        begins(&refused(temp.path(), &[command, "set"]), &format!("set/{file}{expected}"));
    }
}

#[test]
fn faults_of_a_dataset_name_file_line_and_column() {
    edited("odometry.csv", "b,0.1,7,7\n", "b,0.1", ":5: 2 fields; expected 4");
    edited("odometry.csv", "b,0.1,7,7", "b,0.1,7.5,7", ":5: column left_ticks: \"7.5\" is not a count");
    edited("odometry.csv", "right_ticks", "right_tics", ":1: missing column right_ticks");
    edited("odometry.csv", "a,0.1,", "a,-0.1,", ":3: column t_s: time runs backwards");
    edited("odometry.csv", "a,0.1,", "a,0,", ":3: column t_s: a second row at 0 s");
    edited("odometry.csv", "a,0.1,", "a,NaN,", ":3: column t_s: \"NaN\" is not finite");
    edited("odometry.csv", "b,0,5,5\nb,0.1,7,7\n", "", ": no rows for run \"b\"");
    edited("odometry.csv", "b,0,5,5", "c,0,5,5", ":4: column run: run \"c\" is not in dataset.toml");
    edited("truth.csv", "0.5,0,0.1", "NaN,0,0.1", ":3: column x_m: \"NaN\" is not finite");
    edited("truth.csv", "0.5,0,0.1", "inf,0,0.1", ":3: column x_m: \"inf\" is not finite");
    edited(
        "dataset.toml",
        "wheel_separation_m = 0.3",
        "wheel_separation_mm = 300",
        ":5: unknown field `wheel_separation_mm`, expected one of",
    );
    edited(
        "dataset.toml",
        "wheel_separation_m = 0.3",
        "wheel_separation_m = -0.3",
        ":5: wheel_separation_m = -0.3; expected",
    );
    edited("dataset.toml", "ticks_per_rev = 2000", "ticks = 2000", ":6: ");
    edited("dataset.toml", "format = 1", "format = 2", ":1: format = 2 is not known here");
    edited("dataset.toml", "[[run]]\nid = \"b\"", "[[run]", ":9: ");
    // In one table and not in the other: the run's own line is named.
    let temp = tempfile::tempdir().expect("a temporary folder");
    small_set(temp.path());
    fs::write(temp.path().join("set/truth.csv"), "run,t_s,x_m,y_m,theta_rad\na,0,0,0,0\n").expect("written");
    begins(
        &refused(temp.path(), &["evaluate", "set"]),
        "set/dataset.toml:9: run \"b\" has odometry but no rows in truth.csv",
    );
}

/// That it is not held in memory either is asked by crates/dataset/tests/memory.rs.
#[test]
fn a_file_of_a_gigabyte_of_nothing_is_refused_by_its_name() {
    let at = &workplace();
    let at = at.path();
    let huge = |path: &Path| fs::File::create(path).and_then(|file| file.set_len(1 << 30)).expect("a sparse file");
    huge(&at.join("huge"));
    contains(&refused(at, &["simulate", "huge", "--out", "new"]), "huge: ");
    contains(&refused(at, &["sweep", "huge", "--out", "new"]), "huge: ");
    begins(&refused(at, &["import", "censi", "huge", "--out", "new"]), "huge:1: ");
    begins(&refused(at, &["evaluate", "set", "--calibration", "huge"]), "huge: ");
    for file in ["dataset.toml", "odometry.csv", "points.csv", "truth.csv", "displacement.csv", "wheel_reference.csv"] {
        let path = at.join("set").join(file);
        let before = fs::read(&path).ok();
        huge(&path);
        for command in ["calibrate", "evaluate"] {
            begins(&refused(at, &[command, "set"]), &format!("set/{file}"));
        }
        match before {
            Some(before) => fs::write(&path, before).expect("written"),
            None => fs::remove_file(&path).expect("removed"),
        }
    }
    succeed(at, &["calibrate", "set"]);
}

#[test]
fn empty_binary_and_absent_files_and_folders_are_refused() {
    let at = &workplace();
    let at = at.path();
    fs::write(at.join("empty"), "").expect("written");
    // Bytes of a small generator: neither text nor any known format, a NUL and a line end among them.
    let mut state = 0x9e37_79b9_u32;
    let noise: Vec<u8> = std::iter::repeat_with(|| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    })
    .take(1 << 16)
    .collect();
    assert!(noise.contains(&0) && noise.contains(&b'\n'));
    fs::write(at.join("noise"), &noise).expect("written");
    fs::create_dir(at.join("folder")).expect("made");
    for wrong in ["empty", "noise", "folder", "absent"] {
        for command in [
            &["simulate", wrong, "--out", "new"][..],
            &["sweep", wrong, "--out", "new"],
            &["import", "censi", wrong, "--out", "new"],
            &["import", "optiodom", wrong, "--out", "new"],
            &["evaluate", "set", "--calibration", wrong],
            &["evaluate", wrong],
            &["calibrate", wrong, "--out", "new"],
        ] {
            let message = refused(at, command);
            contains(&message, wrong);
            assert!(!message.contains("os error 21"), "{message}");
        }
    }
    for file in ["dataset.toml", "odometry.csv", "points.csv"] {
        let path = at.join("set").join(file);
        let before = fs::read(&path).expect("read");
        for content in [&b""[..], &noise] {
            fs::write(&path, content).expect("written");
            begins(&refused(at, &["calibrate", "set"]), &format!("set/{file}"));
        }
        fs::write(&path, before).expect("written");
    }
}

#[test]
fn a_scenario_that_is_none_names_the_line_and_the_known_words() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let edited = |from: &str, to: &str| {
        let scenario = paper();
        let position = scenario.find(from).unwrap_or_else(|| panic!("{from}"));
        let line = scenario[..position].matches('\n').count() + 1;
        fs::write(at.join("s.toml"), scenario.replacen(from, to, 1)).expect("written");
        let message = refused(at, &["simulate", "s.toml", "--out", "new"]);
        assert_eq!(refused(at, &["sweep", "s.toml", "--trials", "2", "--out", "new"]), message);
        (message, line)
    };
    let (message, line) = edited("kind = \"wheel_scale\"", "kind = \"wheel_size\"");
    begins(&message, &format!("s.toml:{line}: "));
    contains(&message, "wheel_size");
    assert!(effects::CATALOGUE.iter().all(|id| message.contains(id)), "{message}");
    let (message, line) = edited("wheel_separation_m = 0.363", "wheel_separation_mm = 363");
    begins(&message, &format!("s.toml:{line}: "));
    contains(&message, "`wheel_separation_m`");
    contains(&edited("scale = 1.0328", "scale = 1.0328\ncolour = 3").0, "unknown field `colour`");
    for (from, to, what) in [
        ("scale = 1.0328", "scale = -1", "effect wheel_scale: scale is -1; it must be positive"),
        ("sigma_m = 0.001 ", "sigma_m = -0.001 ", "contact_patch_wheelbase"),
        ("wheel_separation_m = 0.363", "wheel_separation_m = -1", "wheel_separation_m is -1"),
        ("reading_sigma_m = 0.0005", "reading_sigma_m = -1", "reading_sigma_m is -1"),
        ("length_m = 0.5", "length_m = nan", "protocol.length_m is NaN"),
        ("runs = 82", "runs = -1", "s.toml:"),
        ("seed = 20060701", "seed = 0.5", "s.toml:"),
        (
            "\"noise.wheel_sigma_m_per_sqrt_m\"",
            "\"noise.wheel_sigma\"",
            "known keys: sensitivity_sigma, wheel_sigma_m_per_sqrt_m",
        ),
        ("\"noise.wheel_sigma_m_per_sqrt_m\"", "\"effect.wheel_size.scale\"", "it has: wheel_scale, wheel_mismatch"),
        ("trials = 5000", "trials = 1", "sweep.trials is 1"),
        ("runs_each_way = 5", "runs_each_way = 5.5", "s.toml:"),
    ] {
        let message = edited(from, to).0;
        begins(&message, "s.toml");
        contains(&message, what);
    }
}

#[test]
fn a_sweep_that_cannot_be_run_is_refused_before_it_runs() {
    let at = &workplace();
    let at = at.path();
    fs::write(at.join("s.toml"), paper().replace("\"umbmark\"]", "\"umbmrk\"]")).expect("written");
    let message = refused(at, &["sweep", "s.toml", "--out", "new"]);
    begins(&message, "s.toml: unknown method \"umbmrk\"");
    assert!(calib::METHODS.iter().all(|method| message.contains(method.name())), "{message}");
    fs::write(at.join("s.toml"), paper().split("[sweep]").next().expect("a head")).expect("written");
    begins(&refused(at, &["sweep", "s.toml"]), "s.toml: ");
    for trials in ["1", "18446744073709551615"] {
        contains(&usage(at, &["sweep", "paper.toml", "--trials", trials]), "2..=100000000");
    }
    // Where results cannot go is said before hours of trials, not after.
    for out in ["paper.toml", "paper.toml/new"] {
        begins(&refused(at, &["sweep", "paper.toml", "--trials", "1000000", "--out", out]), out);
    }
    let message = usage(at, &["sweep", "paper.toml", "--jobs", "1000000"]);
    contains(&message, "1024");
}

#[test]
fn an_effect_that_needs_steps_says_what_to_set() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let eccentric = "[[effect]]\nkind = \"wheel_eccentricity\"\nleft_amplitude = 0.01\n\n[[protocol]]";
    fs::write(at.join("s.toml"), paper().replacen("[[protocol]]", eccentric, 1)).expect("written");
    for command in ["simulate", "sweep"] {
        let message = refused(at, &[command, "s.toml", "--out", "new"]);
        contains(&message, "wheel_eccentricity");
        contains(&message, "stepping");
    }
}

#[test]
fn a_calibration_file_that_is_none_names_the_known_keys() {
    let at = &workplace();
    let at = at.path();
    for (parameters, what) in [
        ("wheel_separation_mm = 363", "known: left_wheel_diameter_m, right_wheel_diameter_m, wheel_separation_m"),
        ("wheel_separation_m = -1", "wheel_separation_m = -1"),
        ("wheel_separation_m = nan", "wheel_separation_m = NaN"),
        ("wheel_separation_m = 1e308", "wheel_separation_m = 1e308"),
        ("wheel_separation_m = 5e-324", "wheel_separation_m = 5e-324"),
        ("latency_s = inf", "latency_s = inf"),
        ("wheel_separation_m = { value = 0.3, sigma = nan }", "c.toml:4: not a calibration: NaN where 0 or a number"),
        ("wheel_separation_m = { value = 0.3, ratio_to_nominal = -inf }", "-inf where a number from 1e-60 to 1e60"),
        ("wheel_separation_m = \"wide\"", "c.toml:4: not a calibration"),
    ] {
        let text = format!("[[methods]]\nmethod = \"x\"\n[methods.parameters]\n{parameters}\n");
        fs::write(at.join("c.toml"), text).expect("written");
        let message = refused(at, &["evaluate", "set", "--calibration", "c.toml"]);
        begins(&message, "c.toml:");
        contains(&message, what);
    }
    for nothing in ["methods = []\n", "[[methods]]\nmethod = \"x\"\nerror = \"no\"\n"] {
        fs::write(at.join("c.toml"), nothing).expect("written");
        contains(&refused(at, &["evaluate", "set", "--calibration", "c.toml"]), "holds no values");
    }
}

#[test]
fn a_scenario_that_is_no_model_of_the_robot_says_why() {
    let at = &workplace();
    let at = at.path();
    let refused_as = |text: String, what: &str| {
        fs::write(at.join("s.toml"), text).expect("written");
        let message = refused(at, &["evaluate", "set", "--calibration", "s.toml"]);
        begins(&message, "s.toml");
        contains(&message, what);
        let corrected = ["correct", "set", "--calibration", "s.toml", "--out", "new"];
        assert_eq!(refused(at, &corrected), message);
    };
    let remarks = succeed(at, &["evaluate", "set", "--calibration", "paper.toml"]).stderr;
    assert_eq!(remarks, "paper.toml: contact_patch_wheelbase only scatters: dead reckoning does without it\n");
    let with = |effect: &str| paper().replacen("[[protocol]]", &format!("[[effect]]\n{effect}\n\n[[protocol]]"), 1);
    let traction = "kind = \"traction_loss\"\nstatic_friction = 0.5\nkinetic_friction = 0.4\nstribeck_speed_m_s = 0.05";
    refused_as(with(traction), ": effect traction_loss: its sizes do not say how it acts on average");
    let estimated = |kind: &str, values: &str| {
        format!(
            "{}\n[estimated]\nsensor_x_m = 0.0\nsensor_y_m = 0.0\nsensor_theta_rad = 0.0\nlatency_s = 0.0\n\
             [[estimated.term]]\nkind = \"{kind}\"\nvalues = {{ {values} }}\n",
            with("kind = \"slip_speed\"\nslip_s_m = 0.01")
        )
    };
    fs::write(at.join("s.toml"), estimated("slip_speed", "slip_s_m = 0.01")).expect("written");
    succeed(at, &["evaluate", "set", "--calibration", "s.toml"]);
    let not_of_one = ": [[estimated.term]] of kind ";
    refused_as(estimated("slip_speed", "slip_s_m = 0.02"), &format!("{not_of_one}\"slip_speed\""));
    refused_as(estimated("lateral_skid", "skid_s = 0.02"), &format!("{not_of_one}\"lateral_skid\""));
    refused_as(estimated("slip_speed", "slip_s_m = nan"), "estimated.term.values.slip_s_m is NaN");
    refused_as(paper().replacen("scale = 1.0328", "scale = 1.0328\ncolour = 3", 1), "unknown field `colour`");
    let other = paper().replacen("wheel_separation_m = 0.363", "wheel_separation_m = 3.63", 1);
    refused_as(other, ": it is the model of another robot: wheel_separation_m is 3.6300 where the dataset states 0.3");
}

#[test]
fn places_that_cannot_be_written_are_named_and_left_alone() {
    let at = &workplace();
    let at = at.path();
    fs::write(at.join("file"), "mine").expect("written");
    begins(&refused(at, &["simulate", "paper.toml", "--out", "file/new"]), "file");
    contains(&refused(at, &["simulate", "paper.toml", "--out", "file"]), "file: already exists and is not a folder");
    let message = refused(at, &["calibrate", "set", "--out", "nowhere/found.toml"]);
    assert_eq!(message, "nowhere/found.toml: there is no folder nowhere");
    begins(&refused(at, &["calibrate", "set", "--out", "file/found.toml"]), "file/found.toml: ");
    begins(&refused(at, &["calibrate", "set", "--out", "set"]), "set: ");
    fs::create_dir(at.join("new.truth.json")).expect("made");
    begins(&refused(at, &["simulate", "paper.toml", "--out", "new", "--force"]), "new.truth.json: already exists");
    assert_eq!(fs::read_to_string(at.join("file")).expect("read"), "mine");
}

/// Two sessions of one run each, in the form of the `OptiOdom` study.
fn two_sessions(at: &Path) {
    for session in ["s1", "s2"] {
        let folder = at.join("logs").join(session);
        fs::create_dir_all(&folder).expect("made");
        let metadata = "type,diff\nngear,43.7\nencRes,64\nLi,0.2\nDi,0.084,0.084\nN,1\nL,0.75\n";
        fs::write(folder.join(format!("{session}_metadata.csv")), metadata).expect("written");
        fs::write(folder.join(format!("{session}_run-01.csv")), "0,0,0,0,0,0\n0.05,0,0,0,9,9\n").expect("written");
    }
}

#[test]
fn an_import_is_done_as_a_whole_or_not_at_all() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    two_sessions(at);
    // A fault in the last session, then a folder in the way of it.
    let run = at.join("logs/s2/s2_run-01.csv");
    let good = fs::read_to_string(&run).expect("read");
    fs::write(&run, good.replace("9,9", "9,x")).expect("written");
    begins(&refused(at, &["import", "optiodom", "logs", "--out", "new"]), "logs/s2/s2_run-01.csv:2: column left_ticks");
    fs::write(&run, &good).expect("written");
    fs::create_dir_all(at.join("new/s2/mine")).expect("made");
    begins(&refused(at, &["import", "optiodom", "logs", "--out", "new"]), "new/s2: already exists");
    // Two sessions of one name would replace each other.
    fs::create_dir_all(at.join("logs/copy")).expect("made");
    for file in ["s1_metadata.csv", "s1_run-01.csv"] {
        fs::copy(at.join("logs/s1").join(file), at.join("logs/copy").join(file)).expect("copied");
    }
    contains(&refused(at, &["import", "optiodom", "logs", "--out", "other", "--force"]), "two sessions");
}

#[test]
fn a_counter_that_wraps_is_refused_and_its_width_named() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    small_set(at);
    let odometry = |bits: u32| {
        let rows = (0..80).map(|row: u64| {
            let count = (row << (bits - 4)) % (1 << bits);
            format!("a,{row},{count},{row}\nb,{row},{row},{row}\n")
        });
        "run,t_s,left_ticks,right_ticks\n".to_owned() + &rows.collect::<String>()
    };
    for bits in [8, 16, 24, 32] {
        fs::write(at.join("set/odometry.csv"), odometry(bits)).expect("written");
        let ended = run_in(at, &["calibrate", "set", "--quiet"]);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(1), ""));
        assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
        contains(&ended.stderr, &format!("{bits}"));
        contains(&ended.stderr, "counter_bits");
    }
}

#[test]
fn a_counter_that_leaves_its_place_for_one_row_is_refused_and_the_row_named() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    small_set(at);
    let rows = (0..80).map(|row: u64| {
        let left = if row == 40 { 4_000_000_000 } else { 7 * row };
        format!("a,{row},{left},{row}\nb,{row},{row},{row}\n")
    });
    let odometry = "run,t_s,left_ticks,right_ticks\n".to_owned() + &rows.collect::<String>();
    fs::write(at.join("set/odometry.csv"), odometry).expect("written");
    let ended = run_in(at, &["calibrate", "set", "--quiet"]);
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(1), ""));
    contains(&ended.stderr, "run \"a\": the left counter shows 4000000000 at t = 40 s and comes back in the next row");
}

/// What belongs to another command is sent there.
#[test]
fn a_manifest_is_no_calibration_and_a_table_is_imported_first() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    small_set(at);
    let message = refused(at, &["evaluate", "set", "--calibration", "set/dataset.toml"]);
    contains(&message, "set/dataset.toml: it is the manifest of a dataset, and no calibration");
    contains(&message, "yair calibrate DATASET --out FILE");
    contains(&refused(at, &["export", "c", "set/dataset.toml"]), "the manifest of a dataset");
    fs::write(at.join("wide.csv"), "t,left,right,x,y,theta\n").expect("written");
    for command in ["calibrate", "evaluate", "check", "diagnose"] {
        let message = refused(at, &[command, "wide.csv"]);
        contains(&message, "import it first: yair import csv wide.csv --out wide --wheel METRES --base METRES");
    }
    fs::write(at.join("drive.mcap"), "").expect("written");
    contains(&refused(at, &["calibrate", "drive.mcap"]), "yair import ros2 drive.mcap --out drive");
    contains(&refused(at, &["calibrate", "set/dataset.toml"]), "a dataset is the folder of a dataset.toml");
}

//! Every fault of a dataset gives one message, on one line, that names file, line, column and what was
//! expected.

use std::fs;
use std::path::Path;

use dataset::{DatasetError, Warning, read};
use kinematics::Side;

pub(crate) const TOML: &str = "\
format = 1
[robot]
left_wheel_diameter_m = 0.1
right_wheel_diameter_m = 0.1
wheel_separation_m = 0.3
ticks_per_rev = 2000
[truth]
sigma_xy_m = 0.001
[[run]]
id = \"a\"
payload_kg = 2
[[run]]
id = \"b\"
[[point]]
id = \"left\"
x_m = 0
y_m = 0.25
";
const ODOMETRY: &str = "run,t_s,left_ticks,right_ticks\na,0,0,0\na,0.1,10,12\nb,0,5,5\nb,0.1,7,7\n";
const TRUTH: &str = "run,t_s,x_m,y_m,theta_rad\na,0,0,0,0\na,1,0.5,0,0.1\nb,0,0,0,\nb,1,0.5,0,\n";
const DISPLACEMENT: &str = "run,t0_s,t1_s,dx_m,dy_m,dtheta_rad\na,0,1,0.1,0,0\na,1,2,0.1,0,0\n";
const POINTS: &str = "run,t_s,point,x_m,y_m\na,0,left,0,0.25\na,1,left,0.5,0.25\n";
const WHEELS: &str = "run,t_s,left_mps,right_mps\na,0,0.1,0.1\na,1,0.1,0.1\n";

/// A good dataset in which some files have other content, or are absent.
pub(crate) struct Case(tempfile::TempDir);

impl Case {
    pub(crate) fn good() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
            .with("dataset.toml", TOML)
            .with("odometry.csv", ODOMETRY)
            .with("truth.csv", TRUTH)
    }

    pub(crate) fn with(self, file: &str, content: impl AsRef<[u8]>) -> Self {
        fs::write(self.path().join(file), content).expect("written");
        self
    }

    pub(crate) fn without(self, file: &str) -> Self {
        fs::remove_file(self.path().join(file)).expect("removed");
        self
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn error(&self) -> DatasetError {
        read(self.path()).expect_err("a fault was planted")
    }

    /// The message without the folder; one line that names the file.
    fn message(&self) -> String {
        let message = self.error().to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        let prefix = format!("{}{}", self.path().display(), std::path::MAIN_SEPARATOR);
        message.strip_prefix(&prefix).unwrap_or_else(|| panic!("no file in {message}")).to_owned()
    }
}

#[track_caller]
fn fault(file: &str, content: impl AsRef<[u8]>, expected: &str) {
    let message = Case::good().with(file, content).message();
    assert!(message.starts_with(expected), "\nfound    {message}\nexpected {expected}");
}

#[track_caller]
fn odometry(rows: &str, expected: &str) {
    fault("odometry.csv", format!("run,t_s,left_ticks,right_ticks\n{rows}"), expected);
}

#[track_caller]
fn toml(good: &str, bad: &str, expected: &str) {
    assert!(TOML.contains(good), "{good}");
    fault("dataset.toml", TOML.replacen(good, bad, 1), expected);
}

#[test]
fn the_good_dataset_is_good() {
    let case = Case::good()
        .with("displacement.csv", DISPLACEMENT)
        .with("points.csv", POINTS)
        .with("wheel_reference.csv", WHEELS);
    let loaded = read(case.path()).expect("no fault");
    assert!(loaded.warnings.is_empty());
    let runs = &loaded.dataset.runs;
    assert_eq!((runs.len(), runs[0].truth.len(), runs[0].displacements.len()), (2, 2, 2));
    assert_eq!((runs[0].point_readings.len(), runs[0].wheel_reference.len()), (2, 2));
    assert_eq!(runs[0].info.covariates["payload_kg"], 2.0);
    assert_eq!(runs[1].truth[1].theta_rad(), None);
}

#[test]
fn columns_may_come_in_any_order_and_runs_in_turns() {
    let shuffled = "right_ticks,run,left_ticks,t_s\r\n0,a,0,0\r\n5, b ,5,0\r\n\r\n12,\"a\",10,0.1\r\n7,b,7,0.1";
    let shuffled = read(Case::good().with("odometry.csv", shuffled).path()).expect("no fault");
    assert_eq!(shuffled, read(Case::good().path()).expect("no fault"));
}

#[test]
fn truncated_empty_and_header_only() {
    odometry("a,0,0,0\na,0.1,1", "odometry.csv:3: 3 fields; expected 4 as in the header; it is the last line");
    let inside = Case::good().with("odometry.csv", ODOMETRY.replace("a,0.1,10,12", "a,0.1,10")).message();
    assert_eq!(inside, "odometry.csv:3: 3 fields; expected 4 as in the header");
    odometry("a,0,0,0\na,0.1,1,2,3\n", "odometry.csv:3: 5 fields; expected 4");
    fault("odometry.csv", "", "odometry.csv: empty file; expected a header like run,t_s,left_ticks,right_ticks");
    fault("truth.csv", "\n\n", "truth.csv: empty file; expected a header like run,t_s,x_m,y_m,theta_rad");
    fault("dataset.toml", " \n", "dataset.toml: empty file; expected");
    odometry("", "odometry.csv: no rows for run \"a\" of dataset.toml");
    fault(
        "truth.csv",
        "run,t_s,x_m,y_m,theta_rad\n",
        "dataset.toml:9: run \"a\" has odometry but no rows in truth.csv",
    );
}

#[test]
fn numbers_that_are_none() {
    odometry("a,nan,0,0\n", "odometry.csv:2: column t_s: \"nan\" is not finite");
    odometry("a,1e999,0,0\n", "odometry.csv:2: column t_s: \"1e999\" is not finite");
    odometry("a,0,0,0\na,1,0,inf\n", "odometry.csv:3: column right_ticks: \"inf\" is not finite");
    odometry("a,0,0,0\na,0x1,0,0\n", "odometry.csv:3: column t_s: \"0x1\" is not a number");
    odometry("a,,0,0\n", "odometry.csv:2: column t_s: \"\" is not a number");
    odometry("a,0,1.5,0\n", "odometry.csv:2: column left_ticks: \"1.5\" is not a count; expected a whole number");
    odometry(
        "a,0,9223372036854775808,0\n",
        "odometry.csv:2: column left_ticks: \"9223372036854775808\" is not a count",
    );
    odometry("a,0,0,0\nb,0,0\u{7}x\0,0\n", "odometry.csv:3: column left_ticks: \"0\\u{7}x\\0\" is not a count");
    for (content, expected) in [
        ("a,0,NaN,0,0", "truth.csv:2: column x_m: \"NaN\" is not finite"),
        ("a,0,0,-inf,0", "truth.csv:2: column y_m: \"-inf\" is not finite"),
        ("a,0,0,0,1e400", "truth.csv:2: column theta_rad: \"1e400\" is not finite"),
        ("a,0,0,,0", "truth.csv:2: column y_m: \"\" is not a number"),
    ] {
        fault("truth.csv", format!("run,t_s,x_m,y_m,theta_rad\n{content}\n"), expected);
    }
    let sigma = "run,t_s,x_m,y_m,theta_rad,sigma_xy_m\na,0,0,0,0,\na,1,0,0,0,-0.1\n";
    fault("truth.csv", sigma, "truth.csv:3: sigma_xy_m = -0.1; expected a positive number");
    fault("displacement.csv", DISPLACEMENT.replace("2,0.1", "2,nan"), "displacement.csv:3: column dx_m: \"nan\"");
    fault("points.csv", POINTS.replace("0.5", "nan"), "points.csv:3: column x_m: \"nan\"");
    fault(
        "wheel_reference.csv",
        WHEELS.replace("0.1\na", "nan\na"),
        "wheel_reference.csv:2: column right_mps: \"nan\"",
    );
}

#[test]
fn time_in_every_table() {
    odometry("a,0.5,0,0\nb,0,0,0\na,0.25,1,1\n", "odometry.csv:4: column t_s: time runs backwards, 0.25 s after 0.5 s");
    odometry("a,0.5,0,0\nb,0,0,0\na,0.50,1,1\n", "odometry.csv:4: column t_s: a second row at 0.5 s in the same run");
    fault("truth.csv", TRUTH.replace("a,1", "a,-1"), "truth.csv:3: column t_s: time runs backwards, -1 s after 0 s");
    fault("truth.csv", TRUTH.replace("b,1", "b,0"), "truth.csv:5: column t_s: a second row at 0 s");
    fault(
        "displacement.csv",
        DISPLACEMENT.replace("a,1", "a,0"),
        "displacement.csv:3: column t0_s: a second row at 0 s",
    );
    fault(
        "displacement.csv",
        DISPLACEMENT.replace("a,1", "a,-1"),
        "displacement.csv:3: column t0_s: time runs backwards",
    );
    fault(
        "displacement.csv",
        DISPLACEMENT.replace("a,1,2", "a,1,1"),
        "displacement.csv:3: column t1_s: the interval ends at 1 s; expected an end after its start at 1 s",
    );
    fault("points.csv", POINTS.replace("a,1", "a,0"), "points.csv:3: column t_s: a second row at 0 s");
    fault("points.csv", POINTS.replace("a,1", "a,-1"), "points.csv:3: column t_s: time runs backwards");
    fault(
        "wheel_reference.csv",
        WHEELS.replace("a,1", "a,0"),
        "wheel_reference.csv:3: column t_s: a second row at 0 s",
    );
    let error = Case::good().with("truth.csv", TRUTH.replace("a,1", "a,-1")).error();
    assert!(matches!(error, DatasetError::TimeRunsBackwards { line: 3, t_s: -1.0, previous_s: 0.0, .. }), "{error:?}");
}

#[test]
fn several_points_may_share_an_instant() {
    let two = format!("{TOML}[[point]]\nid = \"right\"\nx_m = 0\ny_m = -0.25\n");
    let case = Case::good().with("dataset.toml", &two).with("points.csv", POINTS.replace("a,1,left", "a,0,right"));
    assert_eq!(read(case.path()).expect("no fault").dataset.runs[0].point_readings.len(), 2);
    let thrice = "run,t_s,point,x_m,y_m\na,0,left,0,0\na,0,right,0,0\na,0,left,0,0\n";
    let message = Case::good().with("dataset.toml", two).with("points.csv", thrice).message();
    assert!(message.starts_with("points.csv:4: column t_s: a second row at 0 s"), "{message}");
}

#[test]
fn missing_and_wrong_columns() {
    fault(
        "odometry.csv",
        ODOMETRY.replace("t_s", "t_ms"),
        "odometry.csv:1: missing column t_s; the columns found are: run, t_ms, left_ticks, right_ticks",
    );
    fault("odometry.csv", ODOMETRY.replace("run", "id"), "odometry.csv:1: missing column run; ");
    fault("odometry.csv", ODOMETRY.replace("right_ticks", "right_rad"), "odometry.csv:1: missing column right_ticks");
    fault(
        "odometry.csv",
        "run,t_s,l,r\n",
        "odometry.csv:1: missing column left_ticks,right_ticks or left_rad,right_rad or left_mps,right_mps or v_mps,omega_radps; the columns",
    );
    fault("odometry.csv", ODOMETRY.replace("right_t", "left_t"), "odometry.csv:1: column left_ticks occurs twice");
    fault(
        "truth.csv",
        TRUTH.replace("theta_rad", "theta_deg"),
        "truth.csv:1: missing column theta_rad; the columns found",
    );
    fault("displacement.csv", DISPLACEMENT.replace("dx_m", "dx_mm"), "displacement.csv:1: missing column dx_m");
    fault("points.csv", POINTS.replace("point", "mark"), "points.csv:1: missing column point");
    fault("wheel_reference.csv", WHEELS.replace("left_mps", "left"), "wheel_reference.csv:1: missing column left_mps");
    let extra = "run,t_s,left_ticks,right_ticks,cmd_v_mps\na,0,0,0,\na,1,0,0,0.5\nb,0,0,0,1\n";
    fault("odometry.csv", extra, "odometry.csv:3: column cmd_v_mps: a value, though the run's first row has none");
    let gap = "run,t_s,left_ticks,right_ticks,cmd_v_mps\na,0,0,0,0.5\na,1,0,0,\nb,0,0,0,\n";
    fault("odometry.csv", gap, "odometry.csv:3: column cmd_v_mps: \"\" is not a number");
}

#[test]
fn unknown_and_redundant_columns_are_warned_of_and_kept_out() {
    let wide = "run,t_s,left_ticks,right_ticks,battery_V,v_mps,gyro_radps\na,0,0,0,12,0,0.5\nb,0,0,0,12,0,\n";
    let case = Case::good().with("odometry.csv", wide);
    let loaded = read(case.path()).expect("no fault");
    let messages: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(messages.len(), 2, "{messages:?}");
    assert!(messages[0].contains("odometry.csv: column \"battery_V\" is not known and was left out"), "{messages:?}");
    assert!(messages[1].contains("column v_mps was left out, because the dataset also has left_ticks"), "{messages:?}");
    assert_eq!(loaded.dataset.runs[0].odometry.extra.len(), 1);
    assert_eq!(loaded.dataset.runs[1].odometry.extra.len(), 0);
}

#[test]
fn a_gyroscope_may_have_gaps_and_keeps_them() {
    let gaps = "run,t_s,left_ticks,right_ticks,gyro_radps\na,0,0,0,\na,1,5,0,0.5\na,2,9,0,\nb,0,0,0,\nb,1,1,1,\n";
    let case = Case::good().with("odometry.csv", gaps);
    let set = read(case.path()).expect("no fault").dataset;
    let of = |run: usize| set.runs[run].odometry.extra.values().cloned().collect::<Vec<_>>();
    assert_eq!(format!("{:?} {:?}", of(0), of(1)), "[[NaN, 0.5, NaN]] []");
    let again = case.path().join("again");
    dataset::write(&set, &again, dataset::Existing::Refuse).expect("written");
    assert_eq!(fs::read_to_string(again.join("odometry.csv")).expect("a table"), gaps);
    assert!(read(&again).expect("no fault").dataset == set);
    let wrong = Case::good().with("odometry.csv", gaps.replace("0.5", "fast"));
    let message = read(wrong.path()).expect_err("no number").to_string();
    assert!(message.contains("odometry.csv:3: column gyro_radps"), "{message}");
}

#[test]
fn runs_in_one_table_and_not_in_the_other() {
    odometry("a,0,0,0\nc,0,0,0\n", "odometry.csv:3: column run: run \"c\" is not in dataset.toml");
    fault("truth.csv", TRUTH.replace("b,0", "A,0"), "truth.csv:4: column run: run \"A\" is not in dataset.toml");
    odometry("b,0,0,0\n", "odometry.csv: no rows for run \"a\" of dataset.toml");
    let only_a = "run,t_s,x_m,y_m,theta_rad\na,0,0,0,0\n";
    fault("truth.csv", only_a, "dataset.toml:12: run \"b\" has odometry but no rows in truth.csv; expected");
    let message = Case::good().with("truth.csv", only_a).with("points.csv", POINTS).message();
    assert!(
        message.starts_with("dataset.toml:12: run \"b\" has odometry but no rows in truth.csv, points.csv;"),
        "{message}"
    );
    fault(
        "points.csv",
        POINTS.replace("left", "nose"),
        "points.csv:2: column point: point \"nose\" is not in dataset.toml; the points there are: left",
    );
}

#[test]
fn keys_units_and_sizes() {
    toml("format = 1\n", "", "dataset.toml:1: missing field `format`");
    toml("format = 1", "format = 2\nrobots = 7", "dataset.toml:1: format = 2 is not known here; expected format = 1");
    toml("format = 1", "format = 1\nlicense = \"MIT\"", "dataset.toml:2: unknown field `license`, expected one of");
    toml("wheel_separation_m = 0.3\n", "", "dataset.toml:2: missing field `wheel_separation_m`");
    toml("ticks_per_rev = 2000\n", "", "dataset.toml:2: missing key ticks_per_rev; odometry.csv has ticks");
    toml(
        "wheel_separation_m = 0.3",
        "wheel_separation_mm = 300",
        "dataset.toml:5: unknown field `wheel_separation_mm`, expected one of `id`, `left_wheel_diameter_m`",
    );
    toml("= 0.3", "= \"0.3\"", "dataset.toml:5: invalid type: string \"0.3\", expected");
    toml("= 0.3", "= 0", "dataset.toml:5: wheel_separation_m = 0; expected a positive finite number");
    toml("= 0.3", "= nan", "dataset.toml:5: wheel_separation_m = NaN; expected a positive finite number");
    toml(
        "left_wheel_diameter_m = 0.1",
        "left_wheel_diameter_m = -0.1",
        "dataset.toml:3: left_wheel_diameter_m = -0.1;",
    );
    toml("= 2000", "= inf", "dataset.toml:6: ticks_per_rev = inf; expected a positive finite number");
    toml(
        "= 2000",
        "= 2000\ncounter_bits = 64",
        "dataset.toml:7: counter_bits = 64; expected a width from 2 to 63 bits",
    );
    toml("[robot]", "[robot]\nid = \" 7\"", "dataset.toml:3: [robot] id: \" 7\" is no id; expected a text");
    toml("format = 1", "format = 1\nrecorded = \"2026-11-23\"", "dataset.toml:2: recorded: \"2026-11-23\" is no such");
    toml(
        "format = 1",
        "format = 1\nrecorded = 2026-11-23T08:00:00",
        "dataset.toml:2: recorded: \"2026-11-23T08:00:00\"",
    );
    toml(
        "format = 1",
        "format = 1\nrecorded = 7",
        "dataset.toml:2: key recorded is of type integer; expected an instant",
    );
    toml("sigma_xy_m = 0.001", "sigma_xy_m = -1", "dataset.toml:8: sigma_xy_m = -1; expected a positive");
    toml("sigma_xy_m", "sigma_xy_mm", "dataset.toml:8: unknown field `sigma_xy_mm`, expected");
    for (key, expected) in [
        ("side_mm", "side_m"),
        ("length_cm", "length_m"),
        ("turn_deg", "turn_rad"),
        ("radius_mm", "radius_m"),
        ("start_ms", "start_s"),
        ("side", "side_m"),
    ] {
        let message = format!("dataset.toml:11: key {key} is not in SI units; expected {expected}");
        toml("payload_kg", key, &message);
    }
    toml(
        "payload_kg = 2",
        "payload_kg = \"2\"",
        "dataset.toml:11: key payload_kg is of type string; expected a number",
    );
    toml("payload_kg = 2", "payload_kg = nan", "dataset.toml:11: payload_kg = NaN; expected a finite number");
    toml("payload_kg = 2", "side_m = 0", "dataset.toml:11: side_m = 0; expected a positive finite number");
    toml(
        "payload_kg = 2",
        "protocol = \"loop\"",
        "dataset.toml:11: protocol: unknown variant `loop`, expected one of `straight`",
    );
    toml(
        "payload_kg = 2",
        "continuous = 1",
        "dataset.toml:11: key continuous is of type integer; expected true or false",
    );
    toml("id = \"b\"", "id = \"a\"", "dataset.toml:13: a second run with id \"a\"; the first is in line 10");
    toml("id = \"b\"", "id = \"\"", "dataset.toml:13: id \"\": expected a text that is not empty");
    toml("id = \"b\"", "id = \"x\\ny\"", "dataset.toml:13: id \"x\\ny\": expected a text without line ends");
    toml("id = \"b\"", "", "dataset.toml:12: missing key id of a [[run]]");
    toml("y_m = 0.25", "y_m = inf", "dataset.toml:17: y_m = inf; expected a finite number");
    toml("[truth]", "[truth", "dataset.toml:7: ");
    fault("dataset.toml", &TOML[..TOML.find("[[run]]").expect("runs")], "dataset.toml:1: no [[run]]; expected one");
}

#[test]
fn a_sigma_of_zero_is_unknown() {
    let zero = TRUTH.replace("theta_rad\n", "theta_rad,sigma_theta_rad\n").replace("0.1\n", "0.1,0.002\n");
    let zero = zero.replace("a,0,0,0,0\n", "a,0,0,0,0,0\n").replace(",\n", ",,\n");
    let case = Case::good().with("dataset.toml", TOML.replace("0.001", "0.0")).with("truth.csv", zero);
    let dataset = read(case.path()).expect("no fault").dataset;
    assert_eq!(dataset.truth_noise.sigma_xy_m, None);
    let sigmas = dataset.runs[0].truth_sigma.as_ref().expect("one is known");
    assert_eq!((sigmas[0].sigma_theta_rad, sigmas[1].sigma_theta_rad), (None, Some(0.002)));
    assert_eq!(dataset.runs[1].truth_sigma, None);
}

#[test]
fn a_counter_that_wraps_is_kept_and_named() {
    let rows = "a,0,32700,0\na,1,32750,1\na,2,-32736,2\na,3,-32686,3\nb,0,0,0\n";
    let case = Case::good().with("odometry.csv", format!("run,t_s,left_ticks,right_ticks\n{rows}"));
    let loaded = read(case.path()).expect("no fault");
    assert_eq!(loaded.warnings, [Warning::CounterWraps { run: "a".into(), side: Side::Left, bits: 16 }]);
    assert_eq!(loaded.dataset.runs[0].odometry.t_s.len(), 4);
    let message = loaded.warnings[0].to_string();
    assert!(message.contains("run \"a\": the left tick counter") && message.contains("counter_bits = 16"), "{message}");
}

#[test]
fn a_counter_that_leaves_its_place_for_a_row_is_a_spike() {
    let rows = "a,0,0,0\na,1,50,1\na,2,4000000000,2\na,3,150,3\na,4,200,4\nb,0,0,0\n";
    let case = Case::good().with("odometry.csv", format!("run,t_s,left_ticks,right_ticks\n{rows}"));
    let loaded = read(case.path()).expect("no fault");
    let spike = Warning::CounterSpike { run: "a".into(), side: Side::Left, row: 3, t_s: 2.0, ticks: 4_000_000_000 };
    assert_eq!(loaded.warnings, [spike]);
    assert!(loaded.warnings[0].to_string().contains("reads 4000000000 at 2 s, row 3 of the run"));
}

#[test]
fn counts_may_be_written_with_a_point() {
    let pointed = ODOMETRY.replace("10,12", "10.0,12.00");
    let counted = |case: Case| read(case.path()).expect("no fault").dataset;
    assert_eq!(counted(Case::good().with("odometry.csv", pointed)), counted(Case::good()));
    odometry("a,0,3.5,0\n", "odometry.csv:2: column left_ticks: \"3.5\" is not a count");
    odometry("a,0,1e17.0,0\n", "odometry.csv:2: column left_ticks: \"1e17.0\" is not a count");
}

/// What a fault's message says behind its place.
#[track_caller]
fn hints(file: &str, content: impl AsRef<[u8]>, expected: &str) {
    let message = Case::good().with(file, content).message();
    assert!(message.contains(expected), "\nfound    {message}\nexpected … {expected} …");
}

#[test]
fn what_was_likely_meant_is_said() {
    hints("odometry.csv", ODOMETRY.replace(',', ";"), "semicolons separate the fields where commas are expected");
    hints("odometry.csv", ODOMETRY.replace(',', "\t"), "tabs separate the fields");
    hints("odometry.csv", ODOMETRY.replace("0.1", "0,1"), "5 fields; expected 4 as in the header; decimal commas?");
    hints("odometry.csv", ODOMETRY.replace("0.1", "\"0,1\""), "with a decimal point and no comma");
    hints(
        "odometry.csv",
        ODOMETRY.replace("left_ticks,right_ticks", "enc_l,enc_r"),
        "; likely run=run, t=t_s, left=enc_l, right=enc_r: yair import csv",
    );
    hints("truth.csv", TRUTH.replace(",theta_rad", ",heading"), "likely run=run, t=t_s, x=x_m, y=y_m, theta=heading");
    hints("truth.csv", "run,t_s,x_m,y_m\na,0,0,0\n", "leave the column empty");
    let cut = &TOML[..TOML.find("_m = 0.3").expect("a key")];
    hints("dataset.toml", cut, "dataset.toml:5: the file may be cut off at line 5");
    hints(
        "dataset.toml",
        TOML.replace("left_wheel_diameter_m", "left_wheel_radius_m"),
        "a diameter is twice the radius",
    );
    let large = TOML.replace("_diameter_m = 0.1", "_diameter_m = 160").replace("= 0.3", "= 363");
    let warnings = read(Case::good().with("dataset.toml", large).path()).expect("no fault").warnings;
    assert_eq!(warnings.len(), 3);
    assert!(
        warnings[2]
            .to_string()
            .ends_with("wheel_separation_m = 363 is in metres; is it 0.363 m, written in millimetres?")
    );
}

#[test]
fn text_that_is_none() {
    fault("dataset.toml", b"format = 1\nname = \"\xff\"\n", "dataset.toml:2: not UTF-8 text");
    fault("odometry.csv", b"run,t_s\xff\n", "odometry.csv:1: not UTF-8 text");
    fault("odometry.csv", b"run,t_s,left_ticks,right_ticks\na,0,\xff,0\n", "odometry.csv:2: not UTF-8 text");
    fault("odometry.csv", b"run,t_s,left_ticks,right_ticks\n\xff,0,0,0\n", "odometry.csv:2: not UTF-8 text");
    odometry("\"a,0,0,0\na,1,0,0\n", "odometry.csv:2: a quoted field must end on its line");
    // A UTF-16 file as spreadsheets save it.
    let utf16: Vec<u8> = ODOMETRY.encode_utf16().flat_map(u16::to_le_bytes).collect();
    fault("odometry.csv", [&[0xff, 0xfe][..], &utf16].concat(), "odometry.csv:1: not UTF-8 text");
}

#[test]
fn what_is_no_file_and_no_folder() {
    let message = Case::good().without("odometry.csv").message();
    assert!(message.starts_with("odometry.csv: no such file; expected a header like run,t_s"), "{message}");
    let message = Case::good().without("dataset.toml").message();
    assert!(message.starts_with("dataset.toml: no such file; expected a dataset's format"), "{message}");
    let case = Case::good().without("odometry.csv");
    fs::create_dir(case.path().join("odometry.csv")).expect("made");
    assert!(
        case.message().starts_with("odometry.csv: is a folder, where a file belongs; expected"),
        "{}",
        case.message()
    );
    let case = Case::good().without("truth.csv");
    assert!(matches!(case.error(), DatasetError::NoTruth { .. }));
    assert!(case.error().to_string().contains("truth.csv, displacement.csv, points.csv and wheel_reference.csv"));
    fs::create_dir(case.path().join("truth.csv")).expect("made");
    assert!(case.message().starts_with("truth.csv: is a folder, where a file belongs; expected"), "{}", case.message());
    for (wrong, expected) in [("absent", "no such folder"), ("dataset.toml", "is a file, where a folder belongs")] {
        let message = read(&case.path().join(wrong)).expect_err("no folder").to_string();
        assert!(message.contains(&format!("{wrong}: {expected}; expected a dataset")), "{message}");
    }
}

#[test]
fn garbage_is_refused_by_its_first_line() {
    // Bytes that hold line ends, quotes and commas now and then, as a binary file does.
    let garbage: Vec<u8> = (0..1_u32 << 20).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for file in ["dataset.toml", "odometry.csv", "truth.csv", "points.csv"] {
        fault(file, &garbage, &format!("{file}:1: not UTF-8 text"));
    }
    fault("odometry.csv", vec![0; 1 << 20], "odometry.csv:1: line longer than 65536 bytes; is this the right file?");
    fault("odometry.csv", [ODOMETRY.as_bytes(), &vec![b'7'; 1 << 20]].concat(), "odometry.csv:6: line longer than");
    let many_columns = vec!["column"; 5000].join(",");
    let message = Case::good().with("odometry.csv", many_columns).message();
    assert!(message.len() < 1000, "{message}");
}

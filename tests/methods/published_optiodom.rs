//! The published numbers of Sousa et al. (J Intell Robot Syst 105, 39, 2022), from their logs: errors under
//! the nominal values, and UMBmark.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::real_data::real_data;
use crate::support::{document, succeed};
use calib::methods::umbmark::{Form, Umbmark};
use calib::{CalibrationReport, Method};
use dataset::import::importer;
use dataset::{Dataset, Protocol, WheelLog};
use kinematics::{DriveGeometry, Pose, Rule, Wheels, wrap_to_pi};

/// One unit of the last published digit. Rounding explains half of it; that it is enough was seen, and that
/// each wrong specimen below misses it.
const LAST_DIGIT: f64 = 1e-6;

/// A row of `published-results.csv`, by column.
struct Row {
    columns: Vec<String>,
    fields: Vec<String>,
}

impl Row {
    fn text(&self, column: &str) -> &str {
        let position = self.columns.iter().position(|name| name == column).expect("a published column");
        &self.fields[position]
    }

    fn number(&self, column: &str) -> f64 {
        self.text(column).parse().expect("a number")
    }

    /// Separation, left and right diameter from columns with this prefix.
    fn geometry(&self, prefix: &str) -> DriveGeometry {
        let value = |key: &str| self.number(&format!("{prefix}{key}_m"));
        let diameter_m = Wheels { left: value("left_diameter"), right: value("right_diameter") };
        DriveGeometry::new(diameter_m, value("wheel_separation")).expect("a published geometry")
    }

    /// Largest position and heading error, largest final ones; metres and degrees.
    fn nominal_errors(&self) -> [f64; 4] {
        ["max_position_m", "max_heading_deg", "max_final_position_m", "max_final_heading_deg"]
            .map(|column| self.number(&format!("nominal_{column}")))
    }

    fn calibration_file(&self) -> String {
        let nominal = self.geometry("nominal_");
        format!(
            "[[methods]]\nmethod = \"row\"\n[methods.parameters]\nleft_wheel_diameter_m = {}\nright_wheel_diameter_m = {}\n\
             wheel_separation_m = {}\n",
            nominal.wheel_diameter_m().left,
            nominal.wheel_diameter_m().right,
            nominal.wheel_separation_m()
        )
    }
}

fn published(folder: &Path) -> Vec<Row> {
    let text = fs::read_to_string(folder.join("published-results.csv")).expect("the published table");
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let columns = lines.next().expect("a header");
    let rows: Vec<_> = lines.map(|fields| Row { columns: columns.clone(), fields }).collect();
    assert_eq!(rows.len(), 26, "rows of June 2020");
    rows
}

fn import(session: &Path) -> Dataset {
    let mut imported = importer("optiodom").expect("the importer").read(session).expect("a session");
    assert_eq!(imported.len(), 1);
    imported.remove(0).dataset
}

fn agree<const N: usize>(found: [f64; N], published: [f64; N]) -> bool {
    found.iter().zip(published).all(|(found, published)| (found - published).abs() <= LAST_DIGIT)
}

/// What `yair evaluate` finds under the row's nominal values, in the published units.
fn evaluated(dataset: &Dataset, row: &Row) -> [f64; 4] {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let file = temp.path().join("row.toml");
    fs::write(&file, row.calibration_file()).expect("written");
    let calibration = &CalibrationReport::read(&file).expect("a calibration file").calibrations()[0];
    let drift = calib::evaluate(&[dataset.session()], Some(calibration), false);
    [
        drift.max_position_m,
        drift.max_heading_rad.map(f64::to_degrees),
        drift.max_final_position_m,
        drift.max_final_heading_rad.map(f64::to_degrees),
    ]
    .map(|value| value.expect("absolute truth"))
}

/// The same numbers by another way: rows and truth share their instants in these logs.
fn by_hand(dataset: &Dataset, geometry: &DriveGeometry, rule: Rule) -> [f64; 4] {
    let mut largest = [0.0_f64; 4];
    for (view, run) in dataset.session().runs.iter().zip(&dataset.runs) {
        let truth = |row: usize| {
            let sample = &run.truth[row];
            Pose::new(sample.x_m, sample.y_m, sample.theta_rad().expect("a heading"))
        };
        let mut row = 0;
        view.dead_reckon(&dataset.robot, geometry, rule, truth(0), |_, pose| {
            let seen = truth(row);
            let position_m = (pose.x_m - seen.x_m).hypot(pose.y_m - seen.y_m);
            let heading_deg = wrap_to_pi(pose.theta_rad - seen.theta_rad).abs().to_degrees();
            row += 1;
            largest[0] = largest[0].max(position_m);
            largest[1] = largest[1].max(heading_deg);
            if row == run.truth.len() {
                largest[2] = largest[2].max(position_m);
                largest[3] = largest[3].max(heading_deg);
            }
        });
        assert_eq!(row, run.truth.len());
    }
    largest
}

fn with_wheels_swapped(dataset: &Dataset) -> Dataset {
    let mut swapped = dataset.clone();
    for run in &mut swapped.runs {
        let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { panic!("ticks") };
        std::mem::swap(&mut ticks.left, &mut ticks.right);
    }
    swapped
}

/// Started from the second truth row: the first is the origin, so a start from the origin is right here.
fn started_a_row_late(dataset: &Dataset) -> Dataset {
    let mut moved = dataset.clone();
    for run in &mut moved.runs {
        assert_eq!((run.truth[0].x_m, run.truth[0].y_m, run.truth[0].theta_rad()), (0.0, 0.0, Some(0.0)));
        let second = &run.truth[1];
        run.truth[0] = dataset::TruthSample::new(run.truth[0].t_s, second.x_m, second.y_m, second.theta_rad());
    }
    moved
}

/// What an importer makes of exchanged columns: the counts, and the ways round that it reads off them.
fn with_ways_round_swapped(dataset: &Dataset) -> Dataset {
    let mut swapped = with_wheels_swapped(dataset);
    for run in &mut swapped.runs {
        run.info.protocol = match run.info.protocol {
            Some(Protocol::SquareCw) => Some(Protocol::SquareCcw),
            Some(Protocol::SquareCcw) => Some(Protocol::SquareCw),
            other => panic!("{other:?} among the squares"),
        };
    }
    swapped
}

#[test]
fn published_optiodom_nominal() {
    let Some(folder) = real_data("published_optiodom_nominal", "optiodom") else { return };
    let (mut circles_by_the_exact_arc, mut from_the_second_row) = (0, 0);
    for row in published(&folder) {
        let name = format!("{} {}", row.text("method"), row.text("session"));
        let dataset = import(&folder.join(row.text("session")));
        assert_eq!(dataset.runs.len().to_string(), row.text("runs"), "{name}");
        let errors = row.nominal_errors();
        let found = evaluated(&dataset, &row);
        assert!(agree(found, errors), "{name}: {found:?}, published {errors:?}");
        let nominal = row.geometry("nominal_");
        let found = by_hand(&dataset, &nominal, Rule::Midpoint);
        assert!(agree(found, errors), "{name} by hand: {found:?}, published {errors:?}");

        // What must not pass.
        assert!(!agree(evaluated(&with_wheels_swapped(&dataset), &row), errors), "{name}: swapped wheels");
        from_the_second_row += u32::from(agree(evaluated(&started_a_row_late(&dataset), &row), errors));
        if row.text("session").contains("circular") {
            circles_by_the_exact_arc += u32::from(agree(by_hand(&dataset, &nominal, Rule::ExactArc), errors));
        }
    }
    assert_eq!((circles_by_the_exact_arc, from_the_second_row), (0, 0), "rows that a wrong specimen reproduced");
}

/// Every session through the command, from the logs to the document: under each row's values, and as
/// `nominal` where the row's are the session's.
#[test]
fn published_optiodom_nominal_through_the_command() {
    let Some(folder) = real_data("published_optiodom_nominal_through_the_command", "optiodom") else { return };
    let temp = tempfile::tempdir().expect("a temporary folder");
    let source = folder.display().to_string();
    let imported = document(temp.path(), &["import", "optiodom", &source, "--out", "sessions"]);
    assert_eq!(imported["datasets"].as_array().map(Vec::len), Some(14));
    let (mut as_nominal, mut others) = (0, 0);
    for row in published(&folder) {
        fs::write(temp.path().join("row.toml"), row.calibration_file()).expect("written");
        let session = PathBuf::from(row.text("session"));
        let set = Path::new("sessions").join(session.file_name().expect("a session")).display().to_string();
        let found = document(temp.path(), &["evaluate", &set, "--calibration", "row.toml"]);
        let errors = |entry: usize| {
            let entry = &found["calibrations"][entry];
            let value = |key: &str| entry[key].as_f64().expect("a number");
            [
                value("max_position_m"),
                value("max_heading_rad").to_degrees(),
                value("max_final_position_m"),
                value("max_final_heading_rad").to_degrees(),
            ]
        };
        assert_eq!(found["calibrations"][1]["name"], "row");
        assert!(agree(errors(1), row.nominal_errors()), "{set}: {:?}", errors(1));
        let robot = dataset::read(&temp.path().join(&set)).expect("imported").dataset.robot;
        if robot.geometry().expect("nominal") == row.geometry("nominal_") {
            assert!(agree(errors(0), row.nominal_errors()), "{set}: {:?}", errors(0));
            as_nominal += 1;
        } else {
            // Rows that start from other values than the session's: the session's must not pass for them.
            assert!(!agree(errors(0), row.nominal_errors()), "{set}: {:?}", errors(0));
            others += 1;
        }
    }
    // Counted by a script over metadata and table.
    assert_eq!((as_nominal, others), (18, 8));
}

#[test]
fn published_optiodom_umbmark() {
    let Some(folder) = real_data("published_optiodom_umbmark", "optiodom") else { return };
    let rows: Vec<_> = published(&folder).into_iter().filter(|row| row.text("method") == "umbmark").collect();
    assert_eq!(rows.len(), 4);
    for row in rows {
        let source = folder.join(row.text("session"));
        let dataset = import(&source);
        assert_eq!(dataset.robot.geometry().expect("nominal"), row.geometry("nominal_"), "{}", row.text("session"));
        let expected = row.geometry("");
        let expected =
            [expected.wheel_separation_m(), expected.wheel_diameter_m().right, expected.wheel_diameter_m().left];

        let temp = tempfile::tempdir().expect("a temporary folder");
        succeed(temp.path(), &["import", "optiodom", &source.display().to_string(), "--out", "set"]);
        let found = document(temp.path(), &["calibrate", "set", "--method", "umbmark"]);
        let found = ["wheel_separation_m", "right_wheel_diameter_m", "left_wheel_diameter_m"]
            .map(|key| found["methods"][0]["parameters"][key]["value"].as_f64().expect("a value"));
        assert!(agree(found, expected), "{}: {found:?}, published {expected:?}", row.text("session"));

        // What must not pass: the wheels swapped (the x form sees no swap of the counts alone), and the other
        // form of UMBmark.
        let by = |method: Umbmark, dataset: &Dataset| {
            let geometry = method.calibrate(&[dataset.session()]).expect("squares both ways").geometry;
            [geometry.wheel_separation_m(), geometry.wheel_diameter_m().right, geometry.wheel_diameter_m().left]
        };
        let default = Umbmark::DEFAULT;
        assert!(agree(by(default, &dataset), expected), "{}: the library", row.text("session"));
        let swapped = with_ways_round_swapped(&dataset);
        assert!(!agree(by(default, &swapped), expected), "{}: swapped wheels", row.text("session"));
        let other = if matches!(default.form, Form::X) { Form::Y } else { Form::X };
        assert!(!agree(by(Umbmark { form: other }, &dataset), expected), "{}: {other:?}", row.text("session"));
    }
}

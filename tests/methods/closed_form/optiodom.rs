//! `ivanjko` and Jung & Chung's method on the logs of Sousa et al. (2022): the published parameters come out.

use std::path::Path;

use calib::methods::ivanjko::Ivanjko;
use calib::methods::jung_chung::JungChung;
use calib::{Method, Parameter};
use dataset::Dataset;
use dataset::import::importer;

use super::{as_optiodom, lengths, swapped_counts};
use crate::support::real_data::real_data;

fn optiodom(session: &Path) -> Dataset {
    let mut imported = importer("optiodom").expect("the importer").read(session).expect("a session");
    assert_eq!(imported.len(), 1);
    imported.remove(0).dataset
}

/// Sessions of one method in `published-results.csv` with what was published: the dataset on the row's
/// nominal values; left and right diameter and base.
fn published(folder: &Path, method: &str) -> Vec<(String, Dataset, [f64; 3])> {
    let text = std::fs::read_to_string(folder.join("published-results.csv")).expect("the published table");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let columns = lines.next().expect("a header");
    let rows = lines.filter(|fields| fields[0] == method).map(|fields| {
        let number = |column: &str| -> f64 {
            let position = columns.iter().position(|name| *name == column).expect("a published column");
            fields[position].parse().expect("a number")
        };
        let mut dataset = optiodom(&folder.join(fields[1]));
        dataset.robot.wheel_separation_m = number("nominal_wheel_separation_m");
        dataset.robot.left_wheel_diameter_m = number("nominal_left_diameter_m");
        dataset.robot.right_wheel_diameter_m = number("nominal_right_diameter_m");
        let values = ["left_diameter_m", "right_diameter_m", "wheel_separation_m"].map(number);
        (fields[1].to_owned(), dataset, values)
    });
    rows.collect()
}

/// One unit of the last published digit: rounding explains half of it.
fn agree(found: [f64; 3], published: [f64; 3]) -> bool {
    found.iter().zip(published).all(|(found, published)| (found - published).abs() <= 1e-6)
}

#[test]
fn published_optiodom_ivanjko() {
    let Some(folder) = real_data("published_optiodom_ivanjko", "optiodom") else { return };
    let rows = published(&folder, "ivanjko");
    assert_eq!(rows.len(), 4);
    for (session, dataset, published) in rows {
        let found = Ivanjko.calibrate(&[dataset.session()]).expect("straights and spins");
        assert!(
            found.converged && agree(lengths(&found), published),
            "{session}: {:?}, published {published:?}",
            lengths(&found)
        );
        // What must not pass: the wheels swapped, one direction of the spins, and the chord of the whole run
        // in place of its end.
        let mut swapped = dataset.clone();
        swapped_counts(&mut swapped);
        assert!(
            !Ivanjko.calibrate(&[swapped.session()]).is_ok_and(|found| agree(lengths(&found), published)),
            "{session}: swapped wheels"
        );
        let one_way = dataset.session_of(|info| info.settings.turn_rad.is_none_or(|turn_rad| turn_rad > 0.0));
        let one_way = Ivanjko.calibrate(&[one_way]).expect("straights and spins");
        assert!(!agree(lengths(&one_way), published), "{session}: spins one way");
        let direct =
            calib::methods::direct::Direct::DEFAULT.calibrate(&[dataset.session()]).expect("straights and spins");
        assert!(!agree(lengths(&direct), published), "{session}: direct");
    }
}

/// The published values of Jung & Chung's method come out to the last digit when the mean heading is divided
/// by the runs twice, and only then.
#[test]
fn published_optiodom_jung_chung_is_divided_twice() {
    let Some(folder) = real_data("published_optiodom_jung_chung_is_divided_twice", "optiodom") else { return };
    let rows = published(&folder, "jung_chung");
    assert_eq!(rows.len(), 4);
    for (session, dataset, published) in rows {
        assert!(agree(as_optiodom(&dataset, true), published), "{session}: {:?}", as_optiodom(&dataset, true));
        assert!(!agree(as_optiodom(&dataset, false), published), "{session}: divided once");
        let found = lengths(&JungChung.calibrate(&[dataset.session()]).expect("squares both ways"));
        let nominal_m = dataset.robot.wheel_separation_m;
        // A second division by three or five leaves a third or a fifth of the correction, and the corner's
        // term takes a little of it.
        let share = (published[2] - nominal_m) / (found[2] - nominal_m);
        assert!((0.15..0.36).contains(&share), "{session}: {share}");
    }
}

/// docs/calibration.md, "On logged sessions": `| method | kind/session | B | D_R | D_L |` in millimetres,
/// each with its sigma.
#[test]
fn optiodom_sessions_stand_in_the_document_as_found() {
    let Some(folder) = real_data("optiodom_sessions_stand_in_the_document_as_found", "optiodom") else { return };
    let document =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/calibration.md")).expect("read");
    let mut rows = 0;
    // Tables of other things have no errors.
    for row in document.lines().filter(|line| line.starts_with("| `") && line.contains(" ± ")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let method = calib::method(cells[0].trim_matches('`')).expect("a method");
        let dataset = optiodom(&folder.join("diff").join(cells[1]));
        let found = method.calibrate(&[dataset.session()]).expect("applies");
        let of = |parameter| {
            let estimate = found.estimate(parameter).expect("estimated");
            let sigma = estimate.sigma.map_or_else(|| "?".to_owned(), |sigma| format!("{:.3}", 1e3 * sigma));
            format!("{:.3} ± {sigma}", 1e3 * estimate.value)
        };
        let here = [Parameter::WheelSeparation, Parameter::RightWheelDiameter, Parameter::LeftWheelDiameter].map(of);
        assert_eq!(cells[2..], here, "{row}");
        rows += 1;
    }
    assert_eq!(rows, 28, "jung_chung 4, circular 6, ivanjko 4, linear 14");
}

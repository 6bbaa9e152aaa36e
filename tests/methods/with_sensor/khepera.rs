//! The published calibration of a Khepera III with a laser (Censi et al. 2013) from its logs.

use std::fs;
use std::path::Path;

use calib::methods::censi::{Censi, CensiFit};
use calib::{Calibration, Method};
use dataset::Dataset;
use dataset::import::importer;
use kinematics::{Pose, Wheels};

use crate::support::real_data::real_data;

/// The two configurations that the data have: the laser turned by 90°, and ahead.
const LOGS: [&str; 2] = ["l90", "lstraight"];

fn log(folder: &Path, name: &str) -> Dataset {
    let mut imported =
        importer("censi").expect("the importer").read(&folder.join(format!("{name}.tuple"))).expect("a log");
    imported.remove(0).dataset
}

/// What the authors' program found: `NAME_results.json`.
fn published(folder: &Path, name: &str) -> CensiFit {
    let text = fs::read_to_string(folder.join(format!("{name}_results.json"))).expect("their result");
    let result: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |key: &str| result[key].as_f64().expect("a number");
    CensiFit {
        radius_m: Wheels { left: 0.5 * number("l_diam"), right: 0.5 * number("r_diam") },
        separation_m: number("axle"),
        body_from_sensor: Pose::new(number("l_x"), number("l_y"), number("l_theta")),
    }
}

/// Largest relative difference of diameters and axle, and the distance between the sensor's places in metres.
fn off(found: &CensiFit, published: &CensiFit) -> (f64, f64) {
    let ratios = [
        found.radius_m.left / published.radius_m.left,
        found.radius_m.right / published.radius_m.right,
        found.separation_m / published.separation_m,
    ];
    let relative = ratios.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
    (relative, found.body_from_sensor.position().distance_m(published.body_from_sensor.position()))
}

fn fit(found: &Calibration) -> CensiFit {
    CensiFit {
        radius_m: found.geometry.wheel_diameter_m().map(|diameter_m| 0.5 * diameter_m),
        separation_m: found.geometry.wheel_separation_m(),
        body_from_sensor: found.extrinsics.expect("censi finds it").body_from_sensor,
    }
}

/// They print six digits: half a unit of the last one is 6e-6 of a diameter, and less of the rest. Rejected:
/// no trimming, the wheels for each other, and the pose of the robot in the sensor's frame.
#[test]
fn published_khepera() {
    let Some(folder) = real_data("published_khepera", "khepera") else { return };
    let agrees = |found: &CensiFit, published: &CensiFit| {
        let (relative, distance_m) = off(found, published);
        relative < 1e-5 && distance_m < 1e-7
    };
    for name in LOGS {
        let dataset = log(&folder, name);
        let published = published(&folder, name);
        let found = Censi::DEFAULT.calibrate(&[dataset.session()]).expect("an exciting drive");
        assert!(found.converged);
        let fitted = fit(&found);
        assert!(agrees(&fitted, &published), "{name}: {fitted:?}, published {published:?}");
        // Untrimmed, a log may even be refused: its worst displacements outweigh its translations.
        let untrimmed = Censi { rounds: 0, ..Censi::DEFAULT }.calibrate(&[dataset.session()]);
        assert!(!untrimmed.is_ok_and(|found| agrees(&fit(&found), &published)), "{name}: untrimmed");
        let swapped =
            CensiFit { radius_m: Wheels { left: fitted.radius_m.right, right: fitted.radius_m.left }, ..fitted };
        assert!(!agrees(&swapped, &published), "{name}: wheels swapped");
        let inverse = CensiFit { body_from_sensor: fitted.body_from_sensor.inverse(), ..fitted };
        assert!(!agrees(&inverse, &published), "{name}: the robot in the sensor's frame");
    }
}

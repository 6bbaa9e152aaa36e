//! Calibration files: what was written is what is read.

use std::path::PathBuf;

use calib::{CalibrationReport, METHODS, MethodReport, Names, ReportError};

use crate::log::Log;

/// The file of a text; each test has its own.
fn file_of(test: &str, text: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("yair-{test}-{}.toml", std::process::id()));
    std::fs::write(&path, text).expect("written");
    path
}

fn read(test: &str, text: &str) -> Result<CalibrationReport, ReportError> {
    let path = file_of(test, text);
    let read = CalibrationReport::read(&path);
    std::fs::remove_file(path).expect("removed");
    read
}

/// Reading left out the profile interval and why there is no standard deviation.
#[test]
fn regress_a_calibration_file_gives_every_word_of_its_values_back() {
    let dataset = Log::noisy(4).dataset();
    let sessions = [dataset.session()];
    let of = |method: &&dyn calib::Method| {
        let mut report = MethodReport::new(method.name(), &method.calibrate(&sessions), &dataset.robot);
        for value in report.parameters.values_mut() {
            value.interval_95 = value.value.map(|value| [value - 1e-3, value + 2e-3]);
        }
        let last = report.parameters.values_mut().next_back().expect("a value");
        (last.sigma, last.sigma_why_null) = (None, Some("too few runs to show a scatter".to_owned()));
        report
    };
    let written = CalibrationReport {
        dataset: Names::of(vec!["known robot".to_owned()]),
        trained_on: Vec::new(),
        methods: METHODS.iter().map(of).collect(),
    };
    let ratios = written.methods.iter().flat_map(|method| method.parameters.values());
    assert!(ratios.filter(|value| value.ratio_to_nominal.is_some()).count() > METHODS.len(), "no ratio to lose");
    let read = read("words", &written.to_toml().expect("it has a form")).expect("readable");
    assert_eq!(read, written);
}

#[test]
fn lengths_of_a_calibration_file_are_positive_and_positions_of_a_sensor_have_either_sign() {
    let of = |key: &str, value: &str| {
        read("lengths", &format!("[[methods]]\nmethod = \"x\"\n[methods.parameters]\n{key} = {value}\n"))
    };
    for key in ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m", "left_m_per_tick"] {
        assert_eq!(of(key, "0.1").expect("a length").calibrations()[0].values[key], 0.1);
        for value in ["0.0", "-0.1", "inf", "nan"] {
            let refused = of(key, value).expect_err("no length").to_string();
            assert!(refused.contains(key) && refused.contains("lengths are positive"), "{refused}");
        }
    }
    for key in ["sensor_x_m", "sensor_y_m", "sensor_theta_rad", "latency_s"] {
        for value in ["-0.1", "0.0", "0.1"] {
            assert!(of(key, value).is_ok(), "{key} = {value}");
        }
        assert!(of(key, "inf").is_err() && of(key, "nan").is_err(), "{key}");
    }
    assert!(of("wheel_seperation_m", "0.1").expect_err("a typo").to_string().contains("known: left_wheel_diameter_m"));
}

#[test]
fn bare_numbers_are_values() {
    let text = "[[methods]]\nmethod = \"published\"\n[methods.parameters]\nwheel_separation_m = 0.2\n";
    let found = read("numbers", text).expect("readable").calibrations();
    assert_eq!((found.len(), found[0].values["wheel_separation_m"]), (1, 0.2));
}

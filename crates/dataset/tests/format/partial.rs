//! Partial measurements and a gyroscope, read and refused.

use dataset::read;

use crate::bad_input::{Case, TOML};

/// What a tape, a wall or a place that is come back to says, and the faults of it.
#[test]
fn partial_measurements_are_read_and_their_faults_named() {
    let revisit =
        |row: &str| Case::good().with("revisit.csv", format!("run,t0_s,t1_s,sigma_xy_m,sigma_theta_rad\n{row}\n"));
    let read_back = read(revisit("a,0,0.1,,0.01").path()).expect("readable").dataset;
    let of = read_back.runs[0].revisits[0];
    assert_eq!((of.dx_m, of.dy_m, of.dtheta_rad), (None, None, Some(0.0)));
    assert_eq!((of.sigma_xy_m, of.sigma_theta_rad), (None, Some(0.01)));
    let message = |case: Case| case.error().to_string();
    assert!(message(revisit("a,0,0.1,,")).contains("revisit.csv:2: the row measures nothing"));
    assert!(message(revisit("a,0,0.1,0,0.1")).contains("revisit.csv:2: sigma_xy_m = 0; expected a positive"));
    assert!(message(revisit("a,0.1,0.1,0.1,0.1")).contains("expected an end after its start"));
    let tape = |row: &str| Case::good().with("distance.csv", format!("run,t0_s,t1_s,distance_m,sigma_m\n{row}\n"));
    assert_eq!(read(tape("b,0,0.1,1.5,0.002").path()).expect("readable").dataset.runs[1].distances[0].distance_m, 1.5);
    assert!(message(tape("b,0,0.1,1.5,")).contains("sigma_m"));
    assert!(message(tape("b,0,0.1,0,0.002")).contains("a return is one of revisit.csv"));
    let wall = |row: &str| {
        Case::good().with("wall.csv", format!("run,t_s,wall,distance_m,heading_rad,sigma_m,sigma_rad\n{row}\n"))
    };
    let walls = read(wall("a,0,north,1.5,,0.01,\na,0.1,north,,0.2,,0.01").path()).expect("readable").dataset;
    assert_eq!(walls.runs[0].walls[1].heading_rad, Some(0.2));
    assert_eq!(walls.runs[0].walls[0].heading_rad, None);
    assert!(message(wall("a,0,north,1.5,,,0.01")).contains("the row measures nothing"));
    assert!(message(wall("a,0,north,1.5,0,1,1\na,0,north,1.5,0,1,1")).contains("a second row at 0 s"));
}

/// A gyroscope is truth enough; what is known of it stands in the manifest.
#[test]
fn a_gyroscope_stands_for_a_truth() {
    let odometry = "run,t_s,left_ticks,right_ticks,gyro_radps\na,0,0,0,0\na,0.1,10,12,0.1\nb,0,5,5,0\nb,0.1,7,7,0\n";
    let with = |gyro: &str| {
        let toml = TOML.replace("[truth]", &format!("[gyro]\n{gyro}\n[truth]"));
        Case::good().with("odometry.csv", odometry).with("dataset.toml", toml).without("truth.csv")
    };
    let gyro = read(with("scale_sigma = 0.01\nsampling = \"instantaneous\"").path()).expect("readable");
    let gyro = gyro.dataset.truth_noise.gyro;
    assert_eq!((gyro.scale_sigma, gyro.is_instantaneous, gyro.noise_rad_per_sqrt_s), (Some(0.01), true, None));
    assert_eq!(read(with("scale_sigma = 0").path()).expect("readable").dataset.truth_noise.gyro.scale_sigma, None);
    assert!(with("sampling = \"mean\"").error().to_string().contains("interval_end"));
    assert!(Case::good().without("truth.csv").error().to_string().contains("gyro_radps"));
}

/// The distortion of a map needs the length over which its errors resemble each other.
#[test]
fn a_map_is_stated_with_its_length_and_written_as_it_was_read() {
    let with = |keys: &str| Case::good().with("dataset.toml", TOML.replace("[truth]", &format!("[truth]\n{keys}")));
    let read = |case: Case| read(case.path()).expect("readable").dataset;
    let stated = read(with("map_sigma_xy_m = 0.02\nmap_length_m = 1.5"));
    let map = stated.truth_noise.map.expect("stated");
    assert_eq!((map.sigma_xy_m, map.sigma_theta_rad, map.length_m), (0.02, 0.0, 1.5));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let again = folder.path().join("again");
    dataset::write(&stated, &again, dataset::Existing::Refuse).expect("written");
    assert_eq!(dataset::read(&again).expect("readable").dataset, stated);
    assert_eq!(read(with("map_sigma_xy_m = 0\nmap_length_m = 1.5")).truth_noise.map, None);
    assert!(with("map_sigma_theta_rad = 0.01").error().to_string().contains("map_length_m is missing"));
    assert!(with("map_sigma_xy_m = -0.01\nmap_length_m = 1.5").error().to_string().contains("map_sigma_xy_m"));
}

/// What is read, written and read again.
fn again(dataset: &dataset::Dataset) -> dataset::Dataset {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("again");
    dataset::write(dataset, &path, dataset::Existing::Refuse).expect("written");
    read(&path).expect("readable").dataset
}

/// A row's covariance is read whole, in part or not at all, and what no covariance can be is refused with its
/// line.
#[test]
fn covariances_of_rows_are_read_and_impossible_ones_named() {
    let header = "run,t_s,x_m,y_m,theta_rad,cov_xx,cov_xy,cov_xt,cov_yy,cov_yt,cov_tt\n";
    let with = |row: &str| Case::good().with("truth.csv", format!("{header}{row}\nb,0,0,0,0,,,,,,\n"));
    let elements = |row: &str| {
        let set = read(with(row).path()).expect("readable").dataset;
        assert_eq!(again(&set).runs, set.runs, "{row}");
        set.runs[0].truth_sigma.as_ref().and_then(|rows| rows[0].covariance).map(|of| of.elements())
    };
    let full = [4e-4, 1e-4, 2e-5, 1e-4, -1e-5, 1e-4];
    assert_eq!(elements("a,0,0,0,0,4e-4,1e-4,2e-5,1e-4,-1e-5,1e-4"), Some(full));
    // Without a heading its part says nothing; zeros are what drivers without a covariance write.
    let position = [4e-4, 1e-4, 0.0, 1e-4, 0.0, 0.0];
    assert_eq!(elements("a,0,0,0,,4e-4,1e-4,2e-5,1e-4,-1e-5,1e-4"), Some(position));
    assert_eq!(elements("a,0,0,0,0,4e-4,1e-4,,1e-4,,"), Some(position));
    assert_eq!(elements("a,0,0,0,0,0,0,0,0,0,0"), None);
    let message = |row: &str| with(row).error().to_string();
    for (row, why) in [
        ("a,0,0,0,0,1e-4,2e-4,0,1e-4,0,1e-4", "not positive definite"),
        ("a,0,0,0,0,-1,0,0,1,0,1", "a variance is negative"),
        ("a,0,0,0,0,1,0,0.5,1,0,0", "with a variance of zero"),
    ] {
        let found = message(row);
        assert!(found.contains("truth.csv:2: cov_xx to cov_tt are no covariance") && found.contains(why), "{found}");
    }
    let lacking = Case::good().with("truth.csv", "run,t_s,x_m,y_m,theta_rad,cov_xx\na,0,0,0,0,1\n");
    assert!(lacking.error().to_string().contains("cov_xy"));
}

/// Rows without a position are headings, among poses or alone.
#[test]
fn headings_without_a_position_are_read_with_their_sigma() {
    let header = "run,t_s,x_m,y_m,theta_rad,sigma_theta_rad\n";
    let rows = "a,0,,,0.5,0.01\na,0.1,1,2,0.6,\na,0.2,,,0.7,\nb,0,0,0,0,\n";
    let case = |rows: &str| Case::good().with("truth.csv", format!("{header}{rows}"));
    let toml = TOML.replace("[truth]", "[truth]\nsigma_theta_rad = 0.002");
    let set = read(case(rows).with("dataset.toml", toml).path()).expect("readable").dataset;
    let headings: Vec<_> = set.runs[0].headings.iter().map(|of| (of.t_s, of.theta_rad, of.sigma_rad)).collect();
    // Where the row states none, the standard deviation is that of the manifest.
    assert_eq!((headings, set.runs[0].truth.len()), (vec![(0.0, 0.5, 0.01), (0.2, 0.7, 0.002)], 1));
    assert_eq!(again(&set).runs, set.runs);
    let message = |case: Case| case.error().to_string();
    assert!(message(case("a,0,,,,\nb,0,0,0,0,\n")).contains("truth.csv:2: the row measures nothing"));
    assert!(message(case("a,0.1,1,2,0.6,\na,0,,,0.5,\nb,0,0,0,0,\n")).contains("truth.csv:3"));
    assert!(message(case("a,0,1,,0.6,\nb,0,0,0,0,\n")).contains("y_m"));
    assert!(message(case(rows)).contains("truth.csv:4: the row measures nothing; expected a value and its standard"));
}

/// A gyroscope with instants of its own: means over the rows' intervals.
#[test]
fn a_gyroscope_may_have_its_own_instants() {
    let rows = "run,t_s,omega_radps\na,0,0.2\na,0.05,0.4\na,0.1,0.2\nb,0,0\nb,0.1,0.1\n";
    let set = read(Case::good().with("gyro.csv", rows).without("truth.csv").path()).expect("readable").dataset;
    let rates = set.runs[0].gyro_rates().expect("a gyroscope");
    // Two trapezoids of 0.3 rad/s; sums of some 0.01 rad.
    assert!(rates[0].is_nan() && (rates[1] - 0.3).abs() < 1e-12, "{rates:?}");
    assert_eq!(again(&set).runs, set.runs);
    let both = "run,t_s,left_ticks,right_ticks,gyro_radps\na,0,0,0,0\na,0.1,10,12,7\nb,0,5,5,0\nb,0.1,7,7,0\n";
    let loaded = read(Case::good().with("gyro.csv", rows).with("odometry.csv", both).path()).expect("readable");
    let rates = loaded.dataset.runs[0].gyro_rates().expect("a gyroscope");
    assert!((rates[1] - 0.3).abs() < 1e-12, "{rates:?}");
    let said: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|line| line.contains("gyro_radps") && line.contains("gyro.csv")), "{said:?}");
    let back = rows.replace("a,0.1,0.2", "a,0.05,0.2");
    assert!(Case::good().with("gyro.csv", back).error().to_string().contains("gyro.csv:4"));
}

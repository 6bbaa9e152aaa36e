//! `ros2-yaml`: parameters of ROS 2's `diff_drive_controller`.
//!
//! The controller goes by `wheel_separation · wheel_separation_multiplier` and, side by side, by
//! `wheel_radius · …_wheel_radius_multiplier`. The file has nominal lengths with multipliers, or the
//! calibrated geometry with a separation's multiplier of 1 and wheels' multipliers about 1: there is one
//! radius, so that they alone can hold the difference of the wheels.
//!
//! Covariance: with wheels that scatter by k·√s over a travel s, a speed v that is measured over an interval
//! of 1/f has per wheel a variance of k² v f; the mean of both has half of it, their difference over the
//! separation b gives 2 k² v f/b² of the yaw rate. The pose's is that of dead reckoning after a metre
//! straight on (`kinematics::OdometryCovariance`).
//! Reference: diff_drive_controller's `diff_drive_controller_parameter.yaml` (ros2_controllers).

use std::fmt::Write;

use calib::OdometryNoise;
use kinematics::{OdometryCovariance, Pose, WheelNoise, Wheels};

use crate::comment::{comment, decimal, digits, limits, mm, origin, plus_minus_mm, variance, wrapped};
use crate::error::ExportError;
use crate::options::{Lengths, Options};
use crate::robot::{CalibratedRobot, Length};
use crate::settings::{POSE_TRAVEL_M, UNMEASURED_VARIANCE};

/// Decimals of lengths and multipliers: a nanometre, and 1e-9 of a length, are far below any calibration.
const DECIMALS: usize = 9;

pub(super) fn render(robot: &CalibratedRobot, options: &Options) -> Result<String, ExportError> {
    let controller = options.controller.as_deref().unwrap_or("diff_drive_controller");
    of_node(robot, options, "ros2-yaml", &[controller, "ros__parameters"])
}

/// The parameters under the keys of a node, with what they are and what they cannot express.
pub(super) fn of_node(
    robot: &CalibratedRobot,
    options: &Options,
    format: &str,
    keys: &[&str],
) -> Result<String, ExportError> {
    let mut text = origin("#", format, robot);
    let how = match options.lengths {
        Lengths::Nominal => {
            "Nominal lengths with multipliers: the controller multiplies them to the calibrated ones. \
             If the lengths of your own file differ from these, replace them too."
        }
        Lengths::Calibrated => {
            "Calibrated geometry: replace lengths and multipliers of your own file, all of them. \
             The wheels' multipliers hold their difference, since there is one radius."
        }
    };
    text.push_str(&wrapped("#", how));
    for (depth, name) in keys.iter().enumerate() {
        let _ = writeln!(text, "{}{}:", "  ".repeat(depth), key(name));
    }
    let mut body = String::new();
    lengths(&mut body, robot, options.lengths)?;
    covariances(&mut body, robot, options);
    for line in body.lines() {
        // Written for two keys.
        let _ = writeln!(text, "{}{line}", "  ".repeat(keys.len() - 2));
    }
    text.push_str(&wrapped(
        "#",
        "What these parameters cannot express: anything that depends on speed, load, direction or the phase of a wheel.",
    ));
    text.push_str(&limits("#", robot, false));
    Ok(text)
}

/// A node's name as a key of YAML.
pub(super) fn key(name: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-/*".contains(letter);
    if !name.is_empty() && !name.starts_with('*') && name.chars().all(is_plain) {
        name.to_owned()
    } else {
        format!("'{}'", comment(name).replace('\'', "''"))
    }
}

/// A line of a parameter with its comment.
fn line(text: &mut String, name: &str, value: &str, remark: &str) {
    let _ = writeln!(text, "    {name}: {value}  # {remark}");
}

/// "322.140 ± 0.031 mm instead of 320.000 mm".
fn shown(length: &Length, scale: f64) -> String {
    let scaled = Length {
        value_m: scale * length.value_m,
        sigma_m: length.sigma_m.map(|sigma_m| scale * sigma_m),
        nominal_m: length.nominal_m.map(|nominal_m| scale * nominal_m),
    };
    let instead = scaled.nominal_m.map_or_else(
        || "; what it replaces is not in the file".to_owned(),
        |nominal_m| format!(" instead of {} mm", mm(nominal_m)),
    );
    format!("{} mm {}{instead}", mm(scaled.value_m), plus_minus_mm(&scaled))
}

fn lengths(text: &mut String, robot: &CalibratedRobot, lengths: Lengths) -> Result<(), ExportError> {
    let Wheels { left, right } = robot.wheel_diameter;
    let separation = robot.wheel_separation;
    let (base_m, radius_m, bases) = match lengths {
        Lengths::Nominal => {
            let nominal = |length: &Length, parameter| {
                let or = ", or --lengths for the calibrated geometry";
                length.nominal_m.ok_or(ExportError::NoNominal { place: robot.place.clone(), parameter, or })
            };
            let base_m = nominal(&separation, "wheel_separation_m")?;
            let (left_m, right_m) =
                (nominal(&left, "left_wheel_diameter_m")?, nominal(&right, "right_wheel_diameter_m")?);
            // A nominal value comes from a ratio, to the last digits.
            let are_alike = (left_m / right_m - 1.0).abs() < 1e-12;
            let which = if are_alike { "nominal" } else { "mean of the nominal ones, which differ" };
            (base_m, 0.25 * (left_m + right_m), ["nominal".to_owned(), which.to_owned()])
        }
        Lengths::Calibrated => (
            separation.value_m,
            0.5 * robot.mean_diameter_m(),
            [shown(&separation, 1.0), "geometric mean of the calibrated wheels".to_owned()],
        ),
    };
    let [of_separation, of_radius] = bases;
    // What is written is what is multiplied: the factors are those of the rounded lengths.
    let written = |value: f64| decimal(value, DECIMALS).parse().unwrap_or(value);
    let (base_m, radius_m): (f64, f64) = (written(base_m), written(radius_m));
    line(text, "wheel_separation", &decimal(base_m, DECIMALS), &format!("m, {of_separation}"));
    line(text, "wheel_radius", &decimal(radius_m, DECIMALS), &format!("m, {of_radius}"));
    let factor = |text: &mut String, name: &str, length: &Length, scale: f64, base_m: f64| {
        let factor = scale * length.value_m / base_m;
        let sigma = length.sigma_m.map_or_else(|| "not known".to_owned(), |of| digits(scale * of / base_m));
        line(text, name, &decimal(factor, DECIMALS), &format!("± {sigma}: {}", shown(length, scale)));
    };
    match lengths {
        Lengths::Nominal => factor(text, "wheel_separation_multiplier", &separation, 1.0, base_m),
        Lengths::Calibrated => line(text, "wheel_separation_multiplier", "1.0", "the length above is calibrated"),
    }
    factor(text, "left_wheel_radius_multiplier", &left, 0.5, radius_m);
    factor(text, "right_wheel_radius_multiplier", &right, 0.5, radius_m);
    Ok(())
}

fn covariances(text: &mut String, robot: &CalibratedRobot, options: &Options) {
    let Some(noise) = robot.noise else {
        let none =
            "No covariances: the calibration has no noise of the wheels. `yair calibrate --method joint` fits it.";
        text.push_str(&wrapped("    #", none));
        return;
    };
    let k_mm = digits(1e3 * noise.wheel_sigma_m_per_sqrt_m);
    let (speed, rate) = (decimal(options.speed_m_s, 3), decimal(options.rate_hz, 3));
    text.push_str(&wrapped(
        "    #",
        &format!(
            "Covariances are of x, y, z, roll, pitch, yaw, from the fitted noise of the wheels, {k_mm} mm/√m. Twist: \
             over one interval at {rate} Hz, {speed} m/s straight on; it grows in proportion to speed and rate. \
             Sideways the model has no motion: it has the variance ahead. Pose: after {} m straight on; that \
             of dead reckoning grows without bound, which no constant can say: let a filter take the twist.",
            decimal(POSE_TRAVEL_M, 1)
        ),
    ));
    let list = |[x, y, yaw]: [f64; 3]| {
        let unmeasured = UNMEASURED_VARIANCE;
        let all = [x, y, unmeasured, unmeasured, unmeasured, yaw].map(variance);
        format!("[{}]", all.join(", "))
    };
    let separation_m = robot.wheel_separation.value_m;
    let _ = writeln!(text, "    pose_covariance_diagonal: {}", list(pose_variances(noise, separation_m)));
    let _ = writeln!(text, "    twist_covariance_diagonal: {}", list(twist_variances(noise, separation_m, options)));
}

/// Variances of x, y (m²) and yaw (rad²) after a travel straight on.
pub(super) fn pose_variances(noise: OdometryNoise, separation_m: f64) -> [f64; 3] {
    let mut covariance = OdometryCovariance::default();
    let wheels = WheelNoise { sigma_m_per_sqrt_m: Wheels::both(noise.wheel_sigma_m_per_sqrt_m) };
    covariance.propagate(Pose::IDENTITY, Wheels::both(POSE_TRAVEL_M), separation_m, &wheels);
    [0, 1, 2].map(|row| covariance.matrix()[(row, row)])
}

/// Variances of the speeds ahead and aside (m²/s²) and of the yaw rate (rad²/s²) over one interval.
pub(super) fn twist_variances(noise: OdometryNoise, separation_m: f64, options: &Options) -> [f64; 3] {
    let wheel = noise.wheel_sigma_m_per_sqrt_m.powi(2) * options.speed_m_s * options.rate_hz;
    [0.5 * wheel, 0.5 * wheel, 2.0 * wheel / separation_m.powi(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    /// The value of a key in the text.
    fn of(text: &str, key: &str) -> f64 {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(&format!("{key}: ")));
        line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or_else(|| panic!("{key}\n{text}"))
    }

    #[test]
    fn regress_text_of_a_small_calibration() {
        let text = render(&specimen(), &Options::default()).expect("has all");
        assert_eq!(
            text,
            "# By `yair export ros2-yaml` from robot.toml (joint).\n\
             # Nominal lengths with multipliers: the controller multiplies them to the calibrated ones. If the\n\
             #  lengths of your own file differ from these, replace them too.\n\
             diff_drive_controller:\n\
             \u{20} ros__parameters:\n\
             \u{20}   wheel_separation: 0.4  # m, nominal\n\
             \u{20}   wheel_radius: 0.1  # m, nominal\n\
             \u{20}   wheel_separation_multiplier: 1.02  # ± 0.00050: 408.000 mm ± 0.20 mm instead of 400.000 mm\n\
             \u{20}   left_wheel_radius_multiplier: 1.01  # ± 0.00010: 101.000 mm ± 0.010 mm instead of 100.000 mm\n\
             \u{20}   right_wheel_radius_multiplier: 0.99  # ± 0.00010: 99.000 mm ± 0.010 mm instead of 100.000 mm\n\
             \u{20}   # Covariances are of x, y, z, roll, pitch, yaw, from the fitted noise of the wheels, 1.0 mm/√m.\n\
             \u{20}   #  Twist: over one interval at 50.0 Hz, 0.25 m/s straight on; it grows in proportion to speed\n\
             \u{20}   #  and rate. Sideways the model has no motion: it has the variance ahead. Pose: after 1.0 m\n\
             \u{20}   #  straight on; that of dead reckoning grows without bound, which no constant can say: let a\n\
             \u{20}   #  filter take the twist.\n\
             \u{20}   pose_covariance_diagonal: [5.00e-7, 4.00e-6, 1.00e+6, 1.00e+6, 1.00e+6, 1.20e-5]\n\
             \u{20}   twist_covariance_diagonal: [6.25e-6, 6.25e-6, 1.00e+6, 1.00e+6, 1.00e+6, 1.50e-4]\n\
             # What these parameters cannot express: anything that depends on speed, load, direction or the phase\n\
             #  of a wheel.\n"
        );
    }

    /// Nine decimals of two factors: 0.5e-9 of a length and of its factor.
    #[test]
    fn length_times_multiplier_is_the_calibrated_length_once() {
        let mut robot = specimen();
        robot.wheel_diameter.left.nominal_m = Some(0.2037);
        robot.wheel_separation.value_m = 0.412_345_678_912;
        for lengths in [Lengths::Nominal, Lengths::Calibrated] {
            let text = render(&robot, &Options { lengths, ..Options::default() }).expect("has all");
            let of = |key: &str| of(&text, key);
            let Wheels { left, right } = robot.wheel_diameter;
            for (found_m, expected_m) in [
                (of("wheel_separation") * of("wheel_separation_multiplier"), robot.wheel_separation.value_m),
                (2.0 * of("wheel_radius") * of("left_wheel_radius_multiplier"), left.value_m),
                (2.0 * of("wheel_radius") * of("right_wheel_radius_multiplier"), right.value_m),
            ] {
                assert!((found_m - expected_m).abs() < 1e-9, "{found_m} {expected_m}: {text}");
            }
            let is_nominal = (of("wheel_separation") - 0.4).abs() < 1e-12;
            assert_eq!(
                (is_nominal, of("wheel_separation_multiplier") == 1.0),
                match lengths {
                    Lengths::Nominal => (true, false),
                    Lengths::Calibrated => (false, true),
                }
            );
        }
    }

    #[test]
    fn what_is_not_known_is_not_written() {
        let mut robot = specimen();
        robot.noise = None;
        let text = render(&robot, &Options::default()).expect("has all");
        assert!(!text.contains("covariance_diagonal") && text.contains("No covariances"), "{text}");
        robot.wheel_separation.nominal_m = None;
        let refused = render(&robot, &Options::default()).expect_err("no nominal");
        assert!(matches!(refused, ExportError::NoNominal { parameter: "wheel_separation_m", .. }));
        let text = render(&robot, &Options { lengths: Lengths::Calibrated, ..Options::default() }).expect("needs none");
        assert!(text.contains("what it replaces is not in the file"), "{text}");
    }

    #[test]
    fn names_of_nodes_are_keys() {
        assert_eq!(
            (key("/base/drive_1"), key("a: b"), key("it's\n"), key("/**"), key("*a")),
            ("/base/drive_1".into(), "'a: b'".into(), "'it''s '".into(), "/**".into(), "'*a'".into())
        );
    }
}

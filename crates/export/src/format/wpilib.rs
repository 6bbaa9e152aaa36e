//! `wpilib`: Java constants for `DifferentialDriveKinematics` and the encoders' position conversion (FRC).

use std::f64::consts::PI;
use std::fmt::Write;

use crate::comment::{decimal, limits, mm, origin, plus_minus_mm, wrapped};
use crate::error::ExportError;
use crate::options::Options;
use crate::robot::{CalibratedRobot, Length};
use crate::settings::INCH_M;

/// Decimals of lengths, metres and inches.
const DECIMALS: usize = 9;

pub(super) fn render(robot: &CalibratedRobot, _: &Options) -> Result<String, ExportError> {
    let mut text = origin("//", "wpilib", robot);
    text.push_str("public final class DriveCalibration {\n  private DriveCalibration() {}\n\n");
    let was = |length: &Length, scale: f64| {
        let nominal = length.nominal_m.map_or_else(String::new, |of| format!(", instead of {} mm", mm(scale * of)));
        let sigma_m = length.sigma_m.map(|sigma_m| scale * sigma_m);
        format!("{}{nominal}", plus_minus_mm(&Length { sigma_m, ..*length }))
    };
    let mut constant = |name: &str, value: f64, remark: &str| {
        let _ =
            writeln!(text, "  /** {remark} */\n  public static final double {name} = {};", decimal(value, DECIMALS));
    };
    let separation = &robot.wheel_separation;
    constant("kTrackwidthMeters", separation.value_m, &format!("{}.", was(separation, 1.0)));
    constant("kTrackwidthInches", separation.value_m / INCH_M, "The same in inches.");
    let (left, right) = (&robot.wheel_diameter.left, &robot.wheel_diameter.right);
    for (name, wheel) in [("kLeftMetersPerRotation", left), ("kRightMetersPerRotation", right)] {
        constant(name, PI * wheel.value_m, &format!("Of the wheel, after gears: {}.", was(wheel, PI)));
    }
    text.push_str("}\n");
    text.push_str(&wrapped(
        "//",
        "What these constants cannot express: anything that depends on speed, load, direction or the phase of a wheel.",
    ));
    text.push_str(&limits("//", robot, false));
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn regress_text_of_a_small_calibration() {
        let mut robot = specimen();
        robot.cautions.push("common_scale is not determined: */ closed".to_owned());
        let text = render(&robot, &Options::default()).expect("has all");
        assert_eq!(
            text,
            concat!(
                "// By `yair export wpilib` from robot.toml (joint).\n",
                "public final class DriveCalibration {\n  private DriveCalibration() {}\n\n",
                "  /** ± 0.20 mm, instead of 400.000 mm. */\n",
                "  public static final double kTrackwidthMeters = 0.408;\n",
                "  /** The same in inches. */\n",
                "  public static final double kTrackwidthInches = 16.062992126;\n",
                "  /** Of the wheel, after gears: ± 0.063 mm, instead of 628.319 mm. */\n",
                "  public static final double kLeftMetersPerRotation = 0.634601716;\n",
                "  /** Of the wheel, after gears: ± 0.063 mm, instead of 628.319 mm. */\n",
                "  public static final double kRightMetersPerRotation = 0.622035345;\n",
                "}\n",
                "// What these constants cannot express: anything that depends on speed, load, direction or the phase\n",
                "//  of a wheel.\n",
                "// Caution: common_scale is not determined: * / closed.\n",
            )
        );
    }
}

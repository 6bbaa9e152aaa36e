//! `linorobot2`: defines for the firmware's `lino_base_config.h`.
//!
//! The firmware has one diameter D and the counts of a turn of each wheel, so that a count is πD/N_i. Counts
//! of N·D/D_i make both wheels right. They are whole numbers there (`Encoder(int, int, int counts_per_rev,
//! bool)`): D is then chosen for what rounding leaves in common, and what it leaves between the wheels is
//! said.
//!
//! Reference: config/lino_base_config.h (github.com/linorobot/linorobot2_hardware).

use std::fmt::Write;

use kinematics::Wheels;

use crate::comment::{decimal, limits, mm, origin, plus_minus_mm, wrapped};
use crate::error::ExportError;
use crate::options::Options;
use crate::robot::CalibratedRobot;

/// Decimals of lengths, metres.
const DECIMALS: usize = 9;

pub(super) fn render(robot: &CalibratedRobot, _: &Options) -> Result<String, ExportError> {
    let ticks_per_rev = robot.ticks_per_rev()?;
    let wheels_m = robot.wheel_diameter.map(|length| length.value_m);
    let Defines { counts, diameter_m, left_over_right_error } = Defines::of(wheels_m, ticks_per_rev);
    let separation = &robot.wheel_separation;
    let mut text = origin("//", "linorobot2", robot);
    text.push_str(&wrapped(
        "//",
        &format!(
            "Replace these defines in lino_base_config.h. Diameters {} mm left ({}) and {} mm right ({}) are in the \
             counts of a turn, {} before.",
            mm(wheels_m.left),
            plus_minus_mm(&robot.wheel_diameter.left),
            mm(wheels_m.right),
            plus_minus_mm(&robot.wheel_diameter.right),
            decimal(ticks_per_rev, 3)
        ),
    ));
    let instead = separation.nominal_m.map_or_else(String::new, |of| format!(", instead of {} mm", mm(of)));
    let _ = writeln!(text, "#define WHEEL_DIAMETER {} // m", decimal(diameter_m, DECIMALS));
    let of = (decimal(separation.value_m, DECIMALS), plus_minus_mm(separation));
    let _ = writeln!(text, "#define LR_WHEELS_DISTANCE {} // m, {}{instead}", of.0, of.1);
    let _ = writeln!(text, "#define COUNTS_PER_REV1 {} // left; COUNTS_PER_REV3 of four wheels too", counts.left);
    let _ = writeln!(text, "#define COUNTS_PER_REV2 {} // right; COUNTS_PER_REV4 of four wheels too", counts.right);
    text.push_str(&wrapped(
        "//",
        &format!(
            "What these defines cannot express: counts of a turn are whole numbers, which leaves the left wheel wrong \
             by {:.4} % against the right one; anything that depends on speed, load or direction.",
            100.0 * left_over_right_error
        ),
    ));
    text.push_str(&limits("//", robot, false));
    Ok(text)
}

struct Defines {
    counts: Wheels<i64>,
    diameter_m: f64,
    /// Travel of a left count over that of a right one, relative to what is calibrated.
    left_over_right_error: f64,
}

impl Defines {
    fn of(wheels_m: Wheels<f64>, ticks_per_rev: f64) -> Self {
        let mean_m = (wheels_m.left * wheels_m.right).sqrt();
        let counts = wheels_m.map(|diameter_m| (ticks_per_rev * mean_m / diameter_m).round() as i64);
        // With it a count of each wheel is right but for this factor and its inverse.
        let own_m = wheels_m.zip_with(counts, |diameter_m, counts| diameter_m * counts as f64 / ticks_per_rev);
        Self {
            counts,
            diameter_m: (own_m.left * own_m.right).sqrt(),
            left_over_right_error: own_m.right / own_m.left - 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn regress_text_of_a_small_calibration() {
        let text = render(&specimen(), &Options::default()).expect("has all");
        assert_eq!(
            text,
            concat!(
                "// By `yair export linorobot2` from robot.toml (joint).\n",
                "// Replace these defines in lino_base_config.h. Diameters 202.000 mm left (± 0.020 mm) and 198.000\n",
                "//  mm right (± 0.020 mm) are in the counts of a turn, 10000.0 before.\n",
                "#define WHEEL_DIAMETER 0.1999899 // m\n",
                "#define LR_WHEELS_DISTANCE 0.408 // m, ± 0.20 mm, instead of 400.000 mm\n",
                "#define COUNTS_PER_REV1 9900 // left; COUNTS_PER_REV3 of four wheels too\n",
                "#define COUNTS_PER_REV2 10101 // right; COUNTS_PER_REV4 of four wheels too\n",
                "// What these defines cannot express: counts of a turn are whole numbers, which leaves the left\n",
                "//  wheel wrong by 0.0099 % against the right one; anything that depends on speed, load or\n",
                "//  direction.\n",
            )
        );
    }

    /// Travel per count of both wheels by the defines, whatever the encoder's resolution.
    #[test]
    fn both_wheels_are_right_but_for_the_rounding_that_is_said() {
        let wheels_m = Wheels { left: 0.1523, right: 0.1498 };
        for ticks_per_rev in [300.0, 4096.5, 144_000.0] {
            let defines = Defines::of(wheels_m, ticks_per_rev);
            let error = wheels_m.zip_with(defines.counts, |wheel_m, counts| {
                (defines.diameter_m / counts as f64) / (wheel_m / ticks_per_rev) - 1.0
            });
            // Half of what is said, each way; squares of 0.2 % are left.
            assert!((error.left + error.right).abs() < 1e-5, "{error:?}");
            assert!((error.left - error.right - defines.left_over_right_error).abs() < 1e-5, "{error:?}");
            // Half a count of each wheel at most.
            assert!(defines.left_over_right_error.abs() < 1.1 / ticks_per_rev);
        }
    }

    #[test]
    fn without_counts_there_is_nothing_to_scale() {
        let mut robot = specimen();
        robot.ticks_per_rev = None;
        assert!(matches!(render(&robot, &Options::default()), Err(ExportError::NoTicks { .. })));
    }
}

//! `roadrunner`: parameters of Road Runner's `TankDrive` (FTC), which has one travel per tick.
//!
//! Reference: TankDrive.java of github.com/acmerobotics/road-runner-quickstart: the track width is
//! `inPerTick · trackWidthTicks`.

use std::f64::consts::PI;
use std::fmt::Write;

use crate::comment::{decimal, limits, mm, origin, plus_minus_mm, wrapped};
use crate::error::ExportError;
use crate::options::Options;
use crate::robot::CalibratedRobot;
use crate::settings::INCH_M;

/// Decimals of inches per tick: 1e-12 in over a million ticks are a microinch.
const DECIMALS: usize = 12;

pub(super) fn render(robot: &CalibratedRobot, _: &Options) -> Result<String, ExportError> {
    let in_per_tick =
        |diameter_m: f64| -> Result<f64, ExportError> { Ok(PI * diameter_m / robot.ticks_per_rev()? / INCH_M) };
    let both = in_per_tick(robot.mean_diameter_m())?;
    let separation = &robot.wheel_separation;
    let mut text = origin("//", "roadrunner", robot);
    text.push_str("// TankDrive.Params\n");
    let _ = writeln!(text, "public double inPerTick = {}; // geometric mean of both sides", decimal(both, DECIMALS));
    let nominal = separation.nominal_m.map_or_else(String::new, |of| format!(" instead of {} mm", mm(of)));
    let _ = writeln!(
        text,
        "public double trackWidthTicks = {}; // {} mm {}{nominal}",
        decimal(separation.value_m / INCH_M / both, 6),
        mm(separation.value_m),
        plus_minus_mm(separation)
    );
    for (side, wheel) in [("left", robot.wheel_diameter.left), ("right", robot.wheel_diameter.right)] {
        let _ = writeln!(text, "// {side} side alone: {} in per tick", decimal(in_per_tick(wheel.value_m)?, DECIMALS));
    }
    text.push_str(&wrapped(
        "//",
        "What these parameters cannot express: the difference of the sides, unless your localizer scales the ticks of \
         each by the values above; anything that depends on speed, load or direction.",
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
        let text = render(&specimen(), &Options::default()).expect("has all");
        // π · 0.202 m / 10000 / 0.0254 m = 0.00249843 in; 408 mm are 16.063 in.
        assert_eq!(
            text,
            concat!(
                "// By `yair export roadrunner` from robot.toml (joint).\n",
                "// TankDrive.Params\n",
                "public double inPerTick = 0.002473571315; // geometric mean of both sides\n",
                "public double trackWidthTicks = 6493.846379; // 408.000 mm ± 0.20 mm instead of 400.000 mm\n",
                "// left side alone: 0.002498431953 in per tick\n",
                "// right side alone: 0.002448958053 in per tick\n",
                "// What these parameters cannot express: the difference of the sides, unless your localizer scales\n",
                "//  the ticks of each by the values above; anything that depends on speed, load or direction.\n",
            )
        );
    }

    #[test]
    fn without_counts_there_are_no_inches_per_tick() {
        let mut robot = specimen();
        robot.ticks_per_rev = None;
        assert!(matches!(render(&robot, &Options::default()), Err(ExportError::NoTicks { .. })));
    }
}

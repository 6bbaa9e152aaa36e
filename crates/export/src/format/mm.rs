//! `mm`: a table in millimetres, for people and for programs that nobody has a format of.

use std::fmt::Write;

use crate::comment::{decimal, digits, limits, mm, origin};
use crate::error::ExportError;
use crate::options::Options;
use crate::robot::{CalibratedRobot, Length};

pub(super) fn render(robot: &CalibratedRobot, _: &Options) -> Result<String, ExportError> {
    let mut text = origin("#", "mm", robot);
    let row = |text: &mut String, [name, value, sigma, nominal, ratio]: [&str; 5]| {
        let _ = writeln!(text, "{name:<22} {value:>10} {sigma:>9} {nominal:>10} {ratio:>9}");
    };
    row(&mut text, ["parameter", "mm", "±", "nominal", "ratio"]);
    let mut length = |name: &str, length: &Length| {
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        let sigma = or_dash(length.sigma_m.map(|sigma_m| digits(1e3 * sigma_m)));
        let nominal = or_dash(length.nominal_m.map(mm));
        let ratio = or_dash(length.nominal_m.map(|nominal_m| format!("{:.6}", length.value_m / nominal_m)));
        row(&mut text, [name, &mm(length.value_m), &sigma, &nominal, &ratio]);
    };
    length("left wheel diameter", &robot.wheel_diameter.left);
    length("right wheel diameter", &robot.wheel_diameter.right);
    length("wheel separation", &robot.wheel_separation);
    if let Some(ticks) = robot.ticks_per_rev {
        let _ = writeln!(text, "# {} counts a wheel turn", decimal(ticks, 3));
    }
    if let Some(noise) = robot.noise {
        let _ = writeln!(text, "# noise of each wheel: {} mm/√m", digits(1e3 * noise.wheel_sigma_m_per_sqrt_m));
    }
    text.push_str(&limits("#", robot, false));
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn regress_text_of_a_small_calibration() {
        let mut robot = specimen();
        robot.wheel_diameter.right.nominal_m = None;
        robot.wheel_diameter.right.sigma_m = None;
        let text = render(&robot, &Options::default()).expect("has all");
        assert_eq!(
            text,
            "# By `yair export mm` from robot.toml (joint).\n\
             parameter                      mm         ±    nominal     ratio\n\
             left wheel diameter       202.000     0.020    200.000  1.010000\n\
             right wheel diameter      198.000         –          –         –\n\
             wheel separation          408.000      0.20    400.000  1.020000\n\
             # 10000.0 counts a wheel turn\n\
             # noise of each wheel: 1.0 mm/√m\n"
        );
    }
}

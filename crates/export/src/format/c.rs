//! `c`: odometry for a robot's controller as one self-contained C99 header: no allocation, no library but
//! `math.h`.
//!
//! A plain calibration goes by the midpoint rule, an extended model by exact arcs of counts and terms
//! together, as `yair evaluate` does. Effects whose mean is a function of one interval are in it, by the
//! statements of their own files (`effects::OnBoard`); all others are named as left out.
//! [`crate::OnBoardOdometry`] is the same in Rust; `tests/compiled_header.rs` compares the two.

use std::fmt::Write;

use effects::OnBoard;

use crate::comment::{limits, origin, wrapped};
use crate::error::ExportError;
use crate::on_board::width;
use crate::options::Options;
use crate::robot::{CalibratedRobot, RobotEffect};

const HEADER: &str = include_str!("odometry.h.in");
const COVARIANCE: &str = include_str!("covariance.h.in");
const TANGENT: &str = include_str!("tangent.h.in");

const SINC: &str = "
/* sin(x)/x; the series' next term is below rounding. */
static inline double yair_sinc(double x) {
    return fabs(x) < 1e-4 ? 1.0 - x * x / 6.0 : sin(x) / x;
}
";

const SENSE: &str = "
/* -1, 0 or 1. */
static inline double yair_sense(double x) {
    return (double)((x > 0.0) - (x < 0.0));
}
";

pub(super) fn render(robot: &CalibratedRobot, options: &Options) -> Result<String, ExportError> {
    let ticks_per_rev = robot.ticks_per_rev()?;
    let m_per_count = robot
        .geometry()?
        .m_per_count(ticks_per_rev)
        .map_err(|source| ExportError::NotADrive { place: robot.place.clone(), source })?;
    let bits = width(robot, options.counter_bits);
    let count = if bits > 32 { "int64_t" } else { "int32_t" };
    let mask = u64::MAX >> (64 - u32::from(bits));
    let mask = if bits > 32 { format!("UINT64_C({mask})") } else { format!("{mask}u") };
    let has_noise = robot.noise.is_some();
    let effects = effects(robot);
    let functions = [
        if has_noise || robot.is_extended { SINC } else { "" },
        if has_noise { TANGENT } else { "" },
        if effects.contains("yair_sense") { SENSE } else { "" },
    ];
    let mut limits = limits(" *", robot, true);
    if !has_noise {
        limits.push_str(&wrapped(" *", "No covariance: the calibration has no noise of the wheels."));
    }
    limits.push_str(&wrapped(
        " *",
        "What this header cannot express: effects that need more than the counts of one interval.",
    ));
    let chord = if robot.is_extended { "moved_m * yair_sinc(0.5 * turned_rad)" } else { "moved_m" };
    let uses_interval = !effects.is_empty();
    let parts: [(&str, String); 17] = [
        ("@ORIGIN@", origin(" *", "c", robot)),
        ("@LIMITS@", limits),
        ("@LEFT_M_PER_COUNT@", exact(m_per_count.left)),
        ("@RIGHT_M_PER_COUNT@", exact(m_per_count.right)),
        ("@SEPARATION_M@", exact(robot.wheel_separation.value_m)),
        ("@NOISE@", noise(robot)),
        ("@BITS@", bits.to_string()),
        ("u@COUNT@", format!("u{count}")),
        ("@COUNT@", count.to_owned()),
        ("@MASK@", mask),
        ("@STATE@", if has_noise { STATE.to_owned() } else { String::new() }),
        ("@FUNCTIONS@", functions.concat()),
        ("@INIT@", if has_noise { INIT.to_owned() } else { String::new() }),
        ("@EFFECTS@", effects),
        ("@COVARIANCE@", if has_noise { COVARIANCE.to_owned() } else { String::new() }),
        ("@CHORD@", chord.to_owned()),
        ("@UNUSED@", if uses_interval { String::new() } else { "    (void)dt_s;\n".to_owned() }),
    ];
    Ok(parts.iter().fold(HEADER.to_owned(), |text, (name, part)| text.replace(name, part)))
}

const STATE: &str = "    double covariance[3][3]; /* of x, y, theta since the start, by the noise of the wheels */\n";

const INIT: &str = "    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            s->covariance[i][j] = 0.0;
        }
    }
";

/// A number that reads back as it is; its exponent makes it a double.
fn exact(value: f64) -> String {
    format!("{value:e}")
}

fn noise(robot: &CalibratedRobot) -> String {
    robot.noise.map_or_else(String::new, |noise| {
        format!(
            "/* Noise of each wheel's travel, m/sqrt(m), and of turns beyond it, rad/sqrt(rad). */\n\
             #define YAIR_WHEEL_SIGMA {}\n#define YAIR_TURN_SIGMA {}\n",
            exact(noise.wheel_sigma_m_per_sqrt_m),
            exact(noise.turn_sigma_rad_per_sqrt_rad)
        )
    })
}

/// The effects' statements, each in its own block.
fn effects(robot: &CalibratedRobot) -> String {
    let blocks: String = robot.effects.iter().filter_map(block).collect();
    if blocks.is_empty() {
        return blocks;
    }
    let mut text = "    {
        double left_change_m = 0.0, right_change_m = 0.0, turn_change_rad = 0.0;
"
    .to_owned();
    // What no effect reads is not declared: it would be a warning.
    let uses = |name: &str| robot.effects.iter().any(|effect| effect.on_board.uses(name));
    for (names, value) in [
        (&["left_m_s", "right_m_s", "v_m_s", "omega_rad_s"][..], "per_s = dt_s > 0.0 ? 1.0 / dt_s : 0.0"),
        (&["left_m_s"], "left_m_s = left_m * per_s"),
        (&["right_m_s"], "right_m_s = right_m * per_s"),
        (&["v_m_s"], "v_m_s = distance_m * per_s"),
        (&["omega_rad_s"], "omega_rad_s = turn_rad * per_s"),
    ] {
        if names.iter().any(|name| uses(name)) {
            let _ = writeln!(text, "        const double {value};");
        }
    }
    if !uses("dt_s") && !text.contains("per_s") {
        text.push_str("        (void)dt_s;\n");
    }
    text.push_str(&blocks);
    text.push_str(
        "        moved_m += 0.5 * (left_change_m + right_change_m);
        turned_rad += (right_change_m - left_change_m) / YAIR_WHEEL_SEPARATION_M + turn_change_rad;
    }
",
    );
    text
}

fn block(effect: &RobotEffect) -> Option<String> {
    let OnBoard::Static(statements) = effect.on_board else { return None };
    let mut text = format!("        {{ /* {}: {} */\n", effect.id, effect.meaning);
    for (name, value) in effect.values.iter().filter(|(name, _)| effect.on_board.uses(name)) {
        let _ = writeln!(text, "            const double {name} = {};", exact(*value));
    }
    for line in statements.lines() {
        let _ = writeln!(text, "            {line}");
    }
    text.push_str("        }\n");
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn constants_read_back_to_the_last_bit() {
        let robot = specimen();
        let text = render(&robot, &Options::default()).expect("has all");
        let line = text.lines().find_map(|line| line.strip_prefix("#define YAIR_LEFT_M_PER_COUNT "));
        let m_per_count = std::f64::consts::PI * 0.202 / 10_000.0;
        assert_eq!(line.and_then(|value| value.parse().ok()), Some(m_per_count));
        assert!(!text.contains('@'), "a part of the template is left: {text}");
    }

    #[test]
    fn texts_of_files_stay_in_their_comment() {
        let mut robot = specimen();
        robot.place = "evil*/\nint x;.toml".to_owned();
        let text = render(&robot, &Options::default()).expect("has all");
        let (comment, _) = text.split_once("*/").expect("a comment");
        assert!(comment.contains("int x;") && comment.contains("What this header cannot express"), "{text}");
    }

    #[test]
    fn without_noise_there_is_no_covariance() {
        let mut robot = specimen();
        robot.noise = None;
        let text = render(&robot, &Options::default()).expect("has all");
        assert!(!text.contains("covariance[") && text.contains("No covariance"), "{text}");
    }

    #[test]
    fn counters_have_the_width_that_is_chosen() {
        let of =
            |bits| render(&specimen(), &Options { counter_bits: Some(bits), ..Options::default() }).expect("has all");
        assert!(of(16).contains("#define YAIR_COUNTER_MASK 65535u\n") && of(16).contains("typedef int32_t"));
        assert!(of(40).contains("UINT64_C(1099511627775)") && of(40).contains("typedef int64_t"));
    }
}

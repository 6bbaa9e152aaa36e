//! `c`: odometry for a robot's controller as one self-contained C99 header: no allocation, no library but
//! `math.h`.
//!
//! A plain calibration goes by the midpoint rule, an extended model by exact arcs of counts and terms
//! together, as `yair evaluate` does. Effects are in it by the statements of their own files
//! (`effects::OnBoard`), with what they remember and what they must be told; those that cannot run on board
//! are named as left out. [`crate::OnBoardOdometry`] is the same in Rust; `tests/compiled_header.rs` compares
//! the two.

mod blocks;
mod covariance;
mod inputs;
mod literal;
mod past;

use effects::OnBoard;

use crate::comment::{limits, origin, wrapped};
use crate::error::ExportError;
use crate::on_board::width;
use crate::options::Options;
use crate::robot::CalibratedRobot;
use blocks::Blocks;
use inputs::Inputs;
use literal::exact;
use past::Past;

const HEADER: &str = include_str!("c/odometry.h.in");

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
    let (blocks, inputs, past) = (Blocks::of(robot), Inputs::of(robot), Past::of(robot));
    let covariance = covariance::of(robot, &blocks);
    let effects = blocks.mean();
    let uses_sense = robot.effects.iter().any(|effect| effect.on_board.uses("yair_sense"));
    let functions = [
        if has_noise || robot.is_extended { SINC } else { "" },
        &covariance.functions,
        if uses_sense { SENSE } else { "" },
        &blocks.functions,
    ];
    let mut limits = limits(" *", robot, true);
    if !has_noise {
        limits.push_str(&wrapped(" *", "No covariance: the calibration has no noise of the wheels."));
    }
    limits.push_str(&wrapped(" *", CANNOT));
    let chord = if robot.is_extended { "moved_m * yair_sinc(0.5 * turned_rad)" } else { "moved_m" };
    let uses_rad = inputs.needs_turns() || robot.effects.iter().any(uses_radius);
    let rad_per_count = match uses_rad {
        true => format!(
            "/* Turn of a wheel for a count, radians. */\n#define YAIR_RAD_PER_COUNT {}\n",
            exact(std::f64::consts::TAU / ticks_per_rev)
        ),
        false => String::new(),
    };
    let is_timed = [&effects, &past.step, &inputs.step, &blocks.corrections, &covariance.step]
        .iter()
        .any(|text| blocks::uses(text, "dt_s"));
    let parts: [(&str, String); 24] = [
        ("@ORIGIN@", origin(" *", "c", robot)),
        ("@LIMITS@", limits),
        ("@LEFT_M_PER_COUNT@", exact(m_per_count.left)),
        ("@RIGHT_M_PER_COUNT@", exact(m_per_count.right)),
        ("@SEPARATION_M@", exact(robot.wheel_separation.value_m)),
        ("@CONSTANTS@", covariance.constants + &rad_per_count),
        ("@BITS@", bits.to_string()),
        ("@TYPES@", inputs.types + &blocks.types),
        ("@STATE@", covariance.state + &past.state + &inputs.state + &blocks.state),
        ("@COUNT@", count.to_owned()),
        ("@MASK@", mask),
        ("@FUNCTIONS@", functions.concat()),
        ("@INIT@", covariance.init + &past.init + &inputs.init + &blocks.init),
        ("@COUNTS@", blocks.counts()),
        ("@INPUTS@", inputs.step),
        ("@PAST@", past.step),
        ("@EFFECTS@", effects),
        ("@COVARIANCE@", covariance.step),
        ("@CHORD@", chord.to_owned()),
        ("@STEP@", inputs.function.to_owned()),
        ("@TOLD@", inputs.logged.to_owned()),
        ("@INPUTS_PARAMETER@", inputs.parameter.to_owned()),
        ("@WITHOUT_INPUTS@", inputs.without.to_owned()),
        ("@UNUSED@", if is_timed { String::new() } else { "    (void)dt_s;\n".to_owned() }),
    ];
    Ok(filled(HEADER, &parts))
}

/// A template with its marks replaced. What is put in is not looked at again: a file's text may hold marks.
fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let (mut text, mut rest) = (String::new(), template);
    while let Some(at) = rest.find('@') {
        let found = parts.iter().find(|(name, _)| rest[at..].starts_with(name));
        let (part, length) = found.map_or(("@", 1), |(name, part)| (&part[..], name.len()));
        text.push_str(&rest[..at]);
        text.push_str(part);
        rest = &rest[at + length..];
    }
    text + rest
}

const CANNOT: &str = "What this header cannot express: effects that show in later readings alone.";

fn uses_radius(effect: &crate::RobotEffect) -> bool {
    matches!(effect.on_board, OnBoard::CovarianceOnly(_))
        && ["left_radius_m", "right_radius_m"].iter().any(|name| effect.on_board.uses(name))
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
        for hostile in ["evil*/\nint x;.toml", "*\\\n/ int x;", "*??/\n/ int x;", "/* int x; @STATE@ @LIMITS@"] {
            robot.place = hostile.to_owned();
            robot.name = hostile.to_owned();
            robot.cautions = vec![hostile.to_owned()];
            let text = render(&robot, &Options::default()).expect("has all");
            let (comment, rest) = text.split_once("*/").expect("a comment");
            assert_eq!(comment.matches("int x;").count(), 3, "{text}");
            assert!(comment.contains("What this header cannot express") && !rest.contains("int x;"), "{text}");
            assert!(!comment.contains("??") && !comment.contains('\\') && !comment[2..].contains("/*"), "{text}");
            assert_eq!(text.matches("yair_count_t left_count, right_count;").count(), 1, "{text}");
        }
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

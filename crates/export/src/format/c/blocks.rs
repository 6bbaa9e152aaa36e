//! The effects' statements, each in its own block with its sizes, and what they remember.

use std::fmt::Write as _;

use effects::{Code, Input, OnBoard};

use super::literal::exact;
use crate::robot::{CalibratedRobot, RobotEffect};

/// Whether a C text has a name.
pub(super) fn uses(text: &str, name: &str) -> bool {
    text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_').any(|word| word == name)
}

/// Texts of the effects in the places where they belong.
#[derive(Default)]
pub(super) struct Blocks {
    pub(super) types: String,
    pub(super) state: String,
    pub(super) init: String,
    pub(super) functions: String,
    pub(super) corrections: String,
    pub(super) scatter: String,
    means: String,
    /// Names of the interval that means read, with what they are.
    reads: Vec<&'static str>,
}

/// Names of the interval and what they are; the names that a value reads stand after it.
const OF_INTERVAL: [(&str, &str); 6] = [
    ("left_m_s", "dt_s > 0.0 ? left_m / dt_s : 0.0"),
    ("right_m_s", "dt_s > 0.0 ? right_m / dt_s : 0.0"),
    ("v_m_s", "dt_s > 0.0 ? distance_m / dt_s : 0.0"),
    ("omega_rad_s", "dt_s > 0.0 ? turn_rad / dt_s : 0.0"),
    ("left_count_m", "YAIR_LEFT_M_PER_COUNT"),
    ("right_count_m", "YAIR_RIGHT_M_PER_COUNT"),
];

/// What covariances read beside those.
const OF_WHEELS: [(&str, &str); 2] = [
    ("left_radius_m", "YAIR_LEFT_M_PER_COUNT / YAIR_RAD_PER_COUNT"),
    ("right_radius_m", "YAIR_RIGHT_M_PER_COUNT / YAIR_RAD_PER_COUNT"),
];

impl Blocks {
    pub(super) fn of(robot: &CalibratedRobot) -> Self {
        let mut blocks = Self::default();
        for effect in robot.corrections() {
            let block = block(effect, "", "    ");
            blocks.corrections.push_str(&block);
        }
        for (number, effect) in robot.effects.iter().enumerate() {
            let Some(code) = effect.on_board.code() else { continue };
            let is_scatter = matches!(effect.on_board, OnBoard::CovarianceOnly(_));
            if matches!(effect.on_board, OnBoard::Constant(_)) || is_scatter && robot.noise.is_none() {
                continue;
            }
            // The same effect may come twice, with other sizes.
            let name = format!("{}_{number}", effect.id);
            blocks.remember(&name, code);
            for function in
                code.functions.iter().filter(|function| !blocks.functions.contains(**function)).collect::<Vec<_>>()
            {
                let _ = write!(blocks.functions, "\n{function}");
            }
            let own = match code.remembers {
                [] => String::new(),
                _ => format!("yair_{name}_t *const own = &s->{name};"),
            };
            let names = OF_INTERVAL.iter().chain(&OF_WHEELS).map(|(name, _)| *name);
            let read: Vec<&str> = names.filter(|name| effect.on_board.uses(name)).collect();
            if is_scatter {
                let text = block_with(effect, &own, &read);
                blocks.scatter.push_str(&text);
            } else {
                blocks.means.push_str(&block(effect, &own, "        "));
                blocks.reads.extend(read);
            }
        }
        blocks
    }

    /// Members of the state for what an effect remembers.
    fn remember(&mut self, name: &str, code: Code) {
        if code.remembers.is_empty() {
            return;
        }
        let members: Vec<&str> = code.remembers.iter().map(|(member, _)| *member).collect();
        let _ = write!(self.types, "\ntypedef struct {{\n    double {};\n}} yair_{name}_t;\n", members.join(", "));
        let _ = writeln!(self.state, "    yair_{name}_t {name};");
        for (member, value) in code.remembers {
            let _ = writeln!(self.init, "    s->{name}.{member} = {};", exact(*value));
        }
    }

    /// Travel of each wheel by the counts, once faults of the records are undone.
    pub(super) fn counts(&self) -> String {
        if self.corrections.is_empty() {
            return "    const double left_m = YAIR_LEFT_M_PER_COUNT * yair_count_difference(left_ticks, s->left_count);
    const double right_m = YAIR_RIGHT_M_PER_COUNT * yair_count_difference(right_ticks, s->right_count);
"
            .to_owned();
        }
        format!(
            "    double left_counts = yair_count_difference(left_ticks, s->left_count);
    double right_counts = yair_count_difference(right_ticks, s->right_count);
    /* Faults of the records are undone first. */
{}    const double left_m = YAIR_LEFT_M_PER_COUNT * left_counts;
    const double right_m = YAIR_RIGHT_M_PER_COUNT * right_counts;
",
            self.corrections
        )
    }

    /// The means of all effects, and what they change.
    pub(super) fn mean(&self) -> String {
        if self.means.is_empty() {
            return String::new();
        }
        let mut text = "    {
        double left_change_m = 0.0, right_change_m = 0.0, turn_change_rad = 0.0;
"
        .to_owned();
        // What no effect reads is not declared: it would be a warning.
        for (name, value) in OF_INTERVAL.iter().filter(|(name, _)| self.reads.contains(name)) {
            let _ = writeln!(text, "        const double {name} = {value};");
        }
        text.push_str(&self.means);
        text.push_str(
            "        moved_m += 0.5 * (left_change_m + right_change_m);
        turned_rad += (right_change_m - left_change_m) / YAIR_WHEEL_SEPARATION_M + turn_change_rad;
    }
",
        );
        text
    }
}

/// The condition under which an input is known, where it is not a wheel's.
const fn condition(input: Option<Input>) -> Option<&'static str> {
    match input {
        None | Some(Input::WheelAngles) => None,
        Some(Input::RoomHeading) => Some("s->known & YAIR_ROOM_HEADING"),
        Some(Input::Payload) => Some("s->known & YAIR_PAYLOAD"),
        Some(Input::SessionTime) => Some("s->known & YAIR_SESSION_TIME"),
        Some(Input::SessionDistance) => Some("s->known & YAIR_SESSION_DISTANCE"),
    }
}

/// The statements of an effect in a block with its sizes; nothing where it has no statements.
fn block(effect: &RobotEffect, own: &str, indent: &str) -> String {
    let Some(code) = effect.on_board.code().filter(|code| !code.statements.is_empty()) else { return String::new() };
    let start = condition(effect.on_board.input()).map_or_else(|| "{".to_owned(), |known| format!("if ({known}) {{"));
    let mut text = format!("{indent}{start} /* {}: {} */\n", effect.id, effect.meaning);
    if !own.is_empty() {
        let _ = writeln!(text, "{indent}    {own}");
    }
    for name in effect.size_names() {
        let _ = writeln!(text, "{indent}    const double {name} = {};", exact(effect.size(&name)));
    }
    for line in code.statements.lines() {
        let _ = writeln!(text, "{indent}    {line}");
    }
    let _ = writeln!(text, "{indent}}}");
    text
}

/// The same with names of the interval and the wheels that it reads.
fn block_with(effect: &RobotEffect, own: &str, reads: &[&str]) -> String {
    let mut declared = own.to_owned();
    for (name, value) in OF_INTERVAL.iter().chain(&OF_WHEELS).filter(|(name, _)| reads.contains(name)) {
        if !declared.is_empty() {
            declared.push_str("\n        ");
        }
        let _ = write!(declared, "const double {name} = {value};");
    }
    block(effect, &declared, "    ")
}

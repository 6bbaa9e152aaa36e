//! What a robot's own program can do of an effect while it drives: C that a header for its controller is made
//! of, in the effect's own file.
//!
//! The statements are the mean term of the effect, by what one control interval knows: nothing of the rows
//! after it, and nothing of those before. They read
//! `left_m`, `right_m` (travel by the counts), `left_m_s`, `right_m_s` (the same over the interval),
//! `distance_m`, `turn_rad` (of the drive's centre), `v_m_s`, `omega_rad_s`, `dt_s`, the effect's sizes by
//! their names, and `yair_sense(x)`: −1, 0 or 1. They add to `left_change_m`, `right_change_m` (travel of
//! each wheel), `across_m` (the centre, to its left) and `turn_change_rad`. Without an interval's length
//! (`dt_s` = 0) all speeds are 0.

/// How far a robot's own odometry can follow an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnBoard {
    /// By C statements, interval by interval.
    Static(&'static str),
    /// It is no part of the robot's motion: the outside instrument has it.
    OfInstrument,
    /// It needs more than counts of one interval and its length.
    LeftOut,
}

impl OnBoard {
    /// Whether the statements use a size.
    #[must_use]
    pub fn uses(self, name: &str) -> bool {
        let Self::Static(statements) = self else { return false };
        statements.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_').any(|word| word == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CATALOGUE, description, hypothesis};

    /// What is wrong with an effect's statements.
    fn complaint(on_board: OnBoard, sizes: &[&str]) -> Option<String> {
        let OnBoard::Static(statements) = on_board else { return None };
        if let Some(unused) = sizes.iter().find(|name| !on_board.uses(name)) {
            return Some(format!("{unused} is not used"));
        }
        let adds = ["left_change_m", "right_change_m", "across_m", "turn_change_rad"].map(|name| on_board.uses(name));
        (adds == [false; 4] || !statements.trim_end().ends_with([';', '}'])).then(|| "it adds nothing".to_owned())
    }

    #[test]
    fn statements_use_every_size_of_their_effect() {
        let mut with_statements = 0;
        for id in CATALOGUE {
            let on_board = description(id).expect("known").on_board;
            let variants = hypothesis(id).and_then(crate::Hypothesis::into_variants).unwrap_or_default();
            let fixed = variants.iter().flat_map(|variant| variant.fixed.iter().map(|(name, _)| *name));
            let fitted = variants.iter().flat_map(|variant| variant.term.parameters().iter().map(|of| of.name));
            let sizes: Vec<&str> = fixed.chain(fitted).collect();
            assert_eq!(complaint(on_board, &sizes), None, "{id}");
            assert!(!matches!(on_board, OnBoard::Static(_)) || !sizes.is_empty(), "{id} has no mean");
            with_statements += usize::from(matches!(on_board, OnBoard::Static(_)));
        }
        assert_eq!(with_statements, 8);
        assert!(complaint(OnBoard::Static("across_m -= 1.0;"), &["skid_s"]).is_some());
        assert!(complaint(OnBoard::Static("dt_s * skid_s;"), &["skid_s"]).is_some());
        // A part of a name is not the name.
        assert!(!OnBoard::Static("across_m -= skid_s2;").uses("skid_s"));
    }
}

//! How an effect can run on board: what a robot's own program can do of it while it drives, with nothing of
//! the rows that come after.
//!
//! Every effect states its kind in its own file, beside its estimation model. Mean terms are C statements
//! for a header; in Rust the estimation model's own term is evaluated with what is known by then. Statements
//! read names of this list and the effect's sizes by their names:
//!
//! - of the interval: `left_m`, `right_m` (travel by the counts), `left_m_s`, `right_m_s` (the same over
//!   the interval), `distance_m`, `turn_rad` (of the drive's centre), `v_m_s`, `omega_rad_s`, `dt_s`, and
//!   `left_count_m`, `right_count_m` (travel of a count). Without a length (`dt_s` = 0) its speeds are 0;
//! - of the past: `left_start_m_s`, `left_end_m_s`, `right_start_m_s`, `right_end_m_s` (speeds of the
//!   interval before and of this one; those before where this one has no length), `late_start_s`,
//!   `late_end_s` (stamps against the mean period so far);
//! - of inputs: see [`Input`];
//! - `own->NAME`: what the effect remembers; `yair_sense(x)`: −1, 0 or 1.
//!
//! They add to `left_change_m`, `right_change_m` (travel of each wheel), `across_m` (the centre, to its left)
//! and `turn_change_rad`.

use kinematics::Wheels;
use model_term::Interval;

/// The run's covariate that says what the robot carries; a run without it carries nothing.
pub(crate) const PAYLOAD: &str = "payload_kg";

/// A size of an effect by its name; 0 where it has none of that name.
pub type SizeOf<'v> = &'v dyn Fn(&str) -> f64;

/// How an effect can run on board.
#[derive(Debug, Clone, Copy)]
pub enum OnBoard {
    /// The lengths that every header has are its sizes.
    Geometry,
    /// A mean over one interval, by C statements.
    Static(&'static str),
    /// A mean that remembers.
    State {
        /// What it remembers, for people.
        of: &'static str,
        /// What differs from the term that a fit evaluates with rows on both sides, for people.
        lag: &'static str,
        /// C.
        code: Code,
    },
    /// A mean that needs to be told what counts do not say; off until it is.
    Input {
        /// What.
        input: Input,
        /// C.
        code: Code,
    },
    /// A correction of raw counts or of the interval's length, before anything else.
    Constant(Correction),
    /// No mean: it widens the covariance.
    CovarianceOnly(Scatter),
    /// It is no part of the robot's motion: the outside instrument has it.
    OfInstrument,
    /// It cannot; why, for people.
    Never(&'static str),
}

/// C of a mean term.
#[derive(Debug, Clone, Copy)]
pub struct Code {
    /// What is remembered from interval to interval, and its value before the first.
    pub remembers: &'static [(&'static str, f64)],
    /// Functions that the statements call, each whole.
    pub functions: &'static [&'static str],
    /// Statements of one interval.
    pub statements: &'static str,
}

impl Code {
    /// Statements alone.
    pub(crate) const fn of(statements: &'static str) -> Self {
        Self { remembers: &[], functions: &[], statements }
    }
}

/// Why an effect cannot run whose file does not say it: none of the catalogue's may.
pub(crate) const UNSTATED: &str = "nothing states how it could";

/// "Distance since a reversal" before the first one, metres: so far that nothing is left of it, and finite,
/// as compilers that assume finite numbers need.
pub(crate) const NEVER_REVERSED_M: f64 = 1e30;

/// What a robot can be told that its counts do not say. What is told once holds, and is followed by the
/// counts, until it is told again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Input {
    /// The angle of each wheel, from an index pulse or an absolute encoder. Statements read `left_wheel_rad`,
    /// `right_wheel_rad` (where the interval begins) and `left_turned_rad`, `right_turned_rad` (in it; 0
    /// while the angle is not known).
    WheelAngles,
    /// The heading in the room. Statements read `room_heading_rad`, where the interval begins.
    RoomHeading,
    /// What is carried. Statements read `payload_kg`.
    Payload,
    /// The time since the session began. Statements read `session_s`, where the interval begins.
    SessionTime,
    /// The distance driven since the session began. Statements read `session_m`, where the interval begins.
    SessionDistance,
}

impl Input {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::WheelAngles, Self::RoomHeading, Self::Payload, Self::SessionTime, Self::SessionDistance];

    /// What it is, for people.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::WheelAngles => "each wheel's angle, from an index pulse or an absolute encoder",
            Self::RoomHeading => "the heading in the room where the calibration was made",
            Self::Payload => "the payload",
            Self::SessionTime => "the time since the session began",
            Self::SessionDistance => "the distance driven since the session began",
        }
    }

    /// The run's covariate that a log has it in.
    #[must_use]
    pub const fn covariate(self) -> Option<&'static str> {
        match self {
            Self::Payload => Some(PAYLOAD),
            _ => None,
        }
    }
}

/// What a control interval reads before anything is made of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawInterval {
    /// Counts of each counter.
    pub counts: Wheels<f64>,
    /// Length, seconds.
    pub dt_s: f64,
}

/// How a fault of the records is undone.
#[derive(Debug, Clone, Copy)]
pub struct Correction {
    /// C: they change `left_counts`, `right_counts` and `dt_s`.
    pub statements: &'static str,
    /// The same in Rust.
    pub correct: fn(SizeOf<'_>, RawInterval) -> RawInterval,
    /// The size that is the width of the counters, where that is the fault.
    pub counter_bits: Option<&'static str>,
}

/// What scatters, interval by interval.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct IntervalScatter {
    /// Variance of each wheel's travel in this interval, independent of all others, m².
    pub travel_var_m2: Wheels<f64>,
    /// Variance of the turn in this interval, independent of all others, rad².
    pub turn_var_rad2: f64,
    /// Variance of each counter's present reading as travel, m²: it is in this pose and gone with the next.
    pub reading_var_m2: Wheels<f64>,
    /// Variance of the wheel separation, m²: one draw for a whole motion.
    pub separation_var_m2: f64,
    /// A motion begins with this interval: the separation is drawn anew.
    pub motion_begins: bool,
}

/// What an effect adds to the covariance.
pub trait ScatterModel: Send + Sync {
    /// Adds what an interval scatters.
    fn after(&mut self, interval: &Interval<'_>, scatter: &mut IntervalScatter);
}

/// How an effect widens the covariance.
#[derive(Debug, Clone, Copy)]
pub struct Scatter {
    /// Of what kind, for people.
    pub of: &'static str,
    /// C: they add to `left_var_m2`, `right_var_m2`, `turn_var_rad2`, `left_reading_var_m2`,
    /// `right_reading_var_m2` and `separation_var_m2`, and set `motion_begins`, as
    /// [`IntervalScatter`] has them. They read `left_radius_m` and `right_radius_m` too.
    pub code: Code,
    /// The same in Rust, of its sizes.
    pub model: fn(SizeOf<'_>) -> Box<dyn ScatterModel>,
}

impl OnBoard {
    /// The kind in a few words.
    #[must_use]
    pub const fn kind(self) -> &'static str {
        match self {
            Self::Geometry => "geometry",
            Self::Static(_) => "static",
            Self::State { .. } => "with state",
            Self::Input { .. } => "with an input",
            Self::Constant(_) => "a constant",
            Self::CovarianceOnly(_) => "covariance only",
            Self::OfInstrument => "of the instrument",
            Self::Never(_) => "never",
        }
    }

    /// What it remembers or needs, or why it cannot run, for people; empty where the kind says all.
    #[must_use]
    pub const fn detail(self) -> &'static str {
        match self {
            Self::Geometry => "in the lengths",
            Self::Static(_) => "",
            Self::State { of, .. } => of,
            Self::Input { input, .. } => input.meaning(),
            Self::Constant(Correction { counter_bits: Some(_), .. }) => "the width of the counters",
            Self::Constant(_) => "raw counts or interval are corrected first",
            Self::CovarianceOnly(scatter) => scatter.of,
            Self::OfInstrument => "an error of the outside instrument, and none of the robot",
            Self::Never(why) => why,
        }
    }

    /// What differs from the term that a fit evaluates, for people.
    #[must_use]
    pub const fn lag(self) -> Option<&'static str> {
        match self {
            Self::State { lag, .. } => Some(lag),
            _ => None,
        }
    }

    /// Whether a program on board has it in its mean.
    #[must_use]
    pub const fn has_mean(self) -> bool {
        matches!(self, Self::Static(_) | Self::State { .. } | Self::Input { .. })
    }

    /// Its C, where it has some.
    #[must_use]
    pub const fn code(self) -> Option<Code> {
        match self {
            Self::Static(statements) => Some(Code::of(statements)),
            Self::State { code, .. } | Self::Input { code, .. } => Some(code),
            Self::Constant(correction) => Some(Code::of(correction.statements)),
            Self::CovarianceOnly(scatter) => Some(scatter.code),
            Self::Geometry | Self::OfInstrument | Self::Never(_) => None,
        }
    }

    /// The input that it needs.
    #[must_use]
    pub const fn input(self) -> Option<Input> {
        match self {
            Self::Input { input, .. } => Some(input),
            _ => None,
        }
    }

    /// Whether the statements use a name.
    #[must_use]
    pub fn uses(self, name: &str) -> bool {
        self.code().is_some_and(|code| words(code.statements).any(|word| word == name))
    }
}

/// The names of C statements.
fn words(statements: &str) -> impl Iterator<Item = &str> {
    statements.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CATALOGUE, Effect, Hypothesis, description, hypothesis};

    /// What is wrong with an effect's statements.
    fn complaint(on_board: OnBoard, sizes: &[&str]) -> Option<String> {
        let code = on_board.code()?;
        let in_its_width = |name: &str| matches!(on_board, OnBoard::Constant(of) if of.counter_bits == Some(name));
        if let Some(unused) = sizes.iter().find(|name| !on_board.uses(name) && !in_its_width(name)) {
            return Some(format!("{unused} is not used"));
        }
        let targets: &[&str] = match on_board {
            OnBoard::Constant(of) if of.counter_bits.is_some() => return None,
            OnBoard::Constant(_) => &["left_counts", "right_counts", "dt_s"],
            OnBoard::CovarianceOnly(_) => &["left_var_m2", "left_reading_var_m2", "separation_var_m2"],
            _ => &["left_change_m", "right_change_m", "across_m", "turn_change_rad"],
        };
        if !targets.iter().any(|name| on_board.uses(name)) || !code.statements.trim_end().ends_with([';', '}']) {
            return Some("it adds nothing".to_owned());
        }
        let unread = code.remembers.iter().find(|(name, _)| !code.statements.contains(&format!("own->{name}")));
        unread.map(|(name, _)| format!("{name} is remembered for nothing"))
    }

    /// All sizes of an effect by their names: of its mean, or of its scenario where it has none.
    fn sizes(id: &str) -> Vec<&'static str> {
        let variants = hypothesis(id).and_then(Hypothesis::into_variants).unwrap_or_default();
        let fixed = variants.iter().flat_map(|variant| variant.fixed.iter().map(|(name, _)| *name));
        fixed.chain(variants.iter().flat_map(|variant| variant.term.parameters().iter().map(|of| of.name))).collect()
    }

    #[test]
    fn statements_use_every_size_of_their_effect() {
        for id in CATALOGUE {
            let (on_board, sizes) = (description(id).expect("known").on_board, sizes(id));
            assert_eq!(complaint(on_board, &sizes), None, "{id}");
            assert!(!on_board.has_mean() || !sizes.is_empty(), "{id} has no mean");
        }
        assert!(complaint(OnBoard::Static("across_m -= 1.0;"), &["skid_s"]).is_some());
        assert!(complaint(OnBoard::Static("dt_s * skid_s;"), &["skid_s"]).is_some());
        // A part of a name is not the name.
        assert!(!OnBoard::Static("across_m -= skid_s2;").uses("skid_s"));
    }

    /// The kinds are stated, not assumed: no effect has one by default. How many there are of each is in
    /// docs/export.md.
    #[test]
    fn every_effect_states_its_kind() {
        let mut counts = std::collections::BTreeMap::new();
        for id in CATALOGUE {
            let (on_board, hypothesis) = (description(id).expect("known").on_board, hypothesis(id).expect("known"));
            *counts.entry(on_board.kind()).or_insert(0) += 1;
            assert_ne!(on_board.detail(), UNSTATED, "{id}: its file does not say how it can run on board");
            // A mean of the motion runs, or says why not; what has no mean has no statements of one.
            match hypothesis {
                Hypothesis::Geometry => assert!(matches!(on_board, OnBoard::Geometry), "{id}"),
                Hypothesis::Records(_) => {
                    assert!(matches!(on_board, OnBoard::Constant(_) | OnBoard::Never(_)), "{id}");
                }
                Hypothesis::Terms(_) | Hypothesis::TermsAndScatter(..) => {
                    let has_none = matches!(on_board, OnBoard::OfInstrument | OnBoard::Never(_));
                    assert!(on_board.has_mean() || has_none, "{id}");
                }
                _ => assert!(!on_board.has_mean(), "{id}"),
            }
            assert!(!matches!(on_board, OnBoard::Never("")), "{id}: why never?");
        }
        let expected = [
            ("a constant", 5),
            ("covariance only", 3),
            ("geometry", 3),
            ("never", 5),
            ("of the instrument", 7),
            ("static", 9),
            ("with an input", 7),
            ("with state", 7),
        ];
        assert_eq!(counts.into_iter().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn corrections_undo_what_the_simulation_does() {
        let raw = RawInterval { counts: Wheels { left: 12.0, right: -8.0 }, dt_s: 20.0 };
        let corrected = |effect: &Effect, sizes: &[(&str, f64)]| {
            let OnBoard::Constant(of) = description(effect.id()).expect("known").on_board else {
                panic!("{} is no constant", effect.id())
            };
            (of.correct)(&|name| sizes.iter().find(|(of, _)| *of == name).map_or(0.0, |(_, size)| *size), raw)
        };
        let swapped = corrected(&Effect::SwappedWheels(crate::SwappedWheels { swapped: true }), &[("swapped", 1.0)]);
        assert_eq!(swapped, RawInterval { counts: Wheels { left: -8.0, right: 12.0 }, ..raw });
        let reversed = crate::ReversedWheel { left: false, right: true };
        let reversed = corrected(&Effect::ReversedWheel(reversed), &[("left", 0.0), ("right", 1.0)]);
        assert_eq!(reversed, RawInterval { counts: Wheels { left: 12.0, right: 8.0 }, ..raw });
        let counts = Effect::WrongCountsPerTurn(crate::WrongCountsPerTurn { factor: 4.0 });
        assert_eq!(corrected(&counts, &[("factor", 4.0)]).counts, Wheels { left: 3.0, right: -2.0 });
        let unit = Effect::TimeUnit(crate::TimeUnit { factor: 1e3 });
        assert_eq!(corrected(&unit, &[("factor", 1e3)]), RawInterval { dt_s: 0.02, ..raw });
    }
}

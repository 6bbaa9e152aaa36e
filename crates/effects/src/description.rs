//! What is known of an effect beside its two models: its meaning for people, what excites it, the signature
//! of a single large error of it looks, how its fault of the records is treated, and how the blind benchmark
//! draws it.
//!
//! Diagnosis, plans, pages and the benchmark ask these properties; none of them compares ids. So a new effect
//! states here all that they must know of it.

use dataset::Dataset;

use crate::benchmark::Benchmark;
use crate::estimates::Estimates;
use crate::on_board::{OnBoard, UNSTATED};

/// Properties of an effect, whatever its sizes.
#[derive(Clone)]
pub struct Description {
    /// What is wrong where the effect is, in one line for people: "the wheels lose distance in proportion to
    /// their speed".
    pub meaning: &'static str,
    /// Its description with the values that a fit found.
    pub summary: Summary,
    /// What excites it.
    pub excitation: Excitation,
    /// The signature of a single large error of it; `None` where its errors are not single ones.
    pub isolated_error: Option<IsolatedError>,
    /// How its fault of the records is treated; of record faults only.
    pub record_fault: RecordFault,
    /// The records with the stamps that they would have without it; of effects that are in the stamps alone.
    pub restamped: Option<Restamped>,
    /// The estimate of its only parameter by the counts alone; of effects that are in the stamps alone.
    pub shown_by_counts: Option<ShownByCounts>,
    /// Its parameter that is an offset of the instrument's clock, seconds; `None` where it has none.
    pub clock_offset: Option<&'static str>,
    /// To first order it is a delay, whatever the robot drives.
    pub is_delay: bool,
    /// It is the rate of a clock: its form is known as exactly as what an instrument does.
    pub is_clock_rate: bool,
    /// What of the instrument's mounting on the robot it changes; `None` where it changes none.
    pub extrinsic: Option<Extrinsic>,
    /// The ratio of the drive's geometry that it changes, with its size of that meaning; of the geometry that
    /// every calibration fits only.
    pub geometry: Option<(GeometryRatio, &'static str)>,
    /// What a robot's own odometry can do of it.
    pub on_board: OnBoard,
    /// How the blind benchmark draws it.
    pub benchmark: Benchmark,
}

/// The records of a dataset without an error of their stamps, by its only parameter's estimate and standard
/// deviation; `None` where the stamps are not what is wrong, or cannot be told.
pub type Restamped = fn(&Dataset, f64, f64) -> Option<Dataset>;

/// The estimate of an effect's only parameter by the counts of a robot's records, and its standard deviation;
/// `None` where they do not show it by themselves.
pub type ShownByCounts = fn(&[Dataset]) -> Option<(f64, f64)>;

/// A part of the instrument's mounting on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extrinsic {
    /// Where it is.
    Position,
    /// How it is turned.
    Heading,
}

/// A ratio of the true geometry over the nominal one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GeometryRatio {
    /// Of both wheels' diameters: their geometric mean.
    Wheels,
    /// Of the right wheel's diameter over the left one's.
    RightOverLeft,
    /// Of the wheel separation.
    Separation,
}

impl Description {
    /// An effect of this meaning that manoeuvres excite, without further properties.
    pub(crate) const fn of(meaning: &'static str) -> Self {
        Self {
            meaning,
            summary: Summary::Finding,
            excitation: Excitation::Manoeuvres,
            isolated_error: None,
            record_fault: RecordFault::WITH_A_TRACE,
            restamped: None,
            shown_by_counts: None,
            clock_offset: None,
            is_delay: false,
            is_clock_rate: false,
            extrinsic: None,
            geometry: None,
            on_board: OnBoard::Never(UNSTATED),
            benchmark: Benchmark::OF_MEAN,
        }
    }

    /// What is wrong, with its size; `None` where the finding's own sentence says more.
    #[must_use]
    pub fn statement(&self, values: &Estimates<'_>) -> Option<Statement> {
        match self.summary {
            Summary::Finding => None,
            Summary::Meaning => Some(Statement { what: self.meaning, size: None }),
            Summary::WithSize(statement) => Some(statement(values)),
        }
    }
}

/// What is wrong and by how much, in words for people: signs are words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Statement {
    /// What is wrong.
    pub what: &'static str,
    /// By how much, with one standard deviation; `None` where the sizes say little to people.
    pub size: Option<String>,
}

impl Statement {
    pub(crate) const fn of(what: &'static str, size: String) -> Self {
        Self { what, size: Some(size) }
    }

    /// As one part of a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        self.size.as_ref().map_or_else(|| self.what.to_owned(), |size| format!("{}: {size}", self.what))
    }
}

/// How reports describe an effect that was found.
#[derive(Clone, Copy)]
pub enum Summary {
    /// By the finding's own sentence, which says more: what a rewriting undid, or what the checks saw.
    Finding,
    /// By the meaning: the sizes say little to people.
    Meaning,
    /// By a statement with the sizes in it, which says in words what a sign means.
    WithSize(fn(&Estimates<'_>) -> Statement),
}

/// What excites an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// What is driven: a plan of manoeuvres can make it detectable.
    Manoeuvres,
    /// Other conditions than what is driven; what to do instead, as an instruction.
    Conditions(&'static str),
}

/// How a single large error of an effect measurements in the innovations at and after it. Each grid holds the
/// scales that the error's size is integrated over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IsolatedError {
    /// One wheel loses distance, anywhere where it drives: how much, metres.
    LostOnTheWay {
        /// Scales of the distance lost, metres.
        scales_m: &'static [f64],
    },
    /// Wheels lose distance as they become faster and gain it as they become slower, in proportion to the
    /// change of speed.
    LostWithSpeedChange {
        /// Scales of the distance per change of speed, seconds.
        scales_s: &'static [f64],
    },
    /// Wheels are behind where they start or stop, and catch up later.
    WoundUp {
        /// Scales of the distance that they are behind, metres.
        scales_m: &'static [f64],
    },
    /// The outside instrument is wrong at one measurement alone, in any direction and by any amount.
    OfInstrument,
}

/// How a fault of the records is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordFault {
    /// The log alone can show it. What leaves no trace is possible in any records, and is tried only where
    /// the base fit is implausible.
    pub leaves_a_trace: bool,
    /// The rewriting restores the counts only roughly, so that outliers and scatter that are left say nothing
    /// new.
    pub is_restored_roughly: bool,
    /// The size by which it multiplies the counts of both wheels: wheels that are calibrated far from nominal
    /// by one factor are such a fault.
    pub counts_factor: Option<&'static str>,
}

impl RecordFault {
    /// A fault that the log can show and that a rewriting takes back exactly.
    pub(crate) const WITH_A_TRACE: Self =
        Self { leaves_a_trace: true, is_restored_roughly: false, counts_factor: None };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypothesis::Hypothesis;
    use crate::{CATALOGUE, Estimate, description, hypothesis};

    /// What is wrong with a meaning.
    fn complaint(meaning: &str) -> Option<&'static str> {
        match meaning {
            _ if meaning.trim().is_empty() => Some("it is empty"),
            _ if meaning.contains('\n') => Some("it is more than one line"),
            _ if meaning.ends_with('.') || meaning.starts_with(char::is_uppercase) => {
                Some("it is a part of a sentence")
            }
            _ => None,
        }
    }

    #[test]
    fn every_meaning_is_one_line_of_its_own() {
        let mut meanings: Vec<&str> = CATALOGUE.iter().map(|id| description(id).expect("known").meaning).collect();
        for meaning in &meanings {
            assert_eq!(complaint(meaning), None, "{meaning}");
        }
        meanings.sort_unstable();
        meanings.dedup();
        assert_eq!(meanings.len(), CATALOGUE.len(), "two effects mean the same");
        for wrong in ["", "two\nlines", "Slips", "slips."] {
            assert!(complaint(wrong).is_some(), "{wrong}");
        }
    }

    /// A statement names no size that a fit does not have, which would show a question mark, and no sign.
    #[test]
    fn statements_show_the_sizes_that_a_fit_finds_and_say_signs_in_words() {
        let mut with_size = 0;
        for id in CATALOGUE {
            let description = description(id).expect("known");
            let Summary::WithSize(statement) = description.summary else { continue };
            let variants =
                hypothesis(id).and_then(Hypothesis::into_variants).unwrap_or_else(|| panic!("{id} has no sizes"));
            let parameters = variants.iter().flat_map(|variant| variant.term.parameters().iter().map(|of| of.name));
            let names =
                parameters.chain(variants.iter().flat_map(|variant| variant.fixed.iter().map(|(name, _)| *name)));
            let names: Vec<&str> = names.collect();
            let of = |value: f64| {
                let values = names.iter().map(|name| (*name, Estimate { value, sigma: Some(1e-3) }));
                statement(&values.collect()).sentence()
            };
            let (positive, negative) = (of(0.0125), of(-0.0125));
            assert!(!positive.contains('?') && positive.contains("± "), "{id}: {positive}");
            assert!(statement(&Estimates::default()).sentence() != positive, "{id}: it shows no size");
            // Sizes that are positive by nature keep a sign that a fit should never give them, and so does a
            // castor's kick, whose sign is that of the turn before.
            let by_nature =
                ["missed_counts", "backlash", "turn_slip", "low_speed_truncation", "castor_drag", "castor_kick"];
            let is_in_words = !negative.contains("-0.") && !negative.contains("-1");
            assert!(by_nature.contains(id) || is_in_words, "{id}: {negative}");
            let is_amplitude = ["wheel_eccentricity", "encoder_cycle"].contains(id);
            assert!(by_nature.contains(id) || is_amplitude || negative != positive, "{id}: {negative}");
            with_size += 1;
        }
        assert!(with_size >= 15, "{with_size}");
    }

    /// Properties of faults are of faults alone, single errors of what scatters alone.
    #[test]
    fn properties_are_of_the_effects_that_can_have_them() {
        for id in CATALOGUE {
            let (description, hypothesis) = (description(id).expect("known"), hypothesis(id).expect("known"));
            let is_fault = matches!(hypothesis, Hypothesis::Records(_));
            assert!(is_fault || description.record_fault == RecordFault::WITH_A_TRACE, "{id}");
            assert!(!hypothesis.signs().is_empty() || description.isolated_error.is_none(), "{id}");
            assert_eq!(matches!(hypothesis, Hypothesis::Geometry), description.geometry.is_some(), "{id}");
        }
    }
}

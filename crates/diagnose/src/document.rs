//! The document of `yair diagnose`: keys are stable, SI units.

use std::collections::BTreeMap;

use crate::settings::SEARCH;
use calib::{CalibrationReport, Names};
use motion_programs::Schedule;
use serde::Serialize;

/// In one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The calibrated model explains what was measured.
    Consistent,
    /// Every finding has one name.
    Named,
    /// Some finding has several causes that these data do not discriminate.
    Ambiguous,
    /// Some finding is not in the catalogue.
    Unlisted,
}

/// The whole diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Document {
    /// The dataset's name, or a list of them.
    pub dataset: Names,
    /// In one word.
    pub verdict: Verdict,
    /// In a sentence.
    pub sentence: String,
    /// What was diagnosed of a log that is too large to be diagnosed as a whole; absent where all of it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subsample: Option<Subsample>,
    /// The tests of the residuals that the final model leaves.
    pub checks: Vec<Check>,
    /// What was found.
    pub findings: Vec<Finding>,
    /// Every effect that was tested, most probable first.
    pub candidates: Vec<CandidateCause>,
    /// Effects that are not detectable in this data, with their detection limits.
    pub blind_to: Vec<Blind>,
    /// The detection limit of every candidate, found or not.
    pub sensitivity: Vec<Blind>,
    /// The calibration with what was found in the model.
    pub calibration: CalibrationReport,
    /// Drift of dead reckoning on held-out runs; `None` where a fault of the records was undone before, or
    /// nothing can be held out.
    pub drift: Option<HeldOutDrift>,
    /// What the extension gains on held-out runs.
    pub gain: Option<Gain>,
    /// Why there is no gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_why_null: Option<String>,
    /// What extended models gain whose effects were chosen without what they are measured on; empty where
    /// that was not asked for.
    pub nested: Vec<NestedGain>,
    /// What to drive to discriminate the causes.
    pub next_experiment: Option<NextExperiment>,
    /// Why there is nothing to drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_experiment_why_null: Option<String>,
    /// Where the geometry is that suits the data best without any effect of the robot, a calibration file.
    pub calibration_file: Option<String>,
    /// Where the extended scenario is.
    pub extended_model: Option<String>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extended_model_why_null: Option<String>,
}

/// What was diagnosed of a log that is too large to be diagnosed as a whole: stretches that are spread over
/// it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Subsample {
    /// In a sentence.
    pub sentence: String,
    /// Rows of the odometry, of which each was looked at for faults that counts show by themselves.
    pub rows: usize,
    /// Rows of the odometry that were diagnosed.
    pub diagnosed_rows: usize,
    /// Rows of all that saw the robot.
    pub measurements: usize,
    /// Those of what was diagnosed.
    pub diagnosed_measurements: usize,
    /// Stretches into which runs are cut; a short run is one.
    pub stretches: usize,
    /// Stretches that were diagnosed.
    pub diagnosed_stretches: usize,
    /// Faults of the records that counts show by themselves, in all rows.
    pub row_faults: Vec<RowFault>,
}

/// A fault of the records that counts show by themselves.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RowFault {
    /// The effect.
    pub id: String,
    /// How many stretches show it.
    pub stretches: usize,
    /// How many of these were diagnosed.
    pub diagnosed_stretches: usize,
}

/// An effect of the catalogue, tested beside the calibration alone, and why it is no cause of a finding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateCause {
    /// The effect.
    pub id: String,
    /// Standard normal quantile of its p-value, corrected for the variants tried.
    pub z: f64,
    /// Log Bayes factor of the effect over none.
    pub log_odds: f64,
    /// Why it is not named; `None` where it is.
    pub refused: Option<String>,
}

/// A question to the residuals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// Its name.
    pub name: String,
    /// What was computed: a χ², a mean square, a kurtosis or a count, by the check.
    pub statistic: f64,
    /// Its p-value: the probability of as large a statistic when nothing is wrong.
    pub p_value: f64,
    /// Whether it passes among all checks together (Holm).
    pub passes: bool,
}

/// Something that the calibrated model gets wrong: its causes, the most probable first, with sizes in SI
/// units and one standard deviation each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The most probable name, or `unlisted`.
    pub id: String,
    /// Ambiguity set: causes that this data does not discriminate, most probable first.
    pub names: Vec<String>,
    /// Probability of the first cause among all that were tried.
    pub probability: f64,
    /// Standard normal quantile of the p-value.
    pub z: f64,
    /// Probability of so large an effect when there is none, corrected for the variants tried.
    pub p_value: f64,
    /// Sizes of the first name.
    pub parameters: BTreeMap<String, Value>,
    /// For people.
    pub sentence: String,
    /// The sparse term, when no catalogued effect fits.
    pub unlisted_term: Option<UnlistedTerm>,
    /// Ids of the runs that it concerns; `None` for all.
    pub runs: Option<Vec<String>>,
    /// Whether every session and kind of path that could tell has more than half of the size that the others
    /// give it; `None` where these data cannot tell.
    pub carries_over: Option<bool>,
    /// Why.
    pub carries_over_why: String,
    /// Whether the extended model has it; `None` of what is no term of the mean.
    pub in_extended_model: Option<bool>,
    /// Sizes in each session that determines them, along the proportions found in all.
    pub by_session: BTreeMap<String, BTreeMap<String, Value>>,
    /// The same for each kind of path.
    pub by_kind: BTreeMap<String, BTreeMap<String, Value>>,
    /// How the sizes differ between sessions, and between kinds of path, where there are three or more.
    pub heterogeneity: Vec<Differences>,
}

impl Finding {
    /// Whether it is a term of the model's mean, which another session may have as well.
    #[must_use]
    pub const fn is_of_the_mean(&self) -> bool {
        self.in_extended_model.is_some()
    }
}

/// How the sizes of a term differ between the units of one level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Differences {
    /// The level.
    pub level: GainLevel,
    /// How many units determine their size.
    pub units: usize,
    /// Cochran's Q; χ² of one degree less than units where all have one size.
    pub cochran_q: f64,
    /// Its p-value.
    pub p_value: f64,
    /// Standard deviation of the units' own sizes, as a share of the size found in all.
    pub tau: f64,
    /// Probability that a new unit has less than half of the mean size.
    pub less_than_half_probability: f64,
}

/// A size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Value {
    /// In the unit beside it.
    pub value: f64,
    /// One standard deviation; `None` for a variant parameter that was tried at a few values.
    pub sigma: Option<f64>,
    /// The unit.
    pub unit: String,
}

/// A term outside of the catalogue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnlistedTerm {
    /// `along`, `across` or `yaw` of the motion, or `seen_along`, `seen_across`, `seen_heading` of what the
    /// instrument sees.
    pub channel: String,
    /// Its rate, or its size in the measurement, is the coefficient times the product of these; `1` for none.
    /// `kind = "term"` in a scenario takes them.
    pub covariates: Vec<String>,
    /// In m/s or rad/s; in metres or radians in the measurement.
    pub coefficient: f64,
    /// One standard deviation.
    pub sigma: f64,
}

impl UnlistedTerm {
    /// A term with its coefficient's value and standard deviation; `None` where the data do not determine it.
    pub(crate) fn determined(channel: &str, covariates: Vec<String>, size: (f64, f64)) -> Option<Self> {
        let (coefficient, sigma) = size;
        let is_determined = coefficient.is_finite() && sigma.is_finite();
        is_determined.then(|| Self { channel: channel.to_owned(), covariates, coefficient, sigma })
    }
}

/// Detection limits by effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Blind {
    /// The effect.
    pub id: String,
    /// Why it does not show, or how sharply it would.
    pub why: String,
    /// With probability 0.9 at a false-positive rate of 1e-3; `None` when no size is detectable.
    pub smallest_detectable: Option<Smallest>,
}

/// A size of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Smallest {
    /// In the unit beside it.
    pub value: f64,
    /// The unit.
    pub unit: String,
    /// Which parameter.
    pub parameter: String,
}

/// Final position error of dead reckoning over the distance driven, per cent, on runs that were held out: as
/// configured, calibrated on the other runs, and with what was found as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HeldOutDrift {
    /// How many runs, or blocks of runs, were held out, each once.
    pub held_out_runs: usize,
    /// Distance driven by all of them, metres.
    pub distance_m: f64,
    /// How many runs that distance is of.
    pub runs: usize,
    /// With the nominal geometry.
    pub nominal: Drift,
    /// With the geometry calibrated.
    pub calibrated: Drift,
    /// With the extended model; `None` where it is the calibrated one.
    pub extended: Option<Drift>,
    /// What calibrating gains over the nominal geometry (`base`), run by run.
    pub calibrated_over_nominal: Compared,
}

/// A drift with its 95 % interval over runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Drift {
    /// Final position error over the distance, per cent.
    pub percent: f64,
    /// Lower bound at 95 %; 0 where the interval would reach below.
    pub low: f64,
    /// Upper bound at 95 %.
    pub high: f64,
}

/// What an extension gains on runs that were held out: fitted without them, then tried on them. Bounds are at
/// 95 %, over runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// How many runs, or blocks of runs, were held out, each once.
    pub held_out_runs: usize,
    /// Log likelihood of a scalar observation: extended − base.
    pub log_score_per_observation: Compared,
    /// Final position error of dead reckoning over the distance: base − extended.
    pub drift_percent: Option<Compared>,
    /// The same with runs, whole kinds of path and whole sessions held out, where there are several.
    pub levels: Vec<LevelGain>,
}

/// What is held out together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GainLevel {
    /// Blocks of runs.
    Blocks,
    /// Runs, in a few folds that have runs of each protocol.
    Runs,
    /// Kinds of path.
    Kinds,
    /// Sessions.
    Sessions,
}

/// What an extension gains on what was held out together; intervals are over the units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LevelGain {
    /// What is a unit.
    pub level: GainLevel,
    /// How many units there are.
    pub units: usize,
    /// As in [`Gain`].
    pub log_score_per_observation: Compared,
    /// As in [`Gain`].
    pub drift_percent: Option<Compared>,
}

/// What extended models gain whose effects were chosen without what they are measured on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NestedGain {
    /// What was left out in turn.
    pub level: GainLevel,
    /// How many units were held against a diagnosis of the others.
    pub units: usize,
    /// How many of these had a diagnosis that extends nothing, and so gain nothing.
    pub abstained: usize,
    /// Final position error of dead reckoning over the distance: base − extended, the interval over units.
    pub drift_percent: Option<Compared>,
    /// Each unit.
    pub held_out: Vec<HeldOutUnit>,
}

/// One unit that was left out of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutUnit {
    /// The session or kind of path.
    pub unit: String,
    /// Effects of the mean in the others' extended model; `None` where they have none.
    pub found: Option<Vec<String>>,
    /// Why there is no model, or nothing to hold it against.
    pub why_null: Option<String>,
    /// Mean final position error of dead reckoning over the unit's runs, metres: base − extended, with an
    /// interval over the runs; `None` with fewer than two.
    pub final_position_m: Option<Compared>,
}

impl Gain {
    /// Whether odometry drifts more with the extended model, beyond the 95 % interval and by a material
    /// share. Such a model is refused, whatever it gains on single measurements.
    #[must_use]
    pub fn drifts_more(&self) -> bool {
        self.drifts_more_by(1.0)
    }

    /// Whether held-out measurements are no likelier under the extended model.
    pub(crate) fn predicts_worse(&self) -> bool {
        let score = self.log_score_per_observation;
        score.low + score.high <= 0.0
    }

    /// Whether odometry drifts more at so many half-widths of the 95 % interval.
    pub(crate) fn drifts_more_by(&self, half_widths: f64) -> bool {
        self.drift_percent.as_ref().is_some_and(|drift| {
            let (mean, half_width) = (0.5 * (drift.low + drift.high), 0.5 * (drift.high - drift.low));
            mean + half_widths * half_width < 0.0
                && drift.extended > (1.0 + SEARCH.material_drift_increase) * drift.base
        })
    }
}

/// Base and extended model compared; positive bounds are a gain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Compared {
    /// Without the extension, in the unit of what is compared.
    pub base: f64,
    /// With it, in the same unit.
    pub extended: f64,
    /// Lower bound of the gain at 95 %.
    pub low: f64,
    /// Upper bound of the gain at 95 %.
    pub high: f64,
}

/// What to drive next.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextExperiment {
    /// What to drive, as the part of a scenario that drives it (TOML).
    pub protocol: String,
    /// Why, within which floor and time, and where to measurement.
    pub why: String,
    /// What each name predicts, or from which size on an effect would show.
    pub predicts: BTreeMap<String, String>,
    /// The predictions as numbers, where causes are to be discriminated.
    pub predicted: Option<Predicted>,
    /// What to drive, in words.
    pub drive: String,
    /// The same by speed: a session each.
    pub sessions: Vec<PlannedSession>,
    /// How many runs.
    pub runs: u64,
    /// Driving and handling, minutes.
    pub minutes: f64,
    /// One side over which the robot's centre moves, metres.
    pub free_x_m: f64,
    /// The other side, metres.
    pub free_y_m: f64,
    /// Floor and time within which it was sought, and where they come from.
    pub within: String,
}

/// Runs at one speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedSession {
    /// Speed of the faster wheel, m/s: `cruise_speed_m_s` of a scenario's robot.
    pub speed_m_s: f64,
    /// The `[[protocol]]` blocks of a scenario.
    #[serde(skip)]
    pub protocol_toml: String,
    /// What is driven.
    #[serde(rename = "protocol")]
    pub schedules: Vec<Schedule>,
}

/// What each name says that one kind of run will show: where the instrument sees the robot against dead
/// reckoning with the calibrated geometry alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Predicted {
    /// `forward`, `backward`, `clockwise` or `counter-clockwise`.
    pub direction: String,
    /// When: a share of the run's duration.
    pub share_of_duration: f64,
    /// `along` (ahead is positive), `across` (left is positive) or `heading` (left is positive).
    pub component: String,
    /// The mean over the runs of that direction, by name.
    pub values: BTreeMap<String, Value>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_drifts_more_beyond_the_interval_and_by_a_material_share_alone() {
        let drifts = |base, extended, low, high, half_widths| {
            let of = Compared { base, extended, low, high };
            let gain =
                Gain { held_out_runs: 6, log_score_per_observation: of, drift_percent: Some(of), levels: vec![] };
            gain.drifts_more_by(half_widths)
        };
        // −3 ± 2: below nothing by one half-width, and not by two.
        assert!(drifts(1.0, 4.0, -5.0, -1.0, 1.0) && !drifts(1.0, 4.0, -5.0, -1.0, 2.0));
        assert!(drifts(1.0, 4.0, -5.0, -1.0, -1.0));
        // +3 ± 2 drifts less. Rejects the difference of the bounds for their mean.
        assert!(!drifts(4.0, 1.0, 1.0, 5.0, 1.0));
        // An interval from below nothing to above it, and one that ends at nothing, say nothing.
        assert!(!drifts(1.0, 1.5, -2.0, 1.0, 1.0) && !drifts(1.0, 2.0, -2.0, 0.0, 1.0));
        // By 4 % more, and by 6 %. Rejects any increase.
        assert!(!drifts(1.0, 1.04, -0.05, -0.03, 1.0) && drifts(1.0, 1.06, -0.07, -0.05, 1.0));
        let of = Compared { base: 1.0, extended: 4.0, low: -5.0, high: -1.0 };
        let gain = Gain { held_out_runs: 6, log_score_per_observation: of, drift_percent: Some(of), levels: vec![] };
        assert!(gain.drifts_more() && !Gain { drift_percent: None, ..gain }.drifts_more());
    }

    #[test]
    fn a_term_without_a_number_is_not_determined() {
        let term = |size| UnlistedTerm::determined("yaw", vec!["v".to_owned()], size);
        let of = term((0.2, 0.1)).expect("determined");
        assert_eq!((of.channel.as_str(), of.coefficient, of.sigma), ("yaw", 0.2, 0.1));
        assert!(term((f64::NAN, 0.1)).is_none() && term((0.2, f64::INFINITY)).is_none());
    }
}

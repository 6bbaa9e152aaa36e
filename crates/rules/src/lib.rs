//! Rules that decide about a log, by name: an ablation switches them off, or counts how often they decide.
//!
//! A rule that is off decides nothing: its condition is false, its result is none, its change is not made.
//! Counts are of decisions that differ from that.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

pub use serde;

macro_rules! rules {
    ($($(#[doc = $for:literal])+ $rule:ident,)*) => {
        /// A rule that may decide about a log.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        #[non_exhaustive]
        pub enum Rule {
            $($(#[doc = $for])+ $rule,)*
        }

        impl Rule {
            /// All rules, in the order of a diagnosis.
            pub const ALL: &[Self] = &[$(Self::$rule),*];
        }
    };
}

rules! {
    /// Records: stamps that the counts alone show to be wrong are restored before any fit.
    StampsByCounts,
    /// Clocks: a drift of the clocks is taken off before any fit.
    ClockDrift,
    /// Clocks: an offset of all runs, or a run with an offset, is taken off before any fit.
    ClockOffsets,
    /// Clocks: where most measurements are outliers, a smaller common offset is taken off too.
    ClockRetry,
    /// Contamination: intervals across which the robot or the frame moved are not compared.
    UnknownMotions,
    /// Contamination: runs with another mounting of the instrument are left out.
    OtherExtrinsics,
    /// Contamination: what was found with all intervals compared is taken where it explains the others'
    /// events.
    WholeWithoutEvents,
    /// Records: a fault of the records is undone.
    RecordFault,
    /// Records: a second fault is sought after the first.
    SecondRecordFault,
    /// Base fit: measurements are thinned where odometry seems uncorrelated with all of them.
    ThinnedIfUncorrelated,
    /// Records: stamps that the residuals show to be wrong are restored.
    StampsByResiduals,
    /// Records: restored stamps are kept only if the log then explains as much.
    StampsUndone,
    /// Extrinsics found before the search take the place of the candidate that resembles them.
    ExtrinsicsInstead,
    /// Search: what lasts of the autocorrelation is judged by a part of the runs of a large log.
    AutocorrelationByPart,
    /// Thinning: the spacing goes by what is left with the effects that were found.
    ThinnedBesideEffects,
    /// Outliers: a search without the gate, where there are more outliers than the noise makes.
    UngatedSearch,
    /// Noise of instants is fitted, and effects are sought with it.
    TimingNoise,
    /// One sparse term that explains as much doubts the effects.
    CompetingTerm,
    /// One sparse term that explains more than all effects takes their place or joins them.
    TermInstead,
    /// Autocorrelation: sparse terms that explain it are taken.
    TermsExplainAutocorrelation,
    /// Autocorrelation: a term with which odometry drifts more shows that another cause is present.
    SpuriousTerm,
    /// Autocorrelation: measurements are thinned where it lasts.
    ThinIfAutocorrelated,
    /// Search: a second search at a higher level where residuals depend on something.
    SearchIfDependent,
    /// Search: sparse terms where residuals depend on something still.
    TermsIfDependent,
    /// Scan: a score below the form error of a larger effect does not count.
    FormErrorInScan,
    /// Scan: candidates that the encoders do not resolve are not tested.
    Unresolved,
    /// Scan: a candidate whose score is not significant is refitted where it may become so.
    SignificantOnceRefitted,
    /// Search: a subset takes the place of effects that only cancel each other, or that are not needed.
    SmallestSubset,
    /// Search: subsets whose effects cancel each other are no models.
    Cancellation,
    /// Rivals: where none that explains as much is possible, the others are asked.
    RivalsOfTheRest,
    /// Rivals: estimates that no effect has.
    Unphysical,
    /// Rivals: sizes that robots do not have.
    Implausible,
    /// Rivals: wheels that are far from the stated ones with the effect alone.
    OtherWheels,
    /// Rivals: further variants are fitted where the best one is not possible.
    FurtherVariants,
    /// Rivals: what explains more and is impossible doubts the first that is possible.
    Outdone,
    /// Search: the refit must confirm the score.
    RefitConfirms,
    /// Search: statistics are deflated by what coarse encoders inflate.
    Inflation,
    /// Tests: where the rounding of counts decides, tests are judged among simulated runs.
    JudgedAmongSimulated,
    /// Search: an effect must be significant over the runs.
    OverRuns,
    /// Search: where turns scatter, an effect must be as significant over the runs as in all.
    OverScatteredRuns,
    /// Search: an effect that predicts held-out runs worse is refused.
    PredictsWorse,
    /// Search: an effect with which held-out runs drift more is refused.
    DriftsMore,
    /// Search: an effect without a cause that is significant given the others is refused.
    Unconfirmed,
    /// Causes: differences between delays count in units of their scatter over runs.
    DelayScatter,
    /// Causes: a cause that explains as much stays, whatever its prior.
    ExplainsAsMuch,
    /// Causes: their estimates' spread is added to the other effects' standard deviations.
    SpreadOverCauses,
    /// Search: an effect that is not significant at the end is taken out.
    InsignificantAtTheEnd,
    /// Findings: extrinsics that were fitted before the search.
    ExtrinsicsFound,
    /// Findings: the mean lateness of stamps joins the clock's offset.
    MeanLateness,
    /// Findings: another robot's wheels or geometry doubt all effects.
    OtherGeometryDoubts,
    /// Findings: faults of the records without a name doubt all effects.
    FaultyRecordsDoubt,
    /// Findings: failed checks that nothing explains.
    FailedChecks,
    /// Findings: an effect may be part of a stronger unlisted or noise finding.
    PartOfStronger,
    /// Findings: an effect whose data have another form is doubted.
    OtherForm,
    /// Findings: effects are doubted where an uncatalogued term is significant with them.
    Incomplete,
    /// Findings: failed checks weaker than an incomplete effect are left out.
    WithoutWhatDoubtsSay,
    /// Findings: effects of low significance are doubted.
    LowSignificance,
    /// Findings: an effect that other sessions and paths do not have is doubted.
    DoesNotCarryOver,
    /// Findings: what the errors of a map or of rounded rates explain is left out.
    SystematicErrors,
    /// Findings: doubted findings are left out where stamps are uncertain.
    RemaindersOfStamps,
    /// Noise effects: isolated outliers.
    IsolatedErrors,
    /// Noise effects: where residuals depend on something, only scatter of turns is reported.
    DependentResiduals,
    /// Noise effects: jumps by heavy tails and outliers.
    LargeErrors,
    /// Noise effects: the likelihood of large errors says whose they are.
    Attribution,
    /// Noise effects: what errors do at rest says whether they are the instrument's.
    ErrorsAtRest,
    /// Noise effects: turns that scatter.
    TurnScatter,
    /// Noise effects: turns are judged among those of simulated runs where rates are rounded.
    TurnScatterAmongSimulated,
    /// Noise effects: one that a mean effect of the same cause has already is left out.
    NamedAlready,
    /// Fit: nuisances of the instrument that predict held-out units.
    Nuisances,
    /// Fit: nuisances that explain outliers or autocorrelation are taken without the gate.
    NuisancesExplain,
    /// Fit: nuisances with which the ends of runs drift more are refused.
    NuisancesDrift,
    /// Fit: each run or session may have an instrument of its own.
    NuisancesOfGroups,
    /// Fit: nuisances that hide the geometry are refused.
    NuisancesHide,
    /// Fit: directions of the geometry that are not observable are fixed.
    FixUnobservable,
    /// Fit: the sensor's position is found before the first fit where headings are missing.
    SensorPosition,
    /// Fit: measurements are thinned until their innovations are white.
    Thinning,
    /// Fit: of poses between rows, one a row, and those near their rows, are taken.
    PosesBetweenRows,
    /// Covariance: recorded rates that are alike share the error of their rounding.
    SharedRates,
    /// Covariance: what a map's distortion and shared rates add.
    SystematicCovariance,
    /// Filter: a measurement beyond the gate is left out.
    OutlierGate,
    /// Filter: after outliers in a row the pose is begun anew.
    RestartAfterOutliers,
    /// Rows: the sampling period that stamps follow.
    SamplingPeriod,
    /// Rows: packets of rows that a controller sends together.
    Packets,
    /// Rows: delays of rows that are stamped on receipt.
    ReceiptDelays,
    /// Rows: rows between ticks are left out.
    RowsByThemselves,
    /// Rows: stamps that jitter are tried with other numbers of lost rows.
    NumberingRounds,
}

impl Rule {
    /// Whether the rule decides: its condition, unless it is off.
    #[inline]
    #[must_use]
    pub fn applies(self, condition: bool) -> bool {
        match ABLATION.get() {
            None => condition,
            Some(ablation) => condition && ablation.decides(self),
        }
    }

    /// What the rule finds, or none where it is off.
    #[must_use]
    pub fn finds<T>(self, found: Option<T>) -> Option<T> {
        found.filter(|_| self.applies(true))
    }

    /// What a change makes of a value, or the value as it was where the rule is off.
    #[must_use]
    pub fn changes<T: Clone + PartialEq>(self, before: T, change: impl FnOnce(T) -> T) -> T {
        if ABLATION.get().is_none() {
            return change(before);
        }
        let after = change(before.clone());
        if self.applies(before != after) { after } else { before }
    }

    /// Whether the rule is on at all: for what is costly to find.
    #[must_use]
    pub fn is_on(self) -> bool {
        ABLATION.get().is_none_or(|ablation| !ablation.off.contains(&self))
    }
}

static ABLATION: OnceLock<Ablation> = OnceLock::new();

#[derive(Debug)]
struct Ablation {
    off: BTreeSet<Rule>,
    decided: Vec<AtomicU64>,
}

impl Ablation {
    fn decides(&self, rule: Rule) -> bool {
        self.decided[rule as usize].fetch_add(1, Ordering::Relaxed);
        !self.off.contains(&rule)
    }
}

/// Rules were switched off before in this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("rules are switched off once a process")]
pub struct SwitchedBefore;

/// Switches rules off and counts decisions from here on.
///
/// # Errors
/// [`SwitchedBefore`] the second time.
pub fn switch_off(rules: impl IntoIterator<Item = Rule>) -> Result<(), SwitchedBefore> {
    let decided = Rule::ALL.iter().map(|_| AtomicU64::new(0)).collect();
    ABLATION.set(Ablation { off: rules.into_iter().collect(), decided }).map_err(|_| SwitchedBefore)
}

/// How often each rule decided, or would have where it is off; `None` where nothing is counted.
#[must_use]
pub fn decisions() -> Option<BTreeMap<Rule, u64>> {
    let counts = Rule::ALL.iter().copied().zip(&ABLATION.get()?.decided);
    Some(counts.map(|(rule, count)| (rule, count.load(Ordering::Relaxed))).filter(|of| of.1 > 0).collect())
}

/// Settings of one subject: fields with a default each. They are data, which an ablation may vary.
#[macro_export]
macro_rules! settings {
    ($name:ident $($(#[$doc:meta])* $field:ident: $of:ty = $value:expr,)*) => {
        /// The settings of this subject.
        #[derive(Debug, Clone, PartialEq, $crate::serde::Deserialize)]
        #[serde(crate = "rules::serde", default, deny_unknown_fields)]
        #[non_exhaustive]
        pub struct $name {
            $($(#[$doc])* pub $field: $of,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $value,)* }
            }
        }
    };
}

/// The settings of a crate by subject, each with the static that the crate reads. They can be installed once
/// a process, before any of them is read.
#[macro_export]
macro_rules! rooms {
    ($($subject:ident: $name:path as $read:ident,)*) => {
        /// All settings of the crate.
        #[derive(Debug, Clone, PartialEq, Default, $crate::serde::Deserialize)]
        #[serde(crate = "rules::serde", default, deny_unknown_fields)]
        #[non_exhaustive]
        pub struct Settings {
            $(
                /// Those of the subject.
                pub $subject: $name,
            )*
        }

        static INSTALLED: std::sync::OnceLock<Settings> = std::sync::OnceLock::new();

        /// Takes settings in place of the defaults.
        ///
        /// # Errors
        /// [`rules::SwitchedBefore`] where settings were installed or read before.
        pub fn install(settings: Settings) -> Result<(), $crate::SwitchedBefore> {
            INSTALLED.set(settings).map_err(|_| $crate::SwitchedBefore)
        }

        $(
            pub(crate) static $read: std::sync::LazyLock<$name> =
                std::sync::LazyLock::new(|| INSTALLED.get_or_init(Settings::default).$subject.clone());
        )*
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_that_is_off_decides_nothing_and_is_counted() {
        switch_off([Rule::Outdone]).expect("the first time");
        assert!(!Rule::Outdone.applies(true) && !Rule::Outdone.applies(false) && Rule::Packets.applies(true));
        assert_eq!((Rule::Outdone.finds(Some(1)), Rule::Packets.finds(Some(1))), (None, Some(1)));
        let changed = |rule: Rule, before, after| rule.changes(before, |_| after);
        assert_eq!(
            (changed(Rule::Outdone, 1, 2), changed(Rule::Packets, 1, 2), changed(Rule::Packets, 3, 3)),
            (1, 2, 3)
        );
        assert_eq!(decisions(), Some(BTreeMap::from([(Rule::Outdone, 3), (Rule::Packets, 3)])));
        assert_eq!(switch_off([]), Err(SwitchedBefore));
        assert_eq!(Rule::ALL[Rule::Packets as usize], Rule::Packets);
    }
}

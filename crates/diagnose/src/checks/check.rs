//! Tests of the residuals and of the records, by what they ask.

use crate::document;

/// A component of a pose residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Component {
    /// Along the robot's heading.
    Along,
    /// Across it.
    Across,
    /// Its heading.
    Heading,
}

impl Component {
    /// In the order of the innovations' components.
    pub(crate) const ALL: [Self; 3] = [Self::Along, Self::Across, Self::Heading];

    const fn name(self) -> &'static str {
        match self {
            Self::Along => "along",
            Self::Across => "across",
            Self::Heading => "heading",
        }
    }
}

/// What is tested.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Check {
    /// Mean normalised innovation squared of a component.
    InnovationSize(Component),
    /// Whether it differs between runs.
    RunToRun,
    /// Autocorrelation of a component's innovations.
    Whiteness(Component),
    /// Kurtosis of a component's innovations.
    Tails(Component),
    /// Number of rejected measurements.
    Outliers,
    /// Whether residuals depend on a recorded covariate.
    Covariate(String),
    /// Whether single rows of the log are outlying.
    LogRows,
    /// Whether log and measurements last equally long.
    LogSpans,
}

impl Check {
    /// Whether residuals are asked of a covariate by it.
    pub(crate) const fn is_of_covariate(&self) -> bool {
        matches!(self, Self::Covariate(_))
    }

    /// Whether it asks for autocorrelation.
    pub(crate) const fn is_of_whiteness(&self) -> bool {
        matches!(self, Self::Whiteness(_))
    }

    /// Its key in JSON.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::InnovationSize(component) => format!("nis_{}", component.name()),
            Self::RunToRun => "run_to_run".to_owned(),
            Self::Whiteness(component) => format!("white_{}", component.name()),
            Self::Tails(component) => format!("kurtosis_{}", component.name()),
            Self::Outliers => "outliers".to_owned(),
            Self::Covariate(name) => name.clone(),
            Self::LogRows => "log_rows".to_owned(),
            Self::LogSpans => "log_spans".to_owned(),
        }
    }
}

/// The result of a test.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TestResult {
    pub(crate) check: Check,
    pub(crate) statistic: f64,
    /// Probability of as large a statistic when nothing is wrong.
    pub(crate) p_value: f64,
    pub(crate) passes: bool,
}

impl TestResult {
    /// Whether residuals depend on a covariate by it.
    pub(crate) fn shows_dependence(&self) -> bool {
        !self.passes && self.check.is_of_covariate()
    }

    /// As scripts get it.
    pub(crate) fn document(&self) -> document::Check {
        let Self { ref check, statistic, p_value, passes } = *self;
        document::Check { name: check.name(), statistic, p_value, passes }
    }
}

/// What follows large innovations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ResidualPersistence {
    /// The next are off the same way: the robot jumped.
    Persistent,
    /// The next are off the other way: one measurement erred.
    Reverting,
    /// Neither is significant.
    Undecided,
}

/// Correlation of innovations that follow each other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Correlation {
    /// At lag one.
    pub(crate) coefficient: f64,
    /// The same of all lags, in standard errors.
    pub(crate) sigmas: f64,
}

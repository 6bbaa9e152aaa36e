//! Causes of what a calibrated model gets wrong, what they were found by, and why one is not alone.

use effects::Covariate;

use crate::checks::check::{Check, ResidualPersistence};
use crate::checks::errors_at_rest::ErrorsAtRest;
use crate::document::UnlistedTerm;
use crate::findings::geometry_deviation::GeometryDeviation;
use crate::records::unknown_motion::Anomaly;

/// A candidate cause.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cause {
    /// An effect of the catalogue, by its id.
    Effect(&'static str),
    /// A term that is in no catalogue.
    Term(UnlistedTerm),
    /// Something that is in no catalogue, and of no known form.
    Unknown,
}

impl Cause {
    /// Its id in JSON.
    pub(crate) const fn id(&self) -> &'static str {
        match self {
            Self::Effect(id) => id,
            Self::Term(_) | Self::Unknown => "unlisted",
        }
    }

    /// Whether it is in no catalogue.
    pub(crate) const fn is_unlisted(&self) -> bool {
        !matches!(self, Self::Effect(_))
    }
}

/// What a finding was found by.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Basis {
    /// A mean effect of the catalogue in the augmented model.
    Mean,
    /// The best of so many products of covariates.
    Products(usize),
    /// Failed tests of the residuals that nothing explains.
    FailedTests(Vec<Check>),
    /// Odometry is uncorrelated with what the instrument measured: noise of wheel, turn, position and
    /// heading to the best fit.
    Uncorrelated([f64; 4]),
    /// So many outlying rows of the log.
    OutlyingRows(f64),
    /// The log lasts so many times as long as the measurements.
    OtherClock(f64),
    /// Calibrated wheels are so many times as large as nominal ones.
    WheelFactor(f64),
    /// The calibrated geometry is not the stated one.
    Geometry(GeometryDeviation),
    /// The clock of the instrument is off by so many seconds: of all runs, or of these.
    ClockOffset(f64),
    /// The robot's clock gains so many seconds a second on the instrument's.
    ClockDrift(f64),
    /// The extrinsics of the base fit.
    Extrinsics,
    /// Stretches of runs that do not belong, the largest first.
    Anomalies(Vec<Anomaly>),
    /// A fault of the records, in words.
    RecordFault(String),
    /// So many isolated errors of the instrument among so many measurements.
    IsolatedErrors(usize, usize),
    /// Large errors, by what follows them.
    LargeErrors(ResidualPersistence),
    /// Autocorrelated errors with this coefficient, and what they are while the robot stands.
    Autocorrelated(f64, ErrorsAtRest),
    /// Headings scatter with the turn, rad/√rad.
    TurnScatter(f64),
}

/// Why a cause is not alone.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Doubt {
    /// One uncatalogued term explains the data as well.
    TermDoesAsWell,
    /// Something is left that it does not explain.
    Incomplete,
    /// In the data its size changes with this covariate, which that of such an effect does not.
    OtherForm(Covariate),
    /// Other unmodelled effects of turns scatter like it.
    ScattersAlike,
    /// It is of low significance.
    LowSignificance,
    /// It may be part of an uncatalogued effect.
    PartOfUnlisted,
    /// It is more probably part of an uncatalogued effect than itself.
    ProbablyPartOfUnlisted,
    /// A fault of the records may do the same.
    FaultyRecords,
    /// Some session or kind of path does not have it as the others give it.
    DoesNotCarryOver,
    /// The geometry that it is found beside is not that of the described robot.
    OtherGeometry,
}

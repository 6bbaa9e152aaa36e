//! Why there is no fit.

use dataset::{Session, WheelLog, suspected_spike, suspected_wrap};
use kinematics::{GeometryError, Side};

/// Why sessions give no maximum-likelihood fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EstimationError {
    /// Nothing was given.
    #[error("there is no session")]
    NoSession,
    /// The nominal values of the robot are not a drive.
    #[error("the nominal robot is not a drive: {0}")]
    NotADrive(#[from] GeometryError),
    /// The counters wrap and no `counter_bits` says where.
    #[error(transparent)]
    CounterWraps(#[from] WrappedCounter),
    /// A counter leaves its place for one row: a fit would take both leaps for motion.
    #[error(
        "run {run}: the {side} counter reads {ticks} at {t_s} s and is back in the row after: a spike; take that row out of odometry.csv"
    )]
    CounterSpike {
        /// The run's id.
        run: String,
        /// `left` or `right`.
        side: &'static str,
        /// When, seconds.
        t_s: f64,
        /// What it reads.
        ticks: i64,
    },
    /// No run has wheels and two measurements.
    #[error("no run has logged wheels and two measurements of an instrument within its log")]
    NoMeasurements,
    /// The fit left what is finite.
    #[error("the fit diverges: the measurements do not follow the wheels at all")]
    Diverges,
    /// A profile was asked for of a parameter that is not free, or not observable.
    #[error("{parameter} is not fitted, or not observable: it has no profile")]
    NoProfile {
        /// The parameter.
        parameter: String,
    },
}

/// A counter that wraps at a width which the dataset does not state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("run {run}: the {side} counter wraps at {bits} bits; say counter_bits = {bits} under [robot] in dataset.toml")]
pub struct WrappedCounter {
    /// The run's id.
    pub run: String,
    /// `left` or `right`.
    pub side: &'static str,
    /// The counter's width by its jumps, bits.
    pub bits: u8,
}

/// Refuses sessions whose counters wrap unannounced: a fit would take a jump of 2ⁿ counts for motion.
///
/// # Errors
/// [`EstimationError::CounterWraps`] for the first run that shows it.
pub fn refuse_wrapped_counters(sessions: &[Session<'_>]) -> Result<(), EstimationError> {
    for view in sessions.iter().flat_map(|session| &session.runs) {
        let WheelLog::Ticks(ticks) = &view.odometry().wheels else { continue };
        for side in Side::BOTH {
            if let Some(row) = suspected_spike(&ticks[side]) {
                let (run, t_s) = (view.info().id.clone(), view.odometry().t_s[row]);
                return Err(EstimationError::CounterSpike { run, side: side.name(), t_s, ticks: ticks[side][row] });
            }
            if let Some(bits) = suspected_wrap(&ticks[side]) {
                return Err(WrappedCounter { run: view.info().id.clone(), side: side.name(), bits }.into());
            }
        }
    }
    Ok(())
}

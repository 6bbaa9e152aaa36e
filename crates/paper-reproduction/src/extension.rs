//! Extensions of the paper's model: what each says, which sizes are plausible, and how it acts in the
//! simulator.

use effects::{Command, Forward, Step};
use serde::Serialize;

use super::units::MM_PER_M;

/// A guess at what the model lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Extension {
    /// Nothing.
    None,
    /// The wheelbase in quarter turns differs from the one in long spins.
    CornerWheelbase,
    /// Each wheel loses a length at every start and stop.
    StartStopLength,
    /// The wheels slip by a share of their travel whenever the robot turns on the spot.
    TurnSlip,
    /// The squares were driven by a robot that assumed 500 pulses a turn, 1.0053 mm a pulse.
    NominalOf500,
    /// The scale error of the short runs is not there, or not all of it, on the squares.
    ScaleOnSquares,
}

/// Name, what it says, the unit of its size, and the sizes that are physically plausible with the reason.
pub(crate) struct Description {
    pub(crate) says: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) scale: f64,
    pub(crate) plausible_range: (f64, f64),
    pub(crate) because: &'static str,
}

impl Extension {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::None,
        Self::CornerWheelbase,
        Self::StartStopLength,
        Self::TurnSlip,
        Self::NominalOf500,
        Self::ScaleOnSquares,
    ];

    pub(crate) fn description(self) -> Description {
        let describe =
            |says, unit, scale, plausible_range, because| Description { says, unit, scale, plausible_range, because };
        match self {
            Self::None => describe("the paper's model as published", "", 1.0, (0.0, 0.0), "nothing is assumed"),
            Self::CornerWheelbase => describe(
                "the wheelbase in quarter turns differs from the one in long spins (turn rate, acceleration)",
                "%",
                100.0,
                (-3.0, 3.0),
                "wheelbases that depend on the turn are known up to about 3 %",
            ),
            Self::StartStopLength => describe(
                "each wheel loses a length at every start and stop",
                "mm",
                MM_PER_M,
                (-2.6, 2.6),
                "backlash at a wheel of this size loses up to about 2.6 mm",
            ),
            Self::TurnSlip => describe(
                "the wheels slip by a share of their travel in every turn on the spot",
                "%",
                100.0,
                (0.0, 1.0),
                "slip at walking speed is a per cent at most",
            ),
            Self::NominalOf500 => describe(
                "the squares were driven with a nominal 1.0053 mm/pulse (500 pulses a turn)",
                "",
                1.0,
                (0.0, 0.0),
                "a robot may assume a round number of pulses",
            ),
            Self::ScaleOnSquares => describe(
                "both wheels roll farther or shorter on the squares than on the short runs",
                "%",
                100.0,
                (-0.5, 0.5),
                "load and floor change a wheel's radius by tenths of a per cent",
            ),
        }
    }

    pub(crate) const fn has_size(self) -> bool {
        !matches!(self, Self::None | Self::NominalOf500)
    }
}

/// A turn on the spot of less travel a wheel is a corner: a quarter turn takes 285 mm, a whole one 1140 mm,
/// at 80 counts a millimetre.
const CORNER_BELOW_COUNTS: f64 = 80.0 * 570.0;

/// The extension at work. Sizes are small against the travels they change.
pub(crate) struct ActingExtension {
    extension: Extension,
    size: f64,
    corner: bool,
    starting: bool,
}

impl ActingExtension {
    pub(crate) const fn new(extension: Extension, size: f64) -> Self {
        Self { extension, size, corner: false, starting: false }
    }
}

impl Forward for ActingExtension {
    fn start_motion(&mut self) {
        self.starting = true;
    }

    fn command(&mut self, command: &mut Command) {
        let turning = command.travel_counts.left * command.travel_counts.right < 0.0;
        self.corner = turning && command.travel_counts.right.abs() < CORNER_BELOW_COUNTS;
    }

    fn floor(&mut self, step: &mut Step) {
        let turning = step.travel_m.left * step.travel_m.right < 0.0;
        match self.extension {
            Extension::CornerWheelbase if self.corner => step.wheel_separation_m *= 1.0 + self.size,
            Extension::TurnSlip if turning => {
                step.travel_m = step.travel_m.map(|travel_m| travel_m * (1.0 - self.size));
            }
            Extension::StartStopLength if self.starting => {
                step.travel_m = step.travel_m.map(|travel_m| travel_m - self.size * travel_m.signum());
            }
            _ => {}
        }
        self.starting = false;
    }
}

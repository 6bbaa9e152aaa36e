//! The channels of terms outside of the catalogue: what such a term adds to.

use kinematics::Side;
use serde::{Deserialize, Serialize};

/// Which increment a term adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Along the robot, m/s.
    Along,
    /// Across, to the left, m/s.
    Across,
    /// The heading, rad/s.
    Yaw,
    /// The travel of each wheel's contact, by what that wheel does, m/s.
    Wheels,
    /// The travel of the left wheel's contact, m/s.
    LeftWheel,
    /// The travel of the right wheel's contact, m/s.
    RightWheel,
    /// What the instrument sees, ahead of the robot, metres.
    #[serde(rename = "seen_along")]
    OffsetAlong,
    /// What the instrument sees, to the left of the robot, metres.
    #[serde(rename = "seen_across")]
    OffsetAcross,
    /// The heading that the instrument sees, radians.
    #[serde(rename = "seen_heading")]
    OffsetHeading,
    /// How long before its stamp the instrument sees the robot, seconds.
    #[serde(rename = "seen_late")]
    MeasurementDelay,
}

impl Channel {
    /// Of the motion of the drive's centre.
    pub const MOTION: [Self; 3] = [Self::Along, Self::Across, Self::Yaw];
    /// Of the wheels.
    pub const WHEELS: [Self; 3] = [Self::Wheels, Self::LeftWheel, Self::RightWheel];
    /// Of the instrument.
    pub const INSTRUMENT: [Self; 4] =
        [Self::OffsetAlong, Self::OffsetAcross, Self::OffsetHeading, Self::MeasurementDelay];

    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::MOTION.into_iter().chain(Self::WHEELS).chain(Self::INSTRUMENT)
    }

    /// Its name in findings and scenarios.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Along => "along",
            Self::Across => "across",
            Self::Yaw => "yaw",
            Self::Wheels => "wheels",
            Self::LeftWheel => "left_wheel",
            Self::RightWheel => "right_wheel",
            Self::OffsetAlong => "seen_along",
            Self::OffsetAcross => "seen_across",
            Self::OffsetHeading => "seen_heading",
            Self::MeasurementDelay => "seen_late",
        }
    }

    /// Is it what the instrument sees, and not the motion?
    #[must_use]
    pub fn is_of_instrument(self) -> bool {
        Self::INSTRUMENT.contains(&self)
    }

    /// Is it the travel of wheels, each by what it does itself?
    #[must_use]
    pub fn is_of_wheels(self) -> bool {
        Self::WHEELS.contains(&self)
    }

    /// Is it the travel of this wheel, alone or among others?
    pub(crate) fn is_of(self, side: Side) -> bool {
        self == Self::Wheels || self == if side == Side::Left { Self::LeftWheel } else { Self::RightWheel }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_serialised_form() {
        for channel in Channel::all() {
            let read =
                Channel::deserialize(serde::de::value::StrDeserializer::<serde::de::value::Error>::new(channel.name()))
                    .expect("a channel");
            assert_eq!(read, channel);
        }
    }
}

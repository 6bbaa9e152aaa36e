//! Units in which logs are written, by the names that headers and flags give them.

use std::f64::consts::{PI, TAU};

/// A unit of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unit {
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// Inches.
    Inch,
    /// Radians.
    Rad,
    /// Degrees.
    Deg,
    /// Counts of an encoder.
    Ticks,
    /// Radians a second.
    RadPerS,
    /// Degrees a second.
    DegPerS,
    /// Turns a minute.
    Rpm,
    /// Metres a second.
    MPerS,
    /// Centimetres a second.
    CmPerS,
    /// Millimetres a second.
    MmPerS,
    /// Inches a second.
    InchPerS,
    /// Kilometres an hour.
    KmPerH,
    /// Counts since the row before.
    TicksPerRow,
    /// Radians since the row before.
    RadPerRow,
    /// Metres since the row before.
    MPerRow,
    /// None: a name.
    Text,
    /// None: a component of a unit quaternion.
    One,
}

impl Unit {
    /// Units of time.
    pub const TIMES: [Self; 4] = [Self::S, Self::Ms, Self::Us, Self::Ns];
    /// Units of length.
    pub const LENGTHS: [Self; 4] = [Self::M, Self::Mm, Self::Cm, Self::Inch];
    /// Units of angle.
    pub const ANGLES: [Self; 2] = [Self::Rad, Self::Deg];
    /// Units in which a wheel is logged.
    pub const WHEELS: [Self; 14] = [
        Self::Ticks,
        Self::Rad,
        Self::Deg,
        Self::RadPerS,
        Self::DegPerS,
        Self::Rpm,
        Self::MPerS,
        Self::CmPerS,
        Self::MmPerS,
        Self::InchPerS,
        Self::KmPerH,
        Self::TicksPerRow,
        Self::RadPerRow,
        Self::MPerRow,
    ];

    /// The name that flags and output use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::Ms => "ms",
            Self::Us => "us",
            Self::Ns => "ns",
            Self::M => "m",
            Self::Cm => "cm",
            Self::Mm => "mm",
            Self::Inch => "in",
            Self::Rad => "rad",
            Self::Deg => "deg",
            Self::Ticks => "ticks",
            Self::RadPerS => "rad/s",
            Self::DegPerS => "deg/s",
            Self::Rpm => "rpm",
            Self::MPerS => "m/s",
            Self::CmPerS => "cm/s",
            Self::MmPerS => "mm/s",
            Self::InchPerS => "in/s",
            Self::KmPerH => "km/h",
            Self::TicksPerRow => "ticks/row",
            Self::RadPerRow => "rad/row",
            Self::MPerRow => "m/row",
            Self::Text => "a name",
            Self::One => "1",
        }
    }

    /// The unit that a header or a flag names, in lower case.
    #[must_use]
    pub fn named(text: &str) -> Option<Self> {
        let unit = match text {
            "s" | "sec" | "secs" | "second" | "seconds" | "sek" => Self::S,
            "ms" | "msec" | "msecs" | "millis" | "milliseconds" => Self::Ms,
            "us" | "µs" | "μs" | "usec" | "usecs" | "micros" | "microseconds" => Self::Us,
            "ns" | "nsec" | "nsecs" | "nanos" | "nanosec" | "nanoseconds" => Self::Ns,
            "m" | "meter" | "meters" | "metre" | "metres" => Self::M,
            "cm" | "centimeters" | "centimetres" => Self::Cm,
            "mm" | "millimeters" | "millimetres" => Self::Mm,
            "in" | "inch" | "inches" => Self::Inch,
            "rad" | "rads" | "radian" | "radians" => Self::Rad,
            "deg" | "degs" | "degree" | "degrees" | "grad" | "°" => Self::Deg,
            "tick" | "ticks" | "count" | "counts" | "cnt" | "pulse" | "pulses" | "impulse" | "inc" => Self::Ticks,
            "rad/s" | "radps" | "rad/sec" | "1/s" => Self::RadPerS,
            "deg/s" | "degps" | "deg/sec" | "dps" | "°/s" => Self::DegPerS,
            "rpm" | "1/min" | "u/min" => Self::Rpm,
            "m/s" | "mps" | "m/sec" => Self::MPerS,
            "cm/s" | "cmps" | "cm/sec" => Self::CmPerS,
            "mm/s" | "mmps" | "mm/sec" => Self::MmPerS,
            "in/s" | "inch/s" | "ips" | "in/sec" => Self::InchPerS,
            "km/h" | "kmh" | "kph" => Self::KmPerH,
            "ticks/row" | "counts/row" => Self::TicksPerRow,
            "rad/row" => Self::RadPerRow,
            "m/row" => Self::MPerRow,
            _ => return None,
        };
        Some(unit)
    }

    /// A value in the SI unit: metres, radians, metres a second, radians a second. Decimal units are divided,
    /// so that 123 mm is the same bits as 0.123 m.
    #[must_use]
    pub fn to_si(self, value: f64) -> f64 {
        match self {
            Self::Ms | Self::Mm | Self::MmPerS => value / 1e3,
            Self::Us => value / 1e6,
            Self::Ns => value / 1e9,
            Self::Cm | Self::CmPerS => value / 1e2,
            Self::Inch | Self::InchPerS => value * 0.0254,
            Self::KmPerH => value / 3.6,
            Self::Deg | Self::DegPerS => value * (PI / 180.0),
            Self::Rpm => value * (TAU / 60.0),
            _ => value,
        }
    }

    /// Whether a wheel so logged is a rate and no cumulative quantity.
    #[must_use]
    pub const fn is_rate(self) -> bool {
        matches!(self, Self::RadPerS | Self::DegPerS | Self::Rpm) || self.is_of_contact()
    }

    /// Whether a wheel so logged is what it moved since the row before.
    #[must_use]
    pub const fn is_per_row(self) -> bool {
        matches!(self, Self::TicksPerRow | Self::RadPerRow | Self::MPerRow)
    }

    /// Whether it says how fast or far the wheel's contact goes, whatever the wheel.
    #[must_use]
    pub const fn is_of_contact(self) -> bool {
        matches!(self, Self::MPerS | Self::CmPerS | Self::MmPerS | Self::InchPerS | Self::KmPerH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_found_by_the_name_that_it_is_printed_with() {
        let all = Unit::TIMES.into_iter().chain(Unit::LENGTHS).chain(Unit::ANGLES).chain(Unit::WHEELS);
        assert!(all.into_iter().all(|unit| Unit::named(unit.name()) == Some(unit)));
        assert_eq!(Unit::named("furlong"), None);
    }

    #[test]
    fn decimal_units_give_the_bits_of_the_si_text() {
        assert_eq!(Unit::Mm.to_si(123.0), 0.123);
        assert_eq!(Unit::Ms.to_si(50.0), 0.05);
        assert_eq!(Unit::Cm.to_si(12.0), 0.12);
        assert_eq!(Unit::Deg.to_si(180.0), PI);
        assert_eq!(Unit::Rpm.to_si(60.0), TAU);
    }
}

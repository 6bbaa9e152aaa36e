//! Strata: what a case's robot and records are like, in few levels each, so that every measure can be told
//! for each of them. The numbers that were drawn stand beside.

use dataset::{NotNegative, Number, Positive, Share, checked};
use effects::OrdinaryCondition;

use super::case::Case;
use super::conditions::{Conditions, Stamps};
use super::instrument::{InstrumentModel, NoiseClass, TruthKind};

/// The levels of one stratum.
macro_rules! levels {
    ($(#[$doc:meta])* $Name:ident { $($(#[$level_doc:meta])* $Level:ident,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum $Name { $($(#[$level_doc])* $Level,)+ }
    };
}

levels! {
    /// Ticks for a turn of a wheel.
    EncoderLevel {
        /// 100 to 500.
        Below500,
        /// 500 to 2000.
        Below2000,
        /// 2000 to 10 000.
        Below10000,
        /// 10 000 and more.
        From10000,
    }
}

levels! {
    /// What rounding leaves of the heading, against what the instrument errs by.
    RoundingLevel {
        /// Less than a third of it.
        Small,
        /// A third to three times as much.
        Similar,
        /// More.
        Large,
    }
}

levels! {
    /// Rows a second.
    RateLevel {
        /// 5 to 20.
        Slow,
        /// 20 to 60.
        Medium,
        /// 60 to 200.
        Fast,
    }
}

levels! {
    /// How rows are stamped.
    StampLevel {
        /// On the beat, and true.
        Exact,
        /// Off the beat, and true.
        Irregular,
        /// Off the reading by normal errors.
        Jittering,
        /// On receipt.
        Received,
    }
}

levels! {
    /// Whether rows are missing over which the counters went on.
    RowsLevel {
        /// None.
        All,
        /// Up to one in twenty.
        SomeLost,
    }
}

levels! {
    /// Whether the instrument's clock drifts against the robot's.
    ClockLevel {
        /// One clock.
        Common,
        /// Up to 500 parts in a million.
        Drifting,
    }
}

levels! {
    /// Where the measurements are.
    TruthPlace {
        /// At the instants of rows.
        OnRows,
        /// Between them.
        BetweenRows,
        /// At rest.
        AtRest,
    }
}

levels! {
    /// Measurements a second.
    TruthRateLevel {
        /// At the ends of runs alone.
        AtEnds,
        /// Fewer than two.
        Below2Hz,
        /// 2 to 10.
        Below10Hz,
        /// 10 to 50.
        From10Hz,
    }
}

levels! {
    /// What the measured positions err by.
    TruthNoiseLevel {
        /// 0.2 to 1 mm.
        Low,
        /// 1 to 3 mm.
        Medium,
        /// 3 to 10 mm.
        High,
    }
}

levels! {
    /// In how many runs the driving is recorded.
    RunsLevel {
        /// One long log.
        OneLog,
        /// 2 to 5.
        From2,
        /// 6 to 15.
        From6,
        /// 16 and more.
        From16,
    }
}

levels! {
    /// How the wheels scatter.
    WheelsLevel {
        /// Not at all.
        Perfect,
        /// Up to 0.3 mm/√m.
        Smooth,
        /// More.
        Rough,
    }
}

levels! {
    /// How evenly the shafts turn.
    RippleLevel {
        /// As evenly as the controllers can.
        Even,
        /// Pushed about faster than the controllers correct.
        Rippled,
    }
}

levels! {
    /// The wheelbase.
    SizeLevel {
        /// Below 0.15 m.
        Toy,
        /// 0.15 to 0.5 m.
        Indoor,
        /// 0.5 m and more.
        Vehicle,
    }
}

/// The strata of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Strata {
    /// Ticks for a turn of a wheel.
    pub encoder: EncoderLevel,
    /// What rounding leaves of the heading.
    pub rounding: RoundingLevel,
    /// Rows a second.
    pub rate: RateLevel,
    /// How rows are stamped.
    pub stamps: StampLevel,
    /// Lost rows.
    pub rows: RowsLevel,
    /// The two clocks.
    pub clock: ClockLevel,
    /// Where the measurements are.
    pub truth_place: TruthPlace,
    /// Measurements a second.
    pub truth_rate: TruthRateLevel,
    /// What the measured positions err by.
    pub truth_noise: TruthNoiseLevel,
    /// In how many runs the driving is recorded.
    pub runs: RunsLevel,
    /// How the wheels scatter.
    pub wheels: WheelsLevel,
    /// How evenly the shafts turn.
    pub ripple: RippleLevel,
    /// The wheelbase.
    pub size: SizeLevel,
}

/// The numbers behind the strata.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DrawnConditions {
    /// Wheelbase, metres.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub wheel_separation_m: f64,
    /// Wheel diameter, metres.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub wheel_diameter_m: f64,
    /// Ticks for a turn of a wheel.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub ticks_per_turn: f64,
    /// Way of a wheel for a tick, metres.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub tick_m: f64,
    /// Rows a second.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub log_rate_hz: f64,
    /// Standard deviation of a stamp's error, seconds.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub stamp_sigma_s: f64,
    /// Share of the rows that are missing.
    #[serde(deserialize_with = "checked::<Share, _>")]
    pub lost_row_share: f64,
    /// By how much the instrument's clock gains on the robot's, seconds a second.
    #[serde(deserialize_with = "checked::<Number, _>")]
    pub clock_drift: f64,
    /// Measurements a second.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub truth_rate_hz: f64,
    /// Standard deviation of a measured coordinate, metres.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub sigma_xy_m: f64,
    /// Standard deviation of a measured heading, radians.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub sigma_theta_rad: f64,
    /// Random walk of a wheel's travel, m/√m.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub wheel_sigma_m_per_sqrt_m: f64,
    /// Share of the speed by which the shafts are disturbed, and how often a second; `None` where they are
    /// not.
    #[serde(default, deserialize_with = "checked::<Option<(NotNegative, NotNegative)>, _>")]
    pub ripple: Option<(f64, f64)>,
    /// Rows of the log.
    pub rows: usize,
}

impl Strata {
    /// Conditions that a finding may rightly name.
    pub(crate) fn ordinary_conditions(&self, noise: NoiseClass) -> impl Iterator<Item = OrdinaryCondition> {
        let noise = match noise {
            NoiseClass::White => None,
            NoiseClass::HeavyTailed => Some(OrdinaryCondition::HeavyTailedErrors),
            NoiseClass::Correlated => Some(OrdinaryCondition::AutocorrelatedErrors),
            NoiseClass::Dropouts => Some(OrdinaryCondition::RowsLostWithCounts),
        };
        let stamps = match self.stamps {
            StampLevel::Exact | StampLevel::Irregular => None,
            StampLevel::Jittering => Some(OrdinaryCondition::JitteringStamps),
            StampLevel::Received => Some(OrdinaryCondition::ReceivedStamps),
        };
        let clock = (self.clock == ClockLevel::Drifting).then_some(OrdinaryCondition::DriftingClocks);
        [noise, stamps, clock].into_iter().flatten()
    }
}

/// The first level whose limit a number is below, or the last one.
fn level<L: Copy, const N: usize>(value: f64, limits: [(f64, L); N], beyond: L) -> L {
    limits.iter().find(|(limit, _)| value < *limit).map_or(beyond, |(_, level)| *level)
}

/// The strata of a case and the numbers behind them.
pub(crate) fn strata(case: &Case) -> (Strata, DrawnConditions) {
    let (conditions, instrument_model): (&Conditions, &InstrumentModel) = (&case.conditions, &case.instrument_model);
    let runs = || case.datasets.iter().flat_map(|dataset| &dataset.runs);
    let is_at_ends = instrument_model.kind == TruthKind::Endpoints;
    let wheel_sigma = conditions.wheel_sigma_m_per_sqrt_m;
    let strata = Strata {
        encoder: level(
            conditions.ticks_per_turn,
            [(500.0, EncoderLevel::Below500), (2e3, EncoderLevel::Below2000), (1e4, EncoderLevel::Below10000)],
            EncoderLevel::From10000,
        ),
        rounding: level(
            case.noise.heading_rounding_ratio(),
            [(1.0 / 3.0, RoundingLevel::Small), (3.0, RoundingLevel::Similar)],
            RoundingLevel::Large,
        ),
        rate: level(conditions.log_rate_hz, [(20.0, RateLevel::Slow), (60.0, RateLevel::Medium)], RateLevel::Fast),
        stamps: match conditions.stamps {
            Stamps::Exact => StampLevel::Exact,
            Stamps::Irregular { .. } => StampLevel::Irregular,
            Stamps::Jittering { .. } => StampLevel::Jittering,
            Stamps::Received { .. } => StampLevel::Received,
        },
        rows: if conditions.lost_row_share > 0.0 { RowsLevel::SomeLost } else { RowsLevel::All },
        clock: if conditions.clock_drift == 0.0 { ClockLevel::Common } else { ClockLevel::Drifting },
        truth_place: match instrument_model.on_rows {
            _ if is_at_ends => TruthPlace::AtRest,
            true => TruthPlace::OnRows,
            false => TruthPlace::BetweenRows,
        },
        truth_rate: if is_at_ends {
            TruthRateLevel::AtEnds
        } else {
            level(
                instrument_model.rate_hz,
                [(2.0, TruthRateLevel::Below2Hz), (10.0, TruthRateLevel::Below10Hz)],
                TruthRateLevel::From10Hz,
            )
        },
        truth_noise: level(
            instrument_model.sigma_xy_m,
            [(1e-3, TruthNoiseLevel::Low), (3e-3, TruthNoiseLevel::Medium)],
            TruthNoiseLevel::High,
        ),
        runs: match runs().count() {
            0..=1 => RunsLevel::OneLog,
            2..=5 => RunsLevel::From2,
            6..=15 => RunsLevel::From6,
            _ => RunsLevel::From16,
        },
        wheels: level(
            wheel_sigma,
            [(f64::MIN_POSITIVE, WheelsLevel::Perfect), (3e-4, WheelsLevel::Smooth)],
            WheelsLevel::Rough,
        ),
        ripple: if conditions.ripple.is_some() { RippleLevel::Rippled } else { RippleLevel::Even },
        size: level(
            conditions.wheel_separation_m,
            [(0.15, SizeLevel::Toy), (0.5, SizeLevel::Indoor)],
            SizeLevel::Vehicle,
        ),
    };
    let drawn = DrawnConditions {
        wheel_separation_m: conditions.wheel_separation_m,
        wheel_diameter_m: conditions.wheel_diameter_m,
        ticks_per_turn: conditions.ticks_per_turn,
        tick_m: conditions.tick_m(),
        log_rate_hz: conditions.log_rate_hz,
        stamp_sigma_s: conditions.stamp_sigma_s(),
        lost_row_share: conditions.lost_row_share,
        clock_drift: conditions.clock_drift,
        truth_rate_hz: instrument_model.rate_hz,
        sigma_xy_m: instrument_model.sigma_xy_m,
        sigma_theta_rad: instrument_model.sigma_theta_rad,
        wheel_sigma_m_per_sqrt_m: wheel_sigma,
        ripple: conditions.ripple,
        rows: runs().map(|run| run.odometry.t_s.len()).sum(),
    };
    (strata, drawn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_at_a_limit_is_of_the_level_above() {
        let of = |value| level(value, [(1.0, 'a'), (2.0, 'b')], 'c');
        assert_eq!([0.5, 1.0, 1.5, 2.0, f64::INFINITY].map(of), ['a', 'b', 'b', 'c', 'c']);
    }
}

//! What makes real wheel odometry deviate: one file a physical effect in `catalogue/`, and this table of
//! contents.
//!
//! An effect has two models that share a file and its parameters, never code. The *simulation model*
//! ([`Forward`]) is how the world does it: it acts inside the simulator's step, at whichever of the stages
//! command → motor → wheel → floor → encoder → clock → instrument it touches. The *estimation model*
//! ([`Hypothesis`]) is how recorded data would show it: it sees recorded quantities only.
//!
//! What everything else must know of an effect, from its meaning to how the blind benchmark draws it, stands
//! in its [`Description`]: nothing outside of this crate writes an id.
//!
//! Adding an effect is one new file in `catalogue/` and its line in `contents!` below: scenario parsing, the
//! catalogue and the laws follow. What has no name there is simulated as a [`SparseTerm`].

mod benchmark;
mod channel;
mod covariate;
mod description;
mod effect;
mod estimates;
mod exemption;
mod forward;
mod hypothesis;
mod motion_history;
mod on_board;
pub mod settings;
mod stream;
mod stream_lanes;
mod term;
mod time_shift;

pub use benchmark::{Benchmark, FormOf, HostRobot, Needs, OtherForm, ParameterLaw, ParameterValue, ParameterValues};
pub use channel::Channel;
pub use covariate::Covariate;
pub use description::{
    Description, Excitation, Extrinsic, GeometryRatio, IsolatedError, RecordFault, Restamped, ShownByCounts, Statement,
    Summary,
};
pub use effect::{EffectError, PhysicalEffect};
pub use estimates::{Estimate, Estimates};
pub use exemption::{EXEMPT, Exemption, OrdinaryCondition};
pub use forward::{Command, Forward, Hooks, LaneForm, PoseReading, Readout, RunStart, SampleClock, Step};
pub use hypothesis::{Hypothesis, RecordCorrection, Sign, Variant};
pub use on_board::{Code, Correction, Input, IntervalScatter, OnBoard, RawInterval, Scatter, ScatterModel, SizeOf};
pub use stream::{Address, Stream, StreamName};
pub use stream_lanes::{NormalTable, StreamLanes, StreamsLanes};
pub use term::{Sparse, SparseTerm, modulated};

/// Declares the catalogue: for each effect its module and its parameters' type.
macro_rules! contents {
    ($($module:ident :: $Type:ident),* $(,)?) => {
        mod catalogue {
            $(pub(crate) mod $module;)*

            /// A step of 1 ms at rest on wheels of 80 mm radius, for the effects' own tests.
            #[cfg(test)]
            pub(crate) fn specimen_step() -> crate::Step {
                use kinematics::{Pose, Wheels};
                crate::Step {
                    t_s: 0.0,
                    dt_s: 1e-3,
                    world_from_body: Pose::IDENTITY,
                    nominal_radius_m: Wheels::both(0.08),
                    shaft_rad: Wheels::both(0.0),
                    rate_rad_s: Wheels::both(0.0),
                    acceleration_rad_s2: Wheels::both(0.0),
                    wheel_angle_rad: Wheels::both(0.0),
                    wheel_rad: Wheels::both(0.0),
                    radius_m: Wheels::both(0.08),
                    travel_m: Wheels::both(0.0),
                    wheel_separation_m: 0.363,
                    lateral_m: 0.0,
                    extra_turn_rad: 0.0,
                    creep_m: [0.0; 2],
                    encoder_rad: Wheels::both(0.0),
                }
            }
        }
        $(pub use catalogue::$module::$Type;)*

        /// One effect of the catalogue with its sizes, or a term outside of it; `kind` in a scenario is its
        /// id.
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        pub enum Effect {
            $(
                #[doc = concat!("`", stringify!($module), "`")]
                $Type($Type),
            )*
            /// `term`, of no name in the catalogue.
            Term(SparseTerm),
        }

        impl Effect {
            /// The effect behind its interface.
            #[must_use]
            pub fn physical(&self) -> &dyn PhysicalEffect {
                match self {
                    $(Self::$Type(effect) => effect,)*
                    Self::Term(term) => term,
                }
            }

            /// The id that scenarios, findings and tests use; of a term outside of the catalogue `term`.
            #[must_use]
            pub const fn id(&self) -> &'static str {
                match self {
                    $(Self::$Type(_) => stringify!($module),)*
                    Self::Term(_) => term::TERM,
                }
            }

            /// How data would show the effect; a term outside of the catalogue is its own one variant, or
            /// `None` where it is not physical.
            #[must_use]
            pub fn hypothesis(&self) -> Option<Hypothesis> {
                match self {
                    $(Self::$Type(_) => Some(<$Type as PhysicalEffect>::hypothesis()),)*
                    Self::Term(term) => term.shown(),
                }
            }
        }

        /// How data would show an effect, by its id; `None` for an unknown id.
        #[must_use]
        pub fn hypothesis(id: &str) -> Option<Hypothesis> {
            match id {
                $(stringify!($module) => Some(<$Type as PhysicalEffect>::hypothesis()),)*
                _ => None,
            }
        }

        /// What is known of an effect beside its two models, by its id; `None` for an unknown id.
        #[must_use]
        pub fn description(id: &str) -> Option<Description> {
            match id {
                $(stringify!($module) => Some(<$Type as PhysicalEffect>::description()),)*
                _ => None,
            }
        }

        /// The effect of an id with the sizes that a fit found; `None` when they do not make a physical one.
        #[must_use]
        pub fn effect_from_estimates(id: &str, values: &[(&str, f64)]) -> Option<Effect> {
            match id {
                $(stringify!($module) => <$Type as PhysicalEffect>::from_estimates(values).map(Effect::$Type),)*
                _ => None,
            }
            .filter(|effect: &Effect| effect.physical().check().is_ok())
        }

        /// The effect of an id with sizes that the blind benchmark drew, at a scale in a robot; `None` when
        /// they do not make a physical one.
        #[must_use]
        pub fn effect_at_scale(id: &str, values: &[ParameterValue], scale: f64, robot: &HostRobot) -> Option<Effect> {
            match id {
                $(stringify!($module) => <$Type as PhysicalEffect>::at_scale(values, scale, robot).map(Effect::$Type),)*
                _ => None,
            }
            .filter(|effect: &Effect| effect.physical().check().is_ok())
        }

        /// The effect of an id without any harm, for records of a robot that have what it needs though it is
        /// not hidden.
        #[must_use]
        pub fn harmless(id: &str, robot: &HostRobot) -> Option<Effect> {
            match id {
                $(stringify!($module) => <$Type as PhysicalEffect>::harmless(robot).map(Effect::$Type),)*
                _ => None,
            }
        }

        /// Every id of the catalogue, in the order in which the effects act.
        pub const CATALOGUE: &[&str] = &[$(stringify!($module)),*];
    };
}

contents! {
    wheel_scale::WheelScale,
    wheel_mismatch::WheelMismatch,
    wheelbase::Wheelbase,
    contact_patch_wheelbase::ContactPatchWheelbase,
    backlash::Backlash,
    wheel_eccentricity::WheelEccentricity,
    load_transfer::LoadTransfer,
    payload_compression::PayloadCompression,
    thermal_drift::ThermalDrift,
    wear::Wear,
    direction_asymmetry::DirectionAsymmetry,
    slip_speed::SlipSpeed,
    slip_acceleration::SlipAcceleration,
    traction_loss::TractionLoss,
    stick_slip::StickSlip,
    bumps::Bumps,
    robot_displaced::RobotDisplaced,
    turn_rate_wheelbase::TurnRateWheelbase,
    lateral_skid::LateralSkid,
    castor_kick::CastorKick,
    castor_drag::CastorDrag,
    turn_slip::TurnSlip,
    floor_slope::FloorSlope,
    carpet_nap::CarpetNap,
    encoder_cycle::EncoderCycle,
    missed_counts::MissedCounts,
    sampling_skew::SamplingSkew,
    interval_error::IntervalError,
    clock_rate::ClockRate,
    time_unit::TimeUnit,
    low_speed_truncation::LowSpeedTruncation,
    reversed_wheel::ReversedWheel,
    wrong_counts_per_turn::WrongCountsPerTurn,
    quantization::Quantization,
    dropped_samples::DroppedSamples,
    counter_wrap::CounterWrap,
    torn_read::TornRead,
    counter_reset::CounterReset,
    swapped_wheels::SwappedWheels,
    truth_latency::TruthLatency,
    truth_lever_arm::TruthLeverArm,
    truth_yaw::TruthYaw,
    truth_map_scale::TruthMapScale,
    truth_correlated_noise::TruthCorrelatedNoise,
    truth_outliers::TruthOutliers,
    truth_jump::TruthJump,
}

/// Puts effects into the order in which they act, so that a scenario's order does not matter; terms outside
/// of the catalogue act last.
pub fn sort_by_stage(effects: &mut [Effect]) {
    effects.sort_by_key(|effect| CATALOGUE.iter().position(|id| *id == effect.id()).unwrap_or(CATALOGUE.len()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn folder_and_list_agree() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/catalogue");
        let files: BTreeSet<String> = std::fs::read_dir(folder)
            .expect("the catalogue stands beside this file")
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().trim_end_matches(".rs").to_owned())
            .collect();
        let list: BTreeSet<String> = CATALOGUE.iter().map(ToString::to_string).collect();
        assert_eq!(files, list);
    }

    #[test]
    fn the_order_of_a_scenario_does_not_matter() {
        let mut effects = vec![
            Effect::Term(SparseTerm {
                channel: Channel::Yaw,
                covariates: vec!["v".to_owned()],
                coefficient: 0.01,
                of_runs: std::collections::BTreeMap::new(),
            }),
            Effect::CounterWrap(CounterWrap { bits: 16 }),
            Effect::WheelScale(WheelScale { scale: 1.01 }),
            Effect::SlipSpeed(SlipSpeed { slip_s_m: 0.01 }),
        ];
        sort_by_stage(&mut effects);
        let ids: Vec<&str> = effects.iter().map(Effect::id).collect();
        assert_eq!(ids, ["wheel_scale", "slip_speed", "counter_wrap", "term"]);
    }
}

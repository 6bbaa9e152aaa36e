//! What the outside instrument shows of a run: which measurements, and their errors.
//!
//! The simulator's instrument measures without error; here its measurements are chosen (poses, positions
//! alone, the ends alone, or displacements between two of them) and disturbed: white, heavy-tailed (Student's
//! t with three degrees of freedom), or correlated in time (a first-order Gauss–Markov process beside white
//! noise). It measures at the instants of rows, or at instants of its own between them.

use dataset::{Displacement, Run, TruthNoise, TruthSample};
use effects::{DroppedSamples, Effect};
use kinematics::Pose;

use super::conditions::{Conditions, Stamps};
use super::draw::{CaseDraws, Draw};

/// What the measurements are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TruthKind {
    /// Poses several times a second.
    Dense,
    /// A pose every second or two.
    Sparse,
    /// Positions alone.
    Positions,
    /// The first and the last pose of every run.
    Endpoints,
    /// Displacements between measurements, as scan matching gives them.
    Relative,
    /// A gyro, tapes, walls or marks, without poses.
    Partial,
}

/// What the measurements err by, and what the log loses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseClass {
    /// Independent normal errors.
    White,
    /// Independent errors with heavy tails.
    HeavyTailed,
    /// Errors that last.
    Correlated,
    /// Independent normal errors; 2 % of the log's rows are lost with their counts.
    Dropouts,
}

impl NoiseClass {
    /// What the log loses in this class, as an effect.
    pub(crate) const fn effect(self) -> Option<Effect> {
        match self {
            Self::Dropouts => Some(Effect::DroppedSamples(DroppedSamples { probability: LOST_ROW_SHARE })),
            Self::White | Self::HeavyTailed | Self::Correlated => None,
        }
    }
}

/// Share of the log's rows that are lost with their counts where some are.
const LOST_ROW_SHARE: f64 = 0.02;
/// Measurements a second where the ends of runs alone are taken.
const RATE_AT_ENDS_HZ: f64 = 20.0;
/// Fastest instrument, measurements a second.
const MAX_RATE_HZ: f64 = 50.0;
/// The first and the last pose are taken as long after the log's first row and before its last: stamps that
/// are late, or by another clock, do not put them outside.
const FROM_ENDS_S: f64 = 0.4;
/// With fewer runs their ends determine no geometry.
const MIN_RUNS_WITH_ENDS: u32 = 6;
/// Time between measurements at the ends of runs, for errors that last, seconds.
const BETWEEN_ENDS_S: f64 = 10.0;

/// How the robot of a case is looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InstrumentModel {
    pub(crate) kind: TruthKind,
    pub(crate) class: NoiseClass,
    /// Measurements of the simulated instrument a second.
    pub(crate) rate_hz: f64,
    /// Whether every measurement is at the instant of a row.
    pub(crate) on_rows: bool,
    pub(crate) sigma_xy_m: f64,
    pub(crate) sigma_theta_rad: f64,
    /// Errors that last: their standard deviation over that of the white ones, and for how long, seconds.
    lasting: (f64, f64),
    /// Further errors that last, which the simulator makes: of position and of heading two each, by standard
    /// deviation and for how long, seconds.
    simulated: Option<[LastingPair; 2]>,
    /// What the dataset states of its noise, over the truth; 0 for nothing.
    stated: f64,
}

/// Two errors that last, by standard deviation and time, seconds.
pub(crate) type LastingPair = [(f64, f64); 2];

impl InstrumentModel {
    /// One with white errors of position, metres, and heading, radians, as it states.
    pub(crate) fn white(kind: TruthKind, rate_hz: f64, [sigma_xy_m, sigma_theta_rad]: [f64; 2]) -> Self {
        Self {
            kind,
            class: NoiseClass::White,
            rate_hz,
            on_rows: false,
            sigma_xy_m,
            sigma_theta_rad,
            lasting: (0.0, 1.0),
            simulated: None,
            stated: 1.0,
        }
    }

    /// The same with errors of position and of heading that last, which the simulator makes.
    pub(crate) fn with_lasting(self, simulated: [LastingPair; 2]) -> Self {
        Self { class: NoiseClass::Correlated, simulated: Some(simulated), ..self }
    }

    pub(crate) fn draw(draws: CaseDraws, conditions: &Conditions) -> Self {
        let mut draw = draws.of("truth kind");
        let kind = match draw.below(10) {
            0..=3 => TruthKind::Dense,
            4 => TruthKind::Sparse,
            5..=6 => TruthKind::Positions,
            7 => TruthKind::Endpoints,
            _ => TruthKind::Relative,
        };
        // One log has two ends, and a few runs little more: they determine nothing.
        let kind =
            if kind == TruthKind::Endpoints && conditions.runs < MIN_RUNS_WITH_ENDS { TruthKind::Sparse } else { kind };
        let mut rate = draws.of("truth rate");
        let wanted_hz = match kind {
            TruthKind::Dense | TruthKind::Positions => rate.log_uniform(2.0, MAX_RATE_HZ),
            TruthKind::Sparse => rate.log_uniform(0.5, 2.0),
            TruthKind::Relative => rate.log_uniform(1.0, 10.0),
            TruthKind::Endpoints | TruthKind::Partial => RATE_AT_ENDS_HZ,
        };
        let can_be_on_rows = kind != TruthKind::Endpoints && !matches!(conditions.stamps, Stamps::Irregular { .. });
        let on_rows = rate.bernoulli(0.5) && can_be_on_rows;
        let every = (conditions.log_rate_hz / wanted_hz).round().max((conditions.log_rate_hz / MAX_RATE_HZ).ceil());
        let mut noise = draws.of("truth noise");
        let class = match noise.below(10) {
            0..=5 => NoiseClass::White,
            6 => NoiseClass::HeavyTailed,
            7..=8 => NoiseClass::Correlated,
            _ => NoiseClass::Dropouts,
        };
        // Right, twice or half the truth, or not stated at all.
        let stated = [1.0, 1.0, 2.0, 0.5, 0.0][noise.below(5)];
        let sigma_xy_m = noise.log_uniform(2e-4, 1e-2);
        Self {
            kind,
            class,
            rate_hz: if on_rows { conditions.log_rate_hz / every.max(1.0) } else { wanted_hz },
            on_rows,
            sigma_xy_m,
            // Two marks so far apart, metres, or a scan of walls so far away.
            sigma_theta_rad: sigma_xy_m / noise.log_uniform(0.15, 1.5),
            lasting: (noise.uniform(0.5, 2.0), noise.log_uniform(0.3, 3.0)),
            simulated: None,
            stated,
        }
    }

    /// What the dataset says of its noise.
    pub(crate) fn stated(&self) -> TruthNoise {
        let known = |sigma: f64| (self.stated > 0.0).then_some(self.stated * sigma);
        TruthNoise {
            sigma_xy_m: known(self.sigma_xy_m),
            sigma_theta_rad: known(self.sigma_theta_rad),
            ..TruthNoise::default()
        }
    }

    /// Variances of position and heading that independent errors of the same weight would have: those of
    /// errors that last grow by (1 + ρ)/(1 − ρ), ρ being the correlation from measurement to measurement.
    pub(crate) fn variances(&self) -> [f64; 2] {
        let between_s = if self.kind == TruthKind::Endpoints { BETWEEN_ENDS_S } else { 1.0 / self.rate_hz };
        let grown = |tau_s: f64| {
            let rho = (-between_s / tau_s).exp();
            (1.0 + rho) / (1.0 - rho)
        };
        let white = [self.sigma_xy_m, self.sigma_theta_rad].map(|sigma| sigma * sigma);
        if let Some(lasting) = self.simulated {
            return std::array::from_fn(|k| {
                white[k] + lasting[k].iter().map(|(sigma, tau_s)| grown(*tau_s) * sigma * sigma).sum::<f64>()
            });
        }
        let (share, tau_s) = self.lasting;
        let factor = if self.class == NoiseClass::Correlated { 1.0 + share.powi(2) * grown(tau_s) } else { 1.0 };
        white.map(|variance| factor * variance)
    }

    /// Which measurements of a run are taken.
    fn taken(&self, run: &Run) -> Vec<usize> {
        let all = 0..run.truth.len();
        if self.kind != TruthKind::Endpoints {
            return all.collect();
        }
        let end_s = run.odometry.t_s.last().copied().unwrap_or(0.0) - FROM_ENDS_S;
        let first = all.clone().find(|k| run.truth[*k].t_s >= FROM_ENDS_S);
        let last = all.rev().find(|k| run.truth[*k].t_s <= end_s);
        first.into_iter().chain(last.filter(|last| Some(*last) != first)).collect()
    }

    /// Replaces the noise-free measurements of a run by what is recorded of them; without draws, still
    /// without error.
    pub(crate) fn measurement(&self, run: &mut Run, draw: Option<&mut Draw>) {
        let taken = self.taken(run);
        let exact: Vec<(f64, Pose)> = taken
            .into_iter()
            .map(|measurement| {
                let sample = &run.truth[measurement];
                (sample.t_s, Pose::new(sample.x_m, sample.y_m, sample.theta_rad().unwrap_or(0.0)))
            })
            .collect();
        let mut errors =
            MeasurementErrors { instrument_model: self, draw, lasting: [0.0; 3], last_s: f64::NEG_INFINITY };
        if self.kind == TruthKind::Relative {
            run.truth.clear();
            run.displacements = exact
                .windows(2)
                .map(|pair| {
                    let moved = pair[0].1.to(pair[1].1);
                    let [x_m, y_m, theta_rad] = errors.next(pair[1].0);
                    Displacement {
                        t0_s: pair[0].0,
                        t1_s: pair[1].0,
                        dx_m: moved.x_m + x_m,
                        dy_m: moved.y_m + y_m,
                        dtheta_rad: moved.theta_rad + theta_rad,
                    }
                })
                .collect();
        } else {
            run.truth = exact
                .into_iter()
                .map(|(t_s, pose)| {
                    let [x_m, y_m, theta_rad] = errors.next(t_s);
                    let heading_rad = (self.kind != TruthKind::Positions).then_some(pose.theta_rad + theta_rad);
                    TruthSample::new(t_s, pose.x_m + x_m, pose.y_m + y_m, heading_rad)
                })
                .collect();
        }
    }
}

/// Errors of one measurement after the other.
struct MeasurementErrors<'w> {
    instrument_model: &'w InstrumentModel,
    draw: Option<&'w mut Draw>,
    lasting: [f64; 3],
    last_s: f64,
}

impl MeasurementErrors<'_> {
    fn next(&mut self, t_s: f64) -> [f64; 3] {
        let Some(draw) = self.draw.as_deref_mut() else { return [0.0; 3] };
        let (share, tau_s) = self.instrument_model.lasting;
        let keeps = (-(t_s - self.last_s) / tau_s).exp();
        self.last_s = t_s;
        let sigma =
            [self.instrument_model.sigma_xy_m, self.instrument_model.sigma_xy_m, self.instrument_model.sigma_theta_rad];
        std::array::from_fn(|k| {
            let white = draw.0.normal();
            sigma[k]
                * match self.instrument_model.class {
                    NoiseClass::White | NoiseClass::Dropouts => white,
                    NoiseClass::HeavyTailed => {
                        // t₃ has variance 3: √3 makes it one.
                        let square: f64 = draw.0.normals::<3>().iter().map(|z| z * z).sum();
                        white / (square / 3.0).sqrt() / 3_f64.sqrt()
                    }
                    NoiseClass::Correlated => {
                        self.lasting[k] = keeps * self.lasting[k] + (1.0 - keeps * keeps).sqrt() * draw.0.normal();
                        white + share * self.lasting[k]
                    }
                }
        })
    }
}

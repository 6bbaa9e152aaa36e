//! What the outside instrument shows of a run: which measurements, and their errors.
//!
//! The simulator's instrument measures without error; here its measurements are chosen (dense, sparse, the
//! ends alone, or displacements between two of them) and disturbed: white, heavy-tailed (Student's t with
//! three degrees of freedom), or correlated in time (a first-order Gauss–Markov process beside white noise).

use dataset::{Displacement, Run, TruthNoise, TruthSample};
use effects::{CATALOGUE, DroppedSamples, Effect, Sign, hypothesis};
use kinematics::Pose;

use super::draw::Draw;

/// What the measurements are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TruthKind {
    /// Poses several times a second.
    Dense,
    /// A pose every second or two.
    Sparse,
    /// The first and the last pose of every run.
    Endpoints,
    /// Displacements between measurements, as scan matching gives them.
    Relative,
}

/// What the measurements err by, and what the log loses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseClass {
    /// Independent normal errors.
    White,
    /// Independent errors with heavy tails.
    HeavyTailed,
    /// Errors that last.
    Correlated,
    /// Independent normal errors; 2 % of the log's rows are lost.
    Dropouts,
}

impl NoiseClass {
    /// Findings that are right in this class whatever is hidden.
    #[must_use]
    pub fn right_answers(self) -> Vec<&'static str> {
        let with_sign = |sign: Sign| {
            let shows = |id: &&str| hypothesis(id).is_some_and(|hypothesis| hypothesis.signs().contains(&sign));
            CATALOGUE.iter().copied().filter(shows).collect()
        };
        match self {
            Self::White => Vec::new(),
            Self::HeavyTailed => with_sign(Sign::IsolatedErrors),
            Self::Correlated => with_sign(Sign::AutocorrelatedErrors),
            Self::Dropouts => self.effect().iter().map(Effect::id).collect(),
        }
    }

    /// What the log loses in this class, as an effect.
    pub(crate) const fn effect(self) -> Option<Effect> {
        match self {
            Self::Dropouts => Some(Effect::DroppedSamples(DroppedSamples { probability: LOST_ROW_SHARE })),
            Self::White | Self::HeavyTailed | Self::Correlated => None,
        }
    }
}

/// Share of the log's rows that are lost where some are.
const LOST_ROW_SHARE: f64 = 0.02;

/// How the robot of a case is looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InstrumentModel {
    pub(crate) kind: TruthKind,
    pub(crate) class: NoiseClass,
    /// Every so many measurements of the simulated instrument.
    every: usize,
    sigma_xy_m: f64,
    sigma_theta_rad: f64,
    /// Errors that last: their standard deviation over that of the white ones, and for how long, seconds.
    lasting: (f64, f64),
    /// What the dataset states of its noise, over the truth; 0 for nothing.
    stated: f64,
}

impl InstrumentModel {
    pub(crate) fn draw(draw: &mut Draw) -> Self {
        let kind = match draw.below(10) {
            0..=3 => TruthKind::Dense,
            4..=5 => TruthKind::Sparse,
            6..=7 => TruthKind::Endpoints,
            _ => TruthKind::Relative,
        };
        let every = match kind {
            TruthKind::Dense => 2,
            TruthKind::Sparse => 20 + draw.below(20),
            TruthKind::Endpoints => usize::MAX,
            TruthKind::Relative => 10,
        };
        let class = match draw.below(10) {
            0..=5 => NoiseClass::White,
            6 => NoiseClass::HeavyTailed,
            7..=8 => NoiseClass::Correlated,
            _ => NoiseClass::Dropouts,
        };
        // Right, twice or half the truth, or not stated at all.
        let stated = [1.0, 1.0, 2.0, 0.5, 0.0][draw.below(5)];
        Self {
            kind,
            class,
            every,
            sigma_xy_m: draw.log_uniform(2e-4, 2e-3),
            sigma_theta_rad: draw.log_uniform(3e-4, 3e-3),
            lasting: (draw.uniform(0.5, 2.0), draw.log_uniform(0.3, 3.0)),
            stated,
        }
    }

    /// What the dataset says of its noise.
    pub(crate) fn stated(&self) -> TruthNoise {
        let known = |sigma: f64| (self.stated > 0.0).then_some(self.stated * sigma);
        TruthNoise { sigma_xy_m: known(self.sigma_xy_m), sigma_theta_rad: known(self.sigma_theta_rad) }
    }

    /// Variances of position and heading that independent errors of the same weight would have: those of
    /// errors that last grow by (1 + ρ)/(1 − ρ), ρ being the correlation from measurement to measurement.
    pub(crate) fn variances(&self) -> [f64; 2] {
        let factor = if self.class == NoiseClass::Correlated {
            let between_s = self.every.min(200) as f64 / super::robot::RATE_HZ;
            let rho = (-between_s / self.lasting.1).exp();
            1.0 + self.lasting.0.powi(2) * (1.0 + rho) / (1.0 - rho)
        } else {
            1.0
        };
        [self.sigma_xy_m, self.sigma_theta_rad].map(|sigma| factor * sigma * sigma)
    }

    /// Which measurements of a run are taken.
    fn taken(&self, measurements: usize) -> Vec<usize> {
        let Some(last) = measurements.checked_sub(1) else { return Vec::new() };
        let mut taken: Vec<usize> = (0..measurements).step_by(self.every.min(measurements.max(1))).collect();
        if taken.last() != Some(&last) && self.kind != TruthKind::Dense {
            taken.push(last);
        }
        taken
    }

    /// Replaces the noise-free measurements of a run by what is recorded of them; without draws, still
    /// without error.
    pub(crate) fn measurement(&self, run: &mut Run, draw: Option<&mut Draw>) {
        let taken = self.taken(run.truth.len());
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
                    TruthSample::new(t_s, pose.x_m + x_m, pose.y_m + y_m, Some(pose.theta_rad + theta_rad))
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

//! `dataset.toml` as text: the mirror of the reader's manifest.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::partial::GyroNoise;
use crate::read::FORMAT;
use crate::record::{CovarianceScale, Dataset, NominalRobot, Protocol, ProtocolSettings, Provenance, RunInfo};

#[derive(Serialize)]
struct ManifestOut<'a> {
    format: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    licence: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    notes: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    recorded: Option<String>,
    robot: RobotOut<'a>,
    truth: TruthOut,
    #[serde(skip_serializing_if = "GyroOut::is_empty")]
    gyro: GyroOut,
    #[serde(skip_serializing_if = "Option::is_none")]
    lidar: Option<LidarOut>,
    #[serde(skip_serializing_if = "Option::is_none")]
    corrections: Option<CorrectionsOut>,
    run: Vec<RunOut<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    point: Vec<PointOut<'a>>,
}

#[derive(Serialize)]
struct RobotOut<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<&'a str>,
    #[serde(flatten)]
    nominal: &'a NominalRobot,
}

#[derive(Serialize)]
struct TruthOut {
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_xy_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_theta_rad: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map_sigma_xy_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map_sigma_theta_rad: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map_length_m: Option<f64>,
    #[serde(skip_serializing_if = "CovarianceScale::is_separate")]
    covariance_scale: CovarianceScale,
}

#[derive(Serialize)]
struct GyroOut {
    #[serde(skip_serializing_if = "Option::is_none")]
    scale_sigma: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise_rad_per_sqrt_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bias_walk_radps_per_sqrt_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sampling: Option<&'static str>,
}

impl GyroOut {
    fn of(gyro: GyroNoise) -> Self {
        Self {
            scale_sigma: gyro.scale_sigma,
            noise_rad_per_sqrt_s: gyro.noise_rad_per_sqrt_s,
            bias_walk_radps_per_sqrt_s: gyro.bias_walk_radps_per_sqrt_s,
            sampling: gyro.is_instantaneous.then_some("instantaneous"),
        }
    }

    const fn is_empty(&self) -> bool {
        self.scale_sigma.is_none()
            && self.noise_rad_per_sqrt_s.is_none()
            && self.bias_walk_radps_per_sqrt_s.is_none()
            && self.sampling.is_none()
    }
}

#[derive(Serialize)]
struct CorrectionsOut {
    truth_shift_s: f64,
}

#[derive(Serialize)]
struct LidarOut {
    #[serde(skip_serializing_if = "Option::is_none")]
    yaw_rad: Option<f64>,
}

#[derive(Serialize)]
struct RunOut<'a> {
    id: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    protocol: Option<Protocol>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    side_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    length_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turn_rad: Option<f64>,
    #[serde(skip_serializing_if = "is_true")]
    continuous: bool,
    #[serde(flatten)]
    covariates: &'a BTreeMap<String, f64>,
}

const fn is_true(value: &bool) -> bool {
    *value
}

#[derive(Serialize)]
struct PointOut<'a> {
    id: &'a str,
    x_m: f64,
    y_m: f64,
}

/// `dataset.toml` of a dataset that has been checked, whose runs are these.
pub(crate) fn to_toml(
    dataset: &Dataset,
    runs: &[RunInfo],
    truth_shift_s: Option<f64>,
) -> Result<String, toml::ser::Error> {
    let Provenance { name, licence, source, notes, robot_id, recorded } = &dataset.provenance;
    toml::to_string(&ManifestOut {
        format: FORMAT,
        name: name.as_deref(),
        licence: licence.as_deref(),
        source: source.as_deref(),
        notes: notes.as_deref(),
        recorded: recorded.map(|recorded| recorded.to_string()),
        robot: RobotOut { id: robot_id.as_deref(), nominal: &dataset.robot },
        truth: TruthOut {
            sigma_xy_m: dataset.truth_noise.sigma_xy_m,
            sigma_theta_rad: dataset.truth_noise.sigma_theta_rad,
            map_sigma_xy_m: dataset.truth_noise.map.map(|map| map.sigma_xy_m),
            map_sigma_theta_rad: dataset.truth_noise.map.map(|map| map.sigma_theta_rad),
            map_length_m: dataset.truth_noise.map.map(|map| map.length_m),
            covariance_scale: dataset.truth_noise.covariance_scale,
        },
        gyro: GyroOut::of(dataset.truth_noise.gyro),
        lidar: dataset.truth_noise.lidar.map(|lidar| LidarOut { yaw_rad: lidar.yaw_rad }),
        corrections: truth_shift_s.map(|truth_shift_s| CorrectionsOut { truth_shift_s }),
        run: runs.iter().map(RunOut::new).collect(),
        point: dataset
            .points
            .iter()
            .map(|point| PointOut { id: &point.id, x_m: point.body.x_m, y_m: point.body.y_m })
            .collect(),
    })
}

impl<'a> RunOut<'a> {
    fn new(info: &'a RunInfo) -> Self {
        let ProtocolSettings { side_m, radius_m, length_m, turn_rad } = info.settings;
        Self {
            id: &info.id,
            protocol: info.protocol,
            start_s: info.start_s,
            side_m,
            radius_m,
            length_m,
            turn_rad,
            continuous: info.continuous,
            covariates: &info.covariates,
        }
    }
}

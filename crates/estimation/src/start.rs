//! Where a fit starts: the drive, and what of the instrument the first fit cannot do without.

use dataset::Session;
use kinematics::{Pose, wrap_to_pi};
use preflight::{Clock, DriveStart, SessionClock, StartValues};

use crate::error::EstimationError;
use crate::model::{Column, GroupExtrinsics, Grouping, Instrument, Model};
use crate::model_fit::ModelFit;
use crate::optimizer::ConvergenceCriterion;
use crate::records::Records;
use crate::settings::COMMON;

impl<'a> ModelFit<'a> {
    /// Nothing is fitted: the sessions' records by the clock of each, the drive that
    /// windows of motion show, and a free latency where a clock is off.
    pub(crate) fn started(
        sessions: &[Session<'a>],
        starts: &[StartValues],
        clocks: &[SessionClock],
        ends: ConvergenceCriterion,
        displacements_in_series: bool,
    ) -> Result<Self, EstimationError> {
        let first = sessions.first().ok_or(EstimationError::NoSession)?;
        let nominal = Model::of(&first.robot.geometry()?, 0);
        let start = started(&nominal, starts);
        let records = Records::started(sessions, clocks, Some(&start));
        let mut fit = Self::of_records(sessions, records, [nominal, start], ends, displacements_in_series);
        if clocks.iter().any(|clock| clock.of_all != Clock::default()) {
            fit.columns.push(Column::Latency);
        }
        Ok(fit)
    }
}

impl ModelFit<'_> {
    /// Frees the extrinsics of a rotated sensor, which the first fit cannot do without; those of each
    /// session, with its clock, where windows of motion show that it was mounted otherwise.
    pub(crate) fn free_extrinsics_if_rotated(&mut self, starts: &[StartValues]) {
        let extrinsics = self.records.extrinsics();
        let headings_rad: Option<Vec<f64>> = starts.iter().map(|start| Some(start.drive?.sensor_rad)).collect();
        if let Some(headings_rad) = headings_rad.filter(|of| are_apart(of)) {
            self.columns.retain(|column| *column != Column::Latency);
            let own = extrinsics.iter().copied().chain([Column::Latency]).collect();
            let mut own = GroupExtrinsics::new(Grouping::Session, own);
            for (session, heading_rad) in headings_rad.iter().enumerate() {
                let instrument = Instrument { body_from_sensor: Pose::new(0.0, 0.0, *heading_rad), latency_s: 0.0 };
                own.of.insert(own.grouping.group((session, 0)), instrument);
            }
            self.start.body_from_sensor.theta_rad = headings_rad[0];
            self.start.own = Some(own);
            return;
        }
        let heading_rad = self.records.sensor_heading_rad(&self.start);
        // Where windows determine the drive, a heading is no error of it.
        let is_certain = !starts.is_empty() && starts.iter().all(|start| start.drive.is_some());
        let most_rad = if is_certain { COMMON.turned_sensor_rad } else { COMMON.rotated_sensor_rad };
        // To a latency that is free, less of a turn is a step too far.
        let is_late = is_certain && self.columns.contains(&Column::Latency);
        if is_late || heading_rad.abs() > most_rad {
            self.start.body_from_sensor.theta_rad = heading_rad;
            self.columns.extend(extrinsics);
        }
    }
}

/// Whether headings differ by more than a rotated sensor's.
fn are_apart(headings_rad: &[f64]) -> bool {
    headings_rad.iter().any(|heading_rad| wrap_to_pi(heading_rad - headings_rad[0]).abs() > COMMON.rotated_sensor_rad)
}

/// The stated drive, or the one that the windows of motion show where it is far from that: from there, steps
/// may end elsewhere.
fn started(nominal: &Model, starts: &[StartValues]) -> Model {
    let Some(DriveStart { m_per_rad, wheel_separation_m, .. }) = starts.iter().find_map(|start| start.drive) else {
        return nominal.clone();
    };
    let is_far = |ratio: f64| ratio.ln().abs() > COMMON.min_start_deviation;
    let wheels = m_per_rad.zip_with(nominal.m_per_rad, |found, stated| found / stated);
    let lengths = [wheels.left, wheels.right, wheel_separation_m / nominal.separation_m];
    if lengths.into_iter().any(is_far) {
        Model { m_per_rad, separation_m: wheel_separation_m, ..nominal.clone() }
    } else {
        nominal.clone()
    }
}

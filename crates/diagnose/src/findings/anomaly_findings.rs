//! Findings of runs and intervals that do not belong: the effects of the catalogue that do as much.

use effects::{CATALOGUE, Extrinsic, Hypothesis, hypothesis};

use crate::candidates::cause::{Basis, Cause};
use crate::document::Value;
use crate::findings::finding::{Finding, of_causes};
use crate::fits::statistics::p_of_z;
use crate::records::unknown_motion::{Anomaly, AnomalyKind};

/// Runs and intervals that do not belong, those of one kind together.
pub(crate) fn of_anomalies(anomalies: &[Anomaly], without: &[String]) -> Vec<Finding> {
    let mut kinds: Vec<AnomalyKind> = anomalies.iter().map(|anomaly| anomaly.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let of_kind = |kind: AnomalyKind| {
        let mut own: Vec<Anomaly> = anomalies.iter().filter(|anomaly| anomaly.kind == kind).cloned().collect();
        own.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        let mut runs: Vec<String> = own.iter().map(|anomaly| anomaly.run.clone()).collect();
        runs.sort();
        runs.dedup();
        let largest = own.first()?;
        let displacement = largest.displacement;
        let value =
            |name: &str, value: f64, unit: &str| (name.to_owned(), Value { value, sigma: None, unit: unit.to_owned() });
        let parameters = match kind {
            AnomalyKind::Frame | AnomalyKind::RobotOrFrame => vec![
                value("events", own.len() as f64, "1"),
                value("from_s", largest.span_s[0], "s"),
                value("to_s", largest.span_s[1], "s"),
                value("along_m", displacement.x_m, "m"),
                value("across_m", displacement.y_m, "m"),
                value("turn_rad", displacement.theta_rad, "rad"),
            ],
            AnomalyKind::ExtrinsicPosition | AnomalyKind::ExtrinsicHeading => vec![
                value("lever_x_m", displacement.x_m, "m"),
                value("lever_y_m", displacement.y_m, "m"),
                value("yaw_rad", displacement.theta_rad, "rad"),
            ],
        };
        let causes: Vec<Cause> = CATALOGUE
            .iter()
            .copied()
            .filter(|id| is_of(kind, id) && !without.iter().any(|out| out == id))
            .map(Cause::Effect)
            .collect();
        let p_value = p_of_z(largest.sigmas);
        let found = of_causes(causes, p_value, parameters.into_iter().collect(), Basis::Anomalies(own));
        Some(Finding { runs: Some(runs), ..found })
    };
    kinds.into_iter().filter_map(of_kind).collect()
}

/// Whether an effect of the catalogue is an anomaly of that kind.
fn is_of(kind: AnomalyKind, id: &str) -> bool {
    let extrinsic = || effects::description(id).and_then(|description| description.extrinsic);
    match (kind, hypothesis(id)) {
        (AnomalyKind::Frame, Some(Hypothesis::UnknownMotion { is_of_instrument })) => is_of_instrument,
        (AnomalyKind::RobotOrFrame, Some(Hypothesis::UnknownMotion { .. })) => true,
        (AnomalyKind::ExtrinsicPosition, _) => extrinsic() == Some(Extrinsic::Position),
        (AnomalyKind::ExtrinsicHeading, _) => extrinsic() == Some(Extrinsic::Heading),
        _ => false,
    }
}

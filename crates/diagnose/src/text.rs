//! The diagnosis in English, and as scripts get it: the only place where findings become words.

use std::collections::BTreeMap;

use effects::GeometryRatio;

use crate::candidates::cause::{Basis, Cause, Doubt};
use crate::carry_over::heterogeneity::Heterogeneity;
use crate::carry_over::{CarryOver, Level};
use crate::checks::check::{Check, ResidualPersistence};
use crate::checks::errors_at_rest::ErrorsAtRest;
use crate::document::{self, Gain, GainLevel, Subsample, UnlistedTerm, Value, Verdict};
use crate::findings::alternatives::{Alternative, Status};
use crate::findings::finding::Finding;
use crate::findings::geometry_deviation::GeometryDeviation;
use crate::records::unknown_motion::{Anomaly, AnomalyKind};
use crate::settings::FINDINGS;

/// A finding as scripts get it.
pub(crate) fn finding(finding: &Finding) -> document::Finding {
    let unlisted_term = match finding.first() {
        Cause::Term(term) => Some(term.clone()),
        Cause::Effect(_) | Cause::Unknown => None,
    };
    let by = |level| {
        let sizes = finding.carry_over.as_ref().map(|of| of.sizes(level, &fitted(&finding.parameters)));
        sizes.unwrap_or_default()
    };
    let why = finding.carry_over.as_ref().map_or("it is no term of the mean", |of| of.why.as_str());
    document::Finding {
        id: finding.first().id().to_owned(),
        names: finding.causes.iter().map(|cause| cause.id().to_owned()).collect(),
        probability: finding.probability,
        z: finding.z,
        p_value: finding.p_value,
        parameters: finding.parameters.clone(),
        sentence: sentence(finding),
        unlisted_term,
        runs: finding.runs.clone(),
        carries_over: finding.carry_over.as_ref().and_then(|of| of.carries_over),
        carries_over_why: why.to_owned(),
        in_extended_model: finding.carry_over.as_ref().map(|_| finding.is_in_extended_model()),
        by_session: by(Level::Session),
        by_kind: by(Level::Kind),
        heterogeneity: finding
            .carry_over
            .iter()
            .flat_map(CarryOver::heterogeneity)
            .map(|(level, of)| differences(level, of))
            .collect(),
    }
}

/// How sizes differ between units, as scripts get it.
fn differences(level: Level, of: Heterogeneity) -> document::Differences {
    document::Differences {
        level: match level {
            Level::Session => GainLevel::Sessions,
            Level::Kind => GainLevel::Kinds,
        },
        units: of.units,
        cochran_q: of.q,
        p_value: of.p_value,
        tau: of.tau,
        less_than_half_probability: of.less_than_half,
    }
}

/// The parameters that were fitted, with unit and value.
fn fitted(parameters: &BTreeMap<String, Value>) -> Vec<(&str, &str, f64)> {
    parameters
        .iter()
        .filter(|(_, value)| value.sigma.is_some())
        .map(|(name, value)| (name.as_str(), value.unit.as_str(), value.value))
        .collect()
}

/// A candidate cause as scripts get it.
pub(crate) fn candidate(alternative: &Alternative) -> document::CandidateCause {
    let is_named = matches!(alternative.status, Status::Found | Status::NotDiscriminated);
    let refused = (!is_named).then(|| alternative.status.text());
    let Alternative { id, z, log_odds, .. } = alternative;
    document::CandidateCause { id: id.clone(), z: *z, log_odds: *log_odds, refused: refused.map(ToOwned::to_owned) }
}

fn listed(values: &BTreeMap<String, Value>) -> String {
    let parts: Vec<String> = values
        .iter()
        .map(|(name, value)| match value.sigma {
            Some(sigma) if value.unit == "1" => format!("{name} = {:.3e} ± {sigma:.1e}", value.value),
            Some(sigma) => format!("{name} = {:.3e} ± {sigma:.1e} {}", value.value, value.unit),
            None => format!("{name} = {:.3}", value.value),
        })
        .collect();
    parts.join(", ")
}

/// What was diagnosed of a large log, and what was looked for in all of it.
pub(crate) fn subsample(of: &Subsample) -> String {
    let shown = of.row_faults.iter().map(|fault| {
        format!("{} in {} stretches, {} of them diagnosed", fault.id, fault.stretches, fault.diagnosed_stretches)
    });
    let shown: Vec<String> = shown.collect();
    let shown = if shown.is_empty() { "none".to_owned() } else { shown.join("; ") };
    format!(
        "the log is large: {} of its {} stretches were diagnosed, spread over all of it ({} of {} rows, {} of {} measurements); faults of the records that counts show by themselves, looked for in all rows: {shown}",
        of.diagnosed_stretches, of.stretches, of.diagnosed_rows, of.rows, of.diagnosed_measurements, of.measurements
    )
}

/// The candidates, what speaks for them, and what casts doubt on them.
fn sentence(finding: &Finding) -> String {
    // Doubts come after the finding in print; its candidates are those that it was found with.
    let added = |doubt: &Doubt| *doubt != Doubt::ProbablyPartOfUnlisted;
    let is_doubted = finding.doubts.iter().any(added);
    let skipped = usize::from(finding.doubts.contains(&Doubt::ProbablyPartOfUnlisted));
    let mut own: Vec<&str> = finding.causes.iter().skip(skipped).map(Cause::id).collect();
    if is_doubted && own.len() > 1 && own.last() == Some(&"unlisted") {
        own.pop();
    }
    let what = basis(finding);
    let mut sentence = match (&finding.basis, &own[..]) {
        (Basis::Mean, [id]) => format!("{id}: {what}"),
        (Basis::Mean, [first, ..]) => {
            format!("one of {}; this data cannot tell which. As {first}: {what}", own.join(", "))
        }
        (Basis::Products(_), _) | (Basis::FailedTests(_), ["unlisted"]) => what,
        (_, ["unlisted"] | []) => format!("not in the catalogue: {what}"),
        (_, [id]) => format!("{id}: {what}"),
        (_, ids) => format!("one of {}; this data cannot tell which: {what}", ids.join(", ")),
    };
    for doubt in &finding.doubts {
        sentence = match doubt {
            Doubt::ProbablyPartOfUnlisted => {
                format!("probably part of an effect that is not in the catalogue, or else {sentence}")
            }
            Doubt::PartOfUnlisted => {
                format!("{sentence}; it may be part of an effect that is not in the catalogue")
            }
            Doubt::TermDoesAsWell => format!("{sentence}; a term that is not in the catalogue explains it as well"),
            Doubt::Incomplete => format!("{sentence}; it does not explain all that is there"),
            Doubt::OtherForm(by) => {
                let by = by.name();
                format!("{sentence}; its size changes with {by}, which it should not: it may be something else")
            }
            Doubt::ScattersAlike => format!("{sentence}; other effects that differ from turn to turn scatter alike"),
            Doubt::LowSignificance => format!("{sentence}; its significance is low, and it may be something else"),
            Doubt::OtherGeometry => {
                format!("{sentence}; with a geometry that is not the described robot's, it may be something else")
            }
            Doubt::FaultyRecords => format!("{sentence}; what is wrong with the records may do the same"),
            Doubt::DoesNotCarryOver => {
                let why = finding.carry_over.as_ref().map_or("", |of| of.why.as_str());
                format!("{sentence}; it does not hold elsewhere: {why}")
            }
        };
    }
    sentence
}

/// What speaks for the candidates.
fn basis(finding: &Finding) -> String {
    match &finding.basis {
        Basis::Mean => listed(&finding.parameters),
        Basis::Products(trials) => best_product(finding.first(), *trials),
        Basis::FailedTests(failed) => {
            let of_dependence = failed.iter().any(Check::is_of_covariate);
            let failed = failed.iter().map(Check::name).collect::<Vec<_>>().join(", ");
            if finding.causes.len() > 1 && of_dependence {
                format!(
                    "the residuals are not what the model says ({failed}), and what explains them does not hold over the runs"
                )
            } else if finding.causes.len() > 1 {
                format!("the residuals are autocorrelated ({failed}), and nothing that was recorded explains it")
            } else {
                format!(
                    "the residuals are not what the model says ({failed}), and nothing in the catalogue explains it: the cause is not determined"
                )
            }
        }
        Basis::Uncorrelated([wheel, turn, position, heading]) => format!(
            "odometry is uncorrelated with what the instrument measured: to the best fit the wheels err by {:.0} mm/√m and {:.0} mrad/√rad, and measurements by {:.0} mm and {:.0} mrad",
            1e3 * wheel,
            1e3 * turn,
            1e3 * position,
            1e3 * heading
        ),
        Basis::OutlyingRows(rows) => format!("{rows:.0} rows of the log are outliers among the rows around them"),
        Basis::OtherClock(ratio) => format!(
            "the log lasts {ratio:.3e} times as long as what was measured of the robot: their times are not in one unit"
        ),
        Basis::WheelFactor(factor) => format!(
            "calibrated wheels are {} times as large as the robot's description says: it, its counts or their units are another robot's",
            as_ratio(*factor)
        ),
        Basis::Geometry(deviation) => geometry_deviation(deviation),
        Basis::ClockOffset(offset_s) => {
            let whose = match finding.runs.as_deref() {
                None => "all runs".to_owned(),
                Some([run]) => format!("run {run} alone, which is left out of everything else"),
                Some(runs) => format!("runs {}, which are left out of everything else", runs.join(", ")),
            };
            format!(
                "the instrument's poses are of {:.0} ms {} their stamps, in {whose}",
                1e3 * offset_s.abs(),
                if *offset_s > 0.0 { "before" } else { "after" }
            )
        }
        Basis::ClockDrift(rate) => {
            let gains = if *rate > 0.0 { "gains" } else { "loses" };
            format!("the robot's clock {gains} {:.3} % on the instrument's", 100.0 * rate.abs())
        }
        Basis::Extrinsics => {
            format!("{}, fitted with the wheels before effects were sought", listed(&finding.parameters))
        }
        Basis::Anomalies(all) => anomalies(all),
        Basis::RecordFault(sentence) => sentence.clone(),
        Basis::IsolatedErrors(isolated, of) => {
            format!("{isolated} of {of} measurements are isolated outliers: the next ones agree with odometry again")
        }
        Basis::LargeErrors(ResidualPersistence::Persistent) => "large errors that persist: the robot jumped".to_owned(),
        Basis::LargeErrors(ResidualPersistence::Reverting) => {
            "large errors of the instrument that the next measurement reverts".to_owned()
        }
        Basis::LargeErrors(ResidualPersistence::Undecided) => {
            "errors have heavier tails than normal ones, and the next measurements do not say whether robot or instrument erred".to_owned()
        }
        Basis::Autocorrelated(coefficient, ErrorsAtRest::Autocorrelated) => format!(
            "measurement errors are autocorrelated (lag-one coefficient {coefficient:.2}), and no term that was tried explains it"
        ),
        Basis::Autocorrelated(coefficient, ErrorsAtRest::WhiteOrSlow) => format!(
            "errors are autocorrelated (lag-one coefficient {coefficient:.2}), and no term that was tried explains it; while the robot stands they are white, but it stands too shortly to tell: the instrument errs slowly, or motions err for a while at a time. Let the robot stand for a minute"
        ),
        Basis::Autocorrelated(coefficient, ErrorsAtRest::White) => format!(
            "errors are autocorrelated while the robot moves (lag-one coefficient {coefficient:.2}) and not while it stands: motions err for a while at a time, as where the floor differs"
        ),
        Basis::TurnScatter(sigma) => format!("headings scatter with the turn, by {:.1} mrad/√rad", 1e3 * sigma),
    }
}

/// The product of covariates that explains most, of so many that were tried.
fn best_product(cause: &Cause, trials: usize) -> String {
    let Cause::Term(UnlistedTerm { channel, covariates, coefficient, sigma }) = cause else {
        return format!("not in the catalogue: the best of {trials} products tried");
    };
    let covariates = covariates.join(" · ");
    // As much as what a wheel gains in this time: what is logged of it is older.
    let is_late = channel == "wheels" && covariates == "wheel acceleration" && *coefficient > 0.0;
    let known = if is_late {
        format!("; so is a log whose speeds are filtered, or that is late, by {coefficient:.3} s")
    } else {
        String::new()
    };
    format!(
        "not in the catalogue: {channel}, grows with {covariates} ({coefficient:.3e} ± {sigma:.1e}); the best of {trials} products tried{known}"
    )
}

/// How the calibrated geometry deviates from the described one.
fn geometry_deviation(deviation: &GeometryDeviation) -> String {
    let (what, stated) = match deviation.of {
        GeometryRatio::Wheels => ("calibrated wheels are", "as large as the robot's description says"),
        GeometryRatio::RightOverLeft => ("the right wheel over the left one is", "what the robot's description says"),
        GeometryRatio::Separation => ("the calibrated wheel separation is", "what the robot's description says"),
    };
    let why = match deviation.is_of_skid_steering() {
        true => "as of a robot that skids in turns, or the description is another robot's",
        false => "the description is another robot's, or the fit is of something else",
    };
    format!("{what} {} times {stated}: {why}", as_ratio(deviation.ratio))
}

/// Where something does not belong, the largest events first.
fn anomalies(all: &[Anomaly]) -> String {
    let event = |anomaly: &Anomaly| {
        let Anomaly { run, span_s: [from_s, to_s], displacement, .. } = anomaly;
        let by = format!(
            "{:.0} mm ahead, {:.0} mm to the left, {:.1}°",
            1e3 * displacement.x_m,
            1e3 * displacement.y_m,
            displacement.theta_rad.to_degrees()
        );
        match anomaly.kind {
            AnomalyKind::Frame | AnomalyKind::RobotOrFrame => format!("run {run}, {from_s:.2} s to {to_s:.2} s: {by}"),
            AnomalyKind::ExtrinsicPosition | AnomalyKind::ExtrinsicHeading => format!("run {run}: {by}"),
        }
    };
    let mut shown: Vec<String> = all.iter().take(FINDINGS.max_events_shown).map(event).collect();
    if all.len() > FINDINGS.max_events_shown {
        shown.push(format!("{} more", all.len() - FINDINGS.max_events_shown));
    }
    let shown = shown.join("; ");
    match all.first().map(|anomaly| anomaly.kind) {
        Some(AnomalyKind::Frame) => format!(
            "the instrument's poses jump as no robot moves, and stay displaced; nothing is compared across it ({shown})"
        ),
        Some(AnomalyKind::RobotOrFrame) => format!(
            "between two poses the robot moved, or the instrument's frame did, as its wheels do not say; nothing is compared across it ({shown})"
        ),
        _ => format!("the instrument was mounted otherwise than in the other runs; the run is left out ({shown})"),
    }
}

/// The verdict on all findings.
pub(crate) fn verdict(findings: &[Finding]) -> Verdict {
    if findings.is_empty() {
        Verdict::Consistent
    } else if findings.iter().any(Finding::is_unlisted) {
        Verdict::Unlisted
    } else if findings.iter().any(|finding| finding.causes.len() > 1) {
        Verdict::Ambiguous
    } else {
        Verdict::Named
    }
}

/// The whole diagnosis in one sentence.
pub(crate) fn summary(findings: &[Finding], gain: Option<&Gain>) -> String {
    let names = |finding: &Finding| {
        let ids: Vec<&str> = finding.causes.iter().map(Cause::id).collect();
        match finding.first() {
            // An uncatalogued term is described by its covariates.
            Cause::Term(term) => {
                format!("{} ({} with {})", ids.join(" or "), term.channel, term.covariates.join(" · "))
            }
            Cause::Effect(_) | Cause::Unknown => ids.join(" or "),
        }
    };
    let names: Vec<String> = findings.iter().map(names).collect();
    let gains = match gain {
        Some(gain) if gain.log_score_per_observation.low > 0.0 => "; the extended model predicts held-out runs better",
        Some(_) => "; on held-out runs the extended model gains nothing that is significant",
        None => "",
    };
    match verdict(findings) {
        Verdict::Consistent => "the calibrated model explains what was measured".to_owned(),
        Verdict::Named => format!("found: {}{gains}", names.join(", ")),
        Verdict::Ambiguous => {
            format!("found, with causes that this data cannot discriminate: {}{gains}", names.join("; "))
        }
        Verdict::Unlisted => format!("found, and not all of it is in the catalogue: {}{gains}", names.join(", ")),
    }
}

/// A ratio to two digits after the point, or, where that is nothing, to two digits.
fn as_ratio(ratio: f64) -> String {
    if (0.1..1e3).contains(&ratio) { format!("{ratio:.2}") } else { format!("{ratio:.1e}") }
}

#[cfg(test)]
mod tests;

//! Findings and checks in words that a roboticist uses.

use diagnose::{Check, Compared, Document, Finding, Value, Verdict};
use effects::{Estimate, Estimates};

/// What a finding's first name means, with its sizes; the finding's own sentence where that says more.
pub(crate) fn meaning(finding: &Finding) -> String {
    meaning_of_first(finding).unwrap_or_else(|| finding.sentence.clone())
}

/// What a finding's first name means, with its sizes, where the catalogue says it.
fn meaning_of_first(finding: &Finding) -> Option<String> {
    let estimate = |value: &Value| Estimate { value: value.value, sigma: value.sigma };
    let sizes: Estimates<'_> =
        finding.parameters.iter().map(|(name, value)| (name.as_str(), estimate(value))).collect();
    let description = effects::description(&finding.id);
    description.and_then(|of| of.with_values(&sizes))
}

/// The verdict in a sentence.
pub(crate) fn verdict(document: &Document) -> String {
    if document.verdict == Verdict::Consistent {
        let n = document.checks.len();
        return format!("The calibrated model explains what was measured: of {n} checks of its residuals none fails.");
    }
    let found: Vec<String> = document
        .findings
        .iter()
        .map(|finding| match (meaning_of_first(finding), &finding.names[..]) {
            (Some(first), [_, others @ ..]) if !others.is_empty() => {
                format!("{first} – or it is {}, which these data do not discriminate", named(others))
            }
            // A sentence names all causes itself.
            (first, _) => first.unwrap_or_else(|| finding.sentence.clone()),
        })
        .collect();
    format!("{}.{}", capitalised(&found.join("; ")), gain(document).map_or(String::new(), |gain| format!(" {gain}")))
}

/// What the extension gains, in a sentence.
pub(crate) fn gain(document: &Document) -> Option<String> {
    let drift = document.gain.as_ref()?.drift_percent.filter(|drift| drift.base > 0.0)?;
    let Compared { base, extended, low, high } = drift;
    let (share, half) = (100.0 * (base - extended) / base, 50.0 * (high - low) / base);
    let becomes = format!("{base:.3} % of the distance becomes {extended:.3} %");
    Some(if low > 0.0 {
        format!(
            "On runs that it was not fitted to, the extended model removes {share:.0} ± {half:.0} % of the drift (95 %): {becomes}."
        )
    } else if high < 0.0 {
        format!(
            "On runs that it was not fitted to, dead reckoning drifts more with the extended model: {becomes}. It explains what the instrument measured, and is not to be used for odometry."
        )
    } else {
        format!(
            "On runs that it was not fitted to, no change in the drift can be told: {becomes}; {}.",
            undecided(100.0 * low / base, 100.0 * high / base)
        )
    })
}

/// An interval of the gain that contains zero, per cent of the drift. A normal interval may reach beyond all
/// of the drift, of which nothing can be removed.
pub(crate) fn undecided(low_percent: f64, high_percent: f64) -> String {
    format!(
        "with the correction it may be anything from {:.0} % less to {:.0} % more (95 %)",
        high_percent.clamp(0.0, 100.0),
        (-low_percent).max(0.0)
    )
}

/// Further names of a finding.
pub(crate) fn named(ids: &[String]) -> String {
    let name =
        |id: &String| if id == "unlisted" { "something outside of the catalogue".to_owned() } else { id.clone() };
    ids.iter().map(name).collect::<Vec<_>>().join(" or ")
}

pub(crate) fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// What a check asks.
pub(crate) fn question(check: &Check) -> String {
    let component = |name: &str| match name.rsplit('_').next() {
        Some("along") => "along the robot",
        Some("across") => "across the robot",
        _ => "of the heading",
    };
    let name = &check.name[..];
    if name.starts_with("nis_") {
        return format!(
            "Are residuals {} as large as the noise that was estimated? (mean square, 1 is right)",
            component(name)
        );
    }
    if name.starts_with("white_") {
        return format!("Are residuals {} independent of those just before?", component(name));
    }
    if name.starts_with("kurtosis_") {
        return format!(
            "Are there no more large residuals {} than normal noise has? (kurtosis, 3 is right)",
            component(name)
        );
    }
    match name {
        "run_to_run" => "Is the noise the same in every run?".to_owned(),
        "outliers" => "Are no measurements outliers? (how many are)".to_owned(),
        "log_spans" => "Does the log last as long as the measurements? (how many times as long)".to_owned(),
        "log_rows" => "Do all rows of the log agree with the rows around them? (how many do not)".to_owned(),
        "speed" => "Are residuals independent of speed?".to_owned(),
        "yaw_rate" => "… of yaw rate?".to_owned(),
        "speed_times_yaw_rate" => "… of speed times yaw rate?".to_owned(),
        "acceleration" => "… of acceleration?".to_owned(),
        "heading_in_the_room" => "… of the heading in the room?".to_owned(),
        "left_wheel_phase" => "… of the phase of the left wheel?".to_owned(),
        "right_wheel_phase" => "… of the phase of the right wheel?".to_owned(),
        "time_in_run" => "… of time in the run?".to_owned(),
        "time_in_session" => "… of time in the session?".to_owned(),
        "distance" => "… of the distance driven?".to_owned(),
        "distance_since_reversal" => "… of the distance since a reversal?".to_owned(),
        "position" => "… of the place in the room?".to_owned(),
        "left_wheel_cycles" => "… of the left wheel's phase, several times a turn?".to_owned(),
        "right_wheel_cycles" => "… of the right wheel's phase, several times a turn?".to_owned(),
        "row_length" => "… of how much longer a row is than usual?".to_owned(),
        other => format!("… of {}?", other.trim_start_matches("covariate_")),
    }
}

/// A p-value with the digits that it is worth.
pub(crate) fn p_value(p: f64) -> String {
    match p {
        p if p >= 1e-3 => format!("{p:.3}"),
        p if p > 0.0 => format!("{p:.0e}"),
        _ => "< 1e-300".to_owned(),
    }
}

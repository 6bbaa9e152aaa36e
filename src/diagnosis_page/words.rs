//! Findings and checks in words that a roboticist uses.

use diagnose::{Check, Compared, Document, Finding, UnlistedTerm, Value, Verdict};
use effects::{Estimate, Estimates, OnBoard, Statement};

/// What a finding's first name means, with its sizes; the finding's own sentence where that says more.
pub(crate) fn meaning(finding: &Finding) -> String {
    meaning_of_first(finding).unwrap_or_else(|| finding.sentence.clone())
}

/// What a finding's first name means, with its sizes, where the catalogue or the term says it.
fn meaning_of_first(finding: &Finding) -> Option<String> {
    match (&finding.unlisted_term, statement(finding)) {
        (Some(term), _) => Some(format!("{}, which is not in the catalogue", term_in_words(term))),
        (None, statement) => statement.map(|of| of.sentence()),
    }
}

fn statement(finding: &Finding) -> Option<Statement> {
    let estimate = |value: &Value| Estimate { value: value.value, sigma: value.sigma };
    let sizes: Estimates<'_> =
        finding.parameters.iter().map(|(name, value)| (name.as_str(), estimate(value))).collect();
    effects::description(&finding.id)?.statement(&sizes)
}

/// What is wrong, without its size.
pub(crate) fn cause(finding: &Finding) -> &'static str {
    let of_catalogue = || effects::description(&finding.id).map(|of| of.meaning);
    statement(finding).map(|of| of.what).or_else(of_catalogue).unwrap_or("something that is not in the catalogue")
}

/// What is wrong as a part of a sentence, without its size and without identifiers.
pub(crate) fn cause_in_a_sentence(finding: &Finding) -> String {
    match &finding.unlisted_term {
        Some(term) => format!("{}, which is not in the catalogue", term_in_words(term)),
        None if effects::description(&finding.id).is_none() => {
            "the residuals show something that no known cause explains".to_owned()
        }
        // A fault of the records says in its own sentence what was undone.
        None if statement(finding).is_none() && !finding.sentence.contains('_') => {
            finding.sentence.trim_end_matches('.').to_owned()
        }
        None => cause(finding).to_owned(),
    }
}

/// How large it is; `None` where nothing has a size that people can picture.
pub(crate) fn size(finding: &Finding) -> Option<String> {
    statement(finding)?.size
}

/// Whether the first cause is a fault of the instrument, its clock or its mounting.
pub(crate) fn is_of_instrument(finding: &Finding) -> bool {
    effects::description(&finding.id).is_some_and(|of| matches!(of.on_board, OnBoard::OfInstrument))
}

/// An effect outside of the catalogue: what it does, and in proportion to what.
fn term_in_words(term: &UnlistedTerm) -> String {
    let signed = |positive: &'static str, negative| if term.coefficient < 0.0 { negative } else { positive };
    let what = match &term.channel[..] {
        "along" => signed("the robot gains distance", "the robot loses distance"),
        "across" => signed("the robot drifts to the left", "the robot drifts to the right"),
        "yaw" => signed("the robot turns too far to the left", "the robot turns too far to the right"),
        "wheels" => signed("both wheels gain distance", "both wheels lose distance"),
        "left_wheel" => signed("the left wheel gains distance", "the left wheel loses distance"),
        "right_wheel" => signed("the right wheel gains distance", "the right wheel loses distance"),
        "seen_along" => signed("the instrument sees the robot ahead", "the instrument sees the robot behind"),
        "seen_across" => {
            signed("the instrument sees the robot on the left", "the instrument sees the robot on the right")
        }
        "seen_heading" => {
            signed("the instrument sees the robot turned left", "the instrument sees the robot turned right")
        }
        _ => signed("the instrument is late", "the instrument is early"),
    };
    let product: Vec<&str> = term.covariates.iter().filter(|name| *name != "1").map(|name| covariate(name)).collect();
    if product.is_empty() {
        format!("{what} all the time")
    } else {
        format!("{what} in proportion to {}", product.join(" × "))
    }
}

/// A covariate by the words of a roboticist.
fn covariate(name: &str) -> &str {
    match name {
        "v" => "speed",
        "|v|" => "the size of the speed",
        "omega" => "yaw rate",
        "|omega|" => "the size of the yaw rate",
        "yaw_acceleration" => "yaw acceleration",
        "wheel v" => "wheel speed",
        "|wheel v|" => "the size of the wheel speed",
        "wheel sense" => "the sense of rotation of the wheel",
        "exp(-|wheel v| / 0.05 m/s)" => "slowness of the wheel",
        "exp(-wheel distance since reversal / 2 mm)" => "nearness to the last reversal of the wheel",
        "row length" => "the time between rows",
        "cos(theta)" => "the cosine of the heading",
        "sin(theta)" => "the sine of the heading",
        "time in run" => "time in the run",
        "session time" => "time in the session",
        "distance driven" => "the distance driven",
        "exp(-distance since reversal / 0.1 m)" => "nearness to the last reversal",
        "bend" => "curvature",
        "last turn" => "the sense of the last turn",
        "x" => "x in the room",
        "y" => "y in the room",
        other => other,
    }
}

/// Causes in words, the first three of them.
pub(crate) fn in_words(ids: &[String]) -> String {
    const MOST: usize = 3;
    let word = |id: &String| effects::description(id).map_or("something that is not in the catalogue", |of| of.meaning);
    let mut words: Vec<String> = ids.iter().take(MOST).map(|id| word(id).to_owned()).collect();
    if ids.len() > MOST {
        words.push(format!("{} more, listed below", ids.len() - MOST));
    }
    words.join("; ")
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
                format!("{first}; these data cannot tell it apart from {}", named(others))
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
        format!("On held-out runs, the extended model removes {share:.0} ± {half:.0} % of the drift (95 %): {becomes}.")
    } else if high < 0.0 {
        format!(
            "On held-out runs, dead reckoning drifts more with the extended model: {becomes}. Do not use it for odometry."
        )
    } else {
        format!(
            "On held-out runs, the extended model makes no measurable difference to the drift: {becomes} ({}).",
            undecided(100.0 * low / base, 100.0 * high / base)
        )
    })
}

/// An interval of the gain that contains zero, per cent of the drift. A normal interval may reach beyond all
/// of the drift, of which nothing can be removed.
pub(crate) fn undecided(low_percent: f64, high_percent: f64) -> String {
    format!("95 % interval: {:.0} % less to {:.0} % more", high_percent.clamp(0.0, 100.0), (-low_percent).max(0.0))
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

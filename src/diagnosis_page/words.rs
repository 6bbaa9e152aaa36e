//! Findings and checks in words that a roboticist uses.

use std::collections::BTreeMap;

use diagnose::{Alternative, Check, Compared, Document, Fate, Finding, Value, Verdict};

/// A value with its standard deviation, with as many digits as that is worth.
pub(super) fn plus_minus(value: f64, sigma: Option<f64>, unit: &str) -> String {
    let sigma = sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0);
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    match sigma {
        Some(sigma) => {
            let decimals = decimals_for(sigma);
            format!("{value:.decimals$} ± {sigma:.decimals$}{unit}")
        }
        None => {
            let decimals = decimals_for(0.1 * value.abs());
            format!("{value:.decimals$}{unit}")
        }
    }
}

/// Decimals that show two digits of a number below 1, and none of one above 10.
fn decimals_for(sigma: f64) -> usize {
    if !(sigma.is_finite() && sigma > 0.0) {
        return 2;
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 9
    let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize;
    decimals
}

type Parameters = BTreeMap<String, Value>;

fn value<'p>(parameters: &'p Parameters, name: &str) -> Option<&'p Value> {
    parameters.get(name)
}

/// A parameter scaled for people.
fn of(parameters: &Parameters, name: &str, scale: f64, unit: &str) -> String {
    value(parameters, name).map_or_else(
        || "?".to_owned(),
        |value| plus_minus(scale * value.value, value.sigma.map(|s| s * scale.abs()), unit),
    )
}

/// The amplitude of a sine and a cosine, per side.
fn amplitudes(parameters: &Parameters, suffix: &str, scale: f64, unit: &str, what: &str) -> String {
    let side = |side: &str| -> Option<(f64, String)> {
        let (sin, cos) =
            (value(parameters, &format!("{side}_sin{suffix}"))?, value(parameters, &format!("{side}_cos{suffix}"))?);
        let size = sin.value.hypot(cos.value);
        let sigma =
            sin.sigma.zip(cos.sigma).map(|(a, b)| ((sin.value * a).hypot(cos.value * b)) / size.max(f64::MIN_POSITIVE));
        let shows = sigma.is_none_or(|sigma| size > 3.0 * sigma);
        let text = format!("the {side} {what} by {}", plus_minus(scale * size, sigma.map(|s| s * scale), unit));
        shows.then_some((size, text))
    };
    let mut sides: Vec<(f64, String)> = ["left", "right"].into_iter().filter_map(side).collect();
    sides.sort_by(|a, b| b.0.total_cmp(&a.0));
    if sides.is_empty() {
        return format!("a {what}, which one cannot be told");
    }
    sides.into_iter().map(|(_, text)| text).collect::<Vec<_>>().join(" and ")
}

/// What a finding's first name means, with its sizes.
pub(super) fn meaning(finding: &Finding) -> String {
    let p = &finding.parameters;
    match &finding.id[..] {
        "slip_speed" => format!(
            "the wheels lose way in proportion to their speed: {} of it for each m/s",
            of(p, "slip_s_m", 100.0, "%")
        ),
        "slip_acceleration" => format!("the ground speed lags behind the wheels' by {}", of(p, "kappa_s", 1e3, "ms")),
        "wheel_eccentricity" => {
            format!("a wheel is not round or not centred: {}", amplitudes(p, "", 100.0, "%", "wheel's radius varies"))
        }
        "encoder_cycle" => format!(
            "an encoder errs {} times a turn: {}",
            value(p, "cycles").map_or_else(|| "some".to_owned(), |cycles| format!("{:.0}", cycles.value)),
            amplitudes(p, "_rad", 1e3, "mrad", "encoder is off")
        ),
        "backlash" => format!(
            "there is play between encoder and wheel: {} on the left, {} on the right",
            of(p, "left_gap_m", 1e3, "mm"),
            of(p, "right_gap_m", 1e3, "mm")
        ),
        "lateral_skid" => {
            format!("the robot slides outwards in bends, by {} times speed times yaw rate", of(p, "skid_s", 1e3, "ms"))
        }
        "load_transfer" => format!(
            "in bends the outer tyre is pressed flatter: radii differ by {} for each m/s² of side acceleration, each way",
            of(p, "compression_s2_m", 100.0, "%")
        ),
        "turn_rate_wheelbase" => format!(
            "the faster the robot turns, the farther apart its wheels act: {} for each rad/s",
            of(p, "beta_s", 100.0, "%")
        ),
        "castor_drag" => format!(
            "the castor resists rolling aside: {} of turn lost for each metre that it rolls so",
            of(p, "drag_rad_m", 1e3, "mrad")
        ),
        "castor_kick" => format!(
            "the castor swings round after a reversal and turns the robot by {}",
            of(p, "kick_rad", 1e3, "mrad")
        ),
        "floor_slope" => "the floor slopes: the robot creeps one way in the room, whatever way it looks".to_owned(),
        "carpet_nap" => {
            "the floor's pile takes the wheels with it: a drift one way in the room in proportion to the way driven"
                .to_owned()
        }
        "direction_asymmetry" => format!(
            "forward and backward metres count differently: by {} on the left wheel, {} on the right",
            of(p, "left_asymmetry", 100.0, "%"),
            of(p, "right_asymmetry", 100.0, "%")
        ),
        "missed_counts" => format!(
            "counts are lost at high speed: {} on the left, {} on the right above {}",
            of(p, "left_lost_share", 100.0, "%"),
            of(p, "right_lost_share", 100.0, "%"),
            value(p, "hinge_speed_m_s")
                .map_or_else(|| "some speed".to_owned(), |hinge| format!("{:.2} m/s", hinge.value))
        ),
        "low_speed_truncation" => format!(
            "fractions of counts are thrown away step by step: {} of speed lost",
            of(p, "loss_m_s", 1e3, "mm/s")
        ),
        "sampling_skew" => {
            format!("the right counter is read {} after the left one", of(p, "right_delay_s", 1e3, "ms"))
        }
        "payload_compression" => "the payload presses the tyres flatter".to_owned(),
        "thermal_drift" => {
            format!("the scale drifts with the time of the session, by {} in the end", of(p, "growth", 100.0, "%"))
        }
        "wear" => "the scale drifts with the distance driven".to_owned(),
        "interval_error" => "the logged intervals are not the true ones".to_owned(),
        "clock_rate" => format!("one clock runs fast, by {}", of(p, "rate", 100.0, "%")),
        "truth_latency" => format!(
            "the instrument's looks are late by {}: nothing is wrong with the robot",
            of(p, "delay_s", 1e3, "ms")
        ),
        "truth_lever_arm" => format!(
            "the instrument's marker is not over the axle's centre, but {} ahead and {} to the left: nothing is wrong with the robot",
            of(p, "lever_x_m", 1e3, "mm"),
            of(p, "lever_y_m", 1e3, "mm")
        ),
        "truth_yaw" => format!(
            "the instrument's frame is turned on the robot by {} (or both wheels toe by as much)",
            of(p, "yaw_rad", 180.0 / std::f64::consts::PI, "°")
        ),
        "truth_correlated_noise" => {
            "the instrument's errors last for several looks: it is not as precise as its single looks seem".to_owned()
        }
        "truth_outliers" => "single looks of the instrument lie far off".to_owned(),
        _ => finding.sentence.clone(),
    }
}

/// The verdict in a sentence.
pub(super) fn verdict(document: &Document) -> String {
    if document.verdict == Verdict::Consistent {
        let n = document.checks.len();
        return format!("The calibrated model explains what was measured: of {n} checks of its residuals none fails.");
    }
    let found: Vec<String> = document
        .findings
        .iter()
        .map(|finding| match &finding.names[..] {
            [_, others @ ..] if !others.is_empty() => {
                format!("{} – or it is {}, which this data cannot tell from it", meaning(finding), named(others))
            }
            _ => meaning(finding),
        })
        .collect();
    format!("{}.{}", capitalised(&found.join("; ")), gain(document).map_or(String::new(), |gain| format!(" {gain}")))
}

/// What the extension gains, in a sentence.
pub(super) fn gain(document: &Document) -> Option<String> {
    let drift = document.gain.as_ref()?.drift_percent.filter(|drift| drift.base > 0.0)?;
    let Compared { base, extended, low, high } = drift;
    let (share, half) = (100.0 * (base - extended) / base, 50.0 * (high - low) / base);
    let becomes = format!("{base:.3} % of the way become {extended:.3} %");
    Some(if low > 0.0 {
        format!(
            "On runs that it was not fitted to, the extended model removes {share:.0} ± {half:.0} % of the drift (95 %): {becomes}."
        )
    } else if high < 0.0 {
        format!(
            "On runs that it was not fitted to, dead reckoning drifts **more** with the extended model: {becomes}. It explains what the instrument saw, and is not to be used for odometry."
        )
    } else {
        format!(
            "What dead reckoning gains on runs that it was not fitted to is not certain: {becomes}, a gain of {:.0} to {:.0} % of the drift (95 %).",
            100.0 * low / base,
            100.0 * high / base
        )
    })
}

/// Further names of a finding.
fn named(ids: &[String]) -> String {
    let name =
        |id: &String| if id == "unlisted" { "something outside of the catalogue".to_owned() } else { id.clone() };
    ids.iter().map(name).collect::<Vec<_>>().join(" or ")
}

pub(super) fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// What a check asks.
pub(super) fn question(check: &Check) -> String {
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
        "outliers" => "Do no looks lie far off? (how many do)".to_owned(),
        "log_spans" => "Does the log last as long as what was seen of the robot? (how many times as long)".to_owned(),
        "log_rows" => "Do all rows of the log go on where the rows around them do? (how many do not)".to_owned(),
        "speed" => "Do residuals not go with speed?".to_owned(),
        "yaw_rate" => "… with yaw rate?".to_owned(),
        "speed_times_yaw_rate" => "… with speed times yaw rate?".to_owned(),
        "acceleration" => "… with acceleration?".to_owned(),
        "heading_in_the_room" => "… with the heading in the room?".to_owned(),
        "left_wheel_phase" => "… with the phase of the left wheel?".to_owned(),
        "right_wheel_phase" => "… with the phase of the right wheel?".to_owned(),
        "time_in_run" => "… with time in the run?".to_owned(),
        "time_in_session" => "… with time in the session?".to_owned(),
        "distance" => "… with the distance driven?".to_owned(),
        "distance_since_reversal" => "… with the distance since a reversal?".to_owned(),
        "position" => "… with the place in the room?".to_owned(),
        "left_wheel_cycles" => "… with the left wheel's phase, several times a turn?".to_owned(),
        "right_wheel_cycles" => "… with the right wheel's phase, several times a turn?".to_owned(),
        "row_length" => "… with how much longer a row is than usual?".to_owned(),
        other => format!("… with {}?", other.trim_start_matches("covariate_")),
    }
}

/// Why an alternative was not named.
pub(super) fn fate(alternative: &Alternative) -> &'static str {
    match alternative.fate {
        Fate::Found => "found",
        Fate::NotToldApart => "cannot be told from what was found",
        Fate::ExplainsLess => "explains less than what was found, or nothing beside it",
        Fate::DoesNotStandOut => "does not stand out",
        Fate::NotShown => "these data could not show it",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_standard_deviation() {
        assert_eq!(plus_minus(0.40123, Some(0.0123), "%"), "0.401 ± 0.012 %");
        assert_eq!(plus_minus(159.87, Some(23.4), "mm"), "160 ± 23 mm");
        assert_eq!(plus_minus(7.0, None, ""), "7.00");
    }
}

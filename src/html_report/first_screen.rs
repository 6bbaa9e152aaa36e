//! The first screen of a diagnosis: drift before and after, what to change first, and the facts behind it.
//!
//! What is wrong with the robot comes first. A fault of the instrument never is the headline of a robot with
//! a finding; it has a tile of its own.

use ::diagnose::{Compared, Document, Drift, Finding};
use report_page::{Bar, Bars, Role, Tile, Tone};

use super::words::{count, plus_minus};
use super::{UnderCalibrations, drift, next_drive};
use crate::diagnosis_page::words::{self, capitalised};

/// Drift as configured, calibrated, and with what was found.
pub(super) struct FirstScreen<'d> {
    document: &'d Document,
    /// Drifts in per cent with their 95 % intervals.
    drifts: Vec<Bar>,
    robot: Vec<&'d Finding>,
    instrument: Vec<&'d Finding>,
}

impl<'d> FirstScreen<'d> {
    /// Drifts of held-out runs; where nothing could be held out, those of the runs at hand.
    pub(super) fn of(document: &'d Document, under: &UnderCalibrations) -> Self {
        let names = [
            ("As configured", Role::Nominal),
            ("Calibrated", Role::Calibrated),
            ("With what was found", Role::ExtendedModel),
        ];
        let held_out = document.drift.map(|of| [Some(of.nominal), Some(of.calibrated), of.extended]);
        let drift_of = |(at, (name, role)): (usize, (&str, Role))| {
            let (percent, interval) = match held_out {
                Some(held_out) => held_out[at].map(|Drift { percent, low, high }| (percent, Some((low, high))))?,
                None => {
                    let (_, _, drift) = under.drifts.iter().find(|(_, of, _)| *of == role)?;
                    (drift.drift_percent?, None)
                }
            };
            Some(Bar { name: name.to_owned(), role, value: percent, interval, text: percent_words(percent, interval) })
        };
        let (instrument, robot) = document.findings.iter().partition(|finding| words::is_of_instrument(finding));
        Self { document, drifts: names.into_iter().enumerate().filter_map(drift_of).collect(), robot, instrument }
    }

    pub(super) fn tone(&self) -> Tone {
        use ::diagnose::Verdict;
        match self.document.verdict {
            Verdict::Consistent => Tone::Fine,
            Verdict::Named => Tone::Found,
            Verdict::Ambiguous | Verdict::Unlisted => Tone::Uncertain,
        }
    }

    pub(super) fn bars(&self) -> Option<Bars> {
        let (title, note) = match &self.document.drift {
            Some(of) => {
                let mean_m = of.distance_m / of.runs.max(1) as f64;
                let example = if mean_m > 0.0 {
                    format!(
                        " 1 % is {:.0} mm at the end of a run of {mean_m:.1} m, the mean length here.",
                        10.0 * mean_m
                    )
                } else {
                    String::new()
                };
                let held_out = of.held_out_runs;
                let note = format!("± is the 95 % interval over {held_out} held-out runs or parts of runs.{example}");
                ("Drift on held-out runs: position error at the end of a run, per cent of the distance driven", note)
            }
            None => {
                let note = "Drift on the runs that were calibrated with: new runs drift a little more.";
                (drift::BARS, note.to_owned())
            }
        };
        // What changes nothing is no bar of its own.
        let bars = match &self.drifts[..] {
            [before @ .., calibrated, extended] if calibrated.text == extended.text => {
                before.iter().chain([calibrated]).cloned().collect()
            }
            all => all.to_vec(),
        };
        (!bars.is_empty()).then(|| Bars { title: title.to_owned(), bars, note })
    }

    /// What to change first, in a sentence.
    pub(super) fn headline(&self) -> String {
        match (self.robot.first(), self.calibration()) {
            (None, Some(sentence)) => sentence,
            (None, None) => "Nothing is wrong with the odometry, as far as these runs can show.".to_owned(),
            (Some(first), Some(sentence)) if self.calibration_removes_more() => {
                let likely = if is_certain(first) { "" } else { ", most likely" };
                format!("{sentence} What is left{likely}: {}.", words::cause_in_a_sentence(first))
            }
            (Some(first), _) => {
                let size = words::size(first).map_or_else(String::new, |size| format!(": {size}"));
                let cause = words::cause_in_a_sentence(first);
                if is_certain(first) {
                    format!("{}{size}.", capitalised(&cause))
                } else {
                    format!("Most likely {cause}{size}.")
                }
            }
        }
    }

    /// What else is to be known first.
    pub(super) fn lead(&self) -> String {
        let mut sentences = Vec::new();
        match self.robot.first() {
            None => {
                let blind = self.document.blind_to.len();
                sentences.push("The calibrated model explains the rest, as far as these runs can show.".to_owned());
                if blind > 0 {
                    sentences.push(format!("These runs cannot show {}, listed below.", count(blind, "known cause")));
                }
            }
            Some(first) => {
                if first.names.len() > 1 {
                    sentences.push(format!("It may also be {}.", words::in_words(&first.names[1..])));
                }
                sentences.push(gain_sentence(self.document));
                if !self.calibration_removes_more() {
                    sentences.extend(self.calibration());
                }
            }
        }
        if let Some(subsample) = &self.document.subsample {
            sentences.push(format!("{}.", capitalised(&subsample.sentence)));
        }
        sentences.retain(|sentence| !sentence.is_empty());
        sentences.join(" ")
    }

    /// What calibrating does to the drift; `None` where it was not held out.
    fn calibration(&self) -> Option<String> {
        if self.document.calibration.methods.iter().any(|method| method.error.is_some()) {
            return None;
        }
        let Compared { base, extended, low, high } = self.document.drift?.calibrated_over_nominal;
        let [from, to] = [base, extended].map(|drift| {
            // The bars have more where their intervals are worth more.
            let decimals = (1.0 - drift.max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
            format!("{drift:.decimals$}")
        });
        Some(if low > 0.0 {
            format!("Calibrate the wheels first: the drift falls from {from} % to {to} % of the distance.")
        } else if high < 0.0 {
            format!(
                "Keep the configured wheels: with the calibrated ones the drift rises from {from} % to {to} % of the distance."
            )
        } else {
            format!(
                "Calibrating the wheels makes no measurable difference to the drift: {from} % as configured, {to} % calibrated."
            )
        })
    }

    /// Whether calibrating removes more of the drift than what was found does; both on held-out runs.
    fn calibration_removes_more(&self) -> bool {
        let removed = |of: Compared| if of.low > 0.0 { of.base - of.extended } else { 0.0 };
        let calibrating = self.document.drift.map_or(0.0, |of| removed(of.calibrated_over_nominal));
        calibrating > drift_gain(self.document).map_or(0.0, removed)
    }

    pub(super) fn tiles(&self) -> Vec<Tile> {
        vec![self.cause(), self.size(), self.measurement(), next_drive::tile(self.document)]
    }

    fn cause(&self) -> Tile {
        let Some(first) = self.robot.first() else {
            let n = self.document.checks.len();
            let failed = self.document.checks.iter().filter(|check| !check.passes).count();
            let note = format!("{failed} of {n} checks of the residuals fail");
            return tile("Cause", "Nothing seen".to_owned(), note, "checks");
        };
        let further = self.robot.len() - 1;
        let further =
            if further > 0 { format!("; {} below", count(further, "further finding")) } else { String::new() };
        let or = if first.names.len() > 1 { "most likely; " } else { "" };
        let note = format!("{or}probability {:.0} %{further}", 100.0 * first.probability);
        tile("Cause", capitalised(words::cause(first)), note, "finding")
    }

    fn size(&self) -> Tile {
        let Some(first) = self.robot.first() else {
            let blind = self.document.blind_to.len();
            let note = "these runs do not excite them".to_owned();
            return tile("Could not show", count(blind, "known cause"), note, "limits");
        };
        match words::size(first) {
            Some(size) => tile("Size", capitalised(&size), "± is one standard deviation".to_owned(), "finding"),
            None => {
                let z = format!("{:.0} standard deviations from zero", first.z);
                tile("Evidence", z, "of the size that was found".to_owned(), "statistics")
            }
        }
    }

    fn measurement(&self) -> Tile {
        const LABEL: &str = "About the measurement";
        let Some(first) = self.instrument.first() else {
            return tile(
                LABEL,
                "No fault seen".to_owned(),
                "of the instrument, its clock or its mounting".to_owned(),
                "finding",
            );
        };
        let further = self.instrument.len() - 1;
        let further =
            if further > 0 { format!("; {} below", count(further, "further finding")) } else { String::new() };
        let size = words::size(first).unwrap_or_else(|| format!("probability {:.0} %", 100.0 * first.probability));
        tile(LABEL, capitalised(words::cause(first)), format!("{size}{further}"), "finding")
    }
}

/// Whether a finding has one name, be it that of no known cause.
fn is_certain(finding: &Finding) -> bool {
    finding.names.len() == 1
}

fn tile(label: &str, value: String, note: String, section: &str) -> Tile {
    Tile { label: label.to_owned(), value, note, section: section.to_owned() }
}

/// A drift with as many digits as its interval is worth.
fn percent_words(percent: f64, interval: Option<(f64, f64)>) -> String {
    match interval {
        Some((_, high)) => format!("{} %", plus_minus(percent, Some(high - percent))),
        None => format!("{percent:.3} %"),
    }
}

/// What correcting the finding gains on held-out runs.
pub(super) fn gain_sentence(document: &Document) -> String {
    let Some(Compared { base, low, high, .. }) = drift_gain(document) else {
        let why = document
            .gain_why_null
            .clone()
            .or_else(|| document.gain.is_some().then(|| "no pose says how far these runs drift".to_owned()));
        return why.map_or_else(String::new, |why| format!("No gain in drift is stated: {why}."));
    };
    let (low_percent, high_percent) = (100.0 * low / base, 100.0 * high / base);
    if low > 0.0 {
        let (middle, half) = (0.5 * (low_percent + high_percent), 0.5 * (high_percent - low_percent));
        format!(
            "On held-out runs, correcting what was found removes {middle:.0} ± {half:.0} % of the drift that calibration leaves (95 %)."
        )
    } else if high < 0.0 {
        "On held-out runs, correcting what was found makes the drift larger: use the plain calibration for odometry."
            .to_owned()
    } else {
        let undecided = words::undecided(low_percent, high_percent);
        format!(
            "On held-out runs, correcting what was found makes no measurable difference to the drift ({undecided})."
        )
    }
}

fn drift_gain(document: &Document) -> Option<Compared> {
    document.gain.as_ref()?.drift_percent.filter(|drift| drift.base > 0.0)
}

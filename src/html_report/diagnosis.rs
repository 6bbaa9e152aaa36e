//! The page of a diagnosis: what is wrong, what to change, what was driven, and what to drive next.

use std::path::Path;

use ::diagnose::{Compared, Diagnosis, Document, ExtendedModel, Finding, Verdict};
use calib::{AugmentedCalibration, nominal_value};
use dataset::Dataset;
use report_page::{Block, Cell, Report, Role, Section, Table, Tile, Tone};

use super::words::{count, parameters, plus_minus, to_copy};
use super::{
    Under, UnderCalibrations, contents, diagnosis_details as details, drift, made_by, next_drive, residuals, subject,
};
use crate::diagnosis_page::words::{self, capitalised, meaning, named};
use crate::terminal::Failure;

/// What the page is made of.
pub(crate) struct DiagnosisPage<'d> {
    pub(crate) diagnosis: &'d Diagnosis,
    pub(crate) datasets: &'d [Dataset],
    /// Datasets as they were typed.
    pub(crate) given: &'d [std::path::PathBuf],
    /// The folder under the name that it will have.
    pub(crate) out: &'d Path,
}

/// Dead reckoning of datasets with the nominal robot, the calibrated one, and the extended one where
/// something was found.
fn under_calibrations(diagnosis: &Diagnosis, datasets: &[Dataset]) -> UnderCalibrations {
    let Diagnosis { document, extended, base, .. } = diagnosis;
    let calibrated = base.calibrations().into_iter().next().map(AugmentedCalibration::from);
    let model = extended.as_ref().ok().and_then(|scenario| ExtendedModel::of(scenario).ok());
    let mut under = vec![Under { name: "nominal".to_owned(), role: Role::Nominal, calibration: None, model: None }];
    if let Some(calibrated) = &calibrated {
        let name = "calibrated".to_owned();
        under.push(Under { name, role: Role::Calibrated, calibration: Some(calibrated), model: None });
    }
    if let Some(model) = model.as_ref().filter(|_| !document.findings.is_empty()) {
        let name = "extended".to_owned();
        let calibration = Some(&model.calibration);
        under.push(Under { name, role: Role::ExtendedModel, calibration, model: Some(model) });
    }
    UnderCalibrations::of(datasets, &under)
}

/// Drift of datasets, per cent of the distance: nominal, calibrated and extended.
pub(crate) fn drift_percents(diagnosis: &Diagnosis, datasets: &[Dataset]) -> [Option<f64>; 3] {
    let drifts = under_calibrations(diagnosis, datasets).drifts;
    [Role::Nominal, Role::Calibrated, Role::ExtendedModel]
        .map(|role| drifts.iter().find(|(_, of, _)| *of == role).and_then(|(_, _, drift)| drift.drift_percent))
}

impl DiagnosisPage<'_> {
    /// Writes report.html into a folder.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), Failure> {
        let under = under_calibrations(self.diagnosis, self.datasets);
        super::write(&self.report(&under, self.out), folder)
    }

    fn report(&self, under: &UnderCalibrations, out: &Path) -> Report {
        let Diagnosis { document, residuals: found, alternatives, .. } = self.diagnosis;
        let extended = document.gain.is_some();
        let drift = drift::blocks(&under.drifts);
        let drift = Section { blocks: drift, ..Section::new("drift", "How far runs drift, before and after") };
        let drift = if document.findings.is_empty() || !extended {
            drift.text("These are the runs that were calibrated with: new runs drift a little more.")
        } else {
            drift.text(format!(
                "These are the runs that were calibrated with: new runs drift a little more. {}",
                gain_sentence(document)
            ))
        };
        let mut sections = vec![self.finding(), self.change(out)];
        sections.push(Section::new("path", "The path").with(under.path_block()));
        sections.push(drift);
        sections.push(
            Section::new("residuals", "What the errors go with")
                .text(residuals::HOW_TO_READ)
                .with(Block::Charts(residuals::charts_that_matter(found, extended))),
        );
        sections.push(details::alternatives(alternatives, document));
        sections.extend(details::carries_over(document));
        sections.push(next_drive::section(document));
        sections.push(details::limits(document));
        Report {
            command: "yair diagnose".to_owned(),
            subject: subject(self.datasets),
            tone: match document.verdict {
                Verdict::Consistent => Tone::Fine,
                Verdict::Named => Tone::Found,
                Verdict::Ambiguous | Verdict::Unlisted => Tone::Uncertain,
            },
            headline: headline(document),
            lead: lead(document),
            tiles: self.tiles(under),
            sections,
            appendix: details::appendix(document, found, extended),
            made_by: made_by(contents(self.datasets)),
        }
    }

    fn tiles(&self, under: &UnderCalibrations) -> Vec<Tile> {
        let document = &self.diagnosis.document;
        let tile = |label: &str, value: String, note: String, section: &str| Tile {
            label: label.to_owned(),
            value,
            note,
            section: section.to_owned(),
        };
        let mut tiles = Vec::new();
        match document.findings.first() {
            Some(first) => {
                let further = document.findings.len() - 1;
                let further =
                    if further > 0 { format!("; and {}", count(further, "further finding")) } else { String::new() };
                let confidence = format!("{:.0} % sure{further}", 100.0 * first.probability);
                tiles.push(tile("Cause", cause(first), confidence, "finding"));
                let size = size(first).map_or_else(
                    || {
                        tile(
                            "Size",
                            "Has no size".to_owned(),
                            format!("z = {:.1}: how far from an accident", first.z),
                            "finding",
                        )
                    },
                    |size| tile("Size", size, "± is one standard deviation".to_owned(), "finding"),
                );
                tiles.push(size);
                let (value, note) = gain_words(document);
                tiles.push(tile("Gain on runs it has not seen", value, note, "drift"));
            }
            None => {
                let n = document.checks.len();
                tiles.push(tile("Cause", "None found".to_owned(), format!("none of {n} checks fails"), "checks"));
                let percent = |at: usize| under.drifts.get(at).and_then(|(_, _, drift)| drift.drift_percent);
                let value = match (percent(0), percent(1)) {
                    (Some(nominal), Some(calibrated)) => format!("{nominal:.3} % → {calibrated:.3} %"),
                    _ => "Not measured".to_owned(),
                };
                tiles.push(tile(
                    "Drift, nominal → calibrated",
                    value,
                    "of the distance, on these runs".to_owned(),
                    "drift",
                ));
                let blind = document.blind_to.len();
                tiles.push(tile(
                    "Could not show",
                    count(blind, "cause"),
                    "these runs do not excite them".to_owned(),
                    "limits",
                ));
            }
        }
        tiles.push(next_drive::tile(document));
        tiles
    }

    fn finding(&self) -> Section {
        let document = &self.diagnosis.document;
        let mut section = Section::new("finding", "What is wrong");
        if document.findings.is_empty() {
            return section.text("Nothing was found. The calibrated model explains what was measured, as far as these runs can show; what they cannot show stands below.");
        }
        let mut table = Table::new("Findings, the strongest first", &["what", "cause", "it may also be", "how sure"]);
        for finding in &document.findings {
            let others = if finding.names.len() > 1 { named(&finding.names[1..]) } else { "–".to_owned() };
            table.row([
                Cell::text(capitalised(&meaning(finding))),
                Cell::id(finding.id.clone()),
                Cell::text(others),
                Cell::number(format!("{:.0} %", 100.0 * finding.probability)),
            ]);
        }
        section = section.with(Block::Table(table));
        for finding in &document.findings {
            if let Some(runs) = &finding.runs {
                section =
                    section.text(format!("{} concerns {}: {}.", finding.id, count(runs.len(), "run"), runs.join(", ")));
            }
        }
        if document.gain.as_ref().is_some_and(::diagnose::Gain::drifts_more) {
            section = section.with(Block::Warning("dead reckoning drifts more with the extended model on runs that it has not seen. Do not use it for odometry.".to_owned()));
        }
        section
    }

    fn change(&self, out: &Path) -> Section {
        let document = &self.diagnosis.document;
        let robot = self.datasets.first().map(|dataset| dataset.robot);
        let mut section = Section::new("change", "What to change");
        for method in &document.calibration.methods {
            if let Some(error) = &method.error {
                section = section.with(Block::Warning(format!("there are no parameters: {error}")));
                continue;
            }
            let nominal = |key: &str| nominal_value(robot.as_ref()?, key);
            section = section.with(parameters("Parameters, in SI units", &method.parameters, nominal));
            section = section.with(Block::Code("Parameters to copy".to_owned(), to_copy(&method.parameters)));
            let unknown =
                method.not_observable.iter().map(|of| format!("Not determined: {} – {}", of.parameter, of.why));
            let unknown: Vec<String> = unknown.collect();
            if !unknown.is_empty() {
                section = section.with(Block::List(unknown));
            }
        }
        if !document.findings.is_empty() && document.gain.is_some() {
            let mut sizes = Table::new(
                "Sizes of what was found",
                &["cause", "parameter", "value ± one standard deviation", "unit"],
            );
            for finding in &document.findings {
                for (name, value) in &finding.parameters {
                    let unit = if value.unit == "1" { "" } else { &value.unit };
                    let shown = Cell::number(plus_minus(value.value, value.sigma));
                    sizes.row([Cell::id(finding.id.clone()), Cell::id(name.clone()), shown, Cell::text(unit)]);
                }
            }
            section = section.with(Block::Table(sizes));
        }
        let Some(model) = &document.extended_model else {
            let why = document.extended_model_why_null.as_deref().unwrap_or("none was written");
            return section.text(format!("There is no extended model to be used by other commands: {why}."));
        };
        let data = self.given.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" ");
        let corrected = out.with_file_name("corrected");
        let (exported, about) = match &document.calibration_file {
            Some(geometry) => (
                format!("yair export ros2-yaml {geometry}\n"),
                "The first command writes the parameters for ROS 2 (other robots: yair export --help): the geometry that is best without the effects, which such parameters cannot express. The second writes odometry with the effects as a C header, the third the corrected poses of these runs; the fourth tells how far new runs drift.",
            ),
            None => (
                String::new(),
                "The records have a fault: mend it before parameters are copied. The first command writes odometry that undoes it as a C header, the second the corrected poses of these runs; the third tells how far new runs drift.",
            ),
        };
        let commands = format!(
            "{exported}yair export c {model} --out {}\nyair correct {data} --calibration {model} --out {}\nyair evaluate {data} --calibration {model}",
            out.with_file_name("odometry.h").display(),
            corrected.display()
        );
        section.text(about).with(Block::Code("Commands".to_owned(), commands))
    }
}

/// The answer in a sentence.
fn headline(document: &Document) -> String {
    let Some(first) = document.findings.first() else {
        return "Nothing is wrong with the odometry that these runs could show.".to_owned();
    };
    let or = match &first.names[..] {
        [_, others @ ..] if !others.is_empty() => format!(" It may also be {}.", named(others)),
        _ => String::new(),
    };
    format!("{}.{or}", capitalised(&meaning(first)))
}

/// What it means for odometry.
fn lead(document: &Document) -> String {
    let subsample =
        document.subsample.as_ref().map_or_else(String::new, |of| format!(" {}.", capitalised(&of.sentence)));
    format!("{}{subsample}", lead_of_findings(document))
}

fn lead_of_findings(document: &Document) -> String {
    if document.findings.is_empty() {
        let blind = document.blind_to.len();
        let unshown = if blind == 0 {
            "Every cause that these motions excite would have shown at a size that is large for a real robot."
                .to_owned()
        } else {
            format!("These runs could not show {} of the catalogue, listed below.", count(blind, "cause"))
        };
        return format!("The calibrated model explains what was measured. {unshown}");
    }
    gain_sentence(document)
}

/// What the extended model gains on runs that it has not seen.
fn gain_sentence(document: &Document) -> String {
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
        format!("On runs that it has not seen, correcting it removes {middle:.0} ± {half:.0} % of the drift (95 %).")
    } else if high < 0.0 {
        "On runs that it has not seen, correcting it makes the drift larger: use the plain calibration for odometry."
            .to_owned()
    } else {
        format!(
            "On runs that it has not seen, no change in the drift can be told: {}.",
            words::undecided(low_percent, high_percent)
        )
    }
}

fn drift_gain(document: &Document) -> Option<Compared> {
    document.gain.as_ref()?.drift_percent.filter(|drift| drift.base > 0.0)
}

/// The gain for the first screen: the answer, and what it rests on.
fn gain_words(document: &Document) -> (String, String) {
    let Some(Compared { base, extended, low, high }) = drift_gain(document) else {
        let why = document.gain_why_null.as_deref().unwrap_or("no pose says how far these runs drift");
        return ("Not known".to_owned(), why.to_owned());
    };
    let (middle, half) = (50.0 * (low + high) / base, 50.0 * (high - low) / base);
    let note = format!("drift {base:.3} % → {extended:.3} % of the distance; ± is 95 %");
    let share = format!("{middle:.0} ± {half:.0} % of the drift");
    if low > 0.0 {
        (format!("Removes {share}"), note)
    } else if high < 0.0 {
        (format!("Drifts more: {share}"), note)
    } else {
        let undecided = words::undecided(100.0 * low / base, 100.0 * high / base);
        ("No change can be told".to_owned(), capitalised(&undecided))
    }
}

/// What is wrong, without its size.
fn cause(finding: &Finding) -> String {
    let known = effects::description(&finding.id).map(|of| capitalised(of.meaning));
    known.unwrap_or_else(|| "Something that is in no catalogue".to_owned())
}

/// How large it is; `None` where nothing has a size.
fn size(finding: &Finding) -> Option<String> {
    let whole = meaning(finding);
    let cause = effects::description(&finding.id).map_or("", |of| of.meaning);
    let own = whole.strip_prefix(cause).map(|rest| rest.trim_start_matches([':', ',', ' ']));
    if let Some(own) = own.filter(|own| !own.is_empty() && !cause.is_empty()) {
        return Some(capitalised(own));
    }
    if let Some(term) = &finding.unlisted_term {
        return Some(plus_minus(term.coefficient, Some(term.sigma)));
    }
    let values = finding.parameters.iter().map(|(name, value)| {
        let unit = if value.unit == "1" { String::new() } else { format!(" {}", value.unit) };
        format!("{name} {}{unit}", plus_minus(value.value, value.sigma))
    });
    let values: Vec<String> = values.collect();
    (!values.is_empty()).then(|| values.join(", "))
}

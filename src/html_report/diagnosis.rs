//! The page of a diagnosis: what is wrong, what to change, what was driven, and what to drive next.

use std::path::Path;

use ::diagnose::{Diagnosis, ExtendedModel};
use calib::{AugmentedCalibration, nominal_value};
use dataset::Dataset;
use report_page::{Block, Cell, Report, Role, Section, Table};

use super::first_screen::{self, FirstScreen};
use super::words::{count, parameters, plus_minus, to_copy};
use super::{
    Under, UnderCalibrations, contents, diagnosis_details as details, drift, made_by, next_drive, residuals, subject,
};
use crate::diagnosis_page::words::{capitalised, in_words, meaning};
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
        super::write(&self.report(under, self.out), folder)
    }

    fn report(&self, mut under: UnderCalibrations, out: &Path) -> Report {
        let Diagnosis { document, residuals: found, alternatives, .. } = self.diagnosis;
        let first = FirstScreen::of(document, &under);
        let extended = document.gain.is_some();
        let drift = drift::blocks(&under.drifts);
        let drift = Section { blocks: drift, ..Section::new("drift", "How far runs drift, before and after") };
        let drift = if document.findings.is_empty() || !extended {
            drift.text("These are the runs that were calibrated with: new runs drift a little more.")
        } else {
            drift.text(format!(
                "These are the runs that were calibrated with: new runs drift a little more. {}",
                first_screen::gain_sentence(document)
            ))
        };
        let mut sections = vec![self.finding(), self.change(out)];
        let mut path = Section::new("path", "The path").with(under.path_block());
        path.blocks.extend(under.errors_block());
        sections.push(path);
        sections.push(drift);
        sections.push(under.driven_section());
        sections.push(
            Section::new("residuals", "What the errors depend on")
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
            tone: first.tone(),
            headline: first.headline(),
            lead: first.lead(),
            bars: first.bars(),
            tiles: first.tiles(),
            sections,
            appendix: details::appendix(document, found, extended),
            made_by: made_by(contents(self.datasets)),
        }
    }

    fn finding(&self) -> Section {
        let document = &self.diagnosis.document;
        let mut section = Section::new("finding", "What is wrong");
        if document.findings.is_empty() {
            return section.text("Nothing was found. The calibrated model explains what was measured, as far as these runs can show; what they cannot show is listed below.");
        }
        let mut table = Table::new("Findings, the strongest first", &["what", "cause", "it may also be", "how sure"]);
        for finding in &document.findings {
            let others = if finding.names.len() > 1 { in_words(&finding.names[1..]) } else { "–".to_owned() };
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
            section = section.with(Block::Warning(
                "dead reckoning drifts more with the extended model on held-out runs. Do not use it for odometry."
                    .to_owned(),
            ));
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
            section = section.with(parameters("Parameters", &method.parameters, nominal));
            section =
                section.with(Block::Code("Parameters to copy, in SI units".to_owned(), to_copy(&method.parameters)));
            let unknown =
                method.not_observable.iter().map(|of| format!("Not determined: {} – {}", of.parameter, of.why));
            let unknown: Vec<String> = unknown.collect();
            if !unknown.is_empty() {
                section = section.with(Block::List(unknown));
            }
        }
        if !document.findings.is_empty() && document.gain.is_some() {
            let mut sizes = Table::new(
                "Sizes of what was found, as the extended model has them",
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
                "The first command writes the parameters for ROS 2 (other robots: yair export --help): the geometry that is best without the effects, which such parameters cannot express. The second writes odometry with the effects as a C header, the third the corrected poses of these runs; the fourth measures how far new runs drift.",
            ),
            None => (
                String::new(),
                "The records have a fault: correct it before you copy parameters. The first command writes odometry that undoes it as a C header, the second the corrected poses of these runs; the third measures how far new runs drift.",
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

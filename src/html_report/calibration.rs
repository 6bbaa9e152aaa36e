//! The pages of a calibration, of an evaluation and of a comparison.

use std::path::Path;

use calib::methods::joint::Joint;
use calib::{AugmentedCalibration, CalibrationReport, Comparison, KindMean, Method, MethodReport, nominal_value};
use dataset::{Dataset, NominalRobot};
use report_page::{Block, Cell, Report, Role, Section, Table, Tile, Tone};

use super::words::{count, of_millimetres, parameters, plus_minus, to_copy};
use super::{Under, UnderCalibrations, contents, drift, made_by, paths::run_names, subject};
use crate::calibration_file::GivenCalibration;
use crate::terminal::Failure;

/// Roles of calibrations in the order in which they were given; there are no more colours than these.
const ROLES: [Role; 3] = [Role::Calibrated, Role::ExtendedModel, Role::Explained];

fn nominal<'c>() -> Under<'c> {
    Under { name: "nominal".to_owned(), role: Role::Nominal, calibration: None, model: None }
}

fn tile(label: &str, value: String, note: &str, section: &str) -> Tile {
    Tile { label: label.to_owned(), value, note: note.to_owned(), section: section.to_owned() }
}

/// The sections that all of these pages end with.
fn path_and_drift(under: &mut UnderCalibrations) -> [Section; 2] {
    let drift = Section { blocks: drift::blocks(&under.drifts), ..Section::new("drift", "How far runs drift") };
    let mut path = Section::new("path", "The path").with(under.path_block());
    path.blocks.extend(under.errors_block());
    [path, drift]
}

/// The page of a calibration.
pub(crate) struct CalibrationPage<'p> {
    pub(crate) report: &'p CalibrationReport,
    pub(crate) robot: &'p NominalRobot,
    pub(crate) datasets: &'p [Dataset],
}

impl CalibrationPage<'_> {
    /// Writes report.html.
    pub(crate) fn write(&self, out: &Path) -> Result<(), Failure> {
        let mut calibrations: Vec<AugmentedCalibration> =
            self.report.calibrations().into_iter().map(AugmentedCalibration::from).collect();
        // Of several methods the one of the first screen is drawn first.
        let first = self.first().map(|method| method.method.as_str());
        calibrations.sort_by_key(|of| Some(of.calibration.name.as_str()) != first);
        let mut all = vec![nominal()];
        for (calibration, role) in calibrations.iter().zip(ROLES) {
            let name = calibration.calibration.name.clone();
            all.push(Under { name, role, calibration: Some(calibration), model: None });
        }
        let mut under = UnderCalibrations::of(self.datasets, &all);
        let driven = under.driven_section();
        let mut page = self.page(&mut under);
        page.sections.push(driven);
        super::write(&page, out)
    }

    /// The method of the first screen: the default one, or else the first that gave something.
    fn first(&self) -> Option<&MethodReport> {
        let mut given = self.report.methods.iter().filter(|method| method.error.is_none());
        let default = given.clone().find(|method| method.method == Joint::DEFAULT.name());
        default.or_else(|| given.next())
    }

    fn page(&self, under: &mut UnderCalibrations) -> Report {
        let mut section = Section::new("parameters", "The robot's parameters");
        for method in &self.report.methods {
            section = self.method(section, method);
        }
        let key_of = |method: &&MethodReport, keys: &[&str]| {
            keys.iter().find_map(|key| Some(((*key).to_owned(), method.parameters.get(*key)?.clone())))
        };
        let first = self.first();
        let known = [
            ("Left wheel", &["left_wheel_diameter_m", "left_m_per_tick"][..]),
            ("Right wheel", &["right_wheel_diameter_m", "right_m_per_tick"]),
            ("Wheel separation", &["wheel_separation_m"]),
        ];
        let tiles: Vec<Tile> = known
            .iter()
            .filter_map(|(label, keys)| {
                let (key, value) = key_of(&first?, keys)?;
                let shown = value.value.map_or_else(
                    || "Not determined".to_owned(),
                    |found| format!("{} mm", plus_minus(1e3 * found, value.sigma.map(|sigma| 1e3 * sigma))),
                );
                let stated = nominal_value(self.robot, &key)
                    .map_or(String::new(), |stated| format!("nominal {} mm; ", 1e3 * stated));
                Some(tile(label, shown, &format!("{stated}± is one standard deviation"), "parameters"))
            })
            .collect();
        let used = first.map_or(0, |method| method.runs_used);
        let fine = first.is_some_and(|method| method.converged && method.warnings.is_empty());
        let mut sections = vec![section];
        sections.extend(path_and_drift(under));
        sections[2] =
            sections[2].clone().text("These are the runs that were calibrated with: new runs drift a little more.");
        Report {
            command: "yair calibrate".to_owned(),
            subject: subject(self.datasets),
            tone: if fine { Tone::Neutral } else { Tone::Uncertain },
            headline: format!("The robot's wheels and their separation, from {}.", count(used, "run")),
            lead: "What the odometry is to use in place of the nominal values, and how far it drifts with both."
                .to_owned(),
            bars: drift::bars(
                &under.drifts,
                "Drift on the runs that were calibrated with: new runs drift a little more.",
            ),
            tiles,
            sections,
            appendix: Vec::new(),
            made_by: made_by(contents(self.datasets)),
        }
    }

    fn method(&self, section: Section, method: &MethodReport) -> Section {
        let name = &method.method;
        if let Some(error) = &method.error {
            return section.with(Block::Warning(format!("{name} gives nothing: {error}")));
        }
        let caption = format!("By the method {name}");
        let mut section = section
            .with(parameters(&caption, &method.parameters, |key| nominal_value(self.robot, key)))
            .with(Block::Code(format!("Parameters to copy, in SI units ({name})"), to_copy(&method.parameters)));
        for warning in &method.warnings {
            section = section.with(Block::Warning(format!("{name}: {warning}")));
        }
        let rejected = method.runs_rejected.iter().map(|of| format!("Left out: run {}: {}", of.run, of.why));
        let unknown = method.not_observable.iter().map(|of| format!("Not determined: {}: {}", of.parameter, of.why));
        let notes: Vec<String> = rejected.chain(unknown).collect();
        if notes.is_empty() { section } else { section.with(Block::List(notes)) }
    }
}

/// The page of an evaluation.
pub(crate) struct EvaluationPage<'p> {
    pub(crate) calibrations: &'p [Option<GivenCalibration>],
    pub(crate) datasets: &'p [Dataset],
}

impl EvaluationPage<'_> {
    /// Writes report.html.
    pub(crate) fn write(&self, out: &Path) -> Result<(), Failure> {
        let given: Vec<&GivenCalibration> = self.calibrations.iter().flatten().collect();
        let mut all = vec![nominal()];
        // The last ones are what a user judges (as --max-drift does).
        let shown = &given[given.len().saturating_sub(ROLES.len())..];
        for (given, role) in shown.iter().zip(ROLES) {
            let calibration = given.calibration();
            let name = calibration.calibration.name.clone();
            all.push(Under { name, role, calibration: Some(calibration), model: given.model() });
        }
        let mut under = UnderCalibrations::of(self.datasets, &all);
        let driven = under.driven_section();
        let runs = run_names(self.datasets).len();
        let mut tiles = Vec::new();
        if let Some((name, _, last)) = under.drifts.last() {
            let millimetres = |length_m| format!("{} mm", of_millimetres(length_m));
            tiles.push(tile("Mean error at the end", millimetres(last.mean_final_position_m), name, "drift"));
            tiles.push(tile("Largest error anywhere", millimetres(last.max_position_m), name, "path"));
        }
        tiles.push(tile("Runs", runs.to_string(), "dead-reckoned from where they were first measured", "path"));
        let mut sections = path_and_drift(&mut under).to_vec();
        sections.push(driven);
        if shown.len() < given.len() {
            sections[0] = sections[0].clone().text(format!("Only the last {} calibrations are drawn.", shown.len()));
        }
        let page = Report {
            command: "yair evaluate".to_owned(),
            subject: subject(self.datasets),
            tone: Tone::Neutral,
            headline: format!("How far the odometry drifts on {}.", count(runs, "run")),
            lead: "Drift is how far from the measured position a run ends, as a share of the distance.".to_owned(),
            bars: drift::bars(&under.drifts, ""),
            tiles,
            sections,
            appendix: Vec::new(),
            made_by: made_by(contents(self.datasets)),
        };
        super::write(&page, out)
    }
}

/// What a session drives, in words; the comparison's own word for several kinds says little.
fn kind_of_path(kind: &str) -> &str {
    match kind {
        "mixed" => "several kinds of path",
        "free" => "free drives",
        other => other,
    }
}

/// Methods by their mean position error over all pairs, metres, with the number of these; the best first.
/// Those that refused a session that others took are behind those that refused none: an error over other
/// pairs is no smaller one.
fn standings(comparison: &Comparison) -> Vec<(f64, usize, &str)> {
    let of = |method: &calib::ComparedMethod| {
        let errors_m: Vec<f64> = method.pairs.iter().filter_map(|pair| pair.mean_final_position_m).collect();
        (!errors_m.is_empty()).then(|| errors_m.iter().sum::<f64>() / errors_m.len() as f64)
    };
    let mut all: Vec<(usize, f64, usize, &str)> = comparison
        .methods
        .iter()
        .filter_map(|method| {
            let pairs = method.pairs.iter().filter(|pair| pair.mean_final_position_m.is_some()).count();
            Some((method.refusals.len(), of(method)?, pairs, method.method.as_str()))
        })
        .collect();
    all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    all.into_iter().map(|(_, error_m, pairs, method)| (error_m, pairs, method)).collect()
}

/// Which calibration carries over, and what it is worth.
fn headline(standings: &[(f64, usize, &str)]) -> String {
    let nominal = standings.iter().find(|(_, _, method)| *method == "nominal");
    match (standings.first(), nominal) {
        (Some((_, _, "nominal")), _) => "No method beats the nominal values on other sessions.".to_owned(),
        (Some((best_m, _, method)), Some((nominal_m, ..))) => format!(
            "Calibrate with {method}: runs of other sessions then end {:.1} mm from the truth on average; with the nominal values it is {:.1} mm.",
            1e3 * best_m,
            1e3 * nominal_m
        ),
        (Some((best_m, _, method)), None) => {
            format!("{method} predicts other sessions best: their runs end {:.1} mm from the truth.", 1e3 * best_m)
        }
        (None, _) => "No session says how far another's calibration drifts on it.".to_owned(),
    }
}

/// The page of a comparison of methods across sessions.
pub(crate) fn write_comparison(comparison: &Comparison, datasets: &[Dataset], out: &Path) -> Result<(), Failure> {
    let mut table = Table::new(
        "Mean error at the ends of runs that the calibration was not fitted to",
        &["trained on", "method", "evaluated on", "position, mm", "heading, °", "pairs of sessions"],
    );
    for method in &comparison.methods {
        for KindMean { trained_on, evaluated_on, pairs, mean_final_position_m, mean_final_heading_rad, .. } in
            &method.kinds
        {
            table.row([
                Cell::text(trained_on.as_deref().map_or("nothing: stated values", kind_of_path)),
                Cell::id(method.method.clone()),
                Cell::text(kind_of_path(evaluated_on)),
                Cell::number(of_millimetres(*mean_final_position_m)),
                Cell::number(
                    mean_final_heading_rad.map_or_else(|| "–".to_owned(), |angle| format!("{:.3}", angle.to_degrees())),
                ),
                Cell::number(pairs.to_string()),
            ]);
        }
    }
    let mut tiles = vec![tile(
        "Sessions",
        comparison.sessions.len().to_string(),
        "each calibrated on, and tested on by all others",
        "table",
    )];
    let standings = standings(comparison);
    if let Some((position_m, pairs, method)) = standings.first() {
        let note = format!("{method}, mean over {} of sessions", count(*pairs, "pair"));
        tiles.push(tile("Smallest error on unseen sessions", format!("{:.2} mm", 1e3 * position_m), &note, "table"));
    }
    let nominal = standings.iter().find(|(_, _, method)| *method == "nominal");
    if let Some((position_m, ..)) = nominal {
        tiles.push(tile(
            "With the nominal values",
            format!("{:.2} mm", 1e3 * position_m),
            "what the robot states",
            "table",
        ));
    }
    // Three sessions are six pairs; of fewer, one session decides the order of methods whose errors are
    // close.
    let few = match standings.first() {
        Some((_, pairs, _)) if *pairs < 6 => " So few sessions do not rank methods whose errors are close.",
        _ => "",
    };
    let page = Report {
        command: "yair compare".to_owned(),
        subject: subject(datasets),
        tone: Tone::Neutral,
        headline: headline(&standings),
        lead: "Every method calibrates on each session and is tested on every other: how far, on average, runs end from the measured position. Lower is better.".to_owned() + few,
        bars: None,
        tiles,
        sections: vec![Section::new("table", "Errors by method and kind of path").with(Block::Table(table))],
        appendix: Vec::new(),
        made_by: made_by(contents(datasets)),
    };
    super::write(&page, out)
}

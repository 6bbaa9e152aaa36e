//! Drift of every run under several calibrations, as a picture.

use calib::CalibrationDrift;
use report_page::{Axis, Bar, Bars, Block, Cell, Chart, Mark, Role, Series, Table};

use super::words::of_millimetres;

type Drifts = [(String, Role, CalibrationDrift)];

/// Runs on the axis: more cannot be read, and their sums stand in the table.
const MAX_RUNS: usize = 400;

/// The title of bars.
pub(super) const BARS: &str = "Drift: position error at the end of a run, per cent of the distance driven";

/// The drifts as bars; `None` where there is none.
pub(super) fn bars(drifts: &Drifts, note: &str) -> Option<Bars> {
    let bar = |(name, role, drift): &(String, Role, CalibrationDrift)| {
        let percent = drift.drift_percent?;
        let name = if *role == Role::Nominal { "as configured" } else { name };
        Some(Bar {
            name: name.to_owned(),
            role: *role,
            value: percent,
            interval: None,
            text: format!("{percent:.3} %"),
        })
    };
    let bars: Vec<Bar> = drifts.iter().filter_map(bar).collect();
    (!bars.is_empty()).then(|| Bars { title: BARS.to_owned(), bars, note: note.to_owned() })
}

/// The picture of the runs' ends, and the sums.
pub(super) fn blocks(drifts: &Drifts) -> Vec<Block> {
    let mut blocks = vec![Block::Table(sums(drifts))];
    let Some((_, _, first)) = drifts.first() else { return Vec::new() };
    if first.runs.iter().all(|run| run.final_position_m.is_none()) {
        let why = first.why_null.as_deref().unwrap_or("nothing was measured");
        blocks.push(Block::Text(format!("No drift of runs is drawn: {why}.")));
        return blocks;
    }
    // Of one run the table says all.
    if first.runs.len() < 2 {
        return blocks;
    }
    let mut order: Vec<usize> =
        (0..first.runs.len()).filter(|run| first.runs[*run].final_position_m.is_some()).collect();
    let all = order.len();
    if all > MAX_RUNS {
        let end_m = |run: &usize| first.runs[*run].final_position_m.unwrap_or(0.0);
        order.sort_by(|a, b| end_m(b).total_cmp(&end_m(a)));
        order.truncate(MAX_RUNS);
        order.sort_unstable();
    }
    let name = |run: &usize| {
        let run = &first.runs[*run];
        run.dataset.as_ref().map_or_else(|| run.run.clone(), |dataset| format!("{dataset}/{}", run.run))
    };
    let series = |(name, role, drift): &(String, Role, CalibrationDrift)| Series {
        name: name.clone(),
        role: *role,
        mark: Mark::Points,
        values: order.iter().map(|run| Some(1e3 * drift.runs.get(*run)?.final_position_m?)).collect(),
        half_widths: Vec::new(),
    };
    let left_out = if all > order.len() {
        format!(" Drawn: the {} of {all} runs that drift most.", order.len())
    } else {
        String::new()
    };
    blocks.push(Block::Chart(Chart {
        title: title(drifts),
        caption: format!("How far from the measured position dead reckoning has a run end. Lower is better.{left_out}"),
        x: Axis::new("run", ""),
        y: Axis::new("position error at the end", "mm"),
        at: (0_u32..).map(f64::from).take(order.len()).collect(),
        names: order.iter().map(name).collect(),
        series: drifts.iter().map(series).collect(),
    }));
    blocks
}

/// The sums as the finding of the picture.
fn title(drifts: &Drifts) -> String {
    let percent = |(name, _, drift): &(String, Role, CalibrationDrift)| {
        drift.drift_percent.map(|percent| format!("{percent:.3} % {name}"))
    };
    let known: Vec<String> = drifts.iter().filter_map(percent).collect();
    if known.is_empty() {
        "Where runs end against the truth".to_owned()
    } else {
        format!("Drift on these runs, of the distance: {}", known.join(", "))
    }
}

fn sums(drifts: &Drifts) -> Table {
    let headings = [
        "odometry",
        "drift, % of the distance",
        "mean error at the end, mm",
        "largest at an end, mm",
        "largest anywhere, mm",
        "largest heading error, °",
    ];
    let mut table = Table::new("All runs together", &headings);
    for (name, _, drift) in drifts {
        let percent = drift.drift_percent.map_or_else(|| "–".to_owned(), |percent| format!("{percent:.3}"));
        let degrees =
            drift.max_heading_rad.map_or_else(|| "–".to_owned(), |angle| format!("{:.3}", angle.to_degrees()));
        table.row([
            Cell::text(name.clone()),
            Cell::number(percent),
            Cell::number(of_millimetres(drift.mean_final_position_m)),
            Cell::number(of_millimetres(drift.max_final_position_m)),
            Cell::number(of_millimetres(drift.max_position_m)),
            Cell::number(degrees),
        ]);
    }
    table
}

//! What was driven and recorded, session by session: the first question to any log.

use std::f64::consts::TAU;

use calib::RunPath;
use dataset::Dataset;
use report_page::{Block, Cell, Section, Table};

/// What one session drives, by the nominal robot, and how it was recorded.
#[derive(Default)]
pub(crate) struct Driven {
    name: String,
    runs: usize,
    duration_s: f64,
    length_m: f64,
    left_rad: f64,
    right_rad: f64,
    rows: Instants,
    poses: Instants,
}

/// Instants of one kind of record, over runs.
#[derive(Default)]
struct Instants {
    count: usize,
    steps_s: Vec<f64>,
}

impl Instants {
    fn add(&mut self, t_s: &[f64]) {
        self.count += t_s.len();
        self.steps_s.extend(t_s.windows(2).map(|pair| pair[1] - pair[0]));
    }

    /// Usual rate and longest gap, in words.
    fn words(mut self) -> [String; 3] {
        self.steps_s.sort_by(f64::total_cmp);
        let median_s = self.steps_s.get(self.steps_s.len() / 2).copied().filter(|step_s| *step_s > 0.0);
        let rate = median_s.map_or_else(|| "–".to_owned(), |step_s| format!("{} Hz", plain_digits(1.0 / step_s)));
        let gap = self.steps_s.last().map_or_else(|| "–".to_owned(), |step_s| format!("{} s", plain_digits(*step_s)));
        [self.count.to_string(), rate, gap]
    }
}

/// Three significant digits.
fn plain_digits(value: f64) -> String {
    format!("{value:.2e}").parse::<f64>().map_or_else(|_| value.to_string(), |short| short.to_string())
}

impl Driven {
    /// Of a session and its runs under the nominal robot.
    pub(crate) fn of(dataset: &Dataset, paths: &[Option<RunPath>]) -> Self {
        let name = dataset.provenance.name.clone().unwrap_or_else(|| "dataset".to_owned());
        let mut driven = Self { name, runs: dataset.runs.len(), ..Self::default() };
        for (run, path) in dataset.runs.iter().zip(paths) {
            let t_s = &run.odometry.t_s;
            driven.duration_s += t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first);
            driven.rows.add(t_s);
            let Some(path) = path else { continue };
            driven.poses.add(&path.measured_t_s);
            for pair in path.rows.windows(2) {
                driven.length_m += (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m);
                let turned_rad = kinematics::wrap_to_pi(pair[1].theta_rad - pair[0].theta_rad);
                *(if turned_rad > 0.0 { &mut driven.left_rad } else { &mut driven.right_rad }) += turned_rad.abs();
            }
        }
        driven
    }
}

/// The section: a row for each session, and their sum where there are several.
pub(super) fn section(driven: Vec<Driven>) -> Section {
    let headings = [
        "session",
        "runs",
        "time, min",
        "distance, m",
        "turns left",
        "turns right",
        "odometry rows",
        "rate",
        "longest gap",
        "measured poses",
        "rate",
        "longest gap",
    ];
    let mut table = Table::new("Distance and whole turns are those of the nominal robot", &headings);
    for session in driven {
        let cells = [
            session.runs.to_string(),
            format!("{:.1}", session.duration_s / 60.0),
            format!("{:.1}", session.length_m),
            format!("{:.1}", session.left_rad / TAU),
            format!("{:.1}", session.right_rad / TAU),
        ];
        let recorded = session.rows.words().into_iter().chain(session.poses.words());
        table.row(std::iter::once(Cell::text(session.name)).chain(cells.into_iter().chain(recorded).map(Cell::number)));
    }
    Section::new("data", "What was driven").with(Block::Table(table))
}

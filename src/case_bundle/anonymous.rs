//! A dataset without what says whose it is: names, notes, dates, where the map begins and when the clocks do.
//! Lengths, speeds, headings and the relation of the clocks stay: checks go by these.

use std::collections::BTreeMap;

use dataset::{Dataset, Provenance, Run, RunInfo, TruthSample};

/// Clocks that are further apart are not of one session, and any such distance is the same to a check
/// (`preflight` looks for ten minutes at most); what it was may be a date. One day, seconds.
const MAX_APART_S: f64 = 86_400.0;

/// Units that an instrument's times may be in, seconds a unit of the robot's.
const TIME_UNITS: [f64; 7] = [1.0, 1e3, 1e6, 1e9, 1e-3, 1e-6, 1e-9];

/// The sessions of one log. Robots with ids stay the same or different ones.
pub(super) fn anonymous(datasets: &[Dataset]) -> Vec<Dataset> {
    let mut robots = Names::new("robot");
    datasets.iter().enumerate().map(|(number, dataset)| session(dataset, number + 1, &mut robots)).collect()
}

/// Names by number, each name its own.
struct Names {
    kind: &'static str,
    known: BTreeMap<String, String>,
}

impl Names {
    const fn new(kind: &'static str) -> Self {
        Self { kind, known: BTreeMap::new() }
    }

    fn of(&mut self, name: &str) -> String {
        let next = format!("{}-{}", self.kind, self.known.len() + 1);
        self.known.entry(name.to_owned()).or_insert(next).clone()
    }
}

fn session(dataset: &Dataset, number: usize, robots: &mut Names) -> Dataset {
    let mut case = dataset.clone();
    case.provenance = Provenance {
        name: Some(format!("session-{number}")),
        robot_id: dataset.provenance.robot_id.as_deref().map(|id| robots.of(id)),
        ..Provenance::default()
    };
    let mut points = Names::new("point");
    case.points.iter_mut().for_each(|point| point.id = points.of(&point.id));
    let origins = Origins::of(dataset);
    let mut walls = Names::new("wall");
    for (position, run) in case.runs.iter_mut().enumerate() {
        let RunInfo { protocol, settings, start_s, continuous, .. } = run.info;
        let start_s = start_s.map(|start_s| earlier(start_s, origins.start_s));
        let id = format!("run-{:02}", position + 1);
        run.info = RunInfo { id, protocol, settings, start_s, continuous, covariates: BTreeMap::new() };
        run.walls.iter_mut().for_each(|reading| reading.wall = walls.of(&reading.wall));
        origins.take_off(run);
    }
    case
}

/// Where clocks and map of a session begin.
struct Origins {
    start_s: f64,
    robot_s: f64,
    gyro_s: f64,
    measured_s: f64,
    x_m: f64,
    y_m: f64,
}

impl Origins {
    fn of(dataset: &Dataset) -> Self {
        let runs = &dataset.runs;
        let first = |times: &mut dyn Iterator<Item = f64>| times.min_by(f64::total_cmp);
        let robot_s = first(&mut runs.iter().filter_map(|run| run.odometry.t_s.first().copied())).unwrap_or(0.0);
        let of_clock = |first_s: Option<f64>| first_s.map_or(robot_s, |first_s| clock_origin(first_s, robot_s));
        let places = || {
            let readings = runs.iter().flat_map(|run| &run.point_readings).map(|of| [of.room.x_m, of.room.y_m]);
            runs.iter().flat_map(|run| &run.truth).map(|of| [of.x_m, of.y_m]).chain(readings)
        };
        Self {
            start_s: first(&mut runs.iter().filter_map(|run| run.info.start_s)).unwrap_or(0.0),
            robot_s,
            gyro_s: of_clock(first(&mut runs.iter().filter_map(|run| run.gyro.first().map(|of| of.t_s)))),
            measured_s: of_clock(first(&mut runs.iter().filter_map(|run| run.measured_span_s().map(|span| span[0])))),
            x_m: middle(places().map(|of| of[0]).collect()),
            y_m: middle(places().map(|of| of[1]).collect()),
        }
    }

    fn take_off(&self, run: &mut Run) {
        run.odometry.t_s.iter_mut().for_each(|t_s| *t_s = earlier(*t_s, self.robot_s));
        run.gyro.iter_mut().for_each(|of| of.t_s = earlier(of.t_s, self.gyro_s));
        run.map_measurement_times(|t_s| *t_s = earlier(*t_s, self.measured_s));
        for of in &mut run.truth {
            *of = TruthSample::new(of.t_s, less(of.x_m, self.x_m), less(of.y_m, self.y_m), of.theta_rad());
        }
        for of in &mut run.point_readings {
            (of.room.x_m, of.room.y_m) = (less(of.room.x_m, self.x_m), less(of.room.y_m, self.y_m));
        }
    }
}

/// What to take off the instants of a clock whose first is `first_s`: as much as of the robot's, in the unit
/// of this one; or all but a day where they are further apart.
fn clock_origin(first_s: f64, robot_s: f64) -> f64 {
    let is_unit = |unit: f64| {
        let origin = unit * robot_s;
        let is_date = unit == 1.0 || origin.abs() > MAX_APART_S;
        is_date && (first_s - origin).abs() <= MAX_APART_S * unit.max(1.0)
    };
    let unit = TIME_UNITS.into_iter().find(|unit| is_unit(*unit));
    unit.map_or(first_s - MAX_APART_S.copysign(first_s - robot_s), |unit| unit * robot_s)
}

/// The median: one position that is far off moves it nowhere. 0 of no values.
fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A difference of places, with no more digits than its terms have: what a difference leaves behind them is
/// noise, and costs room.
fn less(value: f64, origin: f64) -> f64 {
    rounded_difference(value, origin, f64::ceil)
}

/// As [`less`], of instants: the finer power of ten, so that rows that differ stay different.
fn earlier(t_s: f64, origin_s: f64) -> f64 {
    rounded_difference(t_s, origin_s, f64::floor)
}

fn rounded_difference(value: f64, origin: f64, to_power: fn(f64) -> f64) -> f64 {
    let difference = value - origin;
    let last_place = value.abs().max(origin.abs()) * f64::EPSILON;
    let digits = -to_power(last_place.log10());
    if origin == 0.0 || !(0.0..=MAX_DIGITS).contains(&digits) {
        return difference;
    }
    format!("{difference:.*}", digits as usize).parse().unwrap_or(difference)
}

/// Digits behind the point of a number that is not 0 to every reader: a millionth of a hydrogen atom.
const MAX_DIGITS: f64 = 30.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_has_the_digits_of_its_terms_and_keeps_values_apart() {
        assert_eq!(less(1.75, 0.5), 1.25);
        assert_eq!(less(0.3, 0.1), 0.2);
        assert_eq!(less(0.0018, 0.0068), -0.005);
        assert_eq!(less(0.123, 0.0), 0.123);
        let epoch_s = 1.7e9_f64;
        let close: Vec<f64> =
            [epoch_s, epoch_s.next_up(), epoch_s.next_up().next_up()].map(|t_s| earlier(t_s, epoch_s)).into();
        assert!(close.is_sorted_by(|a, b| a < b), "{close:?}");
        assert!(close[1].to_string().len() < 11, "{close:?}");
        assert_eq!(less(1e300, 2.0), 1e300);
    }

    #[test]
    fn clocks_keep_their_relation_and_no_date() {
        let epoch_s = 1.75e9;
        let shifted = |first_s: f64, robot_s: f64| first_s - clock_origin(first_s, robot_s);
        assert_eq!(shifted(0.25, 0.0), 0.25);
        assert_eq!(shifted(epoch_s + 3.0, epoch_s), 3.0);
        // Nanoseconds of the same clock.
        assert_eq!(shifted(1e9 * epoch_s, epoch_s), 0.0);
        assert_eq!(shifted(epoch_s, 1e9 * epoch_s), 0.0);
        // One of both clocks has a date, and the other begins with the log.
        assert_eq!(shifted(epoch_s, 0.0), MAX_APART_S);
        assert_eq!(shifted(0.0, epoch_s), -MAX_APART_S);
        // To the last place of such a number, 256 ns.
        assert!((shifted(1e9 * epoch_s, 5.0) - MAX_APART_S).abs() <= 256.0);
    }

    #[test]
    fn names_are_numbers_and_the_same_name_is_the_same_number() {
        let mut names = Names::new("wall");
        assert_eq!(["north", "east", "north"].map(|name| names.of(name)), ["wall-1", "wall-2", "wall-1"]);
    }
}

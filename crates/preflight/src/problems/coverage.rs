//! What was driven: whether it is enough, goes both ways round, and determines the drive's parameters.
//!
//! The information of windows of displacement and turn about the logarithms of both wheels and of the
//! separation, with the windows' own residuals for noise; of runs seen at a few instants, by dead reckoning
//! with each parameter changed.

use std::collections::BTreeMap;

use dataset::{MIN_LIDAR_TURN_RAD, TruthSample};
use kinematics::{DriveGeometry, Pose, Rule, Wheels};

use crate::driven::Driven;
use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::run_log::{Part, RunLog};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::Measured;

pub(crate) const PARAMETERS: [&str; 3] = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];

/// Information about the logarithms of left, right and separation.
pub(crate) type Information = [[f64; 3]; 3];

pub(crate) fn found(check: &mut SessionCheck) {
    let turning = check.turning();
    let m_per_rad = check.m_per_rad();
    let distance_m = 0.5 * (turning.left * m_per_rad.left + turning.right * m_per_rad.right);
    let off = check.problems.iter().any(|problem| problem.severity == Severity::Error);
    if !off && distance_m < CHECKS.min_distance_m * check.robot.left_wheel_diameter_m.min(0.15) / 0.15 {
        check.problems.push(Problem::new(&Kind::TooShort { distance_m }, Severity::Warning, None, 0.9));
    }
    let mut driven = Driven::default();
    check.runs.iter().for_each(|run| driven.add(run, check.robot.wheel_separation_m, m_per_rad));
    let Driven { left_rad, right_rad, .. } = driven;
    let all_rad = left_rad + right_rad;
    if !off && all_rad > CHECKS.min_turning_rad && left_rad.max(right_rad) > CHECKS.one_way * all_rad {
        let kind = Kind::OneWayTurns { left: left_rad > right_rad };
        check.problems.push(Problem::new(&kind, Severity::Hint, None, 0.9));
    }
}

/// Partial measurements of runs that have displacements too.
pub(crate) fn unused(check: &mut SessionCheck) {
    let is_idle = |run: &&RunLog| !run.partial.is_empty() && !run.displacements.is_empty();
    let idle: Vec<&RunLog> = check.runs.iter().filter(is_idle).collect();
    if idle.is_empty() {
        return;
    }
    let gyro_alone = idle.iter().flat_map(|run| &run.partial).all(|row| row.part == Part::GyroTurn);
    // A bag's gyroscope comes along unasked; tables are made by somebody who counts on them.
    let severity = if gyro_alone { Severity::Hint } else { Severity::Warning };
    let runs = idle.iter().map(|run| run.id.clone()).collect();
    check.problems.push(Problem::new(&Kind::UnusedMeasurements { gyro_alone }, severity, Some(runs), 0.999));
}

/// What the sessions tell of the parameters together.
pub(crate) struct Coverage {
    pub(crate) information: Information,
    /// Does nothing but partial measurements see the robot?
    pub(crate) partial: bool,
    /// What was driven.
    driven: Driven,
}

impl Coverage {
    pub(crate) fn of(sessions: &[SessionCheck]) -> Self {
        let mut information = [[0.0; 3]; 3];
        let mut driven = Driven::default();
        for session in sessions {
            add(&mut information, session);
            session.runs.iter().for_each(|run| driven.add(run, session.robot.wheel_separation_m, session.m_per_rad()));
        }
        let partial = sessions.iter().flat_map(|session| &session.runs).all(RunLog::is_seen_in_part);
        Self { information, partial, driven }
    }
}

/// Which parameters an information determines.
pub(crate) fn are_determined(information: &Information, partial: bool) -> [bool; 3] {
    let mut sigma = sigmas(information);
    if partial && sigma[..2].iter().any(|sigma| *sigma >= CHECKS.determined_sigma) {
        // The wheels then stay as they are stated, and the separation is the one that goes with them.
        sigma[2] = (1.0 + information[2][2]).sqrt().recip();
    }
    sigma.map(|sigma| sigma < CHECKS.determined_sigma)
}

/// Which parameters the sessions determine together; what they do not is a problem.
pub(crate) fn determined(coverage: &Coverage, problems: &mut Vec<Problem>) -> BTreeMap<&'static str, bool> {
    let Coverage { information, partial, driven } = coverage;
    let determined: BTreeMap<&'static str, bool> =
        PARAMETERS.into_iter().zip(are_determined(information, *partial)).collect();
    let missing: Vec<&'static str> = PARAMETERS.into_iter().filter(|name| !determined[name]).collect();
    let is_wrong = problems.iter().any(|problem| problem.severity == Severity::Error);
    if !missing.is_empty() && !is_wrong {
        let why = if *partial {
            "the gyro, tapes, walls and returns leave it open; measure lengths (distance.csv), whole turns (revisit.csv) or headings (wall.csv), or state scale_sigma under [gyro]".to_owned()
        } else {
            format!("they {}; drive straights of some metres and turns both ways", driven.sentence())
        };
        let kind = Kind::NotDetermined { parameters: missing, why };
        problems.push(Problem::new(&kind, Severity::Warning, None, 0.95));
    }
    determined
}

/// Relative standard deviations, infinite along what nothing is known of.
fn sigmas(information: &Information) -> [f64; 3] {
    // A ridge of a standard deviation of 100 per cent each.
    let mut rows = [[0.0; 6]; 3];
    for (row, line) in rows.iter_mut().enumerate() {
        line[..3].copy_from_slice(&information[row]);
        line[row] += 1.0;
        line[3 + row] = 1.0;
    }
    for pivot in 0..3 {
        let scale = rows[pivot][pivot];
        rows[pivot].iter_mut().for_each(|value| *value /= scale);
        for row in (0..3).filter(|row| *row != pivot) {
            let factor = rows[row][pivot];
            let source = rows[pivot];
            rows[row].iter_mut().zip(source).for_each(|(value, of)| *value -= factor * of);
        }
    }
    [0, 1, 2].map(|row| rows[row][3 + row].sqrt())
}

/// Adds what a scalar of a gradient and a standard deviation tells.
pub(crate) fn add_row(information: &mut Information, gradient: [f64; 3], sigma: f64) {
    for (a, line) in information.iter_mut().enumerate() {
        for (b, cell) in line.iter_mut().enumerate() {
            *cell += gradient[a] * gradient[b] / (sigma * sigma);
        }
    }
}

/// How far the wheels' contacts go between two rows by the nominal robot, metres, and how far it turns by
/// them, radians.
pub(crate) fn travel(run: &RunLog, session: &SessionCheck, from: usize, to: usize) -> (Wheels<f64>, f64) {
    let turned = Wheels {
        left: run.wheels.left[to] - run.wheels.left[from],
        right: run.wheels.right[to] - run.wheels.right[from],
    };
    let travel_m = turned.zip_with(session.m_per_rad(), |rad, m| rad * m);
    (travel_m, (travel_m.right - travel_m.left) / session.robot.wheel_separation_m)
}

/// Gradients of a length and of a turn by the logarithms of the parameters.
pub(crate) fn gradients(travel_m: Wheels<f64>, turn_rad: f64, separation_m: f64) -> [[f64; 3]; 2] {
    [
        [0.5 * travel_m.left, 0.5 * travel_m.right, 0.0],
        [-travel_m.left / separation_m, travel_m.right / separation_m, -turn_rad],
    ]
}

fn add(information: &mut Information, session: &SessionCheck) {
    let mut row = |gradient: [f64; 3], sigma: f64| add_row(information, gradient, sigma);
    let m_per_rad = session.m_per_rad();
    let separation_m = session.robot.wheel_separation_m;
    if let Some(matched) = session.matched.as_ref().filter(|matched| matched.measured == Measured::Poses) {
        // Mean absolute residuals of displacement and turn, for noise of independent windows ten apart.
        let (mut left, mut whole_m, mut whole_rad) = ([0.0, 0.0], 0.0, 0.0);
        for pair in &matched.pairs {
            whole_m += pair.window.ahead_m.hypot(pair.window.left_m);
            whole_rad += pair.turned.map_or(0.0, |turned| turned.1.abs());
        }
        let count = matched.pairs.len() as f64;
        left[0] = matched.explained.unexplained[1] * whole_m / count;
        left[1] = matched.explained.unexplained[0] * whole_rad / count;
        // Not `max`, which takes a residual that is no number for the smallest.
        let sigma = left.map(|left| 1.25 * 10.0_f64.sqrt() * left.clamp(1e-6, f64::INFINITY));
        for pair in &matched.pairs {
            let travel_m = pair.moved.zip_with(m_per_rad, |rad, m| rad * m);
            row([0.5 * travel_m.left, 0.5 * travel_m.right, 0.0], sigma[0]);
            if let Some((turned, _)) = pair.turned {
                let travel_m = turned.zip_with(m_per_rad, |rad, m| rad * m);
                let turn_rad = (travel_m.right - travel_m.left) / separation_m;
                row([-travel_m.left / separation_m, travel_m.right / separation_m, -turn_rad], sigma[1]);
            }
        }
    }
    let Ok(geometry) = session.robot.geometry() else { return };
    for run in &session.runs {
        add_ends(run, &geometry, &mut row);
        add_partial(run, session, &mut row);
    }
}

/// What tapes, walls, returns and a gyroscope tell of a run. A gyroscope of unknown scale tells the ratio
/// of the wheels where the robot hardly turns, and nothing of how far it turns else.
fn add_partial(run: &RunLog, session: &SessionCheck, row: &mut impl FnMut([f64; 3], f64)) {
    // Where it hardly turns the yaw of a lidar is not known, nor how obliquely it drives at a wall.
    let shows_wall_lengths = !session.has_lidar || heading_range_rad(run, session) >= MIN_LIDAR_TURN_RAD;
    let at = |t_s: f64| run.t_s.partition_point(|row_s| *row_s <= t_s).saturating_sub(1);
    for of in &run.partial {
        let (from, to) = (at(of.from_s), at(of.to_s));
        let (travel_m, turn_rad) = travel(run, session, from, to);
        let [by_length, by_turn] = gradients(travel_m, turn_rad, session.robot.wheel_separation_m);
        match (of.part, session.gyro_scale_sigma) {
            (Part::Length, _) => row(by_length, of.sigma),
            (Part::WallLength, _) if shows_wall_lengths => row(by_length, of.sigma),
            (Part::WallLength, _) => {}
            (Part::Turn, _) => row(by_turn, of.sigma),
            (Part::GyroTurn, Some(scale)) => row(by_turn, of.sigma.hypot(scale * turn_rad)),
            (Part::GyroTurn, None) if turn_rad.abs() < CHECKS.max_straight_turn_rad => row(by_turn, of.sigma),
            (Part::GyroTurn, None) => {}
        }
    }
}

/// Range of a run's headings by the nominal robot, radians.
fn heading_range_rad(run: &RunLog, session: &SessionCheck) -> f64 {
    let headings_rad = (0..run.wheels.left.len()).map(|row| travel(run, session, 0, row).1);
    let (least, most) =
        headings_rad.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), rad| (least.min(rad), most.max(rad)));
    (most - least).max(0.0)
}

/// What a run's poses or positions tell, seen from the first.
fn add_ends(run: &RunLog, geometry: &DriveGeometry, row: &mut impl FnMut([f64; 3], f64)) {
    let Some((first, last)) = run.truth.first().zip(run.truth.last()) else { return };
    // Windows skip numbers that are not finite. Poses without a window determine nothing.
    let is_number = |sample: &TruthSample| {
        let parts = [sample.t_s, sample.x_m - first.x_m, sample.y_m - first.y_m, sample.theta_rad().unwrap_or(0.0)];
        parts.iter().map(|part| part * part).sum::<f64>().is_finite()
    };
    if !(last.t_s > first.t_s && run.truth.iter().all(is_number)) {
        return;
    }
    let count = CHECKS.instants.min(run.truth.len() - 1);
    let instants_s: Vec<f64> =
        (1..=count).map(|k| first.t_s + (last.t_s - first.t_s) * k as f64 / count as f64).collect();
    let path = |factors: [f64; 3]| {
        let m_per_rad = geometry.m_per_rad();
        let m_per_count = Wheels { left: factors[0] * m_per_rad.left, right: factors[1] * m_per_rad.right };
        let wheel_separation_m = factors[2] * geometry.wheel_separation_m();
        let reckoner = kinematics::Odometry { m_per_count, wheel_separation_m, rule: Rule::Midpoint };
        let columns = Wheels { left: &run.wheels.left[..], right: &run.wheels.right[..] };
        let mut poses = vec![Pose::IDENTITY; count];
        let mut times = run.t_s.iter();
        reckoner.for_each_pose(Pose::IDENTITY, columns, |pose| {
            let Some(t_s) = times.next() else { return };
            for (at, _) in poses.iter_mut().zip(&instants_s).filter(|(_, instant_s)| t_s <= *instant_s) {
                *at = pose;
            }
        });
        poses
    };
    let base = path([1.0; 3]);
    let step = 1e-4;
    let moved = [0, 1, 2].map(|parameter| {
        let mut factors = [1.0; 3];
        factors[parameter] += step;
        path(factors)
    });
    let has_headings = first.theta_rad().is_some() && last.theta_rad().is_some();
    for (at, base) in base.iter().enumerate() {
        let of = |value: fn(&Pose) -> f64| {
            let slope = |parameter: usize| (value(&moved[parameter][at]) - value(base)) / step;
            [slope(0), slope(1), slope(2)]
        };
        // Instruments read an end to some millimetres, and wheels err by some millimetres on the way.
        row(of(|pose| pose.x_m), 5e-3);
        row(of(|pose| pose.y_m), 5e-3);
        if has_headings {
            row(of(|pose| pose.theta_rad), 1e-2);
        }
    }
}

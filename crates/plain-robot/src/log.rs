//! What is logged of a drive: counts of the wheels, and poses from outside.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use crate::draws::Draws;
use crate::drive::{Path1kHz, Sample};
use crate::robot::{Event, PlainRobot, Records, Reports};
use crate::stamps::in_steps_of;

impl PlainRobot {
    pub(super) fn of_run(&self, number: usize) -> impl Iterator<Item = Event> {
        self.events.iter().filter(move |(run, _)| *run == number).map(|(_, event)| *event)
    }

    /// The millisecond at which the log begins.
    const fn first_step(&self) -> usize {
        if self.starts_moving { 1500 } else { 0 }
    }

    /// What the instrument sees of the robot.
    fn seen(&self, number: usize, t_s: f64, at: [f64; 3], jumped_at: &mut [f64; 3]) -> [f64; 3] {
        let mut seen = at;
        for event in self.of_run(number) {
            match event {
                Event::OtherMarker { at: [x_m, y_m, rad] } => {
                    let (sin, cos) = at[2].sin_cos();
                    seen = [at[0] + cos * x_m - sin * y_m, at[1] + sin * x_m + cos * y_m, at[2] + rad];
                }
                Event::FrameJump { at_s, by } if t_s >= at_s => {
                    if jumped_at.iter().all(|of| of.is_nan()) {
                        *jumped_at = at;
                    }
                    let (sin, cos) = by[2].sin_cos();
                    let (x_m, y_m) = (at[0] - jumped_at[0], at[1] - jumped_at[1]);
                    seen = [
                        jumped_at[0] + by[0] + cos * x_m - sin * y_m,
                        jumped_at[1] + by[1] + sin * x_m + cos * y_m,
                        at[2] + by[2],
                    ];
                }
                _ => {}
            }
        }
        seen
    }

    /// What the counters hold at each millisecond, radians of the wheels: they lose what comes in bursts.
    fn counted_rad(&self, path: &Path1kHz, draws: &mut Draws) -> Vec<[f64; 2]> {
        let mut lost_rad = [0.0; 2];
        let mut deaf_until_s = [0.0; 2];
        let mut last_rad = path.samples[0].wheels_rad;
        let of = |(step, sample): (usize, &Sample)| {
            for wheel in 0..2 {
                if draws.happens(self.bursts_per_s * 1e-3) {
                    deaf_until_s[wheel] = 1e-3 * step as f64 + self.burst_s;
                }
                if deaf_until_s[wheel] > 1e-3 * step as f64 {
                    lost_rad[wheel] += sample.wheels_rad[wheel] - last_rad[wheel];
                }
            }
            last_rad = sample.wheels_rad;
            [0, 1].map(|wheel| sample.wheels_rad[wheel] - lost_rad[wheel])
        };
        path.samples.iter().enumerate().map(of).collect()
    }

    pub(super) fn log_rows(
        &self,
        number: usize,
        id: &str,
        since_s: f64,
        path: &Path1kHz,
        odometry: &mut String,
        draws: &mut Draws,
    ) {
        let every = (1000.0 / self.odometry_hz).round() as usize;
        let offset = [draws.uniform(), draws.uniform()];
        let counted_rad = self.counted_rad(path, draws);
        let (mut last_s, mut last_counts, mut last_row) = (f64::NEG_INFINITY, None, None);
        let mut filtered_m_s = [0.0; 2];
        // How many rows of the packet are still to come.
        let mut waits_for = self.rows_per_packet;
        for step in (self.first_step()..path.samples.len()).step_by(every) {
            let is_lost = draws.uniform() < self.lost_rows;
            // Rows that are sent together have the stamp of the last of them.
            waits_for -= 1;
            let true_s = 1e-3 * (step + waits_for * every) as f64;
            if waits_for == 0 {
                let more = if self.more_rows_per_packet > 0 { draws.uniform() } else { 0.0 };
                waits_for = self.rows_per_packet + (more * (1 + self.more_rows_per_packet) as f64) as usize;
            }
            let true_s = true_s + self.clock_gain * (since_s + true_s);
            let stepped = self.of_run(number).filter_map(|event| match event {
                Event::ClockStep { at_s, by_s } if true_s >= at_s => Some(by_s),
                _ => None,
            });
            let true_s = true_s + stepped.sum::<f64>();
            let stamp_s = self.stamps.of(true_s, draws).max(last_s + 1e-4);
            let read_at = [step, (step + (1e3 * self.right_late_s).round() as usize).min(path.samples.len() - 1)];
            let counts = [0, 1]
                .map(|wheel| (counted_rad[read_at[wheel]][wheel] / TAU * self.ticks_per_rev + offset[wheel]).floor())
                .map(|count| self.first_count + count);
            let is_unchanged = self.logs_changes_alone && last_counts == Some(counts);
            // A row that is lost had the speed of its own time.
            let row = (1e-3 * step as f64, counts);
            let (last_row_s, last_row_counts) = last_row.replace(row).unwrap_or((row.0 - 1e-3 * every as f64, counts));
            let share =
                if self.speed_filter_s > 0.0 { 1.0 - (-1e-3 * every as f64 / self.speed_filter_s).exp() } else { 1.0 };
            let now_m_s = if self.has_rates_of_instants {
                let beside = [step.saturating_sub(1), (step + 1).min(path.samples.len() - 1)];
                let [last, next] = beside.map(|at| path.samples[at].wheels_rad);
                [0, 1].map(|wheel| 0.5e3 * 0.08 * self.scale * (next[wheel] - last[wheel]))
            } else {
                self.speeds_m_s(row.0, counts, last_row_s, last_row_counts)
            };
            filtered_m_s = [0, 1].map(|wheel| filtered_m_s[wheel] + share * (now_m_s[wheel] - filtered_m_s[wheel]));
            if self.knows_wheels {
                let [left, right] = path.samples[step].wheels_rad;
                writeln!(odometry, "{id},{:.6},{left},{right}", 1e-3 * step as f64).expect("text");
                continue;
            }
            let mut noisy_m_s = filtered_m_s;
            if self.speed_noise > 0.0 {
                noisy_m_s.iter_mut().for_each(|m_s| *m_s *= 1.0 + self.speed_noise * draws.normal());
            }
            let values = self.recorded(counts, noisy_m_s);
            if is_lost || is_unchanged {
                continue;
            }
            (last_s, last_counts) = (stamp_s, Some(counts));
            let [left, right] = values;
            writeln!(odometry, "{id},{stamp_s:.6},{left},{right}").expect("text");
        }
    }

    /// Speeds of the wheels by the times and counts of two rows.
    fn speeds_m_s(&self, t_s: f64, counts: [f64; 2], last_s: f64, last_counts: [f64; 2]) -> [f64; 2] {
        let m_per_count = 0.08 * self.scale * TAU / self.ticks_per_rev;
        [0, 1].map(|wheel| m_per_count * (counts[wheel] - last_counts[wheel]) / (t_s - last_s))
    }

    /// What a row says of its counts and of speeds of the wheels.
    fn recorded(&self, counts: [f64; 2], [left_m_s, right_m_s]: [f64; 2]) -> [f64; 2] {
        match self.records {
            Records::Counts => counts,
            Records::Angles { step_rad } => counts.map(|count| in_steps_of(step_rad, count / self.ticks_per_rev * TAU)),
            Records::Speeds { step_m_s } => [left_m_s, right_m_s].map(|speed| in_steps_of(step_m_s, speed)),
            Records::Twists { step_m_s, step_rad_s } => [
                in_steps_of(step_m_s, 0.5 * (left_m_s + right_m_s)),
                in_steps_of(step_rad_s, (right_m_s - left_m_s) / (0.363 * self.scale)),
            ],
        }
    }

    pub(super) fn log_truth(&self, number: usize, id: &str, path: &Path1kHz, truth: &mut String, draws: &mut Draws) {
        let every = (1000.0 / self.truth_hz).round() as usize;
        let between = (self.truth_between_rows * 1000.0 / self.odometry_hz).round() as usize;
        let rows = (1000.0 / self.odometry_hz).round() as usize;
        let last = path.samples.len() - 1;
        let steps: Vec<usize> = match self.reports {
            Reports::FirstAndLast => vec![0, last / rows * rows],
            _ => (self.first_step()..path.samples.len())
                .step_by(every)
                .map(|step| step + between)
                .filter(|s| *s <= last)
                .collect(),
        };
        let off_s = self.latency_s + self.late_run.filter(|(run, _)| *run == number).map_or(0.0, |(_, off_s)| off_s);
        let filtered = self.filtered(path);
        let mut jumped_at = [f64::NAN; 3];
        let mut correlated: Option<[f64; 3]> = None;
        let mut last_s = f64::NEG_INFINITY;
        for step in steps {
            let t_s = 1e-3 * step as f64;
            let is_paused = self.truth_pause_s.is_some_and(|[from_s, to_s]| (from_s..to_s).contains(&t_s));
            if is_paused || draws.happens(self.lost_poses) {
                continue;
            }
            let at = (step as f64 - 1000.0 * off_s).round().clamp(0.0, last as f64) as usize;
            let [x_m, y_m, theta_rad] = self.seen(number, t_s, filtered[at], &mut jumped_at);
            let far = 1.0 + self.truth_grows_per_m * x_m.hypot(y_m);
            let sigmas = [self.truth_sigma_m, self.truth_sigma_m, self.truth_sigma_rad].map(|sigma| sigma * far);
            let mut standard = || {
                if self.has_uniform_errors { 12_f64.sqrt() * (draws.uniform() - 0.5) } else { draws.normal() }
            };
            let new = [standard(), standard(), standard()];
            let keeps = if self.truth_tau_s > 0.0 { (-1.0 / self.truth_hz / self.truth_tau_s).exp() } else { 0.0 };
            let errors = match correlated {
                Some(old) => [0, 1, 2].map(|axis| keeps * old[axis] + (1.0 - keeps * keeps).sqrt() * new[axis]),
                None => new,
            };
            correlated = Some(errors);
            let mut seen = [x_m, y_m, theta_rad];
            for axis in 0..3 {
                seen[axis] += sigmas[axis] * errors[axis];
            }
            if draws.happens(self.outliers) {
                seen = [seen[0] + 0.1 * draws.normal(), seen[1] + 0.1 * draws.normal(), seen[2] + 0.1 * draws.normal()];
            }
            let [step_m, step_rad] = self.truth_steps;
            let [x_m, y_m, theta_rad] =
                [in_steps_of(step_m, seen[0]), in_steps_of(step_m, seen[1]), in_steps_of(step_rad, seen[2])];
            let theta_rad = if self.wraps { (theta_rad + PI).rem_euclid(TAU) - PI } else { theta_rad };
            let theta = if self.reports == Reports::Positions { String::new() } else { format!("{theta_rad:.9}") };
            for repeat in 0..self.truth_repeats {
                let sent_s = t_s + repeat as f64 / (self.truth_repeats as f64 * self.truth_hz);
                let stamp_s = self.truth_stamps.of(sent_s, draws).max(last_s + 1e-4);
                last_s = stamp_s;
                writeln!(truth, "{id},{stamp_s:.6},{x_m:.9},{y_m:.9},{theta}").expect("text");
            }
        }
    }

    /// Poses behind the instrument's filter of first order.
    fn filtered(&self, path: &Path1kHz) -> Vec<[f64; 3]> {
        let mut state = path.samples[0].at;
        let share = if self.truth_filter_s > 0.0 { 1.0 - (-1e-3 / self.truth_filter_s).exp() } else { 1.0 };
        let of = |sample: &Sample| {
            state.iter_mut().zip(sample.at).for_each(|(state, at)| *state += share * (at - *state));
            state
        };
        path.samples.iter().map(of).collect()
    }
}

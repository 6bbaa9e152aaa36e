//! The instants of all that was measured from outside, whatever the kind.

use crate::record::Run;
use crate::settings::MAX_ROW_S;

impl Run {
    /// Changes each instant of what was measured from outside. A gyroscope's are none of them: it rides on
    /// the robot.
    pub fn map_measurement_times(&mut self, mut map: impl FnMut(&mut f64)) {
        self.truth.iter_mut().for_each(|of| map(&mut of.t_s));
        self.headings.iter_mut().for_each(|of| map(&mut of.t_s));
        self.point_readings.iter_mut().for_each(|of| map(&mut of.t_s));
        self.wheel_reference.iter_mut().for_each(|of| map(&mut of.t_s));
        self.walls.iter_mut().for_each(|of| map(&mut of.t_s));
        self.displacements.iter_mut().flat_map(|of| [&mut of.t0_s, &mut of.t1_s]).for_each(&mut map);
        self.revisits.iter_mut().flat_map(|of| [&mut of.t0_s, &mut of.t1_s]).for_each(&mut map);
        self.distances.iter_mut().flat_map(|of| [&mut of.t0_s, &mut of.t1_s]).for_each(&mut map);
    }

    /// First and last instant of what was measured from outside, seconds from the run's start; `None` where
    /// nothing was.
    #[must_use]
    pub fn measured_span_s(&self) -> Option<[f64; 2]> {
        let at = self.truth.iter().map(|of| of.t_s).chain(self.headings.iter().map(|of| of.t_s));
        let at = at.chain(self.point_readings.iter().map(|of| of.t_s)).chain(self.walls.iter().map(|of| of.t_s));
        let at = at.chain(self.wheel_reference.iter().map(|of| of.t_s));
        let ends = self.displacements.iter().flat_map(|of| [of.t0_s, of.t1_s]);
        let ends = ends.chain(self.revisits.iter().flat_map(|of| [of.t0_s, of.t1_s]));
        let ends = ends.chain(self.distances.iter().flat_map(|of| [of.t0_s, of.t1_s]));
        let span = at.chain(ends).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], t_s| [a.min(t_s), b.max(t_s)]);
        (span[1] >= span[0]).then_some(span)
    }
}

/// From when to when something lasts, seconds; `None` where there is nothing.
type Span = Option<[f64; 2]>;

/// When the log of a run, or of a part of it, begins and ends, and when its measurements from outside do.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RunSpans {
    logged: Span,
    measured: Span,
    rows: usize,
    /// Is there an instrument that follows the robot? Tapes, walls and marks may be of a part of a run.
    is_followed: bool,
}

impl RunSpans {
    /// Of a run.
    #[must_use]
    pub fn of(run: &Run) -> Self {
        let t_s = &run.odometry.t_s;
        let is_followed = !(run.truth.is_empty()
            && run.displacements.is_empty()
            && run.point_readings.is_empty()
            && run.wheel_reference.is_empty());
        let logged = t_s.first().zip(t_s.last()).map(|(first, last)| [*first, *last]);
        Self { logged, measured: run.measured_span_s(), rows: t_s.len(), is_followed }
    }

    /// Of two parts of a run together.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self {
            logged: joined(self.logged, other.logged),
            measured: joined(self.measured, other.measured),
            rows: self.rows + other.rows,
            is_followed: self.is_followed || other.is_followed,
        }
    }

    /// The log's span and that of what was measured from outside, seconds, where both are meant to be of the
    /// same time. Where tapes, walls and marks alone lie within a log of plausible rows, it is `None`.
    #[must_use]
    pub fn comparable_s(&self) -> Option<[f64; 2]> {
        let ([first_s, last_s], [from_s, to_s]) = self.logged.zip(self.measured)?;
        let (logged_s, measured_s) = (last_s - first_s, to_s - from_s);
        let is_plausible = logged_s <= MAX_ROW_S * self.rows.saturating_sub(1) as f64;
        let is_within = from_s >= first_s - logged_s && to_s <= last_s + logged_s;
        let are_comparable = self.is_followed || !is_plausible || !is_within;
        (logged_s > 0.0 && measured_s > 0.0 && are_comparable).then_some([logged_s, measured_s])
    }
}

/// From the start of the earlier to the end of the later.
fn joined(a: Span, b: Span) -> Span {
    match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partial::{HeadingReading, Revisit, TapeDistance, WallReading};
    use crate::record::{Displacement, Odometry, TruthSample};

    #[test]
    fn each_kind_of_measurement_has_a_span_and_is_shifted() {
        let [t0_s, t1_s] = [1.0, 3.0];
        let wall = |t_s| WallReading {
            t_s,
            wall: "north".to_owned(),
            distance_m: Some(1.0),
            heading_rad: None,
            sigma_m: Some(0.01),
            sigma_rad: None,
        };
        let heading = |t_s| HeadingReading { t_s, theta_rad: 0.0, sigma_rad: 0.01 };
        let revisit = Revisit {
            t0_s,
            t1_s,
            dx_m: None,
            dy_m: None,
            dtheta_rad: Some(0.0),
            sigma_xy_m: None,
            sigma_theta_rad: Some(0.01),
        };
        let pose = |t_s| TruthSample::new(t_s, 0.0, 0.0, None);
        let displacement = Displacement { t0_s, t1_s, dx_m: 1.0, dy_m: 0.0, dtheta_rad: 0.0 };
        let each = [
            Run { truth: vec![pose(t0_s), pose(t1_s)], ..Run::default() },
            Run { headings: vec![heading(t1_s), heading(t0_s)], ..Run::default() },
            Run { walls: vec![wall(t0_s), wall(t1_s)], ..Run::default() },
            Run { displacements: vec![displacement], ..Run::default() },
            Run { revisits: vec![revisit], ..Run::default() },
            Run { distances: vec![TapeDistance { t0_s, t1_s, distance_m: 1.0, sigma_m: 0.01 }], ..Run::default() },
        ];
        for mut run in each {
            assert_eq!(run.measured_span_s(), Some([1.0, 3.0]), "{run:?}");
            run.map_measurement_times(|t_s| *t_s = 10.0 * *t_s + 1.0);
            assert_eq!(run.measured_span_s(), Some([11.0, 31.0]), "{run:?}");
        }
        assert_eq!(Run::default().measured_span_s(), None);
        assert_eq!(Run { truth: vec![pose(1.0)], ..Run::default() }.measured_span_s(), Some([1.0; 2]));
    }

    #[test]
    fn a_tape_over_a_part_of_a_run_is_no_clock_of_its_own() {
        let log =
            |row_s: f64| Odometry { t_s: (0..=2000).map(|k| row_s * f64::from(k)).collect(), ..Odometry::default() };
        let tape = |t1_s: f64| TapeDistance { t0_s: 0.0, t1_s, distance_m: 1.0, sigma_m: 0.01 };
        let spans = |row_s: f64, t1_s: f64| {
            RunSpans::of(&Run { odometry: log(row_s), distances: vec![tape(t1_s)], ..Run::default() }).comparable_s()
        };
        assert_eq!(spans(0.5, 1.0), None, "a second of a thousand");
        assert_eq!(spans(0.5, 1e6), Some([1000.0, 1e6]), "far beyond the log");
        assert_eq!(spans(500.0, 1000.0), Some([1e6, 1000.0]), "rows of eight minutes");
        let followed = Run {
            odometry: log(0.5),
            truth: vec![TruthSample::new(0.0, 0.0, 0.0, None), TruthSample::new(1.0, 0.0, 0.0, None)],
            ..Run::default()
        };
        let of = RunSpans::of(&followed);
        assert_eq!(of.comparable_s(), Some([1000.0, 1.0]), "poses follow all of it");
        let rest = RunSpans { logged: Some([1000.0, 3000.0]), measured: Some([1500.0, 2001.0]), rows: 2000, ..of };
        assert_eq!(of.with(rest).comparable_s(), Some([3000.0, 2001.0]), "both parts");
        let instant = Run { truth: vec![TruthSample::new(0.0, 0.0, 0.0, None)], ..followed };
        assert_eq!(RunSpans::of(&instant).comparable_s(), None, "one instant");
    }
}

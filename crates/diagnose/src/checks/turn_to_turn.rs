//! Whether the wheelbase differs from turn to turn by more than its estimate's errors.

use dataset::RunInfo;
use estimation::{Column, total};
use kinematics::Pose;
use model_term::{Interval, ModelTerm, TermParameter};

use crate::candidates::candidate::terms;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::statistics::p_of_differing_scores;
use crate::settings::residuals::TURNS_PER_RUN;
use crate::settings::{RESIDUALS, SEARCH};

/// p-value of a wheelbase that differs so much between turns, were it constant: each turn's score by a share
/// of its own, which the turn is larger by, with the score's variance.
///
/// What is drawn anew for each motion, as where on its patch a tyre touches, errs in proportion to the turn
/// and lasts as long. The noise of turns, which grows with their root, is fitted to it, and its increments
/// are independent within a turn where these are not. With u_t the score, what is fitted projected out, and
/// V_t its variance, Σ u_t² is larger than Σ V_t. Turns of a run beyond a number share the scores of the
/// first ones.
/// Reference: Chesher 1984 (the score test of a random coefficient).
pub(crate) fn differs_from_turn_to_turn(model: &AugmentedModel<'_>) -> f64 {
    let coarse = model.fit.decimated(&mut terms(&model.candidates), SEARCH.decimation_step_s);
    let fit = coarse.as_ref().unwrap_or(&model.fit);
    let mut all = terms(&model.candidates);
    all.push(Box::new(EachTurn::default()));
    let first = fit.solution.model.term_values.len();
    let columns = || (first..first + TURNS_PER_RUN).map(|turn| Column::Term(turn).index());
    let runs = fit.scan_parts(&mut all, &[1; TURNS_PER_RUN]);
    let Some(equations) = total(&runs) else { return 1.0 };
    let Some(projection) = fit.eliminated(&equations, &[]) else { return 1.0 };
    let turns = runs.iter().flat_map(|run| columns().map(move |column| (run, column)));
    let scores = turns.map(|(run, column)| {
        let projected = projection.of_columns(run, &[column]);
        (projected.gradient[0], projected.information[(0, 0)])
    });
    // A turn that was not driven, or not measured, has no score.
    p_of_differing_scores(scores.filter(|(_, variance)| *variance > 0.0))
}

/// A share of each turn of a run: by so much of itself the turn is larger than the counts say.
///
/// A turn is over where its rate falls to a tenth of its largest, and the next one begins where the rate is
/// twice that.
#[derive(Debug, Clone, Default)]
struct EachTurn {
    turns: usize,
    /// The largest rate of the turn; once it is over, what the next one begins at.
    largest_rad_s: f64,
    is_over: bool,
}

/// Plausible: a wheelbase is off by a tenth.
const SHARE: TermParameter = TermParameter { name: "share", unit: "1", prior_sigma: 0.1 };
const SHARES: [TermParameter; TURNS_PER_RUN] = [SHARE; TURNS_PER_RUN];

impl ModelTerm for EachTurn {
    fn parameters(&self) -> &[TermParameter] {
        &SHARES
    }

    fn restart(&mut self, _: &RunInfo) {
        *self = Self::default();
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let turn_rad = interval.smooth_increment().turn_rad;
        let rate_rad_s = if interval.dt_s > 0.0 { turn_rad.abs() / interval.dt_s } else { 0.0 };
        if self.is_over && rate_rad_s > RESIDUALS.turn_begins_at * self.largest_rad_s {
            (self.turns, self.largest_rad_s, self.is_over) = (self.turns + 1, rate_rad_s, false);
        }
        self.is_over = self.is_over || rate_rad_s < RESIDUALS.turn_ends_at * self.largest_rad_s;
        if !self.is_over {
            self.largest_rad_s = self.largest_rad_s.max(rate_rad_s);
        }
        gradient[self.turns % TURNS_PER_RUN] = Pose::new(0.0, 0.0, turn_rad);
    }
}

#[cfg(test)]
mod tests {
    use dataset::{Dataset, WheelLog};
    use kinematics::{Pose, Wheels};
    use model_term::Interval;

    use super::*;
    use crate::checks::run_to_run::differs_from_run_to_run;
    use crate::small_robot::{fitted, session};

    /// The number of the turn that each interval of 0.1 s belongs to, by the rates of an even turn, rad/s.
    fn turns(rates_rad_s: &[f64]) -> Vec<usize> {
        let mut term = EachTurn::default();
        let run = RunInfo::default();
        let turn = |(k, rate_rad_s): (usize, &f64)| {
            let speed_m_s = Wheels { left: -0.5 * rate_rad_s, right: 0.5 * rate_rad_s };
            let interval = Interval {
                t_s: 0.1 * k as f64,
                dt_s: 0.1,
                late_s: [0.0; 2],
                travel_m: speed_m_s.map(|speed_m_s| 0.1 * speed_m_s),
                speed_m_s,
                count_m: Wheels::both(0.0),
                speed_at_ends_m_s: [speed_m_s; 2],
                wheel_separation_m: 1.0,
                wheel_rad: Wheels::both(0.0),
                turned_rad: Wheels::both(0.0),
                world_from_body: Pose::IDENTITY,
                session_m: 0.0,
                run: &run,
            };
            let mut gradient = [Pose::IDENTITY; TURNS_PER_RUN];
            term.motion(&interval, &mut gradient);
            let own = gradient.iter().position(|pose| pose.theta_rad != 0.0).unwrap_or(term.turns % TURNS_PER_RUN);
            // The share is one of the turn: its derivative is the turn itself, of its sense.
            assert!((gradient[own].theta_rad - 0.1 * rate_rad_s).abs() < 1e-15);
            own
        };
        rates_rad_s.iter().enumerate().map(turn).collect()
    }

    #[test]
    fn a_turn_ends_where_the_robot_stands_or_turns_the_other_way_and_not_where_it_is_slower() {
        // Rejects a turn that ends at half of its rate, and one that goes on over a stop.
        assert_eq!(turns(&[0.5, 1.0, 0.4, 1.0, 0.0, 0.0, 0.6, 1.0]), [0, 0, 0, 0, 0, 0, 1, 1]);
        assert_eq!(turns(&[1.0, 0.5, -0.05, -0.5, -1.0]), [0, 0, 0, 1, 1]);
        // What trembles about a tenth of a turn's rate is no turn of its own.
        assert_eq!(turns(&[1.0, 0.09, 0.11, 0.09, 0.19, 0.21]), [0, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn turns_of_a_run_beyond_a_number_share_scores() {
        let rates: Vec<f64> = (0..2 * TURNS_PER_RUN + 2).flat_map(|_| [1.0, 0.0]).collect();
        let found = turns(&rates);
        assert_eq!(found[2 * (TURNS_PER_RUN - 1)], TURNS_PER_RUN - 1);
        assert_eq!(found[2 * TURNS_PER_RUN], 0);
    }

    /// A session whose robot turns by a share more in the first half of every run and as much less in the
    /// second, or the other way round, so that no run as a whole turns more than another.
    fn differing(share: f64) -> Dataset {
        let mut dataset = session(0, 0.0);
        for (number, run) in dataset.runs.iter_mut().enumerate() {
            let WheelLog::Angles(angles) = &mut run.odometry.wheels else { panic!("angles are logged") };
            let sense = if number < 4 { 1.0 } else { -1.0 };
            let recorded = angles.clone();
            let mut more_rad = 0.0;
            for row in 1..recorded.left.len() {
                let share = if row <= 100 { share } else { -share } * sense;
                let changed = recorded.as_ref().map(|of| of[row] - of[row - 1]);
                more_rad += 0.5 * share * (changed.right - changed.left);
                angles.left[row] = recorded.left[row] - more_rad;
                angles.right[row] = recorded.right[row] + more_rad;
            }
        }
        dataset
    }

    #[test]
    fn what_differs_from_turn_to_turn_shows_though_no_run_differs_from_another() {
        let p_values = |share: f64| {
            let datasets = [differing(share)];
            let base = fitted(&datasets);
            let model = AugmentedModel::base(&base);
            (differs_from_turn_to_turn(&model), differs_from_run_to_run(&model))
        };
        // Sixteen turns of 2.7 to 16 rad, measured to 0.6 mrad.
        let (by_turn, by_run) = p_values(0.0);
        assert!(by_turn > 0.01 && by_run > 0.01, "{by_turn} {by_run}");
        let (by_turn, by_run) = p_values(0.005);
        assert!(by_turn < 1e-7 && by_run > 1e-3, "{by_turn} {by_run}");
    }
}

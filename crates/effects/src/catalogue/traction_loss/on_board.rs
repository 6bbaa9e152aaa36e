//! The mean term of `traction_loss` in C; the same arithmetic as the estimation model's.

use crate::on_board::{Code, OnBoard};

/// `Term::slide` in C.
const SLIDE: &str = "\
/* Distance that a wheel loses in some time on a floor that pulls no harder than its grip. */
static inline double yair_slide(double *ground_m_s, double time_s, double speed_m_s, double acceleration_m_s2,
                                double grip_m_s2) {
    const double gap_m_s = speed_m_s - *ground_m_s, lag_s = 0.01 / grip_m_s2, steady_m_s = acceleration_m_s2 * lag_s;
    if (fabs(gap_m_s) <= 0.01 && fabs(steady_m_s) <= 0.01) {
        const double left = exp(-time_s / lag_s), more_m_s = gap_m_s - steady_m_s;
        *ground_m_s = speed_m_s + acceleration_m_s2 * time_s - steady_m_s - more_m_s * left;
        return steady_m_s * time_s + more_m_s * lag_s * (1.0 - left);
    }
    {
        const double steps = fmin(fmax(ceil(time_s / 2.5e-3), 1.0), 40.0), step_s = time_s / steps;
        double lost_m = 0.0, passed_s = 0.5 * step_s;
        while (passed_s < time_s) {
            const double now_m_s = speed_m_s + acceleration_m_s2 * passed_s, before_m_s = *ground_m_s;
            const double behind_m_s = now_m_s - before_m_s;
            const double friction = 0.85 + (1.0 - 0.85) * exp(-fabs(behind_m_s) / 0.05);
            const double gain_m_s = grip_m_s2 * friction * fmin(fmax(behind_m_s / 0.01, -1.0), 1.0) * step_s;
            *ground_m_s = fabs(gain_m_s) < fabs(behind_m_s) ? before_m_s + gain_m_s : now_m_s;
            lost_m += (now_m_s - 0.5 * (before_m_s + *ground_m_s)) * step_s;
            passed_s += step_s;
        }
        return lost_m;
    }
}
";

/// The mean term in C, for a robot's own odometry.
pub(super) const ON_BOARD: OnBoard = OnBoard::State {
    of: "the ground's speed under each wheel, and what was lost before the floor first gave way",
    lag: "half an interval: the tread's speed goes from the mean of the interval before to that of this one, where a fit has it at the rows from both sides",
    code: Code {
        remembers: &[
            ("left_ground_m_s", 0.0),
            ("right_ground_m_s", 0.0),
            ("left_held_m", 0.0),
            ("right_held_m", 0.0),
            ("yields", 0.0),
        ],
        functions: &[SLIDE],
        statements: "\
const double per_s2 = dt_s > 0.0 ? 1.0 / dt_s : 0.0;
double left_lost_m = yair_slide(&own->left_ground_m_s, dt_s, left_start_m_s,
                                (left_end_m_s - left_start_m_s) * per_s2, holds_m_s2);
double right_lost_m = yair_slide(&own->right_ground_m_s, dt_s, right_start_m_s,
                                 (right_end_m_s - right_start_m_s) * per_s2, holds_m_s2);
if (own->yields == 0.0) {
    left_lost_m += own->left_held_m;
    right_lost_m += own->right_held_m;
    if (fabs(left_end_m_s - own->left_ground_m_s) > 0.01 || fabs(right_end_m_s - own->right_ground_m_s) > 0.01) {
        own->yields = 1.0;
    } else {
        own->left_held_m = left_lost_m;
        own->right_held_m = right_lost_m;
        left_lost_m = 0.0;
        right_lost_m = 0.0;
    }
}
left_change_m -= sliding * left_lost_m;
right_change_m -= sliding * right_lost_m;",
    },
};

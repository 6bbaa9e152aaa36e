//! The covariance of the pose: noise of wheels and turns, and what effects without a mean scatter; the same
//! arithmetic as `on_board_covariance.rs`.

use super::blocks::Blocks;
use super::literal::exact;
use crate::robot::CalibratedRobot;

const COVARIANCE: &str = include_str!("covariance.h.in");
const TANGENT: &str = include_str!("tangent.h.in");
const READINGS: &str = include_str!("readings.h.in");

const STATE: &str = "    double covariance[3][3]; /* of x, y, theta since the start, by the noise of the wheels */\n";

const INIT: &str = "    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            s->covariance[i][j] = 0.0;
        }
    }
";

/// What scatters beside the noise of the wheels.
const SCATTER: &str = "    double left_var_m2 = 0.0, right_var_m2 = 0.0, turn_var_rad2 = 0.0;
    double left_reading_var_m2 = 0.0, right_reading_var_m2 = 0.0, separation_var_m2 = 0.0;
    int motion_begins = 0;
";

const MORE_STATE: &str = "    double accumulated[3][3]; /* the covariance without what is of this moment or motion */
    double by_separation[3];  /* derivative of the pose by the separation, in this motion */
    int has_started;
";

const MORE_INIT: &str = "    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            s->accumulated[i][j] = 0.0;
        }
        s->by_separation[i] = 0.0;
    }
    s->has_started = 0;
";

const BEFORE: &str = "        double *const g = s->by_separation;
        const double g_turned = g[2];
        /* Rounding of the first readings stays. */
        if (!s->has_started) {
            s->has_started = 1;
            yair_add_readings(p, s->theta_rad, left_reading_var_m2, right_reading_var_m2);
        }
        /* One draw of the separation a motion. */
        if (motion_begins) {
            yair_add_separation(p, g, separation_var_m2);
            g[0] = g[1] = g[2] = 0.0;
        }
        g[0] += (motion_begins ? 0.0 : f[0] * g_turned) - by_turn_x * turn_rad / b_m;
        g[1] += (motion_begins ? 0.0 : f[1] * g_turned) - by_turn_y * turn_rad / b_m;
        g[2] -= turn_rad / b_m;
";

const AFTER: &str = "        for (i = 0; i < 3; i++) {
            for (j = 0; j < 3; j++) {
                s->covariance[i][j] = p[i][j];
            }
        }
        yair_add_separation(s->covariance, g, separation_var_m2);
        yair_add_readings(s->covariance, s->theta_rad + turned_rad, left_reading_var_m2, right_reading_var_m2);
";

#[derive(Default)]
pub(super) struct Covariance {
    pub(super) constants: String,
    pub(super) functions: String,
    pub(super) state: String,
    pub(super) init: String,
    pub(super) step: String,
}

pub(super) fn of(robot: &CalibratedRobot, blocks: &Blocks) -> Covariance {
    let Some(noise) = robot.noise else { return Covariance::default() };
    let constants = format!(
        "/* Noise of each wheel's travel, m/sqrt(m), and of turns beyond it, rad/sqrt(rad). */\n\
         #define YAIR_WHEEL_SIGMA {}\n#define YAIR_TURN_SIGMA {}\n",
        exact(noise.wheel_sigma_m_per_sqrt_m),
        exact(noise.turn_sigma_rad_per_sqrt_rad)
    );
    let scatters = !blocks.scatter.is_empty();
    let with = |text: &'static str| if scatters { text } else { "" };
    let parts = [
        ("@LEFT_VAR@", with(" + left_var_m2")),
        ("@RIGHT_VAR@", with(" + right_var_m2")),
        ("@TURN_VAR@", with(" + turn_var_rad2")),
        ("@ACCUMULATED@", if scatters { "accumulated" } else { "covariance" }),
        ("@BEFORE@", with(BEFORE)),
        ("@AFTER@", with(AFTER)),
    ];
    let step = parts.iter().fold(COVARIANCE.to_owned(), |text, (name, part)| text.replace(name, part));
    Covariance {
        constants,
        functions: [TANGENT, with(READINGS)].concat(),
        state: [STATE, with(MORE_STATE)].concat(),
        init: [INIT, with(MORE_INIT)].concat(),
        step: [with(SCATTER), &blocks.scatter, &step].concat(),
    }
}

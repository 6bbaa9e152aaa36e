//! Speeds and stamps of the intervals before, for the effects that read them; the same arithmetic as
//! `causal.rs`.

use std::fmt::Write as _;

use super::literal::exact;
use crate::robot::CalibratedRobot;
use crate::settings::{LATENESS_KEPT, MAX_JITTER_SHARE, PERIOD_INTERVALS};

#[derive(Default)]
pub(super) struct Past {
    pub(super) state: String,
    pub(super) init: String,
    pub(super) step: String,
}

impl Past {
    pub(super) fn of(robot: &CalibratedRobot) -> Self {
        let uses =
            |name: &str| robot.effects.iter().any(|effect| effect.on_board.has_mean() && effect.on_board.uses(name));
        let mut past = Self::default();
        for side in ["left", "right"] {
            let [start, end] = ["start", "end"].map(|end| uses(&format!("{side}_{end}_m_s")));
            if !(start || end) {
                continue;
            }
            let _ = writeln!(past.state, "    double {side}_m_s; /* mean speed of the interval before */");
            let _ = writeln!(past.init, "    s->{side}_m_s = 0.0;");
            if start {
                let _ = writeln!(past.step, "    const double {side}_start_m_s = s->{side}_m_s;");
            }
            let _ =
                writeln!(past.step, "    const double {side}_end_m_s = dt_s > 0.0 ? {side}_m / dt_s : s->{side}_m_s;");
            let _ = writeln!(past.step, "    s->{side}_m_s = {side}_end_m_s;");
        }
        if uses("late_start_s") || uses("late_end_s") {
            past.state.push_str("    double intervals, period_s, late_s; /* of the stamps so far */\n");
            past.init.push_str("    s->intervals = s->period_s = s->late_s = 0.0;\n");
            let _ = write!(
                past.step,
                "    const double late_start_s = s->late_s;
    if (dt_s > 0.0 && (s->intervals == 0.0 || fabs(dt_s - s->period_s) <= {} * s->period_s)) {{
        s->intervals = fmin(s->intervals + 1.0, {});
        s->period_s += (dt_s - s->period_s) / s->intervals;
        s->late_s = {} * s->late_s + (dt_s - s->period_s);
    }}
    const double late_end_s = s->late_s;
",
                exact(MAX_JITTER_SHARE),
                exact(PERIOD_INTERVALS),
                exact(LATENESS_KEPT)
            );
        }
        past
    }
}

//! What the robot can be told beside its counts, for the effects that need it; the same arithmetic as
//! `causal.rs`. Flags say what is known, and no number that is none: compilers for controllers are often told
//! that there are no such numbers.

use std::fmt::Write as _;

use effects::Input;

use crate::comment::wrapped;
use crate::robot::CalibratedRobot;

const TYPES: &str = include_str!("inputs.h.in");
const WITHOUT: &str = include_str!("without_inputs.h.in");

pub(super) struct Inputs {
    used: Vec<Input>,
    pub(super) types: String,
    pub(super) state: String,
    pub(super) init: String,
    pub(super) step: String,
    pub(super) function: &'static str,
    pub(super) parameter: &'static str,
    pub(super) logged: &'static str,
    pub(super) without: &'static str,
}

/// Members of the state, their initial values, and statements.
const fn texts(input: Input) -> [&'static str; 3] {
    match input {
        Input::WheelAngles => [
            "    double left_wheel_rad, right_wheel_rad; /* once known */\n",
            "    s->left_wheel_rad = s->right_wheel_rad = 0.0;\n",
            "    double left_turned_rad = YAIR_RAD_PER_COUNT * (left_m / YAIR_LEFT_M_PER_COUNT);
    double right_turned_rad = YAIR_RAD_PER_COUNT * (right_m / YAIR_RIGHT_M_PER_COUNT);
    const double left_wheel_rad =
        inputs->known & YAIR_LEFT_WHEEL_ANGLE ? inputs->left_wheel_rad - left_turned_rad : s->left_wheel_rad;
    const double right_wheel_rad =
        inputs->known & YAIR_RIGHT_WHEEL_ANGLE ? inputs->right_wheel_rad - right_turned_rad : s->right_wheel_rad;
    s->left_wheel_rad = left_wheel_rad + left_turned_rad;
    s->right_wheel_rad = right_wheel_rad + right_turned_rad;
    left_turned_rad = s->known & YAIR_LEFT_WHEEL_ANGLE ? left_turned_rad : 0.0;
    right_turned_rad = s->known & YAIR_RIGHT_WHEEL_ANGLE ? right_turned_rad : 0.0;
",
        ],
        Input::RoomHeading => [
            "    double room_offset_rad; /* of the room's frame, once known */\n",
            "    s->room_offset_rad = 0.0;\n",
            "    if (inputs->known & YAIR_ROOM_HEADING) {
        s->room_offset_rad = inputs->room_heading_rad - (s->theta_rad + turn_rad);
    }
    const double room_heading_rad = s->theta_rad + s->room_offset_rad;
",
        ],
        Input::Payload => [
            "    double payload_kg; /* once known */\n",
            "    s->payload_kg = 0.0;\n",
            "    if (inputs->known & YAIR_PAYLOAD) {
        s->payload_kg = inputs->payload_kg;
    }
    const double payload_kg = s->payload_kg;
",
        ],
        Input::SessionTime => [
            "    double session_s; /* once known */\n",
            "    s->session_s = 0.0;\n",
            "    const double session_s = inputs->known & YAIR_SESSION_TIME ? inputs->session_s - dt_s : s->session_s;
    s->session_s = session_s + dt_s;
",
        ],
        Input::SessionDistance => [
            "    double session_m; /* once known */\n",
            "    s->session_m = 0.0;\n",
            "    const double session_m =
        inputs->known & YAIR_SESSION_DISTANCE ? inputs->session_m - fabs(distance_m) : s->session_m;
    s->session_m = session_m + fabs(distance_m);
",
        ],
    }
}

impl Inputs {
    pub(super) fn of(robot: &CalibratedRobot) -> Self {
        let needs = |input: &Input| robot.effects.iter().any(|effect| effect.on_board.input() == Some(*input));
        let used: Vec<Input> = Input::ALL.into_iter().filter(needs).collect();
        let mut inputs = Self {
            used,
            types: String::new(),
            state: String::new(),
            init: String::new(),
            step: String::new(),
            function: "yair_odometry_step",
            parameter: "",
            logged: "",
            without: "",
        };
        if inputs.used.is_empty() {
            return inputs;
        }
        let mut reasons = String::new();
        for input in &inputs.used {
            let of = robot.effects.iter().filter(|effect| effect.on_board.input() == Some(*input));
            let ids: Vec<&str> = of.map(|effect| effect.id).collect();
            reasons.push_str(&wrapped(" *", &format!("{} for {}", input.meaning(), ids.join(", "))));
        }
        inputs.types = TYPES.replace("@USED@", &format!("/*\n{reasons} */\n"));
        inputs.state.push_str("    unsigned known; /* inputs that were told */\n");
        inputs.init.push_str("    s->known = 0u;\n");
        inputs.step.push_str("    s->known |= inputs->known;\n");
        for input in &inputs.used {
            let [state, init, step] = texts(*input);
            for (to, text) in [(&mut inputs.state, state), (&mut inputs.init, init), (&mut inputs.step, step)] {
                let _ = write!(to, "{text}");
            }
        }
        inputs.function = "yair_odometry_step_with";
        inputs.parameter = ", const yair_inputs_t *inputs";
        inputs.logged = ", with what is told of them";
        inputs.without = WITHOUT;
        inputs
    }

    /// Whether they read how far a wheel turned.
    pub(super) fn needs_turns(&self) -> bool {
        self.used.contains(&Input::WheelAngles)
    }
}

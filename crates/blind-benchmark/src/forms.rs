//! Worlds that do an effect in another functional form than its hypothesis has: tanh for a line, a differential equation for an exponential.
//!
//! Each takes the scale of its effect alone; what else it needs (at which speed it saturates) comes with the robot. References: Pacejka 2012 for slip that
//! saturates; a castor's ψ' = −sin ψ/trail; Armstrong-Hélouvry et al. 1994 for round corners of friction.

use effects::{Forward, Hooks, RunStart, Step, Stream};
use kinematics::{Side, Wheels};

/// Effects that have another form here.
pub(crate) const OTHER_FORMS: [&str; 9] = [
    "slip_speed",
    "slip_acceleration",
    "turn_rate_wheelbase",
    "lateral_skid",
    "missed_counts",
    "backlash",
    "castor_kick",
    "thermal_drift",
    "wheel_eccentricity",
];

/// What a form needs to know of the robot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Around {
    pub(crate) speed_m_s: f64,
    pub(crate) acceleration_m_s2: f64,
    pub(crate) wheel_separation_m: f64,
}

/// The other form of an effect: `sizes` are those of its hypothesis, at which it does about as much.
pub(crate) fn other_form(id: &str, sizes: &[(&'static str, f64)], around: Around) -> Option<Box<dyn Forward>> {
    let of = |name: &str| sizes.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, size)| *size);
    let Around { speed_m_s, acceleration_m_s2, wheel_separation_m } = around;
    Some(match id {
        "slip_speed" => {
            let (lost, knee_m_s) = (of("slip_s_m"), 0.7 * speed_m_s);
            Floor::boxed(move |step| {
                let speed_m_s = step.contact_speed_m_s();
                let share = |v: f64| 1.0 - lost * knee_m_s * (v.abs() / knee_m_s).tanh();
                step.travel_m = step.travel_m.zip_with(speed_m_s, |travel_m, v| travel_m * share(v));
            })
        }
        "slip_acceleration" => {
            let (kappa_s, knee_m_s2) = (of("kappa_s"), 0.7 * acceleration_m_s2);
            Floor::boxed(move |step| {
                let acceleration = step.contact_acceleration_m_s2();
                let lost_m = |a: f64| kappa_s * knee_m_s2 * (a / knee_m_s2).tanh() * step.dt_s;
                step.travel_m = step.travel_m.zip_with(acceleration, |travel_m, a| travel_m - lost_m(a));
            })
        }
        "turn_rate_wheelbase" => {
            // The same at the yaw rate of a spin at cruise speed.
            let (beta_s, at_rad_s) = (of("beta_s"), 2.0 * speed_m_s / wheel_separation_m);
            Floor::boxed(move |step| {
                let (_, omega_rad_s) = twist(step);
                step.wheel_separation_m *= 1.0 + beta_s * omega_rad_s.powi(2) / at_rad_s;
            })
        }
        "lateral_skid" => {
            let (skid_s, knee_m_s2) = (of("skid_s"), 0.3);
            Floor::boxed(move |step| {
                let (v_m_s, omega_rad_s) = twist(step);
                let centripetal_m_s2 = v_m_s * omega_rad_s;
                step.lateral_m -= skid_s * centripetal_m_s2 / (1.0 + centripetal_m_s2.abs() / knee_m_s2) * step.dt_s;
            })
        }
        "missed_counts" => Box::new(RoundHinge {
            lost_share: Wheels { left: of("left_lost_share"), right: of("right_lost_share") },
            hinge_m_s: of("hinge_speed_m_s"),
            width_m_s: 0.1 * speed_m_s,
        }),
        "backlash" => Box::new(SpringyPlay {
            half_gap_m: Wheels { left: 0.5 * of("left_gap_m"), right: 0.5 * of("right_gap_m") },
            lead_m: Wheels::default(),
        }),
        "castor_kick" => Box::new(RollingCastor {
            gain: of("kick_rad") / std::f64::consts::PI,
            trail_m: 0.5 * of("decay_m"),
            psi_rad: 0.0,
        }),
        "thermal_drift" => Box::new(Warming { growth: of("growth"), tau_s: of("tau_s"), session_s: 0.0 }),
        "wheel_eccentricity" => {
            let amplitude = |side: &str| of(&format!("{side}_sin")).hypot(of(&format!("{side}_cos")));
            let phase = |side: &str| of(&format!("{side}_cos")).atan2(of(&format!("{side}_sin")));
            Box::new(FlatSpots {
                amplitude: Wheels { left: amplitude("left"), right: amplitude("right") },
                phase_rad: Wheels { left: phase("left"), right: phase("right") },
            })
        }
        _ => return None,
    })
}

/// Speed and yaw rate by the contacts.
fn twist(step: &Step) -> (f64, f64) {
    let Wheels { left, right } = step.contact_speed_m_s();
    (0.5 * (left + right), (right - left) / step.wheel_separation_m)
}

/// Acts on the floor without memory.
struct Floor<F>(F);

impl<F: Fn(&mut Step) + Send + 'static> Floor<F> {
    fn boxed(acts: F) -> Box<dyn Forward> {
        Box::new(Self(acts))
    }
}

impl<F: Fn(&mut Step) + Send> Forward for Floor<F> {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        (self.0)(step);
    }
}

/// Counts lost above a hinge that is round.
struct RoundHinge {
    lost_share: Wheels<f64>,
    hinge_m_s: f64,
    width_m_s: f64,
}

impl Forward for RoundHinge {
    fn hooks(&self) -> Hooks {
        Hooks { encoder: true, ..Hooks::NONE }
    }

    fn encoder(&mut self, step: &mut Step) {
        let speed_m_s = step.contact_speed_m_s();
        for side in Side::BOTH {
            let v = speed_m_s[side].abs();
            if v > 0.0 {
                let over_m_s = self.width_m_s * ((v - self.hinge_m_s) / self.width_m_s).exp().ln_1p();
                step.encoder_rad[side] *= 1.0 - self.lost_share[side] * over_m_s / v;
            }
        }
    }
}

/// Play with a spring in it: the lead goes to its limit over the width of the gap instead of at once.
struct SpringyPlay {
    half_gap_m: Wheels<f64>,
    lead_m: Wheels<f64>,
}

impl Forward for SpringyPlay {
    fn hooks(&self) -> Hooks {
        Hooks { start_run: true, wheel: true, ..Hooks::NONE }
    }

    fn start_run(&mut self, _stream: Stream) {
        self.lead_m = Wheels::default();
    }

    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let half_gap_m = self.half_gap_m[side];
            if half_gap_m <= 0.0 {
                continue;
            }
            let rolled_m = step.wheel_rad[side] * step.nominal_radius_m[side];
            let gained_m =
                (half_gap_m * rolled_m.signum() - self.lead_m[side]) * -(-rolled_m.abs() / half_gap_m).exp_m1();
            self.lead_m[side] += gained_m;
            step.wheel_rad[side] -= gained_m / step.nominal_radius_m[side];
        }
    }
}

/// A castor by its differential equation: it trails at 0, stands on its head at π, and turns the robot as it flips.
struct RollingCastor {
    /// Turn of the robot over the castor's.
    gain: f64,
    trail_m: f64,
    psi_rad: f64,
}

/// How far behind the axle the castor is, metres.
const CASTOR_BEHIND_M: f64 = 0.15;

impl Forward for RollingCastor {
    fn hooks(&self) -> Hooks {
        Hooks { start_run: true, floor: true, ..Hooks::NONE }
    }

    fn start_run(&mut self, _stream: Stream) {
        self.psi_rad = 0.0;
    }

    /// A turn of the robot leaves the castor's direction in the room where it was, and rolling takes it behind.
    fn floor(&mut self, step: &mut Step) {
        let way_m = 0.5 * (step.travel_m.left + step.travel_m.right);
        let turn_rad = (step.travel_m.right - step.travel_m.left) / step.wheel_separation_m;
        let before_rad = self.psi_rad;
        let aside_m = CASTOR_BEHIND_M * turn_rad;
        self.psi_rad -= turn_rad + (aside_m * before_rad.cos() + way_m * before_rad.sin()) / self.trail_m;
        // Only a flip drags the tail: rolling on behind the robot does not.
        if way_m * before_rad.cos() < 0.0 {
            step.extra_turn_rad += self.gain * (before_rad - self.psi_rad);
        }
    }
}

/// Wheels that warm up hyperbolically: t/(t + τ) for 1 − e^{−t/τ}.
struct Warming {
    growth: f64,
    tau_s: f64,
    session_s: f64,
}

impl Forward for Warming {
    fn hooks(&self) -> Hooks {
        Hooks { begin_run: true, wheel: true, ..Hooks::NONE }
    }

    fn begin_run(&mut self, run: &mut RunStart<'_>) {
        self.session_s = run.session_s;
    }

    fn wheel(&mut self, step: &mut Step) {
        let t_s = self.session_s + step.t_s;
        let factor = 1.0 + self.growth * t_s / (t_s + self.tau_s);
        step.radius_m = step.radius_m.map(|radius_m| radius_m * factor);
    }
}

/// A radius that rises and falls linearly with the wheel's angle: a triangle for a sine.
struct FlatSpots {
    amplitude: Wheels<f64>,
    phase_rad: Wheels<f64>,
}

impl Forward for FlatSpots {
    fn hooks(&self) -> Hooks {
        Hooks { wheel: true, ..Hooks::NONE }
    }

    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let angle_rad = step.wheel_angle_rad[side] + 0.5 * step.wheel_rad[side] + self.phase_rad[side];
            // asin(sin) is a triangle of height π/2, whose first harmonic has the amplitude 4/π.
            step.radius_m[side] *= 1.0 + self.amplitude[side] * angle_rad.sin().asin() * std::f64::consts::FRAC_PI_4;
        }
    }
}

//! The robot's words: nominal geometry, encoders, motors, controllers and the marks on its sides. Values
//! only.

use dataset::{MarkedPoint, NominalRobot};
use kinematics::{Point, Wheels};
use serde::{Deserialize, Serialize};

/// A differential-drive robot as it is specified, before any imperfection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Nominal diameter of the left wheel, metres.
    pub left_wheel_diameter_m: f64,
    /// Nominal diameter of the right wheel, metres.
    pub right_wheel_diameter_m: f64,
    /// Nominal distance between the wheel contacts, metres.
    pub wheel_separation_m: f64,
    /// Speed of a wheel's contact that motions are commanded with, m/s.
    pub cruise_speed_m_s: f64,
    /// Acceleration of a wheel's contact that motions are commanded with, m/s².
    pub acceleration_m_s2: f64,
    /// The incremental encoder on each motor's axis.
    pub encoder: Encoder,
    /// The HP HCTL-1100 motor controllers, one a wheel.
    pub controller: Controller,
    /// The DC motors with their gears, one a wheel.
    pub motor: Motor,
    /// Points marked on the robot.
    #[serde(default, rename = "point", skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Mark>,
}

impl Robot {
    /// What the robot believes of itself when a tick is one decoded count.
    #[must_use]
    pub fn nominal(&self) -> NominalRobot {
        NominalRobot {
            left_wheel_diameter_m: self.left_wheel_diameter_m,
            right_wheel_diameter_m: self.right_wheel_diameter_m,
            wheel_separation_m: self.wheel_separation_m,
            ticks_per_rev: Some(self.encoder.counts_per_wheel_turn()),
            counter_bits: None,
        }
    }

    /// Nominal diameters of both wheels, metres.
    #[must_use]
    pub const fn wheel_diameter_m(&self) -> Wheels<f64> {
        Wheels { left: self.left_wheel_diameter_m, right: self.right_wheel_diameter_m }
    }

    /// The marked points in the dataset's form.
    #[must_use]
    pub fn marked_points(&self) -> Vec<MarkedPoint> {
        self.points
            .iter()
            .map(|mark| MarkedPoint { id: mark.id.clone(), body: Point::new(mark.x_m, mark.y_m) })
            .collect()
    }
}

/// A quadrature encoder on the motor's axis, ahead of the gear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// Lines of the disc: periods of each channel a motor turn.
    pub lines_per_rev: f64,
    /// Motor turns for one wheel turn.
    pub gear_ratio: f64,
    /// Largest departure of a quadrature state's width from its nominal quarter period, as a share of it (0 =
    /// perfect).
    pub state_width_error: f64,
}

/// The HCTL-1100 counts every edge of both channels.
pub const QUADRATURE_DECODING: f64 = 4.0;

impl Encoder {
    /// Decoded counts for one turn of the wheel.
    #[must_use]
    pub fn counts_per_wheel_turn(&self) -> f64 {
        QUADRATURE_DECODING * self.lines_per_rev * self.gear_ratio
    }
}

/// Which of the chip's control modes drives the motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlMode {
    /// Trapezoidal profile to a final position; 7-bit maximum velocity.
    Trapezoidal,
    /// Integral velocity: 8-bit velocity, 16-bit acceleration (8.8), no steady velocity error.
    IntegralVelocity,
    /// Proportional velocity: 16-bit velocity (12.4), a velocity error that friction leaves.
    ProportionalVelocity,
}

/// Registers and clock of the two HCTL-1100.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Controller {
    /// Clock of the chips, hertz (100 kHz to 2 MHz).
    pub clock_hz: f64,
    /// Sample timer, register R0F: the sample time is 16 (R0F+1)/clock.
    pub sample_timer: u8,
    /// Which mode drives the motions.
    pub mode: ControlMode,
    /// Digital filter gain K, register R22.
    pub gain: u8,
    /// Digital filter zero A, register R20.
    pub zero: u8,
    /// Digital filter pole B, register R21.
    pub pole: u8,
    /// How much later than the left chip the right one samples, seconds, less than the sample time: they
    /// share no synchronisation.
    pub right_phase_s: f64,
}

/// A DC motor with its gear, all mechanical values at the motor's axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Supply voltage at full PWM, volts.
    pub supply_v: f64,
    /// Armature resistance, ohm. The inductance is neglected: its time constant is far under a sample.
    pub resistance_ohm: f64,
    /// Torque constant, N·m/A, equal to the back-EMF constant, V·s/rad.
    pub torque_constant_nm_a: f64,
    /// Inertia of rotor, gear and the robot's share, kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous friction, N·m·s/rad.
    pub viscous_friction_nm_s: f64,
    /// Coulomb friction, N·m.
    pub coulomb_friction_nm: f64,
}

/// A point marked on the robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mark {
    /// Id in `points.csv`.
    pub id: String,
    /// Ahead of the axle, metres.
    pub x_m: f64,
    /// To the left of the centre, metres.
    pub y_m: f64,
}

//! One HP HCTL-1100 motion controller: registers, profile generators and lead filter, once a sample time t =
//! 16 (R0F + 1)/f_clk.
//!
//! Position loop, X = command − actual position (equation 2 of the datasheet; D(z) = K (z − A/256) / 4 (z +
//! B/256)): MC(n) = K/4 X(n) − [A/256 K/4 X(n−1) + B/256 MC(n−1)]. Proportional velocity: MC = K/4 (command −
//! actual velocity), no memory. Trapezoidal and integral velocity modes move the command position of that
//! loop. All numbers are the chip's: 24-bit two's complement positions (24.8 inside the generators), integer
//! or 12.4 velocities in counts/sample, 8.8 accelerations in counts/sample².
//!
//! The datasheet does not say, so it is modelled: fractions of MC are cut toward zero; MC saturates at its 8
//! bits and this value is MC(n−1); the PWM is full on beyond ±100; the trapezoid is the fastest that its
//! integers can end exactly on the final position.
//! Source: HP (Agilent, Avago) HCTL-1100 datasheet: Digital Filter, Sample Timer, Motor Command registers and
//! the four control modes.

use scenario::{ControlMode, Controller};

use crate::servo_error::ServoError;

/// Clock range, hertz (datasheet, front page).
pub(crate) const CLOCK_MIN_HZ: f64 = 100e3;
/// See [`CLOCK_MIN_HZ`].
pub(crate) const CLOCK_MAX_HZ: f64 = 2e6;
/// Clock periods for each step of the sample timer (datasheet, equation 4).
const CLOCKS_PER_TIMER_STEP: f64 = 16.0;
/// Largest velocity of trapezoidal and integral velocity mode, counts/sample: 7 bits, and 8 bits with a sign.
pub(crate) const WHOLE_VELOCITY_MAX: u8 = 127;
/// Largest velocity of proportional velocity mode, 1/16 count/sample: 16 bits, 12.4.
pub(crate) const FINE_VELOCITY_MAX_Q4: i16 = i16::MAX;
/// Largest acceleration, 1/256 count/sample²: 8.8 whose integer part ends at 7FH.
pub(crate) const ACCELERATION_MAX_Q8: u16 = 0x7FFF;
/// PWM motor command that is full on (datasheet, PWM motor command register R09H).
const PWM_FULL: i16 = 100;
/// Shortfall, in steps of a register, that unit conversions may leave below a whole step without losing it to
/// truncation.
const LATTICE_ROUNDING: f64 = 1e-6;

/// What the chip sends to the amplifier: the 8-bit motor command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct MotorCommand(i8);

impl MotorCommand {
    /// The motor command register's value, −128..=127.
    #[must_use]
    pub(crate) const fn register(self) -> i8 {
        self.0
    }

    /// Duty cycle of the PWM port with its sign, −1..=1: 1 % a step, full on beyond ±100.
    #[must_use]
    pub(crate) fn duty(self) -> f64 {
        f64::from(i16::from(self.0).clamp(-PWM_FULL, PWM_FULL)) / f64::from(PWM_FULL)
    }
}

/// Which algorithm runs, with the registers that only it reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Algorithm {
    Position,
    Trapezoid { remaining_q8: i64, backward: bool, velocity_q8: i64, max_velocity_q8: i64, acceleration_q8: i64 },
    IntegralVelocity { velocity_q8: i32, command_q8: i32, acceleration_q8: i32 },
    ProportionalVelocity { command_q4: i16 },
}

/// The chip's state between samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hctl1100 {
    mode: ControlMode,
    sample_period_s: f64,
    gain: i64,
    zero: i64,
    pole: i64,
    algorithm: Algorithm,
    actual_position: i32,
    /// Command position in 24.8: the registers R0C–R0E are its upper 24 bits, so it wraps where they do.
    command_q8: i32,
    last_error: i64,
    last_motor: MotorCommand,
}

/// The lowest 24 bits as two's complement.
#[must_use]
pub(crate) const fn wrap_24(counts: i64) -> i32 {
    ((counts as i32) << 8) >> 8
}

impl Hctl1100 {
    /// A chip that holds position 0.
    ///
    /// # Errors
    /// When the clock or the sample timer is out of the datasheet's range for the mode, or the gain is zero.
    pub(crate) fn new(controller: &Controller) -> Result<Self, ServoError> {
        let Controller { clock_hz, sample_timer, mode, gain, zero, pole, .. } = *controller;
        if !(CLOCK_MIN_HZ..=CLOCK_MAX_HZ).contains(&clock_hz) {
            return Err(ServoError::OutOfRange { quantity: "clock_hz", value: clock_hz, expected: "in 100e3..=2e6" });
        }
        let minimum = sample_timer_minimum(mode);
        if sample_timer < minimum {
            return Err(ServoError::SampleTimer { sample_timer, minimum, mode });
        }
        ServoError::unless_positive("gain", f64::from(gain))?;
        Ok(Self {
            mode,
            sample_period_s: CLOCKS_PER_TIMER_STEP * (f64::from(sample_timer) + 1.0) / clock_hz,
            gain: i64::from(gain),
            zero: i64::from(zero),
            pole: i64::from(pole),
            algorithm: Algorithm::Position,
            actual_position: 0,
            command_q8: 0,
            last_error: 0,
            last_motor: MotorCommand::default(),
        })
    }

    /// Time between samples, seconds.
    #[must_use]
    pub(crate) const fn sample_period_s(&self) -> f64 {
        self.sample_period_s
    }

    /// The mode that motions are driven in.
    #[must_use]
    pub(crate) const fn mode(&self) -> ControlMode {
        self.mode
    }

    /// Actual position at the last sample, 24-bit (R12–R14).
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn actual_position(&self) -> i32 {
        self.actual_position
    }

    /// Command position, 24-bit (R0C–R0E).
    #[must_use]
    pub(crate) const fn command_position(&self) -> i32 {
        self.command_q8 >> 8
    }

    /// Whether a mode other than position control runs. In trapezoidal mode this is flag F0: it falls with
    /// the last command position that the generator sends, not when the motor stands.
    #[must_use]
    pub(crate) const fn profile_flag(&self) -> bool {
        !matches!(self.algorithm, Algorithm::Position)
    }

    /// Position control: hold a command position.
    pub(crate) fn position_control(&mut self, command_position: i32) {
        self.command_q8 = command_position << 8;
        self.algorithm = Algorithm::Position;
    }

    /// Trapezoidal profile from the present command position to a final one, by the shorter way round the 24
    /// bits.
    pub(crate) fn trapezoid(&mut self, final_position: i32, max_velocity: u8, acceleration_q8: u16) {
        let distance = wrap_24(i64::from(final_position) - i64::from(self.command_position()));
        self.command_q8 = self.command_position() << 8;
        if distance == 0 {
            return self.position_control(final_position);
        }
        self.algorithm = Algorithm::Trapezoid {
            remaining_q8: i64::from(distance.unsigned_abs()) << 8,
            backward: distance < 0,
            velocity_q8: 0,
            max_velocity_q8: i64::from(max_velocity.clamp(1, WHOLE_VELOCITY_MAX)) << 8,
            acceleration_q8: i64::from(acceleration_q8.clamp(1, ACCELERATION_MAX_Q8)),
        };
    }

    /// Integral velocity: approach a velocity in counts/sample at an acceleration, from the velocity that
    /// this mode has now.
    pub(crate) fn integral_velocity(&mut self, command: i8, acceleration_q8: u16) {
        let velocity_q8 =
            if let Algorithm::IntegralVelocity { velocity_q8, .. } = self.algorithm { velocity_q8 } else { 0 };
        self.algorithm = Algorithm::IntegralVelocity {
            velocity_q8,
            command_q8: i32::from(command) << 8,
            acceleration_q8: i32::from(acceleration_q8.clamp(1, ACCELERATION_MAX_Q8)),
        };
    }

    /// Proportional velocity: a velocity in 1/16 count/sample, taken up at once.
    pub(crate) fn proportional_velocity(&mut self, command_q4: i16) {
        self.algorithm = Algorithm::ProportionalVelocity { command_q4 };
    }

    /// One sample: takes the increments decoded since the last one and computes the motor command that stands
    /// until the next.
    pub(crate) fn sample(&mut self, counted: i64) -> MotorCommand {
        self.actual_position = wrap_24(i64::from(self.actual_position) + counted);
        self.generate();
        let motor_q10 = if let Algorithm::ProportionalVelocity { command_q4 } = self.algorithm {
            // Actual velocity has no fraction (R34, R35). K/4 · 1/16 is 1/64, so 16 times more for tenths of
            // 1024.
            self.gain * (i64::from(command_q4) - 16 * counted) * 16
        } else {
            let error = i64::from(wrap_24(i64::from(self.command_position()) - i64::from(self.actual_position)));
            let lead_q10 = self.gain * (256 * error - self.zero * self.last_error);
            self.last_error = error;
            lead_q10 - 4 * self.pole * i64::from(self.last_motor.register())
        };
        let motor = (motor_q10 / 1024).clamp(i64::from(i8::MIN), i64::from(i8::MAX));
        self.last_motor = MotorCommand(motor as i8);
        self.last_motor
    }

    /// Advances the command position by one sample of the running profile.
    fn generate(&mut self) {
        match &mut self.algorithm {
            Algorithm::Trapezoid { remaining_q8, backward, velocity_q8, max_velocity_q8, acceleration_q8 } => {
                let accelerated_q8 = (*velocity_q8 + *acceleration_q8).min(*max_velocity_q8);
                let step_q8 = accelerated_q8.min(fastest_stoppable(*remaining_q8, *acceleration_q8));
                *velocity_q8 = step_q8;
                *remaining_q8 -= step_q8;
                let signed_q8 = if *backward { -step_q8 } else { step_q8 };
                self.command_q8 = self.command_q8.wrapping_add(signed_q8 as i32);
                if *remaining_q8 == 0 {
                    self.algorithm = Algorithm::Position;
                }
            }
            Algorithm::IntegralVelocity { velocity_q8, command_q8, acceleration_q8 } => {
                *velocity_q8 += (*command_q8 - *velocity_q8).clamp(-*acceleration_q8, *acceleration_q8);
                self.command_q8 = self.command_q8.wrapping_add(*velocity_q8);
            }
            Algorithm::Position | Algorithm::ProportionalVelocity { .. } => {}
        }
    }

    /// The whole counts/sample that a speed lands on in the trapezoidal and integral velocity modes.
    ///
    /// # Errors
    /// When the speed is above 127 or below 1 count/sample.
    pub(crate) fn whole_velocity(&self, speed_counts_s: f64) -> Result<u8, ServoError> {
        Ok(self.velocity_steps(speed_counts_s, 1.0, f64::from(WHOLE_VELOCITY_MAX))? as u8)
    }

    /// The 1/16 counts/sample that a speed lands on in proportional velocity mode.
    ///
    /// # Errors
    /// When the speed is above 2047 15/16 or below 1/16 count/sample.
    pub(crate) fn fine_velocity_q4(&self, speed_counts_s: f64) -> Result<i16, ServoError> {
        Ok(self.velocity_steps(speed_counts_s, 16.0, f64::from(FINE_VELOCITY_MAX_Q4))? as i16)
    }

    fn velocity_steps(&self, speed_counts_s: f64, steps_per_count: f64, max_steps: f64) -> Result<f64, ServoError> {
        ServoError::unless_positive("speed_counts_s", speed_counts_s)?;
        let step_counts_s = 1.0 / (steps_per_count * self.sample_period_s);
        let steps = (speed_counts_s / step_counts_s + LATTICE_ROUNDING).floor();
        let mode = self.mode;
        if steps > max_steps {
            return Err(ServoError::SpeedCeiling { speed_counts_s, ceiling_counts_s: max_steps * step_counts_s, mode });
        }
        if steps < 1.0 {
            return Err(ServoError::SpeedTooLow { speed_counts_s, slowest_counts_s: step_counts_s, mode });
        }
        Ok(steps)
    }

    /// The 1/256 counts/sample² nearest to an acceleration.
    ///
    /// # Errors
    /// When the acceleration rounds to zero or exceeds 127 255/256 counts/sample².
    pub(crate) fn acceleration_q8(&self, acceleration_counts_s2: f64) -> Result<u16, ServoError> {
        let step_counts_s2 = 1.0 / (256.0 * self.sample_period_s * self.sample_period_s);
        let steps = (acceleration_counts_s2 / step_counts_s2).round();
        if (1.0..=f64::from(ACCELERATION_MAX_Q8)).contains(&steps) {
            return Ok(steps as u16);
        }
        Err(ServoError::Acceleration {
            acceleration_counts_s2,
            smallest_counts_s2: step_counts_s2,
            largest_counts_s2: f64::from(ACCELERATION_MAX_Q8) * step_counts_s2,
        })
    }
}

/// Smallest sample timer for a mode (datasheet, table 4): 64 µs at 2 MHz for the simple modes, which its text
/// confirms; twice that for those with a profile generator.
const fn sample_timer_minimum(mode: ControlMode) -> u8 {
    match mode {
        ControlMode::ProportionalVelocity => 0x07,
        ControlMode::Trapezoidal | ControlMode::IntegralVelocity => 0x0F,
    }
}

/// The largest step that still lets a profile with that deceleration end exactly on its final position.
///
/// A step v followed by v−a, v−2a … covers (m+1) v − a m(m+1)/2 with m further steps. The last steps share
/// what integers leave over.
fn fastest_stoppable(remaining_q8: i64, acceleration_q8: i64) -> i64 {
    let (remaining, a) = (remaining_q8, acceleration_q8);
    let mut m = ((1.0 + 8.0 * remaining as f64 / a as f64).sqrt() / 2.0 - 0.5) as i64;
    // The square root may round across an integer.
    while a * m * (m + 1) / 2 > remaining {
        m -= 1;
    }
    while a * (m + 1) * (m + 2) / 2 <= remaining {
        m += 1;
    }
    (remaining + a * m * (m + 1) / 2) / (m + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller(mode: ControlMode) -> Controller {
        Controller { clock_hz: 2e6, sample_timer: 249, mode, gain: 40, zero: 200, pole: 64, right_phase_s: 0.0 }
    }

    fn chip(mode: ControlMode) -> Hctl1100 {
        Hctl1100::new(&controller(mode)).expect("a valid controller")
    }

    /// Command positions of a chip whose motor follows without error.
    fn commands(chip: &mut Hctl1100, samples: usize) -> Vec<i32> {
        (0..samples)
            .map(|_| {
                chip.sample(0);
                chip.command_position()
            })
            .collect()
    }

    #[test]
    fn registers_land_on_the_lattice() {
        let chip = chip(ControlMode::Trapezoidal);
        assert_eq!(chip.sample_period_s(), 0.002);
        assert_eq!(chip.whole_velocity(40.7 / 0.002), Ok(40));
        assert_eq!(chip.fine_velocity_q4(40.7 / 0.002), Ok(651)); // 40.6875 counts/sample
        assert_eq!(chip.acceleration_q8(0.16 / 0.002 / 0.002), Ok(41)); // 40.96 is nearest to 41/256
        // A whole value that arithmetic left 1e-12 short stays whole; a real shortfall of 1e-3 does not.
        assert_eq!(chip.whole_velocity(40.0 * (1.0 - 1e-12) / 0.002), Ok(40));
        assert_eq!(chip.whole_velocity(39.999 / 0.002), Ok(39));
    }

    #[test]
    fn speeds_and_accelerations_off_the_registers_name_the_limits() {
        let chip = chip(ControlMode::Trapezoidal);
        let refused = chip.whole_velocity(64_000.0);
        let ceiling = ServoError::SpeedCeiling {
            speed_counts_s: 64_000.0,
            ceiling_counts_s: 63_500.0,
            mode: ControlMode::Trapezoidal,
        };
        assert_eq!(refused, Err(ceiling));
        let message = ceiling.to_string();
        assert!(message.contains("63500") && message.contains("sample_timer"), "{message}");
        assert!(chip.fine_velocity_q4(64_000.0).is_ok());
        assert!(matches!(chip.whole_velocity(499.0), Err(ServoError::SpeedTooLow { .. })));
        assert!(matches!(chip.acceleration_q8(400.0), Err(ServoError::Acceleration { .. })));
        assert!(matches!(chip.acceleration_q8(3.3e7), Err(ServoError::Acceleration { .. })));
    }

    #[test]
    fn impossible_controllers_are_refused() {
        use ControlMode::{IntegralVelocity, ProportionalVelocity, Trapezoidal};
        let with =
            |mode, sample_timer, clock_hz| Hctl1100::new(&Controller { sample_timer, clock_hz, ..controller(mode) });
        assert_eq!(with(ProportionalVelocity, 7, 2e6).map(|chip| chip.sample_period_s()), Ok(64e-6)); // datasheet: 64 µs at 2 MHz
        for mode in [Trapezoidal, IntegralVelocity] {
            assert_eq!(with(mode, 14, 2e6), Err(ServoError::SampleTimer { sample_timer: 14, minimum: 15, mode }));
            assert!(with(mode, 15, 2e6).is_ok());
        }
        assert!(matches!(with(Trapezoidal, 249, 2.1e6), Err(ServoError::OutOfRange { quantity: "clock_hz", .. })));
        assert!(matches!(with(Trapezoidal, 249, f64::NAN), Err(ServoError::OutOfRange { quantity: "clock_hz", .. })));
    }

    #[test]
    fn the_lead_filter_gives_the_hand_computed_sequence() {
        // K 40, A 200, B 64: MC = 10 X − 7.8125 X' − 0.25 MC'.
        let mut chip = chip(ControlMode::Trapezoidal);
        chip.position_control(3);
        assert_eq!(chip.sample(0).register(), 30);
        assert_eq!(chip.sample(2).register(), -20); // 10 − 23.4375 − 7.5 = −20.9375
        assert_eq!(chip.sample(0).register(), 7); // 10 − 7.8125 + 5 = 7.1875
        assert_eq!(chip.sample(3).register(), -29); // −20 − 7.8125 − 1.75 = −29.5625
        chip.position_control(1000);
        assert_eq!((chip.sample(0).register(), chip.sample(0).duty()), (127, 1.0));
        chip.position_control(-1000);
        assert_eq!((chip.sample(0).register(), chip.sample(0).duty()), (-128, -1.0));
    }

    #[test]
    fn proportional_velocity_acts_through_the_gain_alone() {
        let mut chip = chip(ControlMode::ProportionalVelocity);
        chip.proportional_velocity(651); // 40.6875
        // 10 (40.6875 − 38) = 26.875, again and again: no memory.
        assert_eq!([chip.sample(38), chip.sample(38), chip.sample(38)].map(MotorCommand::register), [26, 26, 26]);
        assert_eq!(chip.sample(41).register(), -3); // −3.125
    }

    #[test]
    fn positions_wrap_at_24_bits_and_the_error_does_not_notice() {
        let mut chip = chip(ControlMode::Trapezoidal);
        chip.position_control(0x7F_FFFE);
        let _ = chip.sample(0x7F_FFFE);
        assert_eq!(chip.actual_position(), 8_388_606);
        let _ = chip.sample(0);
        chip.trapezoid(wrap_24(8_388_606 + 5), 10, 256);
        let _ = commands(&mut chip, 10);
        assert_eq!(chip.command_position(), -8_388_605);
        assert!(!chip.profile_flag());
        let _ = chip.sample(5);
        assert_eq!(chip.actual_position(), -8_388_605);
        let _ = commands(&mut chip, 5); // the pole's ringing dies by 4 each sample
        assert_eq!(chip.sample(0).register(), 0);
    }

    #[test]
    fn a_trapezoid_is_exact_and_within_its_velocity_and_acceleration() {
        for (counts, max_velocity, acceleration_q8) in [
            (1, 40, 41),
            (7, 40, 41),
            (5_001, 40, 41),
            (22_807, 40, 41),
            (320_000, 40, 41),
            (-40_000, 127, 7),
            (999, 3, 0x7FFF),
        ] {
            let mut chip = chip(ControlMode::Trapezoidal);
            chip.trapezoid(counts, max_velocity, acceleration_q8);
            let (mut last_q8, mut last_step, mut samples) = (0, 0, 0_i32);
            while chip.profile_flag() && samples < 1_000_000 {
                let _ = chip.sample(0);
                let step = (chip.command_q8 - last_q8) * counts.signum();
                assert!(step > 0 && step <= i32::from(max_velocity) << 8, "{counts}: step {step}");
                // One part in 256 more when decelerating: the integers' remainder is spread over the last
                // steps.
                let change = step - last_step;
                assert!(
                    change <= i32::from(acceleration_q8) && change >= -i32::from(acceleration_q8) - 1,
                    "{counts}: change {change}"
                );
                (last_q8, last_step, samples) = (chip.command_q8, step, samples + 1);
            }
            assert_eq!(chip.command_position(), counts);
            assert_eq!(commands(&mut chip, 3), [counts; 3]);
        }
    }

    #[test]
    fn integral_velocity_ramps_and_then_advances_exactly() {
        let mut chip = chip(ControlMode::IntegralVelocity);
        chip.integral_velocity(-40, 256);
        assert_eq!(commands(&mut chip, 3), [-1, -3, -6]);
        let position = commands(&mut chip, 37)[36];
        assert_eq!(position, -40 * 41 / 2);
        assert_eq!(commands(&mut chip, 1000)[999], position - 40_000);
        chip.integral_velocity(0, 512);
        let last = commands(&mut chip, 25);
        assert_eq!(last[24], last[19], "20 samples at 2 counts/sample² stop it");
        assert_eq!(last[24], position - 40_000 - (38 + 2) * 19 / 2);
    }
}

//! What tells whether two runs are the same record, whatever they are called.

use crate::record::{Run, WheelLog};

/// FNV-1a, 64 bits. Reference: Fowler, Noll, Vo 1991.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

impl Run {
    /// A number of the run's log: times and wheels, to the last bit. Two runs that were driven apart differ.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let mut hash = OFFSET;
        let mut add = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(PRIME);
            }
        };
        self.odometry.t_s.iter().for_each(|t_s| add(t_s.to_bits()));
        match &self.odometry.wheels {
            WheelLog::Ticks(ticks) => ticks.left.iter().chain(&ticks.right).for_each(|tick| add(tick.cast_unsigned())),
            WheelLog::Angles(angles) | WheelLog::Speeds(angles) => {
                angles.left.iter().chain(&angles.right).for_each(|angle| add(angle.to_bits()));
            }
            WheelLog::Twist { v_mps, omega_radps } => {
                v_mps.iter().chain(omega_radps).for_each(|rate| add(rate.to_bits()));
            }
        }
        hash
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Odometry;
    use kinematics::Wheels;

    #[test]
    fn one_count_more_is_another_run() {
        let run = |last: i64| Run {
            odometry: Odometry {
                t_s: vec![0.0, 0.1].into(),
                wheels: WheelLog::Ticks(Wheels { left: vec![0, 5], right: vec![0, last] }),
                ..Odometry::default()
            },
            ..Run::default()
        };
        assert_eq!(run(6).fingerprint(), run(6).fingerprint());
        assert_ne!(run(6).fingerprint(), run(7).fingerprint());
    }
}

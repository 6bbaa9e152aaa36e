//! What tells whether two runs are the same record, whatever they are called.

use std::fmt::{self, Write};

use crate::record::{Run, WheelLog};

/// FNV-1a, 64 bits. Reference: Fowler, Noll, Vo 1991.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

struct Hash(u64);

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    }

    fn numbers<'n>(&mut self, numbers: impl IntoIterator<Item = &'n f64>) {
        numbers.into_iter().for_each(|number| self.bytes(&number.to_bits().to_le_bytes()));
    }
}

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

impl Run {
    /// A number of all that the run's tables hold, to the last bit, and of its start; its id is no part of
    /// it. Two runs that were driven apart differ, though a simulator gave both the same counts.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let mut hash = Hash(OFFSET);
        hash.numbers(&self.odometry.t_s);
        match &self.odometry.wheels {
            WheelLog::Ticks(ticks) => {
                ticks.left.iter().chain(&ticks.right).for_each(|tick| hash.bytes(&tick.to_le_bytes()));
            }
            WheelLog::Angles(angles) | WheelLog::Speeds(angles) => {
                hash.numbers(angles.left.iter().chain(&angles.right));
            }
            WheelLog::Twist { v_mps, omega_radps } => hash.numbers(v_mps.iter().chain(omega_radps)),
        }
        self.odometry.extra.values().for_each(|column| hash.numbers(column));
        for pose in &self.truth {
            hash.numbers(&[pose.t_s, pose.x_m, pose.y_m, pose.theta_rad().unwrap_or(f64::NAN)]);
        }
        self.gyro.iter().for_each(|rate| hash.numbers(&[rate.t_s, rate.omega_radps]));
        // These are few, and a double's text is as exact as its bits.
        let Self { truth_sigma, headings, displacements, point_readings, wheel_reference, .. } = self;
        let Self { revisits, distances, walls, info, .. } = self;
        let of_poses = (truth_sigma, headings, displacements, point_readings, wheel_reference);
        // Writing to a hash does not fail.
        let _ = write!(hash, "{of_poses:?} {:?}", (revisits, distances, walls, info.start_s));
        hash.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partial::{GyroSample, TapeDistance};
    use crate::record::{ExtraChannel, Odometry, TruthSample, TruthSigma};
    use kinematics::Wheels;

    #[test]
    fn one_number_more_in_any_table_is_another_run_and_another_id_is_not() {
        let log = Run {
            odometry: Odometry {
                t_s: vec![0.0, 0.1].into(),
                wheels: WheelLog::Ticks(Wheels { left: vec![0, 5], right: vec![0, 6] }),
                ..Odometry::default()
            },
            truth: vec![TruthSample::new(0.0, 1.0, 2.0, None)],
            ..Run::default()
        };
        let differs = |change: fn(&mut Run)| {
            let mut other = log.clone();
            change(&mut other);
            other.fingerprint() != log.fingerprint()
        };
        assert!(!differs(|run| run.info.id = "other".to_owned()));
        assert!(differs(|run| run.odometry.wheels = WheelLog::Ticks(Wheels { left: vec![0, 5], right: vec![0, 7] })));
        assert!(differs(|run| run.odometry.t_s[1] = 0.2));
        // The same counts on another day: what an outside instrument saw, or when, is not the same.
        assert!(differs(|run| run.truth[0].x_m = 1.5));
        assert!(differs(|run| run.truth[0] = TruthSample::new(0.0, 1.0, 2.0, Some(0.0))));
        assert!(differs(|run| run.truth_sigma = Some(vec![TruthSigma::UNKNOWN])));
        assert!(differs(|run| run.info.start_s = Some(86_400.0)));
        assert!(differs(|run| run.distances.push(TapeDistance {
            t0_s: 0.0,
            t1_s: 0.1,
            distance_m: 1.0,
            sigma_m: 0.1
        })));
        assert!(differs(|run| run.gyro.push(GyroSample { t_s: 0.0, omega_radps: 0.0 })));
        assert!(differs(|run| {
            run.odometry.extra.insert(ExtraChannel::GyroYawRate, vec![0.0, 0.1]);
        }));
    }
}

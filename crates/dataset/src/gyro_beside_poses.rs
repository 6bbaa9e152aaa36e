//! Gyroscopes in runs that an instrument saw with headings.

use crate::record::{Dataset, ExtraChannel, Run};

impl Run {
    /// Does an instrument measure its headings?
    fn has_headings(&self) -> bool {
        !self.displacements.is_empty() || self.truth.iter().any(|sample| sample.theta_rad().is_some())
    }
}

impl Dataset {
    /// Takes the gyroscope out of runs whose poses or displacements have headings, and says of how many. A
    /// fit that takes both together is slow, and its standard deviations are too large.
    pub fn leave_out_gyros_beside_poses(&mut self) -> usize {
        let both = self.runs.iter_mut().filter(|run| run.has_gyro() && run.has_headings());
        let left_out = both.map(|run| {
            run.gyro.clear();
            run.odometry.extra.remove(&ExtraChannel::GyroYawRate);
        });
        left_out.count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Provenance, TruthNoise, TruthSample};

    #[test]
    fn a_gyroscope_stays_where_nothing_else_sees_headings() {
        let with = |theta_rad: Option<f64>| {
            let mut run = Run { truth: vec![TruthSample::new(0.0, 0.0, 0.0, theta_rad)], ..Run::default() };
            run.odometry.extra.insert(ExtraChannel::GyroYawRate, vec![0.1]);
            run
        };
        let runs = vec![with(Some(0.2)), with(None)];
        let robot = crate::NominalRobot {
            left_wheel_diameter_m: 0.1,
            right_wheel_diameter_m: 0.1,
            wheel_separation_m: 0.3,
            ticks_per_rev: None,
            counter_bits: None,
        };
        let (provenance, truth_noise) = (Provenance::default(), TruthNoise::default());
        let mut dataset = Dataset { provenance, robot, truth_noise, points: Vec::new(), runs };
        assert_eq!(dataset.leave_out_gyros_beside_poses(), 1);
        assert_eq!(dataset.runs.iter().map(Run::has_gyro).collect::<Vec<_>>(), [false, true]);
    }
}

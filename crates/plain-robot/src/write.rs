//! A robot's drives and logs as a dataset folder.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::draws::Draws;
use crate::drive::{Part, TrueGeometry, World, programs};
use crate::robot::{PlainRobot, Records};

impl PlainRobot {
    /// The dataset in a temporary folder, and what [`Self::write`] says of the robot; where YAIR_OUT is set,
    /// the dataset stays in a folder there.
    ///
    /// # Panics
    /// Where a file cannot be written.
    #[must_use]
    pub fn written(&self) -> (tempfile::TempDir, [f64; 3]) {
        if let Some(kept) = std::env::var_os("YAIR_OUT") {
            self.write(&Path::new(&kept).join(self.seed.to_string()));
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        let truth_m = self.write(folder.path());
        (folder, truth_m)
    }

    /// Drives all runs and writes the dataset; the diameters of the wheels, and their separation, metres.
    ///
    /// # Panics
    /// Where a file cannot be written.
    pub fn write(&self, folder: &Path) -> [f64; 3] {
        fs::create_dir_all(folder).expect("a folder");
        let mut draws = Draws(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d);
        let base_m = self.scale * 0.363 * (1.0 + 0.01 * draws.normal());
        let radius_m = [0; 2].map(|_| self.scale * 0.08 * (1.0 + 3e-3 * draws.normal()));
        let phase_rad = TAU * draws.uniform();
        let records = if self.knows_wheels { Records::Angles { step_rad: 0.0 } } else { self.records };
        let (mut odometry, mut truth) = (format!("run,t_s,{}\n", records.columns()), String::new());
        truth.push_str("run,t_s,x_m,y_m,theta_rad\n");
        let mut described = String::new();
        let programs: Vec<(&str, Vec<Part>)> = programs(&mut draws)
            .into_iter()
            .filter(|(protocol, _)| self.only.is_none_or(|only| protocol.starts_with(only)))
            .take(self.runs)
            .map(|(protocol, parts)| (protocol, parts.into_iter().map(|part| part.driven_by(self)).collect()))
            .collect();
        let runs: Vec<(String, &str, Vec<Part>)> = if self.joined {
            vec![("all".to_owned(), "free", programs.iter().flat_map(|(_, legs)| legs.iter().copied()).collect())]
        } else {
            let of = |(number, (protocol, legs)): (usize, &(&'static str, Vec<Part>))| {
                (format!("{number:03}_{protocol}"), *protocol, legs.clone())
            };
            programs.iter().enumerate().map(of).collect()
        };
        let geometry = TrueGeometry { base_m, radius_m, phase_rad };
        let mut world = World { at: [0.0; 3], wheels_rad: [0.0; 2], ahead_m: [0.0; 2] };
        for (number, (id, protocol, legs)) in runs.iter().enumerate() {
            let start_s = 60.0 * number as f64;
            write!(described, "[[run]]\nid = \"{id}\"\nprotocol = \"{protocol}\"\nstart_s = {start_s}\n")
                .expect("text");
            world.at = [draws.normal(), draws.normal(), PI * (2.0 * draws.uniform() - 1.0)];
            let path = world.drive(legs, self, number, geometry, &mut draws);
            let since_s = if self.clock_runs_on { start_s } else { 0.0 };
            self.log_rows(number, id, since_s, &path, &mut odometry, &mut draws);
            self.log_truth(number, id, &path, &mut truth, &mut draws);
        }
        let sigma = |sigma: f64| if sigma > 0.0 { sigma } else { 0.0 };
        let text = format!(
            "format = 1\n[robot]\nleft_wheel_diameter_m = {:?}\nright_wheel_diameter_m = {:?}\n\
             wheel_separation_m = {:?}\nticks_per_rev = {:?}\n[truth]\nsigma_xy_m = {:?}\nsigma_theta_rad = {:?}\n{described}",
            0.16 * self.scale,
            0.16 * self.scale,
            0.363 * self.scale,
            self.ticks_per_rev,
            sigma(self.truth_sigma_m * self.stated),
            sigma(self.truth_sigma_rad * self.stated),
        );
        fs::write(folder.join("dataset.toml"), text).expect("written");
        fs::write(folder.join("odometry.csv"), odometry).expect("written");
        fs::write(folder.join("truth.csv"), truth).expect("written");
        [2.0 * radius_m[0], 2.0 * radius_m[1], base_m]
    }
}

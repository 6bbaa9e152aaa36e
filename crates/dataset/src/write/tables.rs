//! The tables as text. Rust prints a number in the fewest digits that read back to the same bits.

use std::io::{self, Write};

use crate::read::wheel_columns;
use crate::record::{Dataset, ExtraChannel, TruthSigma, WheelLog};
use crate::table::quoted_where_needed;

/// Shows a number, or nothing.
struct OrEmpty(Option<f64>);

impl std::fmt::Display for OrEmpty {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.map_or(Ok(()), |number| write!(out, "{number}"))
    }
}

pub(super) fn odometry(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    let has = |channel| dataset.runs.iter().any(|run| run.odometry.extra.contains_key(&channel));
    let extra: Vec<_> = ExtraChannel::ALL.into_iter().filter(|channel| has(*channel)).collect();
    // All runs report their wheels in one form, and there is a run: both have been checked.
    let [left, right] = wheel_columns(&dataset.runs[0].odometry.wheels);
    write!(out, "run,t_s,{left},{right}")?;
    for channel in &extra {
        write!(out, ",{}", channel.column())?;
    }
    writeln!(out)?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for (row, t_s) in run.odometry.t_s.iter().enumerate() {
            write!(out, "{id},{t_s},")?;
            match &run.odometry.wheels {
                WheelLog::Ticks(ticks) => write!(out, "{},{}", ticks.left[row], ticks.right[row])?,
                WheelLog::Angles(angles) => write!(out, "{},{}", angles.left[row], angles.right[row])?,
                WheelLog::Twist { v_mps, omega_radps } => write!(out, "{},{}", v_mps[row], omega_radps[row])?,
            }
            for channel in &extra {
                write!(out, ",{}", OrEmpty(run.odometry.extra.get(channel).map(|values| values[row])))?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

pub(super) fn truth(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    let has_sigma = |of: fn(&TruthSigma) -> Option<f64>| {
        dataset.runs.iter().flat_map(|run| run.truth_sigma.iter().flatten()).any(|sigma| of(sigma).is_some())
    };
    let sigma_xy_m = has_sigma(|sigma| sigma.sigma_xy_m);
    let sigma_theta_rad = has_sigma(|sigma| sigma.sigma_theta_rad);
    write!(out, "run,t_s,x_m,y_m,theta_rad")?;
    if sigma_xy_m {
        write!(out, ",sigma_xy_m")?;
    }
    if sigma_theta_rad {
        write!(out, ",sigma_theta_rad")?;
    }
    writeln!(out)?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for (row, sample) in run.truth.iter().enumerate() {
            write!(out, "{id},{},{},{},{}", sample.t_s, sample.x_m, sample.y_m, OrEmpty(sample.theta_rad()))?;
            let sigma = run.truth_sigma.as_ref().map(|sigmas| sigmas[row]);
            if sigma_xy_m {
                write!(out, ",{}", OrEmpty(sigma.and_then(|sigma| sigma.sigma_xy_m)))?;
            }
            if sigma_theta_rad {
                write!(out, ",{}", OrEmpty(sigma.and_then(|sigma| sigma.sigma_theta_rad)))?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

pub(super) fn displacement(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "run,t0_s,t1_s,dx_m,dy_m,dtheta_rad")?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for step in &run.displacements {
            writeln!(out, "{id},{},{},{},{},{}", step.t0_s, step.t1_s, step.dx_m, step.dy_m, step.dtheta_rad)?;
        }
    }
    Ok(())
}

pub(super) fn points(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "run,t_s,point,x_m,y_m")?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for reading in &run.point_readings {
            let point = quoted_where_needed(&dataset.points[reading.point].id);
            writeln!(out, "{id},{},{point},{},{}", reading.t_s, reading.room.x_m, reading.room.y_m)?;
        }
    }
    Ok(())
}

pub(super) fn wheel_reference(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "run,t_s,left_mps,right_mps")?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for speed in &run.wheel_reference {
            writeln!(out, "{id},{},{},{}", speed.t_s, speed.speed_m_s.left, speed.speed_m_s.right)?;
        }
    }
    Ok(())
}

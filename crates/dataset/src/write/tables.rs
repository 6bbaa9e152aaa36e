//! The tables as text: numbers in the fewest digits that read back to the same bits, as Rust prints them.

use std::io::{self, Write};

use crate::read::wheel_columns;
use crate::record::{Dataset, ExtraChannel, TruthSigma, WheelLog};
use crate::table::quoted_where_needed;

/// A number, as `{}` prints it but in a third of the time; nothing for `None`.
fn number(out: &mut impl Write, number: impl Into<Option<f64>>) -> io::Result<()> {
    let Some(number) = number.into() else { return Ok(()) };
    let mut digits = zmij::Buffer::new();
    let text = digits.format(number);
    if text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'.' | b'-')) {
        out.write_all(text.strip_suffix(".0").unwrap_or(text).as_bytes())
    } else {
        // An exponent, which `{}` does not print.
        write!(out, "{number}")
    }
}

/// Numbers, each behind a comma.
fn numbers<const N: usize>(out: &mut impl Write, values: [f64; N]) -> io::Result<()> {
    values.into_iter().try_for_each(|value| {
        out.write_all(b",")?;
        number(out, value)
    })
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
            out.write_all(id.as_bytes())?;
            numbers(out, [*t_s])?;
            match &run.odometry.wheels {
                WheelLog::Ticks(ticks) => write!(out, ",{},{}", ticks.left[row], ticks.right[row])?,
                WheelLog::Angles(angles) => numbers(out, [angles.left[row], angles.right[row]])?,
                WheelLog::Twist { v_mps, omega_radps } => numbers(out, [v_mps[row], omega_radps[row]])?,
            }
            for channel in &extra {
                out.write_all(b",")?;
                number(out, run.odometry.extra.get(channel).map(|values| values[row]))?;
            }
            out.write_all(b"\n")?;
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
            out.write_all(id.as_bytes())?;
            numbers(out, [sample.t_s, sample.x_m, sample.y_m])?;
            out.write_all(b",")?;
            number(out, sample.theta_rad())?;
            let sigma = run.truth_sigma.as_ref().map(|sigmas| sigmas[row]);
            if sigma_xy_m {
                out.write_all(b",")?;
                number(out, sigma.and_then(|sigma| sigma.sigma_xy_m))?;
            }
            if sigma_theta_rad {
                out.write_all(b",")?;
                number(out, sigma.and_then(|sigma| sigma.sigma_theta_rad))?;
            }
            out.write_all(b"\n")?;
        }
    }
    Ok(())
}

pub(super) fn displacement(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "run,t0_s,t1_s,dx_m,dy_m,dtheta_rad")?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for step in &run.displacements {
            out.write_all(id.as_bytes())?;
            numbers(out, [step.t0_s, step.t1_s, step.dx_m, step.dy_m, step.dtheta_rad])?;
            out.write_all(b"\n")?;
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
            out.write_all(id.as_bytes())?;
            numbers(out, [reading.t_s])?;
            write!(out, ",{point}")?;
            numbers(out, [reading.room.x_m, reading.room.y_m])?;
            out.write_all(b"\n")?;
        }
    }
    Ok(())
}

pub(super) fn wheel_reference(dataset: &Dataset, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "run,t_s,left_mps,right_mps")?;
    for run in &dataset.runs {
        let id = quoted_where_needed(&run.info.id);
        for speed in &run.wheel_reference {
            out.write_all(id.as_bytes())?;
            numbers(out, [speed.t_s, speed.speed_m_s.left, speed.speed_m_s.right])?;
            out.write_all(b"\n")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn text(value: f64) -> String {
        let mut out = Vec::new();
        number(&mut out, value).expect("in memory");
        String::from_utf8(out).expect("digits")
    }

    #[test]
    fn numbers_of_few_digits_and_of_many_zeros() {
        for value in
            [0.0, -0.0, 1.0, -2.5, 1e15, 1e16, 123_456_789_012_345_680.0, 1e300, 1e-5, 1.5e-7, 5e-324, f64::MAX]
        {
            assert_eq!(text(value), format!("{value}"));
        }
        let mut out = Vec::new();
        number(&mut out, None).expect("in memory");
        assert!(out.is_empty());
    }

    proptest! {
        #[test]
        fn a_number_is_printed_as_the_standard_library_prints_it(any: f64, usual in -1e4_f64..1e4, tiny in -1e-4_f64..1e-4) {
            for value in [any, usual, tiny, (usual * 1e3).round() / 1e3].into_iter().filter(|value| value.is_finite()) {
                prop_assert_eq!(text(value), format!("{value}"));
            }
        }
    }
}

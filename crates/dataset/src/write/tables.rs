//! The tables as text: numbers in the fewest digits that read back to the same bits.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufWriter, Write};

use crate::partial::HeadingReading;
use crate::pose_covariance::PoseCovariance;
use crate::read::{
    DISPLACEMENT, DISTANCE, GYRO, ODOMETRY, POINTS, REVISIT, TRUTH, WALL, WHEEL_REFERENCE, wheel_columns,
};
use crate::record::{ExtraChannel, MarkedPoint, Run, TruthSigma, WheelLog};
use crate::table::quoted_where_needed;

/// A table that is being written.
pub(super) type Out = BufWriter<File>;

/// A number as `{}` prints it, in a third of the time: of two texts equally near, which numbers above 10¹²
/// may have, it is the even one. Nothing for `None`.
fn number(out: &mut impl Write, number: impl Into<Option<f64>>) -> io::Result<()> {
    let Some(number) = number.into() else { return Ok(()) };
    if !PLAIN.contains(&number.abs()) {
        return write!(out, "{number}");
    }
    let mut digits = zmij::Buffer::new();
    let text = digits.format_finite(number);
    out.write_all(text.strip_suffix(".0").unwrap_or(text).as_bytes())
}

/// Where zmij prints no exponent, which `{}` never does.
const PLAIN: std::ops::Range<f64> = 1e-4..1e15;

/// Numbers, each behind a comma.
fn numbers<const N: usize>(out: &mut impl Write, values: [f64; N]) -> io::Result<()> {
    values.into_iter().try_for_each(|value| {
        out.write_all(b",")?;
        number(out, value)
    })
}

/// The optional columns of a dataset's tables: those that some run fills.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct OptionalColumns {
    extra: BTreeSet<ExtraChannel>,
    sigma_xy_m: bool,
    sigma_theta_rad: bool,
    covariance: bool,
}

impl OptionalColumns {
    pub(super) fn of(runs: &[Run]) -> Self {
        let mut columns = Self::default();
        for run in runs {
            columns.extra.extend(run.odometry.extra.keys());
            let sigmas = || run.truth_sigma.iter().flatten();
            columns.sigma_xy_m |= sigmas().any(|sigma| sigma.sigma_xy_m.is_some());
            columns.sigma_theta_rad |= sigmas().any(|sigma| sigma.sigma_theta_rad.is_some());
            columns.sigma_theta_rad |= !run.headings.is_empty();
            columns.covariance |= sigmas().any(|sigma| sigma.covariance.is_some());
        }
        columns
    }

    pub(super) fn hold(&self, run: &Run) -> bool {
        let of_run = Self::of(std::slice::from_ref(run));
        of_run.extra.is_subset(&self.extra)
            && self.sigma_xy_m >= of_run.sigma_xy_m
            && self.sigma_theta_rad >= of_run.sigma_theta_rad
            && self.covariance >= of_run.covariance
    }
}

/// One table of a dataset: its header, and the rows of a run.
pub(super) struct TableKind {
    pub(super) file: &'static str,
    pub(super) has: fn(&Run) -> bool,
    pub(super) header: fn(&Run, &OptionalColumns) -> String,
    pub(super) rows: fn(&Run, &[MarkedPoint], &OptionalColumns, &mut Out) -> io::Result<()>,
}

pub(super) const TABLES: [TableKind; 9] = [
    TableKind { file: ODOMETRY, has: |_| true, header: odometry_header, rows: odometry },
    TableKind {
        file: TRUTH,
        has: |run| !(run.truth.is_empty() && run.headings.is_empty()),
        header: truth_header,
        rows: truth,
    },
    TableKind {
        file: DISPLACEMENT,
        has: |run| !run.displacements.is_empty(),
        header: |_, _| "run,t0_s,t1_s,dx_m,dy_m,dtheta_rad".to_owned(),
        rows: displacement,
    },
    TableKind {
        file: POINTS,
        has: |run| !run.point_readings.is_empty(),
        header: |_, _| "run,t_s,point,x_m,y_m".to_owned(),
        rows: points,
    },
    TableKind {
        file: WHEEL_REFERENCE,
        has: |run| !run.wheel_reference.is_empty(),
        header: |_, _| "run,t_s,left_mps,right_mps".to_owned(),
        rows: wheel_reference,
    },
    TableKind {
        file: REVISIT,
        has: |run| !run.revisits.is_empty(),
        header: |_, _| "run,t0_s,t1_s,dx_m,dy_m,dtheta_rad,sigma_xy_m,sigma_theta_rad".to_owned(),
        rows: revisits,
    },
    TableKind {
        file: DISTANCE,
        has: |run| !run.distances.is_empty(),
        header: |_, _| "run,t0_s,t1_s,distance_m,sigma_m".to_owned(),
        rows: distances,
    },
    TableKind {
        file: WALL,
        has: |run| !run.walls.is_empty(),
        header: |_, _| "run,t_s,wall,distance_m,heading_rad,sigma_m,sigma_rad".to_owned(),
        rows: walls,
    },
    TableKind {
        file: GYRO,
        has: |run| !run.gyro.is_empty(),
        header: |_, _| "run,t_s,omega_radps".to_owned(),
        rows: gyro,
    },
];

/// All runs report their wheels in one form, that of the first.
fn odometry_header(first: &Run, columns: &OptionalColumns) -> String {
    let [left, right] = wheel_columns(&first.odometry.wheels);
    let extra: String = columns.extra.iter().map(|channel| format!(",{}", channel.column())).collect();
    format!("run,t_s,{left},{right}{extra}")
}

fn odometry(run: &Run, _: &[MarkedPoint], columns: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for (row, t_s) in run.odometry.t_s.iter().enumerate() {
        out.write_all(id.as_bytes())?;
        numbers(out, [*t_s])?;
        match &run.odometry.wheels {
            WheelLog::Ticks(ticks) => {
                for count in [ticks.left[row], ticks.right[row]] {
                    out.write_all(b",")?;
                    out.write_all(itoa::Buffer::new().format(count).as_bytes())?;
                }
            }
            WheelLog::Angles(columns) | WheelLog::Speeds(columns) => {
                numbers(out, [columns.left[row], columns.right[row]])?;
            }
            WheelLog::Twist { v_mps, omega_radps } => numbers(out, [v_mps[row], omega_radps[row]])?,
        }
        for channel in &columns.extra {
            out.write_all(b",")?;
            number(out, run.odometry.extra.get(channel).map(|values| values[row]).filter(|value| !value.is_nan()))?;
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn truth_header(_: &Run, columns: &OptionalColumns) -> String {
    let sigma_xy_m = if columns.sigma_xy_m { ",sigma_xy_m" } else { "" };
    let sigma_theta_rad = if columns.sigma_theta_rad { ",sigma_theta_rad" } else { "" };
    let covariance = if columns.covariance { format!(",{}", PoseCovariance::COLUMNS.join(",")) } else { String::new() };
    format!("run,t_s,x_m,y_m,theta_rad{sigma_xy_m}{sigma_theta_rad}{covariance}")
}

/// Poses and headings without a position, in the order of time.
fn truth(run: &Run, _: &[MarkedPoint], columns: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    let mut headings = run.headings.iter().peekable();
    let heading = |of: &HeadingReading, out: &mut Out| {
        let sigma = TruthSigma { sigma_theta_rad: Some(of.sigma_rad), ..TruthSigma::UNKNOWN };
        truth_row(&id, of.t_s, [None, None, Some(of.theta_rad)], sigma, columns, out)
    };
    for (row, sample) in run.truth.iter().enumerate() {
        while let Some(of) = headings.next_if(|of| of.t_s < sample.t_s) {
            heading(of, out)?;
        }
        let sigma = run.truth_sigma.as_ref().map_or(TruthSigma::UNKNOWN, |sigmas| sigmas[row]);
        let pose = [Some(sample.x_m), Some(sample.y_m), sample.theta_rad()];
        truth_row(&id, sample.t_s, pose, sigma, columns, out)?;
    }
    headings.try_for_each(|of| heading(of, out))
}

fn truth_row(
    id: &str,
    t_s: f64,
    pose: [Option<f64>; 3],
    sigma: TruthSigma,
    columns: &OptionalColumns,
    out: &mut Out,
) -> io::Result<()> {
    out.write_all(id.as_bytes())?;
    numbers(out, [t_s])?;
    optional(out, pose)?;
    if columns.sigma_xy_m {
        optional(out, [sigma.sigma_xy_m])?;
    }
    if columns.sigma_theta_rad {
        optional(out, [sigma.sigma_theta_rad])?;
    }
    if columns.covariance {
        optional(out, sigma.covariance.map_or([None; 6], |of| of.elements().map(Some)))?;
    }
    out.write_all(b"\n")
}

fn displacement(run: &Run, _: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for step in &run.displacements {
        out.write_all(id.as_bytes())?;
        numbers(out, [step.t0_s, step.t1_s, step.dx_m, step.dy_m, step.dtheta_rad])?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn points(run: &Run, points: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for reading in &run.point_readings {
        let point = quoted_where_needed(&points[reading.point].id);
        out.write_all(id.as_bytes())?;
        numbers(out, [reading.t_s])?;
        write!(out, ",{point}")?;
        numbers(out, [reading.room.x_m, reading.room.y_m])?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn wheel_reference(run: &Run, _: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for speed in &run.wheel_reference {
        out.write_all(id.as_bytes())?;
        numbers(out, [speed.t_s, speed.speed_m_s.left, speed.speed_m_s.right])?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

/// Numbers that may be missing, each behind a comma.
fn optional<const N: usize>(out: &mut impl Write, values: [Option<f64>; N]) -> io::Result<()> {
    values.into_iter().try_for_each(|value| {
        out.write_all(b",")?;
        number(out, value)
    })
}

fn revisits(run: &Run, _: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for of in &run.revisits {
        out.write_all(id.as_bytes())?;
        numbers(out, [of.t0_s, of.t1_s])?;
        optional(out, [of.dx_m, of.dy_m, of.dtheta_rad, of.sigma_xy_m, of.sigma_theta_rad])?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn distances(run: &Run, _: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for of in &run.distances {
        out.write_all(id.as_bytes())?;
        numbers(out, [of.t0_s, of.t1_s, of.distance_m, of.sigma_m])?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn walls(run: &Run, _: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for of in &run.walls {
        out.write_all(id.as_bytes())?;
        numbers(out, [of.t_s])?;
        write!(out, ",{}", quoted_where_needed(&of.wall))?;
        optional(out, [of.distance_m, of.heading_rad, of.sigma_m, of.sigma_rad])?;
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn gyro(run: &Run, _: &[MarkedPoint], _: &OptionalColumns, out: &mut Out) -> io::Result<()> {
    let id = quoted_where_needed(&run.info.id);
    for sample in &run.gyro {
        out.write_all(id.as_bytes())?;
        numbers(out, [sample.t_s, sample.omega_radps])?;
        out.write_all(b"\n")?;
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
                let text = text(value);
                prop_assert_eq!(text.parse::<f64>().expect("a number").to_bits(), value.to_bits());
                prop_assert_eq!(text.len(), format!("{value}").len());
                if value.abs() < 1e12 {
                    prop_assert_eq!(text, format!("{value}"));
                }
            }
        }
    }
}

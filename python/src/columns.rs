//! A dataset as columns of numpy, and its folder.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use yair::dataset::{
    self, Dataset, DatasetError, Existing, ExtraChannel, HeadingReading, NominalRobot, Odometry, PoseCovariance,
    Provenance, Run, RunInfo, TruthNoise, TruthSample, TruthSigma, WheelLog,
};
use yair::kinematics::Wheels;

type Numbers<'py> = PyReadonlyArray1<'py, f64>;

/// A dataset in memory.
#[pyclass]
pub(crate) struct Columns {
    dataset: Dataset,
    warnings: Vec<String>,
}

fn error(error: DatasetError) -> PyErr {
    match error {
        DatasetError::Io { .. } => PyOSError::new_err(error.to_string()),
        other => PyValueError::new_err(other.to_string()),
    }
}

fn both(left: &Numbers<'_>, right: &Numbers<'_>) -> Wheels<Vec<f64>> {
    Wheels { left: left.as_array().to_vec(), right: right.as_array().to_vec() }
}

#[pymethods]
impl Columns {
    /// A dataset without runs.
    #[new]
    #[pyo3(signature = (*, left_wheel_diameter_m, right_wheel_diameter_m, wheel_separation_m, ticks_per_rev=None,
        counter_bits=None, name=None, robot_id=None, recorded=None, sigma_xy_m=None, sigma_theta_rad=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, as dataset.toml has them")]
    fn new(
        left_wheel_diameter_m: f64,
        right_wheel_diameter_m: f64,
        wheel_separation_m: f64,
        ticks_per_rev: Option<f64>,
        counter_bits: Option<u8>,
        name: Option<String>,
        robot_id: Option<String>,
        recorded: Option<String>,
        sigma_xy_m: Option<f64>,
        sigma_theta_rad: Option<f64>,
    ) -> PyResult<Self> {
        let recorded = recorded.map(|text| dataset::parse_recorded(&text)).transpose();
        let recorded = recorded.map_err(|why| PyValueError::new_err(format!("recorded: {why}")))?;
        let robot = NominalRobot {
            left_wheel_diameter_m,
            right_wheel_diameter_m,
            wheel_separation_m,
            ticks_per_rev,
            counter_bits,
        };
        let provenance = Provenance { name, robot_id, recorded, ..Provenance::default() };
        let truth_noise = TruthNoise { sigma_xy_m, sigma_theta_rad, ..TruthNoise::default() };
        let dataset = Dataset { provenance, robot, truth_noise, points: Vec::new(), runs: Vec::new() };
        Ok(Self { dataset, warnings: Vec::new() })
    }

    /// Reads a folder.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let loaded = py.detach(|| dataset::read(&path)).map_err(error)?;
        let warnings = loaded.warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
        Ok(Self { dataset: loaded.dataset, warnings })
    }

    /// Writes the folder; `force` replaces a dataset that stands there.
    fn write(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let existing = if force { Existing::ReplaceDataset } else { Existing::Refuse };
        py.detach(|| dataset::write(&self.dataset, &path, existing)).map_err(error)
    }

    /// Refuses what could not be read back.
    fn check_writable(&self) -> PyResult<()> {
        dataset::check_writable(&self.dataset).map_err(error)
    }

    /// Adds a run without truth. `form` says what the two columns of wheels are, as the format names them:
    /// ticks, rad, mps or twist; ticks are whole, which the caller has seen to.
    fn add_run(
        &mut self,
        id: String,
        form: &str,
        t_s: Numbers<'_>,
        first: Numbers<'_>,
        second: Numbers<'_>,
    ) -> PyResult<()> {
        let wheels = both(&first, &second);
        let whole = |column: Vec<f64>| column.into_iter().map(|value| value as i64).collect();
        let wheels = match form {
            "ticks" => WheelLog::Ticks(Wheels { left: whole(wheels.left), right: whole(wheels.right) }),
            "rad" => WheelLog::Angles(wheels),
            "mps" => WheelLog::Speeds(wheels),
            "twist" => WheelLog::Twist { v_mps: wheels.left, omega_radps: wheels.right },
            other => {
                return Err(PyValueError::new_err(format!("wheels: \"{other}\" is none of ticks, rad, mps and twist")));
            }
        };
        let odometry = Odometry { t_s: t_s.as_array().to_vec().into(), wheels, ..Odometry::default() };
        let info = RunInfo { id, ..RunInfo::default() };
        self.dataset.runs.push(Run { info, odometry, ..Run::default() });
        self.dataset.carry_wheel_angles();
        Ok(())
    }

    /// Gives the last run its truth; NaN = not seen. A row without x and y is a heading alone. `covariance`
    /// has the six columns of elements in the format's order; NaN is 0 there.
    #[pyo3(signature = (t_s, x_m, y_m, theta_rad=None, sigma_xy_m=None, sigma_theta_rad=None, covariance=None))]
    #[expect(clippy::too_many_arguments, reason = "columns, as truth.csv has them")]
    fn add_truth(
        &mut self,
        t_s: Numbers<'_>,
        x_m: Numbers<'_>,
        y_m: Numbers<'_>,
        theta_rad: Option<Numbers<'_>>,
        sigma_xy_m: Option<Numbers<'_>>,
        sigma_theta_rad: Option<Numbers<'_>>,
        covariance: Option<[Numbers<'_>; 6]>,
    ) -> PyResult<()> {
        let known = |column: &Option<Numbers<'_>>, row: usize| {
            let value = column.as_ref().map(|column| column.as_array()[row]);
            value.filter(|value| !value.is_nan())
        };
        let (t_s, x_m, y_m) = (t_s.as_array(), x_m.as_array(), y_m.as_array());
        let given = [&theta_rad, &sigma_xy_m, &sigma_theta_rad].into_iter().flatten();
        let lengths = given.chain(covariance.iter().flatten()).map(|column| column.as_array().len());
        if let Some(other) = lengths.chain([x_m.len(), y_m.len()]).find(|length| *length != t_s.len()) {
            return Err(PyValueError::new_err(format!("truth: a column has {other} rows, t_s has {}", t_s.len())));
        }
        let stated_rad = self.dataset.truth_noise.sigma_theta_rad;
        let Some(run) = self.dataset.runs.last_mut() else {
            return Err(PyValueError::new_err("truth before the first run"));
        };
        let mut sigmas = Vec::with_capacity(t_s.len());
        for row in 0..t_s.len() {
            let theta_rad = known(&theta_rad, row);
            let elements = covariance.as_ref().map_or([0.0; 6], |columns| {
                columns.each_ref().map(|column| Some(column.as_array()[row]).filter(|of| !of.is_nan()).unwrap_or(0.0))
            });
            let stated = PoseCovariance::stated(elements)
                .map_err(|why| PyValueError::new_err(format!("truth: the covariance of row {row} is none: {why}")))?;
            let positive = |sigma: &f64| *sigma != 0.0;
            let sigma = TruthSigma {
                sigma_xy_m: known(&sigma_xy_m, row).filter(positive),
                sigma_theta_rad: known(&sigma_theta_rad, row).filter(positive),
                covariance: stated.and_then(|all| if theta_rad.is_some() { Some(all) } else { all.of_position() }),
            };
            match theta_rad.filter(|_| x_m[row].is_nan() && y_m[row].is_nan()) {
                None => {
                    run.truth.push(TruthSample::new(t_s[row], x_m[row], y_m[row], theta_rad));
                    sigmas.push(sigma);
                }
                Some(theta_rad) => {
                    let of_row = stated.map(|all| all.tt_rad2.sqrt()).filter(positive).or(sigma.sigma_theta_rad);
                    let sigma_rad = of_row.or(stated_rad).ok_or_else(|| {
                        let why = "a heading without a position needs sigma_theta_rad, in the row or of the instrument";
                        PyValueError::new_err(format!("truth: row {row}: {why}"))
                    })?;
                    run.headings.push(HeadingReading { t_s: t_s[row], theta_rad, sigma_rad });
                }
            }
        }
        // A run has the column once it has something to say.
        run.truth_sigma = sigmas.iter().any(|sigma| *sigma != TruthSigma::UNKNOWN).then_some(sigmas);
        Ok(())
    }

    /// What the reader said of the folder.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn name(&self) -> Option<String> {
        self.dataset.provenance.name.clone()
    }

    /// The nominal robot.
    #[getter]
    fn robot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let robot = &self.dataset.robot;
        let all = PyDict::new(py);
        all.set_item("left_wheel_diameter_m", robot.left_wheel_diameter_m)?;
        all.set_item("right_wheel_diameter_m", robot.right_wheel_diameter_m)?;
        all.set_item("wheel_separation_m", robot.wheel_separation_m)?;
        all.set_item("ticks_per_rev", robot.ticks_per_rev)?;
        all.set_item("counter_bits", robot.counter_bits)?;
        Ok(all)
    }

    /// Ids of the runs, in order.
    #[getter]
    fn runs(&self) -> Vec<String> {
        self.dataset.runs.iter().map(|run| run.info.id.clone()).collect()
    }

    /// The columns of a run's odometry, by the names of odometry.csv.
    fn odometry<'py>(&self, py: Python<'py>, run: usize) -> PyResult<Bound<'py, PyDict>> {
        let odometry = &self.run(run)?.odometry;
        let columns = PyDict::new(py);
        let set = |name: &str, values: &[f64]| columns.set_item(name, PyArray1::from_slice(py, values));
        set("t_s", &odometry.t_s)?;
        match &odometry.wheels {
            WheelLog::Ticks(ticks) => {
                columns.set_item("left_ticks", PyArray1::from_slice(py, &ticks.left))?;
                columns.set_item("right_ticks", PyArray1::from_slice(py, &ticks.right))?;
            }
            WheelLog::Angles(angles) => {
                set("left_rad", &angles.left)?;
                set("right_rad", &angles.right)?;
            }
            WheelLog::Speeds(speeds) => {
                set("left_mps", &speeds.left)?;
                set("right_mps", &speeds.right)?;
            }
            WheelLog::Twist { v_mps, omega_radps } => {
                set("v_mps", v_mps)?;
                set("omega_radps", omega_radps)?;
            }
        }
        for channel in ExtraChannel::ALL {
            if let Some(values) = odometry.extra.get(&channel) {
                set(channel.column(), values)?;
            }
        }
        Ok(columns)
    }

    /// The columns of a run's truth, by the names of truth.csv; NaN = not seen. Those of the rows' precision
    /// are there where a row states it.
    fn truth<'py>(&self, py: Python<'py>, run: usize) -> PyResult<Bound<'py, PyDict>> {
        let run = self.run(run)?;
        let sigma_of = |row: usize| run.truth_sigma.as_ref().map_or(TruthSigma::UNKNOWN, |sigmas| sigmas[row]);
        let poses = run.truth.iter().enumerate().map(|(row, sample)| (*sample, sigma_of(row)));
        let headings = run.headings.iter().map(|of| {
            let sigma = TruthSigma { sigma_theta_rad: Some(of.sigma_rad), ..TruthSigma::UNKNOWN };
            (TruthSample::new(of.t_s, f64::NAN, f64::NAN, Some(of.theta_rad)), sigma)
        });
        let mut rows: Vec<(TruthSample, TruthSigma)> = poses.chain(headings).collect();
        rows.sort_by(|(a, _), (b, _)| a.t_s.total_cmp(&b.t_s));
        let columns = PyDict::new(py);
        let column = |name: &str, of: &dyn Fn(&(TruthSample, TruthSigma)) -> f64| {
            columns.set_item(name, PyArray1::from_iter(py, rows.iter().map(of)))
        };
        column("t_s", &|(sample, _)| sample.t_s)?;
        column("x_m", &|(sample, _)| sample.x_m)?;
        column("y_m", &|(sample, _)| sample.y_m)?;
        column("theta_rad", &|(sample, _)| sample.theta_rad().unwrap_or(f64::NAN))?;
        if rows.iter().any(|(_, sigma)| sigma.sigma_xy_m.is_some()) {
            column("sigma_xy_m", &|(_, sigma)| sigma.sigma_xy_m.unwrap_or(f64::NAN))?;
        }
        if rows.iter().any(|(_, sigma)| sigma.sigma_theta_rad.is_some()) {
            column("sigma_theta_rad", &|(_, sigma)| sigma.sigma_theta_rad.unwrap_or(f64::NAN))?;
        }
        if rows.iter().any(|(_, sigma)| sigma.covariance.is_some()) {
            for (element, name) in PoseCovariance::COLUMNS.into_iter().enumerate() {
                column(name, &|(_, sigma)| sigma.covariance.map_or(f64::NAN, |all| all.elements()[element]))?;
            }
        }
        Ok(columns)
    }
}

impl Columns {
    fn run(&self, run: usize) -> PyResult<&Run> {
        let runs = &self.dataset.runs;
        runs.get(run).ok_or_else(|| PyValueError::new_err(format!("run {run}: there are {}", runs.len())))
    }
}

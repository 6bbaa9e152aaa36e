//! Table 2 from simulation: what both methods find on the robot that the direct column describes, beside the
//! published values.
//!
//! The simulated robot has table 1's sensitivities and a wheelbase of 363 mm that scatters by 1 mm from
//! motion to motion; it is measured as the measuring hypothesis of table 1 says. The published UMBmark column
//! is what this model does *not* predict.

use calib::methods::direct::Direct;
use calib::methods::umbmark::Umbmark;
use calib::{Calibration, Method, Parameter, Summary};
use rayon::prelude::*;
use scenario::{Instrument, Scenario};
use serde::Serialize;
use sim_yair::SimulationError;

use super::published::{Column, Printed, TABLE_2_DIRECT, TABLE_2_UMBMARK};
use super::table_1::quantile;
use super::units::MM_PER_M;
use bench::Trial;

/// One cell of table 2 beside its simulation. Sensitivities in mm/pulse, lengths in mm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// `direct` or `umbmark`.
    pub method: &'static str,
    /// `C_L`, `C_R` or `B`.
    pub symbol: &'static str,
    /// Unit of all values.
    pub unit: &'static str,
    /// What the paper prints.
    pub published: f64,
    /// The σ that the paper prints beside it.
    pub published_sigma: Option<f64>,
    /// Simulated 2.5, 50 and 97.5 percentiles of the estimate.
    pub percentiles: [f64; 3],
    /// Simulated standard deviation of the estimate.
    pub sigma: f64,
    /// Simulated standard deviation of the single runs' values, for the direct method: what the paper's σ may
    /// be.
    pub single_sigma: Option<f64>,
    /// Published minus simulated mean, in simulated standard deviations joined with the rounding of the print
    /// (half a digit over √3).
    pub away: f64,
}

/// Everything about table 2.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table2 {
    /// The cells, direct first.
    pub cells: Vec<Cell>,
    /// How many experiments.
    pub trials: u64,
}

impl Table2 {
    /// The cell of a method and a symbol.
    #[must_use]
    pub fn cell(&self, method: &str, symbol: &str) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.method == method && cell.symbol == symbol)
    }
}

/// The cells' order: symbol, parameter, whether it is a sensitivity.
const SYMBOLS: [(&str, Parameter, bool); 3] = [
    ("C_L", Parameter::LeftPerTick, true),
    ("C_R", Parameter::RightPerTick, true),
    ("B", Parameter::WheelSeparation, false),
];

/// Trials that one task drives.
const TRIALS_PER_TASK: u64 = 50;

/// One trial: both methods' values in the cells' order, and the scatter of the direct method's single runs.
type Found = ([[f64; 3]; 2], [f64; 3]);

/// Drives the paper's campaign `trials` times.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn table_2(
    base: &Scenario,
    reading_sigma_m: f64,
    trials: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Table2, SimulationError> {
    let mut scenario = base.clone();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m }];
    let found: Result<Vec<Vec<Found>>, SimulationError> = (0..trials.div_ceil(TRIALS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let mut trial = Trial::new(&scenario, scenario.seed)?;
            let from = task * TRIALS_PER_TASK;
            let mut found = Vec::new();
            for number in from..(from + TRIALS_PER_TASK).min(trials) {
                let ticks_per_rev = trial.ticks_per_rev().unwrap_or(f64::NAN);
                let session = [trial.drive(number)?];
                let methods: [&dyn Method; 2] = [&Direct::DEFAULT, &Umbmark::DEFAULT];
                let [Ok(direct), Ok(umbmark)] = methods.map(|method| method.calibrate(&session)) else { continue };
                let single = single_sigma(&session, &direct, std::f64::consts::TAU / ticks_per_rev);
                found.push(([values(&direct), values(&umbmark)], single));
            }
            progress(found.len() as u64);
            Ok(found)
        })
        .collect();
    let found: Vec<Found> = found?.into_iter().flatten().collect();
    let columns = [("direct", TABLE_2_DIRECT), ("umbmark", TABLE_2_UMBMARK)];
    let cells = columns.iter().enumerate().flat_map(|(k, (method, column))| {
        let found = &found;
        SYMBOLS.iter().enumerate().map(move |(symbol, _)| cell(method, column, symbol, k, found))
    });
    Ok(Table2 { cells: cells.collect(), trials })
}

/// C_L and C_R in mm/pulse, B in mm.
fn values(calibration: &Calibration) -> [f64; 3] {
    SYMBOLS
        .map(|(_, parameter, _)| calibration.estimate(parameter).map_or(f64::NAN, |estimate| estimate.value * MM_PER_M))
}

/// Standard deviations of the single straight and spin values.
fn single_sigma(session: &[dataset::Session<'_>], direct: &Calibration, rad_per_tick: f64) -> [f64; 3] {
    let straights = Direct::straight_values(session).unwrap_or_default();
    let spins = Direct::spin_values(session, direct.geometry.m_per_rad()).unwrap_or_default();
    let std = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        Summary::of(values.iter().copied()).and_then(|summary| summary.variance).map_or(f64::NAN, f64::sqrt)
    };
    [
        std(&mut straights.left.iter().map(|value| value.value * rad_per_tick * MM_PER_M)),
        std(&mut straights.right.iter().map(|value| value.value * rad_per_tick * MM_PER_M)),
        std(&mut spins.iter().map(|(value, _)| value.value * MM_PER_M)),
    ]
}

fn cell(method: &'static str, column: &Column, symbol: usize, method_index: usize, found: &[Found]) -> Cell {
    let printed: Printed = [column.sensitivity.left, column.sensitivity.right, column.base][symbol];
    let mut values: Vec<f64> = found.iter().map(|(values, _)| values[method_index][symbol]).collect();
    values.sort_unstable_by(f64::total_cmp);
    let summary = Summary::of(values.iter().copied());
    let (mean, sigma) = summary.map_or((f64::NAN, f64::NAN), |s| (s.mean, s.variance.unwrap_or(0.0).sqrt()));
    let single = Summary::of(found.iter().map(|(_, single)| single[symbol])).map(|summary| summary.mean);
    let (name, _, sensitivity) = SYMBOLS[symbol];
    Cell {
        method,
        symbol: name,
        unit: if sensitivity { "mm/pulse" } else { "mm" },
        published: printed.value,
        published_sigma: printed.sigma,
        percentiles: [0.025, 0.5, 0.975].map(|share| quantile(&values, share)),
        sigma,
        single_sigma: if method == "direct" { single } else { None },
        away: (printed.value - mean) / sigma.hypot(printed.half_digit / 3_f64.sqrt()),
    }
}

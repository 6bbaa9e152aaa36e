//! Where the paper contradicts itself: each contradiction derived here, not quoted, with its size in the
//! units that make it one.

use calib::Method;
use calib::methods::umbmark::{Form, Umbmark};
use kinematics::{Increment, Point, Pose, Wheels, sinc, wrap_to_pi};
use motion_programs::Schedule;
use scenario::{Instrument, Scenario};
use serde::Serialize;
use sim_yair::SimulationError;

use super::published::{TABLE_1, TABLE_2_DIRECT, TABLE_2_UMBMARK};
use super::table_2::Table2;
use super::units::MM_PER_M;

/// One finding of the audit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Short name.
    pub id: &'static str,
    /// What is claimed or printed.
    pub printed: String,
    /// What follows from the paper's other numbers.
    pub derived: String,
    /// How far apart they are, and in what unit; `None` where it is no matter of size.
    #[serde(rename = "apart")]
    pub separation: Option<(f64, &'static str)>,
    /// What it means.
    pub meaning: String,
}

/// What UMBmark reads, noise-free, on the robot of a scenario: C_L and C_R in mm/pulse, B in mm.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn noise_free_umbmark(base: &Scenario, form: Form) -> Result<(Wheels<f64>, f64), SimulationError> {
    let mut scenario = base.clone();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.noise.sensitivity_sigma = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 0.0 }];
    scenario.effects.retain(|effect| matches!(effect.hypothesis(), Some(effects::Hypothesis::Geometry)));
    scenario.protocols = vec![Schedule::Squares { side_m: 4.0, runs_each_way: 1 }];
    let measured = sim_yair::simulate(&scenario, scenario.seed, 0)?.dataset;
    let nominal_m = scenario.robot.wheel_diameter_m();
    let found = Umbmark { form }.calibrate(&[measured.session()]);
    let geometry = found.map_or_else(|_| scenario.nominal_geometry(), |found| Ok(found.geometry))?;
    // The robot believes in 1 mm/pulse: a sensitivity is the found over the nominal diameter.
    Ok((
        geometry.wheel_diameter_m().zip_with(nominal_m, |found, nominal| found / nominal),
        geometry.wheel_separation_m() * MM_PER_M,
    ))
}

/// The paper against itself.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn audit(base: &Scenario, table_2: &Table2) -> Result<Vec<Finding>, SimulationError> {
    Ok(vec![
        printed_sigmas(),
        umbmark_base(base, table_2)?,
        umbmark_ratio(table_2),
        clockwise_spins(base),
        folding_arcsine(),
        unsigned_chords(base),
        runs_before_rejection(),
        pulses_of_a_turn(base),
    ])
}

/// Rounded to the last digit that table 2 prints of a σ.
fn to_thousandths(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

fn printed_sigmas() -> Finding {
    let (left, right) = (TABLE_1.left.std, TABLE_1.right.std);
    let sigma = TABLE_2_DIRECT.sensitivity.map(|printed| printed.sigma.unwrap_or(f64::NAN));
    let doubled = Wheels { left: to_thousandths(2.0 * left), right: to_thousandths(2.0 * right) };
    // Both are rounded to the same digit: compared exactly.
    let swapped = doubled.left == sigma.right && doubled.right == sigma.left;
    let verdict =
        if swapped { "table 2 prints 2σ with left and right swapped" } else { "no rule that was tried connects them" };
    Finding {
        id: "sigma_of_table_2",
        printed: format!("table 2: σ of C_R {}, of C_L {} mm/pulse", sigma.right, sigma.left),
        derived: format!(
            "table 1: σ_L {left}, σ_R {right}; doubled and rounded {} and {}",
            doubled.left, doubled.right
        ),
        separation: Some((sigma.right / right, "times table 1's σ_R")),
        meaning: verdict.to_owned(),
    }
}

fn umbmark_base(base: &Scenario, table_2: &Table2) -> Result<Finding, SimulationError> {
    let (sensitivity, base_mm) = noise_free_umbmark(base, Form::X)?;
    let (_, base_y_mm) = noise_free_umbmark(base, Form::Y)?;
    let away = table_2.cell("umbmark", "B").map(|cell| (cell.away, "simulated standard deviations"));
    let published = TABLE_2_UMBMARK.base.value;
    Ok(Finding {
        id: "wheelbase_of_umbmark",
        printed: format!(
            "UMBmark: C_L {:.4}, C_R {:.4}, B {published} mm",
            TABLE_2_UMBMARK.sensitivity.left.value, TABLE_2_UMBMARK.sensitivity.right.value
        ),
        derived: format!(
            "from the direct parameters, noise-free: C_L {:.5}, C_R {:.5}, B {base_mm:.2} mm (y form: {base_y_mm:.2} mm)",
            sensitivity.left, sensitivity.right
        ),
        separation: away,
        meaning: format!(
            "a scale error of 3.3 % turns every corner 3.3 % too far, and UMBmark must read a short wheelbase; the paper measured {:.1} mm more than its own \
             parameters predict",
            published - base_mm
        ),
    })
}

fn umbmark_ratio(table_2: &Table2) -> Finding {
    let umbmark = TABLE_2_UMBMARK.sensitivity;
    let measured = umbmark.right.value / umbmark.left.value;
    let direct = TABLE_1.right.mean / TABLE_1.left.mean;
    let relative_var =
        |shape: super::shape::SampleShape| shape.variance / shape.count as f64 / (shape.mean * shape.mean);
    let error = (relative_var(TABLE_1.left) + relative_var(TABLE_1.right)).sqrt();
    // UMBmark's own scatter, from the simulation of table 2: the ratio moves by twice a sensitivity's error,
    // the mean being kept.
    let own = table_2.cell("umbmark", "C_L").map_or(0.0, |cell| 2.0 * cell.sigma);
    Finding {
        id: "wheel_ratio_of_umbmark",
        printed: format!("UMBmark: E_d = C_R/C_L = {measured:.5}"),
        derived: format!(
            "table 1: {direct:.5} ± {error:.5} (standard errors of its means); UMBmark's own simulated scatter is {own:.5}"
        ),
        separation: Some(((direct - measured) / error, "standard errors of table 1's means")),
        meaning: format!(
            "with UMBmark's scatter joined the two are {:.1} standard deviations apart",
            (direct - measured) / error.hypot(own)
        ),
    }
}

/// (14) taken as printed, θ = 2π + asin[…], on a clockwise spin that turns 3.3 % too far.
fn clockwise_spins(base: &Scenario) -> Finding {
    let scale = 0.5 * (TABLE_1.left.mean + TABLE_1.right.mean);
    let base_mm = base.robot.wheel_separation_m * MM_PER_M;
    let turn_rad = std::f64::consts::TAU * scale;
    let printed_mm = |direction: f64| {
        let residual_rad = wrap_to_pi(direction * turn_rad).sin().asin();
        base_mm * turn_rad / (std::f64::consts::TAU + residual_rad)
    };
    let (counter_clockwise_mm, clockwise_mm) = (printed_mm(1.0), printed_mm(-1.0));
    Finding {
        id: "clockwise_spins_by_eq_14",
        printed: "θ = 2π + asin[…] for every spin (eq. 14)".to_owned(),
        derived: format!(
            "a spin 3.3 % too far gives B = {counter_clockwise_mm:.1} mm counter-clockwise and {clockwise_mm:.1} mm clockwise"
        ),
        separation: Some((clockwise_mm - counter_clockwise_mm, "mm")),
        meaning:
            "clockwise it is −2π + asin[…]; with signed counts and angles B = (C_R ΔN_R − C_L ΔN_L)/θ holds for both"
                .to_owned(),
    }
}

fn folding_arcsine() -> Finding {
    let turn_rad = 100.0_f64.to_radians();
    let folded_deg = turn_rad.sin().asin().to_degrees();
    Finding {
        id: "folding_arcsine",
        printed: "Δθ = asin[…]/(d+m1+m2)² (eq. 8, 14)".to_owned(),
        derived: format!("a residual turn of 100° comes out as {folded_deg:.1}°"),
        separation: Some((100.0 - folded_deg, "degrees at 100°")),
        meaning: "the two-argument arctangent of cross and dot product does not fold, and needs no m1+m2+d".to_owned(),
    }
}

/// (6) with chords taken without sign, on the paper's robot driving 500 mm backward.
fn unsigned_chords(base: &Scenario) -> Finding {
    let half_m = 0.5 * base.robot.wheel_separation_m;
    let outside_m = base.robot.points.iter().map(|mark| mark.y_m).fold(0.0, f64::max) - half_m;
    let (left_m, right_m) = (-0.5 * TABLE_1.left.mean, -0.5 * TABLE_1.right.mean);
    let increment = Increment::from_travel(Wheels { left: left_m, right: right_m }, base.robot.wheel_separation_m);
    let mark = Point::new(0.0, half_m + outside_m);
    let chord_m = (increment.arc() * mark).distance_m(Pose::IDENTITY * mark);
    let printed_m = chord_m / sinc(0.5 * increment.turn_rad) + outside_m * increment.turn_rad;
    let percent = 100.0 * (printed_m / left_m.abs() - 1.0);
    Finding {
        id: "unsigned_chords_of_eq_6",
        printed: "S_L = L_L/sinc(Δθ/2) + m2 Δθ with a length L_L (eq. 6)".to_owned(),
        derived: format!("backward, with m2 = {:.0} mm, C_L comes out {percent:+.3} % off", outside_m * MM_PER_M),
        separation: Some((percent, "%")),
        meaning: "the chord must carry the sign of the direction of travel".to_owned(),
    }
}

/// n runs, of which each wheel loses some to the outlier rule: what leaves 79 and 82.
fn runs_before_rejection() -> Finding {
    let (left, right) = (TABLE_1.left.count, TABLE_1.right.count);
    let log_likelihood = |runs: usize| {
        let lost = [runs - left, runs - right];
        let share = lost.iter().sum::<usize>() as f64 / (2 * runs) as f64;
        lost.iter().map(|lost| log_binomial(runs, *lost, share)).sum::<f64>()
    };
    let best = (right..=right + 20).max_by(|a, b| log_likelihood(*a).total_cmp(&log_likelihood(*b))).unwrap_or(right);
    let within: Vec<usize> =
        (right..=right + 60).filter(|runs| log_likelihood(best) - log_likelihood(*runs) < 2.0).collect();
    let (low, high) = (within.first().copied().unwrap_or(best), within.last().copied().unwrap_or(best));
    let share = 100.0 * (2 * best - left - right) as f64 / (2 * best) as f64;
    Finding {
        id: "runs_before_rejection",
        printed: format!("{left} left and {right} right values; how many were measured is not said"),
        derived: format!(
            "if both wheels lose the same share by chance, {best} runs with {share:.1} % rejected make it likeliest; {low} to {high} runs are within 2 of it in \
             log likelihood"
        ),
        separation: None,
        meaning: "a rule that cuts at 3.5 robust standard deviations takes about 0.05 % of normal values: what was rejected were real outliers".to_owned(),
    }
}

fn log_binomial(n: usize, k: usize, share: f64) -> f64 {
    let log_choose: f64 = (1..=k).map(|j| ((n - k + j) as f64 / j as f64).ln()).sum();
    let term = |count: usize, share: f64| if count == 0 { 0.0 } else { count as f64 * share.ln() };
    log_choose + term(k, share) + term(n - k, 1.0 - share)
}

fn pulses_of_a_turn(base: &Scenario) -> Finding {
    let circumference_mm = std::f64::consts::PI * base.robot.left_wheel_diameter_m * MM_PER_M;
    Finding {
        id: "pulses_of_a_turn",
        printed: "160 mm wheels and a nominal C of 1 mm/pulse".to_owned(),
        derived: format!(
            "{circumference_mm:.2} pulses a turn; with 500 the nominal would be {:.4} mm/pulse",
            circumference_mm / 500.0
        ),
        separation: None,
        meaning:
            "the pulse is a rounded number of finer counts: at 1 mm a count the controller could not command the speeds"
                .to_owned(),
    }
}

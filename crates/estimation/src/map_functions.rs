//! A Gaussian process over the places of a map as a sum of functions with independent coefficients of
//! variance 1: its covariance is e^{−d²/2ℓ²} between places that are d apart.
//!
//! Where the places cover few lengths ℓ these are the columns of the incomplete Cholesky factor of their
//! covariance, the place with the largest remaining variance first (Fine & Scheinberg 2001): as few as the
//! places need, and right at every distance and in every direction. Where they are too many, waves at
//! quantiles of the process's spectrum (Rahimi & Recht 2007), which are right on average over directions.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::rc::Rc;

use kinematics::sin_cos;

use crate::settings::MAP;

/// One of the functions.
#[derive(Debug, Clone)]
pub(crate) enum MapFunction {
    /// A column of the factor.
    OfPlaces { factor: Rc<Factor>, column: usize },
    /// A cosine or a sine of w·p.
    Wave { per_m: [f64; 2], phase_rad: f64, amplitude: f64 },
}

impl MapFunction {
    /// Its value at a place in metres; of columns, at one of the places that they were made for.
    pub(crate) fn at(&self, place: [f64; 2]) -> f64 {
        match self {
            Self::OfPlaces { factor, column } => factor.at(place, *column),
            Self::Wave { per_m, phase_rad, amplitude } => {
                amplitude * sin_cos(per_m[0] * place[0] + per_m[1] * place[1] + phase_rad).1
            }
        }
    }
}

/// The incomplete Cholesky factor of the covariance of places. Places within a cell are one.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    cell_m: f64,
    rows: BTreeMap<[i64; 2], Vec<f64>>,
}

impl Factor {
    fn at(&self, place: [f64; 2], column: usize) -> f64 {
        self.rows.get(&cell(place, self.cell_m)).and_then(|row| row.get(column)).copied().unwrap_or(0.0)
    }
}

fn cell(place: [f64; 2], cell_m: f64) -> [i64; 2] {
    place.map(|m| (m / cell_m).floor() as i64)
}

/// The functions for places, metres, of a process of a correlation length.
pub(crate) fn map_functions(places: impl Iterator<Item = [f64; 2]>, length_m: f64) -> Vec<MapFunction> {
    let Some(factor) = factor(places, length_m) else { return waves(length_m) };
    let columns = factor.rows.values().next().map_or(0, Vec::len);
    let factor = Rc::new(factor);
    (0..columns).map(|column| MapFunction::OfPlaces { factor: Rc::clone(&factor), column }).collect()
}

/// The factor; `None` where places need more than `max_map_functions` columns.
fn factor(places: impl Iterator<Item = [f64; 2]>, length_m: f64) -> Option<Factor> {
    let cell_m = length_m / MAP.map_cells_per_length;
    let mut cells: BTreeSet<[i64; 2]> = BTreeSet::new();
    for place in places {
        cells.insert(cell(place, cell_m));
        if cells.len() > MAP.max_map_cells {
            return None;
        }
    }
    let cells: Vec<[i64; 2]> = cells.into_iter().collect();
    let covariance = |a: [i64; 2], b: [i64; 2]| {
        let squared_m2: f64 = (0..2).map(|k| ((a[k] as f64 - b[k] as f64) * cell_m).powi(2)).sum();
        (-0.5 * squared_m2 / (length_m * length_m)).exp()
    };
    let (mut left, mut factor) = (vec![1.0_f64; cells.len()], vec![Vec::new(); cells.len()]);
    let largest = |left: &[f64]| {
        let pivot = (0..left.len()).max_by(|a, b| left[*a].total_cmp(&left[*b]))?;
        (left[pivot] > MAP.max_map_remainder).then_some(pivot)
    };
    while let Some(pivot) = largest(&left) {
        let of_pivot: Vec<f64> = factor[pivot].clone();
        if of_pivot.len() == MAP.max_map_functions {
            return None;
        }
        let root = left[pivot].sqrt();
        for (at, row) in factor.iter_mut().enumerate() {
            let explained: f64 = row.iter().zip(&of_pivot).map(|(a, b): (&f64, &f64)| a * b).sum();
            let own = (covariance(cells[at], cells[pivot]) - explained) / root;
            row.push(own);
            left[at] -= own * own;
        }
    }
    // What is left of a place's variance goes with what is known of it.
    for row in &mut factor {
        let norm = row.iter().map(|own| own * own).sum::<f64>().sqrt();
        row.iter_mut().for_each(|own| *own /= norm);
    }
    Some(Factor { cell_m, rows: cells.into_iter().zip(factor).collect() })
}

/// Waves at quantiles of the spectrum.
fn waves(length_m: f64) -> Vec<MapFunction> {
    let n = f64::from(MAP.map_waves);
    let of = |k: u32| {
        // Quantiles of the length of w: Rayleigh over ℓ.
        let length_per_m = (-2.0 * (1.0 - (f64::from(k) + 0.5) / n).ln()).sqrt() / length_m;
        let (sin, cos) = sin_cos(f64::from(k) * MAP.golden_angle_rad);
        let per_m = [length_per_m * cos, length_per_m * sin];
        [0.0, 0.25 * TAU].map(|phase_rad| MapFunction::Wave { per_m, phase_rad, amplitude: n.sqrt().recip() })
    };
    (0..MAP.map_waves).flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariance(functions: &[MapFunction], a: [f64; 2], b: [f64; 2]) -> f64 {
        functions.iter().map(|function| function.at(a) * function.at(b)).sum()
    }

    fn stated(a: [f64; 2], b: [f64; 2], length_m: f64) -> f64 {
        (-0.5 * ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)) / (length_m * length_m)).exp()
    }

    #[test]
    fn places_have_the_stated_covariance_at_every_distance() {
        // A straight of 6 m and a square of 2 m beside it, with a length of 0.8 m.
        let straight = (0..=120).map(|k| [0.05 * f64::from(k) - 3.0, 0.2]);
        let side = (0..=20).map(|k| 0.1 * f64::from(k));
        let square = side.flat_map(|m| [[m, -2.0], [m, -4.0], [0.0, -2.0 - m], [2.0, -2.0 - m]]);
        let places: Vec<[f64; 2]> = straight.chain(square).collect();
        let functions = map_functions(places.iter().copied(), 0.8);
        let mut worst = 0.0_f64;
        for a in &places {
            assert!((covariance(&functions, *a, *a) - 1.0).abs() < 1e-12);
            for b in &places {
                worst = worst.max((covariance(&functions, *a, *b) - stated(*a, *b, 0.8)).abs());
            }
        }
        // A cell of a sixteenth of a length moves the covariance by its slope, 0.61 a length, times 0.06, and
        // the remainder by 0.01. Rejects waves, of which 24 are off by 0.2 at 6 m.
        assert!(worst < 0.05, "{worst}");
        // Fewer than the lengths squared that are covered would need twice each. Rejects a place a function.
        assert!((10..60).contains(&functions.len()), "{}", functions.len());
    }

    #[test]
    fn waves_make_the_stated_covariance_of_a_hall() {
        // 40 m × 40 m, a length of 0.5 m: more than are factored.
        let places = (0..6400).map(|k| [0.5 * f64::from(k % 80), 0.5 * f64::from(k / 80)]);
        let functions = map_functions(places, 0.5);
        assert_eq!(functions.len(), 2 * MAP.map_waves as usize);
        let (here, mut worst) = ([3.0, -1.0], 0.0_f64);
        for k in 0..40 {
            let (distance_m, direction_rad) = (0.025 * f64::from(k), 0.7 * f64::from(k));
            let there = [here[0] + distance_m * direction_rad.cos(), here[1] + distance_m * direction_rad.sin()];
            worst = worst.max((covariance(&functions, here, there) - stated(here, there, 0.5)).abs());
        }
        // The mean of 64 cosines at quantiles of the spectrum: some dozens of directions for each length
        // leave 1/64 of each. Rejected: the spectrum of e^{−d²/ℓ²}, off by 0.24, and waves along x alone.
        assert!(worst < 0.05, "{worst}");
    }

    #[test]
    fn two_places_have_the_covariance_of_their_distance() {
        // Cells are sixteenths of a length: distances of whole cells are exact. A place in every direction.
        let length_m = 0.5;
        for [x, y] in [[16.0, 0.0], [0.0, 16.0], [-8.0, 24.0], [-3.0, -4.0], [32.0, 32.0]] {
            // In the middle of a cell, far from the origin.
            let a = [7.0 + 0.5 / 32.0, -3.0 + 0.5 / 32.0];
            let b = [a[0] + x / 32.0, a[1] + y / 32.0];
            let functions = map_functions([a, b].into_iter(), length_m);
            assert_eq!(functions.len(), 2, "{x} {y}");
            let on_paper = stated(a, b, length_m);
            // The rounding of a dozen products.
            assert!((covariance(&functions, a, b) - on_paper).abs() < 1e-12, "{x} {y}");
            assert!((covariance(&functions, a, a) - 1.0).abs() < 1e-12);
            assert!((covariance(&functions, b, b) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn places_further_apart_than_whole_numbers_are_independent() {
        let functions = map_functions([[-1e300, 0.0], [1e300, 0.0]].into_iter(), 0.8);
        assert_eq!(functions.len(), 2);
        assert_eq!(covariance(&functions, [-1e300, 0.0], [1e300, 0.0]), 0.0);
        assert_eq!(covariance(&functions, [1e300, 0.0], [1e300, 0.0]), 1.0);
    }

    #[test]
    fn places_in_one_cell_are_one_and_others_have_no_value() {
        let functions = map_functions([[0.01, 0.01], [0.02, 0.03], [0.02, 0.01]].into_iter(), 0.8);
        assert_eq!(functions.len(), 1);
        assert_eq!((functions[0].at([0.04, 0.049]), functions[0].at([0.06, 0.0])), (1.0, 0.0));
        // Cells do not meet about the origin. Rejects a rounding towards it.
        assert_eq!(functions[0].at([-0.01, 0.01]), 0.0);
        assert_eq!(map_functions(std::iter::empty(), 0.8).len(), 0);
    }

    #[test]
    fn a_place_of_which_a_hundredth_is_left_has_no_function_of_its_own() {
        // Two places d apart: 1 − e^{−d²/ℓ²} is left of the second. A sixteenth of a length leaves 0.0039,
        // two leave 0.0155, and a hundredth is the limit.
        let functions = |cells: f64| {
            let places = [[0.5 / 16.0, 0.5 / 16.0], [(0.5 + cells) / 16.0, 0.5 / 16.0]];
            let functions = map_functions(places.into_iter(), 1.0);
            (
                functions.len(),
                covariance(&functions, places[0], places[1]),
                covariance(&functions, places[1], places[1]),
            )
        };
        // With one function both are the same place, with all of its variance.
        assert_eq!(functions(1.0), (1, 1.0, 1.0));
        let (two, of_both, _) = functions(2.0);
        assert!(two == 2 && (of_both - f64::exp(-0.5 / 64.0)).abs() < 1e-12, "{two} {of_both}");
    }

    #[test]
    fn a_wave_is_a_cosine_along_its_direction() {
        let wave = MapFunction::Wave { per_m: [2.0, -3.0], phase_rad: 0.4, amplitude: 5.0 };
        // 2 · 0.3 − 3 · 0.7 + 0.4. Products of a few numbers, each rounded.
        assert!((wave.at([0.3, 0.7]) - 5.0 * (-1.1_f64).cos()).abs() < 1e-12, "{}", wave.at([0.3, 0.7]));
    }

    #[test]
    fn waves_have_the_spectrum_of_the_process_and_spread_over_directions() {
        let length_m = 0.5;
        let all = waves(length_m);
        let of = |function: &MapFunction| match function {
            MapFunction::Wave { per_m, phase_rad, amplitude } => (*per_m, *phase_rad, *amplitude),
            MapFunction::OfPlaces { .. } => panic!("no wave"),
        };
        let n = f64::from(MAP.map_waves);
        let (mut squares, mut mixed, mut lengths) = ([0.0; 2], 0.0, Vec::new());
        for pair in all.chunks(2) {
            let [(per_m, start, amplitude), (other, quarter, of_other)] = [of(&pair[0]), of(&pair[1])];
            // A sine and a cosine of one wave, so that every place has the same variance.
            assert!(per_m == other && amplitude == of_other && (amplitude * amplitude * n - 1.0).abs() < 1e-12);
            assert!(((quarter - start) - 0.25 * TAU).abs() < 1e-12);
            squares = [0, 1].map(|k| squares[k] + per_m[k] * per_m[k] / n);
            mixed += per_m[0] * per_m[1] / n;
            // Each turns on from the one before by π (3 − √5), whatever the length.
            let direction_rad = lengths.len() as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
            let length_per_m = per_m[0].hypot(per_m[1]);
            // Angles of up to 150 rad, rounded.
            assert!((per_m[0] - length_per_m * direction_rad.cos()).abs() < 1e-11 * length_per_m);
            assert!((per_m[1] - length_per_m * direction_rad.sin()).abs() < 1e-11 * length_per_m);
            lengths.push(length_per_m * length_m);
        }
        // The curvature of the covariance at 0 is E w wᵀ = 1/ℓ²; 64 quantiles leave 2 % of the tail, and
        // directions some per cent.
        assert!(squares.iter().all(|of| (of * length_m * length_m - 1.0).abs() < 0.1), "{squares:?}");
        assert!((mixed * length_m * length_m).abs() < 0.1, "{mixed}");
        // Rayleigh: half of the lengths are below √(2 ln 2), a quarter below √(2 ln 4/3).
        for (share, quantile) in [(0.5, 2.0_f64.ln()), (0.25, (4.0_f64 / 3.0).ln())] {
            let below = lengths.iter().filter(|length| **length < (2.0 * quantile).sqrt()).count();
            assert_eq!(below as f64, share * n, "{share}");
        }
    }
}

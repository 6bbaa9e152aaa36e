//! The paper's figures 4, 6 and 7, drawn from the reproduction.

use kinematics::{Side, Wheels};
use report::{Axis, Colour, Figure, Marks, Panel, Series};

use super::Reproduction;
use super::figures::{STEPS_A_TURN, TURNS};
use super::published::TABLE_1;

/// Width of a histogram's bin, mm/pulse: about the published σ over two.
const BIN: f64 = 0.001;

/// Left edge of the first bin; every value of both wheels lies right of it.
const FIRST_EDGE: f64 = 1.0245;

/// Bins of a histogram.
const BINS: usize = 18;

impl Reproduction {
    /// File stem, text for who does not see it, and drawing of each figure.
    #[must_use]
    pub fn pictures(&self) -> Vec<(&'static str, &'static str, Figure)> {
        vec![
            ("paper-figure-4", "Contacts and centre of a spinning robot over three turns", self.draw_4()),
            (
                "paper-figure-6",
                "Histograms of both wheels' sensitivities with the published normal curves",
                self.draw_6(),
            ),
            (
                "paper-figure-7",
                "The 40 m path by its readings and by odometry, and the error against distance",
                self.draw_7(),
            ),
        ]
    }

    fn draw_4(&self) -> Figure {
        // One turn: the others lie upon it, and would fill the gaps of its dashes.
        let one_turn = |points: &[[f64; 2]]| {
            points.iter().take(STEPS_A_TURN as usize + 1).map(|[x, y]| (1e3 * x, 1e3 * y)).collect::<Vec<_>>()
        };
        let panel = Panel::new("", Axis::new("x", "mm"), Axis::new("y", "mm"))
            .equal_aspect()
            .series(Series::line("left contact", one_turn(&self.figure_4.left_m)))
            .series(Series::line("right contact", one_turn(&self.figure_4.right_m)))
            .series(Series::line("centre", one_turn(&self.figure_4.centre_m)));
        Figure::new("Figure 4: on unequal wheels each contact keeps its own circle, turn after turn")
            .caption(&format!(
                "The right wheel is drawn {:.0} % larger than the left one. All {TURNS} turns lie upon the one that is drawn; the centre goes round on a circle of its own.",
                100.0 * (self.figure_4.right_over_left - 1.0)
            ))
            .panel(panel)
    }

    fn draw_6(&self) -> Figure {
        let samples = Wheels { left: &self.figure_6.left, right: &self.figure_6.right };
        let mut figure = Figure::new("Figure 6: sensitivities of one simulated experiment")
            .caption(&format!(
                "scenarios/paper.toml, seed {}. Bars: one experiment under the measuring hypothesis. Curves: normal with the published mean and σ.",
                self.seed
            ))
            .columns(2);
        for side in Side::BOTH {
            let edges: Vec<f64> = (0..=BINS).map(|bin| FIRST_EDGE + BIN * bin as f64).collect();
            let mut heights = vec![0.0; BINS];
            for value in samples[side] {
                let bin = (((value - FIRST_EDGE) / BIN).max(0.0) as usize).min(BINS - 1);
                heights[bin] += 1.0;
            }
            let shape = TABLE_1[side];
            let total = shape.count as f64 * BIN;
            let curve: Vec<(f64, f64)> = (0..=100)
                .map(|k| {
                    let x = FIRST_EDGE + BIN * f64::from(k) / 100.0 * BINS as f64;
                    let z = (x - shape.mean) / shape.std;
                    (x, total * (-0.5 * z * z).exp() / (shape.std * std::f64::consts::TAU.sqrt()))
                })
                .collect();
            let title = if side == Side::Left { "Left wheel" } else { "Right wheel" };
            let panel =
                Panel::new(title, Axis::new("sensitivity", "mm/pulse"), Axis::dimensionless("runs").include(0.0))
                    .series(Series::new("simulated", Marks::Bars { edges, heights }).colour(Colour::SkyBlue))
                    .series(Series::line("published normal", curve).colour(Colour::Vermilion));
            // Both panels have the same series: one legend names them.
            figure = figure.panel(if side == Side::Left { panel.without_legend() } else { panel });
        }
        figure
    }

    fn draw_7(&self) -> Figure {
        let pairs = |points: &[[f64; 2]]| points.iter().map(|[x, y]| (*x, *y)).collect::<Vec<_>>();
        let mut path = Panel::new("One experiment", Axis::new("x", "m"), Axis::new("y", "m"))
            .equal_aspect()
            .series(Series::line("read on the floor", pairs(&self.figure_7.read_m)).colour(Colour::Black));
        let mut error = Panel::new("Position error", Axis::new("distance", "m"), Axis::new("error", "m").include(0.0))
            .without_legend();
        let distance_m = &self.figure_7.distance_m;
        let along = |values: &[f64]| distance_m.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
        for method in &self.figure_7.methods {
            path = path.series(Series::line(method.method, pairs(&method.reckoned_m)));
            let band = Marks::Band { x: distance_m.clone(), low: method.low_m.clone(), high: method.high_m.clone() };
            error = error
                .series(Series::new(method.method, band))
                .series(Series::line(method.method, along(&method.median_m)));
        }
        Figure::new("Figure 7: 40 m with eight quarter turns")
            .caption(&format!(
                "scenarios/paper.toml, seed {}, {} experiments. Odometry under each method's estimates of the same experiment and under the values that table 2 prints. Lines: median error; bands: 95 % of the \
                 experiments. The claim of 10 % would be 4 m at the end.",
                self.seed, self.trials
            ))
            .columns(2)
            .panel(path)
            .panel(error)
    }
}

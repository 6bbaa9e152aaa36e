//! Writes one figure of each kind into the folder given as argument: `cargo run -p report --example gallery
//! -- FOLDER`.
//!
//! The numbers are made up by closed formulas, so that the pictures are always the same.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use report::{Axis, Figure, Marks, Panel, Range, ReportError, Scale, Series};

type Pairs = Vec<(f64, f64)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: gallery FOLDER")?;
    write_all(Path::new(&folder))?;
    Ok(())
}

fn write_all(folder: &Path) -> Result<(), ReportError> {
    let figures = [
        ("sweep", sweep()),
        ("histogram", histogram()),
        ("path", path()),
        ("distance", distance()),
        ("contact", contact()),
        ("residuals", residuals()),
        ("crowded", crowded()),
    ];
    figures.iter().try_for_each(|(stem, figure)| figure.write(folder, stem).map(|_| ()))
}

/// A number between −1 and 1 that looks random.
fn wobble(k: usize, stream: u32) -> f64 {
    let x = (k as f64 * 12.9898 + f64::from(stream) * 78.233).sin() * 43_758.545;
    2.0 * (x - x.floor()) - 1.0
}

/// Roughly normal with standard deviation 1.
fn normal(k: usize, stream: u32) -> f64 {
    (0..12).map(|part| wobble(k, 12 * stream + part)).sum::<f64>() / 2.0
}

fn sweep() -> Figure {
    let runs = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
    let methods = [("UMBmark", 1.6, 0.9), ("UMBmark, corrected", 0.3, 1.0), ("maximum likelihood", 0.05, 0.55)];
    let runs_axis = || Axis::dimensionless("runs in each direction").scale(Scale::Log);
    let mut bias = Panel::new("Bias", runs_axis(), Axis::new("bias of the track", "mm"))
        .series(Series::new("no bias", Marks::HorizontalLine { y: 0.0 }))
        .without_legend();
    let mut sigma = Panel::new("Standard deviation", runs_axis(), Axis::new("σ of the track", "mm").scale(Scale::Log))
        .without_legend();
    let efficiency_axis = Axis::dimensionless("efficiency").include(0.0);
    let mut efficiency = Panel::new("Efficiency against the Cramér–Rao bound", runs_axis(), efficiency_axis)
        .series(Series::new("bound", Marks::HorizontalLine { y: 1.0 }))
        .without_legend();
    let coverage_axis = Axis::new("coverage", "%").range(Range::Fixed { low: 60.0, high: 100.0 });
    let mut coverage = Panel::new("Coverage of the 95 % interval", runs_axis(), coverage_axis)
        .series(Series::new("nominal 95 %", Marks::HorizontalLine { y: 95.0 }));
    for (m, (name, offset, spread)) in methods.into_iter().enumerate() {
        let stream = m as u32;
        let at = |k: usize| runs[k] * 1.04_f64.powi(m as i32 - 1);
        let sigma_at = |k: usize| spread / runs[k].sqrt();
        let values = |of: &dyn Fn(usize) -> f64| (0..runs.len()).map(|k| (at(k), of(k))).collect::<Pairs>();
        let with_error = |points: Pairs, error: &dyn Fn(usize) -> f64| {
            Series::new(name, Marks::Points { points, y_error: Some((0..runs.len()).map(error).collect()) })
        };
        let biases = values(&|k| offset + 0.12 * wobble(k, stream) * sigma_at(k));
        bias =
            bias.series(Series::line(name, biases.clone())).series(with_error(biases, &|k| 0.1 * sigma_at(k) + 0.02));
        let sigmas = values(&sigma_at);
        sigma = sigma.series(Series::line(name, sigmas.clone())).series(with_error(sigmas, &|k| 0.07 * sigma_at(k)));
        let efficiencies = values(&|k| (0.5 / spread).powi(2) * (1.0 + 0.05 * wobble(k, stream + 7)));
        efficiency =
            efficiency.series(Series::line(name, efficiencies.clone())).series(with_error(efficiencies, &|_| 0.06));
        let coverages = values(&|k| 95.0 - 9.0 * offset * runs[k].ln() / 2.0 + wobble(k, stream + 20));
        coverage = coverage.series(Series::line(name, coverages.clone())).series(with_error(coverages, &|_| 1.4));
    }
    Figure::new("What more runs buy, by method")
        .caption(
            "Sweep of runs from 1 to 50; scenario examples/sweep.toml, seed 7, 200 trials a point. Bars: Monte-Carlo standard error. Points of one \
             abscissa are set apart by 4 %.",
        )
        .columns(2)
        .panel(bias)
        .panel(sigma)
        .panel(efficiency)
        .panel(coverage)
}

fn histogram() -> Figure {
    let (mean, sigma, width) = (0.35, 1.1, 0.25);
    let edges: Vec<f64> = (0..=32).map(|k| -4.0 + f64::from(k) * width).collect();
    let trials: Vec<f64> = (0..1000).map(|k| mean + sigma * normal(k, 3)).collect();
    let count = |pair: &[f64]| trials.iter().filter(|&&error| error >= pair[0] && error < pair[1]).count() as f64;
    let heights = edges.windows(2).map(count).collect();
    let curve = (0..=200).map(|k| {
        let x = -4.0 + f64::from(k) * 0.04;
        (x, 1000.0 * width * (-0.5 * ((x - mean) / sigma).powi(2)).exp() / (sigma * TAU.sqrt()))
    });
    let panel = Panel::new("", Axis::new("error of the estimated track", "mm"), Axis::dimensionless("trials"))
        .series(Series::new("estimates", Marks::Bars { edges, heights }))
        .series(Series::line("normal curve", curve))
        .series(Series::new("truth", Marks::VerticalLine { x: 0.0 }))
        .series(Series::new("mean", Marks::VerticalLine { x: mean }));
    Figure::new("Distribution of the estimates")
        .caption("1000 trials, scenario examples/paper.toml, seed 7.")
        .panel(panel)
}

/// A 4 m × 4 m square, driven two and a half times.
fn square(scale_error: f64, turn_error_rad: f64, stream: u32) -> Pairs {
    let (mut x, mut y, mut theta_rad) = (0.0, 0.0, 0.0_f64);
    let mut points = vec![(x, y)];
    for k in 0..400 {
        let step_m = 0.1 * (1.0 + scale_error);
        theta_rad += turn_error_rad / 40.0 + 4e-4 * normal(k, stream);
        if k > 0 && k % 40 == 0 {
            theta_rad += PI / 2.0;
        }
        x += step_m * theta_rad.cos();
        y += step_m * theta_rad.sin();
        points.push((x, y));
    }
    points
}

fn path() -> Figure {
    let truth = square(0.0, 0.01, 1);
    let last = |points: &Pairs| points.last().copied();
    let (nominal, calibrated) = (square(0.01, -0.05, 2), square(0.001, 0.008, 3));
    let ends = [&truth, &nominal, &calibrated].into_iter().filter_map(last);
    let panel = Panel::new("", Axis::new("x", "m"), Axis::new("y", "m"))
        .series(Series::line("truth", truth.clone()).colour(report::Colour::Black))
        .series(Series::line("dead reckoning, nominal", nominal.clone()))
        .series(Series::line("dead reckoning, calibrated", calibrated.clone()))
        .series(Series::points("after 40 m", ends))
        .equal_aspect();
    Figure::new("A path of 40 m in the plane").caption("Scenario examples/paper.toml, seed 7, trial 0.").panel(panel)
}

fn distance() -> Figure {
    let x: Vec<f64> = (0..=80).map(|k| 0.5 * f64::from(k)).collect();
    let mut panel = Panel::new(
        "",
        Axis::new("distance driven", "m").range(Range::Fixed { low: 0.0, high: 40.0 }),
        Axis::new("position error", "mm").include(0.0),
    );
    for (name, rate, power, spread) in
        [("nominal", 0.9, 1.5, 0.35), ("UMBmark", 2.5, 0.8, 0.3), ("maximum likelihood", 1.0, 0.8, 0.25)]
    {
        let mean = |x: f64| rate * x.powf(power);
        let edge = |side: f64| x.iter().map(|&x| mean(x) * (1.0 + side * spread)).collect::<Vec<_>>();
        panel = panel
            .series(Series::new(name, Marks::Band { x: x.clone(), low: edge(-1.0), high: edge(1.0) }))
            .series(Series::line(name, x.iter().map(|&x| (x, mean(x)))));
    }
    Figure::new("Error against distance")
        .caption("Lines: median of 200 trials; bands: from the 16th to the 84th percentile. Scenario examples/paper.toml, seed 7.")
        .panel(panel)
}

fn contact() -> Figure {
    let wheel = |side: f64, stream: u32| {
        (0..=72).map(move |k| {
            let turn_rad = f64::from(k) / 72.0 * TAU;
            let scatter = if stream == 0 { 0.0 } else { 0.15 * wobble(k as usize, stream) };
            (
                1.5 * turn_rad.cos() + scatter,
                side * 130.0 + 6.0 * turn_rad.sin() + 0.4 * (3.0 * turn_rad).cos() + scatter,
            )
        })
    };
    let axes = |centre: f64| {
        let x = Axis::new("forward of the axle", "mm").range(Range::Fixed { low: -10.0, high: 10.0 });
        (x, Axis::new("left of the middle", "mm").range(Range::Fixed { low: centre - 10.0, high: centre + 10.0 }))
    };
    let panel = |title: &str, side: f64, stream: u32| {
        let (x, y) = axes(130.0 * side);
        Panel::new(title, x, y)
            .series(Series::points("contact point", wheel(side, stream)))
            .series(Series::line("fitted locus", wheel(side, 0).map(|(x, y)| (x * 1.02, y))))
            .series(Series::new("nominal", Marks::HorizontalLine { y: 130.0 * side }))
            .series(Series::new("axle", Marks::VerticalLine { x: 0.0 }))
            .equal_aspect()
    };
    Figure::new("Where the wheels touch the floor")
        .caption("Locus over one turn of the wheel; scenario examples/warped.toml, seed 7.")
        .columns(2)
        .panel(panel("Left wheel", 1.0, 1))
        .panel(panel("Right wheel", -1.0, 2))
}

fn residuals() -> Figure {
    let speed = |k: usize| 0.05 + 0.45 * (wobble(k, 5) + 1.0) / 2.0;
    let mean = |v: f64| 0.004 * (v - 0.25) - 3e-4;
    let cloud: Pairs = (0..600).map(|k| (speed(k), mean(speed(k)) + 6e-4 * normal(k, 6))).collect();
    let x: Vec<f64> = (0..=45).map(|k| 0.05 + 0.01 * f64::from(k)).collect();
    let edge = |side: f64| x.iter().map(|&v| mean(v) + side * (1e-4 + 6e-4 * (v - 0.275).abs())).collect::<Vec<_>>();
    let panel = Panel::new("", Axis::new("mean speed of the run", "m/s"), Axis::new("residual of the heading", "rad"))
        .series(Series::points("runs", cloud).colour(report::Colour::SkyBlue))
        .series(
            Series::new("local mean ± 2σ", Marks::Band { x: x.clone(), low: edge(-2.0), high: edge(2.0) })
                .colour(report::Colour::Vermilion),
        )
        .series(Series::line("local mean ± 2σ", x.iter().map(|&v| (v, mean(v)))))
        .series(Series::new("no effect", Marks::HorizontalLine { y: 0.0 }));
    Figure::new("Residual against speed: the slope is the effect that the model lacks")
        .caption("600 runs; scenario examples/slip.toml, seed 7.")
        .panel(panel)
}

/// Everything that could collide: three columns, long texts, close references, tiny and huge numbers, points
/// beyond a fixed range.
fn crowded() -> Figure {
    let waves = |number: usize, scale: f64| {
        (0..number).map(move |s| {
            Series::line(
                &format!("series {}", s + 1),
                (0..=40).map(move |k| (f64::from(k) * 1e-6, scale * (0.2 * f64::from(k) + s as f64).sin())),
            )
        })
    };
    let small = Panel::new(
        "A title that is much too long for a narrow panel",
        Axis::new("a time between ticks", "s"),
        Axis::new("a very long label of the ordinate of this small panel", "mm²/√m"),
    );
    let small = waves(7, 3e-4).fold(small, Panel::series);
    let close = Panel::new("Close references", Axis::new("x", "m"), Axis::new("y", "m"))
        .series(Series::line("line", [(0.0, 0.0), (1.0, 1.0)]))
        .series(Series::new("first bound", Marks::HorizontalLine { y: 0.50 }))
        .series(Series::new("second bound", Marks::HorizontalLine { y: 0.52 }))
        .series(Series::new("third bound", Marks::HorizontalLine { y: 0.97 }))
        .series(Series::new("nominal radius", Marks::VerticalLine { x: 0.50 }))
        .series(Series::new("estimated radius", Marks::VerticalLine { x: 0.55 }));
    let cut = Panel::new(
        "Beyond",
        Axis::new("count", "1").scale(Scale::Log),
        Axis::new("energy", "J").range(Range::Fixed { low: 0.0, high: 4e6 }),
    )
    .series(Series::new(
        "measured",
        Marks::Points {
            points: (0..9).map(|k| (10_f64.powi(k), 6e5 * f64::from(k))).collect(),
            y_error: Some(vec![5e5; 9]),
        },
    ));
    Figure::new("A figure in which everything that could collide is near something else, with a title of more than one line to see that it is broken")
        .caption("x < y & \"quotes\" are text.")
        .columns(3)
        .panel(small)
        .panel(close)
        .panel(cut)
}

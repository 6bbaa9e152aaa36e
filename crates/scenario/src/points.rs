//! The points of a sweep: its cases crossed with its axes, each a scenario.

use std::collections::BTreeSet;

use toml::Table;

use crate::axis::{self, Level, Levels};
use crate::error::ScenarioError;
use crate::experiment::Scenario;
use crate::sweep::{Case, Sweep};

/// The axis on which a point's case is named.
pub const CASE_AXIS: &str = "case";

/// One axis with the level that a point takes on it.
pub type Axis = (String, Level);

/// One point of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The case where there are cases, and the level on each axis in the order of the axes.
    pub levels: Vec<Axis>,
    /// The scenario with these levels.
    pub scenario: Scenario,
}

impl Sweep {
    /// All points: every case with every point of the axes, which are the full grid of their lists, the last
    /// axis varying fastest, or Sobol points in their ranges. One point where nothing is varied.
    ///
    /// # Errors
    /// [`ScenarioError::Axis`] when a key is not in the scenario or no number, and whatever makes a point's
    /// scenario invalid.
    pub fn points(&self, scenario: &Scenario, location: &str) -> Result<Vec<Point>, ScenarioError> {
        let text_error = |message: String| ScenarioError::Toml { location: location.to_owned(), message };
        self.check().map_err(text_error)?;
        let mut base = Table::try_from(scenario).map_err(|error| text_error(error.to_string()))?;
        let designs = self.designs(scenario.seed, &mut base, location)?;

        let mut points = Vec::with_capacity(self.cases.len().max(1) * designs.len());
        let no_case = [None];
        let some_cases: Vec<_> = self.cases.iter().map(Some).collect();
        for case in if some_cases.is_empty() { &no_case[..] } else { &some_cases[..] } {
            let mut table = base.clone();
            let mut levels = Vec::with_capacity(1 + self.axes.len());
            if let Some(case) = case {
                for (key, value) in &case.set {
                    axis::set(&mut table, key, *value).map_err(|problem| case.error(location, key, problem))?;
                }
                levels.push((CASE_AXIS.to_owned(), Level::Name(case.name.clone())));
            }
            for design in &designs {
                let (mut table, mut levels) = (table.clone(), levels.clone());
                for (key, level) in self.axes.keys().zip(design) {
                    axis::set(&mut table, key, *level).map_err(|problem| axis_error(location, key, problem))?;
                    levels.push((key.clone(), Level::Number(*level)));
                }
                let scenario: Scenario =
                    table.try_into().map_err(|error: toml::de::Error| text_error(error.message().to_owned()))?;
                scenario.check(location)?;
                points.push(Point { levels, scenario });
            }
        }
        Ok(points)
    }

    /// Levels of all axes, point by point.
    fn designs(&self, seed: u64, base: &mut Table, location: &str) -> Result<Vec<Vec<f64>>, ScenarioError> {
        let mut taken = BTreeSet::new();
        let mut designs = vec![Vec::new(); self.sobol.map_or(1, |sobol| sobol.points as usize)];
        for ((key, levels), number) in self.axes.iter().zip(0..) {
            let error = |problem: String| axis_error(location, key, problem);
            let (key_paths, whole) = axis::key_paths(base, key).map_err(error)?;
            for location in key_paths {
                if !taken.insert(location.clone()) {
                    return Err(error(format!("{location} is set twice, by this axis or by another")));
                }
            }
            match (levels, self.sobol) {
                (Levels::List(list), None) => {
                    if list.is_empty() {
                        return Err(error("it has no levels".to_owned()));
                    }
                    let crossed = |design: &Vec<f64>| {
                        let design = design.clone();
                        list.iter().map(move |level| design.iter().chain([level]).copied().collect())
                    };
                    designs = designs.iter().flat_map(crossed).collect();
                }
                (Levels::Range(range), Some(_)) => {
                    range.check(whole).map_err(error)?;
                    for (design, point) in designs.iter_mut().zip(0..) {
                        design.push(range.level(axis::sobol_share(seed, point, number), whole));
                    }
                }
                (Levels::List(_), Some(_)) => {
                    let range = "with [sweep.sobol] give a range, such as { from = 0.0, to = 0.002 }";
                    return Err(error(format!("a list of levels makes a grid; {range}")));
                }
                (Levels::Range(_), None) => {
                    let list = "without [sweep.sobol] give a list of levels, such as [0.0, 0.002]";
                    return Err(error(format!("a range is where Sobol points fall; {list}")));
                }
            }
        }
        for case in &self.cases {
            let mut taken = taken.clone();
            for key in case.set.keys() {
                let (key_paths, _) =
                    axis::key_paths(base, key).map_err(|problem| case.error(location, key, problem))?;
                if let Some(twice) = key_paths.into_iter().find(|location| !taken.insert(location.clone())) {
                    return Err(case.error(location, key, format!("{twice} is set twice, by this case or by an axis")));
                }
            }
        }
        Ok(designs)
    }
}

impl Case {
    fn error(&self, location: &str, key: &str, problem: String) -> ScenarioError {
        let key = format!("sweep case \"{}\": \"{key}\"", self.name);
        ScenarioError::Axis { location: location.to_owned(), key, problem }
    }
}

fn axis_error(location: &str, key: &str, problem: String) -> ScenarioError {
    ScenarioError::Axis { location: location.to_owned(), key: format!("sweep axis \"{key}\""), problem }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Levels;
    use motion_programs::Schedule;
    use std::collections::BTreeMap;

    fn empty() -> Sweep {
        Sweep {
            trials: 10,
            methods: vec!["direct".to_owned()],
            axes: BTreeMap::new(),
            sobol: None,
            cases: Vec::new(),
            protocols: BTreeMap::new(),
            validation: Vec::new(),
        }
    }

    fn paper(axes: &[(&str, &[f64])]) -> Scenario {
        let mut scenario = Scenario::parse(crate::shipped::PAPER, "paper.toml").expect("shipped");
        let axes = axes.iter().map(|(key, levels)| ((*key).to_owned(), Levels::List(levels.to_vec()))).collect();
        scenario.sweep = Some(Sweep { axes, ..empty() });
        scenario
    }

    fn points(axes: &[(&str, &[f64])]) -> Result<Vec<Point>, ScenarioError> {
        let scenario = paper(axes);
        scenario.sweep.as_ref().expect("set above").points(&scenario, "x.toml")
    }

    #[test]
    fn levels_reach_floats_integers_and_lists() {
        let points = points(&[
            ("effect.contact_patch_wheelbase.sigma_m", &[0.0, 0.002]),
            ("noise.wheel_sigma_m_per_sqrt_m", &[0.25]),
            ("protocol.0.runs", &[7.0, 8.0, 9.0]),
        ])
        .expect("all keys exist");
        assert_eq!(points.len(), 6);
        let last = &points[5];
        let levels: Vec<_> = last.levels.iter().map(|(_, level)| level.clone()).collect();
        assert_eq!(levels, [0.002, 0.25, 9.0].map(Level::Number));
        assert_eq!(last.scenario.noise.wheel_sigma_m_per_sqrt_m, 0.25);
        assert_eq!(last.scenario.programs().iter().filter(|program| program.id.starts_with("straight")).count(), 9);
        let effects::Effect::ContactPatchWheelbase(patch) = &last.scenario.effects[2] else {
            panic!("third in the file")
        };
        assert_eq!(patch.sigma_m, 0.002);
    }

    #[test]
    fn without_axes_there_is_one_point_the_scenario_itself() {
        let points = points(&[]).expect("valid");
        assert_eq!(points.len(), 1);
        assert_eq!(points[0].scenario, paper(&[]));
    }

    #[test]
    fn axes_that_do_not_fit_are_refused_with_what_is_there() {
        let error = |axes: &[(&str, &[f64])]| points(axes).expect_err("no such axis").to_string();
        assert!(error(&[("noise.grid", &[1.0])]).contains("wheel_sigma_m_per_sqrt_m"));
        assert!(error(&[("effect.wheelbase.ratio", &[1.0])]).contains("wheel_mismatch"));
        assert!(error(&[("name", &[1.0])]).contains("not a number"));
        assert!(error(&[("protocol.0.runs", &[1.5])]).contains("whole number"));
        assert!(error(&[("protocol.9.runs", &[1.0])]).contains("straights"));
        assert!(error(&[("engine.kind.x", &[1.0])]).contains("single value"));
        assert!(error(&[("seed", &[1.0])]).contains("same at every point"));
        assert!(error(&[("sweep.trials", &[9.0])]).contains("same at every point"));
        let many = [1.0; 200];
        let axes: [(&str, &[f64]); 2] = [("noise.sensitivity_sigma", &many), ("placement.half_width_m", &many)];
        assert!(error(&axes).contains("40000 points"));
        assert!(error(&[("noise.sensitivity_sigma", &[])]).contains("no levels"));
        assert!(error(&[("noise.sensitivity_sigma", &[-1.0])]).contains("0 or more"));
    }

    /// Paper's robot with another sweep.
    fn parse(sweep: &str) -> Result<Scenario, ScenarioError> {
        let text = crate::shipped::PAPER;
        let (head, _) = text.split_once("[sweep]").expect("the paper sweeps");
        Scenario::parse(&format!("{head}[sweep]\ntrials = 2\nmethods = [\"direct\"]\n{sweep}"), "x.toml")
    }

    fn points_of(sweep: &str) -> Vec<Point> {
        let scenario = parse(sweep).expect("valid");
        let written = scenario.to_toml().expect("has a TOML form");
        assert_eq!(Scenario::parse(&written, "written").expect("valid"), scenario);
        scenario.sweep.as_ref().expect("given").points(&scenario, "x.toml").expect("valid")
    }

    fn refusal(sweep: &str) -> String {
        let refusal = parse(sweep).expect_err("refused").to_string();
        assert!(refusal.starts_with("x.toml") && !refusal.contains('\n'), "{refusal}");
        refusal
    }

    fn number(point: &Point, axis: &str) -> f64 {
        match point.levels.iter().find(|(key, _)| key == axis) {
            Some((_, Level::Number(level))) => *level,
            other => panic!("{axis} has no number: {other:?}"),
        }
    }

    #[test]
    fn tied_keys_take_the_same_level() {
        let points = points_of(
            "[sweep.axes]\n\"robot.left_wheel_diameter_m, robot.right_wheel_diameter_m\" = [0.1, 0.2]\n\"robot.point.left.y_m\" = [0.3]",
        );
        assert_eq!(points.len(), 2);
        for (point, level) in points.iter().zip([0.1, 0.2]) {
            let robot = &point.scenario.robot;
            assert_eq!((robot.left_wheel_diameter_m, robot.right_wheel_diameter_m), (level, level));
            assert_eq!(robot.points[0].y_m, 0.3);
            assert_eq!(point.levels.len(), 2);
        }
    }

    const CASES: &str = r#"
        [[sweep.case]]
        name = "as built"
        [[sweep.case]]
        name = "wide, 30 runs"
        [sweep.case.set]
        "robot.wheel_separation_m" = 0.5
        "protocol.straights.runs, protocol.spins.runs" = 30
        [sweep.axes]
        "noise.wheel_sigma_m_per_sqrt_m" = [0.0, 0.001]
    "#;

    #[test]
    fn cases_are_crossed_with_the_axes_and_come_first() {
        let points = points_of(CASES);
        let names = points.iter().map(|point| point.levels[0].clone()).collect::<Vec<_>>();
        let case = |name: &str| (CASE_AXIS.to_owned(), Level::Name(name.to_owned()));
        let (built, wide) = (case("as built"), case("wide, 30 runs"));
        assert_eq!(names, [built.clone(), built, wide.clone(), wide]);
        let values = |point: &Point| {
            let scenario = &point.scenario;
            (scenario.robot.wheel_separation_m, scenario.noise.wheel_sigma_m_per_sqrt_m, scenario.programs().len())
        };
        assert_eq!(
            points.iter().map(values).collect::<Vec<_>>(),
            [(0.363, 0.0, 122), (0.363, 0.001, 122), (0.5, 0.0, 70), (0.5, 0.001, 70)]
        );
    }

    #[test]
    fn cases_that_say_nothing_sound_are_refused() {
        let with = |from: &str, to: &str| {
            assert!(CASES.contains(from));
            refusal(&CASES.replace(from, to))
        };
        assert!(with("as built", "wide, 30 runs").contains("names must differ"));
        assert!(with("as built", "").contains("empty name"));
        let unknown = with("robot.wheel_separation_m", "robot.wheel_separation_mm");
        assert!(unknown.contains("sweep case \"wide, 30 runs\": \"robot.wheel_separation_mm\": no "), "{unknown}");
        assert!(with("= 30\n", "= 30.5\n").contains("30.5 is not a whole number"));
        assert!(with("robot.wheel_separation_m", "noise.wheel_sigma_m_per_sqrt_m").contains("set twice"));
        assert!(with("protocol.straights.runs, ", "protocol.1.runs, ").contains("protocol.1.runs is set twice"));
        assert!(with("robot.wheel_separation_m\" = 0.5", "robot.wheel_separation_m\" = -1.0").contains("-1"));
        assert!(with("[sweep.case.set]", "[sweep.case.sets]").contains("`set`"));
        assert!(with("\"robot.wheel_separation_m\"", "robot.wheel_separation_m").contains("must be in quotes"));
        let twice = "[sweep.axes]\n\"effect.0.scale\" = [1.0]\n\"effect.wheel_scale.scale\" = [1.1]";
        assert!(refusal(twice).contains("effect.0.scale is set twice"));
    }

    const SOBOL: &str = r#"
        [sweep.sobol]
        points = 64
        [sweep.axes]
        "effect.contact_patch_wheelbase.sigma_m" = { from = 0.0, to = 0.002 }
        "noise.wheel_sigma_m_per_sqrt_m" = { from = 1e-4, to = 1e-2, scale = "log" }
        "protocol.spins.runs" = { from = 21, to = 36 }
    "#;

    /// Share of each axis of [`SOBOL`] below a level, in its own scale.
    fn shares(points: &[Point]) -> Vec<[f64; 3]> {
        points
            .iter()
            .map(|point| {
                let noise = number(point, "noise.wheel_sigma_m_per_sqrt_m");
                [
                    number(point, "effect.contact_patch_wheelbase.sigma_m") / 0.002,
                    (noise / 1e-4).ln() / 100_f64.ln(),
                    (number(point, "protocol.spins.runs") - 20.5) / 16.0,
                ]
            })
            .collect()
    }

    #[test]
    fn sobol_points_fill_every_axis_and_every_pair_of_axes_evenly() {
        let points = points_of(SOBOL);
        assert_eq!(points.len(), 64);
        let shares = shares(&points);
        for axis in 0..3 {
            // 64 cells of one axis (16 whole numbers for the last) hold one point each (four each). Random
            // points leave no cell empty once in 3e26.
            let cells = if axis == 2 { 16 } else { 64 };
            for cell in 0..cells {
                let within = |share: &&[f64; 3]| (share[axis] * f64::from(cells)).floor() == f64::from(cell);
                let held = shares.iter().filter(within).count();
                assert_eq!(held, 64 / cells as usize, "axis {axis}, cell {cell}");
            }
            // Every quarter of every pair of axes holds a quarter of the points: rejects axes that share a
            // dimension, whose points lie on a diagonal.
            for other in 0..axis {
                let held = shares.iter().filter(|share| share[axis] < 0.5 && share[other] < 0.5).count();
                assert_eq!(held, 16, "axes {other} and {axis}");
            }
        }
    }

    #[test]
    fn sobol_points_are_the_seeds_and_their_scenarios_hold_the_levels_as_printed() {
        let points = points_of(SOBOL);
        assert_eq!(points, points_of(SOBOL));
        for point in &points {
            let typed = |axis: &str| number(point, axis).to_string().parse::<f64>().expect("a number");
            let runs = point.scenario.programs().iter().filter(|program| program.id.starts_with("spin")).count();
            assert_eq!(f64::from(u32::try_from(runs).expect("few")), typed("protocol.spins.runs"));
            assert_eq!(point.scenario.noise.wheel_sigma_m_per_sqrt_m, typed("noise.wheel_sigma_m_per_sqrt_m"));
        }
        let mut other = parse(SOBOL).expect("valid");
        for seed in [other.seed + 1, other.seed + (1 << 32)] {
            other.seed = seed;
            let others = other.sweep.as_ref().expect("given").points(&other, "x.toml").expect("valid");
            assert!(points.iter().zip(&others).all(|(a, b)| a.levels != b.levels), "both words of the seed count");
        }
    }

    #[test]
    fn every_case_is_driven_at_the_same_sobol_points() {
        let points = points_of(
            &SOBOL
                .replace("[sweep.sobol]", "[[sweep.case]]\nname = \"a\"\n[[sweep.case]]\nname = \"b\"\n[sweep.sobol]"),
        );
        assert_eq!(points.len(), 128);
        for (a, b) in points[..64].iter().zip(&points[64..]) {
            assert_eq!(a.levels[1..], b.levels[1..]);
            assert_ne!(a.levels[0], b.levels[0]);
        }
    }

    #[test]
    fn lists_make_grids_and_ranges_hold_sobol_points() {
        let with = |from: &str, to: &str| {
            assert!(SOBOL.contains(from));
            refusal(&SOBOL.replace(from, to))
        };
        assert!(with("{ from = 0.0, to = 0.002 }", "[0.0, 0.002]").contains("with [sweep.sobol] give a range"));
        assert!(with("[sweep.sobol]\n        points = 64", "").contains("without [sweep.sobol] give a list"));
        assert!(with("from = 21, to = 36", "from = 20.5, to = 36").contains("20.5 is not a whole number"));
        assert!(with("from = 1e-4", "from = 0.0").contains("above 0"));
        assert!(with("points = 64", "points = 0").contains("at least 1"));
        assert!(with("points = 64", "points = 10001").contains("10001 points; at most 10000"));
        assert!(with("points = 64", "points = 64\nskip = 1").contains("`points`"));
        assert!(refusal("[sweep.sobol]\npoints = 4").contains("needs 1 to 256 ranges"));
    }

    #[test]
    fn protocols_and_validation_are_checked_where_they_stand() {
        let own = |method: &str, protocol: &str| format!("[sweep.protocols]\n{method} = [{protocol}]");
        let squares = "{ kind = \"squares\", side_m = 1.0, runs_each_way = 1 }";
        let scenario = parse(&own("direct", squares)).expect("valid");
        assert_eq!(scenario.programs_for("direct").expect("no budget").len(), 2);
        assert!(
            refusal(&own("umbmark", squares))
                .contains("sweep.protocols.umbmark: no such method in sweep.methods, which has: direct")
        );
        assert!(refusal(&own("direct", &squares.replace("1.0", "0.0"))).contains("sweep.protocols.direct.side_m is 0"));
        assert!(refusal(&own("direct", "")).contains("sweep.protocols.direct.runs is 0"));
        assert!(refusal(&own("direct", &squares.replace("side_m", "side"))).contains("`side_m`"));
        let path = "[[sweep.validation]]\nkind = \"validation_path\"\nlength_m = 40.0\nmeasure_every_m = 0.5\nruns = 1";
        let validation = parse(path).expect("valid").sweep.expect("given").validation;
        assert_eq!(validation, [Schedule::ValidationPath { length_m: 40.0, measure_every_m: 0.5, runs: 1 }]);
        assert!(refusal(&path.replace("40.0", "0.1")).contains("sweep.validation.measure_every_m is 0.5"));
    }
}

//! The shipped robot under motion capture, with what a test hides in it.

use dataset::Dataset;
use effects::Effect;
use motion_programs::Schedule;
use scenario::Scenario;

pub(crate) const MOTION_CAPTURE: &str = include_str!("../../scenarios/motion-capture.toml");

/// The scenario with calibration errors and further effects, `[[effect]]` of a scenario file, on some paths.
pub(crate) fn robot(extra: &str, protocols: &[Schedule]) -> Scenario {
    #[derive(serde::Deserialize)]
    struct List {
        #[serde(default)]
        effect: Vec<Effect>,
    }
    let mut scenario = Scenario::parse(MOTION_CAPTURE, "motion-capture.toml").expect("the shipped scenario");
    scenario.effects.retain(|effect| ["wheel_scale", "wheel_mismatch", "wheelbase"].contains(&effect.id()));
    scenario.effects.extend(toml::from_str::<List>(extra).expect("an effect").effect);
    scenario.protocols = protocols.to_vec();
    scenario
}

pub(crate) fn simulated(scenario: &Scenario, seed: u64) -> Dataset {
    sim_yair::simulate(scenario, seed, 0).expect("simulates").dataset
}

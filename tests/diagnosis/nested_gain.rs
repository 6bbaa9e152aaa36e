//! Gains of models whose effects were chosen without what they are measured on.

use dataset::Dataset;
use diagnose::{GainLevel, NestedGain, Options, diagnose, nested_gains};

use crate::hidden_effects::robot;
use crate::motion_capture::simulated;

/// A session of the shipped robot, with another name.
fn session(effect: &str, name: &str, seed: u64) -> Dataset {
    let mut dataset = simulated(&robot(effect), seed);
    dataset.provenance.name = Some(name.to_owned());
    dataset
}

fn of_sessions(gains: &[NestedGain]) -> &NestedGain {
    gains.iter().find(|gain| gain.level == GainLevel::Sessions).expect("two sessions")
}

const TURN_RATE: &str = "[[effect]]\nkind = \"turn_rate_wheelbase\"\nbeta_s = 0.05\n";

/// Of two sessions one has an effect. Left out, it is held against a model that was found in the sound one
/// and so abstains; the sound one is held against the effect, which it does not have and does not confirm. A
/// gain whose effects were chosen in both has the effect in both units.
#[test]
fn the_choice_of_effects_has_not_seen_what_is_held_out() {
    let datasets = [session(TURN_RATE, "monday", 81), session("", "tuesday", 82)];
    let gains = nested_gains(&datasets, &Options::default()).expect("diagnoses");
    let sessions = of_sessions(&gains);
    let [monday, tuesday] = &sessions.held_out[..] else { panic!("{sessions:?}") };
    assert_eq!((monday.unit.as_str(), monday.found.as_deref()), ("monday", Some(&[][..])), "{sessions:?}");
    assert_eq!(tuesday.found.as_deref(), Some(&["turn_rate_wheelbase".to_owned()][..]), "{sessions:?}");
    let (abstained, harmed) =
        (monday.final_position_m.as_ref().expect("runs"), tuesday.final_position_m.as_ref().expect("runs"));
    assert_eq!((abstained.low, abstained.high), (0.0, 0.0), "who adds nothing gains nothing");
    // The calibration alone has taken the effect up in its geometry and is wrong there too.
    assert!(harmed.low < 0.0, "{harmed:?}");
    assert_eq!((sessions.units, sessions.abstained), (2, 1));
    assert!(sessions.drift_percent.is_some());
}

/// An effect that both sessions have is found in each, and gains in the other. The document of the diagnosis
/// has no nested gains, which were not asked for.
#[test]
fn what_every_session_has_gains_in_each() {
    let datasets = [session(TURN_RATE, "monday", 83), session(TURN_RATE, "tuesday", 84)];
    let gains = nested_gains(&datasets, &Options::default()).expect("diagnoses");
    let sessions = of_sessions(&gains);
    assert_eq!((sessions.units, sessions.abstained), (2, 0), "{sessions:?}");
    for held in &sessions.held_out {
        let ends = held.final_position_m.as_ref().expect("runs");
        assert!(ends.low > 0.0 && ends.extended < ends.base, "{held:?}");
    }
    let document = diagnose(&datasets, &Options::default()).expect("a diagnosis").document;
    assert!(document.nested.is_empty());
}

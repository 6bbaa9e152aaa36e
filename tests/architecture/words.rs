//! The field's words: private names that the code once had for standard terms do not come back into
//! identifiers.
//!
//! Rejected by what was tried: a `struct Evidence`, a method `examine`, a constant `MOST_RUNS`.

use std::collections::BTreeMap;

use syn::Ident;
use syn::visit::{self, Visit};

use crate::{files, text};

/// A private name and the standard term for it.
const PRIVATE: &[(&str, &str)] = &[
    ("Against", "ResidualsByCovariate"),
    ("Apart", "Grouping"),
    ("ArcScatter", "BridgeCovariance"),
    ("Asked", "MeanStructure"),
    ("Beat", "SamplingPeriodEstimator"),
    ("Bend", "Curvature"),
    ("Choice", "Candidate"),
    ("Coarse", "Decimated"),
    ("Course", "PrecomputedRun"),
    ("Ends", "ConvergenceCriterion"),
    ("Evidence", "NormalEquations"),
    ("Excursion", "DisplacementSample"),
    ("Extended", "AugmentedModel"),
    ("Fate", "Status"),
    ("Follows", "ResidualPersistence"),
    ("JointFit", "ModelFit"),
    ("Kept", "CachedPropagation"),
    ("LastSide", "Hysteresis"),
    ("Leg", "PropagationInterval"),
    ("Look", "Measurement"),
    ("Looks", "Measurements"),
    ("Mounting", "Extrinsics"),
    ("Pace", "DriveLimits, StepDamping, SamplingStatistics or TimeScale"),
    ("Reckoned", "DeadReckoned"),
    ("Remembered", "MotionHistory"),
    ("Rewriting", "RecordCorrection"),
    ("Round", "CaseKind"),
    ("Said", "Reported"),
    ("Shape", "Variant"),
    ("Sighting", "PoseReading"),
    ("Sought", "SparseSearch"),
    ("Sure", "Confidence"),
    ("Together", "ProductBatch"),
    ("Trail", "CarriedState"),
    ("Want", "PassOptions"),
    ("Watching", "InstrumentModel"),
    ("WheelTrack", "WheelAngleInterpolator"),
    ("Whose", "ErrorSource"),
    ("begin_run", "on_run_start"),
    ("closed_again", "regated"),
    ("displaced", "mahalanobis_distance"),
    ("effect_of_sizes", "effect_from_estimates"),
    ("every_look", "ungated"),
    ("examine", "wald_test"),
    ("foreseeing", "on_planned_runs"),
    ("hard_to_believe", "plausibility_warnings"),
    ("hold_what_is_unseen", "fix_unobservable"),
    ("holds_over_runs", "cluster_robust_test"),
    ("in_longer_steps", "decimated"),
    ("is_faint", "is_of_low_significance"),
    ("log_weight", "log_occam_factor"),
    ("looks_by_itself", "free_running"),
    ("of_sizes", "from_estimates"),
    ("of_trials", "sidak"),
    ("plausible", "prior_sigma"),
    ("scattered_arc", "perturbed_arc"),
    ("soon_read", "prefetch_read"),
    ("soon_written", "prefetch_write"),
    ("start_run", "seed_run"),
    ("strayed", "left_basin"),
    ("tell_apart", "discriminate"),
    ("unfitted", "from_parameters"),
    ("unseen", "unobservable"),
    ("way_m", "distance_m"),
];

/// Beginnings of constants, and the standard one.
const PREFIXES: &[(&str, &str)] = &[("LEAST_", "MIN_"), ("MOST_", "MAX_")];

/// How often each identifier of a source text stands in it, macros left out.
#[derive(Default)]
struct Identifiers(BTreeMap<String, usize>);

impl Visit<'_> for Identifiers {
    fn visit_ident(&mut self, ident: &Ident) {
        *self.0.entry(ident.to_string()).or_insert(0) += 1;
        visit::visit_ident(self, ident);
    }
}

/// Private names in a source text, each with the standard term.
fn private_names(source: &str) -> Vec<String> {
    let mut identifiers = Identifiers::default();
    identifiers.visit_file(&syn::parse_file(source).expect("Rust"));
    let standard = |ident: &String| {
        let whole = PRIVATE.iter().find(|(private, _)| private == ident).map(|(_, standard)| (*standard).to_owned());
        let of_prefix =
            |(private, standard): &(&str, &str)| Some(format!("{standard}{}", ident.strip_prefix(private)?));
        whole.or_else(|| PREFIXES.iter().find_map(of_prefix)).map(|standard| format!("{ident} is {standard}"))
    };
    identifiers.0.keys().filter_map(standard).collect()
}

#[test]
fn identifiers_are_the_fields_words() {
    let sources = files("crates").into_iter().chain(files("src")).chain(files("tests")).chain(files("benches"));
    let mut found = Vec::new();
    for file in sources.filter(|file| file.extension().is_some_and(|extension| extension == "rs")) {
        found.extend(private_names(&text(&file)).into_iter().map(|name| format!("{}: {name}", file.display())));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn private_names_are_found_wherever_they_are_defined_or_used() {
    for planted in [
        "struct Evidence;",
        "impl A { fn examine(&self) {} }",
        "const MOST_RUNS: usize = 3;",
        "fn f(a: &A) { a.strayed; }",
        "enum E { Look(f64) }",
    ] {
        assert_eq!(private_names(planted).len(), 1, "{planted}");
    }
    assert!(private_names("struct NormalEquations; const MAX_RUNS: usize = 3; // Evidence").is_empty());
}

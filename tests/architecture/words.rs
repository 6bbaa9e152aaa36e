//! The field's words: private names that the code once had for standard terms do not come back into
//! identifiers.
//!
//! Rejected by what was tried: a `struct Evidence`, a method `examine`, a constant `MOST_RUNS`.

use std::collections::BTreeMap;

use syn::Ident;
use syn::visit::{self, Visit};

use crate::support::succeed;
use crate::{files, root, text};

/// A private name and the standard term for it.
const PRIVATE: &[(&str, &str)] = &[
    ("Against", "ResidualsByCovariate"),
    ("Apart", "Grouping"),
    ("ArcScatter", "BridgeCovariance"),
    ("Asked", "MeanStructure"),
    ("Beat", "sampling_period.rs"),
    ("Bend", "Curvature"),
    ("Choice", "Candidate"),
    ("Coarse", "Decimated"),
    ("Course", "PrecomputedRun"),
    ("Ends", "ConvergenceCriterion"),
    ("Evidence", "NormalEquations"),
    ("Excursion", "DisplacementSample"),
    ("Extended", "AugmentedModel"),
    ("FAINT_INK", "SECONDARY_INK"),
    ("Fate", "Status"),
    ("Follows", "ResidualPersistence"),
    ("Gross", "RecordFault"),
    ("JointFit", "ModelFit"),
    ("Kept", "CachedPropagation"),
    ("LastSide", "Hysteresis"),
    ("Leg", "PropagationInterval"),
    ("Look", "Measurement"),
    ("Looks", "Measurements"),
    ("MAX_TOLD", "MAX_REPORTED"),
    ("MIN_REACH_M", "MIN_EXTENT_M"),
    ("Mounting", "Extrinsics"),
    ("NamingOutcome", "IdentificationOutcome"),
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
    ("Unseen", "Undetectable"),
    ("Want", "PassOptions"),
    ("Watching", "InstrumentModel"),
    ("WheelTrack", "WheelAngleInterpolator"),
    ("Whose", "ErrorSource"),
    ("alarm", "a false positive or a finding"),
    ("beat", "sampling_period"),
    ("begin_run", "on_run_start"),
    ("closed_again", "regated"),
    ("covariance_of_lengths", "geometry_covariance"),
    ("displaced", "mahalanobis_distance"),
    ("effect_of_sizes", "effect_from_estimates"),
    ("every_look", "ungated"),
    ("examine", "wald_test"),
    ("foreseeing", "on_planned_runs"),
    ("hard_to_believe", "plausibility_warnings"),
    ("held_at", "fixed_at"),
    ("hold_what_is_unseen", "fix_unobservable"),
    ("holds_over_runs", "cluster_robust_test"),
    ("in_longer_steps", "decimated"),
    ("is_faint", "is_of_low_significance"),
    ("is_sure", "is_certain"),
    ("lengths_m", "geometry_m"),
    ("log_weight", "log_occam_factor"),
    ("looks_by_itself", "free_running"),
    ("naming_outcome", "identification_outcome"),
    ("of_sizes", "from_estimates"),
    ("of_trials", "sidak"),
    ("pace_counts", "speed_and_acceleration_of_counts"),
    ("plausible", "prior_sigma"),
    ("reach", "extent or log_odds_margin"),
    ("scattered_arc", "perturbed_arc"),
    ("shares_moments", "shares_samples"),
    ("soon", "upcoming"),
    ("soon_read", "prefetch_read"),
    ("soon_written", "prefetch_write"),
    ("start_run", "seed_run"),
    ("strayed", "left_basin"),
    ("tell_apart", "discriminate"),
    ("terms_together", "batched_terms"),
    ("told", "logged or reported"),
    ("unfitted", "from_parameters"),
    ("unseen", "unobservable"),
    ("way_m", "distance_m"),
];

/// Beginnings of constants, and the standard one.
const PREFIXES: &[(&str, &str)] = &[("LEAST_", "MIN_"), ("MOST_", "MAX_")];

/// Private phrases of prose, in lower case, and the standard term. A space in front or behind is part of the
/// phrase; every other character that is no letter counts as one.
const PHRASES: &[(&str, &str)] = &[
    (" a look ", "a measurement"),
    (" every look ", "every measurement"),
    (" of looks ", "of measurements"),
    (" the looks ", "the measurements"),
    (" all looks ", "all measurements"),
    (" sighting ", "measurement"),
    (" sightings ", "measurements"),
    (" told apart ", "discriminated"),
    (" tell apart ", "discriminate"),
    (" tells apart ", "discriminates"),
    (" tell them apart ", "discriminate them"),
    (" tells them apart ", "discriminates them"),
    (" of the way ", "of the distance"),
    (" reckoned ", "dead-reckoned"),
    (" faint ", "of low significance"),
    (" false alarm ", "false positive"),
    (" false alarms ", "false positives"),
    (" an alarm ", "a false positive"),
    (" nine chances in ten ", "with power 0.9"),
    (" even chances ", "even odds"),
    (" in disguise ", "spurious"),
    (" hard to believe ", "implausible"),
    (" hardly stands out ", "is of low significance"),
    (" could not have shown ", "is not detectable in these data"),
    (" would have shown ", "would have been detected"),
    (" out of sight ", "not detectable"),
    (" foreseen ", "predicted"),
    (" astray ", "outlying"),
    (" calibrated lengths ", "calibrated geometry"),
    (" three lengths ", "three geometry parameters"),
    (" than believed ", "than nominal"),
    (" forward face ", "simulation model"),
    (" hypothesis face ", "estimation model"),
];

/// Words between which a phrase is none of the private ones: "dead reckoned" is the standard term.
const STANDARD: &[&str] = &[" dead reckoned "];

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

/// A text as the phrases see it: lower case, letters and digits and hyphens, one space between words.
fn plain(prose: &str) -> String {
    let letters = prose.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { ' ' });
    let words: String = letters.collect();
    let joined = words.split_whitespace().collect::<Vec<_>>().join(" ");
    STANDARD.iter().fold(format!(" {joined} "), |plain, standard| plain.replace(standard, " "))
}

/// Private phrases in prose, each with the standard term.
fn private_phrases(prose: &str) -> Vec<String> {
    let plain = plain(prose);
    let found = PHRASES.iter().filter(|(phrase, _)| plain.contains(phrase));
    found.map(|(phrase, standard)| format!("\"{}\" is {standard}", phrase.trim())).collect()
}

/// The comments of a source text, as one.
fn comments(source: &str) -> String {
    let of_line = |line: &str| {
        let line = line.trim_start();
        let comment = ["//!", "///", "//"].iter().find_map(|mark| line.strip_prefix(mark))?;
        Some(comment.to_owned())
    };
    source.lines().filter_map(of_line).collect::<Vec<_>>().join(" ")
}

#[test]
fn documents_help_and_comments_are_in_the_fields_words() {
    let mut found = Vec::new();
    let mut hold = |place: String, prose: &str| {
        found.extend(private_phrases(prose).into_iter().map(|phrase| format!("{place}: {phrase}")));
    };
    for file in files("").into_iter().filter(|file| file.extension().is_some_and(|extension| extension == "md")) {
        hold(file.display().to_string(), &text(&file));
    }
    let sources = files("crates").into_iter().chain(files("src")).chain(files("tests")).chain(files("benches"));
    for file in sources.filter(|file| file.extension().is_some_and(|extension| extension == "rs")) {
        // This file has the phrases as data.
        if !file.ends_with("architecture/words.rs") {
            hold(file.display().to_string(), &comments(&text(&file)));
        }
    }
    let help = |arguments: &[&str]| succeed(root(), &[arguments, &["--help"]].concat()).stdout;
    let commands = help(&[]);
    let (list, _) = commands.split_once("\nOptions:").expect("the command lists its subcommands");
    let names: Vec<&str> = list
        .lines()
        // What a line goes on with stands further in.
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
        .filter(|name| !matches!(*name, "" | "help"))
        .collect();
    assert!(names.contains(&"diagnose"), "{names:?}");
    hold("yair --help".to_owned(), &commands);
    for name in names {
        hold(format!("yair {name} --help"), &help(&[name]));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn private_phrases_are_found_across_lines_and_marks() {
    for planted in ["names that are told\napart", "2 % of the way.", "A look, then", "end reckoned by counts"] {
        assert_eq!(private_phrases(planted).len(), 1, "{planted}");
    }
    for standard in ["it looks like a delay", "the dead-reckoned pose", "dead reckoned end", "a false-positive rate"] {
        assert!(private_phrases(standard).is_empty(), "{standard}");
    }
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

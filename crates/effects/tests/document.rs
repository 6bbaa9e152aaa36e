//! docs/effects.md is generated: from the `//!` header of each effect's file and from what the effect
//! declares of itself. With YAIR_UPDATE_DOCS=1 it is written anew.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use effects::{
    Address, CATALOGUE, Description, Estimate, Estimates, Excitation, HostRobot, Hypothesis, IsolatedError, OnBoard,
    ParameterLaw, ParameterValues, StreamName, description, hypothesis,
};
use model_term::TermParameter;

/// What every header says, in this order.
const LABELS: [&str; 5] = ["Model", "Signature", "Observability", "Alias", "Reference"];
/// What a header may say besides.
const FURTHER_LABELS: [&str; 1] = ["Assumption of the hypothesis"];
/// How an effect's file introduces the reason for what counts as large.
const LARGE: &str = "Plausible: ";

const INTRODUCTION: &str = "\
# Effects

What makes real wheel odometry deviate. Every effect has two models, in one file under [crates/effects/src/catalogue/](../crates/effects/src/catalogue). The *simulation model* is how the
world does it, inside a step of the simulator; its parameters are keys of a scenario ([scenario.md](scenario.md#effects)). The *estimation model* is how recorded data show it, and sees
recorded quantities only. They share names and no code. `tests/effects/laws.rs` holds what all promise; `tests/effects/hypotheses/` drives every simulation model that has a mean and asks
that its hypothesis, at the same sizes, predicts what was seen, and at half of them, one and a half, or with one sign turned does not.
";

const NOTATION: &str = "\
What has none of these names can be simulated as well: a [`term`](scenario.md#terms) of a scenario is a coefficient times a product of covariates on one channel, as diagnosis finds it when it says `unlisted`.

Notation: e is what was seen of a motion less what the counts predict, along (e_dx), across (e_dy) and in heading (e_dθ), per unit of time where v, ω or a appear; v, ω, a are the
speed, yaw rate and acceleration of the drive's centre, v_w, a_w those of a wheel, b the wheelbase, θ the heading in the room, φ a wheel's angle. An *alias* leaves the same e on some
paths: what tells two apart is the path.

*Meaning* is how a report tells of the effect, here with its sizes large. *Large* is what a real robot may have: detection limits and plans are judged by it. What is driven excites
an effect unless it says otherwise under *Excited by*. *On board* is what a robot's own program can do of it ([export.md](export.md#on-board)). *Benchmark* is how the blind benchmark ([diagnosis-benchmark.md](diagnosis-benchmark.md)) hides it in a robot: in multiples of a large size, or at a
scale of the sizes given, and where it has another functional form than the catalogue's, in that on one robot in two.

This file is generated from the catalogue: `YAIR_UPDATE_DOCS=1 cargo test --release -p effects --test document`.
";

type Holds = fn(&Hypothesis) -> bool;

/// By what an effect is shown, what that is, and which hypotheses are so.
const SHOWN_BY: [(&str, &str, Holds); 6] = [
    ("geometry", "the three geometry parameters of the drive, which every calibration fits", |of| {
        matches!(of, Hypothesis::Geometry)
    }),
    (
        "mean terms",
        "what it adds to a motion by the counts, or to what the instrument sees, linearly in its sizes; what is not linear, a hinge speed or a decay length, is one of a few shapes, or anything between them once the effect is found",
        |of| matches!(of, Hypothesis::Terms(_)),
    ),
    ("records", "the records as they would be without it, tried before any fit", |of| {
        matches!(of, Hypothesis::Records(_))
    }),
    ("scatter", "no mean, or not one alone: checks of a fit show it", |of| {
        matches!(of, Hypothesis::Scatter(_) | Hypothesis::TermsAndScatter(..))
    }),
    ("unknown motion", "motion that no wheel makes, between two measurements, sought before any fit", |of| {
        matches!(of, Hypothesis::UnknownMotion { .. })
    }),
    ("nothing", "innocent, in the noise model", |of| matches!(of, Hypothesis::Silent)),
];

fn source(id: &str) -> String {
    let catalogue = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/catalogue");
    let path =
        [catalogue.join(format!("{id}.rs")), catalogue.join(id).join("mod.rs")].into_iter().find(|path| path.is_file());
    let path = path.unwrap_or_else(|| panic!("{id} has no file in {}", catalogue.display()));
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Texts with their labels.
type Labelled = Vec<(&'static str, String)>;

/// The first line of an effect's header, and what follows each label; the error says what is missing.
fn header(id: &str, source: &str) -> Result<(String, Labelled), String> {
    let lines: Vec<&str> = source.lines().map_while(|line| line.strip_prefix("//!")).map(str::trim).collect();
    // The title ends at the first empty line; it may be wrapped.
    let end = lines.iter().position(|line| line.is_empty()).ok_or_else(|| format!("{id}: no header"))?;
    let (title, rest) = (lines[..end].join(" "), &lines[end..]);
    let first =
        title.strip_prefix(&format!("`{id}`: ")).ok_or_else(|| format!("{id}: the header begins with its id"))?;
    let text = rest.join(" ").trim().to_owned();
    let mut starts: Vec<(usize, &'static str)> = Vec::new();
    for label in LABELS.into_iter().chain(FURTHER_LABELS) {
        let begins = |at: &usize| *at == 0 || text[..*at].ends_with(". ");
        let marked = format!("{label}: ");
        let mut found = text.match_indices(&marked).map(|(at, _)| at).filter(begins);
        match (found.next(), found.next()) {
            (Some(at), None) => starts.push((at, label)),
            (None, _) if FURTHER_LABELS.contains(&label) => {}
            (first, _) => {
                return Err(format!(
                    "{id}: {label} stands in the header {}",
                    if first.is_some() { "twice" } else { "nowhere" }
                ));
            }
        }
    }
    starts.sort_unstable();
    let ends = starts.iter().skip(1).map(|(at, _)| *at).chain([text.len()]);
    let of = |(&(at, label), end): (&(usize, &'static str), usize)| {
        (label, text[at + label.len() + 2..end].trim().to_owned())
    };
    Ok((capitalised(first), starts.iter().zip(ends).map(of).collect()))
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A number as short as it can be written.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

fn with_unit(value: f64, unit: &str) -> String {
    if unit == "1" { number(value) } else { format!("{} {unit}", number(value)) }
}

fn listed<T: AsRef<str>>(names: impl IntoIterator<Item = T>) -> String {
    names.into_iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
}

/// A name in camel case as words.
fn words(name: &str) -> String {
    let mut words = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    words
}

/// The fitted sizes of a hypothesis with what is large and its unit, and its shape parameter with the values
/// that are tried.
fn values(id: &str) -> (Vec<TermParameter>, ParameterValues) {
    let variants = hypothesis(id).and_then(Hypothesis::into_variants).unwrap_or_default();
    let mut fitted: Vec<TermParameter> = Vec::new();
    for parameter in variants.iter().flat_map(|variant| variant.term.parameters()) {
        if fitted.iter().all(|known| known.name != parameter.name) {
            fitted.push(*parameter);
        }
    }
    (fitted, variants.iter().flat_map(|variant| variant.fixed.clone()).collect())
}

/// The meaning with all sizes large, the phases of periodic ones at zero.
fn meaning(id: &str, description: &Description) -> String {
    let (fitted, tried) = values(id);
    let large = fitted.iter().map(|of| (of.name, if of.name.contains("cos") { 0.0 } else { of.prior_sigma }));
    let fixed = tried.get(tried.len() / 2).copied();
    let estimate = |(name, value)| (name, Estimate { value, sigma: None });
    let estimates: Estimates<'_> = large.chain(fixed).map(estimate).collect();
    description.statement(&estimates).map_or_else(|| description.meaning.to_owned(), |of| of.sentence())
}

fn isolated_error(of: IsolatedError) -> &'static str {
    match of {
        IsolatedError::LostOnTheWay { .. } => "one wheel loses distance, anywhere where it drives",
        IsolatedError::LostWithSpeedChange { .. } => {
            "wheels lose distance as they become faster and gain it as they become slower, in proportion to the change of speed"
        }
        IsolatedError::WoundUp { .. } => "wheels are behind where they start or stop, and catch up later",
        IsolatedError::OfInstrument => {
            "the instrument is wrong at one measurement alone, in any direction and by any amount"
        }
    }
}

/// How the blind benchmark draws an effect; `None` for what it cannot hide.
fn benchmark(id: &str, description: &Description) -> Option<String> {
    let benchmark = &description.benchmark;
    let mut stream = Address { seed: 0, point: 0, trial: 0, run: 0 }.stream(StreamName::new("document"));
    let host = HostRobot {
        cruise_speed_m_s: 0.3,
        acceleration_m_s2: 0.5,
        wheel_separation_m: 0.4,
        payload_kg: vec![0.0, 5.0],
        jitter_s: 0.005,
    };
    let law = match (hypothesis(id)?, benchmark.values) {
        (Hypothesis::Geometry | Hypothesis::UnknownMotion { .. } | Hypothesis::Silent, _) => return None,
        (_, ParameterLaw::Direction { .. }) if benchmark.max_scale == 1.0 => "up to a large size".to_owned(),
        (_, ParameterLaw::Direction { .. }) => format!("up to {} times a large size", number(benchmark.max_scale)),
        (_, ParameterLaw::Scatter(law)) => {
            let (scaled, _) = law(&host, &mut stream);
            let scaled = scaled.iter().map(|(name, size)| format!("`{name}` {}", number(*size))).collect::<Vec<_>>();
            format!("{} at scale 1; scales up to {}", scaled.join(", "), number(benchmark.max_scale))
        }
        (_, ParameterLaw::Fault(law)) => {
            let drawn = law(kinematics::Wheels::both(true), &mut stream);
            format!("{} drawn", listed(drawn.iter().map(|(name, _)| name)))
        }
    };
    let form = benchmark.other_form.map_or_else(String::new, |form| format!("; other form: {}", form.what));
    Some(format!("{law}{form}"))
}

/// How it can run on board.
fn on_board(of: OnBoard) -> String {
    let detail = if of.detail().is_empty() { String::new() } else { format!(": {}", of.detail()) };
    let lag = of.lag().map_or_else(String::new, |lag| format!("; lag: {lag}"));
    format!("{}{detail}{lag}", of.kind())
}

fn section(id: &str, source: &str) -> Result<String, String> {
    let (first, labelled) = header(id, source)?;
    let description = description(id).ok_or_else(|| format!("{id}: unknown"))?;
    let mut items: Vec<(String, String)> = labelled.into_iter().map(|(label, text)| (label.to_owned(), text)).collect();
    let mut add = |label: &str, text: String| items.push((label.to_owned(), text));
    add("Meaning", format!("{}.", meaning(id, &description)));
    if let Excitation::Conditions(how) = description.excitation {
        add("Excited by", format!("other conditions than what is driven: {how}."));
    }
    let (fitted, tried) = values(id);
    if !fitted.is_empty() {
        let each = fitted.iter().map(|of| format!("`{}` ({})", of.name, with_unit(of.prior_sigma, of.unit)));
        let reason =
            source.lines().find_map(|line| line.trim_start().trim_start_matches('/').trim_start().strip_prefix(LARGE));
        let reason =
            reason.ok_or_else(|| format!("{id}: no comment \"{LARGE}…\" says why its sizes count as large"))?;
        add("Large", format!("{}: {reason}", each.collect::<Vec<_>>().join(", ")));
    }
    if let Some((name, _)) = tried.first() {
        let values = tried.iter().map(|(_, value)| number(*value)).collect::<Vec<_>>();
        add("Shapes", format!("`{name}` of {}.", values.join(", ")));
    }
    let signs: Vec<String> = hypothesis(id)
        .map(|of| of.signs().iter().map(|sign| words(&format!("{sign:?}"))).collect())
        .unwrap_or_default();
    if !signs.is_empty() {
        add("Shows as", format!("{}.", signs.join(", ")));
    }
    if let Some(error) = description.isolated_error {
        add("Single error", format!("{}.", isolated_error(error)));
    }
    if matches!(hypothesis(id), Some(Hypothesis::Records(_))) {
        let fault = description.record_fault;
        let trace = if fault.leaves_a_trace {
            "the log itself can show it"
        } else {
            "no trace in the log; tried where the base fit is implausible"
        };
        let rough = if fault.is_restored_roughly { "; restored roughly" } else { "" };
        add("In the records", format!("{trace}{rough}."));
    }
    if let Some(law) = benchmark(id, &description) {
        add("Benchmark", format!("{law}."));
    }
    add("On board", format!("{}.", on_board(description.on_board)));
    let mut text = format!("## `{id}`\n\n{first}\n\n");
    for (label, item) in items {
        writeln!(text, "- {label}: {item}").map_err(|error| error.to_string())?;
    }
    Ok(text)
}

fn document() -> String {
    let mut text = format!("{INTRODUCTION}\n| shown by | what that is | effects |\n| --- | --- | --- |\n");
    for (name, what, holds) in SHOWN_BY {
        let of = CATALOGUE.iter().filter(|id| hypothesis(id).is_some_and(|hypothesis| holds(&hypothesis)));
        let links: Vec<String> = of.map(|id| format!("[`{id}`](#{id})")).collect();
        text.push_str(&format!("| {name} | {what} | {} |\n", links.join(", ")));
    }
    text.push_str(&format!("\n{NOTATION}"));
    for id in CATALOGUE {
        text.push_str(&format!("\n{}", section(id, &source(id)).unwrap_or_else(|problem| panic!("{problem}"))));
    }
    text
}

/// The table of docs/export.md: kinds in the order of what they can, and effects of the same kind and detail.
fn table_of_kinds() -> String {
    const KINDS: [&str; 8] = [
        "geometry",
        "static",
        "with state",
        "with an input",
        "a constant",
        "covariance only",
        "never",
        "of the instrument",
    ];
    let mut rows: Vec<(&str, &str, Vec<&str>)> = Vec::new();
    for id in CATALOGUE {
        let of = description(id).expect("known").on_board;
        match rows.iter_mut().find(|(kind, detail, _)| (*kind, *detail) == (of.kind(), of.detail())) {
            Some((.., ids)) => ids.push(id),
            None => rows.push((of.kind(), of.detail(), vec![id])),
        }
    }
    let place = |kind: &str| KINDS.iter().position(|of| *of == kind).unwrap_or_else(|| panic!("{kind} has no place"));
    rows.sort_by_key(|(kind, ..)| place(kind));
    let mut text = "| kind | effects | remembers, is told, or why not |\n| --- | --- | --- |\n".to_owned();
    for (kind, detail, ids) in rows {
        let detail = if detail.is_empty() { "counts of one interval and its length" } else { detail };
        text.push_str(&format!("| {kind} | {} | {detail} |\n", listed(ids)));
    }
    text
}

#[test]
fn the_table_of_what_runs_on_board_is_what_the_catalogue_says() {
    const BEGINS: &str = "<!-- on board: generated -->\n";
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/export.md");
    let text = fs::read_to_string(&path).expect("docs/export.md is there");
    let (before, rest) = text.split_once(BEGINS).expect("the table's mark");
    let (written, after) = rest.split_once("<!-- end -->").expect("the table's end");
    let table = table_of_kinds();
    if std::env::var("YAIR_UPDATE_DOCS").is_ok_and(|value| value == "1") {
        fs::write(&path, format!("{before}{BEGINS}{table}<!-- end -->{after}")).expect("written");
    } else {
        assert_eq!(written, table, "run YAIR_UPDATE_DOCS=1 cargo test --release -p effects --test document");
    }
}

#[test]
fn the_document_is_what_the_catalogue_says() {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/effects.md");
    let text = document();
    if std::env::var("YAIR_UPDATE_DOCS").is_ok_and(|value| value == "1") {
        fs::write(&path, &text).expect("written");
    }
    let written = fs::read_to_string(&path).expect("docs/effects.md is there");
    for (number, (written, generated)) in written.lines().zip(text.lines()).enumerate() {
        assert_eq!(
            written,
            generated,
            "docs/effects.md, line {}: run YAIR_UPDATE_DOCS=1 cargo test --release -p effects --test document",
            number + 1
        );
    }
    assert_eq!(written, text, "docs/effects.md is longer or shorter than what is generated");
}

/// Each effect stands once in the table, whatever its hypothesis.
#[test]
fn every_effect_is_shown_by_one_thing() {
    for id in CATALOGUE {
        let of = hypothesis(id).expect("known");
        assert_eq!(SHOWN_BY.iter().filter(|(_, _, holds)| holds(&of)).count(), 1, "{id}");
    }
}

#[test]
fn a_header_without_a_part_or_with_one_twice_is_rejected() {
    let id = CATALOGUE[0];
    let whole = source(id);
    assert!(section(id, &whole).is_ok());
    for label in LABELS {
        let problem = section(id, &whole.replacen(&format!("{label}: "), "", 1)).expect_err(label);
        assert!(problem.contains(label) && problem.contains("nowhere"), "{problem}");
        let twice = format!("{label}: this. {label}: ");
        assert!(
            section(id, &whole.replacen(&format!("{label}: "), &twice, 1))
                .is_err_and(|problem| problem.contains("twice"))
        );
    }
    assert!(header("another", &whole).is_err());
    // Sizes that nobody says why they are large.
    let id = CATALOGUE.iter().find(|id| !values(id).0.is_empty()).expect("a mean term");
    assert!(section(id, &source(id).replace(LARGE, "")).is_err_and(|problem| problem.contains(LARGE)));
}

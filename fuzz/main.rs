//! Every reader of files, and every calibrator, on input that nobody would write.
//!
//! A sample of a target's corpus is mutated with its structure kept (`text`, `bag`), because random bytes
//! hardly pass a parser's first line; then the target reads it. A finding is a panic, an execution that takes
//! longer or more memory than [`MAX_SECONDS`] and [`MAX_BYTES`], or a promise of the target that does not
//! hold (what was read can be written and reads back equal; no number is a NaN). Every execution is a
//! function of its target and its number, so that a finding is repeated by `YAIR_FUZZ_AT=TARGET:NUMBER`.
//!
//! `cargo test` runs a few hundred executions a target. `.ci/run fuzz MINUTES` runs each target for so many
//! minutes of processor time and prints a row of executions every [`ROW_SECONDS`]; it is a campaign by hand.
//! `YAIR_FUZZ_AFTER=LOG` goes on behind the executions that a campaign's output lists, so that campaigns add
//! up, those that were broken off among them.

#![allow(clippy::print_stdout)] // what a campaign found

mod bag;
mod corpus;
mod odd_datasets;
mod ros1;
mod sqlite;
mod targets;
mod text;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

use peak_alloc::PeakAlloc;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use targets::{TARGETS, Target};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Longest execution, processor seconds: a hundred times the longest sound one.
const MAX_SECONDS: f64 = 20.0;

/// Most memory of an execution, bytes: two chunks of a bag at their limit, and its messages.
const MAX_BYTES: usize = 1 << 30;

/// Executions of each target in `cargo test`, before its cost divides them.
const SMOKE_EXECUTIONS: u64 = 40;

/// Findings of a target that a campaign prints with their numbers: more are mostly the same.
const MAX_TOLD: u64 = 10;

/// Processor seconds between two rows of a campaign: what is lost when it is broken off.
const ROW_SECONDS: f64 = 60.0;

/// How an execution ended.
enum Ended {
    /// The input was read.
    Accepted,
    /// The input was refused with a reason.
    Refused,
    Finding(String),
}

fn generator(target: &Target, number: u64) -> Xoshiro256PlusPlus {
    // FNV-1a, so that targets do not share their mutations.
    let hash = target
        .name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    Xoshiro256PlusPlus::seed_from_u64(hash ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Processor seconds of this process; `None` where the system does not tell.
fn processor_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: u64 = fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?;
    // A hundredth of a second on every Linux.
    Some(0.01 * ticks as f64)
}

/// One execution in a folder, which is emptied after it. Its time is the processor's, where the system
/// tells: a campaign runs beside other work.
fn execute(target: &Target, corpus: &[corpus::Sample], number: u64, folder: &Path) -> Ended {
    let mut random = generator(target, number);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let (started, started_s) = (Instant::now(), processor_s());
    let ended = catch_unwind(AssertUnwindSafe(|| (target.run)(corpus, &mut random, folder)));
    let spent_s = processor_s().zip(started_s).map(|(now_s, then_s)| now_s - then_s);
    let seconds = spent_s.unwrap_or_else(|| started.elapsed().as_secs_f64());
    let bytes = MEMORY.peak_usage().saturating_sub(before);
    match ended {
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
            Ended::Finding(text.unwrap_or_else(|| "a panic".to_owned()))
        }
        Ok(_) if seconds > MAX_SECONDS => Ended::Finding(format!("{seconds:.1} s")),
        Ok(_) if bytes > MAX_BYTES => Ended::Finding(format!("{} MiB of memory", bytes >> 20)),
        Ok(true) => Ended::Accepted,
        Ok(false) => Ended::Refused,
    }
}

fn emptied<T>(folder: &tempfile::TempDir, of: impl FnOnce(&Path) -> T) -> T {
    let inside = folder.path().join("input");
    std::fs::create_dir_all(&inside).expect("a folder");
    let result = of(&inside);
    std::fs::remove_dir_all(&inside).expect("emptied");
    result
}

#[test]
fn no_reader_and_no_calibrator_falls_over_mutated_input() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for target in TARGETS {
        let corpus = (target.corpus)();
        let (mut accepted, mut refused) = (0, 0);
        for number in 0..(SMOKE_EXECUTIONS / target.cost).max(6) {
            match emptied(&folder, |inside| execute(target, &corpus, number, inside)) {
                Ended::Accepted => accepted += 1,
                Ended::Refused => refused += 1,
                Ended::Finding(what) => panic!("YAIR_FUZZ_AT={}:{number}: {what}", target.name),
            }
        }
        // A mutator that no parser lets pass, or that changes nothing, finds nothing.
        assert!(accepted > 0 && refused > 0, "{}: {accepted} accepted, {refused} refused", target.name);
    }
}

/// The first number of a target that no campaign has run whose rows stand in a text: `| target | first |
/// executions | …`.
fn first_after(rows: &str, target: &str) -> Option<u64> {
    let end_of = |row: &str| {
        let mut cells = row.trim().strip_prefix('|')?.split('|').map(str::trim);
        let (name, first, executions) = (cells.next()?, cells.next()?, cells.next()?);
        (name == target).then_some(first.parse::<u64>().ok()?.checked_add(executions.parse().ok()?)?)
    };
    rows.lines().filter_map(end_of).max()
}

#[test]
fn a_campaign_goes_on_behind_the_last_row_of_its_target() {
    let rows = "| target | first | executions |\n| --- | --- | --- |\n| csv | 1000000 | 50 | 7 |\n| csv | 1000050 | 5 | 1 |\n\
                YAIR_FUZZ_AT=csv:1000052: 21.0 s\n| tum | 7 | 1 | 1 |\n| bad | 18446744073709551615 | 1 |\n";
    assert_eq!(first_after(rows, "csv"), Some(1_000_055));
    assert_eq!(first_after(rows, "tum"), Some(8));
    assert_eq!((first_after(rows, "bad"), first_after(rows, "censi")), (None, None));
}

/// The targets of a list `dataset,csv`, in its order; all of them without one.
fn chosen(list: Option<&str>) -> Vec<&'static Target> {
    let Some(list) = list else { return TARGETS.iter().collect() };
    let one = |name: &str| {
        let found = TARGETS.iter().find(|target| target.name == name);
        let known = || TARGETS.iter().map(|target| target.name).collect::<Vec<_>>().join(", ");
        found.unwrap_or_else(|| panic!("no target is named {name}; there are {}", known()))
    };
    list.split(',').map(|name| one(name.trim())).collect()
}

#[test]
fn a_campaign_runs_the_targets_of_its_list_in_their_order() {
    let names = |list| chosen(list).iter().map(|target| target.name).collect::<Vec<_>>();
    assert_eq!(names(Some("tum, csv")), ["tum", "csv"]);
    assert_eq!(names(None).len(), TARGETS.len());
    assert!(catch_unwind(|| names(Some("csv,cvs"))).is_err(), "a name that is none runs nothing in silence");
}

/// That executions which a campaign found wrong are not any more.
#[track_caller]
fn mended(name: &str, numbers: &[u64]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target");
    let corpus = (target.corpus)();
    for &number in numbers {
        if let Ended::Finding(what) = emptied(&folder, |inside| execute(target, &corpus, number, inside)) {
            panic!("YAIR_FUZZ_AT={name}:{number}: {what}");
        }
    }
}

/// Of a fit with an effect's terms, which alone made the odometry follow the measurements, the covariance was
/// asked for without these terms.
#[test]
fn regress_a_fit_with_effects_is_asked_for_its_covariance_with_them() {
    mended("diagnosis", &[1_000_160, 1_000_246]);
}

#[test]
fn regress_a_check_whose_statistic_is_no_number_does_not_pass_in_silence() {
    mended("diagnosis", &[7_000_051, 7_000_393]);
}

#[test]
fn regress_steps_whose_squares_overflow_end_no_decomposition() {
    mended("calibrators", &[7_043_685, 7_049_532]);
}

#[test]
fn regress_a_gain_that_is_no_number_is_none_with_a_reason() {
    mended("diagnosis", &[7_005_084, 7_006_128]);
}

#[test]
fn regress_a_term_with_an_infinite_standard_deviation_is_no_finding() {
    mended("diagnosis", &[8_009_561]);
}

/// All poses were received before the wheels or after them, and the run had nothing to be compared with.
#[test]
fn regress_a_bag_whose_poses_are_all_outside_of_its_wheels_is_refused() {
    mended("mcap-and-cdr", &[20_005_468, 20_012_028]);
}

/// One stamp was 10¹⁶ s before all others, which were one double from there.
#[test]
fn regress_stamps_that_are_one_double_after_the_first_row_are_refused() {
    mended("csv", &[30_012_305, 30_023_822]);
}

#[test]
fn regress_messages_do_not_say_inf_times_and_inf_turns() {
    mended("calibrators", &[7_100_223, 7_128_401, 7_142_279]);
}

/// A map's distortion was added to the covariance of a fit that determines nothing.
#[test]
fn regress_a_fit_that_determines_nothing_in_a_distorted_map_ends_no_process() {
    mended("calibrators", &[40_000_024, 40_000_056]);
    mended("diagnosis", &[40_000_027, 40_000_145]);
}

/// Places of a map that are further apart than the whole numbers of 64 bits were subtracted as whole numbers.
#[test]
fn regress_places_of_a_map_may_be_any_doubles_apart() {
    mended("calibrators", &[800_000_781, 800_001_754]);
    mended("diagnosis", &[800_002_684]);
}

/// An axis of logarithms over the smallest doubles began at zero, and its ticks at the power i32::MIN.
#[test]
fn regress_a_figure_of_the_smallest_doubles_has_ticks() {
    mended("sweep-state", &[200_002_179]);
}

/// A true value of 5e-324 or 0, by which errors are divided, gave "inf" on the page of the result.
#[test]
fn regress_a_true_value_that_nothing_can_be_divided_by_is_refused() {
    mended("sweep-state", &[900_000_290, 900_001_250]);
}

/// Information beyond doubles gave odds that were none, and a search without a cause; a term that a fit does
/// not determine was printed with ± NaN.
#[test]
fn regress_information_beyond_doubles_is_no_evidence() {
    mended("diagnosis", &[300_015_556, 300_026_141, 300_030_664]);
}

/// Information that only rounding inverts gave a latency ± NaN: such a fit has no covariance.
#[test]
fn regress_a_covariance_of_rounding_is_none() {
    mended("calibrators", &[400_125_627]);
}

/// Which number is under way, for executions that end the process: memory that runs out, a stack that does.
fn note(line: &str) {
    if let Ok(file) = std::env::var("YAIR_FUZZ_NOTE") {
        let _ = std::fs::write(file, line);
    }
}

#[test]
#[ignore = "a campaign: .ci/run fuzz MINUTES"]
fn campaign() {
    std::panic::set_hook(Box::new(|_| ()));
    let folder = tempfile::tempdir().expect("a temporary folder");
    if let Some((name, number)) = std::env::var("YAIR_FUZZ_AT").ok().as_deref().and_then(|at| at.split_once(':')) {
        let target = TARGETS.iter().find(|target| target.name == name).expect("a target");
        let _ = std::panic::take_hook();
        let input = Path::new(&std::env::temp_dir()).join("yair-fuzz-finding");
        std::fs::create_dir_all(&input).expect("a folder");
        let ended = execute(target, &(target.corpus)(), number.parse().expect("a number"), &input);
        let what = match ended {
            Ended::Accepted => "accepted".to_owned(),
            Ended::Refused => "refused".to_owned(),
            Ended::Finding(what) => what,
        };
        println!("{name}:{number}: {what}; its input is in {}", input.display());
        return;
    }
    let minutes: f64 = std::env::var("YAIR_FUZZ_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(20.0);
    let first: u64 = std::env::var("YAIR_FUZZ_FIRST").ok().and_then(|text| text.parse().ok()).unwrap_or(1_000_000);
    let before = std::env::var("YAIR_FUZZ_AFTER").map_or_else(
        |_| String::new(),
        |log| std::fs::read_to_string(&log).unwrap_or_else(|error| panic!("YAIR_FUZZ_AFTER={log}: {error}")),
    );
    let mut findings = 0;
    println!(
        "| target | first | executions | accepted | processor s | findings |\n| --- | --- | --- | --- | --- | --- |"
    );
    for target in chosen(std::env::var("YAIR_FUZZ_TARGETS").ok().as_deref()) {
        let corpus = (target.corpus)();
        let budget_s = 60.0 * minutes;
        let mut next = first_after(&before, target.name).unwrap_or(first);
        let (clock, started_s) = (Instant::now(), processor_s());
        let spent = || processor_s().zip(started_s).map_or(clock.elapsed().as_secs_f64(), |(now, then)| now - then);
        let (mut told, mut from_s) = (0, 0.0);
        while from_s < budget_s {
            let until_s = budget_s.min(from_s + ROW_SECONDS);
            let (start, mut accepted, mut found) = (next, 0_u64, 0_u64);
            while spent() < until_s {
                note(&format!("{}:{next}", target.name));
                match emptied(&folder, |inside| execute(target, &corpus, next, inside)) {
                    Ended::Accepted => accepted += 1,
                    Ended::Refused => {}
                    Ended::Finding(what) => {
                        (found, told) = (found + 1, told + 1);
                        if told <= MAX_TOLD {
                            println!("YAIR_FUZZ_AT={}:{next}: {what}", target.name);
                        }
                    }
                }
                next += 1;
            }
            let now_s = spent();
            println!("| {} | {start} | {} | {accepted} | {:.1} | {found} |", target.name, next - start, now_s - from_s);
            from_s = now_s;
            findings += found;
        }
    }
    assert_eq!(findings, 0, "findings, as listed above");
}

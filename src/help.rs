//! What the command says of itself: which subcommand is for whom, with examples, and what to do first.

use clap::Command;

/// A subcommand with lines to type. All of them parse, which a test checks.
type Entry = (&'static str, &'static [&'static str]);

/// Subcommands by what somebody comes for, in the order in which they are used.
const GROUPS: &[(&str, &[Entry])] = &[
    (
        "Your robot",
        &[
            (
                "import",
                &[
                    "yair import csv log.csv --out mine --wheel 0.15 --base 0.3 --ticks-per-rev 4096",
                    "yair import ros2 bag.mcap --list",
                    "yair import ros2 bag.mcap --out mine --robot controllers.yaml",
                    "yair import tum truth.tum --odometry odometry.tum --out mine --wheel 0.15 --base 0.3",
                ],
            ),
            ("check", &["yair check mine", "yair check mine --bundle case.zip"]),
            ("replay-case", &["yair replay-case case.zip"]),
            ("calibrate", &["yair calibrate mine --out mine.toml", "yair calibrate monday tuesday --method all"]),
            (
                "evaluate",
                &[
                    "yair evaluate mine --calibration mine.toml",
                    "yair evaluate mine --calibration mine.toml --max-drift 0.5",
                ],
            ),
            (
                "diagnose",
                &["yair diagnose mine --out diagnosis", "yair diagnose monday tuesday --nested --out diagnosis"],
            ),
            ("plan", &["yair plan mine --room 4,3", "yair plan scenarios/motion-capture.toml --minutes 10"]),
            ("correct", &["yair correct mine --calibration diagnosis/extended.toml --out poses"]),
            ("compare", &["yair compare monday tuesday wednesday"]),
            (
                "fleet",
                &[
                    "yair fleet robots --out nightly --html fleet.html",
                    "yair fleet robots/cart-1 robots/cart-2 --calibrate-only --csv fleet.csv",
                ],
            ),
            (
                "export",
                &[
                    "yair export ros2-yaml mine.toml",
                    "yair export ros2-yaml mine.toml --into controllers.yaml --dry-run",
                    "yair export c diagnosis/extended.toml --out odometry.h",
                    "yair export mcap mine --calibration mine.toml --out paths.mcap",
                ],
            ),
        ],
    ),
    (
        "Simulate and bench",
        &[
            ("demo", &["yair demo", "yair demo --seed 3 --out story --no-open"]),
            ("simulate", &["yair simulate scenarios/motion-capture.toml --out robot"]),
            (
                "sweep",
                &[
                    "yair sweep scenarios/paper.toml",
                    "yair sweep scenarios/paper.toml --precision 2% --out results",
                    "yair sweep scenarios/paper.toml --shard 1/4 --out shard-1",
                    "yair sweep scenarios/paper.toml --shard auto --resume --out shard-1",
                ],
            ),
            ("merge", &["yair merge shard-1 shard-2 --out results"]),
            (
                "challenge",
                &[
                    "yair challenge --cases 60",
                    "yair challenge --instrument gyro-tape --cases 300 --seed 7",
                    "yair challenge --cases 440 --seed 23 --check baseline.json",
                    "yair challenge --cases 2000 --shard 1/4 --out part-1",
                    "yair challenge --merge part-1 part-2 part-3 part-4",
                ],
            ),
        ],
    ),
    ("The paper", &[("reproduce", &["yair reproduce --out paper"])]),
    (
        "The command itself",
        &[
            ("completions", &["yair completions bash > ~/.local/share/bash-completion/completions/yair"]),
            ("man", &["yair man --out ~/.local/share/man/man1"]),
        ],
    ),
];

/// Said when nothing is asked for.
const FIRST_STEPS: &str = "\
What do you have?
  a CSV of wheels and poses   yair import csv log.csv --out mine --wheel 0.15 --base 0.3
  a bag of ROS 2              yair import ros2 bag.mcap --list
  a dataset                   yair check mine, then yair calibrate mine
  nothing yet                 yair demo

yair --help lists all that it can do, yair COMMAND --help says how.";

/// The command with its subcommands in groups, and with examples.
pub(crate) fn with_groups_and_examples(mut command: Command) -> Command {
    let mut list = String::new();
    for (title, entries) in GROUPS {
        list += &format!("{title}:\n");
        for (name, examples) in *entries {
            let about = command.find_subcommand(name).and_then(Command::get_about).map(ToString::to_string);
            let about = about.unwrap_or_default();
            let mut lines = wrapped(&about, 86).into_iter();
            list += &format!("  {name:<12}{}\n", lines.next().unwrap_or_default());
            lines.for_each(|line| list += &format!("{:14}{line}\n", ""));
            let after = format!("Examples:\n{}", examples.iter().map(|line| format!("  {line}\n")).collect::<String>());
            command = command.mut_subcommand(name, |subcommand| subcommand.after_help(after));
        }
        list.push('\n');
    }
    command
        .help_template("{about}\n\n{usage-heading} {usage}{after-help}\n\nOptions:\n{options}")
        .after_help(list)
        .subcommand_required(false)
        .arg_required_else_help(false)
}

/// What to do first.
pub(crate) const fn first_steps() -> &'static str {
    FIRST_STEPS
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory as _;

    use super::*;
    use crate::command::Cli;

    #[test]
    fn every_subcommand_stands_in_one_group_with_examples_that_parse() {
        let command = with_groups_and_examples(Cli::command());
        let all: Vec<&Entry> = GROUPS.iter().flat_map(|(_, entries)| *entries).collect();
        let named: BTreeSet<&str> = all.iter().map(|(name, _)| *name).collect();
        let there: BTreeSet<&str> = command.get_subcommands().map(Command::get_name).collect();
        assert_eq!(named, there);
        assert_eq!(named.len(), all.len());
        for (name, examples) in all {
            assert!(!examples.is_empty(), "{name}");
            for line in *examples {
                let words = line.split(" > ").next().expect("a command").split(' ');
                let parsed = command.clone().try_get_matches_from(words);
                assert_eq!(
                    parsed.as_ref().ok().and_then(|found| found.subcommand_name()),
                    Some(*name),
                    "{line}: {parsed:?}"
                );
            }
        }
    }

    #[test]
    fn the_first_steps_parse() {
        let command = with_groups_and_examples(Cli::command());
        let lines =
            FIRST_STEPS.lines().filter_map(|line| line.split_once("   yair ").filter(|_| line.starts_with("  ")));
        let lines: Vec<&str> = lines.flat_map(|(_, rest)| rest.split(", then yair ")).collect();
        assert_eq!(lines.len(), 5);
        for line in lines {
            let words = std::iter::once("yair").chain(line.trim().split(' '));
            assert!(command.clone().try_get_matches_from(words).is_ok(), "{line}");
        }
    }
}

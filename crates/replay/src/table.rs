//! The tables: all logs, each stratum, and what the same build does on other seeds.

use std::collections::{BTreeMap, BTreeSet};

use comfy_table::presets::ASCII_MARKDOWN;
use comfy_table::{CellAlignment, Table};
use serde::{Deserialize, Serialize};

use crate::corpus::Log;
use crate::measure::{MEASURES, Measure};
use crate::outcome::Outcome;
use crate::paired::{LEVEL, Paired, Verdict};

/// Levels whose difference chance explains more easily are not shown.
const SHOWN_LEVEL: f64 = 0.2;

/// A seed of fewer logs is no campaign of its own.
const MIN_LOGS: usize = 30;

/// Outcomes of one build in a file, by the names of the logs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Stored {
    /// The build.
    pub build: String,
    /// What it says of each log.
    pub outcomes: BTreeMap<String, Outcome>,
}

/// A measure in one level of a stratum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// The stratum.
    pub stratum: String,
    /// Its level.
    pub level: String,
    /// The comparison there.
    pub paired: Paired,
}

/// A measure of one build on the logs of each seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spread {
    /// The measure's key.
    pub measure: &'static str,
    /// Pooled, by seed.
    pub by_seed: Vec<(u64, f64)>,
    /// Standard deviation over the seeds; `None` below two of them.
    pub deviation: Option<f64>,
    /// Half of the 95 % interval of the difference of two builds on these logs: what can just be seen.
    pub visible: f64,
}

/// Two builds on the same logs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Every measure on all logs.
    pub all: Vec<Paired>,
    /// The same by stratum, the corpus among them.
    pub levels: Vec<Level>,
    /// The new build by seed.
    pub spread: Vec<Spread>,
    /// Of each share, the logs that the builds differ on: those where the old one alone has it, then those of
    /// the new one.
    pub differing: BTreeMap<&'static str, [Vec<String>; 2]>,
}

impl Comparison {
    /// Compares two builds' outcomes, in the order of the logs.
    #[must_use]
    pub fn of(logs: &[Log], old: &[Outcome], new: &[Outcome]) -> Self {
        let scored = |measure: &Measure, kept: &dyn Fn(&Log) -> bool| -> Vec<[Option<f64>; 2]> {
            let all = logs.iter().zip(old.iter().zip(new)).filter(|(log, _)| kept(log));
            all.map(|(log, (old, new))| [old, new].map(|of| measure.of(&log.answer, of))).collect()
        };
        let all: Vec<Paired> =
            MEASURES.iter().filter_map(|measure| Paired::of(measure, &scored(measure, &|_| true))).collect();
        let strata: BTreeSet<(String, String)> = logs.iter().flat_map(levels).collect();
        let levels = strata
            .into_iter()
            .flat_map(|(stratum, level)| {
                let is_in = |log: &Log| levels(log).contains(&(stratum.clone(), level.clone()));
                let paired = MEASURES.iter().filter_map(|measure| Paired::of(measure, &scored(measure, &is_in)));
                let paired: Vec<Paired> = paired.collect();
                paired.into_iter().map(move |paired| Level { stratum: stratum.clone(), level: level.clone(), paired })
            })
            .collect();
        let count = |seed: u64| logs.iter().filter(|log| log.answer.seed == seed).count();
        let seeds: BTreeSet<u64> = logs.iter().map(|log| log.answer.seed).collect();
        let seeds: Vec<u64> = seeds.into_iter().filter(|seed| count(*seed) >= MIN_LOGS).collect();
        let spread = all.iter().filter_map(|paired| {
            let measure = MEASURES.iter().find(|measure| measure.id == paired.measure)?;
            let of_seed = |seed: &u64| {
                let paired = Paired::of(measure, &scored(measure, &|log| log.answer.seed == *seed))?;
                Some((*seed, paired.pooled[1]))
            };
            let by_seed: Vec<(u64, f64)> = seeds.iter().filter_map(of_seed).collect();
            let visible = 0.5 * (paired.difference[1] - paired.difference[0]);
            Some(Spread { measure: measure.id, deviation: deviation(&by_seed), by_seed, visible })
        });
        let spread = spread.collect();
        let differing = MEASURES.iter().filter(|measure| measure.is_share()).map(|measure| {
            let scores = scored(measure, &|_| true);
            let names = |side: usize| {
                let differ = |scores: &[Option<f64>; 2]| scores[side] == Some(1.0) && scores[1 - side] == Some(0.0);
                let of = logs.iter().zip(&scores).filter(|(_, scores)| differ(scores));
                of.map(|(log, _)| log.name.clone()).collect()
            };
            (measure.id, [names(0), names(1)])
        });
        Self { all, levels, spread, differing: differing.collect() }
    }

    /// The measures of which more is lost than the rule of acceptance allows, and than chance explains.
    #[must_use]
    pub fn lost(&self) -> Vec<&Paired> {
        self.all.iter().filter(|paired| paired.verdict == Some(Verdict::Lost) && paired.p_value < LEVEL).collect()
    }

    /// The table of all logs, the levels that differ, and the seeds.
    #[must_use]
    pub fn text(&self) -> String {
        let mut all =
            table(&["measure", "logs", "old", "new", "only old", "only new", "difference, 95 %", "p", "rule"]);
        for paired in &self.all {
            all.add_row(row(paired));
        }
        let mut levels =
            table(&["level", "measure", "logs", "old", "new", "only old", "only new", "difference, 95 %", "p"]);
        // Of hundreds of levels those that chance alone would show once in five.
        let differs = |level: &&Level| is_share(&level.paired) && level.paired.p_value < SHOWN_LEVEL;
        for level in self.levels.iter().filter(differs) {
            let mut cells = row(&level.paired);
            cells.pop();
            cells.insert(0, format!("{}: {}", level.stratum, level.level));
            levels.add_row(cells);
        }
        let mut seeds = table(&["measure", "new build, by seed", "deviation", "visible"]);
        for spread in &self.spread {
            let by_seed: Vec<String> = spread.by_seed.iter().map(|(_, value)| shown(spread.measure, *value)).collect();
            let deviation = spread.deviation.map_or("–".to_owned(), |deviation| shown(spread.measure, deviation));
            let cells = [what(spread.measure).to_owned(), by_seed.join(", "), deviation];
            seeds.add_row(cells.into_iter().chain([shown(spread.measure, spread.visible)]));
        }
        format!(
            "{all}\n\nlevels in which shares differ with p below {SHOWN_LEVEL} (--json has all):\n{levels}\n\nby seed, and the difference that these logs show:\n{seeds}\n"
        )
    }
}

fn levels(log: &Log) -> Vec<(String, String)> {
    let strata = log.answer.strata.iter().map(|(stratum, level)| (stratum.clone(), level.clone()));
    strata.chain([("corpus".to_owned(), log.answer.corpus.clone())]).collect()
}

fn deviation(by_seed: &[(u64, f64)]) -> Option<f64> {
    let n = by_seed.len() as f64;
    let mean = by_seed.iter().map(|(_, value)| value).sum::<f64>() / n;
    let squares: f64 = by_seed.iter().map(|(_, value)| (value - mean).powi(2)).sum();
    (by_seed.len() > 1).then(|| (squares / (n - 1.0)).sqrt())
}

fn table(headers: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN).set_header(headers.to_vec());
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn measure(id: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.id == id)
}

fn what(id: &str) -> &'static str {
    measure(id).map_or("", |measure| measure.what)
}

fn is_share(paired: &Paired) -> bool {
    measure(paired.measure).is_some_and(Measure::is_share)
}

/// A value of a measure: shares in per cent.
fn shown(id: &str, value: f64) -> String {
    if measure(id).is_some_and(Measure::is_share) { format!("{:.1} %", 100.0 * value) } else { format!("{value:.3}") }
}

fn row(paired: &Paired) -> Vec<String> {
    let of = |value| shown(paired.measure, value);
    let (scale, digits) = if is_share(paired) { (100.0, 1) } else { (1.0, 3) };
    let [low, high] = paired.difference.map(|end| format!("{:+.*}", digits, scale * end));
    let verdict = paired.verdict.map_or("", |verdict| match verdict {
        Verdict::Won => "won",
        Verdict::Held => "held",
        Verdict::Lost => "LOST",
    });
    vec![
        what(paired.measure).to_owned(),
        paired.logs.to_string(),
        of(paired.pooled[0]),
        of(paired.pooled[1]),
        paired.discordant[0].to_string(),
        paired.discordant[1].to_string(),
        format!("{low} to {high}"),
        format!("{:.3}", paired.p_value),
        verdict.to_owned(),
    ]
}

//! The reproduction as a page of Markdown, readable in a terminal and in `docs/paper.md`.

use std::fmt::Write;

use super::Reproduction;
use super::cause::{Causes, NUMBER_NAMES};
use super::extension::Extension;
use super::published::{Column, TABLE_1, TABLE_2_NOMINAL};
use super::table_1::{Hypothesis, Row, Table1};

/// A share of the experiments that is all of them but for a few.
const ALMOST_ALWAYS: f64 = 0.999;

/// A difference in log likelihood under which hypotheses cannot be discriminated: a likelihood ratio of about
/// 20, as discovery by alias groups uses.
const DISCRIMINATION_LEVEL: f64 = 3.0;

impl Reproduction {
    /// The page.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = String::new();
        // Writing to a String does not fail.
        let _ = self.write_page(&mut page);
        page
    }

    fn write_page(&self, page: &mut String) -> std::fmt::Result {
        writeln!(page, "# The paper, reproduced\n")?;
        writeln!(
            page,
            "Navarro, Benet, Ríos, Bueno, *Mejoras en la localización odométrica de un robot diferencial mediante la corrección de errores sistemáticos*. \
             Every experiment repeated {} times in simulation (seed {}). The paper's raw data are not available: what follows rests on its printed numbers.\n",
            self.trials, self.seed
        )?;
        writeln!(page, "Written by `yair reproduce --out docs`.\n")?;
        self.write_table_1(page)?;
        self.write_table_2(page)?;
        self.write_figures(page)?;
        self.write_audit(page)?;
        self.write_causes(page)
    }

    fn write_figures(&self, page: &mut String) -> std::fmt::Result {
        writeln!(page, "## Figure 7: 40 m with eight quarter turns, and the claim of \"below 10 %\"\n")?;
        writeln!(
            page,
            "Each experiment calibrates by both methods and then walks the path, read every 0.5 m. The claim is judged at every reading from the first metre on, with the \
             95 % interval of its share.\n"
        )?;
        writeln!(
            page,
            "| calibration | median error at 40 m, m | 2.5 % | 97.5 % | error below 10 % of the distance throughout |"
        )?;
        writeln!(page, "| --- | --- | --- | --- | --- |")?;
        for method in &self.figure_7.methods {
            let last = |errors: &[f64]| errors.last().copied().unwrap_or(f64::NAN);
            writeln!(
                page,
                "| {} | {:.3} | {:.3} | {:.3} | {:.1} % of the experiments ({:.1} to {:.1} %) |",
                method.method,
                last(&method.median_m),
                last(&method.low_m),
                last(&method.high_m),
                100.0 * method.below_ten_percent,
                100.0 * method.below_ten_percent_interval[0],
                100.0 * method.below_ten_percent_interval[1]
            )?;
        }
        writeln!(page)?;
        if self.figure_7.methods.iter().all(|method| method.below_ten_percent > ALMOST_ALWAYS) {
            writeln!(
                page,
                "Every set of parameters keeps the claim, the wrong ones too: on a path of 40 m, 10 % is 4 m. The claim says little about a calibration.\n"
            )?;
        }
        for (stem, text, _) in self.pictures() {
            writeln!(page, "![{text}]({stem}.svg)\n")?;
        }
        writeln!(
            page,
            "Figure 6 shows a comb: read to whole millimetres, the lengths of some 484 pulses fall {:.4} mm/pulse apart. The paper's histogram shows \
             whether its grid was read finer.\n",
            TABLE_1.left.mean * 1e-3 / 0.5
        )?;
        Ok(())
    }

    fn write_table_1(&self, page: &mut String) -> std::fmt::Result {
        writeln!(page, "## Table 1: the scatter of the sensitivities, and where it comes from\n")?;
        writeln!(
            page,
            "Three hypotheses, each with its one size set so that the mean variance of both wheels is the published one:\n"
        )?;
        writeln!(
            page,
            "| hypothesis | what it says | reading σ mm | sensitivity σ % | log likelihood | below the best |"
        )?;
        writeln!(page, "| --- | --- | --- | --- | --- | --- |")?;
        for table in &self.table_1 {
            writeln!(
                page,
                "| {} | {} | {:.3} | {:.3} | {:.2} | {:.2} |",
                name(table.hypothesis),
                table.hypothesis.says(),
                1e3 * table.reading_sigma_m,
                100.0 * table.sensitivity_sigma,
                table.log_likelihood,
                table.below_best
            )?;
        }
        let worst = self.table_1.iter().map(|table| table.below_best).fold(0.0, f64::max);
        let verdict = if worst < DISCRIMINATION_LEVEL {
            "**The published statistics cannot discriminate them**"
        } else {
            "**The published statistics prefer the best one**"
        };
        writeln!(
            page,
            "\n{verdict}: the least likely hypothesis is {worst:.2} below the best in log likelihood, where {DISCRIMINATION_LEVEL} would be a likelihood ratio of 20. So all of \
             table 1's scatter can be measuring, and none of it the wheel. It matters: a scatter of the sensitivity goes on along a path, a scatter of \
             measuring does not.\n"
        )?;
        for (wheel, rows) in
            [("left", (|table: &Table1| &table.left) as fn(&Table1) -> &Vec<Row>), ("right", |table| &table.right)]
        {
            writeln!(page, "### {wheel} wheel, mm/pulse\n")?;
            writeln!(
                page,
                "Percentiles under the measuring hypothesis; the last three columns say at which percentile of each hypothesis the published value falls.\n"
            )?;
            let columns = self
                .table_1
                .iter()
                .map(|table| format!("{} at %", name(table.hypothesis)))
                .collect::<Vec<_>>()
                .join(" | ");
            writeln!(page, "| statistic | published | 2.5 % | 50 % | 97.5 % | {columns} |")?;
            writeln!(page, "| --- | --- | --- | --- | --- |{}", " --- |".repeat(self.table_1.len()))?;
            let Some(measuring) = self.table_1.iter().find(|table| table.hypothesis == Hypothesis::Measuring) else {
                continue;
            };
            for (position, row) in rows(measuring).iter().enumerate() {
                let falls: Vec<String> = self
                    .table_1
                    .iter()
                    .map(|table| format!("{:.0}", rows(table)[position].published_falls_at_percent))
                    .collect();
                let [low, middle, high] = row.percentiles.map(|value| number(row.statistic, value));
                let published = number(row.statistic, row.published);
                writeln!(
                    page,
                    "| {} | {published} | {low} | {middle} | {high} | {} |",
                    row.statistic,
                    falls.join(" | ")
                )?;
            }
            writeln!(page)?;
        }
        Ok(())
    }

    fn write_table_2(&self, page: &mut String) -> std::fmt::Result {
        writeln!(page, "## Table 2: what both methods find\n")?;
        writeln!(
            page,
            "The robot of the direct column under the measuring hypothesis, its wheelbase scattering by 1 mm from motion to motion. *Away* is published minus \
             simulated mean, in simulated standard deviations joined with the rounding of the print.\n"
        )?;
        writeln!(
            page,
            "| method | | unit | published | printed σ | 2.5 % | 50 % | 97.5 % | σ of the estimate | σ of single runs | away |"
        )?;
        writeln!(page, "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")?;
        let Column { sensitivity, base } = TABLE_2_NOMINAL;
        for (symbol, unit, printed) in
            [("C_L", "mm/pulse", sensitivity.left), ("C_R", "mm/pulse", sensitivity.right), ("B", "mm", base)]
        {
            writeln!(page, "| nominal | {symbol} | {unit} | {} | – | – | – | – | – | – | – |", printed.value)?;
        }
        for cell in &self.table_2.cells {
            let decimals = if cell.unit == "mm" { 2 } else { 5 };
            let [low, middle, high] = cell.percentiles.map(|value| format!("{value:.decimals$}"));
            let or_dash =
                |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"));
            writeln!(
                page,
                "| {} | {} | {} | {} | {} | {low} | {middle} | {high} | {:.decimals$} | {} | {:+.1} |",
                cell.method,
                cell.symbol,
                cell.unit,
                cell.published,
                cell.published_sigma.map_or_else(|| "–".to_owned(), |sigma| sigma.to_string()),
                cell.sigma,
                or_dash(cell.single_sigma),
                cell.away
            )?;
        }
        writeln!(page)
    }

    fn write_causes(&self, page: &mut String) -> std::fmt::Result {
        let causes = &self.causes;
        writeln!(page, "\n## The cause: what could reconcile all of the numbers\n")?;
        writeln!(
            page,
            "Five published numbers, each with its standard deviation (measuring and the rounding of the print): {}. Each extension is fitted to all five together with \
             the drive's three parameters; the misfit is the sum of squares in standard deviations.\n",
            NUMBER_NAMES
                .iter()
                .zip(causes.published.iter().zip(&causes.sigma))
                .map(|(name, (value, sigma))| format!("{name} {value:.4} ± {sigma:.4}"))
                .collect::<Vec<_>>()
                .join(", ")
        )?;
        writeln!(page, "| extension | size | plausible | misfit | parameters | {} |", NUMBER_NAMES.join(" | "))?;
        writeln!(page, "| --- | --- | --- | --- | --- |{}", " --- |".repeat(NUMBER_NAMES.len()))?;
        for fitted in &causes.fitted {
            let size =
                if fitted.unit.is_empty() { "–".to_owned() } else { format!("{:+.2} {}", fitted.size, fitted.unit) };
            let plausible_word = if fitted.is_plausible { "yes" } else { "no" };
            let [c_left, c_right, base, ratio, squares] = fitted.predicts;
            writeln!(
                page,
                "| {} | {size} | {plausible_word}: {} | {:.1} | {} | {c_left:.4} | {c_right:.4} | {base:.1} | {ratio:.5} | {squares:.1} |",
                fitted.says, fitted.because, fitted.misfit, fitted.parameters
            )?;
        }
        writeln!(page, "\n{}\n", causes.sentence())?;
        writeln!(page, "One further measurement on the robot would decide; the most informative comes first:\n")?;
        let columns = causes.fitted.iter().map(|fitted| spoken(fitted.extension)).collect::<Vec<_>>().join(" | ");
        writeln!(page, "| drive and read | measures | σ | {columns} | discriminates by |")?;
        writeln!(page, "| --- | --- | --- |{} --- |", " --- |".repeat(causes.fitted.len()))?;
        for experiment in &causes.experiments {
            let predicts: Vec<String> = experiment.predicts.iter().map(|value| format!("{value:.4}")).collect();
            writeln!(
                page,
                "| {} | {} | {:.4} | {} | {:.0} σ |",
                experiment.does,
                experiment.shows,
                experiment.sigma,
                predicts.join(" | "),
                experiment.discriminates_by
            )?;
        }
        writeln!(
            page,
            "\nThis is what the printed numbers allow and no more: the raw data are not available, and an extension that fits five numbers with four parameters \
             is a guess that one measurement can end."
        )
    }

    fn write_audit(&self, page: &mut String) -> std::fmt::Result {
        writeln!(page, "## The audit: where the paper contradicts itself\n")?;
        for finding in &self.audit {
            writeln!(
                page,
                "- **{}.** Printed: {}. Derived: {}.",
                finding.id.replace('_', " "),
                finding.printed,
                finding.derived
            )?;
            if let Some((size, unit)) = finding.separation {
                let decimals = if size.abs() < 1.0 { 3 } else { 1 };
                writeln!(page, "  Difference: {size:.decimals$} {unit}.")?;
            }
            writeln!(page, "  So: {}.", finding.meaning)?;
        }
        Ok(())
    }
}

impl Causes {
    fn sentence(&self) -> String {
        let names = |extensions: &[Extension]| {
            extensions.iter().map(|extension| spoken(*extension)).collect::<Vec<_>>().join(", ")
        };
        let plausible_ones: Vec<Extension> = self
            .fitted
            .iter()
            .filter(|fitted| fitted.is_plausible && self.not_discriminated.contains(&fitted.extension))
            .map(|fitted| fitted.extension)
            .collect();
        let of_these = match plausible_ones.as_slice() {
            [] => "None of them has a plausible size.".to_owned(),
            [one] => format!("Of these only **{}** has a plausible size.", spoken(*one)),
            several => format!("Of these {} have a plausible size.", names(several)),
        };
        format!("The published numbers alone cannot discriminate: {}. {of_these}", names(&self.not_discriminated))
    }
}

const fn spoken(extension: Extension) -> &'static str {
    match extension {
        Extension::None => "no extension",
        Extension::CornerWheelbase => "a wheelbase that differs in corners",
        Extension::StartStopLength => "a length lost per start and stop",
        Extension::TurnSlip => "slip in turns",
        Extension::NominalOf500 => "a nominal of 500 pulses",
        Extension::ScaleOnSquares => "another scale on the squares",
    }
}

const fn name(hypothesis: Hypothesis) -> &'static str {
    match hypothesis {
        Hypothesis::Wheels => "wheels",
        Hypothesis::Measuring => "measuring",
        Hypothesis::Both => "both",
    }
}

/// A statistic to the digits that the paper prints, and one more.
fn number(statistic: &str, value: f64) -> String {
    match statistic {
        "count" => format!("{value:.0}"),
        "variance" => format!("{value:.2e}"),
        "std" => format!("{value:.5}"),
        _ => format!("{value:.4}"),
    }
}

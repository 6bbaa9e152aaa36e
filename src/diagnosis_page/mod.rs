//! What `yair diagnose --out DIR` writes for people: report.md with its pictures, to be read from top to
//! bottom.

mod pictures;
pub(crate) mod words;

use std::fmt::Write;
use std::path::Path;

use diagnose::{Alternative, Document, Residuals, Status, Verdict};

use crate::plain_text::{markdown, printable};
use crate::simulate::write_whole;
use crate::terminal::Failure;
use pictures::{Picture, pictures};
pub(crate) use pictures::{predictions_title, that_matter};

/// What is drawn and told.
pub(crate) struct Page<'d> {
    pub(crate) document: &'d Document,
    pub(crate) residuals: &'d Residuals,
    pub(crate) alternatives: &'d [Alternative],
}

/// Alternatives that are told: those that do not stand out at all are one line.
const MAX_ALTERNATIVES: usize = 12;

impl Page<'_> {
    /// Writes report.md, its pictures and residuals.json.
    pub(crate) fn write(&self, out: &Path) -> Result<(), Failure> {
        let extended = self.document.gain.is_some();
        let pictures = pictures(self.residuals, self.document.next_experiment.as_ref(), extended);
        for (stem, _, figure) in &pictures {
            figure.write(out, stem)?;
        }
        write_whole(&out.join("residuals.json"), &serde_json::to_vec_pretty(self.residuals)?)?;
        let mut text = String::new();
        // Writing to a String does not fail.
        let _ = self.text(&mut text, &pictures);
        write_whole(&out.join("report.md"), text.as_bytes())
    }

    fn text(&self, page: &mut String, pictures: &[Picture]) -> std::fmt::Result {
        let names = match &self.document.dataset {
            calib::Names::One(name) => name.clone(),
            calib::Names::Several(names) => names.join(", "),
        };
        writeln!(page, "# Diagnosis of {}\n\n{}\n", markdown(&names), markdown(&words::verdict(self.document)))?;
        if let Some(subsample) = &self.document.subsample {
            writeln!(page, "{}.\n", markdown(&words::capitalised(&subsample.sentence)))?;
        }
        self.findings(page)?;
        self.residuals(page, pictures)?;
        self.checks(page)?;
        self.alternatives(page)?;
        self.blind(page)?;
        self.next(page, pictures)?;
        self.calibration(page)
    }

    fn findings(&self, page: &mut String) -> std::fmt::Result {
        if self.document.findings.is_empty() {
            return Ok(());
        }
        writeln!(page, "## What was found\n")?;
        writeln!(
            page,
            "| finding | other causes that explain it | probability of the first cause | z | what it is |\n| --- | --- | --- | --- | --- |"
        )?;
        for finding in &self.document.findings {
            let others = if finding.names.len() > 1 { finding.names[1..].join(", ") } else { "–".to_owned() };
            let what = markdown(&words::meaning(finding));
            writeln!(page, "| `{}` | {others} | {:.2} | {:.1} | {what} |", finding.id, finding.probability, finding.z)?;
        }
        writeln!(page)?;
        if let Some(gain) = &self.document.gain {
            let score = gain.log_score_per_observation;
            writeln!(
                page,
                "Cross-validated over {} runs or blocks of runs, the mean log predictive density of a measured component rises by {:.4} with the extended model (95 %: {:.4} to {:.4}).\n",
                gain.held_out_runs,
                score.extended - score.base,
                score.low,
                score.high
            )?;
        } else if let Some(why) = &self.document.gain_why_null {
            writeln!(page, "No gain is stated: {}.\n", markdown(why))?;
        }
        Ok(())
    }

    fn residuals(&self, page: &mut String, pictures: &[Picture]) -> std::fmt::Result {
        writeln!(page, "## Residuals\n")?;
        // A covariate of a dataset has whatever name its file gives it.
        let matter: Vec<String> = that_matter(self.residuals).iter().map(|against| markdown(&against.label)).collect();
        if self.document.verdict == Verdict::Consistent {
            writeln!(
                page,
                "The residuals of the calibrated model depend on no recorded covariate. The largest dependence, within p_value, is on {}:\n",
                matter.join(" and ")
            )?;
        } else {
            let extended = if self.document.gain.is_some() { " and of the extended model" } else { "" };
            writeln!(page, "Residuals of the calibrated{extended} against {}:\n", matter.join(", "))?;
        }
        for (stem, alt, _) in pictures.iter().filter(|(stem, ..)| *stem == "residuals") {
            writeln!(page, "![{}]({stem}.svg)\n", markdown(alt))?;
        }
        if !self.residuals.by_covariate.is_empty() {
            writeln!(
                page,
                "Every covariate is drawn in [residuals-all.svg](residuals-all.svg); the numbers are in [residuals.json](residuals.json).\n"
            )?;
        }
        Ok(())
    }

    fn checks(&self, page: &mut String) -> std::fmt::Result {
        let checks = &self.document.checks;
        let failed = checks.iter().filter(|check| !check.passes).count();
        writeln!(page, "## Checks of the residuals\n")?;
        let of = if self.document.gain.is_some() { "extended" } else { "calibrated" };
        writeln!(
            page,
            "Residuals of the {of} model; {failed} of {} checks fail, together at {} % (Holm).\n",
            checks.len(),
            100.0 * diagnose::CHECKS_LEVEL
        )?;
        writeln!(page, "| question | answer | statistic | p-value |\n| --- | --- | --- | --- |")?;
        for check in checks {
            let answer = if check.passes { "yes" } else { "**no**" };
            writeln!(
                page,
                "| {} | {answer} | {:.2} | {} |",
                markdown(&words::question(check)),
                check.statistic,
                words::p_value(check.p_value)
            )?;
        }
        writeln!(page)
    }

    fn alternatives(&self, page: &mut String) -> std::fmt::Result {
        let detectable = self.alternatives.iter().filter(|alternative| alternative.status.is_tested());
        let (standing, others): (Vec<_>, Vec<_>) =
            detectable.partition(|alternative| alternative.status != Status::NotSignificant);
        if standing.is_empty() && others.is_empty() {
            return Ok(());
        }
        writeln!(page, "## Alternatives\n")?;
        if !standing.is_empty() {
            writeln!(
                page,
                "Each effect alone with the calibration, before any other is in the model: its significance, and its log odds against the best, to second order.\n"
            )?;
            writeln!(page, "| effect | z | log odds against the best | outcome |\n| --- | --- | --- | --- |")?;
            for alternative in standing.iter().take(MAX_ALTERNATIVES) {
                writeln!(
                    page,
                    "| `{}` | {:.1} | {:.1} | {} |",
                    alternative.id,
                    alternative.z,
                    alternative.to_the_best,
                    alternative.status.text()
                )?;
            }
            writeln!(page)?;
        }
        if !others.is_empty() {
            let ids: Vec<String> = others.iter().map(|other| format!("`{}` (z = {:.1})", other.id, other.z)).collect();
            writeln!(page, "Tested and not significant: {}.\n", ids.join(", "))?;
        }
        Ok(())
    }

    fn blind(&self, page: &mut String) -> std::fmt::Result {
        let blind = &self.document.blind_to;
        writeln!(page, "## What these data cannot detect\n")?;
        if blind.is_empty() {
            writeln!(
                page,
                "Every effect of the catalogue that these motions excite would have been detected at a size that is large for a real robot.\n"
            )?;
        } else {
            writeln!(page, "| effect | detection limit | why |\n| --- | --- | --- |")?;
            for blind in blind {
                let size = blind.smallest_detectable.as_ref().map_or_else(
                    || "none".to_owned(),
                    |size| {
                        format!(
                            "{} = {:.1e} {}",
                            size.parameter,
                            size.value,
                            if size.unit == "1" { "" } else { &size.unit }
                        )
                    },
                );
                writeln!(page, "| `{}` | {} | {} |", blind.id, size.trim_end(), markdown(&blind.why))?;
            }
            writeln!(page, "\nDetection limits: power 0.9 at a false-positive rate of 1e-3.\n")?;
        }
        let shows: Vec<String> = self
            .document
            .sensitivity
            .iter()
            .filter(|entry| blind.iter().all(|blind| blind.id != entry.id))
            .filter_map(|entry| {
                let size = entry.smallest_detectable.as_ref()?;
                let unit = if size.unit == "1" { String::new() } else { format!(" {}", size.unit) };
                Some(format!("`{}` from {} = {:.1e}{unit} on", entry.id, size.parameter, size.value))
            })
            .collect();
        if !shows.is_empty() {
            writeln!(page, "Detectable, and not detected: {}.\n", shows.join("; "))?;
        }
        Ok(())
    }

    fn next(&self, page: &mut String, pictures: &[Picture]) -> std::fmt::Result {
        writeln!(page, "## Next experiment\n")?;
        let Some(next) = &self.document.next_experiment else {
            let why = self.document.next_experiment_why_null.as_deref().unwrap_or("none was sought");
            return writeln!(page, "None: {}.\n", markdown(why));
        };
        writeln!(page, "{}\n", markdown(&words::capitalised(&next.why)))?;
        writeln!(page, "| effect | predicts |\n| --- | --- |")?;
        for (id, prediction) in &next.predicts {
            writeln!(page, "| `{id}` | {} |", markdown(prediction))?;
        }
        writeln!(page)?;
        for (stem, alt, _) in pictures.iter().filter(|(stem, ..)| *stem == "next-experiment") {
            writeln!(page, "![{}]({stem}.svg)\n", markdown(alt))?;
        }
        writeln!(
            page,
            "```toml\n{}\n```\n\n`yair plan` seeks it in another room or time (`--room X,Y --minutes M`).\n",
            printable(next.protocol.trim_end()).replace("```", "`")
        )
    }

    fn calibration(&self, page: &mut String) -> std::fmt::Result {
        writeln!(page, "## Calibration\n\nEstimated together with the effects that were found.\n")?;
        writeln!(page, "| parameter | value | sigma |\n| --- | --- | --- |")?;
        for method in &self.document.calibration.methods {
            for (name, value) in &method.parameters {
                let sigma = value.sigma.map_or_else(|| "–".to_owned(), |sigma| format!("{sigma:.1e}"));
                let found = value.value.map_or_else(|| "–".to_owned(), |found| format!("{found:.7}"));
                writeln!(page, "| `{name}` | {found} | {sigma} |")?;
            }
            for unobservable in &method.not_observable {
                writeln!(page, "\nNot observable: {} – {}", unobservable.parameter, markdown(&unobservable.why))?;
            }
        }
        match (&self.document.extended_model, &self.document.extended_model_why_null) {
            (Some(_), _) => writeln!(
                page,
                "\nThe robot as found, with its effects, is [extended.toml](extended.toml): `yair simulate` drives it."
            ),
            (None, Some(why)) => writeln!(page, "\nThere is no extended scenario: {}.", markdown(why)),
            (None, None) => Ok(()),
        }
    }
}

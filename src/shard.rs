//! `--shard I/N` and `--shard auto`: which part of a campaign is this process's, as its cluster says.

use std::path::Path;
use std::str::FromStr;

use bench::{FolderLock, Shard};

use crate::terminal::{Failure, Terminal};

/// What `--shard` asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ShardChoice {
    /// This part.
    Given(Shard),
    /// The part that the environment names.
    Auto,
}

impl FromStr for ShardChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        text.parse().map(Self::Given).map_err(|why| format!("{why}, or auto"))
    }
}

impl ShardChoice {
    /// The part that is meant.
    pub(crate) fn resolved(self, terminal: &Terminal) -> Result<Shard, Failure> {
        match self {
            Self::Given(shard) => Ok(shard),
            Self::Auto => {
                let (shard, by) =
                    from_environment(|name| std::env::var(name).ok()).map_err(|why| format!("--shard auto: {why}"))?;
                terminal.remark(&format!("shard {shard}, by {by}"));
                Ok(shard)
            }
        }
    }
}

/// The folder of a part or of a whole campaign, for this process alone.
pub(crate) fn locked(out: &Path, terminal: &Terminal) -> Result<FolderLock, Failure> {
    let lock = FolderLock::take(out)?;
    if let Some(why) = lock.why_not_held() {
        terminal.remark(&format!(
            "warning: {}: it cannot be locked ({why}); see to it that no other process writes there",
            out.display()
        ));
    }
    Ok(lock)
}

/// A part as I/N, in place of a cluster's variables.
const SHARD: &str = "YAIR_SHARD";
/// How many parts there are.
const SHARDS: &str = "YAIR_SHARDS";
/// Slurm: the number of this task in its array.
const SLURM_ID: &str = "SLURM_ARRAY_TASK_ID";
/// Slurm: the least number of a task that was submitted with it.
const SLURM_MIN: &str = "SLURM_ARRAY_TASK_MIN";
/// Slurm: the largest one.
const SLURM_MAX: &str = "SLURM_ARRAY_TASK_MAX";
/// Slurm: from one number to the next.
const SLURM_STEP: &str = "SLURM_ARRAY_TASK_STEP";
/// Slurm: how many tasks were submitted together.
const SLURM_COUNT: &str = "SLURM_ARRAY_TASK_COUNT";
/// Kubernetes: the number of this pod in its indexed Job, from 0. It says nowhere how many there are.
const KUBERNETES_INDEX: &str = "JOB_COMPLETION_INDEX";

/// The part that the environment names, and by which variable; `variable` looks one up.
fn from_environment(variable: impl Fn(&str) -> Option<String>) -> Result<(Shard, &'static str), String> {
    // An empty variable is one that a script did not fill.
    let text = |name: &str| variable(name).map(|text| text.trim().to_owned()).filter(|text| !text.is_empty());
    let whole = |name: &str| -> Result<Option<u32>, String> {
        let parsed = |text: String| text.parse().map_err(|_| format!("{name}={text}: expected a whole number"));
        text(name).map(parsed).transpose()
    };
    let counted = |number: u32, of: u32, by: &'static str| {
        let shard = Shard::new(number, of).ok_or_else(|| format!("{by} names part {number}, and {SHARDS}={of}"));
        shard.map(|shard| (shard, by))
    };
    if let Some(given) = text(SHARD) {
        let shard = given.parse().map_err(|why| format!("{SHARD}={given}: {why}"))?;
        return Ok((shard, SHARD));
    }
    let shards = whole(SHARDS)?;
    match (whole(SLURM_ID)?, whole(KUBERNETES_INDEX)?) {
        (Some(_), Some(_)) => {
            Err(format!("both {SLURM_ID} and {KUBERNETES_INDEX} are set; say which part this is: {SHARD}=I/N"))
        }
        // Of a task that is submitted again by itself Slurm's other variables know nothing of the others.
        (Some(id), None) => match shards {
            Some(of) => counted(id, of, SLURM_ID),
            None => of_an_array(id, &[whole(SLURM_MIN)?, whole(SLURM_MAX)?, whole(SLURM_STEP)?, whole(SLURM_COUNT)?]),
        },
        (None, Some(index)) => match shards {
            Some(of) => counted(index.saturating_add(1), of, KUBERNETES_INDEX),
            None => Err(format!(
                "{KUBERNETES_INDEX} is set, and Kubernetes does not say of how many; set {SHARDS} to the Job's completions"
            )),
        },
        (None, None) => Err(format!(
            "none of {SHARD} (as 2/8), {SLURM_ID} (a Slurm array) and {KUBERNETES_INDEX} (an indexed Job of Kubernetes) is set; give --shard I/N"
        )),
    }
}

/// The part of a task in an array that was submitted as a whole: MIN, MAX, STEP, COUNT.
fn of_an_array(id: u32, array: &[Option<u32>; 4]) -> Result<(Shard, &'static str), String> {
    let set_shards = format!("submit it as --array=1-N and set {SHARDS} to N");
    let [Some(min), max, step, Some(count)] = *array else {
        return Err(format!("{SLURM_ID} is set, {SLURM_MIN} or {SLURM_COUNT} is not; {set_shards}"));
    };
    if count <= 1 {
        return Err(format!(
            "the Slurm array has one task: is it one that was submitted again? Set {SHARDS} to the number of all"
        ));
    }
    let step = step.unwrap_or(1).max(1);
    let number = id.checked_sub(min).filter(|after| after % step == 0).map(|after| after / step + 1);
    let is_even = max.is_none_or(|max| max.checked_sub(min).is_some_and(|span| span / step + 1 == count));
    let shard = number.filter(|_| is_even).and_then(|number| Shard::new(number, count));
    shard
        .map(|shard| (shard, SLURM_ID))
        .ok_or_else(|| format!("the numbers of the Slurm array's {count} tasks are not evenly spaced; {set_shards}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(variables: &[(&str, &str)]) -> Result<String, String> {
        let variable = |name: &str| variables.iter().find(|(of, _)| *of == name).map(|(_, text)| (*text).to_owned());
        from_environment(variable).map(|(shard, _)| shard.to_string())
    }

    fn slurm(
        id: &'static str,
        min: &'static str,
        max: &'static str,
        step: &'static str,
        count: &'static str,
    ) -> Result<String, String> {
        found(&[(SLURM_ID, id), (SLURM_MIN, min), (SLURM_MAX, max), (SLURM_STEP, step), (SLURM_COUNT, count)])
    }

    #[test]
    fn every_task_of_an_array_has_a_part_of_its_own() {
        assert_eq!(slurm("1", "1", "16", "1", "16"), Ok("1/16".to_owned()));
        assert_eq!(slurm("16", "1", "16", "1", "16"), Ok("16/16".to_owned()));
        // --array=0-3, --array=4-12:4
        let all = |ids: [&'static str; 4]| ids.map(|id| slurm(id, "0", "3", "1", "4"));
        assert_eq!(all(["0", "1", "2", "3"]), ["1/4", "2/4", "3/4", "4/4"].map(|shard| Ok(shard.to_owned())));
        assert_eq!(slurm("8", "4", "12", "4", "3"), Ok("2/3".to_owned()));
        // --array=1,3,7: three tasks; the number does not say which of them this is.
        assert!(slurm("3", "1", "7", "1", "3").is_err_and(|why| why.contains("--array=1-N")));
        // --array=3, submitted again, would be the whole campaign.
        assert!(slurm("3", "3", "3", "1", "1").is_err_and(|why| why.contains("submitted again")));
        assert_eq!(found(&[(SLURM_ID, "3"), (SLURM_COUNT, "1"), (SHARDS, "16")]), Ok("3/16".to_owned()));
        assert!(found(&[(SLURM_ID, "3")]).is_err_and(|why| why.contains(SLURM_COUNT)));
    }

    #[test]
    fn kubernetes_counts_from_0_and_plain_variables_come_first() {
        assert_eq!(found(&[(KUBERNETES_INDEX, "0"), (SHARDS, "4")]), Ok("1/4".to_owned()));
        assert_eq!(found(&[(KUBERNETES_INDEX, "3"), (SHARDS, "4")]), Ok("4/4".to_owned()));
        assert_eq!(found(&[(SHARD, "2/8"), (KUBERNETES_INDEX, "3"), (SLURM_ID, "")]), Ok("2/8".to_owned()));
        for (variables, word) in [
            (&[][..], "give --shard I/N"),
            (&[(KUBERNETES_INDEX, "3")], "completions"),
            (&[(KUBERNETES_INDEX, "4"), (SHARDS, "4")], "part 5"),
            (&[(KUBERNETES_INDEX, "x"), (SHARDS, "4")], "whole number"),
            (&[(SLURM_ID, "0"), (SHARDS, "4")], "part 0"),
            (&[(SLURM_ID, "1"), (KUBERNETES_INDEX, "1")], "both"),
            (&[(SHARD, "9/8")], "1 <= I <= N"),
        ] {
            assert!(found(variables).is_err_and(|why| why.contains(word)), "{variables:?}: {:?}", found(variables));
        }
    }
}

//! What sessions and runs are called in findings.

use dataset::Dataset;

/// What sessions are called.
pub(crate) fn session_names(datasets: &[Dataset]) -> Vec<String> {
    let name = |dataset: &Dataset| dataset.provenance.name.clone().unwrap_or_else(|| "dataset".to_owned());
    datasets.iter().map(name).collect()
}

/// What a run is called: with its session where there are several, as each may have a run of the same id.
pub(crate) fn run_name(datasets: &[Dataset], session: usize, run: usize) -> String {
    let id = &datasets[session].runs[run].info.id;
    match datasets {
        [_] => id.clone(),
        several => format!("{}/{id}", session_names(several)[session]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_several_sessions_is_named_with_its_session() {
        let [mut monday, mut tuesday] = [0, 1].map(|seed| crate::small_robot::session(seed, 0.0));
        monday.provenance.name = Some("monday".to_owned());
        tuesday.provenance.name = Some("tuesday".to_owned());
        let id = tuesday.runs[2].info.id.clone();
        assert_eq!(run_name(&[monday, tuesday.clone()], 1, 2), format!("tuesday/{id}"));
        assert_eq!(run_name(&[tuesday], 0, 2), id);
    }
}

//! Where a diagnosis stands, for whoever waits for it.

use std::fmt;
use std::sync::Arc;

/// A stage that begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stage {
    /// What is done, for people.
    pub name: &'static str,
    /// Share of the whole time that was spent before it, as far as the stages' usual shares hold.
    pub done: f64,
}

/// What is told of every stage; nothing by default.
#[derive(Clone, Default)]
pub struct OnStage(Option<Arc<dyn Fn(Stage) + Send + Sync>>);

impl OnStage {
    /// Calls a function when a stage begins.
    #[must_use]
    pub fn call(function: impl Fn(Stage) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(function)))
    }

    pub(crate) fn begins(&self, step: Step) {
        let Some(function) = &self.0 else { return };
        let all: f64 = STEPS.iter().map(|(_, _, share)| share).sum();
        let before: f64 = STEPS.iter().take_while(|(of, ..)| *of != step).map(|(_, _, share)| share).sum();
        let name = STEPS.iter().find(|(of, ..)| *of == step).map_or("", |(_, name, _)| name);
        function(Stage { name, done: before / all });
    }
}

impl fmt::Debug for OnStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "OnStage(a function)" } else { "OnStage(nothing)" })
    }
}

/// The stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    Motions,
    RecordFaults,
    MeanStructure,
    CarryOver,
    Gain,
    Detectability,
    NextExperiment,
    Residuals,
}

/// The stages in their order, each with its share of the time. Tuned: by hand, not measured; on long logs
/// the search for effects takes more than its share. They say when to look again, and nothing depends on
/// them.
const STEPS: [(Step, &str, f64); 8] = [
    (Step::Motions, "intervals that do not belong", 0.05),
    (Step::RecordFaults, "calibrated model, and faults of the records", 0.15),
    (Step::MeanStructure, "which effects the residuals show", 0.45),
    (Step::CarryOver, "whether they hold in every session", 0.05),
    (Step::Gain, "gain on held-out runs", 0.10),
    (Step::Detectability, "what could not have shown", 0.08),
    (Step::NextExperiment, "next experiment", 0.10),
    (Step::Residuals, "residuals", 0.02),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn stages_begin_in_their_order_and_their_shares_grow_from_zero() {
        let reported = Arc::new(Mutex::new(Vec::new()));
        let report = Arc::clone(&reported);
        let on_stage = OnStage::call(move |stage| report.lock().expect("one thread").push(stage));
        STEPS.iter().for_each(|(step, ..)| on_stage.begins(*step));
        let reported = reported.lock().expect("one thread");
        assert_eq!((reported.len(), reported[0].done), (STEPS.len(), 0.0));
        assert!(
            reported.windows(2).all(|pair| pair[0].done < pair[1].done) && reported[reported.len() - 1].done < 1.0,
            "{reported:?}"
        );
        OnStage::default().begins(Step::Gain);
    }
}

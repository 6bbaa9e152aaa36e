//! What the oracle knows of a hidden effect: noncentrality, ratio to the detection limit, aliases.

use dataset::{Number, checked};

use crate::hidden::{EffectKind, Hidden};
use crate::oracle::Detectability;
use crate::power::{DISCRIMINATION_LEVEL, detection_limit};

/// What the oracle knows of a hidden effect.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OracleView {
    /// The effect.
    pub id: String,
    /// Its kind.
    pub kind: EffectKind,
    /// Whether it acts in another functional form than the catalogue's.
    pub other_form: bool,
    /// Sizes by the hypothesis's names, shape parameters after them.
    #[serde(rename = "sizes", deserialize_with = "checked::<Vec<(String, Number)>, _>")]
    pub values: Vec<(String, f64)>,
    /// Noncentrality of the test that knows it; beside another hidden effect, with that in the model. `None`
    /// for gross faults.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub noncentrality: Option<f64>,
    /// Its size over the smallest that this test finds with power 0.9. `None` for gross faults.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub ratio: Option<f64>,
    /// How much of its signature's χ² its hypothesis takes up: 1 where that has its form. `None` for gross
    /// faults and scatter.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub form_share: Option<f64>,
    /// Noncentrality of the best test between it and each other name whose sizes can be, the least first:
    /// what the other name leaves of it. Empty for gross faults.
    #[serde(deserialize_with = "checked::<Vec<(String, Number)>, _>")]
    pub rivals: Vec<(String, f64)>,
    /// The other names that this test does not tell from it with power 0.9; of a gross fault, those whose
    /// corrections leave as little.
    pub aliases: Vec<String>,
    /// Share of the noncentrality that the rounding of the counts takes; `None` where rounding does not
    /// matter, and of what is no mean.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub rounding_share: Option<f64>,
}

/// A size with which a scatter or a gross fault must be named for itself: there is no oracle between their
/// names.
const CLEAR_RATIO: f64 = 2.0;

/// An effect counts as plain at this many detection limits, the bar on the power's ratio.
const PLAIN_RATIO: f64 = 1.6;

/// An encoder that takes so much of an effect's noncentrality does not resolve it.
const UNRESOLVED_SHARE: f64 = 0.9;

impl OracleView {
    /// Whether other names are right of it as well, or nobody can say that they are not.
    #[must_use]
    pub fn is_aliased(&self) -> bool {
        match self.kind {
            EffectKind::Mean | EffectKind::RecordFault => !self.aliases.is_empty(),
            EffectKind::Scatter => !self.aliases.is_empty() || self.ratio.is_none_or(|ratio| ratio < CLEAR_RATIO),
        }
    }

    /// Whether the effect is large enough that it must be detected, beside another hidden effect too.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.ratio.is_some_and(|ratio| ratio >= PLAIN_RATIO)
    }

    /// Whether the encoder resolves the effect.
    pub(crate) fn is_resolved(&self) -> bool {
        self.rounding_share.is_none_or(|share| share < UNRESOLVED_SHARE)
    }
}

/// Whether an effect's signature is random in part: where in its gap a wheel was left, which fraction of a
/// count was lost.
pub(crate) fn has_random_signature(effect: &Hidden) -> bool {
    effect.benchmark.has_random_signature
}

/// Whether only what its hypothesis takes up of an effect's signature can be known: of another form, and
/// where it is random in part.
pub(crate) fn is_known_by_form_alone(effect: &Hidden) -> bool {
    effect.other_form || has_random_signature(effect)
}

/// Noncentrality of the test that knows the effect.
pub(crate) fn known_noncentrality(effect: &Hidden, detectability: &Detectability) -> f64 {
    if is_known_by_form_alone(effect) {
        detectability.noncentrality_in_form(effect.id)
    } else {
        detectability.noncentrality()
    }
}

/// λ over that of the detection limit, as a ratio of sizes.
pub(crate) fn size_ratio(effect: &Hidden, detectability: &Detectability) -> f64 {
    match effect.kind {
        EffectKind::Mean => {
            (known_noncentrality(effect, detectability) / detection_limit(detectability.freedom(effect.id))).sqrt()
        }
        // λ grows with the fourth power of the size.
        _ => (detectability.scatter / DISCRIMINATION_LEVEL).powf(0.25),
    }
}

/// What the oracle knows of one hidden effect of a case: `detectability` of each hidden effect alone, `both`
/// of a pair together.
pub(crate) fn view(
    effect: &Hidden,
    index: usize,
    detectability: &[Option<Detectability>],
    both: Option<&Detectability>,
    others: &[Hidden],
) -> OracleView {
    let values = effect.values().into_iter().map(|(name, size)| (name.to_owned(), size)).collect();
    let mut view = OracleView {
        id: effect.id.to_owned(),
        kind: effect.kind,
        other_form: effect.other_form,
        values,
        noncentrality: None,
        ratio: None,
        form_share: None,
        rivals: Vec::new(),
        aliases: Vec::new(),
        rounding_share: None,
    };
    let Some(own) = detectability[index].as_ref() else { return view };
    if effect.kind == EffectKind::Mean {
        let other = others.iter().position(|other| other.id != effect.id);
        let other = other.and_then(|other| Some((&others[other], detectability[other].as_ref()?)));
        let noncentrality = match (both, other) {
            (Some(both), Some((other, _))) if is_known_by_form_alone(effect) => {
                both.noncentrality_beside(effect.id, other.id)
            }
            (Some(both), Some((_, other))) => {
                // By polarisation: ⟨a, b⟩ = (|a + b|² − |a|² − |b|²)/2.
                let (a, b) = (own.noncentrality(), other.noncentrality());
                let product = 0.5 * (both.noncentrality() - a - b);
                if b > 0.0 { (a - product * product / b).max(0.0) } else { a }
            }
            _ => known_noncentrality(effect, own),
        };
        view.noncentrality = Some(noncentrality);
        view.ratio = Some((noncentrality / detection_limit(own.freedom(effect.id))).sqrt());
        view.form_share = Some(form_share(effect, own));
    } else {
        view.noncentrality = Some(own.scatter);
        view.ratio = Some(size_ratio(effect, own));
    }
    // What scatters may look like a mean: sliding at every start is a slip that grows with the acceleration.
    view.rivals = own
        .rivals(effect.id, known_noncentrality(effect, own))
        .into_iter()
        .map(|(id, left)| (id.to_owned(), left))
        .collect();
    view.aliases =
        view.rivals.iter().filter(|(_, left)| *left < DISCRIMINATION_LEVEL).map(|(id, _)| id.clone()).collect();
    view
}

/// How much of an effect's signature its own hypothesis takes up.
pub(crate) fn form_share(effect: &Hidden, detectability: &Detectability) -> f64 {
    let whole = detectability.noncentrality();
    if whole > 0.0 { detectability.noncentrality_in_form(effect.id) / whole } else { 0.0 }
}

//! A fit with candidate terms: the augmented model, its cost against that of others, and refits with other terms.

use std::ops::Range;

use estimation::{Column, Evidence, JointFit, total};
use nalgebra::DVector;

use crate::candidate::{Choice, terms};

/// A fit with effects.
#[derive(Debug, Clone)]
pub(crate) struct Extended<'a> {
    pub(crate) fit: JointFit<'a>,
    pub(crate) choices: Vec<Choice>,
}

impl<'a> Extended<'a> {
    /// A fit without any.
    pub(crate) fn alone(base: &JointFit<'a>) -> Self {
        Self { fit: base.clone(), choices: Vec::new() }
    }

    /// Which of the fit's sizes are a choice's.
    pub(crate) fn range(&self, place: usize) -> Range<usize> {
        let first = self.choices[..place].iter().map(|choice| choice.parameters().len()).sum();
        first..first + self.choices[place].parameters().len()
    }

    /// The indices of a choice's columns.
    pub(crate) fn columns(&self, place: usize) -> Vec<usize> {
        self.range(place).map(|k| Column::Term(k).index()).collect()
    }

    /// A choice's sizes.
    pub(crate) fn sizes(&self, place: usize) -> DVector<f64> {
        DVector::from_column_slice(&self.fit.fit.model.sizes[self.range(place)])
    }
}

/// −log likelihood of a fit over as many innovations as the fullest of those compared: a look that one fit takes for an outlier is charged as one.
pub(crate) fn cost(fit: &JointFit<'_>, count: f64) -> f64 {
    total(&fit.fit.pass.runs).map_or(f64::INFINITY, |sum| sum.cost() + left_out_cost(&sum, count))
}

/// What the innovations that are missing to a number of them cost: each lies as far off as an outlier does at least, and has a variance as the others have.
pub(crate) fn left_out_cost(evidence: &Evidence, count: f64) -> f64 {
    // Half of the χ² with three degrees of freedom at which a look is an outlier, a component.
    const OUTLIER: f64 = 0.5 * 25.9 / 3.0;
    (count - evidence.count).max(0.0) * (OUTLIER + 0.5 * evidence.log_det / evidence.count.max(1.0))
}

pub(crate) fn count(fit: &JointFit<'_>) -> f64 {
    fit.fit.pass.runs.iter().map(|run| run.count).sum()
}

/// A fit that takes a smaller share of the looks that another one takes has lost the robot.
const LEAST_FOLLOWED: f64 = 0.5;

/// The model with other choices, fitted from where it stands, and where steps stray from the base too: the likelier of the two. `None` when both diverge.
pub(crate) fn refit<'a>(base: &JointFit<'a>, from: &Extended<'a>, choices: Vec<Choice>) -> Option<Extended<'a>> {
    let mut sizes = Vec::new();
    for choice in &choices {
        let none = vec![0.0; choice.parameters().len()];
        let of_shape = from.choices.iter().position(|own| own == choice);
        let known = of_shape.or_else(|| from.choices.iter().position(|own| own.is_shape_of(choice)));
        let own = known.map(|place| from.sizes(place).as_slice().to_vec());
        sizes.extend(own.filter(|own| own.len() == none.len()).unwrap_or(none));
    }
    let follows = |fit: &JointFit<'_>| {
        fit.fit.model.sizes.iter().all(|size| size.is_finite()) && count(fit) > LEAST_FOLLOWED * count(&from.fit)
    };
    let near = from.fit.extended_from(sizes, &mut terms(&choices)).ok().filter(follows);
    let near = match near {
        Some(fit) if !fit.fit.strayed => return Some(Extended { fit, choices }),
        near => near,
    };
    let anew = base.extended(&mut terms(&choices)).ok().filter(follows);
    let most = [&near, &anew].into_iter().flatten().map(count).fold(0.0, f64::max);
    let fit = near.into_iter().chain(anew).min_by(|a, b| cost(a, most).total_cmp(&cost(b, most)))?;
    Some(Extended { fit, choices })
}

/// A model's choices but one.
pub(crate) fn others(model: &Extended<'_>, place: usize) -> Vec<Choice> {
    let mut others = model.choices.clone();
    others.remove(place);
    others
}

/// A model without one of its choices; the base where it has no other. `None` when that diverges.
pub(crate) fn without<'a>(base: &JointFit<'a>, model: &Extended<'a>, place: usize) -> Option<Extended<'a>> {
    let others = others(model, place);
    if others.is_empty() { Some(Extended::alone(base)) } else { refit(base, model, others) }
}

//! Score tests of what residuals may depend on: products of covariates on every channel, beside what the
//! model has.

use effects::{Channel, Covariate, Sparse};
use estimation::ModelFit;
use kinematics::Side;

use crate::candidates::candidate::Candidate;
use crate::candidates::covariates::{of_cycles, of_runs};
use crate::checks::check::Check;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::null_distribution::NullDistribution;
use crate::fits::scan::{detectable_statistic, freedom, scan_parts_of};
use crate::fits::statistics::{p_of_score, sidak};
use crate::settings::RESIDUALS;

/// A quantity on which residuals may depend.
struct Question {
    name: String,
    /// Groups that are tested as a whole; the smallest p-value answers, corrected for the number of groups.
    groups: Vec<Vec<Candidate>>,
}

fn questions(fit: &ModelFit<'_>) -> Vec<Question> {
    use Covariate::{
        AbsSpeed, AbsYawRate, Acceleration, CosHeading, CosPhase, Curvature, LastTurn, RunTime, SessionTime,
        SinHeading, SinPhase, SinceReversal, Speed, Way, WheelSinceReversal, WheelSpeed, X, Y, YawAcceleration,
        YawRate,
    };
    let mut questions: Vec<(String, Vec<Vec<Covariate>>)> = [
        ("speed", vec![vec![AbsSpeed], vec![Speed, AbsSpeed]]),
        ("yaw_rate", vec![vec![AbsYawRate], vec![YawRate, AbsYawRate]]),
        ("speed_times_yaw_rate", vec![vec![Speed, YawRate], vec![AbsSpeed, YawRate]]),
        ("acceleration", vec![vec![Acceleration], vec![YawAcceleration]]),
        ("heading_in_the_room", vec![vec![AbsSpeed, CosHeading], vec![AbsSpeed, SinHeading]]),
        ("left_wheel_phase", vec![vec![CosPhase(Side::Left, 1)], vec![SinPhase(Side::Left, 1)]]),
        ("right_wheel_phase", vec![vec![CosPhase(Side::Right, 1)], vec![SinPhase(Side::Right, 1)]]),
        ("time_in_run", vec![vec![RunTime, Speed], vec![RunTime, YawRate]]),
        ("time_in_session", vec![vec![SessionTime, Speed], vec![SessionTime, YawRate]]),
        ("distance", vec![vec![Way, Speed], vec![Way, YawRate]]),
        ("position", vec![vec![X, Speed], vec![Y, Speed], vec![X, YawRate], vec![Y, YawRate]]),
    ]
    .map(|(name, products)| (name.to_owned(), products))
    .into();
    for covariate in of_runs(fit) {
        let name = format!("covariate_{}", covariate.name());
        questions.push((name, vec![vec![covariate.clone(), Speed], vec![covariate, YawRate]]));
    }
    let on = |channel, covariates: &[Covariate]| Candidate::Sparse(Sparse { channel, covariates: covariates.to_vec() });
    let on_motion = |product: &Vec<Covariate>| Channel::MOTION.map(|channel| on(channel, product));
    let of_motion = questions
        .into_iter()
        .map(|(name, products)| Question { name, groups: vec![products.iter().flat_map(on_motion).collect()] });
    // Of the body either way, to the side of the last turn, and of each wheel for itself.
    let since = [Speed, AbsSpeed].map(|speed| vec![SinceReversal, speed]);
    let of_wheel = [WheelSpeed, WheelSinceReversal];
    let of_reversals = Question {
        name: "distance_since_reversal".to_owned(),
        groups: vec![
            since.iter().flat_map(on_motion).collect(),
            vec![on(Channel::Yaw, &[SinceReversal, AbsSpeed, LastTurn])],
            [Channel::LeftWheel, Channel::RightWheel].map(|channel| on(channel, &of_wheel)).to_vec(),
        ],
    };
    let curvatures = [AbsSpeed, AbsYawRate].map(|rate| on(Channel::Yaw, &[rate, Curvature])).to_vec();
    let of_curvature = Question { name: "bend".to_owned(), groups: vec![curvatures] };
    // A row that is longer than usual by its stamps, and not in truth.
    let of_rows = Question { name: "row_length".to_owned(), groups: vec![vec![Candidate::Sparse(Sparse::of_rows())]] };
    // A cosine and a sine for each number of cycles in a turn.
    let of_cycles = |(side, name): (Side, &str)| Question {
        name: name.to_owned(),
        groups: of_cycles(side).chunks(2).map(|both| both.iter().cloned().map(Candidate::Sparse).collect()).collect(),
    };
    let of_wheels = [(Side::Left, "left_wheel_cycles"), (Side::Right, "right_wheel_cycles")].map(of_cycles);
    of_motion.chain([of_reversals, of_curvature, of_rows]).chain(of_wheels).collect()
}

/// Score tests of every question.
pub(crate) fn covariates(
    model: &AugmentedModel<'_>,
    null: Option<&NullDistribution<'_, '_>>,
    add: &mut impl FnMut(Check, f64, f64),
) {
    let questions = questions(&model.fit);
    let parts: Vec<&[Candidate]> = questions.iter().flat_map(|question| &question.groups).map(Vec::as_slice).collect();
    // Statistic and p-value of each detectable group.
    let answers = scan_parts_of(&model.fit, &model.candidates, &parts, |own, projected, equations| {
        let (statistic, dimensions) = detectable_statistic(own, projected);
        let freedom = freedom(&model.fit, equations);
        let p_value = |statistic| p_of_score(statistic, dimensions, equations.count, freedom);
        (dimensions > 0).then(|| Answer {
            statistic,
            p_value: p_value(statistic),
            dimensions,
            count: equations.count,
            freedom,
        })
    });
    let answers = match null {
        Some(null) => deflated(null, &parts, answers),
        None => answers,
    };
    let mut answers = answers.into_iter();
    for Question { name, groups } in &questions {
        let own: Vec<Answer> = answers.by_ref().take(groups.len()).flatten().collect();
        if let Some(answer) = own.iter().min_by(|a, b| a.p_value.total_cmp(&b.p_value)) {
            add(Check::Covariate(name.clone()), answer.statistic, sidak(answer.p_value, own.len()));
        }
    }
}

/// The score test of a group of terms.
#[derive(Clone, Copy)]
struct Answer {
    statistic: f64,
    p_value: f64,
    dimensions: usize,
    count: f64,
    freedom: f64,
}

/// The answers with their statistics over what coarse encoders inflate them by, where they would matter.
fn deflated(
    null: &NullDistribution<'_, '_>,
    parts: &[&[Candidate]],
    mut answers: Vec<Option<Answer>>,
) -> Vec<Option<Answer>> {
    let matter: Vec<usize> = (0..answers.len())
        .filter(|part| answers[*part].is_some_and(|answer| answer.p_value < RESIDUALS.resimulated_level))
        .collect();
    let groups_that_matter: Vec<&[Candidate]> = matter.iter().map(|part| parts[*part]).collect();
    for (part, inflation) in matter.into_iter().zip(null.inflation(&groups_that_matter)) {
        if let Some(answer) = &mut answers[part] {
            answer.statistic /= inflation;
            answer.p_value = p_of_score(answer.statistic, answer.dimensions, answer.count, answer.freedom);
        }
    }
    answers
}

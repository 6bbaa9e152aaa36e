//! Sessions whose own data say that they are of different robots, whatever their files state.

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::problems::wheels::certain;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// The two sessions that differ most, over what one robot's do.
pub(crate) fn found(sessions: &[SessionCheck]) -> Option<Problem> {
    let estimates: Vec<([f64; 3], [f64; 3], &str)> = sessions
        .iter()
        .filter_map(|session| {
            let geometry = session.matched.as_ref()?.geometry?;
            // What is wrong with a session's wheels has been said of it.
            let sound = geometry.m_per_rad.left * geometry.m_per_rad.right > 0.0 && !geometry.is_diluted;
            let geometry_m = [
                2.0 * geometry.m_per_rad.left.abs(),
                2.0 * geometry.m_per_rad.right.abs(),
                geometry.separation_m.abs(),
            ];
            sound.then_some((geometry_m, geometry.sigma, session.name.as_str()))
        })
        .collect();
    let parameters = [
        ("left_wheel_diameter_m", CHECKS.same_wheel),
        ("right_wheel_diameter_m", CHECKS.same_wheel),
        ("wheel_separation_m", CHECKS.same_separation),
    ];
    let mut worst: Option<(f64, f64, Kind)> = None;
    for (first, a) in estimates.iter().enumerate() {
        for b in &estimates[first + 1..] {
            for (at, (parameter, same)) in parameters.into_iter().enumerate() {
                let log_ratio = (a.0[at] / b.0[at]).ln().abs();
                let sigmas = (log_ratio - same) / a.1[at].hypot(b.1[at]).max(1e-9);
                let ratio = log_ratio / same;
                if log_ratio > same
                    && sigmas > CHECKS.certain_sigmas
                    && worst.as_ref().is_none_or(|worst| ratio > worst.0)
                {
                    let kind = Kind::SeveralRobots {
                        parameter,
                        sessions: [a.2.to_owned(), b.2.to_owned()],
                        values_m: [a.0[at], b.0[at]],
                    };
                    worst = Some((ratio, sigmas, kind));
                }
            }
        }
    }
    worst.map(|(_, sigmas, kind)| Problem::new(&kind, Severity::Error, None, certain(sigmas)))
}

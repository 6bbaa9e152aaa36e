//! The physical effects: the laws that all keep, each simulation model against its estimation model, and both
//! engines against each other.

mod engines_agree;
mod hypotheses;
mod laws;
mod on_board;

//! The physical effects: the laws that all keep, each forward face against its hypothesis face, and both engines against each other.

mod engines_agree;
mod hypotheses;
mod laws;

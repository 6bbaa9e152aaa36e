//! What may be in the data: candidate causes, their covariates, and which sizes a robot can have.

pub(crate) mod candidate;
pub(crate) mod cause;
pub(crate) mod covariates;
pub(crate) mod kinds;
pub(crate) mod physical;

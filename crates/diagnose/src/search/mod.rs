//! The search over the catalogue and over sparse terms: which effects the mean of the data needs.

pub(crate) mod beam;
pub(crate) mod mean_structure;
pub(crate) mod ranking;
pub(crate) mod rivals;
pub(crate) mod selection;
pub(crate) mod sparse_terms;

//! Physical effects.

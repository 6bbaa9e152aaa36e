//! Whose values a picture shows.

/// Whose values a line or point shows: its colour and its form are the same in all pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The outside instrument.
    Truth,
    /// The robot as it believes itself to be.
    Nominal,
    /// The calibrated geometry.
    Calibrated,
    /// The calibrated geometry with what was found.
    ExtendedModel,
    /// What a model says that measurements follow.
    Explained,
}

impl Role {
    /// Its name in data and style sheet.
    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Nominal => "nominal",
            Self::Calibrated => "calibrated",
            Self::ExtendedModel => "extended",
            Self::Explained => "explained",
        }
    }
}

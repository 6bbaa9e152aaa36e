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
    /// One of several methods, by its number from 0; colours repeat after seven.
    Method(u8),
}

/// Keys of methods: of the palette of Okabe and Ito (2008), without yellow.
const METHODS: [&str; 7] = ["method-1", "method-2", "method-3", "method-4", "method-5", "method-6", "method-7"];

impl Role {
    /// Its name in data and style sheet.
    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Nominal => "nominal",
            Self::Calibrated => "calibrated",
            Self::ExtendedModel => "extended",
            Self::Explained => "explained",
            Self::Method(number) => METHODS[number as usize % METHODS.len()],
        }
    }
}

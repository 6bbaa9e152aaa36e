//! A bag whose topics are known: what it says of the robot comes before the import, which needs the robot.

use std::path::{Path, PathBuf};

use crate::bag::Bag;
use crate::error::RosBagError;
use crate::import::{FromBag, Options, import_of};
use crate::topics::Survey;

/// A bag with its topics.
pub struct OpenBag {
    bag: Bag,
    survey: Survey,
}

impl OpenBag {
    /// Opens a bag and reads which topics it has; `definitions` are files of types that it does not define
    /// ([`Options`]).
    ///
    /// # Errors
    /// [`RosBagError`] where there is no bag, or not one message in it.
    pub fn open(path: &Path, definitions: &[PathBuf]) -> Result<Self, RosBagError> {
        let bag = Bag::open(path, definitions)?;
        let survey = Survey::of(&bag)?;
        Ok(Self { bag, survey })
    }

    /// Topic and text of the robot's description (URDF), where the bag has it.
    #[must_use]
    pub fn robot_description(&self) -> Option<(&str, &str)> {
        self.survey.description.as_ref().map(|(topic, text)| (&topic[..], &text[..]))
    }

    /// The dataset of two of its topics.
    ///
    /// # Errors
    /// [`RosBagError`] of the first fault; what could not be read of a damaged bag is a warning.
    pub fn import(mut self, options: &Options) -> Result<FromBag, RosBagError> {
        if let Some(wheels) = &options.known_wheels {
            self.survey.know_wheels(wheels);
        }
        import_of(&self.bag, &self.survey, options)
    }
}

/// Reads a bag as a dataset.
///
/// # Errors
/// As [`OpenBag::import`].
pub fn import(path: &Path, options: &Options) -> Result<FromBag, RosBagError> {
    OpenBag::open(path, &options.definitions)?.import(options)
}

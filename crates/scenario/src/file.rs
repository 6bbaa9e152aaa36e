//! A scenario's text: read and checked, and written.

use std::io::Read;
use std::path::Path;

use crate::error::ScenarioError;
use crate::experiment::Scenario;
use crate::preset::expanded;

/// Scenarios are written by hand; anything larger is another file.
pub const LARGEST_FILE_BYTES: u64 = 1 << 20;

impl Scenario {
    /// Reads and checks a scenario file.
    ///
    /// # Errors
    /// [`ScenarioError`]: unreadable, not a scenario, or values out of range; one line that names the file.
    pub fn read(path: &Path) -> Result<Self, ScenarioError> {
        let io = |source| ScenarioError::Io { path: path.to_owned(), source };
        let location = path.display().to_string();
        // Read no more than the limit, whatever size a device or a pipe states.
        let mut text = String::new();
        let file = std::fs::File::open(path).map_err(io)?;
        file.take(LARGEST_FILE_BYTES + 1).read_to_string(&mut text).map_err(io)?;
        if text.len() as u64 > LARGEST_FILE_BYTES {
            let message = format!("too large for a scenario (at most {LARGEST_FILE_BYTES} bytes)");
            return Err(ScenarioError::Toml { location, message });
        }
        Self::parse(&text, &location)
    }

    /// Parses and checks a scenario; `location` (the file) is named in errors.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, location: &str) -> Result<Self, ScenarioError> {
        let no_toml = |message: String| ScenarioError::Toml { location: location.to_owned(), message };
        if let Some(table) = expanded(text).map_err(no_toml)? {
            let read = table.try_into::<Self>();
            return read.map_err(|error| no_toml(error.message().trim().replace('\n', "; ")))?.checked(location);
        }
        let scenario: Self = toml::from_str(text).map_err(|error| {
            let location = match error.span() {
                Some(span) => format!("{location}:{}", text[..span.start].matches('\n').count() + 1),
                None => location.to_owned(),
            };
            ScenarioError::Toml { location, message: error.message().trim().replace('\n', "; ") }
        })?;
        scenario.checked(location)
    }

    fn checked(self, location: &str) -> Result<Self, ScenarioError> {
        let scenario = self;
        scenario.check(location)?;
        let no_fit =
            |source| ScenarioError::NoFit { location: location.to_owned(), key: "protocol".to_owned(), source };
        scenario.fitted(&scenario.protocols).map_err(no_fit)?;
        if let Some(sweep) = &scenario.sweep {
            sweep.points(&scenario, location)?;
        }
        Ok(scenario)
    }

    /// The scenario as TOML; [`Self::parse`] gives the same scenario back.
    ///
    /// # Errors
    /// [`ScenarioError::Toml`] when a value has no TOML form (a seed beyond 2⁶³).
    pub fn to_toml(&self) -> Result<String, ScenarioError> {
        toml::to_string(self)
            .map_err(|error| ScenarioError::Toml { location: self.name.clone(), message: error.to_string() })
    }
}

//! Why a law cannot be built from the table of a scene.

use serde::de::DeserializeOwned;
use toolkit::scene::read_value;

/// Why a law cannot be built from its table.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// The key of `[[contact]]`.
    pub key: String,
    /// What is wrong.
    pub what: String,
    /// What to try.
    pub cure: Option<String>,
    /// Whether these are the words of the reader of the scene, which it explains itself.
    pub misread: bool,
}

impl Refusal {
    /// Of a key.
    pub fn of(key: impl Into<String>, what: impl Into<String>) -> Self {
        Self { key: key.into(), what: what.into(), cure: None, misread: false }
    }

    /// With what to try.
    #[must_use]
    pub fn try_instead(mut self, cure: impl Into<String>) -> Self {
        self.cure = Some(cure.into());
        self
    }
}

/// A law's own keys as the struct that it takes.
///
/// # Errors
/// With the key that cannot be read; `law` where that is none.
pub fn read<K: DeserializeOwned>(own: &toml::Table) -> Result<K, Refusal> {
    read_value("", &toml::Value::Table(own.clone())).map_err(|e| Refusal {
        cure: e.hint,
        misread: true,
        ..Refusal::of(e.key.filter(|key| !key.is_empty()).unwrap_or("law".into()), e.message)
    })
}

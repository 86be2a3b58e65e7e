//! Why a law cannot be built from the table of a scene.

use serde::de::DeserializeOwned;

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
/// With the key that cannot be read: it is the one in whose place a number could, or nothing; `law` where that is none.
pub fn read<K: DeserializeOwned>(own: &toml::Table) -> Result<K, Refusal> {
    own.clone().try_into().map_err(|e: toml::de::Error| {
        let is_at_fault = |key: &&String| {
            let mut other = own.clone();
            other.insert((*key).clone(), toml::Value::Float(1.0));
            let as_number = other.clone().try_into::<K>().is_ok();
            other.remove(*key);
            as_number || other.try_into::<K>().is_ok()
        };
        let key = own.keys().find(is_at_fault).map_or("law", String::as_str);
        Refusal { misread: true, ..Refusal::of(key, e.message()) }
    })
}

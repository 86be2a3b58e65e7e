//! The name of a run, and the number that stands for it.

use std::collections::hash_map::RandomState;
use std::fmt;
use std::hash::BuildHasher;
use std::str::FromStr;

/// Name of a run: 1 to 16 characters of `a-z A-Z 0-9 -`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunId(String);

impl RunId {
    /// A new one, from the system's random numbers: nobody can take the names that follow from it beforehand.
    pub fn new() -> Self {
        Self(format!("{:016x}", RandomState::new().hash_one(std::process::id())))
    }

    /// As it is written.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The number that stands for it in headers.
    pub fn number(&self) -> u64 {
        fnv1a(self.0.as_bytes())
    }
}

impl Default for RunId {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for RunId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for RunId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fits = !text.is_empty() && text.len() <= 16;
        if fits && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-') {
            Ok(Self(text.into()))
        } else {
            Err(format!("a run id has 1 to 16 letters, digits and dashes; \"{text}\" does not"))
        }
    }
}

/// FNV-1a, 64 bit: stable, short, and not for secrets.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &b| (hash ^ u64::from(b)).wrapping_mul(0x100_0000_01b3))
}

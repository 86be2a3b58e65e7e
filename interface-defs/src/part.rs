//! How far each part of a structure was used in a run, and what became of the energy in it.

use serde::{Deserialize, Serialize};
use std::fmt;

crate::worded! {
    /// What a utilisation is a share of.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum ShareOf with word {
        /// Force over strength.
        #[default]
        Force = "force",
        /// Travel of a brake over its stroke.
        Travel = "travel",
        /// Axial force and moments over what the section bears where all of it yields, or the strain of a fibre over that at which it tears.
        Section = "section",
        /// The same of a part of which a fibre has yielded: it stays bent. That begins below 1, in an H bent about its strong axis at some 0.9.
        Yielded = "section, yielded",
    }
}

/// The largest utilisation of a part.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Utilisation {
    /// Share: 1 where it can bear no more.
    pub share: f64,
    /// Of what.
    pub of: ShareOf,
    /// When [s].
    pub time: f64,
}

/// A part of a structure in a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartUse {
    /// Its name; of all that is in no part `the rest`.
    pub part: String,
    /// Its largest utilisation; `None`: nothing of it tears, yields, or has a stroke.
    pub utilisation: Option<Utilisation>,
    /// Energy that it has dissipated in the run [J].
    pub dissipated: f64,
    /// Energy stored in it at the end, 0 as modelled [J].
    pub stored: f64,
}

impl PartUse {
    /// The largest utilisation, 0 where there is none.
    pub fn share(&self) -> f64 {
        self.utilisation.map_or(0.0, |largest| largest.share)
    }

    /// Whether it was used beyond what it bears, or stays bent.
    pub fn is_beyond(&self) -> bool {
        self.utilisation.is_some_and(|largest| largest.share > 1.0 || largest.of == ShareOf::Yielded)
    }
}

/// That it was used beyond what it can bear.
impl fmt::Display for PartUse {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Utilisation { share, of, time } = self.utilisation.unwrap_or_default();
        let what = match of {
            ShareOf::Force => "carried {} times its strength",
            ShareOf::Travel => "came to {} times its stroke",
            ShareOf::Section => "came to {} times what its plastic section bears",
            ShareOf::Yielded => "yielded: it came to {} times what its plastic section bears",
        };
        write!(f, "`{}` {} at {time:.4} s", self.part, what.replace("{}", &format!("{share:.2}")))
    }
}

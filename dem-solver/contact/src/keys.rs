//! What the checks of the tables of a scene share.

use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// Result of a check.
pub(crate) type Checked<T = ()> = Result<T, Diagnostic>;

/// The keys of one table of a scene.
pub(crate) struct Keys<'a> {
    scene: &'a Scene,
    table: String,
}

impl<'a> Keys<'a> {
    /// Of the table at a dotted key.
    pub fn of(scene: &'a Scene, table: impl Into<String>) -> Self {
        Self { scene, table: table.into() }
    }

    /// An error about the value of `key`.
    pub fn invalid(&self, key: &str, what: impl Into<String>) -> Diagnostic {
        self.scene.invalid(&format!("{}.{key}", self.table), what)
    }

    /// An error that names one of the keys, else `key`, at its place.
    pub fn placed(&self, error: Diagnostic, key: &str) -> Diagnostic {
        let own = error.key.clone().filter(|own| !own.is_empty());
        self.scene.placed(error.about(format!("{}.{}", self.table, own.as_deref().unwrap_or(key))))
    }

    /// Refuse `key` if it is `bad`: what is wrong with it, and what to try, if anything.
    pub fn refuse(&self, bad: bool, key: &str, what: impl Into<String>, cure: impl Into<String>) -> Checked {
        let cure = Some(cure.into()).filter(|cure| !cure.is_empty());
        if bad { Err(self.invalid(key, what).try_if(cure)) } else { Ok(()) }
    }

    /// Refuse the second of two keys if `both` are there.
    pub fn twice(&self, [one, other]: [&str; 2], both: bool) -> Checked {
        self.refuse(both, other, format!("{one} and {other} define one thing twice"), "keep one of them")
    }

    /// Refuse the first of these numbers, each with its unit, that is 0 or less.
    pub fn above_zero(&self, numbers: &[(&str, Option<f64>, &str)]) -> Checked {
        numbers.iter().try_for_each(|(key, value, unit)| {
            let value = value.unwrap_or(1.0);
            let what = format!("{key} = {value}{unit}: it must lie above 0");
            self.refuse(value.is_nan() || value <= 0.0, key, what, "")
        })
    }

    /// Refuse the first of these numbers, each with its unit, that is below 0.
    pub fn not_negative(&self, numbers: &[(&str, Option<f64>, &str)]) -> Checked {
        numbers.iter().try_for_each(|(key, value, unit)| {
            let value = value.unwrap_or_default();
            let what = format!("{key} = {value}{unit}: it must be 0 or more");
            let cure = format!("turn its sign round: {key} = {}", -value);
            self.refuse(value.is_nan() || value < 0.0, key, what, cure)
        })
    }

    /// Refuse the first of these keys that does nothing, and say why.
    pub fn idle(&self, keys: &[(&str, bool, &str)]) -> Checked {
        keys.iter().try_for_each(|(key, idle, why)| {
            self.refuse(*idle, key, format!("`{key}` {why} does nothing"), "leave it out")
        })
    }

    /// Refuse the first of these keys that is there beside a `file`, which has `what` as it is.
    pub fn beside_file(&self, what: &str, keys: &[(&str, bool)]) -> Checked {
        keys.iter().try_for_each(|(key, there)| {
            let own = key.rsplit_once('.').map_or(*key, |(_, own)| own);
            let cure = format!("keep one of `file` and `{own}`");
            self.refuse(*there, key, format!("{what} read from a file as it is"), cure)
        })
    }
}

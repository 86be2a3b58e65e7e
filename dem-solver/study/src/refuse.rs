//! How a study is refused: at a key, with what to write instead.

use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// Refuse the value at a key of a study, with what to write instead.
pub(super) fn refuse<T>(
    study: &Scene,
    key: &str,
    what: impl Into<String>,
    cure: impl Into<String>,
) -> Result<T, Diagnostic> {
    Err(study.invalid(key, what).try_instead(cure))
}

//! What the tests of all elements have in common, and patches of several elements.

pub(crate) mod checks;
mod patches;

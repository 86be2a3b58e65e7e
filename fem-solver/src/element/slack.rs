//! What is made of the stiffness of a part that is slack.

/// What a slack cable adds to the tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Slack {
    /// Nothing: the exact tangent, for dynamics, where the masses hold the node.
    Exact,
    /// This share of its axial stiffness in every direction, for statics. Only the tangent knows of
    /// it, so it alters the path of the iteration and not where it ends.
    Regularised(f64),
    /// Its axial stiffness as if it were just taut: an upper bound, for the critical step.
    Taut,
}

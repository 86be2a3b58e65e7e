//! Geometry that knows nothing of rocks and laws: closest points, a tree of boxes.

pub mod box_tree;
pub mod closest;

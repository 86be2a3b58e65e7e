//! Geometry that knows nothing of rocks and laws: spheres, triangles, closest points, a tree of boxes, whether elements share
//! their nodes.

pub mod box_tree;
pub mod closest;
pub mod median_tree;
pub mod shared_nodes;
pub mod sphere;
pub mod sphere_tree;
pub mod triangle;

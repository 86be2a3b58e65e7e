//! Geometry that knows nothing of rocks and laws: spheres, triangles, closest points, a tree of boxes, whether elements share
//! their nodes; lines and areas seen from above.

pub mod box_tree;
pub mod closest;
pub mod median_tree;
pub mod plan;
pub mod shared_nodes;
pub mod sphere;
pub mod sphere_tree;
pub mod triangle;

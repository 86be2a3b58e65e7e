//! Rocks: what is constant of them, and what moves.
//!
//! - [`body`]: a rigid rock; [`motion`]: where it is and how it moves
//! - [`flight`]: its motion while nothing acts on it
//! - `placed`: the spheres that stand for it, placed as its scene asks for
//! - [`faces`]: those of a rock that is a convex polyhedron
//! - [`exposed`]: how much of the surface of each sphere lies outside the others
//! - [`outermost`]: the spheres that may be the furthest in a direction, or touch a plane together
//! - [`solid`]: mass, inertia and surface of the true solid
//! - [`rotation`]: free rotation that keeps the angular momentum

pub mod body;
pub mod exposed;
pub mod faces;
pub mod flight;
pub mod motion;
pub mod outermost;
mod placed;
pub mod rotation;
pub mod solid;

pub use body::Rock;
pub use flight::Flight;
pub use motion::Motion;

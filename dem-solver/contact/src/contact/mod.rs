//! Contacts of rocks: which spheres touch what, and what all contacts of a rock with one partner amount to.
//!
//! 1. [`broad_phase`]: lists of pairs that may touch, kept while they are good
//! 2. [`narrow_phase`]: the closest points of listed pairs, and which of several are contacts
//! 3. [`history`]: what each contact takes over from the step before
//! 4. [`pipeline`]: how the rock moves past its partner at each contact, the law ([`crate::law`]), and the sums
//!
//! A partner has a file of its own: [`mesh`] (the interface mesh), [`terrain`] (and the sides of a box), [`rocks`] (another rock).
//! [`whole_rock`] is the contact of a rock with terrain that does not depend on its spheres.

pub mod broad_phase;
pub mod history;
pub mod mesh;
pub mod narrow_phase;
pub mod pipeline;
pub mod rocks;
pub mod terrain;
pub mod whole_rock;

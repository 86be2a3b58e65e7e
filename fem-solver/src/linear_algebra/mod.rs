//! What is computed with matrices and long vectors, whatever they mean.
//!
//! - [`linear_solver`]: a sparse symmetric matrix, its factor and what is solved with it: begin here
//! - [`elimination`], [`multifrontal`], [`signed`]: the order of elimination, the fronts, fronts of matrices that are not positive
//! - [`dense`]: the arithmetic of one front; [`gaps`]: memory between fronts
//! - [`lanes`]: loops over long vectors in wide registers; [`node_major`]: vectors as the interface has them

pub mod dense;
pub mod elimination;
pub mod gaps;
pub mod lanes;
pub mod linear_solver;
pub mod multifrontal;
pub mod node_major;
pub mod signed;

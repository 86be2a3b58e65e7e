//! Matrices and long vectors: sparse factors, solutions, sums in a fixed order.
//!
//! - [`symmetric`]: a sparse symmetric matrix; [`linear_solver`]: its factor and what is solved with it: begin here
//! - [`elimination`], [`multifrontal`], [`signed`]: the order of elimination, the fronts, fronts of matrices that are not positive
//! - [`dense`]: the arithmetic of one front
//! - [`lanes`]: loops over long vectors in wide registers; [`node_major`]: vectors as the interface has them

pub mod dense;
pub mod elimination;
pub mod lanes;
pub mod linear_solver;
pub mod multifrontal;
pub mod node_major;
pub mod signed;
pub mod symmetric;

//! fem-solver

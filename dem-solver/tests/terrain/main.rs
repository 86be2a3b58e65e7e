//! Behaviour over terrain: bounces, rolling, rest, trajectories, and the readers of terrain files.

mod bench;
mod bounces;
mod coordinates;
mod figure8;
mod ground;
mod heap;
mod memory;
mod meshes;
mod net;
mod readers;
mod rolling;
mod trajectory;
mod whole;
mod yielding;

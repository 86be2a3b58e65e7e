//! What pages, help and the map of the code say is so.

mod architecture;
mod blocks;
mod numbers;
mod numbers_long;
mod pages;
mod readme;
mod reference;

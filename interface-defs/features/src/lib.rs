//! Which features of third-party crates are compiled, the same for every package: `Cargo.toml` says why.

//! The shared library carries the protocol's version in its name.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,librockfall_solver.so.3");
}

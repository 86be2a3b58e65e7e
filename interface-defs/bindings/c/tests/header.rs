//! The header in the repository is the one that the sources give. With ROCKFALL_BLESS set it is written.

#[test]
fn the_header_is_current() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("the settings");
    let bindings = cbindgen::Builder::new().with_src(root.join("src/lib.rs")).with_config(config).generate();
    let mut made = Vec::new();
    bindings.expect("a header").write(&mut made);
    // The headings of safety sections are for callers in Rust.
    let made = String::from_utf8(made).expect("text").replace("//\n// # Safety\n", "");
    let path = root.join("include/rockfall_solver.h");
    if std::env::var_os("ROCKFALL_BLESS").is_some() {
        std::fs::write(&path, &made).expect("written");
    }
    let kept = std::fs::read_to_string(&path).expect("the header");
    assert!(
        kept == made,
        "include/rockfall_solver.h is not what src/lib.rs gives: run this test with ROCKFALL_BLESS=1"
    );
}

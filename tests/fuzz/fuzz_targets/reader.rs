//! One reader of `tests::readers` under libFuzzer: the one that `ROCKFALL_READER` names.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;
use tests::readers::{TARGETS, Target};

static READER: LazyLock<&'static Target> = LazyLock::new(|| {
    let name = std::env::var("ROCKFALL_READER").expect("ROCKFALL_READER names a reader");
    TARGETS.iter().find(|target| target.name == name).expect("a reader of that name")
});

fuzz_target!(|bytes: &[u8]| {
    let dir = tempfile::tempdir().expect("a directory");
    (READER.read)(dir.path(), bytes);
});

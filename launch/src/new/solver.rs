//! Templates of solvers, as they lie in `interface-defs/bindings/templates`.

/// Languages for which there is one.
pub const LANGUAGES: [&str; 5] = ["c", "cpp", "fortran", "python", "rust"];

macro_rules! template {
    ($language:literal: $($name:literal)*) => {
        vec![$(($name, include_str!(concat!("../../../interface-defs/bindings/templates/", $language, "/", $name)).to_owned())),*]
    };
}

/// Files of the template of a language.
pub fn files(language: &str) -> Vec<(&'static str, String)> {
    match language {
        "c" => template!("c": "README.md" "Makefile" "net.c" "scene.toml" "sphere.c" "contact.toml"),
        "cpp" => template!("cpp": "README.md" "Makefile" "net.cpp" "scene.toml"),
        "fortran" => template!("fortran": "README.md" "Makefile" "net.f90" "scene.toml"),
        "python" => {
            template!("python": "README.md" "Makefile" "net.py" "scene.toml" "sphere.py" "contact.toml" "drop-test.ipynb")
        }
        _ => template!("rust": "README.md" "Makefile" "Cargo.toml" "net.rs" "scene.toml"),
    }
}

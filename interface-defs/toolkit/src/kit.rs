//! `structure.kit`: a whole barrier from a file of its own. The scene says the rest: rock, contact, terrain, where it stands.
//!
//! A kit file has the tables `[structure]`, `[[gauge]]` and `[kit]`, as a scene has them. It is put in place where a scene is
//! read, so that every program reads the same. What the scene itself names goes before the kit.

use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// The key of the scene.
pub const KEY: &str = "structure.kit";

/// What it means, for the reference.
pub const MEANING: &str = "A barrier from a kit file, from the directory of the scene: its `[structure]` and its gauges, of which \
    whatever the scene names itself goes before the kit; parts by `name`, gauges by `name` and `quantity`. Where the scene has \
    `generator.line` or `generator.position`, `spacing` and `anchor_rise` of the kit do not count. The table `[kit]` says `name`, \
    `class` (0 to 8, EAD 340059-00-0106) and `energy`, in J, of its largest test, for `rockfall approve`.";

/// The tables of a kit file.
pub const TABLES: [&str; 3] = ["kit", "structure", "gauge"];

/// What the kit has for a site in axes of its own, and a barrier on a line has not.
const OF_OWN_AXES: [&str; 2] = ["spacing", "anchor_rise"];

/// What a kit says of itself.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// Name. Default: that of its file.
    pub name: Option<String>,
    /// Class, 0 to 8.
    pub class: Option<u8>,
    /// Energy of its largest test (MEL) [J].
    pub energy: Option<f64>,
}

/// A kit file as a scene reads it.
#[derive(Debug, Clone)]
pub(crate) struct Kit {
    pub(crate) path: PathBuf,
    /// Its text behind so many blanks that positions in it are those of all text of the scene.
    padded: String,
    /// Where its text begins.
    pub(crate) base: usize,
}

impl Kit {
    /// The file at `path` with this text, which is TOML; its positions begin at `base`, which is above 0.
    pub(crate) fn new(path: &Path, text: &str, base: usize) -> Self {
        Self { path: path.to_owned(), padded: " ".repeat(base - 1) + "\n" + text, base }
    }

    /// Text of its file.
    pub(crate) fn text(&self) -> &str {
        &self.padded[self.base..]
    }

    /// Put what it has and `scene` has not into `scene`.
    pub(crate) fn fill<'a>(&'a self, scene: &mut DeTable<'a>) {
        let mut kit = DeTable::parse(&self.padded).expect("it was parsed when it was read").into_inner();
        kit.remove("kit");
        let home = self.path.parent().unwrap_or(Path::new(""));
        kit.iter_mut().for_each(|(_, value)| with_absolute_files(value, home));
        fill(scene, kit);
    }

    /// Take out what only a barrier in axes of its own has where `scene` says where it stands, and the key of the kit.
    pub(crate) fn settle(&self, scene: &mut DeTable) {
        let Some(structure) = scene.get_mut("structure").and_then(|value| table(value.get_mut())) else {
            return;
        };
        structure.remove("kit");
        let Some(generator) = structure.get_mut("generator").and_then(|value| table(value.get_mut())) else {
            return;
        };
        if ["line", "position"].iter().any(|key| generator.contains_key(*key)) {
            let own = self.base..self.padded.len();
            for key in OF_OWN_AXES {
                if generator.get(key).is_some_and(|value| own.contains(&value.span().start)) {
                    generator.remove(key);
                }
            }
        }
    }
}

fn table<'a, 'b>(value: &'a mut DeValue<'b>) -> Option<&'a mut DeTable<'b>> {
    if let DeValue::Table(table) = value { Some(table) } else { None }
}

/// `own` with what `kit` has and it has not.
fn fill<'a>(own: &mut DeTable<'a>, kit: DeTable<'a>) {
    for (key, value) in kit {
        match own.get_mut(key.get_ref().as_ref()) {
            None => drop(own.insert(key, value)),
            Some(there) => fill_value(there.get_mut(), value.into_inner()),
        }
    }
}

fn fill_value<'a>(own: &mut DeValue<'a>, kit: DeValue<'a>) {
    match (own, kit) {
        // What is another thing of the same name has keys of its own.
        (DeValue::Table(own), DeValue::Table(kit)) if !differ(own, &kit) => fill(own, kit),
        (DeValue::Array(own), DeValue::Array(kit)) if kit.iter().all(|item| identity(item).is_some()) => {
            let mut others: Vec<Spanned<DeValue>> =
                std::mem::replace(own, DeArray::new()).into_iter().collect();
            // Numbers of the kit's parts stay what they are in its file.
            for item in kit {
                let same = others.iter().position(|other| identity(other) == identity(&item));
                own.push(match same.map(|at| others.remove(at)) {
                    Some(mut named) => {
                        fill_value(named.get_mut(), item.into_inner());
                        named
                    }
                    None => item,
                });
            }
            others.into_iter().for_each(|other| own.push(other));
        }
        _ => {}
    }
}

/// Whether two tables say that they are different things.
fn differ(a: &DeTable, b: &DeTable) -> bool {
    let said = |table: &DeTable, key: &str| {
        table.get(key).and_then(|value| value.get_ref().as_str().map(str::to_owned))
    };
    ["type", "element"].iter().any(|key| said(a, key).zip(said(b, key)).is_some_and(|(a, b)| a != b))
}

/// By what an item of a list is known.
fn identity(item: &Spanned<DeValue>) -> Option<[Option<String>; 2]> {
    let DeValue::Table(table) = item.get_ref() else { return None };
    let said = |key: &str| table.get(key).and_then(|value| value.get_ref().as_str().map(str::to_owned));
    Some([Some(said("name")?), said("quantity")])
}

/// Paths in a kit are relative to it: those of files that are there become absolute.
fn with_absolute_files(value: &mut Spanned<DeValue>, home: &Path) {
    match value.get_mut() {
        DeValue::String(text) if text.contains(['.', '/']) => {
            let path = home.join(text.as_ref());
            let absolute = path.is_file().then(|| std::path::absolute(path).ok()).flatten();
            if let Some(path) = absolute.as_deref().and_then(Path::to_str) {
                *text = path.to_owned().into();
            }
        }
        DeValue::Array(items) => items.iter_mut().for_each(|item| with_absolute_files(item, home)),
        DeValue::Table(table) => table.iter_mut().for_each(|(_, value)| with_absolute_files(value, home)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use interface_defs::diagnostic::Diagnostic;

    const OF_KIT: &str = "[kit]\nname = \"K\"\nenergy = 1e5\n[structure]\ndamping = 1.0\n[structure.generator]\ntype = \"barrier\"\n\
        spacing = 8.0\nheight = 3.0\n[structure.cable]\nyoung = 1e11\n[[structure.parts]]\nname = \"net\"\nelement = \"ring\"\n\
        mass = 0.5\n[[structure.parts]]\nname = \"posts\"\nelement = \"beam\"\nradius = 0.08\n[[gauge]]\nname = \"net\"\n\
        group = \"net\"\nquantity = \"tension\"\n";

    fn scene(kit: &str, text: &str, sets: &[&str]) -> (tempfile::TempDir, Result<Scene, Diagnostic>) {
        let temp = tempfile::tempdir().expect("a directory");
        std::fs::create_dir(temp.path().join("kits")).expect("created");
        std::fs::write(temp.path().join("kits/k.toml"), kit).expect("written");
        std::fs::write(temp.path().join("s.toml"), text).expect("written");
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let read = Scene::load(&temp.path().join("s.toml"), &sets);
        (temp, read)
    }

    const NAMED: &str = "end_time = 1.0\n[structure]\nkit = \"kits/k.toml\"\n";

    #[test]
    fn what_the_scene_names_goes_before_the_kit() {
        let text = NAMED.to_owned()
            + "damping = 2.0\n[structure.generator]\nlean = 1.0\n[[structure.parts]]\nname = \"more\"\n[[structure.parts]]\n\
               name = \"posts\"\nradius = 0.1\n[[gauge]]\nname = \"net\"\ngroup = \"net\"\nquantity = \"elongation\"\n";
        let sets = ["structure.parts.0.mass=0.7", "structure.generator.height=3.5"];
        let (_temp, read) = scene(OF_KIT, &text, &sets);
        let document = read.expect("valid").document().expect("a table");
        let due = "end_time = 1.0\n[structure]\ndamping = 2.0\ngenerator = { type = \"barrier\", spacing = 8.0, height = 3.5, lean = 1.0 }\n\
            cable = { young = 1e11 }\n[[structure.parts]]\nname = \"net\"\nelement = \"ring\"\nmass = 0.7\n[[structure.parts]]\n\
            name = \"posts\"\nelement = \"beam\"\nradius = 0.1\n[[structure.parts]]\nname = \"more\"\n[[gauge]]\nname = \"net\"\n\
            group = \"net\"\nquantity = \"tension\"\n[[gauge]]\nname = \"net\"\ngroup = \"net\"\nquantity = \"elongation\"\n";
        assert_eq!(document, due.parse::<toml::Table>().expect("TOML"));
    }

    #[test]
    fn another_element_takes_the_place_of_that_of_the_kit_and_a_line_that_of_its_spacing() {
        let text =
            NAMED.to_owned() + "[[structure.parts]]\nname = \"net\"\nelement = \"cable\"\narea = 1e-4\n";
        for sets in [&["structure.generator.line=[[0.0, 0.0], [30.0, 0.0]]"][..], &[]] {
            let (_temp, read) = scene(OF_KIT, &text, sets);
            let document = read.expect("valid").document().expect("a table");
            assert_eq!(document["structure"]["parts"][0].as_table().expect("a part").len(), 3);
            assert_eq!(document["structure"]["generator"].get("spacing").is_some(), sets.is_empty());
        }
        // A set of the user is not taken back.
        let (_temp, read) = scene(
            OF_KIT,
            &text,
            &["structure.generator.position=[0.0, 0.0]", "structure.generator.spacing=9.0"],
        );
        let document = read.expect("valid").document().expect("a table");
        assert_eq!(document["structure"]["generator"]["spacing"].as_float(), Some(9.0));
    }

    #[test]
    fn what_is_wrong_is_said_with_file_and_line_of_the_kit() {
        let said = |kit: &str, text: &str, sets: &[&str]| {
            let (temp, read) = scene(kit, text, sets);
            let text = read.expect_err("refused").to_string();
            text.replace(&format!("{}/", temp.path().display()), "")
        };
        let broken = said("[structure]\ndamping = \n", NAMED, &[]);
        assert!(broken.starts_with("kits/k.toml:2:"), "{broken}");
        let unknown = said(&format!("{OF_KIT}[[rock]]\nmass = 1.0\n"), NAMED, &[]);
        assert!(
            unknown.starts_with("kits/k.toml:24:3: unknown key `rock` at the top of the kit"),
            "{unknown}"
        );
        let empty = said("[kit]\nclass = 3\n", NAMED, &[]);
        assert!(empty.contains("the kit has no table [structure]"), "{empty}");
        let class = said(&OF_KIT.replace("energy = 1e5", "class = 9"), NAMED, &[]);
        assert!(class.starts_with("kits/k.toml:3:9: there is no class 9"), "{class}");
        let nested = said("[structure]\nkit = \"k.toml\"\n", NAMED, &[]);
        assert!(nested.starts_with("kits/k.toml:2:7: a kit cannot be made of another kit"), "{nested}");
        let missing = said(OF_KIT, &NAMED.replace("k.toml", "j.toml"), &[]);
        assert!(missing.starts_with("s.toml:3:7: the kit kits/j.toml: there is no such file"), "{missing}");
        assert!(missing.contains("did you mean k.toml"), "{missing}");
        let set = said(OF_KIT, NAMED, &["structure.kit=none.toml"]);
        assert!(
            set.contains("--set structure.kit=none.toml") && set.contains("there is no such file"),
            "{set}"
        );
        let number = said(OF_KIT, "[structure]\nkit = 3\n", &[]);
        assert!(number.starts_with("s.toml:2:7: the kit is a text"), "{number}");
        // A value that a program refuses.
        let (_temp, read) = scene(OF_KIT, NAMED, &[]);
        let scene = read.expect("valid");
        let refused = scene.invalid("structure.parts.1.radius", "too thick").to_string();
        assert!(refused.contains("kits/k.toml:19:10: too thick"), "{refused}");
    }

    #[test]
    fn another_kit_is_another_scene_and_files_of_a_kit_lie_beside_it() {
        let (temp, read) = scene("[structure]\nmesh = \"net.msh\"\n", NAMED, &[]);
        let before = read.expect("valid").fingerprint();
        std::fs::write(temp.path().join("kits/net.msh"), "x").expect("written");
        let again = Scene::load(&temp.path().join("s.toml"), &[]).expect("valid");
        assert_eq!(again.fingerprint(), before);
        let mesh = again.document().expect("a table")["structure"]["mesh"].as_str().map(str::to_owned);
        assert_eq!(mesh.as_deref(), temp.path().join("kits/net.msh").to_str());
        std::fs::write(temp.path().join("kits/k.toml"), "[structure]\nmesh = \"other.msh\"\n")
            .expect("written");
        assert_ne!(Scene::load(&temp.path().join("s.toml"), &[]).expect("valid").fingerprint(), before);
    }
}

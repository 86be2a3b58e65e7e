//! Which law a pair of materials has.
//!
//! Names are looked up once: a rock has a row of law numbers, one for each material of the mesh, and
//! whoever lists elements keeps the number. A contact then costs one index.

use crate::law::{Law, PartnerKind};
use crate::settings::{ContactSettings, EffectiveMass};

/// The laws of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Laws {
    /// The tables.
    pub settings: Vec<ContactSettings>,
    /// Of a rock with a mesh, one for each table of the scene.
    pub surfaces: Vec<Law>,
    /// Between two rocks, likewise.
    pub rocks: Vec<Law>,
}

impl Laws {
    /// From the scene's tables, which have been checked; `None` if there are none.
    pub fn new(settings: &[ContactSettings]) -> Option<Self> {
        let laws = |partner| settings.iter().map(|s| Law::new(s, partner)).collect();
        (!settings.is_empty()).then(|| Self {
            settings: settings.to_vec(),
            surfaces: laws(PartnerKind::Surface),
            rocks: laws(PartnerKind::Rock),
        })
    }

    /// Number of the law between two materials, by name: the table that names them, else the one that
    /// names none.
    pub fn number(&self, a: &str, b: &str) -> Option<usize> {
        let named = self.settings.iter().position(|s| s.names(a, b));
        named.or_else(|| self.settings.iter().position(|s| s.between.is_none()))
    }

    /// Numbers of the laws of material `rock` with each of `surfaces`. Errs with the first of those that
    /// has none.
    pub fn row<'a>(&self, rock: &str, surfaces: &'a [String]) -> Result<Vec<u16>, &'a str> {
        surfaces.iter().map(|w| self.number(rock, w).map(|n| n as u16).ok_or(w.as_str())).collect()
    }

    /// The laws with surfaces that may apply to something of material `material`.
    pub fn of<'a>(&'a self, material: &'a str) -> impl Iterator<Item = &'a Law> {
        let may = move |s: &ContactSettings| match &s.between {
            Some(names) => names.iter().any(|n| n == material),
            None => true,
        };
        self.settings.iter().zip(&self.surfaces).filter(move |(s, _)| may(s)).map(|(_, law)| law)
    }

    /// True if any dashpot is scaled with the local mass.
    pub fn use_local_masses(&self) -> bool {
        self.surfaces.iter().any(|law| law.damping.is_some_and(|d| d.mass == EffectiveMass::Local))
    }

    /// The same with the rock's whole mass in every dashpot: for a mesh whose masses are not known.
    pub fn without_local_masses(mut self) -> Self {
        for damping in self.surfaces.iter_mut().filter_map(|law| law.damping.as_mut()) {
            damping.mass = EffectiveMass::Rock;
        }
        self
    }

    /// In words, a line for each table.
    pub fn describe(&self) -> Vec<String> {
        let line = |(s, law): (&ContactSettings, &Law)| match &s.between {
            Some([a, b]) => format!("{a} and {b}: {}", law.describe()),
            None => law.describe(),
        };
        self.settings.iter().zip(&self.surfaces).map(line).collect()
    }
}

/// The laws of one rock with a mesh, element by element.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceLaws<'a> {
    /// All laws with surfaces.
    pub laws: &'a [Law],
    /// Law number of each material of the mesh, from [`Laws::row`].
    pub row: &'a [u16],
    /// Material of each element of the mesh, by its number; empty: all are of the first.
    pub materials: &'a [u8],
}

impl<'a> SurfaceLaws<'a> {
    /// The law of element number `element`.
    #[inline]
    pub fn of(&self, element: u32) -> &'a Law {
        &self.laws[self.number(element) as usize]
    }

    /// The number of that law.
    #[inline]
    pub fn number(&self, element: u32) -> u16 {
        let material = if self.materials.is_empty() { 0 } else { self.materials[element as usize] };
        self.row[material as usize]
    }

    /// The numbers of all laws, each once.
    pub fn distinct(self) -> impl Iterator<Item = u16> + 'a {
        let row = self.row;
        row.iter().enumerate().filter(move |(at, law)| !row[..*at].contains(law)).map(|(_, law)| *law)
    }

    /// True if `ask` is true of any of them.
    pub fn any(&self, ask: impl Fn(&Law) -> bool) -> bool {
        self.row.iter().any(|n| ask(&self.laws[*n as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::normal::Normal;

    fn tables(text: &str) -> Vec<ContactSettings> {
        let scene = toolkit::scene::Scene::from_text("test.toml", text).expect("a scene");
        ContactSettings::read(&scene).expect("tables")
    }

    #[test]
    fn a_named_pair_has_its_own_law_in_either_order_and_all_others_the_one_without_names() {
        let part = |between: &str, young: &str| {
            format!(
                "[[contact]]\n{between}\nlaw = \"hertz_mindlin\"\nyoung = {young}\npoisson = 0.0\nrestitution = 1.0\n"
            )
        };
        let text = part("between = [\"granite\", \"net\"]", "1e9") + &part("", "2e9");
        let laws = Laws::new(&tables(&text)).expect("two tables");
        assert_eq!(laws.number("net", "granite"), Some(0));
        assert_eq!(laws.number("granite", "granite"), Some(1));
        let surfaces = ["soil", "net"].map(String::from);
        let row = laws.row("granite", &surfaces).expect("all have a law");
        let materials = [1, 0, 1];
        let of_rock = SurfaceLaws { laws: &laws.surfaces, row: &row, materials: &materials };
        let modulus = |normal| match normal {
            Normal::HertzMindlin(law) => law.modulus,
            other => panic!("{other:?}"),
        };
        let moduli = [0, 1, 2].map(|e| modulus(of_rock.of(e).normal));
        assert_eq!(moduli, [1e9, 2e9, 1e9]);
        // Two rocks are both elastic.
        assert_eq!(modulus(laws.rocks[1].normal), 1e9);
        assert_eq!(laws.of("net").count(), 2);
        assert_eq!(laws.of("soil").count(), 1);
        let only = Laws::new(&tables(&part("between = [\"granite\", \"net\"]", "1e9"))).expect("one");
        assert_eq!(only.row("granite", &surfaces), Err("soil"));
    }
}

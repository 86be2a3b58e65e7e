//! What can be known of a structure before it is computed: numbers in other units than SI, sections that do not fit their
//! elements, strengths below what acts from the start. Error: certainly wrong. Warning: possible, but unusual.

pub mod loading;

use crate::config::Config;
use crate::config::generator::Generator;
use crate::config::scheme::Scheme;
use crate::config::structure::CableEntry;
use crate::element::beam::Beam;
use crate::element::cable::{CableConfig, Stated};
use crate::element::part::{Key, Surroundings};
use crate::element::{AnyElement, PartConfig};
use crate::model::{Model, Part};
use interface_defs::diagnostic::{Code, Diagnostic, code};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::f64::consts::PI;
use toolkit::ranges::Gate;
use toolkit::scene::{self, Scene};

/// Longest structure that a mesh or generator may make [m], and that from which on it is asked whether metres are meant.
const LONGEST: [f64; 2] = [2000.0, 500.0];
/// Shortest one [m].
const SHORTEST: f64 = 0.01;
/// Nodes closer than this, relative to the extent, are at one place.
const SAME_PLACE: f64 = 1e-9;

/// Strain by a prestress that changes nothing.
const SLACK: f64 = 1e-6;
/// Strain from which on a prestress below 0 is more likely to be a tension with the wrong sign.
const LOOSE: f64 = 5e-3;
/// Least density of metals [kg/m3], and a modulus that is below all of theirs [Pa].
const METAL: f64 = 2000.0;
const SOFTEST_METAL: f64 = 1e9;
const ALL_ABOVE: f64 = f64::INFINITY;

const YOUNG: Gate = Gate {
    key: "young",
    unit: "Pa",
    possible: [1e3, ALL_ABOVE],
    usual: [3e5, 2e12],
    says: ["is softer than rubber, which has 1e6", "is stiffer than diamond (1.2e12)"],
    units: &[("GPa", 1e9), ("MPa", 1e6)],
    hint: "210 GPa of steel is 2.1e11, a wire rope has 1e11",
};
/// Of parts with the density of a metal, above what is said of all.
const YOUNG_OF_METAL: Gate = Gate {
    usual: [SOFTEST_METAL, ALL_ABOVE],
    says: ["is softer than plastic, and the density is that of a metal", ""],
    units: &[("kPa", 1e3)],
    ..YOUNG
};
const DENSITY: Gate = Gate {
    key: "density",
    unit: "kg/m3",
    possible: [0.01, 1e6],
    usual: [30.0, 3e4],
    says: ["is that of a foam, or lighter than air", "is heavier than any metal (osmium has 22600)"],
    units: &[("g/cm3", 1e3), ("t/mm3", 1e12)],
    hint: "steel has 7850 (7.85 g/cm3, 7.85e-9 t/mm3)",
};
const PRESTRESS: Gate = Gate {
    key: "prestress",
    unit: "Pa",
    usual: [-ALL_ABOVE, 1e10],
    says: ["", "is more than any wire bears (2e9 Pa)"],
    hint: "it is a stress: 100 MPa is 1e8, a force is divided by the area",
    ..Gate::ANY
};

/// A structure that is judged, and what is said of it.
struct Judge<'a> {
    scene: &'a Scene,
    config: &'a Config,
    model: &'a Model,
    warnings: &'a mut Vec<Diagnostic>,
}

impl Judge<'_> {
    /// Say something about `key`; an empty `hint` is none.
    fn warn(&mut self, code: Code, key: impl Into<String>, what: impl Into<String>, hint: &str) {
        self.warnings.push(warning(code, key, what, hint));
    }
}

/// Judge `model`. What is possible, but unusual goes into its warnings.
pub fn judge(scene: &Scene, config: &Config, model: &mut Model) -> Result<(), Diagnostic> {
    let mut warnings = Vec::new();
    let mut at = Judge { scene, config, model, warnings: &mut warnings };
    judge_extent(&mut at)?;
    for section in sections(config, model) {
        section.material(&mut at)?;
        section.shape(&mut at)?;
        section.strength(&mut at)?;
    }
    judge_parts(&mut at)?;
    loading::judge_supports(&mut at)?;
    // What is generated is connected where it should be; a post's nodes lie beside those of the net's edge.
    if config.structure.generator.is_none() {
        at.warnings.extend(twins(model).into_iter().chain(doubled(config)));
    }
    model.warnings.extend(warnings);
    Ok(())
}

/// Material and section as a table states them, SI units; `None` where it does not.
#[derive(Debug, Default)]
struct StatedSection {
    /// Key of the table.
    key: String,
    young: Option<f64>,
    density: Option<f64>,
    area: Option<f64>,
    inertia: Option<[f64; 2]>,
    radius: Option<f64>,
    prestress: Option<f64>,
    /// Modulus that the prestress strains [Pa]: its own, else that of all cables.
    strained: Option<f64>,
    rupture_force: Option<f64>,
    rupture_strain: Option<f64>,
    /// Its longest line [m].
    longest: f64,
}

impl StatedSection {
    /// That of any table: these keys mean the same in all of them.
    fn of(table: &impl Serialize) -> Self {
        let table = serde_json::to_value(table).expect("a table of a scene is a value");
        let number = |key: &str| table[key].as_f64();
        let young = number("young");
        Self {
            // Of two families of fibres the first.
            young: young.or_else(|| table["young"][0].as_f64()),
            density: number("density"),
            area: number("area"),
            inertia: <[f64; 2]>::deserialize(&table["inertia"]).ok(),
            radius: number("radius"),
            prestress: number("prestress"),
            strained: young,
            rupture_force: number("rupture_force"),
            rupture_strain: number("rupture_strain"),
            ..Self::default()
        }
    }

    /// That of a part: what cables do not state `common` states for all; their own modulus and density alone are judged here.
    fn of_part(part: &PartConfig, common: Option<&CableConfig>) -> Self {
        let own = Self::of(part);
        match (part, common.map(Self::of)) {
            (PartConfig::CablePart(_), Some(common)) => Self {
                area: own.area.or(common.area),
                radius: own.radius.or(common.radius),
                prestress: own.prestress.or(common.prestress),
                strained: own.young.or(common.young),
                ..own
            },
            _ => own,
        }
    }
}

/// The sections of a scene: that of all cables, then one for each part.
fn sections(config: &Config, model: &Model) -> Vec<StatedSection> {
    let table = &config.structure;
    let span = |line: &[usize; 2]| (model.nodes[line[1]] - model.nodes[line[0]]).norm();
    // What every cable states for itself nothing uses of the common table.
    let parted: usize = model.parts[..model.part_count].iter().map(|p| p.cables.len()).sum();
    let others = model.cables.len() > parted + table.cables.len();
    let cables = table.cables.iter().map(CableEntry::stated).chain(table.parts.iter().filter_map(|part| {
        if let PartConfig::CablePart(cables) = part { Some(cables.stated()) } else { None }
    }));
    let used = |states: fn(&Stated) -> bool| others || cables.clone().any(|own| !states(&own));
    let all = model.lines().map(|(line, _)| span(&line)).fold(0.0, f64::max);
    let mut sections = Vec::new();
    if let Some(common) = &table.cable {
        let own = StatedSection::of(common);
        sections.push(StatedSection {
            key: "structure.cable".into(),
            young: own.young.filter(|_| used(|own| own.young.is_some())),
            density: own.density.filter(|_| used(|own| own.density.is_some())),
            area: own.area.filter(|_| used(|own| own.area.is_some())),
            longest: all,
            ..own
        });
    }
    for (i, (config, part)) in table.parts.iter().zip(&model.parts).enumerate() {
        let cables = part.cables.iter().map(|c| span(&model.cables[*c].nodes));
        let others = part.elements.iter().flat_map(|e| model.elements[*e].lines()).map(|l| span(&l));
        let longest = cables.chain(others).fold(0.0, f64::max);
        let key = format!("structure.parts.{i}");
        sections.push(StatedSection { key, longest, ..StatedSection::of_part(config, table.cable.as_ref()) });
    }
    sections
}

impl StatedSection {
    fn error(&self, at: &Judge, name: &str, what: String, hint: &str) -> Diagnostic {
        at.scene.invalid(&format!("{}.{name}", self.key), what).try_instead(hint)
    }

    fn warn(&self, at: &mut Judge, code: Code, name: &str, what: String, hint: &str) {
        at.warn(code, format!("{}.{name}", self.key), what, hint);
    }

    fn pass(&self, at: &mut Judge, gate: &Gate, value: Option<f64>) -> Result<(), Diagnostic> {
        value.map_or(Ok(()), |value| gate.pass(at.scene, &self.key, value, at.warnings))
    }

    /// Modulus and density.
    fn material(&self, at: &mut Judge) -> Result<(), Diagnostic> {
        let (young, density) = (self.young, self.density);
        let statics = Scheme::of(&at.config.fem).is_some_and(|scheme| !scheme.inertia);
        self.pass(at, &YOUNG, young)?;
        // What its prestress alone makes longer than its double is no material, but a stiffness by prestress.
        let stretched = self.prestress.zip(young).is_some_and(|(stress, young)| stress >= young);
        if density.is_some_and(|d| d >= METAL) && !stretched {
            self.pass(at, &YOUNG_OF_METAL, young.filter(|young| *young >= YOUNG.usual[0]))?;
        }
        // What has no mass is meant. In statics mass is weight alone, and textbooks take next to none.
        let light = Gate { possible: [0.0, DENSITY.possible[1]], ..DENSITY };
        self.pass(at, if statics { &light } else { &DENSITY }, density.filter(|density| *density > 0.0))
    }

    /// Area, moments of inertia and radius, against each other and the length of the elements.
    fn shape(&self, at: &mut Judge) -> Result<(), Diagnostic> {
        let longest = self.longest;
        if longest == 0.0 {
            return Ok(());
        }
        let radius = self.radius.unwrap_or(0.0);
        let key = format!("{}.radius", self.key);
        if radius == 0.0 && scene::at(&at.scene.document()?, &key).is_some() {
            let what = "0 m: rocks touch it as a line without thickness".into();
            let hint = "half of its diameter in metres, 0.004 of 8 mm; left out it is 0, too";
            self.warn(at, code::UNUSUAL_VALUE, "radius", what, hint);
        }
        if radius > longest {
            let what = format!("radius is {radius} m, and the longest element of it has {longest:.4} m");
            return Err(self.error(at, "radius", what, "metres: 8 mm is 0.008"));
        }
        if radius > 0.2 * longest {
            let what = format!("{radius} m beside elements of {longest:.4} m at most");
            self.warn(at, code::LIKELY_UNIT, "radius", what, "8 mm is 0.008");
        }
        let Some(area) = self.area else { return Ok(()) };
        let (width, beam) = (2.0 * (area / PI).sqrt(), self.inertia.is_some());
        let what = format!(
            "area is {area} m2, a rod {width:.3} m thick, and the longest element of it has {longest:.4} m"
        );
        if width > if beam { 5.0 * longest } else { longest } {
            return Err(self.error(at, "area", what, "square metres: 240 mm2 is 2.4e-4"));
        }
        if width > if beam { longest } else { 0.1 * longest.max(1.0) } {
            self.warn(at, code::LIKELY_UNIT, "area", what, "240 mm2 is 2.4e-4");
        }
        if radius > 0.0 && !beam && (1.9..=2.1).contains(&(radius / (0.5 * width))) {
            let what = format!("{radius} m is twice the radius of a rod of the section, {area} m2");
            let hint = format!("is it the diameter? Then write {:?}", 0.5 * radius);
            self.warn(at, code::UNUSUAL_VALUE, "radius", what, &hint);
        }
        if radius > 0.0 && !beam && (area > 1.2 * PI * radius * radius || PI * radius * radius > 50.0 * area)
        {
            let rod = 0.5 * width;
            let what =
                format!("a contact sees {radius} m, and the section of {area} m2 alone has {rod:.2e} m");
            self.warn(at, code::UNUSUAL_VALUE, "radius", what, "");
        }
        for inertia in self.inertia.unwrap_or_default() {
            let gyration = (inertia / area).sqrt();
            let what = format!(
                "inertia is {inertia} m4 with an area of {area} m2: a radius of gyration of {gyration:.2e} m, of a beam \
                 of {longest:.4} m"
            );
            let hint = "metres to the fourth: 2490 cm4 (HE 160 B) is 2.49e-5";
            if gyration > longest {
                return Err(self.error(at, "inertia", what, hint));
            }
            if beam && (gyration > 0.2 * longest || gyration < 0.01 * width) {
                self.warn(at, code::LIKELY_UNIT, "inertia", what, hint);
            }
        }
        Ok(())
    }

    /// Prestress, against the modulus.
    fn tension(&self, at: &mut Judge) -> Result<(), Diagnostic> {
        let (Some(stress), Some(young)) = (self.prestress, self.strained) else {
            return Ok(());
        };
        let strain = stress / young;
        if stress != 0.0 && strain.abs() < SLACK {
            let what = format!(
                "{stress} Pa strains it by {strain:.1e} only (young is {young:e} Pa), which changes nothing"
            );
            let hint = format!("were it in MPa, it would be {:e} Pa", 1e6 * stress);
            self.warn(at, code::LIKELY_UNIT, "prestress", what, &hint);
        }
        if strain <= -LOOSE {
            let longer = -100.0 * strain;
            let what = format!("{stress:e} Pa makes it {longer:.1} % longer than the distance of its nodes");
            self.warn(at, code::UNUSUAL_VALUE, "prestress", what, "below 0 is slack, a tension is above 0");
        }
        self.pass(at, &PRESTRESS, Some(stress))
    }

    /// Strength, against prestress and what a section of its size carries.
    fn strength(&self, at: &mut Judge) -> Result<(), Diagnostic> {
        if let Some(strain) = self.rupture_strain.filter(|s| *s > 1.0) {
            let hint = format!("{strain} % is {}", 0.01 * strain);
            let what = format!("{strain} is a strain, no percentage");
            self.warn(at, code::LIKELY_UNIT, "rupture_strain", what, &hint);
        }
        self.tension(at)?;
        let (Some(force), Some(area)) = (self.rupture_force, self.area) else {
            return Ok(());
        };
        let prestress = self.prestress.unwrap_or(0.0);
        if prestress * area > force {
            let what = format!(
                "rupture_force is {force} N, and the prestress alone is {:.4e} N ({prestress:e} Pa on {area} m2)",
                prestress * area
            );
            return Err(self.error(at, "rupture_force", what, "newtons: 300 kN is 3e5; or less prestress"));
        }
        let strength = force / area;
        if !(5e6..=1e10).contains(&strength) {
            let than = if strength < 5e6 { "weaker than wood" } else { "stronger than any wire" };
            let what = format!("{force} N on {area} m2 is a strength of {strength:.1e} Pa, {than}");
            self.warn(at, code::LIKELY_UNIT, "rupture_force", what, "300 kN is 3e5");
        }
        Ok(())
    }
}

fn judge_extent(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, .. } = *at;
    let table = &config.structure;
    if model.nodes.is_empty() {
        let what = "no element of the mesh becomes anything: the structure is empty";
        return Err(scene.invalid("structure.mesh", what).coded(code::GEOMETRY).try_instead(
            "save the lines of the mesh too (in Gmsh: physical groups for curves), and write parts or [structure.cable]",
        ));
    }
    let extent = model.extent();
    let what = format!("the structure has an extent of {extent:.4} m");
    let (key, cure) = if table.mesh.is_some() {
        ("structure.mesh", "coordinates count in metres: save the mesh in metres, or scale it by 0.001")
    } else {
        ("structure.generator", "lengths count in metres: 150 mm is 0.15")
    };
    let (made, flat) =
        (table.mesh.is_some() || table.generator.is_some(), model.nodes.len() > 1 && extent < SHORTEST);
    if extent > LONGEST[0] && made {
        return scene.refuse(key, format!("{what}, more than {} m", LONGEST[0]), cure);
    }
    if flat && made {
        let cure = cure.replace("scale it by 0.001", "scale it by 1000 if it is in kilometres");
        return scene.refuse(key, format!("{what}, less than {SHORTEST} m"), cure);
    }
    let key = if table.nodes.is_empty() { key } else { "structure.nodes" };
    if extent > LONGEST[1] {
        let hint = format!("are these centimetres or millimetres? {cure}");
        at.warn(code::LIKELY_UNIT, key, what, &hint);
    } else if flat {
        at.warn(code::LIKELY_UNIT, key, what, "its coordinates count in metres");
    }
    Ok(())
}

/// Nodes at one place: a mesh whose parts were not joined falls apart there.
fn twins(model: &Model) -> Option<Diagnostic> {
    let step = (SAME_PLACE * model.extent()).max(f64::MIN_POSITIVE);
    let mut seen: HashMap<[i64; 3], usize> = HashMap::with_capacity(model.node_count());
    let mut pairs = Vec::new();
    for (node, p) in model.nodes.iter().enumerate() {
        let place = [p.x, p.y, p.z].map(|c| (c / step).round() as i64);
        let first = *seen.entry(place).or_insert(node);
        pairs.extend((first != node).then_some((first, node)));
    }
    let (a, b) = *pairs.first()?;
    let (count, [a, b]) = (pairs.len(), [a, b].map(|node| model.node_name(node)));
    let what = format!(
        "{count} nodes lie where another one does, first node {a} and node {b}: elements that end there are not connected"
    );
    Some(warning(code::GEOMETRY, "structure", what, "join them (in Gmsh: Coherence)"))
}

/// A cable that joins the same two nodes as one before it.
fn doubled(config: &Config) -> Option<Diagnostic> {
    let mut seen = HashMap::new();
    let (again, first) = config.structure.cables.iter().enumerate().find_map(|(number, cable)| {
        let [a, b] = cable.nodes;
        Some((number, seen.insert([a.min(b), a.max(b)], number)?))
    })?;
    let what =
        format!("it joins the same two nodes as cable {first}: both carry, as one of twice the section");
    Some(warning(code::GEOMETRY, format!("structure.cables.{again}"), what, "leave one of them out"))
}

/// A warning about `key`; an empty `hint` is none.
fn warning(code: Code, key: impl Into<String>, what: impl Into<String>, hint: &str) -> Diagnostic {
    let about = Diagnostic::warning(code, what).about(key);
    if hint.is_empty() { about } else { about.try_instead(hint) }
}

/// Every part against the structure that it is in.
fn judge_parts(at: &mut Judge) -> Result<(), Diagnostic> {
    let Judge { scene, config, model, .. } = *at;
    let extent = model.extent();
    for (i, (part, built)) in config.structure.parts.iter().zip(&model.parts).enumerate() {
        let key = Key { scene, key: format!("structure.parts.{i}") };
        let size = built.elements.iter().map(|e| {
            let nodes = model.elements[*e].nodes();
            nodes.iter().map(|n| (model.nodes[*n] - model.nodes[nodes[0]]).norm()).fold(0.0, f64::max)
        });
        let size = size.fold(0.0, f64::max);
        let pulled = || pulled(config, model, i);
        at.warnings.extend(part.judge(&Surroundings { key: &key, extent, size, pulled: &pulled })?);
        at.warnings.extend(weak_axis(config, model, i));
        at.warnings.extend(late_brake(config, model, i));
    }
    check_rope_ends(scene, config, model)
}

/// A warning about posts of a section that bend more easily across the barrier, where the block comes from, than along it.
fn weak_axis(config: &Config, model: &Model, part: usize) -> Option<Diagnostic> {
    let barrier = matches!(config.structure.generator, Some(Generator::Barrier(_)));
    let feet = &model.groups.iter().find(|group| barrier && group.name == "feet")?.nodes;
    let [first, last] = [feet.first()?, feet.last()?].map(|node| model.nodes[*node as usize]);
    let line = Vector3::new(last.x - first.x, last.y - first.y, 0.0).try_normalize(0.0)?;
    let across = Vector3::new(-line.y, line.x, 0.0);
    let weak = model.parts[part].elements.iter().any(|element| {
        let AnyElement::Beam(Beam { axes, bending, fibres: Some(_), .. }) = &model.elements[*element] else {
            return false;
        };
        let towards = |direction: &Vector3<f64>| -> f64 {
            axes.iter().zip(bending).map(|(axis, stiffness)| axis.dot(direction).powi(2) * stiffness).sum()
        };
        towards(&across) < 0.99 * towards(&line)
    });
    let (key, name) = (format!("structure.parts.{part}.up"), config.structure.parts[part].head().name);
    let up = [across.x, across.y].map(|x| (1e3 * x).round() / 1e3 + 0.0);
    let what =
        format!("`{name}` stand with the weak axis of their section against what comes across the barrier");
    let hint = format!("turn the web there with up = [{:?}, {:?}, 0.0]", up[0], up[1]);
    weak.then(|| warning(code::UNUSUAL_VALUE, key, what, &hint))
}

/// A warning about brakes that give way only under more than the weakest rope at them bears.
fn late_brake(config: &Config, model: &Model, part: usize) -> Option<Diagnostic> {
    let own = |element: &usize| match &model.elements[*element] {
        AnyElement::Bar(bar) if bar.is_brake() => Some((bar.law.hardening.first()?.1, bar.nodes)),
        _ => None,
    };
    let brakes: Vec<_> = model.parts[part].elements.iter().filter_map(own).collect();
    let first = brakes.first()?.0;
    let breaks = |element: &usize| match &model.elements[*element] {
        AnyElement::Bar(rope) if !rope.is_brake() => Some((rope.rupture.force, &rope.nodes[..])),
        AnyElement::SlidingCable(rope) => Some((rope.rupture.force, &rope.nodes[..])),
        _ => None,
    };
    let is_at = |nodes: &[usize]| nodes.iter().any(|node| brakes.iter().any(|(_, ends)| ends.contains(node)));
    let (rope, force) = config.structure.parts.iter().zip(&model.parts).find_map(|(part, built)| {
        let weak =
            built.elements.iter().filter_map(breaks).find(|(force, nodes)| *force <= first && is_at(nodes));
        weak.map(|(force, _)| (part.head().name, force))
    })?;
    let what = format!(
        "the brakes give way under {first} N, and `{rope}`, at which they are, breaks under {force:.4e} N"
    );
    let hint = "rows are [elongation in m, force in N]: a brake has less force than its rope bears";
    Some(warning(code::UNUSUAL_VALUE, format!("structure.parts.{part}.curve"), what, hint))
}

/// Refuse brakes that run into the next point of their rope before they come to their own stop.
fn check_rope_ends(scene: &Scene, config: &Config, model: &Model) -> Result<(), Diagnostic> {
    for end in model.rope_ends() {
        let AnyElement::Bar(brake) = &model.elements[end.brake] else { continue };
        let (stroke, room) = (brake.law.limit, end.room());
        if !(stroke.is_finite() && stroke > room) {
            continue;
        }
        let part = |of: usize| model.parts.iter().position(|part| part.elements.contains(&of));
        let (at, rope) = (part(end.brake).unwrap_or(0), part(end.rope));
        let rope = rope.map_or("its rope", |at| config.structure.parts[at].head().name);
        let key = Key { scene, key: format!("structure.parts.{at}") };
        let what = format!(
            "stroke is {stroke} m, and {} has room for {room:.3} m: there the end of `{rope}` has come to the next point that \
             it slides through, and the brake is jammed",
            model.member_name(end.brake, None)
        );
        let barrier = matches!(config.structure.generator, Some(Generator::Barrier(_)));
        let cure = match barrier {
            true => {
                "anchors further beyond the outer posts (structure.generator.side_distance: the bottom rope's lie at half of it), or a shorter stroke"
            }
            false => "more rope between the brake and that point, or a shorter stroke",
        };
        return key.refuse("stroke", what, cure);
    }
    Ok(())
}

/// The part with the largest prestress [N] that has a node in common with part number `of`, and that prestress.
fn pulled<'a>(config: &'a Config, model: &Model, of: usize) -> Option<(&'a str, f64)> {
    let nodes = |part: &Part| -> Vec<usize> {
        let cables = part.cables.iter().flat_map(|c| model.cables[*c].nodes);
        cables.chain(part.elements.iter().flat_map(|e| model.elements[*e].nodes().iter().copied())).collect()
    };
    let own = nodes(&model.parts[of]);
    let common = config.structure.cable.as_ref();
    let ropes = config.structure.parts.iter().zip(&model.parts).filter_map(|(part, built)| {
        let section = StatedSection::of_part(part, common);
        let (stress, area) = (section.prestress?, section.area?);
        let touches = nodes(built).iter().any(|node| own.contains(node));
        (touches && stress > 0.0).then(|| (part.head().name, stress * area))
    });
    ropes.max_by(|a, b| a.1.total_cmp(&b.1))
}

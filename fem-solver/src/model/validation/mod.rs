//! What can be known of a structure before it is computed: numbers in other units than SI, sections that do not fit their
//! elements, strengths below what acts from the start. An error where no one can mean it, else a warning.

mod devices;
pub mod supports;

use crate::config::Config;
use crate::element::cable_properties::Stated;
use crate::element::part::StatedSection;
use crate::model::Model;
use interface_defs::diagnostic::Diagnostic;
use interface_defs::toolkit::scene::Scene;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Longest structure that a mesh or generator may make [m], and that from which on it is asked whether metres are meant.
const LONGEST: [f64; 2] = [2000.0, 500.0];
/// Shortest one [m].
const SHORTEST: f64 = 0.01;
/// Nodes closer than this, relative to the extent, are at one place.
const SAME_PLACE: f64 = 1e-9;

/// Strain by a prestress of which no one could see anything.
const SLACK: f64 = 1e-6;
/// Strain from which on a prestress below 0 is more likely to be a tension with the wrong sign.
const LOOSE: f64 = 5e-3;
/// Stress that no wire bears [Pa].
const STRONGEST: f64 = 1e10;
/// Least density of metals [kg/m3], and a modulus that is below all of theirs [Pa].
const METAL: f64 = 2000.0;
const SOFTEST_METAL: f64 = 1e9;

/// Judge `model`. What someone might mean goes into its warnings.
pub fn judge(scene: &Scene, config: &Config, model: &mut Model) -> Result<(), Diagnostic> {
    let mut warnings = Vec::new();
    judge_extent(scene, config, model, &mut warnings)?;
    for section in sections(config, model) {
        let mut judge = Judge { scene, section: &section, warnings: &mut warnings };
        judge.material()?;
        judge.shape()?;
        judge.strength()?;
    }
    devices::judge(scene, config, model, &mut warnings)?;
    supports::judge(scene, config, model, &mut warnings)?;
    supports::judge_gravity(scene, config, &mut warnings);
    supports::judge_damping(config, &mut warnings);
    warnings.extend(twins(model));
    model.warnings.extend(warnings);
    Ok(())
}

/// The sections of a scene: that of all cables, then one for each part that has lines.
fn sections(config: &Config, model: &Model) -> Vec<StatedSection> {
    let table = &config.structure;
    let span = |line: &[usize; 2]| (model.nodes[line[1]] - model.nodes[line[0]]).norm();
    // What every cable states for itself nothing uses of the common table.
    let parted: usize = model.parts[..model.part_count].iter().map(|p| p.cables.len()).sum();
    let others = model.cables.len() > parted + table.cables.len();
    let used = |states: fn(&Stated) -> bool| {
        others
            || table.cables.iter().any(|c| !states(&c.stated()))
            || table.parts.iter().any(|p| p.stated().is_some_and(|own| !states(&own)))
    };
    let all = model.lines().map(|(line, _)| span(&line)).fold(0.0, f64::max);
    let mut sections = Vec::new();
    if let Some(common) = &table.cable {
        sections.push(StatedSection {
            key: "structure.cable".into(),
            young: Some(common.young).filter(|_| used(|own| own.young.is_some())),
            density: Some(common.density).filter(|_| used(|own| own.density.is_some())),
            area: Some(common.area).filter(|_| used(|own| own.area.is_some())),
            radius: Some(common.radius),
            prestress: Some(common.prestress),
            strained: Some(common.young),
            longest: all,
            ..StatedSection::default()
        });
    }
    for (i, (config, part)) in table.parts.iter().zip(&model.parts).enumerate() {
        let cables = part.cables.iter().map(|c| span(&model.cables[*c].nodes));
        let others = part.elements.iter().flat_map(|e| model.elements[*e].lines()).map(|l| span(&l));
        let longest = cables.chain(others).fold(0.0, f64::max);
        let key = format!("structure.parts.{i}");
        sections.extend(config.section(table.cable.as_ref()).map(|own| StatedSection {
            key,
            longest,
            ..own
        }));
    }
    sections
}

/// Judges one section.
struct Judge<'a> {
    scene: &'a Scene,
    section: &'a StatedSection,
    warnings: &'a mut Vec<String>,
}

impl Judge<'_> {
    fn error(&self, name: &str, what: String, cure: &str) -> Diagnostic {
        self.scene.invalid(&format!("{}.{name}", self.section.key), what).try_instead(cure)
    }

    fn warn(&mut self, name: &str, what: String) {
        self.warnings.push(format!("{}.{name}: {what}", self.section.key));
    }

    /// Modulus and density.
    fn material(&mut self) -> Result<(), Diagnostic> {
        if let Some(young) = self.section.young {
            if young < 1e3 {
                let what = format!("young is {young} Pa: no solid is that soft");
                return Err(self.error(
                    "young",
                    what,
                    "pascals: 210 GPa of steel is 2.1e11, a wire rope has 1e11",
                ));
            }
            if (5e4..=3e5).contains(&young) {
                self.warn(
                    "young",
                    format!(
                        "{young} Pa is softer than rubber; in MPa it would be a metal's: write {:e}",
                        1e6 * young
                    ),
                );
            }
            if young < 5e4 {
                self.warn(
                    "young",
                    format!(
                        "{young} Pa is softer than rubber, which has 1e6; in MPa it would be {:e} Pa",
                        1e6 * young
                    ),
                );
            }
            let dense = self.section.density.is_some_and(|d| d >= METAL);
            // What is stretched to more than its double by its prestress alone is no material, but a stiffness by prestress.
            let stretched = self.section.prestress.is_some_and(|stress| stress >= young);
            if dense && young > 3e5 && young < SOFTEST_METAL && !stretched {
                self.warn(
                    "young",
                    format!(
                        "{young:e} Pa is softer than plastic, and {} kg/m3 is a metal's density; in kPa it would be {:e} Pa",
                        self.section.density.unwrap_or_default(),
                        1e3 * young
                    ),
                );
            }
            if young > 2e12 {
                self.warn(
                    "young",
                    format!("{young:e} Pa is stiffer than diamond (1.2e12); steel has 2.1e11"),
                );
            }
        }
        let Some(density) = self.section.density.filter(|d| *d > 0.0) else { return Ok(()) };
        let steel = "kilograms per cubic metre: steel has 7850 (7.85 g/cm3, 7.85e-9 t/mm3)";
        if !(0.01..=1e6).contains(&density) {
            let than = if density < 1.0 { "lighter than air" } else { "heavier than anything" };
            return Err(self.error("density", format!("density is {density} kg/m3: {than}"), steel));
        }
        if density < 30.0 {
            self.warn("density", format!("{density} kg/m3 is that of a foam; {steel}"));
        }
        if density > 3e4 {
            self.warn(
                "density",
                format!("{density} kg/m3 is heavier than any metal (osmium has 22600); {steel}"),
            );
        }
        Ok(())
    }

    /// Area, moments of inertia and radius, against each other and the length of the elements.
    fn shape(&mut self) -> Result<(), Diagnostic> {
        let longest = self.section.longest;
        if longest == 0.0 {
            return Ok(());
        }
        let radius = self.section.radius.unwrap_or(0.0);
        if radius > longest {
            let what = format!("radius is {radius} m, and the longest element of it has {longest:.4} m");
            return Err(self.error("radius", what, "metres: 8 mm is 0.008"));
        }
        if radius > 0.2 * longest {
            self.warn(
                "radius",
                format!("{radius} m beside elements of {longest:.4} m at most; 8 mm is 0.008"),
            );
        }
        let Some(area) = self.section.area else { return Ok(()) };
        let (width, beam) = (2.0 * (area / PI).sqrt(), self.section.inertia.is_some());
        let what = format!(
            "area is {area} m2, a rod {width:.3} m thick, and the longest element of it has {longest:.4} m"
        );
        if width > if beam { 5.0 * longest } else { longest } {
            return Err(self.error("area", what, "square metres: 240 mm2 is 2.4e-4"));
        }
        if width > if beam { longest } else { 0.1 * longest.max(1.0) } {
            self.warn("area", format!("{what}; 240 mm2 is 2.4e-4"));
        }
        if radius > 0.0 && !beam && (1.9..=2.1).contains(&(radius / (0.5 * width))) {
            self.warn(
                "radius",
                format!(
                    "{radius} m is twice the radius of a rod of the section, {area} m2: is it the diameter? Then write {:?}",
                    0.5 * radius
                ),
            );
        }
        if radius > 0.0 && !beam && (area > 1.2 * PI * radius * radius || PI * radius * radius > 50.0 * area)
        {
            self.warn(
                "radius",
                format!(
                    "a contact sees {radius} m, and the section of {area} m2 alone has {:.2e} m",
                    0.5 * width
                ),
            );
        }
        for inertia in self.section.inertia.unwrap_or_default() {
            let gyration = (inertia / area).sqrt();
            let what = format!(
                "inertia is {inertia} m4 with an area of {area} m2: a radius of gyration of {gyration:.2e} m, of a beam \
                 of {longest:.4} m"
            );
            if gyration > longest {
                return Err(self.error(
                    "inertia",
                    what,
                    "metres to the fourth: 2490 cm4 (HE 160 B) is 2.49e-5",
                ));
            }
            if beam && (gyration > 0.2 * longest || gyration < 0.01 * width) {
                self.warn("inertia", format!("{what}; 2490 cm4 (HE 160 B) is 2.49e-5"));
            }
        }
        Ok(())
    }

    /// Prestress, against the modulus.
    fn prestress(&mut self) {
        let (Some(stress), Some(young)) = (self.section.prestress, self.section.strained) else { return };
        let strain = stress / young;
        if stress != 0.0 && strain.abs() < SLACK {
            self.warn(
                "prestress",
                format!(
                    "{stress} Pa strains it by {strain:.1e} only (young is {young:e} Pa), which changes nothing; were it in MPa, \
                     it would be {:e} Pa",
                    1e6 * stress
                ),
            );
        }
        if stress > STRONGEST {
            self.warn(
                "prestress",
                format!("{stress:e} Pa is more than any wire bears (2e9 Pa); it is a stress: 100 MPa is 1e8, a force is divided by the area"),
            );
        }
        if strain <= -LOOSE {
            self.warn(
                "prestress",
                format!(
                    "{stress:e} Pa makes it {:.1} % longer than the distance of its nodes, as below 0 is slack; a tension is above 0",
                    -100.0 * strain
                ),
            );
        }
    }

    /// Strength, against prestress and what a section of its size carries.
    fn strength(&mut self) -> Result<(), Diagnostic> {
        if let Some(strain) = self.section.rupture_strain.filter(|s| *s > 1.0) {
            self.warn(
                "rupture_strain",
                format!("{strain} is a strain, no percentage: {strain} % is {}", 0.01 * strain),
            );
        }
        self.prestress();
        let (Some(force), Some(area)) = (self.section.rupture_force, self.section.area) else {
            return Ok(());
        };
        let prestress = self.section.prestress.unwrap_or(0.0);
        if prestress * area > force {
            let what = format!(
                "rupture_force is {force} N, and the prestress alone is {:.4e} N ({prestress:e} Pa on {area} m2)",
                prestress * area
            );
            return Err(self.error("rupture_force", what, "newtons: 300 kN is 3e5; or less prestress"));
        }
        let strength = force / area;
        if !(5e6..=1e10).contains(&strength) {
            let than = if strength < 5e6 { "weaker than wood" } else { "stronger than any wire" };
            self.warn(
                "rupture_force",
                format!("{force} N on {area} m2 is a strength of {strength:.1e} Pa, {than}; 300 kN is 3e5"),
            );
        }
        Ok(())
    }
}

fn judge_extent(
    scene: &Scene,
    config: &Config,
    model: &Model,
    warnings: &mut Vec<String>,
) -> Result<(), Diagnostic> {
    let table = &config.structure;
    if model.nodes.is_empty() {
        let what = "no element of the mesh becomes anything: the structure is empty";
        return Err(scene.invalid("structure.mesh", what).try_instead(
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
    if extent > LONGEST[0] && (table.mesh.is_some() || table.generator.is_some()) {
        return Err(scene.invalid(key, format!("{what}, more than {} m", LONGEST[0])).try_instead(cure));
    }
    if model.nodes.len() > 1 && extent < SHORTEST && (table.mesh.is_some() || table.generator.is_some()) {
        let cure = cure.replace("scale it by 0.001", "scale it by 1000 if it is in kilometres");
        return Err(scene.invalid(key, format!("{what}, less than {SHORTEST} m")).try_instead(cure));
    }
    let key = if table.nodes.is_empty() { key } else { "structure.nodes" };
    if extent > LONGEST[1] {
        warnings.push(format!("{key}: {what}: are these centimetres or millimetres? {cure}"));
    }
    if model.nodes.len() > 1 && extent < SHORTEST {
        warnings.push(format!("{key}: {what}: its coordinates count in metres"));
    }
    Ok(())
}

/// Nodes at one place: a mesh whose parts were not joined falls apart there.
fn twins(model: &Model) -> Option<String> {
    let step = (SAME_PLACE * model.extent()).max(f64::MIN_POSITIVE);
    let mut seen: HashMap<[i64; 3], usize> = HashMap::with_capacity(model.node_count());
    let mut pairs = Vec::new();
    for (node, p) in model.nodes.iter().enumerate() {
        let place = [p.x, p.y, p.z].map(|c| (c / step).round() as i64);
        match seen.get(&place) {
            Some(first) => pairs.push((*first, node)),
            None => {
                seen.insert(place, node);
            }
        }
    }
    let (a, b) = *pairs.first()?;
    Some(format!(
        "structure: {} nodes lie where another one does, first node {} and node {}: elements that end there are not connected; join \
         them (in Gmsh: Coherence)",
        pairs.len(),
        model.node_name(a),
        model.node_name(b)
    ))
}

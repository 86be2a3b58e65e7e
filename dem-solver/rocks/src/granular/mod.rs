//! Thousands of separate spheres that touch each other and the sides of a box.
//!
//! - [`forces`]: what the pairs do
//! - [`run`]: the steps of a window, and why one went wrong
//! - [`state`]: what is committed and what is tried
//! - [`steps`](mod@steps): the largest stable step
//! - [`fields`](mod@fields), [`check`](mod@check): what is reported of it

pub mod check;
pub mod fields;
pub mod forces;
pub mod run;
pub mod state;
pub mod steps;

use crate::gate;
use crate::model::Steps;
use crate::model::between::no_table;
use crate::results::gauges::energies;
use crate::results::measures::penetration;
use crate::results::not_written;
use dem_contact::contact::broad_phase::cell_grid::{Plane, SpherePair};
use dem_contact::law::Law;
use dem_contact::law::table::Laws;
use dem_contact::settings::placement::Start;
use dem_contact::settings::{BoxSettings, Settings, limits};
use fields::GranularFields;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::{Gauge, Hello};
use interface_defs::solver::OnProgress;
use interface_defs::{Fault, Plan, Ready, Solver, Statistics, Window};
use nalgebra::Vector3;
use run::GranularIntegrator;
use state::GranularState;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// True if there are separate spheres in `scene` and nothing else that they could touch but a box: else each is a rock.
pub fn are_alone(scene: &Scene) -> bool {
    let others = ["rock", "terrain", "structure"];
    let of_other_solver =
        || matches!(scene.read::<toml::Table>("processes"), Ok(Some(table)) if table.contains_key("fem"));
    scene.has("spheres") && !others.iter().any(|key| scene.has(key)) && !of_other_solver()
}

/// What does not change in a run.
pub struct GranularModel {
    /// What the scene says.
    pub settings: Settings,
    /// Radius of each sphere [m].
    pub radius: Vec<f64>,
    /// Mass [kg].
    pub mass: Vec<f64>,
    /// Inertia about the centre [kg m2].
    pub inertia: Vec<f64>,
    /// Number of the table that made it.
    pub group: Vec<u16>,
    /// Smallest radius [m].
    pub smallest: f64,
    /// The surfaces.
    pub planes: Vec<Plane>,
    /// The laws between spheres, then those with surfaces.
    pub laws: Vec<Law>,
    /// Law numbers, a row for each group: with each group, then with the surfaces.
    table: Vec<u16>,
    /// True if a law has a rolling part.
    pub rolls: bool,
    /// True if a law remembers.
    pub remembers: bool,
    /// The step, and what limits it.
    pub steps: Steps,
    /// `gravity` [m/s2].
    pub gravity: Vector3<f64>,
}

impl GranularModel {
    /// Of a scene, and where its spheres start.
    pub fn new(scene: &Scene) -> Result<(Self, Start), Diagnostic> {
        let settings = Settings::of_spheres(scene)?;
        let start = Start::of(&settings.spheres, scene)?;
        let laws = Laws::new(&settings.contacts).expect("checked: there is a contact");
        let table = law_table(&settings, &laws).map_err(|(a, b)| {
            let [what, advice] = no_table(a, b);
            scene.invalid("contact", what).try_instead(advice)
        })?;
        // Each sphere is a body of its own, and its contact with a wall one as with another.
        let walls = laws.surfaces.iter().zip(&laws.rocks);
        let walls = walls.map(|(wall, rock)| Law { rolling: rock.rolling, ..wall.clone() });
        let all: Vec<Law> = laws.rocks.iter().cloned().chain(walls).collect();
        let used = || table.iter().map(|n| &all[*n as usize]);
        let (rolls, remembers) = (used().any(|l| l.rolling.is_some()), used().any(Law::remembers));
        let steps = steps::steps(&settings, &start, &used().cloned().collect::<Vec<_>>(), scene)?;
        let smallest = start.radius.iter().copied().fold(f64::INFINITY, f64::min);
        let inertia = start.mass.iter().zip(&start.radius).map(|(m, r)| 0.4 * m * r * r).collect();
        let model = Self {
            radius: start.radius.clone(),
            mass: start.mass.clone(),
            inertia,
            group: start.group.clone(),
            smallest,
            planes: settings.sides.iter().flat_map(BoxSettings::planes).collect(),
            laws: all,
            table,
            rolls,
            remembers,
            steps,
            gravity: settings.gravity,
            settings,
        };
        Ok((model, start))
    }

    /// What the pair of sphere `i` and `second` (a sphere, or a mesh) needs.
    fn pair(&self, i: usize, second: u32) -> SpherePair {
        let groups = self.settings.spheres.len();
        let row = self.group[i] as usize * (groups + 1);
        let (radius, mass) = (self.radius[i], self.mass[i]);
        let j = second as usize;
        let (column, radius, mass) = match self.radius.get(j) {
            Some(other) => {
                let mass = mass * self.mass[j] / (mass + self.mass[j]);
                (self.group[j] as usize, radius * other / (radius + other), mass)
            }
            None => (groups, radius, mass),
        };
        SpherePair { second, law: self.table[row + column], radius, root_mass: mass.sqrt() }
    }
}

/// Law numbers of all pairs of groups and of groups with surfaces. Errs with the pair that has none.
fn law_table<'a>(settings: &'a Settings, laws: &Laws) -> Result<Vec<u16>, (&'a str, &'a str)> {
    let number = |a: &'a str, b: &'a str| laws.number(a, b).ok_or((a, b));
    let mut table = Vec::new();
    for a in settings.spheres.iter().map(|group| &*group.material) {
        for b in &settings.spheres {
            table.push(number(a, &b.material)? as u16);
        }
        // Without surfaces the entry is never read.
        let with_walls = settings.sides.as_ref().map_or(Ok(0), |sides| number(a, &sides.material))?;
        table.push((laws.rocks.len() + with_walls) as u16);
    }
    Ok(table)
}

/// Many separate spheres, alone on a scene.
pub struct GranularSolver {
    model: GranularModel,
    cautions: Vec<Diagnostic>,
    options: Options,
    run: GranularIntegrator,
    committed: GranularState,
    trial: GranularState,
    fields: Option<GranularFields>,
}

/// How far spheres of a file may overlap at the start, in smaller radii: as in a packing at rest.
const RESTING: f64 = 0.1;

/// What is said of `contacts` that there are at the start: of spheres of a file, little. Others are placed apart.
fn overlapping(
    model: &GranularModel,
    start: &Start,
    contacts: usize,
    scene: &Scene,
) -> Result<Option<Diagnostic>, Diagnostic> {
    let groups = &model.settings.spheres;
    let what = match contacts {
        1 => "1 pair overlaps at the start".to_owned(),
        _ => format!("{contacts} pairs overlap at the start"),
    };
    if groups.iter().all(|group| group.file.is_none()) {
        let reach = |a: usize| (groups[a].lowest, groups[a].highest);
        let same = (1..groups.len()).find(|b| (0..*b).any(|a| reach(a) == reach(*b)));
        let at = same.unwrap_or(groups.len() - 1);
        return scene.refuse(
            &format!("spheres.{at}.count"),
            what,
            "give each table a region of its own, inside the box: lowest, highest",
        );
    }
    let Some((i, j, share)) = start.deepest() else { return Ok(None) };
    let of = |k: usize| usize::from(start.group[k]);
    let at = if groups[of(j)].file.is_some() { of(j) } else { of(i) };
    let (a, b, percent) = (start.position[i], start.position[j], 100.0 * share);
    let deepest = format!(
        "{what}, the deepest by {percent:.2} % of the smaller radius: the spheres at {} {} {} and {} {} {} m",
        a.x, a.y, a.z, b.x, b.y, b.z
    );
    if share > RESTING {
        return scene.refuse(
            &format!("spheres.{at}.file"),
            deepest,
            "beyond 10 % they fly apart: move them apart, or write smaller radii (radii, not diameters)",
        );
    }
    Ok(Some(Diagnostic::warning(code::GEOMETRY, deepest).about(format!("spheres.{at}.file"))))
}

impl GranularSolver {
    /// The solver of a scene.
    pub fn new(scene: &Scene, options: &Options) -> Result<Self, Diagnostic> {
        let (model, start) = GranularModel::new(scene)?;
        let mut cautions = gate::of_spheres(&model.settings, scene)?;
        let mut committed = GranularState::new(&start, model.gravity);
        let mut run = GranularIntegrator::new(committed.position.len());
        run.at_end(&model, &mut committed);
        if committed.contacts > 0 {
            cautions.extend(overlapping(&model, &start, committed.contacts, scene)?);
        }
        cautions.extend(limits::of_contacts(&model.settings.contacts));
        let trial = committed.clone();
        Ok(Self { model, cautions, options: options.clone(), run, committed, trial, fields: None })
    }

    /// What does not change in a run.
    pub fn model(&self) -> &GranularModel {
        &self.model
    }

    /// The committed state.
    pub fn state(&self) -> &GranularState {
        &self.committed
    }

    /// Names of the numbers that come with every answer.
    fn gauges() -> Vec<Gauge> {
        let others = [Gauge::new("contacts", "1"), Gauge::new("fastest", "m/s")];
        let centre = ["x", "y", "z"].map(|axis| Gauge::new(format!("centre_of_mass_{axis}"), "m"));
        energies().into_iter().chain(others).chain(centre).collect()
    }

    /// Their values.
    fn values(&self, state: &GranularState) -> [f64; 9] {
        let model = &self.model;
        let (mut kinetic, mut potential, mut fastest) = (0.0, 0.0, 0.0_f64);
        let (mut mass, mut centre) = (0.0, Vector3::zeros());
        for i in 0..state.position.len() {
            let (v2, w2) = (state.velocity[i].norm_squared(), state.spin[i].norm_squared());
            kinetic += 0.5 * (model.mass[i] * v2 + model.inertia[i] * w2);
            potential -= model.mass[i] * model.gravity.dot(&state.position[i]);
            fastest = fastest.max(v2);
            mass += model.mass[i];
            centre += state.position[i] * model.mass[i];
        }
        let stored = state.elastic + state.tangential_energy;
        centre /= mass;
        let contacts = state.contacts as f64;
        [kinetic, potential, stored, state.dissipated, contacts, fastest.sqrt(), centre.x, centre.y, centre.z]
    }

    fn write_gauges(&self, state: &GranularState, output: &mut [f64]) {
        for (out, value) in output.chunks_exact_mut(3).zip(self.values(state)) {
            out.fill(value);
        }
    }

    fn write_fields(&mut self) -> Result<(), Fault> {
        let (model, state) = (&self.model, &self.committed);
        self.fields.as_mut().map_or(Ok(()), |fields| fields.write_if_due(model, state))
    }
}

impl Solver for GranularSolver {
    fn hello(&self) -> Hello {
        Hello {
            program: format!("dem-solver {}", env!("CARGO_PKG_VERSION")),
            repeats: Some(0.0),
            ..Hello::default()
        }
    }

    fn prepare(&mut self, plan: &Plan, _: OnProgress) -> Result<Ready, Fault> {
        if plan.partner_mesh.is_some() || !plan.takes.is_empty() || !plan.gives.is_empty() {
            return Err(Fault::input("[[spheres]] run alone: they have no interface with a structure"));
        }
        if let (Some(interval), Some(out)) = (self.model.settings.fields, &self.options.out) {
            self.fields = Some(GranularFields::create(&out.join("fields"), interval, &self.model)?);
            self.write_fields()?;
        }
        let gauges = Self::gauges();
        let mut initial = vec![0.0; 3 * gauges.len()];
        self.write_gauges(&self.committed, &mut initial);
        Ok(Ready { gauges, initial, warnings: self.cautions.clone(), ..Ready::default() })
    }

    fn solve(&mut self, window: &Window, _: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        if !(window.length > 0.0 && window.length.is_finite()) {
            return Err(Fault::broken(format!("a window of {} s cannot be solved", window.length)));
        }
        self.trial.copy(&self.committed);
        self.run.solve(&self.model, &mut self.trial, window)?;
        self.write_gauges(&self.trial, output);
        Ok(())
    }

    fn commit(&mut self) -> Result<(), Fault> {
        std::mem::swap(&mut self.committed, &mut self.trial);
        self.write_fields()
    }

    fn finish(&mut self) -> Result<Statistics, Fault> {
        let counts = [
            ("sub_steps", self.run.steps),
            ("contact_evaluations", self.run.evaluations),
            ("candidate_refreshes", self.run.searches()),
        ];
        let counts = counts.map(|(name, count)| (name.to_owned(), count)).into();
        let (deepest, when) = self.committed.deepest;
        let measures = vec![penetration("max_penetration", deepest, when)];
        let unwritten = self.fields.as_mut().and_then(|fields| fields.finish().err());
        let warnings = unwritten.map(not_written).into_iter().collect();
        Ok(Statistics { measures, counts, warnings, ..Statistics::default() })
    }
}

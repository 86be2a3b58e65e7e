//! A coupled run within this process: the same numbers as over shared memory, without its waiting.

use coupler::coupling::{Committed, Coupling, Observer};
use coupler::settings::CouplingSettings;
use coupler::side::Side;
use in_process::{Any, InProcess};
use interface_defs::Diagnostic;
use interface_defs::message::{Measure, Statistics};
use std::path::Path;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// What a run computed, and what it took.
pub struct Computed {
    /// Why it ended before its time, if it did.
    pub error: Option<String>,
    /// Measures of both solvers.
    pub measures: Vec<Measure>,
    /// Largest imbalance of energy over the kinetic energy at impact.
    pub energy_error: f64,
    /// Coupling iterations: passes over both solvers.
    pub passes: u64,
    /// Windows that were solved again at half length.
    pub halved: u64,
    /// Steps of the contact solver and of the structure.
    pub steps: [u64; 2],
}

impl Computed {
    /// A measure; NaN where there is none.
    pub fn measure(&self, name: &str) -> f64 {
        self.measures.iter().find(|m| m.name == name).map_or(f64::NAN, |m| m.value)
    }
}

struct Silent;

impl Observer for Silent {
    fn prepared(&mut self, _: &Side, _: &Side, _: &[Diagnostic]) -> Result<(), Diagnostic> {
        Ok(())
    }
    fn committed(&mut self, _: &Committed) -> Result<(), Diagnostic> {
        Ok(())
    }
}

/// Run `scene` with these `--set`s to its end, in this process.
pub fn computed(scene: &Path, sets: &[String]) -> Result<Computed, String> {
    let scene = Scene::load(scene, sets).map_err(|e| e.to_string())?;
    let options = Options { out: None, shortcuts: true };
    let dem = (dem_solver::PROGRAM.build)(&scene, &options).map_err(|e| e.to_string())?;
    let fem = (fem_solver::PROGRAM.build)(&scene, &options).map_err(|e| e.to_string())?;
    let (mut dem, mut fem) = (InProcess::new("dem", Any(dem)), InProcess::new("fem", Any(fem)));
    let settings = CouplingSettings::of(&scene).map_err(|e| e.to_string())?;
    let end = scene.end_time().map_err(|e| e.to_string())?;
    let mut coupling = Coupling::new(settings, end, &mut dem, &mut fem);
    let outcome = coupling.run(&mut Silent, &mut |_| Ok(()));
    let (counts, energy_error) = (coupling.counts, coupling.balance.system.error().unwrap_or(f64::NAN));
    let told = coupling.finish().unwrap_or_else(|_| (Statistics::default(), Statistics::default()));
    let steps = |side: &Statistics| side.counts.iter().find(|(n, _)| n == "sub_steps").map_or(0, |(_, c)| *c);
    let measures: Vec<Measure> = told.0.measures.iter().chain(&told.1.measures).cloned().collect();
    Ok(Computed {
        error: outcome.err().map(|e| e.to_string()),
        energy_error,
        passes: counts.iterations,
        halved: counts.halved,
        steps: [steps(&told.0), steps(&told.1)],
        measures,
    })
}

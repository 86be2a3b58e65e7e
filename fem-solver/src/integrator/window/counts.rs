//! Counts of the work of a run.

use crate::equilibrium::newton::Info;
use crate::model::Model;
use interface_defs::diagnostic::{Diagnostic, code};
use serde::{Deserialize, Serialize};

/// Work that was done, iterations of windows included, and windows that were skipped.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Counts {
    /// Steps of the integrator.
    pub steps: u64,
    /// Newton iterations, form finding included.
    pub newton: u64,
    /// Factorisations, form finding included.
    pub factorisations: u64,
    /// Factorisations that were spared: the factor at hand was that of the tangent asked for.
    pub kept_factors: u64,
    /// Windows begun anew with twice the steps, because Newton had failed.
    pub refined: u64,
    /// Steps along a path of equilibrium that were taken anew, shorter.
    pub refused: u64,
    /// Steps with a tangent that was not positive and had to be shifted.
    pub shifted: u64,
    /// Those of them whose last tangent was such.
    pub unstable: u64,
    /// Degree of freedom of the pivot that was not positive, in the first of them.
    pub unstable_at: Option<usize>,
    /// Most of its strength that anything carried as it broke in an implicit step, where that was too much; 0 where nothing did.
    pub late: f64,
    /// Committed windows in which nothing loaded or moved the structure.
    pub skipped: u64,
}

impl Counts {
    /// Add the work of Newton's iteration in a step.
    pub fn add(&mut self, info: &Info) {
        self.newton += info.iterations;
        self.factorisations += info.factorisations;
        self.kept_factors += info.kept_factors;
        self.shifted += u64::from(info.shifted_at.is_some());
        self.unstable += u64::from(info.unstable.is_some());
        self.unstable_at = self.unstable_at.or(info.unstable);
    }

    /// The counts by the names of `summary.json`.
    pub fn named<C: FromIterator<(String, u64)>>(&self) -> C {
        let counts = [
            ("sub_steps", self.steps),
            ("newton_iterations", self.newton),
            ("skipped_windows", self.skipped),
            ("factorisations", self.factorisations),
            ("kept_factors", self.kept_factors),
            ("refined_windows", self.refined),
            ("shifted_tangents", self.shifted),
            ("refused_steps", self.refused),
        ];
        counts.into_iter().map(|(name, count)| (name.to_owned(), count)).collect()
    }

    /// Warnings that follow from them; in `load_steps` of statics, or in steps of the scene.
    pub fn warnings(&self, model: &Model, load_steps: bool) -> Vec<Diagnostic> {
        let mut warnings = Vec::new();
        if self.refined > 0 {
            let what = format!(
                "Newton failed in {} windows, iterations of the coupling included: they were begun anew with shorter steps",
                self.refined
            );
            warnings.push(Diagnostic::warning(code::NOT_CONVERGED, what));
        }
        if self.late > 0.0 {
            let key = if load_steps { "fem.load_steps.first" } else { "fem.time_step" };
            let what = format!(
                "a step ended with {:.4} times the strength of what broke in it: loads grew too much in one step",
                self.late
            );
            warnings.push(Diagnostic::warning(code::TRUST, what).about(key).try_instead("shorten it"));
        }
        if let Some(dof) = self.unstable_at {
            let (steps, pivot) = (self.unstable, model.dof_name(dof));
            let what = format!(
                "the tangent was not positive at the end of {steps} steps (slack, or close to buckling; the first pivot at {pivot}): it was \
                 shifted, which slows Newton down and leaves its answer as it is"
            );
            warnings.push(Diagnostic::warning(code::GEOMETRY, what));
        }
        warnings
    }
}

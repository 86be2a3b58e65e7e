//! The interface force of a window: which samples a plan brings, and the load of each step.

use crate::config::scheme::Scheme;
use crate::integrator::implicit::StepLoad;
use crate::integrator::shown::Shown;
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::field::{FieldSpec, Items, Layout, Sampling, name};
use interface_defs::mesh::InterfaceMesh;
use interface_defs::message::{Fault, Plan};

/// Most samples of a field in a window.
pub const MOST_SAMPLES: u32 = 64;

/// Loads that a scheme needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// The mean over each part of the window.
    pub mean: bool,
    /// The force at the end of each part.
    pub end: bool,
}

impl Needs {
    /// Of an implicit scheme, or of the explicit one (`None`).
    pub fn of(scheme: Option<Scheme>) -> Self {
        match scheme {
            None => Self { mean: true, end: false },
            Some(s) => Self { mean: !s.takes_end_only(), end: !s.takes_mean_only() },
        }
    }

    /// The fields that a solver with these needs takes.
    pub fn fields(self) -> Vec<FieldSpec> {
        let field =
            |sampling| FieldSpec { samples: MOST_SAMPLES, ..FieldSpec::nodal(name::FORCE, 3, sampling) };
        let mean = self.mean.then(|| field(Sampling::Means));
        mean.into_iter().chain(self.end.then(|| field(Sampling::AtEnds))).collect()
    }
}

/// Samples of one kind in the input: which, and how many.
type Source = (Sampling, usize);

/// The interface force over a window, and the memory for that of a step (component-major).
pub struct Loads {
    layout: Layout,
    mean: Option<Source>,
    end: Option<Source>,
    mean_now: Vec<f64>,
    end_before: Vec<f64>,
    end_now: Vec<f64>,
    balance: Vec<f64>,
    end_of_step: Vec<f64>,
}

impl Loads {
    /// Find the force in `plan`, for a structure of so many degrees of freedom. A force of the other kind than the scheme needs is taken in its
    /// place, with a warning.
    pub fn new(
        needs: Needs,
        plan: &Plan,
        mesh: &InterfaceMesh,
        dofs: usize,
    ) -> Result<(Self, Vec<Diagnostic>), Fault> {
        let layout = Layout::new(&plan.takes, mesh, 0);
        let find = |sampling| {
            let spec = plan.takes.iter().find(|f| f.name == name::FORCE && f.sampling == sampling)?;
            Some((sampling, spec.samples as usize))
        };
        let (means, ends) = (find(Sampling::Means), find(Sampling::AtEnds));
        let mut warnings = Vec::new();
        let mut choose = |own: Option<Source>, other: Option<Source>, what: &str| {
            own.or_else(|| other.inspect(|_| warnings.push(Diagnostic::warning(code::TRUST, what))))
        };
        let of_end = "the force at a window's end is taken for its mean: impulse and work are not exact";
        let of_mean = "a window's mean force is applied as the force at its end: a lag of half a window, which adds energy; \
                       exchange the force at the end, or use generalized_alpha with rho_inf = 1";
        let mean = if needs.mean { choose(means, ends, of_end) } else { None };
        let end = if needs.end { choose(ends, means, of_mean) } else { None };
        if let (Some((_, means)), Some((_, ends))) = (mean, end)
            && means != ends
        {
            return Err(Fault::input(format!(
                "the integrator needs mean and end forces of equal samples, the plan has {means} and {ends}"
            )));
        }
        let [mean_now, end_before, end_now, balance, end_of_step] = [(); 5].map(|()| vec![0.0; dofs]);
        Ok((Self { layout, mean, end, mean_now, end_before, end_now, balance, end_of_step }, warnings))
    }

    /// Parts of a window that carry a force of their own.
    pub fn parts(&self) -> usize {
        self.mean.or(self.end).map_or(1, |(_, samples)| samples.max(1))
    }

    /// Whether there is any force in `input`.
    pub fn any(&self, input: &[f64]) -> bool {
        let mut samples = self.mean.iter().chain(&self.end).flat_map(|(kind, n)| (0..*n).map(|s| (*kind, s)));
        samples.any(|(kind, number)| sample(&self.layout, input, kind, number).iter().any(|f| *f != 0.0))
    }

    /// From now on inputs are laid out for these items. Nothing acts on nodes that are not among them.
    pub fn select(&mut self, items: &Items) {
        self.layout.resize(items);
        self.mean_now.fill(0.0);
        self.end_now.fill(0.0);
    }

    /// Part number `part` begins, with a force on the nodes `shown`; `before` is the force at the end of what came before.
    pub fn begin_part(&mut self, input: &[f64], part: usize, shown: &Shown, before: &[f64]) {
        if let Some((kind, _)) = self.mean {
            shown.put(sample(&self.layout, input, kind, part), &mut self.mean_now);
        }
        if let Some((kind, _)) = self.end {
            self.end_before.copy_from_slice(before);
            shown.put(sample(&self.layout, input, kind, part), &mut self.end_now);
        }
    }

    /// Mean force of the current part [N], component-major.
    pub fn mean(&self) -> &[f64] {
        &self.mean_now
    }

    /// Load of a step whose begin and end, at 0 and 1, lie `at` these shares of the current part, for a scheme that balances at
    /// `1 - alpha_f`.
    pub fn between(&mut self, scheme: &Scheme, at: impl Fn(f64) -> f64) -> StepLoad<'_> {
        if scheme.takes_mean_only() {
            return StepLoad { balance: &self.mean_now, end: &self.mean_now };
        }
        let (balance, end) = (at(1.0 - scheme.alpha_f), at(1.0));
        for i in 0..self.balance.len() {
            let (first, slope) = if self.mean.is_some() {
                // The straight line with this mean and this end.
                let first = 2.0 * self.mean_now[i] - self.end_now[i];
                (first, self.end_now[i] - first)
            } else {
                (self.end_before[i], self.end_now[i] - self.end_before[i])
            };
            self.balance[i] = if balance == 1.0 { self.end_now[i] } else { first + balance * slope };
            self.end_of_step[i] = if end == 1.0 { self.end_now[i] } else { first + end * slope };
        }
        StepLoad { balance: &self.balance, end: &self.end_of_step }
    }

    /// Whether the scheme's load has an end, which the next window begins from.
    pub fn has_end(&self) -> bool {
        self.end.is_some()
    }
}

/// A sample of the force in `input`.
fn sample<'a>(layout: &Layout, input: &'a [f64], kind: Sampling, number: usize) -> &'a [f64] {
    layout.sample(name::FORCE, kind, number).map_or(&[], |at| &input[at])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{FemConfig, Integrator};
    use crate::linear_algebra::node_major::{to_component_major, to_node_major};

    fn scheme(rho_inf: f64) -> Scheme {
        let fem = FemConfig {
            integrator: Integrator::GeneralizedAlpha,
            rho_inf: Some(rho_inf),
            ..Default::default()
        };
        Scheme::of(&fem).expect("is implicit")
    }

    fn mesh() -> InterfaceMesh {
        InterfaceMesh { coordinates: vec![0.0; 3], ..Default::default() }
    }

    #[test]
    fn a_scheme_declares_the_load_that_it_takes() {
        let takes = |s| Needs::of(s).fields().iter().map(|f| f.sampling).collect::<Vec<_>>();
        assert_eq!(takes(None), [Sampling::Means]);
        assert_eq!(takes(Some(scheme(1.0))), [Sampling::Means]);
        assert_eq!(takes(Some(scheme(0.0))), [Sampling::AtEnds]);
        assert_eq!(takes(Some(scheme(0.5))), [Sampling::Means, Sampling::AtEnds]);
    }

    fn of_step<'a>(loads: &'a mut Loads, scheme: &Scheme, step: usize, steps: usize) -> StepLoad<'a> {
        loads.between(scheme, |x| (step as f64 + x) / steps as f64)
    }

    #[test]
    fn a_force_that_grows_straight_reaches_every_step_as_it_is_there() {
        // F(t) = 8 t over a window of length 1: mean 4, end 8; the scheme balances at 1 - alpha_f.
        let plan = Plan { takes: Needs::of(Some(scheme(0.5))).fields(), ..Default::default() };
        let mut plan = plan;
        plan.takes.iter_mut().for_each(|f| f.samples = 1);
        let (mut loads, warnings) =
            Loads::new(Needs::of(Some(scheme(0.5))), &plan, &mesh(), 3).expect("is fine");
        assert!(warnings.is_empty());
        loads.begin_part(&[4.0, 0.0, 0.0, 8.0, 0.0, 0.0], 0, &Shown::all(1), &[0.0; 3]);
        for step in 0..4 {
            let load = of_step(&mut loads, &scheme(0.5), step, 4);
            let balance = 8.0 * (step as f64 + 1.0 - scheme(0.5).alpha_f) / 4.0;
            assert!((load.balance[0] - balance).abs() < 1e-14);
            assert!((load.end[0] - 2.0 * (step as f64 + 1.0)).abs() < 1e-14);
        }
    }

    #[test]
    fn end_forces_are_joined_by_straight_lines() {
        let mut plan = Plan { takes: Needs::of(Some(scheme(0.0))).fields(), ..Default::default() };
        plan.takes[0].samples = 2;
        let (mut loads, _) = Loads::new(Needs::of(Some(scheme(0.0))), &plan, &mesh(), 3).expect("is fine");
        assert_eq!(loads.parts(), 2);
        let input = [6.0, 0.0, 0.0, 7.0, 0.0, 0.0];
        loads.begin_part(&input, 0, &Shown::all(1), &[2.0, 0.0, 0.0]);
        assert_eq!(of_step(&mut loads, &scheme(0.0), 0, 2).end[0], 4.0);
        assert_eq!(of_step(&mut loads, &scheme(0.0), 1, 2).end[0], 6.0);
        loads.begin_part(&input, 1, &Shown::all(1), &[6.0, 0.0, 0.0]);
        assert_eq!(of_step(&mut loads, &scheme(0.0), 0, 1).balance[0], 7.0);
    }

    #[test]
    fn the_wrong_kind_of_force_is_taken_with_a_warning() {
        let plan =
            Plan { takes: vec![FieldSpec::nodal(name::FORCE, 3, Sampling::Means)], ..Default::default() };
        let (mut loads, warnings) =
            Loads::new(Needs::of(Some(scheme(0.0))), &plan, &mesh(), 3).expect("is fine");
        assert!(warnings[0].message.contains("lag of half a window"), "{warnings:?}");
        loads.begin_part(&[5.0, 0.0, 0.0], 0, &Shown::all(1), &[0.0; 3]);
        assert_eq!(of_step(&mut loads, &scheme(0.0), 0, 1).end[0], 5.0);
    }

    #[test]
    fn transposing_there_and_back_changes_nothing() {
        let nodal: Vec<f64> = (0..12).map(f64::from).collect();
        let (mut by_component, mut back) = (vec![0.0; 12], vec![0.0; 12]);
        to_component_major(&nodal, 4, &mut by_component);
        assert_eq!(by_component[..4], [0.0, 3.0, 6.0, 9.0]);
        to_node_major(&by_component, 4, &mut back);
        assert_eq!(nodal, back);
    }
}

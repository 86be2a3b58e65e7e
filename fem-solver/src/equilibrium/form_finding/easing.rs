//! Easing: rings that go slack over a range of forces in place of at a corner, and that range made smaller until it is none.
//!
//! A net of slack rings has no stiffness until its rings are drawn out, and then at once a great one. Newton's iteration finds
//! out ring by ring which of them are taut. Where the force of each goes to zero gradually, all have some stiffness, and
//! the tangent says beforehand which become taut. The rest shape under a wide range is a good start for a narrower one.
//!
//! It is the search alone that knows of it: the last iterations are those of the structure itself, and what elements
//! remember stays that of the start but for rotations, so that no brake and no ring yields by being eased.

use crate::equilibrium::form_finding::Search;
use crate::equilibrium::newton::{Failure, Problem};
use crate::model::Model;

/// Widest range of forces, relative to the sum of the dead load; each next one is [`NARROWER`] times as wide, down to [`LAST`].
const FIRST: f64 = 0.1;
const NARROWER: f64 = 0.1;
const LAST: f64 = 1e-7;
/// Most Newton iterations for a range where the scene does not say.
const MOST_OF_RANGE: u32 = 60;
/// Residual, relative to the forces, at which the next range follows.
const TOLERANCE: f64 = 1e-6;

/// A structure whose rings go slack gradually.
pub struct Easing<'a> {
    model: &'a Model,
    /// The same with rings that are eased.
    soft: Model,
    pressures: Vec<f64>,
    most: Option<u32>,
}

impl<'a> Easing<'a> {
    /// Of `model`, if it has rings. `most` bounds the Newton iterations of each approach.
    pub fn of(model: &'a Model, most: Option<u32>) -> Option<Self> {
        let rings = model.elements.iter().any(|element| element.eased(0.0).is_some());
        rings.then(|| Self { model, soft: model.clone(), pressures: model.pressures_at_start(), most })
    }

    /// Move `u` [m], and of its history the rotations, close to a rest shape. Returns whether it comes to rest under the
    /// narrowest range.
    pub fn approach(
        &mut self,
        search: &mut Search,
        u: &mut [f64],
        history: &mut [f64],
    ) -> Result<bool, Failure> {
        let load: f64 = self.model.load_at_start(u).iter().map(|p| p.abs()).sum();
        let (mut range, mut at_rest) = (FIRST * load, false);
        while range > LAST * load {
            self.ease(range);
            at_rest = self.solve(search, u, history)?;
            search.newton.internal.elements.advance_rotations(&self.model.elements, u, history);
            range *= NARROWER;
        }
        Ok(at_rest)
    }

    /// Let every ring go slack over the forces `range` [N].
    fn ease(&mut self, range: f64) {
        for element in &mut self.soft.elements {
            if let Some(eased) = element.eased(range) {
                *element = eased;
            }
        }
    }

    /// Newton from `u`; returns whether it comes to rest. `u` is where it ends, at rest or not: each of its steps goes downhill.
    fn solve(&self, search: &mut Search, u: &mut [f64], history: &[f64]) -> Result<bool, Failure> {
        let most = self.most.unwrap_or(MOST_OF_RANGE);
        let zero = vec![0.0; u.len()];
        let problem = Problem::of_rest(self.model, &zero, history, &self.pressures);
        match search.solve_stage(&self.soft, &problem, (TOLERANCE, most), u) {
            Ok(info) => {
                search.done.unstable = info.unstable;
                Ok(true)
            }
            Err(failure @ Failure::Stopped(_)) => Err(failure),
            Err(_) => Ok(false),
        }
    }
}

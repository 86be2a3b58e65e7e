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

/// Widest range of forces, relative to the sum of the dead load; each next one is [`NARROWER`] times as wide, down to [`LAST`].
const FIRST: f64 = 0.1;
const NARROWER: f64 = 0.1;
const LAST: f64 = 1e-7;
/// Most Newton iterations for a range where the scene does not say.
const MOST_OF_RANGE: u32 = 60;
/// Residual, relative to the forces, at which the next range follows.
const TOLERANCE: f64 = 1e-6;

/// Move `u` [m], and of its history the rotations, close to a rest shape. Returns whether it comes to rest under the narrowest
/// range, which it does not where there are no rings.
pub fn approach(search: &mut Search, u: &mut [f64], history: &mut [f64]) -> Result<bool, Failure> {
    let model = search.wanted.model;
    if !model.elements.iter().any(|element| element.regularised(0.0).is_some()) {
        return Ok(false);
    }
    let (mut soft, zero, pressures) = (model.clone(), vec![0.0; u.len()], model.pressures_at_start());
    let limits = (TOLERANCE, search.wanted.most.unwrap_or(MOST_OF_RANGE));
    let load: f64 = model.load_at_start(u).iter().map(|p| p.abs()).sum();
    let (mut range, mut at_rest) = (FIRST * load, false);
    while range > LAST * load {
        for element in &mut soft.elements {
            if let Some(eased) = element.regularised(range) {
                *element = eased;
            }
        }
        // Wherever Newton ends, at rest or not: each of its steps goes downhill.
        let problem = Problem::of_rest(&soft, &zero, history, &pressures);
        at_rest = match search.solve_stage(&problem, limits, u) {
            Ok(info) => {
                search.done.unstable = info.unstable;
                true
            }
            Err(failure @ Failure::Stopped(_)) => return Err(failure),
            Err(_) => false,
        };
        search.newton.internal.elements.advance_rotations(&model.elements, u, history);
        range *= NARROWER;
    }
    Ok(at_rest)
}

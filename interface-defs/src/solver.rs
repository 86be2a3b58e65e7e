//! The trait of a solver: a function of (committed state, input) over one time window.

use crate::message::{Fault, Hello, Plan, Progress, Ready, Statistics};
use crate::selection::Selection;

/// One time window, as the coupler asks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Number of the window, from 1.
    pub number: u64,
    /// Coupling iteration in the window, from 1.
    pub iteration: u32,
    /// Start [s]. Never sum up lengths: this is the time.
    pub start: f64,
    /// Length [s].
    pub length: f64,
}

impl Window {
    /// End [s].
    pub fn end(&self) -> f64 {
        self.start + self.length
    }

    /// Number of equal steps, none longer than `step` [s]: `ceil(length / step)`, at least 1.
    ///
    /// A length that is a multiple of `step` but for rounding counts as that multiple.
    pub fn steps(&self, step: f64) -> usize {
        ((self.length / step) * (1.0 - 1e-9)).ceil().max(1.0) as usize
    }
}

/// Receives progress while a solver prepares; an error means that the solver must stop.
pub type OnProgress<'a> = &'a mut dyn FnMut(Progress) -> Result<(), Fault>;

/// A solver. After [`Solver::hello`] and [`Solver::prepare`] it has two verbs: solve and commit.
pub trait Solver {
    /// Who this is and what it can do. Depends on nothing but the scene.
    fn hello(&self) -> Hello;

    /// Build everything: form finding, search trees, factorisation patterns. May take long; report
    /// progress at least once a second. A structure offers its interface mesh in [`Ready::mesh`];
    /// a contact solver works on the mesh of [`Plan::partner_mesh`] and returns the mesh that it uses.
    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault>;

    /// Advance the committed state over `window` under `input` (layout: fields of [`Plan::takes`])
    /// and write the answer to `output` (fields of [`Plan::gives`], then three numbers per gauge).
    ///
    /// May be called any number of times for a window, and always starts from the committed state:
    /// equal input gives equal bytes, whatever was solved in between.
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault>;

    /// Accept the last solve: its end is the committed state from now on.
    fn commit(&mut self) -> Result<(), Fault>;

    /// From now on fields of place node, line, face and pair are laid out for this selection; `None`: for the whole interface
    /// mesh. A structure fills in the pairs of nodes that its tangent couples, a contact solver finds them there. Asked only
    /// of solvers that declare [`crate::message::capability::SELECTS`].
    fn select(&mut self, selection: Option<&mut Selection>) -> Result<(), Fault> {
        match selection {
            None => Ok(()),
            Some(_) => {
                Err(Fault::broken("it was asked for a part of the interface mesh, which it has not declared"))
            }
        }
    }

    /// Of a structure that selects: write the committed state to `output`, laid out as an answer.
    fn committed(&mut self, output: &mut [f64]) -> Result<(), Fault> {
        let _ = output;
        Err(Fault::broken("it was asked for its committed state, which it has not declared"))
    }

    /// Of a contact solver that selects: write to `nodes`, ascending, those of the interface mesh that it must see in windows
    /// from the committed state on; `input` is a request for all nodes, for the window to come. Once a rock has moved so far
    /// that they are too few, [`Solver::solve`] errs with [`crate::message::FaultKind::Beyond`].
    fn reach(&mut self, window: &Window, input: &[f64], nodes: &mut Vec<u32>) -> Result<(), Fault> {
        let _ = (window, input, nodes);
        Err(Fault::broken("it was asked for its reach, which it has not declared"))
    }

    /// Whether nothing more will happen, so that a run of this solver alone may end before its time. It
    /// follows from the committed state.
    fn has_ended(&self) -> bool {
        false
    }

    /// Whether nothing of it will move any more unless the other solver moves it, as far as its last window shows: all stands
    /// still, and no load or support will change. A coupled run ends where both solvers are at rest.
    fn is_at_rest(&self) -> bool {
        false
    }

    /// The committed state, with all else that the next answers follow from, to the last bit; what belongs to it in files of
    /// results is on the disk when this returns. Asked only of solvers that declare [`crate::message::capability::CHECKPOINT`].
    fn save(&mut self) -> Result<Vec<u8>, Fault> {
        Err(Fault::broken("it was asked for its state to keep, which it has not declared"))
    }

    /// Before [`Solver::prepare`]: go on from a state that [`Solver::save`] gave for the same scene. `prepare` then answers as it
    /// did at t = 0, and leaves the solver in that state, and its files of results as they were then.
    fn resume(&mut self, state: &[u8]) -> Result<(), Fault> {
        let _ = state;
        Err(Fault::broken("it was asked to go on from a state that was kept, which it has not declared"))
    }

    /// The run is over. Write what is left to write and say what was done.
    fn finish(&mut self) -> Result<Statistics, Fault>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_takes_the_fewest_equal_steps_not_longer_than_the_limit() {
        let window = |length| Window { number: 1, iteration: 1, start: 0.0, length };
        assert_eq!(window(1e-3).steps(1e-3), 1);
        assert_eq!(window(3e-4).steps(1e-4), 3);
        assert_eq!(window(1e-3 * (1.0 + 1e-6)).steps(1e-3), 2);
        assert_eq!(window(1e-9).steps(1.0), 1);
        assert_eq!(window(0.1 + 0.2).steps(0.1), 3);
    }
}

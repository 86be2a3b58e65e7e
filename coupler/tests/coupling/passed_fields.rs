//! Fields that the coupler does not know: what both solvers name alike is passed on, at the right time.

use super::common::{Load, Node, Sphere};
use coupler::coupling::{Committed, Coupling, Observer};
use coupler::settings::{CouplingSettings, Scheme};
use coupler::side::Side;
use in_process::InProcess;
use interface_defs::solver::OnProgress;
use interface_defs::*;

/// A solver that also gives one field of one number per node, and takes another one.
struct Talker<S> {
    inner: S,
    gives: FieldSpec,
    takes: FieldSpec,
    /// Where the inner solver's fields end in an answer.
    fields: usize,
    answer: Vec<f64>,
    /// Number given in the window at hand.
    say: fn(&Window) -> f64,
    /// Windows, with what came in them.
    heard: Vec<(u64, f64)>,
    last: (u64, f64),
}

impl<S> Talker<S> {
    fn new(inner: S, gives: FieldSpec, takes: FieldSpec, say: fn(&Window) -> f64) -> Self {
        Self { inner, gives, takes, fields: 0, answer: Vec::new(), say, heard: Vec::new(), last: (0, 0.0) }
    }
}

impl<S: Solver> Solver for Talker<S> {
    fn hello(&self) -> Hello {
        let mut hello = self.inner.hello();
        hello.gives.push(self.gives.clone());
        hello.takes.push(self.takes.clone());
        hello
    }
    fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
        let mut inner = plan.clone();
        let (gives, takes) = (inner.gives.pop(), inner.takes.pop());
        assert_eq!((gives.as_ref(), takes.as_ref()), (Some(&self.gives), Some(&self.takes)), "agreed");
        let mut ready = self.inner.prepare(&inner, progress)?;
        self.fields = Layout::new(&inner.gives, &ready.mesh, 0).len();
        self.answer = ready.initial.clone();
        ready.initial.insert(self.fields, -1.0);
        Ok(ready)
    }
    fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
        let (heard, input) = input.split_last().expect("the field comes last");
        self.last = (window.number, *heard);
        self.inner.solve(window, input, &mut self.answer)?;
        let (fields, gauges) = self.answer.split_at(self.fields);
        output[..fields.len()].copy_from_slice(fields);
        output[fields.len()] = (self.say)(window);
        output[fields.len() + 1..].copy_from_slice(gauges);
        Ok(())
    }
    fn commit(&mut self) -> Result<(), Fault> {
        self.heard.push(self.last);
        self.inner.commit()
    }
    fn finish(&mut self) -> Result<Statistics, Fault> {
        self.inner.finish()
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

fn talkers(place: Place) -> (InProcess<Talker<Sphere>>, InProcess<Talker<Node>>) {
    let field = |name: &str| FieldSpec { place, ..FieldSpec::nodal(name, 1, Sampling::Once) };
    let node = Node::new(1.0, 1.0, Load::Mean, 0.0, 0.1);
    let sphere = Sphere::new(1.0, 1.0, false, 1, 0.05, 0.0);
    // The number of the window and of its iteration, so that a later one differs from an earlier.
    let say = |window: &Window| window.number as f64 + 0.01 * f64::from(window.iteration);
    let structure = Talker::new(node, field("warmth"), field("wear"), say);
    let contact = Talker::new(sphere, field("wear"), field("warmth"), say);
    (InProcess::new("dem", contact), InProcess::new("fem", structure))
}

#[test]
fn a_field_comes_from_the_structure_as_committed_and_from_the_contact_solver_at_once() {
    let (mut dem, mut fem) = talkers(Place::Node);
    let settings = CouplingSettings {
        tolerance: 1e-12,
        absolute_tolerance: 1e-14,
        ..CouplingSettings::new(Scheme::Strong, 0.2)
    };
    let mut coupling = Coupling::new(settings, 1.0, &mut dem, &mut fem);
    coupling.run(&mut Silent, &mut |_| Ok(())).expect("a good run");
    coupling.finish().expect("a good end");
    let (dem, fem) = (dem.solver.heard, fem.solver.heard);
    assert_eq!((dem.len(), fem.len()), (5, 5));
    assert_eq!(dem[0], (1, -1.0), "the initial answer");
    let mut iterations = 0;
    for (dem, fem) in dem.windows(2).zip(&fem) {
        // What the structure gave last in the window before: that of the last iteration, as the contact solver's own was.
        assert_eq!(dem[1].1, fem.1, "windows {} and {}", dem[0].0, dem[1].0);
        assert_eq!(fem.1.floor(), fem.0 as f64);
        iterations = iterations.max((100.0 * fem.1.fract()).round() as u32);
    }
    assert!(iterations > 1, "windows were repeated");
}

#[test]
fn a_field_of_nodes_between_meshes_that_differ_is_refused() {
    struct Moved(Talker<Sphere>);
    impl Solver for Moved {
        fn hello(&self) -> Hello {
            self.0.hello()
        }
        fn prepare(&mut self, plan: &Plan, progress: OnProgress) -> Result<Ready, Fault> {
            let mut ready = self.0.prepare(plan, progress)?;
            ready.mesh.coordinates[0] += 1.0;
            Ok(ready)
        }
        fn solve(&mut self, window: &Window, input: &[f64], output: &mut [f64]) -> Result<(), Fault> {
            self.0.solve(window, input, output)
        }
        fn commit(&mut self) -> Result<(), Fault> {
            self.0.commit()
        }
        fn finish(&mut self) -> Result<Statistics, Fault> {
            self.0.finish()
        }
    }
    let run = |place| {
        let (dem, mut fem) = talkers(place);
        let mut dem = InProcess::new("dem", Moved(dem.solver));
        let mut settings = CouplingSettings::new(Scheme::Weak, 0.1);
        settings.mapping = Some(coupler::mapping::AnyMapper::NearestNeighbor(Default::default()));
        let mut coupling = Coupling::new(settings, 0.2, &mut dem, &mut fem);
        coupling.run(&mut Silent, &mut |_| Ok(())).map_err(|e| e.to_string())
    };
    let message = run(Place::Node).expect_err("other nodes");
    assert!(
        message.contains("\"warmth\"") && message.contains("the meshes of both solvers differ"),
        "{message}"
    );
    assert_eq!(run(Place::Whole), Ok(()), "a number for the whole interface needs no nodes");
}

//! The coupling loop on two masses, for which everything is known: V-C1 and V-C2.

use super::common::{Load, Node, Sphere};
use coupler::acceleration::{Aitken, AnyAcceleration, Constant, NoRelaxation};
use coupler::coupling::{Committed, Coupling, CouplingError, Iteration, Observer};
use coupler::settings::{CouplingSettings, OnNoConvergence, Scheme};
use coupler::side::Side;
use in_process::InProcess;
use interface_defs::Diagnostic;

/// Keeps what a test looks at.
#[derive(Default)]
struct Record {
    /// Node displacement and imbalance of energy after each window.
    rows: Vec<(f64, f64)>,
    spans: Vec<(f64, f64)>,
    iterations: Vec<u32>,
    residuals: Vec<f64>,
    defects: Vec<(f64, f64)>,
    warnings: Vec<Diagnostic>,
}

impl Observer for Record {
    fn prepared(&mut self, _: &Side, _: &Side, warnings: &[Diagnostic]) -> Result<(), Diagnostic> {
        self.warnings.extend_from_slice(warnings);
        Ok(())
    }

    fn iteration(&mut self, iteration: &Iteration) -> Result<(), Diagnostic> {
        self.residuals.push(iteration.residual.displacement);
        Ok(())
    }

    fn committed(&mut self, c: &Committed) -> Result<(), Diagnostic> {
        self.rows.push((c.fem[15], c.balance.imbalance));
        self.spans.push((c.span.start, c.span.length));
        self.iterations.push(c.iterations);
        self.defects.push((c.balance.structure_work, c.balance.mesh_work));
        Ok(())
    }
}

struct Run {
    record: Record,
    node: Node,
    sphere: Sphere,
    outcome: Result<(), CouplingError>,
    counts: coupler::coupling::Counts,
}

fn run(settings: CouplingSettings, end: f64, sphere: Sphere, node: Node) -> Run {
    let (mut dem, mut fem) = (InProcess::new("dem", sphere), InProcess::new("fem", node));
    let mut record = Record::default();
    let mut coupling = Coupling::new(settings, end, &mut dem, &mut fem);
    // Schemes that fail are shown here on purpose.
    coupling.limits.energy_error = f64::INFINITY;
    let outcome = coupling.run(&mut record, &mut |_| Ok(()));
    let counts = coupling.counts;
    coupling.finish().unwrap();
    Run { record, node: fem.solver, sphere: dem.solver, outcome, counts }
}

fn weak(window: f64, predictor: u32) -> CouplingSettings {
    CouplingSettings { predictor, ..CouplingSettings::new(Scheme::Weak, window) }
}

fn strong(window: f64) -> CouplingSettings {
    CouplingSettings {
        tolerance: 1e-13,
        absolute_tolerance: 1e-14,
        max_iterations: 50,
        ..CouplingSettings::new(Scheme::Strong, window)
    }
}

/// Speed ratio of a free mass after its contact with a fixed spring, k = m = 1, at `omega` = w dt.
/// `phase` shifts the first touch inside a window.
fn rebound(settings: CouplingSettings, load: Load, omega: f64, phase: f64) -> f64 {
    let node = Node::new(1.0, 0.0, load, -phase * omega, 1.0);
    // Half a period of contact, and some windows of flight for the last load to be used up.
    let end = omega * ((std::f64::consts::PI * 1.5 / omega).ceil() + 10.0);
    let run = run(settings, end, Sphere::new(f64::INFINITY, 1.0, false, 1, 0.0, 0.0), node);
    run.outcome.unwrap();
    assert!(run.node.state[0] < 0.0, "it has left the contact");
    -run.node.state[1]
}

/// V-C1: the table has six decimals.
#[test]
fn the_lagged_weak_scheme_gains_the_energy_of_v_c1() {
    let table = [(0.02, 1.031928), (0.05, 1.081711), (0.1, 1.170555), (0.2, 1.361083), (0.4, 1.824363)];
    for (omega, expected) in table {
        let ratio = rebound(weak(omega, 0), Load::End, omega, 0.0);
        assert!((ratio - expected).abs() < 1e-6, "{ratio} vs {expected} at {omega}");
    }
}

/// V-C1: the mean force as mid-step load does the exact work, at any phase of touch and lift-off.
/// Tolerance: some 1e2 windows, each converged to 1e-14 m of 1 m amplitude, times the stiffness 1.
#[test]
fn a_converged_strong_scheme_with_mean_force_returns_all_energy() {
    for omega in [0.05, 0.4, 1.5] {
        for phase in [0.0, 0.3, 0.77] {
            let ratio = rebound(strong(omega), Load::Mean, omega, phase);
            assert!((ratio - 1.0).abs() < 1e-10, "{ratio} at {omega}, phase {phase}");
        }
    }
}

/// V-C1: the end force errs at lift-off inside a step, within the printed bounds.
#[test]
fn a_converged_strong_scheme_with_end_force_errs_only_at_lift_off() {
    for (omega, bound) in [(0.02, 1.6e-5), (0.05, 1.6e-4), (0.1, 1.2e-3), (0.2, 3.6e-3)] {
        for phase in [0.1, 0.5, 0.9] {
            let ratio = rebound(strong(omega), Load::End, omega, phase);
            assert!((ratio - 1.0).abs() < 1.1 * bound, "{ratio} at {omega}, phase {phase}");
        }
    }
}

/// Growth per window of the contact mode: of y = x1 - u2, whose second differences obey a recurrence of
/// two terms once the other modes are gone (they decay, or are free motion and drop out of y's differences).
fn growth(settings: CouplingSettings, load: Load, omega: f64, mass: f64, steps: u32) -> f64 {
    let windows = 60;
    let end = omega * f64::from(windows);
    let node = Node::new(1.0, 0.0, load, 0.0, 1.0);
    let run = run(settings, end, Sphere::new(mass, 1.0, true, steps, 0.0, 0.0), node);
    run.outcome.unwrap();
    // A sphere of 1e6 node masses hardly moves: the node alone is the contact mode.
    let u: Vec<f64> = run.record.rows.iter().map(|row| row.0).collect();
    let d: Vec<f64> = u.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
    let [a, b, c, e] = d[d.len() - 4..] else { unreachable!() };
    // d[n+1] = p d[n] - q d[n-1] from two equations; |A| = sqrt(q).
    ((b * e - c * c) / (b * b - a * c)).abs().sqrt()
}

/// V-C2, columns "lagged" and "linear predictor", m1 = 1e6 m2 (the motion of the heavy sphere shows at 1e-6).
#[test]
fn weak_schemes_grow_as_v_c2_says() {
    let lagged =
        [(0.05, 1.00124766), (0.1, 1.00496302), (0.2, 1.01943179), (0.5, 1.10740295), (1.0, 1.3294835)];
    let linear =
        [(0.1, 1.00001256), (0.2, 1.00020396), (0.5, 1.00867899), (1.0, 1.13846242), (1.5, 1.45350772)];
    for (predictor, table) in [(0, lagged), (1, linear)] {
        for (omega, expected) in table {
            let a = growth(weak(omega, predictor), Load::End, omega, 1e6, 20);
            assert!((a - expected).abs() < 2e-6, "{a} vs {expected} at {omega}, predictor {predictor}");
        }
    }
}

/// V-C2: linear predictor and mean force, one pass: neutral up to O = 2, violent beyond.
#[test]
fn the_weak_scheme_with_mean_force_is_neutral_up_to_its_limit() {
    for omega in [0.1, 0.5, 1.0, 1.9] {
        let a = growth(weak(omega, 1), Load::Mean, omega, 1e9, 20);
        assert!((a - 1.0).abs() < 1e-6, "{a} at {omega}");
    }
    assert!(growth(weak(2.1, 1), Load::Mean, 2.1, 1e9, 20) > 1.5);
}

/// V-C2: the strong scheme is neutral with end force (Newmark) and mean force (midpoint), at any O.
#[test]
fn converged_strong_schemes_are_neutral() {
    for omega in [0.1, 0.5, 1.0, 2.0] {
        for load in [Load::End, Load::Mean] {
            let a = growth(strong(omega), load, omega, 1e9, 20);
            assert!((a - 1.0).abs() < 1e-6, "{a} at {omega}, {load:?}");
        }
    }
}

/// The mean force in the place of the end force grows even when converged, and
/// `energy_error` (the imbalance) is what shows it: the contact's energy grows by |A|^2 a window.
#[test]
fn a_mean_force_in_the_place_of_the_end_force_shows_in_the_balance_of_energy() {
    for (omega, expected) in [(0.1, 1.00248451), (0.2, 1.00975816), (0.5, 1.05438798), (1.0, 1.16106424)] {
        let a = growth(strong(omega), Load::MeanAtEnd, omega, 1e9, 20);
        assert!((a - expected).abs() < 1e-5, "{a} vs {expected} at {omega}");
        let node = Node::new(1.0, 0.0, Load::MeanAtEnd, 0.0, 1.0);
        let windows = 40.0;
        let run = run(strong(omega), omega * windows, Sphere::new(1e9, 1.0, true, 20, 0.0, 0.0), node);
        let gain = run.record.rows.iter().map(|row| row.1).fold(0.0, f64::max);
        let energy = 0.5 * (expected.powf(2.0 * windows) - 1.0);
        assert!(gain > 0.5 * energy && gain < 2.0 * energy, "gain {gain}, growth predicts {energy}");
    }
}

/// Plain Gauss-Seidel converges for O < 2 and not beyond; constant 0.5 fails at O = 5;
/// Aitken needs three evaluations wherever.
#[test]
fn iterations_converge_where_the_compliance_says() {
    let once = |acceleration: AnyAcceleration, omega: f64| {
        let settings = CouplingSettings {
            acceleration,
            tolerance: 0.0,
            absolute_tolerance: 1e-10,
            max_iterations: 400,
            on_no_convergence: OnNoConvergence::Stop,
            ..CouplingSettings::new(Scheme::Strong, omega)
        };
        let node = Node::new(1.0, 0.0, Load::Mean, 0.0, 1.0);
        let run = run(settings, omega, Sphere::new(f64::INFINITY, 1.0, true, 1, 0.0, 0.0), node);
        run.outcome.ok().map(|()| run.record.iterations[0])
    };
    let none = || AnyAcceleration::NoRelaxation(NoRelaxation {});
    assert!(once(none(), 1.9).is_some());
    assert!(once(none(), 2.1).is_none());
    assert!(once(AnyAcceleration::Constant(Constant { factor: 0.5 }), 1.9).is_some());
    assert!(once(AnyAcceleration::Constant(Constant { factor: 0.5 }), 5.0).is_none());
    for omega in [0.5, 1.0, 1.9, 5.0, 20.0] {
        let iterations = once(AnyAcceleration::Aitken(Aitken::default()), omega).unwrap();
        assert!(iterations <= 4, "{iterations} at {omega}");
    }
}

/// The booked difference of the two sides is mean force times residual; both are known here.
#[test]
fn work_is_booked_on_both_sides_and_solvers_agree_with_it() {
    let settings = CouplingSettings {
        absolute_tolerance: 5e-2,
        tolerance: 0.0,
        ..CouplingSettings::new(Scheme::Strong, 0.3)
    };
    let run = run(
        settings,
        6.0,
        Sphere::new(50.0, 4.0, false, 8, 0.1, -0.5),
        Node::new(1.0, 0.3, Load::Mean, 0.0, 0.2),
    );
    run.outcome.unwrap();
    let (structure, mesh) = *run.record.defects.last().unwrap();
    assert!((structure - mesh).abs() > 1e-6, "a loose tolerance leaves a defect");
    // Sums of twenty windows with works of order 1.
    assert!((structure - run.node.received()).abs() < 1e-13, "{structure}");
    assert!((mesh + run.sphere.received()).abs() < 1e-13, "{mesh}");
}

#[test]
fn a_failed_window_is_halved_and_the_full_length_returns() {
    let mut node = Node::new(1.0, 1.0, Load::Mean, 0.0, 1.0);
    node.longest = 0.03;
    let settings = CouplingSettings { ..weak(0.1, 1) };
    let run = run(settings, 0.2, Sphere::new(1.0, 1.0, false, 1, 10.0, 0.0), node);
    run.outcome.unwrap();
    assert!(run.record.spans.iter().all(|(_, length)| *length == 0.025));
    assert_eq!(run.record.spans.len(), 8);
    // The full window and its half at first; a half again after four quarters.
    assert_eq!(run.counts.halved, 3, "a length that failed is tried again after a while");
    assert_eq!(run.counts.short, 8);
}

#[test]
fn halving_ends_at_the_smallest_window_with_the_reason() {
    let mut node = Node::new(1.0, 1.0, Load::Mean, 0.0, 1.0);
    node.longest = 1e-9;
    let run = run(weak(0.1, 1), 0.2, Sphere::new(1.0, 1.0, false, 1, 10.0, 0.0), node);
    let message = run.outcome.unwrap_err().to_string();
    assert!(message.contains("fem: ") && message.contains("too long"), "{message}");
    assert!(message.contains("min_window"), "{message}");
    assert_eq!(run.counts.halved, 6, "64 = 2^6");
}

/// A constant factor of 0.5 multiplies the residual by 1 - 0.5 (1 + 25/4) = -2.6 in each iteration, in half the window by
/// -0.28. Three growths are enough to see the first.
#[test]
fn a_window_that_diverges_is_halved_after_three_growths() {
    let omega = 5.0;
    let settings = CouplingSettings {
        acceleration: AnyAcceleration::Constant(Constant { factor: 0.5 }),
        tolerance: 0.0,
        absolute_tolerance: 1e-10,
        ..CouplingSettings::new(Scheme::Strong, omega)
    };
    let glued = Sphere::new(f64::INFINITY, 1.0, true, 1, 0.0, 0.0);
    let run = run(settings, omega, glued, Node::new(1.0, 0.0, Load::Mean, 0.0, 1.0));
    run.outcome.unwrap();
    assert_eq!((run.counts.diverged, run.counts.halved, run.counts.windows), (1, 1, 2));
    let of_two: u32 = run.record.iterations.iter().sum();
    assert_eq!(run.counts.iterations, 4 + u64::from(of_two));
}

/// Every measure that is named must pass; the force is compared with the iteration before.
#[test]
fn a_measure_that_is_named_is_what_is_judged() {
    let iterations = |measure: &str| {
        let mut settings = strong(1.0);
        settings.acceleration = AnyAcceleration::Constant(Constant { factor: 0.3 });
        (settings.max_iterations, settings.on_no_convergence) = (40, OnNoConvergence::Stop);
        let table: toml::Table = toml::from_str(measure).unwrap();
        settings.measure = table["measure"].clone().try_into().unwrap();
        let node = Node::new(1.0, 0.3, Load::Mean, 0.0, 1.0);
        let run = run(settings, 3.0, Sphere::new(50.0, 4.0, true, 8, 0.1, -0.5), node);
        run.outcome.map(|()| run.record.iterations)
    };
    let of = |field: &str, absolute: f64| {
        iterations(&format!("[[measure]]\nfield = \"{field}\"\ntolerance = 0.0\nabsolute = {absolute:e}"))
    };
    let (loose, tight) = (of("force", 1e-2).unwrap(), of("force", 1e-11).unwrap());
    assert!(loose.iter().zip(&tight).all(|(a, b)| a < b), "{loose:?} {tight:?}");
    assert!(loose.iter().all(|n| *n >= 2), "the first force has none before it: {loose:?}");
    let coarse = of("displacement", 1e3).unwrap();
    assert_eq!(coarse, [1, 1, 1]);
    let both = iterations(
        "[[measure]]\nfield = \"displacement\"\nnorm = \"rms\"\ntolerance = 0.0\nabsolute = 1e3\n\
         [[measure]]\nfield = \"force\"\ntolerance = 0.0\nabsolute = 1e-11",
    );
    assert_eq!(both.unwrap(), tight, "the stricter of two decides");
    let message = of("force", 1e-30).unwrap_err().to_string();
    assert!(message.contains("force residual") && message.contains("1.0e-30 N"), "{message}");
}

/// A solver that keeps what it computed, committed or not, has moved on when its window is halved: the run ends instead.
#[test]
fn no_window_is_halved_under_a_solver_that_cannot_repeat() {
    let mut node = Node::new(1.0, 1.0, Load::Mean, 0.0, 1.0);
    (node.longest, node.repeatable) = (0.03, false);
    let run = run(weak(0.1, 1), 0.2, Sphere::new(1.0, 1.0, false, 1, 10.0, 0.0), node);
    let message = run.outcome.unwrap_err().to_string();
    for word in ["fem: 0.1 s is too long", "fem (node)", "`repeats`", "clause 5.8"] {
        assert!(message.contains(word), "\"{word}\" is not in: {message}");
    }
    assert_eq!((run.counts.halved, run.node.solves), (0, 1), "nothing was asked again");
}

#[test]
fn more_samples_per_window_cost_no_second_contract() {
    // Declared samples are the most a solver can do: these can do one.
    let settings = CouplingSettings { samples: 4, ..weak(0.1, 1) };
    let run = run(
        settings,
        0.2,
        Sphere::new(1.0, 1.0, false, 1, 10.0, 0.0),
        Node::new(1.0, 1.0, Load::Mean, 0.0, 1.0),
    );
    let message = run.outcome.unwrap_err().to_string();
    assert!(message.contains("4 per window"), "{message}");
}

/// Nobody maps to the nearest node without a word; a mapping that is named says how far it reaches.
#[test]
fn meshes_that_differ_need_a_mapping_that_is_named_and_a_bad_one_is_reported() {
    let of = |mapping: Option<&str>| {
        let settings = CouplingSettings {
            mapping: mapping.map(|name| toml::from_str(&format!("type = \"{name}\"")).unwrap()),
            ..weak(0.1, 1)
        };
        let mut sphere = Sphere::new(1.0, 1.0, false, 1, 10.0, 0.0);
        sphere.beside = 0.2;
        run(settings, 0.2, sphere, Node::new(1.0, 1.0, Load::Mean, 0.0, 1.0))
    };
    let refused = of(None).outcome.unwrap_err();
    let CouplingError::Failed(failure) = &refused else { panic!("{refused}") };
    assert!(failure.is_input() && refused.to_string().contains("coupling.mapping.type"), "{refused}");
    for name in ["nearest_neighbor", "nearest_projection", "rbf"] {
        let run = of(Some(name));
        run.outcome.unwrap();
        let [warning] = &run.record.warnings[..] else { panic!("{name}: {:?}", run.record.warnings) };
        let distance = format!("by {:.3e} m", 0.2 * f64::sqrt(3.0));
        assert!(warning.message.contains("1 of 1 nodes") && warning.message.contains(&distance), "{warning}");
    }
}

/// It says that nothing touches for a second, in every window: long windows in which something touches begin anew.
#[test]
fn a_free_time_that_is_wrong_costs_windows_and_ends_where_a_true_one_does() {
    for settings in [weak(1e-2, 0), strong(1e-2)] {
        let ended = |free: f64| {
            let settings = CouplingSettings { flight_window: 0.1, ..settings.clone() };
            let mut sphere = Sphere::new(1.0, 100.0, false, 1, 0.23, -1.0);
            sphere.free = free;
            run(settings, 2.0, sphere, Node::new(1.0, 1.0, Load::Mean, 0.0, 0.0))
        };
        let (true_one, wrong) = (ended(0.0), ended(1.0));
        assert!(wrong.outcome.is_ok() && true_one.outcome.is_ok(), "{:?}", wrong.outcome.err());
        assert!(wrong.record.spans.len() < true_one.record.spans.len(), "no window was longer");
        // The node takes steps of a window: beside contact they differ. The sphere is pushed in windows of equal length.
        let [a, b] = [&true_one, &wrong].map(|run| run.sphere.state[1]);
        assert!(a > -0.9 && (a - b).abs() < 1e-9, "{a} {b}");
    }
}

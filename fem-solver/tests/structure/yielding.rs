//! Posts that yield: plastic moment, buckling, dissipation, unloading; in statics, implicit and explicit steps.

use crate::common::{Run, coupled_plan};
use interface_defs::Sampling;
use interface_defs::diagnostic::code;
use interface_defs::solver::Solver;
use std::f64::consts::PI;
use toolkit::alloc::allocations;

/// Plastic moment of HE 160 B in S235 [N m]: 354 cm3 of the table.
const PLASTIC: f64 = 354e-6 * 235e6;

/// A row of `count` beams of a section from the origin along x, `length` long.
fn row(
    section: &str,
    (count, length): (usize, f64),
    bow: f64,
    structure: &str,
    fem: &str,
    more: &str,
) -> String {
    let nodes: Vec<[f64; 3]> = (0..=count)
        .map(|i| i as f64 / count as f64)
        .map(|x| [x * length, 0.0, bow * (PI * x).sin()])
        .collect();
    let cells: Vec<[usize; 2]> = (0..count).map(|i| [i, i + 1]).collect();
    format!(
        r#"
end_time = 5.0
[structure]
nodes = {nodes:?}
{structure}
[[structure.parts]]
name = "post"
element = "beam"
cells = {cells:?}
{section}
[fem]
{fem}
[[gauge]]
name = "post"
group = "post"
quantity = "bending_moment"
[[gauge]]
name = "post"
group = "post"
quantity = "utilisation"
{more}
"#
    )
}

const HE_160_B: &str = "section = \"HE 160 B\"\nsteel = \"S235\"";

/// The schemes; a post of 2 m is bent over 1 s or more, which is slow for it.
const SCHEMES: [(&str, f64); 3] = [
    ("integrator = \"static\"", 1e-2),
    ("integrator = \"generalized_alpha\"\ntime_step = 1e-3", 1e-2),
    ("integrator = \"central_difference\"", 1e-2),
];

/// What a post of 2 m does whose node `driven` is moved aside by 0.1 of its `lever` within 1 s, and back by 5 mm per m2 of it.
struct Bent {
    most: f64,
    moment: f64,
    work: f64,
    dissipated: f64,
    stored: f64,
    /// Slope of the way back [N/m].
    unloading: f64,
    utilisation: f64,
    yields: String,
}

fn bent(count: usize, driven: &str, lever: f64, held: &str, fem: (&str, f64)) -> Bent {
    let (far, back) = (0.1 * lever, 5e-3 * lever * lever);
    let motion = format!(
        "motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, {far:?}], [1.2, 0.0, 0.0, {:?}]]",
        far - back
    );
    let structure = format!("damping = 20.0\nsupports = [{held}, {{ {driven}, {motion} }}]");
    let gauge = format!("[[gauge]]\nname = \"load\"\nat = [{lever:?}, 0.0, 0.0]\nquantity = \"force\"\n");
    let text = row(HE_160_B, (count, 2.0), 0.0, &structure, fem.0, &gauge);
    let mut run = Run::alone(&text, fem.1);
    let (mut most, mut moment, mut utilisation) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut forces = Vec::new();
    for _ in 0..120 {
        run.step(fem.1, &[]);
        let ending = if count > 1 { "_max" } else { "" };
        let of_all = |quantity: &str| run.value(&format!("post_{quantity}{ending}"));
        forces.push(run.value("load_fz"));
        most = most.max(run.value("load_fz"));
        moment = moment.max(of_all("bending_moment"));
        utilisation = utilisation.max(of_all("utilisation"));
    }
    let statistics = run.solver.finish().expect("ends");
    let warning = statistics.warnings.iter().find(|w| w.code == code::YIELD);
    Bent {
        most,
        moment,
        unloading: (forces[102] - forces[118]) / (0.8 * back),
        utilisation,
        work: -run.value("energy_supports_fem"),
        dissipated: run.value("energy_dissipated_fem"),
        stored: run.value("energy_stored_fem"),
        yields: warning.map_or(String::new(), |w| w.message.clone()),
    }
}

#[test]
fn a_post_bears_its_plastic_moment_and_the_work_beyond_is_dissipated() {
    let clamped = "{ nodes = [0], rotations = \"xyz\" }";
    // Braced where it is struck: under a plastic hinge nothing else holds an H against tilting.
    let simple = "{ nodes = [0], rotations = \"x\" }, { nodes = [4], directions = \"yz\" }";
    let tip = |node: usize| format!("nodes = [{node}], directions = \"z\"");
    let braced = "nodes = [2], directions = \"yz\", rotations = \"xz\"".to_owned();
    let bending = 2.1e11 * 2492e-8;
    let mut all = Vec::new();
    for fem in SCHEMES {
        // Lever, force at the plastic moment and elastic stiffness of a cantilever and of a beam on two supports.
        for (count, held, driven, lever, limit, stiffness) in [
            (1, clamped, tip(1), 2.0, PLASTIC / 2.0, 3.0 / 8.0 * bending),
            (4, clamped, tip(4), 2.0, PLASTIC / 2.0, 3.0 / 8.0 * bending),
            (4, simple, braced.clone(), 1.0, 2.0 * PLASTIC, 6.0 * bending),
        ] {
            let bent = bent(count, &driven, lever, held, fem);
            let what = format!("{count} beams, {lever} m, {fem:?}");
            println!(
                "{what}: {:.1} of {limit:.1} N, {:.1} N m, {:.4}, work {:.2} J, dissipated {:.2} J, stored {:.2} J, back {:.4e} of \
                 {stiffness:.4e} N/m; {}",
                bent.most,
                bent.moment,
                bent.utilisation,
                bent.work,
                bent.dissipated,
                bent.stored,
                bent.unloading,
                bent.yields
            );
            assert!((bent.moment / PLASTIC - 1.0).abs() < 0.03, "{what}: {} N m", bent.moment);
            assert!((bent.most / limit - 1.0).abs() < 0.03, "{what}: {} N, {limit} N", bent.most);
            assert!((bent.utilisation - 1.0).abs() < 0.03, "{what}: {}", bent.utilisation);
            let books = (bent.stored + bent.dissipated) / bent.work;
            assert!((books - 1.0).abs() < 0.01, "{what}: {books}");
            assert!((bent.unloading / stiffness - 1.0).abs() < 0.05, "{what}: {} N/m", bent.unloading);
            assert!(
                bent.yields.contains("of post") && bent.yields.contains("plastic strain"),
                "{}",
                bent.yields
            );
            all.push([bent.most, bent.dissipated]);
        }
    }
    for (own, statics) in all.iter().zip(all[..3].iter().cycle()) {
        assert!(own.iter().zip(statics).all(|(a, b)| (a / b - 1.0).abs() < 0.01), "{all:?}");
    }
}

#[test]
fn a_bowed_column_bears_the_load_of_euler_and_then_yields() {
    // 6 m of HE 160 B about its weak axis, bowed by 1e-4 of its length; its end is pushed in, slowly until it has buckled.
    let (length, count) = (6.0, 8);
    let euler = PI * PI * 2.1e11 * 889.2e-8 / (length * length);
    let section = format!("{HE_160_B}\nup = [0.0, 1.0, 0.0]");
    let structure = format!(
        "supports = [{{ nodes = [0], rotations = \"x\" }}, {{ nodes = [{count}], directions = \"xyz\", motion = [[0.0, 0.0, 0.0, 0.0], \
         [4.0, -0.004, 0.0, 0.0], [5.0, -0.1, 0.0, 0.0]] }}]"
    );
    let mut loads = Vec::new();
    for fem in ["integrator = \"static\"", "integrator = \"generalized_alpha\"\ntime_step = 2e-3"] {
        let damped = format!("damping = 2.0\n{structure}");
        let gauge = format!("[[gauge]]\nname = \"end\"\nat = [{length:?}, 0.0, 0.0]\nquantity = \"force\"\n");
        let text = row(&section, (count, length), length / 1e4, &damped, fem, &gauge);
        let mut run = Run::alone(&text, 2e-3);
        let forces: Vec<f64> = (0..2500)
            .map(|_| {
                run.step(2e-3, &[]);
                run.value("end_fx").abs()
            })
            .collect();
        let most = forces[..2000].iter().copied().fold(0.0, f64::max);
        let last = forces[2300..].iter().sum::<f64>() / 200.0;
        println!("{fem}: {most:.1} N of {euler:.1} N, then {last:.1} N");
        assert!((most / euler - 1.0).abs() < 0.03, "{most} N, {euler} N, {fem}");
        assert!(last < 0.7 * most && run.value("energy_dissipated_fem") > 0.0, "{last} N of {most} N, {fem}");
        loads.push(most);
    }
    assert!((loads[1] / loads[0] - 1.0).abs() < 0.01, "{loads:?}");
}

#[test]
fn what_a_section_needs_and_what_it_says_twice_is_said() {
    let refused = |section: &str| {
        let held = "supports = [{ nodes = [0], rotations = \"xyz\" }]";
        let text = row(section, (1, 2.0), 0.0, held, "", "");
        let options = toolkit::program::Options { out: None, shortcuts: true };
        let solver = fem_solver::FemSolver::new(&crate::common::scene(&text), &options);
        solver.err().expect("must be refused").to_string()
    };
    for (section, words) in [
        ("section = \"HE 150 B\"\nsteel = \"S235\"", "HE 100 A to HE 300 A"),
        ("section = \"HE 160 B\"\narea = 5e-3\nsteel = \"S235\"", "leave out area"),
        ("section = \"HE 160 B\"", "beams need a modulus"),
        ("steel = \"S235\"", "a `section` by name"),
        ("area = 5e-3\ninertia = [2e-5, 9e-6]\nsteel = \"S235\"", "depends on its shape"),
        ("section = \"HE 160 B\"\nsteel = \"S236\"", "S236"),
        ("section = \"HE 160 B\"\nsteel = \"S235\"\nyield_stress = 0.0", "it must lie above 0"),
    ] {
        let message = refused(section);
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_beam_without_inertia_is_a_bar_and_next_to_no_density_is_a_word_in_statics_alone() {
    // A tripod of one bar and two springs is stable without moments.
    let held = "supports = [{ nodes = [0] }]\nsprings = [{ nodes = [1], stiffness = [0.0, 1e3, 1e3] }]\n\
                loads = [{ nodes = [1], force = [1000.0, 0.0, 0.0] }]";
    let bar = "young = 2e11\narea = 1e-4\ninertia = [0.0, 0.0]";
    let more = "[[gauge]]\nname = \"bar\"\ngroup = \"post\"\nquantity = \"tension\"\n";
    let of = |density: &str, fem: &str| {
        let text = row(&format!("{bar}\ndensity = {density}"), (1, 2.0), 0.0, held, fem, more);
        // There is no beam left of which moments or strength could be asked.
        let cut = text.find("[[gauge]]").expect("gauges");
        let last = text.rfind("[[gauge]]").expect("gauges");
        format!("{}{}", &text[..cut], &text[last..])
    };
    let mut run = Run::alone(&of("0.001", "integrator = \"static\""), 0.1);
    run.step(0.1, &[]);
    assert!((run.value("bar_tension") - 1000.0).abs() < 1e-3, "{} N", run.value("bar_tension"));
    let options = toolkit::program::Options { out: None, shortcuts: true };
    let solver = fem_solver::FemSolver::new(&crate::common::scene(&of("0.001", "")), &options);
    let error = solver.err().expect("must be refused").to_string();
    assert!(error.contains("lighter than air"), "{error}");
}

#[test]
fn a_window_in_which_a_post_yields_depends_on_its_start_and_its_force_alone_and_allocates_nothing() {
    let clamped = "supports = [{ nodes = [0], rotations = \"xyz\" }]";
    for fem in ["time_step = 2e-5", "integrator = \"generalized_alpha\"\ntime_step = 2e-4"] {
        let text = row(HE_160_B, (4, 2.0), 0.0, clamped, fem, "");
        let mut run = Run::with(&text, coupled_plan(1e-3, Sampling::Means, 1, 1));
        let force = |amount: f64| {
            let mut force = vec![0.0; run.force_len];
            force[3 * 4 + 2] = amount;
            force
        };
        let (a, b) = (force(2e5), force(-3e5));
        (0..20).for_each(|_| run.step(1e-3, &a));
        run.solve(1e-3, &a).expect("solved");
        let first = run.output.clone();
        run.solve(1e-3, &b).expect("solved");
        assert_ne!(first, run.output);
        let before = allocations();
        run.solve(1e-3, &a).expect("solved");
        assert_eq!(allocations(), before, "{fem}");
        assert!(first.iter().zip(&run.output).all(|(x, y)| x.to_bits() == y.to_bits()), "{fem}");
        assert!(run.value("energy_dissipated_fem") > 1e3, "{} J", run.value("energy_dissipated_fem"));
        assert!(run.balance().abs() < 0.01 * run.value("energy_received_fem"), "{} J", run.balance());
    }
}

/// When an element tore [s], under which force [N], and what it lost [J].
fn fractured(section: &str, supports: &str, fem: (&str, f64)) -> (f64, f64, f64) {
    let structure = format!("form_finding = \"none\"\ndamping = 20.0\nsupports = [{supports}]");
    let mut run = Run::alone(&row(section, (1, 1.0), 0.0, &structure, fem.0, ""), fem.1);
    (0..110).for_each(|_| run.step(fem.1, &[]));
    let torn = run.solver.finish().expect("ends").torn.expect("it can tear");
    assert_eq!((torn[0].part.as_str(), torn[0].elements), ("post", 1));
    assert!(run.balance().abs() < 1e-2 * run.value("energy_dissipated_fem"), "{fem:?}: {}", run.balance());
    (torn[0].first, torn[0].force, run.value("energy_dissipated_fem"))
}

#[test]
fn a_post_fractures_where_a_fibre_reaches_its_strain_in_tension_and_in_bending() {
    // Perfectly plastic; 5 cm per m in 1 s, and a turn of both ends by 0.8 rad: strains of half the height times 1.6 rad/m.
    let section = format!("{HE_160_B}\nhardening_modulus = 0.0\nfracture_strain = 0.04");
    let drawn = "{ nodes = [0], rotations = \"xyz\" },
        { nodes = [1], rotations = \"xyz\", motion = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.05, 0.0, 0.0]] }";
    let turning = |x: f64, angle: f64| {
        format!(
            "through = [{x:?}, 0.0, 0.0], axis = [0.0, 1.0, 0.0], angles = [[0.0, 0.0], [1.0, {angle:?}]]"
        )
    };
    let bent = format!(
        "{{ nodes = [0], rotations = \"xyz\", turning = {{ {} }} }},
         {{ nodes = [1], directions = \"yz\", rotations = \"xyz\", turning = {{ {} }} }}",
        turning(0.0, 0.8),
        turning(1.0, -0.8)
    );
    let yield_force = 5425e-6 * 235e6;
    for fem in SCHEMES {
        let (time, force, lost) = fractured(&section, drawn, fem);
        assert!((time / 0.8 - 1.0).abs() < 0.02, "{fem:?}: {time}");
        assert!((force / yield_force - 1.0).abs() < 0.01, "{fem:?}: {force}");
        let work = yield_force * (0.04 - 0.5 * 235e6 / 2.1e11);
        assert!((lost / work - 1.0).abs() < 0.03, "{fem:?}: {lost} of {work}");
        // The outermost fibre lies within the flange, from 67 to 80 mm.
        let (time, force, lost) = fractured(&section, &bent, fem);
        let strain = |height: f64| 1.6 * time * height;
        assert!(strain(0.067) < 0.04 && strain(0.08) > 0.04, "{fem:?}: {time}");
        assert!(force.abs() < 0.02 * yield_force, "{fem:?}: {force}");
        assert!((lost / (1.6 * time * PLASTIC) - 1.0).abs() < 0.06, "{fem:?}: {lost}");
    }
}

#[test]
fn a_fracture_strain_without_fibres_or_below_the_yield_point_is_refused() {
    for (section, words) in [
        (
            "young = 2.1e11\narea = 5e-3\ninertia = [1e-5, 1e-5]\nfracture_strain = 0.1",
            "only fibres have strains",
        ),
        ("section = \"HE 160 B\"\nsteel = \"S235\"\nfracture_strain = 1e-3", "above 0.00112"),
        ("section = \"HE 160 B\"\nsteel = \"S235\"\nfracture_strain = 15.0", "15 % is 0.15"),
    ] {
        let text = row(section, (1, 1.0), 0.0, "supports = [{ nodes = [0] }]", "", "");
        let options = toolkit::program::Options::default();
        let error = fem_solver::FemSolver::new(&crate::common::scene(&text), &options).err().expect(words);
        assert!(error.to_string().contains(words), "{error}");
    }
}

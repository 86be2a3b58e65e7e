//! What tore, in sentences.

use crate::common::{Run, off};
use interface_defs::solver::Solver;
use interface_defs::verdict::Torn;

/// Three ropes that hang from supports, each with a mass on it that falls into it; each breaks above its own force.
fn ropes(strengths: [f64; 3]) -> String {
    let part = |name: &str, cells: &str, strength: f64| {
        format!(
            "[[structure.parts]]\nname = \"{name}\"\nelement = \"cable\"\ncells = {cells}\nyoung = 1e9\narea = 1e-4\n\
             density = 7850.0\nrupture_force = {strength:?}\n"
        )
    };
    format!(
        r#"
end_time = 1.0
gravity = [0.0, 0.0, -10.0]
[structure]
form_finding = "none"
nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [2.0, 0.0, -1.0]]
supports = [{{ nodes = [0, 1, 2] }}]
masses = [{{ nodes = [3, 4, 5], mass = 100.0 }}]
{}{}[fem]
time_step = 1e-5
"#,
        part("pair", "[[0, 3], [1, 4]]", strengths[0].min(strengths[1])),
        part("single", "[[2, 5]]", strengths[2]),
    )
}

fn verdict(run: &mut Run) -> Vec<String> {
    torn(run).expect("something can tear").iter().map(ToString::to_string).collect()
}

fn torn(run: &mut Run) -> Option<Vec<Torn>> {
    run.solver.finish().expect("is prepared").torn
}

#[test]
fn what_tore_is_said_by_part_with_place_time_and_force() {
    // Let go at once, 100 kg on k = E A / L = 1e5 N/m: N = m g (1 - cos w t), w = sqrt(1000) 1/s, up to 2 kN.
    let mut run = Run::alone(&ropes([1500.0, 1500.0, 1e6]), 1e-3);
    (0..100).for_each(|_| run.step(1e-3, &[]));
    let said = verdict(&mut run);
    assert_eq!(said.len(), 1, "{said:?}");
    let place = "the first under 1.5 kN: element 0 of pair, (0.0 0.0 0.0) to (0.0 0.0 -1.0)";
    assert!(
        said[0].starts_with("2 elements of `pair` tore from 0.06") && said[0].ends_with(place),
        "{said:?}"
    );
    // The rope weighs 0.8 kg and stiffens by 1.5 % at its strain: of cos(w t) = 1 - 1.5 the time to some per cent.
    let first = &torn(&mut run).expect("something can tear")[0];
    assert!(first.elements == 2 && first.last >= first.first && off(first.force, 1500.0) < 0.05, "{first:?}");
    let time = first.first;
    assert!(off(time, (1.0_f64 - 1.5).acos() / 1000.0_f64.sqrt()) < 0.02, "{time}");

    let mut run = Run::alone(&ropes([1e6, 1e6, 1500.0]), 1e-3);
    (0..100).for_each(|_| run.step(1e-3, &[]));
    let said = verdict(&mut run);
    let place = "under 1.5 kN: element 0 of single, (2.0 0.0 0.0) to (2.0 0.0 -1.0)";
    assert!(
        said.len() == 1 && said[0].starts_with("`single` tore at 0.06") && said[0].ends_with(place),
        "{said:?}"
    );
}

#[test]
fn that_nothing_tore_is_said_where_something_could() {
    let whole = ropes([1e6, 1e6, 1e6]);
    let mut run = Run::alone(&whole, 1e-3);
    run.step(1e-3, &[]);
    assert_eq!(torn(&mut run), Some(Vec::new()));
    let mut run = Run::alone(&whole.replace("rupture_force = 1000000.0\n", ""), 1e-3);
    run.step(1e-3, &[]);
    assert_eq!(torn(&mut run), None);
}

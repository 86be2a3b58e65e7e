use super::*;
use crate::config::Config;
use crate::element::tests::checks::random;
use crate::linear_algebra::lanes::longest_displacement;
use toolkit::scene::Scene;

/// A net whose rows are longer than a block, of rings that break.
fn net() -> Model {
    let text = r#"
end_time = 1.0
gravity = [0.0, 0.0, -9.81]
[structure]
generator = { type = "ring_net", rings = [10, 5], diameter = 0.3 }
[[structure.parts]]
name = "net"
element = "ring"
diameter = 0.3
perimeter = 0.94
perimeter_stiffness = 8e6
bending_stiffness = 5e4
mass = 0.5
rupture_force = 5e4
"#;
    let scene = Scene::from_text("net.toml", text).unwrap_or_else(|e| panic!("{e}"));
    let config = Config::of(&scene).unwrap_or_else(|e| panic!("{e}"));
    Model::build(&scene, &config).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn rings_in_blocks_pull_break_and_store_what_they_do_one_by_one() {
    let model = net();
    let elements = &model.elements;
    let (mut alone, mut blocks) = (Assembly::new(&model), Assembly::with_blocks(&model));
    let mut history: Vec<f64> = elements.iter().flat_map(|e| e.start_history()).collect();
    let mut noise = random(3);
    let velocity: Vec<f64> = (0..model.dof_count()).map(|_| 2.8e-3 * noise()).collect();
    let mut start = vec![0.0; velocity.len()];
    let mut broken = 0;
    for step in 0..60 {
        // Out and back: rings unload, too.
        let forth = if step < 50 { 0.5 } else { -0.5 };
        let middle: Vec<f64> = start.iter().zip(&velocity).map(|(u, v)| u + forth * v).collect();
        let end: Vec<f64> = start.iter().zip(&velocity).map(|(u, v)| u + 2.0 * forth * v).collect();
        let mut forces = [vec![0.0; start.len()], vec![0.0; start.len()]];
        let mut after = history.clone();
        let [one, several] = &mut forces;
        let at = ((&start[..], &middle[..]), longest_displacement(&start, &middle, model.node_count()));
        let largest = alone.subtract_and_advance(elements, at, &mut history, one);
        let same = blocks.subtract_and_advance(elements, at, &mut after, several);
        assert_eq!((largest.to_bits(), &history), (same.to_bits(), &after), "step {step}");
        assert_eq!(alone.broken, blocks.broken);
        assert_eq!(one, several);
        broken += alone.broken.len();
        let stored = alone.energy(elements, &end, &history);
        assert_eq!(stored, blocks.energy(elements, &end, &history));
        // Of each second step with the energies.
        if step % 2 == 0 {
            blocks.begin_reading();
        }
        for (i, element) in elements.iter().enumerate() {
            let mut lines = [0.0; 4];
            element.line_forces(alone.gather(i, &end), blocks.history(i, &history), &mut lines);
            let tension = if lines[0].is_nan() { 0.0 } else { lines[0] };
            assert_eq!(blocks.ring_tensions(i, &end, &history)[0].to_bits(), tension.to_bits());
        }
        start = end;
    }
    assert!(broken > 5 && broken < elements.len() - 5, "{broken} of {}", elements.len());
}

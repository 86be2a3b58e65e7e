use super::*;
use interface_defs::{FieldSpec, InterfaceMesh, Items, Layout, Place, Sampling, name};

/// Two nodes, the first held, a wire of 100 N/m between them along x, and a mass of 0.25 kg: a frequency of 20 rad/s.
fn net() -> (LocalNet, LocalFields, Layout) {
    let mesh = InterfaceMesh { coordinates: vec![0.0; 6], lines: vec![[0, 1]], ..Default::default() };
    let spec = |name, sampling| FieldSpec { samples: 2, ..FieldSpec::nodal(name, 3, sampling) };
    let once =
        |name, components, place| FieldSpec { place, ..FieldSpec::nodal(name, components, Sampling::Once) };
    let mut takes = Layout::new(
        &[
            spec(name::DISPLACEMENT, Sampling::FromStart),
            spec(name::VELOCITY, Sampling::FromStart),
            spec(name::FORCE, Sampling::Means),
            once(name::LOCAL_FORCE, 3, Place::Node),
            once(name::LOCAL_FORCE_RATE, 3, Place::Node),
            once(name::LOCAL_TANGENT, 9, Place::Pair),
        ],
        &mesh,
        0,
    );
    let mut selection = Selection::new(&mesh);
    selection.set(&mesh, [0, 1].into_iter()).expect("nodes of the mesh");
    selection.pairs.extend([[0, 0], [0, 1], [1, 1]]);
    takes.resize(&Items { pairs: 3, ..selection.items() });
    let mut fields = LocalFields::default();
    fields.lay_out(&takes, &Layout::default());
    let mut net = LocalNet::default();
    net.select(&selection, &[Vector3::zeros(), Vector3::x()], Some(&[0.0, 4.0]));
    (net, fields, takes)
}

/// Advance a window of `length` [s] in `steps` steps under the force `pull` [N] on the second node along x; displacement and
/// velocity of that node, and the work of the force.
fn advance(input: &[f64], (length, steps): (f64, usize), pull: f64) -> (f64, f64, f64) {
    let (mut net, fields, takes) = net();
    let h = length / steps as f64;
    net.begin(&fields, input, h, &[]);
    let mut work = 0.0;
    for number in 0..steps {
        let step = NetStep { number, steps, h, segments: 2 };
        let at = |name, s| takes.sample(name, Sampling::FromStart, s).expect("in the plan");
        let s = number / (steps / 2);
        let ends = [
            at(name::DISPLACEMENT, s),
            at(name::DISPLACEMENT, s + 1),
            at(name::VELOCITY, s),
            at(name::VELOCITY, s + 1),
        ];
        net.to_middle(step, ends, input);
        net.force[3] = pull;
        work += net.kick(step, &fields, input);
    }
    let (position, velocity) = net.node(1);
    (position.x - 1.0, velocity.x, work)
}

fn tangent(takes: &Layout, input: &mut [f64]) {
    let at = takes.sample(name::LOCAL_TANGENT, Sampling::Once, 0).expect("in the plan").start;
    (input[at], input[at + 9], input[at + 18]) = (100.0, -100.0, 100.0);
}

/// `m u'' = F - K (u - u_0) + f` has the solution `(F + f) / K (1 - cos w t)` from rest. Halving the steps quarters the error;
/// with sixteen steps whose `K d` is applied as one impulse it is at most twice that of one step as long as they are together, and of the same order.
#[test]
fn a_pulled_node_swings_as_a_mass_on_a_spring_with_second_order() {
    let (_, _, takes) = net();
    let mut input = vec![0.0; takes.len()];
    tangent(&takes, &mut input);
    let residual = takes.sample(name::LOCAL_FORCE, Sampling::Once, 0).expect("in the plan").start;
    input[residual + 3] = 2.0;
    let (w, time): (f64, f64) = (20.0, 0.2);
    let exact = 0.05 * (1.0 - (w * time).cos());
    let errors = [4, 8, 128, 256].map(|steps| {
        let (u, v, work) = advance(&input, (time, steps), 3.0);
        assert!((work - 3.0 * u).abs() < 1e-12, "a constant force does force times displacement");
        (u - exact).abs().max((v / w - 0.05 * (w * time).sin()).abs())
    });
    assert!(errors[1] < 0.3 * errors[0], "{errors:?}");
    assert!(errors[2] < 2.0 * errors[1] && errors[3] < 0.3 * errors[2], "{errors:?}");
}

/// A reference that is the solution already, with the force under which it is: nothing is left to move.
#[test]
fn under_the_force_of_the_reference_a_node_stays_on_it() {
    let (_, _, takes) = net();
    let mut input = vec![0.0; takes.len()];
    tangent(&takes, &mut input);
    for s in 0..3 {
        let t = 0.005 * s as f64;
        let at = |name| takes.sample(name, Sampling::FromStart, s).expect("in the plan").start + 3;
        input[at(name::DISPLACEMENT)] = 0.03 * (1.0 - (20.0 * t).cos());
        input[at(name::VELOCITY)] = 0.6 * (20.0 * t).sin();
    }
    for s in 0..2 {
        input[takes.sample(name::FORCE, Sampling::Means, s).expect("in the plan").start + 3] = 3.0;
    }
    let (u, v, _) = advance(&input, (0.01, 8), 3.0);
    assert!(
        (u - 0.03 * (1.0 - 0.2_f64.cos())).abs() < 1e-15 && (v - 0.6 * 0.2_f64.sin()).abs() < 1e-13,
        "{u} {v}"
    );
    let (other, ..) = advance(&input, (0.01, 8), 4.0);
    let off = 0.01 * (1.0 - 0.2_f64.cos());
    assert!(
        (other - u - off).abs() < 0.02 * off,
        "one newton more moves it as from rest: {}",
        (other - u) / off
    );
}

#[test]
fn a_held_node_follows_its_reference_whatever_pulls() {
    let (mut net, fields, takes) = net();
    let input = vec![0.0; takes.len()];
    net.begin(&fields, &input, 1e-3, &[]);
    let step = NetStep { number: 0, steps: 2, h: 1e-3, segments: 2 };
    net.to_middle(step, [0..6, 6..12, 18..24, 24..30], &input);
    net.force[0] = 1e6;
    net.kick(step, &fields, &input);
    assert_eq!(net.node(0).0, Vector3::zeros());
}

//! What is torn touches nothing any more: a sphere falls through where a wire has broken.

use tests::{Bench, Ended};

/// A sphere of 10 kg on a wire of two segments between two springs; the segment under it breaks above `strength` [N].
fn scene(strength: f64, scheme: &str, selection: &str) -> String {
    format!(
        r#"
end_time = 0.1
gravity = [0.0, 0.0, -9.81]

[[rock]]
name = "sphere"
position = [0.1, 0.0, 0.0505]
velocity = [0.0, 0.0, -3.0]
mass = 10.0
shape = {{ type = "sphere", radius = 0.05 }}

[[contact]]
law = "linear"
stiffness = 1e6
restitution = 1.0

[dem]
contact_selection = "{selection}"

[structure]
nodes = [[-0.2, 0.0, 0.0], [0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]
springs = [{{ nodes = [0, 2], stiffness = [1e6, 1e6, 1e6] }}]
cable = {{ young = 1e10, area = 1e-4, density = 7850.0 }}
form_finding = "none"
[[structure.parts]]
name = "strong"
element = "cable"
cells = [[0, 1]]
young = 1e10
area = 1e-4
density = 7850.0
prestress = 1e6
[[structure.parts]]
name = "weak"
element = "cable"
cells = [[1, 2]]
young = 1e10
area = 1e-4
density = 7850.0
prestress = 1e6
rupture_force = {strength:?}

[fem]
time_step = 1e-5

[coupling]
scheme = "{scheme}"
time_window = 1e-5
"#
    )
}

fn run(bench: &Bench, out: &str, text: &str) -> Ended {
    bench.done(&bench.scene(text), out, &[])
}

/// When the wire broke [s]; none if it has not.
fn broke(ended: &Ended) -> Option<f64> {
    ended.summary()["torn"]
        .as_array()
        .expect("it can")
        .iter()
        .filter_map(|t| t["first"].as_f64())
        .reduce(f64::min)
}

#[test]
fn a_sphere_falls_freely_through_a_torn_wire_and_bounces_off_a_whole_one() {
    let bench = Bench::new();
    for (at, (scheme, selection)) in
        [("weak", "nearest"), ("strong", "nearest"), ("weak", "continuous")].into_iter().enumerate()
    {
        let torn = run(&bench, &format!("torn{at}"), &scene(5e3, scheme, selection));
        let at_rupture = broke(&torn).expect("breaks");
        assert!(at_rupture > 0.0 && at_rupture < 0.02, "{at_rupture}");
        let (time, speed) = (torn.column("time_s"), torn.column("sphere_vz_m_per_s"));
        // Told with the window in which it broke: from the next one on nothing acts but weight.
        let first = time.iter().position(|t| *t > at_rupture + 1.1e-5).expect("goes on");
        let (t0, v0) = (time[first], speed[first]);
        for (t, v) in time.iter().zip(&speed).skip(first) {
            assert!((v - v0 + 9.81 * (t - t0)).abs() < 1e-9, "{scheme}: {v} at {t}");
        }
        assert!(v0 < -1.0, "{v0}");
        // The books close: what the wire and the contact held when they parted is booked as lost.
        assert!(torn.measure("energy_error") < 1e-3, "{scheme}: {}", torn.measure("energy_error"));
        let whole = run(&bench, &format!("whole{at}"), &scene(1e9, scheme, selection));
        assert!(
            broke(&whole).is_none()
                && whole.column("sphere_vz_m_per_s").into_iter().fold(0.0, f64::max) > 1.0
        );
    }
}

//! No acceleration allocates memory once its first window has begun.

use coupler::acceleration::AnyAcceleration;
use toolkit::alloc::allocations;

/// Forty iterations in each of three windows, on sets of nodes that change in number and kind.
#[test]
fn no_acceleration_allocates_after_the_start_of_its_first_window() {
    let nodes: Vec<u32> = (0..12).collect();
    let most = 2 * 3 * nodes.len();
    let (mut x, mut residual) = (vec![0.0; most], vec![0.0; most]);
    for name in AnyAcceleration::NAMES {
        let mut method: AnyAcceleration = toml::from_str(&format!("type = \"{name}\"")).unwrap();
        method.start_window(most);
        let before = allocations();
        for window in 0..3 {
            method.start_window(most);
            for iteration in 0..40_usize {
                let nodes = &nodes[iteration % 3..12 - iteration % 5];
                let len = 6 * nodes.len();
                for (i, (x, r)) in x.iter_mut().zip(&mut residual).enumerate() {
                    (*x, *r) = (i as f64, (1.0 + (iteration * 7 + i * 3 + window) as f64).sin());
                }
                method.update(&mut x[..len], &residual[..len], nodes);
            }
        }
        assert_eq!(allocations() - before, 0, "{name}");
    }
}

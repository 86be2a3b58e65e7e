//! A window allocates nothing after the first.

use crate::common::{Run, WALENSTADT, coupled_plan};
use interface_defs::Sampling;
use toolkit::alloc::allocations;

#[test]
fn no_window_allocates_after_the_first_whatever_the_scheme_and_the_length() {
    let gauges = "[[gauge]]\nname = \"centre\"\nat = [1.95, 1.95, 0.0]\nquantity = \"displacement\"\n\
                  [[gauge]]\nname = \"wire\"\nat = [1.95, 1.95, 0.0]\nquantity = \"tension\"\n\
                  [[gauge]]\nname = \"edge\"\ngroup = \"x_min\"\nquantity = \"force\"\n";
    for (fem, sampling) in [
        ("[fem]\ntime_step = 2e-5\n", Sampling::Means),
        ("[fem]\nintegrator = \"generalized_alpha\"\n", Sampling::Means),
        ("[fem]\nintegrator = \"newmark\"\n", Sampling::AtEnds),
    ] {
        let mut run = Run::with(&format!("{WALENSTADT}{gauges}{fem}"), coupled_plan(1e-4, sampling, 2, 4));
        let mut force = vec![0.0; run.force_len];
        run.step(1e-4, &force);
        for node in [350, 363, 364, 365] {
            force[3 * node + 2] = -50.0;
        }
        run.step(1e-4, &force);
        for (window, length) in [1e-4, 5e-5, 2.5e-5, 1e-4].into_iter().enumerate() {
            let before = allocations();
            for _ in 0..3 {
                run.solve(length, &force).expect("converges");
            }
            run.commit(length);
            assert_eq!(allocations() - before, 0, "window {window} with {fem}");
        }
    }
}

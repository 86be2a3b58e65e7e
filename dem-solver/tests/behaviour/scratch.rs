use crate::bench::*;
#[test]
fn scratch() {
    for (orientation, name) in [("[1,0,0,0]", "flat"), ("[0.92, 0.25, 0.2, 0.1]", "corner"), ("[0.98,0.1,0.05,0.2]", "tilted")] {
        for (law, lname) in [("restitution = 1.0", "elastic"), ("restitution = 0.9\nfriction = 0.4", "user")] {
            for h in [5e-5, 1e-5, 2e-6] {
                let more = format!("position = [0.013, -0.021, 0.35]\nvelocity = [0.5, 0.2, -3.0]\norientation = {orientation}");
                let scene = format!("end_time = 0.1\ngravity = [0.0, 0.0, -9.81]\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\n{law}\n[dem]\ntime_step = {h:e}\n", cube(64, &more));
                let mut mesh = net(20, 0.15, 0.0);
                mesh.masses = vec![f64::INFINITY; mesh.node_count()];
                let mut bench = Setup::new(scene, mesh).build();
                let (k, e0) = (bench.value("energy_kinetic_dem"), bench.energy());
                let mut worst = 0.0_f64; let mut last = 0.0; let mut jumps = 0.0_f64; let mut prev = 0.0;
                for _ in 0..(0.1 / h) as usize { bench.advance(h); last = (bench.energy() - e0) / k; worst = worst.max(last.abs()); jumps = jumps.max((last - prev as f64).abs()); prev = last; }
                println!("{name:7} {lname:8} h {h:.0e}: worst {worst:.2e} last {last:.2e} largest jump {jumps:.2e} vz {}", bench.velocity().z);
            }
        }
    }
}

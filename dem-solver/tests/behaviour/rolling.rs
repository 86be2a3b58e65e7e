//! Rolling and sliding on planes, and contact across the borders of elements.

use crate::bench::{Bench, Setup, fixed_plane, net, plane, sphere};
use interface_defs::{InterfaceMesh, Sampling};
use nalgebra::Vector3;

const G: f64 = 9.81;

struct Ball {
    radius: f64,
    density: f64,
    young: f64,
    poisson: f64,
}

impl Ball {
    fn mass(&self) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * self.radius.powi(3) * self.density
    }

    /// Overlap at which a plane carries `force`.
    fn overlap(&self, force: f64) -> f64 {
        let modulus = self.young / (1.0 - self.poisson * self.poisson);
        (force / (4.0 / 3.0 * modulus * self.radius.sqrt())).powf(2.0 / 3.0)
    }

    /// On a plane at z = 0 whose slope (degrees) is put into gravity; `offset` in x and y.
    fn scene(&self, slope: f64, friction: f64, more: &str, restitution: f64, step: f64) -> String {
        let (sin, cos) = slope.to_radians().sin_cos();
        format!(
            "end_time = 5.0\ngravity = [{:?}, 0.0, {:?}]\n{}[[contact]]\nlaw = \"hertz_mindlin\"\nyoung = {:?}\n\
             poisson = {:?}\nrestitution = {restitution:?}\nfriction = {friction:?}\n[dem]\ntime_step = {step:?}\n",
            G * sin,
            -G * cos,
            sphere(self.radius, self.density, more),
            self.young,
            self.poisson
        )
    }
}

const STONE: Ball = Ball { radius: 0.2, density: 2500.0, young: 1e9, poisson: 0.2 };

/// Position, speed along x, spin about y after `time`, started at static overlap; and its lever arm.
fn roll(slope: f64, friction: f64, speed: f64, time: f64) -> (f64, f64, f64, f64) {
    let overlap = STONE.overlap(STONE.mass() * G * slope.to_radians().cos());
    let height = STONE.radius - overlap;
    let more = format!("position = [-9.0, 0.03, {height:?}]\nvelocity = [{speed:?}, 0.0, 0.0]");
    let mut bench = Setup::new(STONE.scene(slope, friction, &more, 0.5, 1e-4), fixed_plane(24.0, 1)).build();
    for _ in 0..(time / 1e-3).round() as usize {
        bench.advance(1e-3);
    }
    (bench.value("rock_x") + 9.0, bench.velocity().x, bench.spin().y, height)
}

/// V-D8. The lever arm is r = R - d, with which the exact figures are those of a body of gyration
/// 0.4 R^2 / r^2; d/R = 6e-4 here, and the limit d -> 0 is that of the table within 0.57 d/R.
/// Tolerance: the tangential spring lags by f / k_t, some 1e-5 m.
#[test]
fn a_ball_launched_without_spin_slides_until_it_rolls() {
    let (x, v, w, r) = roll(0.0, 0.3, 2.0, 0.5);
    let gyration = 0.4 * (0.2 / r).powi(2);
    let rolling = 2.0 / (0.3 * G * (1.0 + 1.0 / gyration));
    let end = 2.0 - 0.3 * G * rolling;
    let distance = (2.0 + end) / 2.0 * rolling + end * (0.5 - rolling);
    assert!((v - end).abs() < 2e-5 && (w * r - end).abs() < 2e-5, "{v} {} {end}", w * r);
    assert!((x - distance).abs() < 5e-5, "{x} {distance}");
    let table = 0.332_854_854 + 1.428_571_43 * (0.5 - 0.194_165_332);
    assert!((v / 1.428_571_43 - 1.0).abs() < 1e-3 && (x / table - 1.0).abs() < 1e-3);
}

#[test]
fn a_ball_rolls_down_a_slope_that_holds_it_and_slips_down_one_that_does_not() {
    for (slope, friction, x2, w2) in
        [(30.0, 0.5, 7.00714286, 35.0357143), (20.0, 0.3, 2.396584 * 2.0, 2.396584 * 10.0)]
    {
        let (x, v, w, r) = roll(slope, friction, 0.0, 2.0);
        let a = G * f64::to_radians(slope).sin() / (1.0 + 0.4 * (0.2 / r).powi(2));
        assert!((v / (2.0 * a) - 1.0).abs() < 2e-5, "{v} {}", 2.0 * a);
        assert!((x / (2.0 * a) - 1.0).abs() < 2e-5, "{x}");
        assert!((w * r / v - 1.0).abs() < 1e-5, "rolls without slip");
        assert!((x / x2 - 1.0).abs() < 1e-3 && (w / w2 - 1.0).abs() < 1e-3, "the table: {x} {w}");
    }
    let (x, _, w, r) = roll(30.0, 0.1, 0.0, 2.0);
    // Slipping needs no arm, but 2 ms until the tangential spring has reached its limit, on average half of
    // them without force: 5e-4 of 2 s, against which the distance to its limit counts in x.
    assert!((x / 8.11085816 - 1.0).abs() < 2e-4, "{x}");
    assert!((w / (21.239273 * r / 0.2) - 1.0).abs() < 4e-4, "{w}");
}

/// V-D8: a constant rolling moment `mu_r R m g` brakes a rolling ball by its work; the arm is R - d.
#[test]
fn a_ball_with_a_constant_rolling_moment_stops_where_its_work_is_done() {
    let height = STONE.radius - STONE.overlap(STONE.mass() * G);
    let more = format!(
        "position = [0.0, 0.0, {height:?}]\nvelocity = [1.0, 0.0, 0.0]\nangular_velocity = [0.0, {:?}, 0.0]",
        1.0 / height
    );
    let scene = STONE.scene(0.0, 0.5, &more, 0.5, 1e-4).replace("[dem]", "rolling_friction = 0.05\n[dem]");
    let mut bench = Setup::new(scene, fixed_plane(24.0, 1)).build();
    // It stops after 2.85 s, and swings on with a decay of 13 /s.
    for _ in 0..4500 {
        bench.advance(1e-3);
    }
    let stretch = STONE.radius / height;
    let distance = (1.0 + 0.4 * stretch * stretch) / (2.0 * 0.05 * G * stretch);
    let x = bench.value("rock_x");
    // It swings back by as much as 1e-3 rad, 2e-4 m, at the end.
    assert!((x - distance).abs() < 4e-4, "{x} {distance}");
    assert!((x / 1.42711519 - 1.0).abs() < 1e-3, "the table: {x}");
    assert!(
        bench.velocity().norm() < 1e-6 && bench.spin().norm() < 1e-5,
        "{} {}",
        bench.velocity(),
        bench.spin()
    );
}

/// A rolling spring holds a ball on a slope below its limit and lets it roll above, braked by the
/// limit: `a = g (sin - mu_r cos) / (1 + 0.4)`, here with the arm R - d.
#[test]
fn a_rolling_spring_holds_a_ball_on_a_slope_up_to_its_limit() {
    let run = |slope: f64, time: usize, more: &str| {
        let height = STONE.radius - STONE.overlap(STONE.mass() * G * slope.to_radians().cos());
        let at = format!("position = [0.0, 0.0, {height:?}]");
        let part = format!("rolling_friction = 0.1\nrolling = \"spring\"\n{more}[dem]");
        let scene = STONE.scene(slope, 0.5, &at, 0.5, 1e-4).replace("[dem]", &part);
        let mut bench = Setup::new(scene, fixed_plane(24.0, 1)).build();
        let start = bench.energy();
        for _ in 0..1000 * time {
            bench.advance(1e-3);
        }
        (bench.value("rock_x"), bench.velocity().norm(), bench.energy() - start)
    };
    // tan 4 deg = 0.07 is held, tan 8 deg = 0.14 is not.
    // At rest the spring is turned by sin / mu_r of 1e-3 rad; released at once it may swing to twice that.
    let (x, v, energy) = run(4.0, 2, "rolling_damping = 0.3\n");
    assert!(v < 1e-7 && x > 0.69e-3 * 0.2 && x < 1.4e-3 * 0.2, "{x} {v}");
    assert!(energy.abs() < 1e-6 * STONE.mass() * G * STONE.radius, "{energy}");
    let (sin, cos) = 8.0_f64.to_radians().sin_cos();
    // The moment has reached its limit after 30 ms; then the speed grows evenly.
    let ((_, before, _), (_, v, energy)) = (run(8.0, 1, ""), run(8.0, 2, ""));
    let stretch = STONE.radius / (STONE.radius - STONE.overlap(STONE.mass() * G * cos));
    let a = G * (sin - 0.1 * cos * stretch) / (1.0 + 0.4 * stretch * stretch);
    assert!(((v - before) / a - 1.0).abs() < 1e-4, "{v} {before} {a}");
    assert!(energy.abs() < 1e-3 * STONE.mass() * v * v, "{energy}");
}

/// Planes of V-D9: two triangles; jittered ones with random diagonals; slivers of 1:100.
fn planes() -> [InterfaceMesh; 3] {
    let mut rough = plane(4.0, 16);
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for node in rough.coordinates.chunks_exact_mut(3) {
        if node[0].abs() < 1.99 && node[1].abs() < 1.99 {
            node[0] += 0.12 * random();
            node[1] += 0.12 * random();
        }
    }
    for quad in rough.faces.chunks_exact_mut(2) {
        if random() > 0.0 {
            let ([a, b, d], [_, _, c]) = (quad[0], quad[1]);
            (quad[0], quad[1]) = ([a, b, c], [b, d, c]);
        }
    }
    let mut slivers = InterfaceMesh::default();
    for i in 0..=400_u32 {
        let x = f64::from(i) * 0.01 - 2.0;
        slivers.coordinates.extend([x, -0.5, 0.0, x, 0.5, 0.0]);
        if i > 0 {
            let (a, b, c, d) = (2 * i - 2, 2 * i - 1, 2 * i, 2 * i + 1);
            slivers.faces.extend([[a, c, d], [a, d, b]]);
        }
    }
    [plane(4.0, 1), rough, slivers]
}

/// V-D9: a border between elements of a plane is not felt. Rolling with the arm R - d0.
#[test]
fn a_ball_that_rolls_over_the_borders_of_a_plane_is_not_kicked() {
    let ball = Ball { radius: 0.1, density: 2500.0, young: 1e7, poisson: 0.3 };
    let overlap = ball.overlap(ball.mass() * G);
    let height = 0.1 - overlap;
    let spin = 1.0 / height;
    for (friction, tolerance) in [(0.0, 1e-10), (0.5, 1e-6)] {
        for (number, mut mesh) in planes().into_iter().enumerate() {
            mesh.masses = vec![f64::INFINITY; mesh.node_count()];
            let more = format!(
                "position = [-1.0, 0.0137, {height:?}]\nvelocity = [1.0, 0.0, 0.0]\nangular_velocity = [0.0, {spin:?}, 0.0]"
            );
            let mut bench = Setup::new(ball.scene(0.0, friction, &more, 1.0, 2e-4), mesh).build();
            for _ in 0..500 {
                bench.advance(4e-3);
                let [_, low, high] = bench.gauge("rock_z");
                // Equilibrium to rounding, 1e-16 of the weight over the stiffness, and of the coordinates.
                assert!((low - height).abs() < 1e-12 && (high - height).abs() < 1e-12, "height {low} {high}");
                assert_eq!(bench.gauge("contacts"), [1.0; 3], "plane {number}");
            }
            let (v, w) = (bench.velocity(), bench.spin());
            assert!((v - Vector3::x()).norm() < tolerance, "plane {number}, friction {friction}: {v}");
            assert!((w - Vector3::y() * spin).norm() < spin * tolerance, "plane {number}: {w}");
        }
    }
}

fn strip(parts: u32) -> InterfaceMesh {
    // Along y in parts: a plane z = 0 for x < 0 and one x = 0 for z < 0.
    let mut mesh = InterfaceMesh::default();
    for i in 0..=parts {
        let y = 2.0 * (f64::from(i) / f64::from(parts) - 0.5);
        mesh.coordinates.extend([-1.0, y, 0.0, 0.0, y, 0.0, 0.0, y, -1.0]);
        if i > 0 {
            let a = 3 * (i - 1);
            mesh.faces.extend([
                [a, a + 1, a + 4],
                [a, a + 4, a + 3],
                [a + 1, a + 2, a + 5],
                [a + 1, a + 5, a + 4],
            ]);
        }
    }
    mesh.masses = vec![f64::INFINITY; mesh.node_count()];
    mesh
}

/// V-D9: the trajectory over a convex edge is the same however many elements share it. The contact
/// points agree to rounding, which a second of rolling off amplifies by some 1e3.
#[test]
fn a_ball_rolls_off_a_convex_edge_the_same_way_however_the_edge_is_made() {
    let ball = Ball { radius: 0.1, density: 2500.0, young: 1e8, poisson: 0.3 };
    let height = 0.1 - ball.overlap(ball.mass() * G);
    let ends: Vec<Vector3<f64>> = [1, 2, 10]
        .map(|parts| {
            let more = format!("position = [-0.1, 0.0317, {height:?}]\nvelocity = [0.3, 0.0, 0.0]");
            let mut bench = Setup::new(ball.scene(0.0, 0.5, &more, 0.5, 1e-4), strip(parts)).build();
            for _ in 0..1000 {
                bench.advance(1e-3);
                assert!(bench.gauge("contacts")[2] <= 1.0);
            }
            bench.position()
        })
        .into();
    assert!(ends[0].z < 0.0, "it has rolled off: {}", ends[0]);
    for end in &ends[1..] {
        assert!((end - ends[0]).norm() < 1e-10, "{end} {}", ends[0]);
    }
}

/// Two planes at right angles that meet at y = 0 in a groove, each inclined by 45 degrees.
fn groove() -> InterfaceMesh {
    let mut mesh = InterfaceMesh::default();
    for y in [-1.0, 1.0] {
        mesh.coordinates.extend([-1.0, y, 1.0, 0.0, y, 0.0, 1.0, y, 1.0]);
    }
    mesh.faces = vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]];
    mesh.masses = vec![f64::INFINITY; 6];
    mesh
}

fn settled(bench: &mut Bench, windows: usize) {
    for _ in 0..windows {
        bench.advance(2e-3);
    }
    assert!(bench.velocity().norm() < 1e-9, "has not come to rest: {}", bench.velocity());
}

/// V-D9: each side of a groove of half-angle 45 degrees carries m g / (2 sin 45).
#[test]
fn a_ball_in_a_groove_rests_on_two_contacts() {
    let ball = Ball { radius: 0.1, density: 2500.0, young: 1e7, poisson: 0.3 };
    let each = ball.mass() * G / (2.0 * 45.0_f64.to_radians().sin());
    let height = (0.1 - ball.overlap(each)) / 45.0_f64.to_radians().sin();
    let more = format!("position = [0.0, 0.2, {:?}]", height + 1e-4);
    let mut bench = Setup::new(ball.scene(0.0, 0.0, &more, 0.1, 2e-4), groove()).build();
    settled(&mut bench, 1500);
    assert_eq!(bench.value("contacts"), 2.0);
    assert!((bench.value("rock_z") - height).abs() < 1e-9);
    let forces = bench.force(Sampling::AtEnds, 0);
    // Nodes 0 and 3 belong to the left plane alone, 2 and 5 to the right; 1 and 4 to both.
    let total: Vector3<f64> = forces.iter().sum();
    assert!((total.z + ball.mass() * G).abs() < 1e-6 && total.x.abs() < 1e-6);
    // The right plane's nodes show the direction of its push, (1, 0, -1) / sqrt(2) times `each`.
    let right = forces[2] + forces[5];
    assert!((right.normalize() - Vector3::new(1.0, 0.0, -1.0).normalize()).norm() < 1e-9);
}

/// V-D9: a ball in a square cell of wires rests on four, `F_z = 4 F_n cos b`, `sin b = (b/2) / (R - d)`.
#[test]
fn a_ball_in_a_cell_of_wires_rests_on_four_contacts() {
    let ball = Ball { radius: 0.1, density: 2500.0, young: 1e8, poisson: 0.3 };
    let mut mesh = net(1, 0.12, 0.0);
    mesh.masses = vec![f64::INFINITY; 4];
    let more = "position = [0.0, 0.0, 0.0801]";
    let mut bench = Setup::new(ball.scene(0.0, 0.0, more, 0.1, 1e-4), mesh).build();
    settled(&mut bench, 1500);
    assert_eq!(bench.value("contacts"), 4.0);
    let distance = (0.06_f64.powi(2) + bench.value("rock_z").powi(2)).sqrt();
    let cos = bench.value("rock_z") / distance;
    let modulus = 1e8 / (1.0 - 0.09);
    let force = 4.0 / 3.0 * modulus * 0.1_f64.sqrt() * (0.1 - distance).powf(1.5);
    assert!((4.0 * force * cos / (ball.mass() * G) - 1.0).abs() < 1e-6);
    let total: Vector3<f64> = bench.force(Sampling::AtEnds, 0).iter().sum();
    assert!((total + Vector3::z() * ball.mass() * G).norm() < 1e-6, "{total}");
}

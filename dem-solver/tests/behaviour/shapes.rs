//! Rocks from shapes: clusters, their stated error, wires dragged along them, files.

use crate::bench::{Setup, fixed_plane};
use dem_solver::DemSolver;
use dem_solver::check::check;
use dem_solver::cluster::{Accuracy, Fit, Wish, files, make};
use dem_solver::geometry::sphere::Sphere;
use dem_solver::shape::formats::{Facets, obj, stl};
use dem_solver::shape::{Shape, SolidIntegrals, Surface};
use nalgebra::Vector3;
use toolkit::program::Options;
use toolkit::scene::Scene;

const SHAPES: [&str; 8] = [
    "cube:0.41",
    "box:0.2,0.4,0.6",
    "sphere:0.2",
    "ead_block:0.41",
    "norm_rock_111:0.05",
    "norm_rock_221:0.05",
    "ellipsoid:0.3,0.2,0.15",
    "random_convex:0.5,0.4,0.3,7",
];

fn surface(name: &str) -> Surface {
    // Coarse round shapes are convex polyhedra like the others, and quick.
    if name.starts_with("ellipsoid") {
        return dem_solver::shape::builtin::ellipsoid(Vector3::new(0.3, 0.2, 0.15), 2);
    }
    if name.starts_with("sphere") {
        return dem_solver::shape::builtin::ellipsoid(Vector3::repeat(0.2), 2);
    }
    Shape::parse(name, 1.0).and_then(|s| s.surface(true)).unwrap_or_else(|e| panic!("{e}")).0
}

fn cluster(surface: &Surface, spheres: u32, fit: Fit) -> Vec<Sphere> {
    make(surface, &Wish { spheres, fit, smallest_radius: 0.0 }, |_| ())
}

/// Numbers that look like chance, the same each time, in 0 to 1.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::new(self.next(), self.next(), self.next()) * 2.0 - Vector3::repeat(1.0);
            if (0.01..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.next() * n as f64) as usize).min(n - 1)
    }
}

/// How deep a line through `point` along `along` lies in the convex solid at most [m].
fn depth_in(planes: &[(Vector3<f64>, f64)], point: &Vector3<f64>, along: &Vector3<f64>, reach: f64) -> f64 {
    let depth = |t: f64| {
        let p = point + along * t;
        planes.iter().map(|(n, d)| d - n.dot(&p)).fold(f64::INFINITY, f64::min)
    };
    // Concave along the line: the largest value by thirds, to 1e-7 of the reach.
    let (mut low, mut high) = (-reach, reach);
    for _ in 0..40 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if depth(a) < depth(b) { low = a } else { high = b }
    }
    depth(0.5 * (low + high))
}

/// How far a line moves along `inward` from `point` until it touches a sphere.
fn until_touch(spheres: &[Sphere], point: &Vector3<f64>, along: &Vector3<f64>, inward: &Vector3<f64>) -> f64 {
    let across = along.cross(inward);
    spheres
        .iter()
        .filter_map(|s| {
            let arm = s.centre - point;
            let square = s.radius * s.radius - arm.dot(&across).powi(2);
            (square > 0.0).then(|| arm.dot(inward) - square.sqrt())
        })
        .fold(f64::INFINITY, f64::min)
}

/// Must-show 4: a wire of no thickness that is pressed onto the cluster in 1 000 places, and dragged across its
/// direction from there, lies nowhere deeper in the solid than the stated error.
#[test]
#[ignore = "long"]
fn a_thin_wire_dragged_along_a_cluster_enters_no_deeper_than_the_stated_error() {
    for name in SHAPES {
        let surface = surface(name);
        let size = surface.size();
        let planes: Vec<(Vector3<f64>, f64)> = (0..surface.triangles.len())
            .map(|t| (surface.normal(t), surface.normal(t).dot(&surface.corners(t)[0])))
            .collect();
        for (spheres, fit) in [(40, Fit::Volume), (300, Fit::Inside)] {
            let cluster = cluster(&surface, spheres, fit);
            let stated = Accuracy::of(&surface, &cluster).largest();
            let mut chance = Chance(7);
            let mut deepest = 0.0_f64;
            for _ in 0..1000 {
                let t = chance.below(planes.len());
                let [a, b, c] = surface.corners(t);
                let (mut u, mut v) = (chance.next(), chance.next());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                let place = a + (b - a) * u + (c - a) * v;
                let inward = -planes[t].0;
                let along = inward.cross(&chance.direction()).normalize();
                let across = along.cross(&inward);
                for drag in 0..5 {
                    let point = place + across * (0.01 * size * f64::from(drag));
                    let moved = until_touch(&cluster, &point, &along, &inward);
                    if moved.is_finite() {
                        deepest = deepest.max(depth_in(&planes, &(point + inward * moved), &along, size));
                    } else {
                        // It passes beside all spheres: then the solid ends there too, but for the error.
                        deepest = deepest.max(depth_in(&planes, &point, &along, size).min(size));
                    }
                }
            }
            assert!(deepest <= stated, "{name} {spheres}: {deepest} deep, {stated} stated");
            assert!(
                deepest > 0.1 * stated,
                "the wire has felt the dips: {name} {spheres} {deepest} {stated}"
            );
        }
    }
}

/// The error goes down with the number of spheres: measured from 100 to 1 000 as N^-0.6 to N^-0.9 for solids
/// with edges, for which a lattice has N^-1/3.
#[test]
#[ignore = "long"]
fn more_spheres_have_a_smaller_error_of_at_least_the_observed_order() {
    for name in SHAPES.into_iter().filter(|name| !name.starts_with("sphere")) {
        let surface = surface(name);
        let error = |n: u32| Accuracy::of(&surface, &cluster(&surface, n, Fit::Largest)).largest();
        let (few, many) = (error(100), error(1000));
        let order = (few / many).ln() / 10.0_f64.ln();
        assert!(order > 0.5, "{name}: {few} {many}, order {order}");
    }
}

#[test]
#[ignore = "long"]
fn every_number_of_spheres_is_possible_and_gives_the_same_bytes_again() {
    let surface = surface("random_convex:0.5,0.4,0.3,7");
    for n in [1, 2, 3, 5, 17, 100, 333] {
        let first = cluster(&surface, n, Fit::Volume);
        assert_eq!(first.len(), n as usize);
        assert_eq!(first, cluster(&surface, n, Fit::Volume));
        assert_eq!(files::groups(&first), 1, "{n} overlap");
    }
}

/// What edges leave is covered by as many spheres as asked for; a round surface only down to the chords of its triangles, a
/// gap of 2e-4 of its size.
#[test]
#[ignore = "long"]
fn a_round_surface_takes_no_more_spheres_than_reach_its_chords() {
    let ball = dem_solver::shape::builtin::ellipsoid(Vector3::repeat(0.2), 5);
    let made = cluster(&ball, 300, Fit::Largest);
    assert!(made.len() < 300, "{}", made.len());
    assert!((made[0].radius / 0.2 - 1.0).abs() < 0.02 && made[0].centre.norm() < 0.02 * 0.2, "{:?}", made[0]);
    let error = Accuracy::of(&ball, &made).largest();
    assert!(error < 2e-4 * ball.size(), "{error}");
    let oval = dem_solver::shape::builtin::ellipsoid(Vector3::new(0.3, 0.2, 0.15), 3);
    assert_eq!(cluster(&oval, 300, Fit::Largest).len(), 300);
}

#[test]
fn a_least_radius_is_kept() {
    let surface = surface("cube:0.41");
    let wish = Wish { spheres: 400, fit: Fit::Inside, smallest_radius: 0.02 };
    let made = make(&surface, &wish, |_| ());
    let small: Vec<&Sphere> = made.iter().filter(|s| s.radius < 0.02 * (1.0 - 1e-9)).collect();
    assert!(small.is_empty(), "the cube has room for it everywhere: {small:?}");
    let found = Accuracy::of(&surface, &made);
    // At a corner a ball of radius r leaves r (sqrt 3 - 1), and the search halves depths: r is up to twice the least.
    let corner = 0.02 * (3.0_f64.sqrt() - 1.0);
    assert!((0.99 * corner..2.0 * corner).contains(&found.surface_to_spheres.max), "{found}");
    assert_eq!(found.outside, 0.0);
}

fn scene(text: &str) -> Scene {
    Scene::from_text("test.toml", &format!("end_time = 1.0\n{text}")).expect("a scene")
}

fn solver(text: &str) -> Result<DemSolver, String> {
    DemSolver::new(&scene(text), &Options::default()).map_err(|e| e.to_string())
}

const ROCK: &str = "[[rock]]\nposition = [0.0, 0.0, 1.0]\ndensity = 2600.0\n";

/// V-D10: mass and inertia belong to the shape, whatever the spheres.
#[test]
fn mass_and_inertia_of_any_shape_do_not_depend_on_the_spheres() {
    let shape = "shape = { type = \"random_convex\", size = [0.5, 0.4, 0.3], seed = 7 }\n";
    let body = SolidIntegrals::of(&surface("random_convex:0.5,0.4,0.3,7"));
    for n in [1, 8, 64, 500] {
        let solver =
            solver(&format!("{ROCK}{shape}cluster.spheres = {n}\n")).unwrap_or_else(|e| panic!("{e}"));
        let rock = &solver.model().rocks[0];
        assert_eq!(rock.spheres.len(), n);
        assert!((rock.mass / (2600.0 * body.volume) - 1.0).abs() < 1e-12);
        for (moment, gyration) in rock.inertia.iter().zip(body.gyration.iter()) {
            assert!((moment / (rock.mass * gyration) - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
#[ignore = "long"]
fn check_states_the_error_and_the_resolved_scene_reads_back() {
    for shape in [
        "shape = { type = \"ead_block\", size = 0.41 }\ncluster = { spheres = 100 }",
        "shape = { type = \"box\", size = [0.41, 0.41, 0.41] }\ncluster = { spheres = 60, method = \"medial\" }",
        "shape = { type = \"box\", size = [0.41, 0.41, 0.41] }",
        "shape = { type = \"ellipsoid\", semi_axes = [0.3, 0.2, 0.2] }\ncluster = { spheres = 60 }",
        "shape = { type = \"sphere\", radius = 0.2 }",
    ] {
        let first = check(&scene(&format!("gravity = [0.0, 0.0, 0.0]\n{ROCK}{shape}\n")))
            .unwrap_or_else(|e| panic!("{e}"));
        let said = first.builds.iter().any(|line| line.contains("surface to spheres"));
        assert_eq!(said, !shape.contains("sphere\""), "{:?}", first.builds);
        let again = check(&scene(&first.resolved.to_string())).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(first, again);
    }
}

/// A rock from its own files moves as the same rock from the scene does: its axes, turned to principal
/// ones inside, are the file's outside.
#[test]
fn a_mesh_and_a_cluster_from_files_fall_and_turn_as_the_box_they_describe() {
    let dir = tempfile::tempdir().expect("a directory");
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.9);
    let shift = Vector3::new(0.7, -0.2, 0.4);
    let size = Vector3::new(0.3, 0.4, 0.6);
    let mut text = String::new();
    let mut box_surface = dem_solver::shape::builtin::cuboid(size);
    for p in &mut box_surface.points {
        *p = turn * *p + shift;
        text += &format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z);
    }
    for [a, b, c] in &box_surface.triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    std::fs::write(dir.path().join("rock.obj"), text).expect("written");
    let lattice = dem_solver::cluster::lattice::Lattice::within(size.into(), 50).expect("fits").spheres();
    let moved: Vec<Sphere> =
        lattice.iter().map(|s| Sphere { centre: turn * s.centre + shift, ..*s }).collect();
    std::fs::write(dir.path().join("rock.xyzr"), files::text(&[], &moved)).expect("written");
    let back = nalgebra::UnitQuaternion::from_rotation_matrix(&turn.inverse());
    let [x, y, z, w]: [f64; 4] = back.coords.into();
    let contact = "[[contact]]\nlaw = \"linear\"\nstiffness = 1e6\nrestitution = 0.7\npoisson = 0.2\nfriction = 0.3\n[dem]\ntime_step = 2e-5\n";
    let drop = |shape: &str| {
        let text = format!(
            "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nposition = [0.0, 0.0, 0.36]\nvelocity = [0.5, 0.0, -2.0]\n\
             density = 2600.0\nangular_velocity = [1.0, 2.0, 3.0]\n{shape}\n{contact}"
        );
        let mut bench = Setup::new(text, fixed_plane(4.0, 1)).build();
        for _ in 0..200 {
            bench.advance(1e-3);
        }
        (bench.solver.state().bodies[0].motion.position, bench.solver.state().bodies[0].motion.velocity)
    };
    let plain = drop("shape = { type = \"box\", size = [0.3, 0.4, 0.6] }\ncluster.spheres = 50");
    let (obj, xyzr) = (dir.path().join("rock.obj"), dir.path().join("rock.xyzr"));
    let files = drop(&format!(
        "shape = {{ type = \"mesh\", file = {obj:?} }}\ncluster = {{ file = {xyzr:?} }}\norientation = [{w:?}, {x:?}, {y:?}, {z:?}]"
    ));
    // The same motion but for rounding of the frame, which contacts magnify.
    assert!((plain.0 - files.0).norm() < 1e-9, "{} {}", plain.0, files.0);
    assert!((plain.1 - files.1).norm() < 1e-7, "{} {}", plain.1, files.1);
}

#[test]
fn what_makes_no_sense_of_shapes_and_clusters_is_refused_with_its_place() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).expect("written");
        format!("{path:?}")
    };
    let open = file("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 1 2 3\n");
    let stl = file("bad.stl", "solid x\nvertex 0 0 z\n");
    let spheres = file("bad.xyzr", "0 0 0 1\n0 0 0 -1\n");
    let cube = "shape = { type = \"box\", size = [0.4, 0.4, 0.4] }\n";
    for (text, expected) in [
        ("shape = { type = \"mesh\", file = \"no-such.stl\" }".to_string(), "there is no such file"),
        (format!("shape = {{ type = \"mesh\", file = {open} }}"), "triangles share the edge"),
        (format!("shape = {{ type = \"mesh\", file = {stl} }}"), "bad.stl:2: `z` is not a number"),
        (format!("shape = {{ type = \"mesh\", file = {open}, scale = 0.0 }}"), "above 0"),
        (format!("{cube}cluster = {{ file = {spheres} }}"), "bad.xyzr:2: a radius of -1 m"),
        (format!("{cube}cluster = {{ file = {spheres}, spheres = 8 }}"), "keep one of `file` and `spheres`"),
        (format!("{cube}cluster = {{ spheres = 8, fit = \"inside\" }}"), "belongs to the method `medial`"),
        (format!("{cube}cluster = {{ spheres = 50001 }}"), "1 to 50000"),
        ("shape = { type = \"ead_block\", size = 1.0 }\ncluster.method = \"lattice\"".into(), "fills a box"),
        ("shape = { type = \"norm_rock\", form = \"112\", volume = 1.0 }".into(), "112"),
        (
            "shape = { type = \"convex_hull\", points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] }"
                .into(),
            "convex hull",
        ),
        ("shape = { type = \"random_convex\", size = [1, 1, 1], points = 3 }".into(), "8 to 10000"),
    ] {
        let Err(message) = solver(&format!("{ROCK}{text}\n")) else { panic!("not refused: {text}") };
        assert!(message.contains(expected), "{expected:?} is not in:\n{message}");
        assert!(message.starts_with("test.toml:"), "{message}");
    }
}

/// Readers under fire: cut off, bytes changed, bytes of another kind. No panic, and an error or a sound result.
#[test]
fn readers_hold_against_thousands_of_mutated_files() {
    let rock = surface("random_convex:0.5,0.4,0.3,7");
    let mut ascii = String::from("solid rock\n");
    let mut binary = vec![b' '; 80];
    binary.extend((rock.triangles.len() as u32).to_le_bytes());
    let mut wavefront: String = rock.points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    for t in 0..rock.triangles.len() {
        ascii += "facet normal 0 0 1\nouter loop\n";
        binary.extend([0; 12]);
        for p in rock.corners(t) {
            ascii += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
            binary.extend(p.iter().flat_map(|c| (*c as f32).to_le_bytes()));
        }
        binary.extend([0; 2]);
        ascii += "endloop\nendfacet\n";
        let [a, b, c] = rock.triangles[t];
        wavefront += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    ascii += "endsolid rock\n";
    let spheres = cluster(&rock, 40, Fit::Volume);
    let text = files::text(&["a rock".into()], &spheres);
    let clu = format!("Name\nrock\nBegin centers_and_radii\n{text}End centers_and_radii\nVolume\n0.1\n");
    type Reader = fn(&[u8]) -> bool;
    let soup: Reader = |b| {
        let read = stl::read(b, 1000).map(Facets::indexed);
        read.is_ok_and(|(p, t)| Surface::from_indexed(p, t).is_ok())
    };
    let indexed: Reader = |b| {
        let read = obj::read(b, 1000).map(Facets::indexed);
        read.is_ok_and(|(p, t)| Surface::from_indexed(p, t).is_ok())
    };
    let readers: [(&[u8], Reader); 5] = [
        (ascii.as_bytes(), soup),
        (&binary, soup),
        (wavefront.as_bytes(), indexed),
        (text.as_bytes(), |b| files::read_text(b).is_ok()),
        (clu.as_bytes(), |b| files::read_clu(b).is_ok()),
    ];
    let mut chance = Chance(99);
    for (number, (good, read)) in readers.iter().enumerate() {
        assert!(read(good), "reader {number}");
        let mut refused = 0;
        for round in 0..1500 {
            let mut bytes = good.to_vec();
            match round % 3 {
                0 => bytes.truncate(chance.below(bytes.len())),
                1 => {
                    for _ in 0..1 + chance.below(8) {
                        let at = chance.below(bytes.len());
                        bytes[at] = chance.below(256) as u8;
                    }
                }
                _ => {
                    // A piece of the file somewhere else in it.
                    let (from, to) = (chance.below(bytes.len()), chance.below(bytes.len()));
                    let piece: Vec<u8> = bytes[from..].iter().copied().take(chance.below(200)).collect();
                    bytes.splice(to..to, piece);
                }
            }
            refused += usize::from(!read(&bytes));
        }
        assert!(refused > 300, "reader {number} refused {refused} of 1500");
    }
    for other in [&b"\x7fELF\x02\x01\x01\x00"[..], b"\xff\xfe\x00\x00", &[0_u8; 84][..], &[255_u8; 500][..]] {
        assert!(readers.iter().all(|(_, read)| !read(other)));
    }
}

/// A tetrahedron, whose principal axes are not those of its file, tumbles in flight. What the columns say at half time, written
/// into a scene, goes on to where the whole run ends.
#[test]
fn position_velocity_spin_and_orientation_of_a_row_start_the_rest_of_the_run() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("t.obj");
    std::fs::write(
        &file,
        "v 0 0 0\nv 1.2 0 0\nv 0 0.7 0\nv 0.2 0.1 0.5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
    )
    .expect("written");
    let run = |state: &str, time: f64| {
        let scene = format!(
            "end_time = 1.0\ngravity = [0.0, 0.0, -9.81]\n[[rock]]\nname = \"rock\"\ndensity = 2600.0\n\
             shape = {{ type = \"mesh\", file = {file:?} }}\ncluster.spheres = 8\ncluster.largest_error = 1.0\n{state}\n[dem]\ntime_step = 1e-4\n"
        );
        let mut bench = Setup { contact_mesh: None, ..Setup::new(scene, Default::default()) }.build();
        bench.advance(time);
        let group =
            |names: &[&str]| names.iter().map(|n| bench.value(&format!("rock_{n}"))).collect::<Vec<_>>();
        [
            group(&["x", "y", "z"]),
            group(&["vx", "vy", "vz"]),
            group(&["wx", "wy", "wz"]),
            group(&["orientation_w", "orientation_x", "orientation_y", "orientation_z"]),
        ]
    };
    let start = "position = [1.0, 2.0, 3.0]\nvelocity = [1.0, 0.5, 2.0]\nangular_velocity = [3.0, -2.0, 5.0]\n\
                 orientation = [0.5, 0.5, -0.5, 0.5]";
    let [position, velocity, spin, orientation] = run(start, 0.1);
    let half = format!(
        "position = {position:?}\nvelocity = {velocity:?}\nangular_velocity = {spin:?}\norientation = {orientation:?}"
    );
    let (whole, rest) = (run(start, 0.2), run(&half, 0.1));
    for (a, b) in whole.iter().flatten().zip(rest.iter().flatten()) {
        assert!((a - b).abs() < 1e-9, "{whole:?} {rest:?}");
    }
    let turned = orientation.iter().zip([0.5, 0.5, -0.5, 0.5]).map(|(a, b)| a * b).sum::<f64>().abs();
    assert!(turned < 0.99, "it has turned: {orientation:?}");
}

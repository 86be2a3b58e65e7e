//! What a cluster states of itself, against points sampled on both surfaces and looked at one by one; and what is refused.

use crate::sampled::Sampled;
use crate::solids::solid;
use dem_solver::DemSolver;
use dem_solver::cluster::{Accuracy, Bound, Fit, Wish, files, kept, make, measured};
use dem_solver::geometry::sphere::Sphere;
use dem_solver::shape::{Surface, builtin};
use nalgebra::Vector3;
use std::process::Command;
use toolkit::program::Options;
use toolkit::scene::Scene;

fn wish(spheres: u32, fit: Fit) -> Wish {
    Wish { spheres, fit, smallest_radius: 0.0 }
}

fn cluster(surface: &Surface, spheres: u32, fit: Fit) -> Vec<Sphere> {
    make(surface, &wish(spheres, fit), |_| ())
}

/// Distance of a point to a triangle: to its plane above it, else to an edge.
fn to_triangle(p: &Vector3<f64>, corners: &[Vector3<f64>; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let above = (0..3).all(|k| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        normal.cross(&(to - from)).dot(&(p - from)) >= 0.0
    });
    if above {
        return (normal.dot(&(p - a)) / normal.norm()).abs();
    }
    let to_edge = |k: usize| {
        let (from, along) = (corners[k], corners[(k + 1) % 3] - corners[k]);
        let share = (along.dot(&(p - from)) / along.norm_squared()).clamp(0.0, 1.0);
        (from + along * share - p).norm()
    };
    (0..3).map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Distance to the nearest sphere's surface, negative inside.
fn to_spheres(p: &Vector3<f64>, spheres: &[Sphere]) -> f64 {
    spheres.iter().map(|s| (p - s.centre).norm() - s.radius).fold(f64::INFINITY, f64::min)
}

/// Cells of a grid that can be reached from outside without entering a sphere: what is closed in between spheres touches
/// nothing, and does not count.
struct Outside {
    lowest: Vector3<f64>,
    cell: f64,
    reached: Vec<bool>,
}

const CELLS: usize = 72;

impl Outside {
    fn of(spheres: &[Sphere]) -> Self {
        let nowhere = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (low, high) = spheres.iter().fold(nowhere, |(l, h), s| {
            (l.inf(&s.centre.add_scalar(-s.radius)), h.sup(&s.centre.add_scalar(s.radius)))
        });
        let cell = (high - low).max() / (CELLS - 6) as f64;
        let lowest = low.add_scalar(-3.0 * cell);
        let mut outside = Self { lowest, cell, reached: vec![false; CELLS.pow(3)] };
        outside.reached[0] = true;
        let mut stack = vec![[0_i64; 3]];
        while let Some(at) = stack.pop() {
            for axis in 0..3 {
                for step in [-1, 1] {
                    let mut next = at;
                    next[axis] += step;
                    let Some(k) = number(next) else { continue };
                    let middle = lowest + Vector3::from(next.map(|c| (c as f64 + 0.5) * cell));
                    if !outside.reached[k] && to_spheres(&middle, spheres) > 0.0 {
                        outside.reached[k] = true;
                        stack.push(next);
                    }
                }
            }
        }
        outside
    }

    /// Whether a point near a surface belongs to the outside: a reached cell lies next to it.
    fn is_next_to(&self, p: &Vector3<f64>) -> bool {
        let at = [0, 1, 2].map(|k| ((p[k] - self.lowest[k]) / self.cell).floor() as i64);
        (0..27).any(|n| {
            number([at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1])
                .is_some_and(|k| self.reached[k])
        })
    }
}

fn number(at: [i64; 3]) -> Option<usize> {
    let most = CELLS as i64;
    at.iter().all(|c| (0..most).contains(c)).then(|| ((at[2] * most + at[1]) * most + at[0]) as usize)
}

/// The largest distances as sampled: from the solid's surface to the spheres', and back; and the distance of samples.
fn sampled(surface: &Surface, spheres: &[Sphere]) -> (f64, f64, f64) {
    let outside = Outside::of(spheres);
    let many = (8_000 / spheres.len()).min(400);
    let mut skin = Vec::new();
    let mut spacing = 0.0_f64;
    for sphere in spheres {
        spacing = spacing.max(sphere.radius * (12.0 / many as f64).sqrt());
        for k in 0..many {
            // Rings of equal height have equal areas.
            let z = 1.0 - (2 * k + 1) as f64 / many as f64;
            let angle = 2.399_963 * k as f64;
            let r = (1.0 - z * z).sqrt();
            let p = sphere.centre + Vector3::new(r * angle.cos(), r * angle.sin(), z) * sphere.radius;
            if to_spheres(&p, spheres) > -1e-9 && outside.is_next_to(&p) {
                skin.push(p);
            }
        }
    }
    let corners: Vec<_> = (0..surface.triangles.len()).map(|t| surface.corners(t)).collect();
    let to_surface =
        |p: &Vector3<f64>| corners.iter().map(|c| to_triangle(p, c)).fold(f64::INFINITY, f64::min);
    let back = skin.iter().map(to_surface).fold(0.0, f64::max);
    let total: f64 = (0..corners.len()).map(|t| surface.area(t)).sum();
    let mut there = 0.0_f64;
    for (t, [a, b, c]) in corners.iter().enumerate() {
        let rows = ((surface.area(t) / total * 2000.0).sqrt().ceil() as usize).max(2);
        for i in 0..=rows {
            for j in 0..=rows - i {
                let p = a + (b - a) * (i as f64 / rows as f64) + (c - a) * (j as f64 / rows as f64);
                let gap = to_spheres(&p, spheres);
                let to_skin = || skin.iter().map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min);
                there = there.max(if gap >= 0.0 {
                    gap
                } else if -gap > there {
                    to_skin()
                } else {
                    0.0
                });
            }
        }
    }
    (there, back, spacing)
}

/// What is stated is no less than any sample shows, but for a few per cent by which samples of the statement miss the top, and
/// no more than what samples show and their own distance. A ray that ran on inside of spheres made it fifty times as much.
#[test]
#[ignore = "long"]
fn stated_errors_are_those_of_points_sampled_on_both_surfaces() {
    for (name, spheres) in [
        ("cube:0.41", 8),
        ("box:2,1,0.2", 90),
        ("box:2,0.2,0.2", 30),
        ("ellipsoid:0.3,0.2,0.15", 20),
        ("ead_block:0.41", 64),
        ("disc", 80),
        ("column", 40),
        ("ring", 24),
        ("L", 40),
        ("jack", 60),
        ("star", 64),
        ("scan", 40),
    ] {
        let surface = solid(name);
        let cluster = cluster(&surface, spheres, Fit::Volume);
        let stated = Accuracy::of(&surface, &cluster);
        let (there, back, spacing) = sampled(&surface, &cluster);
        let (to, from) = (stated.surface_to_spheres.max, stated.spheres_to_surface.max);
        assert!(there <= 1.03 * to + spacing, "{name}: {there} sampled, {to} stated");
        assert!(back <= 1.03 * from, "{name}: {back} sampled back, {from} stated");
        let largest = there.max(back);
        assert!(stated.largest() <= 1.1 * largest + spacing, "{name}: {stated}, {largest} sampled");
    }
}

/// A groove of 1 cm around a ball: from its surfaces, along their normals, the distance through the sphere is eight times as long.
#[test]
fn a_ray_that_runs_on_through_a_sphere_is_not_its_distance() {
    let mut profile = vec![[0.0, -0.5]];
    let on = |z: f64| [(0.25 - z * z).sqrt(), z];
    profile.extend((1..20).map(|k| on(-0.5 + f64::from(k) * 0.0245)));
    profile.extend([on(-0.01), [0.49, -0.01], [0.49, 0.01], on(0.01)]);
    profile.extend((1..20).rev().map(|k| on(0.5 - f64::from(k) * 0.0245)));
    profile.push([0.0, 0.5]);
    let surface = crate::solids::revolved(&profile, false, 96).0;
    let ball = [Sphere { centre: Vector3::zeros(), radius: 0.5 }];
    let stated = Accuracy::of(&surface, &ball).surface_to_spheres.max;
    // The groove's edge in the middle of a chord of the 96: 0.49 (1 - cos(pi / 96)) deeper.
    let deepest = 0.5 - ((0.49 * (std::f64::consts::PI / 96.0).cos()).powi(2)).sqrt();
    assert!((0.0099..=deepest * (1.0 + 1e-6)).contains(&stated), "{stated}, {deepest}");
}

/// Slabs, plates and bars lost up to 98 % of their volume, or became a ball as long as they are.
#[test]
#[ignore = "long"]
fn thin_and_limbed_solids_are_covered_evenly_by_few_spheres() {
    for (name, spheres, most) in [
        ("box:2,1,0.2", 64, 1.0),
        ("box:2,1,0.2", 300, 0.7),
        ("box:2,1,0.1", 300, 1.0),
        ("box:2,0.2,0.2", 64, 0.5),
        ("ellipsoid:1,0.1,0.1", 12, 0.9),
        ("disc", 64, 1.0),
        ("column", 10, 1.0),
        ("L", 8, 0.7),
        ("jack", 64, 0.4),
        ("star", 100, 0.3),
    ] {
        let surface = solid(name);
        let cluster = cluster(&surface, spheres, Fit::Volume);
        assert!(cluster.len() <= spheres as usize, "{name}");
        let found = Accuracy::of(&surface, &cluster);
        let thick = Bound::of(&surface, None);
        let share = found.largest() / (thick.largest / 0.9);
        // 1 is a hole through the solid: no point of it is further from the surface.
        assert!(share < most + 1e-4, "{name} {spheres}: {share} of the largest ball's radius, {found}");
        assert!(found.volume.abs() < 0.05 && files::groups(&cluster) == 1, "{name} {spheres}: {found}");
    }
}

/// In the hollow of a pipe there is room for a ball that is ten times as large as its mesh is thick.
#[test]
fn the_bound_of_a_thin_solid_is_that_of_the_largest_ball_inside_of_it() {
    for (name, thick) in [("pipe", 0.03), ("bowl", 0.06), ("box:2,1,0.01", 0.01), ("ring", 0.2)] {
        let found = Bound::of(&solid(name), None).largest / 0.45;
        assert!((0.9 * thick..1.01 * thick).contains(&found), "{name}: {found}");
    }
}

/// 300 spheres on limbs were worse than 50.
#[test]
#[ignore = "long"]
fn more_spheres_are_better_on_limbs_too() {
    for name in ["jack", "star", "L", "ring"] {
        let surface = solid(name);
        let error = |n: u32| Accuracy::of(&surface, &cluster(&surface, n, Fit::Volume)).largest();
        let (few, many) = (error(50), error(300));
        assert!(many < 0.6 * few, "{name}: {few} {many}");
    }
}

/// Of every kind of solid: 300 spheres of a block of 0.2 x 0.4 x 0.6 m were worse than 64, 300 of a jack worse than 50, and
/// plates had the same holes with 4 000 as with 300.
#[test]
#[ignore = "long"]
fn more_spheres_are_never_worse() {
    for name in [
        "cube:0.41",
        "box:0.2,0.4,0.6",
        "box:2,1,0.1",
        "box:2,0.2,0.2",
        "ead_block:0.41",
        "norm_rock_221:0.05",
        "random_convex:0.5,0.4,0.3,7",
        "ellipsoid:1,0.1,0.1",
        "disc",
        "column",
        "ring",
        "bowl",
        "L",
        "jack",
        "star",
        "scan",
    ] {
        let surface = solid(name);
        let mut last = f64::INFINITY;
        for spheres in [8, 48, 300] {
            let error = Accuracy::of(&surface, &cluster(&surface, spheres, Fit::Volume)).largest();
            assert!(error < 1.1 * last, "{name}, {spheres} spheres: {error} m after {last} m");
            last = error;
        }
    }
}

/// Points on both surfaces, ever finer where they are furthest apart: between the three balls around a hole in a plate the
/// statement was a quarter too small, along a ray that grazed a sphere it was larger than the hole is deep.
#[test]
#[ignore = "long"]
fn the_largest_error_is_what_ever_finer_points_on_both_surfaces_find() {
    for (name, spheres) in [
        ("cube:0.41", 300),
        ("box:0.2,0.4,0.6", 8),
        ("box:2,1,0.2", 64),
        ("box:2,1,0.1", 300),
        ("box:2,1,0.1", 1000),
        ("box:2,0.2,0.2", 64),
        ("norm_rock_221:0.05", 8),
        ("ellipsoid:0.3,0.2,0.15", 8),
        ("ead_block:0.41", 300),
        ("ellipsoid:1,0.1,0.1", 30),
        ("disc", 64),
        ("column", 100),
        ("ring", 64),
        ("bowl", 64),
        ("pipe", 64),
        ("L", 64),
        ("jack", 300),
        ("star", 64),
        ("scan", 300),
    ] {
        let surface = solid(name);
        let (cluster, stated) = measured(&surface, &wish(spheres, Fit::Volume), |_| ());
        let (stated, sampled) = (stated.largest(), Sampled::of(&surface, &cluster).largest());
        assert!(sampled <= 1.003 * stated, "{name}, {spheres}: {sampled} sampled, {stated} stated");
        assert!(stated <= 1.1 * sampled, "{name}, {spheres}: {stated} stated, {sampled} sampled");
    }
}

#[test]
#[ignore = "long"]
fn spheres_that_are_to_stay_inside_have_a_radius_and_stay_inside() {
    for (name, spheres) in [
        ("cube:0.41", 20),
        ("box:2,1,0.01", 40),
        ("box:2,1,0.1", 64),
        ("box:2,0.2,0.2", 30),
        ("ead_block:0.41", 3),
        ("ellipsoid:1,0.1,0.1", 12),
        ("sphere:0.2", 8),
        ("disc", 40),
        ("column", 20),
        ("ring", 24),
        ("pipe", 50),
        ("bowl", 30),
        ("L", 30),
        ("jack", 60),
        ("star", 40),
        ("scan", 50),
    ] {
        let surface = solid(name);
        let cluster = cluster(&surface, spheres, Fit::Inside);
        assert!(!cluster.is_empty() && cluster.iter().all(|s| s.radius > 0.0), "{name}: {cluster:?}");
        // By corners and points of the surface, and by the signs of the centres: none lies in a sphere.
        let size = surface.size();
        let nearest = (0..surface.triangles.len())
            .flat_map(|t| {
                let [a, b, c] = surface.corners(t);
                [a, (a + b) / 2.0, (a + b + c) / 3.0]
            })
            .map(|p| to_spheres(&p, &cluster))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest > -1e-9 * size, "{name}: {nearest}");
        let outside = Accuracy::of(&surface, &cluster).outside;
        assert!(outside < 1e-9 * size, "{name}: {outside}");
    }
}

pub fn run(arguments: &[&str]) -> (i32, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_dem-solver")).arg("cluster").args(arguments).output().expect("runs");
    let text = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&text).into_owned())
}

/// A plate of 10 cm, and eight spheres: none keeps the bound. The number that is named instead does.
#[test]
#[ignore = "long"]
fn a_cluster_beyond_the_bound_is_refused_with_a_number_of_spheres_that_keeps_it() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("c.xyzr").display().to_string();
    for (shape, spheres, more) in [
        ("box:2,1,0.1", "8", vec![]),
        ("box:2,0.2,0.2", "4", vec![]),
        ("ead_block:0.41", "20", vec!["--largest-error", "0.01"]),
        ("ellipsoid:1,0.1,0.1", "5", vec!["--fit", "inside"]),
    ] {
        let make = |n: &str| run(&[&[shape, "-n", n, "-o", &file], more.as_slice()].concat());
        let (code, text) = make(spheres);
        assert_eq!(code, 2, "{text}");
        assert!(!std::path::Path::new(&file).exists(), "nothing is written");
        assert!(text.contains(&format!("{spheres} spheres lie up to")), "{text}");
        let named = text.split("`--spheres ").nth(1).and_then(|rest| rest.split('`').next());
        let (code, text) = make(named.unwrap_or_else(|| panic!("{text}")));
        assert_eq!(code, 0, "{text}");
        std::fs::remove_file(&file).expect("written");
    }
    let (code, text) = run(&["box:2,1,0.1", "-n", "8", "--largest-error", "2", "-o", &file]);
    assert_eq!(code, if text.contains("groups") || text.contains("volume of") { 2 } else { 0 }, "{text}");
    let (code, text) = run(&["ead_block:0.41", "-n", "64", "--largest-error", "0.001", "-o", &file]);
    assert!(code == 2 && text.contains("bound of 1.000e-3 m (asked for)"), "{text}");
    // A millimetre thick: no number that is possible keeps it, and no lattice fits into memory.
    let (code, text) = run(&["box:2,1,0.001", "-n", "64", "-o", &file]);
    assert!(code == 2 && text.contains("more than 50000 spheres are required"), "{text}");
    let (code, text) = run(&["box:2,1,0.01", "-n", "64", "--method", "lattice", "-o", &file]);
    assert!(code == 2 && text.contains("takes at least"), "{text}");
}

#[test]
#[ignore = "long"]
fn a_scene_whose_spheres_do_not_stand_for_its_rock_is_refused_at_their_number() {
    let refused = |rock: &str| {
        let text =
            format!("end_time = 1.0\n[[rock]]\nposition = [0.0, 0.0, 1.0]\ndensity = 2600.0\n{rock}\n");
        let scene = Scene::from_text("test.toml", &text).expect("a scene");
        DemSolver::new(&scene, &Options::default()).err().map(|e| e.to_string())
    };
    let plate = "shape = { type = \"box\", size = [2.0, 1.0, 0.1] }\n";
    let few = refused(&format!("{plate}cluster = {{ spheres = 8, method = \"medial\" }}")).expect("refused");
    assert!(few.starts_with("test.toml:6:") && few.contains("8 spheres lie up to"), "{few}");
    let few = refused(&format!("{plate}cluster = {{ spheres = 8 }}")).expect("refused");
    assert!(few.contains("a lattice in a box") && few.contains("8 were asked for"), "{few}");
    let cube = "shape = { type = \"box\", size = [0.4, 0.4, 0.4] }\n";
    let sharp =
        refused(&format!("{cube}cluster = {{ spheres = 64, largest_error = 0.01 }}")).expect("refused");
    assert!(sharp.contains("beyond cluster.largest_error"), "{sharp}");
    assert_eq!(refused(&format!("{cube}cluster = {{ spheres = 64, largest_error = 0.06 }}")), None);
}

/// What the check of a scene hands over is what the run reads: the same spheres bit for bit, and they are not made again.
#[test]
fn the_cluster_that_a_check_has_made_is_not_made_again() {
    let dir = tempfile::tempdir().expect("a directory");
    let file = dir.path().join("scene.toml");
    let scene = "end_time = 1.0\n[[rock]]\nname = \"block\"\nposition = [0.0, 0.0, 5.0]\ndensity = 2600.0\n\
                 shape = { type = \"ead_block\", size = 0.5 }\ncluster.spheres = 20\n";
    std::fs::write(&file, scene).expect("written");
    let scene = || Scene::load(&file, &[]).unwrap_or_else(|e| panic!("{e}"));
    let spheres = || {
        let solver = DemSolver::new(&scene(), &Options::default()).unwrap_or_else(|e| panic!("{e}"));
        solver.model().rocks[0].spheres.clone()
    };
    let report = dem_solver::check::check(&scene()).unwrap_or_else(|e| panic!("{e}"));
    let text = &report.clusters["block"];
    let made = spheres();
    std::fs::create_dir(dir.path().join("clusters")).expect("created");
    let kept = dir.path().join("clusters/block.xyzr");
    std::fs::write(&kept, text).expect("written");
    assert_eq!(spheres(), made);
    // A cluster for the same wish with one sphere less: if it is read, it was not made.
    let surface = solid("ead_block:0.5");
    let bound = Bound::of(&surface, None);
    let fewer = files::read_text(text.as_bytes()).expect("spheres")[1..].to_vec();
    let wish = wish(20, Fit::Volume);
    std::fs::write(&kept, kept::text(&surface, &wish, &bound, &fewer)).expect("written");
    assert_eq!(spheres().len(), 19);
    std::fs::write(&kept, format!("{}1\n", text.trim_end())).expect("written");
    assert_eq!(spheres(), made, "changed by hand: made again");
    let again = dem_solver::check::check(&scene()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(&again.clusters["block"], text);
}

/// Clusters of thick solids, on which figures of scenes depend, have not changed.
#[test]
fn a_plate_is_no_reason_to_change_a_block() {
    let block = builtin::cut_cube(Vector3::repeat(0.41));
    let made = cluster(&block, 300, Fit::Volume);
    let error = Accuracy::of(&block, &made).largest();
    // 4.29 mm: 4.13 mm as stated before corners between three spheres were computed.
    assert!((4.25e-3..4.35e-3).contains(&error), "{error}");
}

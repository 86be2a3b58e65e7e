//! Field files: what their arrays say, against closed forms, read back as ParaView does.

use crate::common::{Run, off, scene};
use base64::Engine as _;
use fem_solver::FemSolver;
use interface_defs::message::Plan;
use std::io::Read as _;
use std::path::Path;
use toolkit::program::Options;

/// The array `name` of a VTU file.
pub fn array(file: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(file).unwrap();
    let at = text.find(&format!("Name=\"{name}\"")).unwrap_or_else(|| panic!("no array {name}"));
    let offset: usize =
        text[at..].split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let data = &text[text.find("base64\">\n_").unwrap() + 10..][offset..];
    let engine = base64::engine::general_purpose::STANDARD;
    let word =
        |bytes: &[u8], i: usize| u64::from_le_bytes(bytes[8 * i..8 * i + 8].try_into().unwrap()) as usize;
    // One block: its number, two sizes, its packed size; 32 bytes are 44 letters.
    let header = engine.decode(&data[..44]).unwrap();
    assert_eq!(word(&header, 0), 1, "one block");
    let packed = word(&header, 3);
    let bytes = engine.decode(&data[44..44 + packed.div_ceil(3) * 4]).unwrap();
    let mut out = Vec::new();
    flate2::read::ZlibDecoder::new(&bytes[..packed]).read_to_end(&mut out).unwrap();
    out.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect()
}

/// Lines of a part in a field file: place along x and height of both ends.
pub fn lines(file: &Path, part: f64) -> Vec<[(f64, f64); 2]> {
    let (points, parts) = (array(file, "Points"), array(file, "part"));
    // Integers of 64 bits, read as numbers of as many.
    let ends: Vec<usize> = array(file, "connectivity").iter().map(|x| x.to_bits() as usize).collect();
    let at = |node: usize| (points[3 * node], points[3 * node + 2]);
    let own = ends.chunks_exact(2).zip(&parts).filter(|(_, p)| **p == part);
    own.map(|(line, _)| [at(line[0]), at(line[1])]).collect()
}

/// Run `text` for one window and give the directory of its fields.
fn fields(text: &str, dir: &Path) -> std::path::PathBuf {
    let options = Options { out: Some(dir.to_owned()), shortcuts: true };
    let solver = FemSolver::new(&scene(text), &options).unwrap_or_else(|e| panic!("{e}"));
    let mut run = Run::of(solver, Plan { end_time: 0.1, window: 0.1, ..Plan::default() });
    run.step(0.1, &[]);
    dir.join("fields")
}

/// A cantilever of four beams along x, 2 m long, with a load on its tip, and a rope and a bar of known strength.
fn structure(load: &str) -> String {
    format!(
        r#"
end_time = 0.1
[structure]
nodes = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 5.0, 0.0], [1.0, 5.0, 0.0], [1.0, 6.0, 0.0]]
supports = [{{ nodes = [0], rotations = "xyz" }}, {{ nodes = [5, 7] }}, {{ nodes = [6], directions = "yz" }}]
loads = [{{ nodes = [4], {load} }}, {{ nodes = [6], force = [1000.0, 0.0, 0.0] }}]
groups = [{{ name = "tip", nodes = [4] }}]
[structure.cable]
young = 1e11
area = 1e-4
density = 7850.0
[[structure.parts]]
name = "bar"
element = "cable"
cells = [[5, 6]]
rupture_force = 4000.0
[[structure.parts]]
name = "post"
element = "beam"
cells = [[0, 1], [1, 2], [2, 3], [3, 4]]
young = 2e11
area = 4e-3
inertia = [2e-5, 8e-6]
torsion = 3e-6
density = 7850.0
up = [0.0, 0.0, 1.0]
[[structure.parts]]
name = "rope"
element = "sliding_cable"
cells = [[6, 7]]
young = 1e11
area = 1e-4
density = 7850.0
prestress = 1e7
rupture_force = 2e4
[fem]
integrator = "static"
[output]
fields = 0.1
"#
    )
}

#[test]
fn moments_of_a_cantilever_are_those_of_statics() {
    // M = P (L - x), towards the load; small: P L^2 / E I = 1e-5, its tip moves by 1e-5 of its length.
    let load = 10.0;
    for (force, plane) in [("[0.0, 0.0, 10.0]", 1), ("[0.0, -10.0, 0.0]", 2)] {
        let dir = tempfile::tempdir().unwrap();
        let fields = fields(&structure(&format!("force = {force}")), dir.path());
        let file = fields.join("structure_000002.vtu");
        let parts = array(&file, "part");
        assert_eq!(parts, [1.0, 2.0, 2.0, 2.0, 2.0, 3.0]);
        for element in 0..4 {
            let x = 0.5 * element as f64;
            for (end, at) in [("start", x), ("end", x + 0.5)] {
                let moment = |p: i32| array(&file, &format!("bending_moment_{p}_{end}"))[1 + element];
                let exact = load * (2.0 - at);
                // The second cross axis is x times z, -y: a force towards it bends towards it.
                assert!(
                    (moment(plane) - exact).abs() < 1e-4 * load,
                    "{force} {element} {end}: {}",
                    moment(plane)
                );
                assert!(moment(3 - plane).abs() < 1e-6 * load, "{}", moment(3 - plane));
            }
        }
        for beamless in ["bending_moment_1_start", "torsion"] {
            let values = array(&file, beamless);
            assert_eq!((values[0], values[5]), (0.0, 0.0));
        }
    }
}

#[test]
fn axial_force_torsion_and_utilisation_are_what_acts() {
    let dir = tempfile::tempdir().unwrap();
    let fields = fields(&structure("force = [-300.0, 0.0, 0.0], moment = [7.0, 0.0, 0.0]"), dir.path());
    let file = fields.join("structure_000002.vtu");
    let (force, torsion, used) =
        (array(&file, "axial_force"), array(&file, "torsion"), array(&file, "utilisation"));
    for element in 1..5 {
        assert!(
            off(force[element], -300.0) < 1e-6 && off(torsion[element], 7.0) < 1e-6,
            "{force:?} {torsion:?}"
        );
    }
    // Stress is force over section, of posts too.
    let stress = array(&file, "stress");
    assert!(stress[1..5].iter().all(|s| off(*s, -300.0 / 4e-3) < 1e-6), "{stress:?}");
    // The bar takes 1000 N of its 4000 N; the rope hangs across with its prestress: 1000 N of 20 kN. Posts have no strength.
    assert!(off(used[0], force[0] / 4000.0) < 1e-12 && off(force[0], 1000.0) < 1e-2, "{used:?} {force:?}");
    assert!(off(used[5], force[5] / 2e4) < 1e-12 && off(force[5], 1000.0) < 1e-3, "{used:?} {force:?}");
    assert!(used[1..5].iter().all(|u| *u == 0.0) && used.iter().all(|u| u.is_finite()));
    let legend = std::fs::read_to_string(fields.join("structure_legend.json")).unwrap();
    for line in ["\"1\": \"bar\"", "\"2\": \"post\"", "\"3\": \"rope\"", "\"0\": \"none\""] {
        assert!(legend.contains(line), "{legend}");
    }
    let groups = array(&file, "group");
    let tip = legend.split("\"group\"").nth(1).unwrap().lines().find(|l| l.contains("\"tip\"")).unwrap();
    let number: f64 = tip.trim().trim_start_matches('"').split('"').next().unwrap().parse().unwrap();
    assert_eq!(
        (groups[4], groups.iter().filter(|g| **g == number).count()),
        (number, 1),
        "{groups:?} {legend}"
    );
}

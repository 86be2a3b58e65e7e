use super::*;
use crate::shape::builtin;
use crate::shape::surface::joined;

fn from_soup(corners: &[[Vector3<f64>; 3]]) -> Result<(Surface, Vec<String>), String> {
    let (points, triangles) = joined(corners);
    Surface::from_indexed(points, triangles)
}

fn soup(surface: &Surface) -> Vec<[Vector3<f64>; 3]> {
    (0..surface.triangles.len()).map(|t| surface.corners(t)).collect()
}

fn cube() -> Vec<[Vector3<f64>; 3]> {
    soup(&builtin::cuboid(Vector3::repeat(1.0)))
}

#[test]
fn loose_triangles_become_one_surface_and_keep_their_corners() {
    let (surface, notes) = from_soup(&cube()).expect("closed");
    assert_eq!((surface.points.len(), surface.triangles.len()), (8, 12));
    assert!(notes.is_empty());
    assert!((SolidIntegrals::of(&surface).volume - 1.0).abs() < 1e-15);
}

#[test]
fn noise_of_single_precision_is_joined_and_told() {
    let mut noisy = cube();
    for (t, triangle) in noisy.iter_mut().enumerate() {
        for (k, p) in triangle.iter_mut().enumerate() {
            *p += Vector3::repeat(1e-8 * ((t * 3 + k) as f64).sin());
        }
    }
    let (surface, notes) = from_soup(&noisy).expect("closed");
    assert_eq!(surface.points.len(), 8);
    assert_eq!(notes, ["28 corners were joined with their neighbours"]);
}

#[test]
fn single_triangles_that_face_the_other_way_are_turned_and_told() {
    let mut mixed = cube();
    for t in [2, 7, 8] {
        mixed[t].swap(0, 1);
    }
    let (surface, notes) = from_soup(&mixed).expect("turned");
    assert!((SolidIntegrals::of(&surface).volume - 1.0).abs() < 1e-15);
    assert_eq!(notes, ["3 triangles were turned to face as their neighbours do"]);
}

#[test]
fn each_flaw_is_refused_with_its_reason_and_place() {
    let refused = |triangles: &[[Vector3<f64>; 3]]| from_soup(triangles).expect_err("a flaw");
    let all = cube();
    let open = refused(&all[..11]);
    assert!(open.starts_with("the surface is open: 3 edges") && open.contains("of triangle"), "{open}");
    let inverted: Vec<_> = all.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let (surface, notes) = from_soup(&inverted).expect("turned");
    assert!((SolidIntegrals::of(&surface).volume - 1.0).abs() < 1e-15 && notes[0].contains("inside out"));
    let mut flat = all.clone();
    flat[4] = [flat[4][0], flat[4][1], (flat[4][0] + flat[4][1]) / 2.0];
    assert!(refused(&flat).contains("triangle 5"), "{}", refused(&flat));
    let mut branched = all.clone();
    branched.push([all[0][0], all[0][1], Vector3::new(5.0, 5.0, 5.0)]);
    assert!(refused(&branched).contains("3 triangles share the edge"), "{}", refused(&branched));
    let mut nan = all.clone();
    nan[6][1].y = f64::NAN;
    assert_eq!(refused(&nan), "triangle 7 has a coordinate that is not a finite number");
    let apart: Vec<_> = all.iter().map(|t| t.map(|p| 2.0 * p + Vector3::repeat(9.0))).collect();
    let two = refused(&[all.clone(), apart.clone()].concat());
    assert!(two.starts_with("the surface is 2 separate pieces: a rock is one."), "{two}");
    for piece in [
        "Piece 1: 12 triangles from number 1, 1.000e0 m3",
        "Piece 2: 12 triangles from number 13, 8.000e0 m3",
    ] {
        assert!(two.contains(piece), "{two}");
    }
    // A smaller one inside that faces inwards is a hollow.
    let hollow: Vec<_> = all.iter().map(|[a, b, c]| [a * 0.5, c * 0.5, b * 0.5]).collect();
    assert!(refused(&[all.clone(), hollow].concat()).contains("-1.250e-1 m3 (a hollow"));
    let (points, triangles) = joined(&[all.clone(), apart].concat());
    let one = |piece: Option<u32>| {
        let mend = Mend { piece: piece.map(PieceChoice::Number), ..Mend::default() };
        Surface::mended(points.clone(), triangles.clone(), &mend)
    };
    let volumes = [1, 2].map(|k| SolidIntegrals::of(&one(Some(k)).expect("one").0).volume);
    assert!((volumes[0] - 1.0).abs() < 1e-12 && (volumes[1] - 8.0).abs() < 1e-12, "{volumes:?}");
    assert_eq!(one(Some(3)), Err("there is no piece 3: the surface has 2, counted from 1".into()));
    assert!(refused(&[]).contains("0 triangles"));
}

/// A tetrahedron one of whose corners is pushed through the opposite face turns inside out; a prism
/// that is twisted too far runs through itself.
#[test]
fn a_surface_that_runs_through_itself_is_refused_with_the_two_triangles() {
    let mut spike = builtin::ellipsoid(Vector3::repeat(1.0), 2);
    // One corner is pulled through the opposite side.
    spike.points[0] *= -1.3;
    let flaw = Surface::from_indexed(spike.points, spike.triangles).expect_err("crossing");
    assert!(flaw.starts_with("the surface runs through itself") && flaw.contains("cross near"), "{flaw}");
}

//! `dem-solver cluster`: a shape to a file of spheres, with its error.

use crate::cluster::lattice::lattice;
use crate::cluster::{Accuracy, Bound, Fit, MOST_SPHERES, Wish, files};
use crate::geometry::sphere::Sphere;
use crate::rock::solid::Solid;
use crate::settings::rock::Method;
use crate::shape::pieces::PieceChoice;
use crate::shape::spec::NAMES;
use crate::shape::{Shape, Surface};
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::io::{IsTerminal, Write};
use std::path::Path;
use toolkit::arguments::ClusterArguments;
use toolkit::exit::Exit;
use toolkit::program::Extra;
use toolkit::screen::show;
use toolkit::vtu::{Cells, Vtu};

/// Arguments for the number of spheres and the largest error, as messages name them.
const NAMED: [&str; 2] = ["--spheres", "--largest-error"];

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

fn command() -> clap::Command {
    ClusterArguments::augment_args(
        clap::Command::new("cluster")
            .bin_name("rockfall cluster")
            .about("Fill a closed surface with overlapping spheres, and print its error")
            .after_help(format!(
                "SHAPE is a file (.stl, .obj) or one of {NAMES}.\n\
                 Mass, centre and inertia of a rock always come from its shape, never from the spheres.\n\
                 In a scene: cluster = {{ spheres = N }} makes the same cluster, cluster = {{ file = \"FILE\" }} reads it."
            )),
    )
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let arguments =
        ClusterArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    if arguments.spheres > MOST_SPHERES {
        let what = format!("{} spheres: 1 to {MOST_SPHERES} are possible", arguments.spheres);
        return Err(Diagnostic::in_file("--spheres", what));
    }
    for (name, value) in [("--smallest-radius", arguments.smallest_radius), ("--scale", arguments.scale)] {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(Diagnostic::in_file(
                name,
                format!("{value} m: it must be a finite number, 0 or more"),
            ));
        }
    }
    let mut shape = Shape::parse(&arguments.shape, arguments.scale)?;
    match &mut shape {
        Shape::Mesh { close_holes, piece, .. } => {
            *close_holes = arguments.close_holes;
            *piece = arguments.piece.as_deref().map(PieceChoice::from);
        }
        _ if arguments.close_holes || arguments.piece.is_some() => {
            return Err(Diagnostic::in_file(
                &arguments.shape,
                "a built-in shape has neither holes nor pieces",
            )
            .try_instead("leave --close-holes and --piece out"));
        }
        _ => {}
    }
    // Known before minutes are spent.
    for file in arguments.vtu.iter().chain([&arguments.output]) {
        check_directory(file)?;
    }
    let (solid, notes) = Solid::new(&shape)?;
    let (surface, _) = shape.surface(false)?;
    if let Some(largest) = arguments.largest_error.filter(|e| !(*e > 0.0 && e.is_finite())) {
        let what = format!("{largest} m: a finite number above 0 is required");
        return Err(Diagnostic::in_file("--largest-error", what));
    }
    let (spheres, accuracy) = spheres(&shape, &surface, &arguments)?;
    let header = header(&shape, &solid, &spheres, &accuracy, &arguments);
    write(&arguments.output, files::text(&header, &spheres).as_bytes())?;
    if let Some(file) = &arguments.vtu {
        write(file, &picture(&spheres))?;
    }
    let mut text = header.join("\n") + "\n";
    let asked = arguments.spheres as usize;
    let fewer = (spheres.len() < asked).then(|| match arguments.method.as_str() {
        "medial" => {
            format!(
                "of {asked} spheres {} cover the shape down to the chords of its triangles",
                spheres.len()
            )
        }
        _ => format!("{} of {asked} spheres fill the box evenly", spheres.len()),
    });
    for note in notes.into_iter().chain(fewer) {
        text += &format!("note: {note}\n");
    }
    show(&text);
    Ok(Exit::Done)
}

fn spheres(
    shape: &Shape,
    surface: &Surface,
    arguments: &ClusterArguments,
) -> Result<(Vec<Sphere>, Accuracy), Diagnostic> {
    let measured = |spheres: Vec<Sphere>| {
        let accuracy = Accuracy::of(surface, &spheres);
        (spheres, accuracy)
    };
    let method = if arguments.method == "lattice" { Method::Lattice } else { Method::Medial };
    match (shape, method) {
        (Shape::Box { size }, Method::Lattice) => {
            lattice(*size, arguments.spheres, arguments.largest_error, NAMED).map(|l| measured(l.spheres()))
        }
        (_, Method::Lattice) => {
            Err(Diagnostic::in_file("--method lattice", "a lattice fills a box, not this shape")
                .try_instead("leave --method out"))
        }
        // All others would lie inside of it.
        (Shape::Sphere { radius }, Method::Medial) => {
            Ok(measured(vec![Sphere { centre: Vector3::zeros(), radius: *radius }]))
        }
        (_, Method::Medial) => {
            let fit = match arguments.fit.as_str() {
                "inside" => Fit::Inside,
                "largest" => Fit::Largest,
                _ => Fit::Volume,
            };
            let wish = Wish { spheres: arguments.spheres, fit, smallest_radius: arguments.smallest_radius };
            let watched = std::io::stderr().is_terminal();
            let made = Bound::of(surface, arguments.largest_error).make(surface, &wish, NAMED, |done| {
                if watched {
                    let _ = write!(std::io::stderr(), "\rmaking the cluster: {:3.0} %", 100.0 * done);
                }
            });
            if watched {
                let _ = writeln!(std::io::stderr());
            }
            made
        }
    }
}

fn header(
    shape: &Shape,
    solid: &Solid,
    spheres: &[Sphere],
    accuracy: &Accuracy,
    arguments: &ClusterArguments,
) -> Vec<String> {
    let volume = solid.volume();
    let [[i1, i2, i3], [x, y, z]]: [[f64; 3]; 2] = [solid.inertia(volume).into(), solid.body.centre.into()];
    let ClusterArguments { shape: named, method, fit, .. } = arguments;
    let (least, most) =
        spheres.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), s| (l.min(s.radius), m.max(s.radius)));
    vec![
        format!("dem-solver {} cluster {named}", env!("CARGO_PKG_VERSION")),
        format!("shape: {}", shape.describe()),
        format!("volume {volume:.9e} m3 = mass over density; centre of mass {x:.9e} {y:.9e} {z:.9e} m"),
        format!("principal moments of inertia over density {i1:.9e} {i2:.9e} {i3:.9e} m5"),
        format!("{} spheres ({method}, {fit}), radius {least:.6e} to {most:.6e} m", spheres.len()),
        format!("error: {accuracy}"),
    ]
}

fn picture(spheres: &[Sphere]) -> Vec<u8> {
    let points: Vec<f64> = spheres.iter().flat_map(|s| [s.centre.x, s.centre.y, s.centre.z]).collect();
    let radius: Vec<f64> = spheres.iter().map(|s| s.radius).collect();
    let point_data = vec![("radius", 1, radius.as_slice())];
    Vtu { points: &points, cells: Cells::Vertices, point_data, cell_data: vec![] }.to_bytes()
}

fn check_directory(file: &Path) -> Result<(), Diagnostic> {
    let parent = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if parent.is_dir() && !file.is_dir() {
        return Ok(());
    }
    Err(Diagnostic::in_file(file.display(), "no file can be written there")
        .try_instead("make its directory first"))
}

fn write(file: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    toolkit::files::write(file, bytes)
        .map_err(|e| Diagnostic::in_file(file.display(), format!("the file cannot be written: {e}")))
}

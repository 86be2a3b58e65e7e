//! `dem-solver ground`: heights of the terrain around a line, as an ESRI grid, for what is built on it.
//!
//! They are those of the surface that rocks touch, whatever the file of the terrain holds.

use super::Terrain;
use super::raster::Raster;
use super::settings::TerrainSettings;
use super::system;
use clap::{ArgMatches, Args, FromArgMatches};
use interface_defs::diagnostic::Diagnostic;
use toolkit::exit::Exit;
use toolkit::ground::GroundArguments;
use toolkit::program::Extra;
use toolkit::scene::Scene;
use toolkit::screen::show;

/// The subcommand.
pub const COMMAND: Extra = Extra { command, run };

/// Most heights that are written.
const MAX_HEIGHTS: f64 = 1e7;

fn command() -> clap::Command {
    GroundArguments::augment_args(
        clap::Command::new("ground")
            .about("Write heights of the scene's terrain around a line, as an ESRI grid")
            .after_help("What stands on the terrain names the file: structure.generator.ground. `rockfall` does both by itself."),
    )
}

fn run(matches: &ArgMatches) -> Result<Exit, Diagnostic> {
    let arguments = GroundArguments::from_arg_matches(matches).map_err(|e| Diagnostic::new(e.to_string()))?;
    let scene = arguments.input.load()?;
    let raster = around(&scene, &arguments)?;
    raster.write_asc(&arguments.output).map_err(|e| {
        Diagnostic::in_file(arguments.output.display(), format!("the heights cannot be written: {e}"))
    })?;
    let [columns, rows] = raster.counts;
    show(&format!(
        "{}: {columns} x {rows} heights, {} m apart\n",
        arguments.output.display(),
        arguments.cell
    ));
    Ok(Exit::Done)
}

/// Heights of the terrain of `scene` around the line of `arguments`, NaN where there is no terrain.
pub fn around(scene: &Scene, arguments: &GroundArguments) -> Result<Raster, Diagnostic> {
    let fault = |what: String| match &arguments.key {
        Some(key) => scene.invalid(key, what),
        None => Diagnostic::in_file("--line", what),
    };
    for (name, value) in [("--margin", arguments.margin), ("--cell", arguments.cell)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Diagnostic::in_file(name, format!("{value} m: it must be a finite number above 0")));
        }
    }
    let (points, rest) = arguments.line.as_chunks::<2>();
    if points.is_empty() || !rest.is_empty() || arguments.line.iter().any(|v| !v.is_finite()) {
        let what = format!("{} numbers are no points", arguments.line.len());
        return Err(fault(what).try_instead("x and y of each point, in metres"));
    }
    let settings = TerrainSettings::of(scene)?.ok_or_else(|| {
        scene.invalid("terrain", "the scene has no [terrain], whose heights could be written")
    })?;
    let own = system::of_file(&scene.resolve(&settings.file)).map(u32::from);
    if let Some((line, own)) = arguments.epsg.zip(own).filter(|(line, own)| line != own) {
        let what = format!("the layer of the line is in EPSG:{line}, and the terrain in EPSG:{own}");
        return Err(fault(what).try_instead("save the layer in the coordinate system of the terrain"));
    }
    let terrain = Terrain::of(scene, &settings)?;
    for [x, y] in points {
        if terrain.highest_at(*x, *y).is_none() {
            let [from, to] = terrain.extent();
            let what = format!(
                "the point x = {x}, y = {y} m lies beside the terrain or in a hole of it: it has x {:.1} to {:.1}, y {:.1} to {:.1} m",
                from.x, to.x, from.y, to.y
            );
            return Err(
                fault(what).try_instead("the line is in the coordinates of the terrain's file, in metres")
            );
        }
    }
    let axis = |a: usize| points.iter().map(move |p| p[a]);
    let cell = arguments.cell;
    let from = |a: usize| ((axis(a).fold(f64::INFINITY, f64::min) - arguments.margin) / cell).floor();
    let to = |a: usize| ((axis(a).fold(f64::NEG_INFINITY, f64::max) + arguments.margin) / cell).ceil();
    let (corner, counts) = ([from(0), from(1)], [to(0) - from(0) + 1.0, to(1) - from(1) + 1.0]);
    if counts[0] * counts[1] > MAX_HEIGHTS {
        let what =
            format!("{:e} heights {cell} m apart: {MAX_HEIGHTS:e} are possible", counts[0] * counts[1]);
        return Err(fault(what).try_instead("a shorter line, or a larger --cell"));
    }
    let counts = counts.map(|n| n as usize);
    let at = |axis: usize, k: usize| (corner[axis] + k as f64) * cell;
    let heights = (0..counts[1]).rev().flat_map(|row| {
        let terrain = &terrain;
        (0..counts[0]).map(move |column| terrain.highest_at(at(0, column), at(1, row)).unwrap_or(f64::NAN))
    });
    Ok(Raster { corner: [at(0, 0), at(1, 0)], spacing: [cell; 2], counts, heights: heights.collect() })
}

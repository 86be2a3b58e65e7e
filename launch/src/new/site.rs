//! A site: one fall over a terrain, a study of many, and a barrier on a line.

use super::{Project, fill, from, quoted, title};
use crate::check::plan::own_program;
use crate::front::shell;
use crate::front::stop::Stop;
use crate::run::children::{Events, ask};
use interface_defs::diagnostic::{Diagnostic, code};
use std::ffi::OsString;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use toolkit::coordinates::{Coordinates, Form};
use toolkit::files;
use toolkit::once::each_once;
use toolkit::raster::Raster;
use toolkit::scene::Scene;

/// Kinds of ground that a preset describes.
const GROUNDS: [&str; 6] = ["bedrock", "scree", "meadow", "soil", "wetland", "forest"];
/// Kits that come with the program.
const KITS: [(&str, &str); 2] = [
    ("example-100", include_str!("../../kits/example-100.toml")),
    ("example-1000", include_str!("../../kits/example-1000.toml")),
];
/// Largest raster that is read [cells].
const MAX_CELLS: usize = 1 << 22;

/// What a site consists of.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "A site")]
pub struct SiteArguments {
    /// Terrain: .asc, .tif, .grd, .xyz, .las, .laz, .stl or .obj, in metres
    #[arg(long, value_name = "FILE", conflicts_with = "kind")]
    terrain: Option<PathBuf>,
    /// Where rocks start: a polygon (GeoJSON, in the terrain's coordinates)
    #[arg(long, value_name = "FILE", conflicts_with = "kind")]
    release: Option<PathBuf>,
    /// Ground where no zone lies: bedrock, scree, meadow, soil, wetland or forest [default: scree]
    #[arg(long, value_name = "GROUND", value_parser = GROUNDS, conflicts_with = "kind")]
    ground: Option<String>,
    /// Other ground within a polygon, as in --zone meadow=meadow.geojson; may be repeated, the last one counts
    #[arg(long, value_name = "GROUND=FILE", value_parser = zone, conflicts_with = "kind")]
    zone: Vec<(String, PathBuf)>,
    /// Line on which rocks are counted and a barrier stands (GeoJSON)
    #[arg(long, value_name = "FILE", conflicts_with = "kind")]
    line: Option<PathBuf>,
    /// Barrier kit: example-100 or example-1000 (kJ), or a file; needs --line [default: example-1000]
    #[arg(long, value_name = "KIT", requires = "line")]
    kit: Option<String>,
    /// Median volume of the rocks [m3]
    #[arg(long, value_name = "M3", default_value_t = 0.5)]
    volume: f64,
    /// Spheres of a rock
    #[arg(long, value_name = "N", default_value_t = 300)]
    spheres: usize,
    /// Rocks of the study
    #[arg(long, value_name = "N", default_value_t = 200)]
    count: usize,
}

fn zone(text: &str) -> Result<(String, PathBuf), String> {
    let (ground, file) = text.split_once('=').ok_or("GROUND=FILE is needed, as in meadow=meadow.geojson")?;
    match GROUNDS.contains(&ground) {
        true => Ok((ground.into(), file.into())),
        false => Err(format!("no ground `{ground}`; there are {}", GROUNDS.join(", "))),
    }
}

impl SiteArguments {
    /// With answers to questions in the place of what is missing.
    pub fn completed(&self, ask: &mut dyn FnMut(&str) -> Option<String>) -> Result<Self, Stop> {
        let mut all = self.clone();
        let asks = all.terrain.is_none() || all.release.is_none();
        let mut need = |value: &mut Option<PathBuf>, question: &str| {
            *value = value.take().or_else(|| ask(question).map(PathBuf::from));
        };
        need(&mut all.terrain, "Terrain (file)");
        need(&mut all.release, "Where rocks start (GeoJSON polygon)");
        if asks {
            need(&mut all.line, "Line of a barrier (GeoJSON, empty: none)");
            let question = format!("Ground: {} (empty: scree)", GROUNDS.join(", "));
            all.ground = all.ground.or_else(|| ask(&question));
        }
        if all.terrain.is_none() || all.release.is_none() {
            let what = "a site needs --terrain FILE and --release POLYGON; or name --drop-test, --net MESH or --solver LANGUAGE";
            return Err(Stop::input(code::ARGUMENT, what));
        }
        if let Some(ground) = all.ground.as_ref().filter(|ground| !GROUNDS.contains(&ground.as_str())) {
            let what = format!("no ground `{ground}`; there are {}", GROUNDS.join(", "));
            return Err(Stop::input(code::ARGUMENT, what));
        }
        if !(all.volume.is_finite() && all.volume > 0.0 && all.volume < 1e4)
            || all.spheres == 0
            || all.count == 0
        {
            let what = "--volume takes 0 to 10 000 m3, --spheres and --count at least 1";
            return Err(Stop::input(code::ARGUMENT, what));
        }
        Ok(all)
    }
}

/// A file of the site.
struct Layer {
    /// As a scene of the directory names it.
    name: String,
    points: Coordinates,
}

fn layer(dir: &Path, file: &Path, form: Form, option: &str) -> Result<Layer, Stop> {
    let name = from(dir, file)?;
    let whole =
        std::path::absolute(file).map_err(|e| Stop::input(code::FILE, format!("{}: {e}", file.display())))?;
    let scene = Scene::from_text("", "")?;
    let points = Coordinates::of_file(whole)
        .read(form, option, &scene)
        .map_err(|e| Stop::input(e.code, format!("{option}: {}", e.message)))?;
    Ok(Layer { name, points })
}

/// The files of a site.
pub fn project(dir: &Path, asked: SiteArguments) -> Result<Project, Stop> {
    let (terrain, release) = (asked.terrain.unwrap_or_default(), asked.release.unwrap_or_default());
    let (ground, volume) = (asked.ground.unwrap_or_else(|| "scree".into()), asked.volume);
    let terrain_name = from(dir, &terrain)?;
    let source = layer(dir, &release, Form::Polygon, "--release")?;
    let line = asked.line.map(|file| layer(dir, &file, Form::Line, "--line")).transpose()?;

    // Each kind of ground once: what a table says counts for all of its zones.
    let grounds = each_once(asked.zone.iter().map(|(material, _)| material));
    let mut zones = String::new();
    for (material, file) in &asked.zone {
        let polygon = quoted(&layer(dir, file, Form::Polygon, "--zone")?.name);
        let _ = write!(zones, "\n[[terrain.zone]]\nmaterial = \"{material}\"\npolygon = {polygon}\n");
    }
    let [low, high] = [0.6, 1.4].map(|share| share * impact(&ground));
    let mut contacts = contact("ground", &ground);
    grounds.iter().for_each(|material| contacts += &contact(material, material));

    let place =
        [0, 1].map(|axis| source.points.iter().map(|p| p[axis]).sum::<f64>() / source.points.len() as f64);
    let mut values = vec![
        ("TITLE", title("One rock from ", &release)),
        ("TITLES", title("Rocks from ", &release)),
        ("VOLUME", format!("{volume:?}")),
        ("SPHERES", asked.spheres.to_string()),
        ("TERRAIN", quoted(&terrain_name)),
        ("ZONES", zones),
        ("CONTACTS", contacts),
        ("POLYGON", quoted(&source.name)),
        ("COUNT", asked.count.to_string()),
        ("VARIED", format!("contact.0.rolling_friction_impact = {{ uniform = [{low:.2}, {high:.2}] }}")),
    ];
    let above = height(&terrain, place, source.points.system())? + 1.5 * volume.cbrt();
    values.push(("POSITION", format!("[{:.2}, {:.2}, {above:.2}]", place[0], place[1])));
    let mut files = vec![("fall.toml", fill(include_str!("fall.toml"), &values))];
    let lines = line
        .as_ref()
        .map_or(String::new(), |line| fill(include_str!("line.toml"), &[("FILE", quoted(&line.name))]));
    values.push(("LINE", lines));
    files.push(("study.toml", fill(include_str!("study.toml"), &values)));
    let file = |name: &str| shell::join([dir.join(name)]);
    let [fall, study, barrier] = ["fall.toml", "study.toml", "barrier.toml"].map(file);
    let mut next = vec![format!("rockfall run {fall}"), format!("rockfall ensemble {study}")];
    if let Some(line) = line {
        let kit = asked.kit.as_deref().unwrap_or(KITS[1].0);
        let text = match KITS.iter().find(|(name, _)| *name == kit) {
            Some((_, text)) => (*text).to_owned(),
            None => files::read_text(Path::new(kit)).map_err(|e| {
                let known = KITS.map(|(name, _)| name).join(", ");
                Stop::input(
                    code::FILE,
                    format!("--kit {kit}: it cannot be read: {e}; kits that come with the program: {known}"),
                )
            })?,
        };
        let [first, last] = [line.points.first(), line.points.last()].map(|p| p.copied().unwrap_or_default());
        let (dx, dy) = (last[0] - first[0], last[1] - first[1]);
        let length = dx.hypot(dy);
        let across = format!("[{:.6}, {:.6}, 0.0]", dy / length, -dx / length);
        let values = [
            ("FILE", quoted(&line.name)),
            ("ACROSS", across),
            ("TITLE", title("A barrier on ", Path::new(&line.name))),
        ];
        files.push(("barrier.toml", fill(include_str!("barrier.toml"), &values)));
        files.push(("kit.toml", text));
        next.push(format!("rockfall ensemble {study} --barrier {barrier} --worst 10"));
    }
    Ok(Project { files, next })
}

/// Losses of spin in impacts, as they were calibrated on similar ground (docs/measured-falls.md).
fn impact(preset: &str) -> f64 {
    match preset {
        "bedrock" => 0.7,
        "meadow" | "wetland" => 0.2,
        _ => 0.5,
    }
}

/// A table of rock and ground.
fn contact(material: &str, preset: &str) -> String {
    let impact = impact(preset);
    format!(
        "[[contact]]\nbetween = [\"rock\", \"{material}\"]\npreset = \"{preset}\"\nrolling_friction = 0.1\n\
         rolling_friction_impact = {impact}\n\n"
    )
}

/// Height of the terrain at a place in the release area [m], by the program that reads terrains, which also compares the coordinate systems.
fn height(terrain: &Path, place: [f64; 2], system: Option<u32>) -> Result<f64, Stop> {
    let scratch =
        tempfile::tempdir().map_err(|e| Stop::failed(code::FILE, format!("a temporary directory: {e}")))?;
    let (scene, heights) = (scratch.path().join("terrain.toml"), scratch.path().join("heights.asc"));
    let absolute = std::path::absolute(terrain)
        .map_err(|e| Stop::input(code::FILE, format!("{}: {e}", terrain.display())))?;
    let text = format!("end_time = 1.0\n[terrain]\nfile = {}\n", quoted(&absolute.display().to_string()));
    let fault = |e| Stop::failed(code::FILE, format!("a temporary file: {e}"));
    files::write(&scene, text.as_bytes()).map_err(fault)?;
    let [x, y] = place;
    let mut words: Vec<OsString> =
        vec!["ground".into(), scene.into(), format!("--line={x},{y},{},{y}", x + 1.0).into()];
    words.extend(["--margin=2", "--cell=0.5", "--key=release"].map(OsString::from));
    words.extend(system.map(|code| format!("--epsg={code}").into()));
    words.extend(["-o".into(), heights.clone().into_os_string()]);
    let about = |e: Diagnostic| Diagnostic {
        place: None,
        message: format!("--release, its middle: {}", e.message),
        ..e
    };
    ask(&own_program("dem-solver")?, &words, &Events::watch()?)
        .map_err(|stop| Stop { errors: stop.errors.into_iter().map(about).collect(), ..stop })?;
    let bytes = files::read(&heights, files::STATE).map_err(fault)?;
    let raster = Raster::read_asc(&bytes, MAX_CELLS)
        .map_err(|_| Stop::failed(code::OTHER, "the heights of the terrain cannot be read"))?;
    raster.nearest(x, y).ok_or_else(|| {
        Stop::input(
            code::ARGUMENT,
            format!("--release: the terrain has no height in the middle of the polygon, at ({x}, {y})"),
        )
    })
}

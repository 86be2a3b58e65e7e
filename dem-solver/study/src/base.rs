//! What all members of a study share: the scene, its terrain, its rocks, the laws; built once.

use super::grid::{self, Grid};
use super::sampling::Sampler;
use super::settings::{Release, Sampling, StudySettings, Varied};
use dem_contact::contact::whole_rock::Whole;
use dem_contact::rock::Rock;
use dem_contact::settings::{RockSettings, Settings, Shape};
use dem_rocks::DemSolver;
use dem_rocks::model::Model;
use dem_rocks::results::map::sheet::Imprint;
use dem_solid::cluster::kept;
use dem_solid::geometry::plan::{Area, Point};
use dem_terrain::Terrain;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toolkit::coordinates::Form;
use toolkit::files;
use toolkit::limits::Limits;
use toolkit::program::Options;
use toolkit::scene::Scene;

/// A rock that members scale: the scene's own, or one of `vary.shape`.
pub struct Prototype {
    /// Its table.
    pub table: RockSettings,
    /// The rock before its scene scales it.
    pub rock: Rock,
    /// How its scene scales it.
    pub scale: f64,
    /// Its mass in the scene [kg].
    pub mass: f64,
    /// What its contact as a whole needs, before it is scaled.
    pub whole: Option<Whole>,
    /// Its spheres for a file, where making them takes time ([`dem_solid::cluster::kept`]).
    pub made: Option<String>,
}

impl Prototype {
    fn new(table: RockSettings, mut rock: Rock, whole: bool) -> Self {
        let (mut scale, mass) = (1.0, rock.mass);
        let made = rock.made.take();
        if let Some(own) = rock.unscaled.take() {
            (rock, scale) = (own.0.clone(), own.1);
        }
        rock.made = None;
        let whole = whole.then(|| Whole::new(&rock));
        Self { table, rock, scale, mass, whole, made }
    }
}

/// What all members share.
pub struct Base {
    /// What the study says.
    pub study: StudySettings,
    /// The scene.
    pub scene: Scene,
    /// Its values.
    pub document: toml::Table,
    /// What they mean.
    pub settings: Settings,
    /// Its bounds of trust.
    pub limits: Limits,
    /// The terrain.
    pub ground: Arc<Terrain>,
    /// The rocks.
    pub prototypes: Vec<Prototype>,
    /// The spheres of the scene's own rock for a file, where making them takes time.
    own: Option<String>,
    /// Drawn numbers of each release.
    pub samplers: Vec<Sampler>,
    /// Of what varies the numbers that all members of a replicate share, which [`crate::calibrate`] chooses: which, and the value of each
    /// replicate. Otherwise none.
    pub shared: Vec<(usize, Vec<f64>)>,
    /// Areas of the releases that have one, local [m].
    pub areas: Vec<Option<Area>>,
    /// The cells of the maps, where there are any.
    pub grid: Option<Grid>,
    /// The lines, local [m].
    pub lines: Vec<Vec<Point>>,
    /// Number of the first member of each release, from 0, and of all members of a replicate.
    pub starts: Vec<u64>,
    /// What the user should look at twice.
    pub warnings: Vec<Diagnostic>,
    /// What the results depend on, in a few letters.
    pub fingerprint: String,
    /// Whether savings may be used.
    pub shortcuts: bool,
}

impl Base {
    /// Read a study, its scene and its terrain; spheres that were made before are looked for in the folders `clusters` too.
    /// [`crate::gate::read`] checks it and knows its fingerprint.
    pub(super) fn new(file: &Scene, shortcuts: bool, clusters: &[PathBuf]) -> Result<Self, Diagnostic> {
        let study = StudySettings::of(file)?;
        let path = file.resolve(&study.scene);
        if path.canonicalize().ok() == file.path().canonicalize().ok() {
            let cure = "name the scene of one fall, with [[rock]], [terrain] and [[contact]]";
            return file.refuse("scene", "the study names itself", cure);
        }
        let scene = Scene::load(&path, &[])?;
        check_scene(&scene, file)?;
        let limits = Limits::of(&scene)?;
        let mut document = scene.document()?;
        let solver = DemSolver::with_kept(&scene, &Options { out: None, shortcuts }, clusters)?;
        let warnings = [solver.notices(), solver.cautions()].concat();
        let model = solver.into_model();
        let Some(ground) = model.ground.clone() else {
            let what = format!("{} has no [terrain]", scene.path().display());
            return file.refuse("scene", what, "releases need a terrain to fall on");
        };
        let own = model.rocks.first().and_then(|rock| rock.made.clone());
        let prototypes = prototypes(&study, file, &scene, model, clusters)?;
        let settings = Settings::of(&scene)?;
        put_zones(&mut document, &settings);
        let local = |all: &[Point]| all.iter().map(|place| local(&ground, place)).collect::<Vec<_>>();
        let area = |release: &Release| {
            let place = release.place();
            (place.form == Form::Polygon).then(|| Area::new(&local(place.corners)))
        };
        let areas = study.releases.iter().map(area).collect();
        let grid = study.maps.as_ref().map(|maps| Grid::new(&ground, maps.cell));
        let lines = study.lines.iter().map(|line| local(&line.points)).collect();
        let mut starts = vec![0];
        study.counts().iter().for_each(|count| starts.push(starts[starts.len() - 1] + count));
        let base = Self {
            samplers: samplers(&study),
            shared: Vec::new(),
            study,
            scene,
            document,
            settings,
            limits,
            ground,
            prototypes,
            own,
            areas,
            grid,
            lines,
            starts,
            warnings,
            fingerprint: String::new(),
            shortcuts,
        };
        base.check(file)?;
        Ok(base)
    }

    /// Write the spheres that were made for its rocks to a folder, where they are not there yet: no later start makes them again.
    pub fn keep_clusters(&self, folder: &Path) -> io::Result<()> {
        let name = &self.settings.rocks[0].name;
        let shapes = self.study.varies(Varied::Shape).then_some(&self.prototypes);
        let shapes = shapes.into_iter().flatten().zip(1..).map(|(shape, number)| (Some(number), &shape.made));
        for (shape, made) in [(None, &self.own)].into_iter().chain(shapes) {
            let Some(text) = made else { continue };
            let file = kept::file(folder, name, shape);
            if !files::read(&file, files::TEXT).is_ok_and(|known| known == text.as_bytes()) {
                files::Dir::create(folder)?;
                files::write(&file, text.as_bytes())?;
            }
        }
        Ok(())
    }

    /// A place seen from above in local coordinates [m].
    pub fn local(&self, place: &Point) -> Point {
        local(&self.ground, place)
    }

    /// Number of members of a replicate.
    pub fn replicate(&self) -> u64 {
        self.starts[self.starts.len() - 1]
    }

    /// Number of members.
    pub fn members(&self) -> u64 {
        self.replicate() * self.study.replicates
    }

    /// The same study with so many replicates.
    pub fn repeat(&mut self, replicates: u64) {
        self.study.replicates = replicates;
        self.samplers = samplers(&self.study);
    }

    /// Whether the trajectories of members are followed.
    pub fn follows(&self) -> bool {
        self.grid.is_some() || !self.lines.is_empty()
    }

    /// Whether the trajectory of a member is drawn: of each replicate evenly spread ones, and no more than the study asks for in all.
    /// That does not depend on the number of replicates.
    pub fn draws(&self, number: u64) -> bool {
        let most = self.study.maps.as_ref().map_or(0, |maps| u64::from(maps.trajectories));
        let (own, index) = (self.replicate(), number - 1);
        let every = own.div_ceil(most.max(1));
        (index % own).is_multiple_of(every) && (index / own + 1) * own.div_ceil(every) <= most
    }
}

fn local(ground: &Terrain, [x, y]: &Point) -> Point {
    [x - ground.origin.x, y - ground.origin.y]
}

/// Put the corners of zones into a scene where it names their files: no member reads them again.
fn put_zones(document: &mut toml::Table, settings: &Settings) {
    let own = settings.terrain.iter().flat_map(|terrain| &terrain.zone);
    let tables = document.get_mut("terrain").and_then(|terrain| terrain.get_mut("zone")?.as_array_mut());
    for (table, zone) in tables.into_iter().flatten().filter_map(toml::Value::as_table_mut).zip(own) {
        if let Some(Ok(corners)) = zone.polygon.as_ref().map(toml::Value::try_from) {
            table.insert("polygon".into(), corners);
        }
    }
}

/// The drawn numbers of each release.
fn samplers(study: &StudySettings) -> Vec<Sampler> {
    let of = |(at, count): (usize, &u64)| {
        Sampler::new(study.sampling, study.seed, at, [*count, study.replicates], drawn(study, at))
    };
    study.counts().iter().enumerate().map(of).collect()
}

/// What is drawn for a member of release number `at`, with its levels in a full factorial.
fn drawn(study: &StudySettings, at: usize) -> Vec<(String, u64)> {
    let factorial = study.sampling == Sampling::FullFactorial;
    let places = if factorial { study.releases[at].count() } else { 0 };
    let own = ["place", "place across", "turn 1", "turn 2", "turn 3", "axis 1", "axis 2"];
    let mut all: Vec<(String, u64)> =
        own.iter().map(|name| ((*name).to_owned(), if *name == "place" { places } else { 0 })).collect();
    all.extend(study.variables[at].iter().map(|v| (v.name.clone(), v.distribution.levels)));
    all
}

fn check_scene(scene: &Scene, file: &Scene) -> Result<(), Diagnostic> {
    let refuse =
        |what: &str, cure: &str| file.refuse("scene", format!("{}: {what}", scene.path().display()), cure);
    if scene.has("structure") {
        let what = "it has a [structure], and members of a study fall over terrain alone";
        return refuse(what, "leave it out");
    }
    if scene.has("spheres") || scene.has("box") {
        let what = "it has [[spheres]] or a [box], and a member of a study is one rock on terrain";
        return refuse(what, "leave them out");
    }
    let rocks: Vec<toml::Table> = scene.read("rock")?.unwrap_or_default();
    match rocks.len() {
        1 => Ok(()),
        n => refuse(&format!("it has {n} rocks, and a member of a study is one rock"), "keep one [[rock]]"),
    }
}

/// The table of the one rock of a scene.
pub fn rock_of(document: &mut toml::Table) -> Option<&mut toml::Table> {
    document.get_mut("rock")?.get_mut(0)?.as_table_mut()
}

/// Give a rock another shape.
pub fn put_shape(rock: &mut toml::Table, shape: &toml::Value) {
    rock.insert("shape".into(), shape.clone());
    // A sphere is one sphere.
    if shape.get("type").and_then(toml::Value::as_str) == Some("sphere") {
        rock.remove("cluster");
    }
}

/// The scene's rock, or one of each shape that is chosen from.
fn prototypes(
    study: &StudySettings,
    file: &Scene,
    scene: &Scene,
    mut model: Model,
    clusters: &[PathBuf],
) -> Result<Vec<Prototype>, Diagnostic> {
    let shapes = study.varied().iter().find(|v| v.quantity == Varied::Shape);
    let whole = model.wholes.pop().flatten().is_some();
    let own = model.rocks.pop().zip(model.settings.rocks.pop());
    let (rock, table) = own.expect("checked: there is one rock");
    let Some(values) = shapes.and_then(|v| v.distribution.values()) else {
        return Ok(vec![Prototype::new(table, rock, whole)]);
    };
    let of = |value: &toml::Value| {
        let refuse = |e: String| file.invalid("vary.shape", e);
        let shape = file.read_value::<Shape>("vary.shape", value)?;
        shape.check().map_err(|(key, what)| refuse(format!("{key}: {what}")))?;
        let mut document = scene.document()?;
        if let Some(rock) = rock_of(&mut document) {
            put_shape(rock, value);
        }
        let scene = scene.patched(document);
        let table = Settings::of(&scene)?.rocks.swap_remove(0);
        let (rock, _) = Rock::new(0, &table, &scene, clusters)?;
        Ok(Prototype::new(table, rock, whole))
    };
    values.iter().map(of).collect()
}

/// What is wrong with a place that lies beside the terrain, as far as it can be guessed.
fn guess([x, y]: Point, [low, high]: [Vector3<f64>; 2]) -> String {
    let within = |x: f64, y: f64| (low.x..=high.x).contains(&x) && (low.y..=high.y).contains(&y);
    let terrain =
        format!("the terrain lies from ({:.1}, {:.1}) to ({:.1}, {:.1})", low.x, low.y, high.x, high.y);
    match () {
        () if within(y, x) => format!("{terrain}; x and y may be exchanged"),
        () if low.x > 1e3
            && within(low.x + x, low.y + y)
            && (x > 180.0 || y > 90.0 || x.fract() + y.fract() == 0.0) =>
        {
            format!("{terrain}; it may count from the terrain's corner: ({}, {})", low.x + x, low.y + y)
        }
        () if x.abs() <= 180.0 && y.abs() <= 90.0 && low.x.abs() > 1e3 => {
            format!("{terrain}; it may be in degrees of longitude and latitude")
        }
        () => terrain,
    }
}

impl Base {
    fn check(&self, file: &Scene) -> Result<(), Diagnostic> {
        self.check_masses(file)?;
        self.check_layers(file)?;
        self.check_places(file)?;
        self.check_lines(file)?;
        let size = self.ground.highest - self.ground.lowest;
        let cell = self.study.maps.as_ref().and_then(|maps| maps.cell);
        match cell.filter(|cell| (size.x / cell + 1.0) * (size.y / cell + 1.0) > grid::MAX_CELLS) {
            None => Ok(()),
            Some(cell) => {
                let (x, y, most) = (size.x, size.y, grid::MAX_CELLS);
                let what =
                    format!("cells of {cell} m on a terrain of {x:.0} m x {y:.0} m are more than {most:.0e}");
                file.refuse("maps.cell", what, "make them larger, or leave `cell` out")
            }
        }
    }

    /// Refuse a mass that nothing turns into a volume.
    fn check_masses(&self, file: &Scene) -> Result<(), Diagnostic> {
        let dense = self.study.varies(Varied::Density) || self.prototypes[0].table.density.is_some();
        for (quantity, name) in [(Varied::Mass, "mass"), (Varied::Volume, "volume")] {
            if self.study.varies(quantity) && !dense {
                let what = format!("{name} varies, and the rock of the scene has no density");
                let cure = "write density in place of mass in the scene";
                return file.refuse(&format!("vary.{name}"), what, cure);
            }
        }
        Ok(())
    }

    /// The code of the coordinate system that the terrain's file names, or the `.prj` beside it.
    pub fn system(&self) -> Option<u16> {
        Imprint::system(&self.scene, self.settings.terrain.as_ref())
    }

    /// Refuse releases and lines of layers in another coordinate system than that of the terrain.
    fn check_layers(&self, file: &Scene) -> Result<(), Diagnostic> {
        let named = self.study.maps.as_ref().and_then(|maps| maps.epsg);
        let own = self.system().map(u32::from).or(named);
        for (at, release) in self.study.releases.iter().enumerate() {
            for (name, _, all) in release.geometries() {
                if let Some(all) = all {
                    all.check_system(own, &format!("release.{at}.{name}"), file)?;
                }
            }
        }
        for (at, line) in self.study.lines.iter().enumerate() {
            line.points.check_system(own, &format!("line.{at}.points"), file)?;
        }
        Ok(())
    }

    /// Lowest and highest corner of the terrain, in its own coordinates.
    fn extent(&self) -> [Vector3<f64>; 2] {
        [self.ground.lowest, self.ground.highest].map(|corner| corner + self.ground.origin)
    }

    /// Refuse lines that lie beside all of the terrain.
    fn check_lines(&self, file: &Scene) -> Result<(), Diagnostic> {
        let [low, high] = self.extent();
        for (at, line) in self.study.lines.iter().enumerate() {
            let beside = |axis: usize| {
                line.points.iter().all(|p| p[axis] < low[axis])
                    || line.points.iter().all(|p| p[axis] > high[axis])
            };
            if beside(0) || beside(1) {
                let what = format!("the line `{}` lies beside the terrain", line.name);
                return file.refuse(&format!("line.{at}.points"), what, guess(line.points[0], [low, high]));
            }
        }
        Ok(())
    }

    /// Refuse places without ground.
    fn check_places(&self, file: &Scene) -> Result<(), Diagnostic> {
        let [low, high] = self.extent();
        for (at, release) in self.study.releases.iter().enumerate() {
            let place = release.place();
            for (k, corner @ [x, y]) in place.corners.iter().enumerate() {
                let key = format!("release.{at}.{}.{k}", place.key);
                if !(low.x..=high.x).contains(x) || !(low.y..=high.y).contains(y) {
                    let what = format!("({x}, {y}) lies beside the terrain");
                    return file.refuse(&key, what, guess(*corner, [low, high]));
                }
                if self.ground.ground_at(self.local(corner)).is_none() {
                    let what = format!("there is no ground at ({x}, {y}): the terrain has a hole there");
                    return file.refuse(&key, what, "move the release, or fill the hole");
                }
            }
        }
        Ok(())
    }
}

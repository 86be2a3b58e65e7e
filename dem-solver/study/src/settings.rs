//! The study file: which scene, how many releases from where, what varies; and what editors know of it.

use super::capacity::Capacity;
use super::design::Design;
pub use super::vary::{Variable, Varied};
use super::vary::{of_release, variables};
use dem_solid::geometry::plan;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::PathBuf;
use toolkit::coordinates::{Coordinates, Form};
use toolkit::scene::Scene;

/// The key that adds members to a study without making it another one.
pub const REPLICATES: &str = "replicates";

/// Keys that no record of a fall depends on: replicates are added without changing any, and the others are judged afterwards.
const AFTERWARDS: [&str; 4] = [REPLICATES, "title", "most_failed", REPORT];

/// The key without which `rockfall` writes the report of a study.
pub(crate) const REPORT: &str = "report";
/// The same inside of tables.
const AFTERWARDS_IN: [(&str, &[&str]); 3] = [
    ("release", &["name", "blocks_per_year"]),
    ("line", &["name", "design", "barrier"]),
    ("maps", &["epsg"]),
];

/// What is left of a study without all that no record of a fall depends on.
pub fn of_falls(mut study: toml::Table) -> toml::Table {
    study.retain(|key, _| !AFTERWARDS.contains(&key));
    for (name, keys) in AFTERWARDS_IN {
        let tables = match study.get_mut(name) {
            Some(toml::Value::Array(all)) => all.iter_mut().filter_map(toml::Value::as_table_mut).collect(),
            Some(toml::Value::Table(one)) => vec![one],
            _ => vec![],
        };
        tables.into_iter().for_each(|table| table.retain(|key, _| !keys.contains(&key)));
    }
    study
}

/// Most members of a release that a Sobol sequence has: indices of 16 bits.
pub const MAX_OF_SOBOL: u64 = 1 << 16;

/// How the members of a study are spread over what varies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Independent of each other.
    Random,
    /// One member in each of as many equal parts of every distribution as there are members.
    #[default]
    LatinHypercube,
    /// A scrambled Sobol sequence: even in several distributions at once.
    Sobol,
    /// Every level of each distribution with every level of all others.
    FullFactorial,
}

/// Where rocks start. Exactly one of `points`, `line` and `polygon`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Release {
    /// Its name in the table of members. Default `release_1` and so on.
    #[serde(default)]
    pub name: String,
    /// Points `[x, y]` [m] in the terrain's coordinates, or a GeoJSON file; members take turns.
    pub points: Option<Coordinates>,
    /// A polyline of points `[x, y]` [m], or a GeoJSON file: members start evenly along it.
    pub line: Option<Coordinates>,
    /// Corners `[x, y]` [m] of an area, closed by itself, or a GeoJSON file: members start evenly in it, as seen from above.
    pub polygon: Option<Coordinates>,
    /// Number of members; with `full_factorial` number of places. Default with `points`: one for each.
    pub count: Option<u32>,
    /// Blocks that start here in a year, on average; of all releases or of none. Each member stands for its part of them, and lines and
    /// maps have annual frequencies.
    pub blocks_per_year: Option<f64>,
    /// Height of the rock above where it would touch the ground [m]. Default 0.
    #[serde(default)]
    pub height: f64,
    /// Distributions of this release that go before those of `[vary]`, which has the same keys for all others; not `shape`.
    #[schemars(with = "Option<Map<String, Value>>")]
    pub vary: Option<toml::Table>,
}

/// The geometry of a release.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place<'a> {
    /// Its key in the study.
    pub key: &'static str,
    /// What its corners are.
    pub form: Form,
    /// Its corners.
    pub corners: &'a [[f64; 2]],
}

impl Release {
    /// With the points of its files in their place.
    fn read(&mut self, key: &str, study: &Scene) -> Result<(), Diagnostic> {
        let geometries = self.geometries().map(|(name, form, all)| {
            all.as_ref().map(|all| all.read(form, &format!("{key}.{name}"), study)).transpose()
        });
        let [points, line, polygon] = geometries;
        (self.points, self.line, self.polygon) = (points?, line?, polygon?);
        Ok(())
    }

    /// What may say where it is, by its key.
    pub fn geometries(&self) -> [(&'static str, Form, &Option<Coordinates>); 3] {
        [
            ("points", Form::Points, &self.points),
            ("line", Form::Line, &self.line),
            ("polygon", Form::Polygon, &self.polygon),
        ]
    }

    /// Where; checked that there is exactly one.
    pub fn place(&self) -> Place<'_> {
        let there = self.geometries().into_iter().find(|(.., corners)| corners.is_some());
        let (key, form, corners) = there.unwrap_or(("polygon", Form::Polygon, &None));
        Place { key, form, corners: corners.as_deref().unwrap_or_default() }
    }

    /// Number of members, or of places.
    pub fn count(&self) -> u64 {
        let points = self.points.as_ref().map_or(0, |points| points.len() as u64);
        self.count.map_or(points, u64::from)
    }
}

/// Rasters of what passes where. Presence is the switch.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Maps {
    /// Edge of a cell [m]. Default: some 300 cells along the longer side of the terrain.
    pub cell: Option<f64>,
    /// EPSG code of the terrain's coordinate system. Default: that of a GeoTIFF, or of a `.prj` beside the terrain.
    pub epsg: Option<u32>,
    /// Largest number of trajectories that are drawn: every second one, every third one, ... of the members. Default 200.
    #[serde(default = "trajectories")]
    pub trajectories: u32,
}

fn trajectories() -> u32 {
    200
}

/// A line across the slope, such as a barrier's; what passes it is recorded.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScreenLine {
    /// Its name: letters, digits, `_`, `-`. Default `line_1` and so on.
    #[serde(default)]
    pub name: String,
    /// Its points `[x, y]` [m] in the terrain's coordinates, or a GeoJSON file.
    pub points: Coordinates,
    /// What a barrier there must be able to do.
    pub design: Option<Design>,
    /// What a barrier there stops, by the first crossing of each member, in shares and, with `blocks_per_year`, in blocks a year. Members
    /// are not stopped in the fall itself; other lines have their measures twice, without and with the barriers before them.
    pub barrier: Option<Capacity>,
}

/// A study, checked as far as that goes without its terrain.
#[derive(Debug, Clone, PartialEq)]
pub struct StudySettings {
    /// Its title, for reports and pictures.
    pub title: Option<String>,
    /// The scene of which each member is a variant; relative to the study file.
    pub scene: PathBuf,
    /// Another number, other members.
    pub seed: u64,
    /// How they are spread.
    pub sampling: Sampling,
    /// How often all releases are drawn anew, each time with other members.
    pub replicates: u64,
    /// Where they start.
    pub releases: Vec<Release>,
    /// What else varies at each release, of all in the same order.
    pub variables: Vec<Vec<Variable>>,
    /// Whether the rock is turned at random, every orientation as likely as any other.
    pub turned: bool,
    /// The maps.
    pub maps: Option<Maps>,
    /// The lines.
    pub lines: Vec<ScreenLine>,
    /// Share of members that may fail or be unreliable in a study that is done.
    pub most_failed: f64,
}

/// What ends the names of results of a line that count what barriers on other lines leave.
pub const BEHIND: &str = "_with_barriers";

/// Largest number of members.
const MAX_MEMBERS: u64 = 10_000_000;

impl StudySettings {
    /// Read and check them.
    pub fn of(study: &Scene) -> Result<Self, Diagnostic> {
        let Some(scene) = study.read("scene")? else {
            let cure = "name the scene of one fall, as in scene = \"fall.toml\"";
            return study.refuse("scene", "the key `scene` is missing", cure);
        };
        let seed: i64 = study.read("seed")?.unwrap_or(1);
        let seed = u64::try_from(seed)
            .map_err(|_| study.invalid("seed", format!("a seed of {seed}: 0 or more is possible")))?;
        let mut releases: Vec<Release> = study.read("release")?.unwrap_or_default();
        if releases.is_empty() {
            let cure = "add a table [[release]] with points, line or polygon, and count";
            return study.refuse("release", "the study has no release", cure);
        }
        for (at, release) in releases.iter_mut().enumerate() {
            if release.name.is_empty() {
                release.name = format!("release_{}", at + 1);
            }
            release.read(&format!("release.{at}"), study)?;
            check_release(at, release, study)?;
        }
        for (at, release) in releases.iter().enumerate() {
            if releases[..at].iter().any(|other| other.name == release.name) {
                let what = format!("two releases are named `{}`", release.name);
                return study.refuse(&format!("release.{at}.name"), what, "give each a name of its own");
            }
        }
        let (all, turned) = variables(study)?;
        let own = releases.iter().enumerate();
        let own =
            own.map(|(at, it)| of_release(&all, it.vary.as_ref(), &format!("release.{at}.vary"), study));
        let variables = own.collect::<Result<_, _>>()?;
        let most_failed: f64 = study.read("most_failed")?.unwrap_or(0.01);
        if !(0.0..=1.0).contains(&most_failed) {
            let what = format!("most_failed = {most_failed}: it is a share, from 0 to 1");
            return study.refuse("most_failed", what, "5 % is 0.05");
        }
        study.read::<bool>(REPORT)?;
        let sampling = study.read("sampling")?.unwrap_or_default();
        let replicates: u32 = study.read(REPLICATES)?.unwrap_or(1);
        if replicates == 0 {
            return Err(
                study.invalid(REPLICATES, "replicates = 0: 1, the releases as they are, is the least")
            );
        }
        let maps: Option<Maps> = study.read("maps")?;
        if let Some(cell) = maps.as_ref().and_then(|maps| maps.cell).filter(|cell| *cell <= 0.0) {
            return Err(study.invalid("maps.cell", format!("cells of {cell} m: they must lie above 0")));
        }
        let lines = lines(study)?;
        let (title, replicates) = (study.read("title")?, replicates.into());
        let it = Self {
            title,
            scene,
            seed,
            sampling,
            replicates,
            releases,
            variables,
            turned,
            maps,
            lines,
            most_failed,
        };
        it.check(study)?;
        Ok(it)
    }

    /// Members per place of a release: the product of all levels.
    pub fn combinations(&self, release: usize) -> u64 {
        let levels = self.variables[release].iter().map(|v| v.distribution.levels);
        if self.sampling == Sampling::FullFactorial { levels.fold(1, u64::saturating_mul) } else { 1 }
    }

    /// What varies, for what is the same at all releases: names and quantities, but not distributions.
    pub fn varied(&self) -> &[Variable] {
        &self.variables[0]
    }

    /// A release of each set of distributions.
    pub fn variants(&self) -> Vec<usize> {
        let shared = self.releases.iter().position(|release| release.vary.is_none());
        (0..self.releases.len())
            .filter(|at| self.releases[*at].vary.is_some() || shared == Some(*at))
            .collect()
    }

    /// Number of members of each release in a replicate.
    pub fn counts(&self) -> Vec<u64> {
        let of = |(at, release): (usize, &Release)| release.count().saturating_mul(self.combinations(at));
        self.releases.iter().enumerate().map(of).collect()
    }

    /// Blocks a year of each release, where the study says so.
    pub fn rates(&self) -> Option<Vec<f64>> {
        self.releases.iter().map(|release| release.blocks_per_year).collect()
    }

    /// The names of two releases if a member of the first stands for fewer blocks a year than one of the second.
    pub fn unequal(&self) -> Option<[&str; 2]> {
        let rates = self.rates()?.into_iter().zip(self.counts()).map(|(rate, count)| rate / count as f64);
        let own: Vec<(f64, &str)> = rates.zip(self.releases.iter().map(|it| it.name.as_str())).collect();
        let few = own.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let many = own.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        (many.0 > few.0 * (1.0 + 1e-9)).then_some([few.1, many.1])
    }

    /// Number of members.
    pub fn members(&self) -> u64 {
        self.counts().iter().fold(0_u64, |a, b| a.saturating_add(*b)).saturating_mul(self.replicates)
    }

    /// What is wrong with replicates of a study in which nothing is random: intervals of the same members again would be too narrow.
    pub fn unrepeatable(&self) -> Option<&'static str> {
        let random = self.turned
            || self.varies(Varied::Spin)
            || self.releases.iter().any(|release| release.place().form == Form::Polygon);
        (self.sampling == Sampling::FullFactorial && !random).then_some(
            "nothing is random in this full factorial: a replicate would have the same members again",
        )
    }

    /// Most replicates that there can be.
    pub fn most_replicates(&self) -> u64 {
        let largest = self.counts().into_iter().max().unwrap_or(1);
        let of_sobol = if self.sampling == Sampling::Sobol { MAX_OF_SOBOL / largest } else { u64::MAX };
        of_sobol.min(MAX_MEMBERS * self.replicates / self.members())
    }

    /// Whether this quantity varies.
    pub fn varies(&self, quantity: Varied) -> bool {
        self.varied().iter().any(|v| v.quantity == quantity)
    }

    fn check(&self, study: &Scene) -> Result<(), Diagnostic> {
        let members = self.members();
        if members > MAX_MEMBERS {
            let what = format!("{members} members: up to {MAX_MEMBERS} are possible");
            return study.refuse("release", what, "lower count, or the levels in [vary]");
        }
        if self.sampling == Sampling::Sobol
            && let counts = self.counts().into_iter().map(|n| n.saturating_mul(self.replicates))
            && let Some((at, count)) = counts.enumerate().find(|(_, n)| *n > MAX_OF_SOBOL)
        {
            let what = format!("{count} members of one release: a Sobol sequence has {MAX_OF_SOBOL}");
            let cure = "sampling = \"latin_hypercube\"";
            return study.refuse(&format!("release.{at}.count"), what, cure);
        }
        let with = |given: bool| self.releases.iter().position(|it| it.blocks_per_year.is_some() == given);
        if let (Some(_), Some(without)) = (with(true), with(false)) {
            let what = "some releases have blocks_per_year, and this one has none";
            let cure = "all releases of a study have it, or none";
            return study.refuse(&format!("release.{without}"), what, cure);
        }
        let judged = self.lines.iter().position(|line| line.design.is_some());
        if let (Some(line), Some([few, many])) = (judged, self.unequal()) {
            let what = format!(
                "a design takes quantiles over members, and those of `{many}` stand for more blocks a year than those of `{few}`"
            );
            let cure =
                "make count of all releases proportional to blocks_per_year, or leave one of the two out";
            return study.refuse(&format!("line.{line}.design"), what, cure);
        }
        if let Some(what) = self.unrepeatable().filter(|_| self.replicates > 1) {
            return study.refuse(REPLICATES, what, "leave it out, or give distributions more levels");
        }
        if self.varies(Varied::Volume) && self.varies(Varied::Mass) {
            let what = "mass and volume together define one thing twice";
            return study.refuse("vary.mass", what, "vary volume and density");
        }
        Ok(())
    }
}

/// The lines, with the points of their files in their place.
pub fn read_lines(study: &Scene) -> Result<Vec<ScreenLine>, Diagnostic> {
    let mut lines: Vec<ScreenLine> = study.read("line")?.unwrap_or_default();
    for (at, line) in lines.iter_mut().enumerate() {
        line.points = line.points.read(Form::Line, &format!("line.{at}.points"), study)?;
    }
    Ok(lines)
}

/// The lines, each with a name of its own.
fn lines(study: &Scene) -> Result<Vec<ScreenLine>, Diagnostic> {
    let mut lines = read_lines(study)?;
    for at in 0..lines.len() {
        let line = &mut lines[at];
        if line.name.is_empty() {
            line.name = format!("line_{}", at + 1);
        }
        if !line.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
            let what =
                format!("`{}` cannot be the name of a file: letters, digits, `_` and `-` can", line.name);
            return Err(study.invalid(&format!("line.{at}.name"), what));
        }
        if plan::length(&line.points) <= 0.0 {
            let (key, cure) = (format!("line.{at}.points"), "points = [[x, y], [x, y]]");
            return study.refuse(&key, "a line without length", cure);
        }
        let sides: Vec<[[f64; 2]; 2]> = line.points.windows(2).map(|ends| [ends[0], ends[1]]).collect();
        let crosses = |k: usize| sides[..k.saturating_sub(1)].iter().any(|side| plan::cross(side, &sides[k]));
        if (0..sides.len()).any(crosses) {
            let cure = "list its points in order along it, or make two lines of it";
            return study.refuse(&format!("line.{at}.points"), "the line crosses itself", cure);
        }
        let name = line.name.clone();
        if name.ends_with(BEHIND) {
            let what = format!("`{name}`: names with `{BEHIND}` are those of results behind barriers");
            return Err(study.invalid(&format!("line.{at}.name"), what));
        }
        if lines[..at].iter().any(|other| other.name == name) {
            return Err(study.invalid(&format!("line.{at}.name"), format!("two lines are named `{name}`")));
        }
    }
    Ok(lines)
}

fn check_release(at: usize, release: &Release, study: &Scene) -> Result<(), Diagnostic> {
    let key = |name: &str| format!("release.{at}.{name}");
    if release.geometries().iter().filter(|(.., corners)| corners.is_some()).count() != 1 {
        let what = "exactly one of points, line and polygon says where it is";
        return study.refuse(&format!("release.{at}"), what, "polygon = [[x, y], [x, y], [x, y]]");
    }
    let Place { form, corners, key: own } = release.place();
    let (least, what) = match form {
        Form::Points => (1, "a point"),
        Form::Line => (2, "a line of two points"),
        Form::Polygon => (3, "an area of three corners"),
    };
    if corners.len() < least {
        let what = format!("{} points; {what} is the least", corners.len());
        return Err(study.invalid(&key(own), what));
    }
    match form {
        Form::Line if plan::length(corners) <= 0.0 => {
            return Err(study.invalid(&key("line"), "a line without length"));
        }
        Form::Points | Form::Line => {}
        Form::Polygon => plan::check_polygon(corners, &key("polygon"), study)?,
    }
    match release.count {
        Some(0) => return Err(study.invalid(&key("count"), "count = 0: a release has one member at least")),
        None if release.points.is_none() => {
            let cure = "add count = 1000, the number of members that start here";
            return study.refuse(&format!("release.{at}"), "the key `count` is missing here", cure);
        }
        _ => {}
    }
    if let Some(rate) = release.blocks_per_year.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
        let what = format!("blocks_per_year = {rate}: it must lie above 0");
        return study.refuse(&key("blocks_per_year"), what, "one block in 50 years is 0.02");
    }
    if release.height < 0.0 {
        let what = format!("height = {} m: 0 (on the ground) or more is possible", release.height);
        return Err(study.invalid(&key("height"), what));
    }
    Ok(())
}

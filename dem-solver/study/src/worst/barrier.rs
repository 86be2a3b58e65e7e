//! The barrier that members are run against: a scene with a structure on a line, without rock and terrain of its own.

use crate::base::{Base, rock_of};
use crate::member::{Member, put_motion};
use crate::runner::Flight;
use crate::settings::{ScreenLine, read_lines};
use dem_contact::settings::STRUCTURE;
use interface_defs::diagnostic::Diagnostic;
use std::path::Path;
use toml::{Table, Value};
use toolkit::arguments::EnsembleArguments;
use toolkit::ground::Area;
use toolkit::input_file::with_absolute_files;
use toolkit::scene::Scene;
use toolkit::start_from::{self, Origin};

/// Name of the line that a study gets for its barrier.
const NAME: &str = "barrier";
/// Points of two lines that are the same are this near to each other [m].
const SAME: f64 = 1e-6;
/// What a scene with a barrier takes from the study.
const OF_STUDY: [&str; 3] = ["rock", "terrain", "gravity"];

/// A barrier.
pub struct Barrier {
    scene: Scene,
    document: Table,
    /// Seconds that are computed after a member has reached the line.
    after: f64,
    /// Name of its line in the study.
    pub line: String,
    /// How far from its line it reaches [m].
    pub margin: f64,
}

impl Barrier {
    /// The barrier that the command line names, and the study with its line.
    /// `sets` are values that take the place of those of its scene.
    pub fn of(
        arguments: &EnsembleArguments,
        sets: &[String],
        study: Scene,
    ) -> Result<(Option<Self>, Scene), Diagnostic> {
        let Some(file) = &arguments.barrier else { return Ok((None, study)) };
        let site = arguments.site.as_deref().and_then(|text| serde_json::from_str::<Area>(text).ok());
        let area = site.ok_or_else(|| {
            let what = "where the barrier stands is not known here";
            Diagnostic::in_file("--barrier", what).try_instead("rockfall ensemble STUDY --barrier SCENE")
        })?;
        let scene = Scene::load(file, sets)?;
        let foreign = [("spheres", "separate spheres"), ("box", "a box")];
        if let Some((key, what)) = foreign.into_iter().find(|(key, _)| scene.has(key)) {
            let what = format!("a barrier that members of a study are run against has no place for {what}");
            return scene.refuse(key, what, format!("leave `{key}` out"));
        }
        let after = scene.end_time()?;
        let mut document = scene.document()?;
        with_absolute_files(&mut document, &scene)?;
        if let Some(start) = absolute_start(&scene)? {
            document.insert(start_from::KEY.into(), start);
        }
        let (line, study) = with_line(study, &area, &scene)?;
        Ok((Some(Self { scene, document, after, line, margin: area.margin }), study))
    }

    /// File of its scene.
    pub fn file(&self) -> &Path {
        self.scene.path()
    }

    /// Its name.
    pub fn name(&self) -> String {
        self.scene.name()
    }

    /// What of its scene nothing uses, for the user to know.
    pub fn notices(&self) -> Vec<String> {
        let note = |key: &str| {
            let file = self.scene.path().display();
            format!("{file}: `{key}` is not used: a member has that of the study")
        };
        // Gravity is the same everywhere.
        OF_STUDY[..2].iter().filter(|key| self.scene.has(key)).map(|key| note(key)).collect()
    }

    /// The scene of a member with this barrier, from its flight (or its release) on, until some time after it reaches the
    /// line at `crossing` [s].
    pub fn with(
        &self,
        base: &Base,
        member: &Member,
        flight: Option<&Flight>,
        crossing: f64,
    ) -> Result<Table, Diagnostic> {
        let mut own = base.scene_of(member)?;
        if let Some((flight, rock)) = flight.zip(rock_of(&mut own)) {
            put_motion(rock, [&flight.position, &flight.velocity, &flight.orientation, &flight.spin]);
        }
        let mut scene = self.document.clone();
        let contacts = self.contacts(&own)?;
        scene.insert("contact".into(), Value::Array(contacts));
        for key in OF_STUDY {
            scene.remove(key);
        }
        let gravity = base.settings.gravity.iter().map(|g| Value::Float(*g)).collect();
        scene.insert("gravity".into(), Value::Array(gravity));
        for key in ["rock", "terrain"] {
            scene.extend(own.remove(key).map(|table| (key.to_owned(), table)));
        }
        for key in ["dem", "limits"] {
            if let Some(table) = own.remove(key).filter(|_| !self.document.contains_key(key)) {
                scene.insert(key.into(), table);
            }
        }
        let start = flight.map_or(0.0, |flight| flight.time);
        // A round number is easier to read.
        let end = ((crossing - start + self.after) * 100.0).ceil() / 100.0;
        scene.insert("end_time".into(), end.into());
        let barrier = self.scene.name();
        scene.insert("title".into(), format!("Member {} against {barrier}", member.number).into());
        Ok(scene)
    }

    /// Laws of the ground as the study has them, those of the structure as the barrier has them. That of ground against the net
    /// would be many times too stiff: a barrier without its own is refused.
    fn contacts(&self, own: &Table) -> Result<Vec<Value>, Diagnostic> {
        let tables =
            |document: &Table| document.get("contact").and_then(Value::as_array).cloned().unwrap_or_default();
        let names = |table: &Value, wanted: &str| {
            let between = table.get("between").and_then(Value::as_array);
            between.map(|all| all.iter().any(|name| name.as_str() == Some(wanted)))
        };
        let rock = own.get("rock").and_then(|rocks| rocks.get(0));
        let material = rock.and_then(|rock| rock.get("material")).and_then(Value::as_str).unwrap_or("rock");
        let (ground, barrier) = (tables(own), tables(&self.document));
        let mut all: Vec<Value> =
            ground.into_iter().filter(|table| names(table, STRUCTURE) != Some(true)).collect();
        let named = barrier.iter().any(|table| names(table, STRUCTURE) == Some(true));
        let mut found = false;
        for mut table in barrier {
            match (names(&table, STRUCTURE), &mut table) {
                (Some(true), _) => {
                    found |= names(&table, material) == Some(true);
                    all.push(table);
                }
                // What holds for all pairs holds for the structure.
                (None, Value::Table(law)) if !named => {
                    law.insert("between".into(), vec![material, STRUCTURE].into());
                    all.push(table);
                    found = true;
                }
                _ => {}
            }
        }
        if found {
            return Ok(all);
        }
        let what = format!(
            "there is no [[contact]] of `{material}` and `{STRUCTURE}`, and that of the ground is not for a net"
        );
        let advice = format!(
            "add one to the barrier, as in\n[[contact]]\nbetween = [\"{material}\", \"{STRUCTURE}\"]\nlaw = \"linear\"\n\
             stiffness = 1e7\npoisson = 0.2\nrestitution = 0.5\nfriction = 0.4"
        );
        self.scene.refuse("contact", what, advice)
    }
}

/// The run that the structure starts from, so that every member finds it wherever its scene lies.
fn absolute_start(scene: &Scene) -> Result<Option<Value>, Diagnostic> {
    let Some(mut origin) = Origin::of(scene)? else { return Ok(None) };
    let refuse = |what: String| scene.invalid(start_from::KEY, what);
    origin.run = std::path::absolute(&origin.run).map_err(|e| refuse(e.to_string()))?;
    Value::try_from(&origin).map(Some).map_err(|e| refuse(e.to_string()))
}

/// Name of the line of the barrier in the study, and the study with it: its own, where it has one in the same place.
fn with_line(study: Scene, area: &Area, scene: &Scene) -> Result<(String, Scene), Diagnostic> {
    let lines = read_lines(&study)?;
    let near = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) <= SAME;
    let is_same = |line: &ScreenLine| {
        let (own, other) = (&line.points, &area.line);
        let same = own.iter().zip(other).all(|(a, b)| near(a, b));
        let turned = own.iter().rev().zip(other).all(|(a, b)| near(a, b));
        own.len() == other.len() && (same || turned)
    };
    if let Some(at) = lines.iter().position(is_same) {
        let name =
            if lines[at].name.is_empty() { format!("line_{}", at + 1) } else { lines[at].name.clone() };
        return Ok((name, study));
    }
    let points: Vec<String> = area.line.iter().map(|[x, y]| format!("[{x:?}, {y:?}]")).collect();
    let table = format!("[[line]]\nname = \"{NAME}\"\npoints = [{}]\n", points.join(", "));
    if let Some(at) = lines.iter().position(|line| line.name == NAME) {
        let what = format!("the line `{NAME}` of the study is not where {} stands", scene.path().display());
        let advice = format!("give it another name, or these points: points = [{}]", points.join(", "));
        return study.refuse(&format!("line.{at}.points"), what, advice);
    }
    // Without its name: the study is the same for all barriers on this line.
    let more = format!("\n# Where the barrier stands.\n{table}");
    let study = study
        .with_more(&more, scene.path())
        .map_err(|e| e.try_instead(format!("write lines as tables, as in\n{table}")))?;
    Ok((NAME.into(), study))
}

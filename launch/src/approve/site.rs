//! The site of the test, the block, and the scenes.
//!
//! The site is vertical, as most: the barrier stands out from a wall, gravity acts along the motion of the block. In the axes of the
//! barrier y runs down the slope, z is normal to it, and the anchors lie in the wall through the feet, which is the reference slope.

use super::ApproveArguments;
use super::layout::{Layout, table_at};
use super::vary::Variation;
use crate::check::ground::Scratch;
use crate::check::prepared::{self, Prepared};
use crate::front::stop::{Stop, write};
use crate::run::children::Events;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use std::path::{Path, PathBuf};
use toml::{Table, Value};
use toolkit::arguments::Input;
use toolkit::exit::Exit;
use toolkit::input_file::{hash, with_absolute_files};
use toolkit::numbers::four;
use toolkit::scene::{Scene, at};

/// [m/s2]
pub const GRAVITY: f64 = 9.81;
/// Volume of the block over that of its cube: edges and corners are cut at a quarter.
const OF_CUBE: f64 = 17.0 / 24.0;
/// How far its corners lie from its centre, in its edge: at (1/2, 1/4, 1/4).
pub const CORNER: f64 = 0.612_372_435_695_794_5;
/// Between the block and what it is to touch first [m].
const GAP: f64 = 0.05;
/// Bound of the uncertainty of deflections, of reactions three times as much. No criterion is judged by a reaction, of which the usual
/// bound is 3 %.
const ERROR: f64 = 0.02;
/// The largest launch of class 1 [J]; below it, class 0, there are no SEL launches.
const CLASS_1: f64 = 250e3;
/// Energies of the largest launches of the classes from 0 on [J].
const CLASSES: [f64; 8] = [100e3, 250e3, 500e3, 1e6, 1.5e6, 2e6, 3e6, 4.5e6];
/// Less energy than that of any launch [J].
const LEAST: f64 = 5e3;
/// Least displacement of the block in a launch when nothing stops it [m].
const SHORTEST: f64 = 1.0;
/// Name of the block in the scenes.
pub const BLOCK: &str = "block";
/// File of the site with the kit.
const SITE: &str = "site.toml";

/// A kit, and with what it is tested.
pub struct Kit {
    /// Its name.
    pub name: String,
    /// Its class; by default the highest whose largest launch it was given.
    pub class: u8,
    /// Its file.
    pub file: PathBuf,
    /// The scene of the site with the kit, without a block.
    pub document: Table,
    /// Energy of the largest launch, and of each of both smaller ones [J].
    pub mel: f64,
    /// `None`: there are none.
    pub sel: Option<f64>,
    /// Speed of the block [m/s].
    pub speed: f64,
    /// Its density [kg/m3].
    pub density: f64,
    /// Hash of its file.
    pub hash: String,
    /// What it was read from.
    pub own: Scene,
    sets: Vec<String>,
    scratch: Scratch,
}

impl Kit {
    /// What the command line asks for. Nothing has been started where it is refused.
    pub fn read(arguments: &ApproveArguments) -> Result<Self, Stop> {
        let refused = |e: Diagnostic| prepared::no_kit(&arguments.kit).unwrap_or_else(|| e.into());
        let (own, about) = Scene::load_kit(&arguments.kit).map_err(refused)?;
        let ApproveArguments { energy, sel, speed, density, time, .. } = *arguments;
        let Some(mel) = energy.map(|energy| 1e3 * energy).or(about.energy) else {
            let what = "the energy of the largest launch is not known";
            let cure = "add --energy KJ, or energy = 1e6 [J] to [kit]";
            return Err(own.invalid("kit", what).try_instead(cure).into());
        };
        let least = sel.map(|energy| 1e3 * energy).or((mel >= CLASS_1).then_some(mel / 3.0));
        // A longer path takes longer; 0.6 s are twice the braking time at 1 000 kJ.
        let length = time.unwrap_or_else(|| (6.0 * (mel / 1e6).cbrt().max(1.0)).ceil() / 10.0);
        let [most, path] = [1e-3 * mel, length * speed].map(four);
        let given = [("--energy", energy), ("--sel", sel), ("--speed", Some(speed)), ("--time", time)];
        let given = given.into_iter().filter_map(|(name, value)| Some((name, value?)));
        let positive =
            |value: f64| (value.is_finite() && value > 0.0, format!("it is {value}, and must lie above 0"));
        let positive = given.map(|(name, value)| (name, positive(value)));
        let few = 3.0 * least.unwrap_or(0.0) <= mel * (1.0 + 1e-9);
        let few = (few, format!("it is more than a third of the largest launch, {most} kJ"));
        let soon = format!("in {length} s the block moves by {path} m: nothing is stopped so soon");
        let range = (2500.0..=3000.0).contains(&density);
        let range = (range, format!("the block has {density} kg/m3, and the test asks for 2500 to 3000"));
        let others = [("--sel", few), ("--time", (length * speed >= SHORTEST, soon)), ("--density", range)];
        if let Some((name, (_, what))) = positive.chain(others).find(|(_, (holds, _))| !holds) {
            return Err(Diagnostic::error(code::ARGUMENT, what).at(Place::file(name.to_owned())).into());
        }
        if mel < LEAST {
            let what = format!("the largest launch has {mel} J: barriers are tested with {LEAST} J and more");
            let cure = "--energy is in kJ, `energy` of [kit] in J: 1000 kJ is energy = 1e6";
            let refused = match energy {
                Some(_) => Diagnostic::error(code::ARGUMENT, what).at(Place::file("--energy")),
                None => own.invalid("kit.energy", what),
            };
            return Err(refused.try_instead(cure).into());
        }
        let kind = "structure.generator.type";
        if at(&own.document()?, kind).and_then(Value::as_str) != Some("barrier") {
            let what = format!("the test is of a barrier: {kind} must be \"barrier\"");
            return Err(own.invalid(kind, what).into());
        }
        let scratch = Scratch::new(None)?;
        let file = std::path::absolute(&arguments.kit).map_err(|e| own.invalid("kit", e.to_string()))?;
        let site = scratch.file(SITE);
        write(&site, &site_text(&file, length))?;
        // In its axes the anchors lie in the wall. What a user sets goes before it.
        let sets = std::iter::once("structure.generator.anchor_rise=0.0".into());
        let sets: Vec<String> = sets.chain(arguments.sets.iter().cloned()).collect();
        let scene = Scene::load(&site, &sets)?;
        let document = document(&scene)?;
        let placed = ["line", "position", "ground"].map(|key| format!("structure.generator.{key}"));
        if let Some(key) = placed.iter().find(|key| at(&document, key).is_some()) {
            let what = format!("`{key}` says where a barrier stands: the test has a site of its own");
            let cure = "leave it to the scene that uses the kit";
            return Err(scene.invalid(key, what).try_instead(cure).into());
        }
        let class = class_of(mel);
        if let Some(stated) = about.class.filter(|stated| *stated > class && energy.is_none()) {
            let least = 1e-3 * CLASSES[usize::from(stated).min(CLASSES.len() - 1)];
            let or = if stated > 7 { "more than" } else { "at least" };
            let what =
                format!("class {stated} is of {or} {least} kJ, and `energy` is {most} kJ, of class {class}");
            let cure = format!("class = {class}, or a higher energy");
            return Err(own.invalid("kit.class", what).try_instead(cure).into());
        }
        // An energy of the command line has a class of its own.
        let class = about.class.filter(|_| energy.is_none()).unwrap_or(class);
        let name = about.name.unwrap_or_else(|| own.name());
        let hash = hash(own.text().as_bytes());
        Ok(Self { name, class, file, hash, own, document, mel, sel: least, speed, density, sets, scratch })
    }

    /// Energy of a launch [J].
    pub fn energy(&self, which: Which) -> f64 {
        if which == Which::Mel { self.mel } else { self.sel.unwrap_or(self.mel) }
    }

    /// The block of an energy [J].
    pub fn block(&self, energy: f64) -> Block {
        let mass = 2.0 * energy / (self.speed * self.speed);
        Block { mass, size: (mass / self.density / OF_CUBE).cbrt() }
    }

    /// A scene in a file that lives as long as this.
    pub fn written(&self, scene: &Table) -> Result<Input, Stop> {
        let file = self.scratch.file("scene.toml");
        write(&file, &scene.to_string())?;
        Ok(Input { scene: file, sets: Vec::new() })
    }
}

/// The highest class whose largest launch has this energy [J].
fn class_of(mel: f64) -> u8 {
    let reached = CLASSES.iter().filter(|energy| mel >= **energy * (1.0 - 1e-9)).count() as u8;
    if mel > CLASSES[7] * (1.0 + 1e-9) { 8 } else { reached.saturating_sub(1) }
}

/// A block.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// [kg]
    pub mass: f64,
    /// Edge of its cube [m].
    pub size: f64,
}

/// The site without a block.
fn site_text(kit: &Path, time: f64) -> String {
    let kit = Value::from(kit.display().to_string());
    format!(
        "end_time = {time:?}\ngravity = [0.0, {GRAVITY:?}, 0.0]\n\n[[contact]]\nlaw = \"linear\"\nstiffness = 1e7\npoisson = 0.2\n\
         restitution = 0.5\nfriction = 0.4\n\n[structure]\nkit = {kit}\n\n[fem]\nintegrator = \"central_difference\"\n\n[limits]\ndeflection_error = {ERROR:?}\n"
    )
}

/// A scene as a table that reads the same anywhere.
fn document(scene: &Scene) -> Result<Table, Diagnostic> {
    let mut document = scene.document()?;
    with_absolute_files(&mut document, scene)?;
    Ok(document)
}

interface_defs::worded! {
    /// Which launch.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Which with name {
        /// The first of a third of the energy.
        Sel1 = "SEL 1",
        /// The second of them, without repair.
        Sel2 = "SEL 2",
        /// The largest, at a new kit.
        Mel = "MEL",
    }
}

impl Which {
    /// Name of the directory of its run.
    pub fn dir(self) -> String {
        self.name().to_lowercase().replace(' ', "_")
    }
}

/// The kit with one thing varied, on its site.
pub struct Test<'a> {
    /// The kit.
    pub kit: &'a Kit,
    /// Its structure.
    pub layout: Layout,
    /// x and z of the block [m].
    centre: [f64; 2],
    /// The same of a block that hits the middle of the middle field [m].
    pub middle: [f64; 2],
    /// The scene without a block, with all groups and gauges.
    pub document: Table,
    /// What the user should know of the kit.
    pub warnings: Vec<Diagnostic>,
    /// Least expected wall time of its first launch [s].
    pub cost: Option<f64>,
}

impl<'a> Test<'a> {
    /// Every program has checked its first launch. What is wrong is bad input, and said of the kit: the scene of the check does not last.
    pub fn of(kit: &'a Kit, variation: &Variation, events: &Events) -> Result<Self, Stop> {
        Self::checked(kit, variation, events).map_err(|mut stop| {
            let scratch = kit.scratch.file("");
            let of_site = |place: &Place| Path::new(&place.file).starts_with(&scratch);
            for error in stop.errors.iter_mut().filter(|error| error.place.as_deref().is_some_and(of_site)) {
                error.place = Some(Box::new(Place::file(kit.file.display()))).filter(|_| error.key.is_none());
                *error = kit.own.placed(error.clone());
            }
            // That the block strikes nothing is no failure here, as nothing has run yet.
            let nothing = stop.errors.iter().any(|error| error.code == code::PLACE);
            Stop { exit: if nothing { Exit::BadInput } else { stop.exit }, ..stop }
        })
    }

    fn checked(kit: &'a Kit, variation: &Variation, events: &Events) -> Result<Self, Stop> {
        let sets = kit.sets.iter().chain(&variation.sets).cloned().collect();
        let input = Input { scene: kit.scratch.file(SITE), sets };
        let layout = Layout::of(&input, events)?;
        let mut document = document(&input.load()?)?;
        let size = kit.block(kit.mel).size;
        let (height, lean) = (layout.number("height"), layout.number("lean"));
        let rise = (height * height - lean * lean).max(0.0).sqrt();
        if size > rise / 3.0 {
            // Its volume goes with the energy over density and speed squared.
            let [most, fits] = [rise / 3.0, kit.speed * (3.0 * size / rise).powf(1.5)];
            let of = [1e-3 * kit.mel, size, rise, most, (10.0 * fits).ceil() / 10.0];
            let [energy, size, rise, most, fits] = of.map(four);
            let what = format!(
                "the block of {energy} kJ has an edge of {size} m, more than a third of the height of the kit, {rise} m"
            );
            let cure = format!("--speed {fits}: its block has {most} m; or a higher kit");
            let place = Place::file(kit.file.display());
            return Err(Diagnostic::error(code::CONTRADICTION, what).at(place).try_instead(cure).into());
        }
        let centre = centre(&layout, rise, variation.place, size);
        for (key, more) in layout.gauges(centre, 0.5 * size) {
            let own =
                if key == "groups" { table_at(&mut document, "structure") } else { Some(&mut document) };
            let list = own.map(|table| table.entry(key).or_insert_with(|| Vec::<Value>::new().into()));
            if let (Some(Value::Array(list)), Value::Array(more)) = (list, more) {
                list.extend(more);
            }
        }
        document.insert("title".into(), format!("{}, {}", kit.name, variation.name).into());
        let middle = self::centre(&layout, rise, "", size);
        let mut test = Self { kit, layout, centre, middle, document, warnings: Vec::new(), cost: None };
        let first = if kit.sel.is_some() { Which::Sel1 } else { Which::Mel };
        let prepared = Prepared::of(&kit.written(&test.launch(first, &test.layout)?)?, |_| None, events)?;
        // The rest is of the site, which is not the user's.
        let of_kit =
            |doubt: &Diagnostic| doubt.key.as_deref().is_some_and(|key| key.starts_with("structure"));
        let doubts = prepared.doubts()?.into_iter().filter(of_kit);
        test.warnings = doubts.map(|doubt| kit.own.placed(doubt)).collect();
        test.cost = prepared.numbers.of_steps();
        Ok(test)
    }

    /// The scene of a launch at the structure that stands at rest as in `now`.
    pub fn launch(&self, which: Which, now: &Layout) -> Result<Table, Stop> {
        let Block { mass, size } = self.kit.block(self.kit.energy(which));
        let [x, z] = self.centre;
        let Some(first) = now.first_struck(self.centre, 0.5 * size) else {
            let [x, z] = self.centre.map(four);
            let what = format!(
                "the block of {} m strikes nothing of the barrier, at x = {x} m, z = {z} m",
                four(size)
            );
            return Err(Stop::failed(code::PLACE, what));
        };
        // It falls through the gap, and has its speed when it touches.
        let speed = (self.kit.speed.powi(2) - 2.0 * GRAVITY * GAP).max(0.0).sqrt();
        let rock = format!(
            "[[rock]]\nname = {BLOCK:?}\nposition = [{x:?}, {:?}, {z:?}]\nvelocity = [0.0, {speed:?}, 0.0]\nmass = {mass:?}\n\
             shape = {{ type = \"ead_block\", size = {size:?} }}\ncluster = {{ spheres = 300 }}\n",
            first - GAP - 0.5 * size
        );
        let mut scene = self.document.clone();
        scene.extend(rock.parse::<Table>().expect("it is TOML"));
        Ok(scene)
    }
}

/// x and z of a block of this edge [m] that hits there.
fn centre(layout: &Layout, rise: f64, place: &str, size: f64) -> [f64; 2] {
    let (fields, spacing) = (layout.number("fields"), layout.number("spacing"));
    let middle = ((0.5 * fields).floor() + 0.5 - 0.5 * fields) * spacing;
    match place {
        "post" => [middle + 0.5 * spacing, 0.5 * rise],
        "edge_field" => [0.5 * (fields - 1.0) * spacing, 0.5 * rise],
        "top_rope" => [middle, rise - 0.75 * size],
        _ => [middle, 0.5 * rise],
    }
}

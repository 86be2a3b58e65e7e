//! The site of the test, the block, and the scenes.
//!
//! The site is vertical, as most: the barrier stands out from a wall, gravity acts along the motion of the block. In the axes of the
//! barrier y runs down the slope, z is normal to it, and the anchors lie in the wall through the feet, which is the reference slope.

use super::Arguments;
use super::layout::{Layout, number};
use super::vary::{Hit, Variation};
use crate::children::Events;
use crate::ground::Scratch;
use crate::prepared::Prepared;
use crate::stop::Stop;
use interface_defs::diagnostic::{Diagnostic, Place, code};
use std::path::{Path, PathBuf};
use toml::{Table, Value};
use toolkit::arguments::Input;
use toolkit::files;
use toolkit::input_file::with_absolute_files;
use toolkit::kit::About;
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
/// Name of the block in the scenes.
pub const BLOCK: &str = "block";

/// A kit, and with what it is tested.
pub struct Kit {
    /// What it says of itself.
    pub about: About,
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
    sets: Vec<String>,
    scratch: Scratch,
}

impl Kit {
    /// What the command line asks for. Nothing has been started where it is refused.
    pub fn read(arguments: &Arguments) -> Result<Self, Stop> {
        let (own, about) = Scene::load_kit(&arguments.kit)?;
        let option = |name: &str, what: String| {
            Diagnostic::error(code::ARGUMENT, what).at(Place::file(name.to_owned()))
        };
        let Some(mel) = arguments.energy.map(|energy| 1e3 * energy).or(about.energy) else {
            let what = "the energy of the largest launch is not known";
            return Err(own
                .invalid("kit", what)
                .try_instead("add --energy KJ, or energy = 1e6 [J] to [kit]")
                .into());
        };
        let sel = arguments.sel.map(|energy| 1e3 * energy).or((mel >= CLASS_1).then_some(mel / 3.0));
        // A longer way takes longer; 0.6 s are twice the braking time at 1 000 kJ.
        let time = arguments.time.unwrap_or_else(|| (6.0 * (mel / 1e6).cbrt().max(1.0)).ceil() / 10.0);
        let given = [
            ("--energy", mel),
            ("--sel", sel.unwrap_or(mel)),
            ("--speed", arguments.speed),
            ("--time", time),
        ];
        if let Some((name, value)) = given.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
        {
            return Err(option(name, format!("it is {value}, and must lie above 0")).into());
        }
        if !(2500.0..=3000.0).contains(&arguments.density) {
            let what = format!(
                "the density of the block is {} kg/m3, the test asks for 2500 to 3000",
                arguments.density
            );
            return Err(option("--density", what).into());
        }
        let scratch = Scratch::new(None)?;
        let file = std::path::absolute(&arguments.kit).map_err(|e| own.invalid("kit", e.to_string()))?;
        let site = scratch.file("site.toml");
        files::write(&site, site_text(&file, time).as_bytes())
            .map_err(|e| Stop::input(code::FILE, format!("{}: {e}", site.display())))?;
        let scene = Scene::load(&site, &arguments.sets)?;
        let document = document(&scene)?;
        let sets = arguments.sets.clone();
        let kit = Self {
            about,
            file,
            document,
            mel,
            sel,
            speed: arguments.speed,
            density: arguments.density,
            sets,
            scratch,
        };
        let generator = at(&kit.document, "structure.generator");
        let word = |key: &str| generator.and_then(|table| table.get(key));
        if word("type").and_then(Value::as_str) != Some("barrier") {
            let what = "the test is of a barrier: structure.generator.type must be \"barrier\"";
            return Err(scene.invalid("structure.generator.type", what).into());
        }
        if let Some(key) = ["line", "position", "ground"].into_iter().find(|key| word(key).is_some()) {
            let what = format!("`{key}` says where a barrier stands: the test has a site of its own");
            let cure = "leave it to the scene that uses the kit";
            return Err(scene.invalid(&format!("structure.generator.{key}"), what).try_instead(cure).into());
        }
        Ok(kit)
    }

    /// Name of its file.
    pub fn stem(&self) -> String {
        self.file.file_stem().map_or_else(|| "kit".into(), |stem| stem.to_string_lossy().into_owned())
    }

    /// Its name.
    pub fn name(&self) -> String {
        self.about.name.clone().unwrap_or_else(|| self.stem())
    }

    /// Its class: the highest whose largest launch it was given.
    pub fn class(&self) -> u8 {
        let reached = CLASSES.iter().filter(|energy| self.mel >= **energy * (1.0 - 1e-9)).count() as u8;
        self.about.class.unwrap_or(if self.mel > CLASSES[7] { 8 } else { reached.saturating_sub(1) })
    }

    /// The block of an energy [J].
    pub fn block(&self, energy: f64) -> Block {
        let mass = 2.0 * energy / (self.speed * self.speed);
        Block { mass, size: (mass / self.density / OF_CUBE).cbrt() }
    }

    /// What the structure's program makes of a scene that is written for it alone.
    pub fn layout(&self, scene: &Table, events: &Events) -> Result<Layout, Stop> {
        let file = self.scratch.file("structure.toml");
        write(&file, scene)?;
        Layout::of(&Input { scene: file, sets: Vec::new() }, events)
    }
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
         restitution = 0.5\nfriction = 0.4\n\n[structure]\nkit = {kit}\n\n[structure.generator]\nanchor_rise = 0.0\n\n[fem]\n\
         integrator = \"central_difference\"\n\n[limits]\ndeflection_error = {ERROR:?}\n"
    )
}

/// A scene as a table that reads the same anywhere.
fn document(scene: &Scene) -> Result<Table, Diagnostic> {
    let mut document = scene.document()?;
    with_absolute_files(&mut document, scene)?;
    Ok(document)
}

/// Write a scene.
pub fn write(file: &Path, scene: &Table) -> Result<String, Stop> {
    let fault =
        |e: String| Stop::failed(code::NOT_WRITTEN, format!("{}: cannot be written: {e}", file.display()));
    let text = toml::to_string(scene).map_err(|e| fault(e.to_string()))?;
    files::write(file, text.as_bytes()).map_err(|e| fault(e.to_string()))?;
    Ok(text)
}

/// The kit with one thing varied, on its site.
pub struct Test<'a> {
    /// The kit.
    pub kit: &'a Kit,
    /// Its structure.
    pub layout: Layout,
    /// x and z of the block [m].
    pub centre: [f64; 2],
    /// The scene without a block, with all groups and gauges.
    document: Table,
}

impl<'a> Test<'a> {
    /// Every program has checked its first launch.
    pub fn of(kit: &'a Kit, variation: &Variation, events: &Events) -> Result<Self, Stop> {
        let site = kit.scratch.file("site.toml");
        let sets: Vec<String> = kit.sets.iter().chain(&variation.sets).cloned().collect();
        let input = Input { scene: site, sets };
        let layout = Layout::of(&input, events)?;
        let mut document = document(&input.load()?)?;
        let largest = kit.block(kit.mel);
        let (height, lean) = (layout.number("height"), layout.number("lean"));
        let rise = (height * height - lean * lean).max(0.0).sqrt();
        if largest.size > rise / 3.0 {
            let denser = Block { mass: largest.mass, size: (largest.mass / 3000.0 / OF_CUBE).cbrt() };
            let what = format!(
                "the block of {} kJ has an edge of {} m, more than a third of the height of the kit, {} m",
                four(1e-3 * kit.mel),
                four(largest.size),
                four(rise)
            );
            let cure = format!(
                "a faster block (--speed), or a denser one: {} m with --density 3000",
                four(denser.size)
            );
            return Err(Diagnostic::error(code::CONTRADICTION, what)
                .at(Place::file(kit.file.display().to_string()))
                .try_instead(cure)
                .into());
        }
        let centre = centre(&layout, rise, variation.hit, largest.size);
        let (groups, gauges) = layout.gauges(centre, 0.5 * largest.size);
        let structure = document.get_mut("structure").and_then(Value::as_table_mut);
        let add = |table: Option<&mut Table>, key: &str, more: Vec<Table>| {
            let list =
                table?.entry(key.to_owned()).or_insert_with(|| Value::Array(Vec::new())).as_array_mut()?;
            list.extend(more.into_iter().map(Value::Table));
            Some(())
        };
        add(structure, "groups", groups);
        add(Some(&mut document), "gauge", gauges);
        let title = format!(
            "{}, {}",
            kit.name(),
            if variation.name.is_empty() { "as defined" } else { &variation.name }
        );
        document.insert("title".into(), title.into());
        let test = Self { kit, layout, centre, document };
        let file = kit.scratch.file("launch.toml");
        write(&file, &test.launch(kit.sel.unwrap_or(kit.mel), &test.layout)?)?;
        Prepared::of(&Input { scene: file, sets: Vec::new() }, |_| None, events)?.doubts()?;
        Ok(test)
    }

    /// Energy of the smaller launches [J].
    pub fn sel(&self) -> Option<f64> {
        self.kit.sel
    }

    /// The scene without a block.
    pub fn without_block(&self) -> Table {
        self.document.clone()
    }

    /// The scene of a launch with an energy [J] at impact, at the structure that stands at rest as in `now`.
    pub fn launch(&self, energy: f64, now: &Layout) -> Result<Table, Stop> {
        let block = self.kit.block(energy);
        let Some(first) = now.in_the_way(self.centre, 0.5 * block.size) else {
            let [x, z] = self.centre.map(four);
            let what = format!("nothing of the barrier is in the way of the block, at x = {x} m, z = {z} m");
            return Err(Stop::failed(code::PLACE, what));
        };
        let [x, z] = self.centre;
        // It falls through the gap, and has its speed when it touches.
        let speed = (self.kit.speed.powi(2) - 2.0 * GRAVITY * GAP).max(0.0).sqrt();
        let vector = |values: [f64; 3]| Value::Array(values.map(Value::from).to_vec());
        let shape = [("type".to_owned(), "ead_block".into()), ("size".into(), block.size.into())];
        let rock = Table::from_iter([
            ("name".to_owned(), BLOCK.into()),
            ("position".into(), vector([x, first - GAP - 0.5 * block.size, z])),
            ("velocity".into(), vector([0.0, speed, 0.0])),
            ("mass".into(), block.mass.into()),
            ("shape".into(), Table::from_iter(shape).into()),
            ("cluster".into(), Table::from_iter([("spheres".to_owned(), 300.into())]).into()),
        ]);
        let mut scene = self.without_block();
        scene.insert("rock".into(), vec![Value::Table(rock)].into());
        Ok(scene)
    }
}

/// x and z of a block of this edge [m] that hits there.
fn centre(layout: &Layout, rise: f64, hit: Hit, size: f64) -> [f64; 2] {
    let (fields, spacing) = (layout.number("fields"), layout.number("spacing"));
    let middle = ((0.5 * fields).floor() + 0.5 - 0.5 * fields) * spacing;
    let edge = 0.5 * (fields - 1.0) * spacing;
    match hit {
        Hit::Middle => [middle, 0.5 * rise],
        Hit::Post => [middle + 0.5 * spacing, 0.5 * rise],
        Hit::EdgeField => [edge, 0.5 * rise],
        Hit::TopRope => [middle, rise - 0.75 * size],
    }
}

/// A number of a table, by its dotted key.
pub fn value(table: &Table, key: &str) -> Option<f64> {
    number(at(table, key))
}

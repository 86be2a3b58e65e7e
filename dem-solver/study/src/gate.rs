//! What can be known of a study before it starts: an error where it is certainly wrong, a warning where it is
//! possible, but unusual.
//!
//! Rocks and contacts are judged by the checks of a scene ([`dem_rocks::gate`]), at the ends of what varies.

use super::base::Base;
use super::member::Member;
use super::record;
use super::settings::{Place, Variable, Varied};
use dem_contact::settings::Settings;
use dem_rocks::gate::contacts::of_contact;
use dem_rocks::gate::units::{all_of_rock, in_litres};
use dem_solid::geometry::plan;
use interface_defs::diagnostic::{self, Diagnostic, code};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::PathBuf;
use toolkit::numbers::four;
use toolkit::once::each_once;
use toolkit::ranges::{Gate, refused};
use toolkit::scene::Scene;

/// Largest mass [kg] of rocks that were likelier meant in tonnes.
const LIGHT: f64 = 20.0;
/// Angles up to a turn and to a right angle in radians, and some rounding of them.
const TURN: f64 = TAU + 0.02;
const QUARTER: f64 = FRAC_PI_2 + 0.01;
/// Members from which on nothing is said of their number; shortest line of which nothing is said [m].
const FEW: u64 = 10;
const SHORT: f64 = 1.0;
/// Pieces of a line that are looked at for ground below.
const PIECES: u32 = 1000;

/// Read a study and check what can be known of it before it starts; spheres that were made before are looked for in the folders
/// `clusters` too.
pub fn read(file: &Scene, shortcuts: bool, clusters: &[PathBuf]) -> Result<Base, Diagnostic> {
    let mut base = Base::new(file, shortcuts, clusters)?;
    base.fingerprint = record::fingerprint(&base, file)?;
    let found = check(&base, file)?;
    base.warnings.extend(found);
    Ok(base)
}

/// What the user should look at twice, with its place; errs where it is certainly wrong.
fn check(base: &Base, file: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
    let mut said = Vec::new();
    for release in base.study.variants() {
        let directions =
            base.study.variables[release].iter().filter_map(|variable| of_direction(variable, file));
        let all = [of_keys(base, release, file)?, of_rocks(base, release, file)?, directions.collect()];
        said.extend(all.concat());
    }
    let mut said = each_once(said);
    for (at, line) in base.study.lines.iter().enumerate() {
        if let Some(design) = &line.design {
            said.extend(design.check(&format!("line.{at}.design"), file)?);
        }
        if let Some(barrier) = &line.barrier {
            said.extend(barrier.check(&format!("line.{at}.barrier"), file)?);
        }
        said.extend(of_line(base, at, file));
    }
    said.extend(base.study.variants().into_iter().filter_map(|at| of_slope(base, at, file)));
    said.extend(of_heights(base, file)?);
    said.extend(of_cells(base, file)?);
    said.extend(of_system(base, file)?);
    said.extend(of_rates(base, file));
    said.extend(of_many(base, file));
    let members = base.members();
    if members < FEW {
        let what = format!("members: {members}, and no share, quantile or frequency follows from so few");
        let cure = "hundreds show the spread; a fall alone is `rockfall run` of its scene";
        said.push(warning(file, "release.0.count", what).try_instead(cure));
    }
    said.extend(of_twins(base, file));
    Ok(said)
}

/// Lines and releases that have the places of another one.
fn of_twins(base: &Base, file: &Scene) -> Vec<Diagnostic> {
    let lines = base.study.lines.iter().zip(&base.lines);
    let lines = lines
        .enumerate()
        .map(|(at, (line, points))| (format!("line.{at}.points"), &line.name, points.as_slice()));
    let releases = base.study.releases.iter().enumerate().map(|(at, release)| {
        let Place { key, corners, .. } = release.place();
        (format!("release.{at}.{key}"), &release.name, corners)
    });
    let all: Vec<_> = lines.chain(releases).collect();
    let twin = |(at, (key, name, corners)): (usize, &(String, &String, &[[f64; 2]]))| {
        let (_, other, _) = all[..at].iter().find(|(.., others)| others == corners)?;
        let what = format!("`{name}` has the places of `{other}`");
        Some(warning(file, key, what).coded(code::PLACE).try_instead("leave one of them out"))
    };
    all.iter().enumerate().filter_map(twin).collect()
}

/// A warning at its place.
fn warning(file: &Scene, key: &str, what: String) -> Diagnostic {
    file.placed(Diagnostic::warning(code::UNUSUAL_VALUE, what).about(key))
}

/// Refuse keys of the scene that do not exist, and values at the ends of their distributions that it refuses; say what it doubts.
fn of_keys(base: &Base, release: usize, file: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
    let variables = &base.study.variables[release];
    let keys: Vec<&Variable> = variables.iter().filter(|v| v.quantity == Varied::Key).collect();
    let mut said: Vec<Diagnostic> = Vec::new();
    for end in [0, 1] {
        let set = |v: &&Variable| format!("{}={}", v.name, v.distribution.ends()[end]);
        let sets: Vec<String> = keys.iter().map(set).collect();
        let judged = Scene::load(base.scene.path(), &sets).and_then(|scene| {
            let settings = Settings::of(&scene)?;
            let all = settings.contacts.iter().enumerate();
            let all = all.map(|(number, contact)| of_contact(number, contact, &scene));
            Ok(all.collect::<Result<Vec<_>, _>>()?.concat())
        });
        // Whatever is found of a key that varies is written in the study.
        let own = |found: &Diagnostic| {
            let mut all = keys.iter().zip(&sets);
            // An unknown key has no key of its own, but a place.
            let file = |set: &str| diagnostic::Place::in_argument(set, 0..0).file;
            let is_in = |set: &str| found.place.as_ref().is_some_and(|place| place.file == file(set));
            all.find(|(variable, set)| found.key.as_deref() == Some(variable.name.as_str()) || is_in(set))
        };
        match judged {
            Ok(warnings) => {
                for found in warnings {
                    let Some((variable, set)) = own(&found) else { continue };
                    let what = format!("with {set}: {}", found.message);
                    let moved =
                        file.placed(Diagnostic { message: what, ..found }.about(variable.key.clone()));
                    said.push(moved);
                }
            }
            Err(error) => {
                let key = own(&error).map_or("vary".to_owned(), |(variable, _)| variable.key.clone());
                let what = if own(&error).is_some() { error.message } else { error.headline() };
                let wrong = file.invalid(&key, format!("with {}: {what}", sets.join(", ")));
                return Err(wrong.coded(error.code).try_if(error.hint));
            }
        }
    }
    Ok(said)
}

/// The quantities that a key of a rock's table follows from.
fn quantities(key: &str) -> &'static [Varied] {
    match key {
        "density" => &[Varied::Density],
        "mass" => &[Varied::Mass],
        "shape" | "shape.volume" => &[Varied::Volume, Varied::Mass, Varied::Shape],
        "velocity" => &[Varied::Speed],
        "angular_velocity" => &[Varied::Spin],
        _ => &[],
    }
}

/// Rocks at the ends of their sizes, densities, speeds and spins, by the checks of a scene.
fn of_rocks(base: &Base, release: usize, file: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
    let variables = &base.study.variables[release];
    let (mut said, mut keys) = (Vec::new(), BTreeSet::new());
    let ends = [[true, true], [true, false], [false, true], [false, false]];
    for (prototype, [large, dense]) in (0..base.prototypes.len()).flat_map(|p| ends.map(|end| (p, end))) {
        let high = |quantity| match quantity {
            Varied::Volume | Varied::Mass => large,
            Varied::Density => dense,
            _ => true,
        };
        let values = variables.iter().map(|v| v.distribution.ends()[usize::from(high(v.quantity))].clone());
        let member = Member {
            number: 1,
            release,
            place: [0.0; 2],
            orientation: None,
            axis: Vector3::z(),
            values: values.collect(),
            prototype,
        };
        let (rock, table) = base.rock_alone(&member);
        let volume = rock.solid.volume();
        for mut found in all_of_rock(&rock, &table) {
            let all = quantities(found.key.as_deref().unwrap_or_default());
            let varied = |quantity: &Varied| variables.iter().find(|v| v.quantity == *quantity);
            let Some(variable) = all.iter().find_map(varied) else { continue };
            let (name, quantity) = (&variable.name, variable.quantity);
            if all.len() > 1
                && let Some(hint) = of_size_meant(quantity, volume, rock.mass)
            {
                found.hint = Some(hint);
            }
            let (key, mut what) = (variable.key.clone(), found.message);
            if quantity != Varied::Shape {
                let value = four(base.quantity(&member, quantity).unwrap_or(f64::NAN));
                what = format!("with {name} = {value}: {what}");
            }
            let found = refused(Diagnostic { message: what, key: Some(key.clone()), ..found }, file)?;
            if keys.insert(key) {
                said.push(file.placed(found));
            }
        }
        let sized = variables.iter().find(|v| matches!(v.quantity, Varied::Volume | Varied::Mass));
        if let Some(variable) = sized.filter(|_| large && dense)
            && let Some(hint) = of_size_meant(variable.quantity, volume, rock.mass)
            && keys.insert(variable.key.clone())
        {
            let (name, of, mass, volume) = (&variable.name, &rock.name, four(rock.mass), four(volume));
            let value = if variable.quantity == Varied::Mass { &mass } else { &volume };
            let what = format!("with {name} = {value}: rock `{of}` has {mass} kg in {volume} m3");
            let doubted = warning(file, &variable.key, what);
            said.push(doubted.coded(code::LIKELY_UNIT).try_instead(hint));
        }
    }
    Ok(said)
}

/// What a size that few rocks have may have been, where the study varies this quantity.
fn of_size_meant(quantity: Varied, volume: f64, mass: f64) -> Option<String> {
    let meant = match quantity {
        Varied::Mass if mass < LIGHT => Some(("tonnes", 1e3)),
        Varied::Mass => in_litres(volume).map(|_| ("grams", 1e-3)),
        Varied::Volume => return in_litres(volume),
        _ => None,
    };
    meant.map(|(unit, size)| format!("were it in {unit}, it would be {} kg", four(size * mass)))
}

/// A direction that is likelier in radians, or upward.
fn of_direction(variable: &Variable, file: &Scene) -> Option<Diagnostic> {
    let (most, name) = match variable.quantity {
        Varied::Azimuth => (TURN, "azimuth"),
        Varied::Dip => (QUARTER, "dip"),
        _ => return None,
    };
    let [low, high] = variable.distribution.range()?;
    let range = |low: f64, high: f64| match low == high {
        true => four(low),
        false => format!("{} to {}", four(low), four(high)),
    };
    let key = variable.key.clone();
    let written = range(low, high);
    if name == "dip" && low < 0.0 {
        let what = format!(
            "a dip of {written} degrees: it counts below the horizontal, so this throws rocks upward"
        );
        return Some(warning(file, &key, what).try_instead("30 degrees downward are dip = 30.0"));
    }
    let degrees = variable.distribution.values().is_some_and(whole);
    (low >= 0.0 && high > 0.0 && high <= most && !degrees).then(|| {
        let degrees = range(low.to_degrees(), high.to_degrees());
        warning(file, &key, format!("{name} is in degrees, {written} here"))
            .coded(code::LIKELY_UNIT)
            .try_instead(format!("were it in radians, it would be {degrees} degrees"))
    })
}

/// Whether all these are whole numbers: no one writes radians like that.
fn whole(values: &[toml::Value]) -> bool {
    values.iter().all(|v| v.as_float().is_none_or(|v| v.fract() == 0.0))
}

/// How much of line number `at` has no ground below.
fn of_line(base: &Base, at: usize, file: &Scene) -> Option<Diagnostic> {
    let (line, name) = (&base.lines[at], &base.study.lines[at].name);
    let places = (0..PIECES).map(|k| plan::along(line, (f64::from(k) + 0.5) / f64::from(PIECES)));
    let beside = places.filter(|place| base.ground.ground_at(*place).is_none()).count();
    let length = plan::length(line);
    let heights = |points: &[[f64; 2]]| {
        let all = points.iter().filter_map(|place| base.ground.ground_at(*place));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)])
    };
    let [lowest, _] = heights(
        &(0..=PIECES).map(|k| plan::along(line, f64::from(k) / f64::from(PIECES))).collect::<Vec<_>>(),
    );
    let corners = base.study.releases.iter().flat_map(|release| release.place().corners);
    let [_, highest] = heights(&corners.map(|corner| base.local(corner)).collect::<Vec<_>>());
    if lowest > highest {
        let what = format!(
            "all of the line `{name}` lies higher than every corner of the releases: no rock will pass it"
        );
        let cure = "is it the other way round, or are x and y exchanged?";
        return Some(warning(file, &format!("line.{at}.points"), what).coded(code::PLACE).try_instead(cure));
    }
    let through = base.study.releases.iter().find(|release| {
        let Place { key, corners, .. } = release.place();
        let mut corners: Vec<_> = corners.iter().map(|corner| base.local(corner)).collect();
        match key {
            "polygon" => corners.push(corners[0]),
            "line" => {}
            _ => corners.clear(),
        }
        corners
            .windows(2)
            .any(|side| line.windows(2).any(|own| plan::cross(&[own[0], own[1]], &[side[0], side[1]])))
    });
    if length < SHORT {
        let what = format!("the line `{name}` is {} m long", four(length));
        let cure = "coordinates count in metres: a line that rocks pass has tens of them";
        return Some(warning(file, &format!("line.{at}.points"), what).try_instead(cure));
    }
    if let Some(release) = through {
        let what = format!(
            "the line `{name}` runs across the release `{}`: what starts below it never passes it",
            release.name
        );
        return Some(
            warning(file, &format!("line.{at}.points"), what)
                .coded(code::PLACE)
                .try_instead("draw it below the release"),
        );
    }
    (beside > 0).then(|| {
        let (lost, all) = (four(length * beside as f64 / f64::from(PIECES)), four(length));
        let what = format!(
            "{lost} m of {all} m of the line `{name}` lie beyond the terrain or over holes in it: what passes there is not counted"
        );
        warning(file, &format!("line.{at}.points"), what).coded(code::PLACE)
    })
}

/// Slopes from which on it matters that rocks start up them.
const STEEP: f64 = 0.3;

/// Rocks of a release that all start up the slope, as far as the ground in the middle of its corners says.
fn of_slope(base: &Base, release: usize, file: &Scene) -> Option<Diagnostic> {
    let azimuth = base.study.variables[release].iter().find(|v| v.quantity == Varied::Azimuth)?;
    let [low, high] = azimuth.distribution.range()?;
    let corners = base.study.releases[release].place().corners;
    let mean = |axis: usize| corners.iter().map(|c| c[axis]).sum::<f64>() / corners.len() as f64;
    let [x, y] = base.local(&[mean(0), mean(1)]);
    let reach = 0.02 * (base.ground.highest - base.ground.lowest).xy().max();
    let rise = |dx: f64, dy: f64| {
        let at = |sign: f64| base.ground.ground_at([x + sign * dx, y + sign * dy]);
        Some((at(1.0)? - at(-1.0)?) / (2.0 * reach))
    };
    let (east, north) = (rise(reach, 0.0)?, rise(0.0, reach)?);
    // Across the slope is neither up nor down.
    let least = 0.1 * east.hypot(north);
    let up = |angle: f64| east * angle.to_radians().sin() + north * angle.to_radians().cos() > least;
    let all = (0..=8).all(|k| up(low + f64::from(k) / 8.0 * (high - low)));
    (all && east.hypot(north) > STEEP && high - low < 360.0).then(|| {
        let down = four((-east).atan2(-north).to_degrees().rem_euclid(360.0).round());
        let (name, [low, high]) = (&base.study.releases[release].name, [low, high].map(four));
        let what = format!(
            "azimuth from {low} to {high}: all rocks of `{name}` start up the slope, which falls towards {down} degrees"
        );
        warning(file, &azimuth.key, what).try_instead("it counts clockwise from north: 90 is east")
    })
}

/// Height of a start above the ground.
const HEIGHT: Gate = Gate {
    key: "height",
    unit: "m",
    possible: [0.0, 1000.0],
    usual: [0.0, 50.0],
    says: ["is below the ground", "above the ground is a start in free fall from there"],
    hint: "it counts from where the rock would touch the ground, not from sea level",
    ..Gate::ANY
};

/// Releases far above the ground.
fn of_heights(base: &Base, file: &Scene) -> Result<Vec<Diagnostic>, Diagnostic> {
    let (study, mut said) = (&base.study, Vec::new());
    for (at, release) in study.releases.iter().enumerate() {
        HEIGHT.pass(file, &format!("release.{at}"), release.height, &mut said)?;
    }
    for variable in study.variables.iter().flatten().filter(|v| v.quantity == Varied::Height) {
        let table = variable.key.strip_suffix(".height").unwrap_or("vary");
        for value in variable.distribution.range().into_iter().flatten() {
            HEIGHT.pass(file, table, value, &mut said)?;
        }
    }
    let mut said: Vec<Diagnostic> = said.into_iter().map(|found| file.placed(found)).collect();
    said.dedup();
    Ok(said)
}

/// Fewest cells along the longer side of the terrain of which nothing is said.
const CELLS: f64 = 10.0;

/// Cells that are so large that maps show nothing.
fn of_cells(base: &Base, file: &Scene) -> Result<Option<Diagnostic>, Diagnostic> {
    let Some(cell) = base.study.maps.as_ref().and_then(|maps| maps.cell) else { return Ok(None) };
    let size = base.ground.highest - base.ground.lowest;
    let (x, y) = (four(size.x), four(size.y));
    let what = format!("cells of {} m, and the terrain is {x} m x {y} m large", four(cell));
    let cure = "leave cell out for some 300 along the longer side";
    if cell >= size.x.max(size.y) {
        return file.refuse("maps.cell", format!("{what}: it would be one"), cure);
    }
    Ok((size.x.max(size.y) < CELLS * cell).then(|| warning(file, "maps.cell", what).try_instead(cure)))
}

/// Members that count alike in shares and quantiles, and do not stand for as many blocks a year.
fn of_rates(base: &Base, file: &Scene) -> Option<Diagnostic> {
    let [few, many] = base.study.unequal()?;
    let what = format!(
        "a member of `{many}` stands for more blocks a year than one of `{few}`: frequencies and return periods weigh that, shares, \
         quantiles and the other maps count all alike"
    );
    let cure = "for these make count proportional to blocks_per_year";
    Some(warning(file, "release.0.blocks_per_year", what).try_instead(cure))
}

/// More blocks a year than any cliff drops.
const MANY: f64 = 1e4;

/// Rates that no cliff has.
fn of_many(base: &Base, file: &Scene) -> Vec<Diagnostic> {
    let rates = base.study.releases.iter().enumerate().filter_map(|(at, r)| Some((at, r.blocks_per_year?)));
    let many = rates.filter(|(_, rate)| *rate > MANY).map(|(at, rate)| {
        let what = format!("{} blocks a year are {} a day", four(rate), four(rate / 365.25));
        let cure = "one block in 50 years is 0.02";
        warning(file, &format!("release.{at}.blocks_per_year"), what).try_instead(cure)
    });
    many.collect()
}

/// Systems that are often taken for each other: codes from, to, and from where to where their coordinates reach [m].
const REACH: [([u32; 2], [f64; 4]); 6] = [
    ([2056, 2056], [2.48e6, 2.84e6, 1.07e6, 1.3e6]),
    ([21781, 21781], [4.8e5, 8.4e5, 7e4, 3e5]),
    ([25828, 25838], [1e5, 9e5, 0.0, 9.4e6]),
    ([32601, 32660], [1e5, 9e5, 0.0, 9.4e6]),
    ([31257, 31259], [1e5, 9e5, 5.1e6, 5.5e6]),
    ([31254, 31256], [-2.5e5, 2.5e5, 5.1e6, 5.5e6]),
];

/// A code in whose area the terrain's coordinates do not lie.
fn of_reach(base: &Base, epsg: u32, file: &Scene) -> Option<Diagnostic> {
    let (_, [west, east, south, north]) =
        REACH.iter().find(|([from, to], _)| (*from..=*to).contains(&epsg))?;
    let ground = &base.ground;
    let [low, high] = [ground.lowest, ground.highest].map(|corner| corner + ground.origin);
    let within = low.x >= *west && high.x <= *east && low.y >= *south && high.y <= *north;
    (!within).then(|| {
        let what = format!(
            "EPSG:{epsg} reaches from ({west}, {south}) to ({east}, {north}), and the terrain from ({:.0}, {:.0}) to ({:.0}, {:.0})",
            low.x, low.y, high.x, high.y
        );
        warning(file, "maps.epsg", what).coded(code::PLACE).try_instead("write the code that the terrain is in")
    })
}

/// Codes of coordinate systems in a GeoTIFF.
const CODES: [u32; 2] = [1024, 32_766];
/// Coordinate systems of longitude and latitude that are in use: no map of metres is in them.
const DEGREES: [u32; 22] = [
    4121, 4149, 4150, 4167, 4171, 4230, 4258, 4265, 4267, 4269, 4277, 4283, 4312, 4314, 4326, 4490, 4612,
    4619, 4674, 4979, 6318, 6706,
];

/// The code of the maps: one that is possible, in metres, and that of the terrain.
fn of_system(base: &Base, file: &Scene) -> Result<Option<Diagnostic>, Diagnostic> {
    let Some(epsg) = base.study.maps.as_ref().and_then(|maps| maps.epsg) else { return Ok(None) };
    let refuse = |what: String, cure: &str| file.refuse("maps.epsg", what, cure);
    if !(CODES[0]..=CODES[1]).contains(&epsg) {
        let [low, high] = CODES;
        let what = format!("epsg = {epsg}: the codes of coordinate systems go from {low} to {high}");
        let cure = "2056 in Switzerland, 31254 to 31259 in Austria, 25832 or 32632 for UTM zone 32";
        return refuse(what, cure);
    }
    if DEGREES.contains(&epsg) {
        let what =
            format!("EPSG:{epsg} is in degrees of longitude and latitude, and the terrain is in metres");
        return refuse(what, "write the code of the system that the terrain is in, as 2056 in Switzerland");
    }
    let own = base.system().map(u32::from).filter(|own| *own != epsg);
    let named = own.map(|own| {
        let what = format!(
            "epsg = {epsg}, and the terrain's file says EPSG:{own}: maps keep the terrain's coordinates and are called EPSG:{epsg}"
        );
        let cure = format!("leave epsg out to call them EPSG:{own}");
        warning(file, "maps.epsg", what).coded(code::CONTRADICTION).try_instead(cure)
    });
    Ok(named.or_else(|| of_reach(base, epsg, file)))
}

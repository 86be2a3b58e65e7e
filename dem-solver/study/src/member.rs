//! One member: its numbers, the model that it is computed with, and its scene: what a run of it computes is what the study has computed.

use super::base::{Base, put_shape, rock_of};
use super::place::{above_ground, line_of_fall};
use super::settings::{Place, Varied};
use dem_contact::contact::whole_rock::Whole;
use dem_contact::rock::Rock;
use dem_contact::settings::{RockSettings, Settings};
use dem_rocks::model::between::rows;
use dem_rocks::model::{Model, Steps};
use dem_solid::geometry::plan;
use dem_solid::geometry::sphere_tree::SphereTree;
use interface_defs::diagnostic::{Diagnostic, code};
use nalgebra::Vector3;
use std::f64::consts::TAU;
use toml::{Table, Value};
use toolkit::coordinates::Form;
use toolkit::input_file::with_absolute_files;
use toolkit::scene::number;

/// Numbers that are drawn for every member: two of its place, three of its orientation, two of the axis of its spin.
const DRAWN: usize = 7;

/// The numbers of a member.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Its number, from 1.
    pub number: u64,
    /// Number of its release, from 0.
    pub release: usize,
    /// Where it starts, seen from above, local [m].
    pub place: [f64; 2],
    /// Quaternion of a random orientation, where the study asks for it.
    pub orientation: Option<[f64; 4]>,
    /// Unit axis of its spin.
    pub axis: Vector3<f64>,
    /// Values of what varies, in the study's order.
    pub values: Vec<toml::Value>,
    /// Which shape it has.
    pub prototype: usize,
}

/// A rock with what is made of it, for the next member of the same shape and size.
pub struct Kept {
    of: (usize, u64, u64),
    rock: Rock,
    tree: SphereTree,
    whole: Option<Whole>,
}

impl Kept {
    /// What a model leaves.
    pub fn of(member: &Member, mut model: Model) -> Option<Self> {
        let (rock, tree) = (model.rocks.pop()?, model.trees.pop()?);
        let volume = rock.solid.volume();
        let of = (member.prototype, volume.to_bits(), rock.mass.to_bits());
        Some(Self { of, rock, tree, whole: model.wholes.pop().flatten() })
    }
}

/// Every orientation as likely as any other, of three numbers from 0 to 1.
///
/// Source: Shoemake (1992), Uniform random rotations, Graphics Gems III.
pub fn orientation([u, v, w]: [f64; 3]) -> [f64; 4] {
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    [b * (TAU * w).cos(), a * (TAU * v).sin(), a * (TAU * v).cos(), b * (TAU * w).sin()]
}

/// Every direction as likely as any other, of two numbers from 0 to 1.
pub fn direction([u, v]: [f64; 2]) -> Vector3<f64> {
    let z = 1.0 - 2.0 * u;
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vector3::new(r * (TAU * v).cos(), r * (TAU * v).sin(), z)
}

/// Unit vector of an azimuth, clockwise from +y seen from above, and an angle below the horizontal [degrees].
fn towards(azimuth: f64, dip: f64) -> Vector3<f64> {
    let (azimuth, dip) = (azimuth.to_radians(), dip.to_radians());
    Vector3::new(azimuth.sin() * dip.cos(), azimuth.cos() * dip.cos(), -dip.sin())
}

/// Put `value` at a dotted key of a document; tables that are not there are made.
pub fn put(document: &mut toml::Table, key: &str, value: toml::Value) {
    let mut parts = key.split('.');
    let Some(first) = parts.next() else { return };
    let table = || Value::Table(Table::new());
    let inner = parts.try_fold(document.entry(first).or_insert_with(table), |node, part| match node {
        Value::Array(items) => items.get_mut(part.parse::<usize>().ok()?),
        Value::Table(inner) => Some(inner.entry(part).or_insert_with(table)),
        _ => None,
    });
    if let Some(node) = inner {
        *node = value;
    }
}

impl Base {
    /// The release of the member with this number, from 1.
    pub fn release_of(&self, number: u64) -> usize {
        let index = (number - 1) % self.replicate();
        self.starts.partition_point(|start| *start <= index) - 1
    }

    /// The member with this number, from 1.
    pub fn member(&self, number: u64) -> Member {
        let (replicate, index) = ((number - 1) / self.replicate(), (number - 1) % self.replicate());
        let release = self.release_of(number);
        let [first, end] = [0, 1].map(|k| self.starts[release + k]);
        let (sampler, within) = (&self.samplers[release], replicate * (end - first) + index - first);
        let draw = |dimension: usize| sampler.at(dimension, within);
        let Place { form, corners, .. } = self.study.releases[release].place();
        let place = match (form, &self.areas[release]) {
            (_, Some(area)) => area.at(draw(0), draw(1)),
            (Form::Points, _) => self.local(&corners[(within % corners.len() as u64) as usize]),
            _ => self.local(&plan::along(corners, draw(0))),
        };
        let mut values: Vec<toml::Value> = (self.study.variables[release].iter().enumerate())
            .map(|(at, variable)| variable.distribution.value(draw(DRAWN + at)))
            .collect();
        for (at, of_replicates) in &self.shared {
            values[*at] = toml::Value::Float(of_replicates[replicate as usize]);
        }
        let shape = self.study.varied().iter().position(|v| v.quantity == Varied::Shape);
        Member {
            number,
            release,
            place,
            orientation: self.study.turned.then(|| orientation([draw(2), draw(3), draw(4)])),
            axis: direction([draw(5), draw(6)]),
            prototype: shape.map_or(0, |at| self.study.varied()[at].distribution.chosen(draw(DRAWN + at))),
            values,
        }
    }

    /// A fault of a member, with its number.
    pub(super) fn of_member(member: &Member) -> impl Fn(Diagnostic) -> Diagnostic {
        let number = member.number;
        move |fault| Diagnostic { message: format!("member {number}: {}", fault.message), ..fault }
    }

    /// A quantity of a member, where it varies.
    pub fn quantity(&self, member: &Member, quantity: Varied) -> Option<f64> {
        let at = self.study.varied().iter().position(|v| v.quantity == quantity)?;
        number(&member.values[at])
    }

    /// The model of a member; `kept` is what the one before has left. Errs with what is wrong.
    pub fn model(&self, member: &Member, kept: Option<Kept>) -> Result<Model, Diagnostic> {
        let mut settings = self.settings_of(member)?;
        let Kept { rock, tree, whole, .. } = self.rock(member, kept);
        let table = &mut settings.rocks[0];
        table.shape = self.prototypes[member.prototype].table.shape.clone();
        (table.mass, table.density) = (Some(rock.mass), None);
        table.scale = Some(self.factor(member)).filter(|factor| *factor != 1.0);
        if let Some(orientation) = member.orientation {
            table.orientation = orientation;
        }
        if let Some(spin) = self.quantity(member, Varied::Spin) {
            table.angular_velocity = (member.axis * spin).into();
        }
        table.velocity = self.velocity(member, &rock, &table.velocity)?.into();
        let height = self.quantity(member, Varied::Height);
        let height = height.unwrap_or(self.study.releases[member.release].height);
        let motion = rock.start(table, settings.gravity);
        let position =
            above_ground(&self.ground, (&rock, &tree), &motion, member.place, height).ok_or_else(|| {
                let [x, y] = [member.place[0] + self.ground.origin.x, member.place[1] + self.ground.origin.y];
                Diagnostic::error(code::PLACE, format!("there is no ground at ({x:.2}, {y:.2})"))
            })?;
        table.position = (position + self.ground.origin).into();
        let mut model = Model::new(settings, vec![rock], vec![tree], self.ground.origin);
        let laws = model.laws.as_ref().ok_or_else(|| Diagnostic::new("there is no contact law"))?;
        model.ground_rows =
            rows(laws, &model.settings, &self.ground.materials).map_err(|[what, _]| Diagnostic::new(what))?;
        (model.ground, model.wholes, model.shortcuts) =
            (Some(self.ground.clone()), vec![whole], self.shortcuts);
        model.steps = Steps::new(&model, &self.scene)?;
        Ok(model)
    }

    /// What the scene says with the member's values in place.
    fn settings_of(&self, member: &Member) -> Result<Settings, Diagnostic> {
        if !self.study.varied().iter().any(|v| v.quantity == Varied::Key) {
            return Ok(self.settings.clone());
        }
        let mut document = self.document.clone();
        for (variable, value) in self.study.varied().iter().zip(&member.values) {
            if variable.quantity == Varied::Key {
                put(&mut document, &variable.name, value.clone());
            }
        }
        Settings::of(&self.scene.patched(document))
    }

    /// The rock of a member, and a table that says of it what the study does.
    pub(super) fn rock_alone(&self, member: &Member) -> (Rock, RockSettings) {
        let mut table = self.prototypes[member.prototype].table.clone();
        table.scale = Some(self.factor(member));
        if self.study.varies(Varied::Density) {
            table.density = Some(self.density(member));
        }
        if let Some(speed) = self.quantity(member, Varied::Speed) {
            table.velocity = [speed, 0.0, 0.0];
        }
        if let Some(spin) = self.quantity(member, Varied::Spin) {
            table.angular_velocity = [spin, 0.0, 0.0];
        }
        (self.rock(member, None).rock, table)
    }

    /// Density of a member [kg/m3].
    fn density(&self, member: &Member) -> f64 {
        let prototype = &self.prototypes[member.prototype];
        let own = || prototype.mass / prototype.rock.solid.scaled(prototype.scale).volume();
        self.quantity(member, Varied::Density).or(prototype.table.density).unwrap_or_else(own)
    }

    /// Lengths of a member over those of its shape as it is stated.
    fn factor(&self, member: &Member) -> f64 {
        let prototype = &self.prototypes[member.prototype];
        let mass = self.quantity(member, Varied::Mass);
        let wanted = self.quantity(member, Varied::Volume).or(mass.map(|mass| mass / self.density(member)));
        wanted.map_or(prototype.scale, |volume| (volume / prototype.rock.solid.volume()).cbrt())
    }

    /// The member's rock: its shape at its size.
    fn rock(&self, member: &Member, kept: Option<Kept>) -> Kept {
        let prototype = &self.prototypes[member.prototype];
        let rock = &prototype.rock;
        let factor = self.factor(member);
        let solid = rock.solid.scaled(factor);
        let varies = [Varied::Volume, Varied::Mass, Varied::Density];
        let mass = if varies.iter().any(|quantity| self.study.varies(*quantity)) {
            self.density(member) * solid.volume()
        } else {
            prototype.mass
        };
        let of = (member.prototype, solid.volume().to_bits(), mass.to_bits());
        if let Some(kept) = kept.filter(|kept| kept.of == of) {
            return kept;
        }
        let rock = if factor == 1.0 && mass == rock.mass { rock.clone() } else { rock.scaled(factor, mass) };
        let whole = prototype.whole.as_ref().map(|whole| whole.scaled(factor));
        Kept { of, tree: SphereTree::new(&rock.spheres), rock, whole }
    }

    /// Velocity of the start: what the study varies of it, else the scene's; without a direction down the line of fall.
    fn velocity(&self, member: &Member, rock: &Rock, own: &[f64; 3]) -> Result<Vector3<f64>, Diagnostic> {
        let own = Vector3::from(*own);
        let [speed, azimuth, dip] =
            [Varied::Speed, Varied::Azimuth, Varied::Dip].map(|quantity| self.quantity(member, quantity));
        if [speed, azimuth, dip].iter().all(Option::is_none) {
            return Ok(own);
        }
        let speed = speed.unwrap_or(own.norm());
        let direction = match (azimuth, dip, own.try_normalize(0.0)) {
            (None, None, Some(direction)) => direction,
            (Some(azimuth), dip, _) => towards(azimuth, dip.unwrap_or(0.0)),
            (None, dip, own) => {
                let fall = own.or_else(|| line_of_fall(&self.ground, member.place, rock.reach));
                let fall = fall.ok_or_else(|| {
                    Diagnostic::new("the ground is level where it starts, and its speed has no direction")
                })?;
                match dip {
                    None => fall,
                    Some(dip) => towards(fall.x.atan2(fall.y).to_degrees(), dip),
                }
            }
        };
        Ok(direction * speed)
    }
}

impl Base {
    /// The scene of a member from its start, with absolute paths. Errs with what is wrong with the member.
    pub fn scene_of(&self, member: &Member) -> Result<Table, Diagnostic> {
        let model = self.model(member, None).map_err(Self::of_member(member))?;
        let mut document = self.document.clone();
        for (variable, value) in self.study.varied().iter().zip(&member.values) {
            match (variable.quantity, rock_of(&mut document)) {
                (Varied::Key, _) => put(&mut document, &variable.name, value.clone()),
                (Varied::Shape, Some(rock)) => put_shape(rock, value),
                _ => {}
            }
        }
        if let Some(rock) = rock_of(&mut document) {
            put_start(rock, &model.settings.rocks[0]);
        }
        with_absolute_files(&mut document, &self.scene)?;
        Ok(document)
    }

    /// The text of a scene that was made for a member, with a head that says so and `more`.
    pub fn text(&self, member: &Member, more: &str, scene: &Table) -> Result<String, Diagnostic> {
        let (number, version) = (member.number, env!("CARGO_PKG_VERSION"));
        let head = format!("Member {number} of a study{more}, by rockfall {version}. Runs as it is.");
        let head: String = head.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        let body = toml::to_string(scene).map_err(|e| Diagnostic::new(e.to_string()))?;
        Ok(format!("# {head}\n\n{body}"))
    }
}

/// Position, velocity, orientation and angular velocity of a rock.
pub fn put_motion(rock: &mut Table, motion: [&[f64]; 4]) {
    for (key, values) in ["position", "velocity", "orientation", "angular_velocity"].into_iter().zip(motion) {
        rock.insert(key.into(), values.to_vec().into());
    }
}

/// Size, mass and motion of a rock at its start.
fn put_start(rock: &mut Table, start: &RockSettings) {
    rock.remove("density");
    rock.remove("scale");
    put_motion(rock, [&start.position, &start.velocity, &start.orientation, &start.angular_velocity]);
    let sizes = [("mass", start.mass), ("scale", start.scale)];
    rock.extend(sizes.into_iter().filter_map(|(key, value)| Some((key.into(), value?.into()))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Quaternion, UnitQuaternion};

    /// Of uniform orientations every entry of the matrix has mean 0 and mean square 1/3, and each image of an axis is uniform:
    /// its share within a cap of height h is h / 2.
    #[test]
    fn orientations_and_directions_are_spread_evenly() {
        let n = 24_u32;
        let part = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
        let (mut sums, mut squares, mut capped) = ([0.0; 9], [0.0; 9], 0);
        let all = f64::from(n * n * n);
        for (i, j, k) in (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| (i, j, k)))) {
            let [w, x, y, z] = orientation([part(i), part(j), part(k)]);
            assert!((w * w + x * x + y * y + z * z - 1.0).abs() < 1e-12);
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
            for (at, entry) in turn.matrix().iter().enumerate() {
                sums[at] += entry / all;
                squares[at] += entry * entry / all;
            }
            capped += u32::from(turn.matrix()[(0, 2)] > 0.4);
        }
        assert!(sums.iter().all(|s| s.abs() < 1e-2), "{sums:?}");
        assert!(squares.iter().all(|s| (s - 1.0 / 3.0).abs() < 2e-3), "{squares:?}");
        assert!((f64::from(capped) / all - 0.3).abs() < 1e-2, "{capped}");
        let upper = (0..n * n).filter(|k| direction([part(k / n), part(k % n)]).z > 0.4).count();
        assert!((upper as f64 / f64::from(n * n) - 0.3).abs() < 0.03, "{upper}");
    }

    #[test]
    fn an_azimuth_is_that_of_a_compass_and_a_dip_points_down() {
        assert!((towards(90.0, 0.0) - Vector3::x()).norm() < 1e-15);
        assert!((towards(0.0, 30.0) - Vector3::new(0.0, 0.75_f64.sqrt(), -0.5)).norm() < 1e-15);
    }

    #[test]
    fn a_value_is_put_at_its_key() {
        let mut document: toml::Table = toml::from_str("[[contact]]\nfriction = 0.5").expect("TOML");
        put(&mut document, "contact.0.friction", 0.7.into());
        put(&mut document, "dem.steps_per_contact", 20.into());
        assert_eq!(
            toml::to_string(&document).expect("text"),
            "[[contact]]\nfriction = 0.7\n\n[dem]\nsteps_per_contact = 20\n"
        );
    }
}

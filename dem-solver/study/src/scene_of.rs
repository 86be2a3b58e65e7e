//! The scene of one member, complete: what a run of it computes is what the study has computed.

use super::base::{Base, put_shape, rock_of};
use super::member::{Member, put};
use super::settings::Quantity;
use dem_contact::settings::RockSettings;
use interface_defs::diagnostic::Diagnostic;
use toml::{Table, Value};
use toolkit::input_file::with_absolute_files;

impl Base {
    /// The scene of a member from its start, with absolute paths. Errs with what is wrong with the member.
    pub fn scene_of(&self, member: &Member) -> Result<Table, Diagnostic> {
        let model = self.model(member, None).map_err(Self::of_member(member))?;
        let mut document = self.document.clone();
        for (variable, value) in self.study.variables.iter().zip(&member.values) {
            match variable.quantity {
                Quantity::Key => put(&mut document, &variable.name, value.clone()),
                Quantity::Shape => {
                    if let Some(rock) = rock_of(&mut document) {
                        put_shape(rock, value);
                    }
                }
                _ => {}
            }
        }
        if let Some(rock) = rock_of(&mut document) {
            put_start(rock, &model.settings.rocks[0]);
        }
        with_absolute_files(&mut document, &self.scene)?;
        Ok(document)
    }

    /// What stands above a scene that was made for a member.
    pub fn head(&self, member: &Member, more: &str) -> String {
        let (number, all, version) = (member.number, self.members(), env!("CARGO_PKG_VERSION"));
        let head =
            format!("Member {number} of {all} of a study{more}, by rockfall {version}. Runs as it is.");
        format!("# {}\n\n", head.chars().map(|c| if c.is_control() { '?' } else { c }).collect::<String>())
    }
}

/// Size, mass and motion of a rock at its start.
pub fn put_start(rock: &mut Table, start: &RockSettings) {
    rock.remove("density");
    rock.remove("scale");
    let mut numbers = |key: &str, values: &[f64]| {
        let values = values.iter().map(|value| Value::Float(*value)).collect();
        rock.insert(key.into(), Value::Array(values));
    };
    numbers("position", &start.position);
    numbers("velocity", &start.velocity);
    numbers("orientation", &start.orientation);
    numbers("angular_velocity", &start.angular_velocity);
    for (key, value) in [("mass", start.mass), ("scale", start.scale)] {
        if let Some(value) = value {
            rock.insert(key.into(), value.into());
        }
    }
}

//! Heights of the terrain around a line, on their way from who reads the terrain to who builds on it.
//!
//! Neither solver knows the other: who starts them asks one where ([`Area`]), and the other for a raster of it.

use super::arguments::Input;
use clap::Args;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Where heights are needed, as the program that needs them says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// Key of the scene that names a raster of them.
    pub wants: String,
    /// Key of the scene that states the line: what is wrong with the place is wrong there.
    pub of: String,
    /// Points of the line, x and y [m].
    pub line: Vec<[f64; 2]>,
    /// EPSG code of the layer that the line was read from, if it names one.
    pub epsg: Option<u32>,
    /// How far from it they are needed [m].
    pub margin: f64,
    /// Distance of the heights [m].
    pub cell: f64,
}

impl Area {
    /// Options of the program that reads the terrain.
    pub fn options(&self) -> Vec<String> {
        let line: Vec<String> = self.line.iter().flatten().map(f64::to_string).collect();
        let named = [
            ("--line", line.join(",")),
            ("--margin", self.margin.to_string()),
            ("--cell", self.cell.to_string()),
            ("--key", self.of.clone()),
        ];
        // With `=`, since a number may begin with a minus.
        let epsg = self.epsg.map(|code| ("--epsg", code.to_string()));
        named.into_iter().chain(epsg).map(|(name, value)| format!("{name}={value}")).collect()
    }
}

/// Of `site`: which scene.
#[derive(Debug, Clone, Args)]
pub struct SiteArguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
}

/// Of `ground`: heights of which terrain, where, into which file.
#[derive(Debug, Clone, Args)]
pub struct GroundArguments {
    /// The scene.
    #[command(flatten)]
    pub input: Input,
    /// Points of the line, in coordinates of the terrain [m]
    #[arg(long, value_name = "X,Y,X,Y", value_delimiter = ',', allow_hyphen_values = true, required = true)]
    pub line: Vec<f64>,
    /// How far from the line heights are written [m]
    #[arg(long, value_name = "M", default_value_t = 10.0)]
    pub margin: f64,
    /// Distance of the heights [m]
    #[arg(long, value_name = "M", default_value_t = 0.25)]
    pub cell: f64,
    /// EPSG code of the coordinate system that the line is in: refused where the terrain's file names another one
    #[arg(long, value_name = "CODE")]
    pub epsg: Option<u32>,
    /// Key of the scene that states the line, for messages
    #[arg(long, value_name = "KEY", hide = true)]
    pub key: Option<String>,
    /// File to write, an ESRI grid (.asc)
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::FromArgMatches;

    #[test]
    fn options_are_read_as_they_were_meant() {
        let area = Area {
            wants: "a.ground".into(),
            of: "a.line".into(),
            line: vec![[-2.6e6, 1.2e6], [0.1, -0.3]],
            epsg: Some(2056),
            margin: 12.5,
            cell: 0.25,
        };
        let command = GroundArguments::augment_args(clap::Command::new("ground"));
        let words = ["ground", "s.toml", "-o", "g.asc"].map(String::from).into_iter().chain(area.options());
        let read = GroundArguments::from_arg_matches(&command.get_matches_from(words)).expect("valid");
        assert_eq!(read.line, [-2.6e6, 1.2e6, 0.1, -0.3]);
        assert_eq!(read.epsg, Some(2056));
        assert_eq!((read.margin, read.cell, read.key.as_deref()), (12.5, 0.25, Some("a.line")));
    }
}

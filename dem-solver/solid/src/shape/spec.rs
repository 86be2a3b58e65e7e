//! One shape, as a scene (`shape = { type = "box", ... }`) or a command line (`box:0.2,0.4,0.6`) names it.

use super::closed::Mend;
use super::formats::{self, read_surface};
use super::pieces::PieceChoice;
use super::surface::Surface;
use super::{builtin, hull};
use crate::input::{LENGTHS, reasonable};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use toolkit::tagged;

/// Times that an icosahedron is refined for the exact surface of a sphere or an ellipsoid: 20 480
/// triangles that lie within 3e-4 radii of it.
const EXACT: u32 = 5;
/// The same for pictures: 1280 triangles.
const DRAWN: u32 = 3;

tagged! {
    /// The true solid, in its own axes. Built-in shapes lie around the origin.
    #[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
    pub enum Shape by "type" (rename_all = "snake_case", deny_unknown_fields) {
        /// A box.
        Box {
            /// Edge lengths along x, y, z [m].
            size: [f64; 3],
        },
        /// A sphere.
        Sphere {
            /// Radius [m].
            radius: f64,
        },
        /// An ellipsoid.
        Ellipsoid {
            /// Half the lengths along x, y, z [m].
            semi_axes: [f64; 3],
        },
        /// The test block of EAD 340059-00-0106: a cube with its edges and corners cut off.
        EadBlock {
            /// Edge of the cube from which it is cut [m].
            size: f64,
        },
        /// A norm rock of the Chant Sura experiments.
        NormRock {
            /// `111` (the EAD block) or `221` (the same, a plate).
            form: NormRock,
            /// Volume [m3].
            volume: f64,
        },
        /// A random convex polyhedron: the hull of points on and in an ellipsoid.
        RandomConvex {
            /// Edges of the box that it fills [m].
            size: [f64; 3],
            /// Another number, another rock. Default 0.
            #[serde(default)]
            seed: u64,
            /// Points, 8 to 10 000; most of them become corners. Default 30.
            #[serde(default = "points")]
            points: u32,
        },
        /// The convex hull of points.
        ConvexHull {
            /// The points [m].
            points: Vec<[f64; 3]>,
        },
        /// A closed surface from a file.
        Mesh {
            /// STL or OBJ; relative to the scene file.
            file: PathBuf,
            /// Metres per unit of the file. Default 1.
            #[serde(default = "one")]
            scale: f64,
            /// Close small holes, as scans have them: up to a tenth of the size wide. Default false.
            #[serde(default, skip_serializing_if = "std::ops::Not::not")]
            close_holes: bool,
            /// Of several closed surfaces in the file take this one: its number, from 1, or its name in the file.
            piece: Option<PieceChoice>,
        },
    }
}

/// Ratio of a norm rock's extents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum NormRock {
    /// 1 : 1 : 1
    #[serde(rename = "111")]
    Cube,
    /// 2 : 2 : 1
    #[serde(rename = "221")]
    Plate,
}

fn points() -> u32 {
    30
}

fn one() -> f64 {
    1.0
}

/// Names of shapes on a command line.
pub const NAMES: &str = "cube:EDGE, box:A,B,C (edges), sphere:RADIUS, ellipsoid:A,B,C (semi-axes), \
                         ead_block:EDGE, norm_rock_111:VOLUME, norm_rock_221:VOLUME, \
                         random_convex:A,B,C[,SEED[,POINTS]] (edges of its box); lengths in m, volumes in m3";

impl Shape {
    /// From a command line: one of [`NAMES`], or a file, with `scale` metres per unit.
    pub fn parse(text: &str, scale: f64) -> Result<Self, Diagnostic> {
        let refuse = |what: String| {
            Diagnostic::in_file(text, what)
                .try_instead(format!("a file ({}) or one of {NAMES}", formats::known(", ")))
        };
        let Some((name, values)) = text.split_once(':').filter(|_| !std::path::Path::new(text).exists())
        else {
            let shape = Self::Mesh { file: text.into(), scale, close_holes: false, piece: None };
            return shape.check().map_err(|(_, what)| refuse(what)).map(|()| shape);
        };
        let values: Vec<f64> = values
            .split(',')
            .map(|v| v.trim().parse().map_err(|_| refuse(format!("`{v}` is not a number"))))
            .collect::<Result<_, _>>()?;
        let shape = match (name, &values[..]) {
            ("cube", [a]) => Self::Box { size: [*a; 3] },
            ("box", [a, b, c]) => Self::Box { size: [*a, *b, *c] },
            ("sphere", [radius]) => Self::Sphere { radius: *radius },
            ("ellipsoid", [a, b, c]) => Self::Ellipsoid { semi_axes: [*a, *b, *c] },
            ("ead_block", [size]) => Self::EadBlock { size: *size },
            ("norm_rock_111", [volume]) => Self::NormRock { form: NormRock::Cube, volume: *volume },
            ("norm_rock_221", [volume]) => Self::NormRock { form: NormRock::Plate, volume: *volume },
            ("random_convex", [a, b, c, rest @ ..]) if rest.len() <= 2 => {
                let whole = |v: f64| if v >= 0.0 && v.fract() == 0.0 { Ok(v as u64) } else { Err(v) };
                let no = |v: f64| refuse(format!("{v} is no whole number"));
                let seed = rest.first().map_or(Ok(0), |v| whole(*v)).map_err(no)?;
                let count = rest.get(1).map_or(Ok(points().into()), |v| whole(*v)).map_err(no)?;
                Self::RandomConvex {
                    size: [*a, *b, *c],
                    seed,
                    points: u32::try_from(count).unwrap_or(u32::MAX),
                }
            }
            _ => return Err(refuse(format!("`{name}` with {} numbers is no shape", values.len()))),
        };
        shape.check().map_err(|(_, what)| refuse(what)).map(|()| shape)
    }

    /// The same shape with all its lengths times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut it = self.clone();
        let grow = |lengths: &mut [f64]| lengths.iter_mut().for_each(|l| *l *= factor);
        match &mut it {
            Self::Box { size } | Self::RandomConvex { size, .. } => grow(size),
            Self::Sphere { radius: length }
            | Self::EadBlock { size: length }
            | Self::Mesh { scale: length, .. } => *length *= factor,
            Self::Ellipsoid { semi_axes } => grow(semi_axes),
            Self::NormRock { volume, .. } => *volume *= factor.powi(3),
            Self::ConvexHull { points } => points.iter_mut().for_each(|p| grow(p)),
        }
        it
    }

    /// Refuse numbers without sense: the key and what is wrong with it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        // Squares and cubes of lengths far from these have no numbers.
        let above = |key, what: &str, values: &[f64]| match values.iter().find(|v| !LENGTHS.contains(*v)) {
            Some(bad) if *bad > 0.0 => {
                let [low, high] = [LENGTHS.start(), LENGTHS.end()];
                Err((key, format!("{what} of {bad:e} m: from {low:e} to {high:e} m are possible")))
            }
            Some(bad) => Err((key, format!("{what} of {bad} m: it must lie above 0"))),
            None => Ok(()),
        };
        match self {
            Self::Box { size } => above("size", "an edge", size),
            Self::Sphere { radius } => above("radius", "a radius", &[*radius]),
            Self::Ellipsoid { semi_axes } => above("semi_axes", "a semi-axis", semi_axes),
            Self::EadBlock { size } => above("size", "an edge", &[*size]),
            Self::NormRock { volume, .. } if *volume > 0.0 => {
                above("volume", "a cube root of the volume", &[volume.cbrt()])
            }
            Self::NormRock { volume, .. } => {
                Err(("volume", format!("a volume of {volume} m3: it must lie above 0")))
            }
            Self::RandomConvex { size, points, .. } => {
                if !(8..=10_000).contains(points) {
                    return Err(("points", format!("{points} points: 8 to 10000 are possible")));
                }
                above("size", "an edge", size)
            }
            Self::ConvexHull { points } if points.len() > hull::MOST_POINTS || points.len() < 4 => {
                Err(("points", format!("{} points: 4 to {} are possible", points.len(), hull::MOST_POINTS)))
            }
            Self::ConvexHull { points } => {
                let mut bad = points.iter().flatten().filter_map(|value| reasonable(*value).err());
                bad.next().map_or(Ok(()), |what| Err(("points", what)))
            }
            Self::Mesh { scale, .. } => above("scale", "a unit", &[*scale]),
        }
    }

    /// Its closed surface, and what was mended in a file's. Of a sphere and an ellipsoid a polyhedron
    /// with its corners on it: a fine one, or one for pictures.
    pub fn surface(&self, drawn: bool) -> Result<(Surface, Vec<String>), Diagnostic> {
        let levels = if drawn { DRAWN } else { EXACT };
        let surface = match self {
            Self::Box { size } => builtin::cuboid((*size).into()),
            Self::Sphere { radius } => builtin::ellipsoid(Vector3::repeat(*radius), levels),
            Self::Ellipsoid { semi_axes } => builtin::ellipsoid((*semi_axes).into(), levels),
            Self::EadBlock { size } => builtin::cut_cube(Vector3::repeat(*size)),
            Self::NormRock { form, volume } => builtin::cut_cube(form.size(*volume)),
            Self::RandomConvex { size, seed, points } => {
                builtin::random_convex((*size).into(), *points, *seed).map_err(Diagnostic::new)?
            }
            Self::ConvexHull { points } => {
                let points: Vec<Vector3<f64>> = points.iter().map(|p| (*p).into()).collect();
                hull::convex(&points).map_err(Diagnostic::new)?
            }
            Self::Mesh { file, scale, close_holes, piece } => {
                let mend = Mend { close_holes: *close_holes, piece: piece.clone(), ..Mend::default() };
                return read_surface(file, *scale, &mend);
            }
        };
        Ok((surface, Vec::new()))
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        match self {
            Self::Box { size: [a, b, c] } => format!("box {a} x {b} x {c} m"),
            Self::Sphere { radius } => format!("sphere of radius {radius} m"),
            Self::Ellipsoid { semi_axes: [a, b, c] } => format!("ellipsoid of semi-axes {a} x {b} x {c} m"),
            Self::EadBlock { size } => format!("EAD 340059 block cut from a cube of {size} m"),
            Self::NormRock { form, volume } => {
                let size = form.size(*volume);
                let ratio = if *form == NormRock::Cube { "1:1:1" } else { "2:2:1" };
                format!("norm rock {ratio} of {volume} m3, {:.6} x {:.6} x {:.6} m", size.x, size.y, size.z)
            }
            Self::RandomConvex { size: [a, b, c], seed, points } => {
                format!("random convex polyhedron (seed {seed}, {points} points) in {a} x {b} x {c} m")
            }
            Self::ConvexHull { points } => format!("convex hull of {} points", points.len()),
            Self::Mesh { file, scale, .. } => format!("surface of {} (scale {scale})", file.display()),
        }
    }
}

impl NormRock {
    /// Extents [m] of the rock with this volume [m3].
    fn size(self, volume: f64) -> Vector3<f64> {
        let ratio: Vector3<f64> = match self {
            Self::Cube => Vector3::new(1.0, 1.0, 1.0),
            Self::Plate => Vector3::new(2.0, 2.0, 1.0),
        };
        ratio * (volume / (ratio.product() * 17.0 / 24.0)).cbrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::SolidIntegrals;

    #[test]
    fn a_command_line_names_every_shape() {
        for (text, volume) in [
            ("cube:0.41", 0.068921),
            ("box:0.2,0.4,0.6", 0.048),
            ("ead_block:0.6", 0.216 * 17.0 / 24.0),
            ("norm_rock_111:1.0", 1.0),
            ("norm_rock_221:0.3", 0.3),
        ] {
            let (surface, _) = Shape::parse(text, 1.0).expect(text).surface(false).expect(text);
            assert!((SolidIntegrals::of(&surface).volume / volume - 1.0).abs() < 1e-14, "{text}");
        }
        for text in ["sphere:0.3", "ellipsoid:0.1,0.2,0.3", "random_convex:1,2,3", "random_convex:1,2,3,7,50"]
        {
            Shape::parse(text, 1.0).expect(text).surface(true).expect(text);
        }
    }

    /// The squares of such lengths are infinite or 0: no nearest point of a surface was found.
    #[test]
    fn lengths_whose_squares_have_no_numbers_are_refused() {
        for text in ["box:1e200,1e200,1e200", "cube:1e155", "sphere:1e-170", "norm_rock_111:1e300"] {
            let error = Shape::parse(text, 1.0).expect_err(text).to_string();
            assert!(error.contains("from 1e-9 to 1e9 m are possible"), "{error}");
        }
        assert!(Shape::ConvexHull { points: vec![[1e200, 0.0, 0.0]; 4] }.check().is_err());
    }

    #[test]
    fn what_names_no_shape_is_refused_with_what_could_be_meant() {
        for text in ["cube:x", "cube:1,2", "cube:-1", "cubes:1", "sphere:nan", "random_convex:1,1,1,0.5"] {
            let error = Shape::parse(text, 1.0).expect_err(text).to_string();
            assert!(error.starts_with(text) && error.contains("ead_block:EDGE"), "{error}");
        }
        let error = Shape::parse("no-such.stl", 1.0).expect("a file").surface(false).expect_err("none");
        assert_eq!(error.to_string(), "no-such.stl: there is no such file");
    }

    #[test]
    fn a_scene_names_shapes_by_type() {
        let read = |text: &str| -> Shape {
            let table: toml::Table = text.parse().expect("TOML");
            toolkit::scene::read_value("shape", &table.into()).expect("a shape")
        };
        let shape = read("type = \"norm_rock\"\nform = \"221\"\nvolume = 0.5");
        assert_eq!(shape, Shape::NormRock { form: NormRock::Plate, volume: 0.5 });
        assert_eq!(read(&toml::to_string(&shape).expect("TOML")), shape);
    }
}

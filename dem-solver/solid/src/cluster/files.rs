//! Files of spheres: `x y z r` text, and Kratos `.clu` (read only).
//!
//! `.clu`: between the lines `Begin centers_and_radii` and `End centers_and_radii` one sphere per line as
//! `x y z r`; `Name`, `Particle_center_and_diameter`, `Size`, `Volume` and `Inertia per unit mass` are each followed by their
//! values on lines of their own; `//` begins a comment. Only the spheres are taken: mass and inertia come from the shape.

use super::wish::MOST_SPHERES;
use crate::geometry::sphere::Sphere;
use crate::input::{LARGEST, ReadError, lines, number, point, read_bytes, shown};
use interface_defs::diagnostic::Diagnostic;
use std::collections::HashMap;
use std::path::Path;

/// The spheres of a file [m], by its extension: `.clu`, else `x y z r` text.
pub fn read(path: &Path) -> Result<Vec<Sphere>, Diagnostic> {
    let bytes = read_bytes(path, LARGEST)?;
    let clu = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("clu"));
    let spheres = if clu { read_clu(&bytes) } else { read_text(&bytes) };
    spheres.map_err(|e| e.in_file(path))
}

/// One sphere per line as `x y z r`, with blanks or commas between; `#` and `//` begin a comment.
pub fn read_text(bytes: &[u8]) -> Result<Vec<Sphere>, ReadError> {
    read_at_most(bytes, MOST_SPHERES as usize)
}

/// The same with at most so many spheres.
pub fn read_at_most(bytes: &[u8], most: usize) -> Result<Vec<Sphere>, ReadError> {
    let mut first = true;
    let spheres = read_list(bytes, most, |line| {
        if std::mem::take(&mut first) {
            named(line)?;
        }
        let what = "numbers are separated by blanks or commas, not by semicolons";
        if line.contains(';') { Err(format!("`{}`: {what}", shown(line))) } else { Ok(true) }
    })?;
    not_none(spheres)
}

/// The spheres in those lines of which `holds` says that they hold one, or what is wrong with the line.
fn read_list(
    bytes: &[u8],
    most: usize,
    mut holds: impl FnMut(&str) -> Result<bool, String>,
) -> Result<Vec<Sphere>, ReadError> {
    let (mut spheres, mut known) = (Vec::new(), HashMap::new());
    for line in lines(bytes) {
        let (at, line) = line?;
        let end = line.find('#').into_iter().chain(line.find("//")).min().unwrap_or(line.len());
        let line = line[..end].trim();
        let fault = |what: String| ReadError::at(at, what);
        if line.is_empty() || !holds(line).map_err(fault)? {
            continue;
        }
        let mut words = line.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|w| !w.is_empty());
        let centre = point(&mut words, at)?;
        let missing = "a number is missing at the end of the line: each holds x y z r [m]";
        let radius = number(Some(words.next().ok_or_else(|| fault(missing.into()))?), at)?;
        if let Some(more) = words.next() {
            return Err(fault(format!("`{}` after x y z r: there must be four numbers", shown(more))));
        }
        if radius <= 0.0 {
            return Err(fault(format!("a radius of {radius} m: it must lie above 0")));
        }
        let key = [centre.x, centre.y, centre.z, radius].map(|v| (v + 0.0).to_bits());
        if let Some(first) = known.insert(key, at) {
            return Err(fault(format!("the same sphere as in line {first}: it would count twice")));
        }
        spheres.push(Sphere { centre, radius });
        if spheres.len() > most {
            return Err(fault(format!("more than {most} spheres")));
        }
    }
    Ok(spheres)
}

fn not_none(spheres: Vec<Sphere>) -> Result<Vec<Sphere>, ReadError> {
    let what = "the file has no spheres: write one per line, as x y z r";
    if spheres.is_empty() { Err(what.into()) } else { Ok(spheres) }
}

/// A first line of words: an error that says what the file may be.
fn named(line: &str) -> Result<(), String> {
    let word = line.split([' ', '\t', ',', ';']).next().unwrap_or_default();
    let letters = word.chars().next().is_some_and(|c| c.is_alphabetic() || c == '"' || c == '$');
    if !letters || word.parse::<f64>().is_ok() {
        return Ok(());
    }
    let surface = |form: &str| {
        format!(
            "this is a surface in {form}, no list of spheres: name it with shape = {{ type = \"mesh\", file = \"...\" }}"
        )
    };
    Err(match word {
        "solid" => surface("STL"),
        "v" | "o" | "g" => surface("OBJ"),
        "ncols" => "this is a grid of terrain, no list of spheres".into(),
        _ => {
            let word = shown(word);
            format!(
                "`{word}` is not a number: a line of column names? Put # before it; each line holds x y z r [m]"
            )
        }
    })
}

/// The spheres of a Kratos cluster.
pub fn read_clu(bytes: &[u8]) -> Result<Vec<Sphere>, ReadError> {
    let (mut inside, mut ended) = (false, false);
    let spheres = read_list(bytes, MOST_SPHERES as usize, |line| {
        match line {
            "Begin centers_and_radii" if inside || ended => return Err("a second list of spheres".into()),
            "Begin centers_and_radii" => inside = true,
            "End centers_and_radii" if !inside => return Err("the list of spheres has no begin".into()),
            "End centers_and_radii" => (inside, ended) = (false, true),
            _ => return Ok(inside),
        }
        Ok(false)
    })?;
    let what = "there is no list from `Begin centers_and_radii` to `End centers_and_radii`: cut off?";
    if ended { not_none(spheres) } else { Err(what.into()) }
}

/// The text of a file of spheres; every line of `header` becomes a comment.
pub fn text(header: &[String], spheres: &[Sphere]) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    for line in header {
        let _ = writeln!(text, "# {line}");
    }
    text += "# x y z r [m]\n";
    for s in spheres {
        let _ = writeln!(text, "{:?} {:?} {:?} {:?}", s.centre.x, s.centre.y, s.centre.z, s.radius);
    }
    text
}

/// In how many groups the spheres fall that do not overlap: 1 is a rock.
pub fn groups(spheres: &[Sphere]) -> usize {
    let mut apart: Vec<&Sphere> = spheres.iter().collect();
    let mut groups = 0;
    while let Some(first) = apart.pop() {
        groups += 1;
        let mut stack = vec![first];
        while let Some(here) = stack.pop() {
            stack.extend(apart.extract_if(.., |other| {
                let sum = (here.radius + other.radius) * (1.0 - 1e-9);
                (here.centre - other.centre).norm_squared() < sum * sum
            }));
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn spheres() -> Vec<Sphere> {
        (0..9)
            .map(|i| Sphere { centre: Vector3::new(0.1 * f64::from(i), -1.0 / 3.0, 1e-7), radius: 0.07 })
            .collect()
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit() {
        let text = text(&["made by a test".into(), "mass 3 kg".into()], &spheres());
        assert!(text.starts_with("# made by a test\n# mass 3 kg\n# x y z r [m]\n0.0 "));
        assert_eq!(read_text(text.as_bytes()), Ok(spheres()));
    }

    #[test]
    fn a_kratos_cluster_is_read_and_what_else_it_says_is_not_believed() {
        let text = "//\n//   Cluster Name: \"two\"\n//\n\nName\ntwo\n\nBegin centers_and_radii\n0 0 0 0.5\n\
                    0.5 0 0 0.25 // the nose\nEnd centers_and_radii\n\nParticle_center_and_diameter\n0.1 0 0 1.2\n\n\
                    Size\n1.2\n\nVolume\n0.55\n\nInertia per unit mass\n0.1\n0.12\n0.12\n";
        let read = read_clu(text.as_bytes()).expect("a cluster");
        assert_eq!(read.len(), 2);
        assert_eq!((read[1].centre.x, read[1].radius), (0.5, 0.25));
        for bad in ["", "Begin centers_and_radii\n0 0 0 1\n", "End centers_and_radii\n"] {
            assert!(read_clu(bad.as_bytes()).is_err(), "{bad}");
        }
        let twice = format!("{text}Begin centers_and_radii\n");
        assert!(read_clu(twice.as_bytes()).expect_err("twice").message.contains("second"));
    }

    #[test]
    fn nonsense_is_refused_with_its_line() {
        let refused = |text: &str| read_text(text.as_bytes()).expect_err("refused");
        for (text, line, what) in [
            ("", None, "no spheres"),
            ("# nothing\n", None, "no spheres"),
            ("0 0 0 1\n0 0 1\n", Some(2), "a number is missing"),
            ("0 0 0 1 5\n", Some(1), "four numbers"),
            ("0 0 0 -1\n", Some(1), "above 0"),
            ("0 0 0 0\n", Some(1), "above 0"),
            ("0 nan 0 1\n", Some(1), "finite"),
            ("0 inf 0 1\n", Some(1), "finite"),
            ("x y z r\n", Some(1), "`x` is not a number"),
            ("0 0 0 1\n1 0 0 1\n0,0, 0 1.0\n", Some(3), "the same sphere as in line 1"),
        ] {
            let error = refused(text);
            assert_eq!(error.line, line, "{text}");
            assert!(error.message.contains(what), "{error:?}");
        }
        assert!(read_text(b"\x00\xff\x80").is_err());
        let many: String = (0..50_001).map(|i| format!("{i} 0 0 1\n")).collect();
        assert!(refused(&many).message.contains("more than 50000"));
    }

    #[test]
    fn spheres_that_only_touch_are_separate_groups() {
        assert_eq!(groups(&spheres()), 1);
        let touching: Vec<_> =
            (0..3).map(|i| Sphere { centre: Vector3::x() * f64::from(i), radius: 0.5 }).collect();
        assert_eq!(groups(&touching), 3);
    }
}

//! The coordinate system that a terrain's file names: an EPSG code.

use crate::formats::crs;
use std::io::BufReader;
use std::path::Path;
use tiff::tags::Tag;
use toolkit::files;

/// Geo key of the code of a projected system, and its value where the file defines one of its own.
pub const PROJECTED_TYPE: u16 = 3072;
/// See [`PROJECTED_TYPE`].
pub const USER_DEFINED: u16 = 32_767;

/// The code that a file names, or the `.prj` beside it.
pub fn of_file(file: &Path) -> Option<u16> {
    of_tif(file).or_else(|| of_text(file))
}

/// The code in a GeoTIFF.
fn of_tif(file: &Path) -> Option<u16> {
    let mut decoder = tiff::decoder::Decoder::new(BufReader::new(files::input(file).ok()?)).ok()?;
    let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).ok()?;
    let code =
        keys[4.min(keys.len())..].chunks_exact(4).find(|key| key[0] == PROJECTED_TYPE && key[1] == 0)?[3];
    (code != USER_DEFINED && code > 0).then_some(code)
}

/// The code of the whole, which stands last in the well-known text beside a file.
fn of_text(file: &Path) -> Option<u16> {
    code_in(&String::from_utf8(files::read_input(&file.with_extension("prj"), crs::LARGEST).ok()?).ok()?)
}

fn code_in(text: &str) -> Option<u16> {
    let compact: String = text.chars().filter(|c| !c.is_whitespace() && *c != '"').collect();
    let ends = compact.trim_end_matches(']');
    // No bracket is open behind it but those that close the whole.
    let at = ends.rfind("[EPSG,")?;
    ends[at + 6..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_the_whole_is_found_in_well_known_text() {
        let swiss = "PROJCS[\"CH1903+ / LV95\",\n GEOGCS[\"x\",AUTHORITY[\"EPSG\",\"4150\"]],UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],\n AUTHORITY[\"EPSG\",\"2056\"]]";
        assert_eq!(code_in(swiss), Some(2056));
        assert_eq!(code_in("PROJCRS[\"x\",ID[\"EPSG\",25832]]"), Some(25832));
        assert_eq!(
            code_in("PROJCS[\"x\",GEOGCS[\"y\",AUTHORITY[\"EPSG\",\"4150\"]],UNIT[\"metre\",1]]"),
            None
        );
    }
}

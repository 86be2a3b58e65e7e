//! In which coordinates a terrain file says that it is: the EPSG code of its system, and degrees and feet, which are refused, as a
//! scene is in metres.
//!
//! Source: OGC GeoTIFF 1.1 (geo keys; LAS holds the same), OGC 01-009 and ISO 19162 (well-known text).

use dem_solid::input::ReadError;
use std::io::BufReader;
use std::path::Path;
use tiff::tags::Tag;
use toolkit::files;

/// Geo keys and their values.
const MODEL: u16 = 1024;
const GEOGRAPHIC: u16 = 2;
const GEOCENTRIC: u16 = 3;
const GEOGRAPHIC_TYPE: u16 = 2048;
/// Geo key of the code of a projected system.
pub const PROJECTED_TYPE: u16 = 3072;
/// Code of the system of maps in browsers.
const WEB_MERCATOR: u16 = 3857;
const LINEAR_UNITS: u16 = 3076;
const VERTICAL_TYPE: u16 = 4096;
const VERTICAL_UNITS: u16 = 4099;
/// Value of a key that a file defines itself.
pub const USER_DEFINED: u16 = 32_767;
/// Longest description of a coordinate system that is read [bytes].
const LARGEST: u64 = 1 << 20;

/// A unit of length: its EPSG code, its name, metres.
const UNITS: [(u16, &str, f64); 5] = [
    (9002, "feet", 0.3048),
    (9003, "US survey feet", 1200.0 / 3937.0),
    (9005, "Clarke's feet", 0.304_797_265_4),
    (9036, "kilometres", 1000.0),
    (9093, "miles", 1609.344),
];

/// Codes of systems of heights in feet, and which of the units these are: NAVD88 (ft), NGVD29 and NAVD88 (ftUS).
const HEIGHTS_IN_FEET: [(u16, usize); 3] = [(8228, 0), (5702, 1), (6360, 1)];

/// What to do about coordinates in degrees.
const PROJECT: &str = "project it to metres, as with gdalwarp -t_srs EPSG:CODE IN OUT (EPSG:2056 in Switzerland, EPSG:326NN for UTM zone NN)";

fn degrees(which: &str) -> ReadError {
    ReadError::new(format!("its coordinates are degrees ({which}), and a scene is in metres"))
        .try_instead(PROJECT)
}

fn unit(what: &str, (_, name, metres): (u16, &str, f64)) -> ReadError {
    let wrong =
        ReadError::new(format!("its {what} are in {name} of {metres:.7} m, and a scene is in metres"));
    wrong.try_instead(match what {
        "heights" => format!(
            "multiply its heights by {metres:.7}, as with gdal_calc.py --calc=\"A*{metres:.7}\" -A IN --outfile OUT"
        ),
        _ => "project it to metres, as with gdalwarp -t_srs EPSG:CODE IN OUT".into(),
    })
}

/// The value of a geo key in a directory of them, four numbers each behind a head of four.
fn geo_key(directory: &[u16], key: u16) -> Option<u16> {
    let found = directory.chunks_exact(4).skip(1).find(|k| k[0] == key && k[1] == 0);
    found.map(|k| k[3])
}

/// Judge a directory of geo keys and the text that they point into.
pub fn geo_keys(directory: &[u16], text: &str) -> Result<(), ReadError> {
    let of = |key: u16| geo_key(directory, key);
    let code =
        |key: u16| of(key).filter(|c| *c != USER_DEFINED).map_or(String::new(), |c| format!(", EPSG:{c}"));
    match of(MODEL) {
        Some(GEOGRAPHIC) => return Err(degrees(&format!("geographic{}", code(GEOGRAPHIC_TYPE)))),
        Some(GEOCENTRIC) => {
            let what = "its coordinates are geocentric: z is not upward";
            return Err(ReadError::new(what).try_instead(PROJECT));
        }
        _ => {}
    }
    for (key, what) in [(LINEAR_UNITS, "coordinates"), (VERTICAL_UNITS, "heights")] {
        if let Some(found) = of(key).and_then(|c| UNITS.iter().find(|(epsg, ..)| *epsg == c)) {
            return Err(unit(what, *found));
        }
    }
    if of(PROJECTED_TYPE) == Some(WEB_MERCATOR) {
        let what =
            "EPSG:3857 (Web Mercator) stretches lengths, at 46 degrees by 1.44, and a scene is in metres";
        return Err(ReadError::new(what).try_instead(PROJECT));
    }
    if let Some((_, feet)) = HEIGHTS_IN_FEET.iter().find(|(code, _)| of(VERTICAL_TYPE) == Some(*code)) {
        return Err(unit("heights", UNITS[*feet]));
    }
    // A code alone does not say its unit; its name mostly does.
    if of(LINEAR_UNITS).is_none()
        && of(PROJECTED_TYPE).is_some()
        && let Some(feet) = feet_in(text)
    {
        return Err(unit("coordinates", feet));
    }
    Ok(())
}

/// Judge well-known text.
pub fn well_known_text(text: &str) -> Result<(), ReadError> {
    let text = text.trim_start_matches('\u{feff}').trim();
    if ["GEOGCS", "GEOGCRS", "GEODCRS", "GEOGRAPHICCRS"].iter().any(|k| text.starts_with(k)) {
        return Err(degrees(text.split('"').nth(1).unwrap_or("geographic")));
    }
    let vertical = ["VERT_CS", "VERTCRS", "VERTICALCRS"].iter().filter_map(|k| text.find(k)).min();
    let (plane, heights) = text.split_at(vertical.unwrap_or(text.len()));
    for (part, what) in [(plane, "coordinates"), (heights, "heights")] {
        let words = part.match_indices("UNIT").filter_map(|(at, _)| part[at..].split('"').nth(1));
        if let Some(feet) = words.filter_map(feet_in).next() {
            return Err(unit(what, feet));
        }
    }
    Ok(())
}

fn feet_in(text: &str) -> Option<(u16, &'static str, f64)> {
    let text = text.to_lowercase();
    let has = |words: &[&str]| words.iter().any(|w| text.contains(w));
    if !has(&["foot", "feet", "ftus", "(ft)", "_ft"]) {
        return None;
    }
    Some(if has(&["us", "survey"]) { UNITS[1] } else { UNITS[0] })
}

/// The unit of heights as GDAL writes it: empty, "m", "ft", "US survey foot".
pub fn unit_of_heights(text: &str) -> Result<(), ReadError> {
    let word = text.trim().to_lowercase();
    let known = if word == "ft" { Some(UNITS[0]) } else { feet_in(&word) };
    known.map_or(Ok(()), |feet| Err(unit("heights", feet)))
}

/// The text of the file with the extension `.prj` beside a terrain, and its name, if there is one.
fn beside(file: &Path) -> Option<(String, String)> {
    let prj = file.with_extension("prj");
    let bytes = files::read_input(&prj, LARGEST).ok()?;
    let name = prj.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Some((String::from_utf8_lossy(&bytes).into_owned(), name))
}

/// Judge the file with the extension `.prj` beside a terrain, if there is one.
pub fn check_beside(file: &Path) -> Result<(), ReadError> {
    let Some((text, name)) = beside(file) else { return Ok(()) };
    well_known_text(&text).map_err(|e| ReadError { message: format!("{} (by {name})", e.message), ..e })
}

/// The code that a file names, or the `.prj` beside it.
pub fn of_file(file: &Path) -> Option<u16> {
    // The code of the whole stands last in well-known text.
    of_tif(file).or_else(|| code_in(&beside(file)?.0))
}

/// The code in a GeoTIFF.
fn of_tif(file: &Path) -> Option<u16> {
    let mut decoder = tiff::decoder::Decoder::new(BufReader::new(files::input(file).ok()?)).ok()?;
    let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).ok()?;
    geo_key(&keys, PROJECTED_TYPE).filter(|code| *code != USER_DEFINED && *code > 0)
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

    fn keys(entries: &[(u16, u16)]) -> Vec<u16> {
        let mut all = vec![1, 1, 0, entries.len() as u16];
        entries.iter().for_each(|(key, value)| all.extend([*key, 0, 1, *value]));
        all
    }

    #[test]
    fn degrees_and_feet_are_found_in_geo_keys() {
        let of = |entries: &[(u16, u16)], text: &str| geo_keys(&keys(entries), text).map_err(|e| e.message);
        assert_eq!(of(&[(1024, 1), (3072, 2056), (3076, 9001), (4099, 9001)], "CH1903+ / LV95"), Ok(()));
        assert_eq!(of(&[], ""), Ok(()));
        let found = |entries: &[(u16, u16)], text: &str, words: &str| {
            let what = of(entries, text).expect_err(words);
            assert!(what.contains(words), "{what}");
        };
        found(&[(1024, 2), (2048, 4326)], "WGS 84", "degrees (geographic, EPSG:4326)");
        found(&[(1024, 3)], "", "geocentric");
        found(&[(1024, 1), (3076, 9003)], "", "coordinates are in US survey feet of 0.3048006 m");
        found(&[(1024, 1), (3076, 9001), (4099, 9002)], "", "heights are in feet of 0.3048000 m");
        found(&[(1024, 1), (3072, 3857)], "", "stretches lengths");
        found(&[(1024, 1), (3072, 26910), (4096, 6360)], "", "heights are in US survey feet");
        found(&[(1024, 1), (3072, 2227)], "NAD83 / California zone 3 (ftUS)|", "US survey feet");
    }

    #[test]
    fn degrees_and_feet_are_found_in_well_known_text() {
        let degree = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],UNIT["degree",0.0174532925199433]]"#;
        let metre = format!(r#"PROJCS["CH1903+ / LV95",{degree},PROJECTION["x"],UNIT["metre",1]]"#);
        let feet = metre.replace(r#"UNIT["metre",1]"#, r#"UNIT["Foot_US",0.3048006096012192]"#);
        let heights =
            format!(r#"COMPD_CS["both",{metre},VERT_CS["NAVD88 height (ft)",UNIT["foot",0.3048]]]"#);
        assert_eq!(well_known_text(&metre), Ok(()));
        let what = |text: &str| well_known_text(text).expect_err(text).message;
        assert!(what(degree).contains("degrees (WGS 84)"));
        assert!(what(&feet).contains("coordinates are in US survey feet"));
        assert!(what(&heights).contains("heights are in feet"));
    }

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

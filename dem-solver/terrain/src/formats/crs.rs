//! In which coordinates a terrain file says that it is: degrees and feet are refused, as a scene is in metres.
//!
//! Source: OGC GeoTIFF 1.1 (geo keys; LAS holds the same), OGC 01-009 and ISO 19162 (well-known text).

use interface_defs::diagnostic::Diagnostic;
use std::path::Path;
use toolkit::files;

/// Geo keys and their values.
const MODEL: u16 = 1024;
const GEOGRAPHIC: u16 = 2;
const GEOCENTRIC: u16 = 3;
const GEOGRAPHIC_TYPE: u16 = 2048;
const PROJECTED_TYPE: u16 = 3072;
const LINEAR_UNITS: u16 = 3076;
const VERTICAL_UNITS: u16 = 4099;
/// Value of a key that a file defines itself.
const USER_DEFINED: u16 = 32_767;

/// A unit of length: its EPSG code, its name, metres.
const UNITS: [(u16, &str, f64); 5] = [
    (9002, "feet", 0.3048),
    (9003, "US survey feet", 1200.0 / 3937.0),
    (9005, "Clarke's feet", 0.304_797_265_4),
    (9036, "kilometres", 1000.0),
    (9093, "miles", 1609.344),
];

/// What is wrong, and what to try.
type Wrong = (String, String);

fn degrees(which: &str) -> Wrong {
    (
        format!("its coordinates are degrees ({which}), and a scene is in metres"),
        "project it to metres, as with gdalwarp -t_srs EPSG:CODE IN OUT (EPSG:2056 in Switzerland, EPSG:326NN for UTM \
         zone NN)"
            .into(),
    )
}

fn unit(what: &str, name: &str, metres: f64) -> Wrong {
    (
        format!("its {what} are in {name} of {metres:.7} m, and a scene is in metres"),
        if what == "heights" {
            format!(
                "multiply its heights by {metres:.7}, as with gdal_calc.py --calc=\"A*{metres:.7}\" -A IN --outfile OUT"
            )
        } else {
            "project it to metres, as with gdalwarp -t_srs EPSG:CODE IN OUT".into()
        },
    )
}

/// Judge a directory of geo keys, four numbers each behind a head of four, and the text that they point into.
pub fn geo_keys(directory: &[u16], text: &str) -> Result<(), Wrong> {
    let of = |key: u16| {
        let found = directory.chunks_exact(4).skip(1).find(|k| k[0] == key && k[1] == 0);
        found.map(|k| k[3])
    };
    let code =
        |key: u16| of(key).filter(|c| *c != USER_DEFINED).map_or(String::new(), |c| format!(", EPSG:{c}"));
    match of(MODEL) {
        Some(GEOGRAPHIC) => return Err(degrees(&format!("geographic{}", code(GEOGRAPHIC_TYPE)))),
        Some(GEOCENTRIC) => {
            let what = "its coordinates are geocentric: z is not upward";
            return Err((what.into(), degrees("").1));
        }
        _ => {}
    }
    for (key, what) in [(LINEAR_UNITS, "coordinates"), (VERTICAL_UNITS, "heights")] {
        if let Some((_, name, metres)) = of(key).and_then(|c| UNITS.iter().find(|(epsg, ..)| *epsg == c)) {
            return Err(unit(what, name, *metres));
        }
    }
    // A code alone does not say its unit; its name mostly does.
    if of(LINEAR_UNITS).is_none()
        && of(PROJECTED_TYPE).is_some()
        && let Some((_, name, metres)) = feet_in(text)
    {
        return Err(unit("coordinates", name, metres));
    }
    Ok(())
}

/// Judge well-known text.
pub fn well_known_text(text: &str) -> Result<(), Wrong> {
    let text = text.trim_start_matches('\u{feff}').trim();
    if ["GEOGCS", "GEOGCRS", "GEODCRS", "GEOGRAPHICCRS"].iter().any(|k| text.starts_with(k)) {
        return Err(degrees(text.split('"').nth(1).unwrap_or("geographic")));
    }
    let vertical = ["VERT_CS", "VERTCRS", "VERTICALCRS"].iter().filter_map(|k| text.find(k)).min();
    let (plane, heights) = text.split_at(vertical.unwrap_or(text.len()));
    for (part, what) in [(plane, "coordinates"), (heights, "heights")] {
        let words = part.match_indices("UNIT").filter_map(|(at, _)| part[at..].split('"').nth(1));
        if let Some((_, name, metres)) = words.filter_map(feet_in).next() {
            return Err(unit(what, name, metres));
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
pub fn unit_of_heights(text: &str) -> Result<(), Wrong> {
    let word = text.trim().to_lowercase();
    let known = if word == "ft" { Some(UNITS[0]) } else { feet_in(&word) };
    known.map_or(Ok(()), |(_, name, metres)| Err(unit("heights", name, metres)))
}

/// The same as an error about `file`.
pub fn refused(file: &str, judged: Result<(), Wrong>) -> Result<(), Diagnostic> {
    judged.map_err(|(what, cure)| Diagnostic::in_file(file, what).try_instead(cure))
}

/// Longest description of a coordinate system that is read [bytes].
pub const LARGEST: u64 = 1 << 20;

/// Judge the file with the extension `.prj` beside a terrain, if there is one.
pub fn beside(path: &Path) -> Result<(), Diagnostic> {
    let prj = path.with_extension("prj");
    let Ok(bytes) = files::read_input(&prj, LARGEST) else { return Ok(()) };
    let text = String::from_utf8_lossy(&bytes);
    refused(
        &path.display().to_string(),
        well_known_text(&text).map_err(|(what, cure)| {
            (format!("{what} (by {})", prj.file_name().unwrap_or_default().to_string_lossy()), cure)
        }),
    )
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
        let of =
            |entries: &[(u16, u16)], text: &str| geo_keys(&keys(entries), text).map_err(|(what, _)| what);
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
        let what = |text: &str| well_known_text(text).expect_err(text).0;
        assert!(what(degree).contains("degrees (WGS 84)"));
        assert!(what(&feet).contains("coordinates are in US survey feet"));
        assert!(what(&heights).contains("heights are in feet"));
    }
}

//! The maps: per cell how many rocks passed or stopped there, and quantiles of how fast, how strong, how high. Each is a GeoTIFF,
//! one band of numbers, north up, in the terrain's coordinate system, and a picture; the two ends of an interval are GeoTIFFs beside it.
//! Trajectories and ends of members are layers of a GeoPackage, with what became of each. Beside each raster lies its style for QGIS.
//!
//! Source: OGC GeoTIFF 1.1, 7.1 and B; the mark of cells without a value is GDAL's.

use super::geopackage::{GeoPackage, Geometry, Layer};
use super::picture::{self, Map, Scale};
use super::style;
use crate::base::Base;
use crate::bounds::{Ends, Part, of_frequency, of_share, quantile};
use crate::grid::Grid;
use crate::record::{All, How, QUANTITIES, Record};
use crate::summary::quantile_of;
use dem_rocks::results::map::sheet::Imprint;
use dem_terrain::system::{PROJECTED_TYPE, USER_DEFINED};
use interface_defs::diagnostic::{Diagnostic, code};
use rusqlite::types::Value as Attribute;
use rustc_hash::FxHashMap;
use std::io::{self, Cursor};
use std::ops::Range;
use std::path::Path;
use tiff::TiffResult;
use tiff::encoder::colortype::Gray32Float;
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, TiffEncoder};
use tiff::tags::Tag;
use toolkit::files;
use toolkit::numbers;
use toolkit::summary::RunStatus;

/// The quantities of a visit, in its order: name of the file, and what the picture says.
const VISITED: [(&str, &str); 4] = [
    ("speed", "speed [m/s]"),
    ("kinetic_energy", "kinetic energy, rotation included [J]"),
    ("rotation_energy", "energy of rotation [J]"),
    ("jump_height", "jump height of the lowest point [m]"),
];

/// Shares of which there are maps [%]: those that a design asks for.
const SHARES: [u32; 4] = [50, 90, 95, 99];

/// Where few rocks pass, a high quantile is between the two largest of them.
fn note(share: u32) -> Option<String> {
    let few = 100 / (100 - share) + 1;
    (share >= 90).then(|| format!("where up to {few} rocks pass (see count): between the two largest"))
}

/// Maps that have an interval, and what ends the names of its two ends.
const INTERVALS: [&str; 6] = ["share", "frequency", VISITED[0].0, VISITED[1].0, VISITED[2].0, VISITED[3].0];
const ENDINGS: [&str; 3] = ["", "_low", "_high"];

/// Values of cells that are in memory at once, 4 bytes each: where there are more, members are read again for other cells.
const AT_ONCE: usize = 100_000_000;

/// The cells in parts with at most so many values, where one cell alone has no more; `starts`: where the values of each begin, and all end.
fn parts(starts: &[usize], most: usize) -> Vec<Range<usize>> {
    let (mut parts, mut first) = (Vec::new(), 0);
    while first + 1 < starts.len() {
        let end = starts.partition_point(|start| *start <= starts[first] + most) - 1;
        let end = end.max(first + 1);
        parts.push(first..end);
        first = end;
    }
    parts
}

/// Write all maps of a study.
pub fn write(
    base: &Base,
    grid: &Grid,
    system: &System,
    dir: &Path,
    imprint: &Imprint,
    all: All,
) -> io::Result<()> {
    let (mut count, mut ends, mut computed) = (vec![0_u32; grid.cells()], vec![0_u32; grid.cells()], 0_u64);
    // Of each release its blocks a year, its members, and how many of them pass each cell.
    let rates = base.study.rates().into_iter().flatten();
    let mut rated: Vec<(f64, u64, Vec<u32>)> = rates.map(|rate| (rate, 0, vec![0; grid.cells()])).collect();
    all(&mut |record| {
        if record.outcome.status == RunStatus::Failed {
            return Ok(());
        }
        computed += 1;
        record.track.visits.iter().for_each(|visit| count[visit.cell as usize] += 1);
        if let Some((_, members, count)) = rated.get_mut(base.release_of(record.number)) {
            *members += 1;
            record.track.visits.iter().for_each(|visit| count[visit.cell as usize] += 1);
        }
        let [x, y, _] = record.outcome.end;
        let place = base.local(&[x, y]);
        if let Some(cell) = grid.at(place).filter(|_| record.outcome.how == How::Rest) {
            ends[cell as usize] += 1;
        }
        Ok(())
    })?;
    let picture = picture::Sheet::new(base, grid, computed, imprint, |cell| count[cell] > 0);
    let band =
        |name: &str, values: &[f32]| write_band(&dir.join(format!("{name}.tif")), base, grid, system, values);
    let put = |name: &str, title: String, note, scale, values: &[f32]| {
        band(name, values)?;
        // The ends of the interval of a value have its colours.
        if values.iter().any(|value| !value.is_nan()) {
            let style = style::of_raster(scale, values);
            for end in
                if INTERVALS.iter().any(|of| name.starts_with(of)) { &ENDINGS[..] } else { &ENDINGS[..1] }
            {
                files::write(&dir.join(format!("{name}{end}.qml")), style.as_bytes())?;
            }
        }
        picture.write(&dir.join(format!("{name}.svg")), &Map { title, note, scale, values })
    };
    let known = |of: &dyn Fn(usize) -> f32| -> Vec<f32> {
        (0..grid.cells()).map(|cell| if count[cell] > 0 { of(cell) } else { f32::NAN }).collect()
    };
    let passing = known(&|cell| count[cell] as f32);
    put("count", "number of rocks passing".into(), None, Scale::Log, &passing)?;
    let shares = known(&|cell| (f64::from(count[cell]) / computed.max(1) as f64) as f32);
    put("share", "share of rocks passing".into(), None, Scale::Log, &shares)?;
    let interval = |cell: usize| of_share(count[cell].into(), computed.max(1));
    band("share_low", &known(&|cell| interval(cell).low.map_or(f32::NAN, |low| low as f32)))?;
    band("share_high", &known(&|cell| interval(cell).high.map_or(f32::NAN, |high| high as f32)))?;
    // Of a release without a member nothing is known.
    if !rated.is_empty() && rated.iter().all(|(_, members, _)| *members > 0) {
        let part = |cell: usize| {
            let all = rated.iter().map(|(rate, all, count)| (*rate, *all, count[cell].into()));
            of_frequency(all.map(|(rate, all, count)| Part { rate, count, all }))
        };
        let often = known(&|cell| part(cell).0 as f32);
        put("frequency", "rocks passing in a year [1/year]".into(), None, Scale::Log, &often)?;
        let end = |end: Option<f64>| end.map_or(f32::NAN, |end| end as f32);
        band("frequency_low", &known(&|cell| end(part(cell).1.low)))?;
        band("frequency_high", &known(&|cell| end(part(cell).1.high)))?;
    }
    let stopped: Vec<f32> = ends.iter().map(|n| if *n > 0 { *n as f32 } else { f32::NAN }).collect();
    put("deposition", "number of rocks at rest".into(), None, Scale::Linear, &stopped)?;
    // Where the values of each cell begin in one long row.
    let mut starts = vec![0_usize];
    count.iter().for_each(|n| starts.push(starts[starts.len() - 1] + *n as usize));
    // Where intervals end depends on the number of rocks alone.
    let mut ends: FxHashMap<usize, [Ends; SHARES.len()]> = FxHashMap::default();
    for (number, (name, title)) in VISITED.into_iter().enumerate() {
        // The quantile, and both ends of its interval.
        let mut maps = vec![[(); 3].map(|()| vec![f32::NAN; grid.cells()]); SHARES.len()];
        let mut sorted = Vec::new();
        for part in parts(&starts, AT_ONCE) {
            let before = starts[part.start];
            let mut values = vec![0.0_f32; starts[part.end] - before];
            let mut next = starts[part.clone()].to_vec();
            all(&mut |record| {
                if record.outcome.status == RunStatus::Failed {
                    return Ok(());
                }
                let visits = record.track.visits.iter().filter(|visit| part.contains(&(visit.cell as usize)));
                for visit in visits {
                    let place = &mut next[visit.cell as usize - part.start];
                    values[*place - before] = visit.values[number];
                    *place += 1;
                }
                Ok(())
            })?;
            for cell in part.filter(|cell| count[*cell] > 0) {
                sorted.clear();
                let own = starts[cell] - before..starts[cell + 1] - before;
                sorted.extend(values[own].iter().map(|v| f64::from(*v)));
                sorted.sort_by(f64::total_cmp);
                let ends = ends.entry(sorted.len()).or_insert_with_key(|count| {
                    SHARES.map(|share| Ends::of(*count, f64::from(share) / 100.0))
                });
                for ((maps, share), ends) in maps.iter_mut().zip(SHARES).zip(ends) {
                    let of = ends.on(&sorted);
                    let all = [Some(quantile(&sorted, f64::from(share) / 100.0)), of.low, of.high];
                    for (map, value) in maps.iter_mut().zip(all) {
                        map[cell] = value.map_or(f32::NAN, |value| value as f32);
                    }
                }
            }
        }
        for ([map, low, high], share) in maps.iter().zip(SHARES) {
            let (title, name) = (format!("{share} % quantile of the {title}"), quantile_of(name, share));
            put(&name, title, note(share), Scale::Linear, map)?;
            band(&format!("{name}_low"), low)?;
            band(&format!("{name}_high"), high)?;
        }
    }
    Ok(())
}

/// Value of cells without one.
const NOTHING: f32 = -9999.0;
/// Geo keys, and their values.
const MODEL: u16 = 1024;
const PROJECTED: u16 = 1;
const RASTER: u16 = 1025;
const PIXEL_IS_AREA: u16 = 1;
const LINEAR_UNITS: u16 = 3076;
const METRE: u16 = 9001;

/// The coordinate system of the maps.
pub struct System {
    /// Its EPSG code.
    pub epsg: Option<u16>,
}

impl System {
    /// That which the study names, else that of the terrain's file.
    pub fn of(base: &Base) -> Self {
        let named = base.study.maps.as_ref().and_then(|maps| maps.epsg);
        // Checked: there is no such code above.
        let named = named.and_then(|code| u16::try_from(code).ok());
        Self { epsg: named.or_else(|| base.system()) }
    }

    /// What the user should know of it.
    pub fn warning(&self) -> Option<Diagnostic> {
        self.epsg.is_none().then(|| {
            let what = "maps have no coordinate system: the terrain's file names none";
            Diagnostic::warning(code::PLACE, what)
                .try_instead("write its code in the study, as in maps.epsg = 2056")
        })
    }
}

/// Write one band; NaN: no value.
fn write_band(path: &Path, base: &Base, grid: &Grid, system: &System, values: &[f32]) -> io::Result<()> {
    let mut file = Cursor::new(Vec::new());
    encode(&mut file, base, grid, system, values).map_err(io::Error::other)?;
    files::write(path, file.get_ref())
}

fn encode(
    file: &mut Cursor<Vec<u8>>,
    base: &Base,
    grid: &Grid,
    system: &System,
    values: &[f32],
) -> TiffResult<()> {
    let [columns, rows] = grid.counts.map(|n| n as u32);
    let mut encoder = TiffEncoder::new(file)?.with_compression(Compression::Deflate(DeflateLevel::default()));
    let mut image = encoder.new_image::<Gray32Float>(columns, rows)?;
    let [west, north] = [0, 1].map(|k| grid.corner[k] + base.ground.origin[k]);
    let mut keys: Vec<u16> = Vec::new();
    let mut key = |id: u16, value: u16| keys.extend([id, 0, 1, value]);
    key(MODEL, PROJECTED);
    key(RASTER, PIXEL_IS_AREA);
    key(PROJECTED_TYPE, system.epsg.unwrap_or(USER_DEFINED));
    if system.epsg.is_none() {
        key(LINEAR_UNITS, METRE);
    }
    let head = [1, 1, 0, (keys.len() / 4) as u16];
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[grid.cell, grid.cell, 0.0][..])?;
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, west, north, 0.0][..])?;
    tags.write_tag(Tag::GeoKeyDirectoryTag, &[&head[..], &keys].concat()[..])?;
    tags.write_tag(Tag::GdalNodata, &*format!("{NOTHING}"))?;
    let filled: Vec<f32> = values.iter().map(|v| if v.is_nan() { NOTHING } else { *v }).collect();
    image.write_data(&filled)
}

/// Layers of trajectories, thin lines, and of where each rock ended: a circle where it is at rest, a triangle where it left the terrain, a
/// cross where it still moved.
const FEATURES: &str = "study.gpkg";
const TRAJECTORIES: Layer =
    Layer { name: "trajectories", geometry: Geometry::LineString, style: include_str!("trajectories.qml") };
const ENDS: Layer = Layer { name: "ends", geometry: Geometry::Point, style: include_str!("ends.qml") };

/// Millimetres are enough on a map.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Significant digits of attributes: all are in the table of members.
const DIGITS: usize = 6;

/// Attributes of a member that are no numbers of a fall.
const OWN: [(&str, &str); 6] = [
    ("member", "INTEGER"),
    ("release", "TEXT"),
    ("status", "TEXT"),
    ("ending", "TEXT"),
    ("volume_m3", "DOUBLE"),
    ("mass_kg", "DOUBLE"),
];

/// What is known of a member, in the order of the columns.
fn attributes(base: &Base, record: &Record) -> Vec<Attribute> {
    let it = &record.outcome;
    let number = |value: f64| Attribute::Real(numbers::rounded(value, DIGITS));
    let mapped = QUANTITIES.iter().zip(it.values).filter(|(quantity, _)| quantity.mapped);
    let own = [
        Attribute::Integer(record.number as i64),
        Attribute::Text(base.study.releases[base.release_of(record.number)].name.clone()),
        Attribute::Text(it.status.word().into()),
        Attribute::Text(it.how.word().into()),
        number(it.volume),
        number(it.mass),
    ];
    own.into_iter().chain(mapped.map(|(_, value)| number(value))).collect()
}

/// Write trajectories and ends.
pub fn write_features(base: &Base, system: &System, dir: &Path, all: All) -> io::Result<()> {
    let file = GeoPackage::create(&dir.join(FEATURES), system.epsg)?;
    let mapped = QUANTITIES.iter().filter(|quantity| quantity.mapped);
    let columns = OWN.map(|(name, kind)| (name.to_owned(), kind)).into_iter();
    let columns: Vec<_> = columns.chain(mapped.map(|quantity| (quantity.column(), "DOUBLE"))).collect();
    file.layer(&TRAJECTORIES, &columns)?;
    file.layer(&ENDS, &columns)?;
    let origin = base.ground.origin;
    all(&mut |record| {
        let place = |[x, y, z, _]: &[f32; 4]| {
            [f64::from(*x) + origin.x, f64::from(*y) + origin.y, f64::from(*z) + origin.z].map(rounded)
        };
        let path: Vec<[f64; 3]> = record.track.path.iter().map(place).collect();
        if path.len() > 1 {
            file.add(&TRAJECTORIES, &path, attributes(base, record))?;
        }
        if record.outcome.how != How::None {
            file.add(&ENDS, &[record.outcome.end.map(rounded)], attributes(base, record))?;
        }
        Ok(())
    })?;
    file.close()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five cells with 3, 0, 2, 7 and 1 values.
    #[test]
    fn cells_are_cut_into_parts_that_fit() {
        let starts = [0, 3, 3, 5, 12, 13];
        assert_eq!(parts(&starts, 100).first(), Some(&(0..5)));
        assert_eq!(parts(&starts, 5), [0..3, 3..4, 4..5]);
        assert_eq!(parts(&starts, 1), [0..1, 1..2, 2..3, 3..4, 4..5]);
        assert_eq!(parts(&[0], 5), []);
    }
}

//! The maps: per cell how many rocks passed or stopped there, and quantiles of how fast, how strong, how high. Each is a GeoTIFF,
//! one band of numbers, north up, in the terrain's coordinate system, and a picture; the two ends of an interval are GeoTIFFs beside it.
//! Trajectories and ends of members are layers of a GeoPackage, with what became of each. Beside each raster lies its style for QGIS.
//!
//! Source: OGC GeoTIFF 1.1, 7.1 and B; the mark of cells without a value is GDAL's.

use super::geopackage::{GeoPackage, Geometry, Layer};
use super::picture::{self, ColourScale, Map};
use super::style;
use crate::base::Base;
use crate::bounds::{Ends, Part, of_frequency, of_share, quantile};
use crate::grid::Grid;
use crate::path_quantity::{PathQuantity, rasters};
use crate::quantity::{MEMBER_QUANTITIES, MemberQuantity};
use crate::record::{All, How, Record};
use crate::summary::quantile_of;
use dem_rocks::results::map::sheet::Imprint;
use dem_terrain::system::{PROJECTED_TYPE, USER_DEFINED};
use interface_defs::diagnostic::{Diagnostic, code};
use interface_defs::message::Interval;
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

/// Shares of which there are maps [%]: those that a design asks for.
const SHARES: [u32; 4] = [50, 90, 95, 99];

/// Where few rocks pass, a high quantile is between the two largest of them.
fn note(share: u32) -> Option<String> {
    let few = 100 / (100 - share) + 1;
    (share >= 90).then(|| format!("where up to {few} rocks pass (see count): between the two largest"))
}

/// What ends the names of a value's raster and of those of its interval.
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
    let found = Counts::of(base, grid, all)?;
    let sheet = picture::Sheet::new(base, grid, found.computed, imprint, |cell| found.count[cell] > 0);
    // A picture of the value, and a raster with its style of it and of each end of its interval, where it has one.
    let put = |name: &str, map: &Map, ends: &[Vec<f32>]| {
        let rasters = std::iter::once(map.values).chain(ends.iter().map(|values| &values[..]));
        for (values, end) in rasters.zip(ENDINGS) {
            write_band(&dir.join(format!("{name}{end}.tif")), base, grid, system, values)?;
            // The ends of the interval of a value have its colours.
            if map.values.iter().any(|value| !value.is_nan()) {
                let style = style::of_raster(map.scale, map.values);
                files::write(&dir.join(format!("{name}{end}.qml")), style.as_bytes())?;
            }
        }
        sheet.write(&dir.join(format!("{name}.svg")), map)
    };
    let passing = found.known(&|cell| found.count[cell] as f32);
    put("count", &Map::new("number of rocks passing", ColourScale::Log, &passing), &[])?;
    let computed = found.computed.max(1);
    let shares = found.known(&|cell| (f64::from(found.count[cell]) / computed as f64) as f32);
    let ends = found.ends(&|cell| of_share(found.count[cell].into(), computed));
    put("share", &Map::new("share of rocks passing", ColourScale::Log, &shares), &ends)?;
    // Of a release without a member nothing is known.
    if !found.rated.is_empty() && found.rated.iter().all(|(_, members, _)| *members > 0) {
        let often = found.known(&|cell| found.frequency(cell).0 as f32);
        let ends = found.ends(&|cell| found.frequency(cell).1);
        put("frequency", &Map::new("rocks passing in a year [1/year]", ColourScale::Log, &often), &ends)?;
    }
    let stopped: Vec<f32> = found.stopped.iter().map(|n| if *n > 0 { *n as f32 } else { f32::NAN }).collect();
    put("deposition", &Map::new("number of rocks at rest", ColourScale::Linear, &stopped), &[])?;
    // Where intervals end depends on the number of rocks alone.
    let mut known_ends = FxHashMap::default();
    for (number, (PathQuantity { unit, .. }, [name, title])) in rasters().enumerate() {
        let maps = found.quantiles(number, &mut known_ends, all)?;
        for ([values, ends @ ..], share) in maps.iter().zip(SHARES) {
            let title = format!("{share} % quantile of the {title} [{unit}]");
            let map = Map { title, note: note(share), scale: ColourScale::Linear, values };
            put(&quantile_of(name, share), &map, ends)?;
        }
    }
    Ok(())
}

/// What is counted in each cell.
struct Counts {
    /// Members that were computed.
    computed: u64,
    /// Those that pass.
    count: Vec<u32>,
    /// Those that come to rest.
    stopped: Vec<u32>,
    /// Of each release its blocks a year, its members, and how many of them pass; empty where blocks a year are not known.
    rated: Vec<(f64, u64, Vec<u32>)>,
}

impl Counts {
    fn of(base: &Base, grid: &Grid, all: All) -> io::Result<Self> {
        let none = || vec![0_u32; grid.cells()];
        let rates = base.study.rates().into_iter().flatten();
        let rated = rates.map(|rate| (rate, 0, none())).collect();
        let mut it = Self { computed: 0, count: none(), stopped: none(), rated };
        all(&mut |record| {
            if record.outcome.status == RunStatus::Failed {
                return Ok(());
            }
            it.computed += 1;
            record.track.visits.iter().for_each(|visit| it.count[visit.cell as usize] += 1);
            if let Some((_, members, count)) = it.rated.get_mut(base.release_of(record.number)) {
                *members += 1;
                record.track.visits.iter().for_each(|visit| count[visit.cell as usize] += 1);
            }
            let [x, y, _] = record.outcome.end;
            let place = base.local(&[x, y]);
            if let Some(cell) = grid.at(place).filter(|_| record.outcome.how == How::Rest) {
                it.stopped[cell as usize] += 1;
            }
            Ok(())
        })?;
        Ok(it)
    }

    /// Values of the cells that rocks pass; of the others NaN.
    fn known(&self, of: &dyn Fn(usize) -> f32) -> Vec<f32> {
        let cells = self.count.iter().enumerate();
        cells.map(|(cell, count)| if *count > 0 { of(cell) } else { f32::NAN }).collect()
    }

    /// Both ends of the interval of such values.
    fn ends(&self, of: &dyn Fn(usize) -> Interval) -> [Vec<f32>; 2] {
        let end = |end: Option<f64>| end.map_or(f32::NAN, |end| end as f32);
        [self.known(&|cell| end(of(cell).low)), self.known(&|cell| end(of(cell).high))]
    }

    /// Rocks a year that pass a cell.
    fn frequency(&self, cell: usize) -> (f64, Interval) {
        let all = self.rated.iter();
        of_frequency(all.map(|(rate, all, count)| Part { rate: *rate, count: count[cell].into(), all: *all }))
    }

    /// For each of the [`SHARES`] the quantile of quantity `number` of the visits, and both ends of its interval.
    fn quantiles(
        &self,
        number: usize,
        known_ends: &mut FxHashMap<usize, [Ends; SHARES.len()]>,
        all: All,
    ) -> io::Result<Vec<[Vec<f32>; 3]>> {
        // Where the values of each cell begin in one long row.
        let mut starts = vec![0_usize];
        self.count.iter().for_each(|n| starts.push(starts[starts.len() - 1] + *n as usize));
        let mut maps = vec![[(); 3].map(|()| vec![f32::NAN; self.count.len()]); SHARES.len()];
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
            for cell in part.filter(|cell| self.count[*cell] > 0) {
                sorted.clear();
                let own = starts[cell] - before..starts[cell + 1] - before;
                sorted.extend(values[own].iter().map(|v| f64::from(*v)));
                sorted.sort_by(f64::total_cmp);
                let ends = known_ends.entry(sorted.len()).or_insert_with_key(|count| {
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
        Ok(maps)
    }
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

/// Attributes of a member that are no numbers of its fall.
const OWN: [(&str, &str); 4] =
    [("member", "INTEGER"), ("release", "TEXT"), ("status", "TEXT"), ("ending", "TEXT")];

/// The quantities that are attributes.
fn mapped() -> impl Iterator<Item = &'static MemberQuantity> {
    MEMBER_QUANTITIES.iter().filter(|quantity| quantity.mapped)
}

/// What is known of a member, in the order of the columns.
fn attributes(base: &Base, record: &Record) -> Vec<Attribute> {
    let it = &record.outcome;
    let own = [
        Attribute::Integer(record.number as i64),
        Attribute::Text(base.study.releases[base.release_of(record.number)].name.clone()),
        Attribute::Text(it.status.word().into()),
        Attribute::Text(it.how.word().into()),
    ];
    let numbers = mapped().map(|quantity| Attribute::Real(numbers::rounded((quantity.of)(it), DIGITS)));
    own.into_iter().chain(numbers).collect()
}

/// Write trajectories and ends.
pub fn write_features(base: &Base, system: &System, dir: &Path, all: All) -> io::Result<()> {
    let file = GeoPackage::create(&dir.join(FEATURES), system.epsg)?;
    let own = OWN.map(|(name, kind)| (name.to_owned(), kind)).into_iter();
    let columns: Vec<_> = own.chain(mapped().map(|quantity| (quantity.column(), "DOUBLE"))).collect();
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

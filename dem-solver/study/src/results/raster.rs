//! GeoTIFF: one band of numbers, north up, in the terrain's coordinate system.
//!
//! Source: OGC GeoTIFF 1.1, 7.1 and B; the mark of cells without a value is GDAL's.

use crate::base::Base;
use crate::grid::Grid;
use dem_terrain::system::{self, PROJECTED_TYPE, USER_DEFINED};
use interface_defs::diagnostic::{Diagnostic, code};
use std::io::{self, Cursor};
use std::path::Path;
use tiff::TiffResult;
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, TiffEncoder, colortype::Gray32Float};
use tiff::tags::Tag;
use toolkit::files;

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
        Self { epsg: named.or_else(|| Self::of_terrain(base)) }
    }

    /// The code that the terrain's file names, or the `.prj` beside it.
    pub fn of_terrain(base: &Base) -> Option<u16> {
        system::of_file(&base.scene.resolve(&base.settings.terrain.as_ref()?.file))
    }

    /// What the user should know of it.
    pub fn warning(&self) -> Option<Diagnostic> {
        self.epsg.is_none().then(|| {
            let what = "maps have no coordinate system: the terrain's file names none";
            Diagnostic::warning(code::PLACE, what)
                .try_instead("write its code in the study, as in maps.epsg = 2056")
        })
    }

    /// For GeoJSON.
    pub fn urn(&self) -> Option<String> {
        self.epsg.map(|code| format!("urn:ogc:def:crs:EPSG::{code}"))
    }
}

/// Write one band; NaN: no value.
pub fn write(path: &Path, base: &Base, grid: &Grid, system: &System, values: &[f32]) -> io::Result<()> {
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

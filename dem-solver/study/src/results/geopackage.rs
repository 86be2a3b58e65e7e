//! Features as a GeoPackage, with their styles in it: one file, which GIS programs open as it is.
//!
//! Source: OGC 12-128r18 (GeoPackage 1.3), 1.1 and 2.1; ISO 19125 with z for geometries; the table of styles is that of QGIS.

use rusqlite::{Connection, OpenFlags, params, params_from_iter, types::Value};
use std::io;
use std::path::Path;
use toolkit::files;

/// What a layer holds, by its code and name of ISO 19125 with z.
#[derive(Clone, Copy)]
pub enum Geometry {
    Point = 1001,
    LineString = 1002,
}

/// A layer, and how QGIS shows it.
pub struct Layer {
    /// Its name, which is that of its table.
    pub name: &'static str,
    /// What each feature is.
    pub geometry: Geometry,
    /// The text of the `.qml` file.
    pub style: &'static str,
}

/// A file that is written; there is nothing to be relied on in it before [`GeoPackage::close`].
pub struct GeoPackage {
    file: Connection,
    /// Its coordinate system; -1: it is not known.
    system: i32,
}

impl GeoPackage {
    /// A new file at `path`, in the coordinate system of an EPSG code. An old one is replaced.
    pub fn create(path: &Path, epsg: Option<u16>) -> io::Result<Self> {
        files::remove(path)?;
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE;
        let file = Connection::open_with_flags(path, flags).map_err(io::Error::other)?;
        let system = epsg.map_or(-1, i32::from);
        file.execute_batch(include_str!("geopackage.sql"))
            .and_then(|()| {
                file.execute(
                    "INSERT OR IGNORE INTO gpkg_spatial_ref_sys VALUES ('EPSG:' || ?1, ?1, 'EPSG', ?1, 'undefined', NULL)",
                    [system],
                )
            })
            .map_err(io::Error::other)?;
        Ok(Self { file, system })
    }

    /// Add a layer whose features have these attributes: name and type of SQLite.
    pub fn layer(&self, layer: &Layer, attributes: &[(String, &str)]) -> io::Result<()> {
        let Layer { name, geometry, style } = layer;
        let columns: String = attributes.iter().map(|(name, kind)| format!(", \"{name}\" {kind}")).collect();
        let kind = match geometry {
            Geometry::Point => "POINT",
            Geometry::LineString => "LINESTRING",
        };
        let add = || {
            self.file.execute_batch(&format!(
                "CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {kind}{columns})"
            ))?;
            self.file.execute(
                "INSERT INTO gpkg_contents (table_name, data_type, identifier, srs_id) VALUES (?1, 'features', ?1, ?2)",
                params![name, self.system],
            )?;
            self.file.execute(
                "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, 1, 0)",
                params![name, kind, self.system],
            )?;
            self.file.execute(
                "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName, styleQML, \
                 useAsDefault, description, owner) VALUES ('', '', ?1, 'geom', ?1, ?2, 1, '', '')",
                params![name, style],
            )
        };
        add().map(|_| ()).map_err(io::Error::other)
    }

    /// Add a feature to a layer: its places, of a point one, and its attributes in their order.
    pub fn add(&self, layer: &Layer, places: &[[f64; 3]], attributes: Vec<Value>) -> io::Result<()> {
        let values = std::iter::once(Value::Blob(self.blob(layer.geometry, places))).chain(attributes);
        let values: Vec<Value> = values.collect();
        let places = ", ?".repeat(values.len());
        self.file
            .prepare_cached(&format!("INSERT INTO {} VALUES (NULL{places})", layer.name))
            .and_then(|mut row| row.execute(params_from_iter(values)))
            .map(|_| ())
            .map_err(io::Error::other)
    }

    /// A geometry as GeoPackage has it: a head without an envelope, then well-known binary.
    fn blob(&self, geometry: Geometry, places: &[[f64; 3]]) -> Vec<u8> {
        let mut blob = b"GP\x00\x01".to_vec();
        blob.extend(self.system.to_le_bytes());
        blob.push(1);
        blob.extend((geometry as u32).to_le_bytes());
        if let Geometry::LineString = geometry {
            blob.extend((places.len() as u32).to_le_bytes());
        }
        blob.extend(places.iter().flatten().flat_map(|value| value.to_le_bytes()));
        blob
    }

    /// Finish the file.
    pub fn close(self) -> io::Result<()> {
        self.file.execute_batch("COMMIT").map_err(io::Error::other)?;
        self.file.close().map_err(|(_, e)| io::Error::other(e))
    }
}

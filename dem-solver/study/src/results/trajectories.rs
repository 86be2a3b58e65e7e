//! Trajectories and ends of members as GeoJSON, with what became of each.

use super::All;
use super::raster::System;
use crate::base::Base;
use crate::quantity::QUANTITIES;
use crate::record::{How, Record};
use serde_json::{Map, Value, json};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use toolkit::files::{self, Stream};

/// The trajectories of some members.
pub const TRAJECTORIES: &str = "trajectories.geojson";
/// Where each came to rest or left the terrain.
pub const ENDS: &str = "ends.geojson";

/// A file of features that is written one by one.
struct Features {
    file: BufWriter<Stream>,
    any: bool,
}

impl Features {
    fn create(path: &Path, name: &str, system: &System) -> io::Result<Self> {
        let mut file = BufWriter::new(files::create(path)?);
        write!(file, "{{\"type\": \"FeatureCollection\", \"name\": \"{name}\"")?;
        if let Some(urn) = system.urn() {
            let crs = json!({ "type": "name", "properties": { "name": urn } });
            write!(file, ", \"crs\": {crs}")?;
        }
        write!(file, ", \"features\": [")?;
        Ok(Self { file, any: false })
    }

    fn add(&mut self, geometry: &Value, properties: Map<String, Value>) -> io::Result<()> {
        let feature = json!({ "type": "Feature", "geometry": geometry, "properties": properties });
        write!(self.file, "{}\n{feature}", if self.any { "," } else { "" })?;
        self.any = true;
        Ok(())
    }

    fn end(mut self) -> io::Result<()> {
        write!(self.file, "\n]}}\n")?;
        self.file.flush()
    }
}

/// Millimetres are enough on a map.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

fn properties(base: &Base, record: &Record) -> Map<String, Value> {
    let it = &record.outcome;
    let mut all = Map::new();
    let mut put = |name: &str, value: Value| {
        all.insert(name.into(), value);
    };
    put("member", json!(record.number));
    put("release", json!(base.study.releases[base.member(record.number).release].name));
    put("status", json!(it.status.word()));
    put("ending", json!(it.how.word()));
    put("volume_m3", json!(it.volume));
    put("mass_kg", json!(it.mass));
    for (quantity, value) in QUANTITIES.iter().zip(it.values).filter(|(quantity, _)| quantity.mapped) {
        put(&quantity.column(), json!(value));
    }
    all
}

/// Write both files.
pub fn write(base: &Base, system: &System, dir: &Path, all: All) -> io::Result<()> {
    let mut lines = Features::create(&dir.join(TRAJECTORIES), "trajectories", system)?;
    let mut ends = Features::create(&dir.join(ENDS), "ends", system)?;
    let origin = base.ground.origin;
    all(&mut |record| {
        let path = &record.track.path;
        if path.len() > 1 {
            let places: Vec<[f64; 3]> = path
                .iter()
                .map(|[x, y, z, _]| {
                    [f64::from(*x) + origin.x, f64::from(*y) + origin.y, f64::from(*z) + origin.z]
                        .map(rounded)
                })
                .collect();
            lines.add(&json!({ "type": "LineString", "coordinates": places }), properties(base, record))?;
        }
        if record.outcome.how != How::None {
            let place = record.outcome.end.map(rounded);
            ends.add(&json!({ "type": "Point", "coordinates": place }), properties(base, record))?;
        }
        Ok(())
    })?;
    lines.end()?;
    ends.end()
}

//! LAS and LAZ points, read by the crate `las`. What their headers promise is compared with the file's size
//! first: the crate makes room for as much as is promised.
//!
//! Source of the layout: ASPRS LAS 1.4-R15, tables 3 to 6.

use super::format::{Format, Holds, Reader};
use super::laz::{self, whole};
use crate::system;
use dem_solid::input::ReadError;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// This format.
pub const FORMAT: Format = Format {
    name: "LAS or LAZ",
    extensions: &["las", "laz"],
    also: &[],
    holds: Holds::ClassifiedPoints,
    begins: |head| head.begins(&[b"LASF"]),
    read: Reader::Points(read),
};

/// Bytes of points that are read at once.
const BATCH: u64 = 1 << 22;
/// Fixed part of the smallest header, and of a variable length record [bytes].
const HEADER: usize = 227;
const RECORD: usize = 54;
/// Most points in a file, and most that are taken of them: each becomes a node and two triangles, 230 bytes together.
const MOST: u64 = 2_000_000_000;
const MOST_TAKEN: usize = 100_000_000;

/// Read points of these classes, all if there is none.
fn read(bytes: Vec<u8>, classes: &[u8]) -> Result<Vec<[f64; 3]>, ReadError> {
    check(&bytes)?;
    // The crate is not proof against every lie in a compressed file.
    let (points, seen) = catch_unwind(AssertUnwindSafe(|| points(bytes, classes)))
        .map_err(|_| "cannot be read as LAS: its compressed points are damaged")??;
    if points.len() > MOST_TAKEN {
        return Err(ReadError::new(format!("more than {MOST_TAKEN} points of the terrain"))
            .try_instead("thin them out, or cut the area out that is needed"));
    }
    if points.is_empty() {
        let text: Vec<String> = classes.iter().map(u8::to_string).collect();
        let what = format!("none of its {seen} points is of class {}", text.join(", "));
        return Err(ReadError::new(what).try_instead("write classes = [] under [terrain] to take all points"));
    }
    Ok(points)
}

fn points(bytes: Vec<u8>, classes: &[u8]) -> Result<(Vec<[f64; 3]>, u64), ReadError> {
    let broken = |e: las::Error| format!("cannot be read as LAS: {e}");
    let mut reader = las::Reader::new(Cursor::new(bytes)).map_err(broken)?;
    check_coordinates(reader.header())?;
    let count = reader.header().number_of_points();
    let mut points = Vec::new();
    let at_once = (BATCH / u64::from(reader.header().point_format().len()).max(1)).clamp(1, 65_536);
    let mut batch = reader.read_points(at_once.min(count)).map_err(broken)?;
    let mut seen = batch.len() as u64;
    loop {
        let places = batch.x().zip(batch.y()).zip(batch.z());
        for (((x, y), z), class) in places.zip(batch.classification()) {
            let wanted = classes.is_empty() || classes.contains(&class);
            if wanted && (x + y + z).is_finite() {
                points.push([x, y, z]);
            }
        }
        if points.len() > MOST_TAKEN || seen >= count {
            return Ok((points, seen));
        }
        let got = reader.fill_points(at_once, &mut batch).map_err(broken)?;
        if got == 0 {
            return Ok((points, seen));
        }
        seen += got;
    }
}

/// Refuse headers that promise more than the file can hold.
fn check(bytes: &[u8]) -> Result<(), ReadError> {
    if !bytes.starts_with(b"LASF") {
        return Err("the file does not begin with `LASF`; is this LAS or LAZ?".into());
    }
    if bytes.len() < HEADER {
        return Err(format!("{} bytes are too few for the header of a LAS file", bytes.len()).into());
    }
    let number = |at: usize, size: usize| whole(bytes, at, size);
    let length = bytes.len() as u64;
    let (header, offset, records) = (number(94, 2), number(96, 4), number(100, 4));
    let long = (bytes[24], bytes[25]) >= (1, 4) && header >= 375;
    if header < HEADER as u64
        || header > offset
        || offset > length
        || records * RECORD as u64 > offset - header
    {
        let what = format!(
            "its header ({header} bytes, {records} records) and points from byte {offset} on do not fit {length} bytes"
        );
        return Err(what.into());
    }
    let (compressed, each) = (bytes[104] & 0xc0 != 0, number(105, 2));
    let count = if long { number(247, 8) } else { 0 }.max(number(107, 4));
    if count > MOST || (!compressed && count.checked_mul(each).is_none_or(|size| size > length - offset)) {
        let what =
            format!("its header promises {count} points of {each} bytes, and the file has {length} bytes");
        return Err(what.into());
    }
    if long {
        extended_records(bytes, number(235, 8), number(243, 4))?;
    }
    if compressed {
        laz::check(bytes, header as usize, records, offset as usize, count, each)?;
    }
    Ok(())
}

/// Records that state the coordinates: geo keys with their text, and well-known text.
const GEO_KEYS: u16 = 34_735;
const GEO_TEXT: u16 = 34_737;
const WELL_KNOWN_TEXT: u16 = 2112;

/// Judge what the variable length records say of the coordinates.
fn check_coordinates(header: &las::Header) -> Result<(), ReadError> {
    let (mut keys, mut text) = (Vec::new(), String::new());
    for record in header.vlrs().iter().filter(|record| record.user_id == "LASF_Projection") {
        let words = String::from_utf8_lossy(&record.data);
        match record.record_id {
            GEO_KEYS => {
                keys = record.data.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
            }
            GEO_TEXT => text = words.into_owned(),
            WELL_KNOWN_TEXT => system::well_known_text(words.trim_end_matches('\0'))?,
            _ => {}
        }
    }
    system::geo_keys(&keys, &text)
}

/// Walk over the records behind the points: each states the length of its data.
fn extended_records(bytes: &[u8], start: u64, count: u64) -> Result<(), String> {
    let mut at = start;
    for record in 1..=count {
        let end = usize::try_from(at).ok().and_then(|at| {
            bytes.get(at..at.checked_add(60)?)?;
            (at as u64 + 60).checked_add(whole(bytes, at + 20, 8))
        });
        match end {
            Some(end) if end <= bytes.len() as u64 => at = end,
            _ => {
                return Err(format!(
                    "its extended record {record} at byte {at} does not fit {} bytes",
                    bytes.len()
                ));
            }
        }
    }
    Ok(())
}

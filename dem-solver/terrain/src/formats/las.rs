//! LAS and LAZ points, read by the crate `las`. What their headers promise is compared with the file's size
//! first: the crate makes room for as much as is promised.
//!
//! Compressed points of LAS 1.4 (formats 6 to 10) come in layers, each of which states its length.
//!
//! Source of the layout: ASPRS LAS 1.4-R15, tables 3 to 6; of compressed points Isenburg (2013), "LASzip: lossless compression of LiDAR
//! data", Photogramm. Eng. Remote Sens. 79, 209, and the records as LASzip 3 writes them.

use super::format::{Format, Reader};
use crate::system;
use dem_solid::input::ReadError;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// This format.
pub const FORMAT: Format = Format {
    name: "LAS or LAZ",
    extensions: &["las", "laz"],
    also: &[],
    begins: |head| head.begins(&[b"LASF"]),
    read: Reader::ClassifiedPoints(read),
};

/// Bytes of points that are read at once.
const BATCH: u64 = 1 << 22;
/// Fixed part of the smallest header, and of a variable length record [bytes].
const HEADER: usize = 227;
const RECORD: usize = 54;
/// Most points in a file, and most that are taken of them: each becomes a node and two triangles, 230 bytes together.
const MAX_POINTS: u64 = 2_000_000_000;
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
    if count > MAX_POINTS
        || (!compressed && count.checked_mul(each).is_none_or(|size| size > length - offset))
    {
        let what =
            format!("its header promises {count} points of {each} bytes, and the file has {length} bytes");
        return Err(what.into());
    }
    if long {
        extended_records(bytes, number(235, 8), number(243, 4))?;
    }
    if compressed {
        check_compressed(bytes, header as usize, records, offset as usize, count, each)?;
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

/// Who signs the record that describes the compression, and its number.
const USER: &[u8] = b"laszip encoded";
const NUMBER: u64 = 22_204;
/// Compressor that keeps each part of the points of a chunk in a layer of its own.
const LAYERED: u64 = 3;
/// Longest compressed point: each extra byte takes models of some 10 kB.
const LONGEST: u64 = 2048;

/// A whole number of some bytes, lowest first; 0 beyond the end.
fn whole(bytes: &[u8], at: usize, size: usize) -> u64 {
    at.checked_add(size)
        .and_then(|end| bytes.get(at..end))
        .map_or(0, |b| b.iter().rev().fold(0_u64, |v, byte| v << 8 | u64::from(*byte)))
}

/// Refuse a file whose `count` compressed points of `each` bytes, from byte `offset` on, claim more room than it has.
fn check_compressed(
    bytes: &[u8],
    header: usize,
    records: u64,
    offset: usize,
    count: u64,
    each: u64,
) -> Result<(), String> {
    if each > LONGEST {
        return Err(format!("compressed points of {each} bytes: up to {LONGEST} are read"));
    }
    let Some(about) = description(bytes, header, records, offset) else {
        return Err("it has no record that describes how its points are compressed".into());
    };
    let (compressor, chunk, items) = (whole(about, 0, 2), whole(about, 12, 4), whole(about, 32, 2));
    let item = |i: usize| (whole(about, 34 + 6 * i, 2), whole(about, 36 + 6 * i, 2));
    let items: Vec<(u64, u64)> = (0..items as usize).take(about.len() / 6).map(item).collect();
    let size: u64 = items.iter().map(|(_, size)| size).sum();
    if size != each {
        return Err(format!("compressed points of {size} bytes, and points of {each}"));
    }
    let table = whole(bytes, offset, 8);
    // A table at the file's end is marked by -1 there and by its place in the last eight bytes.
    let table = if table == u64::MAX { whole(bytes, bytes.len() - 8, 8) } else { table };
    let fits = usize::try_from(table).ok().filter(|t| *t < bytes.len());
    let chunks = fits.map_or(u64::MAX, |t| whole(bytes, t + 4, 4));
    // Each begins with a point as it is.
    if chunks.checked_mul(each).is_none_or(|size| size > bytes.len() as u64) {
        return Err(format!("its table of chunks at byte {table} does not fit {} bytes", bytes.len()));
    }
    if compressor != LAYERED {
        return Ok(());
    }
    // Layers of a point, a colour, colour and infrared, a wave, extra bytes; other parts have none.
    let layers: u64 = items
        .iter()
        .map(|(kind, size)| match kind {
            10 => 9,
            11 | 13 => 1,
            12 => 2,
            14 => *size,
            _ => 0,
        })
        .sum();
    walk(bytes, offset + 8, count, each, layers as usize, chunk)
}

/// Over all chunks: a point, how many there are, the lengths of the layers, the layers.
fn walk(bytes: &[u8], start: usize, count: u64, each: u64, layers: usize, chunk: u64) -> Result<(), String> {
    let (mut at, mut points, mut number) = (start, 0, 0);
    while points < count {
        number += 1;
        let sizes = at + each as usize + 4;
        let here = sizes + 4 * layers;
        let promised: u64 = (0..layers).map(|k| whole(bytes, sizes + 4 * k, 4)).sum();
        if here > bytes.len() || promised > (bytes.len() - here) as u64 {
            return Err(format!(
                "its chunk {number} at byte {at} promises {promised} bytes in {layers} layers, and the file has {} bytes",
                bytes.len()
            ));
        }
        // A chunk of any length says its own.
        let own = if chunk == u64::from(u32::MAX) { whole(bytes, sizes - 4, 4) } else { chunk };
        points += own.max(1);
        at = here + promised as usize;
    }
    Ok(())
}

/// The data of the record that describes the compression.
fn description(bytes: &[u8], header: usize, records: u64, offset: usize) -> Option<&[u8]> {
    let mut at = header;
    for _ in 0..records {
        let end = at.checked_add(RECORD)?.checked_add(whole(bytes, at + 20, 2) as usize)?;
        let record = bytes.get(at..end.min(offset))?;
        if record.get(2..2 + USER.len())? == USER && whole(record, 18, 2) == NUMBER {
            return record.get(RECORD..);
        }
        at = end;
    }
    None
}

//! LAS and LAZ points, read by the crate `las`. What their headers promise is compared with the file's size
//! first: the crate makes room for as much as is promised.
//!
//! Source of the layout: ASPRS LAS 1.4-R15, tables 3 to 6.

use super::format::{Content, Format, Holds};
use super::{crs, laz};
use interface_defs::diagnostic::Diagnostic;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// This format.
pub const FORMAT: Format = Format {
    name: "LAS or LAZ",
    extensions: &["las", "laz"],
    also: &[],
    holds: Holds::ClassifiedPoints,
    begins: |head| head.begins(&[b"LASF"]),
    read: |source| read(source.bytes, source.classes, source.file).map(Content::Points),
};

/// Bytes of points that are read at once.
const BATCH: u64 = 1 << 22;
/// Fixed part of the smallest header, and of a variable length record [bytes].
const HEADER: usize = 227;
const RECORD: usize = 54;
/// Most points in a file, and most that are taken of them: each becomes a node and two triangles, 230 bytes together.
const MOST: u64 = 2_000_000_000;
const MOST_TAKEN: usize = 100_000_000;

/// Read the bytes of `file`: points of these classes, all if there is none.
fn read(bytes: Vec<u8>, classes: &[u8], file: &str) -> Result<Vec<[f64; 3]>, Diagnostic> {
    check(&bytes, file)?;
    crs::refused(file, coordinates(&bytes))?;
    // The crate is not proof against every lie in a compressed file.
    let read = catch_unwind(AssertUnwindSafe(|| points(bytes, classes)));
    let (points, seen) = match read {
        Ok(Ok(read)) => read,
        Ok(Err(e)) => return Err(Diagnostic::in_file(file, format!("cannot be read as LAS: {e}"))),
        Err(_) => {
            return Err(Diagnostic::in_file(
                file,
                "cannot be read as LAS: its compressed points are damaged",
            ));
        }
    };
    if points.len() > MOST_TAKEN {
        return Err(Diagnostic::in_file(file, format!("more than {MOST_TAKEN} points of the terrain"))
            .try_instead("thin them out, or cut the area out that is needed"));
    }
    if points.is_empty() {
        let text: Vec<String> = classes.iter().map(u8::to_string).collect();
        let what = format!("none of its {seen} points is of class {}", text.join(", "));
        return Err(Diagnostic::in_file(file, what)
            .try_instead("write classes = [] under [terrain] to take all points"));
    }
    Ok(points)
}

fn points(bytes: Vec<u8>, classes: &[u8]) -> Result<(Vec<[f64; 3]>, u64), las::Error> {
    let mut reader = las::Reader::new(Cursor::new(bytes))?;
    let count = reader.header().number_of_points();
    let mut points = Vec::new();
    let at_once = (BATCH / u64::from(reader.header().point_format().len()).max(1)).clamp(1, 65_536);
    let mut batch = reader.read_points(at_once.min(count))?;
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
        let got = reader.fill_points(at_once, &mut batch)?;
        if got == 0 {
            return Ok((points, seen));
        }
        seen += got;
    }
}

/// Refuse headers that promise more than the file can hold.
fn check(bytes: &[u8], file: &str) -> Result<(), Diagnostic> {
    let fault = |what: String| Err(Diagnostic::in_file(file, what));
    if !bytes.starts_with(b"LASF") {
        return fault("the file does not begin with `LASF`; is this LAS or LAZ?".into());
    }
    if bytes.len() < HEADER {
        return fault(format!("{} bytes are too few for the header of a LAS file", bytes.len()));
    }
    let whole = |at: usize, size: usize| laz::whole(bytes, at, size);
    let length = bytes.len() as u64;
    let (header, offset, records) = (whole(94, 2), whole(96, 4), whole(100, 4));
    let newest = (bytes[24], bytes[25]) >= (1, 4);
    if header < HEADER as u64
        || header > offset
        || offset > length
        || records * RECORD as u64 > offset - header
    {
        return fault(format!(
            "its header ({header} bytes, {records} records) and points from byte {offset} on do not fit {length} bytes"
        ));
    }
    let (format, each) = (bytes[104], whole(105, 2));
    let compressed = format & 0xc0 != 0;
    let count = if newest && header >= 375 { whole(247, 8).max(whole(107, 4)) } else { whole(107, 4) };
    if count > MOST || (!compressed && count.checked_mul(each).is_none_or(|size| size > length - offset)) {
        return fault(format!(
            "its header promises {count} points of {each} bytes, and the file has {length} bytes"
        ));
    }
    if newest && header >= 375 {
        extended_records(bytes, whole(235, 8), whole(243, 4)).or_else(fault)?;
    }
    if compressed {
        let start = offset as usize;
        laz::check(bytes, header as usize, records, start, count, each).or_else(fault)?;
    }
    Ok(())
}

/// Records that state the coordinates: geo keys with their text, and well-known text.
const GEO_KEYS: u64 = 34_735;
const GEO_TEXT: u64 = 34_737;
const WELL_KNOWN_TEXT: u64 = 2112;

/// Judge what the variable length records say of the coordinates; their sizes have been checked in sum alone.
fn coordinates(bytes: &[u8]) -> Result<(), (String, String)> {
    let whole = |at: usize, size: usize| laz::whole(bytes, at, size);
    let (mut at, mut keys, mut text) = (whole(94, 2) as usize, Vec::new(), String::new());
    for _ in 0..whole(100, 4) {
        if at + RECORD > bytes.len() {
            break;
        }
        let (number, length) = (whole(at + 18, 2), whole(at + 20, 2) as usize);
        let owner = &bytes[at + 2..at + 18];
        at += RECORD;
        let Some(data) = bytes.get(at..at + length) else { break };
        at += length;
        if !owner.starts_with(b"LASF_Projection") {
            continue;
        }
        match number {
            GEO_KEYS => keys = data.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect(),
            GEO_TEXT => text = String::from_utf8_lossy(data).into_owned(),
            WELL_KNOWN_TEXT => {
                crs::well_known_text(String::from_utf8_lossy(data).trim_end_matches('\0'))?;
            }
            _ => {}
        }
    }
    crs::geo_keys(&keys, &text)
}

/// Walk over the records behind the points: each states the length of its data.
fn extended_records(bytes: &[u8], start: u64, count: u64) -> Result<(), String> {
    let mut at = start;
    for record in 1..=count {
        let end = usize::try_from(at).ok().and_then(|at| {
            let length = bytes.get(at.checked_add(20)?..at.checked_add(28)?)?;
            let length = length.iter().rev().fold(0_u64, |v, byte| v << 8 | u64::from(*byte));
            (at as u64).checked_add(60)?.checked_add(length)
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

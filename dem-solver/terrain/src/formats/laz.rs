//! What a LAZ file says of its compressed points, compared with its size before the crate `laz` makes room for it: points
//! of LAS 1.4 (formats 6 to 10) come in layers, each of which states its length.
//!
//! Source of the layout: Isenburg (2013), "LASzip: lossless compression of LiDAR data", Photogramm. Eng. Remote Sens.
//! 79, 209, and the records as LASzip 3 writes them.

/// Who signs the record that describes the compression, and its number.
const USER: &[u8] = b"laszip encoded";
const NUMBER: u64 = 22_204;
/// Bytes of a record's head.
const HEAD: usize = 54;
/// Compressor that keeps each part of the points of a chunk in a layer of its own.
const LAYERED: u64 = 3;
/// Longest compressed point: each extra byte takes models of some 10 kB.
const LONGEST: u64 = 2048;

/// A whole number of some bytes, lowest first; 0 beyond the end.
pub(super) fn whole(bytes: &[u8], at: usize, size: usize) -> u64 {
    at.checked_add(size)
        .and_then(|end| bytes.get(at..end))
        .map_or(0, |b| b.iter().rev().fold(0_u64, |v, byte| v << 8 | u64::from(*byte)))
}

/// Refuse a file whose `count` compressed points of `each` bytes, from byte `offset` on, claim more room than it has.
pub(super) fn check(
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
        let end = at.checked_add(HEAD)?.checked_add(whole(bytes, at + 20, 2) as usize)?;
        let record = bytes.get(at..end.min(offset))?;
        if record.get(2..2 + USER.len())? == USER && whole(record, 18, 2) == NUMBER {
            return record.get(HEAD..);
        }
        at = end;
    }
    None
}

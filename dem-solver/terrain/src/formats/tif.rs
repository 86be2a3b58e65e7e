//! GeoTIFF, decoded by the crate `tiff`: one band of numbers, its place from pixel scale and tie point or from
//! a transformation without turn. A height stands in the middle of its pixel unless the file says that pixels
//! are points.
//!
//! Source: OGC GeoTIFF 1.1, 7.1 and B.6; the mark of pixels without height is GDAL's.

use super::format::{Format, MOST_CELLS, Reader};
use crate::raster::Raster;
use crate::system;
use dem_solid::input::ReadError;
use std::fmt::Display;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{TiffError, TiffResult};

/// This format.
pub const FORMAT: Format = Format {
    name: "a GeoTIFF",
    extensions: &["tif"],
    also: &["tiff"],
    begins: |head| head.begins(&[b"II*\0", b"MM\0*", b"II+\0"]),
    read: Reader::Raster(read),
};

/// Deflate and LZW do not shrink further than this: a promise beyond it is a lie.
const LARGEST_SHRINK: usize = 1100;
/// Value of the tag for the kind of compression where there is none.
const NOT_PACKED: u16 = 1;
/// Tag in which GDAL writes scale, offset and unit of heights, and the bit of an image that is a mask.
const GDAL_METADATA: u16 = 42_112;
const MASK: u32 = 4;
/// What to do about a compression or a kind of pixel that is not read.
const REPACK: &str = "write it anew: gdal_translate -ot Float32 -co COMPRESS=DEFLATE IN OUT";
/// Geo key of what a pixel is, and its value for a point.
const RASTER_TYPE: u16 = 1025;
const PIXEL_IS_POINT: u16 = 2;

fn read(bytes: &[u8]) -> Result<Raster, ReadError> {
    let (parts, counts, values) = match catch_unwind(AssertUnwindSafe(|| decode(bytes))) {
        Ok(read) => read.map_err(|e| {
            let unread = |e: &dyn Display| ReadError::new(format!("cannot be read as GeoTIFF: {e}"));
            match e {
                TiffError::UnsupportedError(what) => unread(&what).try_instead(REPACK),
                e => unread(&e),
            }
        })?,
        Err(_) => return Err("cannot be read as GeoTIFF: its image is damaged".into()),
    };
    let [columns, rows] = counts;
    if values.len() != columns * rows {
        let what =
            format!("{} values for {columns} x {rows} pixels; one band of heights is required", values.len());
        return Err(ReadError::new(what).try_instead(
            "several bands are mostly a picture; if one of them has the heights: gdal_translate -b 1 IN OUT",
        ));
    }
    system::geo_keys(&parts.keys, &parts.text)?;
    system::unit_of_heights(&parts.unit)?;
    if parts.mask {
        return Err(ReadError::new("it has a mask of pixels without height, which is not read")
            .try_instead("write them as a height: gdalwarp -dstnodata -9999 IN OUT"));
    }
    if let &[_, b, _, _, c, ..] = parts.matrix.as_slice()
        && (b != 0.0 || c != 0.0)
        && parts.scale.is_empty()
    {
        return Err(ReadError::new("its raster is turned against x and y, which cannot be read")
            .try_instead("turn it: gdalwarp IN OUT"));
    }
    let (place, spacing) = parts.place()?;
    let half = if parts.point { 0.0 } else { 0.5 };
    let [dx, dy] = spacing;
    let corner = [place[0] + half * dx, place[1] - half * dy - dy * (rows - 1) as f64];
    // The mark is text: a height of single precision equals it in single precision.
    let missing = |v: f64| !v.is_finite() || parts.nodata.is_some_and(|n| v == n || v as f32 == n as f32);
    let (times, plus) = parts.heights()?;
    let heights = values.into_iter().map(|v| if missing(v) { f64::NAN } else { v * times + plus }).collect();
    Ok(Raster { corner, spacing, counts, heights })
}

#[derive(Default)]
struct Parts {
    scale: Vec<f64>,
    tie: Vec<f64>,
    matrix: Vec<f64>,
    nodata: Option<f64>,
    point: bool,
    keys: Vec<u16>,
    text: String,
    /// By which pixels become heights, as GDAL writes it: times this, plus that; and their unit.
    times: Option<f64>,
    plus: Option<f64>,
    unit: String,
    mask: bool,
}

impl Parts {
    /// By what a pixel is multiplied, and what is added, to give its height.
    fn heights(&self) -> Result<(f64, f64), String> {
        let (times, plus) = (self.times.unwrap_or(1.0), self.plus.unwrap_or(0.0));
        // The third numbers of scale and tie point do the same; 0 and 1 say nothing.
        let third = self.scale.get(2).copied().filter(|s| *s != 0.0 && *s != 1.0);
        let upright = match self.matrix[..] {
            [_, _, _, _, _, _, _, _, a, b, c, d, ..] => {
                a == 0.0 && b == 0.0 && (c == 0.0 || c == 1.0) && d == 0.0
            }
            _ => true,
        };
        match third {
            _ if !(times.is_finite() && plus.is_finite() && times != 0.0) => {
                Err(format!("heights times {times} plus {plus} cannot be read"))
            }
            _ if !upright => Err("its transformation turns or scales heights, which cannot be read".into()),
            Some(third) if self.times.is_none() => {
                let [from, to] = [2, 5].map(|i| self.tie.get(i).copied().unwrap_or(0.0));
                Ok((third, to - from * third + plus))
            }
            _ => Ok((times, plus)),
        }
    }

    /// Take over what GDAL has written of the first band.
    fn read_metadata(&mut self, text: &str) {
        for item in text.split("<Item ").skip(1) {
            let (head, rest) = item.split_once('>').unwrap_or((item, ""));
            let value = rest.split('<').next().unwrap_or("").trim();
            let role = head.split("role=\"").nth(1).and_then(|r| r.split('"').next()).unwrap_or("");
            if !head.contains("sample=\"0\"") {
                continue;
            }
            match role {
                "scale" => self.times = value.parse().ok(),
                "offset" => self.plus = value.parse().ok(),
                "unittype" => self.unit = value.into(),
                _ => {}
            }
        }
    }

    /// x and y of the outer corner (or middle) of the first pixel, and the size of pixels.
    fn place(&self) -> Result<([f64; 2], [f64; 2]), String> {
        let (place, spacing) = match (self.scale.as_slice(), self.tie.as_slice(), self.matrix.as_slice()) {
            (&[sx, sy, ..], &[i, j, _, x, y, ..], _) => ([x - i * sx, y + j * sy], [sx, sy]),
            (_, _, &[a, _, _, x, _, d, _, y, ..]) => ([x, y], [a, -d]),
            _ => return Err("it does not say where it lies (no pixel scale and tie point)".into()),
        };
        let sound = place.iter().chain(&spacing).all(|v| v.is_finite()) && spacing.iter().all(|v| *v > 0.0);
        if sound {
            Ok((place, spacing))
        } else {
            Err(format!("pixels of {} m x {} m cannot be read", spacing[0], spacing[1]))
        }
    }
}

fn decode(bytes: &[u8]) -> TiffResult<(Parts, [usize; 2], Vec<f64>)> {
    let most = bytes.len().saturating_mul(LARGEST_SHRINK).min(8 * MOST_CELLS);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = most;
    limits.intermediate_buffer_size = most;
    // A value takes some 100 bytes in memory for each byte in the file.
    limits.ifd_value_size = bytes.len();
    let mut decoder = Decoder::new(Cursor::new(bytes))?.with_limits(limits);
    let (columns, rows) = decoder.dimensions()?;
    let pixels = columns as usize * rows as usize;
    let packed =
        decoder.find_tag(Tag::Compression)?.map_or(Ok(NOT_PACKED), |how| how.into_u16())? != NOT_PACKED;
    // What is not packed stands in the file, a byte per pixel at least.
    if pixels == 0 || pixels > MOST_CELLS || pixels > if packed { most } else { bytes.len() } {
        return Err(TiffError::LimitsExceeded);
    }
    let mut numbers = |tag: Tag| decoder.find_tag(tag)?.map_or(Ok(Vec::new()), |v| v.into_f64_vec());
    let mut parts = Parts {
        scale: numbers(Tag::ModelPixelScaleTag)?,
        tie: numbers(Tag::ModelTiepointTag)?,
        matrix: numbers(Tag::ModelTransformationTag)?,
        ..Parts::default()
    };
    if let Some(value) = decoder.find_tag(Tag::GdalNodata)? {
        parts.nodata = value.into_string()?.trim_matches(['\0', ' ']).parse().ok();
    }
    if let Some(value) = decoder.find_tag(Tag::GeoKeyDirectoryTag)? {
        let keys = value.into_u16_vec()?;
        parts.point =
            keys.chunks_exact(4).skip(1).any(|k| k[0] == RASTER_TYPE && k[1] == 0 && k[3] == PIXEL_IS_POINT);
        parts.keys = keys;
    }
    // What cannot be read as text says nothing of units.
    let mut text = |tag: Tag| {
        let value = decoder.find_tag(tag).ok().flatten();
        value.and_then(|v| v.into_string().ok()).unwrap_or_default()
    };
    parts.text = text(Tag::GeoAsciiParamsTag);
    let metadata = text(Tag::Unknown(GDAL_METADATA));
    parts.read_metadata(&metadata);
    let values = match decoder.read_image()? {
        DecodingResult::U8(v) => widen(v),
        DecodingResult::U16(v) => widen(v),
        DecodingResult::U32(v) => widen(v),
        DecodingResult::I8(v) => widen(v),
        DecodingResult::I16(v) => widen(v),
        DecodingResult::I32(v) => widen(v),
        DecodingResult::F32(v) => widen(v),
        DecodingResult::F64(v) => v,
        _ => return Err(TiffError::FormatError(tiff::TiffFormatError::InvalidDimensions(columns, rows))),
    };
    while decoder.more_images() {
        // Another image that cannot be read is not the heights.
        if decoder.next_image().is_err() {
            break;
        }
        let kind = decoder.find_tag(Tag::NewSubfileType).ok().flatten();
        parts.mask |= kind.and_then(|k| k.into_u32().ok()).is_some_and(|k| k & MASK != 0);
    }
    Ok((parts, [columns as usize, rows as usize], values))
}

fn widen<T: Into<f64>>(values: Vec<T>) -> Vec<f64> {
    values.into_iter().map(Into::into).collect()
}

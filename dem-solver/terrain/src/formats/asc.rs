//! ESRI ASCII grid, as [`crate::raster`] has it.

use super::format::{Format, MOST_CELLS, Reader};
use crate::raster::Raster;

/// This format.
pub const FORMAT: Format = Format {
    name: "an ESRI grid",
    extensions: &["asc"],
    also: &[],
    begins: |head| matches!(head.word(), "ncols" | "nrows"),
    read: Reader::Raster(|bytes| {
        Raster::read_asc(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), MOST_CELLS)
    }),
};

//! Field files as this project writes them, read again.

use crate::files;
use base64::Engine as _;
use flate2::read::ZlibDecoder;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Longest array of a file that is read [bytes].
const LONGEST: u64 = 4 << 30;

/// A file, whose arrays are decoded as they are asked for.
pub struct Loaded {
    /// The declarations, and the data behind them.
    xml: String,
    data: String,
}

impl Loaded {
    /// The file at `path`.
    pub fn open(path: &Path) -> io::Result<Self> {
        Self::of(&files::read_text(path)?)
            .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", path.display())))
    }

    /// Its text.
    ///
    /// # Errors
    /// If it is none of ours.
    pub fn of(text: &str) -> io::Result<Self> {
        let parts = text.split_once("<AppendedData encoding=\"base64\">\n_");
        let (xml, data) = parts.ok_or_else(|| broken("it has no data as this project writes them"))?;
        Ok(Self { xml: xml.into(), data: data.into() })
    }

    /// The numbers of the first array of that name; none if there is no such array.
    ///
    /// # Errors
    /// If it is not what its header says.
    pub fn floats(&self, name: &str) -> io::Result<Vec<f64>> {
        Ok(self.array(name)?.chunks_exact(8).map(|of| f64::from_le_bytes(eight(of))).collect())
    }

    /// The same of whole numbers, as cells have them.
    pub fn whole(&self, name: &str) -> io::Result<Vec<u32>> {
        let number = |of: &[u8]| u32::try_from(i64::from_le_bytes(eight(of)));
        let all: Result<Vec<u32>, _> = self.array(name)?.chunks_exact(8).map(number).collect();
        all.map_err(|_| broken("a number of a node or cell is none"))
    }

    /// The bytes of the first array of that name; none if there is no such array.
    pub(super) fn array(&self, name: &str) -> io::Result<Vec<u8>> {
        let Some((_, declared)) = self.xml.split_once(&format!(" Name=\"{name}\"")) else {
            return Ok(Vec::new());
        };
        let offset = declared.split_once(" offset=\"").and_then(|(_, rest)| rest.split_once('"'));
        let offset = offset.and_then(|(number, _)| number.parse().ok());
        let data = offset.and_then(|at: usize| self.data.get(at..));
        let data = data.ok_or_else(|| broken("an array lies beyond its end"))?;
        // Bytes of a text that is encoded by itself.
        let decoded = |from: usize, bytes: usize| {
            let text = data.get(from..).and_then(|rest| rest.get(..bytes.div_ceil(3) * 4));
            let text = text.ok_or_else(|| broken("it ends before its data do"))?;
            base64::engine::general_purpose::STANDARD.decode(text).map_err(io::Error::other)
        };
        let header = |count: usize| -> io::Result<Vec<usize>> {
            Ok(decoded(0, 8 * count)?
                .chunks_exact(8)
                .map(|of| u64::from_le_bytes(eight(of)) as usize)
                .collect())
        };
        // Number of blocks, two sizes, and the compressed size of each block.
        let blocks = header(3)?.first().copied().filter(|blocks| *blocks < data.len());
        let header = header(3 + blocks.ok_or_else(|| broken("it has more blocks than bytes"))?)?;
        let sizes = &header[3..];
        let all = sizes.iter().try_fold(0_usize, |sum, size| sum.checked_add(*size));
        let all =
            all.filter(|all| *all < data.len()).ok_or_else(|| broken("its blocks are longer than it is"))?;
        let packed = decoded((8 * header.len()).div_ceil(3) * 4, all)?;
        let (mut out, mut at) = (Vec::new(), 0);
        for size in sizes {
            ZlibDecoder::new(&packed[at..at + size]).take(LONGEST).read_to_end(&mut out)?;
            at += size;
        }
        Ok(out)
    }
}

fn eight(of: &[u8]) -> [u8; 8] {
    std::array::from_fn(|k| of[k])
}

fn broken(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// Times [s] and files of the series `name` in `dir`; none where it is not there.
pub fn series(dir: &Path, name: &str) -> io::Result<Vec<(f64, PathBuf)>> {
    let text = files::if_there(files::read_text(&dir.join(format!("{name}.pvd"))))?;
    let Some(text) = text else { return Ok(Vec::new()) };
    let entries = text.split("<DataSet ").skip(1).map(|entry| {
        let value = |key: &str| Some(entry.split_once(&format!("{key}=\""))?.1.split_once('"')?.0);
        // The file lies beside its list.
        let file = Path::new(value("file")?).file_name()?;
        Some((value("timestep")?.parse().ok()?, dir.join(file)))
    });
    entries
        .collect::<Option<_>>()
        .ok_or_else(|| broken("a list of field files has an entry without time or file"))
}

//! VTU files and a PVD series with physical time, which ParaView opens.
//!
//! Unstructured grid, data appended at the end: base64 of zlib-compressed blocks, header of UInt64.
//! Source: VTK file formats, <https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html>.

use base64::Engine as _;
use flate2::{Compression, write::ZlibEncoder};
use std::fmt::Write as _;
use std::io::Write as _;

mod read;
mod series;
pub use read::{Loaded, series};
pub use series::{KeptSeries, Series};

/// Bytes that are compressed as one block.
const BLOCK: usize = 1 << 20;

/// The cells of a grid.
pub enum Cells<'a> {
    /// Two points each.
    Lines(&'a [[u32; 2]]),
    /// Three points each.
    Triangles(&'a [[u32; 3]]),
    /// Triangles and quadrilaterals: their points one after the other, and where those of each end.
    Polygons {
        /// Points.
        nodes: &'a [u32],
        /// Ends.
        ends: &'a [u32],
    },
    /// One for each point.
    Vertices,
}

/// Numbers of the format for cells with this many points: vertex, line, triangle, quadrilateral.
const TYPES: [u8; 5] = [0, 1, 3, 5, 9];

/// A grid with data: name, components, values (`[components * items]`, item-major).
pub struct Vtu<'a> {
    /// `[3 * points]` [m].
    pub points: &'a [f64],
    /// Cells.
    pub cells: Cells<'a>,
    /// Data at the points.
    pub point_data: Vec<(&'a str, usize, &'a [f64])>,
    /// Data at the cells.
    pub cell_data: Vec<(&'a str, usize, &'a [f64])>,
}

impl Vtu<'_> {
    /// The file's content.
    ///
    /// Panics if the length of a field does not fit the number of its points or cells.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.gather().to_bytes()
    }

    /// All arrays, as they are before compression: a copy that outlives what they were taken from.
    fn gather(&self) -> Grid {
        let points = self.points.len() / 3;
        let each = |count: usize, points: u32| (1..=count as u32).map(|cell| cell * points).collect();
        let (connectivity, ends): (Vec<u32>, Vec<u32>) = match self.cells {
            Cells::Lines(lines) => (lines.as_flattened().to_vec(), each(lines.len(), 2)),
            Cells::Triangles(triangles) => (triangles.as_flattened().to_vec(), each(triangles.len(), 3)),
            Cells::Polygons { nodes, ends } => (nodes.to_vec(), ends.to_vec()),
            Cells::Vertices => ((0..points as u32).collect(), each(points, 1)),
        };
        let cells = ends.len();
        let starts = std::iter::once(&0).chain(&ends);
        let types: Vec<u8> = starts.zip(&ends).map(|(start, end)| TYPES[(end - start) as usize]).collect();
        let mut grid = Grid { points, cells, sections: Vec::with_capacity(4) };
        for (tag, items, fields) in
            [("PointData", points, &self.point_data), ("CellData", cells, &self.cell_data)]
        {
            let arrays = fields.iter().map(|(name, components, values)| {
                assert_eq!(values.len(), items * components, "field {name} must fit its {tag}");
                Array::floats(name, *components, values)
            });
            grid.sections.push((tag, arrays.collect()));
        }
        grid.sections.push(("Points", vec![Array::floats("Points", 3, self.points)]));
        let whole = |name, values: &[u32]| {
            Array::new("Int64", name, 1, values.iter().flat_map(|&i| i64::from(i).to_le_bytes()).collect())
        };
        let types = Array::new("UInt8", "types", 1, types);
        grid.sections
            .push(("Cells", vec![whole("connectivity", &connectivity), whole("offsets", &ends), types]));
        grid
    }
}

/// An array of a file: its type in the format, name, components, and values in little endian.
struct Array {
    kind: &'static str,
    name: String,
    components: usize,
    bytes: Vec<u8>,
}

impl Array {
    fn new(kind: &'static str, name: &str, components: usize, bytes: Vec<u8>) -> Self {
        Self { kind, name: name.into(), components, bytes }
    }

    fn floats(name: &str, components: usize, values: &[f64]) -> Self {
        Self::new("Float64", name, components, values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }
}

/// What a file holds, by its sections.
struct Grid {
    points: usize,
    cells: usize,
    sections: Vec<(&'static str, Vec<Array>)>,
}

impl Grid {
    fn to_bytes(&self) -> Vec<u8> {
        let Self { points, cells, sections } = self;
        let mut body = Body::default();
        for (tag, arrays) in sections {
            let _ = writeln!(body.xml, "<{tag}>");
            arrays.iter().for_each(|array| body.array(array));
            let _ = writeln!(body.xml, "</{tag}>");
        }
        format!(
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n\
             <UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n{}\
             </Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"base64\">\n_{}\n</AppendedData>\n</VTKFile>\n",
            body.xml, body.data
        )
        .into_bytes()
    }
}

/// The declarations, and the data appended to them.
#[derive(Default)]
struct Body {
    xml: String,
    data: String,
}

impl Body {
    fn array(&mut self, Array { kind, name, components, bytes }: &Array) {
        let (name, offset) = (escape(name), self.data.len());
        self.xml += &format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" \
             offset=\"{offset}\"/>\n"
        );
        let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(compress).collect();
        // Number of blocks, size of a block, size of the last one if it is not full, compressed sizes.
        let sizes = [blocks.len(), BLOCK, bytes.len() % BLOCK];
        let sizes = sizes.into_iter().chain(blocks.iter().map(Vec::len));
        let header: Vec<u8> = sizes.flat_map(|n| (n as u64).to_le_bytes()).collect();
        let encoder = base64::engine::general_purpose::STANDARD;
        encoder.encode_string(header, &mut self.data);
        encoder.encode_string(blocks.concat(), &mut self.data);
    }
}

fn compress(block: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(block.len() / 2 + 64), Compression::fast());
    encoder.write_all(block).expect("writing to memory cannot fail");
    encoder.finish().expect("writing to memory cannot fail")
}

/// A text as it may stand in XML and HTML, within quotation marks too.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loaded(vtu: &Vtu) -> Loaded {
        Loaded::of(&String::from_utf8(vtu.to_bytes()).expect("text")).expect("a file of ours")
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit_over_several_blocks() {
        let points: Vec<f64> = (0..150_000).map(|i| f64::from(i).sin()).collect();
        let mass: Vec<f64> = (0..50_000).map(f64::from).collect();
        let vtu = Vtu {
            points: &points,
            cells: Cells::Lines(&[[0, 1], [1, 49_999]]),
            point_data: vec![("mass", 1, &mass)],
            cell_data: vec![("tension <N>", 1, &[1.5, -2.5])],
        };
        let file = loaded(&vtu);
        let floats = |name| file.floats(name).expect("an array");
        assert_eq!(floats("Points"), points);
        assert_eq!(floats("mass"), mass);
        assert_eq!(floats("tension &lt;N&gt;"), [1.5, -2.5]);
        assert!(floats("none").is_empty());
        assert_eq!(file.whole("connectivity").expect("an array"), [0, 1, 1, 49_999]);
        assert_eq!(file.array("types").expect("an array"), [3, 3]);
    }

    #[test]
    fn triangles_and_quadrilaterals_stand_side_by_side() {
        let points: Vec<f64> = (0..15).map(f64::from).collect();
        let cells = Cells::Polygons { nodes: &[0, 1, 2, 1, 2, 3, 4], ends: &[3, 7] };
        let vtu =
            Vtu { points: &points, cells, point_data: vec![], cell_data: vec![("area", 1, &[1.0, 2.0])] };
        let file = loaded(&vtu);
        assert_eq!(file.array("types").expect("an array"), [5, 9]);
        assert_eq!(file.whole("offsets").expect("an array"), [3, 7]);
        assert!(String::from_utf8_lossy(&vtu.to_bytes()).contains("NumberOfCells=\"2\""));
    }

    #[test]
    fn a_grid_without_cells_or_points_is_a_valid_file() {
        let vtu = Vtu { points: &[], cells: Cells::Vertices, point_data: vec![], cell_data: vec![] };
        assert!(loaded(&vtu).floats("Points").expect("an array").is_empty());
    }

    #[test]
    fn a_file_that_was_cut_or_changed_is_an_error_and_no_panic() {
        let vtu = Vtu { points: &[1.0; 9], cells: Cells::Vertices, point_data: vec![], cell_data: vec![] };
        let text = String::from_utf8(vtu.to_bytes()).expect("text");
        let begin = text.find("\n_").expect("data") + 2;
        assert!(Loaded::of(&text[..begin - 3]).is_err());
        for cut in begin..begin + 40 {
            assert!(Loaded::of(&text[..cut]).and_then(|file| file.floats("Points")).is_err(), "{cut}");
        }
        let mut other = text.into_bytes();
        other[begin..begin + 8].fill(b'x');
        let other = Loaded::of(std::str::from_utf8(&other).expect("text")).expect("declarations");
        assert!(other.floats("Points").is_err());
    }
}

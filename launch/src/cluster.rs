//! The arguments of `rockfall cluster`, for its help, completions and manual page. `dem-solver cluster` does the work and
//! checks their values; a test in `tests` compares the two.

use clap::builder::PossibleValuesParser;
use std::ffi::OsString;
use std::path::PathBuf;

/// What a cluster is made of, and into which file.
#[derive(clap::Args)]
pub struct Arguments {
    /// Closed surface (.stl, .obj), or a built-in shape, as in box:1.2,0.8,0.6; all of them below
    shape: OsString,
    /// Most spheres, 1 to 50000. A round shape may take fewer: a sphere is one
    #[arg(long, short = 'n', value_name = "N")]
    spheres: OsString,
    /// File to write: `x y z r` per line [m], in the shape's own axes
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Metres per unit of a surface file [default: 1]
    #[arg(long, value_name = "M")]
    scale: Option<OsString>,
    /// Close small holes of a surface file, as scans have them; their number and area are printed
    #[arg(long)]
    close_holes: bool,
    /// Of several closed surfaces in a file take this one, counted from 1
    #[arg(long, value_name = "K")]
    piece: Option<OsString>,
    /// `medial`: by the error; `lattice`: equal spheres in rows (boxes; the largest number that fills it) [default: medial]
    #[arg(long, value_name = "HOW", value_parser = PossibleValuesParser::new(["medial", "lattice"]))]
    method: Option<String>,
    /// `volume`: as much outside of the solid as lacks inside; `largest`: as far outside as inside, the smallest largest
    /// error; `inside`: never outside [default: volume]
    #[arg(long, value_name = "WHERE", value_parser = PossibleValuesParser::new(["volume", "largest", "inside"]))]
    fit: Option<String>,
    /// Smallest radius [m]: small spheres make edges sharp, and are soft; what only smaller ones reach stays uncovered
    /// [default: 0]
    #[arg(long, value_name = "M")]
    smallest_radius: Option<OsString>,
    /// Largest distance of the two surfaces [m]: a cluster beyond it is refused [default: 15 % of the diagonal of the
    /// shape's box, and no more than 0.9 times the radius of the largest ball that fits into it]
    #[arg(long, value_name = "M")]
    largest_error: Option<OsString>,
    /// Write the spheres (points with a radius) as a VTU file too
    #[arg(long, value_name = "FILE")]
    vtu: Option<PathBuf>,
}

/// The arguments of this process after the word `cluster`, as they were given.
pub fn given() -> Vec<OsString> {
    std::env::args_os().skip(1).skip_while(|word| word != "cluster").skip(1).collect()
}

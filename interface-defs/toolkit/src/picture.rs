//! What all pictures have in common: colours, the line at their foot, and what stands across those of a run or a study whose results are
//! not to be trusted. They are drawn before it is known: the words are in every picture, unseen, and shown when the summary is written.

use super::files::{self, Dir};
use super::run_dir::PICTURE;
use std::io;
use std::path::Path;

/// Where a study has pictures.
const FOLDERS: [&str; 2] = ["maps", "lines"];
const UNSEEN: &str = "<g visibility=\"hidden\"";

/// Colours of lines and marks, distinct for any colour vision. Source: Okabe and Ito, Color Universal Design, 2008; without yellow and
/// light blue, which are pale on paper.
pub const COLOURS: [(u8, u8, u8); 6] =
    [(213, 94, 0), (0, 114, 178), (0, 0, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0)];
/// Height of the foot [px].
pub const FOOT: i32 = 30;

/// End the picture `svg` of this width and height, of which `fine` are a pixel: of what it is, and of which version, at its foot, and the words.
pub fn close(svg: &mut String, [width, height]: [i32; 2], fine: i32, foot: &[Option<&str>]) {
    let version = concat!("rockfall ", env!("CARGO_PKG_VERSION"));
    let foot: Vec<&str> = foot.iter().flatten().copied().chain([version]).collect();
    let foot = foot.join("  |  ").replace('&', "&amp;").replace('<', "&lt;");
    let (left, low, size) = (10 * fine, height - 11 * fine, 11 * fine);
    let foot = format!(
        "<text x=\"{left}\" y=\"{low}\" font-family=\"sans-serif\" font-size=\"{size}\" fill=\"#282828\">{foot}</text>\n"
    );
    svg.truncate(svg.rfind("</svg>").unwrap_or(svg.len()));
    *svg += &(foot + &words([width, height]));
}

/// The end of a picture, with the words.
fn words([width, height]: [i32; 2]) -> String {
    let size = (width / 7).min(height / 2);
    // Once for each part of a high page that is as high as it is wide.
    let parts = (height / width).max(1);
    let at = |part: i32| {
        let [x, y] = [width / 2, (2 * part + 1) * height / (2 * parts)];
        format!("<text x=\"{x}\" y=\"{y}\" transform=\"rotate(-12 {x} {y})\">UNRELIABLE</text>\n")
    };
    let style = "text-anchor=\"middle\" font-family=\"sans-serif\" font-weight=\"bold\" fill=\"#B00000\" fill-opacity=\"0.3\"";
    format!("{UNSEEN} font-size=\"{size}\" {style}>\n{}</g>\n</svg>", (0..parts).map(at).collect::<String>())
}

/// The picture `svg` with the words shown.
pub fn marked(svg: &str) -> String {
    svg.replacen(UNSEEN, "<g", 1)
}

/// Show the words across all pictures of the run or study in `dir`.
///
/// # Errors
/// If a picture cannot be read or written.
pub fn reveal(dir: &Path) -> io::Result<()> {
    let mut all = vec![dir.join(PICTURE)];
    for folder in FOLDERS.map(|name| dir.join(name)).iter().filter(|folder| folder.is_dir()) {
        let names = Dir::open(folder)?.entries()?.into_iter().map(|(name, _)| folder.join(name));
        all.extend(names.filter(|path| path.extension().is_some_and(|end| end == "svg")));
    }
    for path in all.iter().filter(|path| path.is_file()) {
        files::write(path, marked(&files::read_text(path)?).as_bytes())?;
    }
    Ok(())
}

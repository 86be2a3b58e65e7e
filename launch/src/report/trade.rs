//! The page of `rockfall trade`: its text and its picture.

use super::page::{Page, picture};
use pulldown_cmark::{Options, Parser, html};
use std::io;
use std::path::Path;
use toolkit::files;
use toolkit::run_dir::{TRADE, TRADE_PICTURE};
use toolkit::summary::RunStatus;

/// The page of the study in `dir`.
pub fn page(dir: &Path) -> io::Result<Page> {
    let texts = TRADE.iter().filter(|name| dir.join(name).exists());
    let texts = texts.map(|name| files::read_text(&dir.join(name))).collect::<io::Result<Vec<_>>>()?;
    let title = texts.first().and_then(|text| text.lines().next()).unwrap_or_default();
    let mut page = Page::new(title.trim_start_matches("# "), RunStatus::Done);
    if dir.join(TRADE_PICTURE).exists() {
        page.section("Error over cost", &picture(&dir.join(TRADE_PICTURE), "The front, and all runs")?);
    }
    for section in texts.iter().flat_map(|text| text.split("\n## ")) {
        let (title, text) = section.split_once('\n').unwrap_or((section, ""));
        let mut content = String::new();
        html::push_html(&mut content, Parser::new_ext(text, Options::ENABLE_TABLES));
        let content = content.replace("<table>", "<div class=\"wide\"><table>");
        let content = content.replace("</table>", "</table></div>").replace(" %", "&nbsp;%");
        page.section(if title.starts_with("# ") { "What was run" } else { title }, &content);
    }
    Ok(page)
}

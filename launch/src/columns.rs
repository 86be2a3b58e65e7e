//! Tables of which every column is declared once, with its name and what stands in it: for programs, for a page, for the screen.

use std::fmt::Write;
use toolkit::history::csv_text;

/// What stands in a cell.
type Value<'a, R> = Box<dyn Fn(&R) -> String + 'a>;

/// A table of rows `R`.
pub struct Columns<'a, R>(Vec<(String, Value<'a, R>)>);

impl<'a, R> Columns<'a, R> {
    /// Without columns.
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// The same with one more.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, value: impl Fn(&R) -> String + 'a) -> Self {
        self.0.push((name.into(), Box::new(value)));
        self
    }

    /// The same with one of numbers, at full precision, empty where there is none.
    #[must_use]
    pub fn number(self, name: impl Into<String>, value: impl Fn(&R) -> Option<f64> + 'a) -> Self {
        self.with(name, move |row| value(row).map_or(String::new(), |number| number.to_string()))
    }

    /// The same with one of texts of a user, which stay texts in a spreadsheet.
    #[must_use]
    pub fn text(self, name: impl Into<String>, value: impl Fn(&R) -> String + 'a) -> Self {
        self.with(name, move |row| csv_text(&value(row)).into_owned())
    }

    fn names(&self) -> Vec<String> {
        self.0.iter().map(|(name, _)| name.clone()).collect()
    }

    fn row(&self, row: &R) -> Vec<String> {
        self.0.iter().map(|(_, value)| value(row)).collect()
    }

    /// As CSV.
    pub fn csv(&self, rows: &[R]) -> Result<String, csv::Error> {
        let mut out = csv::Writer::from_writer(Vec::new());
        out.write_record(self.names())?;
        rows.iter().try_for_each(|row| out.write_record(self.row(row)))?;
        let bytes = out.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// As Markdown, with an empty line behind it.
    pub fn markdown(&self, rows: &[R]) -> String {
        let line = |cells: Vec<String>| {
            let cells: Vec<String> =
                cells.iter().map(|cell| cell.replace('|', "\\|").replace('\n', " ")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = format!("|{}\n", "---|".repeat(self.0.len()));
        line(self.names()) + &rule + &rows.iter().map(|row| line(self.row(row))).collect::<String>() + "\n"
    }

    /// In columns for a screen.
    pub fn aligned(&self, rows: &[R]) -> String {
        let lines: Vec<Vec<String>> =
            std::iter::once(self.names()).chain(rows.iter().map(|row| self.row(row))).collect();
        let width = |k: usize| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.0.len()).map(width).collect();
        lines.iter().fold(String::new(), |mut text, line| {
            let cells: Vec<String> =
                line.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
            let _ = writeln!(text, "{}", cells.join("  ").trim_end());
            text
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_declared_once_for_all_forms() {
        let table =
            Columns::new().text("name", |row: &(&str, f64)| row.0.into()).number("x_m", |row| Some(row.1));
        let rows = [("=cmd", -1.5), ("a|b", 20.0)];
        assert_eq!(table.csv(&rows).expect("text"), "name,x_m\n'=cmd,-1.5\na|b,20\n");
        assert_eq!(table.markdown(&rows[1..]), "| name | x_m |\n|---|---|\n| a\\|b | 20 |\n\n");
        assert_eq!(table.aligned(&rows), "name   x_m\n'=cmd  -1.5\na|b    20\n");
    }
}

//! Tables of which every column is declared once, with its name and what stands in it: for programs, for a page, for the screen.

use super::history::csv_text;
use super::numbers::three;

/// What stands in a cell.
type Value<'a, R> = Box<dyn Fn(&R) -> String + 'a>;

/// A column.
struct Column<'a, R> {
    /// In a table for programs `_` stands for its blanks.
    name: String,
    people: Value<'a, R>,
    programs: Value<'a, R>,
}

/// A table of rows `R`.
#[must_use]
pub struct Columns<'a, R>(Vec<Column<'a, R>>);

impl<'a, R> Default for Columns<'a, R> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'a, R> Columns<'a, R> {
    /// Without columns.
    pub fn new() -> Self {
        Self::default()
    }

    fn and(
        mut self,
        name: impl Into<String>,
        people: impl Fn(&R) -> String + 'a,
        programs: impl Fn(&R) -> String + 'a,
    ) -> Self {
        self.0.push(Column { name: name.into(), people: Box::new(people), programs: Box::new(programs) });
        self
    }

    /// The same with one more.
    pub fn with(self, name: impl Into<String>, value: impl Fn(&R) -> String + Copy + 'a) -> Self {
        self.and(name, value, value)
    }

    /// The same with one of numbers: for programs at full precision, empty where there is none; for people of three digits.
    pub fn number(self, name: impl Into<String>, value: impl Fn(&R) -> Option<f64> + Copy + 'a) -> Self {
        let people = move |row: &R| value(row).map_or("-".into(), three);
        self.and(name, people, move |row| value(row).map_or(String::new(), |number| number.to_string()))
    }

    /// The same with several of numbers, the parts of a vector.
    pub fn numbers<const N: usize>(
        self,
        names: [&str; N],
        value: impl Fn(&R) -> Option<[f64; N]> + Copy + 'a,
    ) -> Self {
        names
            .into_iter()
            .enumerate()
            .fold(self, |all, (at, name)| all.number(name, move |row| value(row).map(|vector| vector[at])))
    }

    /// The same with one of texts of a user, which stay texts in a spreadsheet.
    pub fn text(self, name: impl Into<String>, value: impl Fn(&R) -> String + Copy + 'a) -> Self {
        self.and(name, value, move |row| csv_text(&value(row)).into_owned())
    }

    /// Names of the columns, for programs.
    pub fn names(&self) -> impl Iterator<Item = String> {
        self.0.iter().map(|column| column.name.replace(' ', "_"))
    }

    /// Cells of a row, for programs.
    pub fn row(&self, row: &R) -> impl Iterator<Item = String> {
        self.0.iter().map(|column| (column.programs)(row))
    }

    /// Names and cells of all rows, for people.
    pub fn lines(&self, rows: &[R]) -> Vec<Vec<String>> {
        let names = self.0.iter().map(|column| column.name.clone()).collect();
        let cells = |row| self.0.iter().map(|column| (column.people)(row)).collect();
        std::iter::once(names).chain(rows.iter().map(cells)).collect()
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
        let mut lines = self.lines(rows);
        lines.iter_mut().flatten().for_each(|cell| *cell = cell.replace('|', "\\|").replace('\n', " "));
        let lines = padded(lines);
        let rule: Vec<String> = lines[0].iter().map(|cell| "-".repeat(cell.chars().count() + 2)).collect();
        let mut rows: Vec<String> =
            lines.iter().map(|cells| format!("| {} |\n", cells.join(" | "))).collect();
        rows.insert(1, format!("|{}|\n", rule.join("|")));
        rows.concat() + "\n"
    }

    /// In columns for a screen.
    pub fn aligned(&self, rows: &[R]) -> String {
        let lines = padded(self.lines(rows));
        lines.iter().map(|cells| cells.join("  ").trim_end().to_owned() + "\n").collect()
    }
}

/// Every cell as wide as the widest of its column.
fn padded(mut lines: Vec<Vec<String>>) -> Vec<Vec<String>> {
    for column in 0..lines[0].len() {
        let width = lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
        lines.iter_mut().for_each(|line| line[column] = format!("{:width$}", line[column]));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_declared_once_for_all_forms() {
        let table =
            Columns::new().text("name", |row: &(&str, f64)| row.0.into()).number("x_m", |row| Some(row.1));
        let rows = [("=cmd", -1.53125), ("a|b", 20.0)];
        assert_eq!(table.csv(&rows).expect("text"), "name,x_m\n'=cmd,-1.53125\na|b,20\n");
        assert_eq!(table.markdown(&rows[1..]), "| name | x_m |\n|------|-----|\n| a\\|b | 20  |\n\n");
        assert_eq!(table.aligned(&rows), "name  x_m\n=cmd  -1.53\na|b   20\n");
    }
}

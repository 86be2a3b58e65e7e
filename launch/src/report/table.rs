//! Tables of numbers that a run has written, such as `history.csv`.

use std::fmt::Display;
use std::io;
use std::path::Path;
use toolkit::files;

/// Numbers by rows and columns.
#[derive(Debug, Default)]
pub struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// That in the CSV file at `path`, up to its first row that is not whole; an empty one where there is none.
    pub fn read(path: &Path) -> io::Result<Self> {
        let Some(file) = files::if_there(files::source(path))? else { return Ok(Self::default()) };
        let mut reader = csv::Reader::from_reader(io::BufReader::new(file));
        let names: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row).unwrap_or(false) {
            // An empty cell is a number that there is not.
            let cells = row.iter().map(|cell| cell.parse().unwrap_or(f64::NAN));
            columns.iter_mut().zip(cells).for_each(|(column, value)| column.push(value));
        }
        Ok(Self { names, columns })
    }

    /// The same with the columns of whose names `keep` is true.
    pub fn filtered(self, keep: impl Fn(&str) -> bool) -> Self {
        let columns = self.names.into_iter().zip(self.columns);
        let (names, columns) = columns.filter(|(name, _)| keep(name)).unzip();
        Self { names, columns }
    }

    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// All columns with their names.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.names.iter().map(String::as_str).zip(self.columns.iter().map(Vec::as_slice))
    }

    /// The column `name`; empty where there is none.
    pub fn column(&self, name: &str) -> &[f64] {
        self.columns().find(|(other, _)| *other == name).map_or(&[], |(_, column)| column)
    }

    /// Columns by the ends of their names, such as x, y and z; `None` where one is missing.
    pub fn vector<const N: usize>(&self, before: &str, ends: [impl Display; N]) -> Option<Vec<[f64; N]>> {
        let columns = ends.map(|end| self.column(&format!("{before}{end}")));
        let is_there = columns.iter().all(|column| !column.is_empty());
        is_there.then(|| (0..self.rows()).map(|row| std::array::from_fn(|k| columns[k][row])).collect())
    }

    /// Names of the rocks, whose columns begin with them.
    pub fn rocks(&self) -> impl Iterator<Item = &str> {
        let names = self.names.iter().filter_map(|name| name.strip_suffix("_vx_m_per_s"));
        names.filter(|name| !self.column(&format!("{name}_orientation_w")).is_empty())
    }

    /// The rows of which the column `name` is `value`.
    pub fn only(&self, name: &str, value: f64) -> Self {
        let of = self.column(name);
        let rows: Vec<usize> = (0..of.len()).filter(|row| of[*row] == value).collect();
        let columns = self.columns.iter().map(|column| rows.iter().map(|row| column[*row]).collect());
        Self { names: self.names.clone(), columns: columns.collect() }
    }
}

//! Cholesky factorisation of a sparse matrix front by front: the multifrontal method.
//!
//! A *supernode* is a block of columns of the factor with one pattern. Its *front* is the dense matrix over its own
//! columns (pivots) and the rows below: what the matrix has there, and what its children in the elimination tree
//! leave over. The pivots are eliminated, the panel of their columns is a piece of the factor, and the rest (Schur
//! complement) is handed to the parent. All arithmetic runs in small dense loops over contiguous memory. Source:
//! Duff and Reid (1983), ACM TOMS 9, 302; Liu (1992), SIAM Review 34, 82.
//!
//! Fronts of cable nets are small (three to a few hundred columns): general dense kernels spend more time in
//! getting started than in numbers, so [`crate::linear_algebra::dense`] has its own. Every sum has one order, so that equal input gives
//! equal bytes.

use crate::linear_algebra::dense::{ROWS, rest_place};
use crate::linear_algebra::lanes::wide;
use crate::linear_algebra::signed::{Pivoting, Positive, Signed};
use std::ops::Range;

/// Columns of the factor with one pattern.
#[derive(Debug, Clone)]
struct Supernode {
    /// Its columns, in the order of elimination.
    columns: Range<usize>,
    /// Rows of its front: its columns, and below them.
    rows: usize,
    /// Place of its panel in the factor.
    panel: usize,
    /// Place of what it leaves over.
    rest: usize,
    /// Its rows below, in `below`.
    below: Range<usize>,
    /// Entries of the matrix that belong to its panel.
    entries: Range<usize>,
    /// Its children, in `children`.
    children: Range<usize>,
}

/// Shape of a factor: all that does not depend on the numbers.
#[derive(Debug, Clone, Default)]
pub struct Fronts {
    /// Each right after its children.
    supernodes: Vec<Supernode>,
    /// Rows below all supernodes, in the order of elimination.
    below: Vec<u32>,
    /// Places of these in the front of the parent, by rows and in its first column.
    in_parent: Vec<u32>,
    in_panel: Vec<u32>,
    /// Place of a number among those of the matrix, and in the panel.
    entries: Vec<[u32; 2]>,
    /// Children of all supernodes.
    children: Vec<u32>,
    /// Unknown of each column, in the order of elimination.
    pub unknowns: Vec<usize>,
    /// Numbers in the factor, padding included.
    pub factor_len: usize,
    /// Numbers that wait for a parent, at most.
    pub rest_len: usize,
    most_rows: usize,
}

impl Supernode {
    /// The row of the front with which the columns of what is left over begin: tiles of both then match.
    #[inline(always)]
    fn base(&self) -> usize {
        self.columns.len() / ROWS * ROWS
    }

    /// Rows with which the first tile of what is left over begins, and which are none of it.
    #[inline(always)]
    fn skipped(&self) -> usize {
        self.columns.len() - self.base()
    }

    /// Numbers of what is left over.
    fn rest_len(&self) -> usize {
        let tiles = leading(self.rows) / ROWS - self.base() / ROWS;
        tiles * (tiles + 1) / 2 * ROWS * ROWS
    }

    /// Column `j` of what is left over, from the diagonal on.
    #[inline(always)]
    fn rest_column<'a>(&self, rest: &'a [f64], j: usize) -> &'a [f64] {
        let tiles = leading(self.rows) / ROWS - self.base() / ROWS;
        let column = self.skipped() + j;
        let from = rest_place(tiles, column) + column % ROWS;
        &rest[from..from + self.below.len() - j]
    }
}

impl Fronts {
    /// For a lower triangle by columns, the rows of column `j` being `rows[starts[j]..starts[j + 1]]`. `unknowns` are those of
    /// each column in the order of elimination, `shape` the columns of each supernode and its rows below, increasing; each
    /// supernode right after its children.
    pub fn new(
        unknowns: Vec<usize>,
        shape: &[(Range<usize>, Vec<usize>)],
        starts: &[usize],
        rows: &[usize],
    ) -> Self {
        let n = unknowns.len();
        let mut column = vec![0; n];
        unknowns.iter().enumerate().for_each(|(i, unknown)| column[*unknown] = i);
        let mut owner = vec![0; n];
        for (s, (columns, _)) in shape.iter().enumerate() {
            owner[columns.clone()].fill(s);
        }
        let mut children = vec![Vec::new(); shape.len()];
        for (s, (_, below)) in shape.iter().enumerate() {
            if let Some(row) = below.first() {
                children[owner[*row]].push(s as u32);
            }
        }
        let mut fronts = Self { unknowns, ..Self::default() };
        let mut memory = FreeMemory::default();
        for ((columns, below), children) in shape.iter().zip(&children) {
            let (first, first_child) = (fronts.below.len(), fronts.children.len());
            fronts.below.extend(below.iter().map(|row| *row as u32));
            fronts.children.extend(children);
            let mut supernode = Supernode {
                columns: columns.clone(),
                rows: columns.len() + below.len(),
                panel: fronts.factor_len,
                rest: 0,
                below: first..fronts.below.len(),
                entries: 0..0,
                children: first_child..fronts.children.len(),
            };
            supernode.rest = memory.take(supernode.rest_len());
            for child in children.iter().map(|child| &fronts.supernodes[*child as usize]) {
                memory.give_back(child.rest, child.rest_len());
            }
            fronts.factor_len += leading(supernode.rows) * columns.len();
            fronts.most_rows = fronts.most_rows.max(supernode.rows);
            fronts.supernodes.push(supernode);
        }
        fronts.in_parent = vec![0; fronts.below.len()];
        fronts.in_panel = fronts.in_parent.clone();
        fronts.rest_len = memory.len;
        for parent in &fronts.supernodes {
            for child in &fronts.children[parent.children.clone()] {
                for at in fronts.supernodes[*child as usize].below.clone() {
                    let row = local(parent, &fronts.below, fronts.below[at] as usize);
                    fronts.in_parent[at] = row as u32;
                    fronts.in_panel[at] = in_panel(parent.columns.len(), row, 0) as u32;
                }
            }
        }
        fronts.place_entries(&column, &owner, starts, rows);
        fronts
    }

    /// Find the place of each number of the matrix in the panel of its supernode.
    fn place_entries(&mut self, column: &[usize], owner: &[usize], starts: &[usize], rows: &[usize]) {
        let ends = |j: usize, at: usize| {
            let (a, b) = (column[j], column[rows[at]]);
            (a.max(b), a.min(b))
        };
        let all = || (0..column.len()).flat_map(|j| (starts[j]..starts[j + 1]).map(move |at| (j, at)));
        let mut next = vec![0; self.supernodes.len()];
        all().for_each(|(j, at)| next[owner[ends(j, at).1]] += 1);
        let mut sum = 0;
        for (supernode, next) in self.supernodes.iter_mut().zip(&mut next) {
            supernode.entries = sum..sum + *next;
            (*next, sum) = (sum, sum + *next);
        }
        self.entries = vec![[0; 2]; sum];
        for (j, at) in all() {
            let (row, column) = ends(j, at);
            let supernode = &self.supernodes[owner[column]];
            let row = local(supernode, &self.below, row);
            let place = in_panel(supernode.columns.len(), row, column - supernode.columns.start);
            let next = &mut next[owner[column]];
            self.entries[*next] = [at as u32, place as u32];
            *next += 1;
        }
    }

    /// Numbers of work that [`Self::solve`] needs.
    pub fn work_len(&self) -> usize {
        self.unknowns.len() + leading(self.most_rows)
    }

    /// Logarithm of the magnitude of the determinant, of a factor.
    pub fn log_determinant(&self, factor: &[f64]) -> f64 {
        let panels = self.supernodes.iter().flat_map(|s| {
            let pivots = s.columns.len();
            (0..pivots).map(move |k| s.panel + in_panel(pivots, k, k))
        });
        // On the diagonal stands the inverse of the root of the pivot's magnitude.
        panels.map(|at| -2.0 * factor[at].ln()).sum()
    }

    /// Solve in place by `factor`, whose pivots have the signs `signs`; empty = all are positive. `work` holds
    /// [`Self::work_len`] numbers.
    pub fn solve(&self, factor: &[f64], signs: &[f64], x: &mut [f64], work: &mut [f64]) {
        let (y, work) = work.split_at_mut(x.len());
        y.iter_mut().zip(&self.unknowns).for_each(|(y, unknown)| *y = x[*unknown]);
        forward(self, factor, y, work);
        y.iter_mut().zip(signs).for_each(|(y, sign)| *y *= sign);
        backward(self, factor, y, work);
        y.iter().zip(&self.unknowns).for_each(|(y, unknown)| x[*unknown] = *y);
    }
}

/// Rows of all tiles of a front of so many rows.
#[inline(always)]
fn leading(rows: usize) -> usize {
    rows.next_multiple_of(ROWS)
}

/// Place of a number in a panel of so many pivots.
#[inline(always)]
fn in_panel(pivots: usize, row: usize, column: usize) -> usize {
    (row / ROWS * pivots + column) * ROWS + row % ROWS
}

/// Place of `row` in the front of `supernode`.
fn local(supernode: &Supernode, below: &[u32], row: usize) -> usize {
    if supernode.columns.contains(&row) {
        return row - supernode.columns.start;
    }
    let inside = below[supernode.below.clone()].binary_search(&(row as u32));
    supernode.columns.len() + inside.expect("the front of a parent holds the rows of its children")
}

/// Factorise the matrix with `values`, in the order of its pattern, into `factor`; `rest`: memory for [`Fronts::rest_len`] numbers. The
/// error is the unknown of a pivot that is not positive or, with `signed`, which keeps the signs of the pivots, is not a number.
pub fn factorise(
    fronts: &Fronts,
    values: &[f64],
    factor: &mut [f64],
    rest: &mut [f64],
    signed: Option<&mut Signed>,
) -> Result<(), usize> {
    match signed {
        Some(signed) => all_fronts(fronts, values, factor, rest, signed),
        None => all_positive(fronts, values, factor, rest),
    }
}

/// All fronts, one after the other.
#[inline(always)]
fn all_fronts<P: Pivoting>(
    fronts: &Fronts,
    values: &[f64],
    factor: &mut [f64],
    rest: &mut [f64],
    pivoting: &mut P,
) -> Result<(), usize> {
    for supernode in &fronts.supernodes {
        let (pivots, ld) = (supernode.columns.len(), leading(supernode.rows));
        let children = &fronts.children[supernode.children.clone()];
        let panel = &mut factor[supernode.panel..][..ld * pivots];
        // What stands above the diagonal, but for the tiles on it, is neither written nor read.
        for (t, tile) in panel.chunks_exact_mut(pivots * ROWS).enumerate() {
            tile[..pivots.min((t + 1) * ROWS) * ROWS].fill(0.0);
        }
        for [from, to] in &fronts.entries[supernode.entries.clone()] {
            panel[*to as usize] = values[*from as usize];
        }
        for child in children {
            let child = &fronts.supernodes[*child as usize];
            let places = &fronts.in_parent[child.below.clone()];
            let in_panel = &fronts.in_panel[child.below.clone()];
            let from = &rest[child.rest..][..child.rest_len()];
            for (j, place) in places.iter().enumerate().take_while(|(_, place)| (**place as usize) < pivots) {
                let to = &mut panel[*place as usize * ROWS..];
                for (number, row) in child.rest_column(from, j).iter().zip(&in_panel[j..]) {
                    to[*row as usize] += number;
                }
            }
        }
        if let Err(column) = pivoting.eliminate(panel, &supernode.columns) {
            return Err(fronts.unknowns[supernode.columns.start + column]);
        }
        pivoting.leave_over(
            &mut rest[supernode.rest..][..supernode.rest_len()],
            panel,
            &supernode.columns,
            supernode.rows,
        );
        let (base, tiles) = (supernode.base(), (ld - supernode.base()) / ROWS);
        for child in children {
            let child = &fronts.supernodes[*child as usize];
            let places = &fronts.in_parent[child.below.clone()];
            // The two lie apart in one memory, in either order.
            let (from, to) = if supernode.rest < child.rest {
                let (low, high) = rest.split_at_mut(child.rest);
                (&high[..child.rest_len()], &mut low[supernode.rest..])
            } else {
                let (low, high) = rest.split_at_mut(supernode.rest);
                (&low[child.rest..][..child.rest_len()], high)
            };
            let first = places.partition_point(|place| (*place as usize) < pivots);
            for (j, place) in places.iter().enumerate().skip(first) {
                let column = *place as usize - base;
                let start = column / ROWS * ROWS + base;
                let to = &mut to[rest_place(tiles, column)..][..ld - start];
                for (number, row) in child.rest_column(from, j).iter().zip(&places[j..]) {
                    to[*row as usize - start] += number;
                }
            }
        }
    }
    Ok(())
}

wide! {
    /// All fronts, whose pivots are positive.
    fn all_positive(fronts: &Fronts, values: &[f64], factor: &mut [f64], rest: &mut [f64]) -> Result<(), usize> {
        all_fronts(fronts, values, factor, rest, &mut Positive)
    }

    /// `y = L^-1 y`, in the order of elimination.
    fn forward(fronts: &Fronts, factor: &[f64], y: &mut [f64], work: &mut [f64]) {
        for supernode in &fronts.supernodes {
            let (pivots, ld) = (supernode.columns.len(), leading(supernode.rows));
            let panel = factor[supernode.panel..][..ld * pivots].as_chunks::<ROWS>().0;
            let x = &mut y[supernode.columns.clone()];
            for (t, tile) in panel.chunks_exact(pivots).enumerate() {
                let solved = pivots.min(t * ROWS);
                let mut sums = [[0.0; ROWS]; 2];
                let ((x2, x1), (l2, l1)) = (x[..solved].as_chunks::<2>(), tile[..solved].as_chunks::<2>());
                for (x, l) in x2.iter().zip(l2) {
                    for part in 0..2 {
                        for r in 0..ROWS {
                            sums[part][r] += x[part] * l[part][r];
                        }
                    }
                }
                let mut sum: [f64; ROWS] = std::array::from_fn(|r| sums[0][r] + sums[1][r]);
                for (x, l) in x1.iter().zip(l1) {
                    for r in 0..ROWS {
                        sum[r] += x * l[r];
                    }
                }
                for k in solved..pivots.min(solved + ROWS) {
                    let l = &tile[k];
                    x[k] = (x[k] - sum[k - solved]) * l[k - solved];
                    for r in 0..ROWS {
                        sum[r] += x[k] * l[r];
                    }
                }
                work[t * ROWS..][..ROWS].copy_from_slice(&sum);
            }
            for (row, w) in fronts.below[supernode.below.clone()].iter().zip(&work[pivots..]) {
                y[*row as usize] -= w;
            }
        }
    }

    /// `y = L^-T y`, in the order of elimination.
    fn backward(fronts: &Fronts, factor: &[f64], y: &mut [f64], work: &mut [f64]) {
        for supernode in fronts.supernodes.iter().rev() {
            let (pivots, ld) = (supernode.columns.len(), leading(supernode.rows));
            let panel = factor[supernode.panel..][..ld * pivots].as_chunks::<ROWS>().0;
            let work = &mut work[..ld];
            for (row, w) in fronts.below[supernode.below.clone()].iter().zip(&mut work[pivots..]) {
                *w = y[*row as usize];
            }
            // What is not solved yet counts as 0, as does what lies behind the last row.
            work[..pivots].fill(0.0);
            work[supernode.rows..].fill(0.0);
            let x = &mut y[supernode.columns.clone()];
            for start in (0..pivots).step_by(4).rev() {
                match pivots - start {
                    1 => back::<1>(panel, pivots, start, work, x),
                    2 => back::<2>(panel, pivots, start, work, x),
                    3 => back::<3>(panel, pivots, start, work, x),
                    _ => back::<4>(panel, pivots, start, work, x),
                }
            }
        }
    }
}

/// Solve for unknowns `start..start + W` of a front, those behind being in `work` already.
#[inline(always)]
fn back<const W: usize>(panel: &[[f64; ROWS]], pivots: usize, start: usize, work: &mut [f64], x: &mut [f64]) {
    let mut sums = [[0.0; ROWS]; W];
    for (tile, w) in panel.chunks_exact(pivots).zip(work.as_chunks::<ROWS>().0).skip(start / ROWS) {
        let tile: &[[f64; ROWS]; W] = tile[start..start + W].try_into().expect("so many columns");
        for k in 0..W {
            for r in 0..ROWS {
                sums[k][r] += w[r] * tile[k][r];
            }
        }
    }
    let tile = &panel[start / ROWS * pivots + start..][..W];
    for k in (0..W).rev() {
        let mut sum = total(&sums[k]);
        for r in k + 1..W {
            sum += work[start + r] * tile[k][start % ROWS + r];
        }
        let value = (x[start + k] - sum) * tile[k][start % ROWS + k];
        x[start + k] = value;
        work[start + k] = value;
    }
}

/// Sum of the parts of a sum.
#[inline(always)]
fn total(lanes: &[f64; ROWS]) -> f64 {
    let pairs = [lanes[0] + lanes[4], lanes[1] + lanes[5], lanes[2] + lanes[6], lanes[3] + lanes[7]];
    (pairs[0] + pairs[2]) + (pairs[1] + pairs[3])
}

/// Places in memory that is taken and given back, found once: the first gap that is wide enough.
#[derive(Debug, Default)]
struct FreeMemory {
    /// Gaps below `len`, in order.
    gaps: Vec<Range<usize>>,
    /// Numbers in all, at most.
    len: usize,
}

impl FreeMemory {
    /// A place for `len` numbers.
    fn take(&mut self, len: usize) -> usize {
        if let Some(i) = self.gaps.iter().position(|gap| gap.len() >= len) {
            let place = self.gaps[i].start;
            self.gaps[i].start += len;
            if self.gaps[i].is_empty() {
                self.gaps.remove(i);
            }
            return place;
        }
        let place = match self.gaps.last() {
            Some(gap) if gap.end == self.len => self.gaps.pop().map_or(self.len, |gap| gap.start),
            _ => self.len,
        };
        self.len = place + len;
        place
    }

    /// The place of `len` numbers is free again.
    fn give_back(&mut self, place: usize, len: usize) {
        if len == 0 {
            return;
        }
        let mut gap = place..place + len;
        let mut at = self.gaps.partition_point(|g| g.start < place);
        if self.gaps.get(at).is_some_and(|g| g.start == gap.end) {
            gap.end = self.gaps.remove(at).end;
        }
        if at > 0 && self.gaps[at - 1].end == gap.start {
            at -= 1;
            gap.start = self.gaps.remove(at).start;
        }
        self.gaps.insert(at, gap);
    }
}

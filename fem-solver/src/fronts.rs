//! Cholesky factorisation of a sparse matrix front by front: the multifrontal method.
//!
//! A *supernode* is a block of columns of the factor with one pattern. Its *front* is the dense matrix over its own
//! columns (pivots) and the rows below: what the matrix has there, and what its children in the elimination tree
//! leave over. The pivots are eliminated, the panel of their columns is a piece of the factor, and the rest (Schur
//! complement) is handed to the parent. All arithmetic runs in small dense loops over contiguous memory. Source:
//! Duff and Reid (1983), ACM TOMS 9, 302; Liu (1992), SIAM Review 34, 82.
//!
//! Fronts of cable nets are small (three to a hundred columns): general dense kernels spend more time in
//! getting started than in numbers. Measured for 10 092 unknowns: 47e6 operations took 12 ms through them.
//! Every number is the same sum in the same order whatever the width of the registers, and no product is
//! fused with a sum: equal input gives equal bytes on every machine.

use crate::dense::{Apart, Arithmetic, Fused, ROWS, eliminate, leave_over};
use crate::lanes::wide;
use std::ops::Range;

/// Columns of the factor with one pattern.
#[derive(Debug, Clone)]
struct Supernode {
    /// Its columns, in the order of elimination.
    columns: Range<usize>,
    /// Rows of its front: its columns, and below them.
    rows: usize,
    /// Place of its panel in the factor: `leading(rows)` numbers per column.
    panel: usize,
    /// Place of what it leaves over, `leading(rows) - base` numbers per row below.
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
    /// In an order in which children precede their parents.
    supernodes: Vec<Supernode>,
    /// Rows below all supernodes, in the order of elimination.
    below: Vec<u32>,
    /// Where these are in the front of the parent.
    in_parent: Vec<u32>,
    /// Place of a number among those of the matrix, and in the factor.
    entries: Vec<[u32; 2]>,
    /// Children of all supernodes.
    children: Vec<u32>,
    /// Unknown of each column.
    unknowns: Vec<usize>,
    factor_len: usize,
    rest_len: usize,
    most_rows: usize,
    /// Numbers of the largest panel.
    widest: usize,
}

/// A column pattern of supernodes, as an analysis gives it.
pub struct Shape<'a> {
    /// Unknown of each column in the order of elimination.
    pub unknowns: &'a [usize],
    /// Columns of each supernode and its rows below, increasing; each supernode right after its children.
    pub supernodes: Vec<(Range<usize>, Vec<usize>)>,
}

impl Supernode {
    /// The row of the front with which the columns of what is left over begin: tiles of both then meet.
    #[inline(always)]
    fn base(&self) -> usize {
        self.columns.len() / ROWS * ROWS
    }

    /// Numbers from one column of what is left over to the next.
    #[inline(always)]
    fn ld_rest(&self) -> usize {
        leading(self.rows) - self.base()
    }

    /// Rows with which a column of what is left over begins, and which are none of it.
    #[inline(always)]
    fn skipped(&self) -> usize {
        self.columns.len() - self.base()
    }

    /// Numbers of what is left over.
    fn rest_len(&self) -> usize {
        self.ld_rest() * self.below.len()
    }
}

impl Fronts {
    /// For a lower triangle by columns, the rows of column `j` being `rows[starts[j]..starts[j + 1]]`.
    pub fn new(shape: &Shape, starts: &[usize], rows: &[usize]) -> Self {
        let n = shape.unknowns.len();
        let mut column = vec![0; n];
        shape.unknowns.iter().enumerate().for_each(|(i, unknown)| column[*unknown] = i);
        let mut owner = vec![0; n];
        for (s, (columns, _)) in shape.supernodes.iter().enumerate() {
            owner[columns.clone()].fill(s);
        }
        let count = shape.supernodes.len();
        let mut children = vec![Vec::new(); count];
        for (s, (_, below)) in shape.supernodes.iter().enumerate() {
            if let Some(row) = below.first() {
                children[owner[*row]].push(s);
            }
        }
        let mut entries = vec![Vec::new(); count];
        for j in 0..n {
            for at in starts[j]..starts[j + 1] {
                let (a, b) = (column[j], column[rows[at]]);
                entries[owner[a.min(b)]].push((at, a.max(b), a.min(b)));
            }
        }
        let mut fronts = Self { unknowns: shape.unknowns.to_vec(), ..Self::default() };
        let mut memory = Memory::default();
        for s in 0..count {
            fronts.push(&shape.supernodes[s], &entries[s], &mut memory, &children[s]);
        }
        fronts.rest_len = memory.len;
        for s in 0..count {
            let parent = &fronts.supernodes[s];
            for child in &fronts.children[parent.children.clone()] {
                for at in fronts.supernodes[*child as usize].below.clone() {
                    fronts.in_parent[at] = local(parent, &fronts.below, fronts.below[at] as usize) as u32;
                }
            }
        }
        fronts
    }

    /// Append a supernode whose children are there.
    fn push(
        &mut self,
        (columns, below): &(Range<usize>, Vec<usize>),
        entries: &[(usize, usize, usize)],
        memory: &mut Memory,
        children: &[usize],
    ) {
        let first = self.below.len();
        self.below.extend(below.iter().map(|row| *row as u32));
        self.in_parent.resize(self.below.len(), 0);
        let (first_entry, first_child) = (self.entries.len(), self.children.len());
        self.children.extend(children.iter().map(|c| *c as u32));
        let rows = columns.len() + below.len();
        let mut supernode = Supernode {
            columns: columns.clone(),
            rows,
            panel: self.factor_len,
            rest: 0,
            below: first..self.below.len(),
            entries: first_entry..first_entry,
            children: first_child..self.children.len(),
        };
        supernode.rest = memory.take(supernode.rest_len());
        for (at, row, column) in entries {
            let row = local(&supernode, &self.below, *row);
            let place = in_panel(columns.len(), row, column - columns.start);
            self.entries.push([*at as u32, place as u32]);
        }
        supernode.entries.end = self.entries.len();
        for child in children {
            let child = &self.supernodes[*child];
            memory.give_back(child.rest, child.rest_len());
        }
        self.factor_len += leading(rows) * columns.len();
        self.most_rows = self.most_rows.max(rows);
        self.widest = self.widest.max(leading(rows) * columns.len());
        self.supernodes.push(supernode);
    }

    pub fn stat(&self) {
        let (mut ops, mut flops, mut gather) = (0.0, 0.0, 0.0);
        for s in &self.supernodes {
            let (p, r) = (s.columns.len() as f64, s.rows as f64);
            for k in 0..s.columns.len() { let l = r - k as f64; ops += l * (l + 1.0) / 2.0; }
            gather += s.below.len() as f64 * (s.below.len() as f64 + 1.0) / 2.0;
            flops += p * r;
        }
        println!("supernodes {} ops {:.2}M gather {:.2}M runs {} panel {:.2}M len {:.2}M rest {:.2}M", self.supernodes.len(), ops/1e6, gather/1e6, 0, flops/1e6, self.factor_len as f64/1e6, self.rest_len as f64/1e6);
    }

    /// Numbers in the factor, padding included.
    pub fn factor_len(&self) -> usize {
        self.factor_len
    }

    /// Numbers that wait for a parent, at most.
    pub fn rest_len(&self) -> usize {
        self.rest_len + self.widest
    }

    /// Numbers of work that [`Self::solve`] needs.
    pub fn work_len(&self) -> usize {
        self.unknowns.len() + leading(self.most_rows)
    }

    /// Factorise the matrix with `values`. `rest` holds [`Self::rest_len`] numbers. If a pivot is not
    /// positive, its unknown is the error.
    pub fn factorise(&self, values: &[f64], factor: &mut [f64], rest: &mut [f64]) -> Result<(), usize> {
        factorise(self, values, factor, rest)
    }

    /// Solve in place by `factor`. `work` holds [`Self::work_len`] numbers.
    pub fn solve(&self, factor: &[f64], x: &mut [f64], work: &mut [f64]) {
        let (y, work) = work.split_at_mut(x.len());
        y.iter_mut().zip(&self.unknowns).for_each(|(y, unknown)| *y = x[*unknown]);
        forward(self, factor, y, work);
        backward(self, factor, y, work);
        y.iter().zip(&self.unknowns).for_each(|(y, unknown)| x[*unknown] = *y);
    }
}

/// Numbers from one column to the next of a panel of so many rows.
#[inline(always)]
fn leading(rows: usize) -> usize {
    rows.next_multiple_of(ROWS)
}

/// Place of a number in a panel of so many pivots.
#[inline(always)]
fn in_panel(pivots: usize, row: usize, column: usize) -> usize {
    (row / ROWS * pivots + column) * ROWS + row % ROWS
}

/// Where `row` is in the front of `supernode`.
fn local(supernode: &Supernode, below: &[u32], row: usize) -> usize {
    if supernode.columns.contains(&row) {
        return row - supernode.columns.start;
    }
    let inside = below[supernode.below.clone()].binary_search(&(row as u32));
    supernode.columns.len() + inside.expect("the front of a parent holds the rows of its children")
}

/// Places in memory that is taken and given back, found once: the first gap that is wide enough.
#[derive(Debug, Default)]
struct Memory {
    /// Gaps below `len`, in order.
    gaps: Vec<Range<usize>>,
    len: usize,
}

impl Memory {
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

/// All fronts, one after the other, with the widest registers of this processor.
fn factorise(fronts: &Fronts, values: &[f64], factor: &mut [f64], rest: &mut [f64]) -> Result<(), usize> {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f")]
        fn widest(fronts: &Fronts, values: &[f64], factor: &mut [f64], rest: &mut [f64]) -> Result<(), usize> {
            all_fronts::<Fused<true>>(fronts, values, factor, rest)
        }
        #[target_feature(enable = "avx2,fma")]
        fn wide(fronts: &Fronts, values: &[f64], factor: &mut [f64], rest: &mut [f64]) -> Result<(), usize> {
            all_fronts::<Fused<false>>(fronts, values, factor, rest)
        }
        let which = std::env::var("ISA").unwrap_or_default();
        if std::arch::is_x86_feature_detected!("avx512f") && which.is_empty() {
            // SAFETY: the processor has what the function is compiled for; it was asked a line above.
            return unsafe { widest(fronts, values, factor, rest) };
        }
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") && which != "0" {
            // SAFETY: as above.
            return unsafe { wide(fronts, values, factor, rest) };
        }
    }
    all_fronts::<Apart>(fronts, values, factor, rest)
}

#[inline(always)]
fn all_fronts<A: Arithmetic>(
    fronts: &Fronts,
    values: &[f64],
    factor: &mut [f64],
    memory: &mut [f64],
) -> Result<(), usize> {
    let rest = memory; let mut in_column = vec![0u32; fronts.most_rows];
    let mut T = [0u64; 7]; let mut t0 = tick();
    macro_rules! mark { ($i:literal) => { let t = tick(); T[$i] += t - t0; t0 = t; } }
    for supernode in &fronts.supernodes {
        let (pivots, ld) = (supernode.columns.len(), leading(supernode.rows));
        let children = &fronts.children[supernode.children.clone()];
        let panel = &mut factor[supernode.panel..][..ld * pivots];
        panel.fill(0.0);
        for [from, to] in &fronts.entries[supernode.entries.clone()] {
            panel[*to as usize] = values[*from as usize];
        }
mark!(0);
        for child in children {
            let child = &fronts.supernodes[*child as usize];
            let places = &fronts.in_parent[child.below.clone()];
            let ld_child = child.ld_rest();
            let columns = rest[child.rest..][..child.rest_len()].chunks_exact(ld_child);
            let targets = places.iter().take_while(|place| (**place as usize) < pivots);
            let in_column = &mut in_column[..places.len()];
            in_column.iter_mut().zip(places).for_each(|(to, row)| *to = in_panel(pivots, *row as usize, 0) as u32);
            for (j, (place, column)) in targets.zip(columns).enumerate() {
                let to = &mut panel[*place as usize * ROWS..];
                for (number, row) in column[child.skipped() + j..].iter().zip(&in_column[j..]) {
                    to[*row as usize] += number;
                }
            }
        }
mark!(1);
mark!(2);
        if let Err(column) = eliminate::<A>(panel, pivots) {
            return Err(fronts.unknowns[supernode.columns.start + column]);
        }
mark!(3);
        leave_over::<A>(&mut rest[supernode.rest..][..supernode.rest_len()], panel, pivots, supernode.rows);
mark!(4);
        let (ld, base) = (supernode.ld_rest(), supernode.base());
        for child in children {
            let child = &fronts.supernodes[*child as usize];
            let places = &fronts.in_parent[child.below.clone()];
            // The two lie apart in one memory, in either order.
            let (from, to) = if supernode.rest < child.rest {
                let (low, high) = rest.split_at_mut(child.rest);
                (&high[..], &mut low[supernode.rest..])
            } else {
                let (low, high) = rest.split_at_mut(supernode.rest);
                (&low[child.rest..], high)
            };
            let columns = from[..child.rest_len()].chunks_exact(child.ld_rest());
            let first = places.partition_point(|place| (*place as usize) < pivots);
            for (j, (place, column)) in places.iter().zip(columns).enumerate().skip(first) {
                let to = &mut to[(*place as usize - pivots) * ld..][..ld];
                for (number, row) in column[child.skipped() + j..].iter().zip(&places[j..]) {
                    to[*row as usize - base] += number;
                }
            }
        }
mark!(5);
    }
    unsafe { for i in 0..7 { TT[i] += T[i]; } }
    Ok(())
}
pub static mut TT: [u64;7] = [0;7];
fn tick() -> u64 { unsafe { std::arch::x86_64::_rdtsc() } }

wide! {
    /// `y = L^-1 y`, in the order of elimination.
    fn forward(fronts: &Fronts, factor: &[f64], y: &mut [f64], work: &mut [f64]) {
        for supernode in &fronts.supernodes {
            let (pivots, ld) = (supernode.columns.len(), leading(supernode.rows));
            let panel = factor[supernode.panel..][..ld * pivots].as_chunks::<ROWS>().0;
            let x = &mut y[supernode.columns.clone()];
            for (t, tile) in panel.chunks_exact(pivots).enumerate() {
                let solved = pivots.min(t * ROWS);
                let mut sums = [[0.0; ROWS]; 2];
                for (k, (x, l)) in x[..solved].iter().zip(tile).enumerate() {
                    for r in 0..ROWS {
                        sums[k % 2][r] += x * l[r];
                    }
                }
                let mut sum: [f64; ROWS] = std::array::from_fn(|r| sums[0][r] + sums[1][r]);
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
}

wide! {
    /// `y = L^-T y`, in the order of elimination.
    fn backward(fronts: &Fronts, factor: &[f64], y: &mut [f64], work: &mut [f64]) {
        for supernode in fronts.supernodes.iter().rev() {
            let (pivots, ld) = (supernode.columns.len(), leading(supernode.rows));
            let panel = factor[supernode.panel..][..ld * pivots].as_chunks::<ROWS>().0;
            let work = &mut work[..ld];
            work[..pivots].copy_from_slice(&y[supernode.columns.clone()]);
            for (row, w) in fronts.below[supernode.below.clone()].iter().zip(&mut work[pivots..]) {
                *w = y[*row as usize];
            }
            work[supernode.rows..].fill(0.0);
            for start in (0..pivots).step_by(ROWS).rev() {
                let width = (pivots - start).min(ROWS);
                let own = start / ROWS;
                let mut sums = [[0.0; ROWS]; ROWS];
                for (tile, w) in panel.chunks_exact(pivots).zip(work.as_chunks::<ROWS>().0).skip(own + 1) {
                    for (sum, l) in sums.iter_mut().zip(&tile[start..start + width]) {
                        for r in 0..ROWS {
                            sum[r] += w[r] * l[r];
                        }
                    }
                }
                let tile = &panel[own * pivots..(own + 1) * pivots];
                for k in (0..width).rev() {
                    let l = &tile[start + k];
                    let mut sum = total(&sums[k]);
                    for r in k + 1..ROWS {
                        sum += work[start + r] * l[r];
                    }
                    work[start + k] = (work[start + k] - sum) * l[k];
                }
            }
            y[supernode.columns.clone()].copy_from_slice(&work[..pivots]);
        }
    }
}

#[inline(always)]
fn total(lanes: &[f64; ROWS]) -> f64 {
    let pairs = [lanes[0] + lanes[4], lanes[1] + lanes[5], lanes[2] + lanes[6], lanes[3] + lanes[7]];
    (pairs[0] + pairs[2]) + (pairs[1] + pairs[3])
}

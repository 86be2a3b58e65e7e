//! Memory that is shared out once: what fronts leave to their parents takes turns in it.

use std::ops::Range;

/// Places in memory that is taken and given back, found once: the first gap that is wide enough.
#[derive(Debug, Default)]
pub struct FreeMemory {
    /// Gaps below `len`, in order.
    gaps: Vec<Range<usize>>,
    /// Numbers in all, at most.
    pub len: usize,
}

impl FreeMemory {
    /// A place for `len` numbers.
    pub fn take(&mut self, len: usize) -> usize {
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
    pub fn give_back(&mut self, place: usize, len: usize) {
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

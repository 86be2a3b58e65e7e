//! Which lines of the interface mesh are broken.

use crate::internal_force::assembly::Event;
use crate::model::Model;
use interface_defs::selection::Selection;
use std::ops::Range;

/// The lines of each element, and where an answer speaks of them.
pub(super) struct BrokenLines {
    /// Lines of each element in the interface mesh, where those of the fast kernel come first.
    of_elements: Vec<Range<usize>>,
    /// Place of each line of the mesh in the field, [`Selection::OUT`] where it is not selected.
    place: Vec<u32>,
}

impl BrokenLines {
    /// Of all lines of `model`.
    pub(super) fn new(model: &Model) -> Self {
        let mut next = model.cables.len();
        let lines = model.elements.iter().map(|element| {
            let first = next;
            next += element.line_count();
            first..next
        });
        let of_elements = lines.collect();
        Self { of_elements, place: (0..next as u32).collect() }
    }

    /// Speak of the selected lines alone, or of all.
    pub(super) fn select(&mut self, selection: Option<&Selection>) {
        let Some(selection) = selection else {
            return self.place.iter_mut().enumerate().for_each(|(line, place)| *place = line as u32);
        };
        self.place.fill(Selection::OUT);
        for (place, line) in selection.lines.iter().enumerate() {
            self.place[*line as usize] = place as u32;
        }
    }

    /// Write 1 for each line that broke in `events`, else 0.
    pub(super) fn write<'a>(&self, events: impl Iterator<Item = &'a Event>, flags: &mut [f64]) {
        flags.fill(0.0);
        for line in events.flat_map(|event| self.of_elements[event.element as usize].clone()) {
            if let Some(flag) = flags.get_mut(self.place[line] as usize) {
                *flag = 1.0;
            }
        }
    }
}

//! What broke, and what is remembered of it.

use crate::element::AnyElement;
use serde::{Deserialize, Serialize};

/// Something that broke.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When it broke; with implicit steps the end of the step in which it did [s].
    pub time: f64,
    /// Number of the element.
    pub element: u32,
    /// Largest axial force it carried then [N].
    pub tension: f64,
}

/// An element that broke in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Broken {
    /// Number of the element.
    pub element: u32,
    /// Largest axial force it carried then [N].
    pub tension: f64,
    /// At which part of the step.
    pub part: f64,
    /// Share of its strength that it used then, 1 or more.
    pub share: f64,
}

impl Broken {
    /// As an event of the step from `time` [s] that is `length` [s] long.
    pub fn event(&self, time: f64, length: f64) -> Event {
        Event { time: time + self.part * length, element: self.element, tension: self.tension }
    }
}

/// The work of an element that broke in the last step is `f . (u_1 - u_0)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Release {
    pub(super) element: usize,
    /// Where its force begins in the memory.
    pub(super) first: usize,
    /// Its energy at the step's start, less `f . u_0` [J].
    pub(super) before: f64,
}

/// An element, and the displacements of all at a step's start and in its middle.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub(super) number: usize,
    pub(super) element: &'a AnyElement,
    pub(super) start: &'a [f64],
    pub(super) middle: &'a [f64],
}

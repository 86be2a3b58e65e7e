//! Elements: each answers with energy, force and tangent at given displacements.
//!
//! Displacements count from the structure as it is modelled. With `W` the energy, the internal
//! force is `f = dW/du` and the tangent `K = df/du`; the tests of each file differentiate one to
//! find the other. What many cables do at once, and fast, is in [`crate::internal_force::kernel`]; all others go
//! through [`Element`].
//!
//! To add one: a file here with the element (`impl Element`) and what a scene states of it (`part!`, `impl PartSettings`); its
//! `mod` line, and its lines in `elements!` at the end of this file. What is forgotten does not compile.

pub mod bar;
pub mod beam;
pub mod cable;
mod capstan;
pub mod fibres;
pub mod ground_contact;
pub mod material;
pub mod membrane;
pub mod part;
pub mod ring;
pub mod rope;
pub mod section;
pub mod segment;
pub mod shell;
pub mod sliding_cable;
pub mod support_spring;
#[cfg(test)]
pub(crate) mod tests;
pub mod turn;

pub use bar::Bar;
pub use beam::Beam;
pub use cable::Cable;
pub use ground_contact::GroundContact;
pub use membrane::{Membrane, MembraneQuad};
pub use ring::Ring;
pub use shell::Shell;
pub use sliding_cable::SlidingCable;
pub use support_spring::SupportSpring;

use interface_defs::ShareOf;
use part::PartSettings;
use ring::{mechanisms, wire};
use std::fmt::Debug;
use std::ops::Deref;

/// Shares of its strength: from the first to below the second, an element is near breaking, and steps must resolve how its force
/// swings.
pub const NEAR: f64 = 0.75;
/// See [`NEAR`].
pub const FAR: f64 = 0.65;
/// From this share on small differences decide whether it breaks: forces are hardly better known.
pub const CLOSE: f64 = 0.99;

/// The answer of an element, written into memory of the caller. Everything is overwritten.
///
/// Local degrees of freedom are node-major: x, y, z of the first node (and, where the element rotates,
/// its rotations), then those of the next.
#[derive(Debug)]
pub struct Answer<'a> {
    /// Internal force on each local degree of freedom [N, N m].
    pub force: &'a mut [f64],
    /// Its derivative, square, by rows [N/m, N, N m]. Need not be symmetric; the solver takes its
    /// symmetric part.
    pub tangent: Option<&'a mut [f64]>,
    /// Stiffness of slack parts in the tangent.
    pub slack: Slack,
    /// History after these displacements.
    pub history: &'a mut [f64],
    /// Largest axial force [N].
    pub tension: f64,
}

/// Stiffness of slack parts in the tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Slack {
    /// Nothing: the exact tangent, for dynamics, where the masses hold the node.
    Exact,
    /// This share of its axial stiffness in every direction, for statics. Only the tangent knows of
    /// it, so it alters the path of the iteration and not where it ends.
    Regularised(f64),
    /// Its axial stiffness as if it were just taut: an upper bound, for the critical step.
    Taut,
}

/// Time between a history and the displacements asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pace {
    /// 1 over the time between [1/s]; 0 in statics, where nothing has a speed.
    pub rate: f64,
    /// Whether the work of a step is that of the mean of two forces, at the history and at hand: so it is where forces balance at the
    /// ends of steps, and with explicit steps, whose histories are of their middles. Otherwise it is that of the force at hand.
    pub by_ends: bool,
}

/// Energies of an element [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// Stored, 0 as modelled.
    pub stored: f64,
    /// Dissipated by plastic flow, friction and rupture.
    pub dissipated: f64,
}

/// Tangent of a piece of an element: of the places of two nodes, and of two slips.
pub type Piece = [[f64; 8]; 8];

/// Constants of an element.
#[derive(Debug, Clone, Copy, Default)]
pub struct Constants {
    /// Whether its nodes have rotations: 6 degrees of freedom each in place of 3.
    pub rotates: bool,
    /// Whether it can break at all.
    pub can_break: bool,
    /// Index of the number in its history that is above 0 once it is broken.
    pub broken: Option<usize>,
    /// Whether it is a beam, which [`Element::moments`] are of.
    pub has_moments: bool,
    /// Index of its largest plastic strain in its history, above 0 once it yields.
    pub plastic: Option<usize>,
    /// Whether its tangent comes in pieces ([`Element::pieces`]) as well: as a whole it couples each of its nodes with each.
    pub in_pieces: bool,
    /// Number of its lines.
    pub lines: usize,
    /// Number of different axial forces in them, those of its first lines: 1 where all carry the same.
    pub forces: usize,
    /// Radius of its lines that a contact sees [m].
    pub radius: f64,
    /// Section of its lines [m2], which turns their forces into stresses; 0 where it has none.
    pub section: f64,
    /// Thickness of its faces [m]; 0 where it has none.
    pub thickness: f64,
}

/// A force on part of a structure.
///
/// An element is a function of displacements and of its committed history (with a dashpot, of the time between, too): whatever it
/// remembers (plastic strain, slip, reference rotation, rupture) lies in the history, and nothing in itself.
pub trait Element: Debug {
    /// Its nodes.
    fn nodes(&self) -> &[usize];

    /// Its constants.
    fn constants(&self) -> Constants {
        Constants::default()
    }

    /// History as modelled.
    fn start_history(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Force, tangent and new history at the local displacements `u` [m, rad], which come after `history` as `pace` says: what has a
    /// dashpot answers with its force as well.
    fn respond(&self, pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        answer.force.fill(0.0);
        answer.history.copy_from_slice(history);
        answer.tension = 0.0;
        if let Some(k) = &mut answer.tangent {
            k.fill(0.0);
        }
        self.add_to(pace, u, history, answer);
    }

    /// The same as [`Element::respond`], added to an answer of no force and an unchanged history.
    fn add_to(&self, pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer);

    /// Call `take` with the symmetric tangent of each piece between one node and the next at `u`, from `history`: over the places of
    /// the two, and over what has slipped past the first and past the second [m], in the way from the first to the last node. Nothing slips
    /// past the ends of the whole. With all slips eliminated, their sum is the tangent as a whole.
    fn pieces(&self, _u: &[f64], _history: &[f64], _slack: Slack, _take: &mut dyn FnMut(&Piece)) {}

    /// Energies at `u`, from `history`.
    fn energy(&self, u: &[f64], history: &[f64]) -> Energy;

    /// An upper bound of the share of its strength that it uses at `u`, from `history`, for less than a whole answer; infinite
    /// where there is none.
    fn utilisation_bound(&self, _u: &[f64], _history: &[f64]) -> f64 {
        f64::INFINITY
    }

    /// Called when a step is done and `history` is that at its end `u`: whether the element breaks now. If
    /// so it has written into `history` that it is broken.
    fn breaks(&self, _u: &[f64], _history: &mut [f64]) -> bool {
        false
    }

    /// Add its lumped mass to that of each of its nodes [kg], and its rotary inertia [kg m2].
    fn lump(&self, mass: &mut [f64], inertia: &mut [f64]);

    /// Lines that a contact sees, and that field files show: from node to node, and back to the first.
    fn lines(&self) -> Vec<[usize; 2]> {
        let nodes = self.nodes();
        (0..self.constants().lines).map(|i| [nodes[i], nodes[(i + 1) % nodes.len()]]).collect()
    }

    /// Faces that a contact sees: the triangles of [`Element::face_cell`] from its first node.
    fn faces(&self) -> Vec<[usize; 3]> {
        let Some((first, others)) = self.face_cell().split_first() else { return Vec::new() };
        others.windows(2).map(|pair| [*first, pair[0], pair[1]]).collect()
    }

    /// Nodes of the cell that field files show of its faces, around; none where it has no faces.
    fn face_cell(&self) -> &[usize] {
        &[]
    }

    /// Whether its history says that it is broken.
    fn is_broken(&self, history: &[f64]) -> bool {
        self.constants().broken.is_some_and(|at| history[at] > 0.0)
    }

    /// Axial force of each of its lines [N]; `NaN` where broken.
    fn line_forces(&self, _u: &[f64], _history: &[f64], _forces: &mut [f64]) {}

    /// Share of its strength that the axial force `force` [N] of a line and its strain use; 0 where it cannot break.
    fn force_utilisation(&self, _u: &[f64], _force: f64) -> f64 {
        0.0
    }

    /// The same of what else it has that comes to an end, such as a stroke, where `history` says how far it went.
    fn utilisation(&self, u: &[f64], force: f64, _history: &[f64]) -> (f64, ShareOf) {
        (self.force_utilisation(u, force), ShareOf::Force)
    }

    /// Share of the strain at which its fibres tear; 0 where they do not.
    fn strain_utilisation(&self, _u: &[f64], _history: &[f64]) -> f64 {
        0.0
    }

    /// Share of the axial force and the moments at which its section is wholly plastic that it bears at the more loaded of its ends, added
    /// up (EN 1993-1-1, 6.2.1 (7)); 0 where it does not yield, or is broken.
    fn plastic_utilisation(&self, _u: &[f64], _history: &[f64]) -> f64 {
        0.0
    }

    /// Share of its strength that the most loaded of its lines uses at `u`; 1 where it is broken. Its axial forces come to `forces` [N].
    fn largest_utilisation(&self, u: &[f64], history: &[f64], forces: &mut [f64]) -> f64 {
        self.line_forces(u, history, forces);
        let of_line = |force: &f64| if force.is_nan() { 1.0 } else { self.force_utilisation(u, *force) };
        let section = self.plastic_utilisation(u, history).max(self.strain_utilisation(u, history));
        forces.iter().map(of_line).fold(section, f64::max)
    }

    /// Moments in it [N m]; 0 where it is broken or no beam. Bending in the plane of each cross axis, at start and end: positive
    /// where it bends the beam towards the axis. Torsion, the same all along: positive where the end is turned right-handed about
    /// the way from the start.
    fn moments(&self, _u: &[f64], _history: &[f64]) -> [f64; 5] {
        [0.0; 5]
    }

    /// Principal stresses of its faces [Pa], the larger first.
    fn face_stresses(&self, _u: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }

    /// Principal bending moments of its faces, per width [N m/m], the larger first: positive where they stretch the side
    /// from which the nodes are seen to run counter-clockwise. 0 where they bear none.
    fn face_moments(&self, _u: &[f64], _history: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }

    /// Elongation against the structure as modelled [m]; 0 where it has none.
    fn elongation(&self, _u: &[f64]) -> f64 {
        0.0
    }

    /// Size of the terms whose differences its forces are [N], where that is more than stiffness times displacement:
    /// what its rounding is relative to. 0 where strains follow from displacements alone.
    fn coarseness(&self) -> f64 {
        0.0
    }

    /// The same without friction, where it has any: what form finding computes where it finds no form with it.
    fn frictionless(&self) -> Option<AnyElement> {
        None
    }

    /// The part of `history` that it has without friction, too.
    fn frictionless_history<'a>(&self, history: &'a [f64]) -> &'a [f64] {
        history
    }

    /// History where it hangs at `u` as it would without friction, with the history `frictionless` there.
    fn relaxed_history(&self, _u: &[f64], frictionless: &[f64]) -> Vec<f64> {
        frictionless.to_vec()
    }

    /// The same with a force that goes to zero gradually, over a range of forces [N], where it has a corner at which it goes
    /// slack: for a search for a rest shape.
    fn regularised(&self, _range: f64) -> Option<AnyElement> {
        None
    }
}

/// Declares what parts of a scene may name, with the settings of each, and the elements that these become.
///
/// Two enums: [`PartConfig`] over the settings, which is a [`PartSettings`] by reference, and [`AnyElement`] over the elements,
/// which is an [`Element`] by reference.
macro_rules! elements {
    (parts { $($name:literal => $settings:ident::$part:ident,)* } elements { $($module:ident::$element:ident,)* }) => {
        toolkit::tagged! {
            /// A part; `element` says of what.
            #[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema)]
            #[allow(missing_docs)] // What a part is, its settings' own doc comment says, in the schema too.
            pub enum PartConfig by "element" () {
                $(
                    #[serde(rename = $name)]
                    $part($settings::$part),
                )*
            }
        }

        impl Deref for PartConfig {
            type Target = dyn PartSettings;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$part(settings) => settings,)*
                }
            }
        }

        /// Any element that goes through [`Element`].
        #[derive(Debug, Clone)]
        #[allow(missing_docs)] // Each is what its own doc comment says.
        pub enum AnyElement {
            $($element($module::$element),)*
        }

        impl Deref for AnyElement {
            type Target = dyn Element;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$element(element) => element,)*
                }
            }
        }

        $(impl From<$module::$element> for AnyElement {
            fn from(element: $module::$element) -> Self {
                Self::$element(element)
            }
        })*
    };
}

elements! {
    parts {
        "cable" => bar::CablePart,
        "sliding_cable" => sliding_cable::SlidingCablePart,
        "brake" => bar::BrakePart,
        "beam" => beam::BeamPart,
        "ring" => mechanisms::RingPart,
        "wire_ring" => wire::WireRingPart,
        "membrane" => membrane::MembranePart,
        "shell" => shell::ShellPart,
        "none" => part::NoPart,
    }
    elements {
        bar::Bar,
        sliding_cable::SlidingCable,
        beam::Beam,
        ring::Ring,
        membrane::Membrane,
        membrane::MembraneQuad,
        shell::Shell,
        ground_contact::GroundContact,
        support_spring::SupportSpring,
    }
}

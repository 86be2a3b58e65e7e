//! How rocks are advanced over a window.
//!
//! - [`window`]: the steps of a window, as [`schedule`] cuts it; [`step`]: one step of all rocks
//! - `exchange`: where its request and answer hold what, of which nodes
//! - contacts in a step, partner by partner: [`mesh_stage`], [`terrain_stage`], [`rock_stage`], [`box_stage`]
//! - where nothing is touched: [`closed_form`] (flight without steps)
//! - [`sub_stepping`]: the step while a rock touches terrain; [`secondary_impacts`]: how far a rock may be thrown in a window

pub mod box_stage;
pub mod closed_form;
mod exchange;
pub mod mesh_stage;
pub mod rock_stage;
pub mod schedule;
pub mod secondary_impacts;
pub mod step;
pub mod sub_stepping;
pub mod terrain_stage;
pub mod window;

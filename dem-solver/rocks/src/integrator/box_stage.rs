//! The contacts of rocks with the sides of a box in a step, and free time between.

use crate::guard::cause::Case;
use crate::guard::{watch, watch_whole};
use crate::model::state::{Against, Body, State};
use crate::model::{Model, Span};
use dem_contact::contact::broad_phase::cell_grid::Plane;
use dem_contact::contact::history::SurfaceHistory;
use dem_contact::contact::pipeline::Sums;
use dem_contact::contact::terrain::SurfaceContacts;
use dem_contact::contact::whole_rock::Whole;
use dem_contact::contact::whole_rock::terrain::WholeRockContacts;
use dem_contact::law::table::SurfaceLaws;
use dem_contact::law::yielding::PlasticIndentation;
use dem_contact::rock::Motion;
use dem_terrain::queries::arrival;
use interface_defs::Fault;

/// Share of the reach by which the bounding sphere is larger than the rock, for rounding.
const ROUNDING: f64 = 1e-9;

/// The contacts of all rocks with the sides of a box, one rock after the other.
#[derive(Debug, Clone, Default)]
pub struct BoxStage {
    standing: SurfaceContacts,
    /// Of rocks that touch a side as a whole, with one side after the other.
    landed: WholeRockContacts,
    /// Their histories after the step, by side.
    after: Vec<SurfaceHistory>,
}

/// The law of a rock with the sides.
fn laws_with(model: &Model, rock: usize) -> Option<SurfaceLaws<'_>> {
    Some(SurfaceLaws { laws: model.surfaces(), row: model.side_rows.get(rock)?, materials: &[] })
}

/// Distance of the bounding sphere of rock number `rock` from a plane [m].
fn gap(model: &Model, rock: usize, plane: &Plane, now: &Motion) -> f64 {
    let reach = model.trees[rock].reach;
    plane.offset - plane.normal.dot(&now.position) - reach * (1.0 + ROUNDING)
}

/// True if rock number `rock` is so near a side that it may be reached within `further` [m].
pub fn is_near(model: &Model, rock: usize, now: &Motion, further: f64) -> bool {
    model.planes.iter().any(|plane| gap(model, rock, plane, now) < further)
}

/// Time in which no rock that flies freely can touch a side [s].
pub fn free_time(model: &Model, state: &State) -> f64 {
    let gravity = &model.settings.gravity;
    let mut least = f64::INFINITY;
    for (rock, body) in state.bodies.iter().enumerate() {
        for plane in &model.planes {
            let now = &body.motion;
            let gap = gap(model, rock, plane, now);
            let (speed, pull) = (plane.normal.dot(&now.velocity), plane.normal.dot(gravity));
            if gap <= 0.0 {
                return 0.0;
            }
            if speed > 0.0 || pull > 0.0 {
                // Not a number where it turns back before: then `min` keeps what is known.
                least = least.min(arrival(gap, speed, pull));
            }
        }
    }
    least
}

impl BoxStage {
    /// With room for the contacts of any one rock.
    pub fn new(model: &Model) -> Self {
        let most = model.rocks.iter().map(|rock| rock.spheres.len()).max().unwrap_or(0);
        let whole = if model.side_wholes.iter().any(Option::is_some) { most } else { 0 };
        let after = Vec::with_capacity(3 * whole);
        Self { standing: SurfaceContacts::new(3 * most), landed: WholeRockContacts::new(whole), after }
    }

    /// Contacts of a rock for which there is room.
    pub fn most_contacts(&self) -> usize {
        self.standing.contacts.capacity()
    }

    /// Forces on rock number `rock` at `now`, in the middle of a step. The histories after the step are `body`'s.
    pub fn forces(
        &mut self,
        model: &Model,
        rock: usize,
        body: &mut Body,
        now: &Motion,
        span: Span,
    ) -> Result<Sums, Fault> {
        let Some(laws) = laws_with(model, rock).filter(|_| is_near(model, rock, now, 0.0)) else {
            body.box_histories.clear();
            return Ok(Sums::default());
        };
        if let Some(whole) = &model.side_wholes[rock] {
            return self.forces_as_whole((model, rock, whole), laws, body, now, span);
        }
        let (it, standing) = (&model.rocks[rock], &mut self.standing);
        standing.find_on_planes(it, &model.planes, now);
        let sums = standing.forces(it, laws, None, now, span.h, &body.box_histories);
        watch(&Case::new(model, rock, Against::Sides, span), now, &sums, |depth| {
            Some((standing.passed_centre(it, now, span.h, depth)?, "a side of the box".into()))
        })?;
        std::mem::swap(&mut body.box_histories, &mut standing.histories);
        Ok(sums)
    }

    /// The same of a rock that touches each side as a whole.
    fn forces_as_whole(
        &mut self,
        (model, rock, whole): (&Model, usize, &Whole),
        laws: SurfaceLaws,
        body: &mut Body,
        now: &Motion,
        span: Span,
    ) -> Result<Sums, Fault> {
        let (it, landed) = (&model.rocks[rock], &mut self.landed);
        let mut sums = Sums::default();
        let mut before = &body.box_histories[..];
        self.after.clear();
        for (number, plane) in (0..).zip(&model.planes) {
            let (own, others) = before.split_at(before.iter().take_while(|m| m.element == number).count());
            before = others;
            if gap(model, rock, plane, now) >= 0.0 {
                continue;
            }
            landed.find_on_plane(it, whole, (number, plane), now);
            sums.add_all(&landed.forces(
                it,
                whole,
                laws,
                now,
                span.h,
                (own, &mut PlasticIndentation::default()),
            ));
            self.after.extend_from_slice(&landed.histories);
        }
        watch_whole(&Case::new(model, rock, Against::Sides, span), whole, now, &sums)?;
        std::mem::swap(&mut body.box_histories, &mut self.after);
        Ok(sums)
    }

    /// Elastic energy [J] and number of contacts of rock number `rock` at `now`.
    pub fn energy(&mut self, model: &Model, rock: usize, now: &Motion) -> (f64, usize) {
        let Some(laws) = laws_with(model, rock).filter(|_| is_near(model, rock, now, 0.0)) else {
            return (0.0, 0);
        };
        if let Some(whole) = &model.side_wholes[rock] {
            let landed = &mut self.landed;
            return (0..).zip(&model.planes).fold((0.0, 0), |(energy, count), plane| {
                landed.find_on_plane(&model.rocks[rock], whole, plane, now);
                let own = landed.energy(whole, laws, &PlasticIndentation::default());
                (energy + own, count + landed.contacts.len())
            });
        }
        self.standing.find_on_planes(&model.rocks[rock], &model.planes, now);
        (self.standing.energy(laws), self.standing.contacts.len())
    }
}

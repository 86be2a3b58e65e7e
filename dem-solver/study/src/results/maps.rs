//! The maps: per cell how many rocks passed or stopped there, and quantiles of how fast, how strong, how high.

use super::All;
use super::picture::{self, Map, Scale};
use super::raster::{self, System};
use crate::base::Base;
use crate::grid::Grid;
use crate::record::How;
use crate::summary::quantile;
use std::io;
use std::path::Path;
use toolkit::summary::RunStatus;

/// The quantities of a visit, in its order: name of the file, and what the picture says.
const QUANTITIES: [(&str, &str); 4] = [
    ("speed", "speed [m/s]"),
    ("kinetic_energy", "kinetic energy [J]"),
    ("rotation_energy", "energy of rotation [J]"),
    ("jump_height", "jump height of the lowest point [m]"),
];

/// Shares of which there are maps [%]: those that a design asks for.
const SHARES: [u32; 4] = [50, 90, 95, 99];

/// Where few rocks pass, a high quantile is between the two largest of them.
fn note(share: u32) -> Option<String> {
    let few = 100 / (100 - share) + 1;
    (share >= 90).then(|| format!("where up to {few} rocks pass (see count): between the two largest"))
}

/// Write all maps of a study.
pub fn write(base: &Base, grid: &Grid, system: &System, dir: &Path, all: All) -> io::Result<()> {
    let (mut count, mut ends, mut computed) = (vec![0_u32; grid.len()], vec![0_u32; grid.len()], 0_u64);
    all(&mut |record| {
        if record.outcome.status == RunStatus::Failed {
            return Ok(());
        }
        computed += 1;
        record.track.visits.iter().for_each(|visit| count[visit.cell as usize] += 1);
        let [x, y, _] = record.outcome.end;
        let place = base.local(&[x, y]);
        if let Some(cell) = grid.at(place).filter(|_| record.outcome.how == How::Rest) {
            ends[cell as usize] += 1;
        }
        Ok(())
    })?;
    let picture = picture::Sheet::new(base, grid, computed);
    let put = |name: &str, title: String, note, scale, values: &[f32]| {
        raster::write(&dir.join(format!("{name}.tif")), base, grid, system, values)?;
        picture.write(&dir.join(format!("{name}.svg")), &Map { title, note, scale, values })
    };
    let known = |of: &dyn Fn(usize) -> f32| -> Vec<f32> {
        (0..grid.len()).map(|cell| if count[cell] > 0 { of(cell) } else { f32::NAN }).collect()
    };
    let passing = known(&|cell| count[cell] as f32);
    put("count", "number of rocks passing".into(), None, Scale::Log, &passing)?;
    let shares = known(&|cell| (f64::from(count[cell]) / computed.max(1) as f64) as f32);
    put("share", "share of rocks passing".into(), None, Scale::Log, &shares)?;
    let stopped: Vec<f32> = ends.iter().map(|n| if *n > 0 { *n as f32 } else { f32::NAN }).collect();
    put("deposition", "number of rocks at rest".into(), None, Scale::Linear, &stopped)?;
    // Where the values of each cell begin in one long row.
    let mut starts = vec![0_usize];
    count.iter().for_each(|n| starts.push(starts[starts.len() - 1] + *n as usize));
    for (number, (name, title)) in QUANTITIES.into_iter().enumerate() {
        let mut values = vec![0.0_f32; starts[grid.len()]];
        let mut next = starts.clone();
        all(&mut |record| {
            if record.outcome.status == RunStatus::Failed {
                return Ok(());
            }
            for visit in &record.track.visits {
                let place = &mut next[visit.cell as usize];
                values[*place] = visit.values[number];
                *place += 1;
            }
            Ok(())
        })?;
        let mut maps = vec![vec![f32::NAN; grid.len()]; SHARES.len()];
        let mut sorted = Vec::new();
        for cell in (0..grid.len()).filter(|cell| count[*cell] > 0) {
            sorted.clear();
            sorted.extend(values[starts[cell]..starts[cell + 1]].iter().map(|v| f64::from(*v)));
            sorted.sort_by(f64::total_cmp);
            for (map, share) in maps.iter_mut().zip(SHARES) {
                map[cell] = quantile(&sorted, f64::from(share) / 100.0) as f32;
            }
        }
        for (map, share) in maps.iter().zip(SHARES) {
            let title = format!("{share} % quantile of the {title}");
            put(&format!("{name}_q{share}"), title, note(share), Scale::Linear, map)?;
        }
    }
    Ok(())
}

//! Curves over time, from the columns of `history.csv` and `trajectory.csv`.

use crate::report::table::Table;
use base64::Engine as _;
use serde_json::{Value, json};
use toolkit::summary::Summary;

/// Most rows of a curve: of more, the least and the largest value of some that follow each other stand for them.
const ROWS: usize = 3000;

/// A chart: title, unit, curves by name.
struct Chart {
    title: String,
    unit: &'static str,
    curves: Vec<(String, Vec<f64>)>,
}

/// What is drawn of columns by the ends of their names: title, unit, factor to it.
const BY_END: [(&str, &str, &str, f64); 8] = [
    ("_m", "Displacements, elongations and heights of gauges", "m", 1.0),
    ("_m_per_s", "Velocities of gauges", "m/s", 1.0),
    ("_N", "Forces of gauges; of a group that of the most loaded member", "kN", 1e-3),
    ("_Nm", "Bending moment", "kN m", 1e-3),
    ("_J", "Energy", "kJ", 1e-3),
    ("utilisation", "Utilisation", "1", 1.0),
    ("utilisation_max", "Utilisation", "1", 1.0),
    ("iterations", "Coupling iterations of a window", "1", 1.0),
];

/// All charts of a run, as its page takes them.
pub fn charts(history: &Table, trajectory: &Table, summary: &Summary) -> Vec<Value> {
    let mut charts: Vec<Chart> = Vec::new();
    let mut add = |title: &str, unit: &'static str, name: &str, values: Vec<f64>| match charts
        .iter_mut()
        .find(|chart| chart.title == title)
    {
        Some(chart) => chart.curves.push((name.into(), values)),
        None => charts.push(Chart { title: title.into(), unit, curves: vec![(name.into(), values)] }),
    };
    let rocks: Vec<&str> = history.rocks().collect();
    for rock in &rocks {
        if let Some(travel) = travel(history, rock, rocks.len() > 1, summary) {
            add("Travel along the impact direction, from the first touch", "m", rock, travel);
        }
        if let Some(velocity) = history.vector(rock, ["_vx_m_per_s", "_vy_m_per_s", "_vz_m_per_s"]) {
            add("Speed", "m/s", rock, velocity.iter().map(length).collect());
        }
    }
    let sums =
        [("contact_force", "Force of the rocks on the structure"), ("reaction", "Reaction of all supports")];
    for (name, title) in sums {
        if let Some(force) = history.vector(name, ["_x_N", "_y_N", "_z_N"]) {
            add(title, "kN", "magnitude", force.iter().map(|of| 1e-3 * length(of)).collect());
        }
    }
    let peak = |column: &[f64]| column.iter().map(|value| value.abs()).fold(0.0, f64::max);
    let peak_of = |name: String| peak(history.column(&name));
    let is_drawn = |name: &str, column: &[f64]| {
        // Of the least and the most loaded member of a group, that whose load is larger.
        let least = name.contains("_min") && peak(column) <= peak_of(name.replace("_min", "_max"));
        let most = name.contains("_max") && peak(column) < peak_of(name.replace("_max", "_min"));
        let of_rock = rocks.iter().any(|rock| name.starts_with(&format!("{rock}_")));
        let of_sum = sums.iter().any(|(sum, _)| name.starts_with(&format!("{sum}_")));
        !(least || most || of_rock || of_sum || name.ends_with("_defect_J"))
    };
    for (name, column) in history.columns().filter(|(name, column)| is_drawn(name, column)) {
        let Some((end, title, unit, factor)) = BY_END.iter().find(|(end, ..)| name.ends_with(end)) else {
            continue;
        };
        let label =
            name.strip_suffix(end).filter(|_| *unit != "1").unwrap_or(name).trim_start_matches("energy_");
        let label = label.replace("_dem", " of rocks").replace("_fem", " of the structure").replace('_', " ");
        add(title, unit, &label, column.iter().map(|value| factor * value).collect());
    }
    let time = history.column("time_s");
    let mut all: Vec<Value> = charts.iter().map(|chart| packed(time, chart)).collect();
    // Each rock has times of its own there.
    for (number, rock) in rocks.iter().enumerate() {
        let own = trajectory.only("rock", number as f64);
        if own.rows() < 2 {
            continue;
        }
        let title = format!("Height of {rock} above the ground");
        let height = own.column("jump_height_m").to_vec();
        all.push(packed(
            own.column("time_s"),
            &Chart { title, unit: "m", curves: vec![("lowest point".into(), height)] },
        ));
    }
    all
}

fn length(of: &[f64; 3]) -> f64 {
    of.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// Travel of a rock's centre from its first touch along its impact direction [m]; `None`: it touched no net.
fn travel(history: &Table, rock: &str, several: bool, summary: &Summary) -> Option<Vec<f64>> {
    let measure = |name: &str| summary.measure(&if several { format!("{rock}_{name}") } else { name.into() });
    let (x, y, z) =
        (measure("impact_direction_x")?, measure("impact_direction_y")?, measure("impact_direction_z")?);
    let (touch, time) = (measure("time_of_impact")?, history.column("time_s"));
    let places = history.vector(rock, ["_x_m", "_y_m", "_z_m"])?;
    let along: Vec<f64> = places.iter().map(|place| x * place[0] + y * place[1] + z * place[2]).collect();
    // A row stands at each first touch.
    let first = along.get(time.iter().position(|time| *time >= touch)?)?;
    Some(along.iter().map(|value| value - first).collect())
}

/// For the page: single precision is a ten-thousandth of a millimetre in a metre.
fn packed(time: &[f64], chart: &Chart) -> Value {
    // Rows that stand for those from each to the next, of a curve with its least and its largest value.
    let step = (2 * time.len()).div_ceil(ROWS).max(1);
    let thin = time.len() > ROWS;
    let of_time = |chunk: &[f64]| [chunk[0], chunk[chunk.len() / 2]];
    let extremes = |chunk: &[f64]| {
        let least = (0..chunk.len()).min_by(|a, b| chunk[*a].total_cmp(&chunk[*b])).unwrap_or(0);
        let most = (0..chunk.len()).max_by(|a, b| chunk[*a].total_cmp(&chunk[*b])).unwrap_or(0);
        [chunk[least.min(most)], chunk[least.max(most)]]
    };
    let pack = |values: &[f64], of: &dyn Fn(&[f64]) -> [f64; 2]| {
        if thin { floats(values.chunks(step).flat_map(of)) } else { floats(values.iter().copied()) }
    };
    let curves =
        chart.curves.iter().map(|(name, values)| json!({ "name": name, "values": pack(values, &extremes) }));
    json!({
        "title": chart.title, "unit": chart.unit, "rows": time.len(), "times": pack(time, &of_time),
        "curves": curves.collect::<Vec<_>>(),
    })
}

/// Numbers of single precision, as the page reads them.
pub fn floats(values: impl Iterator<Item = f64>) -> String {
    bytes(values.flat_map(|value| (value as f32).to_le_bytes()))
}

/// Bytes, as the page reads them.
pub fn bytes(bytes: impl Iterator<Item = u8>) -> String {
    base64::engine::general_purpose::STANDARD.encode(bytes.collect::<Vec<u8>>())
}

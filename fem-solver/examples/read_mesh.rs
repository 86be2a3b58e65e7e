//! How long a mesh of a million nodes takes to read, in each format, and how that grows.
//!
//! `cargo run --release -p fem-solver --example read_mesh [NODES]`

use fem_solver::read::{Format, parse};
use std::fmt::Write;
use std::time::Instant;

/// The net of `n` x `n` nodes as text: all nodes, all lines, one group of each.
fn text(format: Format, old: bool, n: usize) -> String {
    let mut out = String::new();
    let lines = 2 * n * (n - 1);
    let number = |i: usize, j: usize| j * n + i + 1;
    let point = |k: usize| (0.15 * (k % n) as f64, 0.15 * (k / n) as f64, 1e-3 * (k % 7) as f64);
    let ends = (0..n).flat_map(|j| (0..n - 1).map(move |i| (number(i, j), number(i + 1, j))));
    let ends = ends.chain((0..n - 1).flat_map(|j| (0..n).map(move |i| (number(i, j), number(i, j + 1)))));
    let mut line = |text: std::fmt::Arguments| writeln!(out, "{text}").expect("text grows");
    match (format, old) {
        (Format::Msh, true) => {
            line(format_args!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"net\"\n$EndPhysicalNames"
            ));
            line(format_args!("$Nodes\n{}", n * n));
            (0..n * n)
                .for_each(|k| line(format_args!("{} {} {} {}", k + 1, point(k).0, point(k).1, point(k).2)));
            line(format_args!("$EndNodes\n$Elements\n{lines}"));
            ends.enumerate().for_each(|(e, (a, b))| line(format_args!("{} 1 2 1 1 {a} {b}", e + 1)));
            line(format_args!("$EndElements"));
        }
        (Format::Msh, false) => {
            line(format_args!(
                "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"net\"\n$EndPhysicalNames"
            ));
            line(format_args!("$Entities\n0 1 0 0\n1 0 0 0 1 1 0 1 1 0\n$EndEntities"));
            line(format_args!("$Nodes\n1 {0} 1 {0}\n1 1 0 {0}", n * n));
            (0..n * n).for_each(|k| line(format_args!("{}", k + 1)));
            (0..n * n).for_each(|k| line(format_args!("{} {} {}", point(k).0, point(k).1, point(k).2)));
            line(format_args!("$EndNodes\n$Elements\n1 {lines} 1 {lines}\n1 1 1 {lines}"));
            ends.enumerate().for_each(|(e, (a, b))| line(format_args!("{} {a} {b}", e + 1)));
            line(format_args!("$EndElements"));
        }
        (Format::Inp, _) => {
            line(format_args!("*NODE, NSET=all"));
            (0..n * n).for_each(|k| {
                line(format_args!("{}, {}, {}, {}", k + 1, point(k).0, point(k).1, point(k).2))
            });
            line(format_args!("*ELEMENT, TYPE=T3D2, ELSET=net"));
            ends.enumerate().for_each(|(e, (a, b))| line(format_args!("{}, {a}, {b}", e + 1)));
        }
        (Format::Mdpa, _) => {
            line(format_args!("Begin Nodes"));
            (0..n * n)
                .for_each(|k| line(format_args!("{} {} {} {}", k + 1, point(k).0, point(k).1, point(k).2)));
            line(format_args!("End Nodes\nBegin Elements CableElement3D2N"));
            ends.enumerate().for_each(|(e, (a, b))| line(format_args!("{} 0 {a} {b}", e + 1)));
            line(format_args!("End Elements\nBegin SubModelPart net\nBegin SubModelPartElements"));
            (1..=lines).for_each(|e| line(format_args!("{e}")));
            line(format_args!("End SubModelPartElements\nEnd SubModelPart"));
        }
    }
    out
}

fn main() {
    let nodes = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(1_000_000_usize);
    let side = |nodes: usize| (nodes as f64).sqrt().round().max(2.0) as usize;
    println!("format    nodes     elements   MB      seconds  ns per byte");
    for (name, format, old) in [
        ("msh 4.1", Format::Msh, false),
        ("msh 2.2", Format::Msh, true),
        ("inp", Format::Inp, false),
        ("mdpa", Format::Mdpa, false),
    ] {
        for n in [side(nodes / 16), side(nodes / 4), side(nodes)] {
            let text = text(format, old, n);
            let started = Instant::now();
            let mesh = match parse("net", format, text.as_bytes()) {
                Ok(mesh) => mesh,
                Err(error) => return eprintln!("{error}"),
            };
            let seconds = started.elapsed().as_secs_f64();
            println!(
                "{name:8}  {:8}  {:9}  {:6.1}  {seconds:7.3}  {:5.1}",
                mesh.nodes.len(),
                mesh.elements.len(),
                text.len() as f64 * 1e-6,
                seconds / text.len() as f64 * 1e9
            );
        }
    }
}

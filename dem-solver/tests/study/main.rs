//! Studies: every member is the run of its own scene, whatever was computed before it, on how many threads, in which chunks,
//! and after which kill.

mod calibrate;
mod doubts;
mod drawn;
mod frequency;
mod growth;
mod lines;
mod members;
mod preview;
mod repeat;

use dem_solver::random::SplitMix;
use dem_solver::terrain::raster::Raster;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

#[path = "../support/slope.rs"]
mod slope;
use slope::Slope;

const SCENE: &str = "end_time = 20.0\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nname = \"block\"\nposition = [2600012.0, 1200020.0, 1040.0]\ndensity = 2600.0\n\
    shape = { type = \"box\", size = [0.8, 0.7, 0.6] }\ncluster.spheres = 27\n\
    [terrain]\nfile = \"slope.asc\"\n\
    [[contact]]\nlaw = \"hertz_rock\"\nyoung = 1e9\npoisson = 0.25\nrestitution = 0.2\nfriction = 0.6\n";

const STUDY: &str = "scene = \"fall.toml\"\nseed = 3\nmost_failed = 0.2\n\
    [[release]]\nname = \"cliff\"\npolygon = [[2600005.0, 1200010.0], [2600015.0, 1200012.0], [2600010.0, 1200030.0]]\ncount = 14\n\
    [[release]]\npoints = [[2600020.5, 1200020.25], [2600018.0, 1200022.0]]\nheight = 2.0\ncount = 6\n\
    [vary]\norientation = \"uniform\"\nspeed = { uniform = [0.5, 4.0] }\nspin = 2.0\n\
    contact.0.friction = { normal = [0.6, 0.05] }\ndem.steps_per_contact = { choice = [40, 45] }\n\
    [maps]\ncell = 2.0\n[[line]]\nname = \"road\"\npoints = [[2600035.0, 1200005.0], [2600035.0, 1200035.0]]\n";

/// A directory with scene, study and terrain.
struct Place {
    temp: tempfile::TempDir,
}

impl Place {
    fn new(study: &str) -> Self {
        let temp = tempfile::tempdir().expect("a directory");
        let slope = Slope {
            corner: [2_600_000.0, 1_200_000.0],
            spacing: 1.0,
            counts: [61, 41],
            drop: 35.0,
            foot: 1000.0,
            benches: 2,
            roughness: 0.05,
            seed: 5,
        };
        slope.raster().write_asc(&temp.path().join("slope.asc")).expect("written");
        let place = Self { temp };
        place.write("fall.toml", SCENE);
        place.write("study.toml", study);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.temp.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn command(&self, out: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dem-solver"));
        command.env("SOURCE_DATE_EPOCH", "1700000000"); // whenever a study begins, the same bytes
        command.arg("ensemble").arg(self.path("study.toml")).arg("--out").arg(self.path(out)).args(arguments);
        command
    }

    fn run(&self, out: &str, arguments: &[&str]) -> Output {
        self.command(out, arguments).output().expect("started")
    }

    /// The table of a study that ends well.
    fn table(&self, out: &str, arguments: &[&str]) -> String {
        let output = self.run(out, arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        self.read(out)
    }

    /// The maps and what passes the line, byte by byte.
    fn files(&self, out: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let mut all = Vec::new();
        for folder in ["maps", "lines"] {
            let entries = std::fs::read_dir(self.path(out).join(folder)).expect("a folder");
            for path in entries.map(|entry| entry.expect("an entry").path()) {
                let name = Path::new(folder).join(path.file_name().expect("a name"));
                all.push((name, std::fs::read(path).expect("read")));
            }
        }
        all.sort();
        assert!(all.len() > 40, "{}", all.len());
        all
    }

    fn read(&self, out: &str) -> String {
        std::fs::read_to_string(self.path(out).join("members.csv")).expect("a table")
    }
}

const FLIGHT: &str = "end_time = 1.5\ngravity = [0.0, 0.0, -9.81]\n\
    [[rock]]\nposition = [2600012.0, 1200020.0, 1040.0]\ndensity = 2600.0\nshape = { type = \"sphere\", radius = 0.3 }\n\
    [terrain]\nfile = \"slope.asc\"\n\
    [[contact]]\nlaw = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.25\nrestitution = 0.2\nfriction = 0.6\n";

const FLIGHTS: &str = "scene = \"fall.toml\"\nmost_failed = 1.0\n\
    [[release]]\npoints = [[2600010.0, 1200020.5]]\nheight = 20.0\ncount = 4\n\
    [vary]\nspeed = { choice = [10.0, 14.0], weights = [3, 1] }\nazimuth = 90.0\n\
    [maps]\ncell = 2.0\nepsg = 2056\n\
    [[line]]\nname = \"road\"\npoints = [[2600015.25, 1200030.0], [2600015.25, 1200010.0]]\n";

/// A study over level ground.
fn flights() -> Place {
    let place = Place::new(FLIGHTS);
    place.write("fall.toml", FLIGHT);
    let level = "ncols 61\nnrows 41\nxllcenter 2600000\nyllcenter 1200000\ncellsize 1\n".to_owned()
        + &("1000 ".repeat(61) + "\n").repeat(41);
    place.write("slope.asc", &level);
    place
}

/// The rows of a table by the names of its columns.
fn rows(table: &str) -> Vec<HashMap<String, String>> {
    let mut lines = table.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    lines.map(|cells| header.iter().cloned().zip(cells).collect()).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name}: {}", row[name]))
}

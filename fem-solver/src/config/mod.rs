//! The tables of a scene that are this program's: `[structure]`, `[fem]`, `[[gauge]]`.

pub mod fem;
pub mod gauge;
pub mod generator;
pub mod ground;
pub mod place;
pub mod scheme;
pub mod structure;

pub use fem::{FemConfig, Integrator, NewtonConfig};
pub use gauge::{GaugeConfig, Quantity};
pub use structure::StructureConfig;

use interface_defs::diagnostic::Diagnostic;
use toolkit::scene::Scene;

/// Everything that a scene says to this program.
#[derive(Debug, Clone)]
pub struct Config {
    /// `[structure]`.
    pub structure: StructureConfig,
    /// `[fem]`; absent = its defaults.
    pub fem: FemConfig,
    /// `[[gauge]]`.
    pub gauges: Vec<GaugeConfig>,
    /// `gravity` [m/s2].
    pub gravity: [f64; 3],
}

impl Config {
    /// Read and check the tables; the numbers in them that only a model can judge are judged there.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let structure: StructureConfig = scene.read("structure")?.ok_or_else(|| {
            scene
                .invalid("structure", "the scene has no table [structure]: there is nothing to build")
                .try_instead("write [structure] with a generator, or with nodes and elements of your own")
        })?;
        let fem: FemConfig = scene.read("fem")?.unwrap_or_default();
        fem.check(scene)?;
        let gauges = scene.read("gauge")?.unwrap_or_default();
        Ok(Self { structure, fem, gauges, gravity: scene.gravity()? })
    }
}

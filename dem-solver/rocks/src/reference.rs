//! What this program reads of a scene and writes as results, for `rockfall schema`.

use dem_contact::settings::{
    BoxSettings, ContactSettings, DemSettings, RockSettings, SpheresSettings, TerrainSettings,
};
use toolkit::schema::{Share, Tables};

/// Its tables and results; of several rocks each measure in the summary begins with `<rock>_`.
pub fn share() -> Share {
    Tables::default()
        .key::<Vec<RockSettings>>("rock")
        .key::<Vec<ContactSettings>>("contact")
        .key::<TerrainSettings>("terrain")
        .key::<DemSettings>("dem")
        .key::<Vec<SpheresSettings>>("spheres")
        .key::<BoxSettings>("box")
        .results(include_str!("results.txt"))
        .share()
}

//! Schema of the tables and results of this program, for `rockfall schema`.

use crate::config::{FemConfig, GaugeConfig, StructureConfig};
use toolkit::schema::{Share, Tables};
use toolkit::start_from::{self, StartFrom};
use toolkit::{kit, library};

/// Its tables and results.
pub fn share() -> Share {
    let mut share = Tables::default()
        .key::<StructureConfig>("structure")
        .key::<FemConfig>("fem")
        .key::<Vec<GaugeConfig>>("gauge")
        .value::<StartFrom>(start_from::KEY, start_from::MEANING)
        .results(include_str!("results.txt"))
        .share();
    // It is put in place where a scene is read, and never seen here.
    let about = serde_json::json!({ "type": "string", "description": kit::MEANING });
    share.definitions["StructureConfig"]["properties"]["kit"] = about;
    let of = serde_json::json!({
        "type": "object",
        "required": ["name", library::KEY],
        "properties": { "name": { "type": "string" }, library::KEY: { "type": "string", "description": library::MEANING } },
    });
    share.definitions["PartConfig"]["oneOf"].as_array_mut().expect("one for each element").push(of);
    let parts = &mut share.definitions["StructureConfig"]["properties"]["parts"]["description"];
    *parts = format!("{} `of`: {}", parts.as_str().unwrap_or_default(), library::MEANING).into();
    share
}

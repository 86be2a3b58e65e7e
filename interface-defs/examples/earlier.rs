//! A structure written for protocol 1, on bare iceoryx2, for a test of what it and the coupler say: `earlier serve SCENE --run ID
//! --as fem`. Its headers and its version byte are those of that version; it never gets as far as a window.
use iceoryx2::config::Config;
use iceoryx2::prelude::{
    EventId, FileName, NodeBuilder, NodeName, Path, SemanticString, ServiceName, ZeroCopySend, ipc,
};
use interface_defs::ipc::channel::ControlHeader;
use interface_defs::ipc::domain::Domain;
use std::time::Duration;

#[repr(C)]
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("rockfall.RequestHeader.v1")]
struct RequestHeader {
    run: u64,
    sequence: u64,
    window: u64,
    iteration: u32,
    command: u32,
    start: f64,
    length: f64,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("rockfall.AnswerHeader.v1")]
struct AnswerHeader {
    run: u64,
    sequence: u64,
    window: u64,
    iteration: u32,
    status: u32,
    start: f64,
    length: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let option = |key: &str| args.iter().position(|a| a == key).and_then(|i| args.get(i + 1)).cloned();
    let (id, part) = (option("--run").ok_or("--run ID")?, option("--as").ok_or("--as NAME")?);
    let domain = Domain::new(&id.parse()?)?;
    while !domain.is_owned() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let mut config = Config::default();
    config.global.prefix = FileName::new(format!("rf_{id}_").as_bytes())?;
    let uid = std::os::unix::fs::MetadataExt::uid(&std::fs::metadata("/proc/self")?);
    config.global.set_root_path(&Path::new(format!("/tmp/rockfall-{uid}/{id}").as_bytes())?);
    let node = NodeBuilder::new().name(&NodeName::new(&part)?).config(&config).create::<ipc::Service>()?;
    let control_name = ServiceName::new(&format!("{part}/control"))?;
    let field_name = ServiceName::new(&format!("{part}/field"))?;
    // The coupler creates the wake-up of `fem` last of all: from then on everything is there.
    let last = ServiceName::new("fem/wake")?;
    while node.service_builder(&last).event().open().is_err() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let control = node
        .service_builder(&control_name)
        .request_response::<[u8], [u8]>()
        .request_user_header::<ControlHeader>()
        .response_user_header::<ControlHeader>()
        .open()?;
    let _field = node
        .service_builder(&field_name)
        .request_response::<[f64], [f64]>()
        .request_user_header::<RequestHeader>()
        .response_user_header::<AnswerHeader>()
        .open()?;
    let wake = node.service_builder(&ServiceName::new("coupler/wake")?).event().open()?;
    let bell = wake.notifier_builder().default_event_id(EventId::new(1)).create()?;
    let control = control.server_builder().initial_max_slice_len(65_536).create()?;
    bell.notify()?;
    loop {
        std::thread::sleep(Duration::from_micros(200));
        if let Some(request) = control.receive()? {
            let version = request.payload().first().copied().unwrap_or(0);
            if version != 1 {
                eprintln!("error: the coupler speaks protocol {version}, this solver speaks protocol 1");
                std::process::exit(1);
            }
        }
    }
}

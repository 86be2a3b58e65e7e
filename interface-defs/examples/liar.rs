//! A structure that breaks the contract, written from `PROTOCOL.md` on bare iceoryx2.
//!
//! For tests of the coupler: `liar LIE serve SCENE --run ID --as fem`, where `LIE` is `none`, `run`,
//! `sequence`, `window`, `iteration`, `length`, `short` (payload), `nan`, `infinite-gauge`, `protocol`,
//! `garbage`, `silent`, `status`, `mute` (never joins), `unrepeatable`, `rough` (repeats
//! to 1 %), `rougher` (to 200 %), `small-window` or `two-meshes`.
//! As a structure it is one node that does not move.
use iceoryx2::prelude::{EventId, ServiceName};
use interface_defs::ipc::RunId;
use interface_defs::ipc::channel::ControlHeader;
use interface_defs::ipc::domain::Domain;
use interface_defs::message::{FromSolver, ToSolver, decode, encode};
use interface_defs::{
    AnswerHeader, Fault, FieldSpec, Gauge, Hello, InterfaceMesh, Ready, RequestHeader, Sampling, Statistics,
    Status, name,
};
use std::time::Duration;

type Failure = Box<dyn std::error::Error>;

fn hello(lie: &str) -> Hello {
    Hello {
        program: format!("liar ({lie})"),
        repeats: match lie {
            "unrepeatable" => None,
            "rough" => Some(1e-2),
            "rougher" => Some(2.0),
            _ => Some(0.0),
        },
        // Unknown to every version: passed over.
        options: vec![("colour".into(), "red".into())],
        takes: vec![FieldSpec::nodal(name::FORCE, 3, Sampling::Means)],
        gives: vec![
            FieldSpec::nodal(name::DISPLACEMENT, 3, Sampling::AtEnds),
            FieldSpec::nodal(name::VELOCITY, 3, Sampling::AtEnds),
        ],
        largest_window: if lie == "small-window" { 1e-9 } else { f64::INFINITY },
        ..Hello::default()
    }
}

fn ready(lie: &str) -> Ready {
    let mesh = InterfaceMesh { coordinates: vec![0.0; 3], masses: vec![f64::INFINITY], ..Default::default() };
    let more_meshes = if lie == "two-meshes" { vec![mesh.clone()] } else { vec![] };
    let gauges = vec![Gauge::new("truth", "1")];
    Ready { mesh, gauges, initial: vec![0.0; 9], more_meshes, ..Ready::default() }
}

fn reply(message: ToSolver, lie: &str, fields: &mut Vec<FieldSpec>) -> FromSolver {
    match message {
        ToSolver::Connect => FromSolver::Hello(hello(lie)),
        ToSolver::Prepare(plan) => {
            *fields = plan.gives;
            FromSolver::Ready(ready(lie))
        }
        ToSolver::Explain => FromSolver::Fault(Fault::window("no reason")),
        // It has not said that it could.
        ToSolver::Save { .. } | ToSolver::Resume { .. } => FromSolver::Fault(Fault::broken("never declared")),
        ToSolver::Finish { .. } | ToSolver::Abort { .. } => FromSolver::Statistics(Statistics::default()),
    }
}

/// Make the answer of a window what it must not be; false: there is none.
fn distort(lie: &str, header: &mut AnswerHeader, payload: &mut Vec<f64>) -> bool {
    match lie {
        "run" => header.run += 1,
        "sequence" => header.sequence += 1,
        "window" => header.window += 1,
        "iteration" => header.iteration += 1,
        "length" => header.length *= 2.0,
        "status" => header.status = 7,
        "short" => payload.truncate(4),
        "nan" => payload[4] = f64::NAN,
        "infinite-gauge" => payload[6] = f64::INFINITY,
        _ => {}
    }
    lie != "silent"
}

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().collect();
    let option = |key: &str| args.iter().position(|a| a == key).and_then(|i| args.get(i + 1)).cloned();
    let lie = args.get(1).map_or("none", String::as_str);
    let (id, part) = (option("--run").ok_or("--run ID")?, option("--as").ok_or("--as NAME")?);
    if lie == "mute" {
        std::thread::sleep(Duration::from_secs(60));
        return Ok(());
    }
    let id: RunId = id.parse()?;
    let domain = loop {
        match Domain::find(&id)? {
            Some(domain) => break domain,
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let node = domain.node(&part)?;
    let control_name = ServiceName::new(&format!("{part}/control"))?;
    let field_name = ServiceName::new(&format!("{part}/window"))?;
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
    let field = node
        .service_builder(&field_name)
        .request_response::<[f64], [f64]>()
        .request_user_header::<RequestHeader>()
        .response_user_header::<AnswerHeader>()
        .open()?;
    let wake = node.service_builder(&ServiceName::new("coupler/wake")?).event().open()?;
    let bell = wake.notifier_builder().default_event_id(EventId::new(1)).create()?;
    let control = control.server_builder().initial_max_slice_len(65_536).create()?;
    let windows = field.server_builder().initial_max_slice_len(9).create()?;
    let mut fields: Vec<FieldSpec> = Vec::new();
    loop {
        std::thread::sleep(Duration::from_micros(200));
        if let Some(request) = control.receive()? {
            // Messages of these tests fit one frame.
            let answer = reply(decode(request.payload())?, lie, &mut fields);
            let over = matches!(answer, FromSolver::Statistics(_));
            let mut bytes = encode(&answer);
            match lie {
                "protocol" => bytes[0] = 0,
                "garbage" => bytes.truncate(bytes.len() / 2),
                _ => {}
            }
            let mut response = request.loan_slice_uninit(bytes.len())?;
            *response.user_header_mut() =
                ControlHeader { run: id.number(), part: 1, parts: 1, more: 0, reserved: 0 };
            response.write_from_slice(&bytes).send()?;
            bell.notify()?;
            if over {
                std::thread::sleep(Duration::from_millis(100));
                return Ok(());
            }
        }
        if let Some(request) = windows.receive()? {
            assert_eq!(fields.len(), 2, "the plan comes before the first window");
            let asked = *request.user_header();
            let mut header = AnswerHeader::echo(&asked, Status::Done);
            let mut payload = vec![0.0; 9];
            // The truth for three windows, so that there are rows to keep.
            if asked.window > 3 && !distort(lie, &mut header, &mut payload) {
                continue;
            }
            let mut response = request.loan_slice_uninit(payload.len())?;
            *response.user_header_mut() = header;
            response.write_from_slice(&payload).send()?;
            bell.notify()?;
        }
    }
}

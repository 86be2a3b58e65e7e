//! The services of one solver, created by the coupler and opened by the solver.

use super::transport;
use crate::header::{AnswerHeader, RequestHeader};
use crate::participant::Failure;
use iceoryx2::prelude::{EventId, ServiceName, ZeroCopySend, ipc};
use iceoryx2::service::port_factory::{event, request_response};
use iceoryx2::{active_request, pending_response, port, response};
use std::time::{Duration, Instant};

/// Event: there is a request or an answer.
pub(crate) const LOOK: usize = 1;
/// Event: the coupler is alive and will ask again.
pub(crate) const HEARTBEAT: usize = 2;

/// Header of a frame of a control message.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("rockfall.ControlHeader.v1")]
pub struct ControlHeader {
    /// Number of the run.
    pub run: u64,
    /// Number of this frame of its message, from 1; 0 in a frame that only asks for the next one.
    pub part: u32,
    /// Frames of the message.
    pub parts: u32,
    /// 1 if another message follows this one (progress), else 0.
    pub more: u32,
    /// Always 0.
    pub reserved: u32,
}

pub(crate) type Ipc = ipc::Service;
pub(crate) type Node = iceoryx2::node::Node<Ipc>;
pub(crate) type Listener = port::listener::Listener<Ipc>;
pub(crate) type Notifier = port::notifier::Notifier<Ipc>;
type EventService = event::PortFactory<Ipc>;

type ControlService = request_response::PortFactory<Ipc, [u8], ControlHeader, [u8], ControlHeader>;
pub(crate) type ControlClient = port::client::Client<Ipc, [u8], ControlHeader, [u8], ControlHeader>;
pub(crate) type ControlServer = port::server::Server<Ipc, [u8], ControlHeader, [u8], ControlHeader>;
pub(crate) type ControlRequest = active_request::ActiveRequest<Ipc, [u8], ControlHeader, [u8], ControlHeader>;

type FieldService = request_response::PortFactory<Ipc, [f64], RequestHeader, [f64], AnswerHeader>;
pub(crate) type FieldClient = port::client::Client<Ipc, [f64], RequestHeader, [f64], AnswerHeader>;
pub(crate) type FieldServer = port::server::Server<Ipc, [f64], RequestHeader, [f64], AnswerHeader>;
pub(crate) type FieldRequest = active_request::ActiveRequest<Ipc, [f64], RequestHeader, [f64], AnswerHeader>;
pub(crate) type FieldPending =
    pending_response::PendingResponse<Ipc, [f64], RequestHeader, [f64], AnswerHeader>;
pub(crate) type FieldResponse = response::Response<Ipc, [f64], AnswerHeader>;

/// A builder of the service `NAME/WHAT`: one request, one response, nothing is dropped, nothing blocks for ever.
macro_rules! lock_step {
    ($node:ident, $name:ident, $what:literal, $item:ty, $asks:ty, $answers:ty) => {
        $node
            .service_builder(&service_name($name, $what)?)
            .request_response::<[$item], [$item]>()
            .request_user_header::<$asks>()
            .response_user_header::<$answers>()
            .max_clients(1)
            .max_servers(1)
            .max_nodes(8)
            .max_active_requests_per_client(1)
            .max_loaned_requests(1)
            .max_response_buffer_size(1)
            .max_borrowed_responses_per_pending_response(1)
            .enable_safe_overflow_for_requests(false)
            .enable_safe_overflow_for_responses(false)
            .enable_fire_and_forget_requests(false)
    };
}

macro_rules! control {
    ($node:ident, $name:ident) => {
        lock_step!($node, $name, "control", u8, ControlHeader, ControlHeader)
    };
}

macro_rules! windows {
    ($node:ident, $name:ident) => {
        lock_step!($node, $name, "window", f64, RequestHeader, AnswerHeader)
    };
}

pub(crate) fn service_name(participant: &str, what: &str) -> Result<ServiceName, Failure> {
    ServiceName::new(&format!("{participant}/{what}")).map_err(transport("name of a channel"))
}

fn event_builder(
    node: &Node,
    name: &str,
) -> Result<iceoryx2::service::builder::event::Builder<Ipc>, Failure> {
    Ok(node
        .service_builder(&service_name(name, "wake")?)
        .event()
        .max_nodes(8)
        .max_notifiers(4)
        .max_listeners(1)
        .event_id_max_value(HEARTBEAT))
}

/// The channels of one solver.
pub(crate) struct Channels {
    pub control: ControlService,
    pub field: FieldService,
    pub wake: EventService,
}

impl Channels {
    /// Create them, as the coupler.
    pub fn create(node: &Node, name: &str) -> Result<Self, Failure> {
        let failed = || format!("cannot create the channels of {name}");
        Ok(Self {
            control: control!(node, name).create().map_err(transport(failed()))?,
            field: windows!(node, name).create().map_err(transport(failed()))?,
            wake: create_wake(node, name)?,
        })
    }

    /// Open them, as the solver: again and again until the coupler has created them.
    pub fn open(node: &Node, name: &str, deadline: Duration) -> Result<Self, Failure> {
        Ok(Self {
            control: retry(deadline, || {
                control!(node, name).open().map_err(transport(format!("cannot open {name}/control")))
            })?,
            field: retry(deadline, || {
                windows!(node, name).open().map_err(transport(format!("cannot open {name}/window")))
            })?,
            wake: open_wake(node, name, deadline)?,
        })
    }
}

/// Create a wake-up event.
pub(crate) fn create_wake(node: &Node, name: &str) -> Result<EventService, Failure> {
    event_builder(node, name)?.create().map_err(transport(format!("cannot create the wake-up of {name}")))
}

/// Open a wake-up event.
pub(crate) fn open_wake(node: &Node, name: &str, deadline: Duration) -> Result<EventService, Failure> {
    retry(deadline, || {
        event_builder(node, name)?.open().map_err(transport(format!("cannot open {name}/wake")))
    })
}

/// Opening races with creating and with the cleaning of dead nodes: try again until the deadline.
fn retry<T>(deadline: Duration, mut open: impl FnMut() -> Result<T, Failure>) -> Result<T, Failure> {
    let started = Instant::now();
    loop {
        match open() {
            Ok(service) => return Ok(service),
            Err(e) if started.elapsed() > deadline || super::interrupt::requested() => return Err(e),
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

/// Both directions of waking.
pub(crate) struct Bell {
    pub listener: Listener,
    notifier: Notifier,
}

impl Bell {
    pub fn new(own: &EventService, partner: &EventService) -> Result<Self, Failure> {
        Ok(Self {
            listener: own.listener_builder().create().map_err(transport("cannot listen for wake-ups"))?,
            notifier: notifier(partner)?,
        })
    }

    /// Wake the partner. A partner that is gone is noticed elsewhere.
    pub fn ring(&self) {
        let _ = self.notifier.notify();
    }
}

/// A notifier of `service`.
pub(crate) fn notifier(service: &EventService) -> Result<Notifier, Failure> {
    service
        .notifier_builder()
        .default_event_id(EventId::new(LOOK))
        .create()
        .map_err(transport("cannot create a wake-up"))
}

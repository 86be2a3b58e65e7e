//! What a solver of protocol 1 finds: its channel for windows, so that it gets as far as being recognised.

use super::channel::lock_step;
use super::{channel, transport};
use crate::message::{DecodeError, PROTOCOL};
use crate::participant::Failure;
use iceoryx2::node::Node;
use iceoryx2::prelude::{CallbackProgression, ZeroCopySend, ipc};
use iceoryx2::service::port_factory::{PortFactory, request_response};

/// As long as the header of that version.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("rockfall.RequestHeader.v1")]
pub struct Request1 {
    _numbers: [u64; 6],
}

/// As long as the header of that version.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("rockfall.AnswerHeader.v1")]
pub struct Answer1 {
    _numbers: [u64; 6],
}

/// The channel `NAME/field` of protocol 1, in which nothing is ever sent: solvers of this version open `NAME/window`.
pub(crate) struct Earlier {
    service: request_response::PortFactory<ipc::Service, [f64], Request1, [f64], Answer1>,
}

impl Earlier {
    /// For the solver `name`, as the coupler.
    pub fn create(node: &Node<ipc::Service>, name: &str) -> Result<Self, Failure> {
        let builder = node
            .service_builder(&channel::service_name(name, "field")?)
            .request_response::<[f64], [f64]>()
            .request_user_header::<Request1>()
            .response_user_header::<Answer1>();
        let service = lock_step!(builder)
            .create()
            .map_err(transport(format!("cannot create the channels of {name}")))?;
        Ok(Self { service })
    }

    /// Errs if a solver of protocol 1 has opened it.
    pub fn check(&self, solver: &str) -> Result<(), Failure> {
        let mut nodes = 0;
        let listed = self.service.nodes(|_| {
            nodes += 1;
            CallbackProgression::Continue
        });
        if listed.is_ok() && nodes <= 1 {
            return Ok(());
        }
        listed.map_err(transport(format!("cannot see which protocol {solver} speaks")))?;
        let what = DecodeError::Protocol(Some(PROTOCOL - 1)).to_string();
        Err(Failure::Contract { solver: solver.into(), what: format!("{what} (PROTOCOL.md, clause 1.5)") })
    }
}

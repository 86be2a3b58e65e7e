//! How to wait, and for how long.

use super::domain::Domain;
use super::interrupt;
use crate::participant::Failure;
use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::ipc;
use std::fmt;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// How long to yield before sleeping, with [`Wait::Yield`]: longer than the partners of a quick run are at work, as
/// falling asleep and being woken costs more than a hundred looks.
const YIELDING: Duration = Duration::from_micros(500);

/// How often a waiting process looks after its partner, its parent and the user.
const TICK: Duration = Duration::from_millis(100);

/// How often a long wait says whom it waits for.
const SAY: Duration = Duration::from_secs(2);

/// What an interrupted run is given to end its exchange in order.
const GRACE: Duration = Duration::from_secs(1);

/// How to wait for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wait {
    /// Sleep until woken: no processor time, some 60 us more per exchange. For oversubscribed machines.
    Event,
    /// Look again for half a millisecond, yielding the processor in between, then sleep: the fastest on a free machine.
    #[default]
    Yield,
}

impl FromStr for Wait {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "event" => Ok(Self::Event),
            "yield" => Ok(Self::Yield),
            _ => Err(format!("unknown wait \"{text}\", expected `event` or `yield`")),
        }
    }
}

impl fmt::Display for Wait {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Event => "event",
            Self::Yield => "yield",
        })
    }
}

/// Whether the process `supervisor` is not this one's parent any more.
pub(crate) fn is_orphan(supervisor: u32) -> bool {
    std::os::unix::process::parent_id() != supervisor
}

/// The launcher is gone, and with it whoever wanted this run.
pub(crate) fn launcher_lost(during: String) -> Failure {
    Failure::Lost { solver: "the launcher".into(), during }
}

/// What ends a wait that is not answered.
pub(crate) struct Patience<'a> {
    pub domain: &'a Domain,
    pub wait: Wait,
    /// Who is waited for, and whether it must be alive (it is not yet while it is starting).
    pub partner: &'a str,
    pub must_live: bool,
    pub during: &'a dyn Fn() -> String,
    pub deadline: Duration,
    /// Process whose end ends the run.
    pub supervisor: Option<u32>,
}

impl Patience<'_> {
    /// Poll until there is an answer. `on_event` sees each event's number and says whether it is a
    /// sign of life (the deadline starts anew); `on_tick` is called some ten times a
    /// second; its failure ends the wait.
    pub fn until<T>(
        &self,
        listener: &Listener<ipc::Service>,
        mut poll: impl FnMut() -> Result<Option<T>, Failure>,
        mut on_event: impl FnMut(usize) -> bool,
        mut on_tick: impl FnMut() -> Result<(), Failure>,
    ) -> Result<T, Failure> {
        let started = Instant::now();
        if self.wait == Wait::Yield {
            loop {
                if let Some(answer) = poll()? {
                    return Ok(answer);
                }
                if started.elapsed() > YIELDING {
                    break;
                }
                std::thread::yield_now();
            }
        }
        let (mut alive_at, mut ticked_at, mut said_at) = (started, started, started);
        let mut interrupted_at = None;
        loop {
            if let Some(answer) = poll()? {
                return Ok(answer);
            }
            let mut sign_of_life = false;
            // Signals interrupt the wait: whatever the cause, look again.
            let _ = listener.timed_wait(|event| sign_of_life |= on_event(event.id.as_value()), TICK);
            let now = Instant::now();
            if sign_of_life {
                alive_at = now;
            }
            if now - ticked_at < TICK {
                continue;
            }
            ticked_at = now;
            // First of all: without its launcher the others leave, too, and are not the ones to be named.
            if self.supervisor.is_some_and(is_orphan) {
                return Err(launcher_lost((self.during)()));
            }
            on_tick()?;
            if interrupt::requested() && now - *interrupted_at.get_or_insert(now) > GRACE {
                return Err(Failure::Interrupted);
            }
            if self.must_live && !self.domain.is_alive(self.partner) {
                // It may have answered and left between two looks: then the answer counts.
                return poll()?.ok_or_else(|| self.lost(self.partner));
            }
            let waited = now - alive_at;
            if waited > self.deadline {
                return Err(Failure::Silent {
                    solver: self.partner.into(),
                    during: (self.during)(),
                    waited: waited.as_secs_f64(),
                    deadline: self.deadline.as_secs_f64(),
                });
            }
            if now - said_at > SAY {
                said_at = now;
                tracing::info!(
                    "waiting for {}: {:.0} s of {:.0} s",
                    self.partner,
                    waited.as_secs_f64(),
                    self.deadline.as_secs_f64()
                );
            }
        }
    }

    fn lost(&self, who: &str) -> Failure {
        Failure::Lost { solver: who.into(), during: (self.during)() }
    }
}

//! How to wait, and for how long.

use super::channel::{HEARTBEAT, Listener};
use super::domain::Domain;
use super::interrupt;
use crate::participant::Failure;
use serde::de::IntoDeserializer;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How long to look again and again before sleeping: longer than the partners of a quick run are at work, as
/// falling asleep and being woken costs more than a hundred looks.
const YIELDING: Duration = Duration::from_micros(500);

/// A look that takes longer than this was interrupted: the processor has other work. On a free machine one takes about
/// a microsecond, and one that yields to a partner of the run a few; a timer's interrupt takes up to a few hundred, the slice
/// of another program some milliseconds.
const LONG: Duration = Duration::from_micros(500);

/// How many times as long as such a look the waits that follow sleep at once. What trying again costs is bounded
/// by its inverse, 5 %.
const REST: u32 = 20;

/// Until when waits sleep at once [ns after [`ORIGIN`]]. One for the process: what it stands for is the machine.
static BUSY_UNTIL: AtomicU64 = AtomicU64::new(0);

/// First wait of the process.
static ORIGIN: LazyLock<Instant> = LazyLock::new(Instant::now);

/// How often a waiting process looks after its partner, its parent and the user.
const TICK: Duration = Duration::from_millis(100);

/// How often a long wait says whom it waits for.
const SAY: Duration = Duration::from_secs(2);

/// What an interrupted run is given to end its exchange in order.
const GRACE: Duration = Duration::from_secs(1);

/// Deadline for one answer where no one names one [s].
pub const TIMEOUT: f64 = 60.0;

/// How to wait for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Wait {
    /// Look again for half a millisecond, yielding the processor in between, then sleep until woken; as soon as the processor
    /// turns out to have other work, sleep at once, and try again later.
    #[default]
    Auto,
    /// Sleep until woken, always: takes no processor time from other work, and each exchange longer.
    Event,
}

impl FromStr for Wait {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::deserialize(text.into_deserializer()).map_err(|e: serde::de::value::Error| e.to_string())
    }
}

impl fmt::Display for Wait {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.serialize(f)
    }
}

/// Whether the process `supervisor` is not this one's parent any more.
pub fn is_orphan(supervisor: u32) -> bool {
    std::os::unix::process::parent_id() != supervisor
}

/// The launcher is gone, and with it whoever wanted this run.
pub(crate) fn launcher_lost(during: String) -> Failure {
    Failure::Lost { solver: "the launcher".into(), during }
}

/// Nobody has come who could answer.
pub(crate) fn absent(who: &str, waited: Duration, deadline: Duration) -> Failure {
    Failure::Absent { who: who.into(), waited: waited.as_secs_f64(), deadline: deadline.as_secs_f64() }
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
    /// Poll until there is an answer. The coupler's heartbeat is a sign of life: the deadline starts anew. `on_tick` is called
    /// some ten times a second; its failure ends the wait.
    pub fn until<T>(
        &self,
        listener: &Listener,
        mut poll: impl FnMut() -> Result<Option<T>, Failure>,
        mut on_tick: impl FnMut() -> Result<(), Failure>,
    ) -> Result<T, Failure> {
        let _span = crate::profile!("wait", partner = self.partner);
        let started = Instant::now();
        if let Some(answer) = self.look_again(started, &mut poll)? {
            return Ok(answer);
        }
        let (mut alive_at, mut ticked_at, mut said_at) = (started, started, started);
        let mut interrupted_at = None;
        loop {
            if let Some(answer) = poll()? {
                return Ok(answer);
            }
            let mut sign_of_life = false;
            // Signals interrupt the wait: whatever the cause, look again.
            let _ = listener.timed_wait(|event| sign_of_life |= event.id.as_value() == HEARTBEAT, TICK);
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
                let lost = || Failure::Lost { solver: self.partner.into(), during: (self.during)() };
                return poll()?.ok_or_else(lost);
            }
            let waited = now - alive_at;
            if waited > self.deadline {
                if !self.must_live {
                    return Err(absent(self.partner, waited, self.deadline));
                }
                let (solver, during) = (self.partner.into(), (self.during)());
                let (waited, deadline) = (waited.as_secs_f64(), self.deadline.as_secs_f64());
                return Err(Failure::Silent { solver, during, waited, deadline });
            }
            // Whoever gives signs of life is not silent, however long its work takes.
            if waited > SAY && now - said_at > SAY {
                said_at = now;
                let (waited, deadline) = (waited.as_secs_f64(), self.deadline.as_secs_f64());
                tracing::info!("waiting for {}: {waited:.0} s of {deadline:.0} s", self.partner);
            }
        }
    }

    /// Poll for a while without sleeping, as far as the machine is free for it.
    fn look_again<T>(
        &self,
        started: Instant,
        poll: &mut impl FnMut() -> Result<Option<T>, Failure>,
    ) -> Result<Option<T>, Failure> {
        let since_origin = |at: Instant| at.saturating_duration_since(*ORIGIN).as_nanos() as u64;
        if self.wait == Wait::Event || since_origin(started) < BUSY_UNTIL.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let mut looked_at = started;
        while looked_at - started <= YIELDING {
            if let Some(answer) = poll()? {
                return Ok(Some(answer));
            }
            std::thread::yield_now();
            let now = Instant::now();
            let took = now - looked_at;
            if took > LONG {
                BUSY_UNTIL.store(since_origin(now + took * REST), Ordering::Relaxed);
                break;
            }
            looked_at = now;
        }
        Ok(None)
    }
}

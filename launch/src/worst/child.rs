//! A program that is waited for, and ended in order when the user wants to stop.

use crate::events::{Event, Events};
use crate::stop::Stop;
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::process::CommandExt;
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// What a program is given to end in order.
const GRACE: Duration = Duration::from_secs(10);

/// How often the user is told of one that takes long.
const TOLD: Duration = Duration::from_secs(30);

/// Start a program and wait until it has ended; a signal ends both.
pub fn wait(command: &mut Command, events: &Events) -> Result<Output, Stop> {
    wait_telling(command, events, &|_| {})
}

/// The same; `tell` gets now and then the seconds since the start.
pub fn wait_telling(command: &mut Command, events: &Events, tell: &dyn Fn(u64)) -> Result<Output, Stop> {
    // A group of its own: Ctrl-C reaches this program alone, which ends the other.
    let spawned = command.process_group(0).stdin(Stdio::null()).spawn();
    let name = command.get_program().to_string_lossy().into_owned();
    let child = spawned.map_err(|e| Stop::failed(format!("{name} cannot be started: {e}")))?;
    let process = Pid::from_child(&child);
    let to_main = events.sender.clone();
    std::thread::spawn(move || to_main.send(Event::Checked(0, child.wait_with_output())));
    let begun = Instant::now();
    loop {
        match events.receiver.recv_timeout(TOLD) {
            Ok(Event::Checked(_, Ok(output))) => return Ok(output),
            Ok(Event::Checked(_, Err(e))) => return Err(Stop::failed(format!("{name}: {e}"))),
            Err(RecvTimeoutError::Timeout) => tell(begun.elapsed().as_secs()),
            Ok(Event::Signal) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(_) => {}
        }
    }
    for signal in [Signal::TERM, Signal::KILL] {
        // It may have ended meanwhile.
        let _ = kill_process(process, signal);
        let deadline = Instant::now() + GRACE;
        while let Ok(event) = events.receiver.recv_timeout(deadline.saturating_duration_since(Instant::now()))
        {
            if matches!(event, Event::Checked(..)) {
                return Err(Stop::failed("interrupted"));
            }
        }
    }
    Err(Stop::failed("interrupted"))
}

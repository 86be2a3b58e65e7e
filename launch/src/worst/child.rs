//! A program that is waited for, and ended in order when the user wants to stop.

use crate::events::{Event, Events};
use crate::stop::Stop;
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::process::CommandExt;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// What a program is given to end in order.
const GRACE: Duration = Duration::from_secs(10);

/// Start a program and wait until it has ended; a signal ends both.
pub fn wait(command: &mut Command, events: &Events) -> Result<Output, Stop> {
    // A group of its own: Ctrl-C reaches this program alone, which ends the other.
    let spawned = command.process_group(0).stdin(Stdio::null()).spawn();
    let name = command.get_program().to_string_lossy().into_owned();
    let child = spawned.map_err(|e| Stop::failed(format!("{name} cannot be started: {e}")))?;
    let process = Pid::from_child(&child);
    let to_main = events.sender.clone();
    std::thread::spawn(move || to_main.send(Event::Checked(0, child.wait_with_output())));
    loop {
        match events.receiver.recv() {
            Ok(Event::Checked(_, Ok(output))) => return Ok(output),
            Ok(Event::Checked(_, Err(e))) => return Err(Stop::failed(format!("{name}: {e}"))),
            Ok(Event::Signal) | Err(_) => break,
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

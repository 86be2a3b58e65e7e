//! What happens while other programs are at work: they end, they say how far they are, the user wants to stop.

use crate::stop::Stop;
use interface_defs::diagnostic::code;
use interface_defs::ipc::interrupt;
use std::io;
use std::process::Output;
use std::sync::mpsc::{Receiver, Sender, channel};
use toolkit::progress::Line;

/// One of it.
pub enum Event {
    /// The process with this number has ended, with what it printed where that is kept.
    Ended(usize, io::Result<Output>),
    /// Ctrl-C, SIGTERM, or a closed terminal.
    Signal,
    /// How far the leader is.
    Progress(Line),
}

/// All of it, from the start of the program on: a signal ends it in order at any moment.
pub struct Events {
    /// To it.
    pub sender: Sender<Event>,
    /// From it.
    pub receiver: Receiver<Event>,
}

impl Events {
    /// From now on signals are events. One that is ignored stays so, as `nohup` wants it.
    pub fn watch() -> Result<Self, Stop> {
        let (sender, receiver) = channel();
        let mut signals = signal_hook::iterator::Signals::new(interrupt::ending())
            .map_err(|e| Stop::failed(code::PROCESS, format!("signals cannot be watched: {e}")))?;
        let to_main = sender.clone();
        std::thread::spawn(move || signals.forever().all(|_| to_main.send(Event::Signal).is_ok()));
        Ok(Self { sender, receiver })
    }

    /// Whether a signal has come. To be asked while nothing is at work: other events are passed over.
    pub fn interrupted(&self) -> bool {
        self.receiver.try_iter().any(|event| matches!(event, Event::Signal))
    }
}

//! One solver as it was agreed with: its gauges, the layout of what goes to it and of what comes back.

use crate::energy::Account;
use interface_defs::{Gauge, Hello, Items, Layout, Plan, Ready};
use toolkit::history::gauge_column;

/// What is agreed with one solver.
pub struct Side {
    /// Its part in the run and its program, for messages: `fem (fem-solver 0.1)`.
    pub program: String,
    /// Its gauges.
    pub gauges: Vec<Gauge>,
    /// Layout of the requests to it.
    pub request: Layout,
    /// Layout of its answers.
    pub layout: Layout,
    /// Its part in the balance of energy.
    pub account: Account,
    /// Its answer at t = 0.
    pub initial: Vec<f64>,
    /// Masses of the nodes of its mesh [kg]; empty if it has given none.
    pub masses: Vec<f64>,
    /// What it has said of itself.
    pub hello: Hello,
}

impl Side {
    /// The solver `name`, which was given `plan` and has answered `ready`.
    pub fn new(name: &str, hello: Hello, plan: &Plan, ready: Ready) -> Self {
        let program = format!("{name} ({})", hello.program);
        let layout = Layout::new(&plan.gives, &ready.mesh, ready.gauges.len());
        let request = Layout::new(&plan.takes, &ready.mesh, 0);
        let account = Account::new(&ready.gauges, &layout, &ready.initial);
        let Ready { gauges, initial, mesh, .. } = ready;
        Self { program, gauges, request, layout, account, initial, masses: mesh.masses, hello }
    }

    /// Lay its payloads out for other items.
    pub fn resize(&mut self, items: &Items) {
        self.request.resize(items);
        self.layout.resize(items);
    }

    /// The first gauge of an answer whose value is not between its smallest and its largest, with the three; means may be.
    pub fn out_of_range(&self, answer: &[f64]) -> Option<String> {
        let numbers = answer[self.layout.gauges()].as_chunks::<3>().0;
        let outside = |(gauge, [value, smallest, largest]): &(&Gauge, &[f64; 3])| {
            let rounding = 1e-9 * smallest.abs().max(largest.abs());
            !gauge.is_mean() && (*value < smallest - rounding || *value > largest + rounding)
        };
        let (gauge, [value, smallest, largest]) = self.gauges.iter().zip(numbers).find(outside)?;
        let Gauge { name, unit, .. } = gauge;
        Some(format!(
            "gauge \"{name}\" is {value} {unit} at the window's end, and between {smallest} and {largest} {unit} in it"
        ))
    }

    /// Names of the columns of its gauges.
    pub fn columns(&self) -> impl Iterator<Item = String> {
        self.gauges.iter().map(gauge_column)
    }
}

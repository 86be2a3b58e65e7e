//! Functions of a solver, called as C would have them called; what is wrong with them ends as a fault.

use super::*;

/// What a test's solver does when it is asked.
struct Mass {
    outcome: c_int,
    bad: bool,
    state: [f64; 2],
    trial: [f64; 2],
    gauges: [RfGauge; 1],
}

const ORIGIN: [f64; 3] = [0.0; 3];

fn mass(data: *mut c_void) -> &'static mut Mass {
    // SAFETY: each test gives its own.
    unsafe { &mut *data.cast() }
}

unsafe extern "C-unwind" fn prepare(data: *mut c_void, plan: *const RfPlan, ready: *mut RfReady) -> c_int {
    // SAFETY: as the header says.
    let (plan, ready) = unsafe { (&*plan, &mut *ready) };
    // SAFETY: two fields were declared.
    let planned = unsafe { slice::from_raw_parts(plan.gives, 2) };
    assert_eq!([planned[0].samples, planned[1].samples], [0, 2]);
    if mass(data).bad {
        panic!("no {}", "steel");
    }
    ready.mesh.nodes = 1;
    ready.mesh.coordinates = ORIGIN.as_ptr();
    ready.gauges = mass(data).gauges.as_ptr();
    ready.gauge_count = 1;
    RF_OK
}

unsafe extern "C-unwind" fn start(_: *mut c_void, gives: *const *mut f64, gauges: *mut f64) -> c_int {
    // SAFETY: as the header says.
    unsafe {
        assert!((*gives).is_null());
        *gauges = 7.0;
    }
    RF_OK
}

unsafe extern "C-unwind" fn solve(
    data: *mut c_void,
    window: *const RfWindow,
    takes: *const *const f64,
    gives: *const *mut f64,
    gauges: *mut f64,
) -> c_int {
    let it = mass(data);
    // SAFETY: as the header says.
    unsafe {
        let force = *(*takes).add(2);
        it.trial = [it.state[0] + force * (*window).length, force];
        (*(*gives.add(1))) = it.trial[0];
        *(*gives.add(1)).add(5) = it.trial[1];
        *gauges.add(2) = 3.0;
        if it.outcome != RF_OK && !it.bad {
            rf_explain(c"the mass went away".as_ptr());
        }
    }
    it.outcome
}

unsafe extern "C-unwind" fn commit(data: *mut c_void) -> c_int {
    mass(data).state = mass(data).trial;
    RF_OK
}

unsafe extern "C-unwind" fn save(data: *mut c_void, bytes: *mut *const u8, length: *mut usize) -> c_int {
    // SAFETY: as the header says.
    unsafe {
        *bytes = mass(data).state.as_ptr().cast();
        *length = 16;
    }
    RF_OK
}

unsafe extern "C-unwind" fn resume(data: *mut c_void, bytes: *const u8, length: usize) -> c_int {
    // SAFETY: as the header says.
    unsafe { std::ptr::copy_nonoverlapping(bytes, mass(data).state.as_mut_ptr().cast(), length) };
    RF_OK
}

unsafe extern "C-unwind" fn finish(_: *mut c_void) -> c_int {
    // SAFETY: texts that end with a zero.
    unsafe { rf_measure(c"way".as_ptr(), 2.0, c"m".as_ptr()) };
    RF_OK
}

const FORCE: RfField =
    RfField { name: c"force".as_ptr(), components: 3, place: RF_NODE, sampling: RF_MEANS, samples: 1 };
const GIVES: [RfField; 2] = [
    RfField { name: c"velocity".as_ptr(), sampling: RF_AT_ENDS, ..FORCE },
    RfField { name: c"displacement".as_ptr(), sampling: RF_AT_ENDS, samples: 2, ..FORCE },
];

/// A solver of one mass, which is leaked: a test ends soon.
fn solver(outcome: c_int, bad: bool) -> RfSolver {
    let gauges = [RfGauge { name: c"uz".as_ptr(), unit: c"m".as_ptr(), role: RF_NO_ROLE, extremes: 1 }];
    let data = Box::leak(Box::new(Mass { outcome, bad, state: [1.0, 0.0], trial: [0.0; 2], gauges }));
    RfSolver {
        program: c"mass".as_ptr(),
        data: (data as *mut Mass).cast(),
        repeats: 0.0,
        largest_window: 0.0,
        takes: &FORCE,
        take_count: 1,
        gives: GIVES.as_ptr(),
        give_count: 2,
        prepare: Some(prepare),
        start: Some(start),
        solve: Some(solve),
        commit: Some(commit),
        finish: Some(finish),
        at_rest: None,
        save: Some(save),
        resume: Some(resume),
    }
}

fn plan(adapter: &Adapter) -> Plan {
    Plan { takes: adapter.takes.clone(), gives: adapter.gives[1..].to_vec(), ..Default::default() }
}

const WINDOW: Window = Window { number: 1, iteration: 1, start: 0.0, length: 0.5 };

fn quiet(_: Progress) -> Result<(), Fault> {
    Ok(())
}

#[test]
fn a_solver_in_c_is_one_in_rust() {
    let c = solver(RF_OK, false);
    // SAFETY: its pointers are static, or leaked.
    let mut adapter = unsafe { Adapter::new(&raw const c) }.expect("a solver");
    let hello = adapter.hello();
    assert_eq!((hello.repeats, hello.largest_window), (Some(0.0), f64::INFINITY));
    assert!(hello.can(capability::CHECKPOINT) && hello.gives.len() == 2);
    let ready = adapter.prepare(&plan(&adapter), &mut quiet).expect("prepared");
    // Two samples of three numbers, and a gauge: velocity is not in the plan.
    assert_eq!(ready.initial, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0]);
    let mut answer = [f64::NAN; 9];
    adapter.solve(&WINDOW, &[0.0, 0.0, 8.0], &mut answer).expect("solved");
    assert_eq!((answer[0], answer[5], answer[8]), (5.0, 8.0, 3.0));
    let before = adapter.save().expect("saved");
    adapter.commit().expect("committed");
    assert_ne!(adapter.save().expect("saved"), before);
    adapter.resume(&before).expect("resumed");
    assert_eq!(adapter.save().expect("saved"), before);
    assert_eq!(adapter.finish().expect("finished").measures, [Measure::new("way", 2.0, "m")]);
}

#[test]
fn an_error_is_a_fault_with_its_text() {
    for (outcome, kind) in
        [(RF_INPUT, FaultKind::Input), (RF_WINDOW, FaultKind::Window), (99, FaultKind::Broken)]
    {
        let c = solver(outcome, false);
        // SAFETY: as above.
        let mut adapter = unsafe { Adapter::new(&raw const c) }.expect("a solver");
        adapter.prepare(&plan(&adapter), &mut quiet).expect("prepared");
        let fault = adapter.solve(&WINDOW, &[0.0; 3], &mut [0.0; 9]).expect_err("a fault");
        assert_eq!((fault.kind, fault.diagnostic.message.as_str()), (kind, "the mass went away"));
    }
}

#[test]
fn a_panic_is_a_fault_with_its_text_and_so_is_silence() {
    let c = solver(RF_BROKEN, true);
    // SAFETY: as above.
    let mut adapter = unsafe { Adapter::new(&raw const c) }.expect("a solver");
    let fault = adapter.prepare(&plan(&adapter), &mut quiet).expect_err("a panic");
    assert_eq!((fault.kind, fault.diagnostic.message.as_str()), (FaultKind::Broken, "prepare: no steel"));
    mass(c.data).bad = false;
    adapter.prepare(&plan(&adapter), &mut quiet).expect("prepared");
    mass(c.data).bad = true;
    let fault = adapter.solve(&WINDOW, &[0.0; 3], &mut [0.0; 9]).expect_err("a fault");
    assert!(fault.diagnostic.message.contains("solve failed without a reason"), "{fault}");
}

#[test]
fn what_is_declared_wrongly_is_named() {
    let why = |c: RfSolver| {
        // SAFETY: as above.
        unsafe { Adapter::new(&raw const c) }.map(drop).expect_err("refused").diagnostic.message
    };
    let good = || solver(RF_OK, false);
    assert!(why(RfSolver { solve: None, ..good() }).contains("no function solve"));
    assert!(why(RfSolver { gives: null(), ..good() }).contains("gives: 2 of them at NULL"));
    for (field, what) in [
        (RfField { name: null(), ..FORCE }, "without a name"),
        (RfField { place: 9, ..FORCE }, "place 9"),
        (RfField { sampling: 4, ..FORCE }, "sampling 4"),
        (RfField { samples: 0, ..FORCE }, "0 samples"),
    ] {
        let said = why(RfSolver { takes: &raw const field, ..good() });
        assert!(said.contains(what), "{said}");
    }
    // SAFETY: NULL is looked for.
    assert!(unsafe { Adapter::new(null()) }.is_err());
}

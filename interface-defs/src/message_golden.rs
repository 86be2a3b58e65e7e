//! Golden bytes of every control message: what a solver in another language must write and read.

use crate::diagnostic::{Diagnostic, Place as Written, code};
use crate::field::{FieldSpec, Place, Sampling};
use crate::header::{AnswerHeader, RequestHeader, Status};
use crate::ipc::channel::ControlHeader;
use crate::mesh::{Group, InterfaceMesh};
use crate::message::*;
use crate::part::{PartUse, ShareOf, Utilisation};
use crate::verdict::{Ending, Fate, Gap, Torn, Touch, Verdict};
use serde::{Serialize, de::DeserializeOwned};

/// Bytes as they are put together by hand, from the page that describes them.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn message(variant: u32) -> Self {
        Self(vec![3]).u32(variant)
    }
    fn byte(mut self, x: u8) -> Self {
        self.0.push(x);
        self
    }
    fn u16(mut self, x: u16) -> Self {
        self.0.extend(x.to_le_bytes());
        self
    }
    fn u32(mut self, x: u32) -> Self {
        self.0.extend(x.to_le_bytes());
        self
    }
    fn u64(mut self, x: u64) -> Self {
        self.0.extend(x.to_le_bytes());
        self
    }
    fn f64(mut self, x: f64) -> Self {
        self.0.extend(x.to_le_bytes());
        self
    }
    fn text(self, x: &str) -> Self {
        let mut bytes = self.u64(x.len() as u64);
        bytes.0.extend(x.as_bytes());
        bytes
    }
}

/// Golden bytes as a file, for implementers in other languages.
struct Golden {
    file: &'static str,
    lines: Vec<String>,
}

impl Golden {
    fn new(file: &'static str) -> Self {
        Self { file, lines: Vec::new() }
    }

    fn message<M>(&mut self, message: M, bytes: Bytes)
    where
        M: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug,
    {
        assert_eq!(encode(&message), bytes.0, "{message:?}");
        assert_eq!(decode::<M>(&bytes.0).unwrap(), message);
        self.line(&serde_json::to_string(&message).unwrap(), &bytes.0);
    }

    fn line(&mut self, value: &str, bytes: &[u8]) {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        self.lines.push(format!("{{\"value\": {value}, \"bytes\": \"{hex}\"}}"));
    }

    /// The file is what it must be. With ROCKFALL_BLESS set it is written.
    fn finish(self) {
        let text = format!("[\n{}\n]\n", self.lines.join(",\n"));
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("bindings/golden").join(self.file);
        if std::env::var_os("ROCKFALL_BLESS").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(kept == text, "{}: run this test with ROCKFALL_BLESS=1", path.display());
    }
}

fn force() -> FieldSpec {
    FieldSpec {
        name: "force".into(),
        components: 3,
        place: Place::Node,
        sampling: Sampling::Means,
        samples: 4,
        interface: 0,
    }
}

fn force_bytes(bytes: Bytes) -> Bytes {
    bytes.text("force").u32(3).u32(0).u32(2).u32(4).u32(0)
}

fn mesh() -> InterfaceMesh {
    InterfaceMesh {
        name: "net".into(),
        coordinates: vec![0.0, 1.0, 2.0],
        lines: vec![[0, 0]],
        faces: vec![[0, 0, 0]],
        line_radius: vec![0.002],
        masses: vec![0.5],
        groups: vec![Group { name: "mid".into(), nodes: vec![0] }],
    }
}

fn mesh_bytes(bytes: Bytes) -> Bytes {
    let bytes =
        bytes.text("net").u64(3).f64(0.0).f64(1.0).f64(2.0).u64(1).u32(0).u32(0).u64(1).u32(0).u32(0).u32(0);
    bytes.u64(1).f64(0.002).u64(1).f64(0.5).u64(1).text("mid").u64(1).u32(0)
}

fn option() -> NamedValues {
    vec![("later".into(), "7".into())]
}

fn option_bytes(bytes: Bytes) -> Bytes {
    bytes.u64(1).text("later").text("7")
}

fn diagnostic() -> Diagnostic {
    let place = Written { file: "s.toml".into(), position: Some((3, 1)), excerpt: None };
    Diagnostic::warning(code::LIKELY_UNIT, "2.6 kg/m3").about("rock.0.density").at(place).try_instead("2600")
}

fn diagnostic_bytes(bytes: Bytes) -> Bytes {
    let bytes = bytes.u32(1).text("likely-unit").byte(1).text("rock.0.density");
    let bytes = bytes.byte(1).text("s.toml").byte(1).u32(3).u32(1).byte(0);
    bytes.text("2.6 kg/m3").byte(1).text("2600")
}

fn torn() -> Torn {
    Torn { part: "rope".into(), elements: 2, first: 0.25, last: 0.5, force: 3e5, member: "element 7".into() }
}

fn torn_bytes(bytes: Bytes) -> Bytes {
    bytes.text("rope").u64(2).f64(0.25).f64(0.5).f64(3e5).text("element 7")
}

fn part_use() -> PartUse {
    let utilisation = Some(Utilisation { share: 0.75, of: ShareOf::Travel, time: 0.5 });
    PartUse { part: "brakes".into(), utilisation, dissipated: 8e4, stored: 2.5 }
}

fn part_use_bytes(bytes: Bytes) -> Bytes {
    bytes.text("brakes").byte(1).f64(0.75).u32(1).f64(0.5).f64(8e4).f64(2.5)
}

fn verdict() -> Verdict {
    let ending = Ending {
        fate: Fate::LeftTerrain,
        time: 4.0,
        position: [1.0, 2.0, 3.0],
        speed: 7.0,
        on_terrain: false,
    };
    Verdict {
        travel: Some(4.5),
        impact: Some(Touch { time: 1.0, speed: 25.0 }),
        gap: Some(Gap { from: 1.5, until: 1.75, speed: 2.0 }),
        then: Some(ending),
        ..Verdict::of("block", ending).at_net(Fate::WentThrough, 2.0, 9.0, None)
    }
}

fn verdict_bytes(bytes: Bytes) -> Bytes {
    let bytes = bytes.text("block").u32(2).f64(2.0).f64(9.0).byte(0).byte(1).f64(4.5).byte(0);
    let bytes = bytes.byte(1).f64(1.0).f64(25.0).byte(0).byte(1).f64(1.5).f64(1.75).f64(2.0).byte(0).byte(0);
    let bytes = bytes.byte(1).u32(7).f64(4.0).f64(1.0).f64(2.0).f64(3.0).f64(7.0).byte(0);
    bytes.u64(0)
}

#[test]
fn messages_to_a_solver_are_these_bytes() {
    let mut golden = Golden::new("to_solver.json");
    golden.message(ToSolver::Connect, Bytes::message(0));
    assert_eq!(encode(&ToSolver::Connect), [3, 0, 0, 0, 0]);
    let plan = Plan {
        end_time: 1.5,
        window: 1e-3,
        takes: vec![force()],
        gives: vec![],
        partner_mesh: Some(mesh()),
        more_meshes: vec![mesh()],
        options: option(),
    };
    let bytes = force_bytes(Bytes::message(1).f64(1.5).f64(1e-3).u64(1)).u64(0).byte(1);
    golden.message(ToSolver::Prepare(plan), option_bytes(mesh_bytes(mesh_bytes(bytes).u64(1))));
    golden.message(ToSolver::Explain, Bytes::message(2));
    golden.message(ToSolver::Finish { commit: true }, Bytes::message(3).byte(1));
    golden.message(ToSolver::Abort { reason: "fem was lost".into() }, Bytes::message(4).text("fem was lost"));
    golden.message(ToSolver::Save { commit: true }, Bytes::message(5).byte(1));
    golden.message(ToSolver::Resume { state: vec![7, 9] }, Bytes::message(6).u64(2).byte(7).byte(9));
    golden.finish();
}

#[test]
fn messages_from_a_solver_are_these_bytes() {
    let mut golden = Golden::new("from_solver.json");
    let hello = Hello {
        program: "p 1".into(),
        capabilities: vec!["selects".into()],
        scene: "fnv1a64:0".into(),
        repeats: Some(1e-13),
        takes: vec![],
        gives: vec![force()],
        largest_window: 0.25,
        options: option(),
    };
    let bytes = Bytes::message(0).text("p 1").u64(1).text("selects").text("fnv1a64:0").byte(1).f64(1e-13);
    golden.message(FromSolver::Hello(hello), option_bytes(force_bytes(bytes.u64(0).u64(1)).f64(0.25)));
    let bytes = Bytes::message(0).u64(0).u64(0).u64(0).byte(0).u64(0).u64(0).f64(f64::INFINITY).u64(0);
    golden.message(FromSolver::Hello(Hello::default()), bytes);
    let progress = Progress { what: "form finding".into(), done: 0.5, options: option() };
    golden.message(
        FromSolver::Progress(progress),
        option_bytes(Bytes::message(1).text("form finding").f64(0.5)),
    );
    let gauge = Gauge { name: "sag".into(), unit: "m".into(), role: Role::Stored, extremes: true };
    let ready = Ready {
        mesh: mesh(),
        gauges: vec![gauge],
        initial: vec![0.5],
        warnings: vec![diagnostic()],
        more_meshes: vec![mesh()],
        options: option(),
    };
    let bytes = mesh_bytes(Bytes::message(2)).u64(1).text("sag").text("m").u32(3).byte(1);
    let bytes = mesh_bytes(diagnostic_bytes(bytes.u64(1).f64(0.5).u64(1)).u64(1));
    golden.message(FromSolver::Ready(ready), option_bytes(bytes));
    let fault = Fault::new(FaultKind::Window, diagnostic());
    golden.message(FromSolver::Fault(fault), diagnostic_bytes(Bytes::message(3).u32(1)).u64(0));
    let measure = |time: Option<f64>| Measure::new("peak", 2.0, "N").at(time);
    let of_post = measure(None).of_member(Some("post 3".into())).ranked(60, Worse::Smaller);
    let statistics = Statistics {
        measures: vec![measure(Some(0.5)), of_post],
        verdicts: vec![verdict()],
        torn: Some(vec![torn()]),
        parts: Some(vec![part_use()]),
        counts: vec![("steps".into(), 7)],
        warnings: vec![],
        cpu_seconds: 1.0,
        solve_seconds: 2.0,
        peak_memory: 3,
        options: option(),
    };
    let bytes = Bytes::message(4).u64(2).text("peak").f64(2.0).text("N").byte(1).f64(0.5).byte(0);
    let bytes =
        bytes.u16(1000).u32(2).text("").text("peak").f64(2.0).text("N").byte(0).byte(1).text("post 3");
    let bytes = verdict_bytes(bytes.u16(60).u32(1).text("").u64(1));
    let bytes = part_use_bytes(torn_bytes(bytes.byte(1).u64(1)).byte(1).u64(1));
    let bytes = bytes.u64(1).text("steps").u64(7).u64(0);
    golden.message(FromSolver::Statistics(statistics), option_bytes(bytes.f64(1.0).f64(2.0).u64(3)));
    golden.message(FromSolver::Saved { state: vec![7, 9] }, Bytes::message(5).u64(2).byte(7).byte(9));
    golden.message(FromSolver::Resumed, Bytes::message(6));
    golden.finish();
}

#[test]
fn enums_have_the_numbers_of_the_page() {
    let number = |bytes: Vec<u8>| bytes[0];
    use Sampling::*;
    assert_eq!([AtEnds, FromStart, Means, Once].map(|s| number(pack(&s))), [0, 1, 2, 3]);
    assert_eq!(
        [Place::Node, Place::Line, Place::Face, Place::Whole, Place::Pair].map(|p| number(pack(&p))),
        [0, 1, 2, 3, 4]
    );
    let roles = [Role::None, Role::Kinetic, Role::Potential, Role::Stored, Role::Dissipated, Role::Received];
    assert_eq!(roles.map(|r| number(pack(&r))), [0, 1, 2, 3, 4, 5]);
    let kinds =
        [FaultKind::Input, FaultKind::Window, FaultKind::Broken, FaultKind::Interrupted, FaultKind::Beyond];
    assert_eq!(kinds.map(|k| number(pack(&k))), [0, 1, 2, 3, 4]);
}

#[test]
fn headers_have_the_layout_of_the_page() {
    use std::mem::{offset_of, size_of};
    assert_eq!(
        (size_of::<ControlHeader>(), size_of::<RequestHeader>(), size_of::<AnswerHeader>()),
        (24, 64, 64)
    );
    assert_eq!((offset_of!(ControlHeader, part), offset_of!(ControlHeader, more)), (8, 16));
    assert_eq!((offset_of!(RequestHeader, window), offset_of!(RequestHeader, iteration)), (16, 24));
    assert_eq!((offset_of!(RequestHeader, command), offset_of!(RequestHeader, start)), (28, 32));
    assert_eq!((offset_of!(AnswerHeader, status), offset_of!(AnswerHeader, length)), (28, 40));
    assert_eq!((offset_of!(RequestHeader, selection), offset_of!(RequestHeader, listed)), (48, 52));
    assert_eq!((offset_of!(RequestHeader, nodes), offset_of!(AnswerHeader, listed)), (56, 52));
}

#[test]
fn headers_are_these_bytes() {
    /// The bytes of a header without padding.
    fn of<T>(header: &T) -> &[u8] {
        // SAFETY: plain data without padding, as the test above says of each.
        unsafe { std::slice::from_raw_parts(std::ptr::from_ref(header).cast(), size_of::<T>()) }
    }
    let mut golden = Golden::new("headers.json");
    let mut header = |name: &str, fields: &str, own: &[u8], bytes: Bytes| {
        assert_eq!(own, bytes.0, "{name}");
        golden.line(&format!("{{\"{name}\": {{{fields}}}}}"), own);
    };
    let control = ControlHeader { run: 7, part: 2, parts: 3, more: 1, reserved: 0 };
    let bytes = Bytes::default().u64(7).u32(2).u32(3).u32(1).u32(0);
    let fields = r#""run": 7, "part": 2, "parts": 3, "more": 1, "reserved": 0"#;
    header("ControlHeader", fields, of(&control), bytes);
    let request = RequestHeader {
        run: 7,
        sequence: 8,
        window: 9,
        iteration: 4,
        command: 2,
        start: 0.5,
        length: 0.25,
        selection: 1,
        listed: 5,
        nodes: 3,
        reserved: 0,
    };
    let bytes = Bytes::default().u64(7).u64(8).u64(9).u32(4).u32(2).f64(0.5).f64(0.25);
    let fields = r#""run": 7, "sequence": 8, "window": 9, "iteration": 4, "command": 2, "start": 0.5, "length": 0.25, "selection": 1, "listed": 5, "nodes": 3, "reserved": 0"#;
    header("RequestHeader", fields, of(&request), bytes.u32(1).u32(5).u32(3).u32(0));
    let answer = AnswerHeader { listed: 6, ..AnswerHeader::echo(&request, Status::Beyond) };
    let bytes = Bytes::default().u64(7).u64(8).u64(9).u32(4).u32(3).f64(0.5).f64(0.25);
    let fields = r#""run": 7, "sequence": 8, "window": 9, "iteration": 4, "status": 3, "start": 0.5, "length": 0.25, "selection": 1, "listed": 6, "reserved": [0, 0]"#;
    header("AnswerHeader", fields, of(&answer), bytes.u32(1).u32(6).u32(0).u32(0));
    golden.finish();
}

#[test]
fn what_is_no_message_is_refused_with_the_reason() {
    let refused = |bytes: &[u8]| decode::<ToSolver>(bytes).unwrap_err();
    assert_eq!(refused(&[]), DecodeError::Protocol(None));
    assert_eq!(refused(&[0, 0, 0, 0, 0]), DecodeError::Protocol(Some(0)));
    assert!(refused(&[0]).to_string().contains("speaks protocol 0, this program speaks protocol 3"));
    let earlier = decode::<FromSolver>(&[2, 6, 0, 0, 0]).unwrap_err();
    assert_eq!(earlier, DecodeError::Protocol(Some(2)));
    assert!(earlier.to_string().contains("speaks protocol 2, this program speaks protocol 3"), "{earlier}");
    for malformed in [&[3, 9, 0, 0, 0][..], &[3, 0, 0], &[3, 0, 0, 0, 0, 7]] {
        assert!(matches!(refused(malformed), DecodeError::Malformed(_)), "{malformed:?}");
    }
    // A length that no memory holds is not asked for.
    let huge = Bytes::message(4).u64(u64::MAX).0;
    assert!(matches!(refused(&huge), DecodeError::Malformed(_)));
}

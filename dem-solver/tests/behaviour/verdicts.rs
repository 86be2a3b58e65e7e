//! Measures along the impact direction, and the sentence on each rock: against closed forms and against the positions of
//! the rows.

use crate::bench::{Bench, Setup, fixed_plane, net, sphere};
use interface_defs::diagnostic::Diagnostic;
use interface_defs::message::Measure;
use interface_defs::verdict::Fate;
use interface_defs::{InterfaceMesh, Solver};
use nalgebra::Vector3;

/// A mesh of the plane z = 0 stood upright: its x along y, its y along z, at x = 0.
fn upright(mut mesh: InterfaceMesh) -> InterfaceMesh {
    for c in mesh.coordinates.chunks_exact_mut(3) {
        (c[0], c[1], c[2]) = (c[2], c[0], c[1]);
    }
    mesh
}

const LINEAR: &str = "[[contact]]\nlaw = \"linear\"\nstiffness = 1e6\n";

/// A ball of 10 kg and 0.1 m.
fn ball(more: &str) -> String {
    sphere(0.1, 10.0 / (4.0 / 3.0 * std::f64::consts::PI * 1e-3), more)
}

fn scene(gravity: f64, rock: &str, contact: &str) -> String {
    format!(
        "end_time = 9.0\ngravity = [0.0, 0.0, {gravity:?}]\n{}{LINEAR}{contact}\n[dem]\ntime_step = 1e-5\n",
        ball(rock)
    )
}

/// Run in windows of 1 ms; time, position and velocity at the end of each.
fn rows(bench: &mut Bench, end: f64) -> Vec<(f64, Vector3<f64>, Vector3<f64>)> {
    let mut rows = vec![(0.0, bench.position(), bench.velocity())];
    while bench.time < end - 1e-9 {
        bench.advance(1e-3);
        rows.push((bench.time, bench.position(), bench.velocity()));
    }
    rows
}

struct End {
    measures: Vec<Measure>,
    warnings: Vec<String>,
    verdict: String,
    fate: Fate,
}

impl End {
    fn of(bench: &mut Bench) -> Self {
        let end = bench.solver.finish().expect("finished");
        let [verdict] = &end.verdicts[..] else { panic!("one verdict per rock: {:?}", end.verdicts) };
        println!("{verdict}");
        let warnings = end.warnings.iter().map(Diagnostic::to_string).collect();
        Self { measures: end.measures, warnings, verdict: verdict.to_string(), fate: verdict.fate }
    }

    fn find(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| m.name == name).map(|m| m.value)
    }

    fn value(&self, name: &str) -> f64 {
        self.find(name).unwrap_or_else(|| panic!("no {name}: {:?}", self.warnings))
    }

    fn says(&self, words: &str) {
        assert!(self.verdict.contains(words), "{words:?} is not in {:?}", self.verdict);
    }

    /// The number before `unit` after `words` in the verdict.
    fn number(&self, words: &str) -> f64 {
        let rest = self.verdict.split_once(words).unwrap_or_else(|| panic!("{words:?}: {}", self.verdict)).1;
        let word = rest.split_whitespace().next().expect("a number");
        word.trim_end_matches([',', ';']).parse().unwrap_or_else(|e| panic!("{word:?}: {e}"))
    }
}

/// Without gravity the ball is a mass on a spring: x'' = -k/m x from the first touch on.
#[test]
fn a_ball_against_an_upright_net_is_measured_along_its_impact_direction() {
    let x: Vector3<f64> = Vector3::x();
    for (velocity, direction) in [([6.0, 0.0, 0.0], x), ([-4.0, 0.0, 0.0], -x)] {
        let start = -0.5 * direction.x;
        let rock = format!("position = [{start:?}, 0.0, 0.0]\nvelocity = {velocity:?}");
        let mut bench =
            Setup::new(scene(0.0, &rock, "restitution = 1.0"), upright(fixed_plane(2.0, 3))).build();
        rows(&mut bench, 0.2);
        let end = End::of(&mut bench);
        let (speed, root): (f64, f64) = (Vector3::from(velocity).norm(), (10.0_f64 / 1e6).sqrt());
        assert!((end.value("impact_speed") - speed).abs() < 1e-9);
        assert!((end.value("time_of_impact") - 0.4 / speed).abs() < 1e-9);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            assert!((end.value(&format!("impact_velocity_{name}")) - velocity[axis]).abs() < 1e-12);
            assert!((end.value(&format!("impact_direction_{name}")) - direction[axis]).abs() < 1e-12);
        }
        // Ends of steps of 1e-5 s: the peak lies at most half a step beside one.
        let travel = speed * root;
        assert!((end.value("max_travel") / travel - 1.0).abs() < 2e-5, "{}", end.value("max_travel"));
        let braking = std::f64::consts::FRAC_PI_2 * root;
        assert!((end.value("braking_time") - braking).abs() < 2e-6, "{}", end.value("braking_time"));
        assert!((end.value("rebound_speed") - speed).abs() < 1e-3 * speed);
        assert!((end.value("max_penetration") - travel / 0.1).abs() < 1e-4);
        assert!(end.find("max_deflection").is_none());
        assert!(end.warnings.iter().any(|w| w.contains("max_deflection") && w.contains("no gravity")));
        end.says("rebounded from the net");
        assert!((end.number("from the net with ") - speed).abs() < 0.006);
    }
}

/// With gravity, judged by the rows: the direction at the touch, the travel and the stop along it.
#[test]
fn an_oblique_impact_travels_and_brakes_along_its_own_direction_and_has_no_depth() {
    let rock = "position = [-2.0, 0.0, 0.0]\nvelocity = [6.0, 0.0, 4.0]";
    let mut bench = Setup::new(scene(-9.81, rock, "restitution = 0.5"), upright(fixed_plane(6.0, 2))).build();
    let rows = rows(&mut bench, 0.6);
    let end = End::of(&mut bench);
    let time = 1.9 / 6.0;
    let velocity = Vector3::new(6.0, 0.0, 4.0 - 9.81 * time);
    let direction = velocity.normalize();
    assert!((end.value("time_of_impact") - time).abs() < 1e-9);
    assert!((end.value("impact_speed") - velocity.norm()).abs() < 1e-8);
    assert!((end.value("impact_velocity_z") - velocity.z).abs() < 1e-8);
    let touch = Vector3::new(-0.1, 0.0, 4.0 * time - 0.5 * 9.81 * time * time);
    let travel =
        rows.iter().filter(|r| r.0 > time).map(|r| (r.1 - touch).dot(&direction)).fold(0.0, f64::max);
    let measured = end.value("max_travel");
    assert!(measured >= travel - 1e-9 && (measured - travel) < 1e-4, "{measured} {travel}");
    let stop = rows.iter().find(|r| r.0 > time && r.2.dot(&direction) <= 0.0).expect("it stopped").0;
    let stopped = time + end.value("braking_time");
    assert!(stopped <= stop && stopped > stop - 1e-3, "{stopped} {stop}");
    let why = end.warnings.iter().find(|w| w.contains("max_deflection")).expect("a reason");
    let angle = direction.angle(&-Vector3::z()).to_degrees();
    assert!(why.contains(&format!("{angle:.1} degrees")), "{why}");
}

/// A drop that is 20 degrees off gravity still has a depth, one of 40 degrees has none.
#[test]
fn a_depth_is_measured_within_thirty_degrees_of_gravity() {
    for (degrees, depth) in [(20.0_f64, true), (29.0, true), (31.0, false), (40.0, false)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let rock =
            format!("position = [0.0, 0.0, 0.100001]\nvelocity = [{:?}, 0.0, {:?}]", 5.0 * sin, -5.0 * cos);
        let mut bench = Setup::new(scene(-9.81, &rock, "restitution = 1.0"), fixed_plane(4.0, 1)).build();
        let rows = rows(&mut bench, 0.02);
        let end = End::of(&mut bench);
        assert_eq!(end.find("max_deflection").is_some(), depth, "{degrees}: {:?}", end.warnings);
        if depth {
            let lowest = rows.iter().map(|r| 0.1 - r.1.z).fold(0.0, f64::max);
            let measured = end.value("max_deflection");
            assert!(measured >= lowest && measured < lowest + 1e-3, "{measured} {lowest}");
        }
    }
}

/// The net swings by a known amount: its largest displacement along the impact direction is that of the node that has it.
#[test]
fn the_elongation_is_the_largest_displacement_of_a_node_along_the_impact_direction() {
    let rock = "position = [-0.13, 0.0, 0.0]\nvelocity = [3.0, 4.0, 0.0]";
    let mesh = upright(net(4, 0.5, 0.01));
    let mut bench = Setup::new(scene(0.0, rock, "restitution = 1.0"), mesh.clone()).build();
    let displacement = |node: usize, t: f64| {
        let y = mesh.coordinates[3 * node + 1];
        let swing = 0.02 * (10.0 * t).sin();
        Vector3::new(swing * (1.0 + y), 0.5 * swing, 3.0 * swing)
    };
    let mut seen = Vec::new();
    while bench.time < 0.5 {
        let t = bench.time;
        bench.displace(0, |node, _| displacement(node, t));
        bench.displace(1, |node, _| displacement(node, t + 1e-3));
        bench.advance(1e-3);
        seen.push(t);
    }
    let end = End::of(&mut bench);
    let direction = Vector3::new(0.6, 0.8, 0.0);
    let impact = end.value("time_of_impact");
    let along =
        |t: f64| (0..mesh.node_count()).map(|n| displacement(n, t).dot(&direction)).fold(f64::MIN, f64::max);
    let expected = seen.iter().filter(|t| **t > impact).map(|t| along(*t)).fold(f64::MIN, f64::max);
    assert!((end.value("max_elongation") - expected).abs() < 1e-12, "{}", end.value("max_elongation"));
}

/// After a wire tears at 0.1 s a part of the net flies off at 90 m/s: that is no elongation.
#[test]
fn the_elongation_of_a_net_that_tears_is_that_before() {
    let rock = "position = [-0.13, 0.0, 0.0]\nvelocity = [3.0, 0.0, 0.0]";
    let setup = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01)));
    let mut bench = Setup { broken: true, ..setup }.build();
    let tears = 0.1;
    let far = |t: f64| Vector3::new(0.1 * t + if t > tears { 90.0 * (t - tears) } else { 0.0 }, 0.0, 0.0);
    let mut before = f64::MIN;
    while bench.time < 0.2 {
        let t = bench.time;
        bench.displace(0, |_, _| far(t));
        bench.displace(1, |_, _| far(t + 1e-3));
        if t > tears {
            bench.tear(|line| line == 0);
        } else {
            before = before.max(0.1 * t);
        }
        bench.advance(1e-3);
    }
    let end = End::of(&mut bench);
    let measured = end.value("max_elongation");
    assert!((measured - before).abs() < 2e-4, "{measured} {before}");
    assert!(end.warnings.iter().any(|w| w.contains("is that before something of the structure tore")));
}

#[test]
fn the_elongation_of_a_net_that_was_torn_before_is_absent_with_its_reason() {
    let rock = "position = [-0.13, 0.0, 0.0]\nvelocity = [3.0, 0.0, 0.0]";
    let setup = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01)));
    let mut bench = Setup { broken: true, ..setup }.build();
    bench.tear(|line| line == 0);
    rows(&mut bench, 0.2);
    let end = End::of(&mut bench);
    assert!(end.value("time_of_impact") > 0.0 && end.find("max_elongation").is_none());
    let why = "max_elongation of rock `rock` absent: something of the structure had torn before the impact";
    assert!(end.warnings.iter().any(|w| w == why), "{:?}", end.warnings);
}

/// Without friction and gravity it keeps its 3 m/s along the plane. It has no speed along (3, 0, -5) once it moves up with 9 / 5 m/s: then
/// its speed is the root of 9 + 3.24.
#[test]
fn a_ball_that_goes_on_across_its_impact_direction_is_said_to() {
    for (velocity, says) in [("[3.0, 0.0, -5.0]", true), ("[0.1, 0.0, -5.0]", false)] {
        let rock = format!("position = [0.0, 0.0, 0.2]\nvelocity = {velocity}");
        let mut bench = Setup::new(scene(0.0, &rock, "restitution = 1.0"), fixed_plane(4.0, 2)).build();
        rows(&mut bench, 0.2);
        let end = End::of(&mut bench);
        end.says("rebounded from the net");
        let said = end.verdict.contains("where it still moved with 3.50 m/s across its impact direction");
        assert_eq!((said, end.verdict.contains("across")), (says, says), "{}", end.verdict);
    }
}

#[test]
fn a_ball_that_a_dashpot_holds_in_the_net_was_stopped() {
    let rock = "position = [0.0, 0.0, 0.2]\nvelocity = [0.0, 0.0, -5.0]";
    let mut bench = Setup::new(scene(-9.81, rock, "damping_ratio = 1.5"), fixed_plane(1.0, 2)).build();
    let rows = rows(&mut bench, 0.5);
    let end = End::of(&mut bench);
    end.says("was stopped by the net in ");
    let last = rows.last().expect("rows");
    assert!(last.1.z < 0.1 && last.2.norm() < 1e-6, "by its rows it lies in the net");
    assert!((end.number("stopped by the net in ") - end.value("braking_time")).abs() < 5.1e-5);
    assert!((end.number("s over ") - end.value("max_travel")).abs() < 5.1e-4);
}

#[test]
fn a_ball_still_on_its_way_down_was_still_being_stopped() {
    let rock = "position = [0.0, 0.0, 0.2]\nvelocity = [0.0, 0.0, -5.0]";
    let mut bench = Setup::new(scene(0.0, rock, "restitution = 1.0"), fixed_plane(1.0, 2)).build();
    let rows = rows(&mut bench, 0.022);
    let end = End::of(&mut bench);
    end.says("was still being stopped");
    assert!((end.number("0.0220 s: ") + rows.last().expect("rows").2.z).abs() < 0.0051);
    assert!(end.find("braking_time").is_none() && end.find("max_travel").is_some());
}

/// A ball of 0.1 m against an upright net of 2 m x 2 m with cells of 0.5 m: its middle, and the four sides.
#[test]
fn a_ball_passes_through_a_cell_over_beside_or_under_a_net_that_it_does_not_touch() {
    let cases = [
        ([0.25, 0.25], Fate::WentThrough, "went through the net without touching it", None),
        ([0.1, 1.5], Fate::PassedOver, "passed over the net", Some(0.5)),
        ([1.6, 0.2], Fate::PassedBeside, "passed beside the net", Some(0.6)),
        ([-1.7, 0.2], Fate::PassedBeside, "passed beside the net", Some(0.7)),
        ([0.1, -1.4], Fate::PassedUnder, "passed under the net", Some(0.4)),
    ];
    for ([y, z], fate, words, distance) in cases {
        let rock = format!("position = [-1.0, {y:?}, {z:?}]\nvelocity = [10.0, 0.0, 0.0]");
        let mut bench =
            Setup::new(scene(0.0, &rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01))).build();
        let rows = rows(&mut bench, 0.3);
        let end = End::of(&mut bench);
        end.says(words);
        assert_eq!(end.fate, fate);
        end.says("still moved with 10.00 m/s near (2.00,");
        assert!(rows.iter().all(|r| r.2 == Vector3::new(10.0, 0.0, 0.0)), "by its rows it touched nothing");
        if let Some(distance) = distance {
            // Less the radius of the ball and that of the wire.
            assert!((end.number("clearance of ") - (distance - 0.11)).abs() < 0.0051);
        }
    }
    // Before it gets there nothing is said of the net.
    let rock = "position = [-1.0, 0.25, 0.25]\nvelocity = [10.0, 0.0, 0.0]";
    let mut bench = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01))).build();
    rows(&mut bench, 0.05);
    End::of(&mut bench).says("rock `rock` still moved with 10.00 m/s near (-0.50,");
}

/// On a parabola: the clearance is the smallest of all rows to the net's top wire.
#[test]
fn the_clearance_of_a_flight_over_the_net_is_the_smallest_distance_of_its_rows() {
    let rock = "position = [-3.0, 0.1, 0.5]\nvelocity = [8.0, 0.0, 4.0]";
    let mut bench = Setup::new(scene(-9.81, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01))).build();
    let rows = rows(&mut bench, 0.7);
    let end = End::of(&mut bench);
    end.says("passed over the net");
    let least = rows.iter().map(|r| r.1.x.hypot(r.1.z - 1.0)).fold(f64::INFINITY, f64::min) - 0.11;
    assert!((end.number("clearance of ") - least).abs() < 0.0055, "{least}");
}

/// It grazes a wire, is turned aside and goes on through a cell.
#[test]
fn a_ball_that_touches_a_wire_and_gets_behind_the_net_went_through() {
    let rock = "position = [-0.5, 0.09, 0.25]\nvelocity = [10.0, 0.0, 0.0]";
    let mut bench = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01))).build();
    let rows = rows(&mut bench, 0.3);
    let end = End::of(&mut bench);
    end.says("went through the net: it touched at ");
    let last = rows.last().expect("rows");
    assert!(last.1.x > 0.5 && last.1.y.abs() < 1.5, "by its rows it is behind the net: {}", last.1);
    let lost = end.number("lost contact at ");
    let touched = end.number("it touched at ");
    assert!(touched < lost && (touched - end.value("time_of_impact")).abs() < 5.1e-5);
    for name in ["max_travel", "max_deflection"] {
        assert!(end.find(name).is_none());
        assert!(end.warnings.iter().any(|w| w.contains(name) && w.contains("went through the net")));
    }
}

/// It grazes the top wire from above and goes on over it.
#[test]
fn a_ball_that_touches_the_top_wire_and_goes_on_above_it_passed_over() {
    let rock = "position = [-0.5, 0.1, 1.1]\nvelocity = [10.0, 0.0, 0.0]";
    let mut bench = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01))).build();
    let rows = rows(&mut bench, 0.3);
    let end = End::of(&mut bench);
    end.says("passed over the net: it touched at ");
    let last = rows.last().expect("rows");
    assert!(last.1.x > 0.5 && last.1.z > 1.1, "by its rows it is behind and above: {}", last.1);
}

/// The same past a net of which a wire has torn: whoever reads only the verdict must learn of it.
#[test]
fn a_net_that_has_torn_is_called_so() {
    let rock = "position = [-0.5, 0.1, 1.1]\nvelocity = [10.0, 0.0, 0.0]";
    let setup = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01)));
    let mut bench = Setup { broken: true, ..setup }.build();
    bench.tear(|line| line == 0);
    rows(&mut bench, 0.3);
    End::of(&mut bench).says("passed over the torn structure: it touched at ");
}

/// A net whose rope has torn falls below the rock that came into it: it went through, not over.
#[test]
fn who_comes_into_a_net_that_tears_and_falls_has_gone_through_it() {
    let rock = "position = [-0.5, 0.09, 0.25]\nvelocity = [10.0, 0.0, 0.0]";
    for (tears, says) in [(true, "went through the torn structure: "), (false, "passed over the net: ")] {
        let setup = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(net(4, 0.5, 0.01)));
        let mut bench = Setup { broken: true, ..setup }.build();
        while bench.time < 0.3 {
            if bench.value("contacts") > 0.0 && tears {
                bench.tear(|line| line == 0);
            }
            // Back and down, as soon as the ball is past the wire.
            let fall = |t: f64| Vector3::new(-60.0, 0.0, -60.0) * (t - 0.055).clamp(0.0, 0.05);
            let t = bench.time;
            bench.displace(0, |_, _| fall(t));
            bench.displace(1, |_, _| fall(t + 1e-3));
            bench.advance(1e-3);
        }
        End::of(&mut bench).says(says);
    }
}

/// The net gives way before the ball, which loses contact in its pocket and finds it again: that is no passing.
#[test]
fn a_ball_that_loses_contact_behind_a_net_that_runs_ahead_has_not_passed() {
    let rock = "position = [-0.15, 0.0, 0.0]\nvelocity = [10.0, 0.0, 0.0]";
    let mut bench = Setup::new(scene(0.0, rock, "restitution = 1.0"), upright(fixed_plane(2.0, 4))).build();
    let moved = |t: f64| Vector3::x() * (20.0 * (t - 0.0055).max(0.0)).min(1.0);
    while bench.time < 0.08 {
        let t = bench.time;
        bench.displace(0, |_, _| moved(t));
        bench.displace(1, |_, _| moved(t + 1e-3));
        bench.advance(1e-3);
    }
    let contacts = bench.value("contacts");
    let end = End::of(&mut bench);
    assert!(contacts == 0.0 && bench.position().x > 0.1 && bench.velocity().x > 5.0, "in flight, net ahead");
    end.says("was still being stopped");
}

/// A torn net that a ball has thrown back over itself lies behind it, along the impact direction; but the ball has rebounded.
#[test]
fn a_ball_that_rebounds_has_not_passed_whatever_the_net_does_then() {
    let rock = "position = [-0.15, 0.0, 0.0]\nvelocity = [10.0, 0.0, 0.0]";
    let setup = Setup::new(scene(0.0, rock, "restitution = 0.5"), upright(fixed_plane(2.0, 4)));
    let mut bench = Setup { broken: true, ..setup }.build();
    // Up and away, then back past the ball.
    let moved = |t: f64| {
        Vector3::z() * (200.0 * (t - 0.03).clamp(0.0, 0.02))
            - Vector3::x() * (100.0 * (t - 0.05).clamp(0.0, 0.03))
    };
    while bench.time < 0.3 {
        let t = bench.time;
        bench.displace(0, |_, _| moved(t));
        bench.displace(1, |_, _| moved(t + 1e-3));
        bench.advance(1e-3);
    }
    assert!(bench.velocity().x < -3.0 && bench.position().x > -3.0 + 0.1, "{}", bench.position());
    let end = End::of(&mut bench);
    assert_eq!(end.fate, Fate::Rebounded);
    assert!(end.value("rebound_speed") > 3.0);
}

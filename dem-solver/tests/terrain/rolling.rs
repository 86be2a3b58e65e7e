//! Rolling resistance of a rock: on the load it rests with, whatever spheres it has, law, step and partner.

use crate::bench::{Bench, G, plane};
use dem_solver::geometry::sphere::direction;
use std::fmt::Write as _;

const RADIUS: f64 = 0.5;
const MU: f64 = 0.1;

/// The laws of a rock on terrain, with `friction` 0.6 and `restitution` 0.4.
const LAWS: [(&str, &str); 4] = [
    ("linear", "law = \"linear\"\nstiffness = 1e7\npoisson = 0.25\n"),
    ("hertz_mindlin", "law = \"hertz_mindlin\"\nyoung = 1e9\npoisson = 0.25\n"),
    ("hertz_rock", "law = \"hertz_rock\"\nyoung = 1e9\npoisson = 0.25\n"),
    ("ground", "law = \"ground\"\nground_modulus = 1e8\nstiffness_ratio = 0.8\npoisson = 0.3\n"),
];

/// A ball of 0.5 m on `t.obj`: one sphere, or `spheres` of 0.95 R that fill it up to bumps of some 0.1 %.
struct Ball {
    radius: f64,
    spheres: usize,
    slope: f64,
    /// Of its lowest point over the plane.
    height: f64,
    speed: f64,
    spin: f64,
}

impl Ball {
    fn rolling(spheres: usize, slope: f64, speed: f64) -> Self {
        Self { radius: RADIUS, spheres, slope, height: 0.0, speed, spin: speed / RADIUS }
    }

    fn bench(&self, law: &str, more: &str) -> Bench {
        let (sin, cos) = self.slope.to_radians().sin_cos();
        let (radius, up) = (self.radius, self.radius + self.height);
        let shape = if self.spheres == 1 {
            format!("shape = {{ type = \"sphere\", radius = {radius} }}")
        } else {
            format!("shape = {{ type = \"sphere\", radius = {radius} }}\ncluster = {{ file = \"ball.txt\" }}")
        };
        let text = format!(
            "end_time = 20.0\ngravity = [0.0, 0.0, {:?}]\n[[rock]]\nposition = [{:?}, 0.0, {:?}]\nvelocity = [{:?}, 0.0, {:?}]\n\
             angular_velocity = [0.0, {:?}, 0.0]\ndensity = 2500.0\n{shape}\n[terrain]\nfile = \"t.obj\"\n[[contact]]\n{law}\
             restitution = 0.4\nfriction = 0.6\n{more}",
            -G,
            up * sin,
            up * cos,
            self.speed * cos,
            -self.speed * sin,
            self.spin,
        );
        Bench::beside(&plane(self.slope, [-10.0, 10.0], 1, 1), &text, true, &[("ball.txt", &self.text())])
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for k in 0..self.spheres {
            let at = direction(k, self.spheres) * (0.05 * self.radius);
            let _ = writeln!(text, "{:?} {:?} {:?} {:?}", at.x, at.y, at.z, 0.95 * self.radius);
        }
        text
    }

    /// Speed along the slope after `time`.
    fn after(&self, law: &str, more: &str, time: f64) -> f64 {
        let mut bench = self.bench(law, more);
        bench.run(2e-3, time);
        let (v, (sin, cos)) =
            (bench.solver.state().bodies[0].motion.velocity, self.slope.to_radians().sin_cos());
        v.x * cos - v.z * sin
    }
}

/// The closed form is `5/7 g mu_r`. What bumps and imprint take is measured without the resistance, and taken off: on `ground`
/// its depth of 1.4 cm.
#[test]
#[ignore = "long"]
fn a_rolling_ball_slows_down_alike_whatever_its_spheres_law_kind_and_step() {
    for (name, law) in LAWS {
        for (spheres, radius) in [(1, RADIUS), (64, RADIUS), (1000, RADIUS), (4000, 0.25)] {
            let ball = Ball { radius, spin: 3.0 / radius, ..Ball::rolling(spheres, 0.0, 3.0) };
            let without = ball.after(law, "", 2.0);
            for more in ["", "rolling = \"spring\"\n", "rolling = \"spring\"\nrolling_damping = 0.0\n"] {
                let after = ball.after(law, &format!("rolling_friction = {MU}\n{more}"), 2.0);
                let slowing = (without - after) / 2.0;
                println!("{name} {spheres} {more:?}: {slowing} beside {}", (3.0 - without) / 2.0);
                assert!(
                    (slowing / (5.0 / 7.0 * G * MU) - 1.0).abs() < 0.02,
                    "{name} {spheres} {more}: {slowing}"
                );
            }
        }
    }
}

/// Out of a drop of 1 m with 0.5 m/s along the ground, which friction alone turns into rolling: `5/7 v`, less a swing of its spring. In the
/// 4 ms of the impact the weight takes another `5/7 g mu_r t`; its force is a hundred times that.
#[test]
fn a_bounce_is_braked_by_the_weight_alone_or_by_its_own_key() {
    for (name, _) in &LAWS[1..3] {
        let law = format!("law = \"{name}\"\nyoung = 1e10\npoisson = 0.25\n");
        let drop = |spin| Ball { height: 1.0, spin, ..Ball::rolling(1, 0.0, 0.5) };
        let without = drop(0.0).after(&law, "", 0.6);
        for kind in ["", "rolling = \"spring\"\n"] {
            for step in ["", "[dem]\ntime_step = 1e-5\n", "[dem]\ntime_step = 5e-5\n"] {
                let out = drop(0.0).after(&law, &format!("rolling_friction = {MU}\n{kind}{step}"), 0.6);
                println!("{name} {kind:?} {step:?}: {out} beside {without}");
                assert!((out / (5.0 / 7.0 * 0.5) - 1.0).abs() < 0.02, "{name} {kind} {step}: {out}");
            }
        }
        // Rolling on impact: in proportion to the key while the rim is as fast as the centre. At 10 the spin stands still, and the
        // spring of friction throws the ball back as it does a block, by no more than the restitution.
        let out = |mu: f64| drop(1.0).after(&law, &format!("rolling_friction_impact = {mu:?}\n"), 0.6);
        let [none, little, twice, much] = [0.0, 0.01, 0.02, 10.0].map(out);
        println!("{name} in impacts: {none} {little} {twice} {much}");
        assert!(
            ((none - twice) / (none - little) - 2.0).abs() < 0.05 && none - twice > 0.02,
            "{none} {little} {twice}"
        );
        assert!(much > -0.4 * 0.5 && much < 0.0, "{much}");
    }
}

/// Held up to `tan = mu_r`, 5.71 degrees; above, a ball rolls off with `5/7 g (sin - mu_r cos)`.
#[test]
fn a_ball_stays_on_a_slope_up_to_the_angle_of_its_rolling_friction() {
    for (name, law) in LAWS {
        let after =
            |slope: f64| Ball::rolling(1, slope, 0.0).after(law, &format!("rolling_friction = {MU}\n"), 3.0);
        let (held, rolls) = (after(5.6), after(5.85));
        println!("{name}: {held} {rolls}");
        let (sin, cos) = 5.85_f64.to_radians().sin_cos();
        let free = 5.0 / 7.0 * G * (sin - MU * cos) * 3.0;
        assert!(
            held.abs() < 1e-3 && rolls > 0.5 * free && rolls < 1.3 * free,
            "{name}: {held} {rolls} {free}"
        );
    }
}

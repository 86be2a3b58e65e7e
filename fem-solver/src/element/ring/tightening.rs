//! The force in a strand of a ring by how far its contacts have drawn it out, and the share of the wires' strength that a
//! bend at a contact leaves.
//!
//! A ring is a bundle of wires as long as its circle, `pi D`; `l` is the perimeter of the polygon through its contacts. What
//! the wire is longer than the polygon lies in the bends at the contacts. The tension `N` shortens these against their plastic
//! moment `M_p`, and stretches the strand:
//!
//! ```text
//! N g = 2 M_p,   g = (pi D - l_0) (1 - t / D) + pi D N / E A - e,   e = l - l_0        M_p = f n s_y d^3 / 6
//! ```
//!
//! `l_0` is the polygon of the round ring, `f` the factor of the bundle. The bundle is `t` thick, and each contact bends it round
//! a neighbour as thick as itself: that takes `t / D` of what there is to draw out.
//!
//! Down from the largest `e` so far, with the tension `N_m` there, it unloads elastically: along the tangent at first, to slack over
//! the way `d = pi D N_m / E A + 1.3 (2 M_p / N_m)`. With `y` from 1 there to 0,
//!
//! ```text
//! N = N_m (k r(y) + (3 - 2 k - s) y^2 + (k + s - 2) y^3)        s = d N'_m / N_m,   r(y) = y, rounded at slack
//! ```
//!
//! The round ring is such a state: it bends elastically, at first as a round ring of `n` wires does, which says `k` (1 at most),
//! until `N_y = 2.3 (2 M_p) / ((pi D - l_0) (1 - t / D))`. Force and slope are continuous everywhere.
//!
//! Against wires of elastic-plastic fibres (3 mm, ring of 0.3 m, 2 to 4 contacts, no friction, thin) the tension is off by -14 to
//! +9 % at all extensions; unloading sets free 0.43 to 0.67 `N_m d / 1.3`, here 0.57.
//!
//! Computed without branches: several rings at a time, each to the same bytes as alone.

use std::f64::consts::PI;

/// Rounding of the corner at slack, as a share of the way from there to the largest extension.
const ROUNDING: f64 = 0.01;
/// Way on which plastic bends spring back, over that along the tangent.
const SPRING_BACK: f64 = 1.3;

/// Strand tension by extension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tightening {
    /// Perimeter of the polygon through the contacts of the round ring, `l_0` [m].
    pub round: f64,
    /// Twice the plastic moment of the bundle, `2 M_p` [N m].
    bend: f64,
    /// Stretch of the strand under its tension, `pi D / E A` [m/N].
    stretch: f64,
    /// Length that can be drawn out, `(pi D - l_0) (1 - t / D)` [m].
    free: f64,
    /// Tension at which bending becomes plastic, `N_y` [N].
    yields: f64,
    /// Slope of unloading near slack, over the mean one.
    pub late: f64,
}

/// Tension at an extension.
#[derive(Debug, Clone, Copy)]
pub struct StrandPull {
    /// Tension [N].
    pub force: f64,
    /// Its slope [N/m].
    pub slope: f64,
    /// Largest extension [m].
    pub most: f64,
}

/// A bundle of wires bent to a ring.
#[derive(Debug, Clone, Copy)]
pub struct Bundle {
    /// Wires side by side.
    pub turns: f64,
    /// Diameter of a wire [m].
    pub wire: f64,
    /// Diameter of the ring [m].
    pub diameter: f64,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Stress at which wires bend plastically, times the factor of the bundle [Pa].
    pub yields: f64,
}

impl Bundle {
    /// Section of all wires [m2].
    pub fn area(&self) -> f64 {
        self.turns * 0.25 * PI * self.wire * self.wire
    }

    /// Diameter of the bundle [m]: exact where wires lie in hexagons (1, 7, 19), within 12 % of the densest packing elsewhere.
    pub fn thickness(&self) -> f64 {
        self.wire * ((4.0 * self.turns - 1.0) / 3.0).sqrt()
    }

    /// Plastic moment of all wires [N m].
    pub fn plastic_moment(&self) -> f64 {
        self.turns * self.yields * self.wire.powi(3) / 6.0
    }

    /// Stiffness of the round ring pulled at two opposite points [N/m]: `E I / (0.149 R^3)`.
    pub fn first_stiffness(&self) -> f64 {
        let bending = self.turns * self.young * PI * self.wire.powi(4) / 64.0;
        bending / ((0.25 * PI - 2.0 / PI) * (0.5 * self.diameter).powi(3))
    }
}

impl Tightening {
    /// Of a ring with so many contacts.
    pub fn new(bundle: &Bundle, contacts: usize) -> Self {
        let (n, diameter) = (contacts as f64, bundle.diameter);
        let (sine, cosine) = (PI / n).sin_cos();
        let round = n * diameter * sine;
        let free = (PI * diameter - round) * (1.0 - bundle.thickness() / diameter);
        let bend = 2.0 * bundle.plastic_moment();
        let stretch = PI * diameter / (bundle.young * bundle.area());
        // Slack with e = 0, plastic where the way back ends.
        let bends = (1.0 + (1.0 + ROUNDING) * SPRING_BACK) * bend;
        let yields = 2.0 * bends / (free + (free * free - 4.0 * ROUNDING * stretch * bends).sqrt());
        // A round ring of bending stiffness E I under n even pulls: dN/dl = E I / (c R^3).
        let of = |n: f64, s: f64, c: f64| PI + n * s * c - 2.0 * n * n * s * s / PI;
        let first = bundle.first_stiffness() * (0.25 * PI - 2.0 / PI) / of(n, sine, cosine);
        let law = Self { round, bend, stretch, free, yields, late: 1.0 };
        // Steeper, and a tight ring would give back more than it took; such a ring yields before, which the straight line stands for.
        let late = f64::min(first * law.back(yields).0 / yields, 1.0);
        Self { late, ..law }
    }

    /// Most that its slope can be [N/m]: that of the strand alone.
    pub fn stiffest(&self) -> f64 {
        1.0 / self.stretch
    }

    /// Extension where bending becomes plastic [m].
    #[inline(always)]
    pub fn first_yield(&self) -> f64 {
        (1.0 + ROUNDING) * self.back(self.yields).0
    }

    /// The way from the tension `force` back to slack [m], over that along the tangent, too.
    #[inline(always)]
    fn back(&self, force: f64) -> (f64, f64) {
        let (stretch, bends) = (self.stretch * force, self.bend / force);
        let way = stretch + SPRING_BACK * bends;
        (way, way / (stretch + bends))
    }

    /// Tension at the extension `e` where all of that is plastic [N].
    #[inline(always)]
    fn plastic(&self, e: f64) -> f64 {
        let gap = self.free - e;
        let root = (gap * gap + 4.0 * self.stretch * self.bend).sqrt();
        // Without the cancellation on either side.
        let (over, under) =
            if gap > 0.0 { (2.0 * self.bend, gap + root) } else { (root - gap, 2.0 * self.stretch) };
        over / under
    }

    /// The larger of this and the extension where bending becomes plastic [m].
    #[inline(always)]
    fn yielded(&self, most: f64) -> f64 {
        let first = self.first_yield();
        if most > first { most } else { first }
    }

    /// Its answer at the extension `e` after the largest extension `most` [m].
    #[inline(always)]
    pub fn pull(&self, e: f64, most: f64) -> StrandPull {
        let largest = self.yielded(most);
        let draws = e >= largest;
        let top = self.plastic(if draws { e } else { largest });
        let (back, steep) = self.back(top);
        let (share, slope, _) = self.unloading(1.0 - (largest - e) / back, steep);
        let drawn = 1.0 / (self.stretch + self.bend / (top * top));
        StrandPull {
            force: if draws { top } else { top * share },
            slope: if draws { drawn } else { top * slope / back },
            most: if draws { e } else { most },
        }
    }

    /// Stored and dissipated energy [J] there; both are 0 in the round ring.
    #[inline(always)]
    pub fn energy(&self, e: f64, most: f64) -> (f64, f64) {
        let largest = self.yielded(if e > most { e } else { most });
        let (top, yields) = (self.plastic(largest), self.yields);
        // Of stretch, and of plastic bends, from the first yield on.
        let since = 0.5 * self.stretch * (top * top - yields * yields) + self.bend * (top / yields).ln();
        let dissipated = self.held(yields, 0.0) + since - self.held(top, 0.0);
        (self.held(top, largest - e), dissipated)
    }

    /// Energy stored so far `beyond` the extension [m] that the tension `force` has drawn out [J].
    #[inline(always)]
    fn held(&self, force: f64, beyond: f64) -> f64 {
        let (back, steep) = self.back(force);
        force * back * self.unloading(1.0 - beyond / back, steep).2
    }

    /// Shape of unloading at `y`, with this slope at 1: its value, slope and integral from slack on.
    #[inline(always)]
    fn unloading(&self, y: f64, steep: f64) -> (f64, f64, f64) {
        const R: f64 = ROUNDING;
        let (rounded, x) = (y < R, if y > -R { y + R } else { 0.0 });
        let value = if rounded { x * x * (1.0 / (4.0 * R)) } else { y };
        let slope = if rounded { x * (1.0 / (2.0 * R)) } else { 1.0 };
        let integral = if rounded { x * x * x * (1.0 / (12.0 * R)) } else { 0.5 * y * y + R * R / 6.0 };
        let (k, z) = (self.late, if y > 0.0 { y } else { 0.0 });
        let (a, b) = (3.0 - 2.0 * k - steep, k + steep - 2.0);
        (
            k * value + z * z * (a + b * z),
            k * slope + z * (2.0 * a + 3.0 * b * z),
            k * integral + z * z * z * (a * (1.0 / 3.0) + 0.25 * b * z),
        )
    }
}

/// Strand force that a ring bears by how sharply contacts turn it: `A s_u / (1 + m (a / 180)^p)` at the angle `a` [degrees].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// Straight [N]; infinite = never breaks.
    pub straight: f64,
    /// `m`, 0 or more.
    loss: f64,
    /// `p`.
    power: f64,
}

impl Strength {
    /// With shares of the `straight` strength [N] at turns of 90 and 180 degrees, the second not above the first.
    pub fn new(straight: f64, [at_90, at_180]: [f64; 2]) -> Self {
        let [half, loss] = [at_90, at_180].map(|share| 1.0 / share - 1.0);
        let power = if half > 0.0 { (loss / half).log2() } else { 0.0 };
        Self { straight, loss, power }
    }

    /// The same however it is turned.
    pub fn even(straight: f64) -> Self {
        Self::new(straight, [1.0, 1.0])
    }

    /// The force that it bears where a contact turns it by `angle` [rad].
    pub fn at(&self, angle: f64) -> f64 {
        if self.loss == 0.0 {
            self.straight
        } else {
            self.straight / (1.0 + self.loss * (angle / PI).powf(self.power))
        }
    }

    /// The least of these, where a contact turns it by 180 degrees.
    #[inline(always)]
    pub fn turned_back(&self) -> f64 {
        self.straight / (1.0 + self.loss)
    }

    /// Share of the strength that a turn of 180 degrees leaves of so many wires: `0.45 (1 - 1.35 / n)`, of fewer than 3 as of 3.
    ///
    /// Fitted to the break of nine chains of three rings, 3 to 19 turns of 2.2 and 3 mm (Guo, Net_panel_analysis, Zenodo 6482654):
    /// within 9 %. No theory: why few wires bear so much less at a sharp bend is not known.
    pub fn share_at_180(turns: f64) -> f64 {
        0.45 * (1.0 - 1.35 / turns.max(3.0))
    }
}

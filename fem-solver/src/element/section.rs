//! Steel sections by name: area, inertia, torsion constant and plastic moduli from their dimensions, and fibres, of which a beam
//! yields.
//!
//! Fibres are the points of Gauss's rule in rectangles and rings that no axis of symmetry cuts: their sums give area, second
//! moments and plastic moduli of the outline exactly, the plastic moduli of round ones to 0.3 %.
//!
//! Sources: EN 10365:2017 (HEA, HEB), EN 10210-2 (tubes: diameter and wall); torsion constant of an H section with its fillets:
//! SCI P363 (2013), 3.2.2; yield strengths and elastic constants: EN 1993-1-1, table 3.1 (up to 40 mm) and 3.2.6.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Height, width, web, flange, radius of the fillets [mm] of each profile, beside its height by name.
type Profiles = [(u32, [f64; 5]); 11];

const HEA: Profiles = [
    (100, [96.0, 100.0, 5.0, 8.0, 12.0]),
    (120, [114.0, 120.0, 5.0, 8.0, 12.0]),
    (140, [133.0, 140.0, 5.5, 8.5, 12.0]),
    (160, [152.0, 160.0, 6.0, 9.0, 15.0]),
    (180, [171.0, 180.0, 6.0, 9.5, 15.0]),
    (200, [190.0, 200.0, 6.5, 10.0, 18.0]),
    (220, [210.0, 220.0, 7.0, 11.0, 18.0]),
    (240, [230.0, 240.0, 7.5, 12.0, 21.0]),
    (260, [250.0, 260.0, 7.5, 12.5, 24.0]),
    (280, [270.0, 280.0, 8.0, 13.0, 24.0]),
    (300, [290.0, 300.0, 8.5, 14.0, 27.0]),
];
const HEB: Profiles = [
    (100, [100.0, 100.0, 6.0, 10.0, 12.0]),
    (120, [120.0, 120.0, 6.5, 11.0, 12.0]),
    (140, [140.0, 140.0, 7.0, 12.0, 12.0]),
    (160, [160.0, 160.0, 8.0, 13.0, 15.0]),
    (180, [180.0, 180.0, 8.5, 14.0, 15.0]),
    (200, [200.0, 200.0, 9.0, 15.0, 18.0]),
    (220, [220.0, 220.0, 9.5, 16.0, 18.0]),
    (240, [240.0, 240.0, 10.0, 17.0, 21.0]),
    (260, [260.0, 260.0, 10.0, 17.5, 24.0]),
    (280, [280.0, 280.0, 10.5, 18.0, 24.0]),
    (300, [300.0, 300.0, 11.0, 19.0, 27.0]),
];
/// Points of Gauss's rule with two of them, in parts of an interval.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];
/// Fibres around a round section, and around the wires of a bundle, of which a ring has many: their plastic modulus is that of
/// the circle to 1.5 %.
const AROUND: u32 = 24;
const AROUND_WIRE: u32 = 16;

/// A structural steel of EN 1993-1-1: 210 GPa, 7850 kg/m3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Steel {
    /// 235 MPa.
    S235,
    /// 275 MPa.
    S275,
    /// 355 MPa.
    S355,
    /// 420 MPa.
    S420,
    /// 460 MPa.
    S460,
}

impl Steel {
    /// Young's modulus [Pa].
    pub const YOUNG: f64 = 2.1e11;
    /// Density [kg/m3].
    pub const DENSITY: f64 = 7850.0;

    /// Yield strength [Pa].
    pub fn yield_stress(self) -> f64 {
        match self {
            Self::S235 => 235e6,
            Self::S275 => 275e6,
            Self::S355 => 355e6,
            Self::S420 => 420e6,
            Self::S460 => 460e6,
        }
    }
}

/// A part of a section with one strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fibre {
    /// Its place along the two cross axes, from the middle [m].
    pub at: [f64; 2],
    /// Area [m2].
    pub area: f64,
}

impl Fibre {
    /// Weights of the section's strains in its own: stretch, and curvature in each plane.
    pub fn place(&self) -> Vector3<f64> {
        Vector3::new(1.0, self.at[0], self.at[1])
    }
}

/// A section; the web of an H lies along the first cross axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Its fibres.
    pub fibres: Vec<Fibre>,
    /// Torsion constant [m4].
    pub torsion: f64,
}

impl Section {
    /// The section of that name.
    ///
    /// # Errors
    ///
    /// In words, if there is none.
    pub fn named(name: &str) -> Result<Self, String> {
        let plain: String = name.to_uppercase().split_whitespace().collect();
        let of_family = |rest: &str, family: &Profiles| {
            let height: u32 = rest.parse().ok()?;
            let (_, sides) = family.iter().find(|(own, _)| *own == height)?;
            Some(Self::wide_flange(sides.map(|mm| 1e-3 * mm)))
        };
        // HE 160 B, and as it is also written, HEB 160.
        let h_section = plain.strip_prefix("HE").and_then(|rest| {
            let digits = rest.trim_matches(['A', 'B']);
            match rest.replacen(digits, "", 1).as_str() {
                "A" => of_family(digits, &HEA),
                "B" => of_family(digits, &HEB),
                _ => None,
            }
        });
        let round = || {
            let millimetres = |text: &str| text.parse::<f64>().ok().filter(|mm| *mm > 0.0 && mm.is_finite());
            if let Some(rest) = plain.strip_prefix("WIRES") {
                let (count, diameter) = rest.split_once('X')?;
                let count = count.parse().ok().filter(|count| *count > 0)?;
                return Some(Self::wires(count, 1e-3 * millimetres(diameter)?));
            }
            if let Some(rest) = plain.strip_prefix("CHS") {
                let (diameter, wall) = rest.split_once('X')?;
                let (diameter, wall) = (1e-3 * millimetres(diameter)?, 1e-3 * millimetres(wall)?);
                return (2.0 * wall < diameter).then(|| Self::round(diameter, diameter - 2.0 * wall));
            }
            Some(Self::round(1e-3 * millimetres(plain.strip_prefix("ROUND")?)?, 0.0))
        };
        h_section.or_else(round).ok_or_else(|| {
            format!(
                "there is no section {name:?}: HE 100 A to HE 300 A and HE 100 B to HE 300 B in steps of 20, CHS 101.6x6.3 \
                 (diameter, wall), ROUND 20 and WIRES 7x3 (7 wires of 3) in mm are known"
            )
        })
    }

    /// An H of height, width, web, flange and radius of its fillets [m].
    fn wide_flange([height, width, web, flange, radius]: [f64; 5]) -> Self {
        let (inner, half) = (0.5 * height - flange, 0.5 * width);
        let mut section = Self { fibres: Vec::new(), torsion: 0.0 };
        for [a, b] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            section.rectangle([a * inner, a * (inner + flange)], [0.0, b * half], [1, 2]);
            section.rectangle([0.0, a * inner], [0.0, 0.5 * b * web], [2, 1]);
            // A square less a quarter of a circle; where its centroid lies from the corner.
            let deep = radius * (5.0 / 6.0 - PI / 4.0) / (1.0 - PI / 4.0);
            let at = [a * (inner - deep), b * (0.5 * web + deep)];
            section.fibres.push(Fibre { at, area: radius * radius * (1.0 - PI / 4.0) });
        }
        let joint = ((radius + 0.5 * web).powi(2) + (radius + flange).powi(2) - radius * radius)
            / (2.0 * radius + flange);
        let share = web / flange * (0.145 + 0.1 * radius / flange);
        section.torsion = 2.0 / 3.0 * (width - 0.63 * flange) * flange.powi(3)
            + (height - 2.0 * flange) * web.powi(3) / 3.0
            + 2.0 * share * joint.powi(4);
        section
    }

    /// A tube or bar of two diameters [m].
    fn round(outer: f64, inner: f64) -> Self {
        let (from, to) = (0.5 * inner, 0.5 * outer);
        let rings = if inner > 0.0 { 1 } else { 2 };
        let fibres = Self::circles((from, to), rings, AROUND);
        Self { fibres, torsion: 0.5 * PI * (to.powi(4) - from.powi(4)) }
    }

    /// So many wires of a diameter [m] side by side, each of which bends and twists about its own middle.
    fn wires(count: u32, diameter: f64) -> Self {
        let (count, radius) = (f64::from(count), 0.5 * diameter);
        let mut fibres = Self::circles((0.0, radius), 1, AROUND_WIRE);
        fibres.iter_mut().for_each(|fibre| fibre.area *= count);
        Self { fibres, torsion: count * 0.5 * PI * radius.powi(4) }
    }

    /// Fibres between two radii [m], in so many rings, each of so many pairs around.
    fn circles((from, to): (f64, f64), rings: u32, around: u32) -> Vec<Fibre> {
        let (wide, angle) = ((to - from) / f64::from(rings), TAU / f64::from(around));
        let mut fibres = Vec::new();
        for k in 0..around {
            let (sine, cosine) = (angle * (f64::from(k) + 0.5)).sin_cos();
            for radius in (0..rings).flat_map(|i| GAUSS.map(|x| from + wide * (f64::from(i) + x))) {
                let area = 0.5 * wide * radius * angle;
                fibres.push(Fibre { at: [radius * cosine, radius * sine], area });
            }
        }
        fibres
    }

    /// Add a rectangle between two places along each cross axis [m], in so many cells.
    fn rectangle(&mut self, a: [f64; 2], b: [f64; 2], cells: [u32; 2]) {
        let places = |[from, to]: [f64; 2], cells: u32| {
            let wide = (to - from) / f64::from(cells);
            (0..cells).flat_map(move |i| GAUSS.map(|x| from + wide * (f64::from(i) + x)))
        };
        let points = f64::from(4 * cells[0] * cells[1]);
        let area = ((a[1] - a[0]) * (b[1] - b[0])).abs() / points;
        for x in places(a, cells[0]) {
            self.fibres.extend(places(b, cells[1]).map(|y| Fibre { at: [x, y], area }));
        }
    }

    fn sum(&self, of: impl Fn(&Fibre) -> f64) -> f64 {
        self.fibres.iter().map(|fibre| fibre.area * of(fibre)).sum()
    }

    /// Area [m2].
    pub fn area(&self) -> f64 {
        self.sum(|_| 1.0)
    }

    /// Second moments of area for bending in the plane of each cross axis [m4].
    pub fn inertia(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.sum(|fibre| fibre.at[axis] * fibre.at[axis]))
    }

    /// Plastic section moduli for bending in the plane of each cross axis [m3].
    pub fn plastic(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.sum(|fibre| fibre.at[axis].abs()))
    }

    /// Largest distance of its fibres from the middle along each cross axis [m].
    pub fn reach(&self) -> [f64; 2] {
        [0, 1].map(|axis: usize| self.fibres.iter().fold(0.0, |most, f| f64::max(most, f.at[axis].abs())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn h_sections_have_the_values_of_the_tables() {
        // Tables of ArcelorMittal to EN 10365: A [cm2], I_y, W_pl,y, I_z, W_pl,z, I_t [cm4, cm3].
        for (name, table) in [
            ("HE 160 B", [54.25, 2492.0, 354.0, 889.2, 170.0, 31.24]),
            ("HEB 200", [78.08, 5696.0, 642.5, 2003.0, 305.8, 59.28]),
            ("he 300 b", [149.1, 25170.0, 1869.0, 8563.0, 870.1, 185.0]),
            ("HE 100 A", [21.24, 349.2, 83.01, 133.8, 41.14, 5.24]),
            ("HEA200", [53.83, 3692.0, 429.5, 1336.0, 203.8, 20.98]),
        ] {
            let section = Section::named(name).expect("is known");
            let ([i_y, i_z], [w_y, w_z]) = (section.inertia(), section.plastic());
            let own =
                [1e4 * section.area(), 1e8 * i_y, 1e6 * w_y, 1e8 * i_z, 1e6 * w_z, 1e8 * section.torsion];
            for (own, table) in own.iter().zip(table) {
                assert!((own / table - 1.0).abs() < 2e-3, "{name}: {own}, {table}");
            }
        }
    }

    #[test]
    fn round_sections_have_the_values_of_the_circle() {
        // Area, inertia, plastic modulus of a circle.
        let of = |d: f64| [0.25 * PI * d * d, PI / 64.0 * d.powi(4), d.powi(3) / 6.0];
        for (name, outer, inner) in [("CHS 101.6x6.3", 0.1016, 0.089), ("ROUND 20", 0.02, 0.0)] {
            let section = Section::named(name).expect("is known");
            let exact: Vec<f64> = of(outer).iter().zip(of(inner)).map(|(o, i)| o - i).collect();
            let (inertia, plastic) = (section.inertia(), section.plastic());
            assert!((section.area() / exact[0] - 1.0).abs() < 1e-12, "{name}");
            assert!(inertia.iter().all(|i| (i / exact[1] - 1.0).abs() < 1e-12), "{name}");
            assert!(plastic.iter().all(|w| (w / exact[2] - 1.0).abs() < 3e-3), "{name}");
            assert!((section.torsion / (2.0 * exact[1]) - 1.0).abs() < 1e-12, "{name}");
        }
    }

    #[test]
    fn a_bundle_has_the_values_of_its_wires_one_by_one() {
        let (wires, d) = (Section::named("WIRES 7x3").expect("is known"), 3e-3_f64);
        let (inertia, plastic) = (7.0 * PI / 64.0 * d.powi(4), 7.0 * d.powi(3) / 6.0);
        assert!((wires.area() / (7.0 * 0.25 * PI * d * d) - 1.0).abs() < 1e-12);
        assert!((wires.torsion / (2.0 * inertia) - 1.0).abs() < 1e-12);
        for axis in 0..2 {
            assert!((wires.inertia()[axis] / inertia - 1.0).abs() < 1e-12);
            assert!((wires.plastic()[axis] / plastic - 1.0).abs() < 1.5e-2);
        }
    }

    #[test]
    fn what_is_no_section_is_said() {
        for name in [
            "WIRES 7",
            "WIRES 0x3",
            "HE 150 B",
            "HE 160 C",
            "HE 160",
            "IPE 200",
            "CHS 20x10",
            "CHS 20",
            "ROUND",
            "",
        ] {
            assert!(Section::named(name).expect_err("is none").contains("HE 100 A to HE 300 A"), "{name}");
        }
    }
}

//! Damping ratio g of a dashpot `c = 2 g sqrt(m* k)` from the restitution coefficient e and back, for
//! contacts that end when the force ends (rocks do not stick).
//!
//! Linear spring, with w = sqrt(1 - g^2):
//! `e = exp(-(g / w) (pi - atan2(2 g w, 1 - 2 g^2)))`; for g > 1 with w = sqrt(g^2 - 1):
//! `e = exp(-(g / w) ln((g + w) / (g - w)))`.
//!
//! Hertz: the same with g replaced by sqrt(6/5) g, exactly. With x the overlap, v its rate and lengths
//! and times scaled, `v dv/dx = -x^(3/2) - 2 g sqrt(3/2) x^(1/4) v`. In xi = x^(5/4) this is
//! `v dv/dxi = -(4/5) xi - 2 (4/5) sqrt(3/2) g v`, a linear oscillator of frequency sqrt(4/5) and
//! ratio sqrt(6/5) g, and the force ends where that oscillator's does. No fit and no integration is
//! needed. Any energy ~ x^n likewise: the ratio is `sqrt(2 (n - 1) / n) g`. The usual polynomial gives e = 0.972 where 0.98 was asked for.
//!
//! Source: Schwager and Poeschel (2007), Granular Matter 9, 465, for the linear one.

/// Restitution of a linear contact with damping ratio `g` >= 0.
pub fn linear_restitution(g: f64) -> f64 {
    let exponent = if g < 1.0 {
        let w = ((1.0 - g) * (1.0 + g)).sqrt();
        g / w * (2.0 * g * w).atan2((2.0 * g * g) - 1.0)
    } else if g > 1.0 {
        let w = ((g - 1.0) * (g + 1.0)).sqrt();
        // ln((g + w) / (g - w)) = 2 asinh(w), without the cancellation.
        2.0 * g / w * w.asinh()
    } else {
        2.0
    };
    (-exponent).exp()
}

/// Damping ratio of the linear contact of the same restitution as one whose energy goes with overlap^`n`, with ratio `g`.
pub fn as_linear(g: f64, n: f64) -> f64 {
    (2.0 * (n - 1.0) / n).sqrt() * g
}

/// Damping ratio of a linear contact with restitution `e` in (0, 1].
pub fn linear_ratio(e: f64) -> f64 {
    assert!(e > 0.0 && e <= 1.0, "restitution {e}");
    if e == 1.0 {
        return 0.0;
    }
    // Restitution falls with the ratio, below 1 / g^2 from g = 1 on; halve until no number is between.
    let (mut low, mut high) = (0.0, 1.0 + 1.0 / e.sqrt());
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if linear_restitution(middle) > e { low = middle } else { high = middle }
    }
}

/// Damping ratio of a contact whose energy goes with overlap^`n`, with restitution `e` in (0, 1].
pub fn ratio(e: f64, n: f64) -> f64 {
    linear_ratio(e) / (2.0 * (n - 1.0) / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// V-D3, first table: e without and with the end at zero force, printed to eight decimals.
    #[test]
    fn restitution_of_a_damping_ratio_is_that_of_the_table() {
        let rows = [
            (0.02, 0.93908956, 0.93984134, 0.93347101, 0.93436786),
            (0.05, 0.85446789, 0.85875810, 0.84170069, 0.84677626),
            (0.10, 0.72924761, 0.74407940, 0.70735128, 0.72467355),
            (0.20, 0.52662060, 0.57174003, 0.49389768, 0.54540215),
            (0.30, 0.37232610, 0.45097545, 0.33515945, 0.42311318),
            (0.50, 0.16303353, 0.29843606, 0.12788100, 0.27315153),
            (0.70, 0.04598791, 0.21028456, 0.02344500, 0.18915470),
            (0.90, 0.00152376, 0.15528275, 0.0, 0.13791457),
        ];
        // Without the end at zero force: a whole half oscillation. 0.9 is "about 1e-8" for Hertz.
        let whole = |g: f64| (-g * PI / (1.0 - g * g).sqrt()).exp();
        for (g, linear_whole, linear, hertz_whole, hertz) in rows {
            assert!((whole(g) - linear_whole).abs() < 6e-9);
            assert!((linear_restitution(g) - linear).abs() < 6e-9);
            let scaled = 1.2_f64.sqrt() * g;
            assert!((whole(scaled) - hertz_whole).abs() < 1.1e-8, "{}", whole(scaled));
            assert!((linear_restitution(as_linear(g, 2.5)) - hertz).abs() < 6e-9);
        }
    }

    /// V-D3, second table.
    #[test]
    fn damping_ratio_of_a_restitution_is_that_of_the_table() {
        let rows = [
            (0.1, 1.24318785, 1.13487005),
            (0.2, 0.73124693, 0.66753406),
            (0.3, 0.49723939, 0.45391539),
            (0.5, 0.25527564, 0.23303371),
            (0.7, 0.12221475, 0.11156629),
            (0.8, 0.07435510, 0.06787661),
            (0.9, 0.03426520, 0.03127971),
            (0.95, 0.01649823, 0.01506076),
            (0.98, 0.00645713, 0.00589453),
        ];
        for (e, linear, hertz) in rows {
            assert!((linear_ratio(e) - linear).abs() < 6e-9, "{}", linear_ratio(e));
            assert!((ratio(e, 2.5) - hertz).abs() < 6e-9, "{}", ratio(e, 2.5));
        }
    }

    #[test]
    fn the_ratio_is_found_over_the_whole_range() {
        for e in [1e-6, 1e-3, 0.13533528323661, 0.5, 0.999, 1.0 - 1e-9] {
            let back = linear_restitution(linear_ratio(e));
            // Near e = 1 the ratio itself is (1 - e) / pi: its last digits are those of 1 - e.
            assert!((back / e - 1.0).abs() < 1e-12, "{e} {back}");
        }
        assert_eq!(linear_ratio(1.0), 0.0);
    }

    /// The formula changes its form at g = 1/sqrt(2) and at 1; it has no step there.
    #[test]
    fn restitution_falls_steadily_with_the_ratio() {
        let mut last = 1.0;
        for i in 1..3000 {
            let e = linear_restitution(f64::from(i) * 1e-3);
            assert!(e < last && last - e < 4e-3, "g = {} e = {e}", f64::from(i) * 1e-3);
            last = e;
        }
    }
}

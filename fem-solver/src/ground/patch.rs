//! One cell of the surface: a bicubic polynomial from heights and slopes at its four corners (Hermite).

/// Height, slopes and second derivatives at a point, per metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    /// `h` [m].
    pub height: f64,
    /// `h_x`, `h_y`.
    pub slope: [f64; 2],
    /// `h_xx`, `h_xy`, `h_yy` [1/m].
    pub bend: [f64; 3],
}

/// Height, `h_x`, `h_y` and `h_xy` at a point of the grid, per cell: what is known of the surface there [m].
pub(super) type Corner = [f64; 4];

/// Value, slope and second derivative of the four cubic polynomials of Hermite at `t` between 0 and 1: those of the value
/// at 0, of the slope at 0, of the value at 1, of the slope at 1.
fn hermite(t: f64) -> [[f64; 4]; 3] {
    let (s, square) = (1.0 - t, t * t);
    [
        [(1.0 + 2.0 * t) * s * s, t * s * s, square * (3.0 - 2.0 * t), -square * s],
        [-6.0 * t * s, s * (1.0 - 3.0 * t), 6.0 * t * s, t * (3.0 * t - 2.0)],
        [12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0],
    ]
}

/// The surface of a cell with these corners (low x and y; high x; high y; both) at the parts `at` of its sides, which are
/// `size` long [m].
pub(super) fn shape(corners: [&Corner; 4], at: [f64; 2], size: [f64; 2]) -> Shape {
    let (x, y) = (hermite(at[0]), hermite(at[1]));
    // Derivatives of the order `i` along x and `j` along y.
    let sum = |i: usize, j: usize| {
        let mut sum = 0.0;
        for (k, corner) in corners.iter().enumerate() {
            let (a, b) = (2 * (k % 2), 2 * (k / 2));
            let along = |order: usize| x[i][a + order];
            let (value, slope) = (y[j][b], y[j][b + 1]);
            sum += along(0) * (value * corner[0] + slope * corner[2]);
            sum += along(1) * (value * corner[1] + slope * corner[3]);
        }
        sum
    };
    let [dx, dy] = size;
    Shape {
        height: sum(0, 0),
        slope: [sum(1, 0) / dx, sum(0, 1) / dy],
        bend: [sum(2, 0) / (dx * dx), sum(1, 1) / (dx * dy), sum(0, 2) / (dy * dy)],
    }
}

/// A height that the cell does not exceed [m]: the highest of its 16 control points (Bezier); NaN where it is no ground.
pub(super) fn bound(corners: [&Corner; 4]) -> f64 {
    let mut highest = f64::NEG_INFINITY;
    for (k, [height, x, y, xy]) in corners.into_iter().enumerate() {
        if height.is_nan() {
            return f64::NAN;
        }
        let (right, up) = (if k % 2 == 0 { 1.0 } else { -1.0 }, if k / 2 == 0 { 1.0 } else { -1.0 });
        let (x, y, xy) = (right * x / 3.0, up * y / 3.0, right * up * xy / 9.0);
        for control in [*height, height + x, height + y, height + x + y + xy] {
            highest = f64::max(highest, control);
        }
    }
    highest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bicubic_polynomial_is_reproduced_with_its_derivatives_and_bounded() {
        // h = (1 + x - 2 x^2 + 3 x^3)(2 - y + y^2 - y^3 / 2) in a cell of 2 m by 0.5 m.
        let (px, py) = ([1.0, 1.0, -2.0, 3.0], [2.0, -1.0, 1.0, -0.5]);
        let poly = |p: &[f64; 4], t: f64, order: usize| match order {
            0 => p[0] + t * (p[1] + t * (p[2] + t * p[3])),
            1 => p[1] + t * (2.0 * p[2] + t * 3.0 * p[3]),
            _ => 2.0 * p[2] + 6.0 * t * p[3],
        };
        let size = [2.0, 0.5];
        let h = |x: f64, y: f64, i: usize, j: usize| poly(&px, x, i) * poly(&py, y, j);
        let corner = |x: f64, y: f64| {
            let [dx, dy] = size;
            [h(x, y, 0, 0), dx * h(x, y, 1, 0), dy * h(x, y, 0, 1), dx * dy * h(x, y, 1, 1)]
        };
        let corners = [corner(0.0, 0.0), corner(2.0, 0.0), corner(0.0, 0.5), corner(2.0, 0.5)];
        let corners = [&corners[0], &corners[1], &corners[2], &corners[3]];
        let highest = bound(corners);
        for k in 0..=20 {
            let at = [k as f64 / 20.0, (7 * k % 21) as f64 / 20.0];
            let (x, y) = (size[0] * at[0], size[1] * at[1]);
            let is = shape(corners, at, size);
            let exact =
                [h(x, y, 0, 0), h(x, y, 1, 0), h(x, y, 0, 1), h(x, y, 2, 0), h(x, y, 1, 1), h(x, y, 0, 2)];
            let [a, b] = is.slope;
            let [c, d, e] = is.bend;
            for (value, exact) in [is.height, a, b, c, d, e].into_iter().zip(exact) {
                // Heights of some 40 m, divided by the square of half a metre.
                assert!((value - exact).abs() < 1e-11, "{value} {exact}");
            }
            assert!(is.height <= highest);
        }
    }
}

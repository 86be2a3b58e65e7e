//! The loops over all numbers of a local net.

use toolkit::wide;

/// Weights of displacements and velocities at the ends of a segment of `length` [s]: cubic Hermite polynomials and their rates,
/// at the share `t` of it.
pub fn hermite(t: f64, length: f64) -> [[f64; 4]; 2] {
    let (t2, t3) = (t * t, t * t * t);
    let value =
        [2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, (t3 - 2.0 * t2 + t) * length, (t3 - t2) * length];
    let bend = 6.0 * (t2 - t) / length;
    [value, [bend, -bend, 3.0 * t2 - 4.0 * t + 1.0, 3.0 * t2 - 2.0 * t]]
}

/// What a step does to every number, with the same index in each vector. Vectors of numbers: displacements and velocities of the
/// reference at both ends of its segment, and what pushes off it.
pub struct Reference<'a> {
    /// Displacement and velocity at the begin and the end of the segment [m, m, m/s, m/s].
    pub samples: [&'a [f64]; 4],
    /// Weights of them for the displacement and for the velocity at an instant.
    pub weights: [[f64; 4]; 2],
}

impl Reference<'_> {
    #[inline(always)]
    fn at(&self, which: usize, i: usize) -> f64 {
        let w = &self.weights[which];
        let [a, b, c, d] = self.samples.map(|sample| sample[i]);
        w[0] * a + w[1] * b + w[2] * c + w[3] * d
    }

    /// The same with slices that are as long as `numbers`, which lets loops go without a check for each number.
    #[inline(always)]
    fn cut(&self, numbers: usize) -> Reference<'_> {
        Reference { samples: self.samples.map(|sample| &sample[..numbers]), weights: self.weights }
    }
}

/// A net's motion off its reference, see [`super::LocalNet`].
pub struct Off<'a> {
    /// Off the reference [m], and its rate [m/s].
    pub off: &'a mut [f64],
    pub rate: &'a mut [f64],
    /// Acceleration in the step before without and by `K d` [m/s2].
    pub fast: &'a mut [f64],
    pub slow: &'a [f64],
    /// Displacement [m] and velocity [m/s] of the nodes.
    pub place: &'a mut [f64],
    pub velocity: &'a mut [f64],
}

wide! {
    /// Displacement and velocity in the middle of a step of twice `half` [s].
    pub fn to_middle(net: Off<'_>, half: f64, reference: &Reference<'_>) {
        let n = net.off.len();
        let reference = reference.cut(n);
        let (off, rate, fast, slow) = (&net.off[..n], &net.rate[..n], &net.fast[..n], &net.slow[..n]);
        let (place, velocity) = (&mut net.place[..n], &mut net.velocity[..n]);
        for i in 0..n {
            place[i] = reference.at(0, i) + off[i] + half * rate[i];
            velocity[i] = reference.at(1, i) + rate[i] + half * fast[i] + half * slow[i];
        }
    }
}

/// Forces of a step on all numbers [N], and what they accelerate.
pub struct Push<'a> {
    /// Of the contacts.
    pub contact: &'a [f64],
    /// Under which the reference moves as it does.
    pub star: &'a [f64],
    /// Left over at the window's start, and its rate [N/s].
    pub left: &'a [f64],
    pub left_rate: &'a [f64],
    /// Time since that start [s].
    pub time: f64,
    /// One over the mass [1/kg].
    pub inverse_mass: &'a [f64],
    /// Damping in proportion to the mass [1/s].
    pub damping: f64,
    /// Length of the step [s], and for how long `K d` is applied in it.
    pub step: f64,
    pub slow: f64,
}

wide! {
    /// Kick in the middle of a step, and drift to its end, where the reference is.
    pub fn kick(net: Off<'_>, push: &Push<'_>, reference: &Reference<'_>) {
        let n = net.off.len();
        let reference = reference.cut(n);
        let (off, rate, fast, slow) = (&mut net.off[..n], &mut net.rate[..n], &mut net.fast[..n], &net.slow[..n]);
        let (place, velocity) = (&mut net.place[..n], &mut net.velocity[..n]);
        let (contact, star) = (&push.contact[..n], &push.star[..n]);
        let (left, left_rate, inverse_mass) = (&push.left[..n], &push.left_rate[..n], &push.inverse_mass[..n]);
        let half = 0.5 * push.step;
        for i in 0..n {
            let force = contact[i] - star[i] + left[i] + push.time * left_rate[i];
            let before = rate[i];
            let acceleration = force * inverse_mass[i] - push.damping * before;
            let after = before + push.step * acceleration + push.slow * slow[i];
            fast[i] = acceleration;
            rate[i] = after;
            off[i] += half * before + half * after;
            place[i] = reference.at(0, i) + off[i];
            velocity[i] = reference.at(1, i) + after;
        }
    }
}

wide! {
    /// `sum += factor a`.
    pub fn add_scaled(a: &[f64], factor: f64, sum: &mut [f64]) {
        let a = &a[..sum.len()];
        for i in 0..sum.len() {
            sum[i] += factor * a[i];
        }
    }
}

wide! {
    /// `sum -= K at`, with the blocks of `K` for pairs of nodes.
    pub fn pull(pairs: &[[u32; 2]], blocks: &[[f64; 9]], at: &[[f64; 3]], sum: &mut [[f64; 3]]) {
        for (&[i, j], k) in pairs.iter().zip(blocks) {
            let (i, j) = (i as usize, j as usize);
            let (a, b) = (at[i], at[j]);
            let own = &mut sum[i];
            for row in 0..3 {
                own[row] -= k[3 * row] * b[0] + k[3 * row + 1] * b[1] + k[3 * row + 2] * b[2];
            }
            if i != j {
                let other = &mut sum[j];
                for row in 0..3 {
                    other[row] -= k[row] * a[0] + k[3 + row] * a[1] + k[6 + row] * a[2];
                }
            }
        }
    }
}

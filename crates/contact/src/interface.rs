//! The response of layered skin at the interface below its first layer to waves of traction on the
//! surface.
//!
//! A wave has the wave number k and runs along x. On the surface it has the tractions `q_k` along x
//! and `q_t` across, and the pressure `p`. At the interface these give the in-plane strains and the
//! traction
//!
//! ```text
//! e_kk = k (U_q i q_k - U_p p)        s_kz = T_q q_k + i T_p p
//! e_kt = (i k / 2) U_t q_t            s_zz = i S_q q_k - S_p p        s_tz = T_t q_t
//! ```
//!
//! They are the same on both sides of the interface. The eight factors are real; [`Response`] holds
//! them.

use crate::layer::Layer;
use crate::layers::{Block, WaveTable, part_of, times};

/// Waves that are tabulated, by length, mm.
const LONGEST_MM: f64 = 130.0;
const SHORTEST_MM: f64 = 0.1;
const ENTRIES: usize = 512;

/// Displacement (mm/MPa) and traction at the interface over traction on the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Response {
    /// Displacement along the wave, by the traction along it and by the pressure: `U_q`, `U_p`.
    pub along: [f64; 2],
    /// Traction along the wave, likewise: `T_q`, `T_p`.
    pub shear: [f64; 2],
    /// Traction along the normal, likewise: `S_q`, `S_p`.
    pub normal: [f64; 2],
    /// Displacement and traction across the wave, by the traction across it: `U_t`, `T_t`.
    pub across: [f64; 2],
}

impl Response {
    /// Of layers from the surface down, held by something rigid.
    fn of_wave(k: f64, layers: &[Layer]) -> Self {
        let [first, below @ ..] = layers else { return Self::default() };
        let (mut in_plane, mut across): (Block, f64) = ([[0.0; 2]; 2], 0.0);
        for layer in below.iter().rev() {
            in_plane = through(k, layer, in_plane).0;
            across = through_across(k, layer, across).0;
        }
        // Traction at the interface over that on the surface.
        let (_, traction) = through(k, first, in_plane);
        let (_, twist) = through_across(k, first, across);
        let moved = times(in_plane, traction);
        Self {
            along: moved[0],
            shear: traction[0],
            normal: traction[1],
            across: [across * twist, twist],
        }
    }

    fn numbers(self) -> [f64; 8] {
        let Self { along: [a, b], shear: [c, d], normal: [e, f], across: [g, h] } = self;
        [a, b, c, d, e, f, g, h]
    }
}

/// Compliance above a layer, and the traction below it over that above it.
fn through(k: f64, layer: &Layer, mut compliance: Block) -> (Block, Block) {
    let (transfer, parts) = part_of(k, layer);
    let mut traction: Block = [[1.0, 0.0], [0.0, 1.0]];
    for _ in 0..parts {
        let (above, below) = transfer.up(compliance);
        (compliance, traction) = (above, times(traction, below));
    }
    (compliance, traction)
}

/// The same across the wave: `u'' = k^2 u`, traction `mu u'`.
fn through_across(k: f64, layer: &Layer, compliance: f64) -> (f64, f64) {
    let [_, mu] = layer.lame_mpa();
    let x = k * layer.thickness_mm;
    // Over cosh, which would overflow.
    let traction = mu * k * x.tanh() * compliance + 1.0;
    ((compliance + x.tanh() / (mu * k)) / traction, 1.0 / (traction * x.cosh()))
}

/// Responses by wave number.
#[derive(Clone, Debug)]
pub(crate) struct InterfaceResponse(WaveTable<8>);

impl InterfaceResponse {
    /// Of layers from the surface down, held by something rigid.
    pub(crate) fn new(layers: &[Layer]) -> Self {
        let entry = |k| Response::of_wave(k, layers).numbers();
        Self(WaveTable::new([LONGEST_MM, SHORTEST_MM], ENTRIES, entry))
    }

    /// At a wave number, 1/mm; beyond the table's ends as at the end.
    pub(crate) fn at(&self, wave_number: f64) -> Response {
        let [a, b, c, d, e, f, g, h] = self.0.at(wave_number);
        Response { along: [a, b], shear: [c, d], normal: [e, f], across: [g, h] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEPTH_MM: f64 = 0.2;

    /// A half-space under waves: `s_zz = -p (1 + x) exp(-x)` and so on, `x = k z`; strains by
    /// Hooke's law, the rest by equilibrium.
    #[test]
    fn alike_layers_are_a_half_space() {
        let layer = |thickness_mm| Layer { young_mpa: 0.1, poisson: 0.3, thickness_mm };
        let layers = [layer(DEPTH_MM), layer(1.0), layer(60.0)];
        let [lambda, mu] = layers[0].lame_mpa();
        let part = mu / (lambda + mu);
        for k in [0.3, 1.0, 4.0, 15.0] {
            let (x, e) = (k * DEPTH_MM, (-k * DEPTH_MM).exp());
            let found = Response::of_wave(k, &layers);
            let due = Response {
                along: [1.0 + part - x, part - x].map(|v| v * e / (2.0 * mu * k)),
                shear: [(1.0 - x) * e, -x * e],
                normal: [x * e, (1.0 + x) * e],
                across: [e / (mu * k), e],
            };
            for (a, b) in found.numbers().iter().zip(due.numbers()) {
                let scale = if b.abs() < 1e-3 { 1e-3 } else { b.abs() };
                assert!((a - b).abs() < 1e-5 * scale, "{k}: {found:?} {due:?}");
            }
        }
    }

    #[test]
    fn the_table_is_the_wave() {
        let layer = |young_mpa, thickness_mm| Layer { young_mpa, poisson: 0.48, thickness_mm };
        let layers = [layer(0.136, DEPTH_MM), layer(0.08, 1.0), layer(0.034, 3.0)];
        let table = InterfaceResponse::new(&layers);
        for k in [0.21, 1.7, 6.3, 22.0] {
            let (found, due) = (table.at(k).numbers(), Response::of_wave(k, &layers).numbers());
            let size = due.iter().map(|v| v.abs()).fold(0.0, f64::max);
            for (a, b) in found.iter().zip(due) {
                assert!((a - b).abs() < 2e-3 * size, "{k}: {found:?} {due:?}");
            }
        }
    }
}

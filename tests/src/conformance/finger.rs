//! The formulas of docs/reference/protocol-effects.md and docs/reference/atlas.md on the finger, in
//! f64 and in their plainest form. They share nothing with the server, which is compared with them.

use papilla_proto::{
    MAP_LEN, MAP_SIDE_PX,
    atlas::{Atlas, Patch, Raster},
    effects::{Actuator, Layout, Place},
};

use super::inputs::Contact;

/// Where the pixels of a patch are, and the area that each shows.
#[derive(Debug)]
pub(super) struct Surface {
    /// Flat index, place (mm) and area (mm2) of every pixel of the patch.
    pixels: Vec<(usize, [f64; 3], f64)>,
    area_mm2: Vec<f64>,
}

impl Surface {
    pub(super) fn new(atlas: &Atlas, raster: &Raster, patch: Patch) -> Self {
        let vertices = atlas.patch(patch);
        let mut pixels = Vec::new();
        let mut area_mm2 = vec![0.0; MAP_LEN];
        for (&index, pixel) in raster.indices().iter().zip(raster.pixels()) {
            let corners = pixel.vertices.map(|v| vertices.positions_mm[v as usize].map(f64::from));
            let [a, b, c] = pixel.vertices.map(|v| vertices.uv_px[v as usize].map(f64::from));
            let drawn_px2 =
                0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
            let mut place_mm = [0.0; 3];
            for (corner, weight) in corners.iter().zip(pixel.weights) {
                (0..3).for_each(|i| place_mm[i] += f64::from(weight) * corner[i]);
            }
            area_mm2[index as usize] = triangle_mm2(corners) / drawn_px2;
            pixels.push((index as usize, place_mm, area_mm2[index as usize]));
        }
        Self { pixels, area_mm2 }
    }

    /// `sum of value x area` over the patch.
    pub(super) fn integral(&self, value: impl Fn(usize) -> f64) -> f64 {
        self.pixels.iter().map(|&(index, _, area)| value(index) * area).sum()
    }

    fn nearest(&self, at_mm: [f64; 3]) -> (usize, [f64; 3], f64) {
        let mut best = (0, [0.0; 3], f64::INFINITY);
        for &(index, place_mm, _) in &self.pixels {
            let squared = squared(place_mm, at_mm);
            if squared < best.2 {
                best = (index, place_mm, squared);
            }
        }
        best
    }

    /// Value of a field at a place: between four pixels, or of the nearest.
    pub(super) fn at(&self, place: Place, map: &[f64]) -> f64 {
        match place {
            Place::Mm(at_mm) => map[self.nearest(at_mm.map(f64::from)).0],
            Place::Px(at) => {
                let [u, v] = at.map(|c| f64::from(c) - 0.5);
                let (left, top) = (u.floor(), v.floor());
                let mut sums = (0.0, 0.0);
                for (column, row) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    let (column, row) = (left + column, top + row);
                    let index = row as usize * MAP_SIDE_PX + column as usize;
                    let weight = (1.0 - (u - column).abs()) * (1.0 - (v - row).abs());
                    if self.area_mm2[index] > 0.0 {
                        sums = (sums.0 + weight * map[index], sums.1 + weight);
                    }
                }
                sums.0 / sums.1
            }
        }
    }

    /// What a layout's actuator is to do.
    pub(super) fn intensity(&self, layout: &Layout, one: &Actuator, map: &[f64]) -> f64 {
        let f = |of: Option<f32>, all: Option<f32>| f64::from(of.or(all).unwrap_or_default());
        let radius_mm = f(one.radius_mm, layout.radius_mm);
        let centre_mm = match one.at {
            Place::Mm(at_mm) => self.nearest(at_mm.map(f64::from)).1,
            Place::Px([u, v]) => {
                let own = v as usize * MAP_SIDE_PX + u as usize;
                self.pixels.iter().find(|pixel| pixel.0 == own).map_or([f64::NAN; 3], |p| p.1)
            }
        };
        let mut sums = (0.0, 0.0);
        for &(index, place_mm, area) in &self.pixels {
            let weight = area * (1.0 - squared(place_mm, centre_mm) / (radius_mm * radius_mm));
            if weight > 0.0 {
                sums = (sums.0 + weight * map[index], sums.1 + weight);
            }
        }
        let above = sums.0 / sums.1 - f(one.threshold, Some(layout.threshold));
        (f(one.gain, layout.gain) * above).clamp(0.0, f64::from(layout.max))
    }

    /// The pressure of contact points, Pa.
    pub(super) fn contacts(&self, contacts: &[Contact]) -> Vec<f64> {
        let mut map_pa = vec![0.0; MAP_LEN];
        for contact in contacts {
            let (own, centre_mm, off) = self.nearest(contact.at_mm);
            if off.sqrt() > 5.0 {
                continue;
            }
            let radius_mm = contact.radius_mm.unwrap_or(5.1 * contact.force_n.powf(1.0 / 3.0));
            let weight = |index: usize, place_mm: [f64; 3]| {
                let share = 1.0 - squared(place_mm, centre_mm) / (radius_mm * radius_mm);
                if index == own { 1.0 } else { share.max(0.0).sqrt() }
            };
            let sum: f64 =
                self.pixels.iter().map(|&(i, place, area)| weight(i, place) * area).sum();
            for &(index, place_mm, _) in &self.pixels {
                map_pa[index] += 1e6 * contact.force_n * weight(index, place_mm) / sum;
            }
        }
        map_pa
    }
}

fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum()
}

fn triangle_mm2([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (p, q) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    0.5 * normal.iter().map(|n| n * n).sum::<f64>().sqrt()
}

/// The sixteen numbers of a summary.
pub(super) fn summary(
    (skin, interface): (&Surface, &Surface),
    (sent_pa, sed): (&[f32], &[f64]),
    rate_hz: Option<&[f64]>,
    contact_pa: f64,
) -> [f64; 16] {
    let u = |i: usize| (i % MAP_SIDE_PX) as f64 + 0.5;
    let v = |i: usize| (i / MAP_SIDE_PX) as f64 + 0.5;
    let p = |i: usize| f64::from(sent_pa[i]);
    let force = skin.integral(p);
    let energy = interface.integral(|i| sed[i]);
    let mean = |of: &dyn Fn(usize) -> f64| interface.integral(|i| of(i) * sed[i]) / energy;
    let top = (0..MAP_LEN).fold(0, |best, i| if sed[i] > sed[best] { i } else { best });
    let (mu, mv) = (mean(&u), mean(&v));
    [
        1e-6 * force,
        skin.integral(|i| f64::from(u8::from(p(i) > contact_pa))),
        (0..MAP_LEN).map(p).fold(0.0, f64::max),
        skin.integral(|i| u(i) * p(i)) / force,
        skin.integral(|i| v(i) * p(i)) / force,
        sed[top],
        u(top),
        v(top),
        energy,
        mu,
        mv,
        mean(&|i| (u(i) - mu).powi(2)),
        mean(&|i| (u(i) - mu) * (v(i) - mv)),
        mean(&|i| (v(i) - mv).powi(2)),
        energy / interface.integral(|_| 1.0),
        rate_hz.map_or(0.0, |rate| 0.7 * interface.integral(|i| rate[i])),
    ]
}

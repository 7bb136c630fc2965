//! The inputs of the cases, by their formulas (docs/reference/conformance.md).

use papilla_proto::{MAP_LEN, MAP_SIDE_PX};
use serde::Deserialize;
use serde_json::Value;

/// Pressure below which a map is 0, Pa.
const NOTHING_PA: f64 = 1.0;

/// A pressure map by formula.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pressure {
    gaussians: Vec<[f64; 4]>,
    disc: Option<[f64; 4]>,
    bad: Option<(usize, usize, Value)>,
}

/// Values at vertices by formula.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vertices {
    gaussian_mm: [f64; 5],
}

/// A contact point.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// On or near the undeformed skin.
    pub at_mm: [f64; 3],
    /// Normal force, N.
    pub force_n: f64,
    /// Radius of the contact, mm; none: the finger's own on a flat object.
    pub radius_mm: Option<f64>,
}

impl Pressure {
    /// The map times `share`, Pa; samples outside of `window` (column, row, width, height) are 0.
    #[must_use]
    pub fn draw(&self, share: f64, window: Option<[usize; 4]>) -> Vec<f32> {
        let mut map_pa = vec![0.0; MAP_LEN];
        for (index, sample) in map_pa.iter_mut().enumerate() {
            let (row, column) = (index / MAP_SIDE_PX, index % MAP_SIDE_PX);
            let inside = window.is_none_or(|[x, y, width, height]| {
                (x..x + width).contains(&column) && (y..y + height).contains(&row)
            });
            if inside {
                *sample = self.at(column as f64 + 0.5, row as f64 + 0.5, share) as f32;
            }
        }
        if let Some((row, column, value)) = &self.bad
            && let Some(sample) = map_pa.get_mut(row * MAP_SIDE_PX + column)
        {
            *sample = match value.as_str() {
                Some("inf") => f32::INFINITY,
                Some(_) => f32::NAN,
                None => value.as_f64().unwrap_or(f64::NAN) as f32,
            };
        }
        map_pa
    }

    fn at(&self, u: f64, v: f64, share: f64) -> f64 {
        let disc = match self.disc {
            Some([u0, v0, radius, pressure_pa]) if squared(u - u0, v - v0) <= radius * radius => {
                pressure_pa
            }
            _ => 0.0,
        };
        let pressure_pa = self.bumps(u, v) + disc;
        if pressure_pa < NOTHING_PA { 0.0 } else { share * pressure_pa }
    }

    fn bumps(&self, u: f64, v: f64) -> f64 {
        let bump = |&[u0, v0, sigma, peak]: &[f64; 4]| {
            peak * (-squared(u - u0, v - v0) / (2.0 * sigma * sigma)).exp()
        };
        self.gaussians.iter().map(bump).sum()
    }

    /// Whether some pixel lies so near to a limit that another machine's `exp` might decide
    /// otherwise.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        (0..MAP_LEN).any(|i| {
            let (u, v) = ((i % MAP_SIDE_PX) as f64 + 0.5, (i / MAP_SIDE_PX) as f64 + 0.5);
            let rim = self.disc.is_some_and(|[u0, v0, radius, _]| {
                (squared(u - u0, v - v0) - radius * radius).abs() < 1e-6
            });
            rim || (self.bumps(u, v) - NOTHING_PA).abs() < 1e-6
        })
    }
}

fn squared(across: f64, down: f64) -> f64 {
    across * across + down * down
}

impl Vertices {
    /// The value at every vertex.
    #[must_use]
    pub fn values(&self, positions_mm: &[[f32; 3]]) -> Vec<f32> {
        let [x, y, z, sigma_mm, peak] = self.gaussian_mm;
        let value = |position: &[f32; 3]| {
            let off = [0, 1, 2].map(|i| f64::from(position[i]) - [x, y, z][i]);
            let squared = off.iter().map(|d| d * d).sum::<f64>();
            (peak * (-squared / (2.0 * sigma_mm * sigma_mm)).exp()) as f32
        };
        positions_mm.iter().map(value).collect()
    }
}

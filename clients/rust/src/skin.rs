//! Pressure maps from what an engine has (docs/reference/atlas.md, 'Helpers of the clients').

use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, AtlasError, Patch, Raster},
};
use papilla_vector::{cross, minus, norm};

/// Distance from the skin beyond which a contact adds nothing, mm.
const REACH_MM: f64 = 5.0;

/// Radius of a fingertip's contact with a flat object at 1 N, mm (docs/reference/atlas.md).
const RADIUS_AT_1_N_MM: f64 = 5.1;

/// A contact point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// On or near the undeformed skin, in the finger's frame.
    pub at_mm: [f64; 3],
    /// Normal force, N.
    pub force_n: f64,
    /// Radius of the contact, mm.
    pub radius_mm: f64,
}

impl Contact {
    /// A contact with a flat object: its radius is the finger's own at that force (N).
    #[must_use]
    pub fn flat(at_mm: [f64; 3], force_n: f64) -> Self {
        Self { at_mm, force_n, radius_mm: RADIUS_AT_1_N_MM * force_n.cbrt() }
    }
}

/// The skin: where its pixels are and how much of the finger each shows.
///
/// ```
/// use papilla_client::{
///     Contact, Skin,
///     proto::atlas::{Atlas, PatchVertices},
/// };
///
/// // A plane skin of 18 mm, 0.1 mm a pixel; a service's own comes from `papilla_client::atlas`.
/// let uv_px = vec![[20.0, 20.0], [200.0, 20.0], [200.0, 200.0], [20.0, 200.0]];
/// let positions_mm = uv_px.iter().map(|[u, v]| [0.1 * v, -0.1 * u, 0.0]).collect();
/// let patch = PatchVertices { positions_mm, uv_px };
/// let skin = Skin::new(&Atlas::new(0.1, vec![[0, 2, 1], [0, 3, 2]], patch.clone(), patch)?);
///
/// let pressure_pa = skin.contacts(&[Contact::flat([11.0, -11.0, 0.0], 0.5)]);
/// assert!((skin.force_n(&pressure_pa) - 0.5).abs() < 0.01);
/// # Ok::<(), papilla_client::proto::atlas::AtlasError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Skin {
    raster: Raster,
    places_mm: Vec<[f64; 3]>,
    areas_mm2: Vec<f64>,
}

impl Skin {
    /// Makes the tables; some milliseconds.
    #[must_use]
    pub fn new(atlas: &Atlas) -> Self {
        let raster = Raster::new(atlas, Patch::Skin);
        let vertices = atlas.patch(Patch::Skin);
        let (mut places_mm, mut areas_mm2) = (Vec::new(), Vec::new());
        for pixel in raster.pixels() {
            let corners = pixel.vertices.map(|v| vertices.positions_mm[v as usize].map(f64::from));
            let drawn = pixel.vertices.map(|v| vertices.uv_px[v as usize].map(f64::from));
            let weights = pixel.weights.map(f64::from);
            places_mm.push(
                [0, 1, 2].map(|axis| (0..3).map(|i| weights[i] * corners[i][axis]).sum::<f64>()),
            );
            let flat = drawn.map(|[u, v]| [u, v, 0.0]);
            areas_mm2.push(doubled_area(corners) / doubled_area(flat));
        }
        Self { raster, places_mm, areas_mm2 }
    }

    /// Draws a field given at the vertices of the skin into `map` (224 x 224).
    ///
    /// # Errors
    /// Another number of vertices or pixels.
    pub fn rasterise(&self, vertex_values: &[f32], map: &mut [f32]) -> Result<(), AtlasError> {
        self.raster.rasterise(vertex_values, map)
    }

    /// Pressure (Pa) of contact points, each with the pressure of Hertz's contact. One more than
    /// 5 mm from the skin adds nothing.
    #[must_use]
    pub fn contacts(&self, contacts: &[Contact]) -> Vec<f32> {
        let mut map_pa = vec![0.0; MAP_LEN];
        for contact in contacts {
            let squared = |place: &[f64; 3]| apart(*place, contact.at_mm);
            let nearest = self
                .places_mm
                .iter()
                .enumerate()
                .min_by(|(_, a), (_, b)| squared(a).total_cmp(&squared(b)));
            let Some((own, &centre_mm)) = nearest else { continue };
            if squared(&centre_mm) > REACH_MM * REACH_MM {
                continue;
            }
            let reach = contact.radius_mm * contact.radius_mm;
            let weight = |entry: usize| {
                let share = 1.0 - apart(self.places_mm[entry], centre_mm) / reach;
                if entry == own {
                    1.0
                } else if share > 0.0 {
                    share.sqrt()
                } else {
                    0.0
                }
            };
            let sum: f64 = self.areas_mm2.iter().enumerate().map(|(i, a)| weight(i) * a).sum();
            for (entry, &index) in self.raster.indices().iter().enumerate() {
                map_pa[index as usize] += (1e6 * contact.force_n * weight(entry) / sum) as f32;
            }
        }
        map_pa
    }

    /// `1e-6 sum p A` of a pressure map (Pa), N: what a summary calls `force_n`.
    #[must_use]
    pub fn force_n(&self, map_pa: &[f32]) -> f64 {
        let pressures = self.raster.indices().iter().map(|&i| map_pa.get(i as usize).copied());
        let forces = pressures.zip(&self.areas_mm2).map(|(p, a)| f64::from(p.unwrap_or(0.0)) * a);
        1e-6 * forces.sum::<f64>()
    }
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum()
}

fn doubled_area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    norm(cross(minus(b, a), minus(c, a)))
}

//! Where the pixels are on the undeformed finger, and how much of it each shows.

use papilla_proto::{
    MAP_LEN, MAP_SIDE_PX, Problem,
    atlas::{Atlas, Patch, Raster},
    effects::Place,
};
use papilla_vector::{cross, norm};

use super::unusable;

/// Areas and places of all pixels of one atlas.
#[derive(Debug)]
pub(crate) struct Geometry {
    /// Area of the skin that each pixel shows, mm2; 0 outside.
    pub(super) skin_mm2: Vec<f32>,
    /// The same of the interface.
    pub(super) interface_mm2: Vec<f32>,
    /// Area of the whole interface, mm2.
    pub(super) interface_sum_mm2: f64,
    /// Flat index and place, mm, of every pixel of the interface.
    pub(super) interface: Vec<(u32, [f32; 3])>,
}

impl Geometry {
    /// Some milliseconds, to be done once an atlas.
    pub(super) fn new(atlas: &Atlas, skin: &Raster, interface: &Raster) -> Self {
        let interface_mm2 = areas_mm2(atlas, interface, Patch::Interface);
        let places = interface.indices().iter().filter_map(|&index| {
            let (row, column) = (index as usize / MAP_SIDE_PX, index as usize % MAP_SIDE_PX);
            Some((index, interface.position_mm(atlas, row, column)?))
        });
        Self {
            skin_mm2: areas_mm2(atlas, skin, Patch::Skin),
            interface_sum_mm2: interface_mm2.iter().map(|&a| f64::from(a)).sum(),
            interface: places.collect(),
            interface_mm2,
        }
    }

    /// The pixel of the interface nearest to `at_mm`, and its distance, mm.
    pub(super) fn nearest(&self, at_mm: [f32; 3]) -> Option<(u32, f32)> {
        self.interface
            .iter()
            .map(|&(index, place_mm)| (index, squared_distance(place_mm, at_mm)))
            .min_by(|(_, a), (_, b)| a.total_cmp(b))
            .map(|(index, squared)| (index, squared.sqrt()))
    }

    /// The pixel of the interface at `place`, and where that is, mm.
    ///
    /// # Errors
    /// There is no interface there; `what` names the place in the message.
    pub(super) fn locate(
        &self,
        place: Place,
        field: &str,
        what: &dyn std::fmt::Display,
    ) -> Result<(u32, [f32; 3]), Problem> {
        let found = match place {
            Place::Px([u, v]) => {
                let inside = |c: f32| (0.0..MAP_SIDE_PX as f32).contains(&c);
                let index = (inside(u) && inside(v))
                    .then(|| (v as usize * MAP_SIDE_PX + u as usize) as u32);
                index.and_then(|index| self.interface.binary_search_by_key(&index, |p| p.0).ok())
            }
            Place::Mm(at_mm) => {
                let nearest = self.nearest(at_mm).filter(|&(_, mm)| mm <= OFF_MAX_MM);
                nearest.and_then(|(i, _)| self.interface.binary_search_by_key(&i, |p| p.0).ok())
            }
        };
        found.map(|entry| self.interface[entry]).ok_or_else(|| {
            let message = format!(
                "{what} at {place:?} is off the interface; GET /v1/atlas says where that is \
                 (px: inside its mask; mm: within {OFF_MAX_MM} mm)"
            );
            unusable(field, message)
        })
    }
}

/// Greatest distance of a place given in mm from the interface: it may well lie on the skin.
const OFF_MAX_MM: f32 = 2.0;

/// Squared length of the chord between two places, mm2.
pub(super) fn squared_distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Area that each pixel of a patch shows: its triangle's area on the finger over that in the map.
fn areas_mm2(atlas: &Atlas, raster: &Raster, patch: Patch) -> Vec<f32> {
    let vertices = atlas.patch(patch);
    let mm2_per_px2: Vec<f32> = atlas
        .triangles()
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|vertex| vertices.positions_mm[vertex as usize]);
            let side = |p: [f32; 3], q: [f32; 3]| [0, 1, 2].map(|i| f64::from(q[i] - p[i]));
            let doubled_mm2 = norm(cross(side(a, b), side(a, c)));
            let [a, b, c] = corners.map(|vertex| vertices.uv_px[vertex as usize].map(f64::from));
            let doubled_px2 = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
            if doubled_px2 > 0.0 { (doubled_mm2 / doubled_px2) as f32 } else { 0.0 }
        })
        .collect();
    let mut areas = vec![0.0; MAP_LEN];
    for (&index, pixel) in raster.indices().iter().zip(raster.pixels()) {
        areas[index as usize] = mm2_per_px2[pixel.triangle as usize];
    }
    areas
}

//! `points`: values at listed points.

use bytes::{BufMut, BytesMut};
use papilla_proto::{MAP_SIDE_PX, Problem, effects::Place};

use super::{Geometry, unusable};

/// Most points of a session.
const POINTS_MAX: usize = 1024;

/// Points, each a weighted mean of up to four pixels.
#[derive(Debug)]
pub(super) struct Points(Vec<[(u32, f32); 4]>);

impl Points {
    /// # Errors
    /// Too many points, or one that is off the interface.
    pub(super) fn new(places: &[Place], geometry: &Geometry) -> Result<Self, Problem> {
        if places.is_empty() || places.len() > POINTS_MAX {
            let message = format!("{} points; name 1 to {POINTS_MAX}", places.len());
            return Err(unusable("points", message));
        }
        let point = |(number, place): (usize, &Place)| {
            let (index, _) = geometry.locate(*place, "points", &format_args!("point {number}"))?;
            Ok(match *place {
                Place::Px(at) => between(at, index, geometry),
                Place::Mm(_) => [(index, 1.0), (index, 0.0), (index, 0.0), (index, 0.0)],
            })
        };
        places.iter().enumerate().map(point).collect::<Result<_, _>>().map(Self)
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Appends one value a point.
    pub(super) fn write(&self, map: &[f32], bytes: &mut BytesMut) {
        for taps in &self.0 {
            bytes
                .put_f32_le(taps.iter().map(|&(index, weight)| weight * map[index as usize]).sum());
        }
    }
}

/// Bilinear weights of the four pixels whose centres surround `[u, v]`. Pixels that are not on the
/// interface have no value: their weight goes to the others. `own` is the pixel of the place itself.
fn between([u, v]: [f32; 2], own: u32, geometry: &Geometry) -> [(u32, f32); 4] {
    let (left, top) = ((u - 0.5).floor(), (v - 0.5).floor());
    let (across, down) = (u - 0.5 - left, v - 0.5 - top);
    let mut taps = [(own, 0.0); 4];
    let corners = [
        (0.0, 0.0, (1.0 - across) * (1.0 - down)),
        (1.0, 0.0, across * (1.0 - down)),
        (0.0, 1.0, (1.0 - across) * down),
        (1.0, 1.0, across * down),
    ];
    for (tap, (right, below, weight)) in taps.iter_mut().zip(corners) {
        let (column, row) = (left + right, top + below);
        let inside = |c: f32| (0.0..MAP_SIDE_PX as f32).contains(&c);
        if inside(column) && inside(row) {
            let index = row as usize * MAP_SIDE_PX + column as usize;
            if geometry.interface_mm2[index] > 0.0 {
                *tap = (index as u32, weight);
            }
        }
    }
    let sum: f32 = taps.iter().map(|&(_, weight)| weight).sum();
    // The place's own pixel is on the interface and weighs a quarter at least.
    taps.iter_mut().for_each(|(_, weight)| *weight /= sum);
    taps
}

#[cfg(test)]
mod tests {
    use super::{super::tests::plane, *};

    fn values(places: &[Place], map: &[f32]) -> Vec<f32> {
        let points = Points::new(places, &plane()).unwrap();
        let mut bytes = BytesMut::new();
        points.write(map, &mut bytes);
        bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    #[test]
    fn a_plane_field_is_read_exactly_between_pixels() {
        let map: Vec<f32> = (0..224 * 224).map(|i| (3 * (i % 224) + i / 224) as f32).collect();
        let found = values(&[Place::Px([50.5, 60.5]), Place::Px([50.75, 61.25])], &map);
        // Column 50 and row 60 are 210; a quarter column and three quarters of a row further: 1.5.
        assert!((found[0] - 210.0).abs() < 1e-3 && (found[1] - 211.5).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn the_rim_does_not_bleed_in() {
        // The test patch begins at column 20: at its edge the zeros outside do not count.
        let mut map = vec![0.0; 224 * 224];
        (0..224 * 224).filter(|i| i % 224 >= 20).for_each(|i| map[i] = 8.0);
        assert!((values(&[Place::Px([20.1, 100.5])], &map)[0] - 8.0).abs() < 1e-4);
    }

    #[test]
    fn millimetres_find_the_nearest_pixel() {
        let mut map = vec![0.0; 224 * 224];
        map[70 * 224 + 90] = 5.0;
        // The test patch: x = 0.1 v, y = -0.1 u, z = -0.5.
        let found = values(&[Place::Mm([7.05, -9.05, -1.2]), Place::Mm([7.05, -9.3, -0.5])], &map);
        assert!((found[0] - 5.0).abs() < 1e-6 && found[1].abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn places_off_the_finger_are_refused_by_number() {
        let refused = |places: &[Place]| Points::new(places, &plane()).unwrap_err();
        for off in [
            Place::Px([5.0, 5.0]),
            Place::Px([f32::NAN, 5.0]),
            Place::Px([-1.0, 1e9]),
            Place::Mm([f32::NAN; 3]),
            Place::Mm([0.0, 0.0, 30.0]),
        ] {
            let problem = refused(&[Place::Px([100.0, 100.0]), off]);
            assert!(problem.message.contains("point 1"), "{problem}");
        }
        assert!(refused(&[]).message.contains("0 points"));
        assert!(refused(&vec![Place::Px([100.0, 100.0]); 1025]).message.contains("1025 points"));
    }
}

//! The points of a pixel over which pressure is a mean.

use papilla_atlas::{MAP_SIDE_PX, Raster};

use super::Place;

/// Points along a pixel.
const POINTS: usize = 4;

/// The points of each pixel of `raster`, whose middles lie at `places`; as many of each.
///
/// Between a pixel's middle and its neighbours' a place is linear. Where there is no neighbour, or it
/// lies on another side, points stay at the middle.
pub(super) fn within(raster: &Raster, places: &[Place]) -> Vec<Place> {
    // Along the lattice to the pixel that lies so many rows and columns away.
    let step = |index: usize, (side, middle): Place, [rows, columns]: [isize; 2]| {
        let row = (index / MAP_SIDE_PX).checked_add_signed(rows);
        let column = (index % MAP_SIDE_PX).checked_add_signed(columns);
        let entry = row.zip(column).and_then(|(row, column)| raster.entry(row, column));
        match entry.map(|entry| places[entry]) {
            Some((other, there)) if other == side => [0, 1].map(|k| there[k] - middle[k]),
            _ => [0.0; 2],
        }
    };
    let offsets: [f64; POINTS] = std::array::from_fn(|n| (n as f64 + 0.5) / POINTS as f64 - 0.5);
    let mut points = Vec::with_capacity(places.len() * POINTS * POINTS);
    for (&index, &own) in raster.indices().iter().zip(places) {
        let ways = [[-1, 0], [1, 0], [0, -1], [0, 1]];
        let [up, down, left, right] = ways.map(|way| step(index as usize, own, way));
        let (side, middle) = own;
        for y in offsets {
            for x in offsets {
                let along_y = if y > 0.0 { down } else { up };
                let along_x = if x > 0.0 { right } else { left };
                let at = |k: usize| middle[k] + y.abs() * along_y[k] + x.abs() * along_x[k];
                points.push((side, [at(0), at(1)]));
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::atlas;
    use papilla_atlas::Patch;

    /// A flat skin whose pixels lie on these sides of a lattice, by column, so far apart.
    fn placed(side: impl Fn(u32) -> u32, apart: [f64; 2]) -> (Raster, Vec<Place>) {
        let raster = Raster::new(&atlas(2), Patch::Skin);
        let place = |&i: &u32| {
            let [row, column] = [i / 224, i % 224];
            (side(column), [apart[0] * f64::from(row), apart[1] * f64::from(column)])
        };
        let places = raster.indices().iter().map(place).collect();
        (raster, places)
    }

    /// Points of a pixel amid others lie in its own square; of one at the rim, on the inner side alone.
    #[test]
    fn points_fill_a_pixel_and_stay_on_the_lattice() {
        let (raster, places) = placed(|_| 1, [8.0, 4.0]);
        let points = within(&raster, &places);
        assert_eq!(points.len(), 16 * places.len());
        let at = &points[16 * raster.entry(100, 90).unwrap()..][..16];
        assert!(at.iter().all(|(side, _)| *side == 1));
        assert_eq!((at[0].1, at[15].1), ([797.0, 358.5], [803.0, 361.5]));
        let mean = |k: usize| at.iter().map(|p| p.1[k]).sum::<f64>() / 16.0;
        assert_eq!([mean(0), mean(1)], [800.0, 360.0]);
        let [top, left] = places[0].1;
        assert_eq!((points[0].1, points[15].1), ([top, left], [top + 3.0, left + 1.5]));
    }

    #[test]
    fn another_side_of_the_lattice_is_no_neighbour() {
        let (raster, places) = placed(|column| u32::from(column > 90), [1.0; 2]);
        let first = 16 * raster.entry(100, 90).unwrap();
        let points = within(&raster, &places);
        let columns: Vec<f64> = points[first..first + 4].iter().map(|p| p.1[1]).collect();
        assert_eq!(columns, [89.625, 89.875, 90.0, 90.0]);
    }
}

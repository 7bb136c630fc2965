//! The points of a pixel over which pressure is a mean.

use papilla_atlas::{MAP_SIDE_PX, Raster};

/// Points along a pixel.
const POINTS: usize = 4;

/// Side and points of each pixel of `raster`, whose middles lie at `place`.
///
/// Between a pixel's middle and its neighbours' a place is linear. Where there is no neighbour, or it
/// lies on another side, points stay at the middle.
pub(super) fn within(raster: &Raster, place: &[(u32, [f64; 2])]) -> Vec<(u32, Vec<[f64; 2]>)> {
    // Along the lattice to the pixel that lies so many rows and columns away.
    let step = |index: usize, own: (u32, [f64; 2]), [rows, columns]: [isize; 2]| {
        let row = (index / MAP_SIDE_PX).checked_add_signed(rows);
        let column = (index % MAP_SIDE_PX).checked_add_signed(columns);
        let inside = row.zip(column).filter(|(row, column)| raster.at(*row, *column).is_some());
        let entry = |(row, column)| {
            raster.indices().binary_search(&((row * MAP_SIDE_PX + column) as u32)).ok()
        };
        match inside.and_then(entry).map(|entry| place[entry]) {
            Some((side, there)) if side == own.0 => [0, 1].map(|k| there[k] - own.1[k]),
            _ => [0.0; 2],
        }
    };
    let offsets: [f64; POINTS] = std::array::from_fn(|n| (n as f64 + 0.5) / POINTS as f64 - 0.5);
    let points = |(&index, &own): (&u32, &(u32, [f64; 2]))| {
        let ways = [[-1, 0], [1, 0], [0, -1], [0, 1]];
        let [up, down, left, right] = ways.map(|way| step(index as usize, own, way));
        let at = |y: f64, x: f64| {
            let (along_y, along_x) =
                (if y > 0.0 { down } else { up }, if x > 0.0 { right } else { left });
            [0, 1].map(|k| own.1[k] + y.abs() * along_y[k] + x.abs() * along_x[k])
        };
        let rows = offsets.iter().flat_map(|&y| offsets.iter().map(move |&x| (y, x)));
        (own.0, rows.map(|(y, x)| at(y, x)).collect())
    };
    raster.indices().iter().zip(place).map(points).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::atlas;
    use papilla_atlas::Patch;

    /// A flat skin whose pixels lie on these sides of a lattice, by column, so far apart.
    fn placed(side: impl Fn(u32) -> u32, apart: [f64; 2]) -> (Raster, Vec<(u32, [f64; 2])>) {
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
        let (raster, place) = placed(|_| 1, [8.0, 4.0]);
        let points = within(&raster, &place);
        let middle = raster.indices().binary_search(&(100 * 224 + 90)).unwrap();
        let (side, at) = &points[middle];
        assert_eq!((*side, at.len()), (1, 16));
        assert_eq!((at[0], at[15]), ([797.0, 358.5], [803.0, 361.5]));
        let mean = |k: usize| at.iter().map(|p| p[k]).sum::<f64>() / 16.0;
        assert_eq!([mean(0), mean(1)], [800.0, 360.0]);
        let [top, left] = place[0].1;
        let rim = &points[0].1;
        assert_eq!((rim[0], rim[15]), ([top, left], [top + 3.0, left + 1.5]));
    }

    #[test]
    fn another_side_of_the_lattice_is_no_neighbour() {
        let (raster, place) = placed(|column| u32::from(column > 90), [1.0; 2]);
        let middle = raster.indices().binary_search(&(100 * 224 + 90)).unwrap();
        let columns: Vec<f64> = within(&raster, &place)[middle].1.iter().map(|p| p[1]).collect();
        assert_eq!(columns[..4], [89.625, 89.875, 90.0, 90.0]);
    }
}

//! Surfaces of more triangles than a mesh may have: fewer triangles, and how far they are off.
//!
//! The triangles are chosen by quadric errors (Garland & Heckbert, *Surface simplification using
//! quadric error metrics*, 1997), by the library meshoptimizer: it leaves corners out and moves none.
//! How far the surface is off is measured here, since the library's own figure is an estimate.

/// What was done to a mesh of too many triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decimated {
    /// Triangles that were told.
    pub before: usize,
    /// Triangles that are left.
    pub after: usize,
    /// Greatest distance between both surfaces at the points where it was measured, mm.
    pub off_mm: f64,
    /// How many points these are.
    pub points: usize,
}

impl std::fmt::Display for Decimated {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { before, after, off_mm, points } = *self;
        write!(
            f,
            "{before} triangles became {after}: the surface is at most {} mm off, as measured at {points} \
             points",
            rounded(off_mm)
        )
    }
}

/// Three digits, without an exponent; what is less than a thousandth of a nm is rounding.
fn rounded(mm: f64) -> String {
    if mm < 1e-9 {
        return "0".into();
    }
    let digits = 2 - mm.log10().floor() as i32;
    format!("{mm:.*}", digits.max(0) as usize)
}

#[cfg(feature = "files")]
pub(crate) use few::few_enough;

#[cfg(feature = "files")]
mod few {
    use super::super::check::{Checked, unchecked};
    use super::super::closest::closest;
    use super::super::tree::Tree;
    use super::super::{Mesh, MeshError, TRIANGLES_MAX, square};
    use super::Decimated;
    use papilla_vector::minus;
    use std::collections::HashSet;

    /// Of a triangle's sides, parts at least, to measure from the middles of the small triangles.
    const PARTS_MIN: usize = 4;
    /// The same at most.
    const PARTS_MAX: usize = 32;
    /// Error at which the library ends, in parts of the whole size: never before the count is reached.
    const ERROR_MAX: f32 = 1.0;

    /// The same surface of few enough triangles, and what was done; `None` if it has these already.
    ///
    /// # Errors
    /// [`MeshError::Index`], and [`MeshError::Count`] if no triangle has an area, or more than
    /// [`TRIANGLES_MAX`] stay.
    pub(crate) fn few_enough(mesh: &Mesh) -> Result<Option<(Mesh, Decimated)>, MeshError> {
        let before = mesh.triangles.len();
        if before <= TRIANGLES_MAX {
            return Ok(None);
        }
        let Checked { corners_mm, mut triangles, tree } = unchecked(mesh)?;
        let told = triangles.clone();
        let mut seen = HashSet::with_capacity(triangles.len());
        triangles.retain(|t| {
            let mut corners = *t;
            corners.sort_unstable();
            seen.insert(corners)
        });
        if triangles.len() > TRIANGLES_MAX {
            triangles = simplified(&corners_mm, &triangles);
        }
        let after = triangles.len();
        if !(1..=TRIANGLES_MAX).contains(&after) {
            return Err(MeshError::Count { found: after });
        }
        let place = |t: &[u32; 3]| t.map(|c| corners_mm[c as usize]);
        let surfaces = [&told, &triangles].map(|of| of.iter().map(place).collect::<Vec<_>>());
        let (off_mm, points) = off(&surfaces, &tree, &corners_mm, &told);
        let fewer = used(&corners_mm, &triangles);
        Ok(Some((fewer, Decimated { before, after, off_mm, points })))
    }

    fn simplified(corners_mm: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        // The library computes in f32: places count from the middle of the body.
        let middle: [f64; 3] = std::array::from_fn(|i| {
            let along = || corners_mm.iter().map(|p| p[i]);
            0.5 * (along().fold(f64::INFINITY, f64::min)
                + along().fold(f64::NEG_INFINITY, f64::max))
        });
        let places: Vec<[f32; 3]> =
            corners_mm.iter().map(|p| minus(*p, middle).map(|v| v as f32)).collect();
        let indices = triangles.as_flattened();
        let most = 3 * TRIANGLES_MAX;
        // Triangles of even shape: fewer of them are slivers, which are flat or lie across each other.
        let options = meshopt::SimplifyOptions::RegularizeLight;
        let kept = meshopt::simplify_decoder(indices, &places, most, ERROR_MAX, options, None);
        kept.as_chunks::<3>().0.to_vec()
    }

    /// Greatest distance of points of each surface from the other, mm, and how many points they are:
    /// the corners of the one that was told, and points all over the other.
    fn off(
        [told, left]: &[Vec<[[f64; 3]; 3]>; 2],
        tree_of_told: &Tree,
        corners_mm: &[[f64; 3]],
        triangles: &[[u32; 3]],
    ) -> (f64, usize) {
        let tree_of_left = Tree::new(left);
        let away = |p: [f64; 3], tree: &Tree, of: &[[[f64; 3]; 3]]| {
            let mut least = f64::INFINITY;
            tree.nearest(p, |triangle, _| {
                let found = square(minus(p, closest(p, &of[triangle]).0));
                least = least.min(found);
                found
            });
            least
        };
        let (mut most, mut points) = (0.0f64, 0);
        let mut is_used = vec![false; corners_mm.len()];
        triangles.as_flattened().iter().for_each(|c| is_used[*c as usize] = true);
        for (p, _) in corners_mm.iter().zip(&is_used).filter(|(_, used)| **used) {
            most = most.max(away(*p, &tree_of_left, left));
            points += 1;
        }
        // Their corners are corners of the other surface; between them it may be hollow.
        let parts = (told.len() as f64 / left.len() as f64).sqrt().ceil() as usize;
        for triangle in left {
            for p in middles(triangle, parts.clamp(PARTS_MIN, PARTS_MAX)) {
                most = most.max(away(p, tree_of_told, told));
                points += 1;
            }
        }
        (most.sqrt(), points)
    }

    /// The middles of the small triangles that a triangle is cut into, its sides into so many parts.
    fn middles([a, b, c]: &[[f64; 3]; 3], parts: usize) -> impl Iterator<Item = [f64; 3]> {
        let at = move |u: f64, v: f64| -> [f64; 3] {
            let [u, v] = [u, v].map(|s| s / parts as f64);
            std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]))
        };
        (0..parts).flat_map(move |i| {
            (0..parts - i).flat_map(move |j| {
                let upright = at(i as f64 + 1.0 / 3.0, j as f64 + 1.0 / 3.0);
                let turned =
                    (i + j + 2 <= parts).then(|| at(i as f64 + 2.0 / 3.0, j as f64 + 2.0 / 3.0));
                std::iter::once(upright).chain(turned)
            })
        })
    }

    /// A mesh of the corners that its triangles use.
    fn used(corners_mm: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let mut new = vec![u32::MAX; corners_mm.len()];
        let mut vertices_mm = Vec::new();
        let triangles = triangles.iter().map(|t| {
            t.map(|c| {
                let own = &mut new[c as usize];
                if *own == u32::MAX {
                    *own = vertices_mm.len() as u32;
                    vertices_mm.push(corners_mm[c as usize]);
                }
                *own
            })
        });
        let triangles = triangles.collect();
        Mesh { vertices_mm, triangles }
    }

    #[cfg(test)]
    mod tests {
        use super::super::super::tests::{ball, cuboid};
        use super::*;
        use crate::SignedDistance as _;

        /// Corners stay on their sphere, so that triangles lie within it: as deep as an arc is high, and as
        /// far as the sphere's own points are from them.
        #[test]
        fn a_fine_ball_of_fewer_triangles_is_off_by_the_height_of_its_arcs() {
            let fine = ball(5.0, 7);
            let (fewer, done) = few_enough(&fine).unwrap().expect("131 072 triangles");
            assert_eq!((done.before, done.after), (131_072, fewer.triangles.len()));
            assert!((16_000..=TRIANGLES_MAX).contains(&done.after), "{done}");
            let built = fewer.build().expect("still closed");
            assert!(built.mended().is_none());
            let deepest_mm = |of: &Mesh, parts: usize| {
                let mut most = 0.0f64;
                for triangle in &of.triangles {
                    let place = triangle.map(|c| of.vertices_mm[c as usize]);
                    let deep = middles(&place, parts).map(|p| 5.0 - square(p).sqrt());
                    most = deep.fold(most, f64::max);
                }
                most
            };
            let middle = |of: &Mesh, triangle: &[u32; 3]| {
                let place = triangle.map(|c| of.vertices_mm[c as usize]);
                middles(&place, 1).next().expect("one middle")
            };
            let on_sphere = |p: [f64; 3]| p.map(|v| 5.0 * v / square(p).sqrt());
            let away =
                fine.triangles.iter().map(|t| built.distance(on_sphere(middle(&fine, t))).gap_mm);
            let due_mm = away.fold(deepest_mm(&fewer, 16), f64::max);
            let own_mm = deepest_mm(&fine, 1);
            assert!(2.0 * own_mm < due_mm && due_mm < 0.01, "{own_mm}, {due_mm}");
            let least_mm = 0.97 * due_mm - own_mm;
            assert!((least_mm..1.03 * due_mm).contains(&done.off_mm), "{done}, {due_mm} mm");
            // The whole ball is smaller by a mean arc, and by no more.
            for p in [[6.0, 0.0, 0.0], [0.0, -3.0, 0.1], [3.0, 3.0, 3.0]] {
                let sphere_mm = square(p).sqrt() - 5.0;
                assert!((built.distance(p).gap_mm - sphere_mm).abs() <= 1.03 * due_mm, "{p:?}");
            }
        }

        /// Faces of a box are plane, whatever their triangles: nothing is off but by rounding.
        #[test]
        fn a_box_of_many_triangles_stays_a_box() {
            let mut many = cuboid([2.0, 1.0, 1.5]);
            while many.triangles.len() <= TRIANGLES_MAX {
                let triangles = std::mem::take(&mut many.triangles);
                for [a, b, c] in triangles {
                    let mut between = |i: u32, j: u32| {
                        let [p, q] = [i, j].map(|k| many.vertices_mm[k as usize]);
                        many.vertices_mm.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
                        many.vertices_mm.len() as u32 - 1
                    };
                    let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
                    many.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                }
            }
            let (fewer, done) = few_enough(&many).unwrap().expect("49 152 triangles");
            assert!(done.after <= TRIANGLES_MAX && done.off_mm < 1e-12, "{done}");
            let [fewer, whole] = [fewer, cuboid([2.0, 1.0, 1.5])].map(|m| m.build().unwrap());
            for p in [[3.0, 2.0, 2.0], [0.0, 0.9, 0.2], [2.5, 0.3, 0.1]] {
                let [a, b] = [&fewer, &whole].map(|of| of.distance(p).gap_mm);
                assert!((a - b).abs() < 1e-12, "{a} for {b} mm");
            }
        }

        /// What is told twice is left out, and the surface is as it was.
        #[test]
        fn doubled_triangles_take_no_corner_away() {
            let mut doubled = cuboid([1.0; 3]);
            let first = doubled.triangles[0];
            doubled.triangles.extend(std::iter::repeat_n(first, TRIANGLES_MAX));
            let (fewer, done) = few_enough(&doubled).unwrap().expect("16 396 triangles");
            assert!(done.after == 12 && done.off_mm < 1e-12, "{done}");
            assert!(done.to_string().contains("at most 0 mm off"), "{done}");
            assert!(fewer.build().unwrap().mended().is_none());
            assert!(few_enough(&cuboid([1.0; 3])).unwrap().is_none());
        }

        /// What was left out is found by the distance, also where it is far from all that is left.
        #[test]
        fn a_body_that_is_lost_is_measured() {
            let ball = ball(1.0, 2);
            let moved = |by: f64| {
                let vertices_mm = ball.vertices_mm.iter().map(|p| [p[0] + by, p[1], p[2]]);
                vertices_mm.collect::<Vec<_>>()
            };
            let corners_mm = [moved(0.0), moved(10.0)].concat();
            let count = ball.vertices_mm.len() as u32;
            let far = ball.triangles.iter().map(|t| t.map(|c| c + count));
            let both: Vec<[u32; 3]> = ball.triangles.iter().copied().chain(far).collect();
            let place = |t: &[u32; 3]| t.map(|c| corners_mm[c as usize]);
            let told: Vec<_> = both.iter().map(place).collect();
            let left = told[..ball.triangles.len()].to_vec();
            let tree = Tree::new(&told);
            let (off_mm, _) = off(&[told, left], &tree, &corners_mm, &both);
            // From the far ball's farthest corner to the near ball's nearest one.
            assert!((off_mm - 10.0).abs() < 1e-12, "{off_mm}");
        }

        #[test]
        fn lengths_have_three_digits() {
            let said = [0.0, 1e-16, 1.234e-5, 0.0021364, 1.0, 12.345].map(super::super::rounded);
            assert_eq!(said, ["0", "0", "0.0000123", "0.00214", "1.00", "12.3"]);
        }
    }
}

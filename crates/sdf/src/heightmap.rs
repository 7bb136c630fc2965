//! Indenter `heightmap`: a plate whose face is a gray picture or a list of heights, and its signed
//! distance.

use super::rules::{BadValue, ShapeError, length, lengths, require};
use super::{Distance, SignedDistance};
#[cfg(feature = "files")]
use image::{ColorType, DynamicImage};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A plate whose face is a gray picture: white is `z = 0`, black `z = -height_mm`.
///
/// The picture is seen from the skin, x to the right and y up, centred at the origin.
/// Heights are the cubic B-spline whose coefficients are the pixels: twice continuously
/// differentiable, as Newton's method needs, never above white or below black, and
/// smoothed over a pixel (kernel 1/6, 4/6, 1/6), so details should be some pixels
/// wide. Beyond the picture its border goes on without end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Heightmap {
    /// PNG, gray, 8 or 16 bits a pixel, relative to the scene's folder.
    pub file: PathBuf,
    /// Width and height of the picture, mm.
    pub size_mm: [f64; 2],
    /// Height of white over black, mm.
    pub height_mm: f64,
}

/// Most pixels along a side.
#[cfg(feature = "files")]
const SIDE_MAX_PX: u32 = 4096;

impl Heightmap {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        let named = !self.file.as_os_str().is_empty();
        require(named, "file", &self.file, "has to name a PNG")?;
        lengths("size_mm", &self.size_mm)?;
        length("height_mm", self.height_mm)
    }

    /// Refuses the picture: this build reads none.
    #[cfg(not(feature = "files"))]
    pub(super) fn read(&self, folder: &Path) -> Result<HeightField, ShapeError> {
        let message = "this program is built without the feature `files`".into();
        Err(ShapeError::Picture { path: folder.join(&self.file), message })
    }

    /// Reads the picture.
    #[cfg(feature = "files")]
    pub(super) fn read(&self, folder: &Path) -> Result<HeightField, ShapeError> {
        let path = folder.join(&self.file);
        let refuse = |message: String| ShapeError::Picture { path: path.clone(), message };
        let picture = image::open(&path).map_err(|e| refuse(e.to_string()))?;
        if !matches!(picture.color(), ColorType::L8 | ColorType::L16) {
            return Err(refuse(format!(
                "it is {:?}: save it as gray, 8 or 16 bits, without transparency",
                picture.color()
            )));
        }
        self.field(&picture).map_err(refuse)
    }

    #[cfg(feature = "files")]
    fn field(&self, picture: &DynamicImage) -> Result<HeightField, String> {
        let (columns, rows) = (picture.width(), picture.height());
        if !(2..=SIDE_MAX_PX).contains(&columns) || !(2..=SIDE_MAX_PX).contains(&rows) {
            return Err(format!("it is {columns} x {rows} pixels: 2 to {SIDE_MAX_PX} are taken"));
        }
        let gray = picture.to_luma16();
        let height = |v: u16| (f64::from(v) / f64::from(u16::MAX) - 1.0) * self.height_mm;
        // The picture's first row is its top, at the largest y.
        let heights_mm = gray.rows().rev().flatten().map(|p| height(p.0[0])).collect();
        let pixel_mm = [self.size_mm[0] / f64::from(columns), self.size_mm[1] / f64::from(rows)];
        Ok(HeightField::new([columns as usize, rows as usize], pixel_mm, heights_mm))
    }
}

/// A surface `z = h(x, y)` with everything below it, see [`Heightmap`].
pub struct HeightField {
    count: [usize; 2],
    pixel_mm: [f64; 2],
    /// Coefficients of the spline, mm, rows from the lowest y.
    heights_mm: Vec<f64>,
    /// Bound of the slope.
    steepest: f64,
}

/// Height with its derivatives along x and y: `d[i][j]` is `i` times by x and `j`
/// times by y.
type Jet = [[f64; 4]; 4];

impl HeightField {
    /// Of `count` pixels of `pixel_mm` along x and y; heights, mm, by rows from the lowest y.
    #[must_use]
    pub fn new(count: [usize; 2], pixel_mm: [f64; 2], heights_mm: Vec<f64>) -> Self {
        let [columns, rows] = count;
        let at = |x: usize, y: usize| heights_mm[y * columns + x];
        let mut slope = [0.0f64; 2];
        for y in 0..rows {
            for x in 0..columns {
                if x > 0 {
                    slope[0] = slope[0].max((at(x, y) - at(x - 1, y)).abs() / pixel_mm[0]);
                }
                if y > 0 {
                    slope[1] = slope[1].max((at(x, y) - at(x, y - 1)).abs() / pixel_mm[1]);
                }
            }
        }
        Self { count, pixel_mm, heights_mm, steepest: slope[0].hypot(slope[1]) }
    }

    /// First pixel and the four weights with their derivatives, along one axis.
    fn weights(&self, axis: usize, x: f64) -> (f64, [[f64; 4]; 4]) {
        let per_mm = 1.0 / self.pixel_mm[axis];
        // Pixel middles are the knots.
        let at = x * per_mm + 0.5 * (self.count[axis] as f64 - 1.0);
        let first = at.floor();
        let t = at - first;
        let s = 1.0 - t;
        let value = [
            s * s * s / 6.0,
            (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
            t * t * t / 6.0,
        ];
        let first_d = [-0.5 * s * s, t * (1.5 * t - 2.0), s * (2.0 - 1.5 * s), 0.5 * t * t];
        let second = [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t];
        let third = [-1.0, 3.0, -3.0, 1.0];
        let d = [
            value,
            first_d.map(|v| v * per_mm),
            second.map(|v| v * per_mm * per_mm),
            third.map(|v| v * per_mm * per_mm * per_mm),
        ];
        (first - 1.0, d)
    }

    fn jet(&self, x: f64, y: f64) -> Jet {
        let (column, wx) = self.weights(0, x);
        let (row, wy) = self.weights(1, y);
        // Far outside only the border's pixels are left; a float-to-integer cast saturates.
        let clamp = |first: f64, k: usize, count: usize| {
            (first + k as f64).clamp(0.0, (count - 1) as f64) as usize
        };
        let columns: [usize; 4] = std::array::from_fn(|k| clamp(column, k, self.count[0]));
        let mut jet = [[0.0; 4]; 4];
        for l in 0..4 {
            let start = clamp(row, l, self.count[1]) * self.count[0];
            for (i, w) in wx.iter().enumerate() {
                let along: f64 = (0..4).map(|k| w[k] * self.heights_mm[start + columns[k]]).sum();
                for j in 0..4 - i {
                    jet[i][j] += wy[j][l] * along;
                }
            }
        }
        jet
    }
}

impl SignedDistance for HeightField {
    /// `F / |grad F|` with `F = z - h(x, y)`: the distance to first order at the surface,
    /// where its gradient is the unit normal.
    fn distance(&self, [x, y, z]: [f64; 3]) -> Distance {
        let d = self.jet(x, y);
        let f = z - d[0][0];
        let slope = [d[1][0], d[0][1]];
        let bend = [[d[2][0], d[1][1]], [d[1][1], d[0][2]]];
        let third =
            [[[d[3][0], d[2][1]], [d[2][1], d[1][2]]], [[d[2][1], d[1][2]], [d[1][2], d[0][3]]]];
        let s = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        // Derivatives of F and of s = |grad F|.
        let df = [-slope[0], -slope[1], 1.0];
        let ds = [dot(slope, bend[0]) / s, dot(slope, bend[1]) / s, 0.0];
        let mut hessian = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let (mut ddf, mut dds) = (0.0, 0.0);
                if i < 2 && j < 2 {
                    ddf = -bend[i][j];
                    dds = (dot(bend[i], bend[j]) + dot(slope, third[i][j]) - ds[i] * ds[j]) / s;
                }
                hessian[i][j] = ddf / s - (df[i] * ds[j] + df[j] * ds[i] + f * dds) / (s * s)
                    + 2.0 * f * ds[i] * ds[j] / (s * s * s);
            }
        }
        let normal = std::array::from_fn(|i| df[i] / s - f * ds[i] / (s * s));
        Distance { gap_mm: f / s, normal, hessian }
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        if direction[0] == 0.0 && direction[1] == 0.0 && direction[2] > 0.0 {
            let highest = self.heights_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            return direction[2] * highest;
        }
        f64::INFINITY
    }

    fn cost(&self) -> f64 {
        4.0
    }

    /// Its gap is approximate: the foot is where the gap vanishes.
    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let mut foot = p;
        for _ in 0..6 {
            let found = self.distance(foot);
            let square = found.normal.iter().map(|v| v * v).sum::<f64>().max(1e-6);
            foot = std::array::from_fn(|i| foot[i] - found.gap_mm * found.normal[i] / square);
        }
        let there = self.distance(foot);
        let behind: f64 = (0..3).map(|i| (p[i] - foot[i]) * there.normal[i]).sum();
        each(Distance { gap_mm: behind, ..there });
    }

    /// No slope is steeper than the steepest step between two pixels.
    fn clearance_mm(&self, [x, y, z]: [f64; 3]) -> f64 {
        (z - self.jet(x, y)[0][0]) / self.steepest.hypot(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};
    use image::{ImageBuffer, Luma};

    fn hills() -> HeightField {
        let height = |i: usize| {
            let (x, y) = ((i % 12) as f64, (i / 12) as f64);
            0.5 * ((0.9 * x).sin() + (0.7 * y + 0.4 * x).cos()) - 1.0
        };
        HeightField::new([12, 10], [1.0, 0.8], (0..120).map(height).collect())
    }

    distance_tests! {
        height_field: hills() => Exactness::Approximate, detail_mm 1.0, mirrors []
    }

    #[test]
    fn clearance_is_never_more_than_the_way_to_the_surface() {
        let field = hills();
        let surface: Vec<[f64; 3]> = (0..4000)
            .map(|i| {
                let (x, y) = (f64::from(i % 80) * 0.15 - 6.0, f64::from(i / 80) * 0.16 - 4.0);
                [x, y, field.jet(x, y)[0][0]]
            })
            .collect();
        for p in [[0.0, 0.0, 0.5], [2.0, -1.0, 0.0], [-3.0, 3.0, 1.0], [5.0, 0.0, -0.5]] {
            let way = |q: &[f64; 3]| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
            let nearest = surface.iter().map(way).fold(f64::INFINITY, f64::min);
            assert!(field.clearance_mm(p) <= nearest, "{p:?}");
        }
    }

    #[test]
    fn a_picture_is_read_the_right_way_up() {
        let folder = tempfile::tempdir().unwrap();
        // A plane that rises along x and y: B-splines give planes back exactly.
        let ramp = ImageBuffer::<Luma<u16>, _>::from_fn(8, 6, |column, row| {
            Luma([1000 * column as u16 + 2000 * (5 - row as u16)])
        });
        ramp.save(folder.path().join("ramp.png")).unwrap();
        let spec = Heightmap { file: "ramp.png".into(), size_mm: [8.0, 6.0], height_mm: 2.0 };
        let field = spec.read(folder.path()).unwrap();
        let [_, hx] = [field.jet(0.0, 0.0)[0][0], field.jet(0.0, 0.0)[1][0]];
        let unit = 2.0 / f64::from(u16::MAX);
        assert!((hx - 1000.0 * unit).abs() < 1e-12);
        assert!((field.jet(0.0, 0.0)[0][1] - 2000.0 * unit).abs() < 1e-12);
        assert!((field.jet(0.0, 0.0)[0][0] - (8500.0 * unit - 2.0)).abs() < 1e-12);
        // Beyond the border it is flat.
        assert!(field.jet(1e9, 0.0)[1][0].abs() < 1e-12);
    }

    #[test]
    fn a_colour_picture_is_refused_with_the_cure() {
        let folder = tempfile::tempdir().unwrap();
        image::RgbImage::new(4, 4).save(folder.path().join("rgb.png")).unwrap();
        let spec =
            |file: &str| Heightmap { file: file.into(), size_mm: [1.0, 1.0], height_mm: 1.0 };
        let text = spec("rgb.png").read(folder.path()).err().unwrap().to_string();
        assert!(text.contains("rgb.png") && text.contains("save it as gray"), "{text}");
        let text = spec("none.png").read(folder.path()).err().unwrap().to_string();
        assert!(text.contains("none.png"), "{text}");
    }
}

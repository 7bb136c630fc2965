//! Rigid indenters as one layer of quadratic bricks over the pressing surface.
//!
//! CalculiX has no analytical rigid surface. Every node of this layer moves as
//! prescribed, so it adds no unknown and no constraint equation. Plate, sphere
//! and cylinder are one surface: a flat rectangle rolled over by a ball,
//!
//! `x(a, b) = flat(a, b) + r n(a, b)`,  `n = (tan a, tan b, 1) / |.|`,
//!
//! with the angles `a`, `b` zero on the flat part.

use super::ExportError;
use papilla_fem::element::reference::HEX27_LATTICE;
use papilla_sdf::Placement;
use papilla_vector::norm;

/// A rigid shape in its own frame, pressing towards +z. Lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigidShape {
    /// A box centred at the origin with rounded edges; the face `z = +half_mm[2]` presses.
    Plate {
        /// Half lengths along x, y, z, mm.
        half_mm: [f64; 3],
        /// Radius of the edges, mm; not above any half length.
        edge_radius_mm: f64,
    },
    /// A ball centred at the origin.
    Sphere {
        /// Radius, mm.
        radius_mm: f64,
    },
    /// A cylinder about the local y axis, centred at the origin. Its ends are
    /// left open: they must not touch.
    Cylinder {
        /// Radius, mm.
        radius_mm: f64,
        /// Half length along the axis, mm.
        half_length_mm: f64,
    },
}

/// A rigid shape, where it starts and where it goes.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidIndenter {
    /// Its shape.
    pub shape: RigidShape,
    /// Where it is at load fraction 0; its own +z is the side that presses.
    pub start: Placement,
    /// Displacement, mm, at rising load fractions up to 1; linear in between
    /// and from none at 0.
    pub path: Vec<(f64, [f64; 3])>,
}

/// The layer of bricks; the face `S2` of each is the surface that presses.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RigidMesh {
    /// Node positions, mm.
    pub nodes: Vec<[f64; 3]>,
    /// Twenty nodes each, indices into `nodes`.
    pub bricks: Vec<[u32; 20]>,
}

/// Arc of one quadratic facet, degrees: its middle leaves a sphere by some 1e-5 of the
/// radius, and the steepest rounded corners of a plate by 3e-4 of theirs.
const FACET_DEG: f64 = 6.25;
/// Steepest part of an edge, ball or cylinder that is meshed, degrees.
const ANGLE_MAX_DEG: f64 = 75.0;

/// The rolled rectangle in the world.
struct Rolled {
    /// The rectangle's axes and the direction that presses, `axes[i]` in the world.
    axes: [[f64; 3]; 3],
    /// Middle of the rectangle that the ball's centre rolls over, mm.
    centre_mm: [f64; 3],
    half_mm: [f64; 2],
    radius_mm: f64,
    /// How far it rolls over the sides of the rectangle.
    angle_deg: [f64; 2],
}

impl RigidIndenter {
    /// Meshes the part of the surface that can touch.
    pub(super) fn mesh(&self) -> Result<RigidMesh, ExportError> {
        let rolled = self.rolled()?;
        let [u, v] = [0, 1].map(|i| stations(rolled.half_mm[i], rolled.angle_deg[i]));
        let mut mesh = RigidMesh::default();
        let mut id = vec![u32::MAX; 3 * u.len() * v.len()];
        for j in (0..v.len() - 1).step_by(2) {
            for i in (0..u.len() - 1).step_by(2) {
                mesh.bricks.push(std::array::from_fn(|a| {
                    let [di, dj, k] = HEX27_LATTICE[a].map(|c| (c + 1) as usize);
                    let (i, j) = (i + di, j + dj);
                    let slot = &mut id[3 * (j * u.len() + i) + k];
                    if *slot == u32::MAX {
                        *slot = mesh.nodes.len() as u32;
                        mesh.nodes.push(rolled.point(u[i], v[j], 0.5 * k as f64));
                    }
                    *slot
                }));
            }
        }
        Ok(mesh)
    }

    fn rolled(&self) -> Result<Rolled, ExportError> {
        let r = &self.start.rotation;
        let local: [[f64; 3]; 3] = std::array::from_fn(|k| std::array::from_fn(|i| r[i][k]));
        let flat = |half: [f64; 2], radius_mm: f64, height: f64, angle_deg| Rolled {
            axes: local,
            centre_mm: std::array::from_fn(|i| self.start.origin_mm[i] + height * local[2][i]),
            half_mm: half.map(|h| h - radius_mm),
            radius_mm,
            angle_deg: [angle_deg; 2],
        };
        let rolled = match self.shape {
            RigidShape::Plate { half_mm: [x, y, z], edge_radius_mm } => {
                let angle = if edge_radius_mm > 0.0 { ANGLE_MAX_DEG } else { 0.0 };
                flat([x, y], edge_radius_mm, z - edge_radius_mm, angle)
            }
            RigidShape::Sphere { radius_mm } => {
                flat([radius_mm; 2], radius_mm, 0.0, self.reach_deg(radius_mm))
            }
            RigidShape::Cylinder { radius_mm, half_length_mm } => {
                let mut cylinder = flat([radius_mm; 2], radius_mm, 0.0, self.reach_deg(radius_mm));
                cylinder.half_mm[1] = half_length_mm;
                cylinder.angle_deg[1] = 0.0;
                cylinder
            }
        };
        let sizes = [rolled.half_mm[0], rolled.half_mm[1], rolled.radius_mm];
        let extent = sizes.iter().sum::<f64>();
        if !(sizes.iter().all(|s| *s >= 0.0) && extent.is_finite() && extent > 0.0) {
            return Err(ExportError::Shape { shape: self.shape });
        }
        Ok(rolled)
    }

    /// Refuses a cylinder that does not reach past the body on both sides.
    pub(super) fn refuse_ends(
        &self,
        points: impl Iterator<Item = [f64; 3]>,
    ) -> Result<(), ExportError> {
        let RigidShape::Cylinder { half_length_mm, .. } = self.shape else { return Ok(()) };
        let axis = self.start.rotation.map(|row| row[1]);
        let along = |p: [f64; 3]| -> f64 {
            (0..3).map(|i| (p[i] - self.start.origin_mm[i]) * axis[i]).sum()
        };
        let beyond_mm = points.map(|p| along(p).abs()).fold(0.0, f64::max) - half_length_mm;
        if beyond_mm > 0.0 { Err(ExportError::Ends { beyond_mm }) } else { Ok(()) }
    }

    /// Half angle of a round shape that a body without hollows can touch, with
    /// some room.
    fn reach_deg(&self, radius_mm: f64) -> f64 {
        let deepest = self.path.iter().map(|(_, offset)| norm(*offset)).fold(0.0, f64::max);
        let cosine = (1.0 - deepest / radius_mm).max(0.0);
        (1.25 * cosine.acos().to_degrees() + FACET_DEG).min(ANGLE_MAX_DEG)
    }
}

impl Rolled {
    /// Point at the stations `u` and `v`, on the inner side (`level` 0) or the
    /// outer (1) of the layer.
    fn point(&self, u: Station, v: Station, level: f64) -> [f64; 3] {
        // Thin enough not to fold inside a sharp edge.
        let thickness = if self.radius_mm > 0.0 {
            0.5 * self.radius_mm
        } else {
            0.1 * self.half_mm[0].max(self.half_mm[1])
        };
        let normal = unit([u.angle.tan(), v.angle.tan(), 1.0]);
        let out = self.radius_mm - thickness * (1.0 - level);
        let local = [u.offset_mm + out * normal[0], v.offset_mm + out * normal[1], out * normal[2]];
        std::array::from_fn(|i| {
            self.centre_mm[i] + (0..3).map(|k| local[k] * self.axes[k][i]).sum::<f64>()
        })
    }
}

/// Place along one axis of the rectangle, and how far the ball has rolled over its side.
#[derive(Clone, Copy)]
struct Station {
    offset_mm: f64,
    angle: f64,
}

/// Stations along one axis, two intervals a facet; a flat side is one.
fn stations(half_mm: f64, angle_deg: f64) -> Vec<Station> {
    let arcs = 2 * (angle_deg / FACET_DEG).ceil() as usize;
    let flats = if half_mm > 0.0 { 2 } else { 0 };
    let mut all = Vec::with_capacity(2 * arcs + flats + 1);
    let arc = |i: usize| angle_deg.to_radians() * i as f64 / arcs as f64;
    all.extend((1..=arcs).rev().map(|i| Station { offset_mm: -half_mm, angle: -arc(i) }));
    for i in 0..=flats {
        let part = if flats > 0 { 2.0 * i as f64 / flats as f64 - 1.0 } else { 0.0 };
        all.push(Station { offset_mm: half_mm * part, angle: 0.0 });
    }
    all.extend((1..=arcs).map(|i| Station { offset_mm: half_mm, angle: arc(i) }));
    all
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = norm(v);
    v.map(|c| c / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fem::element::{BlockGeometry, ElementKind};
    use papilla_sdf::{RoundedPlate, SignedDistance, Sphere};

    const TURNED: Placement = Placement {
        rotation: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        origin_mm: [0.3, -0.2, 5.0],
    };

    fn mesh(shape: RigidShape, travel_mm: [f64; 3]) -> RigidMesh {
        RigidIndenter { shape, start: TURNED, path: vec![(1.0, travel_mm)] }.mesh().unwrap()
    }

    /// Largest distance of a node or of a facet's middle from the true surface.
    fn largest_gap(mesh: &RigidMesh, distance: &dyn SignedDistance) -> f64 {
        let mut worst: f64 = 0.0;
        for brick in &mesh.bricks {
            // The middle of a serendipity face from its corners and mid-sides.
            let mut middle = [0.0; 3];
            for (nodes, weight) in [([4, 5, 6, 7], -0.25), ([12, 13, 14, 15], 0.5)] {
                for a in nodes {
                    let p = mesh.nodes[brick[a] as usize];
                    for i in 0..3 {
                        middle[i] += weight * p[i];
                    }
                    worst = worst.max(TURNED.distance(distance, p).gap_mm.abs());
                }
            }
            worst = worst.max(TURNED.distance(distance, middle).gap_mm.abs());
        }
        worst
    }

    #[test]
    fn facets_lie_on_the_shape() {
        let ball = Sphere { radius_mm: 4.0 };
        let m = mesh(RigidShape::Sphere { radius_mm: 4.0 }, [0.0, 0.0, -0.8]);
        assert!(largest_gap(&m, &ball) < 1e-4, "{}", largest_gap(&m, &ball));
        let (half_mm, edge_radius_mm) = ([10.0, 6.0, 3.0], 1.0);
        let plate = RoundedPlate { half_mm, edge_radius_mm };
        let m = mesh(RigidShape::Plate { half_mm, edge_radius_mm }, [1.0, 0.0, 0.0]);
        assert!(largest_gap(&m, &plate) < 4e-4, "{}", largest_gap(&m, &plate));
    }

    /// Positive volume: CalculiX would stop otherwise. Face nodes of the check
    /// element are filled in from its edges.
    #[test]
    fn bricks_are_not_folded() {
        let shapes = [
            RigidShape::Sphere { radius_mm: 4.0 },
            RigidShape::Cylinder { radius_mm: 2.0, half_length_mm: 5.0 },
            RigidShape::Plate { half_mm: [3.0, 3.0, 1.0], edge_radius_mm: 0.05 },
            RigidShape::Plate { half_mm: [3.0, 3.0, 1.0], edge_radius_mm: 0.0 },
        ];
        for shape in shapes {
            let m = mesh(shape, [1.0, 0.2, 0.0]);
            let corners: Vec<u32> = m.bricks.iter().flat_map(|b| b[..8].to_vec()).collect();
            let geometry = BlockGeometry::new(ElementKind::Hex8, &m.nodes, &corners);
            assert!(geometry.is_ok(), "{shape:?}: {:?}", geometry.err());
        }
    }

    #[test]
    fn a_cylinder_shorter_than_the_body_is_refused() {
        let shape = RigidShape::Cylinder { radius_mm: 2.0, half_length_mm: 5.0 };
        let indenter = RigidIndenter { shape, start: TURNED, path: Vec::new() };
        // Its axis is the world's z; it is centred at z = 5.
        let at = |z: f64| indenter.refuse_ends([[1.0, 0.0, 5.0], [0.0, 2.0, z]].into_iter());
        assert_eq!(at(9.9), Ok(()));
        let refused = at(-1.0).unwrap_err();
        assert!(
            matches!(refused, ExportError::Ends { beyond_mm } if (beyond_mm - 1.0).abs() < 1e-12)
        );
    }

    #[test]
    fn a_shape_without_size_is_refused() {
        for shape in [
            RigidShape::Sphere { radius_mm: 0.0 },
            RigidShape::Sphere { radius_mm: f64::NAN },
            RigidShape::Plate { half_mm: [1.0, 1.0, 1.0], edge_radius_mm: 2.0 },
        ] {
            let indenter = RigidIndenter { shape, start: TURNED, path: Vec::new() };
            assert!(matches!(indenter.mesh(), Err(ExportError::Shape { .. })), "{shape:?}");
        }
    }
}

//! A curved finger and objects thrown at it.

use papilla_atlas::{Atlas, PatchVertices};
use papilla_contact::{Arrays, ContactModel, Header, Layer, Object};
use papilla_sdf::{
    Capsule, Cuboid, Cylinder, Dots, Grating, Mesh, Placement, Plate, Punch, Ring, RoundedPlate,
    SignedDistance, Sphere, Torus, Wedge,
};
use std::sync::Arc;

/// Where a model made by `fe-datagen contact` may lie.
const FILE: &str = "PAPILLA_CONTACT_MODEL";

/// A finger: the real one if there is a file, else the lower half of an ellipsoid on a half-space.
pub(crate) struct Finger {
    pub(crate) model: Arc<ContactModel>,
    pub(crate) places_mm: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f64; 3]>,
}

impl Finger {
    pub(crate) fn new() -> Self {
        Self::of(arrays())
    }

    pub(crate) fn of((header, arrays): (Header, Arrays)) -> Self {
        let triples = |x: &[f32]| {
            x.as_chunks::<3>().0.iter().map(|p| p.map(f64::from)).collect::<Vec<[f64; 3]>>()
        };
        let (places_mm, normals) = (triples(&arrays.positions_mm), triples(&arrays.normals));
        let model = Arc::new(ContactModel::new(header, arrays).expect("a model"));
        Self { model, places_mm, normals }
    }
}

/// The real finger's arrays if there is a file, else the ellipsoid's.
pub(crate) fn arrays() -> (Header, Arrays) {
    match std::env::var(FILE) {
        Ok(file) => Arrays::read(&std::fs::read(file).expect("it can be read")).expect("a model"),
        Err(_) => ellipsoid(),
    }
}

/// The atlas of [`Finger::new`]: the real one's beside its file, else a plane grid.
pub(crate) fn atlas() -> Atlas {
    if let Ok(file) = std::env::var(FILE) {
        let beside = std::path::Path::new(&file).with_file_name("atlas.json");
        let text = std::fs::read_to_string(beside).expect("an atlas beside the model");
        return Atlas::from_json(&text).expect("an atlas");
    }
    let arrays = arrays().1;
    let positions_mm = arrays.positions_mm.as_chunks::<3>().0.to_vec();
    let triangles = arrays.triangles.as_chunks::<3>().0.to_vec();
    let uv = |i: usize| [(i / SIDE[0]) as f32 * 8.0 + 16.0, 206.0 - (i % SIDE[0]) as f32 * 7.0];
    let uv_px = (0..positions_mm.len()).map(uv).collect();
    let patch = PatchVertices { positions_mm, uv_px };
    Atlas::new(0.08, triangles, patch.clone(), patch).expect("an atlas")
}

const HALF_MM: [f64; 3] = [10.0, 7.0, 6.0];
const MODULUS_MPA: f64 = 0.1;
const SIDE: [usize; 2] = [29, 23];

fn ellipsoid() -> (Header, Arrays) {
    let angle = |k: usize, n: usize| (2.0 * k as f64 / (n - 1) as f64 - 1.0) * 1.05;
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..SIDE[1] {
        for column in 0..SIDE[0] {
            let (a, b) = (angle(column, SIDE[0]), angle(row, SIDE[1]));
            let unit = [a.sin() * b.cos(), b.sin(), -a.cos() * b.cos()];
            positions.extend((0..3).map(|i| (HALF_MM[i] * unit[i]) as f32));
            let slope: [f64; 3] = std::array::from_fn(|i| unit[i] / HALF_MM[i]);
            let size = slope.iter().map(|v| v * v).sum::<f64>().sqrt();
            normals.extend(slope.map(|v| (v / size) as f32));
            if row + 1 < SIDE[1] && column + 1 < SIDE[0] {
                let (at, s) = ((row * SIDE[0] + column) as u32, SIDE[0] as u32);
                triangles.extend([at, at + s, at + 1, at + 1, at + s, at + s + 1]);
            }
        }
    }
    let v = SIDE[0] * SIDE[1];
    let areas = areas(&positions, &triangles, v);
    let header = Header {
        vertices: v,
        triangles: triangles.len() / 3,
        share_max: 1.0,
        depth_max_mm: 1.0,
        atlas_hash: "ellipsoid".into(),
        layers: vec![Layer { young_mpa: 0.075, poisson: 0.49, thickness_mm: 60.0 }],
        ..Header::current()
    };
    (header, Arrays::half_space(positions, normals, areas, triangles, MODULUS_MPA))
}

fn areas(positions: &[f32], triangles: &[u32], v: usize) -> Vec<f32> {
    let place = |i: u32| positions.as_chunks::<3>().0[i as usize];
    let mut areas = vec![0.0; v];
    for corners in triangles.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(place);
        let (p, q): ([f32; 3], [f32; 3]) =
            (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let third = n.iter().map(|v| v * v).sum::<f32>().sqrt() / 6.0;
        corners.iter().for_each(|c| areas[*c as usize] += third);
    }
    areas
}

/// Shapes of all kinds, each with the height of its top.
pub(crate) fn shapes() -> Vec<(Arc<dyn SignedDistance>, f64)> {
    let plate = RoundedPlate::from(&Plate::default());
    vec![
        (Arc::new(plate), plate.half_mm[2]),
        (Arc::new(Sphere { radius_mm: 4.0 }), 4.0),
        (Arc::new(Sphere { radius_mm: 40.0 }), 40.0),
        (Arc::new(Cylinder { radius_mm: 2.0, length_mm: 20.0, end_radius_mm: 0.5 }), 2.0),
        (Arc::new(Wedge::default()), 0.0),
        (Arc::new(Punch::default()), 0.0),
        (Arc::new(Ring::default()), Ring::default().height_mm / 2.0),
        (Arc::new(Grating::default()), 0.0),
        (Arc::new(Dots::default()), 0.0),
        (Arc::new(cuboid([3.0, 2.0, 1.0]).build().expect("closed")), 1.0),
        (Arc::new(RoundedPlate::from(&Cuboid::default())), 5.0),
        (Arc::new(Cylinder::from(&Capsule::default())), 3.0),
        (Arc::new(Torus::default()), 1.0),
    ]
}

fn cuboid(half: [f64; 3]) -> Mesh {
    let corner =
        |i: usize| std::array::from_fn(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] });
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh { vertices_mm: (0..8).map(corner).collect(), triangles }
}

/// Where an object is thrown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Throw {
    pub(crate) vertex: usize,
    /// How far its top lies below the skin at the vertex, mm.
    pub(crate) depth_mm: f64,
    /// Turn away from the normal, degrees, and about it.
    pub(crate) tilt_deg: [f64; 2],
    pub(crate) spin_deg: f64,
}

impl Finger {
    pub(crate) fn place(
        &self,
        (shape, top): &(Arc<dyn SignedDistance>, f64),
        throw: Throw,
    ) -> Object {
        let n = self.normals[throw.vertex];
        let turn =
            Placement::turned(throw.tilt_deg[0], throw.tilt_deg[1], throw.spin_deg, [0.0; 3]);
        // Columns: two tangents and the way against the skin's normal.
        let up = n.map(|v| -v);
        let other = if up[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let side = cross(other, up);
        let size = side.iter().map(|v| v * v).sum::<f64>().sqrt();
        let x = side.map(|v| v / size);
        let y = cross(up, x);
        let rotation = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                x[i] * turn.rotation[0][j]
                    + y[i] * turn.rotation[1][j]
                    + up[i] * turn.rotation[2][j]
            })
        });
        let tip: [f64; 3] = std::array::from_fn(|i| {
            let r: [[f64; 3]; 3] = rotation;
            r[i][2] * top
        });
        let at = self.places_mm[throw.vertex];
        let origin_mm = std::array::from_fn(|i| at[i] + throw.depth_mm * up[i] - tip[i]);
        Object::rigid(shape.clone(), Placement { rotation, origin_mm })
    }

    /// The lowest vertex.
    pub(crate) fn lowest(&self) -> usize {
        let lower = |i: &usize, j: &usize| self.places_mm[*i][2].total_cmp(&self.places_mm[*j][2]);
        (0..self.places_mm.len()).min_by(lower).expect("a vertex")
    }

    /// Vertices of the pad, far from where the skin ends.
    pub(crate) fn inner(&self) -> Vec<usize> {
        let [x, y, _] = self.places_mm[self.lowest()];
        let is_near = |i: &usize| {
            let at = self.places_mm[*i];
            (at[0] - x).abs() < 3.0 && (at[1] - y).abs() < 2.5
        };
        (0..self.places_mm.len()).filter(is_near).collect()
    }

    /// Whether the tip of an object lies in the finger, a millimetre or more from where its skin ends.
    pub(crate) fn holds(&self, object: &Object) -> bool {
        let inward = [0, 1, 2].map(|i| object.placement.rotation[i][2]);
        let reach = object.placement.reach_mm(object.shape.as_ref(), inward);
        let o = object.placement.origin_mm;
        let along: f64 = (0..3).map(|i| o[i] * inward[i]).sum();
        let tip: [f64; 3] = std::array::from_fn(|i| o[i] + (reach - along) * inward[i]);
        let top = self.places_mm.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
        let nearest = |a: &usize, b: &usize| {
            let away =
                |i: usize| (0..3).map(|k| (self.places_mm[i][k] - tip[k]).powi(2)).sum::<f64>();
            away(*a).total_cmp(&away(*b))
        };
        let vertex = (0..self.places_mm.len()).min_by(nearest).expect("a vertex");
        let above: f64 =
            (0..3).map(|i| (tip[i] - self.places_mm[vertex][i]) * self.normals[vertex][i]).sum();
        above < -0.3 && tip[2] < top - 1.0
    }

    /// Whether the tip of an object lies below where the skin ends above.
    pub(crate) fn is_about(&self, object: &Object) -> bool {
        let tip = object.placement.reach_mm(object.shape.as_ref(), [0.0, 0.0, 1.0]);
        tip < self.places_mm.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether all of the finger lies below an object, or nearly.
    pub(crate) fn is_below(&self, object: &Object) -> bool {
        let low = -object.placement.reach_mm(object.shape.as_ref(), [0.0, 0.0, -1.0]);
        let top = self.places_mm.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
        low > top - 0.5
    }

    /// Least distance of the undeformed skin from the objects, mm.
    pub(crate) fn clearance_mm(&self, objects: &[Object]) -> f64 {
        let of = |o: &Object| {
            let one = |p: &[f64; 3]| o.placement.clearance_mm(o.shape.as_ref(), *p);
            self.places_mm.iter().map(one).fold(f64::INFINITY, f64::min)
        };
        objects.iter().map(of).fold(f64::INFINITY, f64::min)
    }
}

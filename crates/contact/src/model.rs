//! The contact model: what is known of a finger before anything touches it.

use crate::back::Back;
use crate::clusters::Clusters;
use crate::compliance::Compliance;
use crate::error::ModelError;
use crate::layer::Layer;
use crate::second_order::SecondOrder;
use crate::slopes::{Slopes, slopes};
use serde::{Deserialize, Serialize};

/// Version of the file.
const FORMAT: u32 = 4;
/// Most vertices of a skin.
const VERTICES_MAX: usize = 8192;
/// Most layers of a skin.
const LAYERS_MAX: usize = 16;

/// Header of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the file.
    pub format: u32,
    /// Program and version that made it.
    pub software: String,
    /// Hash of the atlas whose vertices these are.
    pub atlas_hash: String,
    /// Effects of the finger that it stands for.
    pub effects: Vec<String>,
    /// Hashes of the datasets whose training indentations gave the load modes.
    pub datasets: Vec<String>,
    /// V.
    pub vertices: usize,
    /// T.
    pub triangles: usize,
    /// R: load modes of the second order; 0 without.
    pub modes: usize,
    /// K: displacement modes of the second order.
    pub outputs: usize,
    /// Largest share of second-order displacement among the training indentations; beyond it
    /// an answer is out of range.
    pub share_max: f32,
    /// Deepest training indentation, mm; beyond it an answer is out of range. 0: not known.
    #[serde(default)]
    pub depth_max_mm: f32,
    /// Hash of the finger's dimensions and tissues, as `fe-datagen finger explain` prints it; empty:
    /// not known. Bone and tissues do not show in the atlas.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub finger_sha256: String,
    /// Hash of the file that described the finger ([`crate::finger_file_sha256`]); empty: not known. Whoever
    /// has the file but no meshes can tell by it whether the model is of that file.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub finger_file_sha256: String,
    /// Layers below the middle of the pad, from the surface down to the bone; none: pixels cannot be
    /// solved.
    #[serde(default)]
    pub layers: Vec<Layer>,
    /// Step to which the file rounds compliance, mm/N; 0: of the writer's choice.
    #[serde(default)]
    pub compliance_step_mm_per_n: f32,
}

/// Arrays of a file, in its order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arrays {
    /// `[V, 3]`: undeformed vertices in the finger's frame, mm.
    pub positions_mm: Vec<f32>,
    /// `[V, 3]`: outward unit normals.
    pub normals: Vec<f32>,
    /// `[V]`: undeformed areas, mm2.
    pub areas_mm2: Vec<f32>,
    /// `[T, 3]`: the atlas' triangles.
    pub triangles: Vec<u32>,
    /// `[3 V (3 V + 1) / 2]`: upper triangle, row by row, of the displacement (mm) of component
    /// `3 i + a` under a force of 1 N on component `3 k + b`.
    pub compliance_mm_per_n: Vec<f32>,
    /// `[V, 3, R]`: amplitude of each load mode for 1 N on a component.
    pub projection: Vec<f32>,
    /// `[R (R + 1) / 2, K]`: displacement amplitudes of products of load amplitudes `k <= l`.
    pub products: Vec<f32>,
    /// `[V, 3, K]`: displacement modes, mm; orthonormal over the skin.
    pub displacements: Vec<f32>,
}

/// A finger's contact model, ready for any number of solvers.
#[derive(Debug)]
pub struct ContactModel {
    header: Header,
    pub(crate) positions_mm: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) areas_mm2: Vec<f32>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) compliance: Compliance,
    pub(crate) clusters: Clusters,
    pub(crate) second_order: Option<SecondOrder>,
    /// Gradients over each triangle.
    pub(crate) slopes: Vec<Slopes>,
    /// Triangles round each vertex.
    pub(crate) around: Vec<Vec<u32>>,
    /// Whether the skin ends at each vertex.
    pub(crate) border: Vec<bool>,
    /// The lowest vertex, where the pad is.
    pub(crate) lowest: u32,
    pub(crate) back: Back,
    /// Ends of the skin along x, y and z, mm.
    ends_mm: [[f64; 2]; 3],
}

impl ContactModel {
    /// A model of the arrays.
    ///
    /// # Errors
    /// [`ModelError`] names the array that does not fit.
    pub fn new(header: Header, arrays: Arrays) -> Result<Self, ModelError> {
        let (v, r, k) = (header.vertices, header.modes, header.outputs);
        header.require_format()?;
        header.require_layers()?;
        arrays.require_lengths(&header)?;
        for (array, values) in arrays.floats() {
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                let value = f64::from(values[index]);
                return Err(ModelError::Value { array, index, value, rule: "not finite" });
            }
        }
        if let Some(index) = arrays.triangles.iter().position(|i| *i as usize >= v) {
            let value = f64::from(arrays.triangles[index]);
            let rule = "not a vertex";
            return Err(ModelError::Value { array: "triangles", index, value, rule });
        }
        if let Some(index) = arrays.areas_mm2.iter().position(|a| !(*a > 0.0)) {
            let value = f64::from(arrays.areas_mm2[index]);
            let rule = "areas have to be positive";
            return Err(ModelError::Value { array: "areas_mm2", index, value, rule });
        }
        let triples = |x: &[f32]| x.as_chunks::<3>().0.to_vec();
        let triangles = arrays.triangles.as_chunks::<3>().0.to_vec();
        let mut around = vec![Vec::new(); v];
        for (n, triangle) in triangles.iter().enumerate() {
            for &corner in triangle {
                around[corner as usize].push(n as u32);
            }
        }
        let second_order = (r > 0).then(|| {
            SecondOrder::new([r, k], arrays.projection, arrays.products, arrays.displacements)
        });
        let positions_mm: Vec<[f64; 3]> =
            triples(&arrays.positions_mm).into_iter().map(|p| p.map(f64::from)).collect();
        let normals = triples(&arrays.normals);
        let slopes = slopes(&positions_mm, &triangles);
        let border = border(v, &triangles);
        let lowest = (0..v).min_by(|a, b| positions_mm[*a][2].total_cmp(&positions_mm[*b][2]));
        let ends_mm = [0, 1, 2].map(|i| {
            let along = positions_mm.iter().map(|p| p[i]);
            [along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max)]
        });
        let clusters = Clusters::new(&positions_mm);
        let mut rank = vec![0; v];
        for (column, &vertex) in clusters.order().iter().enumerate() {
            rank[vertex as usize] = column as u32;
        }
        Ok(Self {
            areas_mm2: arrays.areas_mm2,
            triangles,
            compliance: Compliance::unpacked(
                &arrays.compliance_mm_per_n,
                rank,
                header.compliance_step_mm_per_n,
            )?,
            clusters,
            second_order,
            slopes,
            around,
            border,
            lowest: lowest.unwrap_or(0) as u32,
            back: Back::of(&positions_mm, &normals),
            normals,
            positions_mm,
            ends_mm,
            header,
        })
    }

    /// What the file says of itself.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.areas_mm2.len()
    }

    /// The lowest vertex, mm: where something flat meets the pad from below.
    #[must_use]
    pub fn lowest_mm(&self) -> [f64; 3] {
        self.positions_mm[self.lowest as usize]
    }

    /// Whether a place lies between the ends of the skin.
    pub(crate) fn is_between_ends(&self, at_mm: [f64; 3]) -> bool {
        (0..3).all(|i| (self.ends_mm[i][0]..=self.ends_mm[i][1]).contains(&at_mm[i]))
    }

    /// Places between a vertex and its neighbours, mm: middles of sides, and of triangles.
    pub(crate) fn beside(&self, vertex: u32) -> impl Iterator<Item = [f64; 3]> {
        self.around[vertex as usize].iter().flat_map(move |triangle| {
            let corners = self.triangles[*triangle as usize];
            let place = |corner: u32| self.positions_mm[corner as usize];
            let [a, b, c] = corners.map(place);
            let next = corners.iter().position(|corner| *corner == vertex).unwrap_or(0) + 1;
            let (own, next) = (place(vertex), place(corners[next % 3]));
            let side = std::array::from_fn(|i| 0.5 * (own[i] + next[i]));
            [side, std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0)]
        })
    }

    /// How far the box round the skin goes along a direction, mm from the origin.
    pub(crate) fn end_mm(&self, direction: [f64; 3]) -> f64 {
        let along = |i: usize| self.ends_mm[i].map(|end| end * direction[i]);
        (0..3).map(|i| along(i)[0].max(along(i)[1])).sum()
    }

    /// Refuses a model that was made of another description of the finger than the one with this
    /// [hash](crate::finger_file_sha256). A model that does not know its description is accepted.
    ///
    /// # Errors
    /// [`ModelError::Finger`].
    pub fn require_finger_file(&self, sha256: &str) -> Result<(), ModelError> {
        let own = &self.header.finger_file_sha256;
        if own.is_empty() || own == sha256 { Ok(()) } else { Err(ModelError::Finger) }
    }

    /// Refuses a model of another atlas.
    ///
    /// # Errors
    /// [`ModelError::Atlas`].
    pub fn require_atlas(&self, hash: &str) -> Result<(), ModelError> {
        if self.header.atlas_hash == hash {
            return Ok(());
        }
        let (found, expected) = (self.header.atlas_hash.clone(), hash.to_owned());
        Err(ModelError::Atlas { found, expected })
    }
}

/// Whether each of so many vertices has a side of one triangle alone.
fn border(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let sides = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]];
    let mut sides: Vec<[u32; 2]> = triangles.iter().flat_map(sides).collect();
    sides.iter_mut().for_each(|side| side.sort_unstable());
    sides.sort_unstable();
    let mut border = vec![false; vertices];
    for same in sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
        same[0].iter().for_each(|vertex| border[*vertex as usize] = true);
    }
    border
}

impl Header {
    /// A header of this version.
    #[must_use]
    pub fn current() -> Self {
        Self { format: FORMAT, ..Self::default() }
    }

    /// Reads a header whose version is this one; of another one the rest may differ.
    pub(crate) fn of_json(json: &[u8]) -> Result<Self, ModelError> {
        #[derive(Deserialize)]
        struct Version {
            format: u32,
        }
        let Version { format } = serde_json::from_slice(json)?;
        Self { format, ..Self::default() }.require_format()?;
        Ok(serde_json::from_slice(json)?)
    }

    /// Refuses layers that no tissue has.
    fn require_layers(&self) -> Result<(), ModelError> {
        if self.layers.len() > LAYERS_MAX {
            return Err(ModelError::Format("its header names more layers than a skin has"));
        }
        let values = self.layers.iter().enumerate().flat_map(|(index, layer)| {
            let Layer { young_mpa, poisson, thickness_mm } = *layer;
            let positive = |value: f64| value > 0.0 && value.is_finite();
            [
                ("layers.young_mpa", index, young_mpa, positive(young_mpa)),
                ("layers.thickness_mm", index, thickness_mm, positive(thickness_mm)),
                ("layers.poisson", index, poisson, (0.0..0.5).contains(&poisson)),
            ]
        });
        let mut wrong = values.filter(|(.., is_good)| !is_good);
        wrong.next().map_or(Ok(()), |(array, index, value, _)| {
            Err(ModelError::Value { array, index, value, rule: "no tissue's" })
        })
    }

    pub(crate) fn require_format(&self) -> Result<(), ModelError> {
        let (found, expected) = (self.format, FORMAT);
        if found == expected { Ok(()) } else { Err(ModelError::Version { found, expected }) }
    }
}

impl Arrays {
    /// Refuses arrays that are not as long as the header says.
    pub(crate) fn require_lengths(&self, header: &Header) -> Result<(), ModelError> {
        let floats = self.floats().map(|(_, values)| values.len());
        let due = lengths(header)?.into_iter().zip(floats);
        let triangles = ("triangles", 3 * header.triangles);
        for ((array, expected), found) in due.chain([(triangles, self.triangles.len())]) {
            if found != expected {
                return Err(ModelError::Length { array, found, expected });
            }
        }
        Ok(())
    }

    pub(crate) fn floats(&self) -> [(&'static str, &[f32]); 7] {
        [
            ("positions_mm", &self.positions_mm),
            ("normals", &self.normals),
            ("areas_mm2", &self.areas_mm2),
            ("compliance_mm_per_n", &self.compliance_mm_per_n),
            ("projection", &self.projection),
            ("products", &self.products),
            ("displacements", &self.displacements),
        ]
    }
}

/// Lengths of the arrays of floats, in the order of [`Arrays::floats`].
pub(crate) fn lengths(header: &Header) -> Result<[(&'static str, usize); 7], ModelError> {
    let (v, r, k) = (header.vertices, header.modes, header.outputs);
    if !(1..=VERTICES_MAX).contains(&v) || header.triangles > 4 * v || r > v || k > v {
        return Err(ModelError::Format("its header names sizes that no finger has"));
    }
    Ok([
        ("positions_mm", 3 * v),
        ("normals", 3 * v),
        ("areas_mm2", v),
        ("compliance_mm_per_n", 3 * v * (3 * v + 1) / 2),
        ("projection", 3 * v * r),
        ("products", r * (r + 1) / 2 * k),
        ("displacements", 3 * v * k),
    ])
}

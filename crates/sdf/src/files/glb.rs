//! Binary glTF 2.0: the triangles of every mesh, placed by the nodes of the scene.
//!
//! Read here and not by the crate `gltf`, which turns on a feature of serde_json in the whole
//! workspace: positions, indices and the nodes' transforms are all that is needed.

use crate::Mesh as Surface;
use serde::Deserialize;

/// `glTF`.
const MAGIC: u32 = 0x4654_6C67;
/// `JSON`.
const JSON: u32 = 0x4E4F_534A;
/// `BIN`.
const BIN: u32 = 0x004E_4942;
/// Nodes above a node, at most: more are a circle.
const DEPTH_MAX: usize = 64;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
struct Document {
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    meshes: Vec<Mesh>,
    nodes: Vec<Node>,
    scenes: Vec<Scene>,
    scene: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: std::collections::BTreeMap<String, usize>,
    indices: Option<usize>,
    #[serde(default = "triangles")]
    mode: u32,
}

/// The mode of separate triangles.
fn triangles() -> u32 {
    4
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Node {
    mesh: Option<usize>,
    children: Vec<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

/// A linear map, by rows, and a shift.
type Affine = ([[f64; 3]; 3], [f64; 3]);

pub(super) fn read(bytes: &[u8]) -> Result<Surface, String> {
    let word = |at: usize| -> Option<u32> {
        Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
    };
    if word(0) != Some(MAGIC) || word(4) != Some(2) {
        return Err("no binary glTF 2.0 (.gltf files have to be exported as .glb)".into());
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let end = (at + 8).checked_add(length as usize).filter(|e| *e <= bytes.len());
        let end = end.ok_or("a chunk reaches beyond the end of the file")?;
        match kind {
            JSON => json = Some(&bytes[at + 8..end]),
            BIN => binary = Some(&bytes[at + 8..end]),
            _ => {}
        }
        at = end;
    }
    let text = json.ok_or("it has no JSON")?;
    let document: Document = papilla_json::read(text).map_err(|e| e.to_string())?;
    let reader = Reader { document: &document, binary: binary.unwrap_or_default() };
    let mut surface = Surface::default();
    let unit: Affine = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]);
    match document.scenes.get(document.scene) {
        Some(scene) => {
            for &node in &scene.nodes {
                reader.walk(node, &unit, 0, &mut surface)?;
            }
        }
        None => {
            for mesh in 0..document.meshes.len() {
                reader.mesh(mesh, &unit, &mut surface)?;
            }
        }
    }
    Ok(surface)
}

struct Reader<'a> {
    document: &'a Document,
    binary: &'a [u8],
}

impl Reader<'_> {
    fn walk(
        &self,
        node: usize,
        above: &Affine,
        depth: usize,
        out: &mut Surface,
    ) -> Result<(), String> {
        if depth > DEPTH_MAX {
            return Err("its nodes hang in a circle".into());
        }
        let of = self.document.nodes.get(node).ok_or("a node is not there")?;
        let here = after(above, &transform(of));
        if let Some(mesh) = of.mesh {
            self.mesh(mesh, &here, out)?;
        }
        of.children.iter().try_for_each(|&child| self.walk(child, &here, depth + 1, out))
    }

    fn mesh(&self, mesh: usize, place: &Affine, out: &mut Surface) -> Result<(), String> {
        let mesh = self.document.meshes.get(mesh).ok_or("a mesh is not there")?;
        for primitive in mesh.primitives.iter().filter(|p| p.mode == triangles()) {
            let position = primitive.attributes.get("POSITION").ok_or("a mesh has no POSITION")?;
            let first = out.vertices_mm.len() as u32;
            let places = self.numbers(*position, "VEC3")?;
            let (m, shift) = place;
            out.vertices_mm.extend(places.chunks_exact(3).map(|p| -> [f64; 3] {
                std::array::from_fn(|i| (0..3).map(|j| m[i][j] * p[j]).sum::<f64>() + shift[i])
            }));
            let indices: Vec<u32> = match primitive.indices {
                Some(of) => self.numbers(of, "SCALAR")?.iter().map(|&v| v as u32).collect(),
                None => (0..places.len() as u32 / 3).collect(),
            };
            let triangles = indices.chunks_exact(3);
            out.triangles
                .extend(triangles.map(|t| std::array::from_fn(|k| t[k].saturating_add(first))));
        }
        Ok(())
    }

    /// The numbers of an accessor of this type.
    fn numbers(&self, accessor: usize, kind: &str) -> Result<Vec<f64>, String> {
        let of = self.document.accessors.get(accessor).ok_or("an accessor is not there")?;
        let view = of.buffer_view.and_then(|v| self.document.buffer_views.get(v));
        let view =
            view.ok_or("an accessor has no plain buffer view (compressed meshes are not read)")?;
        let components = if kind == "VEC3" { 3 } else { 1 };
        let size = match of.component_type {
            5121 => 1,
            5123 => 2,
            5125 | 5126 => 4,
            other => return Err(format!("component type {other} is not known")),
        };
        if of.kind != kind || (kind == "VEC3") != (of.component_type == 5126) {
            return Err(format!("an accessor is {} of type {}", of.kind, of.component_type));
        }
        let stride = view.byte_stride.unwrap_or(size * components);
        let beyond = "an accessor reaches beyond its buffer";
        let last = view.byte_offset.checked_add(view.byte_length).ok_or(beyond)?;
        let data = self.binary.get(view.byte_offset..last).ok_or(beyond)?;
        let end = stride.checked_mul(of.count.saturating_sub(1));
        let end = end.and_then(|e| e.checked_add(of.byte_offset + size * components));
        if of.count > 0 && end.is_none_or(|e| e > data.len()) {
            return Err(beyond.into());
        }
        let value = |at: usize| match size {
            1 => f64::from(data[at]),
            2 => f64::from(u16::from_le_bytes([data[at], data[at + 1]])),
            _ => {
                let word = [data[at], data[at + 1], data[at + 2], data[at + 3]];
                match of.component_type {
                    5126 => f64::from(f32::from_le_bytes(word)),
                    _ => f64::from(u32::from_le_bytes(word)),
                }
            }
        };
        let places = (0..of.count).map(|n| of.byte_offset + n * stride);
        Ok(places.flat_map(|at| (0..components).map(move |c| at + c * size)).map(value).collect())
    }
}

fn transform(node: &Node) -> Affine {
    if let Some(m) = node.matrix {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| m[4 * j + i]));
        return (rows, [m[12], m[13], m[14]]);
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let s = node.scale.unwrap_or([1.0; 3]);
    let rotation = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let rows = rotation.map(|row| std::array::from_fn(|j| row[j] * s[j]));
    (rows, node.translation.unwrap_or_default())
}

/// First `inner`, then `outer`.
fn after((a, p): &Affine, (b, q): &Affine) -> Affine {
    let rows =
        std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()));
    (rows, std::array::from_fn(|i| p[i] + (0..3).map(|k| a[i][k] * q[k]).sum::<f64>()))
}

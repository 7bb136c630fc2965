//! Both patches as binary glTF 2.0.
//!
//! One mesh a patch, vertices in the atlas's order, so that vertex `i` here is vertex `i` of
//! `/v1/atlas`. Positions are the atlas's, in mm; a node scales them to glTF's metres. glTF's
//! texture coordinates begin at the upper left, as the map does: `uv_px / 224`.

use super::{Atlas, Patch};
use crate::MAP_SIDE_PX;
use papilla_vector::{cross, minus, norm};
use serde_json::{Value, json};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const CLAMP_TO_EDGE: u32 = 33071;
const NEAREST: u32 = 9728;

/// The binary chunk and what lies in it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends bytes; returns the number of their view.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view =
            json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Appends vectors, one a vertex; returns the number of their accessor.
    fn vectors<const N: usize>(&mut self, vectors: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> =
            vectors.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let limit = |of: fn(f32, f32) -> f32, start: f32| {
            vectors.iter().fold([start; N], |limit, vector| {
                std::array::from_fn(|axis| of(limit[axis], vector[axis]))
            })
        };
        let (low, high) = (limit(f32::min, f32::INFINITY), limit(f32::max, f32::NEG_INFINITY));
        self.accessors.push(json!({
            "bufferView": view, "componentType": FLOAT, "count": vectors.len(),
            "type": format!("VEC{N}"), "min": low.to_vec(), "max": high.to_vec(),
        }));
        self.accessors.len() - 1
    }

    /// Appends the triangles; returns the number of their accessor.
    fn triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let indices = triangles.as_flattened();
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": indices.len(),
            "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }
}

/// The file. `masks` are the patches' masks as PNG, in the order of [`Patch::ALL`].
pub(super) fn write(atlas: &Atlas, masks: &[Vec<u8>; 2]) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let indices = buffer.triangles(atlas.triangles());
    let (mut meshes, mut nodes, mut images) = (Vec::new(), Vec::new(), Vec::new());
    let (mut textures, mut materials) = (Vec::new(), Vec::new());
    for (number, (patch, mask)) in Patch::ALL.into_iter().zip(masks).enumerate() {
        let vertices = atlas.patch(patch);
        let uv: Vec<[f32; 2]> =
            vertices.uv_px.iter().map(|uv| uv.map(|c| c / MAP_SIDE_PX as f32)).collect();
        let attributes = json!({
            "POSITION": buffer.vectors(&vertices.positions_mm),
            "NORMAL": buffer.vectors(&normals(atlas, patch)),
            "TEXCOORD_0": buffer.vectors(&uv),
        });
        let name = patch.name();
        let image = buffer.view(mask, None);
        images.push(
            json!({"name": format!("{name} mask"), "bufferView": image, "mimeType": "image/png"}),
        );
        textures.push(json!({"source": number, "sampler": 0}));
        materials.push(json!({"name": name, "pbrMetallicRoughness": {
            "baseColorTexture": {"index": number}, "metallicFactor": 0, "roughnessFactor": 0.8}}));
        let primitive = json!({"attributes": attributes, "indices": indices, "material": number});
        meshes.push(json!({"name": name, "primitives": [primitive]}));
        nodes.push(json!({"name": name, "mesh": number}));
    }
    // mm to metres; (x, y, z) to glTF's (z, x, y): the tip ahead (-z), the nail up (y).
    nodes.push(json!({"name": "finger", "scale": [0.001, 0.001, 0.001],
        "rotation": [-0.5, -0.5, -0.5, 0.5], "children": [0, 1]}));
    let document = json!({
        "asset": {"version": "2.0", "generator": "Papilla", "extras": {
            "atlas_hash": atlas.hash(), "mm_per_px": atlas.mm_per_px(), "size_px": atlas.size_px(),
            "pixel_of_a_vertex": "column = floor(224 u), row = floor(224 v)"}},
        "scene": 0, "scenes": [{"nodes": [2]}], "nodes": nodes, "meshes": meshes,
        "materials": materials, "textures": textures, "images": images,
        "samplers": [{"magFilter": NEAREST, "minFilter": NEAREST,
            "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE}],
        "accessors": buffer.accessors, "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.bytes.len()}],
    });
    container(document.to_string().into_bytes(), &buffer.bytes)
}

/// The JSON chunk and the binary chunk behind their headers.
fn container(mut document: Vec<u8>, bytes: &[u8]) -> Vec<u8> {
    document.resize(document.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + document.len() + 8 + bytes.len();
    let mut file = Vec::with_capacity(length);
    file.extend_from_slice(b"glTF");
    for number in [2, length, document.len()] {
        file.extend_from_slice(&(number as u32).to_le_bytes());
    }
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&document);
    file.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(bytes);
    file
}

/// Unit normals out of the finger: means of the triangles around, each by its area.
fn normals(atlas: &Atlas, patch: Patch) -> Vec<[f32; 3]> {
    let positions_mm = &atlas.patch(patch).positions_mm;
    let mut sums = vec![[0.0_f64; 3]; positions_mm.len()];
    for corners in atlas.triangles() {
        let [a, b, c] = corners.map(|vertex| positions_mm[vertex as usize].map(f64::from));
        let normal = cross(minus(b, a), minus(c, a));
        for vertex in corners {
            (0..3).for_each(|axis| sums[*vertex as usize][axis] += normal[axis]);
        }
    }
    let unit = |sum: [f64; 3]| {
        let length = norm(sum);
        // An atlas has no empty triangle; a vertex without one gets some direction.
        if length > 0.0 { sum.map(|s| (s / length) as f32) } else { [0.0, 0.0, -1.0] }
    };
    sums.into_iter().map(unit).collect()
}

//! Computes the contact model of a finger: what the contact solver of the service needs to know of
//! it.

use anyhow::Context;
use papilla_atlas::{Atlas, MAP_LEN, Patch, VertexSampler};
use papilla_contact::{Arrays, Header, Layer};
use papilla_dataset::{Dataset, Field, Maps, Shard, Split};
use papilla_fingertip::geometry::fingertip::{FingertipShape, SurfaceParameter};
use papilla_fingertip::influence::{self, Compliance, Load, SecondOrder};
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::{Finger, TissueTable};
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::tissue::Tissue;
use papilla_vector::norm;
use std::collections::HashMap;
use std::path::PathBuf;

/// Load modes of the second order, unless told otherwise.
pub(crate) const MODES: usize = 48;
/// Displacements of the second order, unless told otherwise.
pub(crate) const OUTPUTS: usize = 48;

/// What a contact model is made of.
pub(crate) struct Recipe<'a> {
    /// The finger.
    pub finger: &'a Finger,
    /// Datasets whose training indentations give the load modes.
    pub datasets: &'a [PathBuf],
    /// Whether they may be another finger's: fingers of the same template have the same vertices at
    /// the same (u, v), so that pressure there can be put on this one.
    pub of_any_finger: bool,
    /// Hash of the file that describes it; empty: there is none.
    pub finger_file_sha256: String,
    /// Load modes of the second order.
    pub modes: usize,
    /// Displacements of the second order.
    pub outputs: usize,
}

/// A contact model.
pub(crate) struct Made {
    /// The file.
    pub bytes: Vec<u8>,
    /// What it says of itself.
    pub header: Header,
    /// Loads that the modes were taken from.
    pub loads: usize,
}

/// A state that loads are taken from: the force on the finger, N, and pressure at the vertices, Pa.
struct Pressed {
    force_n: [f64; 3],
    pressure_pa: Vec<f32>,
}

/// What is read of the datasets, before anything is computed.
#[derive(Default)]
struct Presses {
    states: Vec<Pressed>,
    datasets: Vec<String>,
    depth_max_mm: f32,
}

/// Makes a contact model; `progress` is told the part, what is done of it and how much it is.
///
/// # Errors
/// A dataset cannot be read or is of another finger; the finger cannot be solved.
pub(crate) fn make(
    recipe: &Recipe<'_>,
    progress: &mut dyn FnMut(&'static str, usize, usize),
) -> anyhow::Result<Made> {
    let (density, order) = (Density::Medium, Order::Linear);
    let Finger { shape, tissue, .. } = recipe.finger;
    let rest = influence::body(shape, density, order, tissue)?;
    let (atlas, _) = rest.atlas().context("the finger has no atlas")??;
    let mut presses = Presses::default();
    for folder in recipe.datasets {
        let dataset = Dataset::open(folder)?;
        let fits = if recipe.of_any_finger {
            require_vertices(&atlas, dataset.atlas())
        } else {
            dataset.atlas().require_hash(atlas.hash()).map_err(Into::into)
        };
        fits.with_context(|| folder.display().to_string())?;
        presses.read(&dataset)?;
    }
    let vertices = rest.patch.as_ref().map_or(0, |p| p.patch.skin.len());
    let compliance =
        influence::compliance(&rest, &mut |done| progress("forces", done, 3 * vertices))?;
    let skin = atlas.patch(Patch::Skin);
    let mut loads = presses.loads(&compliance);
    let Presses { datasets, depth_max_mm, .. } = presses;
    add_mirrored(&template_places(shape)?, &mut loads);
    let body = Body::even(shape, tissue, density)?;
    let pairs = recipe.modes * (recipe.modes + 1) / 2;
    let second = influence::second_order(
        &body,
        &compliance,
        &loads,
        [recipe.modes, recipe.outputs],
        &mut |done| progress("pairs of load modes", done, pairs),
    )?;
    let header = Header {
        software: concat!("fe-datagen ", env!("CARGO_PKG_VERSION")).into(),
        atlas_hash: compliance.atlas_hash.clone(),
        effects: ["finite_strain", "layers"]
            .into_iter()
            .map(String::from)
            .chain(tissue.needs.iter().cloned())
            .collect(),
        datasets,
        vertices,
        triangles: atlas.triangles().len(),
        modes: second.modes,
        outputs: second.outputs,
        share_max: second.share_max as f32,
        depth_max_mm,
        finger_sha256: recipe.finger.sha256(),
        finger_file_sha256: recipe.finger_file_sha256.clone(),
        layers: layers_below_pad(shape, tissue)?,
        ..Header::current()
    };
    let arrays = arrays(&compliance, second, &skin.positions_mm, atlas.triangles());
    Ok(Made { bytes: arrays.to_bytes(&header)?, header, loads: loads.len() })
}

/// Whether another finger's atlas has the same vertices.
fn require_vertices(own: &Atlas, other: &Atlas) -> anyhow::Result<()> {
    anyhow::ensure!(
        own.triangles() == other.triangles(),
        "its atlas has other vertices than the finger's: take a dataset of a finger of this template"
    );
    Ok(())
}

/// Where vertices of the template's skin lie: it is its own mirror image, as a finger with a skin
/// of its own is not.
fn template_places(shape: &FingertipShape) -> anyhow::Result<Vec<[f32; 3]>> {
    let template =
        FingertipShape { offset: None, epidermis_map: None, dermis_map: None, ..shape.clone() };
    let body = Body::even(&template, &TissueTable::default(), Density::Medium)?;
    let (atlas, _) = body.atlas().context("the finger has no atlas")??;
    Ok(atlas.patch(Patch::Skin).positions_mm.clone())
}

/// Skin from the surface down to the bone, below the middle of the pad. None of skin under tension:
/// the closed form of plane layers has none, and without layers the service takes a method that needs
/// no closed form.
fn layers_below_pad(shape: &FingertipShape, tissues: &TissueTable) -> anyhow::Result<Vec<Layer>> {
    if tissues.skin_tension_n_per_mm.is_some() {
        return Ok(Vec::new());
    }
    let bounds = shape.layers(SurfaceParameter::Body([0.0, -1.0], 0.0))?;
    let tissue = [Tissue::Epidermis, Tissue::Dermis, Tissue::Subcutaneous];
    let layer = |(tissue, ends): (Tissue, &[[f64; 3]])| {
        let spec = tissues.of(tissue);
        // The way goes up: bone lies above the palmar skin.
        let thickness_mm = ends[1][2] - ends[0][2];
        Layer { young_mpa: spec.youngs_modulus_mpa, poisson: spec.poissons_ratio, thickness_mm }
    };
    Ok(tissue.into_iter().zip(bounds.windows(2)).map(layer).collect())
}

impl Presses {
    /// Adds the deepest and a middle state of each training indentation.
    fn read(&mut self, dataset: &Dataset) -> anyhow::Result<()> {
        let maps = Maps::read(dataset.folder(), dataset.atlas())?;
        let sampler = VertexSampler::new(dataset.atlas(), maps.raster(Patch::Skin));
        for press in dataset.of_split(Split::Train) {
            let shard = dataset.shard(press)?;
            let depths = shard.depth_mm.iter().copied();
            self.depth_max_mm = depths.fold(self.depth_max_mm, f32::max);
            let last = shard.len() - 1;
            for state in [last / 2, last] {
                let pressure_pa = at_vertices(&shard, state, &maps, &sampler)?;
                let force_n = std::array::from_fn(|i| f64::from(shard.force_n[[state, i]]));
                self.states.push(Pressed { force_n, pressure_pa });
            }
        }
        self.datasets.push(dataset.manifest().dataset_sha256.clone());
        Ok(())
    }

    /// Their forces: pressure times undeformed area along the recorded force, as large as that.
    fn loads(&self, compliance: &Compliance) -> Vec<Load> {
        let mut loads = Vec::new();
        for Pressed { force_n, pressure_pa } in &self.states {
            let size = norm(*force_n);
            let areas_mm2 = &compliance.area_mm2;
            let weights = pressure_pa.iter().zip(areas_mm2).map(|(p, a)| f64::from(p * a));
            let total: f64 = weights.clone().sum();
            if !(size > 0.0 && total > 0.0) {
                continue;
            }
            let pressed = weights.enumerate().filter(|(_, w)| *w > 0.0);
            loads.push(pressed.map(|(v, w)| (v as u32, force_n.map(|f| f * w / total))).collect());
        }
        loads
    }
}

/// Pressure of a state at the atlas' vertices, Pa: as stored there, or read off the map.
fn at_vertices(
    shard: &Shard,
    state: usize,
    maps: &Maps,
    sampler: &VertexSampler,
) -> anyhow::Result<Vec<f32>> {
    if shard.cells.is_none() {
        return Ok(shard.pressure_pa.row(state).to_vec());
    }
    let mut map = vec![0.0; MAP_LEN];
    maps.of(shard).draw(Field::Pressure, state, &mut map)?;
    let mut values = vec![0.0; sampler.vertex_count()];
    sampler.sample(&map, &mut values)?;
    Ok(values)
}

/// The template is its own mirror image in y: loads on a finger of it may be mirrored.
fn add_mirrored(positions_mm: &[[f32; 3]], loads: &mut Vec<Load>) {
    let key = |p: &[f32; 3], sign: f32| [p[0], sign * p[1] + 0.0, p[2]].map(f32::to_bits);
    let at: HashMap<_, _> =
        positions_mm.iter().enumerate().map(|(i, p)| (key(p, 1.0), i as u32)).collect();
    let twin = |v: u32| at.get(&key(&positions_mm[v as usize], -1.0)).copied();
    let mirrored = |load: &Load| -> Option<Load> {
        load.iter().map(|(v, f)| Some((twin(*v)?, [f[0], -f[1], f[2]]))).collect()
    };
    let more: Vec<Load> = loads.iter().filter_map(mirrored).collect();
    loads.extend(more);
}

fn arrays(
    compliance: &Compliance,
    second: SecondOrder,
    positions_mm: &[[f32; 3]],
    triangles: &[[u32; 3]],
) -> Arrays {
    let size = 3 * positions_mm.len();
    let row = |i: usize| &compliance.mm_per_n[i * size..][..size];
    Arrays {
        positions_mm: positions_mm.as_flattened().to_vec(),
        normals: compliance.normal.as_flattened().to_vec(),
        areas_mm2: compliance.area_mm2.clone(),
        triangles: triangles.as_flattened().to_vec(),
        compliance_mm_per_n: (0..size).flat_map(|i| row(i)[i..].to_vec()).collect(),
        projection: second.projection,
        products: second.products,
        displacements: second.displacements,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skin_under_tension_is_no_stack_of_plane_layers() {
        let Finger { shape, mut tissue, .. } = Finger::usual();
        assert_eq!(layers_below_pad(&shape, &tissue).unwrap().len(), 3);
        tissue.skin_tension_n_per_mm = Some(0.01);
        assert!(layers_below_pad(&shape, &tissue).unwrap().is_empty());
    }
}

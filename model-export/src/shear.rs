//! What traction along the skin is worth: the error of SED by a network alone, and with the part
//! that layered skin adds for the traction, against FE with friction.

use crate::ExportError;
use crate::contact::Models;
use crate::dataset::Dataset;
use crate::metrics::{SampleMetrics, spread};
use papilla_contact::{InterfaceSkin, ShearEnergy};
use papilla_dataset::{Field, IndentationEntry, Shard};
use papilla_engine::ladder::Traction;
use papilla_engine::{MAP_LEN, Session};
use papilla_processor::thread_s;
use papilla_proto::atlas::{Patch, VertexSampler};
use std::path::Path;
use std::sync::Arc;

/// Measures all states of a dataset with friction, of whichever split: no network learns from it.
/// The network is given FE's pressure; traction is FE's at the atlas' vertices.
///
/// # Errors
/// [`ExportError`] of the dataset or the network, and for a dataset without traction or a contact
/// model without layers.
pub fn measure(
    models: &Models,
    dataset: &Dataset,
    (name, network): (&str, &mut (dyn Session + '_)),
) -> Result<Traction, ExportError> {
    let skin = Arc::new(dataset.maps.raster(Patch::Skin).clone());
    let sampler = VertexSampler::new(dataset.atlas(), &skin);
    let skin = InterfaceSkin::new(models.finger(), dataset.atlas(), skin);
    let bad = |path: &Path, reason: &str| {
        let (path, reason) = (path.to_owned(), reason.to_owned());
        ExportError::DatasetFile { path, reason }
    };
    let skin = skin.ok_or_else(|| bad(Path::new(""), "the contact model names no layers"))?;
    let mut energy = ShearEnergy::new(Arc::new(skin));
    let [mut alone, mut felt, mut added_ms] = [(); 3].map(|()| Vec::new());
    let [mut pressure_pa, mut sed, mut truth] = [(); 3].map(|()| vec![0.0; MAP_LEN]);
    for indentation in dataset.every_indentation() {
        let shard = dataset.shard(indentation)?;
        let path = dataset.shard_path(indentation);
        for state in 0..indentation.samples {
            let shear_pa = traction(dataset, indentation, &shard, state, &sampler)?
                .ok_or_else(|| bad(&path, "it holds no shear_pa: solve it with friction"))?;
            dataset.draw_pressure(indentation, &shard, state, &mut pressure_pa)?;
            dataset.draw_sed(indentation, &shard, state, &mut truth)?;
            let failed = |source| ExportError::Engine { path: path.clone(), source };
            network.infer(&pressure_pa, &mut sed).map_err(failed)?;
            let error = |sed: &[f32]| SampleMetrics::measure(sed, &truth, &dataset.ground);
            alone.extend(error(&sed).map(|metrics| metrics.relative_l2));
            let clock = thread_s();
            energy.add(&pressure_pa, &shear_pa, 1.0, f32::INFINITY, &mut sed);
            added_ms.push((thread_s() - clock) * 1e3);
            felt.extend(error(&sed).map(|metrics| metrics.relative_l2));
        }
    }
    let figure = |values: &[f64]| {
        spread(values)
            .ok_or_else(|| bad(dataset.folder(), "it holds no state whose SED is above zero"))
    };
    Ok(Traction {
        model: name.to_owned(),
        set: dataset.name().to_owned(),
        samples: added_ms.len(),
        alone: figure(&alone)?,
        felt: figure(&felt)?,
        added_ms: figure(&added_ms)?,
    })
}

/// Traction along the skin at the vertices, Pa; none if the shard holds none.
pub(crate) fn traction(
    dataset: &Dataset,
    indentation: &IndentationEntry,
    shard: &Shard,
    state: usize,
    sampler: &VertexSampler,
) -> Result<Option<Vec<[f32; 3]>>, ExportError> {
    if shard.shear_pa.is_none() {
        return Ok(None);
    }
    let path = dataset.shard_path(indentation);
    let refused = |source| ExportError::Atlas { path: path.clone(), source };
    let mut found = vec![[0.0; 3]; sampler.vertex_count()];
    let mut map = vec![0.0; MAP_LEN];
    let mut vertices = vec![0.0; found.len()];
    for axis in 0..3 {
        dataset.draw(indentation, Field::Shear(axis), shard, state, &mut map)?;
        sampler.sample(&map, &mut vertices).map_err(refused)?;
        found.iter_mut().zip(&vertices).for_each(|(q, v)| q[axis] = *v);
    }
    Ok(Some(found))
}

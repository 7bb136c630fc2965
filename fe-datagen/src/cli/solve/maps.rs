//! The maps of a finger's states: arrays of all of them, pictures of the last.

use papilla_atlas::{MAP_LEN, MAP_SIDE_PX};
use papilla_dataset::{Field, ShardMaps};
use papilla_fingertip::scene::{Output, Scene};
use papilla_fingertip::simulation::maps::FingerMaps;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_output::atomic;
use papilla_output::map_image::{MapView, Quantity, white_of};
use papilla_output::npz::NpzBuilder;
use std::path::Path;

/// Writes what the scene asks for: pictures of the deepest state, `maps.npz` of all states and the
/// atlas. Nothing of no state.
pub(super) fn write(
    folder: &Path,
    scene: &Scene,
    finger: &FingerMaps,
    records: &[IncrementRecord],
) -> anyhow::Result<()> {
    let Some(last) = records.len().checked_sub(1) else { return Ok(()) };
    let shard = finger.shard(records)?;
    let maps = finger.maps.of(&shard);
    if scene.writes(Output::Pictures) {
        for (quantity, field, stem) in [
            (Quantity::Pressure, Field::Pressure, "pressure"),
            (Quantity::Sed, Field::SedDermis, "sed"),
        ] {
            let mut pixels = vec![0.0; MAP_LEN];
            maps.draw(field, last, &mut pixels)?;
            let view = MapView {
                quantity,
                pixels: &pixels,
                mask: finger.maps.raster(field.patch()).mask(),
                mm_per_px: f64::from(finger.atlas.mm_per_px()),
                white: white_of(&pixels),
            };
            view.write(folder, stem)?;
        }
    }
    if !scene.writes(Output::Maps) {
        return Ok(());
    }
    let states = records.len();
    let side = MAP_SIDE_PX;
    let mut npz = NpzBuilder::new();
    for (name, field) in [
        ("pressure_pa", Field::Pressure),
        ("sed_dermis_j_per_m3", Field::SedDermis),
        ("sed_epidermis_j_per_m3", Field::SedEpidermis),
    ] {
        npz.add_slice(name, &[states, side, side], &drawn(&maps, states, &[field])?)?;
    }
    if shard.shear_pa.is_some() {
        let fields = [0, 1, 2].map(Field::Shear);
        npz.add_slice("shear_pa", &[states, 3, side, side], &drawn(&maps, states, &fields)?)?;
    }
    npz.add("depth_mm", &shard.depth_mm)?;
    npz.write(&folder.join("maps.npz"))?;
    atomic::write(&folder.join("atlas.json"), finger.atlas.to_json()?.as_bytes())?;
    Ok(())
}

/// Maps of these fields, of one state after the other.
fn drawn(maps: &ShardMaps<'_>, states: usize, fields: &[Field]) -> anyhow::Result<Vec<f32>> {
    let mut pixels = vec![0.0; states * fields.len() * MAP_LEN];
    for (state, of_state) in pixels.chunks_exact_mut(fields.len() * MAP_LEN).enumerate() {
        for (&field, map) in fields.iter().zip(of_state.chunks_exact_mut(MAP_LEN)) {
            maps.draw(field, state, map)?;
        }
    }
    Ok(pixels)
}

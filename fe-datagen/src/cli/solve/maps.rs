//! The maps of a finger's states: arrays of all of them, pictures of the last.

use papilla_atlas::{MAP_LEN, MAP_SIDE_PX};
use papilla_dataset::Field;
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
    for (name, pixels) in finger.drawn(records)? {
        let parts = pixels.len() / (states * MAP_LEN);
        let shape: &[usize] =
            if parts == 1 { &[states, side, side] } else { &[states, parts, side, side] };
        npz.add_slice(name, shape, &pixels)?;
    }
    npz.add("depth_mm", &shard.depth_mm)?;
    npz.write(&folder.join("maps.npz"))?;
    atomic::write(&folder.join("atlas.json"), finger.atlas.to_json()?.as_bytes())?;
    Ok(())
}

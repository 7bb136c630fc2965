//! A ball pressed into the shipped finger: poses in, force and pressure out.
//!
//! ```sh
//! cargo run --release -p papilla-contact --example ball_on_finger
//! ```

use papilla_atlas::{Atlas, Patch, Raster};
use papilla_contact::{
    Arrays, Contact, ContactModel, Object, PixelContact, PixelSkin, PixelSpacing, Settings, Solver,
};
use papilla_sdf::{Placement, Sphere};
use std::{path::Path, sync::Arc};

const RADIUS_MM: f64 = 5.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let atlas = Atlas::from_json(&std::fs::read_to_string(models.join("atlas.json"))?)?;
    let (header, arrays) = Arrays::read(&std::fs::read(models.join("finger.contact"))?)?;
    let model = Arc::new(ContactModel::new(header, arrays)?);
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    let skin = PixelSkin::new(&model, &atlas, raster).ok_or("the model names no layers")?;

    // All memory is taken here. A frame starts from the last one.
    let mut solver = Solver::new(Arc::clone(&model), Settings::default())?;
    let mut pixels = PixelContact::new(Arc::new(skin), &model, PixelSpacing::One);
    let mut contact = Contact::new(model.vertices());

    // The ball comes from below, under the lowest point of the pad, and moves up.
    let [x, y, z] = model.lowest_mm();
    println!("depth, mm   force, N   peak, kPa   area, mm2");
    for step in 1..=10 {
        let depth_mm = 0.15 * f64::from(step);
        let place = Placement::turned(0.0, 0.0, 0.0, [x, y, z - RADIUS_MM + depth_mm]);
        let ball = Object::rigid(Arc::new(Sphere { radius_mm: RADIUS_MM }), place);
        solver.solve_on_pixels(&[ball], &mut pixels, &mut contact)?;
        let (force_n, peak_kpa, area_mm2) =
            (contact.force_n[2], pixels.peak_pa() / 1e3, contact.area_mm2);
        println!("{depth_mm:9.2}   {force_n:8.3}   {peak_kpa:9.1}   {area_mm2:9.1}");
        if !contact.quality.settled || contact.quality.out_of_range {
            println!("            flagged: {:?}", contact.quality);
        }
    }
    Ok(())
}

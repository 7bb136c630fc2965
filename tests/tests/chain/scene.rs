//! From a scene to a client on a coarse mesh, with the engine's small test network: every
//! link of the chain, without any shipped file.

use std::{fs, sync::LazyLock};

use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::{
    scene::Scene,
    simulation::{Simulation, record::IncrementRecord},
};
use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Patch, Raster},
};

use papilla_fingertip::simulation::sample::fault;

use crate::{
    client,
    service::{Sample, Service, tiny_models},
};

pub(crate) const SCENE: &str = r#"
[geometry]
kind = "fingertip"
density = "coarse"
order = "linear"

[motion]
depth_mm = 0.4
increments = 2
pitch_deg = 10.0
roll_deg = 5.0
"#;

/// A solved scene.
pub(crate) struct Pressed {
    pub(crate) atlas: Atlas,
    pub(crate) records: Vec<IncrementRecord>,
}

impl Pressed {
    /// Solves a fingertip's scene as `fe-datagen solve` does. Every state passes its checks.
    pub(crate) fn solve(scene: &Scene) -> Self {
        let Simulation { body, approach, drive, .. } = Simulation::new(scene).unwrap();
        let (atlas, _) = body.atlas().expect("a fingertip has an atlas").unwrap();
        let mut solver = body.solver(Options::default()).unwrap();
        let mut records = Vec::new();
        let mut keep =
            |_: &Solver<'_>, r: &IncrementRecord, _: &StepReport| records.push(r.clone());
        body.press(&mut solver, &approach, &drive, 1, &mut keep).unwrap();
        for record in &records {
            assert_eq!(fault(record, atlas.vertex_count()), None, "at {} mm", record.depth_mm);
        }
        assert_eq!(records.len(), drive.len());
        Self { atlas, records }
    }

    /// The states as a dataset would hold them.
    pub(crate) fn samples(&self) -> Vec<Sample> {
        let outside = |values: &[f64]| values.iter().map(|v| (v * 1e6) as f32).collect();
        let sample = |r: &IncrementRecord| Sample {
            pressure_pa: outside(&r.pressure_mpa),
            sed_j_per_m3: outside(&r.sed_dermis_mpa),
            depth_mm: r.depth_mm as f32,
        };
        self.records.iter().map(sample).collect()
    }
}

/// The coarse indentation, solved once.
pub(crate) static PRESSED: LazyLock<Pressed> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, SCENE).unwrap();
    Pressed::solve(&Scene::read(&path).unwrap())
});

/// Integral of a map over the undeformed patch, N if the map is in Pa: each pixel stands for
/// the area of its triangle that falls to it.
pub(crate) fn map_integral(atlas: &Atlas, raster: &Raster, map: &[f32]) -> f64 {
    let patch = atlas.patch(raster.patch());
    let area_mm2_per_px2: Vec<f64> = atlas
        .triangles()
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|v| patch.positions_mm[v as usize].map(f64::from));
            let [p, q, r] = corners.map(|v| patch.uv_px[v as usize].map(f64::from));
            let (e, f) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
            let cross = [0, 1, 2].map(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                e[j] * f[k] - e[k] * f[j]
            });
            let flat = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            cross.iter().map(|x| x * x).sum::<f64>().sqrt() / flat.abs()
        })
        .collect();
    let pixels = raster.indices().iter().zip(raster.pixels());
    let sum: f64 = pixels
        .map(|(&i, pixel)| f64::from(map[i as usize]) * area_mm2_per_px2[pixel.triangle as usize])
        .sum();
    1e-6 * sum
}

#[test]
fn the_map_carries_the_force_of_the_plate() {
    let atlas = &PRESSED.atlas;
    let skin = Raster::new(atlas, Patch::Skin);
    let mut map = vec![0.0; MAP_LEN];
    for (record, sample) in PRESSED.records.iter().zip(PRESSED.samples()) {
        skin.rasterise(&sample.pressure_pa, &mut map).unwrap();
        let force_n = record.force_n.iter().map(|f| f * f).sum::<f64>().sqrt();
        assert!(force_n > 1e-3, "a press of {} mm takes force", record.depth_mm);
        // The map knows the undeformed area, the force the deformed one.
        let share = map_integral(atlas, &skin, &map) / force_n;
        assert!((share - 1.0).abs() < 0.1, "{} mm: {share} of the force", record.depth_mm);
        // Interpolation makes nothing greater.
        let most = |values: &[f32]| values.iter().copied().fold(0.0, f32::max);
        assert!(most(&map) <= most(&sample.pressure_pa) * (1.0 + 1e-6));
        assert!(map.iter().zip(skin.mask()).all(|(p, inside)| *inside || p.to_bits() == 0));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_travels_the_whole_chain() {
    let samples = PRESSED.samples();
    let deepest = samples.last().unwrap();
    let models = tiny_models(&PRESSED.atlas, deepest);
    let service = Service::on(models.path()).await;
    client::http_answers_are_the_librarys(&service, deepest).await;
    client::nothing_in_nothing_out(&service).await;
    client::http_mistakes_are_named(&service, deepest).await;
    client::session_answers_are_the_librarys(&service, &samples).await;
    client::sessions_survive_mistakes(&service, deepest).await;
}

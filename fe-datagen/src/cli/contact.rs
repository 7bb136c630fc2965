//! `contact`: what the real-time contact solver has to know of the finger.

use anyhow::Context;
use papilla_atlas::{MAP_LEN, Patch, VertexSampler};
use papilla_contact::{Arrays, Header, Layer};
use papilla_dataset::{Dataset, Field, Maps, Shard, Split};
use papilla_fingertip::geometry::fingertip::{FingertipShape, SurfaceParameter};
use papilla_fingertip::influence::{self, Compliance, Load, SecondOrder};
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::TissueTable;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::tissue::Tissue;
use papilla_output::atomic;
use papilla_progress::Progress;
use std::collections::HashMap;
use std::path::PathBuf;
use std::process::ExitCode;

/// Make a contact model of this finger for the real-time contact solver.
///
/// Two parts: how far each vertex of the skin moves under a force on any other one at small strain
/// (one factorization, 3 V right-hand sides), and the second order of finite strain over the load
/// modes of the datasets' training indentations (exact derivatives of the internal forces, no fit).
/// Held-out indentations are not read. Layers and finite strain on, rigid bone and nail.
#[derive(clap::Args)]
#[command(after_help = "Takes 3 min and 3 GB.\n\
                        Example: fe-datagen contact data/s1 data/broad --out out/contact")]
pub(super) struct Args {
    /// Datasets of this finger, by density medium.
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Load modes of the second order.
    #[arg(long, default_value_t = 48)]
    modes: usize,
    /// Displacements of the second order.
    #[arg(long, default_value_t = 48)]
    outputs: usize,
    /// Folder for finger.contact.
    #[arg(long)]
    out: PathBuf,
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

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let (density, order, materials) = (Density::Medium, Order::Linear, TissueTable::default());
    let rest = influence::body(density, order, &materials)?;
    let (atlas, _) = rest.atlas().context("the finger has no atlas")??;
    let mut presses = Presses::default();
    for folder in &args.datasets {
        let dataset = Dataset::open(folder)?;
        dataset.atlas().require_hash(atlas.hash()).with_context(|| folder.display().to_string())?;
        presses.read(&dataset)?;
    }
    atomic::create_folder(&args.out)?;
    let vertices = rest.patch.as_ref().map_or(0, |p| p.patch.skin.len());
    let progress = Progress::new("forces", 3 * vertices, 0, false);
    let compliance = influence::compliance(&rest, &mut |done| progress.set_position(done))?;
    drop(progress);
    let skin = atlas.patch(Patch::Skin);
    let mut loads = presses.loads(&compliance);
    let Presses { datasets, depth_max_mm, .. } = presses;
    add_mirrored(&skin.positions_mm, &mut loads);
    let body = Body::usual(density)?;
    let pairs = args.modes * (args.modes + 1) / 2;
    let progress = Progress::new("pairs of load modes", pairs, 0, false);
    let second = influence::second_order(
        &body,
        &compliance,
        &loads,
        [args.modes, args.outputs],
        &mut |done| progress.set_position(done),
    )?;
    drop(progress);
    let header = Header {
        software: concat!("fe-datagen ", env!("CARGO_PKG_VERSION")).into(),
        atlas_hash: compliance.atlas_hash.clone(),
        effects: vec!["finite_strain".into(), "layers".into()],
        datasets,
        vertices,
        triangles: atlas.triangles().len(),
        modes: second.modes,
        outputs: second.outputs,
        share_max: second.share_max as f32,
        depth_max_mm,
        layers: layers_below_pad(&FingertipShape::default(), &materials)?,
        ..Header::current()
    };
    let arrays = arrays(&compliance, second, &skin.positions_mm, atlas.triangles());
    let bytes = arrays.to_bytes(&header)?;
    let path = args.out.join("finger.contact");
    atomic::write(&path, &bytes)?;
    println!(
        "contact model of {vertices} vertices, {} load modes of {} loads, second order up to {:.0} % \
         of the displacement\nwrote {}",
        header.modes,
        loads.len(),
        100.0 * header.share_max,
        path.display()
    );
    Ok(ExitCode::SUCCESS)
}

/// Skin from the surface down to the bone, below the middle of the pad.
fn layers_below_pad(shape: &FingertipShape, tissues: &TissueTable) -> anyhow::Result<Vec<Layer>> {
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
            let size = force_n.iter().map(|f| f * f).sum::<f64>().sqrt();
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

/// The finger is its own mirror image in y: so are its loads.
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

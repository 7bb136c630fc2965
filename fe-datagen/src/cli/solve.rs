//! `solve`: one scene, with everything that can be looked at.

use super::{CHECKS_FAILED, print};
use crate::body_file::write_vtu;
use anyhow::Context as _;
use ndarray::Array2;
use papilla_atlas::{Atlas, MAP_LEN, MAP_SIDE_PX, Patch, Raster};
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Effort, Options, Solver, StepReport};
use papilla_fingertip::scene::{Output, Plan, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::balanced::Balanced;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::fields::PA_PER_MPA;
use papilla_fingertip::simulation::record::{Checks, IncrementRecord};
use papilla_output::map_image::{MapView, Quantity, white_of};
use papilla_output::npz::NpzBuilder;
use papilla_output::{atomic, vtu};
use papilla_progress::Progress;
use papilla_validation::acceptance::fault;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Solve one scene and write everything that can be looked at.
///
/// Writes summary.json and what the scene's `outputs` name, by default all: a .vtu
/// series for ParaView (series.pvd) and, for a fingertip, pressure.png and sed.png
/// (16-bit gray, with -color twins) of the deepest state and maps.npz of all stored
/// states; for a section pressure.svg, sed.svg and lines.npz along the skin.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen solve scenes/flat-press.toml --out out/flat-press")]
pub(super) struct Args {
    /// Scene file (see scenes/ and docs/reference/scenes.md).
    scene: PathBuf,
    /// Folder for the results.
    #[arg(long)]
    out: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Field of the last equilibrium before a solve was given up.
const LAST_STATE: &str = "last-state.vtu";

/// One stored equilibrium in `summary.json`.
#[derive(Serialize)]
struct Increment {
    depth_mm: f64,
    force_n: [f64; 3],
    pressure_pa_max: f64,
    /// Absent for a body without an interface between epidermis and dermis.
    #[serde(skip_serializing_if = "Option::is_none")]
    sed_dermis_j_per_m3_max: Option<f64>,
    /// The same of the epidermis side.
    #[serde(skip_serializing_if = "Option::is_none")]
    sed_epidermis_j_per_m3_max: Option<f64>,
    stored_energy_mj: f64,
    /// Share of the volume beyond the calibrated stretches of its law.
    outside_calibration: f64,
    /// Where on the skin contact was found.
    contact: ContactRule,
    checks: Checks,
    /// Block of the mesh and element in it where J is smallest.
    j_min_at: [usize; 2],
    /// The tangent's condition number is at least this; absent if only an indefinite one was
    /// factorized.
    condition_at_least: Option<f64>,
    effort: Effort,
    seconds: f64,
    /// Why this state would not enter a dataset; absent if it would.
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<String>,
}

/// What `solve` says of a scene.
#[derive(Serialize)]
struct Summary {
    scene: Scene,
    plan: Plan,
    unknowns: usize,
    elements: usize,
    factor_entries: usize,
    atlas_hash: Option<String>,
    setup_s: f64,
    solve_s: f64,
    effort: Effort,
    increments: Vec<Increment>,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let scene = Scene::read(&args.scene)?;
    let clock = Instant::now();
    let setup = Simulation::new(&scene)?;
    let body = &setup.body;
    let mapped = scene.writes(Output::Maps) || scene.writes(Output::Pictures);
    let atlas = if mapped { body.atlas().transpose()?.map(|(atlas, _)| atlas) } else { None };
    let mut solver = body.solver(Options::default())?;
    let setup_s = clock.elapsed().as_secs_f64();
    atomic::create_folder(&args.out)?;
    let clock = Instant::now();
    let (pressed, solved) =
        press(&setup, &mut solver, scene.writes(Output::Fields).then_some(&args.out), args.json)?;
    let records: Vec<_> = pressed.iter().map(|p| p.record.clone()).collect();
    if let Some(atlas) = &atlas {
        write_maps(&args.out, &scene, atlas, &records)?;
    } else if body.plane {
        super::lines::write(&args.out, &scene, &setup, &records)?;
    }
    let summary = Summary {
        plan: setup.plan,
        unknowns: body.problem.system.dofs.count,
        elements: body.problem.mesh.element_count(),
        factor_entries: body.problem.system.factor_entries(),
        atlas_hash: atlas.as_ref().map(|a| a.hash().to_owned()),
        setup_s,
        solve_s: clock.elapsed().as_secs_f64(),
        effort: pressed.iter().fold(Effort::default(), |sum, p| sum.plus(&p.report.effort)),
        increments: pressed.iter().map(increment).collect(),
        scene,
    };
    atomic::write_json(&args.out.join("summary.json"), &summary)?;
    if solved.is_err() && summary.scene.writes(Output::Fields) {
        eprintln!("{} shows the last equilibrium", args.out.join(LAST_STATE).display());
    }
    solved?;
    print(&summary, args.json, || human(&summary, &args.out))?;
    let clean = summary.increments.iter().all(|i| i.fault.is_none());
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}

/// A stored equilibrium.
struct Pressed {
    record: IncrementRecord,
    report: StepReport,
    /// Greatest pressure on the contact surface, MPa.
    pressure_mpa_max: f64,
}

/// Presses and writes the fields of every stored equilibrium into `out`, if given; those
/// before an error are kept.
fn press(
    setup: &Simulation,
    solver: &mut Solver<'_>,
    out: Option<&PathBuf>,
    quiet: bool,
) -> anyhow::Result<(Vec<Pressed>, Result<(), SimulationError>)> {
    let Simulation { body, approach, drive, .. } = setup;
    let progress = Progress::new("states", drive.len(), 0, quiet);
    let (mut written, mut worst) = (Ok(()), 0.0f64);
    let file = |state: usize| format!("state-{state:03}.vtu");
    let keep =
        &mut |state: usize, s: &Solver<'_>, record: &IncrementRecord, report: &StepReport| {
            if let (Some(out), true) = (out, written.is_ok()) {
                written = write_vtu(&out.join(file(state)), body, s);
            }
            progress.set_position(state + 1);
            progress.set_message(format!("{:.3} mm deep", record.depth_mm));
            worst = if state == 0 { 0.0 } else { worst }.max(record.checks.energy_vs_work);
            if state + 1 == drive.len() && worst > BALANCE_RELATIVE_MAX {
                progress.set_position(0);
                progress.set_message("energy and work part: taken again in smaller steps");
            }
            let surface = &body.problem.mesh.surfaces[&body.contact];
            let pressure_mpa_max = s.pressure_mpa(surface).into_iter().fold(0.0, f64::max);
            Pressed { record: record.clone(), report: *report, pressure_mpa_max }
        };
    let Balanced { kept: pressed, pressed: solved, .. } =
        body.press_balanced(solver, approach, drive, BALANCE_RELATIVE_MAX, keep);
    drop(progress);
    if let (Err(_), Some(out), true) = (&solved, out, written.is_ok()) {
        written = write_vtu(&out.join(LAST_STATE), body, solver);
    }
    written?;
    let place = |r: &IncrementRecord| if drive.is_timed() { r.time_s } else { r.depth_mm };
    let series: Vec<_> =
        pressed.iter().enumerate().map(|(i, p)| (place(&p.record), file(i))).collect();
    if let Some(out) = out {
        vtu::write_pvd(&out.join("series.pvd"), &series)?;
    }
    Ok((pressed, solved))
}

fn increment(Pressed { record, report, pressure_mpa_max }: &Pressed) -> Increment {
    let max = |v: &[f64]| {
        let largest = PA_PER_MPA * v.iter().copied().fold(0.0, f64::max);
        (!v.is_empty()).then_some(largest)
    };
    Increment {
        depth_mm: record.depth_mm,
        force_n: record.force_n,
        pressure_pa_max: PA_PER_MPA * pressure_mpa_max,
        sed_dermis_j_per_m3_max: max(&record.sed_dermis_mpa),
        sed_epidermis_j_per_m3_max: max(&record.sed_epidermis_mpa),
        stored_energy_mj: report.stored_mj,
        outside_calibration: record.outside_calibration,
        contact: record.contact,
        checks: record.checks,
        j_min_at: report.j_min_at,
        condition_at_least: Some(report.condition_at_least).filter(|c| c.is_finite()),
        effort: report.effort,
        seconds: record.seconds,
        fault: fault(record, record.pressure_mpa.len()),
    }
}

/// Images of the deepest state and arrays of all.
fn write_maps(
    folder: &Path,
    scene: &Scene,
    atlas: &Atlas,
    records: &[IncrementRecord],
) -> anyhow::Result<()> {
    let Some(deepest) = records.last() else { return Ok(()) };
    let scaled = |v: &[f64]| -> Vec<f32> { v.iter().map(|x| (x * PA_PER_MPA) as f32).collect() };
    let fields = [
        (Quantity::Pressure, Patch::Skin, "pressure", &deepest.pressure_mpa),
        (Quantity::Sed, Patch::Interface, "sed", &deepest.sed_dermis_mpa),
    ];
    let mut npz = NpzBuilder::new();
    for (quantity, patch, stem, values) in fields {
        let raster = Raster::new(atlas, patch);
        let mut pixels = vec![0.0; MAP_LEN];
        raster.rasterise(&scaled(values), &mut pixels)?;
        let view = MapView {
            quantity,
            pixels: &pixels,
            mask: raster.mask(),
            mm_per_px: f64::from(atlas.mm_per_px()),
            white: white_of(&pixels),
        };
        if scene.writes(Output::Pictures) {
            view.write(folder, stem)?;
        }
        npz.add_slice(&format!("{stem}_map"), &[MAP_SIDE_PX, MAP_SIDE_PX], &pixels)?;
    }
    if !scene.writes(Output::Maps) {
        return Ok(());
    }
    let columns = deepest.pressure_mpa.len();
    let all = |get: fn(&IncrementRecord) -> &Vec<f64>| {
        let flat: Vec<f32> = records.iter().flat_map(|r| scaled(get(r))).collect();
        Array2::from_shape_vec((records.len(), columns), flat).context("one value a vertex")
    };
    npz.add("pressure_pa", &all(|r| &r.pressure_mpa)?)?;
    npz.add("sed_dermis_j_per_m3", &all(|r| &r.sed_dermis_mpa)?)?;
    npz.add("sed_epidermis_j_per_m3", &all(|r| &r.sed_epidermis_mpa)?)?;
    if !deepest.shear_mpa.is_empty() {
        write_shear(&mut npz, atlas, records)?;
    }
    let depths: Vec<f32> = records.iter().map(|r| r.depth_mm as f32).collect();
    npz.add_slice("depth_mm", &[depths.len()], &depths)?;
    npz.write(&folder.join("maps.npz"))?;
    atomic::write(&folder.join("atlas.json"), atlas.to_json()?.as_bytes())?;
    Ok(())
}

/// Shear traction of all states at the vertices, and of the deepest as three maps.
fn write_shear(
    npz: &mut NpzBuilder,
    atlas: &Atlas,
    records: &[IncrementRecord],
) -> anyhow::Result<()> {
    let pa = |v: &f64| (v * PA_PER_MPA) as f32;
    let shear =
        |r: &IncrementRecord| -> Vec<f32> { r.shear_mpa.as_flattened().iter().map(pa).collect() };
    let all: Vec<f32> = records.iter().flat_map(shear).collect();
    npz.add_slice("shear_pa", &[records.len(), atlas.vertex_count(), 3], &all)?;
    let raster = Raster::new(atlas, Patch::Skin);
    let mut maps = vec![0.0; 3 * MAP_LEN];
    let deepest = records.last().map(shear).unwrap_or_default();
    for (i, map) in maps.chunks_exact_mut(MAP_LEN).enumerate() {
        let component: Vec<f32> = deepest.iter().skip(i).step_by(3).copied().collect();
        raster.rasterise(&component, map)?;
    }
    npz.add_slice("shear_map", &[3, MAP_SIDE_PX, MAP_SIDE_PX], &maps)?;
    Ok(())
}

fn human(s: &Summary, out: &Path) -> String {
    let mut text = format!(
        "{} unknowns, {} elements, {} factor entries; set-up {:.1} s, solve {:.1} s \
         (assembly {:.1}, factorization {:.1}, linear solves {:.1})\n",
        s.unknowns,
        s.elements,
        s.factor_entries,
        s.setup_s,
        s.solve_s,
        s.effort.assemble_s,
        s.effort.factor_s,
        s.effort.solve_s,
    );
    text +=
        "depth mm   force N   pressure kPa   SED dermis J/m3   iterations   energy against work\n";
    for i in &s.increments {
        let force = papilla_solid::tensor::norm(i.force_n);
        text += &format!(
            "{:8.3} {:9.4} {:14.3} {:>17} {:12} {:19.2} %{}\n",
            i.depth_mm,
            force,
            i.pressure_pa_max / 1e3,
            i.sed_dermis_j_per_m3_max.map_or("-".into(), |v| format!("{v:.2}")),
            i.checks.newton_iterations,
            100.0 * i.checks.energy_vs_work,
            i.fault.as_ref().map_or(String::new(), |f| format!("  FAILED: {f}")),
        );
        if i.contact == ContactRule::Gauss {
            text += "         contact within faces: the indenter is too narrow for their nodes\n";
        }
        if i.outside_calibration > 0.0 {
            let percent = 100.0 * i.outside_calibration;
            text += &format!("         {percent:.2} % of the volume beyond calibrated stretches\n");
        }
    }
    text + &format!("written to {}", out.display())
}

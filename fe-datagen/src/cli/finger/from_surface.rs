//! `finger from-surface`: a finger from a scan.

use anyhow::Context as _;
use papilla_fingertip::geometry::fingertip::LayerMap;
use papilla_fingertip::scene::Finger;
use papilla_fingertip::scene::finger::{FINGER_FILE, SKIN_FILE, Source, Thickness};
use papilla_output::atomic;
use papilla_scan::fit::{Fitted, Inside, Where, fit};
use papilla_scan::{Unit, picture, read};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Fit a finger to a surface: an STL, OBJ, PLY or GLB file of a fingertip.
///
/// First the template's dimensions are fitted, then its skin is moved along its normals to the
/// surface. Layers, bone and nail cannot be seen from outside: they are in proportion to the
/// default finger's, unless numbers or the bone's own surface are given. Writes a folder with
/// finger.toml, skin.json, fit.json (what is left, and what was done to the surface) and fit.png
/// (distances over u and v, and sections with the layers). See docs/guides/fingers.md.
#[derive(clap::Args)]
#[command(
    after_help = "Example: fe-datagen finger from-surface scan.stl --tip 1.2,0.4,33 --axis 0,0,-1 --unit mm \
                  --out fingers/mine"
)]
pub(super) struct Args {
    /// The surface; its end towards the hand may be open.
    surface: PathBuf,
    /// The finger's foremost point, in the file's coordinates and unit: x,y,z.
    #[arg(long, value_parser = vector, allow_hyphen_values = true, value_name = "X,Y,Z")]
    tip: Vector,
    /// Direction from the tip along the finger towards the hand: x,y,z.
    #[arg(long, value_parser = vector, allow_hyphen_values = true, value_name = "X,Y,Z")]
    axis: Vector,
    /// Direction in which the nail looks, about; found by the fit if not given: x,y,z.
    #[arg(long, value_parser = vector, allow_hyphen_values = true, value_name = "X,Y,Z")]
    nail: Option<Vector>,
    /// Unit of lengths in the file: mm, cm, m, in or um.
    #[arg(long, value_parser = unit)]
    unit: Unit,
    /// Length of the model from the tip, mm; in proportion to the width, as far as the surface goes,
    /// if not given.
    #[arg(long, value_name = "MM")]
    length: Option<f64>,
    /// A finger (folder or finger.toml) whose layers, bone, nail and tissues are taken.
    #[arg(long, value_name = "FINGER")]
    numbers: Option<PathBuf>,
    /// Surface of the bone, in the same frame and unit.
    #[arg(long, value_name = "SURFACE")]
    bone: Option<PathBuf>,
    /// Surface of the nail plate, in the same frame and unit; it need not be closed.
    #[arg(long, value_name = "SURFACE")]
    nail_surface: Option<PathBuf>,
    /// Thickness of the epidermis, mm, or a CSV file of 17 rows over v and 24 columns over u.
    #[arg(long, value_name = "MM|CSV")]
    epidermis: Option<String>,
    /// The same of the dermis.
    #[arg(long, value_name = "MM|CSV")]
    dermis: Option<String>,
    /// Whose finger it is, for finger.toml.
    #[arg(long, default_value = "")]
    who: String,
    /// Day of the scan, for finger.toml.
    #[arg(long, default_value = "")]
    date: String,
    /// Licence of the file, for finger.toml.
    #[arg(long, default_value = "")]
    licence: String,
    /// Folder of the finger. It has to be new or empty: an older finger stays as it is.
    #[arg(long)]
    out: PathBuf,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// Three numbers.
#[derive(Clone, Copy, Debug)]
struct Vector([f64; 3]);

fn vector(text: &str) -> Result<Vector, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && [x, y, z].iter().all(|v| v.is_finite()) => {
            Ok(Vector([x, y, z]))
        }
        _ => Err("has to be three numbers with commas between them, such as 0,0,-1".into()),
    }
}

/// A number of mm, or a map from a file.
fn thickness(text: &str) -> anyhow::Result<Thickness> {
    if let Ok(mm) = text.parse() {
        return Ok(Thickness::Number(mm));
    }
    let rows = papilla_json::read_text(Path::new(text))
        .with_context(|| format!("{text} is no number of mm, and no file that can be read"))?;
    Ok(Thickness::Map(LayerMap::from_csv(&rows).with_context(|| text.to_owned())?))
}

fn unit(name: &str) -> Result<Unit, String> {
    Unit::named(name).ok_or_else(|| "has to be mm, cm, m, in or um".into())
}

/// How well a finger fits; `fit.json`.
#[derive(Serialize)]
struct Report {
    surface: PathBuf,
    /// SHA-256 of the finger's dimensions, skin and tissues.
    finger_sha256: String,
    /// What was done to the surface, and what was assumed.
    done: Vec<String>,
    /// Root of the mean square of the surface's distance from the template, mm.
    template_rms_mm: f64,
    /// Largest control value of the skin's offset, mm; 0 without one.
    offset_mm_max: f64,
    /// Root of the mean square of the surface's distance from the fitted skin, mm.
    skin_rms_mm: f64,
    /// The largest of these distances, mm, and where it is.
    skin_worst_mm: f64,
    skin_worst_uv: [f64; 2],
    /// Least scaled Jacobian of the soft tissue.
    scaled_jacobian_min: f64,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    require_free(&args.out)?;
    let surface = read::surface(&args.surface, args.unit)?;
    let bone = args.bone.as_deref().map(|path| read::surface(path, args.unit)).transpose()?;
    let numbers = match &args.numbers {
        Some(name) => Some(Finger::find(name, Path::new(""))?),
        None => None,
    };
    let at = Where {
        tip_mm: args.tip.0.map(|v| args.unit.mm() * v),
        axis: args.axis.0,
        nail: args.nail.map(|n| n.0),
        length_mm: args.length,
    };
    let nail =
        args.nail_surface.as_deref().map(|path| read::surface(path, args.unit)).transpose()?;
    let inside = Inside {
        numbers: numbers.as_ref(),
        bone: bone.as_ref(),
        nail: nail.as_ref(),
        epidermis: args.epidermis.as_deref().map(thickness).transpose()?,
        dermis: args.dermis.as_deref().map(thickness).transpose()?,
    };
    let mut fitted =
        fit(&surface, &at, &inside).with_context(|| args.surface.display().to_string())?;
    let file = args.surface.file_name().map(|n| n.to_string_lossy().into_owned());
    fitted.finger.source = Source {
        who: args.who.clone(),
        file: file.unwrap_or_default(),
        unit: args.unit.name().into(),
        date: args.date.clone(),
        licence: args.licence.clone(),
    };
    let report = report(args, &fitted);
    write(&args.out, &fitted, &report)?;
    super::super::print(&report, args.json, || human(&report, &args.out))?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses a folder that holds something.
fn require_free(out: &Path) -> anyhow::Result<()> {
    let holds = std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some());
    anyhow::ensure!(
        !holds && !out.is_file(),
        "{} is there already: choose another --out, or take it away first",
        out.display()
    );
    Ok(())
}

fn report(args: &Args, fitted: &Fitted) -> Report {
    let skin = &fitted.skin;
    Report {
        surface: args.surface.clone(),
        finger_sha256: fitted.finger.sha256(),
        done: fitted.done.clone(),
        template_rms_mm: fitted.template_rms_mm,
        offset_mm_max: skin.offset.as_ref().map_or(0.0, |o| o.largest_mm()),
        skin_rms_mm: skin.rms_mm,
        skin_worst_mm: skin.worst_mm,
        skin_worst_uv: skin.worst_uv,
        scaled_jacobian_min: fitted.scaled_jacobian_min,
    }
}

/// The folder with all of its files, or no folder.
fn write(out: &Path, fitted: &Fitted, report: &Report) -> anyhow::Result<()> {
    let parent = match out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    atomic::create_folder(parent)?;
    let folder = tempfile::Builder::new().prefix(atomic::PARTIAL_PREFIX).tempdir_in(parent)?;
    let file = |name: &str| folder.path().join(name);
    if let Some(offset) = &fitted.finger.shape.offset {
        atomic::write_json(&file(SKIN_FILE), offset.as_ref())?;
    }
    atomic::write(&file("fit.png"), &picture::draw(fitted)?)?;
    atomic::write_json(&file("fit.json"), report)?;
    atomic::write(&file(FINGER_FILE), fitted.finger.to_toml().as_bytes())?;
    // What is read back has to be the finger that was checked.
    let read = Finger::read(folder.path())?;
    anyhow::ensure!(read == fitted.finger, "the finger is not read back as it was written");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(0o755))?;
    }
    if out.is_dir() {
        std::fs::remove_dir(out)?;
    }
    std::fs::rename(folder.path(), out)
        .with_context(|| format!("{} cannot be written", out.display()))?;
    Ok(())
}

fn human(r: &Report, out: &Path) -> String {
    let mut text = String::new();
    for done in &r.done {
        text += &format!("- {done}\n");
    }
    let [u, v] = r.skin_worst_uv;
    text + &format!(
        "template: {:.3} mm are left between it and the surface (root of the mean square)\n\
         skin: moved by up to {:.2} mm; {:.3} mm are left, at most {:+.2} mm at u = {u:.2}, v = {v:.2}\n\
         elements: least scaled Jacobian {:.3}\n\
         look at {}, then: fe-datagen finger explain {}\nwrote {}",
        r.template_rms_mm,
        r.offset_mm_max,
        r.skin_rms_mm,
        r.skin_worst_mm,
        r.scaled_jacobian_min,
        out.join("fit.png").display(),
        out.display(),
        out.display(),
    )
}

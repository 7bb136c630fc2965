//! `finger explain`: shows the numbers of a finger's file, and whether it can be meshed.

use super::build::described;
use crate::cli::print;
use anyhow::Context as _;
use papilla_contact::ContactModel;
use papilla_fingertip::geometry::fingertip::SCALED_JACOBIAN_MIN;
use papilla_fingertip::geometry::fingertip::SurfaceParameter;
use papilla_fingertip::mesh::fingertip::check_elements;
use papilla_fingertip::scene::Finger;
use papilla_fingertip::scene::finger::{FIELDS, Source};
use papilla_fingertip::tissue::Tissue;
use papilla_vector::{minus, norm};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Say what a finger is: every number with unit, default and range, what lies between skin and
/// bone, and how well its elements are shaped. Nothing is solved and nothing written.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen finger explain fingers/mine")]
pub(super) struct Args {
    /// Folder of a finger, or its finger.toml.
    finger: PathBuf,
    /// Print as JSON.
    #[arg(long)]
    json: bool,
}

/// A number, or several that belong together.
#[derive(Serialize)]
struct Number {
    key: String,
    value: String,
    unit: &'static str,
    default: String,
    range: [f64; 2],
    is: &'static str,
}

/// Young's modulus and Poisson's ratio of a tissue.
#[derive(Serialize)]
struct Elastic {
    tissue: &'static str,
    youngs_modulus_mpa: f64,
    poissons_ratio: f64,
}

/// What `finger explain` says.
#[derive(Serialize)]
struct Explanation {
    file: PathBuf,
    sha256: String,
    source: Source,
    numbers: Vec<Number>,
    /// Largest distance of the skin from the template that these numbers give; absent without a
    /// skin of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    offset_mm_max: Option<f64>,
    tissues: Vec<Elastic>,
    /// Epidermis, dermis and fat below the middle of the pad.
    below_pad_mm: [f64; 3],
    /// Least scaled Jacobian of the soft tissue.
    scaled_jacobian_min: f64,
    /// Whether the contact model beside the file was made of it; absent without one that tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    contact_is_current: Option<bool>,
}

/// Whether the contact model in a finger's folder was made of the description there; none if there is
/// no model, or one that does not tell.
fn contact_is_current(folder: &Path) -> anyhow::Result<Option<bool>> {
    let path = folder.join("finger.contact");
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let model = ContactModel::read(&bytes).with_context(|| path.display().to_string())?;
    if model.header().finger_file_sha256.is_empty() {
        return Ok(None);
    }
    Ok(Some(model.require_finger_file(&described(folder)?).is_ok()))
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let finger = Finger::read(&args.finger)?;
    let (shape, usual) = (&finger.shape, Finger::usual().shape);
    let bounds = shape.layers(SurfaceParameter::Body([0.0, -1.0], 0.0))?;
    let below_pad_mm = std::array::from_fn(|k| norm(minus(bounds[k + 1], bounds[k])));
    let number = |f: &papilla_fingertip::scene::finger::Field| Number {
        key: f.dotted(),
        value: f.shown(shape),
        unit: f.unit,
        default: f.written(&usual),
        range: f.range,
        is: f.about,
    };
    let elastic = |&tissue: &Tissue| {
        let spec = finger.tissue.of(tissue);
        Elastic {
            tissue: tissue.name(),
            youngs_modulus_mpa: spec.youngs_modulus_mpa,
            poissons_ratio: spec.poissons_ratio,
        }
    };
    let above = args.finger.parent().unwrap_or(Path::new(""));
    let folder = if args.finger.is_dir() { &args.finger } else { above };
    let explanation = Explanation {
        file: args.finger.clone(),
        sha256: finger.sha256(),
        numbers: FIELDS.iter().map(number).collect(),
        offset_mm_max: shape.offset.as_ref().map(|o| o.largest_mm()),
        tissues: Tissue::ALL.iter().map(elastic).collect(),
        below_pad_mm,
        scaled_jacobian_min: check_elements(shape)?,
        contact_is_current: contact_is_current(folder)?,
        source: finger.source.clone(),
    };
    print(&explanation, args.json, || human(&explanation))?;
    Ok(ExitCode::SUCCESS)
}

fn human(e: &Explanation) -> String {
    let mut text = format!("{}\n", e.file.display());
    let Source { who, file, unit, date, licence } = &e.source;
    for (name, value) in
        [("who", who), ("file", file), ("unit", unit), ("date", date), ("licence", licence)]
    {
        if !value.is_empty() {
            text += &format!("  {name:8} {value}\n");
        }
    }
    text += &format!("\n{:22} {:>14} {:4} {:>14}  range\n", "number", "value", "unit", "default");
    for n in &e.numbers {
        let [low, high] = n.range;
        text += &format!(
            "{:22} {:>14} {:4} {:>14}  {low} to {high}: {}\n",
            n.key, n.value, n.unit, n.default, n.is
        );
    }
    if let Some(most) = e.offset_mm_max {
        text += &format!("the skin lies up to {most:.2} mm from these dimensions (shape.skin)\n");
    }
    text += "\ntissue           Young's modulus MPa   Poisson's ratio, both at zero strain\n";
    for t in &e.tissues {
        text += &format!("{:16} {:19} {:17}\n", t.tissue, t.youngs_modulus_mpa, t.poissons_ratio);
    }
    let [epidermis, dermis, fat] = e.below_pad_mm;
    let contact = match e.contact_is_current {
        None => "",
        Some(true) => "\nfinger.contact was made of these numbers",
        Some(false) => {
            "\nfinger.contact is out of date: it was made of other numbers, or another skin; make it \
             anew with `fe-datagen finger build`"
        }
    };
    text + &format!(
        "\nbelow the middle of the pad: epidermis {epidermis:.2}, dermis {dermis:.2}, fat {fat:.2} mm, then \
         bone\nelements: least scaled Jacobian {:.3} ({SCALED_JACOBIAN_MIN} is asked for)\nsha256 {}{contact}",
        e.scaled_jacobian_min, e.sha256
    )
}

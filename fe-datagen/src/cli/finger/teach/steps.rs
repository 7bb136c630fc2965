//! The steps, one command after another.

use super::Args;
use super::error::TeachError;
use super::lender::{Card, Lender, Metrics, Spread, refuse_strangers};
use super::plan::{BATCH, Plan, solved_hours};
use super::programs::Programs;
use super::report::{Errors, Report, Taught};
use crate::cli::CHECKS_FAILED;
use papilla_dataset::{Dataset, Split, sha256_hex};
use papilla_fingertip::scene::Finger;
use papilla_output::atomic;
use serde::Deserialize;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Step of the optimiser at the beginning; a third of what the shipped networks began with.
const LEARNING_RATE: &str = "1e-3";
/// As the shipped networks were trained, docs/guides/training.md.
const SHIFT_PX: &str = "3";
/// The most accurate method of contact, by which poses are judged.
const METHOD: &str = "second order, pixels";
/// Of so many presses one may fail.
const FAILING_ONE_IN: usize = 5;

/// What `model-export evaluate` says.
#[derive(Deserialize)]
struct Evaluated {
    card: Measured,
}

#[derive(Deserialize)]
struct Measured {
    metrics: Metrics,
}

/// What `model-export contact` says of a method.
#[derive(Deserialize)]
struct Row {
    pressure: [f64; 2],
    sed: Option<[f64; 2]>,
}

fn spread([median, p95]: [f64; 2]) -> Spread {
    Spread { median, p95 }
}

/// Words of a command line.
fn words<const N: usize>(words: [&dyn AsRef<std::ffi::OsStr>; N]) -> Vec<OsString> {
    words.iter().map(|word| word.as_ref().to_owned()).collect()
}

pub(super) fn run(
    args: &Args,
    programs: &Programs,
    finger: &Finger,
    plan: &Plan,
    lenders: &[Lender],
    needs_contact: bool,
) -> anyhow::Result<Report> {
    let (folder, presses) = (&args.finger, args.presses_path());
    let threads: Vec<OsString> =
        args.threads.iter().flat_map(|n| ["--threads".into(), n.to_string().into()]).collect();
    if needs_contact {
        programs.run(programs.own(words([&"finger", &"build", folder])))?;
    }
    let mut generate =
        programs.own(words([&"generate", &args.campaign_path(), &"--out", &presses]));
    generate.args(&threads);
    programs.run_or(generate, CHECKS_FAILED)?;
    let dataset = Dataset::open(&presses)?;
    let manifest = dataset.manifest();
    let failed = manifest.failed.len();
    if failed * FAILING_ONE_IN > plan.presses {
        let (presses, folder) = (plan.presses, presses);
        return Err(TeachError::Failed { failed, presses, folder }.into());
    }
    take_atlas(args, dataset.atlas())?;
    refuse_strangers(folder, dataset.atlas().hash(), lenders)?;
    let contact = match args.without_contact {
        true => None,
        false => Some(contact_maps(args, programs)?),
    };
    let mut report = Report {
        finger_sha256: finger.sha256(),
        dataset_sha256: manifest.dataset_sha256.clone(),
        presses: manifest.presses.len(),
        held_out: dataset.of_split(Split::Test).count(),
        held_out_states: dataset.of_split(Split::Test).map(|press| press.samples).sum(),
        failed,
        press_core_hours: solved_hours(&plan.spec, args)?,
        pose_to_pressure: None,
        networks: Vec::new(),
    };
    for lender in lenders {
        let run = run_folder(args, lender, &manifest.dataset_sha256, plan)?;
        let card = train(args, programs, lender, (&run, contact.as_deref()), plan, &threads)?;
        let (before, _) = measure(args, programs, &lender.onnx, true)?;
        let (after, contact) =
            measure(args, programs, &run.join(format!("{}.onnx", lender.name)), false)?;
        report.pose_to_pressure = contact;
        publish(args, lender, &run)?;
        report.networks.push(Taught {
            name: lender.name.clone(),
            start_onnx_sha256: lender.card.onnx_sha256.clone(),
            epochs: plan.epochs,
            training_seconds: card.training.seconds,
            before,
            after,
            of_own_finger: Errors {
                pressure_to_sed: lender.card.metrics.relative_l2,
                pose_to_sed: lender.from_poses,
            },
        });
    }
    programs.run(index(programs, folder, lenders))?;
    programs.run(programs.model_export(words([&"patterns", folder, &"--dataset", &presses])))?;
    // Held-out states: the service tries the networks on them, and shows them beside its answers.
    programs.run(programs.own(words([&"dataset", &"replay", &presses, &"--out", folder])))?;
    Ok(report)
}

/// Lists the networks. The default is the first that learnt contact's pressure, for which most clients
/// ask; the one for clients who give pressure is the first that learnt that of presses.
fn index(programs: &Programs, folder: &Path, lenders: &[Lender]) -> std::process::Command {
    let first = |is: fn(&Lender) -> bool| lenders.iter().find(|of| is(of)).or(lenders.first());
    let [default, for_pressure] =
        [first(Lender::knows_contact), first(|of| !of.knows_contact_alone())]
            .map(|of| of.map_or("small", |lender| &lender.name));
    let mut index = programs.model_export(words([&"index", &folder, &"--default", &default]));
    if for_pressure != default {
        index.args(["--default-for-pressure", for_pressure]);
    }
    index
}

/// Puts the presses' atlas into a bundle that has none.
fn take_atlas(args: &Args, atlas: &papilla_atlas::Atlas) -> anyhow::Result<()> {
    let path = args.finger.join("atlas.json");
    if !path.is_file() {
        return Ok(atomic::write(&path, atlas.to_json()?.as_bytes())?);
    }
    let own = papilla_atlas::Atlas::from_json(&std::fs::read_to_string(&path)?)?;
    if own.hash() != atlas.hash() {
        let contact = args.contact_path();
        return Err(TeachError::OtherAtlas { atlas: path, contact }.into());
    }
    Ok(())
}

/// The pressure that contact makes of the presses, for the training.
fn contact_maps(args: &Args, programs: &Programs) -> Result<PathBuf, TeachError> {
    let (contact, presses, out) = (args.contact_path(), args.presses_path(), args.path("contact"));
    let finger = &args.finger;
    programs.run(programs.model_export(words([
        &"contact-maps",
        &contact,
        &presses,
        &"--finger",
        finger,
        &"--out",
        &out,
    ])))?;
    Ok(out.join("presses.npz"))
}

/// A folder of its own for each training: its name holds a hash of all that it depends on.
fn run_folder(args: &Args, lender: &Lender, dataset: &str, plan: &Plan) -> anyhow::Result<PathBuf> {
    let contact = match args.without_contact {
        true => String::new(),
        false => sha256_hex(&std::fs::read(args.contact_path())?),
    };
    let start = &lender.card.onnx_sha256;
    let of = format!("{dataset} {contact} {start} {} {LEARNING_RATE} {SHIFT_PX}", plan.epochs);
    let hash = sha256_hex(of.as_bytes());
    Ok(args.path("runs").join(format!("{}-{}", lender.name, &hash[..12])))
}

/// Trains, exports, checks and measures; the network and its card lie in the run's folder then.
fn train(
    args: &Args,
    programs: &Programs,
    lender: &Lender,
    (run, contact): (&Path, Option<&Path>),
    plan: &Plan,
    threads: &[OsString],
) -> anyhow::Result<Card> {
    let (presses, name) = (args.presses_path(), &lender.name);
    let [epochs, batch] = [plan.epochs, BATCH].map(|n| n.to_string());
    let file = |ending: &str| run.join(format!("{name}.{ending}"));
    let [onnx, card, reference] = [file("onnx"), file("json"), run.join("reference.npz")];
    let mut train = programs.trainer(words([
        &"train",
        &"--dataset",
        &presses,
        &"--start",
        &lender.onnx,
        &"--out",
        &run,
        &"--resume",
        &"--epochs",
        &epochs,
        &"--batch",
        &batch,
        &"--learning-rate",
        &LEARNING_RATE,
        &"--schedule",
        &"cosine",
        &"--validation-presses",
        &"0",
        &"--shift-px",
        &SHIFT_PX,
    ]));
    train.args(threads);
    if let Some(contact) = contact.filter(|_| lender.knows_contact()) {
        train.arg("--contact").arg(contact);
        train.args(lender.knows_contact_alone().then_some("--contact-alone"));
    }
    programs.run(train)?;
    programs.run(programs.trainer(words([&"export", &run, &"--name", name, &"--onnx", &onnx])))?;
    programs.run(programs.trainer(words([
        &"check",
        &onnx,
        &"--dataset",
        &presses,
        &"--run",
        &run,
        &"--reference",
        &reference,
    ])))?;
    programs.run(programs.model_export(words([
        &"evaluate",
        &onnx,
        &presses,
        &"--reference",
        &reference,
        &"--card",
        &card,
    ])))?;
    Ok(atomic::read_json(&card)?)
}

/// Errors of a network on the held-out presses, and that of contact's pressure.
fn measure(
    args: &Args,
    programs: &Programs,
    onnx: &Path,
    similarity: bool,
) -> anyhow::Result<(Errors, Option<Spread>)> {
    let (presses, contact, finger) = (args.presses_path(), args.contact_path(), &args.finger);
    let also = |mut command: std::process::Command| {
        if similarity {
            command.arg("--similarity");
        }
        command
    };
    let found: Evaluated = programs.ask(also(programs.model_export(words([
        &"--json",
        &"evaluate",
        &onnx,
        &presses,
    ]))))?;
    let pressure_to_sed = found.card.metrics.relative_l2;
    if args.without_contact {
        return Ok((Errors { pressure_to_sed, pose_to_sed: None }, None));
    }
    let rows: Vec<Row> = programs.ask(also(programs.model_export(words([
        &"--json",
        &"contact",
        &contact,
        &presses,
        &"--finger",
        finger,
        &"--method",
        &METHOD,
        &"--network",
        &onnx,
    ]))))?;
    let row = rows.first();
    let pose_to_sed = row.and_then(|row| row.sed).map(spread);
    Ok((Errors { pressure_to_sed, pose_to_sed }, row.map(|row| spread(row.pressure))))
}

/// Copies a network and its card into the bundle. The card names the network's hash, so that one
/// that was cut short between the two is refused by the service, and mended by the same command.
fn publish(args: &Args, lender: &Lender, run: &Path) -> anyhow::Result<()> {
    for ending in ["onnx", "json"] {
        let name = format!("{}.{ending}", lender.name);
        atomic::write_changed(&args.finger.join(&name), &std::fs::read(run.join(&name))?)?;
    }
    Ok(())
}

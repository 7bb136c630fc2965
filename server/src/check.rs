//! `papilla-server check`: looks at settings, models, port and limits, and serves nothing.

use std::{fmt, fs, io, net::TcpListener, path::Path, time::Instant};

use papilla_metrics::resident_bytes;
use papilla_proto::contact::ContactMethod;
use papilla_render::Maps;
use papilla_session_contact::{ContactAssets, FINGER_BYTES_MAX};
use serde::Serialize;
use serde_json::{Value, json};

use crate::{
    StartError,
    config::Config,
    core::{
        catalogue::{Catalogue, Loading, Tier, assets::Assets, calibrate, golden},
        fingers::{self, Bundle},
    },
    descriptors::Descriptors,
    processor::Vectors,
    start::load_contact,
    transport::{gate::Gate, moves::Moves, net, tls},
};

/// Bytes one connection, one session, its effects and one posted map can hold at most; see
/// docs/guides/operating.md.
const PER_CONNECTION: usize = net::BUFFER_MAX + 2 * net::SOCKET_BUFFER as usize;
const PER_SESSION: usize = 5 << 20;
const PER_EFFECTS: usize = 20 << 20;
/// A finger, during a renewal twice, and the shapes of its session.
const PER_FINGER: usize = 2 * FINGER_BYTES_MAX + (10 << 20);
const PER_REQUEST_BEYOND_BODY: usize = 2 << 20;

/// What was found, in the order it was looked at.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Whether everything is in order.
    pub ok: bool,
    /// One line each.
    pub findings: Vec<Finding>,
    #[serde(skip)]
    exit_code: u8,
}

/// One thing that was looked at.
#[derive(Debug, Serialize)]
pub struct Finding {
    /// What.
    pub what: String,
    /// Whether it is in order.
    pub ok: bool,
    /// What was found, in words.
    pub detail: String,
    /// The same as values, where there are any.
    #[serde(skip_serializing_if = "Value::is_null")]
    pub values: Value,
}

impl Report {
    /// 0 if everything is in order, or else that of the first thing that is not.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        self.exit_code
    }

    fn good(&mut self, what: &str, detail: String, values: Value) {
        self.findings.push(Finding { what: what.to_owned(), ok: true, detail, values });
    }

    fn bad(&mut self, what: &str, exit_code: u8, error: &dyn fmt::Display) {
        let (what, detail) = (what.to_owned(), error.to_string());
        self.findings.push(Finding { what, ok: false, detail, values: Value::Null });
        if self.ok {
            (self.ok, self.exit_code) = (false, exit_code);
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for finding in &self.findings {
            let mark = if finding.ok { "ok    " } else { "FAILED" };
            writeln!(f, "{mark} {:<20} {}", finding.what, finding.detail)?;
        }
        let word = if self.ok { "everything is in order" } else { "not in order" };
        write!(f, "{word}")
    }
}

/// Looks at settings, models, atlas, golden answers, calibration and port.
#[must_use]
pub fn check(config: &Config) -> Report {
    let mut report = Report { ok: true, findings: Vec::new(), exit_code: 0 };
    match config.validate() {
        Ok(()) => report.good("settings", "they go together".to_owned(), Value::Null),
        Err(error) => report.bad("settings", 2, &error),
    }
    let vectors = Vectors::here().describe();
    report.good("processor", vectors.to_owned(), Value::Null);
    match tls::acceptor(config) {
        Ok(Some(_)) => report.good("tls", "certificate and key fit".to_owned(), Value::Null),
        Ok(None) => report.good("tls", "none; plain HTTP".to_owned(), Value::Null),
        Err(error) => report.bad("tls", 2, &error),
    }
    match Gate::new(config) {
        Ok(gate) => report.good("tokens", gate.describe(), Value::Null),
        Err(error) => report.bad("tokens", 2, &error),
    }
    if let Some(file) = &config.state_keys {
        match Moves::new(config) {
            Ok(_) => report.good("state_keys", format!("{}", file.display()), Value::Null),
            Err(error) => report.bad("state_keys", 2, &error),
        }
    }
    let loaded = Assets::of(config).and_then(|assets| {
        let catalogue = Catalogue::load(&assets, Loading::of_all(config), None)?;
        Ok((assets, catalogue))
    });
    let mut solves_contact = false;
    match loaded {
        Ok((assets, catalogue)) => {
            // First: later, memory that measuring has used is used again.
            look_at_threads(&mut report, config, &catalogue);
            look_at_models(&mut report, config, &catalogue);
            let contact = load_contact(config, &assets, &catalogue);
            solves_contact = matches!(contact, Ok(Some(_)));
            look_at_contact(&mut report, contact);
            solves_contact |= look_at_fingers(&mut report, config, &catalogue);
        }
        Err(error) => report.bad("models", error.exit_code(), &error),
    }
    match TcpListener::bind(config.bind) {
        Ok(_) => report.good("port", format!("{} can be bound", config.bind), Value::Null),
        Err(source) => {
            let address = config.bind;
            report.bad("port", 4, &StartError::Bind { address, source });
        }
    }
    let descriptors = Descriptors::of(config);
    let values = json!({"due": descriptors.due, "limit": descriptors.limit});
    match (descriptors.shortage(), descriptors.limit) {
        (Some(shortage), _) => report.bad("descriptors", 2, &shortage),
        (None, Some(limit)) => {
            let detail = format!("{} of {limit} at most", descriptors.due);
            report.good("descriptors", detail, values);
        }
        (None, None) => {
            report.good("descriptors", format!("{} at most", descriptors.due), values);
        }
    }
    let bytes = memory_bound(config, solves_contact);
    let detail = format!("clients can make it hold {} MiB at most, beside the models", bytes >> 20);
    report.good("memory", detail, json!({"clients_bytes_max": bytes}));
    report
}

/// What the inference threads take, by the sessions of one, without those of models on demand.
fn look_at_threads(report: &mut Report, config: &Config, catalogue: &Catalogue) {
    let threads = config.thread_count();
    let before = resident_bytes();
    let mut maps = Maps::default();
    let warm = |tier: &Tier, maps: &mut Maps| {
        let model = tier.model()?;
        tier.warm_session(model.as_ref(), &mut maps.pressure_pa, &mut maps.sed_j_per_m3).ok()
    };
    let at_start = catalogue.tiers.iter().filter(|tier| !tier.on_demand);
    // Err: the model is named below, by its golden answers.
    let sessions: Vec<_> = at_start.filter_map(|tier| warm(tier, &mut maps)).collect();
    let grown = resident_bytes().zip(before).map(|(now, before)| now.saturating_sub(before));
    drop(sessions);
    let (detail, values) = match grown {
        Some(bytes) => {
            let all = bytes.saturating_mul(threads as u64);
            let detail = format!(
                "{threads} for inference, about {} MiB each, {} in all, beside the models",
                bytes.div_ceil(1 << 20),
                all.div_ceil(1 << 20),
            );
            (detail, json!({"threads": threads, "bytes_each": bytes}))
        }
        None => (format!("{threads} for inference"), json!({"threads": threads})),
    };
    report.good("threads", detail, values);
}

fn look_at_models(report: &mut Report, config: &Config, catalogue: &Catalogue) {
    let hash = catalogue.atlas.hash();
    let vertices = catalogue.atlas.vertex_count();
    report.good("atlas", format!("{vertices} vertices, {hash}"), json!({"hash": hash}));
    let start = Instant::now();
    let measured = calibrate::calibrate(catalogue, config.calibration());
    if let Err(error) = &measured {
        report.bad("calibration", error.exit_code(), error);
    } else if config.calibration().is_zero() {
        report.good(
            "calibration",
            "none asked for; the shipped times stand".to_owned(),
            Value::Null,
        );
    } else {
        let (overhead, took) = (catalogue.overhead.us(), start.elapsed().as_millis());
        let detail = format!("took {took} ms; {overhead} us beside the network");
        report.good("calibration", detail, json!({"overhead_us": overhead}));
    }
    for (index, tier) in catalogue.offered() {
        let what = format!("model {}", tier.name);
        let Some(model) = tier.model() else { continue };
        let states = catalogue.golden_states();
        let golden = match golden::check(states, model.as_ref(), tier.relative_l2_p95) {
            Ok(golden) => golden,
            Err(error) => {
                report.bad(&what, 3, &error);
                continue;
            }
        };
        let predicted_us = catalogue.predicted_latency_us(index);
        let answers = golden.as_ref().map_or_else(
            || "no golden answers".to_owned(),
            |golden| {
                let (error, most) = (golden.relative_l2, golden.relative_l2_max);
                let (states, share) = (golden.states, golden.share);
                format!("{states} golden answers within {error:.3} of {most:.3}, share {share:.2}")
            },
        );
        let is_default = index == catalogue.default;
        let is_for_pressure = index == catalogue.default_for_pressure;
        let default = match (is_default, is_for_pressure) {
            (true, true) => ", the default",
            (true, false) => ", the default for poses and gaps",
            (false, true) => ", the default for pressure",
            (false, false) => "",
        };
        let on_demand = if tier.on_demand { ", loaded when it is named" } else { "" };
        let values = json!({
            "tier": tier.name,
            "default": is_default,
            "default_for_pressure": is_for_pressure,
            "on_demand": tier.on_demand,
            "onnx_sha256": tier.onnx_sha256,
            "atlas_hash": tier.atlas_hash,
            "backend": model.info().backend,
            "golden": golden,
            "calibrated_us": tier.latency.calibrated_us(),
            "predicted_latency_us": predicted_us,
        });
        let backend = &model.info().backend;
        report.good(
            &what,
            format!("{predicted_us} us in {backend}, {answers}{default}{on_demand}"),
            values,
        );
    }
}

fn look_at_contact(report: &mut Report, contact: Result<Option<ContactAssets>, StartError>) {
    match contact {
        Ok(Some(contact)) => {
            contact.measure();
            let frame_us = contact.frame_us();
            let us = |&(method, us): &(ContactMethod, u64)| format!("{us} us by {method}");
            let frames: Vec<String> = frame_us.iter().map(us).collect();
            let pixels = match contact.pixels {
                Some(_) => "",
                None => "; no pixels, since its model names no layers",
            };
            let measured = if contact.errors.is_some() { "" } else { "; errors not measured" };
            let values = json!({"frame_us": frame_us, "errors": contact.errors});
            let detail = format!("of this finger, {} a frame{pixels}{measured}", frames.join(", "));
            report.good("contact", detail, values);
        }
        Ok(None) => {
            report.good("contact", "no model; sessions send pressure".to_owned(), Value::Null);
        }
        Err(error) => report.bad("contact", error.exit_code(), &error),
    }
}

/// Every folder of `--fingers`, whether it can be served or not; whether one has a contact model.
fn look_at_fingers(report: &mut Report, config: &Config, default: &Catalogue) -> bool {
    let Some(folder) = &config.fingers else { return false };
    let names = match folders(folder) {
        Ok(names) => names,
        Err(source) => {
            report.bad("fingers", 3, &StartError::Folder { folder: folder.clone(), source });
            return false;
        }
    };
    let most = config.max_loaded_fingers.get();
    let detail = format!("{} in {}, {most} loaded at most", names.len(), folder.display());
    let values = json!({"folders": names.len(), "loaded_max": most});
    report.good("fingers", detail, values);
    let mut solves_contact = false;
    for name in &names {
        let what = format!("finger {name}");
        if !fingers::is_name(name) {
            report.bad(
                &what,
                3,
                &"no client can name it: a name has 1 to 64 letters, digits, - and _, and 'default' \
                  is the finger of the models; rename the folder",
            );
            continue;
        }
        let before = resident_bytes();
        let (loading, place) = (Loading::of_all(config), (&**name, 1));
        let read = Bundle::read(&folder.join(name), place, loading, default, None, &|| false);
        let bundle = match read {
            Ok(Some(bundle)) => bundle,
            Ok(None) => continue,
            Err(error) => {
                report.bad(&what, 3, &error);
                continue;
            }
        };
        solves_contact |= bundle.contact.is_some();
        look_at_finger(report, &what, &bundle, before);
    }
    solves_contact
}

fn look_at_finger(report: &mut Report, what: &str, bundle: &Bundle, before: Option<u64>) {
    let Bundle { catalogue, contact, files_bytes } = bundle;
    let mut maps = Maps::default();
    let mut sessions = Vec::new();
    for (_, tier) in catalogue.offered().filter(|(_, tier)| !tier.on_demand) {
        let Some(model) = tier.model() else { continue };
        let Maps { pressure_pa, sed_j_per_m3, .. } = &mut maps;
        match tier.warm_session(model.as_ref(), pressure_pa, sed_j_per_m3) {
            Ok(session) => sessions.push(session),
            Err(error) => return report.bad(what, 3, &error),
        }
    }
    let grown = resident_bytes().zip(before).map(|(now, before)| now.saturating_sub(before));
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let takes = grown.map_or_else(String::new, |bytes| {
        format!(", {} MiB here with all its models and one thread", mib(bytes))
    });
    let borrowed: Vec<&str> = catalogue
        .offered()
        .filter_map(|(_, tier)| tier.trained_on.as_ref().map(|_| tier.name.as_str()))
        .collect();
    let similarity = match borrowed.is_empty() {
        true => String::new(),
        false => format!("; by similarity alone: {}", borrowed.join(", ")),
    };
    let solves = if contact.is_some() { "contact" } else { "no contact model" };
    let values = json!({
        "atlas_hash": catalogue.atlas.hash(),
        "contact": contact.is_some(),
        "files_bytes": files_bytes,
        "grown_bytes": grown,
        "by_similarity": borrowed,
    });
    let (tiers, files) = (catalogue.names(), mib(*files_bytes));
    let detail = format!("{tiers}; {solves}; {files} MiB of files{takes}{similarity}");
    report.good(what, detail, values);
}

/// The names of the folders in a folder, in order.
fn folders(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.path().is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort_unstable();
    Ok(names)
}

/// Bytes that clients can make the service hold, by construction.
fn memory_bound(config: &Config, solves_contact: bool) -> usize {
    let requests =
        config.max_requests.get() * (3 * config.max_body_bytes + PER_REQUEST_BEYOND_BODY);
    let contact = if solves_contact { PER_FINGER } else { 0 };
    config.max_connections.get() * (PER_CONNECTION + config.max_body_bytes)
        + config.max_sessions.get() * (PER_SESSION + PER_EFFECTS)
        + config.max_fingers.get() * (PER_EFFECTS + contact)
        + requests
}

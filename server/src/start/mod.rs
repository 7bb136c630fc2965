//! From settings to a service that renders, behind a port that is open already: load the default
//! tier, warm, serve, load the other tiers, measure.

mod load;
mod remeasure;

use std::{
    borrow::Cow,
    io,
    path::Path,
    sync::{Arc, mpsc::sync_channel},
    thread,
};

use papilla_engine::{Backend, Choice};
use papilla_metrics::Metrics;
use papilla_proto::contact::FINGERS_MAX;
use papilla_session_contact::ContactAssets;
use tokio::{
    sync::{oneshot, watch},
    task::spawn_blocking,
};

use crate::{
    StartError,
    config::Config,
    core::{
        catalogue::{
            Catalogue, Loading, Step,
            assets::{Assets, CONTACT, CONTACT_ERRORS},
            calibrate, golden,
        },
        desk::Desk,
        fingers, reload,
        scheduler::Pool,
    },
    priority::{Priorities, RealTime, Role},
    progress::{Progress, Stage},
    transport::{app::App, front::Front, gate::Gate, moves::Moves, routes},
};

/// What there is before the models are.
pub(crate) struct Parts {
    pub(crate) config: Config,
    pub(crate) gate: Gate,
    pub(crate) moves: Moves,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) progress: Arc<Progress>,
    pub(crate) front: Arc<Front>,
    pub(crate) drain: Arc<watch::Sender<bool>>,
    pub(crate) priorities: Priorities,
}

/// What there is once they are ready.
pub(crate) struct Opened {
    pub(crate) app: Arc<App>,
    pub(crate) pool: Pool,
    pub(crate) tiers: Vec<String>,
    pub(crate) default_tier: String,
    pub(crate) default_tier_for_pressure: String,
    pub(crate) real_time: Option<RealTime>,
}

/// Loads the default tier's model and opens the front; then loads the others. Returns once every tier
/// is measured.
///
/// # Errors
/// The models are missing or unusable, or do not run; a thread cannot be started; the folder
/// cannot be watched.
pub(crate) async fn open(parts: Parts) -> Result<Opened, StartError> {
    let Parts { config, gate, moves, metrics, progress, front, drain, priorities } = parts;
    let (loaded, loading) = oneshot::channel();
    let (opened, opening) = sync_channel::<Arc<App>>(1);
    let (measured, measuring) = oneshot::channel();
    let work = {
        let (config, metrics, progress) =
            (config.clone(), Arc::clone(&metrics), Arc::clone(&progress));
        let priorities = priorities.clone();
        move || {
            priorities.enter(Role::Other);
            let of_default = Assets::of(&config).and_then(|assets| {
                load(&config, &assets, &metrics, &progress, &priorities).map(|of| (assets, of))
            });
            let (assets, of_default) = match of_default {
                Ok((assets, of)) => (Some(assets), Ok(of)),
                Err(error) => (None, Err(error)),
            };
            // Err: the start was given up, or loading has failed.
            if let (Ok(()), Some(assets)) = (loaded.send(of_default).map_err(|_| ()), assets)
                && let Ok(app) = opening.recv()
            {
                let _ = measured.send(complete(&config, assets, &app, &progress));
            }
        }
    };
    // A thread of its own: a runtime that ends would wait for its blocking tasks.
    thread::Builder::new().name("start".to_owned()).spawn(work).map_err(StartError::Thread)?;
    let (catalogue, pool) = loading.await.map_err(|_| StartError::WorkerPanicked)??;
    let tiers = catalogue.tiers.iter().map(|tier| tier.name.clone()).collect();
    let [default_tier, default_tier_for_pressure] =
        [catalogue.default, catalogue.default_for_pressure]
            .map(|place| catalogue.tiers[place].name.clone());
    let real_time = priorities.report(&metrics);
    let step_back = move || priorities.enter(Role::Behind);
    let desk = Desk::start(desk_threads(), step_back).map_err(StartError::Thread)?;
    let parts = (gate, moves, desk);
    let app = App::new(&config, catalogue, metrics, &pool, parts, drain, Arc::clone(&progress));
    let app = Arc::new(app);
    let watched = [config.models.as_deref(), config.fingers.as_deref()].into_iter().flatten();
    for folder in watched.filter(|_| config.watch_models) {
        let (reloader, watched) = (Arc::clone(&app.reloader), folder.to_owned());
        // What watches has a thread, which is not to have the priority of those that read.
        let watching = spawn_blocking(move || reload::watch(reloader, &watched));
        watching.await.map_err(|_| StartError::WorkerPanicked)?.map_err(StartError::Thread)?;
    }
    front.open(routes::router(Arc::clone(&app), &config.allow_origin, config.xr_dir.as_deref()));
    // Err: it is there to be found that the thread has ended.
    let _ = opened.send(Arc::clone(&app));
    measuring.await.map_err(|_| StartError::WorkerPanicked)??;
    progress.enter(Stage::Ready, Vec::new());
    if !config.calibration().is_zero() {
        tokio::spawn(remeasure::until_drain(Arc::clone(&app)));
    }
    tokio::spawn(load::until_drain(Arc::clone(&app), config.thread_count()));
    Ok(Opened { app, pool, tiers, default_tier, default_tier_for_pressure, real_time })
}

/// Threads for hellos: half of the processors, within bounds.
fn desk_threads() -> usize {
    thread::available_parallelism().map_or(2, |cores| (cores.get() / 2).clamp(2, 4))
}

fn load(
    config: &Config,
    assets: &Assets,
    metrics: &Arc<Metrics>,
    progress: &Progress,
    priorities: &Priorities,
) -> Result<(Arc<Catalogue>, Pool), StartError> {
    let loading = Loading::of_default(config);
    if let Some(folder) = &config.fingers {
        let names = fingers::names(folder)?;
        tracing::info!(folder = %folder.display(), fingers = names.join(", "), "fingers to be named");
    }
    let catalogue = Catalogue::load_noting(assets, loading, None, &mut |step| match step {
        Step::Listed(names) => progress.enter(Stage::Loading, names.to_vec()),
        Step::Loaded(name) => progress.done(name),
    })?;
    if config.backend == Choice::Only(Backend::Ort) {
        require_golden_answers(&catalogue)?;
    }
    let catalogue = Arc::new(catalogue);
    progress.enter(Stage::Warming, Vec::new());
    metrics.name_tiers(catalogue.tier_labels());
    // A slot is in the queue at most once, so this many places are always enough.
    let places = config.max_sessions.get() * FINGERS_MAX + config.max_requests.get();
    let pool = Pool::start(&catalogue, metrics, config.thread_count(), places, priorities)?;
    Ok((catalogue, pool))
}

/// Holds all loaded tiers to their golden answers: the library of ONNX Runtime is not the one that the models
/// were tried with. Where the backend is chosen for its speed, loading has done so already.
fn require_golden_answers(catalogue: &Catalogue) -> Result<(), StartError> {
    for tier in &catalogue.tiers {
        let Some(model) = tier.model() else { continue };
        golden::check(catalogue.golden_states(), model.as_ref(), tier.relative_l2_p95).map_err(
            |error| StartError::Unusable {
                file: format!("{}.onnx", tier.name),
                origin: model.info().backend.clone(),
                reason: format!("{error}; --backend tract does without ONNX Runtime"),
            },
        )?;
    }
    Ok(())
}

/// Reads the contact model that `config` names, or else the one among the models, if there is one.
/// It has to be of the models' finger.
pub(crate) fn load_contact(
    config: &Config,
    assets: &Assets,
    catalogue: &Catalogue,
) -> Result<Option<ContactAssets>, StartError> {
    let (file, origin) = match &config.contact {
        Some(file) => (file.display().to_string(), "--contact"),
        None => (CONTACT.to_owned(), assets.origin.as_str()),
    };
    let bad = |reason: String| {
        let (file, origin) = (file.clone(), origin.to_owned());
        StartError::Unusable { file, origin, reason }
    };
    let bytes = match &config.contact {
        Some(file) => Cow::Owned(std::fs::read(file).map_err(|error| bad(error.to_string()))?),
        None => match assets.get(CONTACT) {
            Some(bytes) => Cow::Borrowed(bytes),
            None => return Ok(None),
        },
    };
    let beside = match &config.contact {
        Some(file) => read_beside(file).map_err(|error| bad(error.to_string()))?.map(Cow::Owned),
        None => assets.get(CONTACT_ERRORS).map(Cow::Borrowed),
    };
    let contact = ContactAssets::read(&bytes, beside.as_deref(), &catalogue.atlas, &catalogue.skin);
    let contact = contact.and_then(|contact| match &config.contact {
        // Whoever names a file may keep it elsewhere than what it was made of.
        Some(_) => Ok(contact),
        None => assets.require_finger_of(&contact).map(|()| contact),
    });
    contact.map(Some).map_err(|error| bad(error.to_string()))
}

/// What methods err, as a file beside the contact model tells it; none without such a file.
fn read_beside(contact: &Path) -> io::Result<Option<Vec<u8>>> {
    match std::fs::read(contact.with_file_name(CONTACT_ERRORS)) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Loads the contact model and the tiers that are left, then measures them; the service is open
/// meanwhile, and what disturbs the measurement does not last, since every frame is measured as well.
fn complete(
    config: &Config,
    assets: Assets,
    app: &App,
    progress: &Progress,
) -> Result<(), StartError> {
    let (catalogue, reloader) = (app.catalogue(), &app.reloader);
    let to_come: Vec<usize> = catalogue.to_come().collect();
    let names = to_come.iter().map(|&place| catalogue.tiers[place].name.clone()).collect();
    progress.enter(Stage::Completing, names);
    app.set_contact(load_contact(config, &assets, &catalogue)?);
    drop(assets);
    for &place in &to_come {
        reloader.load_at_start(place, to_come.len() + 1)?;
        progress.done(&catalogue.tiers[place].name);
    }
    let catalogue = app.catalogue();
    let loaded = catalogue.tiers.iter().filter(|tier| tier.is_loaded());
    let names = loaded.map(|tier| tier.name.clone()).collect();
    progress.enter(Stage::Calibrating, names);
    calibrate::calibrate_noting(&catalogue, config.calibration(), &mut |tier| progress.done(tier))?;
    if let Some(contact) = app.contact() {
        // On a thread of its own, so that its solvers' memory is the system's again.
        thread::scope(|scope| {
            let measuring = thread::Builder::new().name("measure".to_owned());
            measuring.spawn_scoped(scope, || contact.measure()).map(drop)
        })
        .map_err(StartError::Thread)?;
    }
    Ok(())
}

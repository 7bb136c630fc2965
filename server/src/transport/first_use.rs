//! Waiting for a tier, or a finger, that is loaded when a client first names it.

use std::{sync::Arc, time::Duration};

use papilla_metrics::Shed;
use papilla_proto::{ErrorCode, Problem, contact::DEFAULT_FINGER, error::shortened};
use tokio::time::timeout;

use super::{app::App, gate::Key};
use crate::{
    core::{
        catalogue::places,
        desk::NoResult,
        reload::{Reloader, Turn},
    },
    problem,
};

/// Waits until the finger of this name is loaded, no longer than `wait_max`; the desk loads it, as
/// [`wait`] has it.
///
/// # Errors
/// There is none, too many are loaded, it is unusable, or it is not loaded in time; then it is still
/// being loaded, and the problem says to come again.
pub(crate) async fn wait_for_finger(
    app: &Arc<App>,
    name: &str,
    client: Option<&Key>,
    wait_max: Duration,
) -> Result<(), Problem> {
    if name == DEFAULT_FINGER || app.reloader.finger(name).is_some() {
        return Ok(());
    }
    if let Some(problem) = app.reloader.finger_failed_lately(name) {
        return Err(problem);
    }
    let owned = name.to_owned();
    let load = move |reloader: &Reloader, turn: &Turn| reloader.load_finger(turn, &owned);
    let what = format!("finger '{}'", shortened(name));
    at_desk(app, &what, client, wait_max, load).await
}

/// Waits until the tier of this number is loaded, no longer than `wait_max`. The desk loads it, once
/// for all who wait: it goes on if whoever named it first leaves.
///
/// # Errors
/// The model is unusable, or not loaded in time; then it is still being loaded, and the problem says
/// to come again.
pub(crate) async fn wait(
    app: &Arc<App>,
    number: usize,
    client: Option<&Key>,
    wait_max: Duration,
) -> Result<(), Problem> {
    let (finger, place) = places(number);
    let catalogue = app.reloader.catalogue_at(finger);
    let tier = catalogue.as_ref().and_then(|catalogue| catalogue.tiers.get(place));
    let Some(tier) = tier.filter(|tier| !tier.is_loaded()) else {
        return Ok(());
    };
    if let Some(problem) = tier.held.failed_lately() {
        return Err(problem);
    }
    let load = move |reloader: &Reloader, turn: &Turn| reloader.load_first(turn, number);
    let what = format!("tier {}", tier.name);
    at_desk(app, &what, client, wait_max, load).await.map_err(|problem| match problem.field {
        None => problem.at("tier"),
        Some(_) => problem,
    })
}

/// Has the desk load something, once it is its turn, and waits for that no longer than `wait_max`.
async fn at_desk(
    app: &Arc<App>,
    what: &str,
    client: Option<&Key>,
    wait_max: Duration,
    load: impl FnOnce(&Reloader, &Turn) -> Result<(), Problem> + Send + 'static,
) -> Result<(), Problem> {
    let loading = async {
        // Those who come meanwhile wait here, and then find it loaded.
        let turn = app.reloader.begin().await;
        let (to_load, client) = (Arc::clone(app), client.cloned());
        let work = async move {
            let reloader = Arc::clone(&to_load.reloader);
            to_load.desk.work(client, move |_| load(&reloader, &turn)).await
        };
        // A task of its own: it outlives whoever waits for it.
        tokio::spawn(work).await
    };
    let busy = |message: String| {
        app.metrics.shed(Shed::Hellos);
        Problem::new(ErrorCode::Overloaded, message)
    };
    match timeout(wait_max, loading).await {
        Ok(Ok(Ok(result))) => result,
        Ok(Ok(Err(NoResult::Busy))) => {
            Err(busy("too much waits to be worked out; try again in a moment".to_owned()))
        }
        Ok(Ok(Err(NoResult::Broken)) | Err(_)) => {
            Err(problem::internal("it cannot be loaded", &what))
        }
        Err(_) => Err(busy(format!(
            "{what} is loaded at its first use, which takes longer than {wait_max:?}; try again in a \
             moment"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, num::NonZeroUsize, path::Path};

    use super::*;
    use crate::Config;

    /// Longer than any load.
    const PATIENCE: Duration = Duration::from_secs(120);

    #[tokio::test(flavor = "multi_thread")]
    async fn a_wait_ends_in_time_and_the_next_one_finds_what_it_has_begun() {
        let models = tempfile::tempdir().unwrap();
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
        for file in ["atlas.json", "nano.onnx", "nano.json", "half-space.onnx", "half-space.json"] {
            fs::copy(shipped.join(file), models.path().join(file)).unwrap();
        }
        let index = br#"{"default": "nano", "models": ["nano", "half-space"],
            "on_demand": ["half-space"]}"#;
        fs::write(models.path().join("index.json"), index).unwrap();
        let config = Config {
            models: Some(models.path().to_owned()),
            threads: NonZeroUsize::new(1),
            calibration_ms: 0,
            ..Config::default()
        };
        let server = crate::start(&config).await.unwrap();
        let app = &server.app;
        let place = app.catalogue().find("half-space").unwrap();
        let is_loaded = || app.catalogue().tiers[place].is_loaded();
        // Something else is being loaded, and takes its time.
        let turn = app.reloader.begin().await;
        let late = wait(app, place, None, Duration::from_millis(20)).await.unwrap_err();
        assert_eq!((late.code, late.field.as_deref()), (ErrorCode::Overloaded, Some("tier")));
        assert!(late.message.contains("try again") && !is_loaded(), "{late}");
        drop(turn);
        // Whoever waits too short has it loaded all the same, sooner or later.
        while !is_loaded() {
            match wait(app, place, None, Duration::from_millis(1)).await {
                Ok(()) => assert!(is_loaded()),
                Err(problem) => assert_eq!(problem.code, ErrorCode::Overloaded, "{problem}"),
            }
        }
        wait(app, place, None, PATIENCE).await.unwrap();
        server.drain().await.unwrap();
    }
}

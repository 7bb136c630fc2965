//! Waiting for a tier whose model is loaded when a client first names it.

use std::{sync::Arc, time::Duration};

use papilla_metrics::Shed;
use papilla_proto::{ErrorCode, Problem};
use tokio::time::timeout;

use super::{app::App, gate::Key};
use crate::{core::desk::NoResult, problem};

/// Waits until the tier at `place` is loaded, no longer than `wait_max`. The desk loads it, once for
/// all who wait: it goes on if whoever named it first leaves.
///
/// # Errors
/// The model is unusable, or not loaded in time; then it is still being loaded, and the problem says
/// to come again.
pub(crate) async fn wait(
    app: &Arc<App>,
    place: usize,
    client: Option<&Key>,
    wait_max: Duration,
) -> Result<(), Problem> {
    let catalogue = app.catalogue();
    let Some(tier) = catalogue.tiers.get(place).filter(|tier| !tier.is_loaded()) else {
        return Ok(());
    };
    if let Some(problem) = tier.held.failed_lately() {
        return Err(problem);
    }
    let loading = async {
        // Those who come meanwhile wait here, and then find it loaded.
        let turn = app.reloader.begin().await;
        let (to_load, client) = (Arc::clone(app), client.cloned());
        let work = async move {
            let reloader = Arc::clone(&to_load.reloader);
            to_load.desk.work(client, move |_| reloader.load_first(&turn, place)).await
        };
        // A task of its own: it outlives whoever waits for it.
        tokio::spawn(work).await
    };
    let busy = |message: String| {
        app.metrics.shed(Shed::Hellos);
        Problem::new(ErrorCode::Overloaded, message).at("tier")
    };
    match timeout(wait_max, loading).await {
        Ok(Ok(Ok(result))) => result,
        Ok(Ok(Err(NoResult::Busy))) => {
            Err(busy("too much waits to be worked out; try again in a moment".to_owned()))
        }
        Ok(Ok(Err(NoResult::Broken)) | Err(_)) => {
            Err(problem::internal("the tier cannot be loaded", &tier.name))
        }
        Err(_) => Err(busy(format!(
            "tier {} is loaded at its first use, which takes longer than {wait_max:?}; try again \
             in a moment",
            tier.name
        ))),
    }
}

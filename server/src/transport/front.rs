//! Answers before the models are loaded: health checks at once, everything else as soon as it can.

use std::{convert::Infallible, sync::Arc, time::Duration};

use axum::{
    Router,
    body::{Body, HttpBody},
    http::Request,
    response::Response,
};
use bytes::Bytes;
use papilla_metrics::Metrics;
use papilla_proto::Problem;
use serde_json::json;
use tokio::{
    sync::{SetOnce, watch},
    time::timeout,
};
use tower::ServiceExt;

use super::{
    answer::{json_answer, refusal::refused},
    http::info,
};
use crate::{drain::begun, problem, progress::Progress};

/// The way to the routes, which are there once the models are loaded.
pub(crate) struct Front {
    router: SetOnce<Router>,
    progress: Arc<Progress>,
    metrics: Arc<Metrics>,
    drain: Arc<watch::Sender<bool>>,
    /// Longest wait of a request for the routes.
    wait_max: Duration,
}

impl Front {
    pub(crate) fn new(
        progress: Arc<Progress>,
        metrics: Arc<Metrics>,
        drain: Arc<watch::Sender<bool>>,
        wait_max: Duration,
    ) -> Self {
        Self { router: SetOnce::new(), progress, metrics, drain, wait_max }
    }

    /// From here on the routes answer.
    pub(crate) fn open(&self, router: Router) {
        // Err: it is open already.
        let _ = self.router.set(router);
    }

    /// Whether the routes answer.
    pub(crate) fn is_open(&self) -> bool {
        self.router.get().is_some()
    }

    /// Answers a request: by its route, or for as long as there is none by how far the start is.
    pub(crate) async fn answer<B>(&self, request: Request<B>) -> Result<Response, Infallible>
    where
        B: HttpBody<Data = Bytes> + Send + 'static,
        B::Error: Into<axum::BoxError>,
    {
        if let Some(router) = self.router.get() {
            return router.clone().oneshot(request.map(Body::new)).await;
        }
        let problem = match request.uri().path() {
            "/healthz" => return Ok(info::healthz().await),
            "/v2/health/live" => return Ok(json_answer(&json!({"live": true}))),
            "/readyz" => match self.progress.left() {
                Some(left) => return Ok(info::starting(&self.metrics, &left)),
                None => problem::shutting_down(),
            },
            "/v2/health/ready" => self.starting(),
            _ => {
                let mut drain = self.drain.subscribe();
                tokio::select! {
                    router = timeout(self.wait_max, self.router.wait()) => match router {
                        Ok(router) => {
                            drop(drain);
                            return router.clone().oneshot(request.map(Body::new)).await;
                        }
                        Err(_) => self.starting(),
                    },
                    () = begun(&mut drain) => problem::shutting_down(),
                }
            }
        };
        Ok(refused(&self.metrics, request.uri(), problem))
    }

    fn starting(&self) -> Problem {
        self.progress.left().map_or_else(problem::shutting_down, |left| left.problem())
    }
}

#[cfg(test)]
mod tests {
    use axum::{http::StatusCode, routing::get};

    use super::*;

    fn front(wait_max: Duration) -> Front {
        let drain = Arc::new(watch::Sender::new(false));
        Front::new(Arc::default(), Metrics::new(), drain, wait_max)
    }

    async fn status(front: &Front, path: &str) -> StatusCode {
        let request = Request::get(path).body(Body::empty()).unwrap();
        front.answer(request).await.unwrap().status()
    }

    #[tokio::test]
    async fn a_request_waits_for_the_routes_and_no_longer_than_it_may() {
        let closed = front(Duration::from_millis(20));
        for path in ["/healthz", "/v2/health/live"] {
            assert_eq!(status(&closed, path).await, StatusCode::OK, "{path}");
        }
        for path in ["/readyz", "/v2/health/ready", "/v1/sed", "/v2/models/a", "/"] {
            assert_eq!(status(&closed, path).await, StatusCode::SERVICE_UNAVAILABLE, "{path}");
        }
        let open = Arc::new(front(Duration::from_secs(60)));
        let waiting = tokio::spawn({
            let open = Arc::clone(&open);
            async move { status(&open, "/a").await }
        });
        tokio::task::yield_now().await;
        open.open(Router::new().route("/a", get(|| async { "a" })));
        assert_eq!(waiting.await.unwrap(), StatusCode::OK);
    }

    #[tokio::test]
    async fn a_drain_ends_the_wait() {
        let front = front(Duration::from_secs(60));
        front.drain.send_replace(true);
        assert_eq!(status(&front, "/v1/sed").await, StatusCode::SERVICE_UNAVAILABLE);
    }
}

//! Frames sent faster than they are answered.

use std::{
    future::{Future, poll_fn},
    pin::Pin,
    task::{Context as TaskContext, Poll},
    time::Duration,
};

use anyhow::{Context, Result, ensure};
use papilla_client::{Answer, Status};
use papilla_tests::conformance::inputs::Pressure;
use serde_json::{Value, json};
use tokio::{sync::oneshot::Receiver, time};

use crate::{
    checks::check_answer,
    run::{Run, control, member},
};

/// The outcomes of a burst, in the order in which they came.
struct Outcomes<T> {
    /// Of each frame sent, until its outcome is there.
    waiting: Vec<Option<Receiver<T>>>,
    arrived: Vec<(usize, T)>,
}

impl<T> Outcomes<T> {
    fn of(waiting: Vec<Option<Receiver<T>>>) -> Self {
        Self { waiting, arrived: Vec::new() }
    }

    /// Looks at every frame, the newest first: an older one that has no outcome when a newer one
    /// has was not answered before it. Two that are found in one look stand as they were sent.
    fn look(&mut self, task: &mut TaskContext<'_>) {
        let mut found = Vec::new();
        for (number, slot) in self.waiting.iter_mut().enumerate().rev() {
            let Some(receiver) = slot else { continue };
            if let Poll::Ready(answer) = Pin::new(receiver).poll(task) {
                *slot = None;
                found.extend(answer.ok().map(|answer| (number, answer)));
            }
        }
        found.reverse();
        self.arrived.append(&mut found);
    }

    /// Waits until no frame is without an outcome.
    async fn all(&mut self) {
        poll_fn(|task| {
            self.look(task);
            if self.waiting.iter().any(Option::is_some) { Poll::Pending } else { Poll::Ready(()) }
        })
        .await;
    }

    /// Keeps looking for so long.
    async fn during(&mut self, time: Duration) {
        let mut end = std::pin::pin!(time::sleep(time));
        poll_fn(|task| {
            self.look(task);
            end.as_mut().poll(task)
        })
        .await;
    }
}

impl Run {
    pub(crate) async fn burst(&mut self, step: &Value) -> Result<()> {
        let session = self.session()?;
        let (count, input): (usize, Pressure) = (member(step, "count")?, member(step, "pressure")?);
        let maps: Vec<_> = (1..=count).map(|k| input.draw(k as f64 / count as f64, None)).collect();
        let gap = Duration::from_millis(step["gap_ms"].as_u64().unwrap_or(0));
        let before = session.superseded_by_client();
        let paused = step["paused"] == json!(true);
        if paused {
            control("pause").await?;
        }
        let mut outcomes = Outcomes::of(Vec::new());
        for map in &maps {
            outcomes.waiting.push(Some(session.send(map)?));
            outcomes.during(gap).await;
        }
        if paused {
            control("resume").await?;
        }
        time::timeout(self.patience, outcomes.all()).await?;
        let counted = session.superseded_by_client() - before;
        self.note = check_burst(&step["expect"], count, counted, &outcomes.arrived)?;
        Ok(())
    }
}

/// Holds what came against what is due; what people may want to know of it.
fn check_burst(
    expect: &Value,
    count: usize,
    counted: u64,
    arrived: &[(usize, Answer)],
) -> Result<String> {
    ensure!(arrived.len() == count, "{} of {count} frames have an outcome", arrived.len());
    let mut sequences: Vec<u32> = arrived.iter().map(|(_, answer)| answer.sequence).collect();
    sequences.sort_unstable();
    sequences.dedup();
    ensure!(sequences.len() == count, "two outcomes of one frame");
    let superseded = |due: bool| {
        let due = Status::Superseded { by_client: due };
        arrived.iter().filter(|(_, answer)| answer.status == due).count() as u64
    };
    let (here, there) = (superseded(true), superseded(false));
    let good: Vec<usize> =
        arrived.iter().filter(|(_, answer)| answer.is_ok()).map(|(number, _)| *number).collect();
    ensure!(good.len() as u64 + here + there == count as u64, "other outcomes: {arrived:?}");
    ensure!(good.is_sorted(), "frames were answered in the order {good:?}");
    ensure!(here == counted, "the client counts {counted} superseded, {here} were");
    ensure!(here + there >= expect["superseded"].as_u64().unwrap_or(0), "{here} + {there}");
    let due = expect["superseded_by_client"].as_u64().unwrap_or(0);
    ensure!(here >= due, "the client superseded {here}");
    let newest = arrived.iter().find(|(number, _)| number + 1 == count);
    check_answer(&expect["newest"], &newest.context("the newest has no outcome")?.1)?;
    Ok(format!(" ({} ok, {here} superseded here, {there} by the service)", good.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::sync::oneshot;

    #[tokio::test]
    async fn outcomes_stand_in_the_order_in_which_they_came() {
        let (sent, waiting): (Vec<_>, Vec<_>) = (0..3).map(|_| oneshot::channel()).unzip();
        let mut outcomes = Outcomes::of(waiting.into_iter().map(Some).collect());
        let mut sent: Vec<_> = sent.into_iter().map(Some).collect();
        for number in [1, 0, 2] {
            let told = sent[number].take().map(|sent| sent.send(()));
            assert!(matches!(told, Some(Ok(()))));
            outcomes.during(Duration::ZERO).await;
        }
        outcomes.all().await;
        let order: Vec<usize> = outcomes.arrived.iter().map(|(number, _)| *number).collect();
        assert_eq!(order, [1, 0, 2]);
    }
}

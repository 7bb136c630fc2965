//! Scenes that threads take one after another.

use super::record::Record;
use super::{Ending, How, SceneRecord, ScenesError};
use crate::stability::panic_text;
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::balanced::Balanced;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_fingertip::simulation::sample::fault;
use papilla_processor::thread_s;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The finger that all scenes are of, and a campaign's indenters.
pub(super) struct Finger {
    pub body: Body,
    /// How each of the campaign's indenters is pressed, but for pose and offset.
    approaches: Vec<Approach>,
}

/// The scenes to solve, on one finger.
pub(super) struct Queue<'a> {
    pub finger: &'a Finger,
    pub todo: &'a [Indentation],
    pub next: AtomicUsize,
    pub record: &'a Record,
    pub solved: &'a (dyn Fn() + Sync),
}

impl Queue<'_> {
    /// Solves scenes until none is left.
    pub(super) fn work(&self) -> Result<Vec<SceneRecord>, ScenesError> {
        let body = &self.finger.body;
        let mut solver = body.solver(Options::default())?;
        let mut done = Vec::new();
        while let Some(press) = self.todo.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            let found = self.finger.solve(&mut solver, press);
            if matches!(found.ending, Ending::Panicked(_)) {
                // It may be in any state.
                solver = body.solver(Options::default())?;
            }
            self.record.add(&found)?;
            done.push(found);
            (self.solved)();
        }
        Ok(done)
    }
}

impl Finger {
    /// Sets up the finger of a campaign.
    pub(super) fn new(spec: &CampaignSpec) -> Result<Self, ScenesError> {
        let candidates = spec.candidates();
        let Simulation { body, approach, .. } = Simulation::new(&spec.scene(&candidates[0]))?;
        let built = candidates.into_iter().map(|c| {
            let shape = c
                .indenter
                .build(&spec.folder)
                .map_err(IndenterError::from)
                .map_err(SimulationError::from)?;
            Ok(Approach { shape, top_mm: c.indenter.top_mm(), ..approach.clone() })
        });
        let approaches = built.collect::<Result<_, ScenesError>>()?;
        Ok(Self { body, approaches })
    }

    /// Presses one scene to its deepest state.
    pub(super) fn solve(&self, solver: &mut Solver<'_>, press: &Indentation) -> SceneRecord {
        let began_s = thread_s();
        let (pose, offset_mm) = (press.pose, press.offset_mm);
        let approach = Approach { pose, offset_mm, ..self.approaches[press.candidate].clone() };
        let drive = Drive::Depths(press.depths_mm.clone());
        let vertices = self.body.patch.as_ref().map_or(0, |p| p.patch.skin.len());
        let keep = &mut |_: usize, _: &Solver<'_>, r: &IncrementRecord, s: &StepReport| {
            (fault(r, vertices), r.checks.j_min, s.effort.since(&s.mending))
        };
        let solved = catch_unwind(AssertUnwindSafe(|| {
            self.body.press_balanced(solver, &approach, &drive, BALANCE_RELATIVE_MAX, keep)
        }));
        let (mut iterations, mut cuts, mut j_min, mut ways) = (0, 0, None, Vec::new());
        let ending = match solved {
            Err(panic) => Ending::Panicked(panic_text(panic.as_ref()).into()),
            Ok(Balanced { kept, attempts, pressed }) => {
                ways = attempts;
                if let Some((_, j, effort)) = kept.last() {
                    (iterations, cuts) = (effort.newton_iterations, effort.cuts);
                    j_min = Some(*j);
                }
                let missed = kept.into_iter().find_map(|(fault, ..)| fault);
                match (pressed, missed) {
                    (Err(error), _) => Ending::Refused(error.to_string()),
                    (Ok(()), Some(fault)) => Ending::Unbalanced(fault),
                    (Ok(()), None) => Ending::Balanced,
                }
            }
        };
        SceneRecord {
            press: press.clone(),
            ending,
            newton_iterations: iterations,
            cuts,
            j_min,
            seconds: thread_s() - began_s,
            how: How::Recorded {
                version: concat!("papilla-validation ", env!("CARGO_PKG_VERSION")).into(),
                contact: ways.last().filter(|way| way.stopped.is_none()).map(|way| way.contact),
                attempts: ways,
            },
        }
    }
}

//! Scenes that threads take one after another.

use super::record::Record;
use super::{Ending, SceneRecord, ScenesError};
use crate::acceptance::fault;
use crate::processor;
use crate::stability::panic_text;
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::IncrementRecord;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The scenes to solve, on one finger.
pub(super) struct Queue<'a> {
    pub body: &'a Body,
    /// How each of the campaign's indenters is pressed, but for pose and offset.
    pub approaches: Vec<Approach>,
    pub todo: &'a [Indentation],
    pub next: AtomicUsize,
    pub record: &'a Record,
    pub solved: &'a (dyn Fn() + Sync),
}

/// See [`Queue::approaches`]; `first` is that of one of them.
pub(super) fn approaches(
    spec: &CampaignSpec,
    first: &Approach,
) -> Result<Vec<Approach>, ScenesError> {
    let built = spec.candidates().into_iter().map(|c| {
        let shape = c
            .indenter
            .build(&spec.folder)
            .map_err(IndenterError::from)
            .map_err(SimulationError::from)?;
        Ok(Approach { shape, top_mm: c.indenter.top_mm(), ..first.clone() })
    });
    built.collect()
}

impl Queue<'_> {
    /// Solves scenes until none is left.
    pub(super) fn work(&self) -> Result<Vec<SceneRecord>, ScenesError> {
        let mut solver = self.body.solver(Options::default())?;
        let mut done = Vec::new();
        while let Some(press) = self.todo.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            let found = self.solve(&mut solver, press);
            if matches!(found.ending, Ending::Panicked(_)) {
                // It may be in any state.
                solver = self.body.solver(Options::default())?;
            }
            self.record.add(&found)?;
            done.push(found);
            (self.solved)();
        }
        Ok(done)
    }

    fn solve(&self, solver: &mut Solver<'_>, press: &Indentation) -> SceneRecord {
        let began_s = processor::thread_s();
        let (pose, offset_mm) = (press.pose, press.offset_mm);
        let approach = Approach { pose, offset_mm, ..self.approaches[press.candidate].clone() };
        let drive = Drive::Depths(press.depths_mm.clone());
        let vertices = self.body.patch.as_ref().map_or(0, |p| p.patch.skin.len());
        let keep = &mut |_: usize, _: &Solver<'_>, r: &IncrementRecord, s: &StepReport| {
            (fault(r, vertices), r.checks.j_min, s.effort)
        };
        let solved = catch_unwind(AssertUnwindSafe(|| {
            self.body.press_balanced(solver, &approach, &drive, BALANCE_RELATIVE_MAX, keep)
        }));
        let (mut iterations, mut cuts, mut j_min) = (0, 0, None);
        let ending = match solved {
            Err(panic) => Ending::Panicked(panic_text(panic.as_ref()).into()),
            Ok((kept, pressed)) => {
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
            seconds: processor::thread_s() - began_s,
        }
    }
}

//! The fidelity levels of the ladder that are finite elements themselves: the same held-out
//! indentations solved on coarser meshes, with other elements and at small strain, beside a
//! reference.
//!
//! Every field is read at the vertices of one atlas ([`Ladder::atlas`]), whatever mesh it
//! was solved on, and every state has its price in processor seconds. In prose:
//! `docs/reports/fe-rungs.md`.

mod assemble;
mod error;
mod report;
mod solve;
mod store;
#[cfg(test)]
mod tests;

pub use error::FidelityError;
pub use report::{DiscretisationError, LeftOut, LevelEntry, Quantiles, Report, StateEntry};

use papilla_fingertip::campaign::{CampaignSpec, Indentation, Slice, held_out, indentations};
use papilla_fingertip::mesh::fingertip::{Density, Order};
use serde::{Deserialize, Serialize};
use solve::{Prepared, Target};
use std::path::Path;
use store::Store;

/// Large or infinitesimal strain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strain {
    /// Linear kinematics and Hooke's law.
    Small,
    /// Finite strain.
    Finite,
}

/// One way of solving an indentation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FidelityLevel {
    /// Mesh density.
    pub density: Density,
    /// Order of the elements.
    pub order: Order,
    /// Strain.
    pub kinematics: Strain,
}

impl FidelityLevel {
    /// A fidelity level.
    #[must_use]
    pub const fn new(density: Density, order: Order, kinematics: Strain) -> Self {
        Self { density, order, kinematics }
    }

    /// Name, such as `fe-medium-linear-finite`.
    #[must_use]
    pub fn name(&self) -> String {
        let density = match self.density {
            Density::Coarse => "coarse",
            Density::Medium => "medium",
            Density::Fine => "fine",
        };
        let order = match self.order {
            Order::Linear => "linear",
            Order::Quadratic => "quadratic",
            Order::Graded => "graded",
        };
        let strain = match self.kinematics {
            Strain::Small => "small",
            Strain::Finite => "finite",
        };
        format!("fe-{density}-{order}-{strain}")
    }
}

/// What is measured against what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ladder {
    /// Density whose atlas every field is read on.
    pub atlas: Density,
    /// Fidelity levels, cheap ones first.
    pub levels: Vec<FidelityLevel>,
    /// What they are compared with.
    pub reference: FidelityLevel,
    /// A still better one for a few indentations, to tell the reference's own error.
    pub check: Option<FidelityLevel>,
    /// How many indentations it solves.
    pub checked: usize,
}

impl Ladder {
    /// Coarse and medium meshes, linear and quadratic elements, small and finite strain,
    /// against linear elements on the fine mesh; `checked` indentations also by quadratic
    /// elements on the fine mesh.
    #[must_use]
    pub fn usual(checked: usize) -> Self {
        use Strain::{Finite, Small};
        let mut levels = Vec::new();
        for density in [Density::Coarse, Density::Medium] {
            for order in [Order::Linear, Order::Quadratic] {
                levels.extend(
                    [Small, Finite].map(|strain| FidelityLevel::new(density, order, strain)),
                );
            }
        }
        Self {
            atlas: Density::Medium,
            levels,
            reference: FidelityLevel::new(Density::Fine, Order::Linear, Finite),
            check: Some(FidelityLevel::new(Density::Fine, Order::Quadratic, Finite)),
            checked,
        }
    }

    /// Every fidelity level in the order of solving, with the number of indentations it solves.
    fn all(&self, indentations: usize) -> Vec<(FidelityLevel, usize)> {
        let mut all: Vec<_> = self.levels.iter().map(|&r| (r, indentations)).collect();
        all.push((self.reference, indentations));
        all.extend(
            self.check.filter(|_| self.checked > 0).map(|r| (r, self.checked.min(indentations))),
        );
        all
    }
}

/// How far a measurement is: what is solved now, and parts done of all.
pub type Progress<'a> = &'a mut dyn FnMut(&str, usize, usize);

/// Solves a slice of `count` held-out indentations of a campaign by every fidelity level, or goes
/// on where an earlier run was stopped. Any number of slices may share `folder`; the slice of all
/// writes `rungs.json` and one npz a fidelity level into it.
///
/// # Errors
/// [`FidelityError`]; single indentations that fail are in the report.
pub fn run(
    spec: &CampaignSpec,
    ladder: &Ladder,
    (count, slice): (usize, Slice),
    folder: &Path,
    progress: Progress<'_>,
) -> Result<Option<Report>, FidelityError> {
    spec.validate()?;
    let chosen = choose(spec, count)?;
    let target = Target::new(spec, ladder.atlas)?;
    let store = Store::open(folder, spec, &target.atlas_hash, target.vertices())?;
    let plan = ladder.all(chosen.len());
    let planned: usize = plan.iter().map(|(_, n)| n).sum();
    let all = (0..planned).filter(|&k| slice.takes(k)).count();
    let (mut parts, mut done, mut places) = (Vec::new(), 0, 0..);
    for (level, presses) in plan {
        let name = level.name();
        let mut prepared = None;
        let mut of_level = Vec::new();
        for (press, place) in chosen[..presses].iter().zip(&mut places) {
            if !slice.takes(place) {
                continue;
            }
            progress(&format!("{name}, indentation {}", press.id), done, all);
            let part = match store.load(&name, press) {
                Some(part) => part,
                None => {
                    let ready = match prepared.take() {
                        Some(ready) => ready,
                        None => Prepared::new(spec, level, &target)?,
                    };
                    let part = ready.part(spec, press, &target)?;
                    prepared = Some(ready);
                    store.write(&name, &part)?;
                    part
                }
            };
            of_level.push(part);
            done += 1;
        }
        parts.push((level, of_level));
    }
    if !slice.is_whole() {
        return Ok(None);
    }
    progress("assembling", done, all);
    store.remove_partial()?;
    assemble::assemble(spec, ladder, &target, &parts, folder).map(Some)
}

/// Held-out indentations, as many different indenters as possible: in the order of their ids,
/// always one of the indenters that had the fewest.
fn choose(spec: &CampaignSpec, count: usize) -> Result<Vec<Indentation>, FidelityError> {
    let test = held_out(spec).test;
    let found = test.len();
    if count == 0 || found < count {
        let campaign = spec.name.clone();
        return Err(FidelityError::TooFew { campaign, found, wanted: count });
    }
    let all = indentations(spec);
    let mut left: Vec<&Indentation> = test.iter().map(|&id| &all[id]).collect();
    let mut had = vec![0usize; spec.candidates().len()];
    let mut chosen = Vec::with_capacity(count);
    for _ in 0..count {
        let Some(next) = (0..left.len()).min_by_key(|&i| (had[left[i].candidate], i)) else {
            break;
        };
        let press = left.remove(next);
        had[press.candidate] += 1;
        chosen.push(press.clone());
    }
    Ok(chosen)
}

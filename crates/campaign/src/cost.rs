//! What a campaign costs: the time and memory that each task of a cluster job needs.

use papilla_fingertip::campaign::{CampaignSpec, Candidate, Indentation, indentations};
use papilla_fingertip::forecast::{Forecast, SedError};
use papilla_fingertip::mesh::fingertip::Order;
use papilla_fingertip::run::BETTER;
use papilla_fingertip::simulation::{Simulation, body::SimulationError};
use serde::Serialize;
use std::time::Instant;

/// One of the campaign's indenters, by its deepest indentation.
#[derive(Debug, Serialize)]
struct IndenterCost {
    indenter: String,
    /// What was done to its meshes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mended: Vec<String>,
    presses: usize,
    unknowns: usize,
    /// With the factorization of an indefinite tangent.
    memory_bytes: usize,
    /// Of one indentation on one core, its mesh included where each has its own.
    seconds: f64,
}

/// What a campaign is going to cost.
#[derive(Debug, Serialize)]
pub struct CampaignCost {
    campaign: String,
    presses: usize,
    states: usize,
    /// Of an indentation, the largest.
    memory_bytes: usize,
    /// Of an indentation on one core.
    seconds_mean: f64,
    seconds_max: f64,
    core_hours: f64,
    indenters: Vec<IndenterCost>,
    /// Error of SED at the interface on the campaign's mesh, relative L2, and where it was measured.
    sed_error: Option<(SedError, &'static str)>,
    /// Those that would fail, of the deepest of each indenter down to the first that would not.
    refused: Vec<Refused>,
}

/// An indentation that would fail before anything is solved.
#[derive(Debug, Serialize)]
struct Refused {
    press: usize,
    indenter: String,
    reason: String,
}

impl CampaignCost {
    /// Of a campaign: of each indenter, its deepest indentation is set up; nothing is solved.
    ///
    /// # Errors
    /// As [`Simulation::new`], where no indentation of any indenter can be set up.
    pub fn of(spec: &CampaignSpec) -> Result<Self, SimulationError> {
        let planned = indentations(spec);
        let (mut indenters, mut refused, mut first_error) = (Vec::new(), Vec::new(), None);
        for (k, candidate) in spec.candidates().iter().enumerate() {
            let mut own: Vec<&Indentation> = planned.iter().filter(|p| p.candidate == k).collect();
            own.sort_by(|a, b| b.deepest_mm().total_cmp(&a.deepest_mm()));
            // The deepest that the mesh can resolve.
            for press in &own {
                match cost(spec, candidate, press) {
                    Ok(cost) => {
                        indenters.push(IndenterCost { presses: own.len(), ..cost });
                        break;
                    }
                    Err(error) => {
                        let (indenter, reason) = (candidate.name.clone(), error.to_string());
                        refused.push(Refused { press: press.id, indenter, reason });
                        first_error.get_or_insert(error);
                    }
                }
            }
        }
        if let (true, Some(error)) = (indenters.is_empty(), first_error) {
            return Err(error);
        }
        let total_s: f64 = indenters.iter().map(|i| i.presses as f64 * i.seconds).sum();
        Ok(Self {
            campaign: spec.name.clone(),
            presses: planned.len(),
            states: spec.samples(),
            memory_bytes: indenters.iter().map(|i| i.memory_bytes).max().unwrap_or_default(),
            seconds_mean: total_s / planned.len().max(1) as f64,
            seconds_max: indenters.iter().map(|i| i.seconds).fold(0.0, f64::max),
            core_hours: total_s / 3600.0,
            sed_error: spec
                .candidates()
                .first()
                .and_then(|c| SedError::of(&spec.scene(c).geometry)),
            indenters,
            refused,
        })
    }

    /// For people.
    pub fn human(&self) -> String {
        let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        let mut text = format!(
            "campaign {}: {} indentations, {} states\n  {:<24} presses   unknowns   MiB   s each\n",
            self.campaign, self.presses, self.states, "indenter"
        );
        for i in &self.indenters {
            text += &format!(
                "  {:<24} {:7} {:10} {:5.0} {:8.1}\n",
                i.indenter,
                i.presses,
                i.unknowns,
                mib(i.memory_bytes),
                i.seconds
            );
            text += &i.mended.iter().map(|done| format!("    {done}\n")).collect::<String>();
        }
        for Refused { press, indenter, reason } in &self.refused {
            text += &format!("  will fail: indentation {press} ({indenter}): {reason}\n");
        }
        text += &format!(
            "an indentation takes {:.0} MiB at most and about {:.1} s of one core; all {:.1} core hours",
            mib(self.memory_bytes),
            self.seconds_mean,
            self.core_hours
        );
        if let Some((error, source)) = self.sed_error {
            text += &format!("\nerror of SED: {} ({source})", error.words());
            if !error.is_small() {
                text += &format!("; {BETTER} it is small");
            }
        }
        text
    }
}

/// What an indentation costs.
fn cost(
    spec: &CampaignSpec,
    candidate: &Candidate,
    press: &Indentation,
) -> Result<IndenterCost, SimulationError> {
    let mut scene = spec.scene(candidate);
    scene.motion = press.motion();
    let clock = Instant::now();
    let setup = Simulation::new(&scene)?;
    let setup_s = clock.elapsed().as_secs_f64();
    let forecast = Forecast::new(&scene, &setup);
    let own_mesh_s = if spec.order == Order::Graded { setup_s } else { 0.0 };
    Ok(IndenterCost {
        indenter: candidate.name.clone(),
        mended: setup.approach.shape.mended(),
        presses: 1,
        unknowns: forecast.census.unknowns,
        memory_bytes: forecast.memory_bytes + forecast.memory_indefinite_bytes,
        seconds: forecast.seconds.total + own_mesh_s,
    })
}

//! One body pressed in both codes.

use super::limit::{LimitFace, limit_faces};
use super::ours::{Cards, laws, sed_mpa};
use super::{Check, Context, SOURCE};
use crate::calculix::Quantity;
use papilla_calculix::deck::{BODY, ELEMENTS, INDENTER};
use papilla_calculix::{Deck, ElementTypes, Indentation, RigidIndenter, StepControl};
use papilla_fem::contact::ContactRule;
use papilla_fem::mesh::Mesh;
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem, Solver};
use papilla_fingertip::simulation::record::relative_l2;
use papilla_fingertip::tissue::Tissue;
use papilla_processor::thread_s;
use papilla_sdf::SignedDistance;
use papilla_validation::verify::CaseError;
use std::sync::Arc;

/// A body, what presses on it, and how far both codes may be apart.
pub(super) struct Pressing<'a> {
    /// Name of CalculiX' files.
    pub job: &'a str,
    /// What the rows are called.
    pub name: &'a str,
    pub mesh: Mesh,
    pub cards: Cards,
    pub fixed: Vec<bool>,
    /// Surface that may be touched.
    pub contact: &'a str,
    /// The indenter for CalculiX; its shape for our solver.
    pub indenter: RigidIndenter,
    pub shape: Arc<dyn SignedDistance>,
    /// Where our solver's contact acts.
    pub rule: ContactRule,
    pub types: ElementTypes,
    /// SED is compared in the elements of the first tissue beside the second.
    pub interface: [Tissue; 2],
    /// Equal steps that our solver is led through; it takes more where it must.
    pub steps: u32,
    /// CalculiX' first increment.
    pub first: f64,
    pub tolerance: Tolerance,
    /// Most of CalculiX' CPU time that ours may take.
    pub cpu_share: f64,
}

/// Largest relative differences.
#[derive(Clone, Copy)]
pub(super) struct Tolerance {
    pub force: f64,
    /// Norm over all nodes.
    pub displacement: f64,
    /// Peak, and norm over all points beside the interface.
    pub sed: f64,
    /// Peak and norm, by area, of SED's limit at the interface; `None`: not compared.
    pub limit: Option<f64>,
}

/// Most of CalculiX' CPU time that an indentation on equal unknowns may take.
pub(super) const CPU_SHARE: f64 = 0.1;

/// What a code found.
struct Answer {
    force_n: f64,
    /// At the nodes that CalculiX has; 0 elsewhere.
    displacement_mm: Vec<[f64; 3]>,
    /// By element of the mesh and printed point.
    sed_mpa: Vec<Vec<f64>>,
    cpu_s: Option<f64>,
}

impl Pressing<'_> {
    /// Solves it in both codes. CPU time is compared on full meshes only. What
    /// does not end well in one of them is one row that fails.
    pub(super) fn rows(self, context: &Context<'_>) -> Vec<Check> {
        let name = self.name;
        self.compare(context).unwrap_or_else(|e| {
            let error: CaseError = format!("{name}: {e}").into();
            vec![Check::failed(error.as_ref())]
        })
    }

    fn compare(self, context: &Context<'_>) -> Result<Vec<Check>, CaseError> {
        let theirs = self.calculix(context)?;
        let beside = beside(&self.mesh, self.interface);
        let faces = match self.tolerance.limit {
            Some(_) => limit_faces(&self.mesh, self.types, self.interface),
            None => Vec::new(),
        };
        let (name, tolerance, cpu_share) = (self.name, self.tolerance, self.cpu_share);
        let [side, _] = self.interface.map(Tissue::name);
        let ours = self.solver()?;
        let row = |what: &str| format!("{name}: {what}");
        let of = |a: &Answer| -> Vec<f64> {
            beside.iter().flat_map(|&e| a.sed_mpa[e].iter().copied()).collect()
        };
        let (sed, their_sed) = (of(&ours), of(&theirs));
        let peak = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        let u =
            relative_l2(ours.displacement_mm.as_flattened(), theirs.displacement_mm.as_flattened());
        let mut rows = vec![
            Check::relative(row("force, N"), ours.force_n, theirs.force_n, tolerance.force, SOURCE),
            Check::vanishes(row("displacement, L2"), u, tolerance.displacement, SOURCE),
            Check::relative(
                row(&format!("peak SED of {side} at the interface, MPa")),
                peak(&sed),
                peak(&their_sed),
                tolerance.sed,
                SOURCE,
            ),
            Check::vanishes(
                row(&format!("SED of {side} at the interface, L2")),
                relative_l2(&sed, &their_sed),
                tolerance.sed,
                SOURCE,
            ),
        ];
        if let Some(limit) = tolerance.limit {
            rows.extend(limit_rows(name, side, &faces, [&ours, &theirs], limit));
        }
        if let (Some(a), Some(b), false) = (ours.cpu_s, theirs.cpu_s, context.quick) {
            let quantity = row(&format!("CPU s, {a:.2} over {b:.1}"));
            rows.push(Check::within(quantity, a / b, [0.0, cpu_share], SOURCE));
        }
        Ok(rows)
    }

    fn calculix(&self, context: &Context<'_>) -> Result<Answer, CaseError> {
        let deck = Deck {
            title: self.job,
            mesh: &self.mesh,
            materials: &self.cards,
            fixed: &self.fixed,
            prescribed_mm: &[],
            press: Some(Indentation {
                contact: self.contact,
                indenter: self.indenter.clone(),
                stiffness_mpa_per_mm: None,
            }),
            types: self.types,
            step: StepControl { first: self.first, ..StepControl::default() },
        };
        let run = context.ccx.run(context.folder, self.job, &deck.to_text()?)?;
        let total = &run.dat.table(Quantity::TotalForce, INDENTER, 1.0)?.rows;
        let mut displacement_mm = vec![[0.0; 3]; self.mesh.nodes.len()];
        for row in &run.dat.table(Quantity::Displacement, BODY, 1.0)?.rows {
            displacement_mm[row.id - 1].copy_from_slice(&row.values[..3]);
        }
        let blocks = &self.mesh.blocks;
        let region: Vec<_> = blocks.iter().flat_map(|b| b.region.iter().copied()).collect();
        let mut sed_mpa = vec![Vec::new(); region.len()];
        for row in &run.dat.table(Quantity::Strain, ELEMENTS, 1.0)?.rows {
            if let Some(card) = &self.cards[region[row.id - 1].index()] {
                sed_mpa[row.id - 1].push(card.energy_mpa(&row.values));
            }
        }
        let along = self.pressing_axis();
        let force_n =
            total.first().map_or(f64::NAN, |r| (0..3).map(|i| r.values[i] * along[i]).sum());
        Ok(Answer { force_n, displacement_mm, sed_mpa, cpu_s: run.cpu_s })
    }

    /// The indenter's own +z in the world. Forces across it belong to planes of symmetry.
    fn pressing_axis(&self) -> [f64; 3] {
        self.indenter.start.rotation.map(|row| row[2])
    }

    fn solver(self) -> Result<Answer, CaseError> {
        let along = self.pressing_axis();
        let begun_s = thread_s();
        let problem = Problem::new(self.mesh, laws(&self.cards)?, self.fixed, Some(self.contact))?;
        let RigidIndenter { start, path, .. } = self.indenter;
        let along_path = MovingIndenter::along(self.shape, start, path);
        let indenter = MovingIndenter { contact: self.rule, ..along_path };
        let mut solver = Solver::new(&problem, Options::default())?;
        solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
        for step in 1..=self.steps {
            solver.advance_to(f64::from(step) / f64::from(self.steps))?;
        }
        let u = solver.displacement_mm();
        let sed_mpa = sed_mpa(&problem, self.types, u)?;
        let cpu_s = Some(thread_s() - begun_s);
        let force = solver.balance().contact_force_n;
        let force_n = (0..3).map(|i| force[i] * along[i]).sum();
        let mut displacement_mm = vec![[0.0; 3]; u.len()];
        for block in &problem.mesh.blocks {
            for e in 0..block.len() {
                for &n in &block.element(e)[..self.types.of(block.kind).nodes] {
                    displacement_mm[n as usize] = u[n as usize];
                }
            }
        }
        Ok(Answer { force_n, displacement_mm, sed_mpa, cpu_s })
    }
}

/// Rows of SED's limit at the interface, from what both codes have at the same points.
fn limit_rows(
    name: &str,
    side: &str,
    faces: &[LimitFace],
    answers: [&Answer; 2],
    tolerance: f64,
) -> [Check; 2] {
    // Norms weigh with the area, peaks do not.
    let [(ours, ours_by_area), (theirs, theirs_by_area)] = answers.map(|a| {
        let at = |f: &LimitFace| {
            let root = f.point_mm2.sqrt();
            f.values(&a.sed_mpa[f.element]).into_iter().map(move |v| (v, v * root))
        };
        faces.iter().flat_map(at).unzip::<f64, f64, Vec<_>, Vec<_>>()
    });
    let peak = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    let row = |what: &str| format!("{name}: {what} SED of {side} at the interface");
    let norm = relative_l2(&ours_by_area, &theirs_by_area);
    [
        Check::relative(
            format!("{}, MPa", row("peak of the limit of")),
            peak(&ours),
            peak(&theirs),
            tolerance,
            SOURCE,
        ),
        Check::vanishes(format!("{}, L2", row("limit of")), norm, tolerance, SOURCE),
    ]
}

/// Elements of the first tissue that share a node with the second.
fn beside(mesh: &Mesh, [side, other]: [Tissue; 2]) -> Vec<usize> {
    let elements = || {
        mesh.blocks
            .iter()
            .flat_map(|b| (0..b.len()).map(move |e| (Tissue::of(b.region[e]), b.element(e))))
    };
    let mut shared = vec![false; mesh.nodes.len()];
    for (_, nodes) in elements().filter(|(tissue, _)| *tissue == other) {
        nodes.iter().for_each(|&n| shared[n as usize] = true);
    }
    let touches = |nodes: &[u32]| nodes.iter().any(|&n| shared[n as usize]);
    elements()
        .enumerate()
        .filter(|(_, (tissue, nodes))| *tissue == side && touches(nodes))
        .map(|(number, _)| number)
        .collect()
}

//! The input deck: mesh, materials, supports, rigid indenter, contact, one step.

use super::elements::{element_faces, takes_node_contact};
use super::hanging::{Followers, followers, position_mm, write_equations};
use super::lines::{write_element, write_node, write_set};
use super::rigid::RigidMesh;
use super::{ElementTypes, ExportError, MaterialCard, RigidIndenter, number};
use papilla_fem::mesh::Mesh;
use papilla_fingertip::tissue::Tissue;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Set of all nodes of the body, whose displacements are printed.
pub const BODY: &str = "NBODY";
/// Set of the indenter's nodes, whose total reaction is printed.
pub const INDENTER: &str = "NINDENTER";
/// Set of the held nodes, whose reactions and their total are printed.
pub const HELD: &str = "NHELD";
/// Set of the body's elements, of which strain and stress are printed.
pub const ELEMENTS: &str = "EBODY";

/// A body, what it is made of, how it is held and what happens to it.
#[derive(Clone, Debug)]
pub struct Deck<'a> {
    /// First comment line.
    pub title: &'a str,
    /// Mesh of the undeformed body. Its node `n` is CalculiX' node `n + 1`, its
    /// elements are numbered from 1 through the blocks.
    pub mesh: &'a Mesh,
    /// Material by [`Tissue::index`]; `None` where no element is made of it.
    pub materials: &'a [Option<MaterialCard>; Tissue::ALL.len()],
    /// Prescribed degrees of freedom, `3 node + component`.
    pub fixed: &'a [bool],
    /// Their values at the end of the step, mm; the others stay 0.
    pub prescribed_mm: &'a [(usize, f64)],
    /// What presses on the body.
    pub press: Option<Indentation<'a>>,
    /// CalculiX types of our elements.
    pub types: ElementTypes,
    /// Increments and output.
    pub step: StepControl,
}

/// Contact with a rigid indenter.
#[derive(Clone, Debug)]
pub struct Indentation<'a> {
    /// Surface of the mesh that may touch.
    pub contact: &'a str,
    /// What touches it.
    pub indenter: RigidIndenter,
    /// Pressure per overlap, MPa/mm. `None`: 10 000 times (face-to-face contact,
    /// which does not settle with more: 1000 times) the stiffest shear modulus
    /// over the mean edge of a contact face.
    pub stiffness_mpa_per_mm: Option<f64>,
}

/// Increments, tolerances and output of the step; load fractions run from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct StepControl {
    /// First increment.
    pub first: f64,
    /// Largest increment.
    pub largest: f64,
    /// Load fractions at which results are printed; only the end if empty.
    pub outputs: Vec<f64>,
    /// Largest residual over the mean force at which CalculiX stops iterating;
    /// its own default is 5e-3.
    pub residual_tolerance: f64,
}

impl Default for StepControl {
    fn default() -> Self {
        Self { first: 0.05, largest: 1.0, outputs: Vec::new(), residual_tolerance: 1e-5 }
    }
}

impl Deck<'_> {
    /// The deck as CalculiX reads it.
    ///
    /// # Errors
    /// [`ExportError`] for what CalculiX cannot express, before anything is written.
    pub fn to_text(&self) -> Result<String, ExportError> {
        let mut out = format!(
            "** {}\n** Units: mm, N, MPa. Written by fe-datagen for CalculiX 2.20.\n",
            self.title.replace('\n', " ")
        );
        let uses = |name| self.mesh.blocks.iter().any(|b| self.types.of(b.kind).name == name);
        if !self.is_nonlinear() && uses("CPE8R") {
            return Err(ExportError::ZeroEnergy);
        }
        let nodes = self.nodes();
        let followers = followers(self.mesh, self.types, &nodes)?;
        let follows = |dof: &usize| followers.contains_key(&((dof / 3) as u32));
        if let Some(dof) = self.prescribed_mm.iter().map(|(dof, _)| *dof).find(follows) {
            return Err(ExportError::HangingPrescribed { node: dof / 3 + 1 });
        }
        self.body(&nodes, &followers, &mut out);
        write_equations(&followers, &mut out);
        self.sections(&mut out)?;
        self.supports(&nodes, &followers, &mut out);
        let rigid = self.press.as_ref().map(|p| p.indenter.mesh()).transpose()?;
        if let (Some(press), Some(rigid)) = (&self.press, &rigid) {
            self.indenter(rigid, &mut out);
            self.contact(press, &mut out)?;
        }
        self.amplitudes(&mut out);
        self.step(&nodes, &mut out);
        Ok(out)
    }

    /// Nodes that CalculiX' elements use, from 0, in order. `Hex27` loses those
    /// on faces and in the middle.
    #[must_use]
    pub fn nodes(&self) -> Vec<u32> {
        let mut used = vec![false; self.mesh.nodes.len()];
        for block in &self.mesh.blocks {
            let taken = self.types.of(block.kind).nodes;
            for e in 0..block.len() {
                for &n in &block.element(e)[..taken] {
                    used[n as usize] = true;
                }
            }
        }
        (0..used.len() as u32).filter(|&n| used[n as usize]).collect()
    }

    fn body(&self, nodes: &[u32], followers: &Followers, out: &mut String) {
        let _ = writeln!(out, "*NODE, NSET={BODY}");
        for n in nodes {
            let at = match followers.get(n) {
                Some(terms) => position_mm(self.mesh, terms),
                None => self.mesh.nodes[*n as usize],
            };
            write_node(out, *n as usize + 1, at);
        }
        let mut number = 0;
        for block in &self.mesh.blocks {
            let ccx = self.types.of(block.kind);
            let mut by_tissue: BTreeMap<Tissue, Vec<usize>> = BTreeMap::new();
            for (e, &region) in block.region.iter().enumerate() {
                by_tissue.entry(Tissue::of(region)).or_default().push(e);
            }
            for (tissue, elements) in by_tissue {
                let _ = writeln!(out, "*ELEMENT, TYPE={}, ELSET={}", ccx.name, set_of(tissue));
                for e in elements {
                    let nodes = &block.element(e)[..ccx.nodes];
                    write_element(out, number + e + 1, nodes.iter().map(|&n| n as usize + 1));
                }
            }
            number += block.len();
        }
        let _ = writeln!(out, "*ELSET, ELSET={ELEMENTS}");
        for tissue in self.tissues() {
            let _ = writeln!(out, "{}", set_of(tissue));
        }
    }

    /// Tissues that elements are made of.
    fn tissues(&self) -> Vec<Tissue> {
        let used = |t: &Tissue| self.mesh.blocks.iter().any(|b| b.region.contains(&t.region()));
        Tissue::ALL.into_iter().filter(used).collect()
    }

    fn sections(&self, out: &mut String) -> Result<(), ExportError> {
        for tissue in self.tissues() {
            let name = tissue.name();
            let card = self.materials[tissue.index()]
                .as_ref()
                .ok_or(ExportError::NoMaterial { tissue: name })?;
            card.check(name)?;
            let material = name.to_uppercase();
            let _ = write!(out, "*MATERIAL, NAME={material}\n{}", card.cards());
            let _ = writeln!(out, "*SOLID SECTION, ELSET={}, MATERIAL={material}", set_of(tissue));
            if self.mesh.is_planar() {
                // Thickness, mm: forces are per mm of length, as ours.
                out.push_str("1.\n");
            }
        }
        Ok(())
    }

    /// What is held. A node that follows others does so there too, as in our solver.
    fn supports(&self, nodes: &[u32], followers: &Followers, out: &mut String) {
        let mut held = Vec::new();
        let mut boundary = String::new();
        // Plane strain holds the third one itself.
        let components = if self.mesh.is_planar() { 2 } else { 3 };
        for &n in nodes.iter().filter(|n| !followers.contains_key(n)) {
            let dofs = &self.fixed[3 * n as usize..3 * n as usize + components];
            for (i, _) in dofs.iter().enumerate().filter(|(_, fixed)| **fixed) {
                let _ = writeln!(boundary, "{},{},{}", n + 1, i + 1, i + 1);
            }
            if dofs.contains(&true) {
                held.push(n as usize + 1);
            }
        }
        if !held.is_empty() {
            write_set(out, HELD, &held);
            let _ = write!(out, "*BOUNDARY\n{boundary}");
        }
    }

    fn indenter(&self, rigid: &RigidMesh, out: &mut String) {
        let first_node = self.mesh.nodes.len() + 1;
        let first_element = self.mesh.element_count() + 1;
        let _ = writeln!(out, "*NODE, NSET={INDENTER}");
        for (i, &p) in rigid.nodes.iter().enumerate() {
            write_node(out, first_node + i, p);
        }
        out.push_str("*ELEMENT, TYPE=C3D20, ELSET=EINDENTER\n");
        for (e, nodes) in rigid.bricks.iter().enumerate() {
            write_element(out, first_element + e, nodes.iter().map(|&n| n as usize + first_node));
        }
        // It cannot deform, as all its nodes move alike; its stiffness is not used.
        out.push_str("*MATERIAL, NAME=INDENTER\n*ELASTIC\n1.,0.\n");
        out.push_str("*SOLID SECTION, ELSET=EINDENTER, MATERIAL=INDENTER\n");
        out.push_str("*SURFACE, NAME=PRESSING, TYPE=ELEMENT\nEINDENTER,S2\n");
    }

    fn contact(&self, press: &Indentation<'_>, out: &mut String) -> Result<(), ExportError> {
        let name = press.contact;
        let surface = self.mesh.surfaces.get(name).ok_or_else(|| ExportError::NoSurface {
            name: name.into(),
            known: self.mesh.surfaces.keys().cloned().collect::<Vec<_>>().join(", "),
        })?;
        let faces = element_faces(self.mesh, self.types, surface)
            .map_err(|nodes| ExportError::LooseFace { name: name.into(), nodes })?;
        out.push_str("*SURFACE, NAME=TOUCHED, TYPE=ELEMENT\n");
        for (element, face) in &faces {
            let _ = writeln!(out, "{element},S{face}");
        }
        let mu = self.shear_modulus_mpa();
        let node_contact = takes_node_contact(surface.kind);
        let stiffness = press.stiffness_mpa_per_mm.unwrap_or_else(|| {
            let mut area = 0.0;
            let rule = surface.kind.quadrature();
            surface.integrate(&rule, &|n| self.mesh.nodes[n as usize], &mut |_, _, normal| {
                area += papilla_vector::norm(normal);
            });
            let mean = area / faces.len().max(1) as f64;
            // The area of an edge is its length.
            let size = if surface.kind.corners() == 2 { mean } else { mean.sqrt() };
            if node_contact { 1e4 * mu / size } else { 1e3 * mu / size }
        });
        let kind = if node_contact { "NODE" } else { "SURFACE" };
        // The second number is the pull on nodes just out of contact (node-to-face only).
        let _ = write!(
            out,
            "*SURFACE INTERACTION, NAME=PRESS\n\
             *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{},{}\n\
             *CONTACT PAIR, INTERACTION=PRESS, TYPE={kind} TO SURFACE\nTOUCHED,PRESSING\n",
            number(stiffness),
            number(1e-4 * mu)
        );
        Ok(())
    }

    /// Stiffest shear modulus at rest of what is soft, MPa.
    fn shear_modulus_mpa(&self) -> f64 {
        let soft = |t: &Tissue| *t != Tissue::Nail && *t != Tissue::Bone;
        let tissues = self.tissues().into_iter().filter(soft);
        let cards = tissues.filter_map(|t| self.materials[t.index()].as_ref());
        cards.map(MaterialCard::shear_modulus_mpa).fold(0.0, f64::max)
    }

    /// Displacement over load fraction of an indenter whose path has corners.
    fn amplitudes(&self, out: &mut String) {
        let Some(press) = self.press.as_ref().filter(|p| p.indenter.path.len() > 1) else { return };
        for i in 0..3 {
            let _ = writeln!(out, "*AMPLITUDE, NAME=ALONG{}\n0.,0.", i + 1);
            for (t, offset) in &press.indenter.path {
                let _ = writeln!(out, "{},{}", number(*t), number(offset[i]));
            }
        }
    }

    fn step(&self, nodes: &[u32], out: &mut String) {
        let StepControl { first, largest, outputs, residual_tolerance } = &self.step;
        let when = if outputs.is_empty() {
            "FREQUENCY=1000000"
        } else {
            out.push_str("*TIME POINTS, NAME=STORED\n");
            for t in outputs {
                let _ = writeln!(out, "{}", number(*t));
            }
            "TIME POINTS=STORED"
        };
        let nonlinear = if self.is_nonlinear() { ", NLGEOM" } else { "" };
        let _ = write!(
            out,
            "*STEP{nonlinear}, INC=100000\n*STATIC\n{},1.,1.E-8,{}\n*CONTROLS, PARAMETERS=FIELD\n{}\n",
            number(*first),
            number(*largest),
            number(*residual_tolerance)
        );
        self.motion(nodes, out);
        let _ = write!(out, "*NODE PRINT, NSET={BODY}, {when}\nU\n");
        if self.fixed.contains(&true) {
            let _ = write!(out, "*NODE PRINT, NSET={HELD}, TOTALS=YES, {when}\nRF\n");
        }
        if self.press.is_some() {
            let _ = write!(out, "*NODE PRINT, NSET={INDENTER}, TOTALS=ONLY, {when}\nRF\n");
            let _ = write!(out, "*CONTACT PRINT, {when}\nCDIS,CSTR\n");
        }
        let _ = write!(out, "*EL PRINT, ELSET={ELEMENTS}, {when}\nE,S\n*END STEP\n");
    }

    /// Whether the step is geometrically nonlinear.
    fn is_nonlinear(&self) -> bool {
        self.tissues()
            .iter()
            .filter_map(|t| self.materials[t.index()].as_ref())
            .any(MaterialCard::is_hyperelastic)
    }

    /// Everything that moves as prescribed, of `nodes`, which the deck has.
    fn motion(&self, nodes: &[u32], out: &mut String) {
        if self.prescribed_mm.is_empty() && self.press.is_none() {
            return;
        }
        out.push_str("*BOUNDARY\n");
        let has = |dof: usize| nodes.binary_search(&((dof / 3) as u32)).is_ok();
        for &(dof, value) in self.prescribed_mm.iter().filter(|(dof, _)| has(*dof)) {
            let _ = writeln!(out, "{},{2},{2},{1}", dof / 3 + 1, number(value), dof % 3 + 1);
        }
        let Some(press) = &self.press else { return };
        if let [(_, travel)] = press.indenter.path[..] {
            for (i, t) in travel.into_iter().enumerate() {
                let _ = writeln!(out, "{INDENTER},{0},{0},{1}", i + 1, number(t));
            }
        } else {
            for i in 1..=3 {
                let _ = writeln!(out, "*BOUNDARY, AMPLITUDE=ALONG{i}\n{INDENTER},{i},{i},1.");
            }
        }
    }
}

fn set_of(tissue: Tissue) -> String {
    format!("E{}", tissue.name().to_uppercase())
}

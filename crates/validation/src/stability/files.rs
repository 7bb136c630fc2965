//! Mesh files with what is wrong with them.

use super::{Line, Suite};
use crate::verify::{CaseError, Check};
use papilla_fem::mesh::gmsh::read;
use papilla_fem::solve::Options;
use papilla_fingertip::scene::Scene;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::tissue::Tissue;
use std::fmt::Write as _;

/// Positions and elements (of one type) of a body of dermis, in MSH 4.1.
struct File {
    nodes: Vec<[f64; 3]>,
    element_type: u32,
    elements: Vec<Vec<usize>>,
    /// Faces of the surfaces `fixed` and `contact`.
    faces: [Vec<Vec<usize>>; 2],
    face_type: u32,
}

impl File {
    /// A column of two unit cubes, held below, touched above.
    fn column() -> Self {
        let mut nodes = Vec::new();
        for z in 0..3 {
            for (x, y) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                nodes.push([f64::from(x), f64::from(y), f64::from(z)]);
            }
        }
        Self {
            nodes,
            element_type: 5,
            elements: vec![(0..8).collect(), (4..12).collect()],
            faces: [vec![vec![0, 3, 2, 1]], vec![vec![8, 9, 10, 11]]],
            face_type: 3,
        }
    }

    fn text(&self) -> String {
        let mut out = String::from(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"fixed\"\n2 2 \"contact\"\n\
             3 1 \"dermis\"\n$EndPhysicalNames\n$Entities\n0 0 2 1\n1 0 0 0 1 1 0 1 1 0\n\
             2 0 0 2 1 1 2 1 2 0\n1 0 0 0 1 1 2 1 1 0\n$EndEntities\n$Nodes\n",
        );
        let n = self.nodes.len();
        let _ = writeln!(out, "1 {n} 1 {n}\n3 1 0 {n}");
        for tag in 1..=n {
            let _ = writeln!(out, "{tag}");
        }
        for [x, y, z] in &self.nodes {
            let _ = writeln!(out, "{x} {y} {z}");
        }
        let faces: usize = self.faces.iter().map(Vec::len).sum();
        let all = faces + self.elements.len();
        let _ = writeln!(out, "$EndNodes\n$Elements\n3 {all} 1 {all}");
        let mut tag = 0;
        let mut block = |out: &mut String, head: String, elements: &[Vec<usize>]| {
            let _ = writeln!(out, "{head} {}", elements.len());
            for nodes in elements {
                tag += 1;
                let list: Vec<_> = nodes.iter().map(|n| (n + 1).to_string()).collect();
                let _ = writeln!(out, "{tag} {}", list.join(" "));
            }
        };
        for (k, faces) in self.faces.iter().enumerate() {
            block(&mut out, format!("2 {} {}", k + 1, self.face_type), faces);
        }
        block(&mut out, format!("3 1 {}", self.element_type), &self.elements);
        out + "$EndElements\n"
    }
}

pub(super) fn run(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = vec![sound()?];
    let mut refused = |variant: &str, file: &File, words: &[&str]| {
        lines.push(Line::refused(
            variant,
            read(&file.text(), &Tissue::ALL.map(Tissue::name)).map(drop),
            words,
        ));
    };
    let mut file = File::column();
    file.elements[1] = vec![8, 9, 10, 11, 4, 5, 6, 7];
    refused("inverted element", &file, &["line ", "element 4 is inverted or flat"]);
    let mut file = File::column();
    file.nodes[8..].iter_mut().for_each(|p| p[2] = 1.0);
    refused("flat element", &file, &["element 4 is ", "times as long as thick"]);
    let mut file = File::column();
    file.elements.push((4..12).collect());
    refused(
        "duplicate element",
        &file,
        &["element 5 has the same corners as element 4", "remove one"],
    );
    let mut file = File::column();
    file.elements.push(vec![5, 6, 7, 4, 9, 10, 11, 8]);
    refused("duplicate element, turned", &file, &["element 5 has the same corners as element 4"]);
    let mut file = File::column();
    file.nodes[8..].iter_mut().for_each(|p| *p = [p[0] + 2000.0 * 1.0, p[1], p[2]]);
    refused("sliver by shear", &file, &["is a sliver", "remesh"]);
    let mut file = File::column();
    file.nodes[8..].iter_mut().for_each(|p| p[2] = 1.0 + 1e-6);
    refused("sliver by thickness", &file, &["times as long as thick"]);
    let mut file = File::column();
    (file.element_type, file.face_type) = (4, 2);
    file.elements = vec![vec![0, 1, 3, 4], vec![1, 3, 4, 6]];
    file.nodes[6] = [0.500_1, 0.5, 0.6];
    file.nodes[4] = [0.5, 0.5, 0.5];
    file.faces = [vec![vec![0, 3, 1]], vec![vec![1, 4, 6]]];
    refused("sliver tetrahedron", &file, &["element 4 is a sliver"]);
    for (factor, unit) in [(1e-3, "was m meant?"), (1e6, "was um meant?")] {
        let mut file = File::column();
        file.nodes.iter_mut().for_each(|p| *p = p.map(|v| v * factor));
        refused(&format!("lengths times {factor:e}"), &file, &[unit, "taken as mm"]);
    }
    lines.extend(loose()?);
    Ok(lines)
}

/// The file that the others spoil is a good one.
fn sound() -> Result<Line, CaseError> {
    let mesh = read(&File::column().text(), &Tissue::ALL.map(Tissue::name))?;
    let count = mesh.element_count() as f64;
    Ok(Line::evaluated(
        "the sound file",
        vec![Check::absolute("elements", count, 2.0, 0.1, "the file")],
    ))
}

/// Parts that are not connected are read (a nail may lie apart) and refused to be solved.
fn loose() -> Result<Vec<Line>, CaseError> {
    let folder = tempfile::tempdir()?;
    let mut lines = Vec::new();
    let mut apart = File::column();
    let beside: Vec<_> = apart.nodes[..8].iter().map(|[x, y, z]| [x + 3.0, *y, *z]).collect();
    apart.nodes.extend(beside);
    apart.elements.push((12..20).collect());
    let mut doubled = File::column();
    let seam: Vec<_> = doubled.nodes[4..8].to_vec();
    doubled.nodes.extend(seam);
    doubled.elements[1] = vec![12, 13, 14, 15, 8, 9, 10, 11];
    for (variant, file, words) in [
        (
            "disconnected part",
            apart,
            ["a part of 1 of the 3 elements", "connected to nothing else"],
        ),
        (
            "unmerged nodes",
            doubled,
            ["4 of its nodes lie on nodes of another part", "Coherence Mesh"],
        ),
    ] {
        std::fs::write(folder.path().join("body.msh"), file.text())?;
        let text = "[geometry]\nkind = \"mesh\"\nfile = \"body.msh\"\nfixed = [\"fixed\"]\n\
                    contact = \"contact\"\n[motion]\ndepth_mm = 0.1\n";
        let scene = Scene::parse(&folder.path().join("scene.toml"), text.into())?;
        let solved =
            Simulation::new(&scene).and_then(|s| s.body.solver(Options::default()).map(drop));
        lines.push(Line::refused(variant, solved, &words));
    }
    Ok(lines)
}

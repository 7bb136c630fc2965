use super::*;
use papilla_fem::element::BlockGeometry;

const KINDS: [ElementKind; 3] = [ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9];

fn all_parts() -> impl Iterator<Item = Parts> {
    [(false, false), (false, true), (true, false), (true, true)]
        .into_iter()
        .map(|(bone, nail)| Parts { bone, nail })
}

fn section(parts: Parts, kind: ElementKind, extent: Extent) -> SectionMesh {
    build(&SectionShape::default(), parts, Density::Coarse, kind, extent).unwrap()
}

fn area_mm2(mesh: &Mesh, wanted: impl Fn(Tissue) -> bool) -> f64 {
    let block = &mesh.blocks[0];
    let geometry = BlockGeometry::new(block.kind, &mesh.nodes, &block.connectivity).unwrap();
    (0..block.len())
        .filter(|&e| wanted(Tissue::of(block.region[e])))
        .map(|e| geometry.element(e).weights.iter().sum::<f64>())
        .sum()
}

/// No element folds, and together they are the ellipse: half of `pi a b`.
#[test]
fn every_combination_fills_the_ellipse() {
    let shape = SectionShape::default();
    let half = |size: [f64; 2]| 0.125 * PI * size[0] * size[1];
    let [skin, bone] = [half([shape.width_mm, shape.height_mm]), half(shape.bone_mm)];
    for parts in all_parts() {
        for kind in KINDS {
            let mesh = section(parts, kind, Extent::Half).mesh;
            let nail = 1.2 * (shape.arc_mm(PI) - shape.arc_mm(shape.nail_angle()));
            let mut expected = skin;
            if !parts.bone {
                expected -= bone;
            }
            let found = area_mm2(&mesh, |_| true);
            // The rigid nail is not meshed: an offset strip, less its inward bend.
            let allowed = if parts.nail { 0.004 * expected } else { 0.15 * nail };
            let missing = if parts.nail { 0.0 } else { nail };
            assert!((found + missing - expected).abs() < allowed, "{parts:?} {kind:?} {found}");
            let of_bone = area_mm2(&mesh, |t| t == Tissue::Bone);
            let all_of_it = if parts.bone { bone } else { 0.0 };
            assert!((of_bone - all_of_it).abs() < 0.01 * bone, "{of_bone}");
        }
    }
}

#[test]
fn the_whole_is_twice_the_half_and_symmetric() {
    for parts in all_parts() {
        for kind in KINDS {
            let half = section(parts, kind, Extent::Half).mesh;
            let SectionMesh { mesh, supports } = section(parts, kind, Extent::Whole);
            let ratio = area_mm2(&mesh, |_| true) / area_mm2(&half, |_| true);
            assert!((ratio - 2.0).abs() < 1e-12, "{parts:?} {kind:?}");
            assert_eq!(mesh.nodes.len() + half.node_sets["symmetry"].len(), 2 * half.nodes.len());
            assert!(!mesh.node_sets.contains_key("symmetry"));
            assert!(supports.iter().all(|(set, _)| mesh.node_sets.contains_key(*set)));
            for name in ["skin", "interface"] {
                let walked = mesh.surfaces[name].walk();
                let x: Vec<f64> = walked.iter().map(|&n| mesh.nodes[n as usize][0]).collect();
                assert_eq!(walked.len(), 2 * half.surfaces[name].walk().len() - 1);
                for (a, b) in x.iter().zip(x.iter().rev()) {
                    assert_eq!((a + b).to_bits(), 0.0f64.to_bits(), "mirror images");
                }
            }
        }
    }
}

/// Skin edges look outward and start at the pad's lowest point; interface nodes
/// lie straight below skin nodes.
#[test]
fn surfaces_are_walked_along_the_skin() {
    let shape = SectionShape::default();
    for kind in KINDS {
        let mesh = section(Parts::default(), kind, Extent::Half).mesh;
        let at = |n: &u32| mesh.nodes[*n as usize];
        let [skin, interface] = ["skin", "interface"].map(|name| mesh.surfaces[name].walk());
        assert_eq!(at(&skin[0]), [0.0, -6.53, 0.0]);
        assert_eq!(skin.len(), interface.len());
        for (s, i) in skin.iter().zip(&interface) {
            let (p, q) = (at(s), at(i));
            let depth = (p[0] - q[0]).hypot(p[1] - q[1]);
            assert!((depth - shape.epidermis_mm).abs() < 1e-12, "{depth}");
        }
        let surface = &mesh.surfaces["skin"];
        surface.integrate(&surface.kind.quadrature(), &|n| at(&n), &mut |face, value, normal| {
            let y: f64 = face.iter().zip(value).map(|(n, v)| v * at(n)[1]).sum();
            assert!(normal[0] > -1e-3 && normal[1] * y > -1e-3, "outward");
        });
    }
}

/// A wedge 0.05 mm wide meets several nodes, and every layer has several elements.
#[test]
fn the_tip_and_the_layers_are_resolved() {
    let shape = SectionShape::default();
    for (density, under_tip, through) in
        [(Density::Coarse, 2, 2), (Density::Medium, 2, 4), (Density::Fine, 3, 8)]
    {
        let kind = ElementKind::Quad9;
        let mesh = build(&shape, Parts::default(), density, kind, Extent::Half).unwrap().mesh;
        let x = |n: u32| mesh.nodes[n as usize][0];
        let skin = mesh.surfaces["skin"].walk();
        let met = skin.iter().filter(|&&n| x(n) <= 0.0251).count();
        assert!(met >= under_tip, "{density:?}: {met} nodes under half the tip");
        for tissue in [Tissue::Epidermis, Tissue::Dermis, Tissue::Subcutaneous] {
            let block = &mesh.blocks[0];
            let first = |e: &usize| block.element(*e).iter().any(|&n| x(n) == 0.0);
            let count = (0..block.len())
                .filter(|&e| block.region[e] == tissue.region())
                .filter(first)
                .count();
            // Columns at the pad and at the nail both touch x = 0.
            assert!(count >= through, "{density:?} {tissue:?}: {count}");
        }
    }
}

#[test]
fn what_moves_is_not_held_and_what_is_held_is_named() {
    let held = |parts| -> Vec<&str> {
        section(parts, ElementKind::Quad9, Extent::Half).supports.iter().map(|s| s.0).collect()
    };
    assert_eq!(held(Parts { bone: false, nail: false }), ["symmetry", "bone", "nail"]);
    assert_eq!(held(Parts { bone: false, nail: true }), ["symmetry", "bone", "nail_centre"]);
    assert_eq!(held(Parts { bone: true, nail: false }), ["symmetry", "nail"]);
    assert_eq!(held(Parts { bone: true, nail: true }), ["symmetry", "nail_centre"]);
    let mesh = section(Parts { bone: true, nail: true }, ElementKind::Quad9, Extent::Half);
    let fixed = mesh.fixed();
    let centre = &mesh.mesh.node_sets["nail_centre"];
    assert!(centre.iter().all(|&n| fixed[3 * n as usize] && fixed[3 * n as usize + 1]));
    let depth = |n: &u32| 6.53 - mesh.mesh.nodes[*n as usize][1];
    let deepest = centre.iter().map(depth).fold(0.0, f64::max);
    assert!((deepest - 1.2).abs() < 1e-12, "through the nail's thickness: {deepest}");
}

#[test]
fn solid_elements_are_refused() {
    let built = build(
        &SectionShape::default(),
        Parts::default(),
        Density::Coarse,
        ElementKind::Hex8,
        Extent::Half,
    );
    assert_eq!(built.unwrap_err(), SectionMeshError::Kind(ElementKind::Hex8));
}

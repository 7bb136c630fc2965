//! What a plan makes of the tissues' constants.

use crate::materials::{MaterialError, MaterialSpec};
use crate::scene::effects::{Law, Plan};
use crate::scene::{TissueError, TissueTable};
use crate::tissue::Tissue;
use papilla_fem::element::{ConstitutiveModel, Elastic, ModelOf, Viscoelastic};
use papilla_fem::solve::Materials;
use papilla_solid::{Isochoric as _, LinearElastic, NeoHookean, Prony};
use std::sync::Arc;

/// Surface of a mesh that is under the tension of the skin.
const SKIN: &str = "skin";

/// The laws that `plan` asks for, and the tension of the skin. A tissue of which the body has no element has
/// one too and costs nothing.
///
/// # Errors
/// [`TissueError`] names the tissue and what is out of range.
pub fn solids(table: &TissueTable, plan: &Plan) -> Result<Materials, TissueError> {
    let solid = |tissue: Tissue| {
        let source = plan.tissues[tissue.index()];
        let refused = |e| TissueError::Material { tissue: source.name(), source: e };
        solid(table.of(source), plan).map_err(refused)
    };
    let models = Tissue::ALL.into_iter().map(solid).collect::<Result<_, _>>()?;
    let materials = Materials::new(models).with_stiff(&Tissue::STIFF);
    Ok(match table.skin_tension_n_per_mm {
        Some(tension) => materials.with_tension(SKIN, tension),
        None => materials,
    })
}

fn solid(spec: &MaterialSpec, plan: &Plan) -> Result<Arc<dyn ConstitutiveModel>, MaterialError> {
    let series = match &spec.prony {
        Some(prony) if plan.relaxes => Some(prony.series()?),
        _ => None,
    };
    let scale = series.map_or(1.0, |(_, scale)| scale);
    if let (Law::Ogden, Some(ogden)) = (plan.law, &spec.ogden) {
        let mut ogden = ogden.clone();
        ogden.mu_mpa.iter_mut().for_each(|mu| *mu *= scale);
        let (law, bulk) = ogden.law()?;
        let bulk = drained(spec, plan, law.shear_modulus_mpa() / scale)?.unwrap_or(bulk / scale);
        return Ok(shared(law, bulk, series));
    }
    let [mu, bulk] = spec.constants().moduli_mpa()?;
    let bulk = drained(spec, plan, mu)?.unwrap_or(bulk);
    let mu_mpa = scale * mu;
    Ok(match plan.law {
        Law::Linear => shared(LinearElastic { mu_mpa }, bulk, series),
        Law::NeoHookean | Law::Ogden => shared(NeoHookean { mu_mpa }, bulk, series),
    })
}

/// Bulk modulus of the solid of a tissue full of fluid, MPa; `None` of any other.
fn drained(spec: &MaterialSpec, plan: &Plan, shear_mpa: f64) -> Result<Option<f64>, MaterialError> {
    let fluid = spec.biphasic.as_ref().filter(|_| plan.fluid.is_some());
    Ok(fluid.map(|f| f.bulk_mpa(shear_mpa)).transpose()?)
}

fn shared<L: ModelOf>(
    law: L,
    bulk_mpa: f64,
    series: Option<(Prony, f64)>,
) -> Arc<dyn ConstitutiveModel> {
    match series {
        Some((prony, _)) => Viscoelastic::shared(law, bulk_mpa, prony),
        None => Elastic::shared(law, bulk_mpa),
    }
}

#[cfg(test)]
mod tests {
    use crate::run::Explanation;
    use crate::scene::Scene;
    use crate::simulation::Simulation;
    use crate::simulation::body::SimulationError;
    use papilla_vector::norm;
    use std::path::Path;

    fn scene(text: &str, tension: &str) -> Scene {
        let tension = match tension {
            "" => String::new(),
            tension => format!("[materials]\nskin_tension_n_per_mm = {tension}\n"),
        };
        Scene::parse(Path::new("tense.toml"), format!("{text}{tension}")).unwrap()
    }

    /// Forces, N, at the stored states, all of which balance; at the last one energy is work, too.
    fn press(text: &str, tension: &str) -> Vec<f64> {
        let (mut forces, mut off) = (Vec::new(), f64::NAN);
        let setup = Simulation::new(&scene(text, tension)).unwrap();
        setup
            .run(&mut |_, record, report| {
                let c = &record.checks;
                println!("{tension} {} mm: {:?} {:?}", record.depth_mm, record.force_n, c);
                assert!(c.residual_relative <= 1e-6 && c.j_min > 0.0, "{tension}: {c:?}");
                assert!(c.plate_vs_support_reaction <= 1e-4, "{tension}: {c:?}");
                println!("{:?}", report.effort);
                off = c.energy_vs_work;
                forces.push(norm(record.force_n));
            })
            .unwrap();
        assert!(off <= 0.005, "{tension}: {off}");
        forces
    }

    const EDGE: &str = r#"effects = ["plane_strain", "finite_strain", "layers"]
        [geometry]
        kind = "section"
        density = "coarse"
        order = "quadratic"
        [indenter]
        shape = "wedge"
        tip_width_mm = 1.0
        base_width_mm = 4.0
        height_mm = 3.0
        tip_radius_mm = 0.3
        [motion]
        depth_mm = 2.0
        increments = 4
    "#;

    /// A hard case: an edge 2 mm deep in the section. Skin under more tension bears more; a tension
    /// of a hundred times people's does not stop the solver, nor does one that is next to nothing.
    #[test]
    fn an_edge_deep_in_tense_skin_finds_its_equilibrium() {
        let found = ["", "0.01", "0.1", "1.0"].map(|tension| press(EDGE, tension));
        for pair in found.windows(2) {
            assert!(pair[0].iter().zip(&pair[1]).all(|(a, b)| b > a), "{found:?}");
        }
        for (slack, nearly) in found[0].iter().zip(press(EDGE, "1e-9")) {
            assert!((nearly / slack - 1.0).abs() < 1e-6, "{slack} {nearly}");
        }
    }

    const SLOW: &str = r#"effects = ["plane_strain", "finite_strain", "layers", "viscoelastic"]
        [geometry]
        kind = "section"
        density = "coarse"
        order = "quadratic"
        [motion]
        path = [{ time_s = 0.5, depth_mm = 1.0 }]
        increments = 16
    "#;

    /// The energy of the skin is counted as stored where tissue relaxes too.
    #[test]
    fn tissue_that_relaxes_below_tense_skin_keeps_its_energy() {
        let [slack, tense] = ["", "0.02"].map(|tension| press(SLOW, tension));
        assert!(tense[15] > slack[15], "{slack:?} {tense:?}");
    }

    /// The mesh that is solved and the coarser one that leads it.
    #[test]
    fn every_body_of_a_scene_has_its_tension() {
        let finger = "[geometry]\nkind = \"fingertip\"\ndensity = \"medium\"\norder = \"graded\"\n\
                      [motion]\ndepth_mm = 0.2\n";
        let setup = Simulation::new(&scene(finger, "0.01")).unwrap();
        let guide = setup.body.guide.as_ref().unwrap();
        for problem in [&setup.body.problem, &guide.body.problem] {
            let faces = problem.mesh.surfaces["skin"].faces().count();
            assert_eq!(problem.tension.as_ref().map(|t| t.len()), Some(faces));
        }
    }

    /// Without a word of it nothing is assembled, and nothing is told.
    #[test]
    fn what_is_told_beforehand_has_the_tension_where_there_is_some() {
        for (tension, tense) in [("", false), ("0.0", false), ("0.01", true)] {
            let scene = scene(EDGE, tension);
            assert_eq!(Simulation::new(&scene).unwrap().body.problem.tension.is_some(), tense);
            let told = Explanation::of(&scene).unwrap().human();
            assert_eq!(told.contains("skin tension"), tense, "{told}");
        }
    }

    /// A mesh of one's own says which of its surfaces is skin.
    #[test]
    fn a_mesh_without_skin_has_no_tension() {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let scene = Scene::read(&scenes.join("two-layer-sphere.toml")).unwrap();
        let mut tense = scene;
        tense.materials.skin_tension_n_per_mm = Some(0.01);
        tense.validate().unwrap();
        let error = Simulation::new(&tense).map(drop).unwrap_err();
        assert!(error.to_string().contains("no tension without a surface 'skin'"), "{error}");
        let field = match error {
            SimulationError::Located(e) => e.error.field(),
            error => error.field(),
        };
        assert_eq!(field.as_deref(), Some("materials.skin_tension_n_per_mm"));
    }
}

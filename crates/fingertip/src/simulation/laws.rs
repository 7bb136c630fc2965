//! What a plan makes of the tissues' constants.

use crate::materials::{MaterialError, MaterialSpec};
use crate::scene::effects::{Law, Plan};
use crate::scene::{TissueError, TissueTable};
use crate::tissue::Tissue;
use papilla_fem::element::{ConstitutiveModel, Elastic, ModelOf, Viscoelastic};
use papilla_fem::solve::Materials;
use papilla_solid::{Isochoric as _, LinearElastic, NeoHookean, Prony};
use std::sync::Arc;

/// The laws that `plan` asks for. A tissue of which the body has no element has
/// one too and costs nothing.
///
/// # Errors
/// [`TissueError`] names the tissue and what is out of range.
pub fn solids(table: &TissueTable, plan: &Plan) -> Result<Materials, TissueError> {
    let solid = |tissue: Tissue| {
        let source = plan.tissues[tissue.index()];
        solid(table.of(source), plan).map_err(|e| TissueError { tissue: source.name(), source: e })
    };
    let models = Tissue::ALL.into_iter().map(solid).collect::<Result<_, _>>()?;
    Ok(Materials::new(models).with_stiff(&Tissue::STIFF))
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

//! The compliance of the undeformed finger: how the skin moves under forces on it.

use super::InfluenceError;
use super::build::{Columns, Load, loads, small_strain_patch, tangent_at_rest};
use crate::simulation::body::Body;

/// Displacement of the skin's vertices under forces at the skin's vertices, to first order.
///
/// It is `K^-1` with the tangent at rest `K`, condensed to the V vertices of the atlas' skin:
/// small strain, whatever the law, since laws agree at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Compliance {
    /// Hash of the atlas whose vertices these are.
    pub atlas_hash: String,
    /// mm per N, `[vertex][component][vertex of the force][component]`, symmetric.
    pub mm_per_n: Vec<f32>,
    /// Area of each vertex, undeformed, mm2.
    pub area_mm2: Vec<f32>,
    /// Outward unit normal of each vertex, undeformed.
    pub normal: Vec<[f32; 3]>,
}

impl Compliance {
    /// Displacement of the skin under forces at some vertices, mm, component by component of
    /// vertex by vertex.
    #[must_use]
    pub fn displacement(&self, load: &[(u32, [f64; 3])]) -> Vec<f64> {
        let size = 3 * self.area_mm2.len();
        let mut moved = vec![0.0; size];
        for (vertex, force) in load {
            for i in 0..3 {
                // Symmetric: a row is a column.
                let row = &self.mm_per_n[(3 * *vertex as usize + i) * size..][..size];
                moved.iter_mut().zip(row).for_each(|(m, c)| *m += force[i] * f64::from(*c));
            }
        }
        moved
    }
}

/// Solves for the compliance of `body`; `progress` is told how many of 3 V systems are done.
///
/// # Errors
/// [`InfluenceError`] for a body that is no fingertip of small strain, or whose systems
/// could not be solved.
pub fn compliance(
    body: &Body,
    progress: &mut dyn FnMut(usize),
) -> Result<Compliance, InfluenceError> {
    let (problem, (patch, atlas)) = (&body.problem, small_strain_patch(body)?);
    let under_pressure = loads(problem, &problem.mesh.surfaces[&body.contact], &patch.skin);
    let unit = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
    let unit_forces: Vec<Load> = under_pressure
        .iter()
        .flat_map(|load| (0..3).map(move |k| Load { force_n: unit(k), ..*load }))
        .collect();
    let tangent = tangent_at_rest(problem)?;
    let mut columns = Columns::new(problem, &tangent, &unit_forces)?;
    columns.solve_all(progress);
    columns.quality()?;
    let outward = |load: &Load| load.force_n.map(|f| (-f / load.area_mm2) as f32);
    Ok(Compliance {
        atlas_hash: atlas.hash().to_owned(),
        mm_per_n: columns.work_mj().iter().map(|w| *w as f32).collect(),
        area_mm2: under_pressure.iter().map(|l| l.area_mm2 as f32).collect(),
        normal: under_pressure.iter().map(outward).collect(),
    })
}

//! Friction over a step: bounds, planes and multipliers between equilibria.

use super::evaluate::Evaluation;
use super::loading::Loading;
use super::problem::Problem;
use crate::contact::FrictionTrial;
use papilla_vector::norm;

/// Sets bound and tangent plane of every point from its normal multiplier and its
/// place at `u`. The bound goes the share `relax` of its way: large coefficients
/// couple pressure and drag so strongly that whole steps swing past the answer.
pub(super) fn bound(
    problem: &Problem,
    loading: &Loading,
    fraction: f64,
    u: &[[f64; 3]],
    multipliers_mpa: &[f64],
    relax: f64,
    friction: &mut FrictionTrial,
) {
    let (Some(surface), Some(indenter)) = (&problem.contact, &loading.indenter) else { return };
    let coefficient = friction.coefficient;
    let points = surface.points(loading.contact());
    for ((point, (support, _)), &pressure) in
        friction.points.iter_mut().zip(points.iter()).zip(multipliers_mpa)
    {
        let x = support.of(|n| std::array::from_fn(|k| problem.mesh.nodes[n][k] + u[n][k]));
        point.bound_mpa += relax * (coefficient * pressure - point.bound_mpa);
        point.normal = indenter.distance(fraction, x).normal;
    }
}

/// Takes the tractions of an equilibrium as multipliers.
pub(super) fn update(friction: &mut FrictionTrial, found: &Evaluation) {
    for (point, &t) in friction.points.iter_mut().zip(&found.friction) {
        point.traction_mpa = t;
    }
}

/// How far bounds, and multipliers unless there are none, are from those that the equilibrium
/// found, over the largest bound.
pub(super) fn change(friction: &FrictionTrial, found: &Evaluation, by_penalty: bool) -> f64 {
    let (mut worst, mut scale) = (0.0f64, 0.0f64);
    for ((point, t), pressure) in
        friction.points.iter().zip(&found.friction).zip(&found.traction_mpa)
    {
        let bound = friction.coefficient * pressure;
        let moved = norm(std::array::from_fn(|i| t[i] - point.traction_mpa[i]));
        let moved = if by_penalty { 0.0 } else { moved };
        worst = worst.max(moved).max((bound - point.bound_mpa).abs());
        scale = scale.max(bound);
    }
    if worst == 0.0 { 0.0 } else { worst / scale }
}

/// Adds the heat of the step, the mean of traction `before` and after it times slip (the trapezoidal
/// rule, as of the indenter's work), and sets every point's place relative to the indenter, from
/// which slip of the next step counts.
pub(super) fn anchor(
    problem: &Problem,
    loading: &Loading,
    fraction: f64,
    u: &[[f64; 3]],
    before: &FrictionTrial,
    friction: &mut FrictionTrial,
) {
    let (Some(surface), Some(indenter)) = (&problem.contact, &loading.indenter) else { return };
    let offset = indenter.offset_mm(fraction);
    let FrictionTrial { points, heat_mj, .. } = friction;
    for ((point, before), (support, area)) in
        points.iter_mut().zip(&before.points).zip(surface.points(loading.contact()).iter())
    {
        let x = support.of(|n| std::array::from_fn(|i| problem.mesh.nodes[n][i] + u[n][i]));
        let place: [f64; 3] = std::array::from_fn(|i| x[i] - offset[i]);
        let [from, to] = [before, &*point].map(|p| p.traction_mpa);
        let slip = |i: usize| place[i] - point.anchor_mm[i];
        *heat_mj += area * (0..3).map(|i| 0.5 * (from[i] + to[i]) * slip(i)).sum::<f64>();
        point.anchor_mm = place;
    }
}

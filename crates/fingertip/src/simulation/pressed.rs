//! A finger under a given pressure, in place of an indenter.

use super::body::{Body, Sides, SimulationError, Under};
use super::drive::Watch;
use super::record::IncrementRecord;
use crate::geometry::fingertip::FingertipShape;
use crate::mesh::fingertip::{Density, FingertipMesh, Order, Parts, build, build_pressed};
use papilla_atlas::PA_PER_MPA;
use papilla_atlas::flatten::build_atlas;
use papilla_atlas::{Atlas, MAP_SIDE_PX, Patch};
use papilla_fem::solve::{
    Effort, Loading, Materials, SolveError, Solver, StepReport, SurfacePressure,
};
use papilla_vector::{dot, minus, norm};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

/// Share of the pressure from one equilibrium to the next.
const STEP_MAX: f64 = 0.125;
/// Farthest from the atlas' flat triangles that a point of the curved skin lies, mm.
const OFF_MM: f64 = 0.4;
/// Side of the boxes in which triangles are looked for, mm.
const BOX_MM: f64 = 1.5;
/// Pressure that counts as an edge beside none, over the greatest.
const EDGE: f64 = 0.02;
/// How far beside a place its pressure is compared, mm: about two pixels.
const BESIDE_MM: f64 = 0.2;

/// A map on the undeformed skin.
struct MapOnSkin<'a> {
    map_pa: &'a [f32],
    /// Corners of each triangle: place, mm, and pixels.
    triangles: Vec<[([f64; 3], [f64; 2]); 3]>,
    boxes: HashMap<[i32; 3], Vec<usize>>,
}

fn box_of(x: [f64; 3]) -> [i32; 3] {
    x.map(|v| (v / BOX_MM).floor() as i32)
}

impl<'a> MapOnSkin<'a> {
    fn new(atlas: &Atlas, map_pa: &'a [f32]) -> Self {
        let skin = atlas.patch(Patch::Skin);
        let corner = |v: u32| {
            let v = v as usize;
            (skin.positions_mm[v].map(f64::from), skin.uv_px[v].map(f64::from))
        };
        let triangles: Vec<_> = atlas.triangles().iter().map(|t| t.map(corner)).collect();
        let mut boxes: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
        for (t, corners) in triangles.iter().enumerate() {
            let of = |i: usize, pick: fn(f64, f64) -> f64| {
                corners.iter().map(|(x, _)| x[i]).reduce(pick).unwrap_or_default()
            };
            let least = box_of(std::array::from_fn(|i| of(i, f64::min) - OFF_MM));
            let most = box_of(std::array::from_fn(|i| of(i, f64::max) + OFF_MM));
            for x in least[0]..=most[0] {
                for y in least[1]..=most[1] {
                    for z in least[2]..=most[2] {
                        boxes.entry([x, y, z]).or_default().push(t);
                    }
                }
            }
        }
        Self { map_pa, triangles, boxes }
    }

    /// Pressure at a point of the skin, Pa: 0 off the atlas.
    fn at_pa(&self, x: [f64; 3]) -> f64 {
        let near = self.boxes.get(&box_of(x)).map_or(&[][..], Vec::as_slice);
        let found = near
            .iter()
            .map(|&t| closest(&self.triangles[t], x))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(distance, _)| *distance < OFF_MM);
        found.map_or(0.0, |(_, uv)| self.sample(uv))
    }

    /// Bilinear between the centres of pixels.
    fn sample(&self, [u, v]: [f64; 2]) -> f64 {
        let (u, v) = (u - 0.5, v - 0.5);
        let (column, row) = (u.floor(), v.floor());
        let mut sum = 0.0;
        for (r, wr) in [(row, row + 1.0 - v), (row + 1.0, v - row)] {
            for (c, wc) in [(column, column + 1.0 - u), (column + 1.0, u - column)] {
                let side = MAP_SIDE_PX as f64;
                if (0.0..side).contains(&r) && (0.0..side).contains(&c) {
                    let pixel = self.map_pa[r as usize * MAP_SIDE_PX + c as usize];
                    sum += wr * wc * f64::from(pixel);
                }
            }
        }
        sum
    }

    /// Greatest pressure, Pa.
    fn most_pa(&self) -> f64 {
        self.map_pa.iter().copied().fold(0.0, f32::max).into()
    }
}

/// Distance of a point to a triangle, mm, and the pixel of the closest point.
fn closest(corners: &[([f64; 3], [f64; 2]); 3], x: [f64; 3]) -> (f64, [f64; 2]) {
    let [(a, ua), (b, ub), (c, uc)] = *corners;
    let (ab, ac, ax) = (minus(b, a), minus(c, a), minus(x, a));
    let (d00, d01, d11) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let (d20, d21) = (dot(ax, ab), dot(ax, ac));
    let det = d00 * d11 - d01 * d01;
    let mut weights = [0.0; 3];
    if det > 0.0 {
        let v = (d11 * d20 - d01 * d21) / det;
        let w = (d00 * d21 - d01 * d20) / det;
        weights = [1.0 - v - w, v, w];
    }
    if weights.iter().any(|w| *w < 0.0) || det <= 0.0 {
        // Beside the triangle: the closest point of its edges.
        let places = [a, b, c];
        let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let edge = minus(places[j], places[i]);
            let along = dot(minus(x, places[i]), edge) / dot(edge, edge).max(f64::MIN_POSITIVE);
            let along = along.clamp(0.0, 1.0);
            let at: [f64; 3] = std::array::from_fn(|k| places[i][k] + along * edge[k]);
            let distance = norm(minus(x, at));
            if distance < best.0 {
                let mut of = [0.0; 3];
                (of[i], of[j]) = (1.0 - along, along);
                best = (distance, of);
            }
        }
        weights = best.1;
    }
    let at: [f64; 3] =
        std::array::from_fn(|k| weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k]);
    let uv = std::array::from_fn(|k| weights[0] * ua[k] + weights[1] * ub[k] + weights[2] * uc[k]);
    (norm(minus(x, at)), uv)
}

impl Body {
    /// A fingertip under a map of pressure (224 x 224, Pa), held as [`Body::fingertip`] is. Cells of
    /// [`Order::Graded`] are split where the map presses, most at its edges.
    ///
    /// # Errors
    /// See [`SimulationError`].
    pub(super) fn fingertip_under(
        shape: &FingertipShape,
        materials: Materials,
        (density, order, parts): (Density, Order, Parts),
        map_pa: &[f32],
    ) -> Result<Self, SimulationError> {
        let plain = build(shape, density, order, parts, None)?;
        let (skin, interface) = plain.patch.places_mm(&plain.mesh);
        let (atlas, _) = build_atlas(&skin, &interface, &plain.patch.triangles)
            .map_err(SimulationError::Atlas)?;
        let on_skin = MapOnSkin::new(&atlas, map_pa);
        let FingertipMesh { mesh, patch, .. } = if order == Order::Graded {
            let least_pa = EDGE * on_skin.most_pa();
            let pressed = |x: [f64; 3]| {
                let pa = on_skin.at_pa(x);
                let beside = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let is_less = |d: [f64; 3]| {
                    [-BESIDE_MM, BESIDE_MM]
                        .iter()
                        .any(|s| on_skin.at_pa(std::array::from_fn(|i| x[i] + s * d[i])) < least_pa)
                };
                (pa >= least_pa).then(|| beside.into_iter().any(is_less))
            };
            build_pressed(shape, density, parts, &pressed)?
        } else {
            plain
        };
        let fixed = Self::held(&mesh, parts);
        let body = Self::with_patch(mesh, materials, fixed, patch, false)?;
        let mesh = &body.problem.mesh;
        let at_mpa = |x: [f64; 3]| on_skin.at_pa(x) / PA_PER_MPA;
        let mut presses = false;
        let mut seen_mpa = |x| {
            let mpa = at_mpa(x);
            presses |= mpa > 0.0;
            mpa
        };
        let pressure = SurfacePressure::new(mesh, &body.contact, &mut seen_mpa)
            .map_err(SimulationError::Pressure)?;
        let mut nodal_mpa = vec![0.0; mesh.nodes.len()];
        for n in mesh.surfaces[&body.contact].nodes() {
            nodal_mpa[n as usize] = at_mpa(mesh.nodes[n as usize]);
        }
        let under = Some(Under { pressure: Arc::new(pressure), nodal_mpa, presses });
        Ok(Self { graded: order == Order::Graded, under, ..body })
    }

    /// Pressure at every node of the mesh, MPa: the indenter's, or the one that is given.
    #[must_use]
    pub fn pressure_mpa(&self, solver: &Solver<'_>) -> Vec<f64> {
        match &self.under {
            Some(under) => under.nodal_mpa.iter().map(|p| p * solver.fraction()).collect(),
            None => solver.pressure_mpa(&self.problem.mesh.surfaces[&self.contact]),
        }
    }

    /// Raises the given pressure to rising shares of it, and calls `visit` at each of them;
    /// `refinement` 2 halves the steps, and so on.
    ///
    /// # Errors
    /// [`SimulationError::Share`] names the share without an equilibrium, [`SimulationError::Empty`] a
    /// body without pressure.
    pub(super) fn to_shares(
        &self,
        solver: &mut Solver<'_>,
        shares: &[f64],
        refinement: u32,
        visit: Watch<'_>,
    ) -> Result<(), SimulationError> {
        let under = self.under.as_ref().ok_or(SimulationError::Empty)?;
        let pressure = Some(Arc::clone(&under.pressure));
        solver.start(Loading { pressure, ..Loading::default() });
        let mut from = 0.0;
        for &share in shares {
            let clock = Instant::now();
            let steps = ((share - from) / STEP_MAX - 1e-9).ceil().max(1.0) as u32 * refinement;
            let mut effort = Effort::default();
            let mut report = StepReport::default();
            for k in 1..=steps {
                let part = f64::from(k) / f64::from(steps);
                let to = if k == steps { share } else { from + part * (share - from) };
                report = solver.advance_to(to).map_err(|source| match source {
                    SolveError::Stopped { .. } => SimulationError::Halted,
                    source => SimulationError::Share { share: to, source },
                })?;
                effort = effort.plus(&report.effort);
            }
            report.effort = effort;
            from = share;
            let mut record = self.record_under(solver, under, &report)?;
            record.seconds = clock.elapsed().as_secs_f64();
            visit(solver, &record, &report)?;
        }
        Ok(())
    }

    /// Vertex values and checks of an equilibrium under the pressure.
    fn record_under(
        &self,
        solver: &Solver<'_>,
        under: &Under,
        report: &StepReport,
    ) -> Result<IncrementRecord, SimulationError> {
        let nodal = self.pressure_mpa(solver);
        let values = self.at_vertices(solver, &nodal)?;
        let force = solver.balance().contact_force_n;
        let size = norm(force).max(solver.least_force_n());
        // How deep the pressed skin has gone along the force.
        let along = force.map(|f| f / size);
        let u = solver.displacement_mm();
        let pressed = under.nodal_mpa.iter().zip(u).filter(|(p, _)| **p > 0.0);
        let depth_mm = pressed.map(|(_, u)| dot(*u, along)).fold(0.0, f64::max);
        let work_mj = solver.pressure_work_mj();
        let sides = Sides {
            recorded_n: self.integral_n(solver, &nodal),
            normal_n: force,
            work_mj,
            work_mj_max: work_mj.abs(),
            gap_mm: 0.0,
        };
        Ok(self.recorded(solver, report, depth_mm, values, Vec::new(), &sides))
    }

    /// Force of the pressure that is recorded, N: what the mesh's nodes, or the atlas, do not show of
    /// the map counts as none.
    fn integral_n(&self, solver: &Solver<'_>, nodal_mpa: &[f64]) -> [f64; 3] {
        let surface = &self.problem.mesh.surfaces[&self.contact];
        let mut shown = vec![0.0; nodal_mpa.len()];
        for &n in self.patch.iter().flat_map(|p| &p.patch.skin) {
            shown[n as usize] = nodal_mpa[n as usize];
        }
        let x = solver.deformed();
        let mut total = [0.0; 3];
        let rule = surface.kind.quadrature();
        surface.integrate(&rule, &|n| x[n as usize], &mut |face, value, area| {
            let p: f64 = face.iter().zip(value).map(|(&n, v)| v * shown[n as usize]).sum();
            (0..3).for_each(|i| total[i] -= p * area[i]);
        });
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_atlas::{MAP_LEN, Raster};

    /// What is drawn at the vertices of an atlas is read again where they lie on the finger, and
    /// nothing where the atlas shows nothing.
    #[test]
    fn a_map_is_read_where_it_was_drawn() {
        let shape = FingertipShape::default();
        let plain = build(&shape, Density::Coarse, Order::Linear, Parts::default(), None).unwrap();
        let (skin, interface) = plain.patch.places_mm(&plain.mesh);
        let (atlas, _) = build_atlas(&skin, &interface, &plain.patch.triangles).unwrap();
        let field = |x: [f64; 3]| 1e3 * (2.0 + 0.05 * x[0] + 0.1 * x[1]);
        let values: Vec<f32> = skin.iter().map(|&x| field(x) as f32).collect();
        let mut map_pa = vec![0.0; MAP_LEN];
        Raster::new(&atlas, Patch::Skin).rasterise(&values, &mut map_pa).unwrap();
        let on_skin = MapOnSkin::new(&atlas, &map_pa);
        let mut inside = 0;
        for corners in &on_skin.triangles {
            let mean = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>() / 3.0;
            let at: [f64; 3] = std::array::from_fn(|i| mean(&|k| corners[k].0[i]));
            let uv: [f64; 2] = std::array::from_fn(|i| mean(&|k| corners[k].1[i]));
            // Beside the edge pixels outside are part of the mean.
            let [column, row] = uv.map(|v| v as usize);
            let around = (row.saturating_sub(2)..row + 3)
                .flat_map(|r| (column.saturating_sub(2)..column + 3).map(move |c| (r, c)));
            let mut near = around.map(|(r, c)| map_pa.get(r * MAP_SIDE_PX + c).copied());
            if near.all(|p| p.is_some_and(|p| p > 0.0)) {
                inside += 1;
                let found = on_skin.at_pa(at);
                assert!((found / field(at) - 1.0).abs() < 0.01, "{at:?}: {found}");
            }
        }
        assert!(inside > 100, "{inside}");
        // The nail's side, and a point far above the skin.
        for away in [[15.0, 0.0, 8.0], [11.0, 0.0, -9.0]] {
            assert!(on_skin.at_pa(away).abs() < 1e-12);
        }
    }
}

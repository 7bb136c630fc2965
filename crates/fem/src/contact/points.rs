//! Points of a surface at which contact is found.

use crate::mesh::Surface;
use papilla_vector::norm;

/// Where on the surface contact is looked for; files know the rules as `nodes`, `faces` and
/// `faces_finely`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ContactRule {
    /// At its nodes: one multiplier a node is what the displacement space can control, so
    /// pressure does not oscillate. An edge narrower than some three faces falls between.
    #[default]
    #[serde(rename = "nodes")]
    Nodal,
    /// At Gauss points of its faces, two by two on flat ones: an edge finds hold within a face
    /// and slides on to the next without a jump. These are more points than the displacement
    /// space can control, so that multipliers would not settle: a stiff penalty takes their place.
    #[serde(rename = "faces")]
    Gauss,
    /// As [`Self::Gauss`], at three by three points of flat faces: quadratic faces follow a rounded
    /// edge, and one that lies along the rows of fewer points cannot jump from one to the next.
    /// A softer penalty leaves gaps of a micrometre or two: SED is the same, iterations are half.
    #[serde(rename = "faces_finely")]
    GaussOrder3,
}

impl ContactRule {
    /// Whether multipliers close the gap that a penalty leaves.
    #[must_use]
    pub const fn has_multipliers(self) -> bool {
        !self.is_gauss()
    }

    /// Penalty in shear moduli of what is pressed over the distance of contact nodes.
    #[must_use]
    pub const fn penalty_factor(self) -> f64 {
        match self {
            Self::Nodal | Self::GaussOrder3 => 200.0,
            Self::Gauss => 2000.0,
        }
    }

    /// Whether contact is at Gauss points of the faces, not at nodes.
    #[must_use]
    pub const fn is_gauss(self) -> bool {
        matches!(self, Self::Gauss | Self::GaussOrder3)
    }
}

/// Points of a surface, each an average of nodes, with their share of the undeformed area.
#[derive(Clone, Debug, Default)]
pub struct ContactPoints {
    /// End of each point's entries in `node` and `value`.
    end: Vec<u32>,
    pub(super) node: Vec<u32>,
    value: Vec<f64>,
    /// As `value`, linear between neighbouring nodes.
    hat: Vec<f64>,
    /// Share of the undeformed area, mm2.
    pub area_mm2: Vec<f64>,
}

/// Nodes that carry a point, and their shape functions there.
#[derive(Clone, Copy, Debug)]
pub struct Support<'a> {
    /// Mesh nodes.
    pub nodes: &'a [u32],
    /// Shape functions; their sum is 1.
    pub values: &'a [f64],
}

impl Support<'_> {
    /// What a nodal vector field has at the point.
    #[must_use]
    pub fn of(&self, field: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (&n, v) in self.nodes.iter().zip(self.values) {
            let at = field(n as usize);
            for i in 0..3 {
                sum[i] += v * at[i];
            }
        }
        sum
    }
}

impl ContactPoints {
    /// One point a node.
    pub(super) fn nodes(nodes: Vec<u32>, area_mm2: Vec<f64>) -> Self {
        Self {
            end: (1..=nodes.len() as u32).collect(),
            value: vec![1.0; nodes.len()],
            hat: vec![1.0; nodes.len()],
            node: nodes,
            area_mm2,
        }
    }

    /// The points of `rule`, places and weights on a face, of the faces that have one of the
    /// sorted `nodes`.
    pub(super) fn faces(
        surface: &Surface,
        rule: &[([f64; 2], f64)],
        positions: &[[f64; 3]],
        nodes: &[u32],
    ) -> Self {
        let mut points = Self::default();
        let hats: Vec<_> = rule.iter().map(|&(xi, _)| surface.kind.hats(xi)).collect();
        let mut visit = 0;
        surface.integrate(rule, &|n| positions[n as usize], &mut |face, value, area| {
            let hat = &hats[visit % rule.len()];
            visit += 1;
            if face.iter().any(|n| nodes.binary_search(n).is_ok()) {
                points.node.extend(face);
                points.value.extend(value);
                points.hat.extend(&hat[..value.len()]);
                points.end.push(points.node.len() as u32);
                points.area_mm2.push(norm(area));
            }
        });
        points
    }

    /// A quantity of the points shared out among the sorted `nodes` around each, by functions that
    /// are linear between neighbouring nodes: what is positive stays so, and so does the sum.
    #[must_use]
    pub(crate) fn shared_out<const N: usize>(
        &self,
        value: impl Fn(usize) -> [f64; N],
        nodes: &[u32],
    ) -> Vec<[f64; N]> {
        let mut sum = vec![[0.0; N]; nodes.len()];
        for point in 0..self.len() {
            let (range, value) = (self.range(point), value(point));
            for (n, hat) in self.node[range.clone()].iter().zip(&self.hat[range]) {
                let Ok(at) = nodes.binary_search(n) else { continue };
                for i in 0..N {
                    sum[at][i] += hat * value[i];
                }
            }
        }
        sum
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.end.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.end.is_empty()
    }

    /// What carries a point.
    #[must_use]
    pub fn support(&self, point: usize) -> Support<'_> {
        let range = self.range(point);
        Support { nodes: &self.node[range.clone()], values: &self.value[range] }
    }

    /// Where the entries of a point are.
    fn range(&self, point: usize) -> std::ops::Range<usize> {
        let start = if point == 0 { 0 } else { self.end[point - 1] as usize };
        start..self.end[point] as usize
    }

    /// What carries each point, and its area, mm2.
    pub fn iter(&self) -> impl Iterator<Item = (Support<'_>, f64)> {
        self.area_mm2.iter().enumerate().map(|(i, &area)| (self.support(i), area))
    }

    /// Nodal tractions with the force of the tractions at the points,
    /// `t_a = sum_q A_q N_a(q) t_q / A_a`, for each of the sorted `nodes` with their areas.
    #[must_use]
    pub fn to_nodes<const N: usize>(
        &self,
        traction: &[[f64; N]],
        nodes: &[u32],
        area_mm2: &[f64],
    ) -> Vec<[f64; N]> {
        let mut nodal = vec![[0.0; N]; nodes.len()];
        for ((support, area), t) in self.iter().zip(traction) {
            for (n, v) in support.nodes.iter().zip(support.values) {
                let Ok(at) = nodes.binary_search(n) else { continue };
                for i in 0..N {
                    nodal[at][i] += v * (area / area_mm2[at]) * t[i];
                }
            }
        }
        nodal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::surface::FaceKind;

    /// Four faces of different size over x and y in [0, 3].
    fn surface() -> (Surface, Vec<[f64; 3]>) {
        let lines = [0.0, 1.0, 3.0];
        let at = lines.iter().flat_map(|&x| lines.iter().map(move |&y| [x, y, 0.1 * x * y]));
        let face = |a: u32| [a, a + 3, a + 4, a + 1];
        let connectivity = [0, 1, 3, 4].into_iter().flat_map(face).collect();
        (Surface { kind: FaceKind::Quad4, connectivity }, at.collect())
    }

    #[test]
    fn face_points_carry_the_area_and_what_is_linear() {
        let (surface, at) = surface();
        let mut nodal = vec![0.0; at.len()];
        surface.add_nodal_areas(&|n| at[n as usize], &mut nodal);
        for (rule, count) in
            [(surface.kind.contact_points(), 4 * 4), (surface.kind.quadrature(), 4 * 9)]
        {
            let points = ContactPoints::faces(&surface, &rule, &at, &surface.nodes());
            assert_eq!(points.len(), count);
            let (found, due) = (points.area_mm2.iter().sum::<f64>(), nodal.iter().sum::<f64>());
            assert!((found / due - 1.0).abs() < 1e-3, "{found} against {due}");
            for (support, _) in points.iter() {
                let [x, y, _] = support.of(|n| at[n]);
                let [sum, linear, _] = support.of(|n| [1.0, 2.0 * at[n][0] - at[n][1], 0.0]);
                assert!((sum - 1.0).abs() < 1e-14 && (linear - (2.0 * x - y)).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn nodes_carry_the_force_of_the_points() {
        let (surface, at) = surface();
        let nodes = surface.nodes();
        let rule = surface.kind.contact_points();
        let points = ContactPoints::faces(&surface, &rule, &at, &nodes);
        let mut area = vec![0.0; at.len()];
        surface.add_nodal_areas(&|n| at[n as usize], &mut area);
        let traction: Vec<[f64; 2]> =
            (0..points.len()).map(|i| [(i as f64).sin(), (i as f64).cos()]).collect();
        let nodal = points.to_nodes(&traction, &nodes, &area);
        for k in 0..2 {
            let due: f64 = points.area_mm2.iter().zip(&traction).map(|(a, t)| a * t[k]).sum();
            let found: f64 = nodal.iter().zip(&area).map(|(t, a)| a * t[k]).sum();
            assert!((found - due).abs() < 1e-13 * due.abs().max(1.0), "{found} against {due}");
        }
    }

    #[test]
    fn a_point_at_a_node_is_the_node() {
        let points = ContactPoints::nodes(vec![3, 7], vec![0.5, 0.25]);
        let [x, y, z] = points.support(1).of(|n| [n as f64, 0.1, -2.0]);
        assert_eq!([x.to_bits(), y.to_bits(), z.to_bits()], [7.0, 0.1, -2.0].map(f64::to_bits));
        let traction = [[0.3], [0.7]];
        assert_eq!(points.to_nodes(&traction, &[3, 7], &[0.5, 0.25]), traction);
    }
}

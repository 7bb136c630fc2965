//! A tree of boxes round triangles, so that most are never looked at.

use super::MeshError;
use super::work::Work;

/// Triangles of a leaf at most.
const LEAF: usize = 4;
/// Deepest tree: halves of 2^14 triangles, with room to spare.
const DEPTH_MAX: usize = 32;

/// Boxes, depth first: the first child of an inner one comes right behind it.
pub(super) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// Triangles of a leaf, in `order`; none of an inner box.
    leaf: [u32; 2],
    /// The second child.
    second: u32,
}

impl Node {
    /// Square of the distance of a point, 0 inside.
    fn square_away(&self, p: [f64; 3]) -> f64 {
        (0..3).map(|i| (self.low[i] - p[i]).max(p[i] - self.high[i]).max(0.0).powi(2)).sum()
    }

    fn overlaps(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        (0..3).all(|i| self.low[i] <= high[i] && low[i] <= self.high[i])
    }
}

impl Tree {
    pub(super) fn new(triangles: &[[[f64; 3]; 3]]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..triangles.len() as u32).collect() };
        tree.split(triangles, 0, triangles.len());
        tree
    }

    fn split(&mut self, triangles: &[[[f64; 3]; 3]], first: usize, last: usize) {
        let own = &self.order[first..last];
        let fold = |i: usize, pick: fn(f64, f64) -> f64, from: f64| {
            own.iter().flat_map(|t| triangles[*t as usize]).map(|p| p[i]).fold(from, pick)
        };
        let low: [f64; 3] = std::array::from_fn(|i| fold(i, f64::min, f64::INFINITY));
        let high: [f64; 3] = std::array::from_fn(|i| fold(i, f64::max, f64::NEG_INFINITY));
        let at = self.nodes.len();
        let is_leaf = last - first <= LEAF;
        let leaf = if is_leaf { [first as u32, last as u32] } else { [0; 2] };
        self.nodes.push(Node { low, high, leaf, second: 0 });
        if is_leaf {
            return;
        }
        let widest = |i: &usize, j: &usize| (high[*i] - low[*i]).total_cmp(&(high[*j] - low[*j]));
        let axis = (0..3).max_by(widest).unwrap_or(0);
        let middle = |t: u32| triangles[t as usize].iter().map(|p| p[axis]).sum::<f64>();
        self.order[first..last].sort_by(|a, b| middle(*a).total_cmp(&middle(*b)));
        let half = (first + last) / 2;
        self.split(triangles, first, half);
        self.nodes[at].second = self.nodes.len() as u32;
        self.split(triangles, half, last);
    }

    /// A value for each box: of a leaf from its triangles, of others from their two halves.
    pub(super) fn sums<T: Copy>(
        &self,
        leaf: impl Fn(&[u32], [[f64; 3]; 2]) -> T,
        both: impl Fn(T, T, [[f64; 3]; 2]) -> T,
    ) -> Vec<T> {
        // Halves lie behind the whole: the last box first.
        let mut sums: Vec<T> = Vec::with_capacity(self.nodes.len());
        let last = self.nodes.len();
        for (at, node) in self.nodes.iter().enumerate().rev() {
            let ends = [node.low, node.high];
            let of = |at: usize| sums[last - 1 - at];
            sums.push(if node.second == 0 {
                leaf(&self.order[node.leaf[0] as usize..node.leaf[1] as usize], ends)
            } else {
                both(of(at + 1), of(node.second as usize), ends)
            });
        }
        sums.reverse();
        sums
    }

    /// Goes from the whole to the parts: `into` says of a box whether to look into it, `each` is
    /// called with every triangle of the leaves that were looked into.
    pub(super) fn descend(&self, mut into: impl FnMut(usize) -> bool, mut each: impl FnMut(usize)) {
        let mut stack = [0u32; DEPTH_MAX];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let at = stack[height];
            if !into(at as usize) {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.second == 0 {
                let own = &self.order[node.leaf[0] as usize..node.leaf[1] as usize];
                own.iter().for_each(|t| each(*t as usize));
                continue;
            }
            stack[height] = node.second;
            stack[height + 1] = at + 1;
            height += 2;
        }
    }

    /// Asks triangles for the squares of their distances from `p`, nearest boxes first, until no
    /// box is nearer than the least one; `ask` is told that too.
    pub(super) fn nearest(&self, p: [f64; 3], mut ask: impl FnMut(usize, f64) -> f64) {
        let mut stack = [(0u32, 0.0f64); DEPTH_MAX];
        let (mut height, mut best) = (1, f64::INFINITY);
        while height > 0 {
            height -= 1;
            let (at, away) = stack[height];
            if away >= best {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.second == 0 {
                for &triangle in &self.order[node.leaf[0] as usize..node.leaf[1] as usize] {
                    best = best.min(ask(triangle as usize, best));
                }
                continue;
            }
            let children = [at + 1, node.second];
            let aways = children.map(|c| self.nodes[c as usize].square_away(p));
            let nearer = usize::from(aways[1] < aways[0]);
            for child in [1 - nearer, nearer] {
                stack[height] = (children[child], aways[child]);
                height += 1;
            }
        }
    }

    /// Calls `each` with every triangle whose leaf's box touches the box from `low` to `high`,
    /// until it returns something.
    ///
    /// # Errors
    /// Boxes and triangles are counted as `work`, which may be too much.
    pub(super) fn find<T>(
        &self,
        [low, high]: [[f64; 3]; 2],
        work: &mut Work<'_>,
        mut each: impl FnMut(usize) -> Option<T>,
    ) -> Result<Option<T>, MeshError> {
        let mut stack = [0u32; DEPTH_MAX];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let at = stack[height];
            let node = &self.nodes[at as usize];
            work.spend(1 + u64::from(node.leaf[1] - node.leaf[0]))?;
            if !node.overlaps(low, high) {
                continue;
            }
            if node.second == 0 {
                let own = &self.order[node.leaf[0] as usize..node.leaf[1] as usize];
                if let Some(found) = own.iter().find_map(|t| each(*t as usize)) {
                    return Ok(Some(found));
                }
                continue;
            }
            stack[height] = at + 1;
            stack[height + 1] = node.second;
            height += 2;
        }
        Ok(None)
    }
}

//! Orders of elimination.
//!
//! The usual one is METIS' nested dissection: on 3-D hexahedral meshes it needs less than half
//! the factor entries of approximate minimum degree. The graph is that of the nodes, not of the
//! degrees of freedom: a third of the size and supernodes for free.

use super::DofMap;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// METIS could not order a graph.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum OrderingError {
    /// METIS counts in 32 bits.
    #[error("the mesh graph has {0} entries, more than METIS' 32-bit index can count")]
    TooLarge(usize),
    /// METIS returned a status other than OK.
    #[error("METIS nested dissection failed with status {0} (-2 input, -3 memory)")]
    Metis(i32),
}

/// In which order unknowns are eliminated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Elimination {
    /// METIS' nested dissection of the nodes: the least fill.
    #[default]
    NestedDissection,
    /// Reverse Cuthill-McKee of the nodes: the least bandwidth.
    CuthillMckee,
    /// As the mesh numbers its nodes.
    Natural,
}

/// Order of the nodes with unknowns, expanded to equations.
pub(super) fn elimination_order(
    neighbours: &[BTreeSet<u32>],
    dofs: &DofMap,
    elimination: Elimination,
) -> Result<Vec<usize>, OrderingError> {
    let unknowns =
        |node: usize| dofs.of_dof[3 * node..3 * node + 3].iter().filter(|&&e| e != DofMap::FIXED);
    let mut compact = vec![u32::MAX; neighbours.len()];
    let mut kept = Vec::new();
    for node in 0..neighbours.len() {
        if unknowns(node).next().is_some() {
            compact[node] = kept.len() as u32;
            kept.push(node);
        }
    }
    let graph: Vec<BTreeSet<u32>> = kept
        .iter()
        .map(|&node| {
            neighbours[node]
                .iter()
                .map(|&b| compact[b as usize])
                .filter(|&b| b != u32::MAX)
                .collect()
        })
        .collect();
    let order = match elimination {
        Elimination::NestedDissection => nested_dissection(&graph)?,
        Elimination::CuthillMckee => cuthill_mckee(&graph),
        Elimination::Natural => (0..graph.len() as u32).collect(),
    };
    Ok(order.iter().flat_map(|&v| unknowns(kept[v as usize]).map(|&e| e as usize)).collect())
}

/// METIS draws from one generator for the whole process (`srand`/`rand`), so
/// two threads that order at once would take numbers from each other and get
/// orders, and with them last bits, that differ from run to run.
static METIS: Mutex<()> = Mutex::new(());

/// Order in which to eliminate the vertices: `order[k]` is the vertex that
/// comes `k`-th. Deterministic: METIS' random seed is fixed, and one thread at
/// a time orders.
///
/// # Errors
/// [`OrderingError`] if METIS refuses the graph.
fn nested_dissection(neighbours: &[BTreeSet<u32>]) -> Result<Vec<u32>, OrderingError> {
    let entries: usize = neighbours.iter().map(BTreeSet::len).sum();
    let too_large = |_| OrderingError::TooLarge(entries.max(neighbours.len()));
    let mut n = i32::try_from(neighbours.len()).map_err(too_large)?;
    i32::try_from(entries).map_err(too_large)?;
    if n < 2 {
        return Ok((0..neighbours.len() as u32).collect());
    }
    let mut start = Vec::with_capacity(neighbours.len() + 1);
    let mut adjacent: Vec<i32> = Vec::with_capacity(entries);
    start.push(0);
    for list in neighbours {
        adjacent.extend(list.iter().map(|&v| v as i32));
        start.push(adjacent.len() as i32);
    }
    let mut permutation = vec![0; neighbours.len()];
    let mut inverse = vec![0; neighbours.len()];
    let status = {
        let _alone = METIS.lock().unwrap_or_else(PoisonError::into_inner);
        call_metis(&mut n, &mut start, &mut adjacent, &mut permutation, &mut inverse)
    };
    if status == metis_sys::rstatus_et_METIS_OK {
        Ok(permutation.into_iter().map(|v| v as u32).collect())
    } else {
        Err(OrderingError::Metis(status))
    }
}

/// Reverse Cuthill-McKee: breadth first from a vertex with few neighbours, those with few
/// first, and the whole turned round.
fn cuthill_mckee(neighbours: &[BTreeSet<u32>]) -> Vec<u32> {
    let degree = |v: &u32| neighbours[*v as usize].len();
    let mut starts: Vec<u32> = (0..neighbours.len() as u32).collect();
    starts.sort_by_key(degree);
    let mut seen = vec![false; neighbours.len()];
    let mut order: Vec<u32> = Vec::with_capacity(neighbours.len());
    for start in starts {
        if std::mem::replace(&mut seen[start as usize], true) {
            continue;
        }
        let mut at = order.len();
        order.push(start);
        while let Some(&v) = order.get(at) {
            at += 1;
            let mut next: Vec<u32> =
                neighbours[v as usize].iter().copied().filter(|&n| !seen[n as usize]).collect();
            next.sort_by_key(degree);
            next.iter().for_each(|&n| seen[n as usize] = true);
            order.extend(next);
        }
    }
    order.reverse();
    order
}

/// The one foreign call of this crate.
#[allow(unsafe_code)]
fn call_metis(
    n: &mut i32,
    start: &mut [i32],
    adjacent: &mut [i32],
    permutation: &mut [i32],
    inverse: &mut [i32],
) -> i32 {
    let mut options = [0; metis_sys::METIS_NOPTIONS as usize];
    // SAFETY: METIS reads `n + 1` entries of `start`, `start[n]` of `adjacent`
    // (both built so by the caller) and METIS_NOPTIONS options, writes `n`
    // entries of `permutation` and `inverse`, and keeps no pointer.
    unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        options[metis_sys::moptions_et_METIS_OPTION_SEED as usize] = 1;
        metis_sys::METIS_NodeND(
            n,
            start.as_mut_ptr(),
            adjacent.as_mut_ptr(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            permutation.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(n: u32) -> Vec<BTreeSet<u32>> {
        (0..n)
            .map(|i| [i.wrapping_sub(1), i + 1].into_iter().filter(|&j| j < n).collect())
            .collect()
    }

    #[test]
    fn a_path_is_ordered_by_a_permutation() {
        let mut order = nested_dissection(&path(200)).unwrap();
        order.sort_unstable();
        assert_eq!(order, (0..200).collect::<Vec<_>>());
    }

    #[test]
    fn cuthill_mckee_orders_two_paths_with_neighbours_beside_each_other() {
        let mut graph = path(50);
        graph.extend(path(30).into_iter().map(|s| s.into_iter().map(|v| v + 50).collect()));
        let order = cuthill_mckee(&graph);
        let mut place = vec![0i64; 80];
        order.iter().enumerate().for_each(|(k, &v)| place[v as usize] = k as i64);
        for (v, set) in graph.iter().enumerate() {
            assert!(set.iter().all(|&n| (place[v] - place[n as usize]).abs() == 1), "{order:?}");
        }
    }

    #[test]
    fn threads_that_order_at_once_get_the_same_order() {
        let graph = path(2000);
        let alone = nested_dissection(&graph).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..50 {
                        assert_eq!(alone, nested_dissection(&graph).unwrap());
                    }
                });
            }
        });
    }
}

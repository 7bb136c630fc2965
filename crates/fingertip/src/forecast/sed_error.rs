//! How wrong SED at the interface is on a mesh of the finger: what was measured, and where.

use crate::mesh::fingertip::{Density, Order};
use crate::scene::Geometry;
use serde::Serialize;

/// What is known of a mesh's error of SED, relative L2 over the interface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SedError {
    /// Measured.
    About(f64),
    /// Not measured; a mesh that is better is as wrong as this.
    AtLeast(f64),
    /// Nothing was measured that tells.
    Unknown,
}

/// A mesh of the finger, what is known of it, and the report that says so.
struct Row {
    density: Density,
    order: Order,
    error: SedError,
    source: &'static str,
}

/// Medians over 23 simulations of other shapes; the error of the finest mesh is estimated.
const LADDER: &str =
    "median of 23 simulations against the fine graded mesh, docs/reports/accuracy-vs-time.md";
const EXTRAPOLATED: &str =
    "extrapolated from medium and fine over 23 simulations, docs/reports/accuracy-vs-time.md";
const WORSE: &str =
    "that of medium, from which SED is another 19 % away, docs/reports/verification.csv";

/// The one table of it.
const ROWS: [Row; 4] = [
    Row {
        density: Density::Coarse,
        order: Order::Linear,
        error: SedError::AtLeast(0.47),
        source: WORSE,
    },
    Row {
        density: Density::Medium,
        order: Order::Linear,
        error: SedError::About(0.47),
        source: LADDER,
    },
    Row {
        density: Density::Medium,
        order: Order::Graded,
        error: SedError::About(0.042),
        source: LADDER,
    },
    Row {
        density: Density::Fine,
        order: Order::Graded,
        error: SedError::About(0.024),
        source: EXTRAPOLATED,
    },
];

impl SedError {
    /// Of a scene's mesh, with its source; `None` for what is no fingertip.
    #[must_use]
    pub fn of(geometry: &Geometry) -> Option<(Self, &'static str)> {
        let Geometry::Fingertip { density, order, .. } = geometry else { return None };
        let row = ROWS.iter().find(|row| (row.density, row.order) == (*density, *order));
        Some(row.map_or((Self::Unknown, "no report compares this mesh"), |r| (r.error, r.source)))
    }

    /// Whether it is known to be small enough to build on.
    #[must_use]
    pub fn is_small(self) -> bool {
        matches!(self, Self::About(error) if error < 0.1)
    }

    /// In words, such as `about 4 %`.
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::About(error) => format!("about {:.0} %", 100.0 * error),
            Self::AtLeast(error) => format!("at least {:.0} %", 100.0 * error),
            Self::Unknown => "not measured".into(),
        }
    }
}

/// The mesh on which SED is cheapest among those whose error is known to be small: what a scene's
/// geometry would be on it. `None` for one that is such already, and for no finger.
#[must_use]
pub fn better(geometry: &Geometry) -> Option<Geometry> {
    let (error, _) = SedError::of(geometry)?;
    let Geometry::Fingertip { shape, finger, .. } = geometry else { return None };
    let (density, order, shape, finger) =
        (Density::Medium, Order::Graded, shape.clone(), finger.clone());
    (!error.is_small()).then_some(Geometry::Fingertip { density, order, shape, finger })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::fingertip::FingertipShape;

    fn finger(density: Density, order: Order) -> Geometry {
        Geometry::Fingertip { density, order, shape: FingertipShape::default(), finger: None }
    }

    /// The table says what the ladder measured.
    #[test]
    fn errors_are_those_of_the_ladder() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../docs/reports/accuracy-vs-time.json");
        let ladder: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let median = |name: &str| {
            let rung = ladder["rungs"].as_array().unwrap().iter().find(|r| r["name"] == name);
            rung.unwrap()["errors"]["reference"]["relative_l2"]["median"].as_f64().unwrap()
        };
        let own = |density, order| match SedError::of(&finger(density, order)).unwrap().0 {
            SedError::About(error) | SedError::AtLeast(error) => error,
            SedError::Unknown => f64::NAN,
        };
        let linear = median("fe-medium-linear");
        for (found, due) in [
            (own(Density::Medium, Order::Linear), linear),
            (own(Density::Coarse, Order::Linear), linear),
            (own(Density::Medium, Order::Graded), median("fe-medium-graded")),
            (
                own(Density::Fine, Order::Graded),
                ladder["discretisation_error"]["sed_relative_l2"].as_f64().unwrap(),
            ),
        ] {
            assert!((found / due - 1.0).abs() < 0.05, "{found} for {due}");
        }
    }

    /// A scene that says nothing of its mesh gets one whose SED is right; another is told which.
    #[test]
    fn the_default_mesh_is_the_one_that_others_are_told_of() {
        let usual: Geometry = toml::from_str("kind = \"fingertip\"").unwrap();
        assert_eq!(usual, finger(Density::Medium, Order::Graded));
        assert!(SedError::of(&usual).unwrap().0.is_small() && better(&usual).is_none());
        for poor in [
            finger(Density::Medium, Order::Linear),
            finger(Density::Fine, Order::Quadratic),
            finger(Density::Coarse, Order::Graded),
        ] {
            assert_eq!(better(&poor), Some(usual.clone()), "{poor:?}");
        }
        assert!(better(&finger(Density::Fine, Order::Graded)).is_none());
        let block = "kind = \"block\"\nsize_mm = [1.0, 1.0]\nelements = [1, 1]\nlayers = []";
        assert_eq!(SedError::of(&toml::from_str(block).unwrap()), None);
    }
}

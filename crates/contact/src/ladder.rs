//! The methods that find pressure at the vertices, from the fastest to the most accurate.

/// A way to find pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// A spring for each vertex, whatever happens beside it: the fastest and the roughest.
    Springs,
    /// The finger's compliance at small strain, on displaced vertices.
    SmallStrain,
    /// The same with the second order of finite strain: the most accurate.
    #[default]
    SecondOrder,
}

impl Method {
    /// Every method, from fast and rough to slow and exact.
    pub const ALL: [Self; 3] = [Self::Springs, Self::SmallStrain, Self::SecondOrder];

    /// Name on the outside.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::SmallStrain => "small_strain",
            Self::SecondOrder => "second_order",
        }
    }

    pub(crate) const fn has_second_order(self) -> bool {
        matches!(self, Self::SecondOrder)
    }
}

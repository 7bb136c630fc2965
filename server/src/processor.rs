//! What the processor has of the vector instructions that networks and contact are written for.
//!
//! Nothing requires them: every loop looks at run time for what there is, down to plain x86-64
//! (`tests/processors/run` runs the program on such processors). But without AVX2 a map takes several
//! times as long, which whoever runs the service had better know.

/// The widest vectors that are made use of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Vectors {
    /// 512 bits: AVX-512, by the operators that tract runs.
    Avx512,
    /// 256 bits: AVX2 and fused products.
    Avx2,
    /// x86-64 without either.
    Narrow,
    /// Another kind of processor, whose vectors are part of it.
    Other,
}

impl Vectors {
    /// Those of this processor.
    pub(crate) fn here() -> Self {
        if cfg!(target_arch = "x86_64") { Self::of(has) } else { Self::Other }
    }

    /// Those of an x86-64 that has these features.
    fn of(has: impl Fn(Feature) -> bool) -> Self {
        if !(has(Feature::Avx2) && has(Feature::Fma)) {
            Self::Narrow
        } else if has(Feature::Avx512) {
            Self::Avx512
        } else {
            Self::Avx2
        }
    }

    /// What there is, in words, and what follows from it.
    pub(crate) fn describe(self) -> &'static str {
        match self {
            Self::Avx512 => "AVX-512",
            Self::Avx2 => "AVX2, without AVX-512",
            Self::Narrow => {
                "neither AVX2 nor FMA: answers are right, but each takes several times as long as \
                 the shipped times; keep the calibration on, and give sessions longer budgets or \
                 the tiers nano and nano-maps"
            }
            Self::Other => "no x86-64; its own vectors",
        }
    }

    /// Says at the start what nobody would guess from the answers.
    pub(crate) fn warn(self) {
        if self == Self::Narrow {
            tracing::warn!("this processor has {}", self.describe());
        }
    }
}

/// What CPUID is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Feature {
    Avx2,
    Fma,
    Avx512,
}

#[cfg(target_arch = "x86_64")]
fn has(feature: Feature) -> bool {
    match feature {
        Feature::Avx2 => std::is_x86_feature_detected!("avx2"),
        Feature::Fma => std::is_x86_feature_detected!("fma"),
        Feature::Avx512 => std::is_x86_feature_detected!("avx512f"),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn has(_: Feature) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_without_avx2_is_told_from_others() {
        let of = |features: &[Feature]| Vectors::of(|feature| features.contains(&feature));
        assert_eq!(of(&[]), Vectors::Narrow);
        assert_eq!(of(&[Feature::Avx2]), Vectors::Narrow, "AVX2 without fused products");
        assert_eq!(of(&[Feature::Fma, Feature::Avx512]), Vectors::Narrow);
        assert_eq!(of(&[Feature::Avx2, Feature::Fma]), Vectors::Avx2);
        assert_eq!(of(&[Feature::Avx2, Feature::Fma, Feature::Avx512]), Vectors::Avx512);
        assert!(Vectors::Narrow.describe().contains("several times as long"));
    }

    /// What this machine has is found at all.
    #[test]
    fn this_processor_has_some() {
        assert_eq!(Vectors::here() == Vectors::Other, !cfg!(target_arch = "x86_64"));
    }
}

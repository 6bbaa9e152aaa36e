//! Loops over columns compiled several times, and run by the widest vectors that the machine has.
//!
//! The library is built for any x86-64 (SSE2), or for whatever else it is built for; loops that stand to gain
//! are compiled for AVX2 and AVX-512 as well. `pulp` asks the processor and holds the one unsafe call that
//! this takes. No product and sum is fused in any of them, so that all give the same bits; a test forces each
//! that the machine has.

/// A set of vector instructions that loops are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum InstructionSet {
    /// What the program was built for: SSE2 on x86-64, two doubles at a time.
    Baseline,
    /// AVX2 (x86-64-v3), four doubles at a time.
    Avx2,
    /// AVX-512 (x86-64-v4), eight doubles at a time.
    Avx512,
}

/// A loop over columns, as `pulp` takes it. To be compiled for each instruction set `call` and all that it
/// calls must be `#[inline(always)]`.
pub use pulp::NullaryFnOnce as Kernel;

impl InstructionSet {
    /// Those that this machine has, narrowest first.
    pub fn available() -> impl Iterator<Item = Self> {
        [Self::Baseline, Self::Avx2, Self::Avx512].into_iter().filter(|set| set.is_available())
    }

    /// The widest that this machine has.
    #[inline]
    #[must_use]
    pub fn widest() -> Self {
        if Self::Avx512.is_available() {
            Self::Avx512
        } else if Self::Avx2.is_available() {
            Self::Avx2
        } else {
            Self::Baseline
        }
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }

    #[inline]
    fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => pulp::x86::V3::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => pulp::x86::V4::is_available(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Runs a kernel compiled for this set; for the baseline where the machine does not have it.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        {
            if self == Self::Avx512
                && let Some(v4) = pulp::x86::V4::try_new()
            {
                return v4.vectorize(kernel);
            }
            if self == Self::Avx2
                && let Some(v3) = pulp::x86::V3::try_new()
            {
                return v3.vectorize(kernel);
            }
        }
        kernel.call()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_that_is_not_there_is_run_by_the_baseline() {
        struct Answer;
        impl Kernel for Answer {
            type Output = u32;
            #[inline(always)]
            fn call(self) -> u32 {
                42
            }
        }
        assert_eq!(InstructionSet::available().next(), Some(InstructionSet::Baseline));
        assert_eq!(InstructionSet::available().last(), Some(InstructionSet::widest()));
        for set in [InstructionSet::Baseline, InstructionSet::Avx2, InstructionSet::Avx512] {
            assert_eq!(set.run(Answer), 42, "{}", set.name());
        }
    }
}

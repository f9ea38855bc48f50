//! Sums in lock step over arrays, compiled for the registers that this CPU has.

/// What such a sum is compiled for: wider registers, the same operations in the same order and so the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instructions {
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

impl Instructions {
    /// The widest that this CPU has.
    pub(crate) fn fastest() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            return Self::Avx2;
        }
        Self::Portable
    }
}

/// Sum of eight lanes, in one order whatever the instruction set.
#[inline(always)]
pub(crate) fn sum(lane: &[f64; 8]) -> f64 {
    let [a, b, c, d, e, f, g, h] = *lane;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// `run_for!(instructions, Owner::method(owner, name: Type, ...))` calls a method that is `inline(always)`, compiled for these
/// [`Instructions`]. A function, for a closure is not inlined for sure.
macro_rules! run_for {
    ($instructions:expr, $owner:ident::$method:ident($of:expr, $($name:ident: $kind:ty),*)) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn avx2(of: &$owner, $($name: $kind),*) {
            of.$method($($name),*);
        }
        match $instructions {
            // SAFETY: `Instructions::fastest` alone makes this value, where it found that the CPU has the feature.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code, reason = "a call that needs a CPU feature; the method is plain Rust")]
            $crate::lanes::Instructions::Avx2 => unsafe { avx2($of, $($name),*) },
            $crate::lanes::Instructions::Portable => $of.$method($($name),*),
        }
    }};
}
pub(crate) use run_for;

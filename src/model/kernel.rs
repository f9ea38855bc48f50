//! The network's fast path: one call a query, over the wet surfaces alone.
//!
//! Layer 1 is split: the part of the global features is computed once a query, the part of a surface's static features
//! once a vehicle, and three features a surface are left. Layer 2, 97 % of the arithmetic, is a register-blocked matrix
//! product over packed weights. Every output is summed in the same order whatever the number of rows, so a surface's
//! force does not depend on which others are wet.
//!
//! The only arithmetic in the crate that is `unsafe`: the loads and stores of the vector tiles, and the calls that need
//! a CPU feature. [`Isa`] can be had from [`Isa::available`] alone, so holding one proves that the CPU has it.

#![allow(unsafe_code)]

use super::network::{Network, OUTPUTS, WIDTH};
use crate::features::{DYNAMIC, GLOBAL, STATIC};

/// A row of activations, aligned to a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Row([f32; WIDTH]);

impl Row {
    const ZERO: Self = Self([0.0; WIDTH]);
}

/// One wet surface of a query.
#[derive(Debug, Clone, Copy, Default)]
pub struct WetSurface {
    /// Index of the surface in the vehicle.
    pub surface: usize,
    /// Its features that change with the state.
    pub dynamic: [f32; DYNAMIC],
}

/// The part of layer 1 that a vehicle's surfaces contribute whatever the state, a row a surface.
#[derive(Debug, Clone)]
pub struct StaticRows(Vec<Row>);

/// Working memory of a query, sized once for a number of surfaces.
#[derive(Debug, Clone)]
pub struct Buffers {
    global: Row,
    h1: Vec<Row>,
    h2: Vec<Row>,
    outputs: Vec<[f32; OUTPUTS]>,
}

impl Buffers {
    /// Working memory for vehicles of up to `surfaces` surfaces.
    pub fn new(surfaces: usize) -> Self {
        Self {
            global: Row::ZERO,
            h1: vec![Row::ZERO; surfaces],
            h2: vec![Row::ZERO; surfaces],
            outputs: vec![[0.0; OUTPUTS]; surfaces],
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Plain arrays with fused multiply-add, which the compiler turns into NEON.
    #[cfg(target_arch = "aarch64")]
    Neon,
    Portable,
}

/// An instruction set that this CPU has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Isa(Kind);

impl Isa {
    /// The instruction sets of this CPU that there is a kernel for, fastest first.
    pub fn available() -> Vec<Self> {
        let mut found = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                found.push(Self(Kind::Avx512));
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                found.push(Self(Kind::Avx2));
            }
        }
        #[cfg(target_arch = "aarch64")]
        found.push(Self(Kind::Neon));
        found.push(Self(Kind::Portable));
        found
    }

    /// Name for logs and reports.
    pub fn name(self) -> &'static str {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => "avx512",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2+fma",
            #[cfg(target_arch = "aarch64")]
            Kind::Neon => "neon",
            Kind::Portable => "portable",
        }
    }

    /// Columns of layer 2 that one tile covers.
    fn tile_width(self) -> usize {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => 32,
            _ => 16,
        }
    }
}

/// A network's weights, packed for one instruction set.
#[derive(Debug, Clone)]
pub struct Kernel {
    isa: Isa,
    w1_global: [Row; GLOBAL],
    w1_dynamic: [Row; DYNAMIC],
    w1_static: [Row; STATIC],
    b1: Row,
    /// Tiles of columns, each with one stretch of `tile_width` weights an input: `[tile][input][column]`.
    w2: Vec<Row>,
    b2: Row,
    w3: [Row; OUTPUTS],
    b3: [f32; OUTPUTS],
}

impl Kernel {
    /// Packs a network whose tensors have the shapes that [`Network::tensors`] states.
    pub fn new(network: &Network, isa: Isa) -> Self {
        let inputs = STATIC + DYNAMIC + GLOBAL;
        let column = |input: usize| Row(std::array::from_fn(|unit| network.w1[unit * inputs + input]));
        let row = |values: &[f32]| Row(std::array::from_fn(|i| values[i]));
        Self {
            isa,
            w1_static: std::array::from_fn(column),
            w1_dynamic: std::array::from_fn(|i| column(STATIC + i)),
            w1_global: std::array::from_fn(|i| column(STATIC + DYNAMIC + i)),
            b1: row(&network.b1),
            w2: pack(&network.w2, isa.tile_width()),
            b2: row(&network.b2),
            w3: std::array::from_fn(|c| row(&network.w3[c * WIDTH..])),
            b3: std::array::from_fn(|c| network.b3[c]),
        }
    }

    /// The instruction set in use.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// What the static features of a vehicle's surfaces contribute to layer 1.
    pub fn static_rows(&self, features: &[[f32; STATIC]]) -> StaticRows {
        let row = |features: &[f32; STATIC]| {
            Row(std::array::from_fn(|unit| {
                (0..STATIC).fold(0.0, |sum, i| sum + features[i] * self.w1_static[i].0[unit])
            }))
        };
        StaticRows(features.iter().map(row).collect())
    }

    /// Standardised forces over density of the wet surfaces, in their order.
    ///
    /// `global` is standardised; `buffers` must be sized for at least as many surfaces as are wet.
    pub fn forward<'b>(
        &self,
        global: &[f32; GLOBAL],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &'b mut Buffers,
    ) -> &'b [[f32; OUTPUTS]] {
        match self.isa.0 {
            // SAFETY: `Isa` exists only where `Isa::available` found the CPU features.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { self.forward_avx512(global, statics, wet, buffers) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { self.forward_avx2(global, statics, wet, buffers) },
            #[cfg(target_arch = "aarch64")]
            Kind::Neon => self.forward_plain::<true>(global, statics, wet, buffers),
            Kind::Portable => self.forward_plain::<false>(global, statics, wet, buffers),
        }
        &buffers.outputs[..wet.len()]
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn forward_avx512(
        &self,
        global: &[f32; GLOBAL],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        self.layer1::<true>(global, statics, wet, buffers);
        let (h1, h2) = (&buffers.h1[..wet.len()], &mut buffers.h2[..wet.len()]);
        for (tile, weights) in self.w2.chunks_exact(self.isa.tile_width()).enumerate() {
            for_row_blocks!(14, h1, h2, |a, out| x86::tile_avx512(a, weights, &self.b2, tile, out));
        }
        self.layer3::<true>(wet.len(), buffers);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn forward_avx2(
        &self,
        global: &[f32; GLOBAL],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        self.layer1::<true>(global, statics, wet, buffers);
        let (h1, h2) = (&buffers.h1[..wet.len()], &mut buffers.h2[..wet.len()]);
        for (tile, weights) in self.w2.chunks_exact(self.isa.tile_width()).enumerate() {
            for_row_blocks!(6, h1, h2, |a, out| x86::tile_avx2(a, weights, &self.b2, tile, out));
        }
        self.layer3::<true>(wet.len(), buffers);
    }

    fn forward_plain<const FUSED: bool>(
        &self,
        global: &[f32; GLOBAL],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        self.layer1::<FUSED>(global, statics, wet, buffers);
        let (h1, h2) = (&buffers.h1[..wet.len()], &mut buffers.h2[..wet.len()]);
        for (tile, weights) in self.w2.chunks_exact(self.isa.tile_width()).enumerate() {
            for_row_blocks!(4, h1, h2, |a, out| tile_plain::<FUSED, _>(a, weights, &self.b2, tile, out));
        }
        self.layer3::<FUSED>(wet.len(), buffers);
    }

    #[inline(always)]
    fn layer1<const FUSED: bool>(
        &self,
        global: &[f32; GLOBAL],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        let sum = &mut buffers.global.0;
        *sum = self.b1.0;
        for (value, weights) in global.iter().zip(&self.w1_global) {
            for unit in 0..WIDTH {
                sum[unit] = multiply_add::<FUSED>(*value, weights.0[unit], sum[unit]);
            }
        }
        let [w0, w1, w2] = &self.w1_dynamic;
        for (row, surface) in buffers.h1.iter_mut().zip(wet) {
            let fixed = &statics.0[surface.surface].0;
            let [d0, d1, d2] = surface.dynamic;
            for unit in 0..WIDTH {
                let mut value = sum[unit] + fixed[unit];
                value = multiply_add::<FUSED>(d0, w0.0[unit], value);
                value = multiply_add::<FUSED>(d1, w1.0[unit], value);
                value = multiply_add::<FUSED>(d2, w2.0[unit], value);
                row.0[unit] = value.max(0.0);
            }
        }
    }

    #[inline(always)]
    fn layer3<const FUSED: bool>(&self, rows: usize, buffers: &mut Buffers) {
        for (row, out) in buffers.h2[..rows].iter().zip(&mut buffers.outputs) {
            for c in 0..OUTPUTS {
                out[c] = self.b3[c] + dot::<FUSED>(&row.0, &self.w3[c].0);
            }
        }
    }
}

/// Splits rows into the fewest blocks of at most `$most`, as equal as can be, and calls the tile with the length of the
/// block as a constant.
macro_rules! for_row_blocks {
    ($most:literal, $h1:ident, $h2:ident, |$a:ident, $out:ident| $tile:expr) => {{
        let mut blocks = $h1.len().div_ceil($most);
        let mut start = 0;
        while blocks > 0 {
            let rows = ($h1.len() - start).div_ceil(blocks);
            let (a, out) = (&$h1[start..start + rows], &mut $h2[start..start + rows]);
            for_row_blocks!(@match rows, a, out, |$a, $out| $tile, 1 2 3 4 5 6 7 8 9 10 11 12 13 14);
            start += rows;
            blocks -= 1;
        }
    }};
    (@match $rows:ident, $h1:ident, $h2:ident, |$a:ident, $out:ident| $tile:expr, $($n:literal)*) => {
        match $rows {
            $($n => {
                if let (Ok($a), Ok($out)) = (<&[Row; $n]>::try_from($h1), <&mut [Row; $n]>::try_from($h2)) {
                    $tile
                }
            })*
            _ => unreachable!("a block holds at most 14 rows"),
        }
    };
}
use for_row_blocks;

/// Packs row-major `[outputs, inputs]` weights as `[tile][input][column]`.
fn pack(weights: &[f32], tile_width: usize) -> Vec<Row> {
    let mut packed = vec![Row::ZERO; WIDTH];
    for (i, slot) in packed.iter_mut().flat_map(|row| &mut row.0).enumerate() {
        let (tile, within) = (i / (WIDTH * tile_width), i % (WIDTH * tile_width));
        let (input, column) = (within / tile_width, within % tile_width);
        *slot = weights[(tile * tile_width + column) * WIDTH + input];
    }
    packed
}

#[inline(always)]
fn multiply_add<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Dot product in sixteen interleaved sums, so that it vectorises, added up in a fixed order.
#[inline(always)]
fn dot<const FUSED: bool>(a: &[f32; WIDTH], b: &[f32; WIDTH]) -> f32 {
    let mut sums = [0.0; 16];
    for start in (0..WIDTH).step_by(16) {
        for lane in 0..16 {
            sums[lane] = multiply_add::<FUSED>(a[start + lane], b[start + lane], sums[lane]);
        }
    }
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
    }
    sums[0]
}

/// A tile of `R` rows by 16 columns of layer 2 with its bias and ReLU.
#[inline(always)]
fn tile_plain<const FUSED: bool, const R: usize>(
    h1: &[Row; R],
    weights: &[Row],
    bias: &Row,
    tile: usize,
    h2: &mut [Row; R],
) {
    const COLUMNS: usize = 16;
    let start = tile * COLUMNS;
    let mut sums = [[0.0; COLUMNS]; R];
    for row in &mut sums {
        row.copy_from_slice(&bias.0[start..start + COLUMNS]);
    }
    let columns = weights.iter().flat_map(|row| row.0.as_chunks::<COLUMNS>().0);
    for (input, columns) in columns.enumerate() {
        for (row, sums) in h1.iter().zip(&mut sums) {
            for (sum, weight) in sums.iter_mut().zip(columns) {
                *sum = multiply_add::<FUSED>(row.0[input], *weight, *sum);
            }
        }
    }
    for (row, sums) in h2.iter_mut().zip(&sums) {
        for (value, sum) in row.0[start..start + COLUMNS].iter_mut().zip(sums) {
            *value = sum.max(0.0);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        _mm256_fmadd_ps, _mm256_load_ps, _mm256_max_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_store_ps,
        _mm512_fmadd_ps, _mm512_load_ps, _mm512_max_ps, _mm512_set1_ps, _mm512_setzero_ps, _mm512_store_ps,
    };

    use super::{Row, WIDTH};

    /// Defines a tile of `R` rows by two vectors of columns: `2 R` sums stay in registers over all inputs.
    macro_rules! tile {
        ($name:ident, $features:literal, $lanes:literal, $load:ident, $store:ident, $set:ident, $zero:ident, $fma:ident,
         $max:ident) => {
            #[target_feature(enable = $features)]
            pub(super) fn $name<const R: usize>(
                h1: &[Row; R],
                weights: &[Row],
                bias: &Row,
                tile: usize,
                h2: &mut [Row; R],
            ) {
                const COLUMNS: usize = 2 * $lanes;
                let start = tile * COLUMNS;
                assert!(weights.len() * WIDTH == WIDTH * COLUMNS && start + COLUMNS <= WIDTH);
                let weights = weights.as_ptr().cast::<f32>();
                let bias = bias.0[start..].as_ptr();
                // SAFETY: the assertion keeps both loads inside `bias`; a row is aligned to 64 bytes and `start` is a
                // multiple of COLUMNS, so both addresses are aligned to a vector.
                let bias = unsafe { [$load(bias), $load(bias.add($lanes))] };
                let mut sums = [bias; R];
                for input in 0..WIDTH {
                    // SAFETY: the assertion makes `weights` WIDTH stretches of COLUMNS values, each aligned to a vector.
                    let (w0, w1) = unsafe {
                        let at = weights.add(input * COLUMNS);
                        ($load(at), $load(at.add($lanes)))
                    };
                    for r in 0..R {
                        let value = $set(h1[r].0[input]);
                        sums[r][0] = $fma(value, w0, sums[r][0]);
                        sums[r][1] = $fma(value, w1, sums[r][1]);
                    }
                }
                for r in 0..R {
                    let out = h2[r].0[start..start + COLUMNS].as_mut_ptr();
                    // SAFETY: the slice holds COLUMNS values and is aligned as `bias` is.
                    unsafe {
                        $store(out, $max(sums[r][0], $zero()));
                        $store(out.add($lanes), $max(sums[r][1], $zero()));
                    }
                }
            }
        };
    }

    tile!(
        tile_avx512,
        "avx512f",
        16,
        _mm512_load_ps,
        _mm512_store_ps,
        _mm512_set1_ps,
        _mm512_setzero_ps,
        _mm512_fmadd_ps,
        _mm512_max_ps
    );
    tile!(
        tile_avx2,
        "avx2,fma",
        8,
        _mm256_load_ps,
        _mm256_store_ps,
        _mm256_set1_ps,
        _mm256_setzero_ps,
        _mm256_fmadd_ps,
        _mm256_max_ps
    );
}

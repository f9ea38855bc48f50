//! The network's fast path: one call a query, over the wet surfaces alone.
//!
//! Layer 1 is split: the part of the global features is computed once a query, the part of a surface's static features
//! once a vehicle, and three features a surface are left. Layer 2, 97 % of the arithmetic, is a register-blocked matrix
//! product over packed weights. It leaves out the inputs that ReLU has made zero in every row of a block, 40 to 80 % of
//! them with trained weights: a block is a few rows, so that few keep each other's inputs alive. What is left out would
//! have added zero, so the sums have the same bits as without, each in the order of its inputs whatever the rows
//! beside it: a surface's force does not depend on which others are wet.
//!
//! The only arithmetic in the crate that is `unsafe`: the loads and stores of the vector tiles, and the calls that need
//! a CPU feature. [`Isa`] can be had from [`Isa::available`] alone, so holding one proves that the CPU has it.

#![allow(unsafe_code)]
#![allow(
    clippy::needless_range_loop,
    reason = "lanes in lock step, by index, are what the compiler vectorizes"
)]
#![allow(clippy::too_many_arguments, reason = "the arguments of a tile are registers")]

mod slopes;

use super::network::{Network, WIDTH};
pub use slopes::{DIRECTIONS, FeatureSlopes, SlopeBuffers};

/// Features of a surface that change with the state, at most.
pub const MAX_DYNAMIC: usize = 12;
/// Answers for a surface, at most.
pub const MAX_OUTPUTS: usize = 8;
/// Features that change with the state, at most: those of a surface, then those of the state.
const MAX_CHANGING: usize = MAX_DYNAMIC + 13;
/// Dynamic features that are multiplied in one pass over a row.
const PASS: usize = 3;

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
    /// Its features that change with the state; of these as many as the network has.
    pub dynamic: [f32; MAX_DYNAMIC],
}

/// The part of layer 1 that a vehicle's surfaces contribute whatever the state, a row a surface.
#[derive(Debug, Clone)]
pub struct StaticRows(Vec<Row>);

/// Rows that a block of layer 2 has at most: enough independent sums to hide the latency of a multiply-add, few enough
/// that most inputs are dead in all of them. By benches/query.rs on a Zen 4 core: 10.7 us a Husky query with 5, 11.0 with
/// 7, 16.5 with 14 and no input left out.
const BLOCK_ROWS: usize = 5;

/// Inputs of layer 2, by index, that are not zero in every row of a block.
#[derive(Debug, Clone, Copy)]
struct Live {
    rows: usize,
    inputs: [u8; WIDTH],
    count: usize,
}

// an index of a u8 cannot leave a row
const _: () = assert!(WIDTH == 256);

impl Live {
    #[inline(always)]
    fn of(rows: &[Row]) -> Self {
        let mut largest = [0.0_f32; WIDTH];
        for row in rows {
            for (largest, value) in largest.iter_mut().zip(&row.0) {
                *largest = largest.max(*value);
            }
        }
        let mut live = Self { rows: rows.len(), inputs: [0; WIDTH], count: 0 };
        for (input, largest) in (0..=u8::MAX).zip(largest) {
            // without a branch: a dead input's place is written over by the next
            live.inputs[live.count] = input;
            live.count += usize::from(largest > 0.0);
        }
        live
    }

    #[inline(always)]
    fn inputs(&self) -> impl Iterator<Item = usize> {
        self.inputs[..self.count].iter().map(|&input| usize::from(input))
    }
}

/// Working memory of a query, sized once for a number of surfaces.
#[derive(Debug, Clone)]
pub struct Buffers {
    global: Row,
    h1: Vec<Row>,
    h2: Vec<Row>,
    /// One entry a block of rows.
    live: Vec<Live>,
    outputs: Vec<[f32; MAX_OUTPUTS]>,
}

impl Buffers {
    /// Working memory for vehicles of up to `surfaces` surfaces.
    pub fn new(surfaces: usize) -> Self {
        Self {
            global: Row::ZERO,
            h1: vec![Row::ZERO; surfaces],
            h2: vec![Row::ZERO; surfaces],
            live: Vec::with_capacity(surfaces.div_ceil(BLOCK_ROWS)),
            outputs: vec![[0.0; MAX_OUTPUTS]; surfaces],
        }
    }

    /// What the network answered last for so many surfaces.
    pub fn outputs(&self, surfaces: usize) -> &[[f32; MAX_OUTPUTS]] {
        &self.outputs[..surfaces]
    }

    /// Splits rows into the fewest blocks of at most [`BLOCK_ROWS`], as equal as can be, and finds their live inputs.
    #[inline(always)]
    fn find_live(&mut self, rows: usize) {
        self.live.clear();
        let blocks = rows.div_ceil(BLOCK_ROWS);
        let mut start = 0;
        for left in (1..=blocks).rev() {
            let end = start + (rows - start).div_ceil(left);
            self.live.push(Live::of(&self.h1[start..end]));
            start = end;
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
    w1_global: Vec<Row>,
    /// In passes: a network with fewer features has zeros in the last.
    w1_dynamic: Vec<[Row; PASS]>,
    w1_static: Vec<Row>,
    /// Of each unit of layer 1 the weights of the dynamic features and of the global ones.
    w1_units: Vec<[f32; MAX_CHANGING]>,
    b1: Row,
    /// Tiles of columns, each with one stretch of `tile_width` weights an input: `[tile][input][column]`.
    w2: Vec<Row>,
    b2: Row,
    w3: Vec<Row>,
    b3: Vec<f32>,
}

impl Kernel {
    /// Packs a network whose tensors have the shapes that [`Network::tensors`] states. A row of its inputs is a
    /// surface's `fixed` features, then the `dynamic` ones, then the global ones.
    ///
    /// # Panics
    /// When the network has no dynamic features, or more of them or of outputs than there is room for.
    pub fn new(network: &Network, (fixed, dynamic): (usize, usize), isa: Isa) -> Self {
        assert!(
            (1..=MAX_DYNAMIC).contains(&dynamic)
                && network.inputs - fixed - dynamic <= MAX_CHANGING - MAX_DYNAMIC
                && network.outputs <= MAX_OUTPUTS,
            "the buffers have room for it"
        );
        let column =
            |input: usize| Row(std::array::from_fn(|unit| network.w1[unit * network.inputs + input]));
        let row = |values: &[f32]| Row(std::array::from_fn(|i| values[i]));
        let unit = |unit: usize| {
            let mut changing = [0.0; MAX_CHANGING];
            let weights = &network.w1[unit * network.inputs..][..network.inputs];
            changing[..dynamic].copy_from_slice(&weights[fixed..fixed + dynamic]);
            changing[MAX_DYNAMIC..][..network.inputs - fixed - dynamic]
                .copy_from_slice(&weights[fixed + dynamic..]);
            changing
        };
        let pass = |first: usize| {
            let column = |i| if first + i < dynamic { column(fixed + first + i) } else { Row::ZERO };
            std::array::from_fn(column)
        };
        Self {
            isa,
            w1_static: (0..fixed).map(column).collect(),
            w1_units: (0..WIDTH).map(unit).collect(),
            w1_dynamic: (0..dynamic).step_by(PASS).map(pass).collect(),
            w1_global: (fixed + dynamic..network.inputs).map(column).collect(),
            b1: row(&network.b1),
            w2: pack(&network.w2, isa.tile_width()),
            b2: row(&network.b2),
            w3: network.w3.chunks_exact(WIDTH).map(row).collect(),
            b3: network.b3.clone(),
        }
    }

    /// The instruction set in use.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// What the static features of a vehicle's surfaces contribute to layer 1.
    pub fn static_rows<const STATIC: usize>(&self, features: &[[f32; STATIC]]) -> StaticRows {
        let row = |features: &[f32; STATIC]| {
            Row(std::array::from_fn(|unit| {
                features.iter().zip(&self.w1_static).fold(0.0, |sum, (x, weights)| sum + x * weights.0[unit])
            }))
        };
        StaticRows(features.iter().map(row).collect())
    }

    /// What the network answers for the wet surfaces, in their order; only as many of the numbers as it has outputs
    /// mean anything.
    ///
    /// `global` is standardised; `buffers` must be sized for at least as many surfaces as are wet.
    pub fn forward<'b>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &'b mut Buffers,
    ) -> &'b [[f32; MAX_OUTPUTS]] {
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
        buffers.outputs(wet.len())
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn forward_avx512(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        self.layer1::<true>(global, statics, wet, buffers);
        buffers.find_live(wet.len());
        let Buffers { h1, h2, live, .. } = buffers;
        // tiles outside: a tile's weights stay in the first-level cache while all blocks use them
        for (tile, weights) in self.w2.chunks_exact(self.isa.tile_width()).enumerate() {
            for_row_blocks!(h1, h2, live, |a, block, out| {
                x86::tile_avx512(a, block, weights, &self.b2, tile, out);
            });
        }
        self.layer3::<true>(wet.len(), buffers);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn forward_avx2(&self, global: &[f32], statics: &StaticRows, wet: &[WetSurface], buffers: &mut Buffers) {
        self.layer1::<true>(global, statics, wet, buffers);
        buffers.find_live(wet.len());
        let Buffers { h1, h2, live, .. } = buffers;
        // tiles outside: a tile's weights stay in the first-level cache while all blocks use them
        for (tile, weights) in self.w2.chunks_exact(self.isa.tile_width()).enumerate() {
            for_row_blocks!(h1, h2, live, |a, block, out| {
                x86::tile_avx2(a, block, weights, &self.b2, tile, out);
            });
        }
        self.layer3::<true>(wet.len(), buffers);
    }

    fn forward_plain<const FUSED: bool>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        self.layer1::<FUSED>(global, statics, wet, buffers);
        buffers.find_live(wet.len());
        let Buffers { h1, h2, live, .. } = buffers;
        // tiles outside: a tile's weights stay in the first-level cache while all blocks use them
        for (tile, weights) in self.w2.chunks_exact(self.isa.tile_width()).enumerate() {
            for_row_blocks!(h1, h2, live, |a, block, out| {
                tile_plain::<FUSED, _>(a, block, weights, &self.b2, tile, out);
            });
        }
        self.layer3::<FUSED>(wet.len(), buffers);
    }

    #[inline(always)]
    fn layer1<const FUSED: bool>(
        &self,
        global: &[f32],
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
        for (row, surface) in buffers.h1.iter_mut().zip(wet) {
            let fixed = &statics.0[surface.surface].0;
            let mut passes = self.w1_dynamic.iter().zip(surface.dynamic.as_chunks().0);
            let last = self.w1_dynamic.len() - 1;
            if let Some((weights, features)) = passes.next() {
                let floor = if last == 0 { 0.0 } else { f32::NEG_INFINITY };
                for unit in 0..WIDTH {
                    let value = sum[unit] + fixed[unit];
                    row.0[unit] = add_pass::<FUSED>(value, features, weights, unit).max(floor);
                }
            }
            for (index, (weights, features)) in passes.enumerate() {
                let floor = if index + 1 == last { 0.0 } else { f32::NEG_INFINITY };
                for unit in 0..WIDTH {
                    let value = row.0[unit];
                    row.0[unit] = add_pass::<FUSED>(value, features, weights, unit).max(floor);
                }
            }
        }
    }

    #[inline(always)]
    fn layer3<const FUSED: bool>(&self, rows: usize, buffers: &mut Buffers) {
        for (row, out) in buffers.h2[..rows].iter().zip(&mut buffers.outputs) {
            for ((out, weights), bias) in out.iter_mut().zip(&self.w3).zip(&self.b3) {
                *out = bias + dot::<FUSED>(&row.0, &weights.0);
            }
        }
    }
}

/// Runs the body for each block of rows with its live inputs, the length of the block as a constant.
macro_rules! for_row_blocks {
    ($h1:ident, $h2:ident, $live:ident, |$a:ident, $block:ident, $out:ident| $body:expr) => {{
        let mut start = 0;
        for $block in $live.iter() {
            let (a, out) = (&$h1[start..start + $block.rows], &mut $h2[start..start + $block.rows]);
            for_row_blocks!(@match $block, a, out, |$a, $out| $body, 1 2 3 4 5);
            start += $block.rows;
        }
    }};
    (@match $block:ident, $h1:ident, $h2:ident, |$a:ident, $out:ident| $body:expr, $($n:literal)*) => {
        match $block.rows {
            $($n => {
                if let (Ok($a), Ok($out)) = (<&[Row; $n]>::try_from($h1), <&mut [Row; $n]>::try_from($h2)) {
                    $body
                }
            })*
            _ => unreachable!("a block holds at most BLOCK_ROWS rows"),
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

/// What the features of a pass add to a unit.
#[inline(always)]
fn add_pass<const FUSED: bool>(
    value: f32,
    features: &[f32; PASS],
    weights: &[Row; PASS],
    unit: usize,
) -> f32 {
    let [(d0, w0), (d1, w1), (d2, w2)] = [0, 1, 2].map(|i| (features[i], weights[i].0[unit]));
    multiply_add::<FUSED>(d2, w2, multiply_add::<FUSED>(d1, w1, multiply_add::<FUSED>(d0, w0, value)))
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
    live: &Live,
    weights: &[Row],
    bias: &Row,
    tile: usize,
    h2: &mut [Row; R],
) {
    const COLUMNS: usize = 16;
    let start = tile * COLUMNS;
    for (row, out) in h1.iter().zip(h2) {
        let mut sums = [0.0; COLUMNS];
        sums.copy_from_slice(&bias.0[start..start + COLUMNS]);
        for input in live.inputs() {
            let columns = &weights[input / COLUMNS].0.as_chunks::<COLUMNS>().0[input % COLUMNS];
            for lane in 0..COLUMNS {
                sums[lane] = multiply_add::<FUSED>(row.0[input], columns[lane], sums[lane]);
            }
        }
        for lane in 0..COLUMNS {
            out.0[start + lane] = sums[lane].max(0.0);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        _mm256_fmadd_ps, _mm256_load_ps, _mm256_max_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_store_ps,
        _mm512_fmadd_ps, _mm512_load_ps, _mm512_max_ps, _mm512_set1_ps, _mm512_setzero_ps, _mm512_store_ps,
    };

    use super::{Live, Row, WIDTH};

    /// Defines a tile of `R` rows by two vectors of columns: `2 R` sums stay in registers over all inputs.
    macro_rules! tile {
        ($name:ident, $features:literal, $lanes:literal, $load:ident, $store:ident, $set:ident, $zero:ident, $fma:ident,
         $max:ident) => {
            #[target_feature(enable = $features)]
            pub(super) fn $name<const R: usize>(
                h1: &[Row; R],
                live: &Live,
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
                for input in live.inputs() {
                    // SAFETY: `input` came from a u8 and is below WIDTH; the assertion makes `weights` WIDTH stretches of
                    // COLUMNS values, each aligned to a vector.
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

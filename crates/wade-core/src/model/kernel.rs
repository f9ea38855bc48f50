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

use std::ops::Range;

use super::network::{MAX_WIDTH, Network, WIDTHS};
pub use slopes::{DIRECTIONS, FeatureSlopes, SlopeBuffers};

/// Features of a surface that change with the state, at most.
pub const MAX_DYNAMIC: usize = 12;
/// Answers for a surface, at most.
pub const MAX_OUTPUTS: usize = 8;
/// Features that change with the state, at most: those of a surface, then those of the state.
const MAX_CHANGING: usize = MAX_DYNAMIC + 13;

/// Units in a cache line.
const LANES: usize = 16;
/// Lines of the widest row.
const MAX_LINES: usize = MAX_WIDTH / LANES;

/// A cache line of activations or weights.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Line([f32; LANES]);

impl Line {
    const ZERO: Self = Self([0.0; LANES]);
}

/// One number for each unit of a hidden layer.
type Row<const LINES: usize> = [Line; LINES];

/// Whole rows of stored lines.
#[inline(always)]
fn rows<const LINES: usize>(lines: &[Line]) -> &[Row<LINES>] {
    lines.as_chunks().0
}

/// Lines of a row of as many numbers as there are lanes in these lines.
fn lines(values: impl IntoIterator<Item = f32>) -> Vec<Line> {
    let values: Vec<f32> = values.into_iter().collect();
    values.as_chunks().0.iter().map(|values| Line(*values)).collect()
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
pub struct StaticRows(Vec<Line>);

/// Rows that a block of layer 2 has at most: enough independent sums to hide the latency of a multiply-add, few enough
/// that most inputs are dead in all of them. By benches/query.rs on a Zen 4 core: 10.7 us a Husky query with 5, 11.0 with
/// 7, 16.5 with 14 and no input left out.
const BLOCK_ROWS: usize = 5;

/// Inputs of layer 2, by index, that are not zero in every row of a block.
#[derive(Debug, Clone, Copy)]
struct Live {
    rows: usize,
    inputs: [u8; MAX_WIDTH],
    count: usize,
}

// a u8 counts the units of the widest row
const _: () = assert!(MAX_WIDTH == 256);

impl Live {
    #[inline(always)]
    fn of<const LINES: usize>(rows: &[Row<LINES>]) -> Self {
        let mut largest = [Line::ZERO; LINES];
        for row in rows {
            for line in 0..LINES {
                for lane in 0..LANES {
                    largest[line].0[lane] = largest[line].0[lane].max(row[line].0[lane]);
                }
            }
        }
        let mut live = Self { rows: rows.len(), inputs: [0; MAX_WIDTH], count: 0 };
        for line in 0..LINES {
            for lane in 0..LANES {
                // without a branch: a dead input's place is written over by the next
                live.inputs[live.count] = (line * LANES + lane) as u8;
                live.count += usize::from(largest[line].0[lane] > 0.0);
            }
        }
        live
    }

    /// Inputs that are not zero, each below the width of a row of so many lines.
    #[inline(always)]
    fn inputs<const LINES: usize>(&self) -> impl Iterator<Item = usize> {
        self.inputs[..self.count].iter().map(|&input| usize::from(input) % (LINES * LANES))
    }
}

/// Working memory of a query, sized once for a number of surfaces.
#[derive(Debug, Clone)]
pub struct Buffers {
    global: Row<MAX_LINES>,
    h1: Vec<Line>,
    h2: Vec<Line>,
    /// One entry a block of rows.
    live: Vec<Live>,
    outputs: Vec<[f32; MAX_OUTPUTS]>,
}

impl Buffers {
    /// Working memory for vehicles of up to `surfaces` surfaces.
    pub fn new(surfaces: usize) -> Self {
        Self {
            global: [Line::ZERO; MAX_LINES],
            h1: vec![Line::ZERO; surfaces * MAX_LINES],
            h2: vec![Line::ZERO; surfaces * MAX_LINES],
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
    fn find_live<const LINES: usize>(&mut self, count: usize) {
        self.live.clear();
        let blocks = count.div_ceil(BLOCK_ROWS);
        let mut start = 0;
        for left in (1..=blocks).rev() {
            let end = start + (count - start).div_ceil(left);
            self.live.push(Live::of::<LINES>(&rows(&self.h1)[start..end]));
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
    /// Cache lines of a row.
    lines: usize,
    w1_global: Vec<Line>,
    w1_dynamic: Vec<Line>,
    w1_static: Vec<Line>,
    /// Of each unit of layer 1 the weights of the dynamic features and of the global ones.
    w1_units: Vec<[f32; MAX_CHANGING]>,
    b1: Vec<Line>,
    /// Tiles of columns, each with one stretch of `tile_width` weights an input: `[tile][input][column]`.
    w2: Vec<Line>,
    b2: Vec<Line>,
    w3: Vec<Line>,
    b3: Vec<f32>,
}

impl Kernel {
    /// Packs a network whose tensors have the shapes that [`Network::tensors`] states. A row of its inputs is a
    /// surface's `fixed` features, then the `dynamic` ones, then the global ones.
    ///
    /// # Panics
    /// When the network has no dynamic features, more of them or of outputs than there is room for, or a width that is not one
    /// of [`WIDTHS`].
    pub fn new(network: &Network, (fixed, dynamic): (usize, usize), isa: Isa) -> Self {
        assert!(
            (1..=MAX_DYNAMIC).contains(&dynamic)
                && network.inputs - fixed - dynamic <= MAX_CHANGING - MAX_DYNAMIC
                && network.outputs <= MAX_OUTPUTS,
            "the buffers have room for it"
        );
        assert!(WIDTHS.contains(&network.width), "there is a kernel for the width");
        let width = network.width;
        let column = |input: usize| (0..width).map(move |unit| network.w1[unit * network.inputs + input]);
        let columns = |inputs: Range<usize>| lines(inputs.flat_map(column));
        let unit = |unit: usize| {
            let mut changing = [0.0; MAX_CHANGING];
            let weights = &network.w1[unit * network.inputs..][..network.inputs];
            changing[..dynamic].copy_from_slice(&weights[fixed..fixed + dynamic]);
            changing[MAX_DYNAMIC..][..network.inputs - fixed - dynamic]
                .copy_from_slice(&weights[fixed + dynamic..]);
            changing
        };
        Self {
            isa,
            lines: width / LANES,
            w1_static: columns(0..fixed),
            w1_units: (0..width).map(unit).collect(),
            w1_dynamic: columns(fixed..fixed + dynamic),
            w1_global: columns(fixed + dynamic..network.inputs),
            b1: lines(network.b1.iter().copied()),
            w2: pack(&network.w2, width, isa.tile_width()),
            b2: lines(network.b2.iter().copied()),
            w3: lines(network.w3.iter().copied()),
            b3: network.b3.clone(),
        }
    }

    /// The instruction set in use.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// What the static features of a vehicle's surfaces contribute to layer 1.
    pub fn static_rows<const STATIC: usize>(&self, features: &[[f32; STATIC]]) -> StaticRows {
        let of_line = |features: &[f32; STATIC], line: usize| {
            let weights = self.w1_static.iter().skip(line).step_by(self.lines);
            features.iter().zip(weights).fold(Line::ZERO, |sum, (x, weights)| {
                Line(std::array::from_fn(|lane| sum.0[lane] + x * weights.0[lane]))
            })
        };
        StaticRows(features.iter().flat_map(|x| (0..self.lines).map(move |line| of_line(x, line))).collect())
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
        match self.lines {
            2 => self.forward_wide::<2>(global, statics, wet, buffers),
            4 => self.forward_wide::<4>(global, statics, wet, buffers),
            8 => self.forward_wide::<8>(global, statics, wet, buffers),
            16 => self.forward_wide::<16>(global, statics, wet, buffers),
            _ => unreachable!("`new` takes only widths that there is a kernel for"),
        }
        buffers.outputs(wet.len())
    }

    #[inline(always)]
    fn forward_wide<const LINES: usize>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        match self.isa.0 {
            // SAFETY: `Isa` exists only where `Isa::available` found the CPU features.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { self.forward_avx512::<LINES>(global, statics, wet, buffers) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { self.forward_avx2::<LINES>(global, statics, wet, buffers) },
            #[cfg(target_arch = "aarch64")]
            Kind::Neon => self.forward_plain::<true, LINES>(global, statics, wet, buffers),
            Kind::Portable => self.forward_plain::<false, LINES>(global, statics, wet, buffers),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn forward_avx512<const LINES: usize>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        layers!(self, true, (global, statics, wet, buffers), x86::tile_avx512);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn forward_avx2<const LINES: usize>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        layers!(self, true, (global, statics, wet, buffers), x86::tile_avx2);
    }

    fn forward_plain<const FUSED: bool, const LINES: usize>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        layers!(self, FUSED, (global, statics, wet, buffers), tile_plain::<FUSED, _, _>);
    }

    #[inline(always)]
    fn layer1<const FUSED: bool, const LINES: usize>(
        &self,
        global: &[f32],
        statics: &StaticRows,
        wet: &[WetSurface],
        buffers: &mut Buffers,
    ) {
        let sum = &mut buffers.global.as_chunks_mut::<LINES>().0[0];
        *sum = rows(&self.b1)[0];
        for (value, weights) in global.iter().zip(rows::<LINES>(&self.w1_global)) {
            for line in 0..LINES {
                for lane in 0..LANES {
                    let sum = &mut sum[line].0[lane];
                    *sum = multiply_add::<FUSED>(*value, weights[line].0[lane], *sum);
                }
            }
        }
        let (fixed, told) = (rows::<LINES>(&statics.0), rows::<LINES>(&self.w1_dynamic));
        for (row, surface) in buffers.h1.as_chunks_mut::<LINES>().0.iter_mut().zip(wet) {
            let fixed = &fixed[surface.surface];
            for line in 0..LINES {
                let mut units = [0.0; LANES];
                for lane in 0..LANES {
                    units[lane] = sum[line].0[lane] + fixed[line].0[lane];
                }
                for (value, weights) in surface.dynamic.iter().zip(told) {
                    for lane in 0..LANES {
                        units[lane] = multiply_add::<FUSED>(*value, weights[line].0[lane], units[lane]);
                    }
                }
                row[line] = Line(units.map(|unit| unit.max(0.0)));
            }
        }
    }

    #[inline(always)]
    fn layer3<const FUSED: bool, const LINES: usize>(&self, count: usize, buffers: &mut Buffers) {
        let Buffers { h2, outputs, .. } = buffers;
        for (row, out) in rows::<LINES>(h2)[..count].iter().zip(outputs) {
            for ((out, weights), bias) in out.iter_mut().zip(rows(&self.w3)).zip(&self.b3) {
                *out = bias + dot::<FUSED, LINES>(row, weights);
            }
        }
    }
}

/// The three layers, layer 2 by tiles of one instruction set.
macro_rules! layers {
    ($kernel:ident, $fused:tt, ($global:ident, $statics:ident, $wet:ident, $buffers:ident), $tile:expr) => {{
        $kernel.layer1::<$fused, LINES>($global, $statics, $wet, $buffers);
        $buffers.find_live::<LINES>($wet.len());
        let Buffers { h1, h2, live, .. } = $buffers;
        let (h1, h2, bias) = (rows(h1), h2.as_chunks_mut().0, &rows(&$kernel.b2)[0]);
        // tiles outside: a tile's weights stay in the first-level cache while all blocks use them
        for (tile, weights) in $kernel.w2.chunks_exact($kernel.isa.tile_width() * LINES).enumerate() {
            for_row_blocks!(h1, h2, live, |a, block, out| {
                $tile(a, block, weights, bias, tile, out);
            });
        }
        $kernel.layer3::<$fused, LINES>($wet.len(), $buffers);
    }};
}
use layers;

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
                if let (Ok($a), Ok($out)) = (<&[Row<LINES>; $n]>::try_from($h1), <&mut [Row<LINES>; $n]>::try_from($h2)) {
                    $body
                }
            })*
            _ => unreachable!("a block holds at most BLOCK_ROWS rows"),
        }
    };
}
use for_row_blocks;

/// Packs row-major `[outputs, inputs]` weights as `[tile][input][column]`.
fn pack(weights: &[f32], width: usize, tile_width: usize) -> Vec<Line> {
    let place = |i: usize| {
        let (tile, within) = (i / (width * tile_width), i % (width * tile_width));
        let (input, column) = (within / tile_width, within % tile_width);
        weights[(tile * tile_width + column) * width + input]
    };
    lines((0..width * width).map(place))
}

#[inline(always)]
fn multiply_add<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Dot product in sixteen interleaved sums, so that it vectorises, added up in a fixed order.
#[inline(always)]
fn dot<const FUSED: bool, const LINES: usize>(a: &Row<LINES>, b: &Row<LINES>) -> f32 {
    let mut sums = [0.0; LANES];
    for line in 0..LINES {
        for lane in 0..LANES {
            sums[lane] = multiply_add::<FUSED>(a[line].0[lane], b[line].0[lane], sums[lane]);
        }
    }
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
    }
    sums[0]
}

/// A tile of `R` rows by a line of columns of layer 2 with its bias and ReLU.
#[inline(always)]
fn tile_plain<const FUSED: bool, const R: usize, const LINES: usize>(
    h1: &[Row<LINES>; R],
    live: &Live,
    weights: &[Line],
    bias: &Row<LINES>,
    tile: usize,
    h2: &mut [Row<LINES>; R],
) {
    for (row, out) in h1.iter().zip(h2) {
        let mut sums = bias[tile].0;
        for input in live.inputs::<LINES>() {
            let (value, columns) = (row[input / LANES].0[input % LANES], &weights[input].0);
            for lane in 0..LANES {
                sums[lane] = multiply_add::<FUSED>(value, columns[lane], sums[lane]);
            }
        }
        out[tile] = Line(sums.map(|sum| sum.max(0.0)));
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        _mm256_fmadd_ps, _mm256_load_ps, _mm256_max_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_store_ps,
        _mm512_fmadd_ps, _mm512_load_ps, _mm512_max_ps, _mm512_set1_ps, _mm512_setzero_ps, _mm512_store_ps,
    };

    use super::{LANES, Line, Live, Row};

    /// Defines a tile of `R` rows by two vectors of columns: `2 R` sums stay in registers over all inputs.
    macro_rules! tile {
        ($name:ident, $features:literal, $lanes:literal, $load:ident, $store:ident, $set:ident, $zero:ident, $fma:ident,
         $max:ident) => {
            #[target_feature(enable = $features)]
            pub(super) fn $name<const R: usize, const LINES: usize>(
                h1: &[Row<LINES>; R],
                live: &Live,
                weights: &[Line],
                bias: &Row<LINES>,
                tile: usize,
                h2: &mut [Row<LINES>; R],
            ) {
                const COLUMNS: usize = 2 * $lanes;
                // of a row, the lines of this tile's columns
                let start = tile * COLUMNS / LANES;
                assert!(weights.len() == LINES * COLUMNS && start + COLUMNS / LANES <= LINES);
                let weights = weights.as_ptr().cast::<f32>();
                let bias = bias[start..].as_ptr().cast::<f32>();
                // SAFETY: the assertion keeps both loads inside `bias`; a line is aligned to 64 bytes and COLUMNS is a multiple
                // of its lanes, so both addresses are aligned to a vector.
                let bias = unsafe { [$load(bias), $load(bias.add($lanes))] };
                let mut sums = [bias; R];
                for input in live.inputs::<LINES>() {
                    // SAFETY: `input` is below the width of a row; the assertion makes `weights` as many stretches of COLUMNS
                    // values, each aligned to a vector.
                    let (w0, w1) = unsafe {
                        let at = weights.add(input * COLUMNS);
                        ($load(at), $load(at.add($lanes)))
                    };
                    for r in 0..R {
                        let value = $set(h1[r][input / LANES].0[input % LANES]);
                        sums[r][0] = $fma(value, w0, sums[r][0]);
                        sums[r][1] = $fma(value, w1, sums[r][1]);
                    }
                }
                for r in 0..R {
                    let out = h2[r][start..start + COLUMNS / LANES].as_mut_ptr().cast::<f32>();
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

//! The backward pass against central differences in double precision, for every tensor and every term of the loss.

use nalgebra::DMatrix;
use wade_learn::random::Random;
use wade_learn::train::layers::{Layers, Sizes};
use wade_learn::train::loss::{Batch, LossConfig, TargetScale, loss};

/// None of them those of the served network: the layers know no feature.
const SIZES: Sizes = Sizes { inputs: 21, width: 16, outputs: 3 };
const SURFACES: usize = 5;
const SAMPLES: usize = 3;

fn batch(random: &mut Random) -> Batch<f64> {
    let columns = SAMPLES * SURFACES;
    let mut draw = |rows| DMatrix::from_fn(rows, columns, |_, _| 2.0 * random.unit() - 1.0);
    let (inputs, targets) = (draw(SIZES.inputs), draw(3));
    Batch { surfaces: SURFACES, inputs, targets, dry: (0..columns).map(|i| i % 4 == 1).collect() }
}

fn total(layers: &Layers<f64>, config: &LossConfig, batch: &Batch<f64>) -> f64 {
    loss(config, &SCALE, batch, &batch.counts(), &layers.forward(&batch.inputs).output).0.total(config)
}

const SCALE: TargetScale<f64> = TargetScale { std: [0.3, 1.7, 0.9], mean: [0.1, -0.2, 0.4] };

#[test]
fn agrees_with_finite_differences() {
    let only =
        |alpha, net_weight, dry_weight| LossConfig { alpha, net_weight, dry_weight, ..LossConfig::default() };
    let hybrid_off = LossConfig { epsilon: 1e30, ..only(1.0, 0.0, 0.0) };
    let terms = [
        ("squared", only(0.0, 0.0, 0.0)),
        ("relative", only(1.0, 0.0, 0.0)),
        ("net", LossConfig { net_weight: 1.0, ..hybrid_off }),
        ("dry", LossConfig { dry_weight: 1.0, ..hybrid_off }),
        ("all", LossConfig::default()),
    ];
    let mut random = Random::new(11);
    let layers = Layers::<f64>::random(SIZES, &mut random);
    let batch = batch(&mut random);
    for (term, config) in terms {
        check(term, &config, &layers, &batch);
    }
}

fn check(term: &str, config: &LossConfig, layers: &Layers<f64>, batch: &Batch<f64>) {
    let activations = layers.forward(&batch.inputs);
    let (_, by_output) = loss(config, &SCALE, batch, &batch.counts(), &activations.output);
    let mut gradient = vec![f64::NAN; layers.parameters.len()];
    layers.backward(&batch.inputs, &activations, &by_output, &mut gradient);
    for (tensor, range) in ["w1", "b1", "w2", "b2", "w3", "b3"].iter().zip(SIZES.ranges()) {
        let size = gradient[range.clone()].iter().fold(0.0_f64, |size, g| size.max(g.abs()));
        assert!(size > 0.0, "{term}: no gradient by {tensor}");
        for i in range {
            let numeric = central_difference(layers, i, |l| total(l, config, batch));
            let error = (gradient[i] - numeric).abs();
            assert!(error < 1e-6 * size, "{term}, {tensor}[{i}]: {} against {numeric}", gradient[i]);
        }
    }
}

fn central_difference(layers: &Layers<f64>, i: usize, f: impl Fn(&Layers<f64>) -> f64) -> f64 {
    let step = 1e-5;
    let moved = |by: f64| {
        let mut layers = layers.clone();
        layers.parameters[i] += by;
        f(&layers)
    };
    (moved(step) - moved(-step)) / (2.0 * step)
}

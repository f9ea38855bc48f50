//! Adam (Kingma, Ba, ICLR 2015) and the halving of its learning rate on a plateau.

/// Decay of the mean of the gradient.
const BETA1: f32 = 0.9;
/// Decay of the mean of its square.
const BETA2: f32 = 0.999;
/// Keeps a step finite where the gradient vanishes.
const EPSILON: f32 = 1e-8;

/// The state of the optimizer, one entry a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Adam {
    /// Steps taken.
    pub steps: i32,
    /// Running mean of the gradient.
    pub mean: Vec<f32>,
    /// Running mean of its square.
    pub square: Vec<f32>,
}

impl Adam {
    /// Starts at rest.
    pub fn new(parameters: usize) -> Self {
        Self { steps: 0, mean: vec![0.0; parameters], square: vec![0.0; parameters] }
    }

    /// One step down the gradient.
    ///
    /// `decay`, a share of the rate, pulls the parameters towards zero beside the gradient (Loshchilov, Hutter, ICLR 2019).
    pub fn step(&mut self, rate: f64, decay: f64, parameters: &mut [f32], gradient: &[f32]) {
        self.steps = self.steps.saturating_add(1);
        let keep = (1.0 - rate * decay) as f32;
        let unbias = |beta: f32| 1.0 - f64::from(beta).powi(self.steps);
        let rate = (rate / unbias(BETA1)) as f32;
        let square_scale = unbias(BETA2).sqrt().recip() as f32;
        let state = self.mean.iter_mut().zip(&mut self.square);
        for ((p, g), (m, v)) in parameters.iter_mut().zip(gradient).zip(state) {
            *m += (1.0 - BETA1) * (g - *m);
            *v += (1.0 - BETA2) * (g * g - *v);
            *p = *p * keep - rate * *m / (v.sqrt() * square_scale + EPSILON);
        }
    }
}

/// A learning rate that is halved when the held-out loss has not improved for some epochs.
#[derive(Debug, Clone, PartialEq)]
pub struct Plateau {
    /// The rate now.
    pub rate: f64,
    /// Epochs that it waits.
    pub patience: u32,
    /// The least loss so far.
    pub best: f64,
    /// Epochs since then, or since the last halving.
    pub waited: u32,
}

impl Plateau {
    /// Starts with `rate` and waits for `patience` epochs.
    pub fn new(rate: f64, patience: u32) -> Self {
        Self { rate, patience, best: f64::INFINITY, waited: 0 }
    }

    /// Takes note of the loss of an epoch.
    pub fn observe(&mut self, loss: f64) {
        if loss < self.best {
            (self.best, self.waited) = (loss, 0);
            return;
        }
        self.waited += 1;
        if self.waited >= self.patience {
            (self.rate, self.waited) = (0.5 * self.rate, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_has_the_length_of_the_rate() {
        let (mut adam, mut parameters) = (Adam::new(2), [1.0, 1.0]);
        adam.step(0.01, 0.0, &mut parameters, &[5.0, -1e-3]);
        assert!((parameters[0] - 0.99).abs() < 1e-6 && (parameters[1] - 1.01).abs() < 1e-6);
    }

    #[test]
    fn the_rate_halves_after_the_patience_and_not_before() {
        let mut plateau = Plateau::new(1.0, 2);
        for (loss, rate) in
            [(3.0, 1.0), (3.0, 1.0), (2.0, 1.0), (2.5, 1.0), (2.5, 0.5), (2.5, 0.5), (2.5, 0.25)]
        {
            plateau.observe(loss);
            assert_eq!(plateau.rate, rate);
        }
    }
}

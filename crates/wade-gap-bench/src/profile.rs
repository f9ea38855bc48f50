//! A quantity over time with its exact first two derivatives.

/// A smooth change from 0 to `by` (a quintic with two continuous derivatives).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    start: f64,
    duration: f64,
    by: f64,
}

/// `amplitude sin(rate t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wave {
    amplitude: f64,
    rate: f64,
}

/// A constant, steps and waves.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Profile {
    constant: f64,
    steps: Vec<Step>,
    waves: Vec<Wave>,
}

impl Profile {
    /// The same at all times.
    pub fn constant(constant: f64) -> Self {
        Self { constant, ..Self::default() }
    }

    /// With a change of `by` that begins at `start` and takes `duration` [s].
    pub fn step(mut self, start: f64, duration: f64, by: f64) -> Self {
        self.steps.push(Step { start, duration, by });
        self
    }

    /// With `amplitude sin(rate t)`.
    pub fn wave(mut self, amplitude: f64, rate: f64) -> Self {
        self.waves.push(Wave { amplitude, rate });
        self
    }

    /// Times a factor.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.constant *= factor;
        self.steps.iter_mut().for_each(|step| step.by *= factor);
        self.waves.iter_mut().for_each(|wave| wave.amplitude *= factor);
        self
    }

    /// Value, first and second derivative.
    pub fn at(&self, t: f64) -> [f64; 3] {
        let mut sum = [self.constant, 0.0, 0.0];
        for Step { start, duration, by } in &self.steps {
            let u = ((t - start) / duration).clamp(0.0, 1.0);
            sum[0] += by * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            sum[1] += by / duration * 30.0 * u * u * (1.0 - u) * (1.0 - u);
            sum[2] += by / (duration * duration) * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u);
        }
        for Wave { amplitude, rate } in &self.waves {
            let (sine, cosine) = (rate * t).sin_cos();
            sum[0] += amplitude * sine;
            sum[1] += amplitude * rate * cosine;
            sum[2] -= amplitude * rate * rate * sine;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn derivatives_belong_to_the_value() {
        let profile = Profile::constant(0.3).step(0.5, 0.8, 1.2).step(1.1, 0.5, -2.0).wave(0.4, 3.0);
        let h = 1e-5;
        for t in [0.2, 0.7, 1.25, 1.9] {
            let [_, rate, curvature] = profile.at(t);
            let difference = (profile.at(t + h)[0] - profile.at(t - h)[0]) / (2.0 * h);
            let second = (profile.at(t + h)[1] - profile.at(t - h)[1]) / (2.0 * h);
            assert!((rate - difference).abs() < 1e-7 && (curvature - second).abs() < 1e-6, "{t}");
        }
    }
}

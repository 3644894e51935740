//! A small neural network: channels to targets through two layers, as a yardstick.
//!
//! y = W₃ tanh(W₂ tanh(W₁ z)), each layer with its offsets, trained on the squared error by Adam
//! (D. P. Kingma and J. Ba, ICLR 2015) in batches whose order follows from the seed alone: the
//! same rows give the same network.

use taxel_numerics::Noise;

/// Neurons of a layer, rows of a batch, first and last rate.
const HIDDEN: usize = 32;
const BATCH: usize = 32;
const RATES: [f64; 2] = [5e-3, 1e-4];
/// Times through all rows: the most, the fewest, and rows learned in all between them. Many rows
/// need fewer times.
const EPOCHS: [usize; 2] = [150, 20];
const LEARNED: usize = 400_000;

/// A layer of neurons, row by row: the weights of one neuron, its offset last.
#[derive(Debug, Clone)]
struct Layer {
    inputs: usize,
    weights: Vec<f64>,
    /// Sums of Adam: of the gradient and of its square.
    moments: [Vec<f64>; 2],
    gradient: Vec<f64>,
}

/// A trained network.
#[derive(Debug, Clone)]
pub(super) struct Network {
    layers: [Layer; 3],
}

impl Layer {
    fn new(inputs: usize, outputs: usize, noise: &mut Noise) -> Self {
        let scale = 1.0 / (inputs as f64).sqrt();
        let row = inputs + 1;
        let weight = |k: usize, noise: &mut Noise| {
            if k % row == inputs {
                0.0
            } else {
                scale * noise.normal()
            }
        };
        let count = outputs * row;
        Self {
            inputs,
            weights: (0..count).map(|k| weight(k, noise)).collect(),
            moments: [vec![0.0; count], vec![0.0; count]],
            gradient: vec![0.0; count],
        }
    }

    fn forward(&self, input: &[f64]) -> Vec<f64> {
        let neurons = self.weights.chunks_exact(self.inputs + 1);
        let sum = |neuron: &[f64]| {
            let terms = neuron.iter().zip(input);
            terms.map(|(w, x)| w * x).sum::<f64>() + neuron[self.inputs]
        };
        neurons.map(sum).collect()
    }

    /// Adds the gradient of the loss by the weights, from that by the outputs; gives that by the
    /// inputs.
    fn backward(&mut self, input: &[f64], output: &[f64]) -> Vec<f64> {
        let row = self.inputs + 1;
        let mut back = vec![0.0; self.inputs];
        let neurons = self.weights.chunks_exact(row);
        let gradients = self.gradient.chunks_exact_mut(row);
        for ((weights, gradient), slope) in neurons.zip(gradients).zip(output) {
            for (i, x) in input.iter().enumerate() {
                gradient[i] += slope * x;
                back[i] += slope * weights[i];
            }
            gradient[self.inputs] += slope;
        }
        back
    }

    fn step(&mut self, rate: f64, step: i32) {
        let [first, second] = &mut self.moments;
        let sums = first.iter_mut().zip(second.iter_mut());
        for ((weight, gradient), (m, v)) in
            self.weights.iter_mut().zip(&mut self.gradient).zip(sums)
        {
            *m = 0.9 * *m + 0.1 * *gradient;
            *v = 0.999 * *v + 0.001 * *gradient * *gradient;
            let mean = *m / (1.0 - 0.9_f64.powi(step));
            let square = *v / (1.0 - 0.999_f64.powi(step));
            *weight -= rate * mean / (square.sqrt() + 1e-8);
            *gradient = 0.0;
        }
    }
}

impl Network {
    /// Trains on rows of scaled inputs and targets.
    pub(super) fn train(inputs: &[Vec<f64>], targets: &[Vec<f64>], seed: u64) -> Self {
        let width = |rows: &[Vec<f64>]| rows.first().map_or(0, Vec::len);
        let mut noise = Noise::seeded(seed);
        let mut network = Self {
            layers: [
                Layer::new(width(inputs), HIDDEN, &mut noise),
                Layer::new(HIDDEN, HIDDEN, &mut noise),
                Layer::new(HIDDEN, width(targets), &mut noise),
            ],
        };
        let mut order: Vec<usize> = (0..inputs.len()).collect();
        let mut step = 0;
        let [most, fewest] = EPOCHS;
        let epochs = (LEARNED / inputs.len().max(1)).clamp(fewest, most);
        for epoch in 0..epochs {
            let share = epoch as f64 / epochs as f64;
            let rate = RATES[0] * (RATES[1] / RATES[0]).powf(share);
            let mut keys: Vec<(f64, usize)> =
                order.iter().map(|row| (noise.normal(), *row)).collect();
            keys.sort_by(|a, b| a.0.total_cmp(&b.0));
            order = keys.into_iter().map(|(_, row)| row).collect();
            for batch in order.chunks(BATCH) {
                for row in batch {
                    network.learn(&inputs[*row], &targets[*row], batch.len());
                }
                step += 1;
                network
                    .layers
                    .iter_mut()
                    .for_each(|layer| layer.step(rate, step));
            }
        }
        network
    }

    fn learn(&mut self, input: &[f64], target: &[f64], batch: usize) {
        let [one, two, last] = &mut self.layers;
        let bent = |sums: Vec<f64>| -> Vec<f64> { sums.into_iter().map(f64::tanh).collect() };
        let first = bent(one.forward(input));
        let second = bent(two.forward(&first));
        let output = last.forward(&second);
        let errors = output.iter().zip(target);
        let slopes: Vec<f64> = errors.map(|(y, t)| (y - t) / batch as f64).collect();
        let straight = |back: Vec<f64>, bent: &[f64]| -> Vec<f64> {
            let pairs = back.iter().zip(bent);
            pairs.map(|(slope, t)| slope * (1.0 - t * t)).collect()
        };
        let slopes = straight(last.backward(&second, &slopes), &second);
        let slopes = straight(two.backward(&first, &slopes), &first);
        one.backward(input, &slopes);
    }

    /// The targets of a row of inputs.
    pub(super) fn estimate(&self, input: &[f64]) -> Vec<f64> {
        let [one, two, last] = &self.layers;
        let bent = |sums: Vec<f64>| -> Vec<f64> { sums.into_iter().map(f64::tanh).collect() };
        last.forward(&bent(two.forward(&bent(one.forward(input)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bent_surface_is_learned_and_the_seed_decides() {
        let input = |k: usize| {
            let part = |step: f64| 2.0 * (k as f64 * step % 1.0) - 1.0;
            vec![part(0.754_877_67), part(0.569_840_29)]
        };
        let target = |input: &[f64]| vec![input[0] * input[1], (2.0 * input[0]).sin()];
        let inputs: Vec<Vec<f64>> = (0..600).map(input).collect();
        let targets: Vec<Vec<f64>> = inputs.iter().map(|row| target(row)).collect();
        let [one, again] = [0, 1].map(|_| Network::train(&inputs, &targets, 3));
        for k in 700..720 {
            let at = input(k);
            let found = one.estimate(&at);
            assert_eq!(found, again.estimate(&at));
            for (found, truth) in found.iter().zip(target(&at)) {
                // The targets span 1 and 2.
                assert!((found - truth).abs() < 0.06, "{found} {truth}");
            }
        }
    }
}

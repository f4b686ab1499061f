//! Decisions in plain numbers: margins summed in f64, a softmax and thresholds. Nothing here is the chip's code, so that its
//! decisions can be compared with these.

/// A recognizer in plain numbers, without a test of strangers.
#[derive(Clone, Debug)]
pub struct Plain {
    /// Evidence for each output, in nats: first what is known before any step.
    pub evidence: Vec<f64>,
    /// The number of the object that each output belongs to.
    pub objects: Vec<usize>,
    /// Outputs that can be named; the others are a background.
    pub known: usize,
    /// For each output the largest sum of the weights of other objects, its own object's being 1, at which it is named.
    pub thresholds: Vec<f64>,
    /// Steps after which it gives up.
    pub most: u32,
    /// Steps so far.
    pub steps: u32,
    /// The first verdict, which stays.
    pub ended: Option<Ended>,
}

/// A verdict in plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// The output that is named; none after too many steps.
    pub named: Option<usize>,
    /// Steps that it took.
    pub steps: u32,
}

impl Plain {
    /// Adds the margins of a step, in nats. Evidence goes on after a verdict, which stays.
    pub fn push(&mut self, margins: &[f32]) {
        self.evidence.iter_mut().zip(margins).for_each(|(sum, margin)| *sum += f64::from(*margin));
        self.steps += 1;
        let leader = self.leader();
        let named = (self.rivals(leader, 1.0) <= self.thresholds[leader]).then_some(leader);
        let is_end = named.is_some() || self.steps >= self.most;
        self.ended = self.ended.or_else(|| is_end.then_some(Ended { named, steps: self.steps }));
    }

    /// The output with the most evidence of the object with the greatest weight, all of its outputs together; the first of
    /// several.
    pub fn leader(&self) -> usize {
        let greater =
            |best: usize, other: usize, of: &dyn Fn(usize) -> f64| if of(other) > of(best) { other } else { best };
        let object = (0..self.known).reduce(|best, other| greater(best, other, &|output| self.own(output, 1.0)));
        let object = self.objects[object.unwrap_or(0)];
        let outputs = (0..self.known).filter(|&output| self.objects[output] == object);
        outputs.reduce(|best, other| greater(best, other, &|output| self.evidence[output])).unwrap_or(0)
    }

    /// Sum of the weights of all objects but an output's, the weight of that one being 1. Evidence is divided by a temperature.
    pub fn rivals(&self, output: usize, temperature: f64) -> f64 {
        let others = (0..self.objects.len()).filter(|&other| self.objects[other] != self.objects[output]);
        others.map(|other| self.weight(other, temperature)).sum::<f64>() / self.own(output, temperature)
    }

    /// The weight of an output's object: that of all of its outputs.
    fn own(&self, output: usize, temperature: f64) -> f64 {
        let own = (0..self.objects.len()).filter(|&other| self.objects[other] == self.objects[output]);
        own.map(|other| self.weight(other, temperature)).sum()
    }

    /// The weight of an output, that with the most evidence having 1.
    fn weight(&self, output: usize, temperature: f64) -> f64 {
        let most = self.evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        ((self.evidence[output] - most) / temperature).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(objects: &[usize], thresholds: f64) -> Plain {
        Plain {
            evidence: vec![0.0; objects.len()],
            objects: objects.to_vec(),
            known: objects.len(),
            thresholds: vec![thresholds; objects.len()],
            most: 3,
            steps: 0,
            ended: None,
        }
    }

    #[test]
    fn an_object_is_named_where_a_softmax_passes_its_threshold_and_else_after_the_most_steps_none() {
        // One nat ahead of two others: weights of 2 / e, 2 / e² and so on.
        let mut sure = plain(&[0, 1, 2], 2.0 * (-2.0_f64).exp());
        sure.push(&[0.0, 1.0, 0.0]);
        assert_eq!((sure.ended, sure.leader()), (None, 1));
        assert!((sure.rivals(1, 1.0) - 2.0 * (-1.0_f64).exp()).abs() < 1e-12);
        assert!((sure.rivals(1, 2.0) - 2.0 * (-0.5_f64).exp()).abs() < 1e-12);
        sure.push(&[0.0, 1.000_001, 0.0]);
        sure.push(&[0.0; 3]);
        assert_eq!(sure.ended, Some(Ended { named: Some(1), steps: 2 }));
        let mut shy = plain(&[0, 1], 1e-9);
        (0..3).for_each(|_| shy.push(&[0.5, 0.0]));
        assert_eq!(shy.ended, Some(Ended { named: None, steps: 3 }));
    }

    #[test]
    fn outputs_of_an_object_add_up_and_the_strongest_of_them_is_named() {
        let mut together = plain(&[0, 1, 1], 0.9);
        together.push(&[1.0, 0.5, 0.625]);
        assert_eq!(together.ended, Some(Ended { named: Some(2), steps: 1 }));
        assert!((together.rivals(2, 1.0) - 1.0_f64.exp() / (0.5_f64.exp() + 0.625_f64.exp())).abs() < 1e-12);
        // A background is never named.
        let mut background = Plain { known: 2, ..plain(&[0, 1, 2], 0.5) };
        background.push(&[1.0, 0.0, 5.0]);
        assert_eq!((background.ended, background.leader()), (None, 0));
    }
}

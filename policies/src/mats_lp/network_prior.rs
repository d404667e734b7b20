//! Networks that were read from files, as priors.

use pogema_core::{Action, Error, Words};

use crate::encode::Channel;
use crate::mats_lp::prior::{Evaluate, Evaluation, Prior};
use crate::network::{ForwardError, Inputs, Network, RecurrentState, Workspace};

/// A [`Network`] whose input and output fit MATS-LP.
#[derive(Clone, Debug)]
pub struct NetworkPrior {
    network: Network,
    radius: usize,
}

impl NetworkPrior {
    /// Creates a prior from a network of two square windows with an odd side, no scalars, five logits and no recurrent
    /// layer.
    ///
    /// A network whose config names an encoder must read what MATS-LP writes: `all_agents` or `agents`, then
    /// `cost_tracer`. Without an encoder, the channels are not checked.
    ///
    /// # Errors
    /// [`Error::Argument`] that says how the network differs.
    pub fn new(network: Network) -> Result<Self, Error> {
        let [channels, height, width] = network.input_shape();
        let wrong = |name, value, expected| Err(Error::argument(name, value, expected));
        if channels != 2 || height != width || height % 2 == 0 {
            let shape = format!("{channels} x {height} x {width}");
            return wrong(
                "window of the network",
                shape,
                "2 windows with the same odd number of rows and columns",
            );
        }
        if network.num_actions() != Action::ALL.len() {
            return wrong("number of actions of the network", network.num_actions().to_string(), "5");
        }
        if network.num_scalars() > 0 {
            return wrong(
                "number of scalars of the network",
                network.num_scalars().to_string(),
                "0, as MATS-LP has none",
            );
        }
        if network.state_size() > 0 {
            let size = network.state_size().to_string();
            return wrong(
                "recurrent state of the network",
                size,
                "0, as MATS-LP evaluates states in any order",
            );
        }
        if let Some(encoder) = &network.config().encoder {
            let is_known =
                matches!(encoder.channels[..], [Channel::AllAgents | Channel::Agents, Channel::CostTracer]);
            if !is_known || encoder.radius != height / 2 {
                let names: Vec<&str> = encoder.channels.iter().map(|channel| channel.word()).collect();
                let found = format!("{} with radius {}", names.join(", "), encoder.radius);
                let expected = format!("all_agents or agents, then cost_tracer, with radius {}", height / 2);
                return Err(Error::argument("encoder of the network", found, expected));
            }
        }
        Ok(Self { network, radius: height / 2 })
    }
}

impl Prior for NetworkPrior {
    fn radius(&self) -> usize {
        self.radius
    }

    fn has_critic(&self) -> bool {
        self.network.has_value()
    }

    fn evaluator(&self) -> Box<dyn Evaluate> {
        let state = RecurrentState::new(&self.network, 0);
        Box::new(NetworkEvaluator {
            workspace: self.network.workspace(),
            network: self.network.clone(),
            state,
        })
    }
}

struct NetworkEvaluator {
    network: Network,
    workspace: Workspace,
    /// Empty, because the network has no recurrent layer.
    state: RecurrentState,
}

impl Evaluate for NetworkEvaluator {
    fn evaluate(&mut self, inputs: &[f32], out: &mut [Evaluation]) -> Result<(), Error> {
        match self.forward(inputs, out) {
            // Evaluates the inputs one by one to find every input whose outputs are not finite.
            Err(ForwardError::NotFinite { .. }) if out.len() > 1 => {
                for (input, out) in inputs.chunks_exact(inputs.len() / out.len()).zip(out.chunks_exact_mut(1))
                {
                    self.evaluate(input, out)?;
                }
                Ok(())
            }
            Err(ForwardError::NotFinite { .. }) => {
                out.fill(Evaluation { logits: [f32::NAN; Action::ALL.len()], value: f32::NAN });
                Ok(())
            }
            Err(ForwardError::Length(error)) => Err(error),
            Err(ForwardError::Runtime(reason)) => Err(Error::Request { reason }),
            Ok(()) => Ok(()),
        }
    }
}

impl NetworkEvaluator {
    fn forward(&mut self, windows: &[f32], out: &mut [Evaluation]) -> Result<(), ForwardError> {
        let inputs = Inputs { windows, scalars: &[], batch: out.len() };
        let outputs = self.network.forward(inputs, &mut self.state, &mut self.workspace)?;
        let values = outputs.values.iter().copied().chain(std::iter::repeat(0.0));
        for ((out, logits), value) in
            out.iter_mut().zip(outputs.logits.chunks_exact(Action::ALL.len())).zip(values)
        {
            out.logits.copy_from_slice(logits);
            out.value = value;
        }
        Ok(())
    }
}

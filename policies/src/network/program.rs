//! The program of a network: its layers, or a graph that a runtime runs.

use pogema_core::SimdPath;

use super::agents::AgentBuffers;
use super::architecture::Architecture;
use super::build;
use super::steps::{Buffers, Chunk, Heads, LayerSteps, MAX_AGENTS_ONE_BY_ONE};
use super::tensors::Tensors;
#[cfg(feature = "onnx")]
use crate::onnx::Runtime;
use crate::simd::{AGENTS, HALF};

/// The layers of a network, packed for a SIMD path.
#[derive(Debug)]
pub struct Layers {
    pub steps: LayerSteps,
    pub heads: Heads,
    path: SimdPath,
}

impl Layers {
    pub fn new(architecture: &Architecture, tensors: &mut Tensors, path: SimdPath) -> Result<Self, String> {
        let (steps, heads) = build::build(architecture, tensors)?;
        Ok(Self { steps, heads, path })
    }

    /// Appends the logits and values of up to 16 agents.
    fn run(&self, chunk: Chunk<'_>, states: &mut [f32], workspace: &mut Workspace) {
        let Self { steps, heads, path } = self;
        let Workspace { buffers, logits, values } = workspace;
        let Some(LayerBuffers { apart, half, agents, heads: outputs }) = buffers else {
            unreachable!("the workspace belongs to another network")
        };
        let num_outputs = heads.dense.num_outputs;
        if chunk.num_agents > steps.max_agents_one_by_one() {
            let agents = if chunk.num_agents > HALF { agents } else { half };
            steps.run_agents(*path, chunk, heads, states, agents);
            for agent in 0..chunk.num_agents {
                logits.extend((0..heads.num_actions).map(|output| agents.output(agent, output)));
                values.extend((heads.num_actions..num_outputs).map(|output| agents.output(agent, output)));
            }
            return;
        }
        steps.run(*path, chunk, states, apart);
        let rows = steps.rows(heads.input, &apart.flats);
        heads.dense.run(*path, chunk.num_agents, rows, false, outputs);
        for row in outputs.chunks_exact(heads.dense.stride()).take(chunk.num_agents) {
            logits.extend(&row[..heads.num_actions]);
            values.extend(&row[heads.num_actions..num_outputs]);
        }
    }
}

/// The program of a network.
#[derive(Debug)]
pub enum Program {
    Layers(Box<Layers>),
    #[cfg(feature = "onnx")]
    Runtime(Box<Runtime>),
}

impl Program {
    #[cfg_attr(
        not(feature = "onnx"),
        allow(clippy::unnecessary_wraps, reason = "only a runtime has no SIMD path")
    )]
    pub fn simd_path(&self) -> Option<SimdPath> {
        match self {
            Self::Layers(layers) => Some(layers.path),
            #[cfg(feature = "onnx")]
            Self::Runtime(_) => None,
        }
    }

    pub fn num_scalars(&self) -> usize {
        match self {
            Self::Layers(layers) => layers.steps.num_scalars,
            #[cfg(feature = "onnx")]
            Self::Runtime(_) => 0,
        }
    }

    pub fn state_size(&self) -> usize {
        match self {
            Self::Layers(layers) => layers.steps.state_size,
            #[cfg(feature = "onnx")]
            Self::Runtime(_) => 0,
        }
    }

    pub fn num_actions(&self) -> usize {
        match self {
            Self::Layers(layers) => layers.heads.num_actions,
            #[cfg(feature = "onnx")]
            Self::Runtime(runtime) => runtime.num_actions,
        }
    }

    pub fn has_value(&self) -> bool {
        match self {
            Self::Layers(layers) => layers.heads.dense.num_outputs > layers.heads.num_actions,
            #[cfg(feature = "onnx")]
            Self::Runtime(_) => false,
        }
    }

    pub fn workspace(&self) -> Workspace {
        let buffers = match self {
            Self::Layers(layers) => Some(LayerBuffers {
                apart: Buffers::new(&layers.steps),
                half: AgentBuffers::new(&layers.steps, &layers.heads, HALF),
                agents: AgentBuffers::new(&layers.steps, &layers.heads, AGENTS),
                heads: vec![0.0; MAX_AGENTS_ONE_BY_ONE * layers.heads.dense.stride()],
            }),
            #[cfg(feature = "onnx")]
            Self::Runtime(_) => None,
        };
        Workspace { buffers, logits: Vec::new(), values: Vec::new() }
    }

    /// Appends the outputs of up to 16 agents. Only a [`Runtime`] can fail. Errors are messages that do not name the
    /// file.
    #[cfg_attr(not(feature = "onnx"), allow(clippy::unnecessary_wraps, reason = "layers cannot fail"))]
    pub fn run(&self, chunk: Chunk<'_>, states: &mut [f32], workspace: &mut Workspace) -> Result<(), String> {
        match self {
            Self::Layers(layers) => {
                layers.run(chunk, states, workspace);
                Ok(())
            }
            #[cfg(feature = "onnx")]
            Self::Runtime(runtime) => chunk
                .windows
                .chunks_exact(chunk.windows.len() / chunk.num_agents)
                .try_for_each(|window| runtime.run(window, &mut workspace.logits)),
        }
    }
}

/// The buffers of a thread that runs a network.
///
/// The size of the buffers does not depend on the batch, except for the lists of outputs, which grow with the largest
/// batch.
#[derive(Clone, Debug)]
pub struct Workspace {
    buffers: Option<LayerBuffers>,
    pub(super) logits: Vec<f32>,
    pub(super) values: Vec<f32>,
}

/// The buffers of layers: for agents one after the other, for 8 and for 16 side by side, and for the heads.
#[derive(Clone, Debug)]
struct LayerBuffers {
    apart: Buffers,
    half: AgentBuffers,
    agents: AgentBuffers,
    heads: Vec<f32>,
}

//! The weights that this crate contains, which `pogema_rs.baselines` trained.

/// The weights of a policy, and the JSON that describes its network.
#[derive(Clone, Copy, Debug)]
pub struct ShippedWeights {
    /// The JSON, see [`NetworkConfig`](crate::NetworkConfig).
    pub config: &'static [u8],
    /// A `.safetensors` file.
    pub tensors: &'static [u8],
}

/// Includes the weights of a folder below `weights/`.
macro_rules! shipped {
    ($folder:literal) => {
        ShippedWeights {
            config: include_bytes!(concat!("../../weights/", $folder, "/weights.json")),
            tensors: include_bytes!(concat!("../../weights/", $folder, "/weights.safetensors")),
        }
    };
}

/// EPOM, see `weights/epom/run.json`.
pub const EPOM: ShippedWeights = shipped!("epom");
/// Follower, see `weights/follower/run.json`.
pub const FOLLOWER: ShippedWeights = shipped!("follower");
/// Follower with a larger network, see `weights/follower-large/run.json`.
pub const FOLLOWER_LARGE: ShippedWeights = shipped!("follower-large");
/// Follower with a small network, see `weights/follower-small/run.json`.
pub const FOLLOWER_SMALL: ShippedWeights = shipped!("follower-small");
/// IPPO, see `weights/ippo/run.json`.
pub const IPPO: ShippedWeights = shipped!("ippo");
/// IQL, see `weights/iql/run.json`.
pub const IQL: ShippedWeights = shipped!("iql");
/// The network of LSwitcher, see `weights/lswitcher/run.json`. LSwitcher also uses [`EPOM`].
pub const LSWITCHER: ShippedWeights = shipped!("lswitcher");
/// MAPPO, see `weights/mappo/run.json`.
pub const MAPPO: ShippedWeights = shipped!("mappo");
/// QMIX, see `weights/qmix/run.json`.
pub const QMIX: ShippedWeights = shipped!("qmix");
/// QPLEX, see `weights/qplex/run.json`.
pub const QPLEX: ShippedWeights = shipped!("qplex");
/// VDN, see `weights/vdn/run.json`.
pub const VDN: ShippedWeights = shipped!("vdn");

"""Tests that environments on several devices play the same episodes as on one."""

import os
import subprocess
import sys

NUM_ENVS, NUM_STEPS, NUM_DEVICES = 8, 40, 2

PROGRAM = f"""
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from pogema_rs.jax import InstancePool, auto_reset, observe, reset

assert jax.device_count() == {NUM_DEVICES}
config = {{"num_agents": 6, "size": 8, "collision_system": "soft", "on_target": "restart", "max_episode_steps": 16}}
params = InstancePool(config, 50).params
actions = np.random.default_rng(0).integers(0, 5, ({NUM_STEPS}, {NUM_ENVS}, 6))
keys = jax.random.split(jax.random.key(0), ({NUM_STEPS}, {NUM_ENVS}))


def play(params, instances, actions, keys):
    def advance(states, given):
        states, out, _ = jax.vmap(auto_reset, (None, 0, 0, 0))(params, given[1], states, given[0])
        return states, (out, jax.vmap(observe, (None, 0))(params, states))

    return jax.lax.scan(advance, jax.vmap(reset, (None, 0))(params, instances), (actions, keys))


def compare(found, wanted):
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(wanted), strict=True):
        np.testing.assert_array_equal(one, other)


instances = jnp.arange({NUM_ENVS})
expected = jax.jit(play)(params, instances, actions, keys)
assert expected[1][0].ended.sum() > {NUM_ENVS}
assert "callback" not in jax.jit(play).lower(params, instances, actions, keys).as_text()

mesh = Mesh(jax.devices(), "envs")
whole, each, later = PartitionSpec(), PartitionSpec("envs"), PartitionSpec(None, "envs")
everywhere = jax.device_put(params, NamedSharding(mesh, whole))
parts = jax.device_put((instances, actions, keys), tuple(NamedSharding(mesh, axis) for axis in (each, later, later)))
specs = {{"in_specs": (whole, each, later, later), "out_specs": (each, later)}}
split = jax.shard_map(play, mesh=mesh, check_vma=False, **specs)
for function in (jax.jit(play), jax.jit(split)):
    found = function(everywhere, *parts)
    compare(found, expected)
    for shard in found[1][1].addressable_shards:
        assert shard.data.shape[1] == {NUM_ENVS // NUM_DEVICES}


def halves(array, axis):
    return jnp.stack(jnp.split(array, {NUM_DEVICES}, axis))


mapped = jax.pmap(play, in_axes=(None, 0, 0, 0))(params, halves(instances, 0), halves(actions, 1), halves(keys, 1))
compare(jax.tree.map(lambda leaf: jnp.concatenate(list(leaf), 0), mapped[0]), expected[0])
compare(jax.tree.map(lambda leaf: jnp.concatenate(list(leaf), 1), mapped[1]), expected[1])
"""


def test_sharded_and_mapped_environments_play_the_same_episodes():
    flags = f"--xla_force_host_platform_device_count={NUM_DEVICES}"
    environ = {**os.environ, "JAX_PLATFORMS": "cpu", "XLA_FLAGS": flags}
    run = subprocess.run(
        [sys.executable, "-B", "-c", PROGRAM], env=environ, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr

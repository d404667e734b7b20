"""Writes maps to files, and draws seeds."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Iterable, Mapping
from typing import Optional, Union

from pogema_rs._checks import check_whole
from pogema_rs._optional import import_optional

__all__ = ["drawn_seed", "generate_and_save", "maps_dict_to_yaml"]


def maps_dict_to_yaml(filename: Union[str, os.PathLike[str]], maps: Mapping[str, str]) -> None:
    """Writes maps to a YAML file, each as a block of lines below its name, sorted by name.

    Source: pogema-toolbox 0.1.1, `generator_utils.py`, `maps_dict_to_yaml`
    """
    yaml = import_optional("yaml", "`maps_dict_to_yaml`")

    class Blocks(yaml.Dumper):  # type: ignore[name-defined]
        """Writes every text as a block."""

    Blocks.add_representer(str, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|"))
    with open(filename, "w", encoding="utf-8") as file:
        yaml.dump(dict(maps), file, Dumper=Blocks)


def generate_and_save(name_prefix: str, seed_range: Iterable[int], generate: Callable[[int], str]) -> None:
    """Writes a map for each seed to `<name_prefix>.yaml`; zeros pad the seeds in the map names to equal length.

    Errors: `ValueError` if there is no seed.
    """
    seeds = list(seed_range)
    if not seeds:
        raise ValueError("`seed_range` is empty, expected at least one seed")
    num_digits = len(str(max(seeds)))
    maps = {f"{name_prefix}-seed-{str(seed).zfill(num_digits)}": generate(seed) for seed in seeds}
    maps_dict_to_yaml(f"{name_prefix}.yaml", maps)


def drawn_seed(seed: Optional[int]) -> int:
    """Returns the given seed, or a random one if it is `None`.

    Errors: `TypeError` if it is not a whole number, `ValueError` if it is negative or has more than 64 bits.
    """
    return secrets.randbits(64) if seed is None else check_whole("seed", seed, 0, 2**64 - 1)

"""Threads that share the work of a network: each computes the features of some agents."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Optional, TypeVar

import torch

#: The smallest number of windows that are worth a thread.
WINDOWS_PER_SHARE = 64

Result = TypeVar("Result")
#: Returns the features and the recurrent state of a share of the agents, from their inputs.
OfShare = Callable[..., tuple[torch.Tensor, Optional[torch.Tensor]]]


class Workers:
    """A number of threads, the calling one included. PyTorch itself uses one thread in each.

    PyTorch's own threads share the work of single operations, which gains less on networks of this size.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._pool: Optional[ThreadPoolExecutor] = None

    def __enter__(self) -> Workers:
        if self.threads > 1:
            self._pool = ThreadPoolExecutor(self.threads - 1, "worker", torch.set_num_threads, (1,))
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def __deepcopy__(self, memo: dict[int, Any]) -> Workers:
        """Returns the same workers: copies of a network share them."""
        return self

    def map(self, function: Callable[..., Result], arguments: Sequence[tuple[Any, ...]]) -> list[Result]:
        """Returns the results of the function for each tuple of arguments; the first runs in the calling thread."""
        if self._pool is None:
            return list(itertools.starmap(function, arguments))
        others = [self._pool.submit(function, *some) for some in arguments[1:]]
        first = [function(*some) for some in arguments[:1]]
        return first + [other.result() for other in others]

    def features(
        self,
        of_share: OfShare,
        parameters: Sequence[torch.nn.Parameter],
        windows: torch.Tensor,
        scalars: torch.Tensor,
        state: Optional[torch.Tensor],
    ) -> tuple[torch.Tensor, Optional[torch.Tensor]]:
        """Returns what `of_share` returns for all agents; each thread computes it for a share of them.

        Gradients reach the parameters, but not the inputs. The gradients are added in a fixed order, so the same number
        of threads gives the same sum.

        Shape: `windows` `(steps, rows, ...)`, `scalars` `(steps, rows, scalars)`, `state` `(layers, rows, width)`
        """
        steps, rows = windows.shape[:2]
        count = max(1, min(self.threads, rows, steps * rows // WINDOWS_PER_SHARE))
        if count == 1:
            return of_share(windows, scalars, state)
        states = [None] * count if state is None else state.tensor_split(count, dim=1)
        shares = list(zip(windows.tensor_split(count, dim=1), scalars.tensor_split(count, dim=1), states))
        later: list[Optional[torch.Tensor]] = []
        if torch.is_grad_enabled():
            values: torch.Tensor = _Shared.apply(self, of_share, shares, later, *parameters)  # type: ignore[no-untyped-call, unused-ignore]
        else:
            parts = self.map(torch.no_grad()(of_share), shares)
            values = torch.cat([part for part, _ in parts], dim=1)
            later += [part for _, part in parts]
        kept = [part for part in later if part is not None]
        return values, torch.cat(kept, dim=1) if kept else None


class _Shared(torch.autograd.Function):
    """Features whose graph has one part for each thread."""

    @staticmethod
    def forward(  # type: ignore[override, unused-ignore]
        ctx: Any,
        workers: Workers,
        of_share: OfShare,
        shares: list[tuple[Any, ...]],
        later: list[Optional[torch.Tensor]],
        *parameters: torch.nn.Parameter,
    ) -> torch.Tensor:
        parts = workers.map(torch.enable_grad()(of_share), shares)
        ctx.workers, ctx.parameters, ctx.parts = workers, parameters, [values for values, _ in parts]
        later += [None if state is None else state.detach() for _, state in parts]
        return torch.cat([part.detach() for part in ctx.parts], dim=1)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[Any, ...]:  # type: ignore[override, unused-ignore]
        split = gradients[0].tensor_split(len(ctx.parts), dim=1)
        pairs = list(zip(ctx.parts, split))
        found = ctx.workers.map(lambda part, slope: torch.autograd.grad(part, ctx.parameters, slope), pairs)
        return None, None, None, None, *(sum(some[1:], some[0]) for some in zip(*found))
